#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One fault in a random robot's log, and the incidents that `wheelwright detect` makes of it.

    tests/campaigns/incidents.py [--program build/bin/wheelwright] [--cases 200] [--kinds KIND ...]
                                 [--courses COURSE ...] [--lost 0 0.01] [--sensors pose gyro none] [--robots 6]
                                 [--sizes 1 2 4 10] [--seed 1] [--keep DIR] [--scene]

ordinary_world.py makes the robots; nothing is shared with model/sim. A robot drives for 100 s: its model is learnt from
the first 50 s of a healthy drive, and the log that is watched is the last 60 s. A case is a kind of fault in turn, with
a course of its size over time, a share of lost rows, sensors of the motion and a robot that are drawn. Faults begin at
60 s; the course `creeping` at 20 s, and `before` is there all the time. Half of the rows that are lost are lost one by
one, half in stretches of ten, at which a log is split. With `--sizes` a fault's largest size is so many times the
certain one, else that of KINDS: certain is what `wheelwright margins` says of the healthy drive that the model is of,
the size that is seen within 1 s at the median onset, in the residual in which that is smaller. Factors beyond MOST of
the fault's range are not drawn; kinds of which no size is certain, that are there or not, or that the catalogue lacks
have the size of KINDS. By kind, course and size the tables (Markdown) count

    logs          with an incident, of those that there are
    incidents     how many, the median and the 95th percentile over those
    excluded      logs with an incident that names the true kind neither among its candidates nor, of a course that
                  falls again, among its sizes; or, of a step, with another size or onset, or as none that stays
    band          logs with an incident whose sizes over time lack the true one: of a course that only grows at an
                  instant, of any where a mean is above or below all that there was in its time
    first         logs whose first candidate is the true kind, or one of the same trace (TWINS)
    second        others whose second candidate it is
    tied          others in which the true kind is said to be as likely as the first
    wrong wheel   logs whose first candidate is the same of the other wheel
    left          candidates that are left, median
    other         logs that are said to have other constant parameters: right for the course `before` only

and ends with 1 where there is one excluded or out of its band, with 77 without numpy. Of kinds that the catalogue lacks (FOREIGN) `first`
counts logs in which no fault is named, or the first leaves more than half of the deviation and is said to fit badly;
nothing is excluded.

