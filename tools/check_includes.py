#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks how many headers of this repository each source reads, directly or through other headers; ctest runs it.

    check_includes.py [ROOT]          every finding on a line "file: message"; exit code 1 when there is one
    check_includes.py --table [ROOT]  mean and most headers of each module, and its source that reads most
    check_includes.py --edges MODULE [ROOT]
                                      the includes whose removal would lower the mean of MODULE most
    check_includes.py --self-test     plants each violation in a scratch tree and expects it to be found

An include of a header of this repository is written "MODULE/x.hpp" from its root, or <wheelwright/MODULE/x.hpp> where
the library is used. Modules are those of tools/check_layers.py.
"""

import re
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

import check_layers
from check_layers import module_of

# Most headers that one source may read, and the most that the sources of a module may read on average.
MOST = 75
MOST_ON_AVERAGE = {"app": 40}
# Sources that may read more than MOST, how many, and why.
EXCEPTIONS = {
    "app/commission_command.cpp": (86, "the whole way from a log to the model, its page, and its detector on the same log"),
    "python/bind_doctor.cpp": (82, "binds four questions: doctor, choose, check and compare, and the export as C"),
    "tests/report/page_test.cpp": (96, "makes every page"),
}

INCLUDE = re.compile(r'^\s*#\s*include\s*(?:<wheelwright/|")([^>"]+)[>"]', re.M)


def include_graph(files):
    """file -> the headers of this repository that it includes itself, of {path: text}."""
    return {file: [header for header in INCLUDE.findall(text) if header in files and header != file]
            for file, text in files.items()}


def read_graph(root):
    """The include graph of the C++ files below `root`."""
    return include_graph({path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
                          for path in check_layers.files(root) if path.suffix in (".hpp", ".cpp")})


def pulled_in(file, graph, without=None):
    """The headers of this repository that are read where `file` is compiled; `without` an include (from, to)."""
    seen, ahead = set(), [file]
    while ahead:
        at = ahead.pop()
        for header in graph[at]:
            if header not in seen and (at, header) != without:
                seen.add(header)
                ahead.append(header)
    return seen - {file}


def headers_by_module(graph):
    """module -> {source: number of headers that it pulls in}; what stands in the root has no module."""
    numbers = defaultdict(dict)
    for file in graph:
        if file.endswith(".cpp") and module_of(file):
            numbers[module_of(file)][file] = len(pulled_in(file, graph))
    return numbers


def mean(numbers):
    return sum(numbers.values()) / len(numbers)


def check(root, most=MOST, on_average=None, exceptions=None):
    on_average = MOST_ON_AVERAGE if on_average is None else on_average
    exceptions = EXCEPTIONS if exceptions is None else exceptions
    findings = []
    numbers = headers_by_module(read_graph(root))
    known = {source: number for of in numbers.values() for source, number in of.items()}
    for source, number in sorted(known.items()):
        limit = exceptions.get(source, (most, ""))[0]
        if number > limit:
            findings.append(f"{source}: reads {number} headers of this repository, expected at most {limit}; "
                            "check_includes.py --edges says which includes cost most: include the header of what is "
                            "used instead of one that makes it, or declare a type that is only passed on")
    for source, (limit, _) in sorted(exceptions.items()):
        if source not in known:
            findings.append(f"{source}: is an exception and no source any more; take it out of EXCEPTIONS")
        elif known[source] <= most:
            findings.append(f"{source}: is an exception and needs none, it reads {known[source]} headers; take it out "
                            "of EXCEPTIONS")
    for module, limit in sorted(on_average.items()):
        if module not in numbers:
            findings.append(f"{module}: has a limit and no sources; take it out of MOST_ON_AVERAGE")
        elif mean(numbers[module]) > limit:
            findings.append(f"{module}: its sources read {mean(numbers[module]):.1f} headers of this repository on "
                            f"average, expected at most {limit}")
    return findings


def table(root):
    lines = ["| module | sources | headers, mean | most | in |", "|---|---|---|---|---|"]
    for module, numbers in sorted(headers_by_module(read_graph(root)).items()):
        worst = max(numbers, key=numbers.get)
        lines.append(f"| {module} | {len(numbers)} | {mean(numbers):.1f} | {numbers[worst]} | {worst} |")
    return lines


def edges(root, module, most=30):
    graph = read_graph(root)
    modules = headers_by_module(graph)
    if module not in modules:
        sys.exit(f"check_includes: {module} has no sources: expected one of {', '.join(sorted(modules))}")
    sources = list(modules[module])
    reached = {source: pulled_in(source, graph) for source in sources}
    gain = Counter()
    for at in set().union(*reached.values()) | set(sources):
        for header in graph[at]:
            for source in sources:
                if at == source or at in reached[source]:
                    gain[at, header] += len(reached[source]) - len(pulled_in(source, graph, (at, header)))
    return [f"{number / len(sources):6.2f}  {at} -> {header}" for (at, header), number in gain.most_common(most)]


def self_test():
    ours = '#include <wheelwright/core/{}.hpp>\n'
    clean = {
        "core/a.hpp": "#include <vector>\n",
        "core/b.hpp": ours.format("a"),
        "core/sub/c.hpp": '#include "core/b.hpp"\n',
        "core/b.cpp": ours.format("b") + '#include "core/sub/c.hpp"\n',
        "app/common.hpp": ours.format("a"),
        "app/run.cpp": '#include "app/common.hpp"\n',
        "app/other.cpp": '#include "app/common.hpp"\n#include "made_by_the_build.hpp"\n',
        "tests/support/help.hpp": "",
        "tests/core/a_test.cpp": ours.format("a") + '#include "tests/support/help.hpp"\n',
    }
    limits = {"most": 3, "on_average": {"app": 2}, "exceptions": {}}
    planted = {
        "a source reads too much": ({"core/b.cpp": clean["core/b.cpp"] + '#include "core/d.hpp"\n', "core/d.hpp": ""}, {},
                                    "core/b.cpp"),
        "through a header in quotes": ({"core/sub/c.hpp": clean["core/sub/c.hpp"] + "#include \"core/d.hpp\"\n", "core/d.hpp": ""}, {}, "core/b.cpp"),
        "a module reads too much": ({"app/common.hpp": ours.format("b")}, {}, "app"),
        "more than the exception": ({"core/b.cpp": clean["core/b.cpp"] + "".join(f'#include "core/d{k}.hpp"\n' for k in "12"),
                                     "core/d1.hpp": "", "core/d2.hpp": ""}, {"core/b.cpp": (4, "why")}, "core/b.cpp"),
        "an exception that is none": ({}, {"core/b.cpp": (4, "why")}, "core/b.cpp"),
        "an exception that is gone": ({}, {"core/gone.cpp": (4, "why")}, "core/gone.cpp"),
    }
    failures = 0

    def found(extra, exceptions):
        with tempfile.TemporaryDirectory() as root:
            for name, text in {**clean, **extra}.items():
                path = Path(root) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            return check(Path(root), **{**limits, "exceptions": exceptions}), edges(Path(root), "app"), table(Path(root))

    findings, costly, rows = found({}, {})
    if findings:
        failures += 1
        print("clean tree:", *findings, sep="\n  ")
    if not any(line.split() == ["1.00", "app/common.hpp", "->", "core/a.hpp"] for line in costly):
        failures += 1
        print("costly includes:", *costly, sep="\n  ")
    if "| app | 2 | 2.0 | 2 | app/other.cpp |" not in rows:
        failures += 1
        print("table:", *rows, sep="\n  ")
    for what, (extra, exceptions, where) in planted.items():
        findings, _, _ = found(extra, exceptions)
        if len(findings) != 1 or not findings[0].startswith(where + ":"):
            failures += 1
            print(f"{what}: expected one finding in {where}, got", *(findings or ["none"]), sep="\n  ")
    print(f"{len(planted) + 3 - failures} passed, {failures} failed")
    return failures


def main(arguments):
    if arguments == ["--self-test"]:
        return 1 if self_test() else 0
    mode = arguments.pop(0) if arguments and arguments[0] in ("--table", "--edges") else ""
    module = arguments.pop(0) if mode == "--edges" and arguments else ""
    if len(arguments) > 1 or (arguments and arguments[0].startswith("-")) or (mode == "--edges" and not module):
        print(__doc__, file=sys.stderr)
        return 2
    root = Path(arguments[0]) if arguments else Path(__file__).resolve().parent.parent
    if mode:
        print(*(table(root) if mode == "--table" else edges(root, module)), sep="\n")
        return 0
    findings = check(root)
    for finding in findings:
        print(finding)
    if not findings:
        print("includes: nothing to report")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
