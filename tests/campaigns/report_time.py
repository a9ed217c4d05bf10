#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How soon a report can be read, and how smoothly it pans: in headless Chromium, in real time.

    tests/campaigns/report_time.py result/report.html [runs]

Prints the size of the page and the medians over the runs of
opened   ms from the start of the navigation to the charts in the window drawn (at least one)
all      ms to every chart of the page drawn
pan      ms of script for a step while half the log is shown: every chart near the window is drawn again
"""

import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

PROBE = """<script>{const root = document.documentElement, poll = setInterval(() => {
  if (!root.dataset.ready) return;
  clearInterval(poll);
  const all = performance.now(), [begin, end] = charts.whole(), times = [];
  charts.all.slice(-1)[0].figure.scrollIntoView();
  const step = (k) => {
    const before = performance.now();
    charts.zoom(begin + (end - begin) * 0.01 * k, begin + (end - begin) * (0.5 + 0.01 * k));
    times.push(performance.now() - before);
    if (k < 40) return setTimeout(() => step(k + 1), 30);
    times.sort((a, b) => a - b);
    console.log("measured " + [root.dataset.opened, all, times[20]].map((x) => Number(x).toFixed(1)).join(" "));
  };
  setTimeout(() => step(0), 300);
}, 20);}</script></body>"""


def measure(page, directory):
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=1200,900",
               "--disable-background-networking", "--remote-debugging-port=0", "--enable-logging=stderr",
               f"--user-data-dir={directory}/profile", page.as_uri()]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as chromium:
        try:
            for line in chromium.stderr:
                if found := re.search(r'"measured ([\d.]+) ([\d.]+) ([\d.]+)"', line):
                    return [float(x) for x in found.groups()]
        finally:
            chromium.terminate()
    raise SystemExit("the page was not measured: has it a chart?")


def main():
    if len(sys.argv) not in (2, 3):
        raise SystemExit(__doc__)
    text = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    runs = int(sys.argv[2]) if len(sys.argv) == 3 else 3
    with tempfile.TemporaryDirectory() as directory:
        page = pathlib.Path(directory, "page.html")
        page.write_text(PROBE.join(text.rsplit("</body>", 1)), encoding="utf-8")
        rows = [measure(page, directory) for _ in range(runs)]
    opened, whole, pan = (statistics.median(column) for column in zip(*rows))
    print(f"{len(text.encode()) / 1e6:.1f} MB, opened {opened:.0f} ms, all {whole:.0f} ms, pan {pan:.1f} ms")


if __name__ == "__main__":
    main()
