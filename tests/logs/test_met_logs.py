# SPDX-License-Identifier: Apache-2.0
"""Logs that people met, made by the program beside the checkout (../shared/cases/give.py, in WHEELWRIGHT_CASES; without
it the test is skipped, as those of recordings are): each is answered with the right values, or refused for its true
reason with a way out, and the way out works when it is followed literally."""

import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import skip

CASES = Path(os.environ.get("WHEELWRIGHT_CASES", ""))
PROGRAM = os.environ.get("WHEELWRIGHT_PROGRAM", "")
# The robot of ../shared/cases/world.py.
TRUTH = {"mass": 24.0, "yaw_inertia": 1.3, "viscous_linear": 6.0, "viscous_yaw": 0.7}


class MetLogs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        skip.skip_without_recordings((CASES / "give.py").is_file(), f"no logs in '{CASES}'")
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.scratch.name)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def case(self, name):
        done = subprocess.run([sys.executable, "-B", CASES / "give.py", self.folder, name], capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / name

    def ask(self, *words):
        """Exit code, standard output and standard error of `program WORDS`."""
        done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=300, check=False)
        self.assertIn(done.returncode, (0, 1, 2), done.stderr)
        return done.returncode, done.stdout, done.stderr

    def findings(self, log, robot):
        """What `doctor` finds beyond notices: sentences with their remedies, by id."""
        _, out, err = self.ask("doctor", log, "--robot", robot, "--json", "--quiet")
        self.assertTrue(out, err)
        return {f["id"]: f"{f['sentence']} {f['next']}" for f in json.loads(out)["findings"]
                if f["severity"] in ("warning", "fatal")}

    def commission(self, log, robot, *more):
        code, out, err = self.ask("commission", log, "--robot", robot, "--json", "--quiet", *more)
        return code, json.loads(out) if out else {}, err

    def hold_the_truth(self, model):
        self.assertTrue(model.get("physical"), model.get("message"))
        for name, entry in model["physical"].items():
            value = TRUTH.get(name, 0.0)
            self.assertTrue(entry["lower"] <= value <= entry["upper"],
                            f"{name} = {value} is not in [{entry['lower']}, {entry['upper']}]")
        self.assertLess(model["physical"]["mass"]["upper"] - model["physical"]["mass"]["lower"], TRUTH["mass"])

    def test_a_car_is_no_differential_drive(self):
        case = self.case("car")
        code, _, err = self.commission(case / "bag.mcap", case / "robot.yaml")
        self.assertEqual(code, 2)
        self.assertRegex(err, r"(?i)steer")

    def test_times_in_days_are_refused_as_such(self):
        case = self.case("csv_files")
        code, _, err = self.commission(case / "days.csv", case / "robot.yaml")
        self.assertEqual(code, 2)
        self.assertRegex(err, r"(?i)\bdays\b")

    def test_decimal_commas_are_read(self):
        case = self.case("csv_files")
        code, model, err = self.commission(case / "german.csv", case / "robot.yaml")
        self.assertEqual(code, 0, err)
        self.hold_the_truth(model)

    def test_places_in_time_can_be_read(self):
        case = self.case("csv_files")
        _, out, _ = self.ask("doctor", case / "epoch.csv", "--robot", case / "robot.yaml")
        places = re.findall(r"at t = ([\d.]+) to", out)
        self.assertTrue(places, out)
        self.assertLess(max(map(float, places)), 121.0, "seconds from the beginning")
        self.assertIn("2022-11-10 14:46:27", out)

    def test_frozen_efforts_are_named_with_their_place(self):
        case = self.case("effort_frozen")
        for name in ("frozen", "zero", "short"):
            with self.subTest(name):
                log = case / f"{name}.csv"
                said = "\n".join(text for key, text in self.findings(log, case / "robot.yaml").items()
                                 if key.startswith("signals.effort_"))
                without = re.search(r"--without (60(?:\.0\d)?:[\d.]+)`", said)
                self.assertTrue(without, said)
                rest = self.folder / f"rest_of_{name}.csv"
                self.assertEqual(self.ask("convert", log, rest, "--without", without[1])[0], 0)
                code, model, err = self.commission(rest, case / "robot.yaml")
                self.assertEqual(code, 0, err)
                self.hold_the_truth(model)

    def test_efforts_in_per_cent_are_not_newton_metres(self):
        case = self.case("effort_percent")
        code, model, err = self.commission(case / "bag.mcap", case / "robot.yaml")
        self.assertNotEqual(code, 0)
        self.assertRegex(err + model.get("message", "") + json.dumps(model.get("contradictions", "")), r"(?i)per cent|%")

    def test_smoothed_speeds_do_not_lead_astray(self):
        case = self.case("filtered_speeds")
        for smoothing in (20, 50, 100):
            with self.subTest(smoothing):
                code, model, err = self.commission(case / f"log_{smoothing}.csv", case / "robot.yaml")
                self.assertEqual(code, 0, err)
                self.hold_the_truth(model)

    def test_speeds_with_the_sign_of_the_command_are_named(self):
        case = self.case("no_direction")
        said = self.findings(case / "log.csv", case / "robot.yaml")
        self.assertRegex("\n".join(said.values()), r"(?i)direction|sign")
        code, model, err = self.commission(case / "log.csv", case / "robot.yaml")
        if code == 0:
            self.hold_the_truth(model)
        else:
            self.assertRegex(err + model.get("message", ""), r"(?i)direction|sign")

    def test_speeds_win_over_angles_that_stay_zero(self):
        case = self.case("position_zero")
        code, model, err = self.commission(case / "bag.mcap", case / "robot.yaml")
        self.assertEqual(code, 0, err)
        self.hold_the_truth(model)

    def test_a_bag_of_ros_1_is_named_with_what_converts_it(self):
        case = self.case("ros1_bag")
        for words in (["doctor"], ["commission"], ["convert"]):
            more = [self.folder / "made.csv"] if words == ["convert"] else ["--robot", case / "robot.yaml"]
            code, _, err = self.ask(*words, case / "log.bag", *more)
            self.assertEqual(code, 2)
            self.assertRegex(err, r"ROS 1[\s\S]*rosbags-convert")

    def test_links_without_a_mass_are_named_at_once(self):
        case = self.case("husky_urdf")
        code, _, err = self.ask("robot", "--urdf", case / "husky.urdf", "--out-file", self.folder / "husky.yaml")
        self.assertEqual(code, 2)
        for link in ("base_link", "top_chassis_link", "user_rail_link", "front_bumper_link", "top_plate_link"):
            self.assertIn(link, err)
        self.assertIn("--massless all", err)
        code, _, err = self.ask("robot", "--urdf", case / "husky.urdf", "--massless", "all", "--out-file",
                                self.folder / "husky.yaml")
        self.assertEqual(code, 0, err)

    def test_no_time_is_negative(self):
        case = self.case("several_segments")
        logs = [case / f"{name}.csv" for name in ("quasi_f", "quasi_b", "dyn_f", "dyn_b")]
        _, out, err = self.ask("identify", *logs, "--robot", case / "robot.yaml")
        self.assertTrue(out + err)
        self.assertNotRegex(out + err, r"[−-]\d[\d.]* s carr")

    def test_one_wheels_radius_is_not_its_encoders_scale(self):
        case = self.case("wheel_radius")
        for log, cause, share in (("log_L-3", "wheel_radius_asymmetric", -0.03),
                                  ("log_R+3", "wheel_radius_asymmetric", 0.03), ("encoder_l", "encoder_scale", -0.03)):
            with self.subTest(log):
                _, out, err = self.ask("gap", case / f"{log}.csv", "--robot", case / "robot.yaml", "--baseline",
                                       case / "healthy.csv", "--json", "--quiet", "--no-shrink", "--no-manoeuvre")
                self.assertTrue(out, err)
                causes = json.loads(out)["causes"]
                self.assertEqual([c["effect"] for c in causes], [cause], causes)
                self.assertTrue(any(p["lower"] <= share <= p["upper"] for p in causes[0]["parameters"].values()
                                    if p["lower"] is not None), causes)

    def test_counts_without_direction_are_named(self):
        case = self.case("ticks_20")
        self.assertRegex("\n".join(self.findings(case / "log.csv", case / "robot.yaml").values()), r"(?i)direction")

    def way_out(self, text):
        """The words `--map NAME=PLACE` that a refusal advises."""
        words = re.findall(r"--map [\"']?([\w]+=[^\s\"'`,;]+(?:\[[^\]]*\])?)", text)
        self.assertTrue(words, text)
        return [word for pair in words for word in ("--map", pair.rstrip(".)"))]

    def test_a_second_publisher_is_named_or_harmless(self):
        case = self.case("two_publishers")
        code, model, err = self.commission(case / "bag.mcap", case / "robot.yaml")
        if code == 2:
            self.assertRegex(err, r"(?i)publisher")
        else:
            self.assertEqual(code, 0)
            self.hold_the_truth(model)

    def test_unequal_arrays_are_cured_by_the_map_that_is_named(self):
        case = self.case("unequal_arrays")
        code, model, err = self.commission(case / "bag.mcap", case / "robot.yaml")
        if code == 2:
            code, model, err = self.commission(case / "bag.mcap", case / "robot.yaml", *self.way_out(err))
        self.assertEqual(code, 0, err)
        self.hold_the_truth(model)


if __name__ == "__main__":
    skip.main()
