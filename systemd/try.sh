#!/usr/bin/env bash
# Tries kinocue.service under a real systemd, in a container (container.sh): eight simulated controllers, everything on loopback.
# Prints what took how long; ends with 1 where something is not as it should be, with 77 where it cannot be tried.
#
#   systemd/try.sh [PROGRAM]      PROGRAM: target/release/kinocue
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=container.sh
. "$here/container.sh"
program=$(realpath "${1:-$here/../target/release/kinocue}")
[ -x "$program" ] || cannot "no program at $program: cargo build --release"

container_make
install -D -m 755 "$program" "$root/usr/bin/kinocue"
install -D -m 644 "$here/kinocue.service" "$root/usr/lib/systemd/system/kinocue.service"
install -D -m 644 "$here/kinocue.sysusers" "$root/usr/lib/sysusers.d/kinocue.conf"
install -D -m 644 "$here/kinocue.tmpfiles" "$root/usr/lib/tmpfiles.d/kinocue.conf"
install -m 644 "$here/simulated.toml" "$root/trial/simulated.toml"
install -m 644 "$here/../cues/bench-ride.csv" "$root/trial/ride.csv"
install -m 755 "$here/try-inside.sh" "$root/trial/inside.sh"
container_run 180 "/bin/bash /trial/inside.sh"
