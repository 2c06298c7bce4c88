#!/usr/bin/env bash
# Tries kinocue.service under a real systemd: a throw-away container over this machine's own root file system, of which
# nothing is changed. Eight simulated controllers, everything on loopback in a network of its own. Prints what took how
# long; ends with 1 where something is not as it should be, with 77 where it cannot be tried.
#
#   systemd/try.sh [PROGRAM]      PROGRAM: target/release/kinocue
#
# Needs root, overlayfs, and of Debian: systemd, systemd-container.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
program=$(realpath "${1:-$here/../target/release/kinocue}")

cannot() { echo "try.sh: $*" >&2; exit 77; }
[ "$(id -u)" -eq 0 ] || cannot "needs root, for a container and its file systems"
command -v systemd-nspawn > /dev/null || cannot "needs systemd-nspawn: apt-get install systemd-container"
[ -x "$program" ] || cannot "no program at $program: cargo build --release"

folder=$(mktemp -d /tmp/kinocue-try.XXXXXX)
mount -t tmpfs -o size=512m kinocue-try "$folder"
clean() {
  if mountpoint -q "$folder/root"; then umount "$folder/root"; fi
  umount "$folder"
  rmdir "$folder"
}
trap clean EXIT
mkdir "$folder"/{upper,work,root}
root=$folder/root
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/upper,workdir=$folder/work" "$root" ||
  cannot "needs overlayfs over /"

# As the package does it, and as if nothing had been there before.
rm -rf "$root"/{etc,run,var/lib,var/log}/kinocue
install -D -m 755 "$program" "$root/usr/bin/kinocue"
install -D -m 644 "$here/kinocue.service" "$root/usr/lib/systemd/system/kinocue.service"
install -D -m 644 "$here/kinocue.sysusers" "$root/usr/lib/sysusers.d/kinocue.conf"
install -D -m 644 "$here/kinocue.tmpfiles" "$root/usr/lib/tmpfiles.d/kinocue.conf"
install -D -m 644 "$here/simulated.toml" "$root/trial/simulated.toml"
install -D -m 644 "$here/../cues/bench-ride.csv" "$root/trial/ride.csv"
install -D -m 755 "$here/try-inside.sh" "$root/trial/inside.sh"

echo "0123456789abcdef0123456789abcdef" > "$root/etc/machine-id"
units=$root/etc/systemd/system
mkdir -p "$units"
for unit in networking systemd-networkd systemd-resolved chrony nats-server mosquitto keepalived prometheus; do
  ln -sf /dev/null "$units/$unit.service"
done
cat > "$units/trial.service" << 'END'
[Unit]
After=basic.target
Requires=basic.target

[Service]
Type=oneshot
ExecStart=-/bin/bash /trial/inside.sh
StandardOutput=file:/trial/result
StandardError=file:/trial/errors
ExecStopPost=/bin/systemctl poweroff --force
TimeoutStartSec=180
END

status=0
timeout -k 5 220 systemd-nspawn --quiet --register=no --keep-unit --directory="$root" --private-network \
  --capability=CAP_SYS_NICE,CAP_IPC_LOCK --rlimit=RLIMIT_MEMLOCK=infinity --boot -- systemd.unit=trial.service \
  > "$folder/console" 2>&1 || status=$?
if [ ! -s "$root/trial/result" ]; then
  tail -20 "$folder/console" >&2
  cannot "the container did not come up (systemd-nspawn ended with $status)"
fi
cat "$root/trial/result"
if ! grep -q '^all as it should be$' "$root/trial/result"; then
  cat "$root/trial/errors" >&2
  exit 1
fi
