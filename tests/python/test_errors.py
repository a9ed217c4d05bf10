# SPDX-License-Identifier: Apache-2.0
"""How mistakes and interruptions look."""

import signal
import threading
import unittest

import numpy as np
import wheelwright as ww
from support import HEALTHY, commissioned, healthy_log, path, robot


class Errors(unittest.TestCase):
    def test_they_are_a_family(self):
        self.assertTrue(issubclass(ww.InputError, ww.Error))
        self.assertTrue(issubclass(ww.InvalidArgument, ww.Error))
        self.assertTrue(issubclass(ww.InputError, ValueError))
        self.assertTrue(issubclass(ww.InvalidArgument, ValueError))
        self.assertFalse(issubclass(ww.Error, ValueError))
        self.assertEqual(ww.InputError.__module__, "wheelwright")

    def test_files_name_the_place(self):
        path("robot.yaml").write_text("wheel_radius: 0.1\ntrack_widht: 0.4\n")
        with self.assertRaisesRegex(ww.InputError, r"robot\.yaml:2.*track_width"):
            ww.read_robot(path("robot.yaml"))
        with self.assertRaises(ww.InputError):
            ww.read_log(path("there_is_none.csv"))

    def test_keys_are_named(self):
        with self.assertRaisesRegex(ww.InputError, "wheel_radius"):
            ww.Robot(track_width=0.4)
        with self.assertRaisesRegex(ww.InputError, "whel_radius"):
            ww.Robot(whel_radius=0.1, track_width=0.4)

    def test_columns_that_are_no_numbers_are_named(self):
        t = np.arange(50) * 0.01
        for bad in (np.array(["a"] * 50), np.array([object()] * 50), t + 1j, ["x"] * 50, t.astype("datetime64[s]"),
                    np.zeros(50, dtype=[("a", "f8")])):
            with self.assertRaisesRegex(ww.InvalidArgument, "column omega_r of type .*: expected real numbers"):
                ww.Log({"t": t, "omega_r": bad})

    def test_times_of_numpy_are_seconds(self):
        ns = np.arange(50) * 10_000_000
        for at in (ns.astype("timedelta64[ns]"), np.datetime64("2026-11-30T12:00:00", "ns") + ns.astype("timedelta64[ns]")):
            log = ww.Log({"t": at, "omega_r": np.arange(50.0)})
            self.assertAlmostEqual(log.median_step, 0.01, places=6)
            self.assertEqual(log.segments, 1)

    def test_objects_without_a_value_are_not_made(self):
        classes = [c for c in vars(ww).values() if isinstance(c, type) and c.__module__.startswith("wheelwright")]
        bound = [c for c in classes if c.__base__.__name__ == "pybind11_object"]
        self.assertGreater(len(bound), 30)
        for c in bound:
            with self.assertRaises(TypeError):
                c.__new__(c)

    def test_shapes_are_named(self):
        with self.assertRaisesRegex(ww.InvalidArgument, r"omega_r of shape \(9\): expected shape \(10\)"):
            ww.Log({"t": np.arange(10), "omega_r": np.arange(9)})
        with self.assertRaisesRegex(ww.InvalidArgument, r"Y of shape \(3, 2\)"):
            ww.FeasibleSet(np.zeros((3, 2)), np.zeros(3), np.ones(3), np.array([[0, 1], [0, 1], [0, 1]]))
        with self.assertRaises(ww.InvalidArgument):
            ww.least_squares(np.full((30, 2), np.nan), np.zeros(30))

    def test_columns_that_lack_are_named(self):
        t = np.arange(100) * 0.01
        log = ww.Log({"t": t, "omega_r": t, "omega_l": t, "tau_r": t})
        with self.assertRaisesRegex(ww.InputError, "tau_l"):
            ww.commission(log, robot())

    def test_options_are_checked(self):
        with self.assertRaisesRegex(ww.InvalidArgument, "polygon"):
            ww.Detector(commissioned().model, set="polygon")
        with self.assertRaises(ww.InvalidArgument):
            ww.Detector(commissioned().model, persistence=(3, 2))
        with self.assertRaisesRegex(ww.InputError, "slop'.*slope"):
            ww.gap(healthy_log(), robot(), without=["slop"])

    def test_samples_are_checked(self):
        detector = ww.Detector(commissioned().model)
        with self.assertRaisesRegex(ww.InvalidArgument, "sample of shape"):
            detector.step(0.0, [1.0])

    def test_a_robot_survives_its_text(self):
        self.assertEqual(ww.Robot(**robot().to_dict()), robot())
        robot().save(path("again.yaml"))
        self.assertEqual(ww.read_robot(path("again.yaml")), robot())


