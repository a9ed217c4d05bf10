#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A day at 1 kHz through the detector, the exported C and `wheelwright detect --follow`, as fast as they go.

    tests/campaigns/endurance.py BUILD [HOURS]

Simulates and commissions a robot at 1 kHz, then plays a second drive of two minutes for so many hours of its clock (24
by default), with trouble every hour (tests/benchmarks/endurance.cpp says which). Prints decisions that differ from those of the
first two minutes, latencies, and the memory of `--follow` at the end of every hour. Ends with 1 where a decision
differs, memory grows from the second hour on, a fault is told, or a spell of trouble is not. Takes some ten minutes.
"""

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def times():
    spec = importlib.util.spec_from_file_location("command_times", ROOT / "tests/campaigns/command_times.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def resident(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text(encoding="utf-8"))[1]) / 1e3


def follow(build, folder, hours):
    """Memory in MB at every heartbeat, and what was told."""
    rows = subprocess.Popen([build / "bin/wheelwright-endurance", "m/model.json", "other.csv", str(hours), "--emit"],
                            cwd=folder, stdout=subprocess.PIPE)
    watch = subprocess.Popen([build / "bin/wheelwright", "detect", "--follow", "--model", "m/model.json",
                              "--heartbeat", "3600"], cwd=folder, stdin=rows.stdout, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True)
    rows.stdout.close()
    memory, told = [], []
    for line in watch.stdout:
        if line.startswith("watching"):
            memory.append(resident(watch.pid))
        else:
            told.append(line.rstrip())
    errors = watch.stderr.read()
    return memory, told, watch.wait(), errors


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    build, hours = Path(sys.argv[1]).resolve(), float(sys.argv[2]) if len(sys.argv) > 2 else 24.0
    with tempfile.TemporaryDirectory(prefix="wheelwright-") as name:
        folder = Path(name)
        program = build / "bin/wheelwright"
        times().make(folder, program, 1000, 120)
        subprocess.run([program, "commission", "log.csv", "--robot", "robot.yaml", "--out", "m", "--quiet"],
                       cwd=folder, check=True, stdout=subprocess.DEVNULL)
        sound = subprocess.run([build / "bin/wheelwright-endurance", "m/model.json", "other.csv", str(hours)],
                               cwd=folder, check=False).returncode == 0
        memory, told, code, errors = follow(build, folder, hours)
        print(f"\n--follow: exit code {code}, memory {', '.join(f'{m:.1f}' for m in memory)} MB by the hour")
        spells = sum(line.startswith("blind") and " until " in line for line in told)
        others = [line for line in told if not line.startswith("blind")]
        print(f"--follow: {spells} spells of trouble told for {int(hours)} hours")
        print(os.linesep.join(others + [errors.rstrip()]))
        sound = sound and code == 0 and spells == int(hours) and len(memory) >= int(hours) - 1
        sound = sound and all(m < 1.02 * memory[1] + 1.0 for m in memory[1:])
    sys.exit(0 if sound else 1)


if __name__ == "__main__":
    main()
