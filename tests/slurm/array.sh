#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# A small fleet as an array of three Slurm jobs and a merge: result files are those of one undisturbed thread, byte for
# byte; and a shard that was lost is told by name and made good by submitting it alone.
#
#   tests/slurm/array.sh WHEELWRIGHT MAKE_FLEET SCRATCH
#
# Exit code 77: there is no Slurm here.
set -eu
if [ "$#" -eq 3 ]; then
  here=$(cd "$(dirname "$0")" && pwd)
  program=$(realpath "$1") make_fleet=$(realpath "$2")
  rm -rf "$3"
  mkdir -p "$3"
  cd "$3"
  exec "$here/../../tests/campaigns/slurm_node.sh" slurm "$here/array.sh" inside "$program" "$make_fleet" \
    "$here/../../tools/slurm"
fi

# From here on beside a Slurm, in SCRATCH.
export WHEELWRIGHT="$2"
make_fleet=$3 jobs=$4
export SBATCH_OUTPUT=job-%j.out
fail() {
  echo "slurm array: $*" >&2
  cat job-*.out >&2 || true
  exit 1
}
same() {
  for file in fleet.json fleet.csv pooled_prior.yaml report.html; do
    cmp "one/$file" "$1/$file" || fail "$1: $file is not that of one thread"
  done
}

"$make_fleet" fleet --robots 6 --seconds 10
"$WHEELWRIGHT" fleet fleet/fleet.csv --robot fleet/robot.yaml --out one --threads 1 --quiet
set -- fleet/fleet.csv --robot fleet/robot.yaml --out

WAIT=1 "$jobs/submit.sh" 3 "$@" array || fail "the merge ended with $?"
same array

# Two of three shards: the merge tells which is missing, and writes no result.
sbatch --quiet --wait --export=ALL,SHARDS=3 --array=1,3 "$jobs/fleet_array.sbatch" "$@" lost ||
  fail "shards 1 and 3: $?"
status=0
sbatch --quiet --wait --output=merge.out "$jobs/fleet_merge.sbatch" "$@" lost || status=$?
[ "$status" -eq 2 ] || fail "a merge with a shard missing ended with $status, not 2"
grep -q '2/3' merge.out || fail "the merge does not name the missing shard: $(cat merge.out)"
[ ! -e lost/fleet.json ] || fail "a merge with a shard missing wrote fleet.json"
sbatch --quiet --wait --export=ALL,SHARDS=3 --array=2 "$jobs/fleet_array.sbatch" "$@" lost || fail "shard 2: $?"
sbatch --quiet --wait "$jobs/fleet_merge.sbatch" "$@" lost || fail "the second merge ended with $?"
same lost
echo "slurm array: 3 shards and the merge, and a shard made good: the files of one thread, byte for byte"
