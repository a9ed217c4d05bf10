#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the house is made of, counted: the table that the layout is judged by.

    tools/house.py                 the table
    tools/house.py --rooms         and lines, files and headers of each room
    tools/house.py --twins         and the functions that have one name in two rooms, and equal stretches of text
    tools/house.py --names         and each comparison with the name of an effect or of a model outside readers
    tools/house.py --self-test

Counted is what git keeps. A reader is a file that turns text into what it names: everything in files, logs, robots,
results.
"""

import argparse
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import check_layers  # noqa: E402

PRODUCT = list(check_layers.MODULES)
READERS = {"files", "logs", "robots", "results"}
WIDTH = 120
TWIN_LINES = 8


def tracked(root):
    names = subprocess.run(["git", "-C", root, "ls-files", "*.hpp", "*.cpp"], capture_output=True, text=True,
                           check=True)
    return {name: (root / name).read_text(encoding="utf-8") for name in names.stdout.split()}


def room_of(name):
    return check_layers.module_of(name)


def lines_of(files, rooms):
    return sum(text.count("\n") for name, text in files.items() if room_of(name) in rooms)


def installed(root, files):
    """Headers that are installed, and those of them that no other room, binding or example includes."""
    public = set().union(*check_layers.installed_headers(root).values())
    users = defaultdict(set)
    for name, text in files.items():
        for header in re.findall(r'#include (?:<wheelwright/|")([\w/]+\.hpp)[>"]', text):
            users[header].add(name)
    reached = {header for header in public
               if any(room_of(user) not in (room_of(header), "tests", "tools") for user in users[header])}
    grown = True
    while grown:  # what such a header includes is needed too
        below = {header for header in public - reached if any(user in reached for user in users[header])}
        reached |= below
        grown = bool(below)
    return public, public - reached


def known_names(files):
    """Names of models and of effects, from where they are listed."""
    effects = set(re.findall(r'\{\.name = "(\w+)"', files.get("model/effect_law.cpp", "")))
    effects |= {name for file, text in files.items() if file.startswith("gap/catalogue")
                for name in re.findall(r'\.name = "(\w+)"', text)}
    return {"differential_drive", "single_axis"}, effects


def comparisons(files, names):
    pattern = re.compile(r'[=!]= "(\w+)"|"(\w+)" [=!]=')
    found = []
    for name, text in sorted(files.items()):
        if room_of(name) not in PRODUCT or room_of(name) in READERS | {"reality", "python"}:
            continue
        for number, line in enumerate(text.splitlines(), 1):
            if any((a or b) in names for a, b in pattern.findall(line)):
                found.append(f"{name}:{number}: {line.strip()}")
    return found


def twins_by_name(files):
    """Free functions that sources of two rooms define under one name, with as many parameters."""
    where = defaultdict(set)
    for name, text in files.items():
        if name.endswith(".cpp") and room_of(name) in PRODUCT:
            for function, parameters in re.findall(r"^[A-Za-z][\w:<>,*& ]* \*?&?(\w+)\(([^;{}()]*)\) (?:const )?\{",
                                                   text, re.M):
                where[function, parameters.count(",") + bool(parameters.strip())].add(room_of(name))
    return {key: rooms for key, rooms in where.items() if len(rooms) > 1 and key[0] not in ("main", "run", "validate")}


def twins_by_text(files):
    """Stretches of TWIN_LINES lines or more (blanks and comments aside) that stand in two places of the product."""
    places = defaultdict(list)
    for name, text in files.items():
        if room_of(name) not in PRODUCT or not name.endswith(".cpp"):
            continue
        code = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)
                if line.strip() and not re.match(r"\s*(//|#include|\}|namespace)", line)]
        for k in range(len(code) - TWIN_LINES + 1):
            places["\n".join(line for _, line in code[k:k + TWIN_LINES])].append((name, code[k][0]))
    found = {}
    for at in places.values():
        if len(at) > 1:
            found.setdefault(tuple(sorted({name for name, _ in at})), at)
    return found


def table(root, files):
    product = {name: text for name, text in files.items() if room_of(name) in PRODUCT}
    public, unused = installed(root, files)
    models, effects = known_names(files)
    return [
        ("product lines (with python, reality)", sum(text.count("\n") for text in product.values()), 80000),
        ("files", len(product), 480),
        ("sources", sum(name.endswith(".cpp") for name in product), 230),
        ("lines of tests, benchmarks and fuzzers", lines_of(files, {"tests"}), 33000),
        ("installed headers", len(public), 120),
        ("of them used by no other room", len(unused), 0),
        ("comparisons with names of effects, outside readers", len(comparisons(files, effects)), 0),
        ("comparisons with names of models, outside readers", len(comparisons(files, models)), 0),
        (f"lines over {WIDTH} columns",
         sum(len(line) > WIDTH for text in files.values() for line in text.splitlines()), 0),
        ("functions of one name in two rooms", len(twins_by_name(files)), None),
        (f"pairs of files with {TWIN_LINES} equal lines", len(twins_by_text(files)), None),
    ]


def self_test():
    body = "".join(f"  x += {k};\n" for k in range(TWIN_LINES))
    files = {"gap/a.cpp": f'int twin(int a, int b) {{\n{body}}}\nbool f() {{ return effect == "drag"; }}\n',
             "design/b.cpp": f'int twin(int a, int b) {{\n{body}}}\nbool g() {{ return "single_axis" != m; }}\n',
             "robots/c.cpp": 'bool reads() { return m == "single_axis"; }\n'}
    assert list(twins_by_name(files)) == [("twin", 2)]
    assert list(twins_by_text(files)) == [("design/b.cpp", "gap/a.cpp")]
    assert len(comparisons(files, {"drag"})) == 1 and len(comparisons(files, {"single_axis"})) == 1
    print("house: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--rooms", "--twins", "--names", "--self-test"):
        parser.add_argument(option, action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return
    files = tracked(ROOT)
    for what, count, goal in table(ROOT, files):
        print(f"{count:8,}  {what}" + (f" (goal {goal:,})" if goal is not None else ""))
    if arguments.rooms:
        public = check_layers.public_headers(ROOT)
        for room in PRODUCT:
            own = [name for name in files if room_of(name) == room]
            print(f"{lines_of(files, {room}):8,}  {room}: {len(own)} files, {len(public.get(room, ()))} headers installed")
    if arguments.twins:
        for (function, count), rooms in sorted(twins_by_name(files).items()):
            print(f"{function}, {count} parameters: {', '.join(sorted(rooms))}")
        for names, at in sorted(twins_by_text(files).items()):
            print("equal text: " + ", ".join(f"{name}:{number}" for name, number in at))
    if arguments.names:
        models, effects = known_names(files)
        print("\n".join(comparisons(files, models | effects)))


if __name__ == "__main__":
    main()
