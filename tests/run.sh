#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds, and runs the tests, but for those that take minutes each (tests/long.sh).
# Arguments go to ctest instead: tests/run.sh -R bounds
set -eu
cd "$(dirname "$0")/.."
tools/setup.sh
tools/build.sh release
if [ $# = 0 ]; then
  set -- -E '(^|/)Slow[A-Z]|^guarantee[.]campaign$'
fi
exec ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc 2>/dev/null || echo 2)" "$@"
