#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# From nothing to a commissioned robot: installs what is missing, builds the program, commissions the log that ships
# with the project, and lets the resulting model look for a fault. Results are in out/.
set -eu
cd "$(dirname "$0")/.."

tools/setup.sh program
tools/build.sh program wheelwright
program=build/bin/wheelwright
mkdir -p out

# make LOG SCENARIO: a log is made again only when its scenario is newer.
make() {
  if [ ! -s "$1" ] || [ "$2" -nt "$1" ]; then
    "$program" simulate "$2" --out "$1" --force
  fi
}

# look WHAT LOG DIRECTORY EXPECTED: detect's exit code is the answer, 1 means a fault.
look() {
  status=0
  "$program" detect "$2" --model out/commission/model.json --out "$3" --quiet >/dev/null || status=$?
  case $status in
    0) echo "$1: no fault found" ;;
    1) echo "$1: fault found" ;;
    *) echo "$1: detect failed with exit code $status" >&2; exit "$status" ;;
  esac
  [ "$status" -eq "$4" ] || { echo "$1: this is not what is expected" >&2; exit 1; }
}

echo
echo "== 1. A healthy robot drove: examples/healthy.csv.gz"
echo "== 2. Commission it: parameters with bounds, thresholds, model.json"
"$program" commission examples/healthy.csv.gz --robot examples/robot.yaml --out out/commission
echo "== 3. Look at two drives with that model"
make out/another.csv examples/scenarios/healthy.yaml
make out/fault.csv examples/scenarios/fault.yaml
look "another healthy drive" out/another.csv out/detect_healthy 0
look "a wheel loses radius half-way" out/fault.csv out/detect_fault 1

echo
echo "The model:                 out/commission/model.json"
echo "Report of the commission:  out/commission/report.html"
echo "Report of the fault:       out/detect_fault/report.html"
echo "Open them in any browser; they need no network."
