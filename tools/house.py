#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the house is made of, counted: the table that the layout is judged by.

    tools/house.py                 the table
    tools/house.py --write         puts it into docs/inside/architecture.md, between two marks
    tools/house.py --check         ends with 1 where that page says something else, where a name of an effect or of a
                                   model is compared outside readers, or where an arrow between modules points upwards
    tools/house.py --modules       and lines, files and headers of each module
    tools/house.py --headers       and own headers that the sources of each module pull in: mean, most, which source
    tools/house.py --twins         and the functions that have one name in two modules, and equal stretches of text
    tools/house.py --names         and each comparison with the name of an effect or of a model outside readers
    tools/house.py --self-test

Counted is what git keeps. A reader is a file that turns text into what it names:
everything in files, logs, robots, results. Modules and their folders are those of tools/check_layers.py; an arrow is a
module of which a header is included, and points upwards where that module stands later in that table.
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
from check_includes import headers_by_module, include_graph, pulled_in  # noqa: E402
from check_layers import MODULES, WIDTH, module_of  # noqa: E402

PAGE = "docs/inside/architecture.md"
BEGIN, END = "<!-- counted by tools/house.py --write -->", "<!-- end of what is counted -->"
WORLD = "reality"
PRODUCT = [*check_layers.PRODUCT, "app", "python", WORLD]
READERS = {"files", "logs", "robots", "results"}
TESTS = {"tests", WORLD}
LOOKERS = {"tests", "tools"}
TWIN_LINES = 8

# What the table is compared with: commit 542cf3a, before modules were cut by who needs them, ecc8359, before the layout
# was; and goals.
FORMER = {
    "entries at the top": (None, 43, 26),
    "of them folders": (None, 31, 17),
    "product lines (with python, without the test world)": (None, 116099, 104000),
    "product files": (797, 590, None),
    "product sources": (410, 317, None),
    "lines of C++ of tests, benchmarks, fuzzers and the test world": (None, 68932, 64000),
    "installed headers": (322, 122, 120),
    "of them used by no other module": (154, 0, 0),
    "arrows between modules": (None, 133, None),
    "of them upwards": (None, 0, 0),
    "arrows between folders at the top": (None, 133, 54),
    "of them on a circle": (None, 0, 0),
    "own headers that a source of app pulls in, mean": (None, 100, 45),
    "own headers that a source pulls in, most": (None, 153, 70),
    "comparisons with names of effects, outside readers": (63, 1, 0),
    "comparisons with names of models, outside readers": (41, 0, 0),
    f"lines of C++ over {WIDTH} columns": (652, 86, 0),
    "functions of one name in two modules": (None, 95, None),
    f"pairs of files with {TWIN_LINES} equal lines": (None, 2, None),
}


def listed(root):
    done = subprocess.run(["git", "-C", root, "ls-files"], capture_output=True, text=True, check=True)
    return [name for name in done.stdout.splitlines() if (root / name).is_file()]


def tracked(root, names):
    return {name: (root / name).read_text(encoding="utf-8") for name in names if name.endswith((".hpp", ".cpp"))}


def at_the_top(names):
    """Entries of the root, and how many of them are folders."""
    return len({name.split("/")[0] for name in names}), len({name.split("/")[0] for name in names if "/" in name})


def lines_of(files, modules):
    return sum(text.count("\n") for name, text in files.items() if module_of(name) in modules)


def most_headers(graph):
    """module -> (mean, most, the source with most) of the own headers that its sources pull in."""
    return {module: (sum(own.values()) / len(own), max(own.values()), max(own, key=own.get))
            for module, own in headers_by_module(graph).items() if module in PRODUCT}


def arrows(graph):
    """Pairs of modules of the product of which the first includes the second; and those that point upwards."""
    found = {(module_of(name), module_of(header)) for name, headers in graph.items() for header in headers}
    found = {(user, used) for user, used in found if user != used and {user, used} <= set(PRODUCT)}
    return found, {(user, used) for user, used in found if PRODUCT.index(used) > PRODUCT.index(user)}


def folder_arrows(graph):
    """The same between the product's folders at the top, the test world's apart; and those that lie on a circle."""
    top = lambda name: name.split("/")[0]
    folders = {top(MODULES[module] + "/") for module in PRODUCT if module != WORLD}
    found = {(top(name), top(header)) for name, headers in graph.items() for header in headers}
    found = {(user, used) for user, used in found if user != used and {user, used} <= folders}
    reach = set(found)
    while more := {(a, d) for a, b in reach for c, d in found if b == c} - reach:
        reach |= more
    return found, {(user, used) for user, used in found if (used, user) in reach}


