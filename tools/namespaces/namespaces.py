#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gives every room of a Wheelwright checkout its own namespace.

    namespaces.py TREE [--facts FILE] [--keep-facts FILE] [--check]

TREE is a clean checkout (node_modules may be a link) in which everything can be configured. What names what is found by the
indexer beside this script, which is compiled when it is missing:

    apt-get install --no-install-recommends libclang-16-dev llvm-16-dev

(clang 14 does not understand the ranges of libstdc++ 12). --keep-facts keeps what it found, --facts takes it instead of looking
again, for the very same tree. --check writes nothing. Nothing is written before everything is known.
Exit code 1: something is left to do by hand, each on a line that begins with LEFT, or the indexer met an error.
"""

import argparse
import json
import re
import shlex
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

HERE = Path(__file__).resolve().parent
OLD = "wheelwright"

ROOMS = """core model filter bounds detector files logs sim robots identify commission inference doctor design gap study words
results export report app python reality bench""".split()
SPACE = {**{room: room for room in ROOMS}, "export": "exporter"}
INSTALLED = {SPACE[room] for room in ROOMS} - {"app", "python", "reality", "bench"}
# Namespaces that stay where they are: they are no part of a room, or are a room's already.
STAY = {"testing", "testing_support", "guarantee", "peers", "embedded"}
# tests/FOLDER is in the namespace of the room that it tests.
TEST_FOLDERS = {"study_mpi": "study"}

# What a user types: also wheelwright::NAME, by a using-declaration in the header that defines it.
EXPORTED = """
Error InvalidArgument InputError Interval LogTable LogSource LogBlock TableSource RegressionBlock read_all
Robot Model Term Hold DifferentialDrive
Measurement MotionKind FilterDesign RegressorFilter TorqueRows
Box Polytope FeasibleSet feasible_set
OnlineModel Detector TorqueDetector Decision make_detector
Json CsvLog read_robot read_model read_scenario
Scenario Simulation
least_squares
Commissioning commission_robot Detection detect
Effect Diagnosis diagnose
""".split()
# Namespaces that are reached directly too, by an alias in the header: namespace NAME = ROOM::NAME.
EXPORTED_SPACES = ["check"]

# Functions whose name a namespace needs: (old namespace, name) -> new name.
RENAMED = {("wheelwright", "commission"): "commission_robot"}

# A name that a source takes from another room so often has a using-declaration there.
OFTEN = 8
TYPES = {"CXXRecord", "ClassTemplate", "Enum", "TypeAlias", "TypeAliasTemplate", "Typedef", "Concept"}

# Functions that have the name of a namespace, but live in another.
MAY_MEET = {"identify"}

# (file, text after qualification and before clang-format, text in its place)
BY_HAND = [
    # `using namespace wheelwright` brings the room `study` beside a function of the program.
    ("bench/half_logs.cpp", "void study(const", "void study_halves(const"),
    ("bench/half_logs.cpp", "      study(words[i]", "      study_halves(words[i]"),
    ("bench/limit_study.cpp", "void study(const", "void study_drive(const"),
    ("bench/limit_study.cpp", "      study(simulated(seed)", "      study_drive(simulated(seed)"),
    ("bench/limit_study.cpp", "        study({std::filesystem", "        study_drive({std::filesystem"),
    ("docs/own_effect.md", "    wheelwright::Effect cogging() {\n      wheelwright::Effect effect;\n",
     "    using namespace wheelwright;\n\n    Effect cogging() {\n      Effect effect;\n"),
    ("docs/own_effect.md", "[](const wheelwright::gap::Drive& drive", "[](const gap::Drive& drive"),
    ("docs/own_effect.md", "return std::vector{wheelwright::gap::catalogue::at_joints(drive, sine), "
     "wheelwright::gap::catalogue::at_joints(drive, cosine)};",
     "return std::vector{gap::catalogue::at_joints(drive, sine), gap::catalogue::at_joints(drive, cosine)};"),
    ("docs/architecture.md", """A room is a folder, a target (`Wheelwright::room`) and a line in the table of `tools/check_layers.py`, which a test reads: a
