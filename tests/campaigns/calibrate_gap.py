#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How often what `wheelwright gap` says is true, by the kind of its answer, as Markdown.

    calibrate_gap.py ANSWERS.json RESULTS [ANSWERS.json RESULTS]...    a pair for each world; RESULTS has CASE/gap.json
    calibrate_gap.py --judge ANSWERS.json RESULTS [...]                what gap.json promises, against truth

The first counts diagnoses by verdict and number of causes (the table of gap/causes/confidence.cpp) and judges each world by
the others: what the rest promises for its answers, and what came of it. Answers are compared as gap.json numbers them:
laws of one family are one cause, what is a trifle is none, and sets of one answer are one; a payload with the shift of
the centre that it makes is a payload off the middle.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

from score_withheld import exact, families, load

OUTCOMES = ("first", "other", "neither")


class Record:
    """Outcomes of diagnoses of one kind."""

    def __init__(self):
        self.of = dict.fromkeys(OUTCOMES, 0)
        self.causes = self.present = 0

    def add(self, gap, truth):
        self.of[outcome(gap, truth)] += 1
        named = families(cause["effect"] for cause in gap["causes"])
        self.causes += len(named)
        self.present += len(named & families(truth))

    def logs(self):
        return sum(self.of.values())

    def share(self, name):
        return (self.of[name] + 0.5) / (self.logs() + 0.5 * len(OUTCOMES))

    def merged(self, other):
        both = Record()
        for name in OUTCOMES:
            both.of[name] = self.of[name] + other.of[name]
        both.causes, both.present = self.causes + other.causes, self.present + other.present
        return both


def kind(gap):
    """Verdict and number of causes: what gap/causes/confidence.cpp tells apart."""
    if gap["verdict"] in ("no_gap", "unexplained"):
        return gap["verdict"]
    return gap["verdict"] + (", several causes" if len(gap["causes"]) > 1 else ", one cause")


def truth_of(answer):
    """Names of what was there; of a payload off the middle both of its parts as well."""
    names = {effect["effect"] for effect in answer["effects"]}
    return names | exact(names) | ({"payload", "com_longitudinal"} if "payload_offset" in exact(names) else set())


def same(effects, truth):
    return families(exact(effects)) == families(exact(truth))


def said_by(member):
    """The causes of a set of the credible set, but for those whose share of the gap is nothing."""
    return [effect for effect in member["effects"] if effect not in member.get("trifles", [])]


def outcome(gap, truth):
    sets = gap["credible_set"] or [{"effects": []}]
    right = {member.get("answer", number) for number, member in enumerate(sets) if same(said_by(member), truth)}
    if not right:
        return "neither"
    return "first" if sets[0].get("answer", 0) in right else "other"


def diagnoses(pairs):
    """(world, gap, truth) of every case with a result."""
    for answers, results in pairs:
        world = Path(results).parent.name
        for case, answer in sorted(json.loads(Path(answers).read_text(encoding="utf-8")).items()):
            gap = load(Path(results), case)
            if gap and gap.get("verdict"):
                yield world, gap, truth_of(answer)


def count(pairs, out):
    worlds = defaultdict(lambda: defaultdict(Record))
    for world, gap, truth in diagnoses(pairs):
        worlds[world][kind(gap)].add(gap, truth)
    total = defaultdict(Record)
    for records in worlds.values():
        for name, record in records.items():
            total[name] = total[name].merged(record)
    print("| answer | logs | first | another listed | none listed | causes named | there |\n"
          "|---|---|---|---|---|---|---|",
          file=out)
    for name, record in sorted(total.items()):
        print(f"| {name} | {record.logs()} | {record.of['first']} | {record.of['other']} | {record.of['neither']} "
              f"| {record.causes} | {record.present} |", file=out)
    print("\n| world | answer | logs | first: promised by the other worlds | came | listed at all: promised | came |\n"
          "|---|---|---|---|---|---|---|", file=out)
    for world, records in worlds.items():
        for name, record in sorted(records.items()):
            rest = Record()
            for other in worlds:
                if other != world:
                    rest = rest.merged(worlds[other][name])
            logs, listed = record.logs(), rest.share("first") + rest.share("other")
            print(f"| {world} | {name} | {logs} | {logs * rest.share('first'):.1f} | {record.of['first']} "
                  f"| {logs * listed:.1f} | {record.of['first'] + record.of['other']} |", file=out)


def promised(gap):
    """Probabilities that the first set is right, and that some set is."""
    if gap["credible_set"]:
        all_sets = [member["probability"] for member in gap["credible_set"]]
        return all_sets[0], sum(all_sets)
    record = gap["track_record"]
    first = (record["first"] + 0.5) / (record["logs"] + 1.5)
    return first, first


def judge(pairs, out):
    """What was promised, and how many came true: by world, and by tenths of the probabilities."""
    bins = {"credible sets": defaultdict(list), "causes of the verdict": defaultdict(list)}
    worlds = defaultdict(list)
    for world, gap, truth in diagnoses(pairs):
        if gap["track_record"]:
            what = outcome(gap, truth)
            worlds[world].append((*promised(gap), what == "first", what != "neither"))
        for member in gap["credible_set"]:
            if member.get("probability") is not None:
                bins["credible sets"][min(int(10 * member["probability"]), 9)].append(
                    (member["probability"], same(member["effects"], truth)))
        for cause in gap["causes"]:
            if cause.get("probability") is not None:
                bins["causes of the verdict"][min(int(10 * cause["probability"]), 9)].append(
                    (cause["probability"], bool(families([cause["effect"]]) & families(truth))))
    print("| world | logs | first: promised | came | listed at all: promised | came |\n|---|---|---|---|---|---|",
          file=out)
    for world, values in worlds.items():
        first, listed, first_came, listed_came = (sum(column) for column in zip(*values))
        print(f"| {world} | {len(values)} | {first:.1f} | {first_came} | {listed:.1f} | {listed_came} |", file=out)
    for what, rows in bins.items():
        print(f"\n| {what}: probability | cases | promised | came true |\n|---|---|---|---|", file=out)
        for tenth, values in sorted(rows.items()):
            print(f"| {tenth / 10:.1f} to {(tenth + 1) / 10:.1f} | {len(values)} | {sum(p for p, _ in values):.1f} "
                  f"| {sum(y for _, y in values)} |", file=out)


def main():
    arguments = sys.argv[1:]
    to_judge = arguments[:1] == ["--judge"]
    arguments = arguments[to_judge:]
    if not arguments or len(arguments) % 2 or arguments[0].startswith("-"):
        sys.exit(__doc__.strip())
    pairs = list(zip(arguments[::2], arguments[1::2]))
    (judge if to_judge else count)(pairs, sys.stdout)


if __name__ == "__main__":
    main()
