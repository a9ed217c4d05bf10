#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scores what `wheelwright gap` said of cases with withheld effects, as Markdown.

    score_withheld.py [--naive|--removed|--profiles] ANSWERS.json RESULTS    RESULTS has CASE/gap.json (or CASE.json)
    score_withheld.py --even|--odd ANSWERS.json RESULTS                      --profiles of cases with such numbers

With --naive what is scored is the answer of the naive rule (`wheelwright gap --naive`), not the diagnosis. With
--removed the hidden effect was not in the tool's catalogue: whatever is said to explain the log is wrong. --profiles is
one table with a column for each kind of case (what stands before the _ of its name), and exact names: lag and delay
count as two.
"""

import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

# Effects that count as one cause.
FAMILIES = [
    {"coulomb", "rolling_resistance", "bearing_friction"},
    {"actuator_lag", "delay", "sensor_time_offset"},
    {"wheel_radius_asymmetric", "encoder_scale"},
]
# What the nominal parameters can take up: names for the verdict of a parametric cause.
PARAMETRIC = {"payload", "armature", "viscous", "torque_gain", "wheel_radius", "track_width", "encoder_scale"}


def family(effect):
    for index, members in enumerate(FAMILIES):
        if effect in members:
            return f"family{index}"
    return effect


def families(effects):
    return frozenset(family(e) for e in effects)


def load(results, case):
    for path in (results / case / "gap.json", results / f"{case}.json"):
        if path.is_file():
            try:
                return json.loads(path.read_text(encoding="utf-8"))
            except json.JSONDecodeError:
                return None
    return None


def said(gap):
    """Effects of the verdict."""
    return [cause["effect"] for cause in gap.get("causes", [])]


def credible(gap):
    """Sets of effects that the tool keeps: its credible set, or its causes where it gives none."""
    sets = [member["effects"] for member in gap.get("credible_set", [])]
    return sets or ([said(gap)] if said(gap) else [])


def naive_answer(gap):
    """The naive rule's answer in the shape of a diagnosis: it knows no alternatives and no floor."""
    effects = gap["naive"]["effects"]
    return {"verdict": "explained" if effects else "no_gap",
            "causes": [{"effect": effect, "parameters": {}} for effect in effects]}


class Count:
    def __init__(self):
        self.good = 0
        self.all = 0

    def add(self, good):
        self.good += bool(good)
        self.all += 1

    def __str__(self):
        if self.all == 0:
            return "–"
        return f"{self.good} of {self.all} ({100.0 * self.good / self.all:.0f} %)"


def median(values):
    ordered = sorted(values)
    if not ordered:
        return None
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])


def class_of(answer):
    names = [e["effect"] for e in answer["effects"]]
    if not names:
        return "none"
    if not answer.get("in_catalogue", True):
        return "outside"
    if len(names) > 1:
        return "pair" if len(names) == 2 else "triple"
    return "parametric" if names[0] in PARAMETRIC else "single"


def numbers(answer):
    """True physical parameters by (effect, name)."""
    return {(e["effect"], name): value for e in answer["effects"] for name, value in e.get("parameters", {}).items()}


def figures_of(gap, kind):
    """Figures of one kind with numbers in them, by channel."""
    return {name: f for name, f in gap.get("shrink", {}).get(kind, {}).items()
            if f.get("after") is not None and f.get("before") is not None}


