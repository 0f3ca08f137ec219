#!/bin/bash
# A study's shards on engines that exist, with kills, against the study made in one go:
#
#   scale_out.sh parallel TWILIGHT     GNU parallel, each job's first attempts killed at random times
#   scale_out.sh slurm TWILIGHT        a Slurm array on one_node_slurm.sh, tasks killed and requeued
#
# Whatever is killed, the merged study has the same files with the same bytes: nothing is lost,
# nothing is there twice. Exit code 77 and a reason where an engine is missing. SEED=N repeats the
# random times.
set -euo pipefail

engine=$1
twilight=$(realpath "$2")
here=$(cd "$(dirname "$0")" && pwd)
shards=4
seed=${SEED:-$RANDOM}
RANDOM=$seed

fail() {
  echo "FAILED (SEED=$seed): $*" >&2
  exit 1
}

skip() {
  echo "SKIP: $*"
  exit 77
}

write_study() {
  # 8 atmospheres, 16 cases; a shard of two atmospheres takes about half a second.
  cat >study.toml <<'END'
[atmosphere]
layers = 10
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 550, 650]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
sunlight_nodes = 64
view_interpolation = false
[outputs]
quantities = ["texture", "illuminance"]
texture_size = 8
picture_size = 16
[[axis]]
key = "earth.ground_albedo"
values = [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
[[axis]]
key = "sun.elevation_deg"
values = [9, -4]
END
}

# The merged folder is the whole one, file by file. What the engine adds (study.sbatch, its logs)
# does not count.
expect_same() {
  "$twilight" study --merge out --quiet || fail "twilight study --merge out"
  diff -r --exclude=study.sbatch whole out >differences || fail "$(head -n 5 differences)"
  echo "merged study and single run: the same $(find whole -type f | wc -l) files"
}

# One attempt of a shard: the first two of each are killed after 0.02 to 0.4 s.
flaky_shard() {
  local shard=$1 attempt
  echo >>"attempts.$shard"
  attempt=$(wc -l <"attempts.$shard")
  "$twilight" study study.toml -o out --shard "$shard/$shards" --threads 1 --quiet &
  local process=$!
  if ((attempt <= 2)); then
    # Each job has its own course of random numbers.
    RANDOM=$((seed + 7919 * shard + attempt))
    sleep "0.$(printf %03d $((20 + RANDOM % 380)))"
    kill -KILL "$process" 2>/dev/null || true
  fi
  local code=0
  wait "$process" || code=$?
  if ((code == 137)); then echo "shard $shard, attempt $attempt" >>kills; fi
  return "$code"
}

with_parallel() {
  export PARALLEL_HOME=$PWD/parallel twilight shards seed
  export -f flaky_shard
  : >kills
  parallel --will-cite --jobs 2 --retries 6 --halt soon,fail=1 flaky_shard ::: \
    $(seq "$shards") 2>parallel.err || fail "$(tail -n 3 parallel.err)"
  echo "killed $(wc -l <kills) times"
  [[ -s kills ]] || fail "no job was killed: the shards are too short for this machine"
  expect_same
}

# Jobs of the array that run now.
running() { squeue --noheader --array --states=RUNNING --job="$1" --format=%i 2>/dev/null; }

waiting() { squeue --noheader --array --job="$1" --format=%i 2>/dev/null; }

inside_slurm() {
  "$twilight" study study.toml -o out --slurm "$shards" --threads 1 --quiet ||
    fail "twilight study --slurm"
  local job kills=0 requeues=0 round task= deadline=$((SECONDS + 120))
  job=$(sbatch --parsable --output=shard_%a.log --open-mode=append out/study.sbatch)
  for ((round = 0; round < 4; ++round)); do
    while [[ -z $(running "$job") && -n $(waiting "$job") ]] && ((SECONDS < deadline)); do
      sleep 0.05
    done
    sleep "0.$((1 + RANDOM % 3))"
    task=$(running "$job" | shuf -n 1 --random-source=<(yes "$RANDOM"))
    [[ -n $task ]] || continue
    if ((round % 2 == 0)); then
      scancel --signal=KILL --full "$task" 2>/dev/null && kills=$((kills + 1))
    else
      scontrol requeue "$task" 2>/dev/null && requeues=$((requeues + 1))
    fi
  done
  while [[ -n $(waiting "$job") ]] && ((SECONDS < deadline)); do sleep 0.2; done
  [[ -z $(waiting "$job") ]] || fail "job $job does not end: $(squeue --noheader)"
  echo "array job $job: $kills tasks killed, $requeues requeued"
  ((kills + requeues > 0)) || fail "no task was killed: the shards are too short for this machine"
  # The same array again makes what is missing.
  sbatch --wait --output=shard_%a.log --open-mode=append out/study.sbatch ||
    fail "$(tail -n 3 shard_*.log)"
  expect_same
}

if [[ $engine == inside-slurm ]]; then  # in the test's folder, on the cluster
  inside_slurm
  exit 0
fi

"$twilight" study --help >/dev/null 2>&1 || skip "this program has no command study"
[[ $engine != parallel ]] || parallel --version 2>/dev/null | grep -q "GNU parallel" ||
  skip "GNU parallel is not installed"

folder=$(mktemp -d "${TMPDIR:-/tmp}/scale-out-XXXXXX")
trap 'rm -rf "$folder"' EXIT
cd "$folder"
write_study
"$twilight" study study.toml -o whole --quiet || fail "the single run"
case $engine in
  parallel) with_parallel ;;
  slurm) SEED=$seed "$here/one_node_slurm.sh" "$here/scale_out.sh" inside-slurm "$twilight" ;;
  *) fail "no engine '$engine'" ;;
esac
