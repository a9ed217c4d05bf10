#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Withheld effects: has `wheelwright gap` name what another physics engine hid in logs, and scores the answers.
#
#   tests/campaigns/withheld.sh [--seed S] [--cases N] [--profile standard|plain|hard] [--kind KIND] [--laws LAWS]
#                     [--wide] [--ordinary] [--duration S] [--out DIR] [--only naive|removed] [SET]
#
# SET is a directory of cases that is there already: case_*/ (or logs/case_*/) beside answers.json. Without it a set is
# made in DIR/set. The tool sees logs and robot file of a case and nothing else; its results are in DIR/results, without
# the drive that would split ambiguous causes, which takes longer than all the rest.
#   --laws LAWS     what effects follow (`wheelwright-reality generate --help`); each: a case for every effect and law
#   --wide          robots of 0.5 to 500 kg, none quite what its file says
#   --ordinary      logs with jitter, lost rows and, one in four, smoothed speeds
#   --only naive    scores what the naive rule said; results in DIR/results-naive
#   --only removed  takes the hidden effect (and those that contain it) out of the tool's catalogue, for cases of one
#                   effect
#                   of the catalogue; results in DIR/results-removed
# Where the set has a second log of each case (fresh/case_*/), what is promised of the shrinking is checked on it.
# The table is Markdown on standard output. BUILD (default build) is the build directory, JOBS (2) the cases at a time.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
bin=${BUILD:-$root/build}/bin
jobs=${JOBS:-2}
seed=1 cases='' profile=standard kind=mixed laws=all duration=120 wide='' ordinary='' out=out/withheld only='' set=''
while [ $# -gt 0 ]; do
  case $1 in
    --seed | --cases | --profile | --kind | --laws | --duration | --out | --only)
      [ $# -ge 2 ] || { echo "withheld: $1 wants a value" >&2; exit 2; }
      case $1 in
        --seed) seed=$2 ;;
        --cases) cases=$2 ;;
        --profile) profile=$2 ;;
        --kind) kind=$2 ;;
        --laws) laws=$2 ;;
        --duration) duration=$2 ;;
        --out) out=$2 ;;
        --only) only=$2 ;;
      esac
      shift 2 ;;
    --wide) wide=--wide; shift ;;
    --ordinary) ordinary=--ordinary; shift ;;
    -*) echo "withheld: unknown option $1" >&2; exit 2 ;;
    *) set=$1; shift ;;
  esac
done

mkdir -p "$out"
if [ -z "$set" ]; then
  set=$out/set
  [ -n "$cases" ] || [ "$laws" = each ] || cases=60
  "$bin/wheelwright-reality" generate --seed "$seed" ${cases:+--cases "$cases"} --profile "$profile" --kind "$kind" \
    --laws "$laws" $wide $ordinary --duration "$duration" --out "$set" --threads "$jobs"
fi
logs=$set
[ ! -d "$set/logs" ] || logs=$set/logs
results=$out/results${only:+-$only}
mkdir -p "$results"

# Lines "case option…" of what is run. Names of answers.json become paths and options: others than ours are refused.
python3 - "$set/answers.json" "$only" >"$results/runs" <<'PY'
import json, re, sys

ALSO = {"coulomb": ["coulomb_asymmetric"], "armature": ["payload", "payload_offset"], 
        "wheel_radius": ["wheel_radius_asymmetric"],
        "torque_gain": ["torque_gain_asymmetric"], "viscous": ["viscous_asymmetric"],
        "com_longitudinal": ["payload_offset"], "payload": ["payload_offset"]}
answers, only = json.load(open(sys.argv[1], encoding="utf-8")), sys.argv[2]
for case, answer in sorted(answers.items()):
    effects = [effect["effect"] for effect in answer["effects"]]
    for name in [case] + effects:
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_-]*", name):
            sys.exit(f"withheld: {sys.argv[1]}: {name!r}: expected a name of letters, digits, _ and -")
    if only == "naive":
        print(case, "--naive", "--no-shrink")
    elif only != "removed":
        print(case)
    elif len(effects) == 1 and answer.get("in_catalogue", True):
        print(case, "--no-shrink", *(f"--without {name}" for name in effects + ALSO.get(effects[0], [])))
PY

# Exit code 1 is an answer ("there is a gap"); anything above is a failure, which the score counts.
export bin set logs results
xargs -P "$jobs" -I '{}' sh -c '
  set -f
  set -- $1
  case=$1; shift
  rm -rf "$results/$case"
  fresh=$(dirname "$logs")/fresh/$case/real.csv.gz
  [ -f "$fresh" ] && set -- "$@" --fresh "$fresh"
  "$bin/wheelwright" gap "$logs/$case/real.csv.gz" --robot "$logs/$case/robot.yaml" \
    --baseline "$logs/$case/baseline.csv.gz" --out "$results/$case" --threads 1 --quiet --no-manoeuvre "$@" \
    >"$results/$case.log" 2>&1 || [ $? -eq 1 ] ||
    echo "withheld: $case failed, see $results/$case.log" >&2' withheld '{}' \
  <"$results/runs"

python3 "$root/tests/campaigns/score_withheld.py" ${only:+"--$only"} "$set/answers.json" "$results"
