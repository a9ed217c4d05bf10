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

# Module -> its folder, from the lowest to the highest; a module of a layer sees those before it, the table below takes
# away what it does not need. CMakeLists.txt lists the same folders, in the order in which they are built.
LAYERS = [
    ("on the robot", {
        "core": "core",
        "model": "model",
        "filter": "model/filter",
        "bounds": "bounds",
        "detector": "detector",
    }),
    ("formats", {
        "files": "formats/files",
        "logs": "formats/logs",
        "sim": "model/sim",
        "robots": "formats/robots",
    }),
    ("commissioning", {
        "identify": "identify",
        "inference": "identify/inference",
        "commission": "commission",
        "doctor": "commission/doctor",
    }),
    ("studies", {
        "design": "commission/design",
        "gap": "gap",
        "study": "study",
    }),
    ("answers", {
        "words": "results/words",
        "results": "results",
        "export": "detector/export",
        "report": "results/report",
    }),
    ("programs", {
        "app": "app",
        "python": "python",
    }),
    ("tests", {
        "reality": "tests/world",
    }),
]
MODULES = {name: folder for _, modules in LAYERS for name, folder in modules.items()}
PRODUCT = [name for layer, modules in LAYERS for name in modules if layer not in ("programs", "tests")]
PURE = set(PRODUCT) - {"files", "logs", "robots", "results", "export"}
BY_FOLDER = sorted(MODULES.items(), key=lambda item: -len(item[1]))


def module_of(path):
    """The module that holds `path` (from the root, with slashes); of other files, tests of a module among them, the first
    folder, "" of those on top."""
    if path.endswith("_test.cpp"):
        return path.split("/")[0]
    for name, folder in BY_FOLDER:
        if path.startswith(folder + "/"):
            return name
    return path.split("/")[0] if "/" in path else ""


def below(module):
    """What stands before `module` and opens no file: who computes is handed what was read."""
    return set(PRODUCT[: PRODUCT.index(module)]) & (PURE if module in PURE else set(PRODUCT))


ROBOT = set(LAYERS[0][1])
MAY_INCLUDE = {
    **{module: below(module) for module in PRODUCT},
    "bounds": {"core"},
    "files": {"core"},
    "logs": {"core", "files"},
    "sim": {"core", "model"},
    "identify": {"core", "model", "filter"},
    "inference": ROBOT | {"identify"},
    "commission": ROBOT | {"identify", "inference"},
    "doctor": ROBOT | {"identify", "commission", "inference"},
    "export": ROBOT | {"files", "robots"},
    "app": None,
    "python": None,
    "reality": {"core", "files", "logs"},
}

# Modules whose namespace is not called as they are.
SPACE = {"export": "exporter"}

# Results are functions of their arguments (seeds are arguments); formats, results and programs open files.
BANNED_HEADERS = {
    "fstream": "only formats and results open files",
    "iostream": "results are returned, not printed",
    "filesystem": "only formats and results open files",
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
    r"\bfopen\s*\(": "only formats and results open files",
}

# Third-party headers that belong to some modules only: pattern -> (modules, why).
OUTSIDE = {
    r"ceres/|nlopt": ({"identify", "inference", "commission", "design", "gap"}, "solvers stay where they are used"),
    r"[Cc]lp|[Cc]oin": (set(), "CLP is a peer in benchmarks"),
    r"mpi\.h$": ({"study"}, "one module shares work out"),
    r"yaml-cpp/": ({"files", "logs", "robots", "results", "app"}, "text is read in formats and results"),
    r"nlohmann/": ({"files", "logs", "robots", "results", "app", "report"}, "text is read in formats and results"),
}
SOLVERS_IN_SOURCES_ONLY = r"ceres/|nlopt|[Cc]lp|[Cc]oin|mpi\.h$"

# Paths of somebody's machine have no place in the project; written so that this file does not name them.
PRIVATE_PATHS = re.compile(r"(?<![\w.~-])/(?:" + "wor" + r"k(?![\w-])|" + "tmp/bash" + r"_jobs|" + "roo" + r"t/|"
                           + "hom" + r"e/\w)")

