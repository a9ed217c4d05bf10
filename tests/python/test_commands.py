# SPDX-License-Identifier: Apache-2.0
"""Functions for which the command line has a command: the same results, to the last bit, and the same words."""

import subprocess
import unittest

import numpy as np
import wheelwright as ww
from support import (CART, HEALTHY, PROGRAM, ROBOT, commissioned, different, fault_file, healthy_log, model_file, path,
                     program, robot)


def words(*arguments):
    """What the command prints for people."""
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=600).stdout


class Commands(unittest.TestCase):
    def same(self, python, *arguments):
        self.assertIsNone(different(python.to_dict(), program(*arguments)))
        self.assertIn(python.summary, words(*arguments))
        python.save(path("saved.json"))


class Doctor(Commands):
    def test_with_and_without_a_robot(self):
        self.same(ww.doctor(healthy_log(), robot()), "doctor", HEALTHY, "--robot", ROBOT)
        self.same(ww.doctor(ww.read_log(HEALTHY)), "doctor", HEALTHY)

    def test_first_rows(self):
        python = ww.doctor(healthy_log(), robot(), rows=500)
        self.same(python, "doctor", HEALTHY, "--robot", ROBOT, "--rows", 500)
        self.assertEqual(python.rows, 500)
        self.assertIn("time.first_rows_only", [f["id"] for f in python.findings])
        with self.assertRaisesRegex(ww.InvalidArgument, "rows"):
            ww.doctor(healthy_log(), rows=0)

    def test_a_model_has_a_robot(self):
        of_model = ww.doctor(healthy_log(), commissioned().model)
        self.assertTrue(of_model.fit)
        self.assertEqual(of_model.verdict, "commission")
        self.assertEqual([f["id"] for f in of_model.findings],
                         [f["id"] for f in ww.doctor(healthy_log(), robot()).findings])

    def test_what_cannot_be_commissioned(self):
        columns = healthy_log().to_arrays()
        still = ww.doctor(ww.Log({name: values if name == "t" else np.zeros_like(values)
                                  for name, values in columns.items()}, robot()), robot())
        self.assertFalse(still.fit)
        self.assertEqual(still.findings[0]["severity"], "fatal")


class Choose(Commands):
    def test_for_a_stated_fault(self):
        told = []
        python = ww.choose(healthy_log(), robot(), faults={"wheel_radius": 0.05}, window=0.5, threads=2,
                           progress=lambda share, text: told.append(share))
        self.same(python, "choose", HEALTHY, "--robot", ROBOT, "--fault", "wheel_radius=0.05", "--window", 0.5)
        self.assertEqual(told, sorted(told))
        chosen = python.commission
        self.assertEqual(chosen.model.filter, python.chosen)
        program("choose", HEALTHY, "--robot", ROBOT, "--fault", "wheel_radius=0.05", "--window", 0.5, "--out",
                path("choice"), "--quiet")
        chosen.save(path("chosen.json"))
        self.assertEqual(path("chosen.json").read_bytes(), (path("choice") / "model.json").read_bytes())

    def test_options_are_checked(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "guarantee 'neither'"):
            ww.choose(healthy_log(), robot(), guarantee="neither")
        with self.assertRaisesRegex(ww.InvalidArgument, r"faults\['wheel_radius'\]"):
            ww.choose(healthy_log(), robot(), faults={"wheel_radius": -1.0})
        with self.assertRaisesRegex(ww.Error, "wheel_radio"):
            ww.choose(healthy_log(), robot(), faults=["wheel_radio"])


class Check(Commands):
    def test_a_file_a_model_and_a_commissioning(self):
        from_file = ww.check(model_file(), healthy_log())
        self.assertTrue(from_file.proved)
        self.same(from_file, "check", model_file(), HEALTHY)
        self.assertIsNone(different(ww.check(ww.read_model(model_file()), healthy_log()).to_dict(),
                                    from_file.to_dict()))
        in_memory = ww.check(commissioned(), healthy_log()).to_dict()
        self.assertIsNone(different({**in_memory, "model": str(model_file())}, from_file.to_dict()))

    def test_another_log_proves_nothing(self):
        python = ww.check(model_file(), ww.read_log(fault_file(), robot()))
        self.assertFalse(python.proved)
        self.assertTrue(python.failures)
        self.same(python, "check", model_file(), fault_file())

    def test_a_model_of_no_file_has_no_proofs(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "Commission that it came from"):
            ww.check(commissioned().model, healthy_log())


