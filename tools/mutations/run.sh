#!/usr/bin/env bash
# Breaks a copy of the program in one place after another, and says which test notices: tools/mutations/run.sh [NAME ...].
# Each patch says what it breaks, and in which suites that has to be noticed. All of them go into one copy, each behind a switch, so
# that there is one build. What no suite notices is named, and ends this with 1.
set -euo pipefail
cd "$(dirname "$0")/../.."
patches=$PWD/tools/mutations
work=$PWD/target/mutations
rm -rf "$work/copy"
mkdir -p "$work/copy"
git ls-files -z | xargs -0 cp --parents --preserve=timestamps -t "$work/copy"
cd "$work/copy"
for patch in "$patches"/*.patch; do patch --quiet -p1 <"$patch"; done
export CARGO_TARGET_DIR=$work/target CARGO_TERM_COLOR=never
names=("$@")
if [ $# -eq 0 ]; then mapfile -t names < <(cd "$patches" && ls -- *.patch | sed 's/\.patch$//' | grep -vx switch); fi

suites_of() { sed -n 's/^Suite: //p' "$patches/$1.patch"; }

# Runs a suite; says how it ended.
try() {
  local code=0
  # shellcheck disable=SC2086 # a suite is words
  KINOCUE_MUTATION=$1 timeout "$3" cargo test --quiet --locked $2 >"$work/log" 2>&1 || code=$?
  return "$code"
}

while read -r suite; do
  try none "$suite" 1800 || { echo "fails unbroken: $suite"; tail -30 "$work/log"; exit 1; }
done < <(for name in "${names[@]}"; do suites_of "$name"; done | sort -u)

survivors=0
for name in "${names[@]}"; do
  caught=
  while read -r suite; do
    code=0
    try "$name" "$suite" 300 || code=$?
    if [ "$code" -eq 124 ]; then caught="a hang of $suite"; break; fi
    if [ "$code" -ne 0 ]; then
      mapfile -t tests < <(sed -n 's/^---- \(.*\) stdout ----$/\1/p' "$work/log" | sort -u)
      caught="${tests[0]:-the end of the whole suite} ($suite, ${#tests[@]} in all)"
      break
    fi
  done < <(suites_of "$name")
  printf '%-28s %s\n' "$name" "${caught:-SURVIVES}"
  if [ -z "$caught" ]; then survivors=$((survivors + 1)); fi
done
exit $((survivors > 0))