WIDTH = 120  # of lines, in characters; what clang-format breaks, and comments and scripts beside it
NARROW = {".hpp", ".cpp", ".cmake"}
CODE = {".hpp", ".cpp", ".cmake", ".py", ".sh", ".js", ".css"}
TEXT = CODE | {".md", ".yaml", ".yml", ".json", ".txt", ".cff", ".bib", ".in", ""}
SKIP = re.compile(r"^(?:\.git|\.cache|build.*|node_modules|out|__pycache__)$")
# A type that is defined in two headers of one namespace is two types of one name to the linker, which keeps one of
# them.
TYPE = re.compile(r"^(?:(?:struct|class|enum class|enum)\s+(\w+)\b(?!\s*<)[^;]*$|using\s+(\w+)\s*=)", re.M)
LENT = re.compile(r"(?:(?:using \w+|namespace \w+ = \w+)::\w+;\n)+\}")
DECLARED = re.compile(r"(?:(?:struct|class) \w+;\n)+\}")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
# Programs that use the installed library, or stand for one.
USERS = re.compile(r"(?:examples|tests/consumer)/")
GENERATED = {"report_assets.hpp"}


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


def check_code(module, relative, text, report):
    user = USERS.match(relative.as_posix())
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        sign, header = match.groups()
        owner = module_of(header) if sign == '"' else None
        if owner in MODULES and module in MAY_INCLUDE:
            allowed = MAY_INCLUDE[module]
            if allowed is not None and owner != module and owner not in allowed:
                report(relative, number, f"{module} may not include {header}, which is of {owner}")
        if sign == "<" and header.startswith("wheelwright/") and not user:
            report(relative, number, f'<{header}>: sources here include "{header.removeprefix("wheelwright/")}"')
        if sign == '"' and owner in MODULES and user:
            report(relative, number, f'"{header}": a program that uses the library includes <wheelwright/{header}>')
        if sign == '"' and "/" not in header and not user and header not in GENERATED:
            report(relative, number, f'"{header}": expected its path from the root of the repository')
        if module in PURE and header in BANNED_HEADERS and (relative.as_posix(), header) not in EXCEPTIONS:
            report(relative, number, f"<{header}> in {module}: {BANNED_HEADERS[header]}")
        if module in PRODUCT and sign == "<":
            for pattern, (modules, why) in OUTSIDE.items():
                if re.match(pattern, header) and module not in modules:
                    report(relative, number, f"<{header}> in {module}: {why}")
            if relative.suffix == ".hpp" and re.match(SOLVERS_IN_SOURCES_ONLY, header):
                report(relative, number, f"<{header}> in a header: solvers belong in .cpp files")
    if module in PURE:
        for number, line in enumerate(without_comments(text).splitlines(), 1):
            for pattern, why in BANNED_CODE.items():
                found = re.search(pattern, line)
                if found:
                    report(relative, number, f"{found.group(0).strip()} in {module}: {why}")
    if relative.suffix == ".hpp" and not re.search(r"^#pragma once$", text, re.M):
        report(relative, 1, "no #pragma once")


def check_space(module, relative, text, report):
    """Code of a module is in the module's namespace; in wheelwright itself stands what a header lends it, and in that of
    another module what a header declares of it, where it may include it."""
    space = "wheelwright::" + SPACE.get(module, module)
    allowed = MAY_INCLUDE.get(module)
    for opened in re.finditer(r"^namespace (wheelwright(?:::\w+)*) \{\n", text, re.M):
        header = relative.suffix == ".hpp"
        lent = header and opened.group(1) == "wheelwright" and LENT.match(text, opened.end())
        other = opened.group(1).split("::")[1:2]
        declared = (header and other and (allowed is None or other[0] in allowed)
                    and DECLARED.match(text, opened.end()))
        if not f"{opened.group(1)}::".startswith(f"{space}::") and not lent and not declared:
            report(relative, text[: opened.start()].count("\n") + 1,
                   f"namespace {opened.group(1)} in {module}: expected {space}")


def check_links(module, relative, text, report):
    """What the module's CMakeLists.txt links is what the table lets it include."""
    allowed = MAY_INCLUDE[module]
    used = re.search(r"\bUSES\s+([a-z_\s]+)", text)
    if allowed is None or not used:
        return
    number = text[: used.start()].count("\n") + 1
    for other in used.group(1).split():
        if other != module and other not in allowed:
            report(relative, number, f"{module} may not use {other}")


def listed_headers(root, kinds):
    """module -> headers, from the root, after the words `kinds` in its CMakeLists.txt; modules without any are not in it."""
    headers = {}
    for module in PRODUCT:
        path = root / MODULES[module] / "CMakeLists.txt"
        if path.is_file():
            for listed in re.findall(rf"\b(?:{kinds})\s+((?:[\w./]+\.hpp\s*)+)", path.read_text(encoding="utf-8")):
                headers.setdefault(module, set()).update(f"{MODULES[module]}/{name}" for name in listed.split())
    return headers


