#!/usr/bin/env bash
# Searches each door (or those named) for so many seconds: fuzz/run.sh 60 [DOOR ...]. Needs a nightly toolchain and cargo-fuzz.
# KINOCUE_SANITIZER=address looks for what is wrong with memory as well: far fewer runs, and a build that did not end in 45 minutes beside others.
# Begins with what is true at the door, with what earlier searches left in fuzz/seeds, and with what the last one here found (fuzz/corpus).
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:?fuzz/run.sh SECONDS [DOOR ...]}
shift
KINOCUE_SEEDS=$PWD/fuzz/corpus cargo test --quiet --locked --test doors each_door_has_beginnings >/dev/null
mapfile -t doors < <(if [ $# -gt 0 ]; then printf '%s\n' "$@"; else ls fuzz/corpus; fi)
mkdir -p fuzz/artifacts
found=0
for door in "${doors[@]}"; do
  log=$(mktemp)
  mkdir -p "fuzz/corpus/$door" "fuzz/seeds/$door"
  KINOCUE_DOOR=$door cargo +nightly fuzz run --release --sanitizer "${KINOCUE_SANITIZER:-none}" --codegen-units 16 door "fuzz/corpus/$door" "fuzz/seeds/$door" -- -max_total_time="$seconds" -max_len=65536 \
    -timeout=10 -rss_limit_mb=2048 -artifact_prefix="fuzz/artifacts/$door-" -print_final_stats=1 >"$log" 2>&1 || found=1
  rmdir --ignore-fail-on-non-empty "fuzz/seeds/$door"
  printf '%-14s %s\n' "$door" "$(awk '/number_of_executed_units/ { runs = $2 } /cov:/ { for (i = 1; i < NF; i++) { if ($i == "cov:") cov = $(i + 1); if ($i == "ft:") ft = $(i + 1) } }
    END { print runs " runs, " cov " edges, " ft " features" }' "$log")"
  grep -m1 -A3 -E 'panicked at|ERROR: libFuzzer|SUMMARY|error(\[|:)' "$log" || true
  rm -f "$log"
done
exit "$found"
