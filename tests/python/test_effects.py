# SPDX-License-Identifier: Apache-2.0
"""An unmodelled effect that a user writes in Python."""

import functools
import gc
import unittest

import numpy as np
import wheelwright as ww

RADIUS = 0.0975
STIFFNESS = 3.0  # N/m

WORLD = ww.Robot(name="tethered", wheel_radius=RADIUS, track_width=0.381, encoder_counts_per_turn=16384,
                 nominal={"mass": 21.0, "yaw_inertia": 0.9, "viscous_linear": 4.0, "viscous_yaw": 4.0 * 0.1905**2})


def drive(seed):
    return ww.simulate({
        "robot": WORLD.to_dict(),
        "parameters": {"mass": 21.0, "yaw_inertia": 0.9, "viscous_linear": 4.0, "viscous_yaw": 4.0 * 0.1905**2},
        "trajectory": {"kind": "multi_sine", "speed": 0.8, "yaw_rate": 1.6, "period": 8},
        "sensors": {"sampling": "interval", "effort": 0.05, "position": 0.002, "heading": 0.003,
                    "encoder_counts_per_turn": 16384, "log": ["speeds", "pose"]},
        "duration": 40,
        "rate": 50,
    }, seed=seed)


@functools.lru_cache(maxsize=None)
def tethered_columns():
    """A spring pulls the robot back to where it started: in no catalogue."""
    columns = drive(8).to_arrays()
    along = np.cos(columns["theta"]) * columns["x"] + np.sin(columns["theta"]) * columns["y"]
    for wheel in ("tau_r", "tau_l"):
        columns[wheel] = columns[wheel] + 0.5 * RADIUS * STIFFNESS * along
    return columns


def tethered_log():
    return ww.Log(tethered_columns(), WORLD)


def along(d):
    return d.wheel_radius * (d.x * np.cos(d.heading) + d.y * np.sin(d.heading))


def tether(columns=lambda d, shape: [ww.Column([along(d)])], **options):
    return ww.Effect("tether", columns, [ww.EffectParameter("stiffness", "N/m", 1)], **options)


def diagnose(effects=(), **options):
    return ww.gap(tethered_log(), WORLD, baseline=drive(5008), effects=list(effects), shrink=False, manoeuvre=False,
                  **options)


class OwnEffects(unittest.TestCase):
    def test_the_catalogue_does_not_explain_a_tether(self):
        found = diagnose()
        self.assertEqual(found.verdict, "unexplained")

    def test_the_users_effect_does(self):
        one, two = diagnose([tether()]), diagnose([tether()], threads=2)
        self.assertEqual(one.verdict, "explained", one.summary)
        self.assertEqual([cause.effect for cause in one.causes], ["tether"])
        stiffness = one.causes[0].parameters["stiffness"]
        self.assertEqual(stiffness.unit, "N/m")
        self.assertLess(stiffness.lower, STIFFNESS)
        self.assertGreater(stiffness.upper, STIFFNESS)
        self.assertLess(stiffness.upper - stiffness.lower, 1.0)
        self.assertEqual(one.to_dict(), two.to_dict())
        self.assertEqual(one.to_dict()["causes"][0]["effect"], "tether")

    def test_shapes_are_searched(self):
        # The same spring, fastened somewhere else: its columns depend on where.
        def columns(d, shape):
            return [ww.Column([d.wheel_radius * ((d.x - shape[0]) * np.cos(d.heading) + d.y * np.sin(d.heading))])]

        found = diagnose([tether(columns, shapes=[ww.ShapeParameter("anchor_x", "m", -0.5, 0.5, scan=5)])])
        self.assertEqual([cause.effect for cause in found.causes], ["tether"])
        anchor = found.causes[0].parameters["anchor_x"]
        self.assertLessEqual(anchor.lower, 0.05)
        self.assertGreaterEqual(anchor.upper, -0.05)

    def test_an_effect_may_not_apply(self):
        found = diagnose([tether(applies=lambda d: None if d.rows < 10 else "the robot is not on a leash")])
        self.assertEqual(found.verdict, "unexplained")
        self.assertTrue(any("leash" in text for text in found.not_excited + found.notes), found.not_excited)

    def test_what_it_raises_is_raised(self):
        def broken(d, shape):
            raise RuntimeError("no idea")

        for threads in (1, 2):
            with self.assertRaisesRegex(RuntimeError, "no idea"):
                diagnose([tether(broken)], threads=threads)

    def test_what_it_returns_is_checked(self):
        with self.assertRaisesRegex(ww.InvalidArgument, r"tether, column 0, effort\[0\]"):
            diagnose([tether(lambda d, shape: [ww.Column([np.zeros(3)])])])
        with self.assertRaisesRegex(ww.InvalidArgument, "expected a sequence of Column"):
            diagnose([tether(lambda d, shape: [along(d)])])
        with self.assertRaisesRegex(ww.InvalidArgument, "2 columns.*one for each parameter, 1"):
            diagnose([tether(lambda d, shape: [ww.Column([along(d)])] * 2)])
        with self.assertRaisesRegex(ww.InvalidArgument, "each name once"):
            diagnose([tether(), tether()])

    def test_a_drive_is_good_for_its_call(self):
        kept = []

        def columns(d, shape):
            kept.append((d, d.joints[0], d.x))
            return [ww.Column([along(d)])]

        diagnose([tether(columns)])
        gc.collect()
        drive_kept, joint, x = kept[0]
        with self.assertRaisesRegex(ww.InvalidArgument, "during the call"):
            drive_kept.t
        with self.assertRaisesRegex(ww.InvalidArgument, "during the call"):
            joint.speed
        self.assertTrue(np.isfinite(x).all())

    def test_the_catalogue_can_be_read(self):
        effects = ww.effect_catalogue(WORLD)
        self.assertIn("coulomb", [effect.name for effect in effects])
        # An effect of several laws is there once for each.
        laws = [(effect.name, effect.sentence) for effect in effects]
        self.assertEqual(len(laws), len(set(laws)))


if __name__ == "__main__":
    unittest.main()
