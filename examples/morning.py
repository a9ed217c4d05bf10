# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# A morning with a robot: is the log fit, what is the robot, is the model proved, what would it see, what does it see,
# why is the robot no longer itself, which drive would tell more, and the detector for its controller.
#
#     python3 morning.py PICTURES [LOG [ROBOT.yaml [TODAY]]]
#
# PICTURES is the directory for pictures and results. Without logs: the log and robot that ship with the project, and a
# simulated drive on which a tyre loses radius. The cells (# %%) run one by one in editors that know them.

# %%
import argparse
import sys
from pathlib import Path

import wheelwright as ww

try:
    import matplotlib.pyplot as plt
except ModuleNotFoundError:
    print("This example draws with matplotlib, which is not installed (Debian: apt install python3-matplotlib).")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
parser = argparse.ArgumentParser()
parser.add_argument("pictures", type=Path)
parser.add_argument("log", nargs="?", default=HERE / "healthy.csv.gz", type=Path)
parser.add_argument("robot", nargs="?", default=HERE / "robot.yaml", type=Path)
parser.add_argument("today", nargs="?", type=Path)
arguments = parser.parse_args()
arguments.pictures.mkdir(parents=True, exist_ok=True)


def keep(name: str) -> None:
    """Saves the figure of the cell."""
    plt.savefig(arguments.pictures / f"{name}.png")
    plt.close()


# %% [markdown]
# Is the log fit to be commissioned with?
# %%
robot = ww.read_robot(arguments.robot)
log = ww.read_log(arguments.log, robot)
health = ww.doctor(log, robot)
print(health.summary)
if not health.fit:
    sys.exit(1)

# %% [markdown]
# Parameters with bounds, and thresholds from them; then the proofs of all bounds again, in exact arithmetic.
# %%
result = ww.commission(log, robot)
print(result.summary)
ww.plot.parameters(result)
keep("parameters")
ww.plot.feasible_set(result, 0, 2)
keep("feasible_set")

# %%
proof = ww.check(result, log)
print(proof.message)
if not proof.proved:
    sys.exit(1)
result.save(arguments.pictures / "model.json")
model = ww.read_model(arguments.pictures / "model.json")

# %% [markdown]
# What would its detector be certain to see, from what size on, and during which manoeuvre?
# %%
faults = ["wheel_radius", "wheel_radius_left", "payload_lost"]
seen = ww.margins(log, model, faults=faults, windows=[0.5, 1.0], onset_step=2.0)
print("\n".join(seen.sentences))
ww.plot.margins(seen)
keep("margins")

# %% [markdown]
# Another drive: a tyre loses radius on the way.
# %%
if arguments.today is not None:
    today = ww.read_log(arguments.today, robot)
else:
    today = ww.simulate(HERE / "scenarios" / "fault.yaml")
found = ww.detect(today, model)
print(found.summary)
run = ww.Detector(model).run(today)
figure, axes = plt.subplots(2, len(run.outputs), figsize=(12.0, 7.0), squeeze=False, layout="constrained")
for i in range(len(run.outputs)):
    ww.plot.residuals(run, i, ax=axes[0, i])
    ww.plot.efforts(run, i, ax=axes[1, i])
keep("detection")

# %% [markdown]
# And a third one, which the robot seems to go slowly: what does the model lack? Without logs it is simulated with dry
# friction.
# %%
truth = {"mass": 21.0, "yaw_inertia": 0.9, "viscous_linear": 4.0, "viscous_yaw": 0.5}
slow = today if arguments.today is not None else ww.simulate({
    "robot": {**robot.to_dict(), "effects": [{"effect": "coulomb", "c": 0.3}]}, "parameters": truth, "duration": 60,
    "trajectory": {"kind": "multi_sine", "speed": 0.6, "yaw_rate": 1.2, "period": 9}, "rate": 100, "seed": 4,
    "sensors": {"noise": "uniform", "wheel_speed": 0.02, "effort": 0.02, "encoder_counts_per_turn": 4096}})
diagnosis = ww.gap(slow, robot, baseline=log, shrink=False, manoeuvre=False)
print(diagnosis.summary)
figure, axes = plt.subplots(len(diagnosis.series), 1, squeeze=False, layout="constrained")
for i in range(len(diagnosis.series)):
    ww.plot.gap(diagnosis, i, ax=axes[i, 0])
keep("gap")

# %% [markdown]
# A drive for narrower bounds within the limits of a small room, and one that tells two suspects apart.
# %%
plan = ww.design(model, "bounds", speed=8.0, acceleration=20.0, radius=1.5, duration=8.0, stages=2)
print(plan.summary)
suspects = ww.design(model, "discrimination", between=["coulomb", "caster_drag"], speed=8.0, acceleration=20.0,
                     radius=1.5,
                     duration=8.0, stages=2)
print(suspects.summary)

# %% [markdown]
# The detector for the robot's controller: one C99 header.
# %%
header = arguments.pictures / "wheelwright.h"
header.write_text(ww.export(model), encoding="utf-8")
print("wrote", header, "and", ", ".join(sorted(p.name for p in arguments.pictures.glob("*.png"))))
