#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Where the time of whole commands goes, and what they do: two Markdown tables.
#
#     tests/campaigns/profile.sh PROGRAM [SECONDS]
#
# A drive of SECONDS (900) at 200 Hz with a pose is simulated, errors declared so that everything is said at a stated
# risk. The first table gives, of each command, the share of each stage, sampled by `perf` (a stage's share counts what
# it calls; stages are parts of functions' names, below); the second bytes read, rows walked, rows that went through the
# filters, and linear programs solved, counted by a debugger. Needs perf, gdb and Python 3; PROGRAM with its symbols, as
# built. Nothing else should run beside it.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '3,13s/^# \{0,1\}//p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
program=$(realpath "$1")
seconds=${2:-900}
for tool in perf gdb python3; do
  command -v $tool >/dev/null || {
    echo "profile.sh: no $tool: expected it (Debian: linux-perf, gdb, python3)" >&2
    exit 2
  }
done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
exec python3 "$here/profile_table.py" "$program" "$seconds" "$folder"