room looks down, never up. What only a room's own sources include is private to it and is not installed.
""", """A room is a folder, a target (`Wheelwright::room`), a namespace (`wheelwright::room`; `exporter` for `export`, which is a keyword)
and a line in the table of `tools/check_layers.py`, which a test reads: a room looks down, never up. What only a room's own
sources include is private to it and is not installed. Names that a program types which uses the library are in `wheelwright`
itself, too: the header that defines one ends with a using-declaration.
"""),
    ("CHANGELOG.md", """### Changed
- Rooms by storeys""", """### Changed
- C++: a namespace for each room (`wheelwright::core` and so on; `exporter` for `export`). What most programs need is in
  `wheelwright` as before; `commission()` is `commission_robot()`.
- Rooms by storeys"""),
    ("tools/check_layers.py", """def check_links(room""", """def check_space(room, relative, text, report):
    \"\"\"Code of a room is in the room's namespace; in wheelwright itself stands what a header lends it.\"\"\"
    space = "wheelwright::" + SPACE.get(room, room)
    for opened in re.finditer(r"^namespace (wheelwright(?:::\\w+)*) \\{\\n", text, re.M):
        lent = relative.suffix == ".hpp" and re.compile(r"(?:(?:using \\w+|namespace \\w+ = \\w+)::\\w+;\\n)+\\}").match(text, opened.end())
        if not f"{opened.group(1)}::".startswith(f"{space}::") and not (opened.group(1) == "wheelwright" and lent):
            report(relative, text[: opened.start()].count("\\n") + 1, f"namespace {opened.group(1)} in {room}/: expected {space}")


def check_links(room"""),
    ("tools/check_layers.py", """# Results are functions of their arguments""", """# Rooms whose namespace is not called as they are.
SPACE = {"export": "exporter"}

# Results are functions of their arguments"""),
    ("tools/check_layers.py", """            check_private(room, relative, text, public, report)
""", """            check_private(room, relative, text, public, report)
            if room in (*HOUSE, "app", "python", "reality"):
                check_space(room, relative, text, report)
"""),
    ("tools/check_layers.py", """        "files/c.cpp": spdx + "#include <fstream>""", """        "model/m.hpp": head + "namespace wheelwright::model {\\nint f();\\n}\\n\\nnamespace wheelwright {\\nusing model::f;\\n}\\n",
        "files/c.cpp": spdx + "#include <fstream>"""),
    ("tools/check_layers.py", """        "file opened": (""", """        "another room's namespace": ("bounds/x.cpp", spdx + "namespace wheelwright::core {\\n}\\n"),
        "no room's namespace": ("bounds/x.hpp", head + "namespace wheelwright {\\nint f();\\n}\\n"),
        "file opened": ("""),
]

# The decision as docs/decisions.md says it, under the next number.
DECISION = """**A namespace a room** (`wheelwright::core` and so on; `exporter` for `export`, which is a keyword). What a program types that
    uses the library is in `wheelwright` too, by using-declarations in the headers that define it, forty-odd names; nothing else
    is (`tools/check_layers.py`). Code says whose a thing is that it takes from another room, and two rooms may call helpers
    alike. Costs: no function in `wheelwright` can have the name of a room (`commission_robot()`).
"""

ERRORS = []
CLANG = Path("/usr/lib/llvm-16")


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, **options)


# ---------------------------------------------------------------------------------------------------------------------------
# Facts


def indexer():
    program = HERE / "indexer" / "index"
    source = HERE / "indexer" / "index.cpp"
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        run("g++", "-std=c++17", "-O1", "-fno-rtti", f"-I{CLANG}/include", source, "-o", program,
            f"{CLANG}/lib/libclang-cpp.so.16", f"{CLANG}/lib/libLLVM-16.so.1")
    return program


def tracked(tree, *patterns):
    names = run("git", "-C", tree, "ls-files", *patterns, capture_output=True, text=True).stdout.split("\n")
    return [name for name in names if name and (tree / name).is_file()]


