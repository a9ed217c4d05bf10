# SPDX-License-Identifier: Apache-2.0
"""Results as tables: in a notebook, in pandas, in one line."""

import functools
import html.parser
import importlib.util
import subprocess
import sys
import unittest

import numpy as np
import skip
import wheelwright as ww
from support import HEALTHY, SCENARIOS, commissioned, fault_file, healthy_log, path, robot, straight_log

HOSTILE = '<script>alert("x")</script> & \'y\''
CONTROLS = "\n\x1b[31m"


@functools.lru_cache(maxsize=None)
def results():
    """One of every class that has a table."""
    model = commissioned().model
    fault = ww.read_log(fault_file(), robot())
    path("study.yaml").write_text(f"scenario: {SCENARIOS / 'healthy.yaml'}\ninputs: {{noise.effort: [0.01, 0.05]}}\n"
                                  "quantities: [width]\nmethods: {one_at_a_time: {levels: 2}}\n")
    path("cart.yaml").write_text("controller_manager: {ros__parameters: {update_rate: 100}}\n"
                                 "diff_drive_controller:\n"
                                 "  ros__parameters: {left_wheel_names: [l], right_wheel_names: [r], "
                                 "wheel_separation: 0.4, wheel_radius: 0.05}\n")
    limits = {"speed": 8.0, "acceleration": 20.0, "radius": 1.5, "stages": 1, "duration": 6.0}
    return [commissioned(), ww.detect(fault, model), ww.Detector(model).run(fault),
            ww.margins(healthy_log(), model, faults=["wheel_radius"], windows=[0.5, 2.0], onset_step=4.0),
            ww.gap(fault, robot(), baseline=healthy_log(), shrink=False, manoeuvre=False),
            ww.identify(healthy_log(), robot(), shapes=False), ww.filter_log(healthy_log(), robot(), model),
            ww.doctor(healthy_log(), robot()), ww.choose(healthy_log(), robot(), threads=2),
            ww.check(commissioned(), healthy_log()), ww.compare(model, model),
            ww.fleet([HEALTHY, path("there_is_none.csv")], robot()),
            ww.sensitivity(path("study.yaml")), ww.robot_from(ros2_control=path("cart.yaml")),
            ww.design(model, "bounds", **limits), ww.design(model, "detection", **limits),
            ww.design(model, "discrimination", between=["coulomb", "caster_drag"], **limits)]


