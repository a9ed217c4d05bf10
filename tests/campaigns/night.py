#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a night on many cores costs: a simulation of `wheelwright fleet` as an array of shards.

    tests/campaigns/night.py [--robots N] [--cores N] [--seconds-a-robot S] [--shards-a-core N] ... [--table]

Every shard is a job of one core: it starts, reads the list, examines its robots one after the other, stores each
result, and ends. Cores have speeds of their own, some are slow; jobs die and begin again where they stopped; logs come
from one file system that all cores share. The scheduler gives a core that is free the next shard. When the last one is
done one process merges. Parameters are what was measured on the machine of docs/use/scale.md, or guesses that are named as
such there. Everything is drawn from --seed. --table prints the table of docs/use/scale.md.
"""

import argparse
import heapq
import random

PARAMETERS = {
    "robots": (1_000_000, "robots, one log each"),
    "cores": (1000, "cores"),
    "shards_a_core": (4, "shards for each core"),
    "seconds_a_robot": (0.75, "processor's seconds for a robot (a log of 120 s at 200 Hz with a pose)"),
    "spread": (0.2, "standard deviation of the logarithm of that, from robot to robot"),
    "megabytes_a_robot": (2.4, "read for a robot"),
    "store": (62e-6, "s, to store a result"),
    "start": (0.05, "s, to start the program"),
    "list": (3.5e-6, "s, to read a robot's line of the list; every shard reads all"),
    "schedule": (0.02, "s between two jobs that the scheduler starts"),
    "speed_spread": (0.08, "standard deviation of the logarithm of a core's speed"),
    "slow_share": (0.02, "share of cores that are slow"),
    "slow": (0.4, "speed of these"),
    "deaths": (2e-3, "jobs that die, for each hour of a core"),
    "again": (120.0, "s until a job that died begins again"),
    "disk": (10.0, "GB/s that the file system delivers to all together"),
    "opens": (20000.0, "files that it opens in a second"),
    "merge": (117e-6, "s for a robot, to merge and to judge the fleet"),
    "seed": (1, "seed"),
}


def simulate(p):
    """Seconds until all shards are done and until the merge is, core-hours used, deaths, waiting for logs."""
    draw = random.Random(p.seed)
    speed = [(p.slow if draw.random() < p.slow_share else 1.0) * draw.lognormvariate(0.0, p.speed_spread)
             for _ in range(p.cores)]
    shards = p.cores * p.shards_a_core
    each, more = divmod(p.robots, shards)
    # While all read, a core has its part of the file system; bytes and opens are two limits.
    at_once = min(p.cores, shards)
    fetch = max(p.megabytes_a_robot * 1e-3 / p.disk, 1.0 / p.opens) * at_once
    free = [(0.0, core) for core in range(p.cores)]
    heapq.heapify(free)
    busy = waited = 0.0
    deaths, last, alone = 0, 0.0, []
    for shard in range(shards):
        begin, core = heapq.heappop(free)
        begin = max(begin, shard * p.schedule)
        now = begin + p.start + p.list * p.robots / speed[core]
        for _ in range(each + (shard < more)):
            work = (p.seconds_a_robot * draw.lognormvariate(-0.5 * p.spread**2, p.spread) + p.store) / speed[core]
            took = max(work, fetch)  # the next log is read ahead by the system
            waited += took - work
            if draw.random() < 1.0 - pow(1.0 - p.deaths, took / 3600.0):
                deaths += 1
                now += draw.random() * took + p.again + p.start + p.list * p.robots / speed[core]
            now += took
        busy += now - begin
        last = max(last, now)
        alone.append(now - begin)
        heapq.heappush(free, (now, core))
    return {"shards": last, "merged": last + p.merge * p.robots, "core_hours": busy / 3600.0, "deaths": deaths,
            "waited": waited / busy, "idle": 1.0 - busy / (p.cores * last), "longest": max(alone)}


def row(p, words):
    r = simulate(p)
    return (f"| {words} | {r['shards'] / 60:.1f} min | {r['merged'] / 60:.1f} min | {r['core_hours']:.0f} h "
            f"| {100 * r['idle']:.0f} % | {100 * r['waited']:.0f} % | {r['deaths']} |")


def table(p):
    def but(**changed):
        return argparse.Namespace(**{**vars(p), **changed})
    print("| 10⁶ robots on 1,000 cores | shards done | merged | core-hours | cores idle | waiting | deaths |\n"
          "|---|---|---|---|---|---|---|")
    print(row(p, "as measured and guessed"))
    print(row(but(shards_a_core=1), "one shard a core"))
    print(row(but(shards_a_core=16), "16 shards a core"))
    print(row(but(slow_share=0.0, deaths=0.0), "no slow cores, no deaths"))
    print(row(but(deaths=0.1), "50 times the deaths"))
    print(row(but(disk=2.0), "a file system of 2 GB/s"))
    print(row(but(opens=500.0), "500 files opened in a second"))
    print(row(but(seconds_a_robot=0.05, megabytes_a_robot=0.24), "logs of 30 s at 100 Hz"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, (value, words) in PARAMETERS.items():
        parser.add_argument("--" + name.replace("_", "-"), type=type(value), default=value, help=f"{words} ({value:g})")
    parser.add_argument("--table", action="store_true")
    p = parser.parse_args()
    if p.table:
        table(p)
        return
    r = simulate(p)
    print(f"{p.robots} robots on {p.cores} cores: shards done after {r['shards'] / 60:.1f} min, merged after "
          f"{r['merged'] / 60:.1f} min; {r['core_hours']:.0f} core-hours, cores idle {100 * r['idle']:.0f} %, "
          f"waiting for logs {100 * r['waited']:.0f} %, {r['deaths']} deaths, "
          f"longest shard {r['longest'] / 60:.1f} min (seed {p.seed})")


if __name__ == "__main__":
    main()
