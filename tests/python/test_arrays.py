# SPDX-License-Identifier: Apache-2.0
"""What numpy hands in and gets back: logs, rows, detectors."""

import itertools
import unittest

import numpy as np
import wheelwright as ww
from support import commissioned, different, fault_file, healthy_log, robot


class Logs(unittest.TestCase):
    def test_arrays_commission_as_their_file_does(self):
        columns = healthy_log().to_arrays()
        from_arrays = ww.commission(ww.Log(columns, robot()), robot()).to_dict()
        from_file = commissioned().to_dict()
        for result in (from_arrays, from_file):
            del result["data"]["files"]
        self.assertIsNone(different(from_arrays, from_file))

    def test_contiguous_columns_are_read_where_they_lie(self):
        t = np.arange(50) * 0.01
        omega = np.zeros(50)
        log = ww.Log({"t": t, "omega_r": omega})
        omega[7] = 3.0
        self.assertEqual(log.to_arrays()["omega_r"][7], 3.0)

    def test_other_columns_are_converted(self):
        t = np.arange(50)
        wide = np.arange(100, dtype=np.float32).reshape(50, 2)
        log = ww.Log({"t": t, "omega_r": wide[:, 1], "omega_l": list(range(50))})
        np.testing.assert_array_equal(log.to_arrays()["omega_r"], wide[:, 1])
        np.testing.assert_array_equal(log.to_arrays()["omega_l"], np.arange(50.0))

    def test_rows_are_cleaned_as_those_of_a_file(self):
        t = np.concatenate([np.arange(40), np.arange(60, 100)]) * 0.01
        theta = np.mod(np.linspace(0.0, 9.0, 80) + np.pi, 2.0 * np.pi) - np.pi
        omega = np.ones(80)
        omega[5] = np.nan
        log = ww.Log({"time": t, "theta": theta, "omega_r": omega})
        self.assertEqual(log.rows, 79)
        self.assertEqual(log.segments, 2)
        self.assertEqual(log.segment_starts().tolist(), [0, 39])
        self.assertTrue(any("row 5" in note for note in log.notes), log.notes)
        self.assertLess(np.abs(np.diff(log.to_arrays()["theta"][:39])).max(), np.pi)

    def test_names_may_be_mapped(self):
        t = np.arange(30) * 0.1
        log = ww.Log({"stamp": t, "wheel_2": t + 1, "other": t}, map={"t": "stamp", "omega_r": "wheel_2"},
                     extra=["other"])
        self.assertEqual(sorted(log.columns), ["omega_r", "other"])

    def test_arrays_outlive_their_names(self):
        log = ww.Log({"t": np.arange(1000) * 0.01, "omega_r": np.full(1000, 2.0)})
        junk = [np.random.default_rng(0).random(1000) for _ in range(50)]
        self.assertEqual(len(junk), 50)
        self.assertTrue((log.to_arrays()["omega_r"] == 2.0).all())


