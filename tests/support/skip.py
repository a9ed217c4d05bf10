# SPDX-License-Identifier: Apache-2.0
"""Skipping of tests whose requirements are missing, as tests/support/skip.hpp does it for those in C++. Nothing else in
tests/ skips a test in Python."""

import os
import sys
import unittest


def skip_unless(test, there, why):
    """Ends `test` where `there` is false: skipped, and failed where the environment variable WHEELWRIGHT_NO_SKIPS is 1
    (.ci/run sets it, and installs all that tests need)."""
    if there:
        return
    if os.environ.get("WHEELWRIGHT_NO_SKIPS") == "1":
        test.fail(f"{why} (WHEELWRIGHT_NO_SKIPS=1)")
    test.skipTest(why)


def skip_without_recordings(there, why):
    """The same for what does not ship with the project: skipped where `there` is false, in CI as well. For setUpClass
    too."""
    if not there:
        raise unittest.SkipTest(why)


def main(argv=None):
    """Runs the tests of the file that calls it, then ends with 1 where one failed, and else with 77, which ctest calls
    skipped, where one was skipped. Each reason is printed."""
    result = unittest.main(argv=argv, exit=False).result
    for why in sorted({why for _, why in result.skipped}):
        print(f"skipped: {why}")
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)
