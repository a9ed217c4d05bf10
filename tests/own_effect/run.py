#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Adds an effect as docs/use/own_effect.md says and looks whether everything that the page promises is there.

    tests/own_effect/run.py --source SOURCE --build BUILD --scratch DIRECTORY

The two blocks of the page go into a copy of model/effect_law.cpp; the object it belongs to is compiled once more and
the program linked with it. The commands then see the effect in a robot file and in a log."""

import argparse
import json
import re
import shutil
import subprocess
from pathlib import Path

MASS, C = 21.0, 0.4
PARAMETERS = f"{{mass: {MASS}, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}}"


def blocks(page):
    """The indented blocks after "For good": the function, the entry."""
    text = page.read_text(encoding="utf-8").split("## For good", 1)[1]
    found = [re.sub(r"(?m)^    ", "", block) for block in re.findall(r"(?m)((?:^(?:    .*)?\n)+)", text)
             if block.strip()]
    assert len(found) == 2, f"{page}: two blocks expected, {len(found)} found"
    return found


def patched(source, page):
    function, entry = blocks(page)
    text = source.read_text(encoding="utf-8")
    before = "}  // namespace\n\nvoid add_effect_terms("
    assert text.count(before) == 1, f"{source}: no {before!r}"
    text = text.replace(before, function + "\n" + before)
    head, tail = text.split("std::vector<EffectLaw> make_laws() {", 1)
    body, rest = tail.split("\n  };\n}", 1)
    return head + "std::vector<EffectLaw> make_laws() {" + body + "\n" + entry.rstrip() + "\n  };\n}" + rest


def run(command, cwd=None):
    done = subprocess.run(command, cwd=cwd, shell=isinstance(command, str), capture_output=True, text=True)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def program_with(source, build, scratch):
    """The program, linked with the copy."""
    copy = scratch / "effect_law.cpp"
    copy.write_text(patched(source / "model/effect_law.cpp", source / "docs/use/own_effect.md"), encoding="utf-8")
    commands = run(["ninja", "-t", "commands", "bin/wheelwright"], build).splitlines()
    original = str(source / "model/effect_law.cpp")
    for command in commands:
        compiled = re.search(r" -o (\S+\.o) -c (\S+)", command)
        if compiled is None or "/wheelwright_model.dir/" not in compiled[1]:
            continue
        unit = Path(compiled[2])
        text = unit.read_text(encoding="utf-8")
        if str(unit) != original and original not in text:
            continue
        unity = scratch / unit.name
        if str(unit) != original:
            unity.write_text(text.replace(original, str(copy)), encoding="utf-8")
        again = scratch / Path(compiled[1]).name
        run(command.replace(f"-o {compiled[1]} -c {unit}", f"-o {again} -c {copy if str(unit) == original else unity}")
            .replace(f"{compiled[1]}.d", f"{again}.d"), build)
        library = scratch / "libwheelwright_model.a"
        shutil.copyfile(build / "model/libwheelwright_model.a", library)
        run(["ar", "r", str(library), str(again)])
        program = scratch / "wheelwright"
        link = commands[-1]
        assert " -o bin/wheelwright " in link and "model/libwheelwright_model.a" in link, link
        link = link.replace(" -o bin/wheelwright ", f" -o {program} ")
        run(link.replace("model/libwheelwright_model.a", str(library)),
            build)
        return program
    raise AssertionError("no object of the program holds model/effect_law.cpp")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("source", "build", "scratch"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    arguments = parser.parse_args()
    scratch = arguments.scratch.resolve()
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    program = program_with(arguments.source.resolve(), arguments.build.resolve(), scratch)

    plain = (arguments.source / "examples/robot.yaml").read_text(encoding="utf-8")
    (scratch / "robot.yaml").write_text(plain, encoding="utf-8")
    for name, c in (("exact", str(C)), ("interval", "[0.1, 1.0]")):
        (scratch / f"{name}.yaml").write_text(plain + f"effects: [{{effect: curve_resistance, c: {c}}}]\n",
                                              encoding="utf-8")
    for name, robot, seed in (("healthy", "robot", 5), ("resists", "exact", 6)):
        (scratch / f"{name}_scenario.yaml").write_text(
            f"robot: {robot}.yaml\nparameters: {PARAMETERS}\n"
            "trajectory: {kind: multi_sine, speed: 0.6, yaw_rate: 1.2, period: 9}\n"
            f"duration: 120\nseed: {seed}\nrate: 100\n"
            "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02, position: 0.002, heading: 0.003, "
            "encoder_counts_per_turn: 4096}\n", encoding="utf-8")
        run([program, "simulate", f"{name}_scenario.yaml", "--out", f"{name}.csv"], scratch)

    run([program, "gap", "resists.csv", "--robot", "robot.yaml", "--baseline", "healthy.csv", "--out", "gap"], scratch)
    gap = json.loads((scratch / "gap/gap.json").read_text(encoding="utf-8"))
    causes = [cause["effect"] for cause in gap["causes"]]
    assert causes == ["curve_resistance"], f"gap names {causes}"
    estimate = gap["causes"][0]["parameters"]["c"]
    assert estimate["lower"] <= C <= estimate["upper"] and gap["causes"][0]["share"] > 0.95, gap["causes"]
    page = (scratch / "gap/report.html").read_text(encoding="utf-8")
    assert "heels that roll harder in curves" in page, "the report does not call the effect by its noun"
    improved = (scratch / "gap/robot_improved.yaml").read_text(encoding="utf-8")
    assert "curve_resistance" in improved, improved

    run([program, "commission", "resists.csv", "--robot", "interval.yaml", "--out", "model"], scratch)
    model = json.loads((scratch / "model/model.json").read_text(encoding="utf-8"))
    assert model["warrant"] == "guaranteed", model["message"]
    bounds = {p["name"]: p for p in model["parameters"]}["curve_resistance_c"]
    assert 0.1 < bounds["lower"] <= C <= bounds["upper"] < 1.0, bounds
    mass = model["physical"]["mass"]
    assert mass["lower"] <= MASS <= mass["upper"], mass
    run([program, "check", "model/model.json", "resists.csv"], scratch)
    print("own effect: as the page says")


if __name__ == "__main__":
    main()
