#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the layering of the house and a few of its habits; ctest runs it.

    check_layers.py [ROOT]        every finding on a line "file:line: message"; exit code 1 when there is one
    check_layers.py --self-test   plants each violation in a scratch tree and expects it to be found
"""

import os
import re
import sys
import tempfile
from pathlib import Path

# Room -> rooms whose headers it may include, its own apart (None: all of them). A room looks down, never up; the rooms of
# a storey stand in the order in which they may see each other.
GROUND = ["core", "model", "filter", "bounds", "detector"]
DOORS = ["files", "logs", "sim", "robots"]
FIRST = ["identify", "commission", "inference", "doctor"]
SECOND = ["design", "gap", "study"]
ROOF = ["words", "results", "export", "report"]
HOUSE = GROUND + DOORS + FIRST + SECOND + ROOF
PURE = set(HOUSE) - {"files", "logs", "robots", "results", "export"}


def below(room):
    """What stands before `room` and opens no file: who computes is handed what was read."""
    return set(HOUSE[: HOUSE.index(room)]) & (PURE if room in PURE else set(HOUSE))


MAY_INCLUDE = {
    **{room: below(room) for room in HOUSE},
    "bounds": {"core"},
    "files": {"core"},
    "logs": {"core", "files"},
    "sim": {"core", "model"},
    "identify": {"core", "model", "filter"},
    "commission": set(GROUND) | {"identify"},
    "inference": set(GROUND) | {"identify", "commission"},
    "doctor": set(GROUND) | {"identify", "commission", "inference"},
    "export": set(GROUND) | {"files", "robots"},
    "app": None,
    "python": None,
    "reality": {"core", "files", "logs"},
    "tests": None,
    "examples": None,
    "bench": None,
}

# Rooms whose namespace is not called as they are.
SPACE = {"export": "exporter"}

# Results are functions of their arguments (seeds are arguments); doors and roof open files.
BANNED_HEADERS = {
    "fstream": "only doors and results open files",
    "iostream": "results are returned, not printed",
    "filesystem": "only doors and results open files",
    "chrono": "no clock here",
    "ctime": "no clock here",
    "time.h": "no clock here",
}
# One file each, and why; no time that passes enters a result.
EXCEPTIONS = {
    ("study/work_on_ranks.cpp", "chrono"): "MPI's own waits keep a processor busy: it sleeps between looks",
}
BANNED_CODE = {
    r"\bstd::random_device\b": "generators are seeded and local",
    r"(?<![\w.>])(?:std::)?s?rand\s*\(": "generators are seeded and local",
    r"\bstd::(?:time|clock)\s*\(": "no clock here",
    r"\bstd::(?:cout|cerr|clog)\b": "results are returned, not printed",
    r"\bf?printf\s*\(": "results are returned, not printed",
    r"\bfopen\s*\(": "only doors and results open files",
}

# Third-party headers that belong to some rooms only: pattern -> (rooms, why).
OUTSIDE = {
    r"ceres/|nlopt": ({"identify", "inference", "design", "gap"}, "solvers stay where they are used"),
    r"[Cc]lp|[Cc]oin": (set(), "CLP is a peer in bench"),
    r"mpi\.h$": ({"study"}, "one room shares work out"),
    r"yaml-cpp/": ({"files", "logs", "robots", "results", "app"}, "text is read at the doors"),
    r"nlohmann/": ({"files", "logs", "robots", "results", "app", "report"}, "text is read at the doors"),
}
SOLVERS_IN_SOURCES_ONLY = r"ceres/|nlopt|[Cc]lp|[Cc]oin|mpi\.h$"

# Paths of somebody's machine have no place in the project; written so that this file does not name them.
PRIVATE_PATHS = re.compile(r"(?<![\w.~-])/(?:" + "wor" + r"k(?![\w-])|" + "tmp/bash" + r"_jobs|" + "roo" + r"t/|" + "hom" + r"e/\w)")

CODE = {".hpp", ".cpp", ".cmake", ".py", ".sh", ".js", ".css"}
TEXT = CODE | {".md", ".yaml", ".yml", ".json", ".txt", ".cff", ".bib", ".in", ""}
SKIP = re.compile(r"^(?:\.git|\.cache|build.*|node_modules|out|__pycache__)$")
# A type that is defined in two headers of one namespace is two types of one name to the linker, which keeps one of them.
TYPE = re.compile(r"^(?:(?:struct|class|enum class|enum)\s+(\w+)\b(?!\s*<)[^;]*$|using\s+(\w+)\s*=)", re.M)
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def files(root):
    for directory, names, leaves in os.walk(root):
        names[:] = sorted(n for n in names if not SKIP.match(n))
        for leaf in sorted(leaves):
            path = Path(directory) / leaf
            if path.suffix in TEXT and not path.is_symlink():
                yield path


def without_comments(text):
    """The text with comments and string literals blanked, line by line as it was."""
    blank = lambda m: re.sub(r"[^\n]", " ", m.group(0))
    return re.sub(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"', blank, text, flags=re.S)


def check_code(room, relative, text, report):
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        header = match.group(1)
        ours = re.match(r"wheelwright/(\w+)/", header)
        if ours and room in MAY_INCLUDE:
            allowed = MAY_INCLUDE[room]
            if allowed is not None and ours.group(1) != room and ours.group(1) not in allowed:
                report(relative, number, f"{room}/ may not include {header}")
        if room in PURE and header in BANNED_HEADERS and (relative.as_posix(), header) not in EXCEPTIONS:
            report(relative, number, f"<{header}> in {room}/: {BANNED_HEADERS[header]}")
        if room in HOUSE:
            for pattern, (rooms, why) in OUTSIDE.items():
                if re.match(pattern, header) and room not in rooms:
                    report(relative, number, f"<{header}> in {room}/: {why}")
            if relative.suffix == ".hpp" and re.match(SOLVERS_IN_SOURCES_ONLY, header):
                report(relative, number, f"<{header}> in a header: solvers belong in .cpp files")
    if room in PURE:
        for number, line in enumerate(without_comments(text).splitlines(), 1):
            for pattern, why in BANNED_CODE.items():
                found = re.search(pattern, line)
                if found:
                    report(relative, number, f"{found.group(0).strip()} in {room}/: {why}")
    if relative.suffix == ".hpp" and not re.search(r"^#pragma once$", text, re.M):
        report(relative, 1, "no #pragma once")


def check_space(room, relative, text, report):
    """Code of a room is in the room's namespace; in wheelwright itself stands what a header lends it."""
    space = "wheelwright::" + SPACE.get(room, room)
    for opened in re.finditer(r"^namespace (wheelwright(?:::\w+)*) \{\n", text, re.M):
        lent = relative.suffix == ".hpp" and re.compile(r"(?:(?:using \w+|namespace \w+ = \w+)::\w+;\n)+\}").match(text, opened.end())
        if not f"{opened.group(1)}::".startswith(f"{space}::") and not (opened.group(1) == "wheelwright" and lent):
            report(relative, text[: opened.start()].count("\n") + 1, f"namespace {opened.group(1)} in {room}/: expected {space}")