def installed(root, graph):
    """Headers that are installed, and those of them that no other module, binding or example includes."""
    public = set().union(*check_layers.installed_headers(root).values())
    users = defaultdict(set)
    for name, headers in graph.items():
        for header in headers:
            users[header].add(name)
    reached = {header for header in public
               if any(module_of(user) not in {module_of(header), *LOOKERS} for user in users[header])}
    grown = True
    while grown:  # what such a header includes is needed too
        below = {header for header in public - reached if any(user in reached for user in users[header])}
        reached |= below
        grown = bool(below)
    return public, public - reached


def known_names(files):
    """Names of models and of effects, from where they are listed."""
    effects = {name for file, text in files.items()
               if Path(file).name == "effect_law.cpp" or Path(file).name.startswith("catalogue")
               for name in re.findall(r'\.name = "(\w+)"', text)}
    return {"differential_drive", "single_axis"}, effects


def comparisons(files, names):
    pattern = re.compile(r'[=!]= "(\w+)"|"(\w+)" [=!]=')
    found = []
    for name, text in sorted(files.items()):
        if module_of(name) not in PRODUCT or module_of(name) in READERS | {WORLD, "python"}:
            continue
        for number, line in enumerate(text.splitlines(), 1):
            if any((a or b) in names for a, b in pattern.findall(line)):
                found.append(f"{name}:{number}: {line.strip()}")
    return found


def twins_by_name(files):
    """Free functions that sources of two modules define under one name, with as many parameters."""
    where = defaultdict(set)
    pattern = re.compile(r"^[A-Za-z][\w:<>,*& ]* \*?&?(\w+)\(([^;{}()]*)\) (?:const )?\{", re.M)
    for name, text in files.items():
        if name.endswith(".cpp") and module_of(name) in PRODUCT:
            for function, parameters in pattern.findall(text):
                where[function, parameters.count(",") + bool(parameters.strip())].add(module_of(name))
    return {key: modules for key, modules in where.items()
            if len(modules) > 1 and key[0] not in ("main", "run", "validate")}


def twins_by_text(files):
    """Stretches of TWIN_LINES lines or more (blanks and comments aside) that stand in two places of the product."""
    places = defaultdict(list)
    for name, text in files.items():
        if module_of(name) not in PRODUCT or not name.endswith(".cpp"):
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


def counts(root, names, files):
    """What is counted -> its number, in the order of the table."""
    graph = include_graph(files)
    entries, folders = at_the_top(names)
    product = [name for name in files if module_of(name) in PRODUCT]
    public, unused = installed(root, graph)
    models, effects = known_names(files)
    headers = most_headers(graph)
    between, upwards = arrows(graph)
    outer, circles = folder_arrows(graph)
    numbers = [
        entries,
        folders,
        lines_of(files, set(PRODUCT) - {WORLD}),
        len(product),
        sum(name.endswith(".cpp") for name in product),
        lines_of(files, TESTS),
        len(public),
        len(unused),
        len(between),
        len(upwards),
        len(outer),
        len(circles),
        round(headers["app"][0]),
        max(most for _, most, _ in headers.values()),
        len(comparisons(files, effects)),
        len(comparisons(files, models)),
        sum(len(line) > WIDTH for text in files.values() for line in text.splitlines()),
        len(twins_by_name(files)),
        len(twins_by_text(files)),
    ]
    return dict(zip(FORMER, numbers, strict=True))


def table(counted):
    show = lambda number: "–" if number is None else f"{number:,}"
    rows = ["| | 542cf3a | ecc8359 | goal | today |", "|---|---|---|---|---|"]
    for what, number in counted.items():
        rows.append("| " + " | ".join([what, *map(show, (*FORMER[what], number))]) + " |")
    return "\n".join(rows) + "\n"