def installed_headers(root):
    return listed_headers(root, "HEADERS")


def public_headers(root):
    """Those that other modules may include: installed, or shared with the modules above."""
    return listed_headers(root, "HEADERS|SHARED")


def check_private(module, relative, text, public, installed, report):
    """Headers that no list names are their own module's; tests and tools may look into every module. What is installed
    includes what is installed."""
    if module in ("tests", "tools"):
        return
    lent = relative.as_posix() in installed.get(module, ())
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        header = match and match.group(2).removeprefix("wheelwright/")
        owner = header and module_of(header)
        if owner not in public:
            continue
        if owner != module and header not in public[owner]:
            report(relative, number, f"{header} is private to {owner}")
        elif lent and header not in installed.get(owner, ()):
            report(relative, number, f"{header} is not installed, {relative} is")


def check_width(relative, text, report):
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > WIDTH:
            report(relative, number, f"{len(line)} columns: expected at most {WIDTH}")


def check_list(root, report):
    """The folders that CMakeLists.txt builds are those of the table."""
    path = root / "CMakeLists.txt"
    if not path.is_file():
        return
    text = path.read_text(encoding="utf-8")
    listed = re.search(r"set\(WHEELWRIGHT_MODULES\s([^)]*)\)", text)
    number = text[: listed.start()].count("\n") + 1 if listed else 1
    folders = set(listed.group(1).split()) if listed else set()
    for folder in sorted(folders ^ set(MODULES.values())):
        report(path.relative_to(root), number, f"{folder} stands in one of WHEELWRIGHT_MODULES and tools/check_layers.py only")


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
    check_list(Path(root), report)
    for path in files(root):
        relative = path.relative_to(root)
        module = module_of(relative.as_posix())
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
        if path.suffix in NARROW or path.name == "CMakeLists.txt":
            check_width(relative, text, report)
        for number, line in enumerate(text.splitlines(), 1):
            named = PRIVATE_PATHS.search(line)
            if named:
                report(relative, number, f"names {named.group(0)}, a path of one machine")
        if path.suffix in (".hpp", ".cpp"):
            check_code(module, relative, text, report)
            check_private(module, relative, text, public, installed, report)
            if module in MODULES:
                check_space(module, relative, text, report)
        if path.suffix == ".hpp" and module in PRODUCT:
            check_types(relative, text, types, report)
        if path.name == "CMakeLists.txt" and module in MAY_INCLUDE:
            check_links(module, relative, text, report)
    return findings


