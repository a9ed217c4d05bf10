#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The picture of the README: a residual between its thresholds, and the fault that takes it out of them.

    readme_picture.py PROGRAM [SVG]     commissions the shipped log with PROGRAM, simulates
                                        examples/scenarios/fault.yaml, detects with --series, and draws the difference
                                        channel into SVG (docs/residual.svg)
"""

import csv
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CHANNEL = "difference"
UNIT = "N·m²"
SHOWN = (20.0, 50.0)  # s
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 330, 62, 14, 46, 44
LINES = 800  # columns of pixels: of the samples in each, the smallest and the largest are drawn


def measured(program):
    """Rows of the series, the events, and when the fault sets in."""
    scenario = ROOT / "examples/scenarios/fault.yaml"
    with tempfile.TemporaryDirectory() as folder:
        def run(*words, allowed=(0,)):
            done = subprocess.run([program, *map(str, words), "--quiet"], cwd=folder, capture_output=True, text=True,
                                  check=False)
            if done.returncode not in allowed:
                sys.exit(f"readme_picture: {' '.join(map(str, words))}: {done.stderr}")

        run("commission", ROOT / "examples/healthy.csv.gz", "--robot", ROOT / "examples/robot.yaml", "--out", "model")
        run("simulate", scenario, "--out", "fault.csv")
        run("detect", "fault.csv", "--model", "model/model.json", "--out", "found", "--series", "series.csv",
            allowed=(1,))
        with open(Path(folder) / "series.csv", encoding="utf-8", newline="") as file:
            series = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        detection = json.loads((Path(folder) / "found/detection.json").read_text(encoding="utf-8"))
    onset = float(re.search(r"onset: ([\d.]+)", scenario.read_text(encoding="utf-8")).group(1))
    return series, [event for event in detection["events"] if event["output"] == CHANNEL], onset


def columns(rows, key):
    """(t, smallest, largest) of `key`, column of pixels by column."""
    cells = {}
    for row in rows:
        cells.setdefault(int((row["t"] - SHOWN[0]) / (SHOWN[1] - SHOWN[0]) * LINES), []).append((row["t"], row[key]))
    return [(sum(t for t, _ in cell) / len(cell), min(y for _, y in cell), max(y for _, y in cell))
            for _, cell in sorted(cells.items())]


def svg(series, events, onset):
    rows = [row for row in series if SHOWN[0] <= row["t"] <= SHOWN[1]]
    keys = [f"{name}_{CHANNEL}" for name in ("residual", "lower", "upper")]
    largest = 1.05 * max(abs(row[key]) for row in rows for key in keys)

    def x(t):
        return LEFT + (t - SHOWN[0]) / (SHOWN[1] - SHOWN[0]) * (WIDTH - LEFT - RIGHT)

    def y(value):
        return TOP + (1 - value / largest) / 2 * (HEIGHT - TOP - BOTTOM)

    def path(points):
        return "M" + " ".join(f"{x(t):.1f},{y(value):.1f}" for t, value in points)

    residual, lower, upper = (columns(rows, key) for key in keys)
    both_ends = [(t, value) for t, low, high in residual for value in (low, high)]
    band = path([(t, high) for t, _, high in upper] + [(t, low) for t, low, _ in reversed(lower)]) + "Z"
    alarm = events[0]["alarm"]
    bottom = HEIGHT - BOTTOM
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
           'font-family="sans-serif" font-size="13" fill="#222">',
           "<title>Residual of the difference channel, its thresholds, and a wheel that loses radius</title>",
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for event in events:
        begin, end = max(event["start"], SHOWN[0]), min(event["end"], SHOWN[1])
        if begin < end:
            out.append(f'<rect x="{x(begin):.1f}" y="{TOP}" width="{x(end) - x(begin):.1f}" '
                       f'height="{bottom - TOP}" fill="#fde4df"/>')
    out += [f'<path d="{band}" fill="#cfe3f5" stroke="#4a86bd" stroke-width="0.8"/>',
            f'<path d="{path(both_ends)}" fill="none" stroke="#b3261e" stroke-width="1.3" stroke-linejoin="round"/>']
    step = 0.05
    for tick in range(-int(largest / step), int(largest / step) + 1):
        at = y(tick * step)
        label = f"{tick * step:.2f}".replace("-", "−")
        out.append(f'<path d="M{LEFT - 4},{at:.1f}h4" stroke="#222"/>'
                   f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{label}</text>')
    for t in range(int(SHOWN[0]), int(SHOWN[1]) + 1, 5):
        out.append(f'<path d="M{x(t):.1f},{bottom}v4" stroke="#222"/>'
                   f'<text x="{x(t):.1f}" y="{bottom + 18}" text-anchor="middle">{t}</text>')
    out += [f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{bottom - TOP}" '
            'fill="none" stroke="#222"/>',
            f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 8}" text-anchor="middle">time, s</text>',
            f'<text transform="translate(14 {(TOP + bottom) / 2:.0f}) rotate(-90)" '
            f'text-anchor="middle">residual, {UNIT}</text>',
            f'<path d="M{x(onset):.1f},{TOP}V{bottom}M{x(alarm):.1f},{TOP}V{bottom}" '
            'stroke="#222" stroke-dasharray="4 3"/>',
            f'<text x="{x(onset) - 5:.1f}" y="{TOP + 16}" text-anchor="end">fault sets in, {onset:g} s</text>',
            f'<text x="{x(alarm) + 5:.1f}" y="{bottom - 8}">first alarm, {alarm:.2f} s</text>']
    at = LEFT
    for look, text, room in (('stroke="#b3261e" stroke-width="2"', "residual", 90),
                             ('stroke="#cfe3f5" stroke-width="12"',
                              "thresholds [l(t), u(t)]: no healthy robot leaves them", 390),
                             ('stroke="#fde4df" stroke-width="12"', "fault event", 0)):
        out.append(f'<path d="M{at},24h26" {look}/><text x="{at + 32}" y="28">{text}</text>')
        at += room + 32
    return "\n".join(out) + "\n</svg>\n"


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    target = Path(sys.argv[2]) if len(sys.argv) == 3 else ROOT / "docs/residual.svg"
    target.write_text(svg(*measured(str(Path(sys.argv[1]).resolve()))), encoding="utf-8")
    print(f"readme_picture: wrote {target}, {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
