#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which lines of the product ran, by module, after a build with --coverage was used (tests/long.sh coverage).

    tools/coverage.py [FOLDER]               a table in Markdown, of build-coverage or of another build folder
    tools/coverage.py [FOLDER] --uncovered   then what did not run, as file:first-last
    tools/coverage.py [FOLDER] --source      the same with the text of these lines
    tools/coverage.py --self-test

    --module MODULE    this module alone; may be given several times

A line can run when GCC made code of it in any object: templates that nothing instantiates and inline functions that
nothing calls are not counted, nor are lines without a letter or digit, nor a second `return` of a constant that GCC
joins with the first. Runs of a line are added up over objects and instantiations. A process that is killed, or ends by
_exit, leaves no counts: what only such processes reach is listed as not run. One that is killed while it writes them
damages a file, and later processes say so on standard error (`Merge mismatch`).
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import check_layers  # noqa: E402

PRODUCT = list(check_layers.MODULES)


def counts_of(folder, root):
    """File below a module of `root` -> line -> how often it ran, of all objects below `folder`."""
    counts = defaultdict(lambda: defaultdict(int))
    names = {}

    def name_of(path):
        """The file's name below `root`, through links of the build folder; None where it is in no module."""
        if path not in names:
            real = Path(path).resolve()
            inside = real.relative_to(root).as_posix() if real.is_relative_to(root) else ""
            names[path] = inside if check_layers.module_of(inside) in PRODUCT else None
        return names[path]

    for notes in sorted(folder.rglob("*.gcno")):
        told = subprocess.run(["gcov", "--json-format", "--stdout", notes], cwd=folder, check=True, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for report in map(json.loads, told.splitlines()):
            for file in report["files"]:
                name = name_of(str(Path(report["current_working_directory"], file["file"])))
                for line in file["lines"] if name else ():
                    counts[name][line["line_number"]] += line["count"]
    return counts


def only_words(counts, root):
    """The counts of lines that have a letter or a digit; and the lines of each file."""
    texts = {name: (root / name).read_text(encoding="utf-8").splitlines() for name in counts}
    return {name: {number: count for number, count in lines.items() if re.search(r"\w", texts[name][number - 1])}
            for name, lines in counts.items()}, texts


def table(counts):
    """Markdown: lines that can run and the share of them that did, by module and of all."""
    modules = {module: [0, 0] for module in PRODUCT}
    for name, lines in counts.items():
        module = modules[check_layers.module_of(name)]
        module[0] += len(lines)
        module[1] += sum(count != 0 for count in lines.values())
    rows = ["| module | lines | did not run | ran |", "|---|---|---|---|"]
    every = [sum(numbers) for numbers in zip(*modules.values())]
    for module, (lines, ran) in [*modules.items(), ("all", every)]:
        if lines:
            rows.append(f"| {module} | {lines:,} | {lines - ran:,} | {100 * ran / lines:.1f} % |")
    return "\n".join(rows)


def uncovered(counts):
    """(file, first, last) of what did not run, with nothing that ran in between; modules in their order, then by name."""
    found = []
    for name in sorted(counts, key=lambda name: (PRODUCT.index(check_layers.module_of(name)), name)):
        open_one = None
        for number, count in sorted(counts[name].items()):
            if count:
                open_one = None
            elif open_one:
                open_one[2] = number
            else:
                open_one = [name, number, number]
                found.append(open_one)
    return [tuple(each) for each in found]


def listing(counts, texts, source):
    rows = []
    for name, first, last in uncovered(counts):
        rows.append(f"{name}:{first}" + (f"-{last}" if last > first else ""))
        if source:
            rows += [f"    {text}" for text in texts[name][first - 1 : last]]
    return "\n".join(rows)


def self_test():
    texts = {
        "core/a.hpp": "#pragma once\ntemplate <int n>\nint part(int a) {\n  if (a > n)\n    return a / 9;\n"
                      "  return a % 5;\n}\ninline int never(int a) {\n  return a;\n}\n",
        "core/a.cpp": '#include "include/a.hpp"\nint used(int a) {\n  if (a < 0) {\n    a = -a;\n    a *= 3;\n  }\n'
                      "  return part<3>(a);\n}\nint unused(int a)\n{\n  return never(a);\n}\n",
        "bounds/b.cpp": '#include "include/a.hpp"\nint other(int a) {\n  return part<5>(a);\n}\n',
        "build/unity.cpp": '#include "core/a.cpp"\n#include "bounds/b.cpp"\n',
        "tests/main.cpp": "#include <string>\nint used(int a);\nint other(int a);\n"
                          "int main(int argc, char**) {\n  if (argc > 9)\n    return 3;\n"
                          "  return std::to_string(used(9) + other(0)).size() - 1;\n}\n",
    }
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch).resolve()
        for name, text in texts.items():
            (root / name).parent.mkdir(exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        (root / "build/include").symlink_to(root / "core")
        for name in ("build/unity.cpp", "tests/main.cpp"):
            subprocess.run(["g++", "--coverage", "-I.", "-Ibuild", "-c", name, "-o", f"build/{Path(name).stem}.o"],
                           cwd=root,
                           check=True)
        subprocess.run(["g++", "--coverage", "build/unity.o", "build/main.o", "-o", "build/program"], cwd=root,
                       check=True)
        subprocess.run(["build/program"], cwd=root, check=True)
        counts, lines = only_words(counts_of(root / "build", root), root)
        assert set(counts) == {"core/a.hpp", "core/a.cpp", "bounds/b.cpp"}, counts
        assert counts["core/a.hpp"][4] == 2 and counts["core/a.hpp"][5] == 1 and counts["core/a.hpp"][6] == 1, counts
        found = uncovered(counts)
        assert found == [("core/a.cpp", 4, 5), ("core/a.cpp", 9, 11), ("core/a.hpp", 8, 9)], found
        shown = table(counts)
        assert "| bounds | 2 | 0 | 100.0 % |" in shown and "| all | 15 | 6 | 60.0 % |" in shown, shown
        listed = listing(counts, lines, True)
        assert listed.startswith("core/a.cpp:4-5\n        a = -a;\n        a *= 3;\n"), listed
    print("coverage: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build-coverage")
    for option in ("--uncovered", "--source", "--self-test"):
        parser.add_argument(option, action="store_true")
    parser.add_argument("--module", action="append", choices=PRODUCT)
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return
    counts, texts = only_words(counts_of(arguments.folder.resolve(), ROOT), ROOT)
    if not counts:
        sys.exit(f"coverage: no counts in {arguments.folder}: build it with the preset `coverage`")
    if arguments.module:
        counts = {name: lines for name, lines in counts.items() if check_layers.module_of(name) in arguments.module}
    print(table(counts))
    if arguments.uncovered or arguments.source:
        print()
        print(listing(counts, texts, arguments.source))


if __name__ == "__main__":
    main()