class Reader(html.parser.HTMLParser):
    """Rows of cells; notes elements that are no table's."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.foreign, self.caption, self.inside = [], [], "", ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag not in ("table", "caption", "thead", "tbody", "tr", "th", "td"):
            self.foreign.append(tag)
        self.inside = tag
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.inside == "caption":
            self.caption += data
        elif self.inside in ("td", "th"):
            self.rows[-1][-1] += data


class Notebook(unittest.TestCase):
    def test_every_result_has_a_table(self):
        for result in results():
            with self.subTest(type(result).__name__):
                shown = Reader(result._repr_html_())
                self.assertEqual(shown.foreign, [])
                self.assertEqual(shown.rows[0], ["what", "value", "interval", "unit", "verdict"])
                self.assertGreater(len(shown.rows), 1)
                self.assertTrue(shown.caption.startswith(type(result).__name__))
                self.assertLessEqual(len(shown.rows), 62)

    def test_every_result_has_a_line(self):
        for result in results():
            with self.subTest(type(result).__name__):
                self.assertRegex(repr(result), rf"^<wheelwright\.{type(result).__name__} .+>$")

    def test_a_table_says_what_the_result_says(self):
        rows = Reader(commissioned()._repr_html_()).rows[1:]
        for row, p in zip(rows, commissioned().parameters):
            self.assertEqual(row[:4], [p.name, f"{p.estimate:.5g}", f"[{p.lower:.5g}, {p.upper:.5g}]", p.unit])
        self.assertEqual(repr(commissioned()), "<wheelwright.Commission of example: done>")

    def test_a_name_that_would_make_lines_or_colours_is_none(self):
        with self.assertRaisesRegex(ww.InputError, "name: .*control characters"):
            ww.Robot(**{**robot().to_dict(), "name": HOSTILE + CONTROLS})

    def test_a_hostile_name_is_escaped(self):
        named = ww.Robot(**{**robot().to_dict(), "name": HOSTILE})
        for result in (ww.commission(healthy_log(), named), ww.identify(healthy_log(), named, shapes=False)):
            text = result._repr_html_()
            self.assertEqual(Reader(text).foreign, [])
            self.assertNotIn("<script", text)
            self.assertIn("&lt;script&gt;", text)
            self.assertNotIn("\x1b", text + repr(result))
            self.assertNotIn("\n", repr(result))

    def test_what_a_log_says_of_nothing_is_a_dash(self):
        result = ww.commission(straight_log(), robot())
        hidden = [row for row, p in zip(Reader(result._repr_html_()).rows[1:], result.parameters) if p.estimate is None]
        self.assertTrue(hidden)
        self.assertTrue(all(row[1] == "–" for row in hidden))


class Frames(unittest.TestCase):
    def setUp(self):
        skip.skip_unless(self, importlib.util.find_spec("pandas"), "pandas is not installed")

    def frame(self, kind):
        result = next(r for r in results() if isinstance(r, kind))
        return result, result.to_dataframe()

    def test_every_result_has_one(self):
        for result in results():
            with self.subTest(type(result).__name__):
                self.assertGreater(len(result.to_dataframe()), 0)

    def test_commission(self):
        result, frame = self.frame(ww.Commission)
        self.assertEqual(list(frame["name"]), [p.name for p in result.parameters])
        np.testing.assert_array_equal(frame["estimate"], result.estimate)
        np.testing.assert_array_equal(frame["lower"], result.lower)

    def test_run_and_regression_have_a_row_for_each_instant_and_output(self):
        run, frame = self.frame(ww.DetectorRun)
        for i, output in enumerate(run.outputs):
            one = frame[frame["output"] == output]
            np.testing.assert_array_equal(one["t"], run.t)
            np.testing.assert_array_equal(one["residual"], run.residual[:, i])
            np.testing.assert_array_equal(one["outside"], run.outside[:, i])
        rows, frame = self.frame(ww.Regression)
        one = frame[frame["output"] == rows.outputs[1]]
        np.testing.assert_array_equal(one["y"], rows.y[:, 1])
        np.testing.assert_array_equal(one[f"Y.{rows.parameters[-1]}"], rows.Y[:, 1, -1])

    def test_detection(self):
        found, frame = self.frame(ww.Detection)
        self.assertEqual(list(frame["start"]), [e.start for e in found.events + found.kinematic_events])
        self.assertEqual(set(frame["incident"]), set(range(len(found.incidents))))

    def test_margins(self):
        found, frame = self.frame(ww.Margins)
        fault = found.residuals[0].faults[0]
        kind = fault.manoeuvres[0]
        row = frame[(frame["residual"] == "torque") & (frame["fault"] == fault.fault) & (frame["side"] == fault.side)
                    & (frame["manoeuvre"] == kind) & (frame["window"] == 2.0)]
        self.assertEqual(row["median"].item(), fault.summarise(1, kind)["median"])

    def test_doctor_choice_check_fleet_study(self):
        found, frame = self.frame(ww.LogHealth)
        self.assertEqual(list(frame["id"]), [f["id"] for f in found.findings])
        found, frame = self.frame(ww.DetectorChoice)
        self.assertEqual(frame["chosen"].sum(), 1)
        self.assertEqual(frame["beta"][0], found.chosen["beta"])
        found, frame = self.frame(ww.ModelCheck)
        self.assertTrue(frame["proved"].all())
        found, frame = self.frame(ww.Fleet)
        self.assertEqual(list(frame["robot"].unique()), ["healthy", "there_is_none"])
        self.assertEqual(list(frame["status"].unique()), ["commissioned", "unreadable"])
        found, frame = self.frame(ww.Sensitivity)
        np.testing.assert_array_equal(frame["noise.effort"], found.points[:, 0])
        np.testing.assert_array_equal(frame[found.quantities[0]["name"]], found.values[:, 0])


class WithoutPandas(unittest.TestCase):
    def test_it_is_said_what_to_install(self):
        code = ("import sys; sys.modules['pandas'] = sys.modules['matplotlib'] = None\n"
                "import numpy as np, wheelwright as ww\n"
                "log = ww.Log({'t': np.arange(500) * 0.01, 'omega_r': np.ones(500)})\n"
                "for work in (ww.doctor(log).to_dataframe, lambda: ww.plot._axes(None)):\n"
                "    try:\n        work()\n"
                "    except ww.Error as error:\n        print(error)\n")
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
        self.assertEqual(done.stderr, "")
        for line, package in zip(done.stdout.splitlines(), ("pandas", "matplotlib"), strict=True):
            self.assertIn(f"apt install python3-{package}", line)


if __name__ == "__main__":
    skip.main()
