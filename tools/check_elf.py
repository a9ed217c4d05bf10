#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads the dynamic section of every ELF file and tells which of them load libraries from a place that is not the system's.

    check_elf.py PATH...       files, folders, wheels (.whl), Debian packages (.deb); a finding a line, exit code 1 when there is one
    check_elf.py --planted FILE COMMAND...
                               runs COMMAND in a folder that holds a broken library for each one that FILE needs: it must not
                               meet one of them
    check_elf.py --self-test   links programs with each kind of search path (cc) and expects it to be found

A library of ours needs no search path of its own, so any RPATH or RUNPATH is a finding; the worst is an empty or relative
entry, for which the loader takes the directory in which the program is started. So is a needed library that is named by a
relative path. Object files and static libraries have no dynamic section. A path in which no ELF file lies is a finding, too.
"""

import contextlib
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

DT_NEEDED, DT_STRTAB, DT_RPATH, DT_RUNPATH = 1, 5, 15, 29
PT_LOAD, PT_DYNAMIC = 1, 2
MAGIC = b"\x7fELF"


def dynamic_strings(content):
    """(tag, string) of the entries NEEDED, RPATH and RUNPATH; none for files without a dynamic section."""
    wide, order = content[4] == 2, "<" if content[5] == 1 else ">"
    kind = struct.unpack_from(order + "H", content, 16)[0]
    if kind == 1:  # an object file
        return []
    table = struct.unpack_from(order + ("Q" if wide else "I"), content, 32 if wide else 28)[0]
    size, count = struct.unpack_from(order + "HH", content, 54 if wide else 42)
    segments = []
    for k in range(count):
        at = table + k * size
        if wide:
            kind, _, offset, address, _, length = struct.unpack_from(order + "IIQQQQ", content, at)
        else:
            kind, offset, address, _, length = struct.unpack_from(order + "IIIII", content, at)
        segments.append((kind, offset, address, length))
    entry = order + ("qQ" if wide else "iI")
    entries = []
    for kind, offset, _, length in segments:
        if kind == PT_DYNAMIC:
            entries += struct.iter_unpack(entry, content[offset:offset + length // struct.calcsize(entry) * struct.calcsize(entry)])
    address = next((value for tag, value in entries if tag == DT_STRTAB), None)
    if address is None:
        return []
    names = next(address - start + offset for kind, offset, start, length in segments
                 if kind == PT_LOAD and start <= address < start + length)
    string = lambda at: content[names + at:content.index(b"\0", names + at)].decode(errors="replace")
    return [(tag, string(value)) for tag, value in entries if tag in (DT_NEEDED, DT_RPATH, DT_RUNPATH)]


def findings_of(name, content):
    for tag, text in dynamic_strings(content):
        if tag == DT_NEEDED:
            if "/" in text and not text.startswith("/"):
                yield f"{name}: needs {text}, which is looked for in the current directory: expected a name without a path"
            continue
        kind = "RPATH" if tag == DT_RPATH else "RUNPATH"
        loose = [entry for entry in text.split(":") if not entry.startswith(("/", "$ORIGIN"))]
        if loose:
            yield f"{name}: {kind} '{text}': libraries of the current directory are loaded: expected no {kind}"
        else:
            yield f"{name}: {kind} '{text}': expected none, all libraries are the system's"


def elves(path):
    """(name, content) of the ELF files in `path`."""
    if path.is_dir():
        for folder, names, leaves in os.walk(path):
            names[:] = sorted(n for n in names if n not in ("node_modules", "CMakeFiles"))
            for leaf in sorted(leaves):
                if not (Path(folder) / leaf).is_symlink():
                    yield from elves(Path(folder) / leaf)
    elif path.suffix == ".whl":
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                if (content := archive.read(name)).startswith(MAGIC):
                    yield f"{path}: {name}", content
    elif path.suffix == ".deb":
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["dpkg-deb", "-x", path, folder], check=True)
            for name, content in elves(Path(folder)):
                yield f"{path}: {os.path.relpath(name, folder)}", content
    elif path.is_file():
        with open(path, "rb") as file:
            if file.read(len(MAGIC)) == MAGIC:
                yield str(path), MAGIC + file.read()


def check(paths):
    findings, count = [], 0
    for path in paths:
        seen = 0
        for name, content in elves(path):
            seen += 1
            findings += findings_of(name, content)
        if not seen:
            findings.append(f"{path}: no ELF file is there: expected what was built")
        count += seen
    return findings, count


def meets_planted(path, command):
    """Whether `command` fails in a folder of broken libraries."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (text for tag, text in dynamic_strings(path.read_bytes()) if tag == DT_NEEDED):
            (Path(folder) / Path(name).name).write_bytes(b"planted")
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"{' '.join(map(str, command))}: exit code {done.returncode} in a folder of planted libraries:", done.stderr.strip())
    return done.returncode != 0


def self_test():
    compiler = shutil.which("cc") or shutil.which("c++")
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        source = folder / "program.c"
        source.write_text("int main(void) { return 0; }\n")
        (folder / "part.c").write_text("int part(void) { return 0; }\n")

        def link(name, *options):
            subprocess.run([compiler, source, "-o", folder / name, *options], check=True, cwd=folder)
            return folder / name

        subprocess.run([compiler, "-shared", "-fPIC", "part.c", "-o", "libpart.so"], check=True, cwd=folder)
        clean = [link("clean"), link("static", "-static"), folder / "libpart.so"]
        bad = {
            "an empty entry": link("empty", "-Wl,-rpath,/usr/lib/x:", "-Wl,--enable-new-dtags"),
            "a colon alone": link("colon", "-Wl,-rpath,:"),
            "a relative entry": link("relative", "-Wl,-rpath,lib"),
            "an old RPATH": link("old", "-Wl,--disable-new-dtags,-rpath,.:/usr/lib"),
            "an absolute entry": link("absolute", "-Wl,-rpath,/usr/lib/x"),
            "a library by a relative path": link("needs", "-Wl,--no-as-needed", "./libpart.so"),
        }
        subprocess.run([compiler, "-c", source, "-o", folder / "object.o"], check=True)
        failures = [f"{path.name}: {found}" for path in clean for found in check([path])[0]]
        failures += [f"object.o: {found}" for found in findings_of("object.o", (folder / "object.o").read_bytes())]
        failures += [f"{what}: not found" for what, path in bad.items() if len(check([path])[0]) != 1]
        wheel = folder / "some.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            archive.write(bad["an empty entry"], "some/_core.so")
            archive.writestr("some/__init__.py", "")
        if len(check([wheel])[0]) != 1:
            failures.append("a wheel: not found")
        if not check([source])[0]:
            failures.append("a path without an ELF file: not found")
        if check([folder])[1] != len(clean) + len(bad) + 2:
            failures.append(f"a folder: {check([folder])[1]} ELF files")
        with contextlib.redirect_stdout(None):
            if meets_planted(clean[0], [clean[0]]) or not meets_planted(bad["an empty entry"], [bad["an empty entry"]]):
                failures.append("planted libraries: a clean program meets them, or one that looks for them does not")
    for failure in failures:
        print(failure)
    print(f"{len(clean) + len(bad) + 5 - len(failures)} passed, {len(failures)} failed")
    return 1 if failures else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if arguments[:1] == ["--planted"] and len(arguments) > 2:
        return 1 if meets_planted(Path(arguments[1]), arguments[2:]) else 0
    if not arguments or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    findings, count = check([Path(argument) for argument in arguments])
    for finding in findings:
        print(finding)
    print(f"elf: {count} files, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
