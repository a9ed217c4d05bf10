# SPDX-License-Identifier: Apache-2.0
"""The runs that tools/freeze.py hashes the results of: what is called, what it reads, and whether it is quick."""

import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
INPUTS = ROOT / "tests/data/behaviour"

HEALTHY = str(ROOT / "examples/healthy.csv.gz")
ROBOT = str(ROOT / "examples/robot.yaml")
ROBOT_AT_RISK = str(INPUTS / "robot_at_risk.yaml")
STUDY = str(ROOT / "examples/studies/better_sensor.yaml")
LIMITS = ["--speed", "8", "--acceleration", "20", "--radius", "1.5", "--duration", "10"]


class Run:
    """Calls of the program, one after another in a folder of their own; what they have in common is the table below.

    name     of the run and of its folder
    call     the words behind `wheelwright`; `then` are calls after it
    needs    runs whose files it reads as ../NAME/FILE
    quick    whether --quick runs it, too
    files    name -> text of files that are put into the folder before
    stdin    a file that it reads from standard input
    printed  the name under which standard output is kept, where that is a result
    same     two CSV files whose columns must be equal, whatever their order
    words    whether it says words only, so that it is run with --words only
    python   whether `call` is a script that imports the module, with its arguments
    """

    def __init__(self, name, call, needs=(), quick=False, then=(), files=None, stdin=None, printed=None, same=None,
                 words=False, python=False):
        self.name, self.calls, self.needs, self.quick = name, [call, *then], tuple(needs), quick
        self.files, self.stdin, self.same, self.words, self.python = files or {}, stdin, same, words, python
        self.printed = printed or ("stdout.json" if "--json" in call else None)


def scenario(name):
    return str(ROOT / "examples/scenarios" / f"{name}.yaml")


def shipped_runs():
    """Logs and robots of examples/."""
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
    yield Run("check", ["check", model, HEALTHY, "--json"], ["commission"], quick=True)
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
    yield Run("design_pose", ["design", "--model", "../commission_pose/r/model.json", "--for", "bounds", *LIMITS,
                              "--out", "r"], ["commission_pose"])
    yield Run("design_detection", ["design", "--model", model, "--for", "detection", "--fault", "wheel_radius=0.03",
                                   *LIMITS, "--out", "r"], ["commission"])
    yield Run("design_discrimination", ["design", "--robot", ROBOT, "--for", "discrimination", "--between", "coulomb",
                                        "--between", "caster_drag", "--size", "coulomb=0.2", *LIMITS, "--out", "r"])
    yield Run("choose", ["choose", HEALTHY, "--robot", ROBOT, "--fault", "wheel_radius=0.05", "--out", "r"])
    yield Run("sensitivity", ["sensitivity", STUDY, "--out", "r"])
    yield Run("gap", ["gap", "../simulate_pose/log.csv", "--robot", ROBOT, "--baseline", HEALTHY, "--out", "r"],
              ["simulate_pose"])
    yield Run("convert", ["convert", HEALTHY, "log.csv"], quick=True)


def risk_runs():
    """Torque and pose at a stated risk: drives of 40 s of a robot whose file says the mean error of both."""
    log, model = "../risk_log/log.csv", "../risk_commission/r/model.json"
    robot = ["--robot", ROBOT_AT_RISK, "--out", "r"]
    for name, file in (("risk_log", "healthy"), ("heavy_log", "heavy"), ("friction_log", "friction")):
        yield Run(name, ["simulate", str(INPUTS / f"{file}.yaml"), "--out", "log.csv"], quick=True)
    yield Run("risk_commission", ["commission", log, *robot], ["risk_log"], quick=True)
    yield Run("heavy_commission", ["commission", "../heavy_log/log.csv", *robot], ["heavy_log"], quick=True)
    yield Run("risk_check", ["check", model, log, "--json"], ["risk_log", "risk_commission"], quick=True)
    yield Run("risk_identify", ["identify", log, *robot], ["risk_log"], quick=True)
    yield Run("risk_margins", ["margins", log, "--model", model, "--fault", "wheel_radius", "--fault", "slip_yaw",
                               "--onset-step", "4", "--out", "r"], ["risk_log", "risk_commission"], quick=True)
    yield Run("risk_detect", ["detect", "../friction_log/log.csv", "--model", model, "--series", "series.csv",
                              "--layouts", "--out", "r"], ["friction_log", "risk_commission"], quick=True)
    yield Run("risk_export", ["export", model, "--language", "c", "--out", "r"], ["risk_commission"], quick=True)
    yield Run("risk_choose", ["choose", log, "--guarantee", "either", *robot], ["risk_log"])
    yield Run("risk_design", ["design", "--model", model, "--for", "bounds", "--guarantee", "at-risk", "--stages", "1",
                              *LIMITS, "--out", "r"], ["risk_commission"])
    yield Run("compare", ["compare", model, "../heavy_commission/r/model.json", "--out", "r"],
              ["risk_commission", "heavy_commission"], quick=True)
    yield Run("compare_same", ["compare", model, model, "--json"], ["risk_commission"], quick=True)
    for name, fed in (("follow", "friction_log"), ("follow_healthy", "risk_log")):
        yield Run(name, ["detect", "--follow", "--model", model, "--json", "--out", "r"], [fed, "risk_commission"],
                  quick=True, stdin=f"../{fed}/log.csv", printed="stdout.jsonl")
    yield Run("doctor_findings", ["doctor", log, "--map", "omega_l=phi_l", *robot], ["risk_log"], quick=True)


