#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# From nothing to a commissioned robot: installs what is missing, builds the half of the program that commissions and
# detects, commissions the log that ships with the project, lets the resulting model look for a fault, and builds the other
# half. Interrupted there, it leaves a program without the commands of the other half; run again, it goes on. Results are in
# out/.
set -eu
cd "$(dirname "$0")/.."

program=build/bin/wheelwright
first=build/first/wheelwright

# Whether the program has the commands of both halves.
whole() {
  "$program" gap --help >/dev/null 2>&1
}

# While there is no whole program, that of the first half takes its place. It is dated before every source, so that the
# build does not take it for the whole one.
stand_in() {
  if [ -x "$first" ] && ! whole; then
    mkdir -p build/bin
    cp "$first" "$program.new"
    touch -t 198001010000 "$program.new"
    mv "$program.new" "$program"
  fi
}

# make LOG SCENARIO: a log is made again only when its scenario is newer.
make() {
  if [ ! -s "$1" ] || [ "$2" -nt "$1" ]; then
    "$first" simulate "$2" --out "$1" --force
  fi
}

# look WHAT LOG DIRECTORY EXPECTED: detect's exit code is the answer, 1 means a fault.
look() {
  status=0
  "$first" detect "$2" --model out/commission/model.json --out "$3" --quiet >/dev/null || status=$?
  case $status in
    0) echo "$1: no fault found" ;;
    1) echo "$1: fault found" ;;
    *) echo "$1: detect failed with exit code $status" >&2; exit "$status" ;;
  esac
  [ "$status" -eq "$4" ] || { echo "$1: this is not what is expected" >&2; exit 1; }
}

tools/setup.sh program
tools/build.sh program wheelwright_first
stand_in
mkdir -p out

echo
echo "== 1. A healthy robot drove: examples/healthy.csv.gz"
echo "== 2. Commission it: parameters with bounds, thresholds, model.json"
"$first" commission examples/healthy.csv.gz --robot examples/robot.yaml --out out/commission
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
echo
if ! whole; then
  echo "The program:               $program"
  echo "It has commission, detect, doctor, check, simulate, convert and robot, and can be used while the rest is built."
  echo "== 4. Build the rest: try, compare, identify, margins, sensitivity, export, design, choose, gap, fleet"
  echo "This may be interrupted; ./examples/commission.sh goes on where it stopped."
fi
# Whoever interrupts the link keeps a program.
trap stand_in EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
tools/build.sh program installed
echo
echo "The whole program:         $program"
