#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The unit and the image of examples/service: what they name is there, and the unit's shell line does what its README
says. No container is built, and nothing is started by systemd."""

import functools
import json
import os
import re
import shlex
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["WHEELWRIGHT_SOURCE_DIR"])
PROGRAM = os.environ["WHEELWRIGHT_PROGRAM"]
SERVICE = SOURCE / "examples" / "service"
UNIT = SERVICE / "wheelwright-follow@.service"

# In every Debian with apt.
ESSENTIAL = {"libc6", "libgcc-s1", "libstdc++6"}
# Where it was found, the program is linked to MPI; tools/setup.sh program does not install it.
OPTIONAL = {"libopenmpi3"}


def read_unit(text):
    """Section -> list of (key, value): keys may stand there more than once."""
    sections, entries = {}, None
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith(("#", ";")):
            continue
        if header := re.fullmatch(r"\[(\w+)\]", line):
            entries = sections.setdefault(header[1], [])
        elif (pair := re.fullmatch(r"(\w+)=(.*)", line)) and entries is not None:
            entries.append((pair[1], pair[2]))
        else:
            raise ValueError(f"line {number}: '{line}': expected [Section] or Key=value")
    return sections


def instructions(text):
    """Stages of a Dockerfile: lists of (instruction, the rest)."""
    stages = []
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    for line in re.sub(r"\\\n", " ", "\n".join(lines)).splitlines():
        if line.strip():
            word, rest = line.split(None, 1)
            if word == "FROM":
                stages.append([])
            stages[-1].append((word, rest))
    return stages


@functools.lru_cache(maxsize=None)
def unit():
    return read_unit(UNIT.read_text(encoding="utf-8"))


def values(section, key):
    return [value for name, value in unit()[section] if name == key]


def shell_line(name):
    """The line that the unit of the instance `name` hands to sh, as systemd does."""
    (command,) = values("Service", "ExecStart")
    words = shlex.split(command.replace("%i", name))
    assert words[:2] == ["/bin/sh", "-c"] and len(words) == 3, words
    return words[2].replace("$$", "$")


def run(arguments, **options):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False,
                          **options)


def packages_of(program):
    """Debian packages of the libraries that `program` itself is linked to."""
    def output(*command):
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    needed = re.findall(r"NEEDED\s+(\S+)", output("objdump", "-p", program))
    found = dict(re.findall(r"^\s*(\S+) => (/\S+)", output("ldd", program), re.M))
    packages = set()
    for library in needed:
        # Several packages have it; sanitizers.
        if library.startswith(("liblapack.", "libblas.", "libasan.", "libubsan.")):
            continue
        path = os.path.realpath(found[library])
        # dpkg knows /lib by the name it has in the package.
        for name in (path, path.removeprefix("/usr"), "/usr" + path):
            owner = subprocess.run(["dpkg", "-S", name], capture_output=True, text=True, check=False)
            if owner.returncode == 0:
                packages.add(owner.stdout.split(":")[0])
                break
        else:
            raise AssertionError(f"{library}: no package has {path}")
    return packages


class Unit(unittest.TestCase):
    def test_options_are_there(self):
        known = run(["detect", "--help"]).stdout
        options = re.findall(r"--[a-z][\w-]*", shell_line("r1"))
        self.assertIn("--follow", options)
        for option in options:
            self.assertRegex(known, re.escape(option) + r"(?![\w-])")

    def test_exit_codes_are_thought_of(self):
        known = run(["detect", "--help"]).stdout
        self.assertRegex(known, r"Exit code: 0 no fault, 1 a fault was found, 2 bad input")
        self.assertEqual(values("Service", "SuccessExitStatus"), ["1 143"])
        self.assertNotIn("2", values("Service", "RestartPreventExitStatus")[0].split(),
                         "a stream that ended blind ends with it")

    def test_reader_knows_a_bad_line(self):
        self.assertEqual(read_unit("[A]\nB=1\nB=2\n# c\n"), {"A": [("B", "1"), ("B", "2")]})
        for text in ("B=1\n", "[A]\nwhat is this\n"):
            with self.assertRaises(ValueError):
                read_unit(text)


class ShellLine(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.holder.name)
        cls.settings = cls.folder / "etc" / "wheelwright" / "r1"
        done = run(["commission", SOURCE / "examples/healthy.csv.gz", "--robot", SOURCE / "examples/robot.yaml",
                    "--out",
                    cls.settings, "--quiet"])
        assert done.returncode == 0, done.stderr
        for drive in ("healthy", "fault"):
            done = run(["simulate", SOURCE / f"examples/scenarios/{drive}.yaml", "--out", cls.folder / f"{drive}.csv"])
            assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.holder.cleanup()

    def follow(self, driver):
        """Exit code, lines of events, standard output and error of the unit's line with the command `driver`."""
        state = self.folder / "state" / self.id()
        state.mkdir(parents=True, exist_ok=True)
        line = shell_line("r1").replace("/etc/", f"{self.folder}/etc/")
        done = subprocess.run(["/bin/sh", "-c", line], capture_output=True, text=True, timeout=120, check=False,
                              cwd=self.folder, env={"DRIVER": driver, "STATE_DIRECTORY": str(state),
                                                    "PATH": f"{Path(PROGRAM).parent}:/usr/bin:/bin"})
        events = [json.loads(line) for line in (state / "events.jsonl").read_text(encoding="utf-8").splitlines()]
        return done.returncode, events, done.stdout, done.stderr

    def test_healthy_drive_leaves_no_event(self):
        code, events, out, error = self.follow("cat healthy.csv")
        self.assertEqual((code, error), (0, ""))
        self.assertEqual([next(iter(event)) for event in events], ["schema", "watching"])
        self.assertEqual(events[0]["schema"], "wheelwright/events/1")
        self.assertEqual(events[1]["watching"]["t"], 60.0)
        self.assertTrue(out.startswith("watching at 60 s: "))

    def test_fault_leaves_events_and_runs_are_appended(self):
        code, events, out, error = self.follow("cat fault.csv")
        self.assertEqual((code, error), (1, ""))
        self.assertIn("incident opened", out)
        self.assertTrue(any("incident" in event for event in events))
        self.assertTrue(all(event["alarm"] >= 30.0 for event in events if "alarm" in event))
        self.assertEqual(self.follow("cat fault.csv")[1], events + events)

    def test_driver_that_does_not_start(self):
        code, events, _, error = self.follow("no_such_driver")
        self.assertEqual((code, len(events)), (2, 1))
        self.assertIn("no_such_driver", error)
        self.assertIn("expected a header line", error)