class Rows(unittest.TestCase):
    def test_filtered_rows_carry_the_model(self):
        model = commissioned().model
        rows = ww.filter_log(healthy_log(), robot(), model)
        instants, outputs, parameters = rows.Y.shape
        self.assertEqual((outputs, parameters), (len(model.outputs), len(model.parameters)))
        self.assertEqual(rows.y.shape, (instants, outputs))
        run = ww.Detector(model).run(healthy_log())
        residual = rows.y - np.einsum("kij,j->ki", rows.Y, model.estimate)
        np.testing.assert_array_equal(rows.row, run.row)
        np.testing.assert_allclose(residual, run.residual, rtol=0, atol=1e-12 * np.abs(rows.y).max())

    def test_first_order_filter_is_the_papers(self):
        # f(t) = alpha exp(-beta t) on linear pieces: its step response against the convolution in closed form.
        beta, h, count = 5.0, 0.01, 400
        t = np.arange(count) * h
        speed = 2.0 * t  # a wheel that speeds up evenly, both alike: v1 = r omega, its derivative is r 2
        radius = robot().to_dict()["wheel_radius"]
        r = ww.Robot(wheel_radius=radius, track_width=0.4, filter={"order": 1, "alpha": beta, "beta": beta},
                     effort={"kind": "torque", "hold": "first_order"}, speed_source="measured",
                     noise={"wheel_speed": 0.0, "effort": 0.0})
        log = ww.Log({"t": t, "omega_r": speed, "omega_l": speed, "tau_r": np.ones(count), "tau_l": np.ones(count)})
        rows = ww.filter_log(log, r)
        self.assertEqual(rows.parameters[0], "r_mass")
        # f * v1' = 2 r (1 - exp(-beta t)) and f * tau = 2 (1 - exp(-beta t)), from rest at t = 0.
        expected = 1.0 - np.exp(-beta * rows.t)
        np.testing.assert_allclose(rows.Y[:, 0, 0], 2.0 * radius * expected, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(rows.y[:, 0], 2.0 * expected, rtol=1e-12, atol=1e-14)

    def test_least_squares_solves_the_normal_equations(self):
        random = np.random.default_rng(1)
        Y = random.normal(size=(9000, 4)) * [1.0, 10.0, 0.1, 3.0]
        y = Y @ [1.0, -2.0, 3.0, 0.5] + random.normal(size=9000)
        fit = ww.least_squares(Y, y)
        np.testing.assert_allclose(fit.estimate, np.linalg.solve(Y.T @ Y, Y.T @ y), rtol=1e-9)
        np.testing.assert_allclose(fit.inverse_gram, np.linalg.inv(Y.T @ Y), rtol=1e-9, atol=1e-12)
        self.assertAlmostEqual(fit.rss / np.sum((y - Y @ fit.estimate) ** 2), 1.0, places=9)
        self.assertEqual(fit.rank, 4)


class Detecting(unittest.TestCase):
    def test_steps_are_the_run(self):
        model = commissioned().model
        log = ww.read_log(fault_file(), robot())
        run = ww.Detector(model).run(log)
        columns = log.to_arrays()
        detector = ww.Detector(model)
        sample = np.column_stack([columns[name] for name in detector.columns])
        starts = set(log.segment_starts().tolist())
        seen = 0
        for k, t in enumerate(columns["t"]):
            if k in starts:
                detector.restart()
            decision = detector.step(t, sample[k])
            if decision is None:
                continue
            self.assertEqual(run.row[seen], k)
            np.testing.assert_array_equal(decision.residual, run.residual[seen])
            np.testing.assert_array_equal(decision.lower, run.lower[seen])
            np.testing.assert_array_equal(decision.upper, run.upper[seen])
            np.testing.assert_array_equal(decision.outside, run.outside[seen])
            seen += 1
        self.assertEqual(seen, len(run))

    def test_run_is_consistent(self):
        run = ww.Detector(commissioned().model).run(ww.read_log(fault_file(), robot()))
        outside = (run.residual < run.lower) | (run.residual > run.upper)
        np.testing.assert_array_equal(outside, run.outside)
        self.assertTrue(run.fault)
        first = run.events[0]
        channel = run.outputs.index(first.output)
        self.assertEqual(run.t[np.flatnonzero(run.outside[:, channel])[0]], first.start)
        self.assertGreater(first.start, 15.0)  # the fault's onset
        found = ww.detect(ww.read_log(fault_file(), robot()), commissioned().model)
        self.assertEqual([(e.start, e.alarm, e.output) for e in run.events],
                         [(e.start, e.alarm, e.output) for e in found.events])

    def test_dead_zones_are_the_residuals_outside(self):
        log, model = ww.read_log(fault_file(), robot()), commissioned().model
        constant = commissioned().to_dict()["detector"]["constant_thresholds"]["outputs"]
        mu = np.array([output["value"] for output in constant])
        d1 = ww.Detector(model).run(log)
        d2 = ww.Detector(model, residual="d2").run(log)
        size = np.abs(d1.residual)
        outside = (d1.residual < d1.lower) | (d1.residual > d1.upper)
        np.testing.assert_array_equal(d1.dead_zone, np.where(outside, size, 0.0))
        np.testing.assert_array_equal(d2.residual, d1.residual)
        np.testing.assert_array_equal(d2.dead_zone, np.where(size > mu, size, 0.0))
        self.assertGreater((d2.dead_zone > 0).sum(), (d1.dead_zone > 0).sum())
        with self.assertRaises(ww.InvalidArgument):
            ww.Detector(model, residual="d3")

    def test_no_theta_of_the_set_leaves_the_threshold(self):
        # The threshold bounds the residual for every theta of the set (34), and some theta attains it.
        model = commissioned().model
        rows = ww.filter_log(healthy_log(), robot(), model)
        found = model.feasible_set
        rule = ww.bounds.ThresholdRule(found, model.estimate)
        inside = found.centre + (1.0 - 1e-6) * (found.vertices - found.centre)
        self.assertTrue(found.contains(inside).all())
        for output in range(len(model.outputs)):
            Y = np.ascontiguousarray(rows.Y[::37, output])
            lower, upper = rule.at(Y)
            possible = Y @ (inside - model.estimate).T
            self.assertTrue((possible.max(axis=1) <= upper).all())
            self.assertTrue((possible.min(axis=1) >= lower).all())
            loose = (upper - possible.max(axis=1)) + (possible.min(axis=1) - lower)
            self.assertTrue((loose <= 1e-5 * (upper - lower)).all())

    def test_views_are_read_only_and_keep_their_result(self):
        view = ww.Detector(commissioned().model).run(healthy_log()).residual
        self.assertFalse(view.flags.writeable)
        self.assertFalse(view.flags.owndata)
        self.assertTrue(np.isfinite(view).all())
        with self.assertRaises(ValueError):
            commissioned().lower[0] = 0.0


class Sets(unittest.TestCase):
    """Against a brute-force enumeration of vertices, on problems of two and three parameters."""

    def setUp(self):
        random = np.random.default_rng(7)
        self.problems = []
        for p in (2, 3):
            theta = random.uniform(-2.0, 2.0, p)
            Y = random.normal(size=(12, p))
            noise = random.uniform(-0.3, 0.3, 12)
            y = Y @ theta + noise
            prior = np.column_stack([np.full(p, -10.0), np.full(p, 10.0)])
            self.problems.append((theta, Y, y - 0.3, y + 0.3, prior))

    @staticmethod
    def vertices(Y, lower, upper, prior):
        p = Y.shape[1]
        A = np.vstack([Y, -Y, np.eye(p), -np.eye(p)])
        b = np.concatenate([upper, -lower, prior[:, 1], -prior[:, 0]])
        found = []
        for rows in itertools.combinations(range(len(b)), p):
            square = A[list(rows)]
            if abs(np.linalg.det(square)) > 1e-9:
                x = np.linalg.solve(square, b[list(rows)])
                if (A @ x <= b + 1e-9).all():
                    found.append(x)
        return np.array(found)

    def test_hull_encloses_the_vertices_tightly(self):
        for theta, Y, lower, upper, prior in self.problems:
            points = self.vertices(Y, lower, upper, prior)
            for order in ("C", "F"):
                hull = ww.bounds.interval_hull(np.asarray(Y, order=order), lower, upper, prior)
                self.assertFalse(hull.empty)
                np.testing.assert_allclose(hull.hull[:, 0], points.min(axis=0), atol=1e-8)
                np.testing.assert_allclose(hull.hull[:, 1], points.max(axis=0), atol=1e-8)

    def test_set_is_what_the_rows_say(self):
        for theta, Y, lower, upper, prior in self.problems:
            points = self.vertices(Y, lower, upper, prior)
            found = ww.FeasibleSet(Y, lower, upper, prior)
            self.assertTrue(found.contains(theta))
            for direction in np.random.default_rng(3).normal(size=(20, len(theta))):
                exact = (points @ direction).max()
                self.assertGreaterEqual(found.support(direction), exact - 1e-9)
                self.assertAlmostEqual(found.support(direction), exact, places=7)
            for x in points:
                distance = np.linalg.norm(found.vertices - x, axis=1).min()
                self.assertLess(distance, 1e-7)
            centre = found.centre
            self.assertTrue((found.A @ centre <= found.b).all())

    def test_proofs_prove(self):
        # lower_j >= the certified value: e_j = sum of multipliers times rows, up to what the box gives.
        for _, Y, lower, upper, prior in self.problems:
            found = ww.FeasibleSet(Y, lower, upper, prior)
            for j, proof in enumerate(found.upper_proofs):
                a = -np.eye(len(prior))[j]
                bound = 0.0
                for row in proof:
                    sign = 1.0 if row["side"] == "upper" else -1.0
                    if row["row"] is None:
                        normal = np.eye(len(prior))[row["parameter"]]
                        side = prior[row["parameter"], 1 if sign > 0 else 0]
                    else:
                        normal = Y[row["row"]]
                        side = upper[row["row"]] if sign > 0 else lower[row["row"]]
                    a += sign * row["multiplier"] * normal
                    bound += sign * row["multiplier"] * side
                self.assertLess(np.abs(a).max(), 1e-9)
                self.assertAlmostEqual(bound, found.hull[j, 1], places=8)

    def test_contradiction(self):
        Y = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        found = ww.FeasibleSet(Y, np.array([0.0, 2.0, 0.0]), np.array([1.0, 3.0, 1.0]), np.array([[-5, 5], [-5, 5]]))
        self.assertTrue(found.empty)
        self.assertEqual({row["row"] for row in found.contradiction}, {0, 1})
        with self.assertRaises(ww.InvalidArgument):
            found.vertices
        self.assertTrue(ww.bounds.interval_hull(Y, np.array([0.0, 2.0, 0.0]), np.array([1.0, 3.0, 1.0]),
                                                np.array([[-5, 5], [-5, 5]])).empty)

    def test_minimax_fit_is_the_smallest_bound(self):
        # In one parameter, y = theta + e: half the range.
        y = np.array([0.3, -1.0, 2.0, 0.5])
        fit = ww.bounds.minimax_fit(np.ones((4, 1)), y, np.array([[-9.0, 9.0]]))
        self.assertLessEqual(fit.lower, 1.5)
        self.assertGreaterEqual(fit.upper, 1.5)
        self.assertAlmostEqual(fit.upper, 1.5, places=8)
        self.assertAlmostEqual(fit.theta[0], 0.5, places=8)


if __name__ == "__main__":
    unittest.main()
