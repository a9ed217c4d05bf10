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

# The program alone and everything share a directory: what the one has built the other need not. Everything stays.
case $preset in
  program | release) directory=build ;;
  *) directory=build-$preset ;;
esac
configured=$(cat "$directory/preset" 2>/dev/null || true)
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER-ccache}"
fi
if [ ! -f "$directory/build.ninja" ] || { [ "$preset" != "$configured" ] && [ "$preset" != program ]; }; then
  if ! cmake --preset "$preset"; then
    [ "$preset" = program ] && all=' program' || all=''
    echo "build: preset $preset cannot be configured; tools/setup.sh$all installs what it needs" >&2
    exit 1
  fi
  echo "$preset" > "$directory/preset"
fi
jobs=$(nproc 2>/dev/null || echo 2)
if [ $# -gt 0 ]; then
  cmake --build "$directory" -j "$jobs" --target "$@"
else
  cmake --build "$directory" -j "$jobs"
fi
