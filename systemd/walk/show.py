"""The shows: a playlist led by tablet, terminal and gear, stops, and a crash in mid-air. Each gives the instants that matter,
which are held against the frames afterwards."""

import os
import signal
import socket
import subprocess
import time

import browser
from before import main_pid, named
from hall import ADDRESS

# Seat-demo lifts all seats from 0.5 s to 2.5 s of its film, and they gain speed until 1.5 s. Water is on from 4.2 s to 4.4 s.
LIFTING = 1.1
ROUNDS = 3


def playlist(terminal, table, sim, booth, tablet):
    """Two cues, one after the other: effects, levels, a seat out, gear that leads, a plug pulled."""
    at = {}
    booth.must("playlist", {"id": "today"}, "PUT")
    booth.must("preflight")
    booth.must("show/arm")
    late = {"X-Kinocue-Sent": str(time.time_ns() // 1_000_000 - 3000)}
    code, reply = tablet.press("show/go", **late)
    table.saw(21, "GO that was pressed three seconds ago", f"{code} {reply.get('code')}", code == 409)
    key = {"Idempotency-Key": "one-press"}
    code, reply = tablet.press("show/go", **key)
    again, _ = tablet.press("show/go", **key)
    table.saw(21, "GO, heard twice", f"{code} {reply.get('state')}, then {again}: done once", (code, again) == (200, 200))
    at["go"] = time.time()
    tablet.until_film("seat-demo", 4.6)
    at["dry"] = time.time()
    terminal.run("kinocue effects off water && kinocue seek 0:04", user="anna")
    tablet.until_film("seat-demo", 4.6)
    at["home"] = time.time()
    bench_ride(terminal, table, sim, tablet, at)
    status, _ = tablet.until_state("parked", 30)
    at["end"] = time.time()
    table.saw(15, "let the list play", f"seat-demo, then bench-ride by itself, then {status['state']}", status["state"] == "parked")
    return at


def bench_ride(terminal, table, sim, tablet, at):
    """The second cue of the list, as the children's show."""
    status, _ = tablet.until_film("bench-ride", 0.5)
    at["kids"] = time.time()
    levels = status["levels"]
    kids = levels["motion"] == 0.6 and levels["effects"]["water"] is False
    table.saw(9, "the list sets the preset kids", f"motion {levels['motion']:.0%}, water {levels['effects']['water']}", kids)
    terminal.run("kinocue level 0% --row A", user="anna")
    at["row_a"] = time.time()
    gear(table, tablet)
    tablet.until_film("bench-ride", 5)
    terminal.readme("kinocue disable B2", user="anna")
    at["b2_out"] = time.time()
    tablet.until_film("bench-ride", 9)
    terminal.readme("kinocue enable B2", user="anna")
    at["b2_in"] = time.time()
    tablet.until_film("bench-ride", 11.5)
    at["row_a_end"] = time.time()
    hold_up(table, sim, tablet)
    tablet.until_film("bench-ride", 13.5)
    named(table, tablet, "mid-show")


def hold_up(table, sim, tablet):
    """All controllers answer late by more than it takes to be lost, and then at once, before their seats have come to rest."""
    sim.send_signal(signal.SIGSTOP)
    time.sleep(0.3)
    sim.send_signal(signal.SIGCONT)

    def are_well(status):
        return all(one["health"] == "ok" for one in status["controllers"])

    time.sleep(0.3)
    status, took = tablet.until("all back", are_well, 5)
    said = f"all back on the cue {0.3 + took:.1f} s later, {status['state']}"
    table.saw(13, "every answer held up for 0.3 s", said, status["state"] == "playing")


def gear(table, tablet):
    """Show-control gear: a line of text, an OSC message; neither may arm."""
    with socket.create_connection(("127.0.0.1", 53535), timeout=5) as line:
        lines = line.makefile("rw", newline="\n")

        def ask(text):
            lines.write(text + "\n")
            lines.flush()
            return lines.readline().strip()

        said = ask("status")
        table.saw(16, "text: status", said, said.startswith("ok playing"))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as osc:
            osc.sendto(osc_message("/kinocue/pause"), ("127.0.0.1", 53000))
        _, took = tablet.until_state("paused", 5)
        table.saw(16, "OSC: /kinocue/pause", f"paused within {1000 * took:.0f} ms", True)
        said = ask("resume")
        table.saw(16, "text: resume", said, said.startswith("ok "))
        said = ask("arm")
        table.saw(16, "text: arm", said, said.startswith("error role"))


def osc_message(address):
    bytes = address.encode() + b"\0"
    return bytes + b"\0" * (-len(bytes) % 4) + b",\0\0\0"


def stops(terminal, table, booth, tablet):
    """Stops while the seats gain speed; gives of each how it was pressed, when, and when the hall had
    stopped, unix time."""
    terminal.run("kinocue level 100% && kinocue level 100% --row A && kinocue effects on water", user="anna")
    booth.must("playlist", {"id": None}, "PUT")
    booth.must("show/load", {"cue": "seat-demo"})
    pressed, ok = [], True
    for _ in range(ROUNDS):
        lift(booth, tablet)
        click = time.time()
        code, _ = tablet.press("show/stop")
        booth.until_state("stopped")
        pressed.append(("STOP of the tablet", click, time.time()))
        refused, _ = booth.press("show/go")
        ok = ok and (code, refused) == (200, 409)
        booth.must("show/clear")
        booth.until("ready to park", may_park, 10)
        booth.must("show/park")
        booth.until_state("parked")
    table.saw(2, f"STOP, and GO behind it, {ROUNDS} x", "stopped, and it stays so" if ok else "something else", ok)
    lift(booth, tablet)
    click = time.time()
    terminal.readme("kinocue stop", user="anna")
    booth.until_state("stopped")
    pressed.append(("kinocue stop, from its start", click, time.time()))
    terminal.readme("kinocue clear", user="anna")
    booth.until("ready to park", may_park, 10)
    terminal.readme("kinocue park", user="anna")
    booth.until_state("parked")
    if browser.is_installed():
        pressed += by_finger(table, booth)
    return pressed


def may_park(status):
    return status["next"].startswith("park")


def lift(booth, tablet):
    booth.must("show/arm")
    tablet.must("show/go")
    tablet.until_film("seat-demo", LIFTING)


def by_finger(table, booth):
    """The same on the page itself, in a browser."""
    page = browser.Browser(f"http://{ADDRESS}/")
    try:
        page.wait("document.getElementById('state').textContent.toLowerCase().includes('parked')")
        token = booth.headers["Authorization"].split()[1]
        page.run(f"sessionStorage.setItem('kinocue-token', '{token}'); return 0")
        pressed = []
        for _ in range(ROUNDS):
            page.press("#arm")
            page.reads("state", "armed")
            page.press("#go")
            page.reads("go-word", "sure?")
            time.sleep(0.4)
            page.press("#go")
            booth.until_film("seat-demo", LIFTING)
            click = page.touch("#stop")
            page.reads("stop-reply", "stop was received")
            page.reads("state", "stopped")
            pressed.append(("finger on the page", click, time.time()))
            page.press("#clear")
            page.press("#park")
            booth.until_state("parked")
        table.saw(21, "chromium: ARM, GO, sure?, GO, STOP, CLEAR, PARK", f"{ROUNDS} times as meant", True)
        return pressed
    finally:
        page.close()


def crash(terminal, table, booth, tablet):
    """The power blinks in mid-air: what comes back, and what moves; gives when it was and until when nothing may move."""
    lift(booth, tablet)
    before = main_pid()
    os.kill(before, signal.SIGKILL)
    crashed = time.time()
    status, took = booth.until("back", lambda status: status["state"] not in ("boot", "playing") and main_pid() != before, 15)
    said = f"{status['state']} after {took:.1f} s: {status['cause']}; next: {status['next']}"
    table.saw(8, "killed the service in mid-air", said, status["state"] == "recovering")
    code, reply = booth.press("show/arm")
    table.saw(8, "ARM at once", f"{code}: {reply.get('detail')}", code == 409)
    time.sleep(2)
    parked = time.time()
    status = booth.must("show/park")
    booth.until_state("parked")
    table.saw(8, "PARK", "the seats are parked", True)
    return crashed, parked


def upgrade(terminal, table, booth, tablet):
    """The package is installed again while seats move, and then taken away."""
    terminal.run("kinocue preflight", user="anna")
    terminal.readme("kinocue playlist today && kinocue arm", user="anna")
    terminal.readme("kinocue go", user="anna")
    tablet.until_film("seat-demo", LIFTING)
    before = main_pid()
    said = terminal.run("apt-get install --reinstall -y ./kinocue_*.deb")
    status = booth.status()
    same = main_pid() == before and status["state"] in ("playing", "joining")
    told = next((line for line in said.splitlines() if line.startswith("kinocue: ")), "nothing is said")
    table.saw(19, "installed the package again in mid-show", f"the show goes on ({status['state']}); {told}", same)
    said = terminal.run("kinocue upload /usr/share/kinocue/cues/seat-demo.csv --id after-upgrade", user="anna")
    table.saw(19, "uploaded to the one that runs on", said.strip().splitlines()[-1], "is in the library" in said)
    terminal.run("apt-get remove -y kinocue")
    active = subprocess.run(["systemctl", "is-active", "kinocue"], capture_output=True, text=True).stdout.strip()
    table.saw(19, "removed the package in mid-show", f"the service is {active}", active != "active")
    return time.time()
