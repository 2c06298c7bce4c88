#!/usr/bin/env bash
# The inside of try.sh: what is tried, as root in a container that has a real systemd. Nothing else starts it.
set -u
faults=0
say() { printf '%-58s %s\n' "$1" "$2"; }
bad() { say "$1" "WRONG: $2"; faults=$((faults + 1)); }
# check WHAT FOUND WANTED
check() { if [[ $2 == $3 ]]; then say "$1" "$2"; else bad "$1" "$2, not $3"; fi; }
ms() { echo $(($(date +%s%N) / 1000000)); }
prop() { systemctl show -P "$1" kinocue.service; }
# until SECONDS COMMAND…: polls every 5 ms; prints how long it took
until_() {
  local end=$(($(ms) + $1 * 1000)) begin
  begin=$(ms)
  shift
  until "$@"; do
    if [ "$(ms)" -gt "$end" ]; then return 1; fi
    sleep 0.005
  done
  echo $(($(ms) - begin))
}
is_active() { [ "$(prop ActiveState)" = active ]; }
is_anew() { [ "$(prop MainPID)" != "$1" ] && is_active; }
status_has() { [[ "$(prop StatusText)" == *"$1"* ]]; }
state_is() { [ "$(kinocue status --json 2> /dev/null | sed -n 's/^{.*"state":"\([a-z]*\)".*/\1/p')" = "$1" ]; }

systemd-sysusers kinocue.conf
systemd-tmpfiles --create kinocue.conf
install -o kinocue -g kinocue -m 640 /trial/ride.csv /var/lib/kinocue/cues/ride.csv

echo "== a bad configuration"
printf '[show]\nrate_hz = "fast"\n' > /etc/kinocue/kinocue.toml
systemctl start kinocue.service 2> /dev/null
check "started" "$?" 1
sleep 3 # three times RestartSec
check "exit code" "$(prop ExecMainStatus)" 78
check "restarts" "$(prop NRestarts)" 0
check "state of the unit" "$(prop ActiveState)" failed
say "what it said" "$(journalctl --no-pager -q -o cat -u kinocue.service | grep -m 1 'kinocue.toml')"
rm /etc/kinocue/kinocue.toml
systemctl reset-failed kinocue.service

echo "== no configuration"
systemctl start kinocue.service 2> /dev/null
sleep 1
check "exit code" "$(prop ExecMainStatus)" 66
check "restarts" "$(prop NRestarts)" 0
systemctl reset-failed kinocue.service

echo "== start, with eight controllers"
cp /trial/simulated.toml /etc/kinocue/kinocue.toml
/usr/bin/kinocue sim --safe --count 8 --host-port 8410 --json > /trial/sim.json 2> /trial/sim.err &
sim=$!
until_ 5 grep -q 7415 /trial/sim.err > /dev/null || bad "simulated controllers" "not ready"
begin=$(ms)
if systemctl start kinocue.service; then
  say "until ready, ms" "$(($(ms) - begin))"
else
  bad "start" "failed"
fi
pid=$(prop MainPID)
say "status text" "$(prop StatusText)"
check "capabilities" "$(sed -n 's/^CapEff:\t//p' /proc/"$pid"/status)" 0000000000000000
check "user" "$(stat -c %U /proc/"$pid")" kinocue
locked=$(sed -n 's/^VmLck:[^0-9]*\([0-9]*\) kB/\1/p' /proc/"$pid"/status)
limit=$(sed -n 's/^Max locked memory *\([^ ]*\).*/\1/p' /proc/"$pid"/limits)
if [ "$limit" = unlimited ]; then
  check "locked memory, KiB" "$locked" "[1-9]*"
else
  say "locked memory, KiB" "$locked (not tried: the root of this machine may not raise its limit of $limit)"
fi
check "policy of the tick thread" "$(chrt -p "$pid" | sed -n 's/.*policy: //p')" "SCHED_FIFO*"
others=$(for task in /proc/"$pid"/task/*; do chrt -p "${task##*/}" 2> /dev/null; done | grep -c SCHED_FIFO)
check "threads that are real-time" "$others" 1
check "control socket" "$(stat -c '%U:%G %a' /run/kinocue/control.sock)" "kinocue:kinocue 660"

shell=$(nsenter --target "$pid" --mount --root /bin/sh -c true 2>&1)
check "another program in its root" "$shell" "*No such file*"
systemctl reload kinocue.service
check "reload" "$?" 0
sleep 1.5
check "state of the unit" "$(prop ActiveState) $(prop NRestarts)" "active 0"

# Parks the seats, and then has them play.
play() {
  kinocue park > /dev/null 2>&1
  until_ 30 state_is parked > /dev/null || bad "park" "$(prop StatusText)"
  for words in "load ride" preflight arm go; do
    # shellcheck disable=SC2086
    kinocue $words > /dev/null 2> /trial/said || bad "$words" "exit code $?: $(cat /trial/said)"
  done
  until_ 20 state_is playing > /dev/null || bad "play" "$(prop StatusText)"
  sleep 1.5 # the line changes once a second at the most
}

echo "== stop in mid-show"
play
check "status text" "$(prop StatusText)" "*playing*"
begin=$(ms)
systemctl stop kinocue.service
say "until stopped, with the seats parked, ms" "$(($(ms) - begin))"
check "result" "$(prop Result)" success
check "exit code" "$(prop ExecMainStatus)" 0

echo "== hang in mid-air: the watchdog"
systemctl reset-failed kinocue.service
systemctl start kinocue.service
play
pid=$(prop MainPID)
kill -STOP "$pid"
if took=$(until_ 10 is_anew "$pid"); then say "from the hang to ready again, ms" "$took"; else bad "restart" "none"; fi
check "restarts" "$(prop NRestarts)" 1
check "why" "$(journalctl --no-pager -q -o cat -u kinocue.service | grep -c 'Watchdog timeout')" 1
until_ 2 status_has recovering > /dev/null
check "status text" "$(prop StatusText)" "*ecovering*"

echo "== crash"
systemctl stop kinocue.service
systemctl reset-failed kinocue.service
systemctl start kinocue.service
pid=$(prop MainPID)
kill -KILL "$pid"
if took=$(until_ 10 is_anew "$pid"); then say "from the crash to ready again, ms" "$took"; else bad "restart" "none"; fi
until_ 2 status_has recovering > /dev/null
check "status text" "$(prop StatusText)" "*ecovering*"
sleep 1
check "status text a second later" "$(prop StatusText)" "*ecovering*"

echo "== crash again and again"
for _ in 1 2 3 4; do
  pid=$(prop MainPID)
  if [ "$pid" -gt 1 ]; then kill -KILL "$pid"; fi
  until_ 3 is_anew "$pid" > /dev/null
done
until_ 5 is_active > /dev/null
check "state of the unit" "$(prop ActiveState)" active

echo "== no controller answers"
kill "$sim"
wait "$sim"
systemctl reset-failed kinocue.service
begin=$(ms)
if systemctl start kinocue.service; then
  took=$(($(ms) - begin))
  say "until ready, ms" "$took"
  [ "$took" -le 11000 ] || bad "until ready" "more than 10 s"
else
  bad "start" "failed"
fi
say "status text" "$(prop StatusText)"
begin=$(ms)
systemctl stop kinocue.service
say "until stopped, ms" "$(($(ms) - begin))"
check "result" "$(prop Result)" success

echo
if [ "$faults" -eq 0 ]; then
  echo "all as it should be"
else
  echo "$faults things are not as they should be"
  journalctl --no-pager -n 200 -o short-monotonic -u kinocue.service >&2
fi
