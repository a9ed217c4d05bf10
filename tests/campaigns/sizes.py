#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One fault of a random robot whose size follows a course over time, and what `wheelwright detect` says of that size.

    tests/campaigns/sizes.py [--program build/bin/wheelwright] [--kinds KIND ...] [--courses COURSE ...] [--lost 0 0.01]
                             [--robots 6] [--seed 1] [--keep DIR]

ordinary_world.py makes the robots; nothing is shared with model/sim. A robot drives for 100 s: its model is learnt from
the first 50 s of a healthy drive, and the log that is watched is the last 60 s, with a fault that begins at 60 s or, of
the course `creeping`, at 20 s. Every second robot has a pose. By kind and course the table (Markdown) counts

    incidents     of logs with one, those that have the true kind among their sizes
    means         intervals of a weighted mean of the size; outside: the true mean, computed from the true course with
                  the weights that docs/methods/detectability.md names, is not in it
    width         median width of these intervals over the final size, where the true mean is half of it and more
    growing       intervals of the size of a fault that only grows; outside: the true size is not in it (courses that
                  fall again are of another class: not judged)
    lost          incidents in which the true kind is excluded, for the class that the course is of
    known         median of the lower end of the size at the end over the final size, if it only grew

and ends with 1 where something is outside or lost, with 77 without numpy.
"""

import argparse
import dataclasses
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("no numpy")
    sys.exit(77)

import incidents
import ordinary_world as world
from incidents import COURSES, FALLING, LEARNT, SECONDS, WATCHED

SIZES = {"effort_loss_left": 0.35, "effort_bias_right": 0.5, "encoder_scale_left": -0.12, "wheel_radius_left": -0.15}


def sensors_of(seed):
    return "pose" if seed % 2 == 0 else "none"


def spoil(log, fault, course, scale):
    """Writes the fault of the size `course` (a function of time) to the log's columns. Radii are the robot's own."""
    true, rows = log.true, log.rows
    size = scale * course(true["t"])
    if fault == "effort_loss_left":
        log.columns["tau_l"] += (true["tau_l"] * (1 / (1 - size) - 1))[rows]
    elif fault == "effort_bias_right":
        log.columns["tau_r"] += size[rows]
    elif fault == "encoder_scale_left":
        step = np.diff(true["phi_l"], prepend=true["phi_l"][0])
        log.sense("phi_l", (true["phi_l"] + np.cumsum(size * step))[rows])
    return size


def kernel(x, step, design):
    """The filter's kernel at ages x, of angles `step` apart."""
    alpha, beta = design["alpha"], design["beta"]
    gamma = max(2 / step, 4 * beta)
    slow, fast = np.exp(-beta * np.maximum(x, 0)), np.exp(-gamma * np.maximum(x, 0))
    return np.where(x < 0, 0.0, alpha**2 * gamma / (gamma - beta) * (x * slow - (slow - fast) / (gamma - beta)))


def true_mean(fault, log, size, begin, end, design):
    """The weighted mean of the size over [begin, end]."""
    t = log.true["t"]
    inside = (t >= begin - 1e-9) & (t < end - 1e-9)
    stamps = log.columns["t"]
    if fault.startswith("effort") and np.any(log.lost & (stamps >= begin) & (stamps <= end)):
        return None  # rows that are lost have weights of their own
    if fault in ("wheel_radius_left", "encoder_scale_left"):
        step = np.diff(log.true["phi_l"], append=log.true["phi_l"][-1])
        # From row to row: the sign of the way between them.
        at = np.searchsorted(t, stamps[~log.lost] - 1e-9)
        signs = np.sign(np.diff(log.true["phi_l"][at]))
        weights = step * signs[np.clip(np.searchsorted(at, np.arange(len(t)), "right") - 1, 0, len(signs) - 1)]
    else:
        weights = np.interp(end - t, (end - stamps)[::-1], kernel(end - stamps, 1 / log.robot.rate, design)[::-1])
        if fault == "effort_loss_left":
            at = np.clip(np.searchsorted(stamps, t + 1e-9) - 1, 0, None)
            weights = weights * np.abs(log.said[at])
    weights = weights * inside
    return float(np.sum(weights * size) / np.sum(weights)) if np.sum(weights) > 0 else None


