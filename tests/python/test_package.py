# SPDX-License-Identifier: Apache-2.0
"""The package as a package: its stub, its page, its wheel."""

import ast
import base64
import contextlib
import csv
import hashlib
import importlib.util
import inspect
import io
import os
import re
import shutil
import unittest
import zipfile
from pathlib import Path

import skip
import wheelwright as ww
import wheelwright._core as core
from support import CART, HEALTHY, PACKAGE, ROBOT, SOURCE, fault_file, page_code, path, python


def arguments_of(thing):
    """Names of the arguments in a signature as pybind11 writes it, '*' among them; with '=' where there is a default."""
    text = thing.__doc__.split("\n")[0]
    text = text[text.index("(") + 1:text.rindex(") -> ")]
    parts, depth = [""], 0
    for c in text:
        depth += (c in "([{<") - (c in ")]}>")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    names = []
    for part in (part.strip() for part in parts):
        name = part.split(":")[0].strip()
        names.append(name + ("=" if re.search(r" = [^=]*$", part) else ""))
    return [name for name in names if name and name != "self"]


def arguments_in_stub(function):
    a = function.args
    plain = [argument.arg for argument in a.args if argument.arg != "self"]
    first_default = len(plain) - len(a.defaults)
    names = [name + ("=" if i >= first_default else "") for i, name in enumerate(plain)]
    if a.kwonlyargs:
        names.append("*")
        names += [k.arg + ("=" if d is not None else "") for k, d in zip(a.kwonlyargs, a.kw_defaults)]
    if a.kwarg:
        names.append("**" + a.kwarg.arg)
    return names


class Types(unittest.TestCase):
    def test_the_stub_has_what_the_module_has(self):
        stub = ast.parse((PACKAGE / "_core.pyi").read_text())
        here = {node.name: node for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))
                and not node.name.startswith("_")}
        self.assertEqual(set(here) | {"software"}, {name for name in dir(core) if not name.startswith("_")})
        for name, node in here.items():
            thing = getattr(core, name)
            if isinstance(node, ast.FunctionDef):
                self.assertEqual(arguments_in_stub(node), arguments_of(thing), name)
            elif not issubclass(thing, Exception):
                self.same_members(name, node, thing)

    def same_members(self, name, node, thing):
        members = {each.name: each for each in node.body if isinstance(each, ast.FunctionDef)}
        public = {key for key, value in vars(thing).items() if not key.startswith("_")}
        self.assertEqual({key for key in members if not key.startswith("_")}, public, name)
        for key, each in members.items():
            is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in each.decorator_list)
            value = vars(thing)[key]
            self.assertEqual(is_property, isinstance(value, property), f"{name}.{key}")
            if not is_property:
                self.assertEqual(arguments_in_stub(each), arguments_of(value), f"{name}.{key}")

    def test_everything_public_says_what_it_is(self):
        for name in ww.__all__:
            thing = getattr(ww, name)
            self.assertTrue(inspect.getdoc(thing), name)


class Page(unittest.TestCase):
    def test_its_first_examples_run(self):
        skip.skip_unless(self, importlib.util.find_spec("pandas"), "pandas is not installed")
        code, pictures = page_code()  # tests/python/test_plot.py draws them
        self.assertIn("to_dataframe", code)
        self.assertTrue(pictures)
        # As it stands there it takes ten seconds.
        for quick, options in (("baseline=log", "shrink=False, manoeuvre=False"), ("radius=1.5", "stages=1, duration=6.0"),
                               ('"caster_drag"], speed=8.0', "stages=1, duration=6.0")):
            self.assertIn(quick, code)
            code = code.replace(quick, f"{quick}, {options}")
        place = path("page")
        place.mkdir()
        for name, source in (("robot.yaml", ROBOT), ("monday.csv.gz", HEALTHY), ("today.csv", fault_file())):
            shutil.copy(source, place / name)
        (place / "cart.urdf").write_text(CART)
        (place / "study.yaml").write_text("log: monday.csv.gz\nrobot: robot.yaml\ninputs: {wheel_radius: {relative: [-0.01, "
                                          "0.01]}}\nquantities: [width]\nmethods: {one_at_a_time: {levels: 2}}\n")
        names = {}
        before = os.getcwd()
        os.chdir(place)
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(code, names)
        finally:
            os.chdir(before)
        self.assertTrue(names["run"].fault and names["found"].fault)
        self.assertTrue((place / "model.json").exists())
        self.assertIn("command_r", names["plan"])
        self.assertTrue(names["health"].fit)
        self.assertEqual(names["cart"].to_dict()["track_width"], 0.4)


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = python(SOURCE / "python" / "make_wheel.py", PACKAGE, "--version", ww.__version__, "--license",
                      SOURCE / "LICENSE", "--out", path("dist"))
        assert done.returncode == 0, done.stderr
        cls.wheel = Path(done.stdout.strip())

    def test_its_record_is_right(self):
        with zipfile.ZipFile(self.wheel) as archive:
            self.assertIsNone(archive.testzip())
            names = archive.namelist()
            record = next(name for name in names if name.endswith(".dist-info/RECORD"))
            rows = {row[0]: row[1:] for row in csv.reader(io.StringIO(archive.read(record).decode()))}
            self.assertEqual(sorted(rows), sorted(names))
            for name, (digest, size) in rows.items():
                if name != record:
                    content = archive.read(name)
                    self.assertEqual(int(size), len(content))
                    expected = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
                    self.assertEqual(digest, "sha256=" + expected)
            self.assertIn("wheelwright/py.typed", names)
            self.assertIn("wheelwright/_core.pyi", names)

    def test_it_loads_libraries_of_the_system_only(self):
        done = python(SOURCE / "tools" / "check_elf.py", self.wheel)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_it_works_where_it_is_installed(self):
        place = path("site")
        if importlib.util.find_spec("pip") is not None:
            done = python("-m", "pip", "install", "--no-index", "--no-deps", "--quiet", "--disable-pip-version-check",
                          "--root-user-action=ignore", "--target", place, self.wheel)
            self.assertEqual(done.returncode, 0, done.stderr)
        else:
            zipfile.ZipFile(self.wheel).extractall(place)
        done = python("-c", f"import wheelwright as ww; print(ww.__file__, ww.read_robot({str(ROBOT)!r}).name)",
                      PYTHONPATH=str(place))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.split(), [str(place / "wheelwright" / "__init__.py"), "example"])


if __name__ == "__main__":
    skip.main()