def gather(tree, jobs=2):
    """What an index of every source says, as a set of lines."""
    work = Path(tempfile.mkdtemp(prefix="namespaces."))
    build = work / "build"
    run("cmake", "--preset", "release", "-S", tree, "-B", build, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
        "-DCMAKE_UNITY_BUILD=ON", cwd=tree, stdout=subprocess.DEVNULL)
    for line in (build / "build.ninja").read_text().splitlines():  # headers that are made of other files
        if line.startswith("  COMMAND = ") and "EmbedText.cmake" in line:
            run("sh", "-c", line.removeprefix("  COMMAND = ").replace("$", ""))
    database = [entry for entry in json.loads((build / "compile_commands.json").read_text())
                if "verify_interface" not in entry["file"]]
    seen = set()
    for entry in database:
        path = Path(entry["file"])
        for text in (re.findall(r'#include "([^"]+)"', path.read_text()) if "Unity" in path.parts else [str(path)]):
            seen.add(str(Path(text).resolve()))
    like = next(entry for entry in database if "make_fleet" in entry["command"] or "make-fleet" in entry["command"])
    for name in tracked(tree, "*.cpp"):
        path = str((tree / name).resolve())
        if path not in seen:
            database.append({"directory": like["directory"], "file": path, "command":
                             like["command"].rsplit(" -o ", 1)[0] + f" -I{tree / 'tests'} -o x.o -c {path}"})
            print(f"also read: {name}")
    index = work / "database"
    index.mkdir()
    (index / "compile_commands.json").write_text(json.dumps(database))
    files = [entry["file"] for entry in database]
    started = []
    for k in range(jobs):
        log = open(work / f"log{k}", "w")
        started.append(subprocess.Popen(["nice", "-n", "10", str(indexer()), str(tree.resolve()), str(index), str(work / f"facts{k}"),
                                         *files[k::jobs]], stdout=log, stderr=log))
    facts = set()
    for k, process in enumerate(started):
        process.wait()
        for line in (work / f"log{k}").read_text(errors="replace").splitlines():
            if "error:" in line:
                print("LEFT indexer:", line)
                ERRORS.append(line)
        facts |= set((work / f"facts{k}").read_text().splitlines())
    return facts


class Use:
    def __init__(self, f):
        self.file, self.offset, self.name, self.kind, self.space, self.home, self.here = f[1], int(f[2]), *f[3:8]
        self.macro, self.shadow = f[8] == "macro", f[9] == "shadow"
        self.old, self.name = self.name, RENAMED.get((self.space, self.name), self.name)


class Declaration:
    def __init__(self, f):
        self.file, self.offset, self.name, self.kind, self.space = f[1], int(f[2]), f[3], f[4], f[5]
        self.definition, self.friend, self.begin, self.extra = f[6] == "definition", f[7] == "friend", int(f[8]), f[9]
        self.old, self.name = self.name, RENAMED.get((self.space, self.name), self.name)


def parse(facts):
    """The facts as uses and declarations; what is renamed has its new name as `name`, and its old one as `old`."""
    uses, declarations = [], []
    for line in sorted(facts):
        f = line.split("\t")
        (uses if f[0] == "U" else declarations).append(Use(f) if f[0] == "U" else Declaration(f))
    return uses, declarations


# ---------------------------------------------------------------------------------------------------------------------------
# Where things go


def room_space(file):
    """The namespace of the room that a file belongs to; None where it has none."""
    parts = file.split("/")
    if len(parts) == 1:
        return None
    room = parts[0]
    if room == "tests":
        room = TEST_FOLDERS.get(parts[1], parts[1])
    return SPACE.get(room)


def new_space(file, space):
    """The namespace, as a list, that `space` of `file` becomes; unnamed ones are left away."""
    parts = [part for part in space.split("::") if part and part != "(anon)"]
    room = room_space(file)
    if not parts or parts[0] != OLD or room is None or (len(parts) > 1 and (parts[1] == room or parts[1] in STAY)):
        return parts
    return [OLD, room, *parts[1:]]


