#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the pages tell a reader to type works.

    check_examples.py PROGRAM     runs the console blocks of docs/use/tutorial.md and compares what they print, three dots for
                                  what is left out; types the commands of docs/use/own_log.md and docs/use/embedding.md, from a
                                  recording that is written here, byte by byte, and compiles the latter's C++; looks up each option behind `wheelwright
                                  COMMAND` in README.md and docs/ in that command's help. Exit code 1 where something
                                  differs
    check_examples.py --self-test
"""

import csv
import os
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def blocks(text):
    """Commands with their expected lines, in order, of all console blocks."""
    runs = []
    for block in re.findall(r"^```console\n(.*?)^```", text, re.M | re.S):
        for line in block.splitlines():
            if line.startswith("$ "):
                runs.append((line[2:], []))
            else:
                runs[-1][1].append(line)
    return runs


def fits(expected, got):
    """Whether lines `got` are `expected`, where ... stands for anything, also for whole lines."""
    def pattern(line):
        return ".*".join(re.escape(part) for part in line.rstrip().split("..."))

    text = "".join(r"(?:.*\n)*?" if line.strip() == "..." else pattern(line) + r"[ ]*\n" for line in expected)
    return re.fullmatch(text, "".join(line.rstrip() + "\n" for line in got)) is not None


def run(program, page):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(ROOT / "examples")
        environment = {**os.environ, "PATH": f"{Path(program).resolve().parent}:{os.environ['PATH']}", "NO_COLOR": "1"}
        for command, expected in blocks(page.read_text(encoding="utf-8")):
            done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            got = done.stdout.splitlines() + ([f"[exit code {done.returncode}]"] if done.returncode else [])
            if not fits(expected, got):
                yield f"{page.name}: $ {command}\n" + "\n".join(got) + "\n" + done.stderr


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def joint_state(t, names, position, velocity, effort):
    """sensor_msgs/JointState as CDR (little-endian): https://www.omg.org/spec/DDSI-RTPS, 10.2."""
    out = bytearray(struct.pack("<iI", int(t), round((t - int(t)) * 1e9)))

    def pad(to):
        out.extend(bytes(-len(out) % to))

    def text(value):
        pad(4)
        out.extend(struct.pack("<I", len(value) + 1) + value.encode() + b"\0")

    text("base")
    pad(4)
    out.extend(struct.pack("<I", len(names)))
    for name in names:
        text(name)
    for values in (position, velocity, effort):
        pad(4)
        out.extend(struct.pack("<I", len(values)))
        if values:
            pad(8)
            out.extend(struct.pack(f"<{len(values)}d", *values))
    return b"\0\1\0\0" + bytes(out)


def write_bag(folder, messages):
    """A rosbag2 folder with one MCAP (https://mcap.dev/spec), no chunks and no index: (time in s, CDR) of /joint_states."""
    magic = b"\x89MCAP0\r\n"

    def text(value):
        return struct.pack("<I", len(value)) + value.encode()

    def record(code, content):
        return struct.pack("<BQ", code, len(content)) + content

    folder.mkdir()
    with open(folder / "morning_0.mcap", "wb") as file:
        file.write(magic + record(1, text("ros2") + text("")))
        file.write(record(3, struct.pack("<H", 1) + text("sensor_msgs/msg/JointState") + text("ros2msg") + text(JOINT_STATE)))
        file.write(record(4, struct.pack("<HH", 1, 1) + text("/joint_states") + text("cdr") + struct.pack("<I", 0)))
        for number, (t, message) in enumerate(messages):
            nanoseconds = round(t * 1e9)
            file.write(record(5, struct.pack("<HIQQ", 1, number, nanoseconds, nanoseconds) + message))
        file.write(record(15, bytes(4)) + record(2, bytes(20)) + magic)
    count, first = len(messages), round(messages[0][0] * 1e9)
    (folder / "metadata.yaml").write_text(f"""rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  relative_file_paths: [morning_0.mcap]
  duration: {{nanoseconds: {round(messages[-1][0] * 1e9) - first}}}
  starting_time: {{nanoseconds_since_epoch: {first}}}
  message_count: {count}
  topics_with_message_count:
    - topic_metadata: {{name: /joint_states, type: sensor_msgs/msg/JointState, serialization_format: cdr, offered_qos_profiles: ""}}
      message_count: {count}
  compression_format: ""
  compression_mode: ""
""", encoding="utf-8")


URDF = """<robot name="my_robot">
  <link name="base"><inertial><mass value="19"/><inertia ixx="0.5" iyy="0.5" izz="1.0" ixy="0" ixz="0" iyz="0"/></inertial></link>
""" + "".join(f"""  <link name="{side}_wheel">
    <inertial><mass value="1"/><inertia ixx="0.003" iyy="0.005" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.0975" length="0.04"/></geometry></collision>
  </link>
  <joint name="front_{side}" type="continuous">
    <parent link="base"/><child link="{side}_wheel"/><origin xyz="0 {y} 0.0975"/><axis xyz="0 1 0"/>
  </joint>
""" for side, y in (("right", -0.1905), ("left", 0.1905))) + "</robot>\n"
CONTROLLERS = """controller_manager:
  ros__parameters:
    update_rate: 100
    diff_drive_controller: {type: diff_drive_controller/DiffDriveController}
diff_drive_controller:
  ros__parameters:
    left_wheel_names: [front_left]
    right_wheel_names: [front_right]
    wheel_separation: 0.381
    wheel_radius: 0.0975
"""


def a_morning(folder, program):
    """What the pages take for granted: recordings, a description, a driver."""
    robot = (ROOT / "examples/robot.yaml").read_text(encoding="utf-8")
    (folder / "truth.yaml").write_text(re.sub(r"^effort:.*$", "effort: {kind: torque}", robot, flags=re.M), encoding="utf-8")
    for day, seed in (("morning", 1), ("afternoon", 2)):
        scenario = (ROOT / "examples/scenarios/healthy.yaml").read_text(encoding="utf-8")
        scenario = scenario.replace("../robot.yaml", "truth.yaml").replace("seed: 2", f"seed: {seed}")
        (folder / "drive.yaml").write_text(scenario, encoding="utf-8")
        subprocess.run([program, "simulate", "drive.yaml", "--out", f"{day}.log.csv", "--quiet"], cwd=folder, check=True)
        with open(folder / f"{day}.log.csv", newline="", encoding="utf-8") as file:
            rows = [{name: float(value) for name, value in row.items()}
                    for row in csv.DictReader(line for line in file if not line.startswith("#"))]
        begin, names = 1.7e9, ["front_left", "front_right"]
        sides = [[f"{what}_{side}" for side in "lr"] for what in ("phi", "omega", "tau")]
        write_bag(folder / f"this_{day}", [
            (begin + row["t"], joint_state(begin + row["t"], names, *([row[name] for name in columns if name in row]
                                                                     for columns in sides))) for row in rows])
    (folder / "my_robot.urdf").write_text(URDF, encoding="utf-8")
    (folder / "controllers.yaml").write_text(CONTROLLERS, encoding="utf-8")
    driver = folder / "bin" / "robot_driver"
    driver.parent.mkdir()
    driver.write_text("#!/bin/sh\ncat morning.csv\n", encoding="utf-8")
    driver.chmod(0o755)


def typed(text):
    """The shell commands of a page's indented blocks."""
    text = re.sub(r"\\\n\s*", "", text)
    return re.findall(r"^ {4}((?:robot_driver \| )?wheelwright .*)$", text, re.M)


def type_pages(program, pages):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        a_morning(folder, str(Path(program).resolve()))
        environment = {**os.environ, "NO_COLOR": "1",
                       "PATH": f"{folder / 'bin'}:{Path(program).resolve().parent}:{os.environ['PATH']}"}
        for page in pages:
            commands = typed(page.read_text(encoding="utf-8"))
            if not commands:
                yield f"{page.name}: no command"
            for command in commands:
                done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True,
                                      check=False)
                if done.returncode:
                    yield f"{page.name}: {command}: exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr}"


def compile_page(page, include):
    """Compiles the first C++ block of a page: its includes, and its statements as those of a function."""
    block = re.search(r"^ {4}#include <wheelwright/.*?(?=^\S)", page.read_text(encoding="utf-8"), re.M | re.S)
    lines = [line[4:] for line in block[0].splitlines()]
    includes = [line for line in lines if line.startswith("#include")]
    source = "\n".join(["#include <vector>", *includes, "void stop();", "void block(double t, std::vector<double> sample) {",
                        *[line for line in lines if line not in includes], "}"])
    done = subprocess.run(["c++", "-std=c++20", "-fsyntax-only", "-iquote", ROOT, "-I", include, "-isystem", "/usr/include/eigen3", "-x", "c++",
                           "-"], input=source, capture_output=True, text=True, check=False)
    if done.returncode:
        yield f"{page.name}: its C++ does not compile\n{done.stderr}"


def examples(text):
    """Commands in code blocks and in backquotes: (command, options)."""
    text = re.sub(r"\\\n\s*", " ", text)
    code = re.findall(r"^(?: {4,}|\$ )(?:[$] )?((?:build/bin/)?wheelwright .*)$", text, re.M) + re.findall(r"`(wheelwright [^`]*)`", text)
    for line in code:
        words = line.split("#")[0].split()[1:]
        if words and re.fullmatch(r"[a-z]+", words[0]):
            yield words[0], [word.split("=")[0] for word in words[1:] if re.match(r"--[a-z]", word)]


def wrong_options(pages, help_of):
    for page in pages:
        for command, options in examples(page.read_text(encoding="utf-8")):
            known = help_of(command)
            if known is None:
                yield f"{page.name}: wheelwright {command}: there is no such command"
                continue
            for option in options:
                if not re.search(re.escape(option) + r"(?![\w-])", known):
                    yield f"{page.name}: wheelwright {command} {option}: there is no such option"


def self_test():
    assert blocks("```console\n$ a b\nx\n$ c\n```\n") == [("a b", ["x"]), ("c", [])]
    assert fits(["a", "...", "b...d"], ["a", "1", "2", "b c d"]) and fits(["...", "z"], ["z"])
    assert not fits(["a"], ["b"]) and not fits(["a"], ["a", "b"]) and not fits(["a", "...", "b"], ["a"])
    page = "x `wheelwright detect` y\n\n    wheelwright detect LOG --model m.json   # --not-here\n    wheelwright gap L --robt=x\n"
    assert list(examples(page)) == [("detect", ["--model"]), ("gap", ["--robt"]), ("detect", [])]
    assert typed("    wheelwright a b \\\n      c\n    x\n    robot_driver | wheelwright d\n") == [
        "wheelwright a b c", "robot_driver | wheelwright d"]
    message = joint_state(1.5, ["a", "bc"], [], [1.0, 2.0], [3.0])
    assert len(message) == 4 + 8 + 12 + 4 + 8 + 8 + 4 + 4 + 16 + 4 + 4 + 8 and message[-8:] == struct.pack("<d", 3.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.md"
        path.write_text(page, encoding="utf-8")
        assert len(list(wrong_options([path], {"detect": "--model FILE", "gap": "--robot FILE"}.get))) == 1
        assert len(list(wrong_options([path], {"gap": "--robt"}.get))) == 2
    print("examples: self-test passed")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    program = sys.argv[1]
    helps = {}

    def help_of(command):
        if command not in helps:
            done = subprocess.run([program, command, "--help"], capture_output=True, text=True, check=False)
            helps[command] = done.stdout if done.returncode == 0 else None
        return helps[command]

    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    found = list(wrong_options(pages, help_of)) + list(run(program, ROOT / "docs/use/tutorial.md"))
    found += compile_page(ROOT / "docs/use/embedding.md", str(Path(program).resolve().parent.parent / "include"))
    found += type_pages(program, [ROOT / "docs/use/own_log.md", ROOT / "docs/use/embedding.md"])
    for complaint in found:
        print("examples: " + complaint)
    if not found:
        print("examples: the tutorial prints what it says, other pages' commands work, and every option is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
