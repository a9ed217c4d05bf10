#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One list of dependencies, tools/cmake/dependencies.json, and everything that has to agree with it.

    check_dependencies.py               exit code 1 where the build's files, tools/setup.sh, package.json or
                                        docs/inside/dependencies.md say something else
    check_dependencies.py --write       writes docs/inside/dependencies.md
    check_dependencies.py --sbom FILE   writes a bill of materials of what is distributed (CycloneDX 1.4, JSON), with
                                        the versions that dpkg has where it has them
    check_dependencies.py --self-test   the check notices what it is for
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = "docs/inside/dependencies.md"
USES = {
    "library": "The library and the program",
    "program": "The program alone",
    "report": "Inside the report page",
    "python": "The Python package",
    "tests": "Tests alone",
    "bench": "Benchmarks alone",
    "reality": "The independent world (`tests/world/`) alone",
    "build": "Building",
    "documentation": "This documentation",
    "packaging": "Packages",
}
PROGRAM = ("library", "program", "report", "build")  # of what the first command installs
DISTRIBUTED = ("library", "program", "report", "python")
LINKED = {"headers": "headers, compiled in", "static": "statically", "shared": "dynamically", "embedded": "embedded",
          "run": "run, not linked"}
# Ours, or part of the C library.
NOT_LISTED = {"Wheelwright", "Threads"}

INTRODUCTION = """# Dependencies and licences

Wheelwright is under [Apache-2.0](https://www.apache.org/licenses/LICENSE-2.0). This is what it is built, tested and
documented with: Debian 12's packages, and uPlot from npm. The list is `tools/cmake/dependencies.json`; this page is made from
it by `tools/check_dependencies.py --write`, and a test compares it with the build's files and `tools/setup.sh`.
Licences are [SPDX](https://spdx.org/licenses/) expressions of the parts that are used, after Debian's copyright files;
versions are those of Debian 12 without its own suffixes. The Debian package `wheelwright` has the part that is
distributed as a CycloneDX bill of materials, with the exact versions it was built with.
"""

QUESTIONS = """## Licence questions

- **The report page** holds uPlot's script and style sheet. Its MIT notice stands in every page in front of the
  script, and in the packages' copyright files.
- **Headers that are compiled in** (Eigen, Boost, fmt, JSON for Modern C++, CLI11, pybind11) are under MPL-2.0, BSL-1.0,
  MIT and BSD-3-Clause. MPL-2.0 asks that changes to Eigen's own files stay available: there are none. The copyright
  files of the packages name their authors.
- **Ceres** is linked statically (Debian's CMake package gives that) and brings CHOLMOD of SuiteSparse, linked
  dynamically, parts of which are under GPL-2.0-or-later. Wheelwright is a work of its own under Apache-2.0, which
  GPL-3.0 admits; who ships the program *together with* that CHOLMOD follows the GPL for the whole. The detector
  (`Wheelwright::detector` and what is below it) links neither Ceres nor NLopt.
- **CLP** is under EPL-1.0, which does not go together with the GPL in one distributed program. Only benchmarks link it.
- **GLPK and QSopt_ex** (GPL) are linked by benchmarks and tests, which are not packaged.
- **SQLite** is in the public domain; `blessing` is what SPDX calls that.
"""


def load(root):
    return json.loads((root / "tools/cmake/dependencies.json").read_text(encoding="utf-8"))["dependencies"]


def named_in_cmake(text):
    """Names that a CMake file looks for: find_package and find_library, pkg:MODULE for pkg-config."""
    text = re.sub(r"#.*", "", text)
    found = set(re.findall(r"find_package\(\s*([\w.+-]+)", text))
    found |= set(re.findall(r"find_library\(\s*\w+\s+([\w.+-]+)", text))
    for words in re.findall(r"pkg_check_modules\(\s*\w+([^)]*)\)", text):
        found |= {"pkg:" + re.split(r"[<>=]", word)[0] for word in words.split()
                  if word not in ("REQUIRED", "QUIET", "IMPORTED_TARGET", "GLOBAL")}
    return found - NOT_LISTED


def cmake_files(root):
    folders = [path for path in root.iterdir() if path.is_dir() and not path.name.startswith((".", "build"))
               and path.name not in ("node_modules", "out")]
    files = [path for folder in folders for pattern in ("*.cmake", "CMakeLists.txt") for path in folder.rglob(pattern)]
    return [root / "CMakeLists.txt"] + sorted(path for path in files if not {"consumer", "ros2", "node_modules"} & set(path.parts))


def setup_packages(text):
    """Debian packages of tools/setup.sh by option: those of the program, what "" adds to them, and an option to
    that."""
    listed = lambda variable: set(re.search(rf'^{variable}="([^"]*)"', text, re.M).group(1).split())
    packages = {"program": listed("packages"), "": listed("everything")}
    for option, words in re.findall(r'^\s*(--\w+)\) everything="\$everything ([^"]*)"', text, re.M):
        packages[option] = set(words.split())
    return packages


def setup_option(entry):
    return entry.get("setup", "program" if entry["use"] in PROGRAM and not entry.get("optional") else "")


