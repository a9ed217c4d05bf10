#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the objects of two builds, so that a change of layout, names or comments can be seen to change no code.

    same_objects.py BEFORE AFTER   the build folders; exit code 1 where the instructions of an object differ
    same_objects.py --self-test

Objects are paired by target and file name, whatever folders they lie in. What is compared is the disassembly with its
relocations (objdump). Of an object that differs the functions are counted whose instructions differ, apart from where
constants lie: a header that comes earlier moves these and the order in which functions are written.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


PADDING = re.compile(r"\b(?:nop[lw]?|xchg\s+%ax,%ax|cs nopw?)\b|^\s*$")


def objects(build):
    """(target, file) -> path of the objects of our targets."""
    found = {}
    for path in sorted(build.rglob("*.o")):
        place = re.search(r"CMakeFiles/([^/]+)\.dir/(.*)$", path.relative_to(build).as_posix())
        if place and "cmake_pch" not in path.name:
            found[place[1], Path(place[2]).name] = path
    return found


def disassembly(path, *options):
    text = subprocess.run(["objdump", "-d", "-r", "-w", "--no-show-raw-insn", *options, path], check=True, text=True,
                          stdout=subprocess.PIPE).stdout
    return text.partition("Disassembly")[2]


def bodies(path):
    """Name -> its bodies (several where a name is local), without the places of constants."""
    parts = re.split(r"^<(.*)>:$", disassembly(path, "--no-addresses"), flags=re.M)
    found = defaultdict(list)
    for name, body in zip(parts[1::2], parts[2::2]):
        body = re.sub(r"<[^>]*>|\.(?:rodata|LC|text|bss|data)[\w.]*(?:[+-]0x[0-9a-f]+)?", "", body.split("\n\n")[0])
        found[name].append("\n".join(line for line in body.split("\n") if not PADDING.search(line)))
    return {name: sorted(texts) for name, texts in found.items()}


def differing(before, after):
    """Functions whose instructions differ; None where the objects are equal."""
    if disassembly(before) == disassembly(after):
        return None
    old, new = bodies(before), bodies(after)
    return sorted(name for name in old.keys() | new.keys() if old.get(name) != new.get(name))


def compare(before, after):
    """Lines to print, and how many objects differ."""
    old, new = objects(before), objects(after)
    lines = [f"only before: {' '.join(key)}" for key in sorted(old.keys() - new.keys())]
    lines += [f"only after: {' '.join(key)}" for key in sorted(new.keys() - old.keys())]
    both = sorted(old.keys() & new.keys())
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda key: differing(old[key], new[key]), both))
    for key, names in zip(both, results):
        if names is not None:
            lines.append(f"{' '.join(key)}: {len(names)} functions differ{', the order of others' if not names else ''}")
    differ = sum(names is not None for names in results)
    lines.append(f"{len(both)} objects in both, {len(both) - differ} equal")
    return lines, differ + len(old.keys() ^ new.keys())


def self_test():
    compiler = shutil.which("cc") or shutil.which("c++")
    with tempfile.TemporaryDirectory() as folder:
        def build(name, place, text):
            at = Path(folder) / name / place / "CMakeFiles/part.dir"
            at.mkdir(parents=True)
            (at / "a.c").write_text(text)
            subprocess.run([compiler, "-O1", "-c", "a.c", "-o", "a.c.o"], cwd=at, check=True)
            return Path(folder) / name

        one = "int f(int a) { return a + 1; }\n"
        two = "int g(int a) { return a * 3; }\n"
        before = build("before", "core", one + two)
        assert compare(before, build("moved", "low/core", "/* moved */\n" + one + two))[1] == 0
        lines, count = compare(before, build("ordered", "core", two + one))
        assert count == 1 and "0 functions differ" in lines[0], lines
        lines, count = compare(before, build("changed", "core", one + two.replace("3", "5")))
        assert count == 1 and "1 functions differ" in lines[0], lines
    print("same objects: self-test passed")


def main(arguments):
    if arguments == ["--self-test"]:
        self_test()
        return 0
    if len(arguments) != 2 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    lines, count = compare(*map(Path, arguments))
    print("\n".join(lines))
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
