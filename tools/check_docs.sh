#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Lets clang read the documentation comments of every header: a \param that names no parameter, a comment that belongs
# to nothing, a malformed command are errors. HTML is not read: <ul> in a comment is a word. Each header is compiled
# alone (syntax only); nothing has to be built.
set -eu
cd "$(dirname "$0")/.."
clang=$(command -v clang++-14 || command -v clang++) || {
  echo "docs: clang is missing; tools/setup.sh --ci installs it" >&2
  exit 2
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
ln -s "$PWD" "$scratch/wheelwright"

# One header for each call, as many at a time as there are processors.
check() {
  header=$1
  source=$scratch/$(printf '%s' "$header" | tr / _).cpp
  printf '#include <wheelwright/%s>\n' "$header" > "$source"
  # shellcheck disable=SC2046
  "$clang" -std=c++20 -fsyntax-only -Wdocumentation -Werror=documentation -Wno-documentation-html -I "$scratch" \
    $(pkg-config --cflags-only-I eigen3 hdf5 python3 | sed 's/-I/-isystem /g') "$source" || {
    echo "docs: $header" >&2
    : > "$scratch/failed"
  }
}

jobs=$(nproc 2>/dev/null || echo 2)
count=0
for header in */*.hpp; do
  case $header in
    build*/* | tests/* | node_modules/*) continue ;;
  esac
  count=$((count + 1))
  check "$header" &
  [ $((count % jobs)) -ne 0 ] || wait
done
wait
[ ! -e "$scratch/failed" ] || exit 1
echo "docs: $count headers, nothing to report"
