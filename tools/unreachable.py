#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which functions of the product no command, binding or example reaches, by module, with their lines.

    tools/unreachable.py              builds the product in build-unreachable (minutes, at first), then a table and a
                                      list
    tools/unreachable.py --built      as it is built already
    tools/unreachable.py --names      without a build: names that a header declares and nothing of the product uses
    tools/unreachable.py --self-test

Every function is compiled into a section of its own, not optimised, and the linker keeps what the programs, the
examples and the Python module lead to. What none of them keeps is unreachable, unless an embedder's example calls it
(KEPT) or it is an accessor of one line through which a test looks. Functions of a header that nothing instantiates are
missing from all that was compiled, and types, constants and fields of a header that nothing uses are found by their
names. What only unreachable functions use is listed with them, but for names: run it again after deleting. Tests and
benchmarks reach nothing.
"""

import argparse
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
# What these name stays: they show or measure what embedders may use.
KEPT = ["examples/*.cpp", "tests/consumer/*.cpp", "tools/*.cpp", "docs/use/embedding.md", "docs/use/own_effect.md"]
SECTIONS = "-O0 -g1 -w -ffunction-sections -fdata-sections"
OPTIONS = ["-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=", f"-DCMAKE_CXX_FLAGS={SECTIONS}",
           "-DCMAKE_EXE_LINKER_FLAGS=-Wl,--gc-sections",
           "-DCMAKE_MODULE_LINKER_FLAGS=-Wl,--gc-sections,--exclude-libs,ALL",
           "-DWHEELWRIGHT_TESTS=OFF", "-DWHEELWRIGHT_BENCH=OFF"]
OTHERS = re.compile(r"_Z(?:NK?|T\w)?(?:S|5Eigen|5ceres|3fmt|8nlohmann|4YAML|8pybind11|3CLI|9__gnu_cxx|5boost)")
PLACE = re.compile(r"([\w/.-]+\.[ch]pp):(\d+)")
DECLARED = re.compile(
    r"^\s*(?:(?:template\s*<[^;{}]*>|\[\[\w+\]\]|inline|static|constexpr|explicit|virtual|friend|extern|const)\s+)*"
    r"(?:(?:struct|class|enum(?:\s+class)?|using|concept)\s+(\w+)|[\w:][\w:<>,*&\s]*?[\s*&>](\w+)\s*(?:\(|=|;|\{))")
FUNCTION = re.compile(r"^\s*(?:\[\[\w+\]\]\s*)?(?:[\w:][\w:<>,*&\s]*?[\s*&>])?(\w+)\(")
ACCESSOR = re.compile(r"\(\) const (?:noexcept )?(?:override )?\{ return [^;]+; \}")
NO_NAMES = {"return", "if", "for", "while", "operator", "namespace", "default", "delete", "noexcept", "final",
            "override",
            "rebind", "const", "requires", "switch", "throw", "sizeof", "main", "int", "double", "bool", "auto", "void"}


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, text=True, **options)


def build(folder):
    if not (folder / "build.ninja").is_file():
        run("cmake", "--preset", "release", "-B", folder, *OPTIONS, cwd=ROOT, stdout=subprocess.DEVNULL)
    run("cmake", "--build", folder)


def functions_in(binary):
    """Mangled name -> address, libraries' templates aside, of those that only this file's own unit sees, and of the
    others."""
    own, shared = {}, {}
    for line in run("nm", "--defined-only", binary, stdout=subprocess.PIPE).stdout.splitlines():
        address, kind, name = line.split(" ", 2)
        if kind in "tTwWuiV" and not OTHERS.match(name):
            (own if kind == "t" else shared).setdefault(name, []).append(address)
    return own, shared


def in_the_product(path):
    """The path from the root of a product's file, however it is named; None of others."""
    parts = path.split("/")
    return next((name for name in ("/".join(parts[k:]) for k in range(len(parts))) if check_layers.module_of(name) in PRODUCT), None)


def places(binary, functions):
    """(file, line) -> names of the functions that begin there, of those in a module's folder."""
    asked = [(address, name) for name, addresses in functions.items() for address in addresses]
    answers = run("addr2line", "-e", binary, input="".join(address + "\n" for address, _ in asked),
                  stdout=subprocess.PIPE).stdout.splitlines()
    found = defaultdict(set)
    for (_, name), answer in zip(asked, answers):
        at = PLACE.search(answer)
        file = at and in_the_product(at.group(1))
        if file:
            found[file, int(at.group(2))].add(name)
    return found


