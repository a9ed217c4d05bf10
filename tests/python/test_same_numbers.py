# SPDX-License-Identifier: Apache-2.0
"""Python and the command line give the same results, to the last bit."""

import json
import unittest

import numpy as np
import wheelwright as ww
from support import (HEALTHY, ROBOT, SCENARIOS, commissioned, different, fault_file, healthy_log, model_file, path,
                     program, robot)


class SameNumbers(unittest.TestCase):
    def same(self, python, command_line):
        self.assertIsNone(different(python, command_line))

    def test_commission(self):
        self.same(commissioned().to_dict(), program("commission", HEALTHY, "--robot", ROBOT))

    def test_saved_model_is_what_the_command_line_writes(self):
        program("commission", HEALTHY, "--robot", ROBOT, "--out", path("out"), "--quiet")
        self.assertEqual(model_file().read_bytes(), (path("out") / "model.json").read_bytes())

    def test_commission_options(self):
        python = ww.commission(healthy_log(), robot(), statistical=True, outliers=1, persistence=(3, 5))
        self.same(python.to_dict(), program("commission", HEALTHY, "--robot", ROBOT, "--statistical", "--outliers", 1,
                                            "--persistence", "3/5"))

    def test_detect(self):
        python = ww.detect(ww.read_log(fault_file(), robot()), ww.read_model(model_file()))
        self.assertTrue(python.fault)
        self.same(python.to_dict(), program("detect", fault_file(), "--model", model_file()))

    def test_detect_symmetric_box(self):
        python = ww.detect(ww.read_log(fault_file(), robot()), ww.read_model(model_file()), set="box",
                           test="symmetric", persistence=(2, 3))
        self.same(python.to_dict(), program("detect", fault_file(), "--model", model_file(), "--set", "box", "--test",
                                            "symmetric", "--persistence", "2/3"))

    def test_detect_by_constant_thresholds(self):
        python = ww.detect(ww.read_log(fault_file(), robot()), ww.read_model(model_file()), residual="d2")
        self.assertTrue(python.fault)
        self.assertEqual([], python.incidents)
        self.same(python.to_dict(), program("detect", fault_file(), "--model", model_file(), "--residual", "d2"))

    def test_identify(self):
        python = ww.identify(healthy_log(), robot(), shapes=False, seed=4)
        self.same(python.to_dict(), program("identify", HEALTHY, "--robot", ROBOT, "--no-shapes", "--seed", 4))

    def test_margins(self):
        python = ww.margins(healthy_log(), ww.read_model(model_file()), faults=["wheel_radius", "payload_lost"],
                            windows=[0.2, 0.5], onset_step=2.0, threads=2)
        self.same(python.to_dict(), program("margins", HEALTHY, "--model", model_file(), "--fault", "wheel_radius",
                                            "--fault", "payload_lost", "--window", 0.2, "--window", 0.5,
                                            "--onset-step", 2))

    def test_gap(self):
        python = ww.gap(ww.read_log(fault_file(), robot()), robot(), baseline=healthy_log(), shrink=False,
                        manoeuvre=False, without=["slope"])
        self.same(python.to_dict(), program("gap", fault_file(), "--robot", ROBOT, "--baseline", HEALTHY, "--no-shrink",
                                            "--no-manoeuvre", "--without", "slope"))

    def test_gap_that_is_ambiguous(self):
        # At one heading a slope is an offset of the torque: both say which drive would tell them apart.
        truth = {"mass": 21.0, "yaw_inertia": 0.9, "viscous_linear": 4.0, "viscous_yaw": 0.145}
        plain = {"wheel_radius": 0.0975, "track_width": 0.381, "encoder_counts_per_turn": 16384, "nominal": truth}
        ww.Robot(**plain).save(path("plain.yaml"))
        ww.simulate({"robot": {**plain, "effects": [{"effect": "slope", "g_x": 0.2, "g_y": 0.01}]},
                     "parameters": truth,
                     "trajectory": {"kind": "multi_sine", "speed": 0.6, "yaw_rate": 0.05, "period": 14},
                     "sensors": {"sampling": "interval", "effort": 0.1, "position": 0.002, "heading": 0.003,
                                 "encoder_counts_per_turn": 16384, "log": ["speeds", "pose"]},
                     "duration": 30, "rate": 50, "seed": 3}).save(path("slope.csv"))
        plain_robot = ww.read_robot(path("plain.yaml"))
        python = ww.gap(ww.read_log(path("slope.csv"), plain_robot), plain_robot, shrink=False)
        self.assertEqual(python.verdict, "ambiguous")
        self.same(python.to_dict(), program("gap", path("slope.csv"), "--robot", path("plain.yaml"), "--no-shrink"))
        self.assertLessEqual({"t", "command_r", "command_l"}, set(python.next_commands))

    def test_design(self):
        python = ww.design(ww.read_model(model_file()), "bounds", speed=8.0, acceleration=20.0, radius=1.5, stages=2,
                           duration=8.0, seed=3)
        self.same(python.to_dict(), program("design", "--model", model_file(), "--for", "bounds", "--speed", 8,
                                            "--acceleration", 20, "--radius", 1.5, "--stages", 2, "--duration", 8,
                                            "--seed", 3))

    def test_simulate(self):
        program("simulate", SCENARIOS / "healthy.yaml", "--out", path("healthy.csv"), "--seed", 9)
        written = ww.read_log(path("healthy.csv")).to_arrays()
        simulated = ww.simulate(SCENARIOS / "healthy.yaml", seed=9).to_arrays()
        self.assertEqual(list(written), list(simulated))
        for name, values in written.items():
            np.testing.assert_array_equal(values, simulated[name], name)

    def test_recordings(self):
        # The same drive as a rosbag2 recording and as HDF5: read by Python as by the command line.
        for name in ("drive.mcap", "drive.h5"):
            program("convert", fault_file(), path(name))
            python = ww.commission(ww.read_log(path(name), robot()), robot())
            self.same(python.to_dict(), program("commission", path(name), "--robot", ROBOT))

    def test_results_are_json(self):
        self.assertEqual(json.loads(json.dumps(commissioned().to_dict(), allow_nan=False)), commissioned().to_dict())


if __name__ == "__main__":
    unittest.main()
