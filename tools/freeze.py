#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Hashes of the program's results, so that a change which shall change none can be seen to.

    tools/freeze.py --program build/bin/wheelwright --write before.json     # all runs, shared recordings too
    tools/freeze.py --program build/bin/wheelwright --against before.json   # ends with 1 where a result differs
    tools/freeze.py --program build/bin/wheelwright --quick --against tools/behaviour.json   # what CI runs
    tools/freeze.py --program build/bin/wheelwright --against before.json --keep now         # and leave the results
    tools/freeze.py --program build/bin/wheelwright --against before.json --threads 1        # results of one thread
    tools/freeze.py --numbers before now   # two such folders: the largest relative difference of any number in a file

Runs stand in tools/freeze_runs.py. Every run gets an exit code, a hash of what it prints as a result, and one of each
JSON file, CSV file, header, robot file and simulator's file that it writes; of pages and plain words only with --words.
Recordings in binary formats are compared by what they are when converted back. What may differ from run to run is
taken out in comparable(). Results must not depend on --threads. The C library is asked for the same mathematical
functions on every machine (GLIBC_TUNABLES). Python's results are there where the module is built beside the program.
"""
import argparse
import concurrent.futures
import csv
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from freeze_runs import INPUTS, ROOT, SHARED, all_runs, recorded_runs  # noqa: E402

VOLATILE = {"software"}
HASHED = {".json", ".csv", ".h", ".yaml", ".jsonl", ".urdf", ".xml", ".sdf"}
WORDS = {".html", ".txt", ".md", ".1"}
ROUNDING = 1e-15  # rad
NO_THREADS = {"completion", "man", "--version"}


def with_needs(runs, names):
    """The runs of these names and all that they need, in the order of `runs`."""
    by_name, wanted, open_names = {r.name: r for r in runs}, set(), list(names)
    while open_names:
        name = open_names.pop()
        if name not in by_name:
            sys.exit(f"freeze: no run '{name}'; there are {', '.join(sorted(by_name))}")
        if name not in wanted:
            wanted.add(name)
            open_names += by_name[name].needs
    return [r for r in runs if r.name in wanted]


def without_volatile(value):
    if isinstance(value, dict):
        return {k: without_volatile(v) for k, v in value.items() if k not in VOLATILE}
    if isinstance(value, list):
        return [without_volatile(v) for v in value]
    return value


def comparable(path):
    """The bytes of a file without what may differ between equal results: the software's name and version in JSON."""
    content = path.read_bytes()
    if path.suffix == ".json":
        return json.dumps(without_volatile(json.loads(content))).encode()
    if path.suffix == ".jsonl":
        return "\n".join(json.dumps(without_volatile(json.loads(line))) for line in content.splitlines()).encode()
    return content


def digest(path):
    return hashlib.sha256(comparable(path)).hexdigest()[:16]


