#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a stated risk buys on recordings: widths and smallest certain faults over those for every noise, as Markdown.

    risk_table.py WHEELWRIGHT [--within S] LOG ROBOT.yaml [LOG ROBOT.yaml ...]

Robot files that leave the noise to be estimated are given what `commission` estimates of each log (bound, bias and
deviation of efforts), as a data sheet would: both guarantees then stand on the same declared errors.
"""

import json
import re
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode > 1:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done


def declared(robot, errors):
    """The text of a robot file with these errors declared."""
    effort = errors["effort"]
    keys = ", ".join(f"{k}: {effort[k]:.6g}" for k in ("bound", "bias", "deviation", "correlation") if k in effort)
    if "effort: estimate" in robot:
        return robot.replace("effort: estimate", f"effort: {{{keys}}}")
    return re.sub(r"(?m)^noise:.*$", f"noise: {{effort: {{{keys}}}}}", robot)


def ratios(wheelwright, log, robot, within, folder):
    text = Path(robot).read_text(encoding="utf-8")
    out = folder / "learnt"
    run(wheelwright, "commission", log, "--robot", robot, "--out", out, "--quiet")
    model = json.loads((out / "model.json").read_text(encoding="utf-8"))
    if "at_risk" not in model or model["at_risk"] is None:
        why = [a["detail"] for a in model["assumptions"] if a["id"] == "noise_averages"]
        return None, None, "; ".join(why)
    if "estimate" in text:
        file = folder / "robot.yaml"
        file.write_text(declared(text, model["at_risk"]["errors"]), encoding="utf-8")
        out = folder / "declared"
        run(wheelwright, "commission", log, "--robot", file, "--out", out, "--quiet")
        model = json.loads((out / "model.json").read_text(encoding="utf-8"))
        if model.get("at_risk") is None:
            return None, None, "; ".join(a["detail"] for a in model["assumptions"] if a["id"] == "noise_averages")
    numbers = model["physical"] or {}
    widths = [(n["at_risk"][1] - n["at_risk"][0]) / (n["upper"] - n["lower"])
              for n in numbers.values() if "at_risk" in n and n["upper"] > n["lower"]]
    run(wheelwright, "margins", log, "--model", out / "model.json", "--out", out, "--quiet",
        *sum((["--window", str(w)] for w in within), []))
    margins = json.loads((out / "margins.json").read_text(encoding="utf-8"))
    return widths, margins, model["warrant"]


def half(fault, window):
    """Size that is certain from half of the onsets after which the window fits; infinite where there is none."""
    sizes = sorted(float("inf") if o["certain"][window] is None else o["certain"][window]
                   for o in fault["onsets"] if len(o["certain"]) > window)
    return sizes[len(sizes) // 2] if sizes else float("inf")


def faults(margins, within):
    """Ratios of what is certain at the risk to what is certain for every noise, by fault and side; and lone ones."""
    torque = next(r for r in margins["residuals"] if r["residual"] == "torque")
    every = {(f["fault"], f["side"]): f for f in torque["faults"]}
    window = margins["windows"].index(within)
    both, alone = [], Counter()
    for fault in margins["at_risk"]["faults"]:
        other = every.get((fault["fault"], fault["side"]))
        if fault["whole"] or other is None:
            continue
        sharp, blunt = half(fault, margins["at_risk"]["windows"].index(within)), half(other, window)
        if sharp < float("inf") and blunt < float("inf"):
            both.append(sharp / blunt)
        elif sharp < blunt:
            alone["at risk"] += 1
        elif blunt < sharp:
            alone["every noise"] += 1
    return both, alone


def main(arguments):
    within = [5.0, 20.0]
    if len(arguments) < 3 or len(arguments) % 2 == 0:
        sys.exit(__doc__)
    print("| log | widths | " + " | ".join(f"faults, {w:g} s | only at the risk, only for every noise" for w in within)
          + " |")
    print("|" + "---|" * (2 + 2 * len(within)))
    everything = []
    for log, robot in zip(arguments[1::2], arguments[2::2]):
        with tempfile.TemporaryDirectory() as folder:
            widths, margins, why = ratios(arguments[0], log, robot, within, Path(folder))
        name = Path(log).parent.name + "/" + Path(log).name
        if widths is None:
            print(f"| {name} | {why} |" + " |" * (2 * len(within)), flush=True)
            continue
        cells, row = [f"{statistics.median(widths):.2f}"], [statistics.median(widths)]
        for w in within:
            both, alone = faults(margins, w)
            row.append(statistics.median(both) if both else float("nan"))
            cells += [f"{row[-1]:.2f} ({len(both)})", f"{alone['at risk']}, {alone['every noise']}"]
        everything.append(row)
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    middle = [f"{statistics.median(column):.2f}" for column in zip(*everything)]
    print(f"| median | {middle[0]} | " + " | ".join(f"{m} |" for m in middle[1:]) + " |")


if __name__ == "__main__":
    main(sys.argv[1:])
