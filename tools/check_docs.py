#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lets clang read every header alone, and its documentation comments: a \\param that names no parameter, a comment that
belongs to nothing, a malformed command are errors. HTML is not read: <ul> in a comment is a word. Nothing has to be built.

Half of the time of a header would be Eigen's: those that include it, themselves or through others, get it compiled
before. What Eigen brings them they have anyway.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import check_layers

ROOT = Path(__file__).resolve().parent.parent
EIGEN = "Eigen/Core"


def included(header, texts):
    """All that `header` includes, itself and through our own headers."""
    found, ahead = set(), [header]
    while ahead:
        for name in re.findall(r"^#include [<\"]([^>\"]+)[>\"]", texts.get(ahead.pop(), ""), re.MULTILINE):
            if name not in found:
                found.add(name)
                ahead.append(name)
    return found


def main():
    clang = shutil.which("clang++-14") or shutil.which("clang++")
    if not clang:
        sys.exit("docs: clang is missing; tools/setup.sh --ci installs it")
    names = subprocess.run(["git", "ls-files", "*.hpp"], cwd=ROOT, check=True, text=True, capture_output=True).stdout.split()
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names
             if check_layers.module_of(name) not in ("tests", "examples")}
    libraries = subprocess.run(["pkg-config", "--cflags-only-I", "eigen3", "hdf5", "python3"], check=True, text=True,
                               capture_output=True).stdout.replace("-I", "-isystem ").split()
    with tempfile.TemporaryDirectory() as scratch:
        call = [clang, "-std=c++20", "-Wdocumentation", "-Werror=documentation", "-Wno-documentation-html", "-iquote", ROOT,
                *libraries]
        compiled = f"{scratch}/eigen.pch"
        subprocess.run([*call, "-x", "c++-header", "-o", compiled, "-"], check=True, text=True,
                       input=f"#include <{EIGEN}>\n")

        def fails(header):
            before = ["-include-pch", compiled] if EIGEN in included(header, texts) else []
            done = subprocess.run([*call, *before, "-fsyntax-only", "-x", "c++", "-"], check=False, text=True,
                                  capture_output=True, input=f'#include "{header}"\n')
            if done.returncode != 0:
                print(f"docs: {header}\n{done.stderr}", file=sys.stderr)
            return done.returncode != 0

        with ThreadPoolExecutor(os.cpu_count() or 2) as pool:
            failed = sum(pool.map(fails, texts))
    if failed == 0:
        print(f"docs: {len(texts)} headers, nothing to report")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