def check_links(room, relative, text, report):
    """What the room's CMakeLists.txt links is what the table lets it include."""
    allowed = MAY_INCLUDE[room]
    used = re.search(r"\bUSES\s+([a-z_\s]+)", text)
    if allowed is None or not used:
        return
    number = text[: used.start()].count("\n") + 1
    for other in used.group(1).split():
        if other != room and other not in allowed:
            report(relative, number, f"{room}/ may not use {other}")


def listed_headers(root, kinds):
    """room -> headers after the words `kinds` in its CMakeLists.txt; rooms without any are not in it."""
    headers = {}
    for room in HOUSE:
        path = root / room / "CMakeLists.txt"
        if path.is_file():
            for listed in re.findall(rf"\b(?:{kinds})\s+((?:[\w.]+\.hpp\s*)+)", path.read_text(encoding="utf-8")):
                headers.setdefault(room, set()).update(listed.split())
    return headers


def installed_headers(root):
    return listed_headers(root, "HEADERS")


def public_headers(root):
    """Those that other rooms may include: installed, or shared with the rooms above."""
    return listed_headers(root, "HEADERS|SHARED")


def check_private(room, relative, text, public, installed, report):
    """Headers that no list names are their own room's; tests and benchmarks may look into every room. What is installed
    includes what is installed."""
    if room in ("tests", "bench", "tools", "fuzz"):
        return
    lent = relative.name in installed.get(room, ())
    for number, line in enumerate(text.splitlines(), 1):
        ours = re.match(r'^\s*#\s*include\s*<wheelwright/(\w+)/([\w.]+)>', line)
        if not ours or ours.group(1) not in public:
            continue
        if ours.group(1) != room and ours.group(2) not in public[ours.group(1)]:
            report(relative, number, f"{ours.group(1)}/{ours.group(2)} is private to its room")
        elif lent and ours.group(2) not in installed.get(ours.group(1), ()):
            report(relative, number, f"{ours.group(1)}/{ours.group(2)} is not installed, {relative} is")


