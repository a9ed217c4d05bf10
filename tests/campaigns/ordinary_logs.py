#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Ordinary and troubled logs of random robots, and what `wheelwright` makes of them.

    tests/campaigns/ordinary_logs.py [--program build/bin/wheelwright] [--kinds KIND ...] [--logs 200] [--seed 1]
                                     [--threads 2] [--out answers.json] [--keep DIR] [--same-account] [--self-test]

A *kind* is one thing that may be odd about a log (KINDS below, --list prints them); ordinary_world.py makes the robots.
Each log is given to `doctor` and `commission`, and the truth is known. By kind the table (Markdown) counts

    right         a model whose intervals hold the true values; of them guaranteed, and of them wide: an interval of
                  mass or inertia that is wider than the true value
    true reason   no model, and the refusal says what is odd about this log; or, for kinds that say so, a model that is
                  only extrapolated and is told to be in doubt for that reason
    other         no model, for another reason
    wrong         a model with an interval that lacks the true value; a model of what is no differential drive; a cause
                  that is false for that kind, named alone; a crash
    could         share of logs without a model, where a right one is possible
    accounts      logs of which doctor and commission (with --same-account identify, gap, try and Python, too) disagree

and lists every wrong one with the command that makes it again (--keep DIR keeps log, robot file and answers). A second
table has the same for the quarters of a kind's logs by rate, and by how large what is odd about them is. Ends with 1
where there is a wrong one, with 77 without numpy. Everything random follows from kind, seed and --seconds.
"""

import argparse
import concurrent.futures
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("skipped: no numpy (tools/setup.sh installs it)")
    sys.exit(1 if os.environ.get("WHEELWRIGHT_NO_SKIPS") == "1" else 77)

import ordinary_world as world
from ordinary_kinds import KINDS, RATES, Kind, Log

ROOT = Path(__file__).resolve().parents[2]
BATCH = 40  # robots simulated at once
LONGEST = 600.0  # s that a command may take

def make_logs(of, seeds, seconds=(60, 100)):
    """The logs of a kind, one a seed; each follows from kind, seed and the range of its length alone."""
    generators = [np.random.default_rng([seed, zlib.crc32(of.name.encode())]) for seed in seeds]
    robots = [world.draw_robot(g, **{"rates": RATES, "seconds": seconds, **of.robot}) for g in generators]
    for robot, true, g in zip(robots, world.simulate(robots), generators):
        log = Log(robot, true, g, **of.sensors)
        of.make(log)
        true.clear()  # most of what is held of a log
        yield log


@dataclass
class Answer:
    """What a command said."""
    code: int
    json: dict
    text: str  # why there is no model: of standard error or of its result

    @property
    def refusals(self):
        """Ids of the findings for which a command refused the log."""
        return sorted(set(re.findall(r"(?m)^  ((?:time|signals|motion|units)\.[a-z_]+):", self.text)))


def ask(program, *words):
    """Runs `program WORDS`."""
    try:
        done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        return Answer(-1, {}, f"no answer within {LONGEST:g} s")
    try:
        result = json.loads(done.stdout)
    except ValueError:
        result = {}
    return Answer(done.returncode, result if isinstance(result, dict) else {}, done.stderr)


def doubts(model):
    """What a model.json says against itself, in words."""
    said = [f"{c['sentence']} {c['next']}" for c in model.get("contradictions", [])]
    said += [a["detail"] for a in model.get("assumptions", []) if a["verdict"] == "fails"]
    return "\n".join([model.get("message", ""), *said])


def outside(model, truth):
    """Intervals of a model.json that lack a true value: sentences, each with its warrant first."""
    entries = [(name, p, p["warrant"]) for name, p in (model.get("physical") or {}).items()]
    entries += [(p["name"], p, p["warrant"]) for p in (model.get("kinematic") or {}).get("parameters", [])]
    out = []
    for name, p, warrant in entries:
        values = truth.get(name, 0.0)
        for value in values if isinstance(values, tuple) else (values,):
            for low, high, what in [(p["lower"], p["upper"], warrant)] + (
                    [(*p["at_risk"], "at a risk, " + warrant)] if p.get("at_risk") else []):
                slack = 1e-9 * abs(value)
                if not low - slack <= value <= high + slack:
                    out.append(f"{what}: {name} {value:.5g} is not in [{low:.5g}, {high:.5g}]")
    return out


def judge(of, truth, answer, says=""):
    """Verdict (right, reason, other, wrong) on what `commission` answered, and why. `says`: what `doctor` found."""
    if answer.code not in (0, 1, 2):
        return "wrong", f"exit code {answer.code}: {answer.text.strip()[-300:]}"
    if answer.code == 0:
        if truth is None:
            return "wrong", "a model of what is no differential drive"
        lacking = outside(answer.json, truth)
        if not lacking:
            return "right", ""
        text = doubts(answer.json) + "\n" + says
        told = of.doubt and re.search(of.reasons, text, re.I) and not any("guaranteed" in line for line in lacking)
        return ("reason" if told else "wrong"), "; ".join(lacking)
    text = answer.text if answer.code == 2 else doubts(answer.json)
    if of.reasons and re.search(of.reasons, text, re.I):
        return "reason", text.strip()
    return ("wrong" if of.false and re.search(of.false, text, re.I) else "other"), text.strip()


def accounts(options, folder, path, robot, doctor, commission, model_file):
    """Differences between what commands make of one log, as sentences."""
    fatal = sorted({f["id"] for f in doctor.json.get("findings", []) if f["severity"] == "fatal"})
    said = {"commission": commission.refusals}
    out = []
    if (doctor.code == 0) != (commission.code == 0):
        out.append(f"doctor ends with {doctor.code}, commission with {commission.code}")
    if options.same_account:
        said["identify"] = ask(options.program, "identify", path, "--robot", robot, "--quiet", "--no-shapes").refusals
        if "nominal" in model_file:
            said["gap"] = ask(options.program, "gap", path, "--robot", robot, "--quiet", "--no-shrink",
                              "--no-manoeuvre").refusals
        ask(options.program, "try", path, "--robot", robot, "--quiet", "--out", folder / "tried")
        tried = folder / "tried" / "doctor" / "doctor.json"
        if tried.exists():
            of_try = sorted({f["id"] for f in json.loads(tried.read_text())["findings"] if f["severity"] == "fatal"})
            out += [f"try finds {of_try}, doctor {fatal}"] if of_try != fatal else []
        if options.python:
            code = ("import json, sys, wheelwright as w; r = w.read_robot(sys.argv[2]); "
                    "print(json.dumps(w.doctor(w.read_log(sys.argv[1], r), r).to_dict()))")
            done = subprocess.run([sys.executable, "-c", code, path, robot], capture_output=True, text=True,
                                  check=False, env={**os.environ, "PYTHONPATH": str(options.python)})
            listed = lambda health: sorted((f["id"], f["severity"]) for f in health.get("findings", []))
            of_python, of_doctor = listed(json.loads(done.stdout or "{}")), listed(doctor.json)
            if of_python != of_doctor:
                out.append(f"Python finds {set(of_python) ^ set(of_doctor)} otherwise ({done.stderr[-200:]})")
    for command, ids in said.items():
        if ids != said["commission"] or not set(ids) <= set(fatal):
            out.append(f"{command} refuses for {ids}, commission for {said['commission']}, doctor for {fatal}")
    return out


def examine(options, of, seed, log):
    """Writes a log, asks about it, and judges: a record."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(options.keep or scratch) / f"{of.name}_{seed}"
        folder.mkdir(parents=True, exist_ok=True)
        path, robot = log.write(folder), folder / "robot.yaml"
        words = (path, "--robot", robot, "--json", "--quiet")
        doctor = ask(options.program, "doctor", *words)
        commission = ask(options.program, "commission", *words, "--threads", 1)
        says = "\n".join(f"{f['id']}: {f['sentence']} {f['next']}" for f in doctor.json.get("findings", [])
                         if f["severity"] in ("warning", "fatal"))
        commission.text = commission.text.replace(str(folder), "DIR")  # which names the kind
        verdict, why = judge(of, log.truth, commission, says)
        if doctor.code not in (0, 1, 2):
            verdict, why = "wrong", f"doctor ends with {doctor.code}"
        differ = accounts(options, folder, path, robot, doctor, commission, log.file)
        physical = commission.json.get("physical") or {}
        width = {name: (p["upper"] - p["lower"]) / max(log.truth[name] if not isinstance(log.truth[name], tuple) else
                                                      log.truth[name][0], 1e-12)
                 for name, p in physical.items() if log.truth and name in ("mass", "yaw_inertia")}
        if options.keep:
            (folder / "answers.json").write_text(json.dumps(
                {"truth": log.truth, "verdict": verdict, "why": why, "doctor": doctor.json,
                 "code": commission.code, "commission": commission.json, "refusal": commission.text}, indent=1))
        return {"kind": of.name, "seed": seed, "verdict": verdict, "why": why,
                "warrant": commission.json.get("warrant"), "width": width, "accounts": differ, "doctor": says,
                "sizes": log.sizes, "hold": log.robot.hold,
                "motion": log.motion, "declared": log.declared, "coulomb": log.robot.coulomb, "bag": log.bag}


