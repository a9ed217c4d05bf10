# SPDX-License-Identifier: Apache-2.0
"""freeze_python.py LOG ROBOT URDF: writes to_dict() of every result of the Python module that has one into TYPE.json.

tools/freeze.py runs it beside the folders of its other runs; ends with 1 where a type that has to_dict is not written.
"""

import inspect
import json
import pathlib
import sys

import wheelwright as ww


def results(log_file, robot_file, urdf):
    robot = ww.read_robot(robot_file)
    log = ww.read_log(log_file, robot)
    friction = ww.read_log("../friction_log/log.csv", robot)
    commissioned = ww.commission(log, robot)
    model = commissioned.model
    pathlib.Path("model.json").write_text(json.dumps(commissioned.to_dict()), encoding="utf-8")
    limits = {"speed": 8.0, "acceleration": 20.0, "radius": 1.5, "duration": 6.0, "stages": 1}
    pathlib.Path("study.yaml").write_text(f"log: {log_file}\nrobot: {robot_file}\n"
                                          "inputs: {wheel_radius: {relative: [-0.01, 0.01]}}\n"
                                          "quantities: [width]\nmethods: {local: true}\n", encoding="utf-8")
    yield robot
    yield commissioned
    yield ww.identify(log, robot, shapes=False)
    yield ww.detect(friction, model)
    yield ww.margins(log, model, faults=["wheel_radius"], windows=[0.5], onset_step=4.0)
    yield ww.gap(friction, robot, baseline=log, shrink=False, manoeuvre=False)
    yield ww.design(model, "bounds", **limits)
    yield ww.doctor(log, robot)
    yield ww.choose(log, robot, faults={"wheel_radius": 0.05}, window=0.5, threads=2)
    yield ww.check("model.json", log)
    yield ww.compare("model.json", "model.json")
    yield ww.robot_from(urdf=urdf)
    yield ww.fleet([log_file, "../friction_log/log.csv"], robot)
    yield ww.sensitivity("study.yaml", threads=2)


def main(arguments):
    written = set()
    for result in results(*arguments):
        written.add(type(result).__name__)
        path = pathlib.Path(f"{type(result).__name__}.json")
        path.write_text(json.dumps(result.to_dict()), encoding="utf-8")
    missing = {name for name, kind in inspect.getmembers(ww, inspect.isclass) if hasattr(kind, "to_dict")} - written
    if missing:
        print(f"freeze_python: to_dict of {', '.join(sorted(missing))} is not written: expected all results that have "
              "one; add a call to results()", file=sys.stderr)
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