def self_test():
    spdx = "// SPDX-License-Identifier: Apache-2.0\n"
    hash_spdx = "# SPDX-License-Identifier: Apache-2.0\n"
    head = spdx + "#pragma once\n"
    # A module's name behind @ stands for its folder.
    placed = lambda text: re.sub(r'@(\w+)/', lambda m: MODULES[m[1]] + '/', text)
    clean = {
        "@core/a.hpp": head + "#include <vector>\n// a random comment on rand() and std::cout\nstruct A {\n};\n",
        "@bounds/b.hpp": head + '#include "@core/a.hpp"\nstruct A;\nstruct B {};\nstruct B<2> {};\n',
        "@model/m.hpp": head + "namespace wheelwright::model {\nint f();\n}\n\nnamespace wheelwright {\nusing model::f;\n}\n",
        "@bounds/d.hpp": head + "namespace wheelwright::core {\nclass C;\nstruct D;\n}\n",
        "@files/c.cpp": spdx + '#include <fstream>\n#include "@core/a.hpp"\n',
        "@inference/robust.cpp": spdx + "#include <ceres/ceres.h>\n",
        "@study/work_on_ranks.cpp": spdx + "#include <chrono>\n#include <mpi.h>\n",
        "@detector/CMakeLists.txt": hash_spdx + "wheelwright_module(detector\n  USES core filter\n  LINK x)\n",
        "@filter/CMakeLists.txt": hash_spdx + "wheelwright_module(filter\n  HEADERS a.hpp\n    b.hpp\n  SHARED s.hpp\n  SOURCES c.cpp)\n",
        "@core/wide.cpp": spdx + "// " + "Δ" * (WIDTH - 3) + "\n",
        "docs/wide.md": "x" * 200 + "\n",
        "@detector/shared.cpp": spdx + '#include "@filter/s.hpp"\n',
        "examples/e.cpp": spdx + "#include <wheelwright/core/a.hpp>\n",
        "docs/framework.md": "framework/works on http://host/working and a/" + "work\n",
    }
    violations = {
        "upward include": ("@bounds/x.hpp", head + '#include "@filter/b.hpp"\n'),
        "commission in identify": ("@identify/x.cpp", spdx + '#include "@commission/s.hpp"\n'),
        "an answer in a format": ("@logs/x.cpp", spdx + '#include "@report/s.hpp"\n'),
        "a format in report": ("@report/x.cpp", spdx + '#include "@robots/s.hpp"\n'),
        "private header": ("@detector/y.cpp", spdx + '#include "@filter/b.hpp"\n#include "@filter/c.hpp"\n'),
        "not installed": ("@filter/a.hpp", head + '#include "@filter/s.hpp"\n'),
        "linked upwards": ("@identify/CMakeLists.txt", hash_spdx + "wheelwright_module(identify\n  USES core bounds)\n"),
        "another module's namespace": ("@bounds/x.cpp", spdx + "namespace wheelwright::core {\n}\n"),
        "declared upwards": ("@bounds/x.hpp", head + "namespace wheelwright::filter {\nclass C;\n}\n"),
        "no module's namespace": ("@bounds/x.hpp", head + "namespace wheelwright {\nint f();\n}\n"),
        "our header by the installed name": ("@bounds/x.cpp", spdx + "#include <wheelwright/core/a.hpp>\n"),
        "our header by its place in an example": ("examples/x.cpp", spdx + '#include "@core/a.hpp"\n'),
        "a header without its folder": ("@bounds/x.cpp", spdx + '#include "b.hpp"\n'),
        "a folder that is not built": ("CMakeLists.txt", hash_spdx + "set(WHEELWRIGHT_MODULES " +
                                       "\n".join(list(MODULES.values())[1:]) + ")\n"),
        "file opened": ("@commission/x.cpp", spdx + "#include <fstream>\n"),
        "printing": ("@filter/x.cpp", spdx + "void f() { std::cout << 1; }\n"),
        "clock": ("@identify/x.cpp", spdx + "#include <chrono>\n"),
        "another clock": ("@study/work_on_ranks.hpp", head + "#include <chrono>\n"),
        "MPI in a header": ("@study/x.hpp", head + "#include <mpi.h>\n"),
        "MPI elsewhere": ("@logs/x.cpp", spdx + "#include <mpi.h>\n"),
        "device": ("@sim/x.cpp", spdx + "std::random_device device;\n"),
        "rand": ("@sim/x.cpp", spdx + "int f() { return rand(); }\n"),
        "solver in header": ("@identify/x.hpp", head + "#include <nlopt.hpp>\n"),
        "CLP in a module": ("@bounds/x.cpp", spdx + "#include <CoinPackedMatrix.hpp>\n"),
        "solver elsewhere": ("@detector/x.cpp", spdx + "#include <nlopt.hpp>\n"),
        "no licence": ("@core/x.cpp", "int x;\n"),
        "no licence in a script": ("tools/x", "#!/bin/sh\ntrue\n"),
        "one name, two types": ("@detector/x.hpp", head + "class A final {\n};\n"),
        "one name, a type and an alias": ("@detector/x.hpp", head + "using A = int;\n"),
        "a wide line": ("@core/x.cpp", spdx + "// " + "x" * (WIDTH - 2) + "\n"),
        "a wide line of CMake": ("@core/CMakeLists.txt", hash_spdx + "set(x " + "x" * WIDTH + ")\n"),
        "no guard": ("@core/x.hpp", spdx),
        "private path": ("docs/x.md", "see /" + "work/main\n"),
        "another private path": ("examples/x.yaml", "log: /" + "tmp/bash_jobs.0/x\n"),
    }
    failures = 0

    def tree(extra):
        with tempfile.TemporaryDirectory() as root:
            for name, text in {**clean, **extra}.items():
                path = Path(root) / placed(name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(placed(text), encoding="utf-8")
            return check(Path(root))

    found = tree({})
    if found:
        failures += 1
        print("clean tree:", *found, sep="\n  ")
    for what, (name, text) in violations.items():
        found = tree({name: text})
        if len(found) != 1 or not found[0].startswith(placed(name) + ":"):
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
