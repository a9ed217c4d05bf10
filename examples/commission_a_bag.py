# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# From a recorded drive to thresholds, and a look at another drive with them.
#
#     python3 commission_a_bag.py [LOG [ROBOT.yaml [ANOTHER_LOG]]] [--out PICTURE.png]
#
# LOG is a rosbag2 recording (a directory, .mcap or .db3), HDF5 or CSV. Without arguments: the log and robot that ship
# with the project, and a simulated drive on which a tyre loses radius half-way. The cells (# %%) run one by one in
# editors that know them.

# %%
import argparse
import sys
from pathlib import Path

import numpy as np
import wheelwright as ww

try:
    import matplotlib.pyplot as plt
except ModuleNotFoundError:
    print("This example draws with matplotlib, which is not installed (Debian: apt install python3-matplotlib).")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
parser = argparse.ArgumentParser()
parser.add_argument("log", nargs="?", default=HERE / "healthy.csv.gz", type=Path)
parser.add_argument("robot", nargs="?", default=HERE / "robot.yaml", type=Path)
parser.add_argument("another", nargs="?", type=Path)
parser.add_argument("--out", type=Path)
arguments = parser.parse_args()


# %% [markdown]
# The robot, and a log of fault-free driving. What was repaired while reading is told, never hidden.
# %%
robot = ww.read_robot(arguments.robot)
log = ww.read_log(arguments.log, robot)
print(log)
for note in log.notes:
    print("  ", note)

# %% [markdown]
# Best-guess parameters, bounds (guaranteed or extrapolated), thresholds, and a trial on driving that was held out.


# %%
def tell(share: float, text: str) -> None:
    print(f"\r{share:4.0%} {text:<50}", end="", file=sys.stderr)


result = ww.commission(log, robot, progress=tell if sys.stderr.isatty() else None)
print(result.summary)
for parameter in result.parameters:
    print(f"  {parameter.name:12} {parameter.lower:10.4g} .. {parameter.upper:10.4g} {parameter.unit}")

# %% [markdown]
# The same model looks at another drive: every residual with its threshold, as arrays.
# %%
if arguments.another is not None:
    another = ww.read_log(arguments.another, robot)
else:
    another = ww.simulate(HERE / "scenarios" / "fault.yaml")
run = ww.Detector(result.model).run(another)
for event in run.events[:5]:
    print(f"  {event.output}: outside since t = {event.start:.3f} s, {event.peak_ratio:.2g} times the threshold")

# %% [markdown]
# Pictures: residuals inside [l, u], and the feasible set as two of its parameters see it.
# %%
figure, axes = plt.subplots(len(run.outputs) + 1, 1, figsize=(9.0, 9.0), layout="constrained")
for i, (output, unit) in enumerate(zip(run.outputs, result.model.output_units)):
    axes[i].fill_between(run.t, run.lower[:, i], run.upper[:, i], color="0.85", label="threshold")
    axes[i].plot(run.t, run.residual[:, i], linewidth=0.7, label="residual")
    axes[i].plot(run.t[run.outside[:, i]], run.residual[run.outside[:, i], i], "r.", markersize=3, label="outside")
    axes[i].set(ylabel=f"{output}, {unit}", xlabel="t, s")
    axes[i].legend(loc="upper left")
theta, i, j = result.estimate, 0, min(2, len(result.parameters) - 1)
vertices = result.feasible_set.vertices
if vertices is not None:
    flat = vertices[:, [i, j]]
    angles = np.linspace(0.0, 2.0 * np.pi, 720)
    directions = np.column_stack([np.cos(angles), np.sin(angles)]) / np.ptp(flat, axis=0)
    outline = flat[np.argmax(flat @ directions.T, axis=0)]
    axes[-1].fill(outline[:, 0], outline[:, 1], color="0.85", label="all theta that the log allows")
axes[-1].plot(theta[i], theta[j], "bx", label="best guess")
one, other = result.parameters[i], result.parameters[j]
axes[-1].set(xlabel=f"{one.name}, {one.unit}", ylabel=f"{other.name}, {other.unit}")
axes[-1].legend()
if arguments.out is not None:
    figure.savefig(arguments.out)
    print("wrote", arguments.out)
else:
    plt.show()