class Detect(Commands):
    def test_a_log_that_is_not_decided_says_so(self):
        columns = healthy_log().to_arrays()
        clock = 1e-6 * np.arange(len(columns["t"]))  # of a robot at rest
        still = ww.Log({name: clock if name == "t" else np.full_like(values, values[0])
                        for name, values in columns.items()}, robot())
        found = ww.detect(still, ww.read_model(model_file()))
        self.assertFalse(found.fault)
        self.assertIn("a clock that hardly goes on", found.undecided)
        self.assertEqual(found.to_dict()["undecided"], found.undecided)
        self.assertIn("not decided", repr(found))
        self.assertEqual(ww.detect(healthy_log(), ww.read_model(model_file())).undecided, "")


class Compare(Commands):
    def test_files_models_and_a_model_in_memory(self):
        heavy = path("heavy.json")
        columns = healthy_log().to_arrays()
        loaded = ww.Log({**columns, "tau_r": 1.2 * columns["tau_r"], "tau_l": 1.2 * columns["tau_l"]}, robot())
        ww.commission(loaded, robot()).save(heavy)
        python = ww.compare(model_file(), heavy)
        self.assertTrue(python.changed)
        self.assertIn("mass", python.message.lower())
        self.assertIsNone(different(python.to_dict(), program("compare", model_file(), heavy)))
        self.assertIn(python.summary, words("compare", model_file(), heavy))
        self.assertIsNone(different(ww.compare(ww.read_model(model_file()), heavy).to_dict(), python.to_dict()))
        self.assertFalse(ww.compare(commissioned().model, model_file()).changed)

    def test_what_is_no_model(self):
        with self.assertRaisesRegex(ww.InputError, "there_is_none"):
            ww.compare(model_file(), path("there_is_none.json"))


class Export(unittest.TestCase):
    def test_text_is_the_commands(self):
        model = ww.read_model(model_file())
        self.assertEqual(ww.export(model), program("export", model_file(), "--language", "c")["text"])
        self.assertEqual(ww.export(model, name="left_robot", set="box", test="symmetric", persistence=(2, 3)),
                         program("export", model_file(), "--language", "c", "--name", "left_robot", "--set", "box",
                                 "--test", "symmetric", "--persistence", "2/3")["text"])

    def test_names_and_languages_are_checked(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "language 'rust': expected c"):
            ww.export(commissioned().model, "rust")
        with self.assertRaisesRegex(ww.InputError, "2fast"):
            ww.export(commissioned().model, name="2fast")


class Fleet(Commands):
    def test_a_list(self):
        path("fleet.csv").write_text("robot,log,when,role\n"
                                     f"amy,{HEALTHY},2026-03-02,commission\n"
                                     f"amy,{fault_file()},2026-03-06,check\n"
                                     f"bob,{fault_file()},2026-03-02,\n"
                                     "eve,there_is_none.csv,2026-03-02,\n")
        told = []
        python = ww.fleet(path("fleet.csv"), robot(), threads=2, progress=lambda share, text: told.append(text))
        self.same(python, "fleet", path("fleet.csv"), "--robot", ROBOT)
        self.assertFalse(python.well)
        self.assertEqual([r["robot"] for r in python.records], ["amy", "bob", "eve"])
        self.assertIn("robot 3 of 3", told)
        program("fleet", path("fleet.csv"), "--robot", ROBOT, "--out", path("fleet"), "--quiet")
        self.assertEqual(python.prior_yaml, (path("fleet") / "pooled_prior.yaml").read_text())

    def test_logs_by_name(self):
        by_name = ww.fleet({"amy": [HEALTHY, fault_file()]}, robot())
        first, = by_name.records
        self.assertEqual(first["commissioning"]["status"], "commissioned")
        self.assertEqual([check["log"]["log"] for check in first["checks"]], [str(fault_file())])
        each_its_own = ww.fleet([HEALTHY, fault_file()], robot())
        self.assertEqual([r["robot"] for r in each_its_own.records], ["healthy", "fault"])
        self.assertEqual(each_its_own.records[0]["commissioning"], first["commissioning"])

    def test_options_are_checked(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "logs"):
            ww.fleet([], robot())
        with self.assertRaisesRegex(ww.InvalidArgument, "two robots called healthy"):
            ww.fleet([HEALTHY, HEALTHY], robot())
        with self.assertRaisesRegex(ww.InputError, "omega_rr.*omega_r"):
            ww.fleet([HEALTHY], robot(), map={"omega_rr": "wheel_2"})


