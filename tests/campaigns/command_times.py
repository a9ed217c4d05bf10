#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Seconds of every command on a log of two minutes with a pose, as Markdown.

    tests/campaigns/command_times.py PROGRAM [RUNS]

Median of the runs (3 by default), on the machine's threads, pages and results written; in brackets the processor's
seconds, and the largest memory. Logs are simulated (examples/robot.yaml at 100 and 200 Hz, errors of the pose declared
with a bias, so that everything is said at a stated risk, too). Run it on an idle machine.
"""

import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RATES = (100, 200)
COMMANDS = [
    ("convert", "convert log.csv table.h5"),
    ("doctor", "doctor log.csv --robot robot.yaml --out doctor"),
    ("identify", "identify log.csv --robot robot.yaml --out identify"),
    ("commission", "commission log.csv --robot robot.yaml --out commission"),
    ("check", "check commission/model.json log.csv --out check"),
    ("detect, healthy", "detect other.csv --model commission/model.json --out healthy"),
    ("detect, a wheel of another radius", "detect faulty.csv --model commission/model.json --out detect"),
    ("margins", "margins other.csv --model commission/model.json --out margins"),
    ("choose", "choose log.csv --robot robot.yaml --out choose"),
    ("gap", "gap faulty.csv --robot robot.yaml --baseline log.csv --out gap"),
    ("design",
     "design --robot designed.yaml --for bounds --duration 20 --speed 8 --acceleration 20 --radius 1.5 --out design"),
    ("export", "export commission/model.json --language c --out export"),
    ("try", "try log.csv --out try"),
]


def make(folder, program, rate, duration=120):
    robot = (ROOT / "examples/robot.yaml").read_text(encoding="utf-8")
    robot = robot.replace("position: 0.002, heading: 0.003",
                          "position: {bound: 0.002, bias: 0.0001}, heading: {bound: 0.003, bias: 0.0001}")
    (folder / "robot.yaml").write_text(robot, encoding="utf-8")
    (folder / "designed.yaml").write_text(robot + "limits: {effort: 3.0}\n", encoding="utf-8")
    scenario = (ROOT / "examples/scenarios/healthy.yaml").read_text(encoding="utf-8")
    scenario = scenario.replace("../robot.yaml", "robot.yaml")
    scenario = scenario.replace("duration: 60", f"duration: {duration:g}").replace("rate: 100", f"rate: {rate}")
    fault = "faults:\n  - {kind: wheel_radius_right, magnitude: -0.005, onset: 40}\n"
    for name, text in (("log", scenario), ("other", scenario.replace("seed: 2", "seed: 3")),
                       ("faulty", scenario.replace("seed: 2", "seed: 4") + fault)):
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
        subprocess.run([program, "simulate", f"{name}.yaml", "--out", f"{name}.csv", "--quiet"], cwd=folder, check=True)


def measure(program, command, folder, runs):
    """Median seconds, processor's seconds, largest memory in MB."""
    took, busy, memory = [], [], 0.0
    for _ in range(runs):
        output = re.search(r"(\S+)$", command)[1]
        subprocess.run(["rm", "-rf", output], cwd=folder, check=True)
        begun = time.monotonic()
        child = subprocess.Popen([program, *command.split(), "--quiet"], cwd=folder, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True)
        words = child.stderr.read()
        _, status, used = os.wait4(child.pid, 0)
        took.append(time.monotonic() - begun)
        busy.append(used.ru_utime + used.ru_stime)
        memory = max(memory, used.ru_maxrss / 1024.0)
        if os.waitstatus_to_exitcode(status) > 1:
            sys.exit(f"command_times: {command}: exit code {os.waitstatus_to_exitcode(status)}\n{words}")
    return statistics.median(took), statistics.median(busy), memory


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    program, runs = str(Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 3
    table = {name: [] for name, _ in COMMANDS}
    for rate in RATES:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            make(folder, program, rate)
            for name, command in COMMANDS:
                table[name].append(measure(program, command, folder, runs))
                print(f"{rate} Hz: {name}", file=sys.stderr)
    print("| command | " + " | ".join(f"{rate} Hz" for rate in RATES) + " | memory |\n|---|"
          + "---|" * (len(RATES) + 1))
    for name, cells in table.items():
        print(f"| {name} | " + " | ".join(f"{took:.1f} s ({busy:.1f} s)" for took, busy, _ in cells)
              + f" | {max(memory for *_, memory in cells):.0f} MB |")


if __name__ == "__main__":
    main()
