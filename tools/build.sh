#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Configures and builds with a preset of CMakePresets.json, whatever of that is still to do.
#
#   tools/build.sh PRESET [TARGET...]
set -eu
cd "$(dirname "$0")/.."
preset=${1:?usage: tools/build.sh PRESET [TARGET...]}
shift

case $preset in
  release) directory=build ;;
  *) directory=build-$preset ;;
esac
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER-ccache}"
fi
if [ ! -f "$directory/build.ninja" ]; then
  cmake --preset "$preset"
fi
jobs=$(nproc 2>/dev/null || echo 2)
if [ $# -gt 0 ]; then
  cmake --build "$directory" -j "$jobs" --target "$@"
else
  cmake --build "$directory" -j "$jobs"
fi