class Image(unittest.TestCase):
    def setUp(self):
        self.stages = instructions((SERVICE / "Dockerfile").read_text(encoding="utf-8"))

    def test_copied_files_are_there(self):
        ignored = (SERVICE / "Dockerfile.dockerignore").read_text(encoding="utf-8").split()
        for stage in self.stages:
            for word, rest in stage:
                if word == "COPY" and not rest.startswith("--from"):
                    for name in rest.split()[:-1]:
                        self.assertTrue((SOURCE / name).exists(), name)
                        self.assertNotIn(name, ignored)
                if word == "RUN":
                    for script in re.findall(r"tools/\w+\.sh", rest):
                        self.assertTrue(os.access(SOURCE / script, os.X_OK), script)

    def test_ends_as_a_user_that_is_not_root(self):
        final = dict(self.stages[-1])
        self.assertEqual(final["ENTRYPOINT"], '["wheelwright"]')
        self.assertNotIn(final["USER"], ("root", "0"))
        self.assertRegex(final["RUN"], rf"useradd .*\b{final['USER']}\b")

    def test_libraries_are_those_of_the_program(self):
        (command,) = [rest for word, rest in self.stages[-1] if word == "RUN"]
        listed = re.search(r"apt-get install ((?:(?!&&).)*)", command)[1].split()
        packages = {word for word in listed if not word.startswith("-")}
        self.assertEqual(packages, packages_of(PROGRAM) - ESSENTIAL - OPTIONAL)


class Pages(unittest.TestCase):
    def test_options_are_there(self):
        known = run(["detect", "--help"]).stdout
        text = (SERVICE / "README.md").read_text(encoding="utf-8")
        for line in re.findall(r"^ {4}.*\bdetect .*$", text, re.M):
            for option in re.findall(r"--[a-z][\w-]*", line.split(" detect ", 1)[1]):
                self.assertRegex(known, re.escape(option) + r"(?![\w-])")


if __name__ == "__main__":
    unittest.main()