def find_unreached(whole, programs):
    """Where functions of `whole` begin that none of the programs holds, with a name of each; and where all begin."""
    own, shared = functions_in(whole)
    # A name tells one from all.
    twice = {name for name, addresses in own.items() if len(addresses) > 1 or name in shared}
    names, begun = set(), set()
    for program in programs:
        its_own, its_shared = functions_in(program)
        names |= set(its_shared) | set(its_own) - twice
        begun |= set(places(program, {name: its_own[name] for name in set(its_own) & twice}))
    everywhere = places(whole, {**own, **shared})
    unreached = {at: min(symbols) for at, symbols in everywhere.items() if at not in begun and not symbols & names}
    return unreached, set(everywhere)


def everything(folder, objects):
    """One file of all that was compiled, whatever is missing or there twice."""
    whole = folder / "everything"
    (folder / "everything.txt").write_text("\n".join(f'"{name}"' for name in objects), encoding="utf-8")
    run("g++", f"@{folder / 'everything.txt'}", "-o", whole, "-Wl,--unresolved-symbols=ignore-all",
        "-Wl,-z,muldefs", "-Wl,--no-gc-sections", stderr=subprocess.DEVNULL)
    return whole


def linked(folder):
    programs = [path for path in (folder / "bin").glob("*") if path.is_file()]
    return programs + list((folder / "python").glob("wheelwright/_core*.so"))


def without_comments(text):
    return check_layers.without_comments(text)


def extent(lines, number):
    """First and last line of the declaration on line `number`, its comment included."""
    code = without_comments("\n".join(lines)).split("\n")
    first = number
    while first > 1 and lines[first - 2].strip() and not re.search(r"[;}{:]\s*$", code[first - 2]):
        first -= 1
    depth, opened = 0, False
    for last in range(first, len(lines) + 1):
        for letter in code[last - 1]:
            opened |= letter == "{"
            depth += (letter in "{(") - (letter in "})")
        if depth <= 0 and (opened and re.search(r"\}[;,)\s]*$", code[last - 1])
                           or code[last - 1].rstrip().endswith(";")):
            if last >= number:
                return first, last
            depth, opened = 0, False
    return first, number


def unreached_functions(unreached, texts, kept):
    """(file, line, last line, name) of these, those left out that are named in `kept` or lie inside the one before."""
    found = []
    for (name, line), symbol in sorted(unreached.items()):
        if name not in texts:
            continue
        lines = texts[name].split("\n")
        here = lines[line - 1] if line <= len(lines) else ""
        if re.match(r"\s*(?:struct|class|enum)\b", here) or "[" in here and "](" in here or "= default" in here:
            continue  # what the compiler makes of a type; a lambda goes with its function
        plain = run("c++filt", input=symbol, stdout=subprocess.PIPE).stdout.strip()
        words = re.findall(r"([\w~]+|operator[^\w\s(]+)(?:\[abi:\w+\])?(?:<.*>)?\(", plain)
        title = words[0] if words else plain
        if title in kept and "_GLOBAL__N_" not in symbol:
            continue
        first, last = extent(lines, line)
        if found and found[-1][0] == name and found[-1][2] >= last:
            continue  # inside the one before
        found.append((name, first, last, title))
    return found


def unused_names(texts, others):
    """(file, line, last line, name) of what a header declares once and nothing else names."""
    counts = defaultdict(int)
    bare = {name: without_comments(text) for name, text in texts.items()}
    for text in [*bare.values(), *others]:
        for word in re.findall(r"[A-Za-z_]\w*", text):
            counts[word] += 1
    found = []
    for name, text in sorted(bare.items()):
        if not name.endswith(".hpp"):
            continue
        for number, line in enumerate(text.split("\n"), 1):
            match = DECLARED.match(line)
            word = match and (match.group(1) or match.group(2))
            if word and counts[word] == 1 and word not in NO_NAMES:
                found.append((name, *extent(texts[name].split("\n"), number), word))
    return found


def defines(text, at):
    """Whether the parameters that go on at `at` are those of a function with a body."""
    depth = 1
    while at < len(text) and depth > 0:
        depth += (text[at] == "(") - (text[at] == ")")
        at += 1
    return re.match(r"\s*(?:const|noexcept|override|final|\s)*(?:->[^;{]*|:[^;]*?)?\{", text[at:]) is not None


def never_compiled(texts, everywhere):
    """(file, line, last line, name) of functions that a header defines and nothing instantiates."""
    begun = defaultdict(set)
    for name, line in everywhere:
        begun[name].add(line)
    found = []
    for name, text in sorted(texts.items()):
        if not name.endswith(".hpp") or name.endswith("_impl.hpp"):  # loops for vector units are always optimised
            continue
        lines, code = text.split("\n"), without_comments(text).split("\n")
        for number, line in enumerate(code, 1):
            match = FUNCTION.match(line)
            if not match or match.group(1) in NO_NAMES or match.group(1).endswith("_") or "constexpr" in line:
                continue
            first, last = extent(lines, number)
            body = "\n".join(code[number - 1:last])
            if defines(body, match.end()) and not any(number <= at <= last for at in begun[name]):
                found.append((name, first, last, match.group(1)))
    return found


