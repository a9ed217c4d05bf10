#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How long `wheelwright fleet --merge` takes for many robots, and how much memory: measured with synthetic results.

    tests/campaigns/merge_at_size.py PROGRAM [ROBOTS [SHARDS]]     1,000,000 robots in 40 shards by default

Three robots are examined for real. A list of ROBOTS names logs that are not there; the program's own shards find them
missing, which costs little and leaves every key, and then each result is replaced by one of the real ones with the
robot's own name. Prints seconds and memory of a shard and of the merge. Needs some 10 kB of disk for each robot in the
folder for temporary files.
"""

import os
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def measured(command, folder):
    begun = time.monotonic()
    child = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    words = child.stderr.read()
    _, status, used = os.wait4(child.pid, 0)
    if os.waitstatus_to_exitcode(status) > 1:
        sys.exit(f"merge_at_size: {' '.join(map(str, command))}: exit code {os.waitstatus_to_exitcode(status)}\n"
                 + words)
    return time.monotonic() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def real_results(program, folder):
    text = (ROOT / "examples/scenarios/healthy.yaml").read_text(encoding="utf-8").replace("../robot.yaml", "robot.yaml")
    (folder / "robot.yaml").write_text((ROOT / "examples/robot.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    lines = ["robot,log,role"]
    for k in range(3):
        (folder / "drive.yaml").write_text(text.replace("seed: 2", f"seed: {k + 7}"), encoding="utf-8")
        subprocess.run([program, "simulate", "drive.yaml", "--out", f"r{k}.csv", "--quiet"], cwd=folder, check=True)
        lines.append(f"real{k},r{k}.csv,commission")
    (folder / "few.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    measured([program, "fleet", "few.csv", "--robot", "robot.yaml", "--out", "few", "--quiet"], folder)
    with sqlite3.connect(folder / "few/results.sqlite") as store:
        rows = store.execute("SELECT key, result FROM results").fetchall()
    return [(key.split("\n")[0], bytes(result) if isinstance(result, (bytes, memoryview)) else result.encode())
            for key, result in rows]


def replace_results(path, real):
    store = sqlite3.connect(path)
    rows = store.execute("SELECT number, key FROM results").fetchall()
    names = [(number, key.split("\n")[0]) for number, key in rows]
    store.executemany("UPDATE results SET result = ? WHERE number = ?",
                      ((real[number % 3][1].replace(real[number % 3][0].encode(), name.encode()), number)
                       for number, name in names))
    store.commit()
    store.close()
    return len(rows)


def main():
    if len(sys.argv) not in (2, 3, 4) or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    program = str(Path(sys.argv[1]).resolve())
    robots = int(sys.argv[2]) if len(sys.argv) > 2 else 1_000_000
    shards = int(sys.argv[3]) if len(sys.argv) > 3 else 40
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        real = real_results(program, folder)
        with open(folder / "fleet.csv", "w", encoding="utf-8") as out:
            out.write("robot,log,role\n")
            out.writelines(f"robot-{k:07d},logs/{k}.csv,commission\n" for k in range(robots))
        fleet = [program, "fleet", "fleet.csv", "--robot", "robot.yaml", "--out", "all", "--quiet", "--threads", "2"]
        seconds = [measured([*fleet, "--shard", f"{k + 1}/{shards}"], folder) for k in range(shards)]
        count = sum(replace_results(file, real) for file in sorted((folder / "all").glob("shard-*.sqlite")))
        size = sum(file.stat().st_size for file in (folder / "all").glob("shard-*.sqlite"))
        took, busy, memory = measured([*fleet, "--merge"], folder)
        again, _, _ = measured([*fleet, "--merge"], folder)
        page = (folder / "all/report.html").stat().st_size
        print(f"{robots} robots in {shards} shards, {count} results of {size / count:.0f} bytes")
        print(f"a shard whose logs are missing: {max(s for s, _, _ in seconds):.1f} s, "
              f"{max(m for _, _, m in seconds):.0f} MB")
        print(f"merge: {took:.1f} s ({busy:.1f} s of processor), {memory:.0f} MB; once more {again:.1f} s; "
              f"page {page / 1e6:.1f} MB, fleet.json {(folder / 'all/fleet.json').stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
