# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share. ctest says where the program and the sources are."""

import functools
import json
import os
import re
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import wheelwright as ww

SOURCE = Path(os.environ["WHEELWRIGHT_SOURCE_DIR"])
PROGRAM = os.environ["WHEELWRIGHT_PROGRAM"]
ROBOT = SOURCE / "examples" / "robot.yaml"
HEALTHY = SOURCE / "examples" / "healthy.csv.gz"
SCENARIOS = SOURCE / "examples" / "scenarios"
PACKAGE = Path(ww.__file__).parent


_URDF = """<robot name="cart">
  <link name="base"><inertial><mass value="10"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  {}
</robot>
"""
_WHEEL = """<link name="{0}"><inertial><mass value="0.5"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>
    </inertial><collision><origin rpy="1.5707963267948966 0 0"/>
    <geometry><cylinder radius="0.05" length="0.02"/></geometry>
    </collision></link>
  <joint name="{0}_joint" type="continuous"><parent link="base"/><child link="{0}"/>
    <origin xyz="0 {1} 0"/><axis xyz="0 1 0"/>
    <limit effort="6" velocity="30"/></joint>"""
# A cart on two driven wheels, 0.4 m apart.
CART = _URDF.format(_WHEEL.format("left", 0.2) + _WHEEL.format("right", -0.2))


def python(*command, **environment):
    """The outcome of this interpreter with the arguments `command`."""
    return subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True, timeout=300,
                          env={**os.environ, **environment})


def page_code():
    """The code that docs/use/python.md shows before "Installing", and of it, apart, the lines that draw."""
    page = (SOURCE / "docs/use/python.md").read_text()
    lines = "".join(re.search(r"((?:^ {4}.*\n|^\n)+)", page[page.index(first):], re.M).group(1)
                    for first in ("    import numpy", "    health = ")).splitlines(keepends=True)
    return tuple(textwrap.dedent("".join(line for line in lines if ("ww.plot." in line) == draws)) for draws in (False, True))


def program(*arguments):
    """What `wheelwright ARGUMENTS --json` prints, as Python reads it."""
    command = [PROGRAM, *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if done.returncode > 1:
        raise AssertionError(f"{' '.join(command)}: {done.stderr}")
    return json.loads(done.stdout)


@functools.lru_cache(maxsize=None)
def robot():
    return ww.read_robot(ROBOT)


def healthy_log():
    return ww.read_log(HEALTHY, robot())


def straight_log():
    """The shipped log as if both wheels had done what the right one did: nothing turns."""
    columns = healthy_log().to_arrays()
    columns.update({name: columns[name.replace("_l", "_r")] for name in columns if name.endswith("_l")})
    return ww.Log(columns, robot())


@functools.lru_cache(maxsize=None)
def commissioned():
    return ww.commission(healthy_log(), robot())


@functools.lru_cache(maxsize=None)
def scratch():
    """A directory that goes with the process."""
    return tempfile.TemporaryDirectory()


def path(name):
    return Path(scratch().name) / name


@functools.lru_cache(maxsize=None)
def model_file():
    """model.json of the shipped log, written by Python."""
    commissioned().save(path("model.json"))
    return path("model.json")


@functools.lru_cache(maxsize=None)
def fault_file():
    """A drive of 30 s in which a tyre loses radius after 15 s."""
    scenario = SCENARIOS / "fault.yaml"
    text = scenario.read_text().replace("../robot.yaml", str(ROBOT)).replace("onset: 30", "onset: 15")
    short = path("fault.yaml")
    short.write_text(text.replace("duration: 60", "duration: 30"))
    ww.simulate(short).save(path("fault.csv"))
    return path("fault.csv")


def different(a, b, where=""):
    """The first place in which two results differ, or None. Numbers must agree to the last bit."""
    if type(a) is not type(b):
        return f"{where}: {a!r} and {b!r}"
    if isinstance(a, dict):
        if list(a) != list(b):
            return f"{where}: keys {list(a)} and {list(b)}"
        return next((d for k in a if (d := different(a[k], b[k], f"{where}/{k}"))), None)
    if isinstance(a, list):
        if len(a) != len(b):
            return f"{where}: {len(a)} and {len(b)} entries"
        return next((d for i, (x, y) in enumerate(zip(a, b)) if (d := different(x, y, f"{where}/{i}"))), None)
    return None if a == b else f"{where}: {a!r} and {b!r}"
