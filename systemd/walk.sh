#!/usr/bin/env bash
# A technician's day, from the package to the report: installs the .deb in a container (container.sh) that has nothing else of
# kinocue, follows the README's "Running a hall" word by word with two rows of simulated seats, leads shows as the tablet's page
# does, pulls a plug, stops, crashes, upgrades, and holds all of it against the frames that passed. Prints a table; ends with 1
# where a line of it failed, with 77 where it cannot be tried. Takes three minutes, and the page in chromium where there is one.
#
#   systemd/walk.sh [--no-build | PACKAGE.deb]      --no-build takes target/dist/kinocue as it is
#
# Needs python3 (3.11 or later) beside what container.sh needs. WALK_KEEP=FOLDER keeps the capture and what was said there.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=container.sh
. "$here/container.sh"
case ${1:-} in
  *.deb) package=$(realpath "$1") ;;
  *) "$here/build-deb.sh" "$@" >&2; package=$(ls -t "$here"/../target/debian/kinocue_*.deb | head -n 1) ;;
esac

keep() {
  if [ -n "${WALK_KEEP:-}" ]; then
    mkdir -p "$WALK_KEEP"
    cp "$root"/trial/{loopback.pcap,*.csv,result,errors} "$WALK_KEEP" || true
  fi
  container_remove
}

container_make
trap keep EXIT
rm -f "$root/etc/dpkg/dpkg.cfg.d/01_nodoc" # which would leave out the README
cp "$package" "$root/trial/"
cp -r "$here/walk" "$root/trial/walk"
chmod 755 "$root/trial"
container_run 480 "/usr/bin/python3 -B /trial/walk/walk.py" --tmpfs="$(realpath "$here/..")"
