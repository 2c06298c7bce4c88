#!/usr/bin/env bash
# Keeps of each door (or those named) the smallest octets that reach what a search has reached, at most 7 kB of them: fuzz/corpus into
# fuzz/seeds, which the tests go through. fuzz/keep.sh [DOOR ...], after fuzz/run.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
mapfile -t doors < <(if [ $# -gt 0 ]; then printf '%s\n' "$@"; else ls fuzz/corpus; fi)
for door in "${doors[@]}"; do
  least=$(mktemp -d)
  KINOCUE_DOOR=$door cargo +nightly fuzz run --release --sanitizer "${KINOCUE_SANITIZER:-none}" --codegen-units 16 door "$least" "fuzz/corpus/$door" -- -merge=1 -max_len=1024 -rss_limit_mb=2048 >/dev/null 2>&1
  rm -rf "fuzz/seeds/$door"
  mkdir -p "fuzz/seeds/$door"
  octets=0
  # From small to large: the more of them, the more is reached.
  while read -r size file; do
    octets=$((octets + size))
    if [ "$octets" -gt 7000 ]; then break; fi
    cp "$file" "fuzz/seeds/$door/$(basename "$file" | cut -c1-12)"
  done < <(find "$least" -type f -printf '%s %p\n' | sort -n)
  rm -rf "$least"
  printf '%-14s %s files\n' "$door" "$(find "fuzz/seeds/$door" -type f | wc -l)"
done
