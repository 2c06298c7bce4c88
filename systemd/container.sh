# A throw-away container with a systemd of its own, over this machine's root file system, of which nothing is changed. Sourced by
# try.sh and walk.sh; needs root, overlayfs, and of Debian: systemd, systemd-container.

cannot() { echo "$(basename "$0"): $*" >&2; exit 77; }

# Makes the container: $root is its root, $root/trial a folder for what it takes in and brings out. As if nothing of kinocue had
# ever been installed. It is gone when the script ends.
container_make() {
  [ "$(id -u)" -eq 0 ] || cannot "needs root, for a container and its file systems"
  command -v systemd-nspawn > /dev/null || cannot "needs systemd-nspawn: apt-get install systemd-container"
  folder=$(mktemp -d /tmp/kinocue-trial.XXXXXX)
  mount -t tmpfs -o size=512m kinocue-trial "$folder"
  trap container_remove EXIT
  mkdir "$folder"/{upper,work,root}
  root=$folder/root
  mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/upper,workdir=$folder/work" "$root" ||
    cannot "needs overlayfs over /"
  rm -rf "$root"/{etc,run,var/lib,var/log}/kinocue "$root"/usr/bin/kinocue
  mkdir "$root/trial"
  echo "0123456789abcdef0123456789abcdef" > "$root/etc/machine-id"
  local units=$root/etc/systemd/system unit
  mkdir -p "$units"
  for unit in networking systemd-networkd systemd-resolved chrony nats-server mosquitto keepalived prometheus; do
    ln -sf /dev/null "$units/$unit.service"
  done
}

container_remove() {
  if mountpoint -q "$folder/root"; then umount "$folder/root"; fi
  umount "$folder"
  rmdir "$folder"
}

# container_run SECONDS COMMAND [OPTION…]: boots it, with more options of systemd-nspawn, runs the command in it as root with a network of its own that has loopback alone, and
# prints what that wrote; its standard error where the last line is not "all as it should be", which ends the script with 1.
container_run() {
  local seconds=$1 command=$2 status=0
  shift 2
  cat > "$root/etc/systemd/system/trial.service" << UNIT
[Unit]
After=basic.target
Requires=basic.target

[Service]
Type=oneshot
ExecStart=-$command
StandardOutput=file:/trial/result
StandardError=file:/trial/errors
ExecStopPost=/bin/systemctl poweroff --force
TimeoutStartSec=$seconds
UNIT
  timeout -k 5 $((seconds + 40)) systemd-nspawn --quiet --register=no --keep-unit --directory="$root" --private-network \
    --capability=CAP_SYS_NICE,CAP_IPC_LOCK --rlimit=RLIMIT_MEMLOCK=infinity "$@" --boot -- systemd.unit=trial.service \
    > "$folder/console" 2>&1 || status=$?
  if [ ! -s "$root/trial/result" ]; then
    tail -20 "$folder/console" >&2
    if [ -s "$root/trial/errors" ]; then cat "$root/trial/errors" >&2; fi
    cannot "the container did not come up (systemd-nspawn ended with $status)"
  fi
  cat "$root/trial/result"
  if [ "$(tail -n 1 "$root/trial/result")" != "all as it should be" ]; then
    cat "$root/trial/errors" >&2
    exit 1
  fi
}