@dataclasses.dataclass
class Tally:
    logs: int = 0
    having: int = 0
    means: int = 0
    means_out: list = dataclasses.field(default_factory=list)
    widths: list = dataclasses.field(default_factory=list)
    growing: int = 0
    growing_out: list = dataclasses.field(default_factory=list)
    lost: list = dataclasses.field(default_factory=list)
    known: list = dataclasses.field(default_factory=list)

    def take(self, fault, course, log, size, found, design, mark):
        final = np.max(np.abs(size))
        for incident in found["incidents"]:
            self.logs += 1
            own = [s for s in incident.get("sizes", []) if s["fault"] == fault]
            falls = course in FALLING
            # What is said of nothing is left out; what is excluded is, too.
            if not own or (own[0]["growing_excluded"] and not falls):
                self.lost.append(mark)
                continue
            self.having += 1
            for mean in own[0]["means"]:
                truth = true_mean(fault, log, size, mean["from"], mean["to"], design)
                if truth is None:
                    continue
                self.means += 1
                if not mean["lower"] - 1e-9 <= truth <= mean["upper"] + 1e-9:
                    self.means_out.append((mark, round(mean["to"], 2), mean["lower"], truth, mean["upper"]))
                if abs(truth) > 0.5 * final:
                    self.widths.append((mean["upper"] - mean["lower"]) / final)
            if falls:
                continue
            for at in own[0]["growing"]:
                truth = float(np.interp(at["t"], log.true["t"], size))
                # At a jump of the course either side may be meant.
                near = size[np.abs(log.true["t"] - at["t"]) <= 1.0 / log.robot.rate]
                self.growing += 1
                low, high = (min(near, default=truth), max(near, default=truth))
                if not (at["lower"] - 1e-9 <= high and low <= at["upper"] + 1e-9):
                    self.growing_out.append((mark, round(at["t"], 2), at["lower"], truth, at["upper"]))
            if own[0]["growing"]:
                last = own[0]["growing"][-1]
                self.known.append(max(0.0, last["lower"], -last["upper"]) / final)

    def line(self, *names):
        median = lambda values: f"{np.median(values):.3f}" if values else "–"
        return "| " + " | ".join(map(str, [*names, self.logs, self.having, self.means, len(self.means_out),
                                           median(self.widths), self.growing, len(self.growing_out),
                                           self.lost or 0, median(self.known)])) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/bin/wheelwright")
    parser.add_argument("--kinds", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument("--courses", nargs="+", choices=COURSES, default=list(COURSES))
    parser.add_argument("--lost", nargs="+", type=float, default=[0.0, 0.01])
    parser.add_argument("--robots", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    run = lambda *words: subprocess.run([options.program, *map(str, words)], capture_output=True, text=True,
                                        check=False)
    seeds = list(range(options.seed, options.seed + options.robots))
    robots = [world.draw_robot(np.random.default_rng([seed, 5]), (50, 100), (SECONDS, SECONDS), "speed", "at_samples")
              for seed in seeds]
    of = lambda name, seed: lambda t: COURSES[name](t, np.random.default_rng([seed, 11]))
    worn, which = [], {}
    for at, (seed, robot) in enumerate(zip(seeds, robots)):
        for name in options.courses if "wheel_radius_left" in options.kinds else []:
            t = world.TABLE * np.arange(int(SECONDS / world.TABLE) + 3)
            which[at, name] = len(worn)
            radius = 1 + SIZES["wheel_radius_left"] * of(name, seed)(t)
            worn.append(dataclasses.replace(robot, courses={"radius_left": radius}))
    healthy = world.simulate([dataclasses.replace(r) for r in robots])
    drives = world.simulate(worn) if worn else []
    world.refine(robots)
    print("| kind | course | lost | incidents | with it | means | outside | width | growing | outside | lost | known |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    bad, everything = 0, Tally()
    with tempfile.TemporaryDirectory() as temporary:
        base = options.keep or Path(temporary)
        designs = {}
        for at, (seed, robot) in enumerate(zip(seeds, robots)):
            folder = base / str(seed)
            folder.mkdir(parents=True, exist_ok=True)
            learn = incidents.make_log(robot, healthy[at], seed, sensors_of(seed), 0.0)
            learn.keep(learn.columns["t"] < LEARNT)
            world.write_csv(folder / "learn.csv", learn.columns)
            world.write_robot(folder / "robot.yaml", learn.file | {"wheel_directions": "checked"})
            run("commission", folder / "learn.csv", "--robot", folder / "robot.yaml", "--out", folder / "model",
                "--quiet", "--force")
            model = folder / "model/model.json"
            if model.exists():
                designs[at] = json.loads(model.read_text())["filter"]
        for fault in options.kinds:
            for name in options.courses:
                for lost in options.lost:
                    tally = Tally()
                    for at, (seed, robot) in enumerate(zip(seeds, robots)):
                        if at not in designs:
                            continue
                        own = worn[which[at, name]] if fault == "wheel_radius_left" else robot
                        own.fine = robot.fine
                        true = drives[which[at, name]] if fault == "wheel_radius_left" else healthy[at]
                        log = incidents.make_log(own, true, seed + 1000, sensors_of(seed), lost)
                        scale = SIZES[fault]
                        if fault == "effort_bias_right":
                            scale *= float(np.sqrt(np.mean(true["tau_r"]**2)))
                        size = spoil(log, fault, of(name, seed), scale)
                        log.said = log.columns["tau_l"]
                        kept = {k: v[(log.columns["t"] >= WATCHED) & ~log.lost] for k, v in log.columns.items()}
                        mark = f"{fault}_{name}_{lost:g}"
                        file = base / str(seed) / f"{mark}.csv"
                        world.write_csv(file, kept)
                        done = run("detect", file, "--model", base / str(seed) / "model/model.json", "--json")
                        try:
                            found = json.loads(done.stdout)
                        except ValueError:
                            continue
                        for each in (tally, everything):
                            each.take(fault, name, log, size, found, designs[at], f"{seed}")
                        if not options.keep:
                            file.unlink()
                    bad += len(tally.means_out) + len(tally.growing_out) + len(tally.lost)
                    print(tally.line(fault, name, f"{lost:g}"), flush=True)
                    for kind, out in (("mean", tally.means_out), ("size", tally.growing_out)):
                        for each in out[:3]:
                            print(f"  {kind} outside: {each}", file=sys.stderr, flush=True)
        print(everything.line("all", "", ""))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
