#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Faults injected into the program while it works: nothing lost, nothing half written, nothing left behind.

    tests/campaigns/faults.py [--program build/bin/wheelwright] [--runs 2000] [--seed 1] [--fault WORD] [--command WORD]

Runs commands on short logs, in an empty place or where an earlier result stands, kills, starves or deafens them, then
runs each again undisturbed, and prints a table (Markdown). The oracle is the bytes that an undisturbed run writes. By
fault:

    injected     runs that met the fault
    lost         the exit code is that of the undisturbed run, and a file or what it prints is not
    half         a file is neither the earlier one nor the new one; a result (its JSON) stands beside files that are not
                 its own; some files of a result are new and others not, though the run was not stopped between renames
    left behind  a temporary file, a copy or an empty directory: at once, or, where the run was killed, after the next;
                 or that the next run is refused, or writes something else
    wrong exit   neither the undisturbed run's code, nor 2 with a message, nor 128 + the signal that was sent: a crash,
                 an abort, a failure that says nothing, a run that does not end

Ends with 1 where anything but the first is not 0, and tells how each was met. A full disk is a small file system in
memory: as root only. Kills at calls take build/bin/librecorded_calls.so (the target recorded_calls). What is random is
drawn from
--seed; when a signal arrives is up to the machine. Takes some five minutes.
"""

import argparse
import concurrent.futures
import dataclasses
import os
import queue
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEMPORARY = re.compile(r"wheelwright-(?:part|copy)|-journal$|-wal$|-shm$")
STORE = re.compile(r"results\.sqlite(?:-wal|-shm|-journal)?$")  # what fleet and sensitivity go on from
LONGEST = 120.0
NOBODY = 65534
DRIVE = """robot: robot.yaml
parameters: {{mass: {mass}, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}}
trajectory: {{kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 3}}
duration: 20
rate: 50
sensors: {{noise: uniform, wheel_speed: 0.02, effort: 0.02}}
"""
STUDY = """scenario: drive.yaml
inputs: {duration: [4, 6]}
quantities: [width]
methods: {one_at_a_time: {levels: 2}}
"""
COMMANDS = {
    "simulate": "simulate in/drive.yaml --out out/log.csv --force",
    "convert to CSV": "convert in/log.mcap out/log.csv --force",
    "convert to CSV, packed": "convert in/log.h5 out/log.csv.zst --force",
    "convert to MCAP": "convert in/log.csv out/log.mcap --force",
    "convert to HDF5": "convert in/log.db3 out/log.h5 --force",
    "convert to a database": "convert in/log.csv out/log.db3 --force",
    "convert to a bag": "convert in/log.csv out/bag",
    "commission": "commission in/log.csv --robot in/robot.yaml --out out/a/model",
    "identify": "identify in/log.csv --robot in/robot.yaml --out out/a/identified --json",
    "doctor": "doctor in/log.mcap --robot in/robot.yaml --out out/a/examined",
    "detect": "detect in/log.csv --model in/model.json --out out/a/found",
    "detect, series": "detect in/log.h5 --model in/model.json --series out/series.h5 --layouts --force",
    "margins": "margins in/log.csv --model in/model.json --fault wheel_radius --window 1 --out out/a/margins --json",
    "gap": "gap in/log.csv --robot in/robot.yaml --no-manoeuvre --no-shrink --out out/a/gap --json",
    "design": "design --model in/model.json --for bounds --speed 8 --acceleration 20 --duration 4 --stages 1 --rate 50 "
              "--out out/a/plan",
    "export": "export in/model.json --language c --out out/a/firmware",
    "man": "man --out out/a/pages",
    "fleet": "fleet in/fleet --robot in/robot.yaml --out out/a/fleet",
    "sensitivity": "sensitivity in/study.yaml --out out/a/study --json",
}
READ = {"design": "in/model.json", "fleet": "in/fleet/amy.csv"}  # for others it is their first argument


@dataclass
class Whole:
    """A command and what it does undisturbed, from nothing and where an earlier result (`old`) stands."""
    name: str
    words: list
    code: int = 0
    seconds: float = 0.0
    printed: bytes = b""
    files: dict = field(default_factory=dict)  # bytes by name; None for a directory
    clocks: dict = field(default_factory=dict)  # by name: where a file holds the time at which it was made
    old: Path = None
    calls: int = 0
    differs: str = ""  # why there is no oracle

    def is_new(self, name, content):
        if name not in self.files or content is None or name not in self.clocks:
            return name in self.files and content == self.files[name]
        expected, clocks = self.files[name], self.clocks[name]
        return len(content) == len(expected) and all(a == b or at in clocks
                                                     for at, (a, b) in enumerate(zip(content, expected)))

    def all_new(self, tree):
        return tree.keys() == self.files.keys() and all(self.is_new(name, tree[name]) for name in tree)


@dataclass
class Run:
    code: int
    out: bytes = b""
    err: bytes = b""
    met: bool = True  # the fault came before the end
    sent: int = 0  # the signal
    speaks: bool = True  # its standard error could be read
    as_if: object = None  # what is expected in place of the undisturbed run


def tree_of(folder, stores=False):
    """What stands in a folder: bytes by name, None for directories; without stores, unless they are asked for."""
    tree = {}
    for where, folders, names in os.walk(folder):
        for name in folders:
            tree[str((Path(where) / name).relative_to(folder))] = None
        for name in names:
            if stores or not STORE.search(name):
                tree[str((Path(where) / name).relative_to(folder))] = (Path(where) / name).read_bytes()
    return tree


def litter(folder, stores=True):
    """Names of temporary files and of empty directories; `stores`: also what belongs to an open store."""
    found = []
    for where, folders, names in os.walk(folder):
        found += [f"{where}/{name}" for name in folders + names
                  if TEMPORARY.search(name) and (stores or not STORE.search(name))]
        if not folders and not names and Path(where) != folder:
            found.append(f"{where}/ (empty)")
    return found


class Place:
    """A folder in which one run at a time works: in/ with what it reads, out/ and tmp/ with what it writes."""

    def __init__(self, program, folder, inputs, earlier):
        self.program, self.folder, self.inputs, self.earlier = program, folder, inputs, earlier
        self.out = folder / "out"
        folder.mkdir()
        (folder / "tmp").mkdir()
        (folder / "tmp").chmod(0o777)
        self.renew_inputs()
        self.clear()

    def renew_inputs(self):
        shutil.rmtree(self.folder / "in", ignore_errors=True)
        shutil.copytree(self.inputs, self.folder / "in")

    def clear(self, old=None):
        shutil.rmtree(self.out, ignore_errors=True)
        for left in (self.folder / "tmp").iterdir():
            if left.is_dir():
                shutil.rmtree(left)
            else:
                left.unlink()
        if old:
            shutil.copytree(old, self.out)
        else:
            self.out.mkdir()

    def begin(self, words, before=(), environment=None, **streams):
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
        return subprocess.Popen([*before, self.program, *words], cwd=self.folder, stdin=subprocess.DEVNULL,
                                restore_signals=False, env={**os.environ, "TMPDIR": str(self.folder / "tmp"),
                                                            **(environment or {})}, **streams)

    @staticmethod
    def end(process, **facts):
        try:
            out, err = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return Run(-999, **facts)
        return Run(process.returncode, out or b"", err or b"", **facts)

    def run(self, words, before=(), environment=None, facts=None, **streams):
        return self.end(self.begin(words, before, environment, **streams), **(facts or {}))


# Faults: each runs the command in `place` once, and returns what it did.


def signalled(number):
    def fault(place, whole, draw):
        process = place.begin(whole.words)
        time.sleep(draw.uniform(0.0, 1.05 * whole.seconds))
        met = process.poll() is None
        process.send_signal(number)
        return place.end(process, met=met, sent=number)
    return fault


def at_call(variable):
    def fault(place, whole, draw):
        environment = {"LD_PRELOAD": str(place.program.parent / "librecorded_calls.so"),
                       variable: str(draw.randint(1, max(1, whole.calls)))}
        return place.run(whole.words, environment=environment,
                         facts={"sent": signal.SIGKILL if variable.endswith("KILL") else 0})
    return fault


def limited(place, whole, draw):
    largest = max((len(content) for content in whole.files.values() if content), default=1)
    return place.run(whole.words, ["prlimit", f"--fsize={draw.randrange(largest)}"])


def room_for(tree):
    return sum(4096 + (len(content) + 4095) // 4096 * 4096 for content in tree.values() if content)


def full_disk(place, whole, draw):
    """On a file system with room for a part of the result; it grows for the next run."""
    size = room_for(tree_of(place.out, stores=True)) + 8192 + draw.randrange(room_for(whole.files))
    kept = place.folder / "kept"
    place.out.rename(kept)
    place.out.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "wheelwright-faults", place.out], check=True)
    shutil.copytree(kept, place.out, dirs_exist_ok=True)
    shutil.rmtree(kept)
    return place.run(whole.words)


def full(stream):
    def fault(place, whole, draw):
        with open("/dev/full", "wb") as nowhere:
            return place.run(whole.words, **{stream: nowhere}, facts={"speaks": stream != "stderr"})
    return fault


def closed(stream):
    def fault(place, whole, draw):
        return place.run(whole.words, ["sh", "-c", f'exec "$@" {1 if stream == "stdout" else 2}>&-', "sh"],
                         facts={"speaks": stream != "stderr"})
    return fault


def reader_gone(place, whole, draw):
    reader, writer = os.pipe()
    os.close(reader)
    try:
        return place.run(whole.words, stdout=writer)
    finally:
        os.close(writer)


def forbidden(place, whole, draw):
    """The user may not write into what is there; made writable for the next run."""
    for where in [place.out, *(path for path in place.out.rglob("*") if path.is_dir())]:
        where.chmod(0o555)
    as_nobody = ["setpriv", f"--reuid={NOBODY}", "--clear-groups"] if os.geteuid() == 0 else []
    run = place.run(whole.words, as_nobody)
    for where in [place.out, *(path for path in place.out.rglob("*") if path.is_dir())]:
        where.chmod(0o755)
    return run


def changed_input(how):
    """A log that changes while it is read: what comes out is the result of the log as it was, or as it is now."""
    def fault(place, whole, draw):
        if whole.name in ("man", "sensitivity"):  # the one reads nothing, to the other a change is another study
            return Run(0, met=False)
        path = place.folder / READ.get(whole.name, whole.words[1])
        process = place.begin(whole.words)
        time.sleep(draw.uniform(0.0, 0.7 * whole.seconds))
        met = process.poll() is None
        how(path, place.earlier / path.relative_to(place.folder / "in"), draw)
        run = place.end(process, met=met)
        run.as_if = dataclasses.replace(whole, printed=run.out)  # it may say that the log has ended since
        if whole.name == "fleet" and b"written to while" in tree_of(place.out).get("a/fleet/fleet.json", b""):
            # A finding of this robot, of which the next run keeps nothing.
            run.as_if = dataclasses.replace(whole, code=1, printed=run.out, files=tree_of(place.out))
        elif met and run.code in (0, 1) and not whole.all_new(tree_of(place.out)):
            kept = place.folder / "kept"
            place.out.rename(kept)
            place.clear()
            now = place.run(whole.words)
            run.as_if = dataclasses.replace(whole, code=now.code, printed=now.out, files=tree_of(place.out))
            shutil.rmtree(place.out)
            kept.rename(place.out)
        place.renew_inputs()
        return run
    return fault


def cut_off(path, _, draw):
    os.truncate(path, draw.randrange(path.stat().st_size))


def replaced(path, other, _):
    beside = path.with_name("beside")
    shutil.copy(other, beside)
    beside.rename(path)


def written_over(path, other, _):
    path.write_bytes(other.read_bytes())


def two_at_once(place, whole, draw):
    first = place.begin(whole.words)
    time.sleep(draw.uniform(0.0, whole.seconds) * draw.randrange(2))
    met = first.poll() is None
    runs = [place.end(process, met=met) for process in (first, place.begin(whole.words))]
    strange = [run for run in runs if run.code not in (whole.code, 2)]
    return (strange or [run for run in runs if run.code == whole.code] or runs)[0]


FAILS = "sync or rename fails (EIO)"
FAULTS = {
    "SIGKILL": signalled(signal.SIGKILL),
    "SIGKILL at a sync or rename": at_call("RECORDED_CALLS_KILL"),
    "SIGINT": signalled(signal.SIGINT),
    "SIGTERM": signalled(signal.SIGTERM),
    FAILS: at_call("RECORDED_CALLS_FAIL"),
    "disk full": full_disk,
    "file size limit": limited,
    "standard output full": full("stdout"),
    "standard output closed": closed("stdout"),
    "reader of standard output gone": reader_gone,
    "standard error full": full("stderr"),
    "standard error closed": closed("stderr"),
    "no right to write": forbidden,
    "log cut off while it is read": changed_input(cut_off),
    "log replaced while it is read": changed_input(replaced),
    "log written over while it is read": changed_input(written_over),
    "two runs at once": two_at_once,
}
DEAF = {name for name in FAULTS if name.startswith(("standard output", "reader"))}


def judged(place, whole, fault, began, run):
    """Counts of what went wrong, and why."""
    wrong = Counter()
    told = []
    usual, whole = whole, run.as_if or whole

    def count(what, why):
        wrong[what] += 1
        told.append(f"{what}: {why}")

    tree = {name: content for name, content in tree_of(place.out).items() if not TEMPORARY.search(name)}
    files = {name: content for name, content in tree.items() if content is not None}
    killed = run.sent == signal.SIGKILL
    succeeded = run.code == whole.code
    if succeeded and not whole.all_new(tree):
        count("lost", f"exit code {run.code}, {difference(whole, tree)}")
    elif succeeded and fault in DEAF and whole.printed:
        count("lost", f"exit code {run.code} though nothing that it printed arrived")
    elif succeeded and run.speaks and fault not in DEAF and run.out != whole.printed:
        count("lost", f"exit code {run.code}, but it printed {len(run.out)} of {len(whole.printed)} bytes")
    ended_by = {-run.sent, 128 + run.sent} if run.sent else set()
    if not succeeded and run.code not in ended_by and (run.code != 2 or (run.speaks and not run.err)):
        count("wrong exit", f"{run.code}: {run.err.decode(errors='replace').strip()[-300:]}")

    old = {name for name, content in files.items() if began.get(name) == content}
    new = {name for name, content in files.items() if whole.is_new(name, content)}
    put = new - old
    missing = {name for name, content in whole.files.items() if content is not None} - new
    for name in files.keys() - old - new:
        if run.code == 2 and name.endswith("report.html") and files[name].rstrip().endswith(b"</html>"):
            continue  # the page of a failure, which tells why
        count("half", f"{name} is neither old nor new ({len(files[name])} bytes)")
    gone = {name for name, content in began.items() if content is not None} - files.keys()
    if gone:
        count("half", f"{', '.join(sorted(gone))} of the earlier result is gone")
    between = killed or fault == FAILS  # renames come one after another, that of the result last
    result = any(name.endswith("report.html") for name in whole.files)  # others' files are each whole by itself
    if result and put and missing and (not between or any(name.endswith(".json") for name in put)):
        count("half", f"{', '.join(sorted(put))} new, {', '.join(sorted(missing))} not")

    if not killed:
        for name in litter(place.out, stores=False) + litter(place.folder / "tmp"):
            count("left behind", name)
    if killed or tree != began:
        again = usual.name == "convert to a bag" and "bag" in tree  # which is not replaced
        following = None if again else place.run(usual.words)
        after = tree_of(place.out)
        if again:
            pass
        elif following.code != usual.code:
            count("left behind",
                  f"the next run: {following.code}, {following.err.decode(errors='replace').strip()[-300:]}")
        elif not usual.all_new(after) and not any(TEMPORARY.search(name) for name in after):
            count("left behind", f"after the next run {difference(usual, after)}")
        for name in litter(place.out) + litter(place.folder / "tmp"):
            count("left behind", f"after the next run {name}")
    return wrong, told


def difference(whole, tree):
    names = [f"no {name}" for name in whole.files.keys() - tree.keys()]
    names += [f"{name} besides" for name in tree.keys() - whole.files.keys()]
    names += [f"another {name}" for name in tree.keys() & whole.files.keys() if not whole.is_new(name, tree[name])]
    return ", ".join(sorted(names))


def injected(place, whole, fault, draw):
    began_from = whole.old if draw.random() < 0.5 else None
    place.clear(began_from)
    began = tree_of(place.out)
    try:
        run = FAULTS[fault](place, whole, draw)
        if os.path.ismount(place.out):
            subprocess.run(["mount", "-o", "remount,size=64m", place.out], check=True)
        if not run.met:
            return Counter(), []
        wrong, told = judged(place, whole, fault, began, run)
    finally:
        if os.path.ismount(place.out):
            subprocess.run(["umount", place.out], check=True)
    wrong["injected"] += 1
    where = "over an earlier result" if began_from else "in an empty place"
    return wrong, [f"{fault}, {whole.name} {where}: {line}" for line in told]


def make_inputs(program, folder, mass):
    folder.mkdir()
    (folder / "fleet").mkdir()
    shutil.copy(ROOT / "examples/robot.yaml", folder)
    (folder / "drive.yaml").write_text(DRIVE.format(mass=mass), encoding="utf-8")
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    commands = ["simulate drive.yaml --out log.csv", "simulate drive.yaml --seed 7 --out fleet/amy.csv",
                "simulate drive.yaml --seed 8 --out fleet/bob.csv", "convert log.csv log.mcap",
                "convert log.csv log.db3",
                "convert log.csv log.h5", "commission log.csv --robot robot.yaml --out model"]
    for command in commands:
        subprocess.run([program, *command.split(), "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    shutil.move(folder / "model/model.json", folder)
    shutil.rmtree(folder / "model")


def undisturbed(place, names, earlier):
    """What each command does, run twice at different seconds of the clock, and after `earlier`, with another log."""
    wholes = [Whole(name, COMMANDS[name].split()) for name in names]
    for time_of_day in range(2):
        for whole in wholes:
            place.clear()
            begin = time.monotonic()
            run = place.run(whole.words)
            whole.seconds = time.monotonic() - begin
            if run.code not in (0, 1):
                sys.exit(f"{whole.name}: {run.code}, {run.err.decode(errors='replace')}")
            tree = tree_of(place.out)
            whole.differs = whole.differs or (learn_clocks(whole, tree) if time_of_day == 1 else "")
            whole.code, whole.printed, whole.files = run.code, run.out, tree
        time.sleep(1.1 if time_of_day == 0 else 0.0)
    for whole in [whole for whole in wholes if not whole.differs]:
        old = earlier.folder / "old" / re.sub(r"\W+", "-", whole.name)
        earlier.clear()
        earlier.run(whole.words)
        old.parent.mkdir(exist_ok=True)
        earlier.out.rename(old)
        place.clear(old)
        if place.run(whole.words).code == whole.code and whole.all_new(tree_of(place.out)):
            whole.old = old
        calls = place.folder / "calls"
        place.clear()
        place.run(whole.words, environment={"LD_PRELOAD": str(place.program.parent / "librecorded_calls.so"),
                                            "RECORDED_CALLS": str(calls)})
        whole.calls = len(calls.read_bytes().splitlines()) if calls.exists() else 0
        calls.unlink(missing_ok=True)
    return wholes


def learn_clocks(whole, tree):
    for name, content in tree.items():
        first = whole.files.get(name)
        if content is not None and content != first:
            if not name.endswith(".h5") or first is None or len(first) != len(content):
                return f"{whole.name}: two undisturbed runs wrote another {name}"
            words = {at // 4 for at in range(len(content)) if first[at] != content[at]}
            whole.clocks[name] = {4 * word + byte for word in words for byte in range(4)}
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--program", type=Path, default=ROOT / "build/bin/wheelwright")
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--fault", default="", help="only faults with this word")
    parser.add_argument("--command", default="", help="only commands with this word")
    parser.add_argument("--folder", type=Path, help="where to work, instead of the directory for temporary files")
    asked = parser.parse_args()
    program = asked.program.resolve()
    faults = [name for name in FAULTS if asked.fault in name]
    if os.geteuid() != 0 and full_disk in map(FAULTS.get, faults):
        print("left out: disk full (needs root)")
        faults.remove("disk full")
    if not (program.parent / "librecorded_calls.so").exists():
        print("left out: faults at calls (no librecorded_calls.so beside the program)")
        faults = [name for name in faults if "sync or rename" not in name]
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="wheelwright-faults-", dir=asked.folder) as scratch:
        folder = Path(scratch)
        folder.chmod(0o755)
        make_inputs(program, folder / "new", 21.0)
        make_inputs(program, folder / "earlier", 23.0)
        places = queue.SimpleQueue()
        places_made = [Place(program, folder / f"place{number}", folder / "new", folder / "earlier")
                       for number in range(asked.jobs)]
        earlier = Place(program, folder / "earlier-place", folder / "earlier", folder / "new")
        wholes = undisturbed(places_made[0], [name for name in COMMANDS if asked.command in name], earlier)
        findings = [whole.differs for whole in wholes if whole.differs]
        wholes = [whole for whole in wholes if not whole.differs]
        for place in places_made:
            places.put(place)

        def one(number):
            fault, draw = faults[number % len(faults)], random.Random(f"{asked.seed}/{number}")
            whole = draw.choices(wholes, [1 / (0.2 + each.seconds) for each in wholes])[0]  # slow ones less often
            place = places.get()
            try:
                return fault, *injected(place, whole, fault, draw)
            finally:
                places.put(place)

        table = {fault: Counter() for fault in faults}
        with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
            for fault, wrong, told in pool.map(one, range(asked.runs)):
                table[fault] += wrong
                findings += told
    columns = ["injected", "lost", "half", "left behind", "wrong exit"]
    print(f"| seed {asked.seed}, {time.monotonic() - began:.0f} s | {' | '.join(columns)} |")
    print("|---" * (len(columns) + 1) + "|")
    for fault, counts in table.items():
        print(f"| {fault} | {' | '.join(str(counts[column]) for column in columns)} |")
    total = sum(table.values(), Counter())
    print(f"| all | {' | '.join(str(total[column]) for column in columns)} |")
    for line, times in Counter(findings).most_common():
        print(f"{times} × {line}", file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
