#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every source file alone, by clang: what a build that compiles them by the dozen with GCC does not see.

    check_alone.py [FOLDER...]    folders of this repository (bounds, app, tests/logs, ...); without one all of them

The commands are those of the preset `debug`, which is configured first; headers that are made are those of
build/. Nothing is built. Warnings are errors, as in every build. Exit code 1 where a file does not compile, with the
first messages of each. All of them take two processors ten minutes.
"""

import concurrent.futures
import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build-debug"
MADE = ROOT / "build" / "results" / "report" / "embedded"  # headers that a source includes
OURS_TO_GCC = ("-Wno-subobject-linkage",)  # which clang does not know


def compiler():
    for name in ("clang++-14", "clang++"):
        if shutil.which(name):
            return name
    sys.exit("check_alone: no clang++: tools/setup.sh --ci installs it")


def commands(folders):
    subprocess.run(["cmake", "--preset", "debug", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"], cwd=ROOT, check=True,
                   stdout=subprocess.DEVNULL)
    wanted, seen = [], set()
    for entry in json.loads((BUILD / "compile_commands.json").read_text(encoding="utf-8")):
        file = Path(entry["file"])
        if BUILD in file.parents or file in seen or ROOT not in file.parents:
            continue
        if not folders or any((ROOT / folder).resolve() in file.parents for folder in folders):
            seen.add(file)
            wanted.append((file, entry["directory"], shlex.split(entry["command"])))
    return wanted


def clang_options(command):
    """What a command of GCC says to clang: without compiler and output, with the source."""
    at = command.index("-o")
    return [each for each in command[1:at] + command[at + 2:] if each != "-c" and each not in OURS_TO_GCC]


def compile_alone(clang, file, directory, command):
    """Messages; empty where it compiles."""
    done = subprocess.run([clang, *clang_options(command), f"-I{MADE}", "-fsyntax-only", "-ferror-limit=3"],
                          cwd=directory, capture_output=True,
                          text=True, check=False)
    return done.stderr if done.returncode else ""


def main():
    if any(argument.startswith("-") for argument in sys.argv[1:]):
        sys.exit(__doc__.strip())
    if not MADE.is_dir():
        sys.exit(f"check_alone: {MADE} is missing: tools/build.sh program makes it")
    clang, files = compiler(), commands(sys.argv[1:])
    if not files:
        sys.exit("check_alone: no source file there: expected folders of this repository")
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        for (file, *_), messages in zip(files, pool.map(lambda each: compile_alone(clang, *each), files)):
            if messages:
                failed += 1
                print(f"{file.relative_to(ROOT)}\n{messages}", flush=True)
    print(f"alone: {len(files)} files, {failed} do not compile")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
