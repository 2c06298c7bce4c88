#!/usr/bin/env bash
# Builds the package of the last commit twice, in two folders that have nothing in common, under another umask, language and
# time zone, and says whether both are equal to the bit: 0 if so; 1 if not, with the files that differ. Needs git, and as
# much time as two builds take (20 minutes on two cores).
#
#   systemd/reproduce.sh [PACKAGE.deb]      with a package, builds once, and compares with that: whoever was given one can try it
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."
given=${1:+$(realpath "$1")}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

build() { # FOLDER: prints the package that was built there
  mkdir -p "$1"
  git archive HEAD | tar -x -C "$1"
  env -u CARGO_TARGET_DIR "$1/systemd/build-deb.sh" >&2
  ls "$1"/target/debian/*.deb
}

first=${given:-$(build "$folder/a")}
second=$(umask 077 && TZ=Pacific/Kiritimati LC_ALL=C build "$folder/of another depth/b")
sha256sum "$first" "$second"
if cmp "$first" "$second"; then
  echo "equal to the bit"
else
  dpkg-deb -R "$first" "$folder/first"
  dpkg-deb -R "$second" "$folder/second"
  diff -rq "$folder/first" "$folder/second" || true
  exit 1
fi
