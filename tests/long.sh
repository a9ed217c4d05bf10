#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# What takes longer than a change should wait for; each part can be asked for alone:
#   tests/long.sh slow        properties over hundreds of runs
#   tests/long.sh campaign    the campaign on random robots, five minutes of it
#   tests/long.sh fuzz [SECONDS]  every fuzzer for a minute, or so long (docs/fuzzing.md)
#   tests/long.sh endurance   a day at 1 kHz, with trouble every hour (tools/endurance.py, ten minutes)
#   tests/long.sh sanitizers  all test programs once more under AddressSanitizer and UndefinedBehaviorSanitizer, but for these
set -eu
cd "$(dirname "$0")/.."
jobs=$(nproc 2>/dev/null || echo 2)
fuzz_seconds=60
slow='(^|/)Slow[A-Z]'
campaign='^guarantee[.]campaign$'
tools/setup.sh
for part in ${*:-slow campaign sanitizers}; do
  case $part in
    slow)
      tools/build.sh release
      ctest --test-dir build --output-on-failure --no-tests=error -j "$jobs" -R "$slow"
      ;;
    campaign)
      tools/build.sh release wheelwright-campaign
      ctest --test-dir build --output-on-failure --no-tests=error -R "$campaign"
      ;;
    endurance)
      tools/build.sh release wheelwright wheelwright-endurance
      tools/endurance.py build
      ;;
    sanitizers)
      tools/build.sh asan
      tests/sanitized.py "$jobs"
      ;;
    fuzz)
      case ${2:-} in [0-9]*) fuzz_seconds=$2 ;; esac
      tools/setup.sh --fuzz
      fuzz/run.sh "$fuzz_seconds"
      ;;
    [0-9]*) ;;
    *)
      echo "usage: tests/long.sh [slow] [campaign] [endurance] [sanitizers] | fuzz [SECONDS]" >&2
      exit 2
      ;;
  esac
done
