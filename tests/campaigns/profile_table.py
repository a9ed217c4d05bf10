#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of tests/campaigns/profile.sh, which says what they are.

    tests/campaigns/profile_table.py PROGRAM SECONDS FOLDER
"""

import collections
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import command_times

COMMANDS = [
    ("doctor", "doctor log.csv --robot robot.yaml --rows 100000000"),
    ("identify", "identify log.csv --robot robot.yaml"),
    ("commission", "commission log.csv --robot robot.yaml"),
    ("detect", "detect other.csv --model commission/model.json"),
    ("margins", "margins other.csv --model commission/model.json"),
    ("gap", "gap faulty.csv --robot robot.yaml --baseline log.csv"),
]
# Of the stages in a stack the first of this list counts.
STAGES = [
    ("reading", ("logs::RowLog::RowLog",)),
    ("pages and files", ("report::", "app::publish", "results::to_json")),
    ("doctor: pose", ("doctor::check_odometry",)),
    ("doctor: rest", ("doctor::examine", "doctor::first_rows")),
    ("kinematics", ("commission::commission_kinematics",)),
    ("pose at risk", ("commission::learn_pose_at_risk", "detector::PoseSumDetector")),
    ("efforts in time", ("commission::effort_timing",)),
    ("contradictions", ("commission::contradictions_in_log", "commission::find_raw_contradictions")),
    ("trial", ("::try_held_out",)),
    ("feasible set", ("::bounded_set",)),
    ("filter, fit", ("commission::settle", "commission::fit_log")),
    ("set at risk", ("commission::declared_risk_set",)),
    ("errors like before", ("commission::serial_correlation",)),
    ("reach, margins", ("commission::risk_reach", "commission::first_look", "commission::survey_margins",
                        "detector::margins_", "detector::solve_smallest_certain", "detector::pose_margins")),
    ("sums at risk", ("commission::learn_at_risk", "commission::watch_at_risk")),
    ("detector", ("commission::detect<", "commission::watch_kinematics")),
    ("gap", ("gap::",)),
    ("identify", ("inference::",)),
]
COUNTED = [
    ("rows", "wheelwright::logs::(anonymous namespace)::KeptRows::next"),
    ("torque", "wheelwright::filter::RowStream<wheelwright::filter::RegressorFilter>::next"),
    ("kinematic", "wheelwright::filter::RowStream<wheelwright::filter::OdometryFilter>::next"),
    ("programs", "wheelwright::bounds::LinearProgram::solve"),
]
BLOCK = 4096  # rows that a walk hands out at once


def stage_of(stack):
    for name, parts in STAGES:
        if any(part in function for function in stack for part in parts):
            return name
    return "rest"


def shares(program, command, folder):
    """Seconds of processor, and the share of each stage."""
    data = folder / "perf.data"
    subprocess.run(["perf", "record", "-q", "-F", "400", "--call-graph", "dwarf,32768", "-o", data, program,
                    *command.split(), "--quiet", "--out", "profiled"],
                   cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    text = subprocess.run(["perf", "script", "-i", data, "-F", "comm,ip,sym"], cwd=folder, capture_output=True,
                          text=True, errors="replace").stdout
    data.unlink()
    counts = collections.Counter()
    for sample in text.split("\n\n"):
        stack = [line.strip().split(" ", 1)[-1].replace("(anonymous namespace)", "")
                 for line in sample.splitlines()[1:]]
        if stack:
            counts[stage_of(stack)] += 1
    total = sum(counts.values())
    return total / 400.0, {name: count / total for name, count in counts.items()}


def bytes_read(program, command, folder):
    child = subprocess.Popen([program, *command.split(), "--quiet", "--out", "profiled"], cwd=folder,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    read = int(re.search(r"rchar: (\d+)", Path(f"/proc/{child.pid}/io").read_text())[1])
    child.wait()
    return read


def symbols(program):
    """The linker's name of each function that is counted."""
    mangled, plain = (
        subprocess.run(["nm", *how, program], capture_output=True, text=True, check=True).stdout.splitlines()
        for how in ([], ["-C"]))
    found = []
    for _, function in COUNTED:
        names = [a.split()[-1] for a, b in zip(mangled, plain) if f" {function}(" in b and "[clone" not in b]
        if not names:
            sys.exit(f"profile_table: {program}: no function {function}: expected a program with its symbols")
        found.append(names[0])
    return found


def calls(program, command, folder):
    script = ["set breakpoint pending off", "set pagination off"]
    for k, symbol in enumerate(symbols(program), 1):
        script += [f"break {symbol}", f"ignore {k} 1000000000"]
    script += ["run", "info breakpoints"]
    options = [word for line in script for word in ("-ex", line)]
    told = subprocess.run(["gdb", "-batch", *options, "--args", program, *command.split(), "--quiet",
                           "--out", "profiled"], cwd=folder, capture_output=True, text=True, errors="replace").stdout
    found = {}
    for k, (name, _) in enumerate(COUNTED, 1):
        entry = re.search(rf"^{k}\s+breakpoint.*?(?=^\d+\s+breakpoint|\Z)", told, re.M | re.S)
        hits = re.search(r"already hit (\d+) time", entry[0]) if entry else None
        found[name] = int(hits[1]) if hits else 0
    return found


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__.strip())
    program, seconds, folder = sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])
    command_times.make(folder, program, 200, duration=seconds)
    subprocess.run([program, *"commission log.csv --robot robot.yaml --out commission --quiet".split()], cwd=folder,
                   check=True)
    rows = seconds * 200
    timed, counted = [], []
    for name, command in COMMANDS:
        print(name, file=sys.stderr)
        logs = sum((folder / word).stat().st_size for word in command.split() if word.endswith(".csv"))
        files = sum(word.endswith(".csv") for word in command.split())
        subprocess.run(["rm", "-rf", "profiled"], cwd=folder)
        busy, stages = shares(program, command, folder)
        told = sorted(stages.items(), key=lambda entry: -entry[1])
        words = ", ".join(f"{stage} {100 * share:.0f} %" for stage, share in told if share >= 0.015)
        timed.append(f"| {name} | {busy:.2f} s | {1e6 * busy / (rows * files):.2f} µs | {words} |")
        subprocess.run(["rm", "-rf", "profiled"], cwd=folder)
        read = bytes_read(program, command, folder)
        subprocess.run(["rm", "-rf", "profiled"], cwd=folder)
        n = calls(program, command, folder)
        calls_a_walk = math.ceil(rows / BLOCK) + 1
        passes = {kind: n[kind] / calls_a_walk / files for kind in ("rows", "torque", "kinematic")}
        counted.append(f"| {name} | {read / logs:.2f} | {passes['rows']:.1f} | {passes['torque']:.1f} "
                       f"| {passes['kinematic']:.1f} | {n['programs']} |")
    print("| command | processor | per row | of it |\n|---|---|---|---|")
    print("\n".join(timed))
    print("\n| command | bytes read, of the files' | walks of the rows | of them through the torque's filter "
          "| the kinematic one | linear programs |\n|---|---|---|---|---|---|")
    print("\n".join(counted))


if __name__ == "__main__":
    main()
