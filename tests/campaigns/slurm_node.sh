#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Runs a command beside a Slurm of one node: this machine, for as long as the command takes.
#
#   tests/campaigns/slurm_node.sh DIR COMMAND [ARGUMENT...]
#
# DIR gets everything: configuration, munge key, state and logs of the daemons. They listen on 127.0.0.1 alone, on ports
# that are free; no system service, account or file is touched. COMMAND runs with SLURM_CONF set, once the node is idle;
# then its jobs are cancelled and the daemons stopped, whatever came of it. Accounting, control groups and limits of
# memory are off. Run as root, as slurmd asks; a container will do.
#
# Exit code: COMMAND's; 77 where Slurm or munge is missing (Debian: apt install slurm-wlm munge); 2 where it does not
# start.
set -eu
PATH=$PATH:/usr/sbin:/sbin
dir=${1:?usage: tests/campaigns/slurm_node.sh DIR COMMAND [ARGUMENT...]}
shift
[ $# -gt 0 ] || { echo "slurm node: expected a command" >&2; exit 2; }
for program in slurmctld slurmd sinfo munged python3; do
  command -v $program >/dev/null || {
    echo "slurm node: no $program (Debian: apt install slurm-wlm munge)" >&2
    exit 77
  }
done
[ "$(id -u)" -eq 0 ] || { echo "slurm node: only root may start a node" >&2; exit 77; }

mkdir -p "$dir"
dir=$(cd "$dir" && pwd)
rm -rf "$dir/state" "$dir/spool" "$dir/munge" "$dir"/*.log
mkdir -p "$dir/state" "$dir/spool" "$dir/munge"
(umask 077 && head -c 64 /dev/urandom >"$dir/munge/key")
node=$(hostname -s)
ports=$(python3 -c '
import socket
open_sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
print(*(s.getsockname()[1] for s in open_sockets))')

cat >"$dir/slurm.conf" <<END
ClusterName=wheelwright
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=${ports% *}
SlurmdPort=${ports#* }
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$dir/munge/socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
SlurmdParameters=config_overrides
ReturnToService=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc)
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
END
: >"$dir/cgroup.conf"
export SLURM_CONF="$dir/slurm.conf"

daemons=''
# Stops the daemons, the last one first, after the jobs; a daemon that does not go is killed.
finish() {
  status=$?
  trap - EXIT INT TERM
  scancel --quiet --user=root 2>/dev/null || true
  for _ in $(seq 50); do
    [ -n "$(squeue --noheader 2>/dev/null)" ] || break
    sleep 0.2
  done
  for pid in $daemons; do
    kill "$pid" 2>/dev/null || true
    for _ in $(seq 50); do
      kill -0 "$pid" 2>/dev/null || break
      sleep 0.1
    done
    kill -9 "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
  done
  exit "$status"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

start() {
  log=$dir/$1.log
  "$@" >>"$log.out" 2>&1 &
  daemons="$! $daemons"
}

start munged --foreground --force --socket="$dir/munge/socket" --key-file="$dir/munge/key" \
  --pid-file="$dir/munge/pid" --seed-file="$dir/munge/seed" --log-file="$dir/munge/log"
for _ in $(seq 50); do
  [ -S "$dir/munge/socket" ] && break
  sleep 0.1
done
start slurmctld -D -f "$SLURM_CONF"
start slurmd -D -f "$SLURM_CONF" -N "$node"
for _ in $(seq 150); do
  [ "$(sinfo --noheader --format=%t 2>/dev/null)" != idle ] || break
  sleep 0.2
done
if [ "$(sinfo --noheader --format=%t 2>/dev/null)" != idle ]; then
  echo "slurm node: the node is not idle after half a minute; the end of the logs in $dir:" >&2
  tail -n 5 "$dir"/*.log "$dir"/*.log.out >&2 || true
  exit 2
fi
"$@"
