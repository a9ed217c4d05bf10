#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""systemd has nothing to say against the unit of examples/service. Nothing is started by it."""

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import skip

UNIT = Path(os.environ["WHEELWRIGHT_SOURCE_DIR"]) / "examples" / "service" / "wheelwright-follow@.service"


class Unit(unittest.TestCase):
    def test_systemd_has_nothing_to_say(self):
        skip.skip_unless(self, shutil.which("systemd-analyze"), "there is no systemd-analyze")
        with tempfile.TemporaryDirectory() as folder:
            placed = shutil.copy(UNIT, folder)
            done = subprocess.run(["systemd-analyze", "verify", placed], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    skip.main()