class Sensitivity(Commands):
    def setUp(self):
        path("robot.yaml").write_text(ROBOT.read_text())
        path("scenario.yaml").write_text("robot: robot.yaml\n"
                                         "parameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, "
                                         "viscous_yaw: 0.5}\n"
                                         "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 3}\n"
                                         "duration: 15\nrate: 50\n"
                                         "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02}\n")
        path("study.yaml").write_text("name: noise\nscenario: scenario.yaml\n"
                                      "inputs:\n  noise.effort: {range: [0.01, 0.05], scale: log}\n"
                                      "  filter.beta: {range: [5, 20], nominal: 8}\n"
                                      "quantities: [width, commissioned]\n"
                                      "methods: {local: true, one_at_a_time: {levels: 3}}\n")

    def test_a_study(self):
        python = ww.sensitivity(path("study.yaml"), threads=2)
        self.same(python, "sensitivity", path("study.yaml"))
        quantities = [q["name"] for q in python.quantities]
        self.assertEqual(python.points.shape, (len(python), 2))
        self.assertEqual(python.values.shape, (len(python), len(quantities)))
        # More noise, wider bounds: cases that differ in noise alone.
        beta = python.points[:, 1] == 8.0
        order = np.argsort(python.points[beta, 0])
        self.assertTrue((np.diff(python.values[beta, 0][order]) > 0).all())

    def test_files_name_the_place(self):
        path("wrong.yaml").write_text("scenario: scenario.yaml\ninputs: {noise.efort: [0.01, 0.05]}\n")
        with self.assertRaisesRegex(ww.InputError, r"wrong\.yaml.*noise\.efort"):
            ww.sensitivity(path("wrong.yaml"))


class RobotFrom(Commands):
    def setUp(self):
        path("cart.urdf").write_text(CART)

    def test_a_urdf(self):
        python = ww.robot_from(path("cart.urdf"))
        self.same(python, "robot", "--urdf", path("cart.urdf"))
        self.assertEqual(python.robot.to_dict()["wheel_radius"], 0.05)
        self.assertIn("cart.urdf:", python.origins["wheel_radius"])
        python.save(path("cart.yaml"))
        self.assertEqual(ww.read_robot(path("cart.yaml")), python.robot)
        self.assertEqual(path("cart.yaml").read_text(), words("robot", "--urdf", path("cart.urdf")))

    def test_hints_go_before_the_file(self):
        python = ww.robot_from(path("cart.urdf"), wheel_radius=0.0505, track_width=0.41, name="mine")
        self.same(python, "robot", "--urdf", path("cart.urdf"), "--wheel-radius", 0.0505, "--track-width", 0.41,
                  "--name",
                  "mine")

    def test_what_is_missing_is_named(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "urdf, ros2_control"):
            ww.robot_from()
        with self.assertRaisesRegex(ww.InvalidArgument, "controller 'base'"):
            ww.robot_from(path("cart.urdf"), controller="base")
        path("half.urdf").write_text(CART.replace("right", "right_rear", 1))
        with self.assertRaisesRegex(ww.InputError, "half.urdf"):
            ww.robot_from(path("half.urdf"))


