# SPDX-License-Identifier: Apache-2.0
"""Pictures: that they draw, what their axes say, and that they show the result's numbers."""

import importlib.util
import io
import unittest

import numpy as np
import skip
import wheelwright as ww
from support import commissioned, fault_file, healthy_log, model_file, page_code, robot, straight_log


class Plot(unittest.TestCase):
    def setUp(self):
        skip.skip_unless(self, importlib.util.find_spec("matplotlib"), "matplotlib is not installed")
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot
        self.plt = matplotlib.pyplot
        self.addCleanup(self.plt.close, "all")

    def drawn(self, ax, x, y):
        ax.figure.savefig(io.BytesIO(), format="svg")
        self.assertRegex(ax.get_xlabel(), x)
        self.assertRegex(ax.get_ylabel(), y)
        return ax

    @staticmethod
    def run_of_fault():
        return ww.Detector(commissioned().model).run(ww.read_log(fault_file(), robot()))

    def test_parameters(self):
        ax = self.drawn(ww.plot.parameters(commissioned()), "deviation from the best guess, %", "parameter")
        p = commissioned().parameters[0]
        self.assertEqual([t.get_text() for t in ax.get_yticklabels()][0], f"{p.name}, {p.unit}")
        np.testing.assert_allclose(ax.lines[0].get_xdata(), [100 * (p.lower / p.estimate - 1),
                                                             100 * (p.upper / p.estimate - 1)])

    def test_parameters_that_no_log_shows(self):
        result = ww.commission(straight_log(), robot())
        self.assertTrue(any(p.estimate is None for p in result.parameters))
        self.drawn(ww.plot.parameters(result), "%", "parameter")

    def test_residuals(self):
        run = self.run_of_fault()
        ax = self.drawn(ww.plot.residuals(run, "difference"), "t, s", "residual of difference, N·m")
        i = run.outputs.index("difference")
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), run.residual[:, i])
        alarms = [e.alarm for e in run.events if e.output == "difference"]
        self.assertEqual([line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == "--"], alarms)
        self.assertEqual([t.get_text() for t in ax.get_legend().get_texts()],
                         ["threshold", "residual", "outside", "alarm"])

    def test_measured_and_predicted_differ_without_colour(self):
        ax = self.drawn(ww.plot.efforts(self.run_of_fault()), "t, s", "filtered sum, N·m")
        self.assertEqual(["-", "--"], [line.get_linestyle() for line in ax.lines])
        self.assertEqual(["measured", "predicted"], [line.get_label() for line in ax.lines])

    def test_feasible_set_is_the_projection(self):
        vertices = commissioned().feasible_set.vertices
        for of in (commissioned(), ww.read_model(model_file())):
            ax = self.drawn(ww.plot.feasible_set(of, 0, 2), r"r_mass, kg·m", r"\w+, \S+")
            corners = ax.patches[0].get_xy()
            hull = commissioned().feasible_set.hull
            width = (hull[:, 1] - hull[:, 0])[[0, 2]]
            # Every vertex is inside the outline, and the outline reaches as far as the vertices do, in any direction.
            for angle in np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False):
                along = np.array([np.cos(angle), np.sin(angle)]) / width
                reach = (vertices[:, [0, 2]] @ along).max()
                self.assertGreaterEqual((corners @ along).max(), reach - 1e-9)
                self.assertLess((corners @ along).max(), reach + 5e-3)

    def test_margins_are_a_matrix(self):
        found = ww.margins(healthy_log(), commissioned().model, faults=["wheel_radius", "payload_lost"],
                           windows=[0.5, 2.0],
                           onset_step=2.0)
        ax = self.drawn(ww.plot.margins(found, 1), "manoeuvre", "fault, unit")
        self.assertEqual(ax.get_title(), "Smallest certain size within 2 s")
        faults, kinds = len(ax.get_yticks()), len(ax.get_xticks())
        self.assertEqual(len(ax.texts), faults * kinds)
        fault = found.residuals[0].faults[0]
        first = fault.summarise(1, ax.get_xticklabels()[0].get_text())["median"]
        self.assertEqual(ax.texts[0].get_text(), f"{first:.3g}" if np.isfinite(first) else "–")

    def test_gap(self):
        found = ww.gap(ww.read_log(fault_file(), robot()), robot(), baseline=healthy_log(), shrink=False,
                       manoeuvre=False)
        series = found.series[1]
        ax = self.drawn(ww.plot.gap(found, series.channel), "t, s", f"residual of {series.channel}")
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), series.nominal)
        np.testing.assert_array_equal(ax.lines[1].get_ydata(), series.after)

    def test_what_the_page_draws(self):
        exec(page_code()[1], {"ww": ww, "run": self.run_of_fault()})
        self.assertEqual(len(self.plt.get_fignums()), 1)

    def test_axes_that_are_given_are_used(self):
        figure, axes = self.plt.subplots(1, 2)
        self.assertIs(ww.plot.parameters(commissioned(), ax=axes[1]), axes[1])
        self.assertEqual(len(axes[0].lines), 0)
        self.assertIs(ww.plot.residuals(self.run_of_fault(), ax=axes[0]), axes[0])

    def test_names_are_checked(self):
        for work, wrong in ((lambda: ww.plot.residuals(self.run_of_fault(), "left"),
                             "output 'left': expected one of sum"),
                            (lambda: ww.plot.residuals(self.run_of_fault(), 2), "output 2"),
                            (lambda: ww.plot.feasible_set(commissioned(), "r_mass", "r_mass"), "r_mass twice"),
                            (lambda: ww.plot.feasible_set(commissioned(), "mass"), "parameter 'mass'")):
            with self.assertRaisesRegex(ww.InvalidArgument, wrong):
                work()


if __name__ == "__main__":
    skip.main()
