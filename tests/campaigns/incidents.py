#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One fault in a random robot's log, and the incidents that `wheelwright detect` makes of it.

    tests/campaigns/incidents.py [--program build/bin/wheelwright] [--kinds KIND ...] [--lost 0 0.01] [--robots 8]
                                 [--seed 1] [--keep DIR]

ordinary_world.py makes the robots; nothing is shared with model/sim. A robot drives for 120 s: its model is learnt from
the first 50 s of a healthy drive, and the log that is watched is the last 75 s, with the fault from 60 s on (a step that
stays) or, for kinds that end in _before, in all of them. Half of the rows that are lost are
lost one by one, half in stretches of ten, at which a log is split. By kind and share the table (Markdown) counts

    alarmed       logs with an incident
    incidents     how many, the median and the 95th percentile over those
    excluded      logs with an incident that lacks the true kind, or has it with another size or onset, or is said to be
                  none of one fault that stays
    first         logs whose first candidate is the true kind; wrong wheel: the same of the other wheel
    left          candidates that are left, median
    other         logs that are said to have other constant parameters: right for kinds that end in _before only

and ends with 1 where there is one excluded, with 77 without numpy.
"""

import argparse
import dataclasses
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("no numpy")
    sys.exit(77)

import ordinary_kinds as kinds
import ordinary_world as world

LEARNT, WATCHED, ONSET = 50.0, 45.0, 60.0  # s: end of the one log, beginning of the other, the fault
STRETCH = 10  # rows


def scaled(stem, side, size):
    """A reading of one wheel that is off by a factor from the onset on; its error stays as it is."""
    def change(log, late):
        name = f"{stem}_{side}"
        true = log.true[name][log.rows]
        base = true[int(np.argmax(late)) - 1] if stem == "phi" else 0.0
        log.columns[name][late] += (size - 1) * (true[late] - base)
    return change


def biased(side, share):
    """An effort's reading that is too large by a share of its root mean square from the onset on."""
    def change(log, late):
        values = log.columns[f"tau_{side}"]
        log.size = share * float(np.sqrt(np.mean(values**2)))
        values[late] += log.size
    return change


@dataclasses.dataclass
class Kind:
    """A fault: its name in the catalogue, its size, what it does to the robot and to the columns."""
    fault: str
    size: float
    robot: dict = dataclasses.field(default_factory=dict)  # factors on fields of world.Robot
    change: object = None


KINDS = {
    "effort_loss": Kind("effort_loss_left", 0.3, change=scaled("tau", "l", 1 / 0.7)),
    "effort_bias": Kind("effort_bias_right", None, change=biased("r", 0.5)),
    "encoder_scale": Kind("encoder_scale_left", -0.08, change=scaled("phi", "l", 0.92)),
    "wheel_radius": Kind("wheel_radius_left", -0.1, {"worn_late": 0.9}),
    "payload": Kind("payload_lost", None, {"heavier": 1.4}),
    "ground_before": Kind("", None, {"viscous": 2.5, "viscous_yaw": 2.5}),
    "load_before": Kind("", None, {"mass": 1.4}),
}


def make_log(robot, true, seed, pose, lost):
    """The log of a drive: angles and efforts with declared errors, a pose or none, rows lost."""
    g = np.random.default_rng([seed, 7])
    log = kinds.Log(robot, dict(true), g, motion="angles", counts=8192, declared=True, gyro=False, pose=pose,
                    nominal=False, bag=False)
    g = np.random.default_rng([seed, 8])
    log.lost = g.uniform(size=len(log.columns["t"])) < lost / 2
    for at in np.flatnonzero(g.uniform(size=len(log.lost)) < lost / 2 / STRETCH):
        log.lost[at:at + STRETCH] = True
    return log