def is_accessor(texts, place):
    """Whether it is one line in a header that hands out a member or what it says of itself: tests look through it."""
    lines = texts[place[0]].split("\n")[place[1] - 1:place[2]]
    code = [line for line in lines if line.strip() and not line.strip().startswith("//")]
    return place[0].endswith(".hpp") and len(code) == 1 and ACCESSOR.search(code[0]) is not None


def table(found):
    modules = defaultdict(set)
    for name, first, last, _ in found:
        modules[check_layers.module_of(name)].update((name, line) for line in range(first, last + 1))
    lines = [f"{len(at):6,}  {module}" for module, at in sorted(modules.items(), key=lambda item: -len(item[1]))]
    lines.append(f"{sum(map(len, modules.values())):6,}  lines that nothing reaches, in {len(found)} places")
    lines += [f"{name}:{first}-{last}: {title}" for name, first, last, title in found]
    return "\n".join(lines)


def self_test():
    header = ("#pragma once\nint used(int a);\n/// Doubles.\nint unused(int a);\n"
              "inline int never(int a) {\n  return a;\n}\nstruct Box {\n  int inside = 0;\n  int unread = 0;\n};\n")
    source = ('#include "a.hpp"\nnamespace {\nint helper(int a) {\n  return a + 1;\n}\n}  // namespace\n'
              "int used(int a) {\n  return a;\n}\n\n"
              "int unused(int a) {\n  const auto f = [&](int b) {\n    return b;\n  };\n"
              "  return f(helper(a));\n}\n")
    main = '#include "core/a.hpp"\nint main() {\n  Box b;\n  return used(b.inside);\n}\n'
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "core").mkdir()
        texts = {"core/a.hpp": header, "core/a.cpp": source, "app/main.cpp": main}
        (folder / "app").mkdir()
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
            if name.endswith(".cpp"):
                run("g++", *SECTIONS.split(), "-I.", "-c", name, "-o", folder / (Path(name).stem + ".o"), cwd=folder)
        objects = [folder / "a.o", folder / "main.o"]
        run("g++", *objects, "-Wl,--gc-sections", "-o", folder / "program")
        unreached, everywhere = find_unreached(everything(folder, objects), [folder / "program"])
        found = unreached_functions(unreached, texts, set())
        assert found == [("core/a.cpp", 3, 5, "helper"), ("core/a.cpp", 11, 16, "unused")], found
        assert len(unreached_functions(unreached, texts, {"unused"})) == 1 and len(everywhere) == 5, everywhere
        names = [(first, last, word) for _, first, last, word in unused_names(texts, [])]
        assert names == [(5, 7, "never"), (10, 10, "unread")], names
        assert table(found).startswith("     9  core")
    print("unreachable: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--built", "--names", "--self-test"):
        parser.add_argument(option, action="store_true")
    parser.add_argument("--build", type=Path, metavar="FOLDER", default=ROOT / "build-unreachable")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return
    tracked = run("git", "-C", ROOT, "ls-files", "*.hpp", "*.cpp", stdout=subprocess.PIPE).stdout.split()
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in tracked if check_layers.module_of(name) in PRODUCT}
    others = [path.read_text(encoding="utf-8") for pattern in KEPT for path in sorted(ROOT.glob(pattern))]
    found = unused_names(texts, others)
    if not arguments.names:
        if not arguments.built:
            build(arguments.build)
        kept = set(re.findall(r"(\w+)(?=\()", "\n".join(others)))
        objects = [path for folder in check_layers.MODULES.values() for path in sorted((arguments.build / folder).glob("CMakeFiles/**/*.o"))]
        unreached, everywhere = find_unreached(everything(arguments.build, objects), linked(arguments.build))
        found = sorted({*unreached_functions(unreached, texts, kept), *never_compiled(texts, everywhere), *found})
        watchers = [path for path in sorted((ROOT / "tests").rglob("*.[ch]pp"))
                    if check_layers.module_of(path.relative_to(ROOT).as_posix()) == "tests"]
        looked_at = set(re.findall(r"[.>](\w+)\(\)", "\n".join(path.read_text(encoding="utf-8") for path in watchers)))
        found = [each for each in found if not (each[3] in looked_at and is_accessor(texts, each))]
    print(table(found))


if __name__ == "__main__":
    main()
