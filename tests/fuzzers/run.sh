#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Builds the fuzzers, makes seeds with the program of build/ and runs each in turn. Exit code 1 where one found
# something; what it was stands in build-fuzz/found. They begin with tests/fuzzers/corpus; what they learn stays in
# build-fuzz/corpus, of which `tests/fuzzers/corpus.py renew` makes tests/fuzzers/corpus anew.
#
#   tests/fuzzers/run.sh SECONDS [NAME...]     all of them unless some are named (csv, mcap, ...)
set -eu
cd "$(dirname "$0")/../.."
seconds=${1:?usage: tests/fuzzers/run.sh SECONDS [NAME...]}
shift
tools/build.sh program wheelwright
names=$*
targets=''
for source in tests/fuzzers/*.cpp; do
  case $source in *_test.cpp) continue ;; esac
  name=$(basename "$source" .cpp)
  [ -n "$*" ] || names="$names $name"
done
for name in $names; do
  targets="$targets fuzz_$name"
done
# shellcheck disable=SC2086
tools/build.sh fuzz $targets
tests/fuzzers/seeds.sh build/bin/wheelwright build-fuzz/seeds
rm -rf build-fuzz/stored
# shellcheck disable=SC2086
tests/fuzzers/corpus.py unpack build-fuzz/stored $names
mkdir -p build-fuzz/found
memory=${TMPDIR:-/tmp}
[ ! -w /dev/shm ] || memory=/dev/shm
TMPDIR=$(mktemp -d -p "$memory" wheelwright-fuzzers-XXXXXX)  # files of a moment
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
export LSAN_OPTIONS=suppressions=tests/support/leaks.supp:print_suppressions=0
# The HDF5 library asks for what damaged files say, and lives without. Traces and a quarantine of normal size double the
# time.
export ASAN_OPTIONS=allocator_may_return_null=1:malloc_context_size=4:quarantine_size_mb=16
failed=''
printf '%-10s %12s %10s %10s\n' fuzzer executions coverage corpus
for name in $names; do
  corpus=build-fuzz/corpus/$name
  log=build-fuzz/$name.log
  mkdir -p "$corpus"
  dictionary=''
  [ ! -f "build-fuzz/seeds/$name.dict" ] || dictionary=-dict=build-fuzz/seeds/$name.dict
  malloc=512
  [ "$name" != hdf5 ] || malloc=2147483647
  # shellcheck disable=SC2046,SC2086
  build-fuzz/bin/fuzz_"$name" "$corpus" build-fuzz/seeds/"$name" build-fuzz/stored/"$name" $(find tests/fuzzers/found -name "$name") \
    -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -malloc_limit_mb=$malloc -max_len=65536 \
    -artifact_prefix=build-fuzz/found/"$name-" -print_final_stats=1 $dictionary > "$log" 2>&1 || failed="$failed $name"
  printf '%-10s %12s %10s %10s\n' "$name" "$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")" \
    "$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$log" | tail -1)" "$(find "$corpus" -type f | wc -l)"
done
if [ -n "$failed" ]; then
  echo "fuzz: found something (build-fuzz/NAME.log, build-fuzz/found):$failed" >&2
  exit 1
fi
