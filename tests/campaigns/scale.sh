#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# How the fleet command scales on this machine, and whether sharing out changes a byte of its results.
#
#   tests/campaigns/scale.sh SCRATCH [ROBOTS [SECONDS]]     500 robots of 30 s each by default
#
# Needs a release build with the targets wheelwright and wheelwright-make-fleet, and an idle machine. Makes a fleet in
# SCRATCH (which must not exist), examines it with 1 and 2 threads, 2 and 4 ranks of MPI, 7 shards and a merge, and once
# more with kill -9 in the middle, prints the seconds of each, and ends with 1 where a result file differs.
set -eu
scratch=${1:?usage: tests/campaigns/scale.sh SCRATCH [ROBOTS [SECONDS]]}
robots=${2:-500}
length=${3:-30}
bin=$(cd "$(dirname "$0")/../.." && pwd)/build/bin
[ ! -e "$scratch" ] || { echo "scale: $scratch is there already: expected a new directory" >&2; exit 2; }
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
mkdir -p "$scratch"
cd "$scratch"
"$bin/wheelwright-make-fleet" made --robots "$robots" --seconds "$length" >/dev/null

# examine DIR PREFIX... -- OPTION...: into DIR; its exit code of 1 says that some robot stands out.
examine() {
  out=$1
  shift
  prefix=''
  while [ "$1" != -- ]; do prefix="$prefix $1"; shift; done
  shift
  # shellcheck disable=SC2086
  $prefix "$bin/wheelwright" fleet made/fleet.csv --robot made/robot.yaml --out "$out" --quiet "$@" || [ $? -eq 1 ]
}
seconds() { date +%s.%N; }
timed() {
  what=$1
  shift
  from=$(seconds)
  examine "$@"
  to=$(seconds)
  awk -v what="$what" -v from="$from" -v to="$to" -v robots="$robots" -v one="${one:-0}" 'BEGIN {
    took = to - from; printf "%-12s %7.2f s  %6.2f ms a robot", what, took, 1000 * took / robots;
    if (one > 0) printf "  %5.2f times", one / took; print "" }'
  took=$(awk -v from="$from" -v to="$to" 'BEGIN { print to - from }')
}
different=0
same() {
  for file in fleet.json fleet.csv pooled_prior.yaml report.html; do
    if [ -e "one/$file" ] && ! cmp -s "one/$file" "$1/$file"; then
      echo "scale: $1/$file differs from one/$file" >&2
      different=1
    fi
  done
}

timed "1 thread" one -- --threads 1
one=$took
timed "2 threads" two -- --threads 2
same two
if command -v mpirun >/dev/null; then
  timed "2 ranks" ranks2 mpirun -n 2 --oversubscribe --bind-to none -- --threads 1
  same ranks2
  timed "4 ranks" ranks4 mpirun -n 4 --oversubscribe --bind-to none -- --threads 1
  same ranks4
fi
from=$(seconds)
for shard in 1 2 3 4 5 6 7; do
  examine shards -- --shard "$shard/7"
done
examine shards -- --merge
to=$(seconds)
awk -v from="$from" -v to="$to" 'BEGIN { printf "%-12s %7.2f s\n", "7 shards", to - from }'
same shards

half=$(awk -v one="$one" 'BEGIN { print one / 2 }')
"$bin/wheelwright" fleet made/fleet.csv --robot made/robot.yaml --out killed --quiet --threads 1 &
pid=$!
sleep "$half"
kill -9 "$pid"
wait "$pid" 2>/dev/null || true
timed "after kill -9" killed -- --threads 1
same killed
[ "$different" = 0 ] && echo "all results are the same, byte for byte"
exit "$different"
