#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds, and runs the tests, but for those that take minutes each (tests/long.sh). What was
# skipped is told at the end, with what it lacks: tools/setup.sh --ci installs that. Arguments go to ctest instead:
# tests/run.sh -R bounds
set -eu
cd "$(dirname "$0")/.."
tools/setup.sh
tools/build.sh release
if [ $# = 0 ]; then
  set -- -E '(^|/)Slow[A-Z]|^guarantee[.]campaign$'
fi
rm -f build/tests.xml
status=0
ctest --test-dir build --output-on-failure --no-tests=error --output-junit tests.xml -j "$(nproc 2>/dev/null || echo 2)" "$@" ||
  status=$?
python3 tools/skipped.py build/tests.xml
exit "$status"
