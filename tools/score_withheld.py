#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scores what `wheelwright gap` said of cases with withheld effects, as Markdown.

    score_withheld.py [--naive] ANSWERS.json RESULTS    RESULTS has CASE/gap.json (or CASE.json) for every case

With --naive what is scored is the answer of the naive rule (`wheelwright gap --naive`), not the diagnosis.
"""

import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

# Effects that count as one cause.
FAMILIES = [
    {"coulomb", "rolling_resistance", "bearing_friction"},
    {"actuator_lag", "delay", "sensor_time_offset"},
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
        return "pair"
    return "parametric" if names[0] in PARAMETRIC else "single"


def numbers(answer):
    """True physical parameters by (effect, name)."""
    return {(e["effect"], name): value for e in answer["effects"] for name, value in e.get("parameters", {}).items()}


def score(answers, results, naive=False):
    rows = defaultdict(Count)
    sizes = []
    confusion = defaultdict(Counter)
    coverage = defaultdict(Count)
    missed = []
    for case, answer in sorted(answers.items()):
        kind = class_of(answer)
        truth = [e["effect"] for e in answer["effects"]]
        label = " + ".join(sorted(truth)) if kind != "outside" else f"({' + '.join(sorted(truth))})"
        label = label or "no effect"
        gap = load(results, case)
        rows["results that are there"].add(gap is not None)
        if gap is None:
            missed.append(f"{case}: {label}: no result")
            confusion["two effects" if kind == "pair" else label]["no result"] += 1
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
        confusion["two effects" if kind == "pair" else label][answered] += 1

        good = True
        if kind in ("single", "parametric"):
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
        elif kind == "pair":
            all_kept = [families(member) for member in kept] + [families(causes)]
            both = any(families(truth) <= member for member in all_kept)
            one = any(families(truth) & member for member in all_kept)
            rows["two effects: both found"].add(both)
            rows["two effects: at least one found"].add(one)
            rows["two effects: exactly these as the verdict"].add(right)
            good = both
        elif kind == "none":
            rows["no effect: no_gap"].add(verdict == "no_gap")
            good = verdict == "no_gap"
        else:
            rows["outside the catalogue: unexplained"].add(verdict == "unexplained")
            rows["outside the catalogue: explained by one wrong cause"].add(verdict == "explained" and len(causes) == 1)
            good = verdict == "unexplained"
        if not good:
            missed.append(f"{case}: {label}: {answered}; credible set {kept}; closest rival "
                          f"{oracle.get('closest_rival', '–')}, gap {answer.get('gap_percent_after_refit')} %")

        true = numbers(answer)
        for cause in gap.get("causes", []):
            for name, interval in cause.get("parameters", {}).items():
                value = true.get((cause["effect"], name))
                if value is not None and interval.get("lower") is not None and interval.get("upper") is not None:
                    coverage[f"{cause['effect']}.{name}"].add(interval["lower"] <= value <= interval["upper"])
    return rows, sizes, confusion, coverage, missed


ORDER = ["results", "single", "parametric", "two", "no effect", "outside"]


def report(answers, results, naive=False, out=sys.stdout):
    rows, sizes, confusion, coverage, missed = score(answers, results, naive)
    print("| measure | cases |\n|---|---|", file=out)
    for name in sorted(rows, key=lambda n: next(k for k, word in enumerate(ORDER) if n.startswith(word))):
        print(f"| {name} | {rows[name]} |", file=out)
    print(f"| single: median size of the credible set | {median(sizes) if sizes else '–'} |", file=out)
    total = Count()
    for count in coverage.values():
        total.good += count.good
        total.all += count.all
    print(f"| parameters within their intervals | {total} |", file=out)

    print("\n| hidden | said (cases) |\n|---|---|", file=out)
    for truth in sorted(confusion):
        print(f"| {truth} | {', '.join(f'{said} {n}' for said, n in confusion[truth].most_common())} |", file=out)
    if coverage:
        print("\n| parameter | within its interval |\n|---|---|", file=out)
        for name in sorted(coverage):
            print(f"| {name} | {coverage[name]} |", file=out)
    if missed:
        print("\nMissed:\n", file=out)
        for line in missed:
            print(f"- {line}", file=out)


def main(arguments):
    naive = arguments[:1] == ["--naive"]
    arguments = arguments[naive:]
    if len(arguments) != 2 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    answers = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    report(answers, Path(arguments[1]), naive)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
