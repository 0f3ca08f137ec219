#!/bin/bash
# A Slurm cluster of one node, this machine, that lives as long as one command:
#
#   one_node_slurm.sh [COMMAND [ARGUMENT ...]]
#
# starts munged, slurmctld and slurmd in a private folder with a slurm.conf of their own, on free
# ports, runs the command (which finds the cluster through SLURM_CONF; without one, an array job
# that writes files), and stops the daemons again whatever happens. The exit code is the command's;
# 77 and one line where the daemons are missing or cannot start. Any user may run it; jobs run as
# that user. An installed and running Slurm is not touched.
set -euo pipefail

skip() {
  echo "SKIP: $*"
  exit 77
}

for program in munged slurmctld slurmd; do
  PATH=$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null || skip "$program is not installed"
done
for program in sbatch squeue scancel scontrol sinfo; do
  command -v "$program" >/dev/null || skip "$program is not installed"
done
PATH=$PATH:/usr/sbin:/sbin

folder=$(mktemp -d "${TMPDIR:-/tmp}/one-node-slurm-XXXXXX")
chmod 0755 "$folder"  # munged wants its socket's folder open to all
daemons=()

# Every process that belongs to this cluster, its jobs included, carries the folder's name.
members() {
  local process
  for process in /proc/[0-9]*; do
    [[ ${process#/proc/} == "$$" || ${process#/proc/} == "$BASHPID" ]] && continue
    if tr '\0' '\n' 2>/dev/null <"$process/environ" | grep -qx "ONE_NODE_SLURM=$folder"; then
      echo "${process#/proc/}"
    fi
  done 2>/dev/null
}

ended_within() {  # SECONDS PID: whether it ends
  local tenths=$((10 * $1))
  while ((tenths-- > 0)); do
    [[ -d /proc/$2 && $(cut -d' ' -f3 /proc/"$2"/stat 2>/dev/null) != Z ]] || return 0
    sleep 0.1
  done
  return 1
}

stop_cluster() {
  trap '' INT TERM HUP
  if ((${#daemons[@]} > 0)); then
    timeout 5 scancel --signal=KILL --full --quiet --user="$(id -un)" 2>/dev/null || true
    timeout 5 scancel --quiet --user="$(id -un)" 2>/dev/null || true
  fi
  local i
  for ((i = ${#daemons[@]} - 1; i >= 0; --i)); do
    kill -TERM "${daemons[i]}" 2>/dev/null || true
    ended_within 5 "${daemons[i]}" || kill -KILL "${daemons[i]}" 2>/dev/null || true
  done
  local process
  for process in $(members); do kill -KILL "$process" 2>/dev/null || true; done
  wait 2>/dev/null || true
  [[ -n ${ONE_NODE_SLURM_LOGS:-} ]] && cp "$folder"/*.log "$ONE_NODE_SLURM_LOGS"/ 2>/dev/null
  rm -rf "$folder"
}
trap stop_cluster EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

free_port() {
  local port
  while :; do
    port=$((20000 + RANDOM % 30000))
    (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || break
  done
  echo "$port"
}

export ONE_NODE_SLURM=$folder SLURM_CONF=$folder/slurm.conf
# What an outer Slurm job says would mislead the inner one.
for variable in $(compgen -e); do
  [[ $variable == SLURM_* && $variable != SLURM_CONF || $variable == SBATCH_* ]] && unset "$variable"
done

user=$(id -un)
node=$(hostname -s)
processors=$(nproc)
memory_mib=$(awk '/^MemTotal:/ { print int($2 / 1024) }' /proc/meminfo)
mkdir "$folder"/{state,spool}
cat >"$folder/slurm.conf" <<END
ClusterName=onenode
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=$user
SlurmdUser=$user
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
AuthType=auth/munge
# cred_expire: how long a requeued job waits.
AuthInfo=socket=$folder/munge.socket,cred_expire=5
CredType=cred/munge
# No control groups: containers and users may not make any.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
SwitchType=switch/none
MailProg=/bin/true
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0
ReturnToService=2
KillWait=2
UnkillableStepTimeout=10
JobRequeue=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=$processors RealMemory=$memory_mib State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
# slurmd loads a plugin all the same. From 23.02 on there is one that does nothing; that of version
# 1 asks for nothing while no other plugin uses it.
version=$(slurmd -V | grep -o '[0-9]*\.[0-9]*' | head -n 1)
if [[ $(printf '%s\n' 23.02 "$version" | sort -V | head -n 1) == 23.02 ]]; then
  echo "CgroupPlugin=disabled" >"$folder/cgroup.conf"
else
  mkdir "$folder/cgroup"
  printf '%s\n' "CgroupPlugin=cgroup/v1" "CgroupMountpoint=$folder/cgroup" "CgroupAutomount=no" >"$folder/cgroup.conf"
fi

start() {  # NAME COMMAND...: in the background, its words to NAME.out
  local name=$1
  shift
  "$@" >"$folder/$name.out" 2>&1 </dev/null &
  daemons+=($!)
}

last_words() {  # NAME: what a daemon said last, in one line
  cat "$folder/$1".{log,out} 2>/dev/null | grep -v '^$' | tail -n 1
}

dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 status=none
chmod 0600 "$folder/munge.key"
start munged munged --foreground --force --num-threads=2 --socket="$folder/munge.socket" \
  --key-file="$folder/munge.key" --log-file="$folder/munged.log" --pid-file="$folder/munged.pid" \
  --seed-file="$folder/munged.seed"
for ((i = 0; i < 50; ++i)); do
  [[ -S $folder/munge.socket ]] && break
  sleep 0.1
done
[[ -S $folder/munge.socket ]] || skip "munged does not start: $(last_words munged)"

start slurmctld slurmctld -D -i -f "$SLURM_CONF"
start slurmd slurmd -D -f "$SLURM_CONF"
for ((i = 0; i < 150; ++i)); do
  [[ $(timeout 2 sinfo --noheader --format=%T 2>/dev/null) == idle ]] && break
  for ((d = 0; d < ${#daemons[@]}; ++d)); do
    if ! kill -0 "${daemons[d]}" 2>/dev/null; then
      names=(munged slurmctld slurmd)
      skip "${names[d]} does not start: $(last_words "${names[d]}")"
    fi
  done
  sleep 0.1
done
[[ $(timeout 2 sinfo --noheader --format=%T 2>/dev/null) == idle ]] ||
  skip "the node is not idle after 15 s: $(last_words slurmd)"
echo "cluster: $(scontrol --version), node $node, $processors processors, in $folder"

if (($# > 0)); then
  "$@" &
else
  (
    cd "$folder"
    cat >array.sbatch <<'END'
#!/bin/bash
#SBATCH --array=1-4
#SBATCH --output=task_%a.log
echo "task $SLURM_ARRAY_TASK_ID of job $SLURM_ARRAY_JOB_ID" >"task_$SLURM_ARRAY_TASK_ID.txt"
END
    sbatch --wait array.sbatch
    cat task_*.txt
    [[ $(ls task_*.txt | wc -l) == 4 ]]
  ) &
fi
wait $!