`--scene` makes the logs of SCENE instead, of a robot of 55 kg with casters in the log and 1 % of its rows lost, prints
the first line that `detect` says of each, and ends with 1 where its first fault is another one, unless it says that the
log does not tell the true one from it.
"""

import argparse
import collections
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

SECONDS, LEARNT, WATCHED, ONSET = 100.0, 50.0, 40.0, 60.0  # s: end of the log learnt, beginning of the other, the fault
STRETCH = 10  # rows


def ramp(rise):
    return lambda t, g: np.clip((t - ONSET) / rise, 0, 1)


def smooth(rise):
    return lambda t, g: 0.5 * (1 - np.cos(np.pi * np.clip((t - ONSET) / rise, 0, 1)))


def wandering(t, g):
    """Anything within the range: knots of random heights, some of them jumps."""
    at = ONSET + np.cumsum(g.uniform(0.2, 4.0, 40))
    return np.where(t < ONSET, 0.0, np.interp(t, at, g.uniform(0, 1, 40) * (g.uniform(size=40) < 0.8)))


COURSES = {
    "step": lambda t, g: (t >= ONSET) * 1.0,
    "ramp_0.2": ramp(0.2), "ramp_2": ramp(2.0), "ramp_5": ramp(5.0), "ramp_20": ramp(20.0), "ramp_60": ramp(60.0),
    "smooth_2": smooth(2.0), "smooth_10": smooth(10.0),
    "stairs": lambda t, g: np.clip(np.floor((t - ONSET) / 3.0 + 1.0) / 4, 0, 1),
    "creeping": lambda t, g: np.clip((t - 20.0) / 60.0, 0, 1),
    "pulse": lambda t, g: ((t >= ONSET) & (t < ONSET + 4.0)) * 1.0,
    "wandering": wandering,
    "before": lambda t, g: 0 * t + 1.0,
}
FALLING = ("pulse", "wandering")
MOST = 0.8  # of a fault's range, and of a mass

# Size of each kind; of efforts' biases over the root mean square, of payload and brake over mass and typical torque.
KINDS = {
    "effort_loss_left": 0.35, "effort_loss_right": 0.5, "effort_bias_left": -0.5, "effort_bias_right": 0.5,
    "encoder_scale_left": -0.12, "encoder_scale_right": 0.1, "wheel_radius_left": -0.12, "wheel_radius_right": -0.15,
    "wheel_slip_left": 0.15, "wheel_slip_right": 0.25, "matched": 0.15, "unmatched": 0.15, "slip_yaw": 0.2,
    "payload_lost": 0.3, "payload_gained": -0.4, "effort_stuck_left": 1.0, "effort_dead_right": 1.0,
    "encoder_frozen_left": 1.0, "friction": 1.5, "brake_left": 0.5,
}
FAULTS = {"payload_gained": "payload_lost"}  # by the name of the catalogue where it is another one
FOREIGN = ("friction", "brake_left")
WHOLE = ("effort_stuck_left", "effort_dead_right", "encoder_frozen_left")  # there or not: steps alone
# Kind, course, size, and what the first line has to hold where it is no fault's.
SCENE = {"carpet from the beginning": ("friction", "before", 1.5, "other constant parameters"),
         "another load from the beginning": ("payload_gained", "before", -0.25, "other constant parameters"),
         "payload": ("payload_gained", "step", -0.25, ""), "ice under a wheel": ("wheel_slip_left", "pulse", 0.6, ""),
         "tyre": ("wheel_radius_left", "ramp_5", -0.08, ""), "encoder": ("encoder_scale_right", "step", -0.05, ""),
         "motor": ("effort_loss_left", "step", 0.3, "")}
TWINS = {f"{a}_{side}": f"{b}_{side}" for a, b in (("wheel_slip", "encoder_scale"), ("encoder_scale", "wheel_slip"))
         for side in ("left", "right")}


def drives(fault, size, course):
    """Factors of the robot over time, by a name of world.COURSES: of what changes how the robot drives."""
    stem, _, side = fault.rpartition("_")
    return {"wheel_radius": {"radius_" + side: 1 + size * course}, "wheel_slip": {"rolls_" + side: 1 - size * course},
            "brake": {"brake_" + side: size * course}}.get(stem) or {
                "matched": {"along": size * course}, "unmatched": {"across": -size * course},
                "slip_yaw": {"about": size * course}, "payload_lost": {"mass": 1 - size * course},
                "payload_gained": {"mass": 1 - size * course}, "friction": {"friction": 1 + size * course},
            }.get(fault, {})


def spoil(log, fault, size):
    """Writes a fault of readings to the log's columns; `size` over the simulator's instants."""
    true, rows = log.true, log.rows
    stem, _, side = fault.rpartition("_")
    effort, angle = "tau_" + side[0], "phi_" + side[0]
    late = (size != 0)[rows]
    if stem == "effort_loss":
        log.columns[effort] += (true[effort] * (1 / (1 - size) - 1))[rows]
    elif stem == "effort_bias":
        log.columns[effort] += size[rows]
    elif stem == "encoder_scale":
        step = np.diff(true[angle], prepend=true[angle][0])
        log.sense(angle, (true[angle] + np.cumsum(size * step))[rows])
    elif stem == "effort_stuck":
        log.columns[effort][late] = log.columns[effort][np.argmax(late)]
    elif stem == "effort_dead":
        log.columns[effort][late] = 0.0
    elif stem == "encoder_frozen":
        log.columns[angle][late] = log.columns[angle][np.argmax(late)]


def make_log(robot, true, seed, sensors, lost):
    """The log of a drive: angles and efforts with declared errors, a pose, a gyro or neither, and `lost` rows."""
    g = np.random.default_rng([seed, 7])
    log = kinds.Log(robot, dict(true), g, motion="angles", counts=8192, declared=True, gyro=sensors == "gyro",
                    pose=sensors == "pose", nominal=False, bag=False)
    g = np.random.default_rng([seed, 8])
    log.lost = g.uniform(size=len(log.columns["t"])) < lost / 2
    for at in np.flatnonzero(g.uniform(size=len(log.lost)) < lost / 2 / STRETCH):
        log.lost[at:at + STRETCH] = True
    return log


@dataclasses.dataclass
class Case:
    """A fault in a log. `scale`: its largest size, in the fault's unit."""
    kind: str
    course: str
    lost: float
    sensors: str
    robot: int
    seed: int
    scale: float = 0.0
    factor: float = 0.0  # times the certain size; 0: the size of KINDS

    def over(self, t):
        return COURSES[self.course](t, np.random.default_rng([self.seed, 11]))