def named(space):
    return [part for part in space.split("::") if part and part != "(anon)"]


class Plan:
    def __init__(self, tree, uses, declarations):
        self.tree = tree
        self.texts = {}
        self.edits = defaultdict(dict)  # file -> offset -> (length, text)
        self.left = []
        self.qualified = defaultdict(list)  # (file, qualified name) -> (offset, name, namespace there) of each unqualified use
        self.usings = defaultdict(list)     # file -> qualified names
        self.counts = Counter()
        self.uses, self.declarations = uses, declarations
        self.read()

    def text(self, file):
        if file not in self.texts:
            self.texts[file] = (self.tree / file).read_bytes()
        return self.texts[file]

    def where(self, file, offset):
        return f"{file}:{self.text(file)[:offset].count(10) + 1}"

    def say(self, what):
        self.left.append(what)

    def read(self):
        """Tables of what is declared: namespaces that have a name, where exported names are defined, hidden friends."""
        self.spaces_of = defaultdict(set)   # (new space, name) there is
        self.inner = defaultdict(set)       # namespace in a room -> that room's
        seen = defaultdict(set)
        for d in self.declarations:
            if d.kind == "Namespace":
                if d.file.split("/")[0] in SPACE and named(d.space) == [OLD]:
                    self.inner[d.name].add(tuple(new_space(d.file, f"{OLD}::{d.name}")[:-1]))
                continue
            seen[d.space, d.name].add(d.friend)
            if not d.friend:
                self.spaces_of[d.name].add(tuple(new_space(d.file, d.space)))
        self.hidden = {key for key, friends in seen.items() if friends == {True}}
        self.homes = {}
        for d in self.declarations:
            if d.name in EXPORTED and named(d.space)[:1] == [OLD] and "(anon)" not in d.space and d.file.endswith(".hpp") and \
                    not d.file.startswith(("tests/", "bench/")) and len(named(d.space)) == 1 and d.kind != "Namespace":
                if d.kind in ("CXXRecord", "ClassTemplate", "Enum") and not d.definition:
                    continue
                self.homes.setdefault(d.name, set()).add(d.file)
        for name in EXPORTED:
            if name not in self.homes:
                self.say(f"exported name {name} is declared nowhere")
            elif len({room_space(file) for file in self.homes[name]}) > 1:
                self.say(f"exported name {name} is declared in several rooms: {sorted(self.homes[name])}")

    def exported(self, use, home_space):
        if use.name not in self.homes or len(home_space) != 2 or use.home not in self.homes[use.name]:
            return False
        here = new_space(use.file, use.here)
        for k in range(2, len(here) + 1):  # a name of the room itself would be found first
            if tuple(here[:k]) in self.spaces_of[use.name]:
                return False
        return True

    def qualifier(self, use):
        """What has to stand before an unqualified use; '' for nothing."""
        here = new_space(use.file, use.here)
        home = new_space(use.home, use.space)
        if use.kind in ("namespace", "directive", "aliased"):
            if use.name == OLD:
                return ""
            if named(use.space) == [OLD] and (use.name in STAY or use.name in SPACE.values()):
                return ""
            if use.name in EXPORTED_SPACES:
                return ""
        elif self.exported(use, home):
            return ""
        if home == here[:len(home)]:
            return ""
        if named(use.space) != [OLD] and named(use.space) != named(use.here)[:len(named(use.space))]:
            return ""  # found by a using-directive or using-declaration, which goes on finding it
        k = 0
        while k < min(len(home), len(here)) and home[k] == here[k]:
            k += 1
        rest = home[k:] if k else home[1:]
        return "".join(part + "::" for part in rest)

    def after_wheelwright(self, use):
        """What has to stand between wheelwright:: and a name."""
        home = new_space(use.home, use.space)
        if use.kind in ("namespace", "directive", "aliased"):
            return "" if use.name == OLD or use.name in STAY or use.name in SPACE.values() or use.name in EXPORTED_SPACES else \
                "".join(part + "::" for part in home[1:])
        if use.name in self.homes and use.home in self.homes[use.name]:
            return ""
        return "".join(part + "::" for part in home[1:])

    def insert(self, file, offset, length, text):
        old = self.edits[file].get(offset)
        if old is not None and old != (length, text):
            self.say(f"{self.where(file, offset)}: two edits of one place: {old} and {(length, text)}")
            return
        self.edits[file][offset] = (length, text)

    def qualify(self):
        places = defaultdict(list)
        for use in self.uses:
            if use.home == "?" or use.name.startswith("operator"):
                continue
            places[use.file, use.offset].append(use)
        for (file, offset), uses in sorted(places.items()):
            text = self.text(file)
            name = uses[0].old
            raw = name.encode()
            if text[offset:offset + len(raw)] != raw or re.match(rb"\w", text[offset + len(raw):offset + len(raw) + 1]):
                if uses[0].kind != "alias":
                    self.say(f"{self.where(file, offset)}: expected {name}")
                continue
            before = text[max(0, offset - 80):offset].rstrip()
            words = {use.name for use in uses}
            word = uses[0].name
            if len(words) > 1:
                self.say(f"{self.where(file, offset)}: {name} may be any of {sorted(words)}")
            wanted = set()
            for use in uses:
                if before.endswith(b"::"):
                    if re.search(rb"(?:^|[^\w:])(?:::)?wheelwright::$", before):
                        wanted.add(self.after_wheelwright(use))
                        here, home = new_space(use.file, use.here), new_space(use.home, use.space)
                        if wanted != {""} and len(home) > 1 and here[:1] == [OLD] and (here[:2] != home[:2] or file.startswith("tests/")) and \
                                re.search(rb"(?:^|[^\w:])wheelwright::$", before) and text[:offset].endswith(before[-13:]):
                            self.insert(file, offset - 13, 13, b"")  # the room says enough
                    else:
                        wanted.add("")
                elif use.shadow or (use.space, use.name) in self.hidden or use.kind == "alias":
                    wanted.add("")
                else:
                    wanted.add(self.qualifier(use))
            if len(wanted) > 1:
                self.say(f"{self.where(file, offset)}: {name} may be of {sorted(wanted)}")
                wanted = {""}
            before_it = wanted.pop()
            if before_it or word != name:
                self.counts["renamed"] += word != name
                self.insert(file, offset, len(raw), (before_it + word).encode())
                if before_it and not before.endswith(b"::") and not uses[0].macro and \
                        uses[0].kind not in ("namespace", "directive", "aliased", "using"):
                    self.qualified[file, before_it + word].append((offset, word, new_space(file, uses[0].here)))
        for d in self.declarations:
            if d.name != d.old:
                self.insert(d.file, d.offset, len(d.old.encode()), d.name.encode())

    def instantiations(self):
        """Explicit instantiations of functions, which the indexer does not look into."""
        types = defaultdict(set)
        for d in self.declarations:
            if d.file.endswith(".hpp") and named(d.space) == [OLD] and "(anon)" not in d.space and d.kind in TYPES:
                types[d.name.encode()].add(d.file)
        for file in tracked(self.tree, "*.hpp", "*.cpp"):
            text = self.text(file)
            for match in re.finditer(rb"^(?:extern )?template (?!<)[^;]*;", text, re.M):
                for word in re.finditer(rb"(?<![\w.:])[A-Z]\w*", match.group()):
                    offset, name = match.start() + word.start(), word.group().decode()
                    homes = types.get(word.group(), set())
                    if offset in self.edits[file] or not homes or name in self.homes:
                        continue
                    rooms = {room_space(home) for home in homes}
                    if len(rooms) > 1:
                        self.say(f"{self.where(file, offset)}: {name} may be of {sorted(rooms)}")
                    elif rooms != {room_space(file)}:
                        self.insert(file, offset, len(name), f"{rooms.pop()}::{name}".encode())

    def shorten(self):
        """Names that a source takes from another room again and again: a using-declaration, and the short name."""
        brought = defaultdict(set)
        for (file, name), uses in self.qualified.items():
            brought[room_space(file), uses[0][1]].add(name)
        for (file, name), uses in sorted(self.qualified.items()):
            word = uses[0][1]
            opened = re.search(rb"^namespace (wheelwright(?:::\w+)*) \{\n", self.text(file), re.M)
            if not file.endswith(".cpp") or not opened or room_space(file) is None:
                continue
            space = new_space(file, opened.group(1).decode())
            inside = [offset for offset, _, here in uses if offset > opened.end() and here[:len(space)] == space]
            own = any(tuple(space[:k]) in self.spaces_of[word] for k in range(2, len(space) + 1))
            if len(inside) < OFTEN or own or len(brought[room_space(file), word]) > 1:
                continue
            for offset in inside:
                length, text = self.edits[file][offset]
                self.edits[file][offset] = (length, word.encode())
            self.usings[file].append(name)

    def write(self):
        changed = {}
        for file in tracked(self.tree, "*.hpp", "*.cpp"):
            text = self.text(file)
            out, at = b"", 0
            for offset, (length, new) in sorted(self.edits[file].items()):
                out += text[at:offset] + new
                at = offset + length
            out = (out + text[at:]).decode()
            out = self.reopen(file, out)
            changed[file] = out
        for file in tracked(self.tree, "*.md", "tools/check_package.sh"):
            changed[file] = self.prose((self.tree / file).read_text())
        for file, old, new in BY_HAND:
            text = changed.get(file)
            if text is None:
                text = (self.tree / file).read_text() if (self.tree / file).is_file() else ""
            if text.count(old) != 1:
                self.say(f"{file}: by hand: {text.count(old)} places, expected one: {old!r}")
            changed[file] = text.replace(old, new)
        page = "docs/decisions.md"
        last = max(int(n) for n in re.findall(r"^(\d+)\. ", changed[page], re.M))
        changed[page] = changed[page].rstrip("\n") + f"\n{last + 1}. {DECISION}"
        written = []
        for file, text in changed.items():
            if (self.tree / file).read_text() != text:
                (self.tree / file).write_text(text)
                written.append(file)
        return written

    def prose(self, text):
        """Code in pages and scripts."""
        def named_there(match):
            name = RENAMED.get((OLD, match.group(1)), match.group(1))
            if name in self.homes:
                return f"wheelwright::{name}"
            rooms = {space[1] for space in self.spaces_of[name] | self.inner[name] if len(space) == 2} & INSTALLED
            return f"wheelwright::{rooms.pop()}::{name}" if len(rooms) == 1 and name not in SPACE.values() else match.group()
        return re.sub(r"\bwheelwright::(\w+)", named_there, text)

    def reopen(self, file, text):
        """namespace wheelwright::X { of a file as it becomes, and the names that its users type."""
        def reopened(match):
            return match.group(1) + "::".join(new_space(file, match.group(2)))
        text = re.sub(r"^((?:}  // )?namespace )(wheelwright(?:::\w+)*)(?= \{$|$)", reopened, text, flags=re.M)
        text = re.sub(r"^}  // namespace (wheelwright[\w:]*)\n\nnamespace \1 \{\n", "", text, flags=re.M)
        text = re.sub(rf"^using namespace {room_space(file)};\n", "", text, flags=re.M)
        if self.usings[file]:
            lines = "".join(f"using {name};\n" for name in sorted(self.usings[file]))
            text = re.sub(r"^(namespace wheelwright[\w:]* \{\n)\n?", lambda m: m.group(1) + "\n" + lines + "\n", text, count=1, flags=re.M)
        for (_, old), new in RENAMED.items():
            text = rewrapped(text, re.sub(rf"(//.*?)\b{old}\(\)", rf"\1{new}()", text))
        names = sorted(name for name, files in self.homes.items() if file in files)
        spaces = [name for name in EXPORTED_SPACES
                  if re.search(rf"^namespace wheelwright::{room_space(file)}::{name} \{{$", text, re.M) and file.endswith(".hpp")
                  and file.split("/")[0] in SPACE]
        if names or spaces:
            room = room_space(file)
            body = "".join(f"namespace {name} = {room}::{name};\n" for name in spaces)
            body += "".join(f"using {room}::{name};\n" for name in names)
            text = text.rstrip("\n") + f"\n\nnamespace wheelwright {{\n{body}}}  // namespace wheelwright\n"
            self.counts["exported"] += len(names)
        return text