class Discrimination(Commands):
    LIMITS = {"speed": 8.0, "acceleration": 20.0, "radius": 1.5, "stages": 1, "duration": 6.0}
    OPTIONS = ("--speed", 8, "--acceleration", 20, "--radius", 1.5, "--stages", 1, "--duration", 6)

    def test_causes_by_name(self):
        python = ww.design(ww.read_model(model_file()), "discrimination", between=["coulomb", "caster_drag+slope"],
                           sizes={"coulomb": 0.2}, **self.LIMITS)
        self.same(python, "design", "--model", model_file(), "--for", "discrimination", "--between", "coulomb",
                  "--between",
                  "caster_drag+slope", "--size", "coulomb=0.2", *self.OPTIONS)
        self.assertLessEqual({"t", "command_r", "command_l"}, set(python.commands))

    def test_causes_of_a_gap(self):
        truth = {"mass": 21.0, "yaw_inertia": 0.9, "viscous_linear": 4.0, "viscous_yaw": 0.145}
        plain = {"wheel_radius": 0.0975, "track_width": 0.381, "encoder_counts_per_turn": 16384, "nominal": truth}
        ww.Robot(**plain).save(path("plain.yaml"))
        late = ww.simulate({"robot": {**plain, "effects": [{"effect": "delay", "T_d": 0.02}]}, "parameters": truth,
                            "trajectory": {"kind": "multi_sine", "speed": 0.6, "yaw_rate": 1.0, "period": 14},
                            "sensors": {"sampling": "interval", "effort": 0.05, "position": 0.002, "heading": 0.003,
                                        "encoder_counts_per_turn": 16384, "log": ["speeds", "pose"]},
                            "duration": 30, "rate": 50, "seed": 3})
        diagnosis = ww.gap(late, ww.read_robot(path("plain.yaml")), shrink=False)
        self.assertEqual(diagnosis.verdict, "explained")
        (cause,) = diagnosis.causes
        self.assertEqual(cause.family, "late_torque")
        self.assertEqual({law.effect for law in cause.laws}, {"actuator_lag", "delay"})
        self.assertEqual(cause.laws[0].parameters.keys(), cause.parameters.keys())
        self.assertEqual(diagnosis.visible, [])
        self.assertIsNone(diagnosis.healthy_misfit)
        diagnosis.save(path("gap.json"))
        model = ww.read_model(model_file())
        python = ww.design(model, "discrimination", gap=diagnosis, **self.LIMITS)
        self.same(python, "design", "--model", model_file(), "--for", "discrimination", "--gap", path("gap.json"),
                  *self.OPTIONS)
        of_file = ww.design(model, "discrimination", gap=path("gap.json"), **self.LIMITS)
        self.assertIsNone(different(python.to_dict(), of_file.to_dict()))

    def test_options_are_checked(self):
        model = commissioned().model
        for wrong, options in (("at least two causes", {}), ("at least two causes", {"between": ["coulomb"]}),
                               ("a Diagnosis or the path", {"gap": 3}),
                               ("'colomb' is no effect", {"between": ["colomb", "slope"]}),
                               (r"sizes\['slope'\].*named with between", {"between": ["coulomb", "caster_drag"],
                                                                          "sizes": {"slope": 1.0}}),
                               ("aim bounds or detection", {"between": ["coulomb", "slope"], "guarantee": "at_risk"})):
            with self.assertRaisesRegex(ww.Error, wrong):
                ww.design(model, "discrimination", **options, **self.LIMITS)
        with self.assertRaisesRegex(ww.InvalidArgument, "aim 'discrimination'"):
            ww.design(model, "bounds", between=["coulomb", "slope"], **self.LIMITS)


class Columns(unittest.TestCase):
    def test_a_robot_file_says_where_columns_are(self):
        lines = ROBOT.read_text() + "\ncolumns: {omega_r: wheel_2}\n"
        path("columns.yaml").write_text(lines)
        log = healthy_log().to_arrays()
        log["wheel_2"] = log.pop("omega_r")
        names = list(log)
        np.savetxt(path("columns.csv"), np.column_stack([log[n] for n in names]), delimiter=",", header=",".join(names),
                   comments="")
        of = ww.read_robot(path("columns.yaml"))
        self.assertIn("omega_r", ww.read_log(path("columns.csv"), of).columns)
        self.assertEqual(ww.fleet([path("columns.csv")], of).records[0]["commissioning"]["status"], "commissioned")


if __name__ == "__main__":
    unittest.main()
