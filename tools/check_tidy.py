#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""clang-tidy over what build/ compiles, a dozen files at once.

    check_tidy.py [FOLDER...]    folders of this repository (bounds, logs, ...); without one all but
                                  tests and examples

Checks, and why some are left out, stand in tools/clang-tidy.yaml. build/ has to be built: its unity sources are read, since most
of the time goes into the headers of libraries, and these are then read once for twelve files. Exit code 1 where
something is found, each told once. All of it takes two processors half an hour.
"""

import concurrent.futures
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import check_layers
from check_alone import clang_options

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
LEFT_OUT = ("tests", "examples")
# Of unity sources, and of options that GCC alone knows.
CHECKS = "--checks=-bugprone-suspicious-include,-clang-diagnostic-unknown-warning-option"
FINDING = re.compile(r"^(/[^:\n]+):(\d+):(\d+): (?:warning|error): .*\[[^\]]+\]$")


def commands(folders):
    """(source, directory, options) of each object that is made of sources in these folders."""
    for entry in json.loads((BUILD / "compile_commands.json").read_text(encoding="utf-8")):
        source, command = Path(entry["file"]), shlex.split(entry["command"])
        name = source.relative_to(BUILD if BUILD in source.parents else ROOT).as_posix()
        wanted = any(name.startswith(folder + "/") for folder in folders) if folders else (
            check_layers.module_of(name) not in LEFT_OUT)
        if not wanted or "cmake_pch" in source.name:
            continue
        options = [each for each in clang_options(command)
                   if each not in ("-include", "-Winvalid-pch", entry["file"]) and "cmake_pch" not in each]
        yield source, entry["directory"], options


def findings(tidy, source, directory, options):
    """Their text by place; a file that does not compile is one."""
    done = subprocess.run([tidy, "--quiet", f"--config-file={ROOT}/tools/clang-tidy.yaml", CHECKS,
                           f"--header-filter=^{re.escape(str(ROOT))}/", str(source), "--", *options], cwd=directory,
                          capture_output=True, text=True, check=False)
    found, lines = {}, done.stdout.splitlines()
    for k, line in enumerate(lines):
        if FINDING.match(line):
            found[line] = "\n".join(lines[k:k + 3])
    if done.returncode and not found:
        found[str(source)] = f"{source}: {done.stdout[-500:]}{done.stderr[-500:]}"
    return found


def main():
    tidy = shutil.which("clang-tidy-14") or shutil.which("clang-tidy")
    if tidy is None:
        sys.exit("check_tidy: no clang-tidy: tools/setup.sh --ci installs it")
    if any(argument.startswith("-") for argument in sys.argv[1:]):
        sys.exit(__doc__.strip())
    if not (BUILD / "compile_commands.json").is_file():
        sys.exit(f"check_tidy: {BUILD} is not built: tools/build.sh release")
    sources, told = list(commands([folder.rstrip("/") for folder in sys.argv[1:]])), set()
    if not sources:
        sys.exit("check_tidy: no source there: expected folders of this repository")
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS", os.cpu_count() or 2))) as pool:
        for found in pool.map(lambda each: findings(tidy, *each), sources):
            for place, text in found.items():
                if place not in told:
                    told.add(place)
                    print(text, flush=True)
    print(f"tidy: {len(sources)} objects, {len(told)} findings")
    sys.exit(1 if told else 0)


if __name__ == "__main__":
    main()
