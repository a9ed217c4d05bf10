#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which tests were skipped, and what was missing.

    skipped.py TESTS.XML      from what `ctest --output-junit TESTS.XML` wrote; nothing is said where no test was skipped, or
                              where there is no such file
    skipped.py --self-test"""

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def reason(output):
    """What a skipped test said: GoogleTest's line after "Skipped", else what follows "skipped:", else its last line."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    after = [b for a, b in zip(lines, lines[1:]) if a.endswith(": Skipped")]
    told = [line.removeprefix("skipped: ") for line in lines if line.startswith("skipped: ")]
    return "; ".join(after or told or lines[-1:]) or "it does not say why"


def skipped(text):
    """reason -> names of the tests, from the text of the file. A name's parameter is left out."""
    out = {}
    for case in ElementTree.fromstring(text).iter("testcase"):
        if case.find("skipped") is not None:
            out.setdefault(reason(case.findtext("system-out") or ""), []).append(re.sub(r"/\d+.*", "", case.get("name")))
    return out


def lines(found):
    for why, names in found.items():
        yield f"skipped, {why}: {', '.join(dict.fromkeys(names))}"


def self_test():
    case = '<testcase name="{}" status="notrun"><skipped message="x"/><system-out>{}</system-out></testcase>'
    text = "<testsuite>{}</testsuite>".format(
        case.format("A.b/0", "[ RUN ] A.b\n/tests/support/skip.hpp:34: Skipped\nthere is no zsh\n\n[  SKIPPED ] A.b (0 ms)\n")
        + case.format("A.b/1", "/tests/support/skip.hpp:34: Skipped\nthere is no zsh\n")
        + case.format("python.c", "..s\nOK (skipped=1)\nskipped: mypy is not installed\n")
        + case.format("example.d", "This example wants Dask.\n") + case.format("e", "")
        + '<testcase name="f" status="run"><system-out>: Skipped\nnever</system-out></testcase>')
    found = list(lines(skipped(text)))
    assert found == ["skipped, there is no zsh: A.b", "skipped, mypy is not installed: python.c",
                     "skipped, This example wants Dask.: example.d", "skipped, it does not say why: e"], found
    print("skipped: self-test passed")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    file = Path(sys.argv[1])
    if file.exists():
        for line in lines(skipped(file.read_text(encoding="utf-8", errors="replace"))):
            print(line)


if __name__ == "__main__":
    main()