def judge(kind, incidents, size):
    """Whether the truth is excluded, is the first candidate, or its other wheel is; how many candidates are left."""
    excluded = False
    for incident in incidents:
        own = [c for c in incident["candidates"] if c["fault"] == kind.fault and not c["changes"]]
        good = incident.get("stays", True) and bool(own)
        if good:
            low, high = own[0]["magnitude"]
            begin, end = own[0]["onset"]
            good = low <= size <= high and ONSET <= end + 0.02 and (own[0]["earlier"] or begin <= ONSET + 0.02)
        excluded = excluded or not good
    first = incidents[0]["candidates"][0]["fault"] if incidents[0]["candidates"] else ""
    mirrored = kind.fault.rsplit("_", 1)[0] + {"left": "_right", "right": "_left"}.get(kind.fault.rsplit("_", 1)[1], "_")
    left = sum(not c["changes"] for c in incidents[0]["candidates"])
    return excluded, first == kind.fault, first == mirrored, left


def watch(options, folder, kind, robot, healthy, faulty, pose, lost, seed):
    """detection.json of a robot's log with a fault, and its size; nothing where there is no model."""
    learn = make_log(robot, healthy, seed, pose, 0.0)
    learn.keep(learn.columns["t"] < LEARNT)
    log = make_log(dataclasses.replace(robot, **{k: getattr(robot, k) * v for k, v in kind.robot.items()}), faulty,
                   seed + 1, pose, lost)
    size = kind.size
    if kind.change:
        kind.change(log, log.columns["t"] >= ONSET)
        size = getattr(log, "size", size)
    if kind.fault == "payload_lost":
        size = -0.4 * robot.mass
    log.keep((log.columns["t"] >= WATCHED) & ~log.lost)
    world.write_csv(folder / "learn.csv", learn.columns)
    world.write_csv(folder / "log.csv", log.columns)
    world.write_robot(folder / "robot.yaml", learn.file | {"wheel_directions": "checked"})
    run = lambda *words: subprocess.run([options.program, *map(str, words)], capture_output=True, text=True, check=False)
    run("commission", folder / "learn.csv", "--robot", folder / "robot.yaml", "--out", folder / "model", "--quiet",
        "--force")
    done = run("detect", folder / "log.csv", "--model", folder / "model/model.json", "--json")
    try:
        return json.loads(done.stdout), size
    except ValueError:
        return None, size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/bin/wheelwright")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--lost", nargs="+", type=float, default=[0.0, 0.01])
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.robots)
    robots = [world.draw_robot(np.random.default_rng([seed, 5]), (50, 100), (120, 120), "speed", "at_samples")
              for seed in seeds]
    drives = {"": world.simulate([dataclasses.replace(r) for r in robots])}
    for name in options.kinds:
        factors = KINDS[name].robot
        drives[name] = world.simulate([dataclasses.replace(r, **{k: getattr(r, k) * v for k, v in factors.items()})
                                       for r in robots]) if factors else drives[""]
    world.refine(robots)
    print("| kind | lost | robots | alarmed | incidents | 95 % | excluded | first | wrong wheel | left | other |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    bad = 0
    for name in options.kinds:
        kind = KINDS[name]
        for lost in options.lost:
            counts, models, excluded, first, mirrored, left, other = [], 0, [], 0, 0, [], 0
            for at, (seed, robot) in enumerate(zip(seeds, robots)):
                with tempfile.TemporaryDirectory() as temporary:
                    folder = options.keep / f"{name}_{lost:g}_{seed}" if options.keep else Path(temporary)
                    folder.mkdir(parents=True, exist_ok=True)
                    found, size = watch(options, folder, kind, robot, drives[""][at], drives[name][at], seed % 2 == 0,
                                        lost, seed)
                if found is None:
                    continue
                models += 1
                if not found["incidents"]:
                    continue
                counts.append(len(found["incidents"]))
                other += bool(found.get("other_parameters"))
                if kind.fault:
                    wrong, right, wheel, many = judge(kind, found["incidents"], size)
                    excluded += [seed] * wrong
                    first, mirrored = first + right, mirrored + wheel
                    left.append(many)
            bad += len(excluded)
            quantile = sorted(counts)[int(0.95 * (len(counts) - 1))] if counts else 0
            print(f"| {name} | {lost:g} | {models} | {len(counts)} | {statistics.median(counts or [0]):g} | {quantile} | "
                  f"{excluded or 0} | {first} | {mirrored} | {statistics.median(left or [0]):g} | {other} |", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
