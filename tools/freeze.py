#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Hashes of the program's results, so that a change which shall change none can be seen to.

    tools/freeze.py --program build/bin/wheelwright --write before.json     # all runs, shared recordings too
    tools/freeze.py --program build/bin/wheelwright --against before.json   # ends with 1 where a result differs
    tools/freeze.py --program build/bin/wheelwright --quick --against tools/behaviour.json   # what CI runs
    tools/freeze.py --program build/bin/wheelwright --against before.json --keep now         # and leave the results
    tools/freeze.py --numbers before now   # two such folders: the largest relative difference of any number in a file

Every run gets an exit code, a hash of what it prints with --json or to the standard output, and one of each JSON file,
CSV file, header and robot file that it writes; of pages and plain words only with --words. JSON is hashed without the
name of the software. The C library is asked for the same mathematical functions on every machine (GLIBC_TUNABLES).
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
VOLATILE = {"software"}
HASHED = {".json", ".csv", ".h", ".yaml", ".jsonl"}
WORDS = {".html", ".txt", ".md"}

HEALTHY = str(ROOT / "examples/healthy.csv.gz")
ROBOT = str(ROOT / "examples/robot.yaml")
STUDY = str(ROOT / "examples/studies/better_sensor.yaml")
LIMITS = ["--speed", "8", "--acceleration", "20", "--radius", "1.5", "--duration", "10"]


def scenario(name):
    return str(ROOT / "examples/scenarios" / f"{name}.yaml")


class Run:
    """One call of the program in a folder of its own; `needs` are the runs whose files it reads as ../NAME/FILE."""

    def __init__(self, name, words, needs=(), quick=False):
        self.name, self.words, self.needs, self.quick = name, words, tuple(needs), quick


def shipped_runs():
    model = "../commission/r/model.json"
    yield Run("simulate_healthy", ["simulate", scenario("healthy"), "--out", "log.csv"], quick=True)
    yield Run("simulate_fault", ["simulate", scenario("fault"), "--out", "log.csv"], quick=True)
    yield Run("simulate_slip", ["simulate", scenario("slip"), "--out", "log.csv"])
    yield Run("simulate_pose", ["simulate", scenario("commissioning"), "--out", "log.csv"], quick=True)
    yield Run("commission", ["commission", HEALTHY, "--robot", ROBOT, "--out", "r"], quick=True)
    yield Run("commission_pose", ["commission", "../simulate_pose/log.csv", "--robot", ROBOT, "--out", "r"],
              ["simulate_pose"], quick=True)
    yield Run("doctor", ["doctor", HEALTHY, "--robot", ROBOT, "--out", "r"], quick=True)
    yield Run("identify", ["identify", HEALTHY, "--robot", ROBOT, "--out", "r"], quick=True)
    yield Run("check", ["check", model, HEALTHY, "--json"], ["commission"])
    yield Run("detect_healthy", ["detect", "../simulate_healthy/log.csv", "--model", model, "--out", "r"],
              ["commission", "simulate_healthy"], quick=True)
    yield Run("detect_fault", ["detect", "../simulate_fault/log.csv", "--model", model, "--out", "r"],
              ["commission", "simulate_fault"])
    yield Run("detect_slip", ["detect", "../simulate_slip/log.csv", "--model", "../commission_pose/r/model.json",
                              "--out", "r"], ["commission_pose", "simulate_slip"])
    yield Run("margins", ["margins", HEALTHY, "--model", model, "--fault", "wheel_radius", "--fault",
                          "effort_loss_right", "--out", "r"], ["commission"])
    yield Run("margins_all", ["margins", "../simulate_pose/log.csv", "--model", "../commission_pose/r/model.json",
                              "--out", "r"], ["simulate_pose", "commission_pose"])
    yield Run("export", ["export", model, "--language", "c", "--out", "r"], ["commission"], quick=True)
    yield Run("export_box", ["export", model, "--language", "c", "--set", "box", "--out", "r"], ["commission"],
              quick=True)
    yield Run("design_bounds", ["design", "--model", model, "--for", "bounds", *LIMITS, "--out", "r"], ["commission"])
    yield Run("design_detection", ["design", "--model", model, "--for", "detection", "--fault", "wheel_radius=0.03",
                                   *LIMITS, "--out", "r"], ["commission"])
    yield Run("design_discrimination", ["design", "--robot", ROBOT, "--for", "discrimination", "--between", "coulomb",
                                        "--between", "caster_drag", "--size", "coulomb=0.2", *LIMITS, "--out", "r"])
    yield Run("choose", ["choose", HEALTHY, "--robot", ROBOT, "--fault", "wheel_radius=0.05", "--out", "r"])
    yield Run("sensitivity", ["sensitivity", STUDY, "--out", "r"])
    yield Run("gap", ["gap", "../simulate_pose/log.csv", "--robot", ROBOT, "--baseline", HEALTHY, "--out", "r"],
              ["simulate_pose"])
    yield Run("convert", ["convert", HEALTHY, "log.csv"], quick=True)