class Laws:
    """What was said of single effects, by effect and law."""

    def __init__(self):
        self.of = defaultdict(Counter)

    def add(self, answer, inside, right, verdict, causes):
        effect = answer["effects"][0]
        count = self.of[effect["effect"], effect.get("law", "given")]
        count["cases"] += 1
        count["in the answer"] += inside
        count["single and right"] += right
        count["beside others"] += not inside and family(effect["effect"]) in families(causes)
        count["no_gap"] += verdict == "no_gap"
        count["one wrong cause"] += verdict == "explained" and len(causes) == 1 and not right
        count["unexplained"] += verdict == "unexplained"

    def __bool__(self):
        return any(law != "given" for _, law in self.of)

    COLUMNS = ["cases", "in the answer", "single and right", "beside others", "no_gap", "one wrong cause",
               "unexplained"]

    def report(self, out):
        print("\n| effect | law | " + " | ".join(self.COLUMNS) + " |\n|" + "---|" * (2 + len(self.COLUMNS)), file=out)
        total = Counter()
        several = Counter()
        for (effect, law), count in sorted(self.of.items()):
            print(f"| {effect} | {law} | " + " | ".join(str(count[c]) for c in self.COLUMNS) + " |", file=out)
            total.update(count)
            if law != "given":
                several.update(count)
        for name, count in (("all", total), ("of several laws", several)):
            print(f"| {name} | | " + " | ".join(str(count[c]) for c in self.COLUMNS) + " |", file=out)


class Promise:
    """What was promised of the shrinking, and what came of it."""

    def __init__(self):
        self.fresh = []
        self.after = []
        self.fault = []
        self.fell = []

    def add(self, gap):
        fresh = figures_of(gap, "fresh_torque_rms")
        for name, held_out in figures_of(gap, "torque_rms").items():
            if name in fresh and held_out["after"] > 0.0:
                self.fresh.append(fresh[name]["after"] / held_out["after"])
            if (held_out.get("floor") or 0.0) > 0.0:
                self.after.append(held_out["after"] / held_out["floor"])
        for fault in figures_of(gap, "smallest_fault").values():
            if (fault.get("floor") or 0.0) > 0.0:
                self.fault.append(fault["after"] / fault["floor"])
            if fault["before"] > 0.0:
                self.fell.append(fault["after"] / fault["before"])

    def rows(self):
        def near(values, limit):
            return sum(abs(value - 1.0) <= limit for value in values)

        def line(values):
            return f"{median(values):.3g}" if values else "–"

        fresh = Count()
        fresh.good, fresh.all = near(self.fresh, 0.1), len(self.fresh)
        yield "fresh log: torque residual within 10 % of what was promised (channels)", str(fresh)
        yield "fresh log: torque residual over what was promised, median", line(self.fresh)
        yield "held-out torque residual with the causes over the floor, median", line(self.after)
        yield "smallest certain radius fault with the causes over that of the healthy robot, median", line(self.fault)
        yield "smallest certain radius fault with the causes over that without, median", line(self.fell)


def report_removed(answers, results, out=sys.stdout):
    """The hidden effect was taken from the tool's catalogue."""
    said_of = defaultdict(Counter)
    unexplained, wrong = Count(), Count()
    for case, answer in sorted(answers.items()):
        if class_of(answer) not in ("single", "parametric"):
            continue
        gap = load(results, case)
        verdict = gap.get("verdict", "") if gap else "no result"
        unexplained.add(verdict == "unexplained")
        wrong.add(verdict == "explained" and len(said(gap)) == 1)
        said_of[answer["effects"][0]["effect"]][
            verdict if verdict in ("unexplained", "no_gap", "no result")
            else " + ".join(sorted(said(gap))) + (" (ambiguous)" if verdict == "ambiguous" else "")] += 1
    print(f"| measure | cases |\n|---|---|\n| removed from the catalogue: unexplained | {unexplained} |", file=out)
    print(f"| removed from the catalogue: explained by one other cause | {wrong} |", file=out)
    print("\n| removed | said (cases) |\n|---|---|", file=out)
    for truth in sorted(said_of):
        print(f"| {truth} | {', '.join(f'{what} {n}' for what, n in said_of[truth].most_common())} |", file=out)