def columns(path):
    with path.open(newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    return dict(zip(names, zip(*rows)))


def same_column(name, old, new):
    """Whether the texts are equal; a heading, which ROS messages hold as a quaternion, may differ by its rounding."""
    if name != "theta" or len(old) != len(new):
        return old == new
    return all(a == b or abs(float(a) - float(b)) <= ROUNDING for a, b in zip(old, new))


def column_difference(before, after):
    """What tells the columns of two CSV files apart; "equal" where nothing does."""
    old, new = columns(before), columns(after)
    if set(old) != set(new):
        return f"columns {', '.join(sorted(set(old) ^ set(new)))} are in one only"
    differing = (name for name in sorted(old) if not same_column(name, old[name], new[name]))
    return next((f"column {name} differs" for name in differing), "equal")


def module_folder(program):
    """Where the Python module of the same build is; nothing where it is not built."""
    folder = program.parent.parent / "python"
    return folder if any(folder.glob("wheelwright/_core*.so")) else None


def command_of(run, call, program, threads):
    # Results name the files they come from: as seen from the run's folder, wherever this repository lies.
    call = [word.replace(str(INPUTS), "../inputs").replace(str(ROOT / "examples"), "../shipped")
            .replace(str(SHARED), "../recorded") for word in call]
    if run.python:
        return [sys.executable, "-B", *call]
    return [program, *call, *(["--threads", str(threads)] if threads and call[0] not in NO_THREADS else [])]


def results_of(run, program, folder, words, threads):
    here = folder / run.name
    here.mkdir()
    for name, text in run.files.items():
        (here / name).write_text(text, encoding="utf-8")
    environment = dict(os.environ, GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F", LC_ALL="C")
    if run.python:
        environment["PYTHONPATH"] = str(module_folder(program))
    codes, printed, complaint = [], b"", ""
    for call in run.calls:
        done = subprocess.run(command_of(run, call, program, threads), cwd=here, env=environment, capture_output=True,
                              input=(here / run.stdin).read_bytes() if run.stdin else b"", check=False)
        codes.append(done.returncode)
        printed, complaint = done.stdout, done.stderr.decode(errors="replace").strip()[:300]
    found = {"exit": codes[0] if len(codes) == 1 else codes}
    if run.printed:
        (here / run.printed).write_bytes(printed)
    elif words:
        (here / "stdout.txt").write_bytes(printed)
    for path in sorted(p for p in here.rglob("*") if p.is_file()):
        name = str(path.relative_to(here))
        if name not in run.files and (path.suffix in HASHED or (words and path.suffix in WORDS)):
            found[name] = digest(path)
    failed = len(found) == 1 or (run.python and codes != [0])
    if run.same and not failed:
        found["columns"] = column_difference(*(here / name for name in run.same))
        failed, complaint = found["columns"] != "equal", f"{' and '.join(run.same)}: {found['columns']}"
    if failed:
        found["error"] = complaint
    return found


def all_results(runs, program, jobs, words, threads, keep):
    results, waiting = {}, list(runs)
    if keep:
        keep.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        going, folder = {}, (keep or pathlib.Path(temporary)).resolve()
        (folder / "shipped").symlink_to(ROOT / "examples")
        (folder / "recorded").symlink_to(SHARED)
        (folder / "inputs").symlink_to(INPUTS)
        while waiting or going:
            for run in [r for r in waiting if all(n in results for n in r.needs)]:
                waiting.remove(run)
                going[pool.submit(results_of, run, program, folder, words, threads)] = run
            for future in concurrent.futures.wait(going, return_when=concurrent.futures.FIRST_COMPLETED).done:
                run = going.pop(future)
                results[run.name] = future.result()
                print(f"{len(results)}: {run.name}", file=sys.stderr)
    return {name: results[name] for name in sorted(results)}


def differences(before, now):
    for name in sorted(set(before) & set(now)):
        for what in sorted(set(before[name]) | set(now[name])):
            old, new = before[name].get(what), now[name].get(what)
            if old != new:
                yield f"{name}: {what}: {old} -> {new}"
    for name in sorted(set(now) - set(before)):
        yield f"{name}: not among the results to compare with"


def largest_difference(old, new, where=""):
    """(relative difference, where) of the numbers of two JSON values; infinite where they differ otherwise."""
    number = (int, float)
    if isinstance(old, number) and isinstance(new, number) and not isinstance(old, bool) and not isinstance(new, bool):
        return (0.0 if old == new else abs(old - new) / max(abs(old), abs(new)), where)
    if isinstance(old, dict) and isinstance(new, dict) and set(old) == set(new):
        return max((largest_difference(old[k], new[k], f"{where}.{k}") for k in old if k not in VOLATILE),
                   default=(0.0, where))
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return max((largest_difference(a, b, f"{where}[{k}]") for k, (a, b) in enumerate(zip(old, new))),
                   default=(0.0, where))
    return (0.0 if old == new else float("inf"), where)


def compare_numbers(before, now):
    for path in sorted(now.rglob("*.json")):
        name = path.relative_to(now)
        if not (before / name).is_file():
            print(f"{name}: not among the earlier ones")
            continue
        size, where = largest_difference(json.loads((before / name).read_text()), json.loads(path.read_text()))
        if size > 0.0:
            print(f"{name}: {size:.1e} at {where}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="a minute's worth, without shared recordings")
    parser.add_argument("--words", action="store_true", help="pages and printed words, too")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--against", type=pathlib.Path)
    parser.add_argument("--only", action="append", help="runs of these names, with what they need")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--threads", type=int, help="of each run; by default the program's own choice")
    parser.add_argument("--keep", type=pathlib.Path, help="a new folder for the results themselves")
    parser.add_argument("--numbers", nargs=2, type=pathlib.Path, metavar=("BEFORE", "NOW"))
    options = parser.parse_args()
    if options.numbers:
        compare_numbers(*options.numbers)
        return 0
    if not options.program:
        parser.error("--program is missing")
    program = options.program.resolve()
    runs = [r for r in all_runs() if options.words or not r.words]
    if not module_folder(program):
        print("freeze: no Python module beside the program: its results are left out", file=sys.stderr)
        runs = [r for r in runs if not r.python]
    if options.quick:
        runs = with_needs(runs, [r.name for r in runs if r.quick])
    elif (SHARED / "data").is_dir():
        runs += recorded_runs()
    else:
        print("freeze: no shared recordings here: shipped and simulated logs only", file=sys.stderr)
    if options.only:
        runs = with_needs(runs, options.only)
    results = all_results(runs, program, options.jobs, options.words, options.threads, options.keep)
    if options.write:
        options.write.write_text(json.dumps(results, indent=1) + "\n")
    failed = [f"{n}: {r['error']}" for n, r in results.items() if "error" in r]
    changed = list(differences(json.loads(options.against.read_text()), results)) if options.against else []
    for line in failed + changed:
        print(line)
    print(f"{len(results)} runs, {sum(len(r) - 1 for r in results.values())} files, {len(changed)} differences")
    return 1 if failed or changed else 0


if __name__ == "__main__":
    sys.exit(main())
