#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Wheelwright and Foxglove's npm packages read the same numbers out of each other's recordings of ROS 2 messages; and
# the databases that Wheelwright writes are whole for the sqlite3 program. Wants Node and npm, and fetches four packages
# from npm into a scratch directory; ctest does not run it.
set -eu
cd "$(dirname "$0")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
command -v npm >/dev/null || { echo "bag: npm is missing" >&2; exit 2; }

"${CXX:-g++}" -std=c++20 -O1 -iquote . $(pkg-config --cflags eigen3) -o "$scratch/check_bag" \
  tools/check_bag.cpp logs/ros_*.cpp logs/mcap_*.cpp formats/logs/bag.cpp formats/logs/bag_files.cpp formats/logs/bag_storage.cpp formats/logs/bag_write.cpp \
  formats/logs/database.cpp formats/files/bytes.cpp formats/files/words.cpp core/words.cpp -lfmt -lz -lzstd -llz4 -lxxhash -lsqlite3 -lfastcdr -lyaml-cpp
cp tools/check_bag.mjs "$scratch"
cd "$scratch"
npm install --silent --no-audit --no-fund --ignore-scripts @mcap/core@2.2.2 @foxglove/wasm-zstd@1.0.1 \
  @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0

same() {
  sort ours.txt > a.txt
  sort theirs.txt > b.txt
  cmp a.txt b.txt || { diff a.txt b.txt | head >&2; echo "bag: $1: read differently" >&2; exit 1; }
  [ -s a.txt ] || { echo "bag: $1: nothing was read" >&2; exit 1; }
  echo "bag: $1: $(wc -l < a.txt) numbers, the same on both sides"
}
./check_bag write ours.mcap
./check_bag read ours.mcap > ours.txt
node check_bag.mjs read ours.mcap > theirs.txt
same "written here"
./check_bag types > types.json
node check_bag.mjs write types.json theirs.mcap > theirs.txt
./check_bag read theirs.mcap > ours.txt
same "written there"

./check_bag write ours.db3
./check_bag read ours.db3 > theirs.txt
./check_bag read ours.mcap > ours.txt
same "as a database"
if command -v sqlite3 >/dev/null; then
  [ "$(sqlite3 ours.db3 'PRAGMA integrity_check')" = ok ] || { echo "bag: the database is not whole" >&2; exit 1; }
  echo "bag: the database is whole"
fi
