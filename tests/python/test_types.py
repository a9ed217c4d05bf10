# SPDX-License-Identifier: Apache-2.0
"""The types of the package, as mypy sees them."""

import importlib.util
import unittest

import skip
from support import PACKAGE, SOURCE, path, python


class Types(unittest.TestCase):
    def mypy(self, *arguments):
        skip.skip_unless(self, importlib.util.find_spec("mypy"), "mypy is not installed")
        return python(*arguments, MYPYPATH=str(PACKAGE.parent), MYPY_CACHE_DIR=str(path("mypy")))

    def test_package_and_examples_are_strictly_typed(self):
        # matplotlib 3.6 and pandas 1.5 have no types.
        path("mypy.ini").write_text("[mypy]\nstrict = True\n[mypy-matplotlib.*,pandas.*]\nignore_missing_imports = True\n")
        done = self.mypy("-m", "mypy", "--config-file", path("mypy.ini"), "-p", "wheelwright")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for example in ("commission_a_bag.py", "morning.py"):
            done = self.mypy("-m", "mypy", "--config-file", path("mypy.ini"), SOURCE / "examples" / example)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_wrong_use_is_found(self):
        path("wrong.py").write_text("import wheelwright as ww\n"
                                    "log = ww.read_log('a.csv')\n"
                                    "ww.commission(log, 'robot.yaml')\n"
                                    "ww.Detector(ww.read_model('m.json'), set='polygon')\n")
        done = self.mypy("-m", "mypy", "--strict", path("wrong.py"))
        self.assertIn("wrong.py:3:", done.stdout)
        self.assertIn("wrong.py:4:", done.stdout)


if __name__ == "__main__":
    skip.main()