def row(name, records, possible):
    """A line of a table."""
    count = lambda verdict: sum(r["verdict"] == verdict for r in records)
    right = [r for r in records if r["verdict"] == "right"]
    widths = [r["width"]["mass"] for r in right if "mass" in r["width"]]
    without = [r for r in records if r["verdict"] in ("reason", "other")]
    cells = [name, len(records), len(right), sum(r["warrant"] == "guaranteed" for r in right),
             sum(any(w > 1 for w in r["width"].values()) for r in right), count("reason"), count("other"),
             count("wrong"), f"{100 * len(without) / len(records):.0f} %" if possible else "–",
             sum(bool(r["accounts"]) for r in records), f"{statistics.median(widths):.3g}" if widths else "–"]
    return "| " + " | ".join(map(str, cells)) + " |"


HEAD = "logs, right, guaranteed, wide, true reason, other, wrong, could, accounts, width of mass".split(", ")


def head(first):
    """The first lines of a table."""
    return [f"| {' | '.join([first, *HEAD])} |", "|---" * (len(HEAD) + 1) + "|"]


def quarters(name, records):
    """Lines of a table over how large what is odd about a kind is, and over rates: each a quarter of its logs."""
    lines = []
    for dimension in dict.fromkeys(d for r in records for d in r["sizes"]):
        of = sorted((r for r in records if dimension in r["sizes"]), key=lambda r: r["sizes"][dimension])
        for quarter in range(4 if len(of) >= 8 else 0):
            some = of[len(of) * quarter // 4:len(of) * (quarter + 1) // 4]
            low, high = (some[k]["sizes"][dimension] for k in (0, -1))
            lines.append(row(f"{name}: {dimension}: {low:.3g} to {high:.3g}", some, KINDS[name].possible))
    return lines


def report(records):
    """The tables of all records, by kind and by size, and every wrong one."""
    by_kind = {name: [r for r in records if r["kind"] == name] for name in dict.fromkeys(r["kind"] for r in records)}
    lines = head("kind") + [row(name, some, KINDS[name].possible) for name, some in by_kind.items()]
    lines += [row("all", records, False)]
    sizes = [line for name, some in by_kind.items() if KINDS[name].possible for line in quarters(name, some)]
    lines += ["", *head("kind: size"), *sizes] if sizes else []
    for r in records:
        if r["verdict"] == "wrong" or r["accounts"]:
            wrong = r["verdict"] == "wrong"
            lines += [f"\n{'wrong' if wrong else 'accounts'}: --kinds {r['kind']} --seed {r['seed']} --logs 1 --keep DIR",
                      f"    {r['why'][:300] if wrong else ''} {'; '.join(r['accounts'])}"]
    return "\n".join(lines)


def run(options):
    """All kinds that are asked for; returns the records."""
    records = []
    with concurrent.futures.ThreadPoolExecutor(options.threads) as pool:
        for name in options.kinds:
            seeds = range(options.seed, options.seed + options.logs)
            for first in range(0, len(seeds), BATCH):
                some = seeds[first:first + BATCH]
                records += pool.map(lambda pair: examine(options, KINDS[name], *pair),
                                    zip(some, make_logs(KINDS[name], some, options.seconds)))
            of_kind = [r for r in records if r["kind"] == name]
            print(row(name, of_kind, KINDS[name].possible), file=sys.stderr, flush=True)
    return records


def self_test(program):
    """Proves the integrator against closed forms, and that the judge can say each of its words. Returns what failed."""
    failed = []

    def expect(what, holds):
        if not holds:
            failed.append(what)

    g = np.random.default_rng(1)
    robot = world.draw_robot(g, (100,), (20, 20), "steps", "at_samples", dry=(0.2, 0.2))
    limit = robot.coulomb
    for torque, force in (((3.0, 3.0), (4.0, 0.0)), ((0.9, -0.9), (0.0, 0.0)), ((2.5, -2.5), (0.0, 3.0))):
        robot.torque = np.tile(np.multiply(torque, limit), (5000, 1))
        true = world.simulate([robot])[0]
        v = (true["omega_r"] + true["omega_l"]) * robot.radius / 2
        w = (true["omega_r"] - true["omega_l"]) * robot.radius / robot.track
        lasting = [force[0] * limit / robot.radius / robot.viscous,
                   force[1] * limit * robot.track / 2 / robot.radius / robot.viscous_yaw]
        lasting[0] *= 1 - np.exp(-true["t"] * robot.viscous / robot.mass)
        lasting[1] *= 1 - np.exp(-true["t"] * robot.viscous_yaw / robot.inertia)
        expect(f"closed form for torques of {torque} times the dry friction",
               np.allclose(v, lasting[0], rtol=0, atol=1e-9) and np.allclose(w, lasting[1], rtol=0, atol=1e-9))

    of = Kind("planted", None, reasons="frozen", false="delay", doubt=True)
    model = lambda low, high, warrant="guaranteed", doubt="": {
        "physical": {"mass": {"lower": low, "upper": high, "warrant": warrant}}, "message": doubt}
    for expected, truth, answer in (
            ("right", {"mass": 24.0}, Answer(0, model(23, 25), "")),
            ("wrong", {"mass": 24.0}, Answer(0, model(24.1, 25), "")),
            ("wrong", {"mass": 24.0}, Answer(0, model(24.1, 25, "guaranteed", "efforts are frozen"), "")),
            ("reason", {"mass": 24.0}, Answer(0, model(24.1, 25, "extrapolated", "efforts are frozen"), "")),
            ("wrong", {"mass": (24.0, 26.0)}, Answer(0, model(23, 25), "")),
            ("wrong", None, Answer(0, model(23, 25), "")),
            ("reason", None, Answer(2, {}, "efforts are frozen, or with a delay")),
            ("wrong", None, Answer(2, {}, "declare a delay")),
            ("other", None, Answer(1, model(0, 0, "", "too short"), "")),
            ("wrong", {"mass": 24.0}, Answer(-11, {}, "")), ("wrong", {"mass": 24.0}, Answer(3, {}, ""))):
        found = judge(of, truth, answer)[0]
        expect(f"{answer} of mass {truth} is {expected}, not {found}", found == expected)

    planted = Kind("planted", lambda log: None,
                   robot={"rates": (100,), "drive": "speed", "hold": "at_samples", "dry": (0, 0)},
                   sensors={"motion": "speeds", **dict.fromkeys(("declared", "gyro", "pose", "nominal", "bag"), False)})
    for factor, expected in ((1.0, "right"), (1.2, "wrong")):
        log = next(make_logs(planted, [1]))
        log.file["wheel_radius"] *= factor
        with tempfile.TemporaryDirectory() as folder:
            path = log.write(Path(folder))
            answer = ask(program, "commission", path, "--robot", path.parent / "robot.yaml", "--json", "--quiet")
        found = judge(planted, log.truth, answer)
        expect(f"a robot file with {factor} times the radius is {expected}, not {found}", found[0] == expected)
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, default=ROOT / "build/bin/wheelwright")
    parser.add_argument("--python", type=Path, help="directory of the Python package, for --same-account")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND")
    parser.add_argument("--logs", type=int, default=200, help="of each kind")
    parser.add_argument("--seed", type=int, default=1, help="of the first log")
    parser.add_argument("--seconds", type=float, nargs=2, default=(60, 100), help="range of their lengths")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON of all records")
    parser.add_argument("--keep", type=Path, help="directory for logs, robot files and answers")
    parser.add_argument("--same-account", action="store_true", help="ask identify, gap, try and Python, too")
    parser.add_argument("--self-test", action="store_true", help="of the integrator and the judge")
    parser.add_argument("--list", action="store_true", help="the kinds")
    options = parser.parse_args()
    if options.list:
        print("\n".join(f"{of.name:18} {of.make.__doc__}" for of in KINDS.values()))
        return 0
    if options.self_test:
        failed = self_test(options.program)
        print("\n".join(failed) or "the judge can say right, true reason, other and wrong")
        return 1 if failed else 0
    records = run(options)
    print(report(records))
    if options.out:
        options.out.write_text(json.dumps(records, indent=1))
    return 1 if any(r["verdict"] == "wrong" for r in records) else 0


if __name__ == "__main__":
    sys.exit(main())
