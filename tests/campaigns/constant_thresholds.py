#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""D2 beside D1 on random robots: whether constant thresholds keep their promise, and what either residual sees.

    PYTHONPATH=build/python tests/campaigns/constant_thresholds.py [--robots 20] [--seed 1] [--drives speed joystick]

ordinary_world.py makes the robots; nothing is shared with model/sim. A robot drives for 420 s, healthy; its model is
learnt from the first 120 s, what follows is watched. By kind of drive the first table (Markdown) has

    robots        with a model
    blocks        watched ones, as long as those of the model
    promised      share of blocks with a false alarm of D2 that the models promise at most, mean over robots
    seen          share that had one, mean over robots, with its standard error
    refuted       models whose own test says that their promise does not hold
    per hour      false alarms of D2 (instants outside no more than 0.5 s apart are one)
    D1            instants outside the thresholds of D1

The second table has faults at six onsets a robot, as steps, in sizes from 0.001 on in steps of the root of 2, up to 0.7:
a share of the effort lost, a bias of the effort (of its rms), an encoder that counts too much. An onset counts where the
healthy drive has no alarm of D2 within 5 s behind it.

    smallest      smallest size that is seen within 5 s, median over robots and onsets: by D1, by D2, their ratio
    delay         at twice the size that D1 sees, median, s: by D1, by D2

Ends with 1 where D1 has a false alarm, or where D2 has more than are promised by three standard errors; with 77 without
numpy.
"""

import argparse
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("no numpy")
    sys.exit(77)

import incidents
import ordinary_world as world
import wheelwright as ww

SECONDS, LEARNT, WITHIN, BEFORE, ONSETS, MERGE = 420.0, 120.0, 5.0, 8.0, 6, 0.5  # s
SIZES = 0.001 * np.sqrt(2.0)**np.arange(20)
FAULTS = {"effort_loss_left": "share of the effort lost", "effort_bias_right": "bias of the effort / rms",
          "encoder_scale_left": "encoder counts too much"}


def log_of(columns):
    return ww.Log({name: np.ascontiguousarray(values) for name, values in columns.items()})


def spoil(log, fault, size, onset):
    """The columns of a log with a step of this size."""
    columns, true, rows = dict(log.columns), log.true, log.rows
    late = true["t"] >= onset
    if fault == "effort_loss_left":
        columns["tau_l"] = columns["tau_l"] + (late * true["tau_l"] * (1 / (1 - size) - 1))[rows]
    elif fault == "effort_bias_right":
        columns["tau_r"] = columns["tau_r"] + (late * size * np.sqrt(np.mean(true["tau_r"]**2)))[rows]
    else:
        extra = np.cumsum(late * size * np.diff(true["phi_l"], prepend=true["phi_l"][0]))
        count = 2 * np.pi / log.counts
        columns["phi_l"] = np.floor((true["phi_l"] + extra)[rows] / count) * count
    return columns


def window(columns, onset):
    t = columns["t"]
    return {name: values[(t >= onset - BEFORE) & (t < onset + WITHIN)] for name, values in columns.items()}


def delays(model, columns, onset):
    """When D1 and D2 see something first behind the onset, s; infinite: not."""
    found = []
    for residual in ("d1", "d2"):
        run = ww.Detector(model, residual=residual).run(log_of(columns))
        late = run.t[(run.dead_zone > 0).any(axis=1) & (run.t >= onset)]
        found.append(late[0] - onset if len(late) else np.inf)
    return found


def false_alarms(model, columns, thresholds):
    """Blocks with a residual of D2 outside, blocks, events, instants of D1 outside."""
    log = log_of(columns)
    one = ww.Detector(model).run(log)
    two = ww.Detector(model, residual="d2").run(log)
    outside = (two.dead_zone > 0).any(axis=1)
    length = int(round(thresholds["block"] / np.median(np.diff(two.t))))
    blocks = len(outside) // length
    bad = outside[:blocks * length].reshape(blocks, length).any(axis=1)
    at = two.t[outside]
    return bad.sum(), blocks, int(np.sum(np.diff(at) > MERGE)) + bool(len(at)), int((one.dead_zone > 0).sum())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drives", nargs="+", default=["speed", "joystick"])
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.robots)
    bad, sizes = False, {fault: [] for fault in FAULTS}
    print("| drive | robots | blocks | promised | seen | refuted | per hour | D1 |\n|---|---|---|---|---|---|---|---|")
    for drive in options.drives:
        robots = [world.draw_robot(np.random.default_rng([seed, 5]), (50, 100), (SECONDS, SECONDS), drive, "at_samples")
                  for seed in seeds]
        promised, seen, refuted, blocks, events, outside = [], [], 0, 0, 0, 0
        for seed, robot, true in zip(seeds, robots, world.simulate(robots)):
            log = incidents.make_log(robot, true, seed, False, 0.0)
            learn = {name: values[log.columns["t"] < LEARNT] for name, values in log.columns.items()}
            with tempfile.TemporaryDirectory() as folder:
                world.write_robot(Path(folder) / "robot.yaml", log.file | {"wheel_directions": "checked"})
                done = ww.commission(log_of(learn), ww.read_robot(Path(folder) / "robot.yaml"))
            thresholds = done.to_dict().get("detector", {}).get("constant_thresholds")
            if done.status not in ("done", "partial") or not thresholds:
                continue
            model = done.model
            watched = {name: values[log.columns["t"] >= LEARNT] for name, values in log.columns.items()}
            alarms = false_alarms(model, watched, thresholds)
            promised.append(thresholds["false_alarms"])
            seen.append(alarms[0] / alarms[1])
            refuted += thresholds["refuted"]
            blocks, events, outside = blocks + alarms[1], events + alarms[2], outside + alarms[3]
            g = np.random.default_rng([seed, 9])
            for onset in np.sort(g.uniform(LEARNT + 20, SECONDS - 20, ONSETS)):
                if np.isfinite(delays(model, window(log.columns, onset), onset)[1]):
                    continue
                for fault in FAULTS:
                    table = [delays(model, window(spoil(log, fault, size, onset), onset), onset) for size in SIZES]
                    sizes[fault].append(table)
        many = len(seen)
        error = float(np.std(seen, ddof=1) / np.sqrt(many))
        bad = bad or outside > 0 or np.mean(seen) > np.mean(promised) + 3 * error
        hours = many * (SECONDS - LEARNT) / 3600
        print(f"| {drive} | {many} | {blocks} | {100 * np.mean(promised):.2f} % | {100 * np.mean(seen):.2f} ± "
              f"{100 * error:.2f} % | {refuted} | {events / hours:.1f} | {outside} |", flush=True)
    print("\n| fault | onsets | smallest, D1 | D2 | ratio | delay, D1 | D2 |\n|---|---|---|---|---|---|---|")
    for fault, words in FAULTS.items():
        table = np.array(sizes[fault])  # onsets, sizes, residuals
        at = np.where(np.isfinite(table).any(axis=1), np.argmax(np.isfinite(table), axis=1), len(SIZES))
        ladder = np.append(SIZES, np.inf)
        smallest = ladder[at]
        twice = np.minimum(at[:, 0] + 2, len(SIZES) - 1)
        delay = np.median(table[np.arange(len(table)), twice], axis=0)
        ratio = np.median(smallest[:, 0] / smallest[:, 1])
        one, two = np.median(smallest, axis=0)
        print(f"| {words} | {len(table)} | {one:.2g} | {two:.2g} | {ratio:.2g} | {delay[0]:.2f} | {delay[1]:.2f} |")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
