#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds, and runs all tests. Arguments go to ctest: tests/run.sh -R bounds
set -eu
cd "$(dirname "$0")/.."
tools/setup.sh
tools/build.sh release
exec ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc 2>/dev/null || echo 2)" "$@"
