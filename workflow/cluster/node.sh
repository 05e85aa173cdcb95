#!/usr/bin/env bash
# `node.sh start` makes this machine a Slurm cluster of one node, for trying profiles/slurm; `node.sh
# stop` ends it. For root on Debian or Ubuntu, with no Slurm of its own; no systemd is needed.
set -euo pipefail
cd "$(dirname "$0")/../.."
. workflow/setup/system.sh
CONF=/etc/slurm/slurm.conf
MARK="# one node for trying, by workflow/cluster/node.sh"
STATE=/var/lib/squeal-slurm

running() { [ -f "$1" ] && kill -0 "$(cat "$1")" 2>/dev/null; }

stop() {
    for name in slurmd slurmctld munged; do
        if running "$STATE/$name.pid"; then kill "$(cat "$STATE/$name.pid")"; fi
    done
    if [ -f "$CONF" ] && grep -qF "$MARK" "$CONF"; then rm -f "$CONF"; fi
}

start() {
    if [ -f "$CONF" ] && ! grep -qF "$MARK" "$CONF"; then
        echo "node.sh: $CONF is not ours; this machine has a Slurm already" >&2
        exit 1
    fi
    if ! command -v slurmctld slurmd munged sbatch >/dev/null; then
        may_be_root && apt_install munge slurmctld slurmd slurm-client
    fi
    stop
    mkdir -p "$STATE/spool" "$STATE/save" "$STATE/munge" /etc/slurm
    [ -f /etc/munge/munge.key ] || dd if=/dev/urandom of=/etc/munge/munge.key bs=1024 count=1 2>/dev/null
    chown -R munge: "$STATE/munge" /etc/munge/munge.key
    chmod 400 /etc/munge/munge.key
    chmod 755 "$STATE" "$STATE/munge"
    cat >"$CONF" <<END
$MARK
ClusterName=one
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$STATE/munge/socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
MinJobAge=600
SlurmctldTimeout=60
SlurmdTimeout=60
StateSaveLocation=$STATE/save
SlurmdSpoolDir=$STATE/spool
SlurmctldPidFile=$STATE/slurmctld.pid
SlurmdPidFile=$STATE/slurmd.pid
SlurmctldLogFile=$STATE/slurmctld.log
SlurmdLogFile=$STATE/slurmd.log
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(free -m | awk '/^Mem/ {print int($2 * 0.9)}')
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
    runuser -u munge -- munged --force --socket="$STATE/munge/socket" --pid-file="$STATE/munge/pid" \
        --log-file="$STATE/munge/log" --seed-file="$STATE/munge/seed"
    cp "$STATE/munge/pid" "$STATE/munged.pid"
    slurmctld -c
    slurmd
    for _ in $(seq 100); do
        if sinfo -h -o %T 2>/dev/null | grep -q idle; then
            echo "node.sh: $(hostname -s) is idle, $(nproc) cores"
            return
        fi
        sleep 0.1
    done
    echo "node.sh: the node does not come up; see $STATE/*.log" >&2
    exit 1
}

case ${1-} in
start) start ;;
stop) stop ;;
*) echo "node.sh start | stop" >&2 && exit 2 ;;
esac