def with_table(page, made):
    """The page with `made` between its marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"house: {PAGE}: expected the lines {BEGIN} and {END} around the table")
    return f"{before}{BEGIN}\n{made}{END}{after}"


def complaints(page, files, counted):
    """What --check finds: a line each."""
    if page != with_table(page, table(counted)):
        yield f"{PAGE}: the table is not what is counted: tools/house.py --write makes it anew"
    models, effects = known_names(files)
    for found in comparisons(files, models | effects):
        yield f"{found}: a name is compared; expected a property that its catalogue says"
    for user, used in sorted(arrows(include_graph(files))[1]):
        yield f"{user} includes {used}, which stands above it: expected no arrow upwards"
    for user, used in sorted(folder_arrows(include_graph(files))[1]):
        yield f"{user}/ includes {used}/, which includes it in turn: expected no circle"


def self_test():
    place = lambda module, leaf: f"{MODULES[module]}/{leaf}"
    body = "".join(f"  x += {k};\n" for k in range(TWIN_LINES))
    files = {"gap/a.cpp": f'int twin(int a, int b) {{\n{body}}}\nbool f() {{ return effect == "drag"; }}\n',
             place("design", "b.cpp"): f'int twin(int a, int b) {{\n{body}}}\nbool g() {{ return "single_axis" != m; }}\n',
             place("robots", "c.cpp"): 'bool reads() { return m == "single_axis"; }\n'}
    assert list(twins_by_name(files)) == [("twin", 2)]
    assert list(twins_by_text(files)) == [(place("design", "b.cpp"), "gap/a.cpp")]
    assert len(comparisons(files, {"drag"})) == 1 and len(comparisons(files, {"single_axis"})) == 1
    files = {"core/a.hpp": "", "gap/b.hpp": '#include "core/a.hpp"\n', "app/own.hpp": "#include <vector>\n",
             "app/c.cpp": '#include "app/own.hpp"\n#include "gap/b.hpp"\n#include "none.hpp"\n',
             "tests/gap/t.cpp": '#include "tests/support/s.hpp"\n', "tests/support/s.hpp": "", "core/up.cpp": ""}
    graph = include_graph(files)
    assert graph["tests/gap/t.cpp"] == ["tests/support/s.hpp"]
    assert pulled_in("app/c.cpp", graph) == {"app/own.hpp", "gap/b.hpp", "core/a.hpp"}
    assert most_headers(graph) == {"app": (3, 3, "app/c.cpp"), "core": (0, 0, "core/up.cpp")}
    assert arrows(graph) == ({("gap", "core"), ("app", "gap")}, set())
    graph = include_graph(files | {"core/up.cpp": '#include "gap/b.hpp"\n'})
    assert arrows(graph)[1] == {("core", "gap")}
    assert folder_arrows(graph) == ({("gap", "core"), ("app", "gap"), ("core", "gap")}, {("gap", "core"), ("core", "gap")})
    assert at_the_top([".ci/run", "README.md", "gap/a.cpp", "gap/b/c.cpp"]) == (3, 2)
    counted = dict.fromkeys(FORMER, 7)
    page = with_table(f"a\n{BEGIN}\nstale\n{END}\nb\n", table(counted))
    assert page.startswith("a\n") and page.endswith("\nb\n") and "stale" not in page
    assert not list(complaints(page, {}, counted))
    assert len(list(complaints(page, {}, counted | {"entries at the top": 8}))) == 1
    planted = {"model/effect_law.cpp": '{.name = "drag"}\n', "gap/a.cpp": 'if (name == "drag") {\n',
               "core/a.cpp": '#include "gap/b.hpp"\n', "gap/b.hpp": ""}
    assert len(list(complaints(page, planted, counted))) == 2
    print("house: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--write", "--check", "--modules", "--headers", "--twins", "--names", "--self-test"):
        parser.add_argument(option, action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return 0
    names = listed(ROOT)
    files = tracked(ROOT, names)
    counted = counts(ROOT, names, files)
    page = ROOT / PAGE
    if arguments.write:
        page.write_text(with_table(page.read_text(encoding="utf-8"), table(counted)), encoding="utf-8")
    if arguments.check:
        found = list(complaints(page.read_text(encoding="utf-8"), files, counted))
        print("\n".join(found) or "house: the table is what is counted")
        return 1 if found else 0
    for what, count in counted.items():
        goal = FORMER[what][2]
        print(f"{count:8,}  {what}" + (f" (goal {goal:,})" if goal is not None else ""))
    if arguments.modules:
        public = check_layers.public_headers(ROOT)
        for module in PRODUCT:
            own = [name for name in files if module_of(name) == module]
            print(f"{lines_of(files, {module}):8,}  {module}: {len(own)} files, "
                  f"{len(public.get(module, ()))} headers for others")
    if arguments.headers:
        for module, (mean, most, source) in most_headers(include_graph(files)).items():
            print(f"{mean:8.1f}  {module}: at most {most} ({source})")
    if arguments.twins:
        for (function, count), modules in sorted(twins_by_name(files).items()):
            print(f"{function}, {count} parameters: {', '.join(sorted(modules))}")
        for of, at in sorted(twins_by_text(files).items()):
            print("equal text: " + ", ".join(f"{name}:{number}" for name, number in at))
    if arguments.names:
        models, effects = known_names(files)
        print("\n".join(comparisons(files, models | effects)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
