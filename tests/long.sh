#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# What takes longer than a change should wait for; each part can be asked for alone:
#   tests/long.sh slow        properties over hundreds of runs
#   tests/long.sh campaign    the campaign on random robots, five minutes of it
#   tests/long.sh fuzz [SECONDS]  every fuzzer for a minute, or so long (docs/inside/fuzzing.md)
#   tests/long.sh mutations [COUNT]  every reader on 100,000 mutations, or so many: slowest input and memory
#   tests/long.sh endurance   a day at 1 kHz, with trouble every hour (tests/campaigns/endurance.py, ten minutes)
#   tests/long.sh faults      kills, full disks, closed streams and the like, 2,000 of them (tests/campaigns/faults.py, as root)
#   tests/long.sh ordinary    200 logs of each kind of odd log, judged (tests/campaigns/ordinary_logs.py, hours)
#   tests/long.sh incidents   one fault a log, and the incidents that are made of it (tests/campaigns/incidents.py, an hour)
#   tests/long.sh coverage    lines that the tests run, by room, and those they do not (tools/coverage.py)
#   tests/long.sh alone       every source file by itself, by clang (tools/check_alone.py, ten minutes)
#   tests/long.sh tidy        clang-tidy (tools/check_tidy.py, half an hour)
#   tests/long.sh sanitizers  all test programs once more under AddressSanitizer and UndefinedBehaviorSanitizer, but for
#                             these
set -eu
cd "$(dirname "$0")/.."
jobs=$(nproc 2>/dev/null || echo 2)
fuzz_seconds=60
mutations=100000
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
      tests/campaigns/endurance.py build
      ;;
    faults)
      tools/build.sh release wheelwright
      tests/campaigns/faults.py --program build/bin/wheelwright
      ;;
    ordinary)
      tools/build.sh release wheelwright wheelwright_python
      tests/campaigns/ordinary_logs.py --threads "$jobs" --same-account --python build/python
      ;;
    incidents)
      tools/build.sh release wheelwright
      tests/campaigns/incidents.py --cases 1000 --robots 12 --lost 0 0.01 0.03
      ;;
    coverage)
      tools/build.sh coverage
      find build-coverage -name '*.gcda' -delete
      # A test that fails is another run's matter: what it reached counts.
      ctest --test-dir build-coverage --no-tests=error -j "$jobs" -LE 'package|house' -E "$slow|$campaign" || true
      tools/coverage.py build-coverage --source > build-coverage/coverage.md
      sed '/^$/,$d' build-coverage/coverage.md
      echo "what did not run: build-coverage/coverage.md"
      ;;
    alone)
      tools/setup.sh --ci
      tools/check_alone.py
      ;;
    tidy)
      tools/setup.sh --ci
      tools/build.sh release
      tools/check_tidy.py
      ;;
    sanitizers)
      tools/build.sh asan
      tests/sanitized.py "$jobs"
      ;;
    fuzz)
      case ${2:-} in [0-9]*) fuzz_seconds=$2 ;; esac
      tools/setup.sh --fuzz
      tests/fuzzers/run.sh "$fuzz_seconds"
      ;;
    mutations)
      case ${2:-} in [0-9]*) mutations=$2 ;; esac
      tools/build.sh release test_fuzz
      folder=${TMPDIR:-/tmp}
      [ ! -w /dev/shm ] || folder=/dev/shm  # for files of a moment
      printf '%-12s %9s %10s %9s %7s %9s\n' reader inputs slowest/s bytes MiB findings
      failed=0
      for reader in $(build/bin/test_fuzz --gtest_filter='Of/Mutations.*' --gtest_list_tests |
        sed -n 's|^ *AreReadOrRefused/\([a-z0-9]*\).*|\1|p'); do
        TMPDIR=$folder WHEELWRIGHT_MUTATIONS=$mutations build/bin/test_fuzz --gtest_brief=1 \
          --gtest_filter="Of/Mutations.AreReadOrRefused/$reader" > build/mutations.log 2>&1 || {
          failed=1
          grep -A2 'Failure$' build/mutations.log >&2 || true
        }
        grep "^$reader " build/mutations.log
      done
      [ "$failed" = 0 ]
      ;;
    [0-9]*) ;;
    *)
      echo "usage: tests/long.sh [slow] [campaign] [endurance] [faults] [ordinary] [coverage] [alone] [tidy]" \
        "[sanitizers] | fuzz [SECONDS] | mutations [COUNT]" >&2
      exit 2
      ;;
  esac
done
