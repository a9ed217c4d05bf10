#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Wheelwright and npm's @mcap/core read each other's MCAP files, message by message the same. Wants Node and npm, and
# fetches three packages from npm into a scratch directory; ctest does not run it.
set -eu
cd "$(dirname "$0")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
command -v npm >/dev/null || { echo "mcap: npm is missing" >&2; exit 2; }

"${CXX:-g++}" -std=c++20 -O1 -iquote . -o "$scratch/check_mcap" tools/check_mcap.cpp logs/mcap_*.cpp \
  formats/files/bytes.cpp formats/files/words.cpp -lfmt -lz -lzstd -llz4 -lxxhash
cp tools/check_mcap.mjs "$scratch"
cd "$scratch"
npm install --silent --no-audit --no-fund --ignore-scripts @mcap/core@2.2.2 @foxglove/wasm-lz4@1.0.2 \
  @foxglove/wasm-zstd@1.0.1

./check_mcap write .
node check_mcap.mjs write .
for file in *.mcap; do
  ./check_mcap read "$file" > ours.txt
  ways='stream indexed'
  case $file in *loose*) ways=stream ;; esac  # without chunks there is no index
  for way in $ways; do
    node check_mcap.mjs "$way" "$file" > theirs.txt
    cmp ours.txt theirs.txt || { echo "mcap: $file is read differently ($way)" >&2; exit 1; }
  done
  echo "mcap: $file: $(wc -l < ours.txt) messages, the same on both sides ($ways)"
done