def check_types(relative, text, types, report):
    for match in TYPE.finditer(without_comments(text)):
        name = match.group(1) or match.group(2)
        number = text[: match.start()].count("\n") + 1
        if name in types:
            report(relative, number, f"{name} is defined in {types[name]} too")
        types.setdefault(name, relative)


def check(root):
    findings = []
    types = {}
    public, installed = public_headers(Path(root)), installed_headers(Path(root))
    report = lambda path, line, message: findings.append(f"{path}:{line}: {message}")
    for path in files(root):
        relative = path.relative_to(root)
        room = relative.parts[0] if len(relative.parts) > 1 else ""
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            if path.suffix in CODE:
                report(relative, 1, "not UTF-8")
            continue
        script = path.suffix == "" and text.startswith("#!")
        if path.suffix in CODE or path.name == "CMakeLists.txt" or script:
            if not re.search(r"SPDX-License-Identifier: Apache-2\.0", "\n".join(text.splitlines()[:3])):
                report(relative, 1, "no SPDX-License-Identifier: Apache-2.0 in the first lines")
        for number, line in enumerate(text.splitlines(), 1):
            named = PRIVATE_PATHS.search(line)
            if named:
                report(relative, number, f"names {named.group(0)}, a path of one machine")
        if path.suffix in (".hpp", ".cpp"):
            check_code(room, relative, text, report)
            check_private(room, relative, text, public, installed, report)
            if room in (*HOUSE, "app", "python", "reality"):
                check_space(room, relative, text, report)
        if path.suffix == ".hpp" and room in HOUSE:
            check_types(relative, text, types, report)
        if path.name == "CMakeLists.txt" and room in MAY_INCLUDE:
            check_links(room, relative, text, report)
    return findings


