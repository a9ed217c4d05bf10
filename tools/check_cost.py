#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a build cost, from ninja's log: seconds of its compilations by module, and the dearest objects.

    tools/check_cost.py [BUILD]                  the table (BUILD: build)
    tools/check_cost.py [BUILD] --most SECONDS   ends with 1, naming it, where an object took longer
    tools/check_cost.py --self-test

Seconds are those on the clock: compilations that waited for a processor look dearer than they are, and what a compiler
cache handed out looks free. `--most` therefore allows for that much of waiting: what the machine's load was beyond its
processors. It is meant for a machine that compiles PROBE in PROBE_SECONDS of processor; on a slower one it is so much
more.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import check_layers

PROBE = """#include <Eigen/LU>
double probe(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) { return a.partialPivLu().solve(b).norm(); }
"""
PROBE_SECONDS = 2.0


def read_log(path):
    """Object -> seconds, of the last time that each was made."""
    objects = {}
    with open(path, encoding="utf-8") as lines:
        if not next(lines, "").startswith("# ninja log"):
            raise SystemExit(f"{path}: no log of ninja")
        for line in lines:
            fields = line.rstrip("\n").split("\t")
            if len(fields) >= 4 and fields[3].endswith(".o"):
                objects[fields[3]] = (int(fields[1]) - int(fields[0])) / 1000.0
    return objects


def module_of(name):
    """The module of an object; of tests and benchmarks their program."""
    folder, _, rest = name.partition("/CMakeFiles/")
    module = check_layers.module_of(f"{folder}/object")
    return f"{folder}/{rest.split('/')[0].removesuffix('.dir')}" if module == "tests" and rest else module


def table(objects, dearest):
    modules = defaultdict(float)
    for name, seconds in objects.items():
        modules[module_of(name)] += seconds
    lines = [f"{seconds:8.1f} s  {module}" for module, seconds in sorted(modules.items(), key=lambda item: -item[1])]
    lines.append(f"{sum(modules.values()):8.1f} s  {len(objects)} objects")
    lines.append("dearest:")
    for name, seconds in sorted(objects.items(), key=lambda item: -item[1])[:dearest]:
        lines.append(f"{seconds:8.1f} s  {name}")
    return "\n".join(lines)


def waiting():
    """How much longer a compilation takes since others want the processors, by the load of the last five minutes."""
    return max(1.0, os.getloadavg()[1] / (os.cpu_count() or 1))


def slowness(compiler="g++"):
    """How much more of a processor a compilation takes here than where the budget was measured, at least 1."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "probe.cpp").write_text(PROBE, encoding="utf-8")
        taken = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([compiler, "-std=c++20", "-O1", "-isystem", "/usr/include/eigen3", "-c", "probe.cpp", "-o",
                            "probe.o"],
                           cwd=folder, check=True, env={**os.environ, "CCACHE_DISABLE": "1"})
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return max(1.0, min(taken) / PROBE_SECONDS)


def complaints(objects, most, factor):
    return [f"{name}: {seconds:.1f} s, more than {most:g} s"
            + (f" × {factor:.2f} for load and machine" if factor > 1.0 else "")
            for name, seconds in sorted(objects.items(), key=lambda item: -item[1]) if seconds > most * factor]


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / ".ninja_log"
        log.write_text("# ninja log v5\n0\t9000\t1\told.o\tx\n0\t1000\t1\tcore/CMakeFiles/c.dir/a.o\tx\n"
                       "5\t26005\t1\tgap/CMakeFiles/g.dir/b.o\tx\n0\t99000\t1\tbin/program\tx\n0\t500\t1\told.o\tx\n"
                       "0\t2000\t1\ttests/CMakeFiles/test_core.dir/t.o\tx\n", encoding="utf-8")
        objects = read_log(log)
        assert objects == {"old.o": 0.5, "core/CMakeFiles/c.dir/a.o": 1.0, "gap/CMakeFiles/g.dir/b.o": 26.0,
                           "tests/CMakeFiles/test_core.dir/t.o": 2.0}, objects
        assert module_of("tests/CMakeFiles/test_core.dir/t.o") == "tests/test_core"
        assert module_of(f"{check_layers.MODULES['filter']}/CMakeFiles/wheelwright_filter.dir/f.o") == "filter"
        assert "29.5 s  4 objects" in table(objects, 1) and table(objects, 1).endswith("b.o")
        assert len(complaints(objects, 25.0, 1.0)) == 1 and not complaints(objects, 25.0, 1.1)
        log.write_text("something else\n", encoding="utf-8")
        try:
            read_log(log)
        except SystemExit as error:
            assert "no log of ninja" in str(error)
        else:
            raise AssertionError("a file that is no log was read")
    print("cost: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", type=Path, default=Path("build"))
    parser.add_argument("--most", type=float, metavar="SECONDS")
    parser.add_argument("--dearest", type=int, default=10)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return 0
    objects = {name: seconds for name, seconds in read_log(arguments.build / ".ninja_log").items()
               if (arguments.build / name).exists()}
    print(table(objects, arguments.dearest))
    found = complaints(objects, arguments.most, waiting() * slowness()) if arguments.most else []
    for complaint in found:
        print(complaint, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
