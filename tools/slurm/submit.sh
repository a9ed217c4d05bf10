#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# A fleet as an array of Slurm jobs, then the merge:
#
#   tools/slurm/submit.sh N LIST --robot robot.yaml --out OUT
#
# N is the number of shards; the rest are the arguments of `wheelwright fleet`. Prints the numbers of both jobs; the
# merge begins when all shards have ended. Environment: SBATCH_OPTIONS for both jobs (partition, account, time, memory;
# words parted by spaces), WAIT=1 to come back when the merge has ended, with its exit code, WHEELWRIGHT for a program
# that is not in PATH.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
case ${1:-} in
  '' | *[!0-9]* | 0*) echo "usage: tools/slurm/submit.sh N LIST --robot robot.yaml --out OUT" >&2; exit 2 ;;
esac
shards=$1
shift
[ $# -gt 0 ] || { echo "submit: expected the arguments of wheelwright fleet" >&2; exit 2; }
export SHARDS="$shards"
status=0
# shellcheck disable=SC2086
array=$(sbatch --parsable ${SBATCH_OPTIONS:-} --array="1-$shards" "$here/fleet_array.sbatch" "$@")
array=${array%%;*}
echo "shards: $array"
# shellcheck disable=SC2086
merge=$(sbatch --parsable ${SBATCH_OPTIONS:-} --dependency="afterany:$array" ${WAIT:+--wait} \
  "$here/fleet_merge.sbatch" "$@") ||
  status=$?
echo "merge: ${merge%%;*}"
exit "$status"