def self_test():
    spdx = "// SPDX-License-Identifier: Apache-2.0\n"
    head = spdx + "#pragma once\n"
    clean = {
        "core/a.hpp": head + "#include <vector>\n// a random comment on rand() and std::cout\nstruct A {\n};\n",
        "bounds/b.hpp": head + "#include <wheelwright/core/a.hpp>\nstruct A;\nstruct B {};\nstruct B<2> {};\n",
        "model/m.hpp": head + "namespace wheelwright::model {\nint f();\n}\n\nnamespace wheelwright {\nusing model::f;\n}\n",
        "files/c.cpp": spdx + "#include <fstream>\n#include <wheelwright/core/a.hpp>\n",
        "inference/robust.cpp": spdx + "#include <ceres/ceres.h>\n",
        "study/work_on_ranks.cpp": spdx + "#include <chrono>\n#include <mpi.h>\n",
        "detector/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\nwheelwright_room(detector\n  USES core filter\n  LINK x)\n",
        "filter/CMakeLists.txt": "# SPDX-License-Identifier: Apache-2.0\nwheelwright_room(filter\n  HEADERS a.hpp\n    b.hpp\n  SHARED s.hpp\n  SOURCES c.cpp)\n",
        "detector/shared.cpp": spdx + "#include <wheelwright/filter/s.hpp>\n",
        "docs/framework.md": "framework/works on http://host/working and a/" + "work\n",
    }
    violations = {
        "upward include": ("bounds/x.hpp", head + "#include <wheelwright/filter/b.hpp>\n"),
        "commission in identify": ("identify/x.cpp", spdx + "#include <wheelwright/commission/s.hpp>\n"),
        "roof in a door": ("logs/x.cpp", spdx + "#include <wheelwright/report/s.hpp>\n"),
        "door in report": ("report/x.cpp", spdx + "#include <wheelwright/robots/s.hpp>\n"),
        "private header": ("detector/y.cpp", spdx + "#include <wheelwright/filter/b.hpp>\n#include <wheelwright/filter/c.hpp>\n"),
        "not installed": ("filter/a.hpp", head + "#include <wheelwright/filter/s.hpp>\n"),
        "linked upwards": ("identify/CMakeLists.txt", "# SPDX-License-Identifier: Apache-2.0\nwheelwright_room(identify\n  USES core bounds)\n"),
        "another room's namespace": ("bounds/x.cpp", spdx + "namespace wheelwright::core {\n}\n"),
        "no room's namespace": ("bounds/x.hpp", head + "namespace wheelwright {\nint f();\n}\n"),
        "file opened": ("commission/x.cpp", spdx + "#include <fstream>\n"),
        "printing": ("filter/x.cpp", spdx + "void f() { std::cout << 1; }\n"),
        "clock": ("identify/x.cpp", spdx + "#include <chrono>\n"),
        "another clock": ("study/work_on_ranks.hpp", head + "#include <chrono>\n"),
        "MPI in a header": ("study/x.hpp", head + "#include <mpi.h>\n"),
        "MPI elsewhere": ("logs/x.cpp", spdx + "#include <mpi.h>\n"),
        "device": ("sim/x.cpp", spdx + "std::random_device device;\n"),
        "rand": ("sim/x.cpp", spdx + "int f() { return rand(); }\n"),
        "solver in header": ("identify/x.hpp", head + "#include <nlopt.hpp>\n"),
        "CLP in a room": ("bounds/x.cpp", spdx + "#include <CoinPackedMatrix.hpp>\n"),
        "solver elsewhere": ("detector/x.cpp", spdx + "#include <nlopt.hpp>\n"),
        "no licence": ("core/x.cpp", "int x;\n"),
        "no licence in a script": ("tools/x", "#!/bin/sh\ntrue\n"),
        "one name, two types": ("detector/x.hpp", head + "class A final {\n};\n"),
        "one name, a type and an alias": ("detector/x.hpp", head + "using A = int;\n"),
        "no guard": ("core/x.hpp", spdx),
        "private path": ("docs/x.md", "see /" + "work/main\n"),
        "another private path": ("examples/x.yaml", "log: /" + "tmp/bash_jobs.0/x\n"),
    }
    failures = 0

    def tree(extra):
        with tempfile.TemporaryDirectory() as root:
            for name, text in {**clean, **extra}.items():
                path = Path(root) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            return check(Path(root))

    found = tree({})
    if found:
        failures += 1
        print("clean tree:", *found, sep="\n  ")
    for what, (name, text) in violations.items():
        found = tree({name: text})
        if len(found) != 1 or not found[0].startswith(name + ":"):
            failures += 1
            print(f"{what}: expected one finding in {name}, got", *(found or ["none"]), sep="\n  ")
    print(f"{len(violations) + 1 - failures} passed, {failures} failed")
    return failures


def main(arguments):
    if arguments == ["--self-test"]:
        return 1 if self_test() else 0
    if len(arguments) > 1 or (arguments and arguments[0].startswith("-")):
        print(__doc__, file=sys.stderr)
        return 2
    root = Path(arguments[0]) if arguments else Path(__file__).resolve().parent.parent
    findings = check(root)
    for finding in findings:
        print(finding)
    if not findings:
        print("layers: nothing to report")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