def score(answers, results, naive=False):
    rows = defaultdict(Count)
    sizes = []
    confusion = defaultdict(Counter)
    coverage = defaultdict(Count)
    missed = []
    promise = Promise()
    laws = Laws()
    for case, answer in sorted(answers.items()):
        kind = class_of(answer)
        truth = [e["effect"] for e in answer["effects"]]
        label = " + ".join(sorted(truth)) if kind != "outside" else f"({' + '.join(sorted(truth))})"
        label = label or "no effect"
        law = "/".join(e["law"] for e in answer["effects"] if e.get("law", "given") != "given")
        gap = load(results, case)
        rows["results that are there"].add(gap is not None)
        if gap is None:
            missed.append(f"{case}: {label}: no result")
            confusion[f"{len(truth)} effects" if kind in ("pair", "triple") else label]["no result"] += 1
            continue
        gap = naive_answer(gap) if naive else gap
        verdict = gap.get("verdict", "")
        causes = said(gap)
        kept = credible(gap)
        oracle = answer.get("oracle", {})
        right = verdict == "explained" and families(causes) == families(truth)
        inside = any(families(member) == families(truth) for member in kept)
        if verdict in ("no_gap", "unexplained"):
            answered = verdict
        else:
            answered = " + ".join(sorted(causes)) or verdict
            if verdict == "ambiguous":
                answered += " (ambiguous)"
        confusion[f"{len(truth)} effects" if kind in ("pair", "triple") else label][answered] += 1

        good = True
        if kind in ("single", "parametric"):
            laws.add(answer, right or inside, right, verdict, causes)
            rows[f"{kind}: verdict or credible set has it"].add(right or inside)
            rows[f"{kind}: the single verdict"].add(right)
            if "separable" in oracle:
                name = "separable" if oracle["separable"] else "inseparable"
                rows[f"{kind}: the single verdict, {name} by the oracle"].add(right)
                rows[f"{kind}: verdict or credible set has it, {name} by the oracle"].add(right or inside)
            if kind == "parametric" and verdict == "no_gap":
                named = {p["parameter"] for p in gap.get("parametric", [])}
                rows["parametric: no_gap, but the parameter is listed"].add(bool(named & set(truth)))
            good = right or inside
            if kind == "single":
                sizes.append(len(kept))
        elif kind in ("pair", "triple"):
            several = "two" if kind == "pair" else "three"
            all_kept = [families(member) for member in kept] + [families(causes)]
            both = any(families(truth) <= member for member in all_kept)
            one = any(families(truth) & member for member in all_kept)
            rows[f"{several} effects: {'both' if kind == 'pair' else 'all'} found"].add(both)
            rows[f"{several} effects: at least one found"].add(one)
            rows[f"{several} effects: exactly these as the verdict"].add(right)
            good = both
        elif kind == "none":
            rows["no effect: no_gap"].add(verdict == "no_gap")
            good = verdict == "no_gap"
        else:
            rows["outside the catalogue: unexplained"].add(verdict == "unexplained")
            rows["outside the catalogue: explained by one wrong cause"].add(verdict == "explained" and len(causes) == 1)
            good = verdict == "unexplained"
        if not good:
            missed.append(f"{case}: {label}{law and f' ({law})'}: {answered}; credible set {kept}; closest rival "
                          f"{oracle.get('closest_rival', '–')}, gap {answer.get('gap_percent_after_refit')} %")

        if right and truth:
            promise.add(gap)
        true = numbers(answer)
        for cause in gap.get("causes", []):
            for name, interval in cause.get("parameters", {}).items():
                value = true.get((cause["effect"], name))
                if value is not None and interval.get("lower") is not None and interval.get("upper") is not None:
                    coverage[f"{cause['effect']}.{name}"].add(interval["lower"] <= value <= interval["upper"])
    return rows, sizes, confusion, coverage, missed, promise, laws


def exact(effects):
    """Names as a set; a payload and the shift of the centre that it makes are a payload off the middle."""
    names = set(effects)
    return frozenset(names - {"payload", "com_longitudinal"} | {"payload_offset"}
                     if {"payload", "com_longitudinal"} <= names else names)