def simulator_runs():
    """Files of simulators and of robots: read, and written back with what `gap` found."""
    for kind, file in (("urdf", "cart.urdf"), ("mjcf", "cart.xml"), ("sdf", "cart.sdf")):
        yield Run(f"write_{kind}", ["gap", "../friction_log/log.csv", "--robot", ROBOT_AT_RISK, "--baseline",
                                    "../risk_log/log.csv", "--no-shrink", "--no-manoeuvre", f"--write-{kind}",
                                    str(INPUTS / file), "--out", "r"], ["risk_log", "friction_log"], quick=True)
    urdf = ["--urdf", str(INPUTS / "cart.urdf")]
    yield Run("try", ["try", "../friction_log/log.csv", *urdf, "--out", "r"], ["friction_log"], quick=True)
    yield Run("robot", ["robot", *urdf, "--ros2-control", str(INPUTS / "controllers.yaml"), "--out", "r"], quick=True,
              then=[["robot", *urdf, "--json"]], printed="stdout.json")


def format_runs():
    """A log from CSV into each other format and back: its columns must be what they were."""
    for kind, between in (("mcap", "log.mcap"), ("lz4", "log.mcap"), ("db3", "log.db3"), ("bag", "bag/"),
                          ("hdf5", "log.h5"), ("packed", "log.csv.zst")):
        extra = ["--compression", "lz4"] if kind == "lz4" else []
        yield Run(f"convert_{kind}", ["convert", "../risk_log/log.csv", between, *extra], ["risk_log"], quick=True,
                  then=[["convert", between, "back.csv"]], same=("../risk_log/log.csv", "back.csv"))


def fleet_runs():
    """A fleet at once, and by two shards of which the second comes later; one log is no log."""
    files = {"fleet.csv": "robot,log,when\namy,../risk_log/log.csv,1\namy,../friction_log/log.csv,2\n"
                          "bob,../heavy_log/log.csv,1\neve,broken.csv,1\n",
             "broken.csv": "t,omega_r\n0,1\n"}
    needs = ["risk_log", "friction_log", "heavy_log"]
    call = ["fleet", "fleet.csv", "--robot", ROBOT_AT_RISK, "--out", "r"]
    yield Run("fleet", call, needs, quick=True, files=files)
    yield Run("fleet_resumed", [*call, "--shard", "1/2"], needs, files=files,
              then=[[*call, "--merge"], [*call, "--shard", "2/2"], [*call, "--merge"]])


def word_runs():
    """What the program says of itself."""
    for shell in ("bash", "zsh", "fish"):
        yield Run(f"completion_{shell}", ["completion", shell], quick=True, words=True)
    yield Run("man", ["man", "--out", "pages"], quick=True, words=True)
    yield Run("version", ["--version"], quick=True, words=True)


def python_runs():
    """to_dict() of every result of the Python module that has one."""
    yield Run("python", [str(ROOT / "tools/freeze_python.py"), HEALTHY, ROBOT, str(INPUTS / "cart.urdf")],
              python=True, needs=["risk_log", "friction_log"])


def recorded_runs():
    """Recordings that do not ship with the project."""
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


def all_runs():
    for runs in (shipped_runs, risk_runs, simulator_runs, format_runs, fleet_runs, word_runs, python_runs):
        yield from runs()
