# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# The logs of many robots, commissioned on the workers of Dask; one table of what came of it.
#
#     python3 fleet_dask.py [LIST.csv ROBOT.yaml] [--scheduler ADDRESS] [--out TABLE.csv]
#
# LIST.csv has the header robot,log (paths relative to the list). Without arguments: six simulated robots, one of whose
# logs is broken. ADDRESS is that of a running Dask scheduler, whose workers see the files and have the module
# wheelwright; without it the work is done in processes of this machine.
#
# `wheelwright fleet` examines fleets without any of this (threads, MPI, Slurm), goes on where it was killed, and judges
# who stands outside or drifts. This is for those whose data and machines are in Dask already.

# %%
import argparse
import csv
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import wheelwright as ww

try:
    import dask
    import dask.bag
except ModuleNotFoundError:
    print("This example works with Dask, which is not installed "
          "(Debian: apt install python3-dask python3-distributed).")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
COLUMNS = ["robot", "status", "parameter", "unit", "estimate", "lower", "upper", "message"]


# %% [markdown]
# One robot. What a log throws becomes a row of the table: one bad log never stops the rest. Results are plain numbers
# and text, which is what travels between workers.
# %%
def commission_one(robot: str, log: str, robot_file: str) -> list[dict[str, Any]]:
    nothing = dict.fromkeys(COLUMNS[2:-1])
    try:
        declared = ww.read_robot(robot_file)
        result = ww.commission(ww.read_log(log, declared), declared)
    except ww.Error as error:
        return [{"robot": robot, "status": "failed", **nothing, "message": str(error)}]
    if result.status in ("empty", "nothing"):
        return [{"robot": robot, "status": result.status, **nothing, "message": result.message}]
    return [
        {
            "robot": robot,
            "status": result.status,
            "parameter": parameter.name,
            "unit": parameter.unit,
            "estimate": parameter.estimate,
            "lower": parameter.lower,
            "upper": parameter.upper,
            "message": result.message,
        }
        for parameter in result.parameters
    ]


# %% [markdown]
# Six robots whose masses and frictions differ by a few per cent, and a sixth log that is cut off in its header.
# %%
def simulate_fleet(directory: Path) -> tuple[Path, Path]:
    robot_file = HERE / "robot.yaml"
    scatter = np.random.default_rng(1)
    rows = ["robot,log"]
    for k in range(6):
        drive = ww.simulate(
            {
                "robot": str(robot_file),
                "parameters": {
                    "mass": 21.0 * float(np.exp(0.05 * scatter.standard_normal())),
                    "yaw_inertia": 0.9 * float(np.exp(0.05 * scatter.standard_normal())),
                    "viscous_linear": 4.0 * float(np.exp(0.05 * scatter.standard_normal())),
                    "viscous_yaw": 0.5,
                },
                "trajectory": {"kind": "commissioning", "speed": 0.6, "yaw_rate": 1.2, "period": 12},
                "duration": 60,
                "rate": 100,
                "sensors": {"wheel_speed": 0.02, "effort": 0.02, "encoder_counts_per_turn": 4096},
            },
            seed=k + 1,
        )
        drive.save(directory / f"robot_{k + 1}.csv")
        rows.append(f"robot_{k + 1},robot_{k + 1}.csv")
    (directory / "robot_6.csv").write_text("t,omega_r,ome")
    (directory / "fleet.csv").write_text("\n".join(rows) + "\n")
    return directory / "fleet.csv", robot_file


# %% [markdown]
# A partition for each robot: Dask hands them out to whichever worker is free, in processes, so that a worker that dies
# takes one robot along, which a scheduler's workers do again.
# %%
def commission_all(fleet: list[dict[str, str]], directory: Path, robot_file: Path) -> list[dict[str, Any]]:
    robots = dask.bag.from_sequence(
        [(row["robot"], str(directory / row["log"]), str(robot_file)) for row in fleet], partition_size=1
    )
    table: list[dict[str, Any]] = robots.starmap(commission_one).flatten().compute()
    return table


# %% [markdown]
# The spread of each parameter over the robots that showed it: robust, since one strange robot must not hide itself.
# %%
def tell_spread(table: list[dict[str, Any]]) -> None:
    for name in dict.fromkeys(row["parameter"] for row in table if row["parameter"]):
        rows = [row for row in table if row["parameter"] == name and row["estimate"] is not None]
        if not rows:
            print(f"  {name:14} shown by no robot")
            continue
        estimates = np.array([row["estimate"] for row in rows])
        median = np.median(estimates)
        spread = 1.4826 * np.median(np.abs(estimates - median))  # of a normal population: its standard deviation
        widths = np.median([row["upper"] - row["lower"] for row in rows])
        print(
            f"  {name:14} {len(rows):4} robots: median {median:9.4g}, spread {spread:9.3g}, "
            f"from {estimates.min():9.4g} to "
            f"{estimates.max():9.4g} {rows[0]['unit']}; one robot's bounds are {widths:.3g} wide"
        )


# %%
def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("list", nargs="?", type=Path)
    parser.add_argument("robot", nargs="?", type=Path)
    parser.add_argument("--scheduler")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    if (arguments.list is None) != (arguments.robot is None):
        parser.error("expected LIST.csv and ROBOT.yaml, or neither")
    if arguments.scheduler:
        from dask.distributed import Client

        client = Client(arguments.scheduler)  # from here on the one that compute() asks
        print(client)
    else:
        dask.config.set(scheduler="processes")
    with tempfile.TemporaryDirectory() as scratch:
        given = arguments.list is not None
        listed, robot = (arguments.list, arguments.robot) if given else simulate_fleet(Path(scratch))
        with open(listed, newline="", encoding="utf-8") as file:
            fleet = list(csv.DictReader(file))
        table = commission_all(fleet, listed.resolve().parent, robot.resolve())

    failed = [row for row in table if row["parameter"] is None]
    print(f"{len(fleet)} robots, {len(fleet) - len(failed)} commissioned")
    tell_spread(table)
    for row in failed:
        print(f"  {row['robot']}: {row['status']}: {row['message']}")
    if arguments.out is not None:
        with open(arguments.out, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(table)
        print("wrote", arguments.out)
    if given:
        return 1 if failed else 0
    # The sixth log is broken, and the other five are not.
    return 0 if [row["robot"] for row in failed] == ["robot_6"] else 1


if __name__ == "__main__":
    sys.exit(main())