def rewrapped(before, text):
    """Lines of comments that have become too long hand their last words on to the next."""
    old, lines = set(before.split("\n")), text.split("\n")
    k = 0
    while k < len(lines):
        line = lines[k]
        begin = re.match(r"\s*///? ", line)
        if begin and line not in old and len(line) > 120:
            at = line.rindex(" ", 0, 121)
            rest = line[at + 1:]
            lines[k] = line[:at]
            follows = k + 1 < len(lines) and lines[k + 1].startswith(begin.group()) and lines[k + 1] != begin.group().rstrip()
            if follows:
                lines[k + 1] = begin.group() + rest + " " + lines[k + 1][len(begin.group()):]
            else:
                lines.insert(k + 1, begin.group() + rest)
        k += 1
    return "\n".join(lines)


def conflicts(plan):
    """What one name declares in several new namespaces, or what meets in one."""
    table = defaultdict(set)
    for d in plan.declarations:
        if d.kind == "Namespace" or "(anon)" in d.space or d.friend or not d.space.startswith(OLD):
            continue
        table[d.space, d.name, d.extra if d.kind == "Function" else ""].add((tuple(new_space(d.file, d.space)), d.file, d.definition, d.kind))
    out = []
    for (space, name, extra), where in sorted(table.items()):
        if len({w[0] for w in where}) > 1:
            out.append(f"{space}::{name}: " + ", ".join(sorted(f"{w[1]} ({w[3]}{', definition' if w[2] else ''})" for w in where)))
    for (space, name, extra), where in sorted(table.items()):
        if name in SPACE.values() and len(named(space)) == 1 and name not in MAY_MEET:
            out.append(f"room's name: {space}::{name}: " + ", ".join(sorted(w[1] for w in where)))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tree", type=Path)
    parser.add_argument("--facts", type=Path)
    parser.add_argument("--keep-facts", type=Path)
    parser.add_argument("--check", action="store_true")
    a = parser.parse_args()
    tree = a.tree.resolve()
    if re.search(r"^namespace wheelwright::core \{", (tree / "core/error.hpp").read_text(), re.M):
        sys.exit(f"{tree} has its namespaces already")
    if not a.check and run("git", "-C", tree, "status", "--porcelain", "-uno", capture_output=True, text=True).stdout:
        sys.exit(f"{tree} is not clean: commit or stash first")
    facts = set(a.facts.read_text().splitlines()) if a.facts else gather(tree)
    if a.keep_facts:
        a.keep_facts.write_text("\n".join(sorted(facts)) + "\n")
    uses, declarations = parse(facts)
    plan = Plan(tree, uses, declarations)
    plan.qualify()
    plan.instantiations()
    plan.shorten()
    plan.counts["using-declarations"] = sum(len(names) for names in plan.usings.values())
    plan.counts["qualifiers"] = sum(b"::" in text for edits in plan.edits.values() for _, text in edits.values())
    for line in conflicts(plan):
        plan.say("declared apart: " + line)
    print(dict(plan.counts), "files:", len(plan.edits))
    if not a.check:
        written = plan.write()
        cpp = [name for name in written if name.endswith((".hpp", ".cpp"))]
        run("tools/check_format.sh", "--fix", *cpp, cwd=tree)
        print("written:", len(written))
    for line in plan.left:
        print("LEFT", line)
    return 1 if plan.left or ERRORS else 0


if __name__ == "__main__":
    sys.exit(main())