def report_profiles(answers, results, rest=None, out=sys.stdout):
    rows = defaultdict(lambda: defaultdict(Count))
    for case, answer in sorted(answers.items()):
        profile, _, number = case.rpartition("_")
        if rest is not None and int(number) % 2 != rest:
            continue
        gap = load(results, case) or {}
        verdict, kind = gap.get("verdict", "no result"), class_of(answer)
        truth, causes = exact(e["effect"] for e in answer["effects"]), exact(said(gap))
        kept = [exact(member) for member in credible(gap)] + [causes]
        explained = verdict == "explained"

        def add(row, good, profile=profile):
            rows[row][profile].add(good)

        if kind in ("single", "parametric"):
            add("one effect: in the answer, alone or beside others", any(truth <= member for member in kept))
            add("one effect: in the answer, alone", any(truth == member for member in kept))
            add("one effect: alone, and explained", explained and causes == truth)
        elif kind in ("pair", "triple"):
            several = "two" if kind == "pair" else "three"
            add(f"{several} effects: exactly these", causes == truth)
            add(f"{several} effects: among those said", any(truth <= member for member in kept))
        elif kind == "none":
            add("no effect: no_gap", verdict == "no_gap")
        else:
            add("outside the catalogue: unexplained", verdict == "unexplained")
        if kind != "none":
            add("blamed on one wrong cause", explained and len(causes) == 1 and not causes <= truth)
            add("a gap called no_gap", verdict == "no_gap")
    profiles = sorted({p for row in rows.values() for p in row}, reverse=True)
    print(f"| measure | {' | '.join(profiles)} |\n|---|{'---|' * len(profiles)}", file=out)
    for row in ("one effect: in the answer, alone or beside others", "one effect: in the answer, alone",
                "one effect: alone, and explained", "two effects: exactly these", "two effects: among those said",
                "three effects: exactly these", "three effects: among those said",
                "no effect: no_gap", "outside the catalogue: unexplained", "blamed on one wrong cause",
                "a gap called no_gap"):
        if row.startswith("three") and row not in rows:
            continue
        print(f"| {row} | {' | '.join(str(rows[row][p]) for p in profiles)} |", file=out)


ORDER = ["results", "single", "parametric", "two", "three", "no effect", "outside"]


def report(answers, results, naive=False, out=sys.stdout):
    rows, sizes, confusion, coverage, missed, promise, laws = score(answers, results, naive)
    print("| measure | cases |\n|---|---|", file=out)
    for name in sorted(rows, key=lambda n: next(k for k, word in enumerate(ORDER) if n.startswith(word))):
        print(f"| {name} | {rows[name]} |", file=out)
    print(f"| single: median size of the credible set | {median(sizes) if sizes else '–'} |", file=out)
    total = Count()
    for count in coverage.values():
        total.good += count.good
        total.all += count.all
    print(f"| parameters within their intervals | {total} |", file=out)
    if promise.after:
        for name, value in promise.rows():
            print(f"| {name} | {value} |", file=out)

    print("\n| hidden | said (cases) |\n|---|---|", file=out)
    for truth in sorted(confusion):
        print(f"| {truth} | {', '.join(f'{said} {n}' for said, n in confusion[truth].most_common())} |", file=out)
    if laws:
        laws.report(out)
    if coverage:
        print("\n| parameter | within its interval |\n|---|---|", file=out)
        for name in sorted(coverage):
            print(f"| {name} | {coverage[name]} |", file=out)
    if missed:
        print("\nMissed:\n", file=out)
        for line in missed:
            print(f"- {line}", file=out)


def main(arguments):
    modes = ("--naive", "--removed", "--profiles", "--even", "--odd")
    mode = arguments[0] if arguments[:1] and arguments[0] in modes else ""
    arguments = arguments[bool(mode):]
    if len(arguments) != 2 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    answers = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    if mode == "--removed":
        report_removed(answers, Path(arguments[1]))
    elif mode in ("--profiles", "--even", "--odd"):
        report_profiles(answers, Path(arguments[1]), {"--even": 0, "--odd": 1}.get(mode))
    else:
        report(answers, Path(arguments[1]), mode == "--naive")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