def complaints(dependencies, in_library, in_build, setup, npm, page):
    out = []

    def compare(what, listed, there):
        out.extend(f"{what} has {name}, tools/cmake/dependencies.json has not" for name in sorted(there - listed))
        out.extend(f"tools/cmake/dependencies.json has {name}, {what} has not" for name in sorted(listed - there))

    def names(chosen):
        return {name for entry in dependencies if chosen(entry) for name in entry.get("cmake", [])}

    for entry in dependencies:
        missing = {"name", "licence", "version", "use", "linked", "for"} - set(entry)
        if missing:
            out.append(f"{entry.get('name', entry)}: no {', '.join(sorted(missing))}")
        elif entry["use"] not in USES or entry["linked"] not in LINKED or not ("packages" in entry or "npm" in entry):
            out.append(f"{entry['name']}: unknown use or linked, or neither packages nor npm")
    if out:
        return out
    compare("tools/cmake/WheelwrightDependencies.cmake", names(lambda entry: entry["use"] == "library"), in_library)
    compare("the build", names(lambda entry: True), in_build)
    for option in sorted(set(setup) | {setup_option(entry) for entry in dependencies}):
        listed = {name for entry in dependencies if setup_option(entry) == option for name in entry.get("packages", [])}
        compare(f"tools/setup.sh {option}".strip(), listed, setup.get(option, set()))
    compare("results/report/package.json", {f"{entry['npm']} {entry['version']}" for entry in dependencies if "npm" in entry},
            {f"{name} {version}" for name, version in npm.items()})
    if page != markdown(dependencies):
        out.append(f"{PAGE} is not what is listed: tools/check_dependencies.py --write")
    return out


def markdown(dependencies):
    out = INTRODUCTION
    for use, title in USES.items():
        out += f"\n## {title}\n\n| name | Debian package | version | licence | linked | for |\n"
        out += "|---|---|---|---|---|---|\n"
        for entry in dependencies:
            if entry["use"] == use:
                where = ", ".join(f"`{package}`" for package in entry.get("packages", [])) or f"npm: `{entry['npm']}`"
                out += (f"| {entry['name']} | {where} | {entry['version']} | {entry['licence']} "
                        f"| {LINKED[entry['linked']]} "
                        f"| {entry['for']} |\n")
    return out + "\n" + QUESTIONS


def installed_version(package):
    try:
        done = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True,
                              check=False)
    except FileNotFoundError:
        return ""
    return done.stdout if done.returncode == 0 else ""


def bill_of_materials(dependencies, version):
    components = []
    for entry in dependencies:
        if entry["use"] not in DISTRIBUTED:
            continue
        component = {"type": "library", "name": entry["name"], "version": entry["version"],
                     "description": f"{entry['for']} ({LINKED[entry['linked']]})",
                     "licenses": [{"expression": entry["licence"]}]}
        if "npm" in entry:
            component["purl"] = f"pkg:npm/{entry['npm']}@{entry['version']}"
        else:
            package = entry["packages"][0]
            component["version"] = installed_version(package) or entry["version"]
            version = component["version"].replace("+", "%2B").replace(":", "%3A")
            component["purl"] = f"pkg:deb/debian/{package}@{version}"
        components.append(component)
    return {"bomFormat": "CycloneDX", "specVersion": "1.4", "version": 1,
            "metadata": {"component": {"type": "application", "name": "wheelwright", "version": version,
                                       "licenses": [{"expression": "Apache-2.0"}]}},
            "components": components}


def gather(root):
    files = {path: path.read_text(encoding="utf-8") for path in cmake_files(root)}
    page = root / PAGE
    return (load(root), named_in_cmake(files[root / "tools/cmake/WheelwrightDependencies.cmake"]),
            set().union(*(named_in_cmake(text) for text in files.values())),
            setup_packages((root / "tools/setup.sh").read_text(encoding="utf-8")),
            json.loads((root / "results/report/package.json").read_text(encoding="utf-8"))["dependencies"],
            page.read_text(encoding="utf-8") if page.exists() else "")


def self_test():
    assert named_in_cmake("find_package(A 3 REQUIRED)\n# find_package(B)\n"
                          "pkg_check_modules(C REQUIRED IMPORTED_TARGET c>=2)\n"
                          "find_library(D_LIBRARY d)\n") == {"A", "pkg:c", "d"}
    assert setup_packages('packages="a b\n  c"\neverything="e"\n'
                          'case x in\n  --ci) everything="$everything d" ;;\n') == {
        "program": {"a", "b", "c"}, "": {"e"}, "--ci": {"d"}}
    good = [{"name": "A", "packages": ["a"], "cmake": ["A"], "licence": "MIT", "version": "1", "use": "library",
             "linked": "headers", "for": "nothing"},
            {"name": "U", "npm": "u", "licence": "MIT", "version": "2", "use": "report", "linked": "embedded",
             "for": "charts"}]
    page = markdown(good)
    right = (good, {"A"}, {"A"}, {"program": {"a"}}, {"u": "2"}, page)
    assert complaints(*right) == []
    for k, wrong in enumerate([good[:1], {"A", "B"}, set(), {"program": {"a", "b"}}, {"u": "3"}, page + " "]):
        assert complaints(*right[:k], wrong, *right[k + 1:]) != [], k
    assert complaints([{**good[0], "licence": "MIT", "use": "fun"}, good[1]], *right[1:]) != []
    assert [component["name"] for component in bill_of_materials(good, "0")["components"]] == ["A", "U"]
    print("dependencies: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--sbom", type=Path, metavar="FILE")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
    elif arguments.sbom:
        version = re.search(r"^project\(Wheelwright VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(),
                            re.M).group(1)
        arguments.sbom.write_text(json.dumps(bill_of_materials(load(ROOT), version), indent=2) + "\n", encoding="utf-8")
    elif arguments.write:
        (ROOT / PAGE).write_text(markdown(load(ROOT)), encoding="utf-8")
    else:
        found = complaints(*gather(ROOT))
        for complaint in found:
            print("dependencies: " + complaint)
        if found:
            return 1
        print("dependencies: the list, the build, the set-up and the page agree")
    return 0


if __name__ == "__main__":
    sys.exit(main())
