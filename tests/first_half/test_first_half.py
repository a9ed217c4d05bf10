#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The program of the first half of the build: its commands give the whole program's results, the others are refused with
what builds them, and examples/commission.sh leaves a program at every moment after its first answer."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["WHEELWRIGHT_SOURCE_DIR"])
FIRST = os.environ["WHEELWRIGHT_FIRST"]
WHOLE = os.environ["WHEELWRIGHT_PROGRAM"]
EXAMPLES = SOURCE / "examples"
ROBOT = EXAMPLES / "robot.yaml"
HEALTHY = EXAMPLES / "healthy.csv.gz"

OWN = ["commission", "detect", "doctor", "check", "simulate", "convert", "robot", "completion", "man"]
LATER = ["try", "compare", "identify", "margins", "sensitivity", "export", "design", "choose", "gap", "fleet"]
CONTROLLERS = """diff_drive_controller:
  ros__parameters:
    type: diff_drive_controller/DiffDriveController
    left_wheel_names: [left]
    right_wheel_names: [right]
    wheel_separation: 0.381
    wheel_radius: 0.0975
"""
NOT_BUILT = "Not built yet, run ./examples/commission.sh again:"


def run(program, *words, **options):
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=300, check=False, **options)


def commands(program):
    """Heading -> name -> purpose, of the program's help."""
    headings, heading = {}, ""
    for line in run(program, "--help").stdout.splitlines():
        if re.fullmatch(r"\S.*:", line):
            heading = line
        elif entry := re.fullmatch(r"  ([a-z]+) +(\S.*)", line):
            headings.setdefault(heading, {})[entry[1]] = entry[2]
    return headings


class TheFirstHalf(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_its_help_names_all_commands_as_the_whole_program_does(self):
        ((_, all_of_them),) = commands(WHOLE).items()
        (own, later) = commands(FIRST).items()
        self.assertEqual(list(own[1]), OWN)
        self.assertEqual(later[0], NOT_BUILT)
        self.assertEqual(list(later[1]), LATER)
        self.assertEqual({**own[1], **later[1]}, all_of_them)

    def test_its_commands_give_the_results_of_the_whole_program(self):
        def results(program):
            folder = self.folder / Path(program).parent.name
            folder.mkdir()
            (folder / "controllers.yaml").write_text(CONTROLLERS, encoding="utf-8")
            lines = [
                ("simulate", EXAMPLES / "scenarios" / "fault.yaml", "--out", "fault.csv"),
                ("convert", "fault.csv", "fault.h5"),
                ("robot", "--ros2-control", "controllers.yaml", "--out-file", "robot.yaml"),
                ("doctor", HEALTHY, "--robot", ROBOT, "--out", "doctor"),
                ("commission", HEALTHY, "--robot", ROBOT, "--out", "commission"),
                ("detect", "fault.h5", "--model", "commission/model.json", "--out", "detect"),
                ("check", "commission/model.json", HEALTHY, "--out", "check"),
            ]
            codes = [run(program, *line, cwd=folder).returncode for line in lines]
            return codes, {
                str(file.relative_to(folder)): file.read_bytes()
                for file in sorted(folder.rglob("*"))
                if file.is_file() and file.suffix != ".h5"
            }

        (codes, files), (whole_codes, whole_files) = results(FIRST), results(WHOLE)
        self.assertEqual(codes, [0, 0, 0, 0, 0, 1, 0])
        self.assertEqual(whole_codes, codes)
        self.assertIn("detect/report.html", files)
        self.assertEqual(list(files), list(whole_files))
        for name, content in files.items():
            self.assertTrue(content == whole_files[name], f"{name} differs")

    def test_the_other_commands_are_refused_with_what_builds_them(self):
        for name in LATER:
            for words in [(name,), (name, "--help"), (name, "drive.csv", "--robot", "robot.yaml", "--out", "result")]:
                with self.subTest(words=words):
                    done = run(FIRST, *words, cwd=self.folder)
                    self.assertEqual((done.returncode, done.stdout), (2, ""))
                    self.assertRegex(done.stderr, rf"\Awheelwright: {name}: not built yet: .*run ./examples/commission[.]sh .*\n\Z")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_shells_complete_its_commands(self):
        self.assertIn("--robot", run(FIRST, "completion", "bash").stdout)
        self.assertIn(r"\-\-robot", run(FIRST, "man", "commission").stdout)


class TheFirstCommand(unittest.TestCase):
    """examples/commission.sh in a copy where set-up does nothing and the build hands out the programs that are built."""

    BUILD = """#!/bin/sh
set -eu
case $2 in
  wheelwright_first) mkdir -p build/first && cp "$WHEELWRIGHT_FIRST" build/first/wheelwright ;;
  installed)
    build/bin/wheelwright commission --help >used_meanwhile
    rm build/bin/wheelwright
    if [ "$STOPPED" = yes ]; then kill -TERM $PPID; exit 1; fi
    cp "$WHEELWRIGHT_PROGRAM" build/bin/wheelwright ;;
esac
"""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "tools").mkdir()
        (self.folder / "examples").mkdir()
        for name in ["commission.sh", "healthy.csv.gz", "robot.yaml"]:
            shutil.copy(EXAMPLES / name, self.folder / "examples" / name)
        shutil.copytree(EXAMPLES / "scenarios", self.folder / "examples" / "scenarios")
        for name, text in [("setup.sh", "#!/bin/sh\n"), ("build.sh", self.BUILD)]:
            (self.folder / "tools" / name).write_text(text, encoding="utf-8")
            (self.folder / "tools" / name).chmod(0o755)
        self.program = self.folder / "build" / "bin" / "wheelwright"

    def commission(self, stopped):
        return run(self.folder / "examples" / "commission.sh", env={**os.environ, "STOPPED": "yes" if stopped else "no"})

    def test_stopped_after_its_answer_it_leaves_a_program_and_goes_on_when_run_again(self):
        done = self.commission(stopped=True)
        self.assertEqual(done.returncode, 143, done.stderr)
        for said in ["another healthy drive: no fault found", "a wheel loses radius half-way: fault found", "4. Build the rest"]:
            self.assertIn(said, done.stdout)
        self.assertTrue((self.folder / "out" / "detect_fault" / "report.html").exists())
        self.assertIn("--robot", (self.folder / "used_meanwhile").read_text(encoding="utf-8"))
        self.assertEqual(run(self.program, "gap", "--help").returncode, 2)
        self.assertEqual(run(self.program, "detect", "--help").returncode, 0)
        oldest = min(file.stat().st_mtime for file in (self.folder / "examples").rglob("*"))
        self.assertLess(self.program.stat().st_mtime, oldest)

        done = self.commission(stopped=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(run(self.program, "gap", "--help").returncode, 0)

        # The whole program stays where the second half is compiled again.
        done = self.commission(stopped=False)
        self.assertNotIn("4. Build the rest", done.stdout)
        self.assertEqual(self.program.read_bytes(), Path(WHOLE).read_bytes())


if __name__ == "__main__":
    unittest.main()
