#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The package of examples/ros2 as colcon meets it, with packages that stand in for those of ROS 2: it is configured,
built and installed against the installed Wheelwright, and its files agree with each other.

    test_package.py BUILD COMPILER FLAGS    the build tree of Wheelwright, the compiler and its flags there
"""

import ast
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent.parent
PACKAGE = SOURCE / "examples" / "ros2"
STUBS = SOURCE / "tests" / "ros2" / "stubs"
BUILD, COMPILER, FLAGS = sys.argv[1:4]


def text(name):
    return (PACKAGE / name).read_text(encoding="utf-8")


class Package(unittest.TestCase):
    def test_dependencies_are_those_that_cmake_asks_for(self):
        root = ElementTree.parse(PACKAGE / "package.xml").getroot()
        named = {element.text for element in root if element.tag in ("depend", "buildtool_depend")}
        asked = set(re.findall(r"find_package\((\w+)", text("CMakeLists.txt"))) - {"Wheelwright"}
        self.assertEqual(named, asked)
        self.assertEqual(root.get("format"), "3")
        imported = set(re.findall(r"^from (\w+)", text("launch/wheelwright_diagnostics.launch.py"), re.M)) - {"pathlib"}
        self.assertEqual({element.text for element in root if element.tag == "exec_depend"}, imported)

    def test_parameters_are_those_of_the_node(self):
        listed = dict(re.findall(r"^ {4}(\w+): *(.*?) *(?:#.*)?$", text("config/wheelwright_diagnostics.yaml"), re.M))
        declared = dict(re.findall(r'declare_parameter<[\w:]+>\(\s*"(\w+)",\s*(.*?)\);', text("src/node.cpp"), re.S))
        self.assertEqual(set(listed), set(declared))
        for name in set(listed) - {"model"}:
            default = declared[name]
            if member := re.fullmatch(r"monitor\.(\w+)", default):
                default = re.search(rf"{member[1]} = ([\d.]+);", text("src/monitor.hpp"))[1]
            default = re.sub(r"^Names", "", default)
            self.assertEqual(re.sub(r'[\[\]{}"]', "", listed[name]), re.sub(r'[{}"]', "", default), name)

    def test_launch_file_is_python_and_names_the_program(self):
        launch = text("launch/wheelwright_diagnostics.launch.py")
        ast.parse(launch)
        self.assertIn('executable="wheelwright_diagnostics"', launch)
        self.assertIn("add_executable(wheelwright_diagnostics ", text("CMakeLists.txt"))

    def test_builds_against_the_installed_library(self):
        def run(*command):
            done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False,
                                  env={key: value for key, value in os.environ.items() if key != "DESTDIR"})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            run("cmake", "--install", BUILD, "--prefix", folder / "prefix", "--component", "development")
            run("cmake", "-S", PACKAGE, "-B", folder / "build", "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={COMPILER}",
                f"-DCMAKE_PREFIX_PATH={folder / 'prefix'};{STUBS / 'cmake'}", f"-DCMAKE_CXX_FLAGS=-Werror {FLAGS}",
                f"-DCMAKE_INSTALL_PREFIX={folder / 'installed'}")
            run("cmake", "--build", folder / "build")
            run("cmake", "--install", folder / "build")
            installed = {str(path.relative_to(folder / "installed")) for path in (folder / "installed").rglob("*")
                         if path.is_file()}
        share = "share/wheelwright_diagnostics/"
        self.assertEqual(installed, {"lib/wheelwright_diagnostics/wheelwright_diagnostics",
                                     share + "config/wheelwright_diagnostics.yaml",
                                     share + "launch/wheelwright_diagnostics.launch.py"})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
