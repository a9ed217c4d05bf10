#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs what the test preset `asan` names, each test program as a whole instead of test by test.

    tests/sanitized.py [JOBS]

A test program makes what its tests share once, which takes most of their time under sanitizers; CTest starts it anew
for every test. Programs are split in as many shards as there are processors. Their output is kept in
build-asan/sanitized/. Ends with 0 when all tests that CTest lists were run and none failed.
"""

import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PRESET = "asan"
BUILD = ROOT / "build-asan"
LAST_LINES = 60


def preset():
    return next(p for p in json.loads((ROOT / "CMakePresets.json").read_text())["testPresets"] if p["name"] == PRESET)


def gtest_filter(names):
    """Googletest's pattern for all but what the expression `names`, words in alternation, is found in."""
    words = names.replace("[.]", ".").split("|")
    assert all(re.fullmatch(r"[\w.]+", word) for word in words), names
    return "-" + ":".join(f"*{word}*" for word in words)


def listed():
    """Names of the tests of each test program, and of those that are something else."""
    shown = subprocess.run(["ctest", "--preset", PRESET, "--show-only=json-v1"], cwd=ROOT, check=True, text=True,
                           stdout=subprocess.PIPE).stdout
    programs, others = {}, []
    for test in json.loads(shown)["tests"]:
        program = Path(test["command"][0])
        if program.name.startswith("test_"):
            programs.setdefault(program, []).append(test["name"])
        else:
            others.append(test["name"])
    return programs, others


def run(program, shard, shards, environment):
    log = BUILD / "sanitized" / f"{program.name}.{shard + 1}.log"
    began = time.monotonic()
    with log.open("w") as out:
        code = subprocess.run([program], cwd=BUILD / "tests", stdout=out, stderr=subprocess.STDOUT,
                              env=environment
                              | {"GTEST_TOTAL_SHARDS": str(shards), "GTEST_SHARD_INDEX": str(shard)}).returncode
    text = log.read_text(errors="replace")
    passed = len(re.findall(r"^\[       OK \]", text, re.MULTILINE))
    skipped = len(re.findall(r"^\[  SKIPPED \] .*\)$", text, re.MULTILINE))
    print(f"{program.name} {shard + 1}/{shards}: {passed} passed, {skipped} skipped in {time.monotonic() - began:.0f} s"
          + (f", exit code {code}: {log}" if code else ""), flush=True)
    if code:
        print("\n".join(text.splitlines()[-LAST_LINES:]), flush=True)
    return passed, skipped, code


def main():
    jobs = int(sys.argv[1]) if len(sys.argv) > 1 else os.cpu_count() or 2
    settings = preset()
    environment = os.environ | {name: value.replace("${sourceDir}", str(ROOT))
                                for name, value in settings["environment"].items()}
    environment["GTEST_FILTER"] = gtest_filter(settings["filter"]["exclude"]["name"])
    programs, others = listed()
    (BUILD / "sanitized").mkdir(exist_ok=True)
    shards = [(program, shard) for program in sorted(programs, key=lambda p: -len(programs[p]))
              for shard in range(jobs)]
    with ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(lambda part: run(*part, jobs, environment), shards))
    passed, skipped, codes = map(list, zip(*results))
    wanted = sum(map(len, programs.values()))
    print(f"{sum(passed)} of {wanted} tests of {len(programs)} programs passed under sanitizers, "
          f"{sum(skipped)} were skipped",
          flush=True)
    rest = "^(" + "|".join(map(re.escape, others)) + ")$"
    call = ["ctest", "--preset", PRESET, "-j", str(jobs), "-R", rest]
    code = subprocess.run(call, cwd=ROOT).returncode if others else 0
    return 1 if code or any(codes) or sum(passed) + sum(skipped) != wanted else 0


if __name__ == "__main__":
    sys.exit(main())