class Progress(unittest.TestCase):
    def test_it_is_told_and_does_not_change_the_result(self):
        told = []
        result = ww.commission(healthy_log(), robot(), progress=lambda share, text: told.append((share, text)))
        self.assertEqual(result.to_dict(), commissioned().to_dict())
        shares = [share for share, _ in told]
        self.assertGreater(len(told), 3)
        self.assertEqual(shares, sorted(shares))
        self.assertTrue(all(0.0 <= share <= 1.0 for share in shares))
        self.assertTrue(all(isinstance(text, str) and text for _, text in told))

    def test_what_it_raises_ends_the_work(self):
        class Enough(Exception):
            pass

        def refuse(share, text):
            raise Enough(text)

        for work in (lambda: ww.commission(healthy_log(), robot(), progress=refuse),
                     lambda: ww.gap(healthy_log(), robot(), shrink=False, manoeuvre=False, threads=2, progress=refuse),
                     lambda: ww.margins(healthy_log(), commissioned().model, threads=2, progress=refuse),
                     lambda: ww.design(commissioned().model, speed=8.0, acceleration=20.0, threads=2,
                                       progress=refuse),
                     lambda: ww.identify(healthy_log(), robot(), shapes=False, progress=refuse),
                     lambda: ww.choose(healthy_log(), robot(), progress=refuse),
                     lambda: ww.fleet([HEALTHY], robot(), threads=2, progress=refuse)):
            with self.assertRaises(Enough):
                work()

    def test_a_signal_ends_the_work(self):
        def interrupt(share, text):
            signal.raise_signal(signal.SIGINT)

        with self.assertRaises(KeyboardInterrupt):
            ww.commission(healthy_log(), robot(), progress=interrupt)

    def test_a_signal_ends_work_that_tells_no_progress(self):
        # The handler finds the log in use: it was called while the work ran, not after it.
        class Stop(Exception):
            pass

        log = healthy_log()
        stopped = threading.Event()

        def handle(number, frame):
            try:
                log.to_arrays()
            except ww.InvalidArgument:
                stopped.set()
                raise Stop from None

        def send():
            while not stopped.wait(0.05):
                signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

        before = signal.signal(signal.SIGINT, handle)
        sender = threading.Thread(target=send)
        sender.start()
        try:
            with self.assertRaises(Stop):
                while not stopped.is_set():
                    ww.commission(log, robot())
        finally:
            stopped.set()
            sender.join()
            signal.signal(signal.SIGINT, before)
        self.assertEqual(log.to_arrays()["t"].size, log.rows)

    def test_a_log_serves_one_call_at_a_time(self):
        log = healthy_log()
        met = []

        def walk_again(share, text):
            try:
                log.to_arrays()
            except ww.InvalidArgument as error:
                met.append(str(error))

        ww.commission(log, robot(), progress=walk_again)
        self.assertIn("at the same time", met[0])
        with self.assertRaises(ww.InvalidArgument):
            ww.gap(log, robot(), baseline=log)
        self.assertEqual(log.to_arrays()["t"].size, log.rows)


class Threads(unittest.TestCase):
    def test_two_threads_get_what_one_gets(self):
        found = []

        def work():
            found.append(ww.commission(ww.read_log(HEALTHY, robot()), robot()).to_dict())

        threads = [threading.Thread(target=work) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [commissioned().to_dict()] * 2)

    def test_the_lock_is_released(self):
        # Another thread gets on while the work runs: it is seen between two words of progress.
        counted = []
        stop = threading.Event()

        def count():
            n = 0
            while not stop.is_set():
                n += 1
                counted.append(n)
                stop.wait(0.0005)

        thread = threading.Thread(target=count)
        marks = []
        thread.start()
        try:
            ww.commission(healthy_log(), robot(), progress=lambda share, text: marks.append(len(counted)))
        finally:
            stop.set()
            thread.join()
        self.assertGreater(marks[-1], marks[0] + 5)


if __name__ == "__main__":
    unittest.main()