def outside_band(case, found):
    """Whether sizes over time of the true kind lack the truth."""
    fault = FAULTS.get(case.kind, case.kind)
    around = 0.02  # s about an instant: within a step of the log
    for incident in found["incidents"]:
        for size in (s for s in incident["sizes"] if s["fault"] == fault):
            grown = [] if case.course in FALLING else [(g["t"], g["t"], g) for g in size["growing"]]
            for begin, end, said in grown + [(m["from"], m["to"], m) for m in size["means"]]:
                true = case.scale * case.over(np.linspace(begin - around, end + around, 201))
                if true.max() < said["lower"] or true.min() > said["upper"]:
                    return True
            if case.course not in FALLING and size["growing_excluded"]:
                return True
    return False


def certain_sizes(run, folder):
    """Of each fault and side that a size is certain of: that size and the range's end."""
    said = json.loads(run("margins", folder / "learn.csv", "--model", folder / "model/model.json", "--window", 1,
                          "--onset-step", 1, "--threads", 1, "--json").stdout)
    out = {}
    for fault in (f for residual in said["residuals"] for f in residual["faults"] if not f["whole"]):
        sizes = sorted(np.inf if onset["certain"][0] is None else onset["certain"][0] for onset in fault["onsets"])
        key = fault["fault"], 1.0 if fault["side"] == "positive" else -1.0
        if sizes and np.isfinite(sizes[len(sizes) // 2]):
            out[key] = min(sizes[len(sizes) // 2], out[key][0] if key in out else np.inf), abs(fault["largest"])
    return out


def judge(case, found):
    """What a log's incidents say of the truth: excluded, first, tied, wrong wheel, candidates left."""
    incidents = found["incidents"]
    named = [c["fault"] for c in incidents[0]["candidates"]]
    if case.kind in FOREIGN:
        badly = bool(named) and (incidents[0]["candidates"][0].get("left") or 0) > 0.5
        return False, badly or not named, False, False, False, len(named)
    fault, excluded = FAULTS.get(case.kind, case.kind), False
    for incident in incidents:
        own = [c for c in incident["candidates"] if c["fault"] == fault]
        good = bool(own) or (case.course in FALLING and any(s["fault"] == fault for s in incident["sizes"]))
        if case.course == "step" and good and case.kind not in WHOLE:
            low, high = own[0]["magnitude"]
            begin, end = own[0]["onset"]
            good = (incident.get("stays", True) and low <= case.scale <= high and ONSET <= end + 0.02 and
                    (own[0]["earlier"] or begin <= ONSET + 0.02))
        excluded = excluded or not good
    same = (fault, TWINS.get(fault))
    first = bool(named) and named[0] in same
    second = not first and len(named) > 1 and named[1] in same
    tied = not first and any(c["fault"] in same and c.get("as_likely") for c in incidents[0]["candidates"])
    stem, _, side = fault.rpartition("_")
    mirrored = bool(named) and named[0] == f"{stem}_{'right' if side == 'left' else 'left'}" and stem != ""
    return excluded, first, second, tied, mirrored, len(named)


@dataclasses.dataclass
class Tally:
    logs: int = 0
    counts: list = dataclasses.field(default_factory=list)
    excluded: list = dataclasses.field(default_factory=list)
    band: list = dataclasses.field(default_factory=list)
    first: int = 0
    second: int = 0
    tied: int = 0
    mirrored: int = 0
    left: list = dataclasses.field(default_factory=list)
    other: int = 0

    def take(self, case, found):
        self.logs += 1
        if not found["incidents"]:
            return
        excluded, first, second, tied, mirrored, left = judge(case, found)
        self.counts.append(len(found["incidents"]))
        self.excluded += [case.seed] * excluded
        self.band += [case.seed] * outside_band(case, found)
        self.second += second
        self.first, self.tied, self.mirrored = self.first + first, self.tied + tied, self.mirrored + mirrored
        self.left.append(left)
        self.other += bool(found.get("other_parameters"))

    def line(self, name):
        quantile = sorted(self.counts)[int(np.ceil(0.95 * (len(self.counts) - 1)))] if self.counts else 0
        return (f"| {name} | {len(self.counts)} of {self.logs} | {statistics.median(self.counts or [0]):g} | "
                f"{quantile} | {len(self.excluded)} | {len(self.band)} | {self.first} | {self.second} | {self.tied} | "
                f"{self.mirrored} | "
                f"{statistics.median(self.left or [0]):g} | {self.other} |")


def heavy_robot():
    """55 kg, as an indoor robot drives."""
    robot = world.draw_robot(np.random.default_rng([55, 5]), (100,), (SECONDS, SECONDS), "speed", "at_samples")
    share = 55.0 / robot.mass
    return dataclasses.replace(robot, mass=55.0, inertia=robot.inertia * share, viscous=robot.viscous * share,
                               viscous_yaw=robot.viscous_yaw * share, coulomb=0.0, kp=robot.kp * share,
                               ki=robot.ki * share)


def play_scene(options, run):
    """Ends with 1 where a first line is wrong."""
    robot, bad = heavy_robot(), 0
    t = world.TABLE * np.arange(int(SECONDS / world.TABLE) + 3)
    cases = {name: Case(kind, course, 0.01, "", 0, options.seed, size)
             for name, (kind, course, size, _) in SCENE.items()}
    changed = [dataclasses.replace(robot, courses=drives(c.kind, c.scale, c.over(t))) for c in cases.values()]
    healthy, *faulty = world.simulate([robot, *changed])
    for case in cases.values():
        if case.kind.startswith("payload"):
            case.scale *= robot.mass
    with tempfile.TemporaryDirectory() as temporary:
        base = options.keep or Path(temporary)
        for sensors in options.sensors:
            folder = base / sensors
            folder.mkdir(parents=True, exist_ok=True)
            learn = make_log(robot, healthy, 1, sensors, 0.0)
            learn.columns["caster_l"] = np.sin(learn.columns["t"])
            learn.keep(learn.columns["t"] < LEARNT)
            world.write_csv(folder / "learn.csv", learn.columns)
            world.write_robot(folder / "robot.yaml", learn.file | {"wheel_directions": "checked"})
            run("commission", folder / "learn.csv", "--robot", folder / "robot.yaml", "--out", folder / "model",
                "--quiet", "--force")
            for (name, case), own, true in zip(cases.items(), changed, faulty):
                own.fine = robot.fine
                log = make_log(own, true, 2, sensors, case.lost)
                spoil(log, case.kind, case.scale * case.over(log.true["t"]))
                log.columns["caster_l"] = np.sin(log.columns["t"])
                log.keep((log.columns["t"] >= WATCHED) & ~log.lost)
                file = folder / f"{name.replace(' ', '_')}.csv"
                world.write_csv(file, log.columns)
                found = folder / f"{file.stem}_found"
                said = run("detect", file, "--model", folder / "model/model.json", "--out", found, "--force")
                lines = [line for line in said.stdout.splitlines() if line.startswith(("incident", "other"))]
                lines = lines or ["nothing"]
                incidents, expected = json.loads((found / "detection.json").read_text()), SCENE[name][3]
                told = judge(case, incidents) if incidents["incidents"] else (False,) * 4
                first, tied = told[1], told[3]
                right = expected in lines[0] if expected else (first or tied) and lines[0].startswith("incident 1: ")
                right = right and (bool(expected) or "no fault of the catalogue" not in lines[0])
                bad += not right
                print(f"{name}, {sensors}: {'right' if right else 'WRONG'}{' (not told apart)' if tied else ''}: "
                      f"{lines[0]}", flush=True)
    return 1 if bad else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/bin/wheelwright")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--courses", nargs="+", choices=COURSES, default=list(COURSES))
    parser.add_argument("--lost", nargs="+", type=float, default=[0.0, 0.01])
    parser.add_argument("--sensors", nargs="+", choices=["pose", "gyro", "none"], default=["pose", "gyro", "none"])
    parser.add_argument("--robots", type=int, default=6)
    parser.add_argument("--sizes", nargs="+", type=float, default=[])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--scene", action="store_true")
    options = parser.parse_args()
    run = lambda *words: subprocess.run([options.program, *map(str, words)], capture_output=True, text=True,
                                        check=False)
    if options.scene:
        return play_scene(options, run)
    robots = [world.draw_robot(np.random.default_rng([options.seed + k, 5]), (50, 100), (SECONDS, SECONDS), "speed",
                               "at_samples") for k in range(options.robots)]
    healthy = world.simulate([dataclasses.replace(r) for r in robots])
    world.refine(robots)
    g = np.random.default_rng([options.seed, 6])
    cases = []
    for k in range(options.cases):
        kind = options.kinds[k % len(options.kinds)]
        course = "step" if kind in WHOLE else str(g.choice(options.courses))
        cases.append(Case(kind, course, float(g.choice(options.lost)), str(g.choice(options.sensors)),
                          int(g.integers(options.robots)), 1000 * options.seed + k))
    table = world.TABLE * np.arange(int(SECONDS / world.TABLE) + 3)
    tallies = {"kind": collections.defaultdict(Tally), "course": collections.defaultdict(Tally),
               "size": collections.defaultdict(Tally), "": {"all": Tally()}}
    certain = {}
    with tempfile.TemporaryDirectory() as temporary:
        base = options.keep or Path(temporary)
        for begin in range(0, len(cases), 24):
            some = cases[begin:begin + 24]
            changed = []
            for case in some:
                robot, true = robots[case.robot], healthy[case.robot]
                effort = float(np.sqrt(np.mean(true["tau_r"]**2)))
                case.scale = KINDS[case.kind] * (effort if case.kind.startswith(("effort_bias", "brake")) else 1.0)
                mass = robot.mass if case.kind.startswith("payload") else 1.0
                model = base / f"{case.robot}_{case.sensors}"
                if not model.exists():
                    model.mkdir(parents=True)
                    learn = make_log(robot, true, options.seed + case.robot, case.sensors, 0.0)
                    learn.keep(learn.columns["t"] < LEARNT)
                    world.write_csv(model / "learn.csv", learn.columns)
                    world.write_robot(model / "robot.yaml", learn.file | {"wheel_directions": "checked"})
                    run("commission", model / "learn.csv", "--robot", model / "robot.yaml", "--out", model / "model",
                        "--quiet", "--force")
                if options.sizes and case.kind not in WHOLE and model not in certain:
                    certain[model] = certain_sizes(run, model)
                least, largest = certain.get(model, {}).get((FAULTS.get(case.kind, case.kind), np.sign(case.scale)),
                                                            (np.inf, 0.0))
                largest = min(largest, mass) if case.kind.startswith("payload") else largest
                fitting = [factor for factor in options.sizes if factor * least <= MOST * largest]
                if fitting and case.kind not in WHOLE:
                    case.factor = float(np.random.default_rng([case.seed, 12]).choice(fitting))
                    case.scale = np.sign(case.scale) * case.factor * least / mass
                changed.append(dataclasses.replace(robot, courses=drives(case.kind, case.scale, case.over(table))))
                if case.kind.startswith("payload"):
                    case.scale *= robot.mass
            moved = [k for k, robot in enumerate(changed) if robot.courses]
            faulty = dict(zip(moved, world.simulate([changed[k] for k in moved]) if moved else []))
            for k, case in enumerate(some):
                model = base / f"{case.robot}_{case.sensors}"
                changed[k].fine = robots[case.robot].fine
                log = make_log(changed[k], faulty.get(k, healthy[case.robot]), case.seed, case.sensors, case.lost)
                spoil(log, case.kind, case.scale * case.over(log.true["t"]))
                log.keep((log.columns["t"] >= WATCHED) & ~log.lost)
                file = base / f"{case.kind}-{case.course}-{case.lost:g}-{case.sensors}-{case.robot}-{case.seed}.csv"
                world.write_csv(file, log.columns)
                done = run("detect", file, "--model", model / "model/model.json", "--json")
                try:
                    found = json.loads(done.stdout)
                except ValueError:
                    continue
                if options.keep:
                    file.with_suffix(".json").write_text(done.stdout)
                else:
                    file.unlink()
                times = f"{case.factor:g} times" if case.factor else "its own"
                for tally in (tallies["kind"][case.kind], tallies["course"][case.course], tallies["size"][times],
                              tallies[""]["all"]):
                    tally.take(case, found)
    for by, of in tallies.items():
        print(f"\n| {by} | logs | incidents | 95 % | excluded | band | first | second | tied | wrong wheel | left | "
              "other |")
        print("|---|---|---|---|---|---|---|---|---|---|---|---|")
        for name, tally in of.items():
            print(tally.line(name), flush=True)
    everything = tallies[""]["all"]
    if everything.excluded:
        print(f"excluded in the logs of seeds {everything.excluded}", file=sys.stderr)
    if everything.band:
        print(f"out of the band in the logs of seeds {everything.band}", file=sys.stderr)
    return 1 if everything.excluded or everything.band else 0


if __name__ == "__main__":
    sys.exit(main())