def recorded_runs():
    data = SHARED / "data"
    for name, log in (("emps", "emps/emps.csv"), ("warthog", "warthog/current.csv"),
                      ("regbot", "regbot_fleet/run_00.csv")):
        robot = str(data / f"{name}.yaml")
        for command in ("commission", "identify", "doctor", "gap"):
            if (name, command) == ("regbot", "gap"):  # six seconds, of which nothing is left to compare
                continue
            yield Run(f"{name}_{command}", [command, str(data / log), "--robot", robot, "--out", "r"])
    yield Run("regbot_fleet", ["fleet", str(data / "regbot_fleet"), "--robot", str(data / "regbot.yaml"), "--out", "r"])
    cases = SHARED / "withheld-dev"
    for case in ("case_000", "case_007", "case_014", "case_021", "case_030", "case_038"):
        folder = cases / case
        if not folder.is_dir():
            continue
        robot, base, log = (str(folder / n) for n in ("robot.yaml", "baseline.csv.gz", "real.csv.gz"))
        yield Run(f"{case}_commission", ["commission", base, "--robot", robot, "--out", "r"])
        yield Run(f"{case}_identify", ["identify", base, "--robot", robot, "--out", "r"])
        yield Run(f"{case}_gap", ["gap", log, "--robot", robot, "--baseline", base, "--out", "r"])
        yield Run(f"{case}_detect", ["detect", log, "--model", f"../{case}_commission/r/model.json", "--out", "r"],
                  [f"{case}_commission"])


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


def digest(path):
    content = path.read_bytes()
    if path.suffix == ".json":
        content = json.dumps(without_volatile(json.loads(content)), sort_keys=False).encode()
    return hashlib.sha256(content).hexdigest()[:16]


def results_of(run, program, folder, words):
    here = folder / run.name
    here.mkdir()
    environment = dict(os.environ, GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F", LC_ALL="C")
    # Results name the files they come from: as seen from the run's folder, wherever this repository lies.
    call = [word.replace(str(ROOT / "examples"), "../shipped").replace(str(SHARED), "../recorded")
            for word in run.words]
    done = subprocess.run([program, *call], cwd=here, env=environment, capture_output=True, check=False)
    found = {"exit": done.returncode}
    if "--json" in run.words:
        (here / "stdout.json").write_bytes(done.stdout)
    elif words:
        (here / "stdout.txt").write_bytes(done.stdout)
    for path in sorted(p for p in here.rglob("*") if p.is_file()):
        if path.suffix in HASHED or (words and path.suffix in WORDS):
            found[str(path.relative_to(here))] = digest(path)
    if len(found) == 1:
        found["error"] = done.stderr.decode(errors="replace").strip()[:300]
    return found


def all_results(runs, program, jobs, words, keep):
    results, waiting = {}, list(runs)
    if keep:
        keep.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        going, folder = {}, (keep or pathlib.Path(temporary)).resolve()
        (folder / "shipped").symlink_to(ROOT / "examples")
        (folder / "recorded").symlink_to(SHARED)
        while waiting or going:
            for run in [r for r in waiting if all(n in results for n in r.needs)]:
                waiting.remove(run)
                going[pool.submit(results_of, run, program, folder, words)] = run
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
    parser.add_argument("--keep", type=pathlib.Path, help="a new folder for the results themselves")
    parser.add_argument("--numbers", nargs=2, type=pathlib.Path, metavar=("BEFORE", "NOW"))
    options = parser.parse_args()
    if options.numbers:
        compare_numbers(*options.numbers)
        return 0
    if not options.program:
        parser.error("--program is missing")
    runs = list(shipped_runs())
    if options.quick:
        runs = with_needs(runs, [r.name for r in runs if r.quick])
    elif (SHARED / "data").is_dir():
        runs += recorded_runs()
    else:
        print("freeze: no shared recordings here: shipped and simulated logs only", file=sys.stderr)
    if options.only:
        runs = with_needs(runs, options.only)
    results = all_results(runs, options.program.resolve(), options.jobs, options.words, options.keep)
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
