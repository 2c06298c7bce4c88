#!/usr/bin/env python3
"""Three troubles in mid-show, each many times: the server stands still for half a second (SIGSTOP), one of 64 controllers says nothing, and
somebody else sends acks that say "emergency stop". Prints a row for each; shown, not gated.

    cargo build --release && benches/trouble/run.py [--only stall | dead | forged] [--times 40]

Of a stall: the frames that each controller got at the wake-up, and the fastest move of any motor, by the simulator's own logs. Of a dead
controller: what the frames and the lateness of the others cost. Of forged acks, from another port and from another address: whether the show
goes on and all accounts are as they would be. Loopback only, in a folder of its own, which it removes; it ends only what it
started. Python 3.9 or later, nothing besides.
"""

import argparse
import contextlib
import importlib.util
import os
import pathlib
import random
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time

spec = importlib.util.spec_from_file_location("estop", pathlib.Path(__file__).resolve().parent.parent / "estop" / "run.py")
estop = importlib.util.module_from_spec(spec)
spec.loader.exec_module(estop)
from run import SETTLE_S, Hall, percentile  # noqa: E402

PULSES_A_MM = 10_000 / 5.0  # of the seat of the abuse
OUT_S = 0.5  # the server stands still
SEEN = ("sent", "lost", "send_failed")


class Troubled(estop.Pressed):
    """The hall of the abuse with its long cue, and moves logged where they are wanted."""

    def __init__(self, *arguments, logs):
        self.logs = ["frames", "moves"] if logs else []
        super().__init__(*arguments)

    def write(self, *arguments):
        Hall.write(self, *arguments)

    def logged(self):
        pairs = (("--" + ("log" if name == "frames" else name), self.folder / f"{name}.csv") for name in self.logs)
        return [word for pair in pairs for word in pair]

    def plays_again(self):
        """Once it is no longer held; a person resumes what was paused. What it was meanwhile."""
        seen = []
        for _ in range(600):
            status = self.status()
            if not seen or status["state"] != seen[-1]:
                seen.append(status["state"])
            if status["state"] == "paused":
                self.ask("resume")
            if status["state"] == "playing" and all(one["health"] in ("ok", "degraded") for one in status["controllers"]):
                return seen
            time.sleep(0.05)
        sys.exit(f"it does not play again: {seen}, {status.get('cause')}")


def frames_by_seat(path):
    """When each controller took its motion frames, s."""
    seats = {}
    with path.open() as rows:
        next(rows)
        for row in rows:
            at, controller, _, function, _ = row.split(",", 4)
            if function:
                seats.setdefault(controller, []).append(float(at))
    return seats


def fastest(path):
    """Of any motor in any move, mm/s."""
    most = 0.0
    with path.open() as rows:
        columns = next(rows).strip().split(",")
        begin, end = columns.index("from_1"), columns.index("to_1")
        for row in rows:
            cells = row.strip().split(",")
            seconds = float(cells[2]) / 1000
            if seconds > 0:
                far = max(abs(int(cells[end + axis]) - int(cells[begin + axis])) for axis in range(3))
                most = max(most, far / PULSES_A_MM / seconds)
    return most


def stalls(hall, chance, args, rate):
    states, times = {}, 0
    end = time.monotonic() + 60 * args.minutes
    while times < args.times and time.monotonic() < end:
        time.sleep(chance.uniform(10, 13))  # seats that fall out three times within a minute stay out
        os.kill(hall.server.pid, signal.SIGSTOP)
        time.sleep(OUT_S)
        os.kill(hall.server.pid, signal.SIGCONT)
        time.sleep(0.2)
        seen = " ".join(hall.plays_again())
        states[seen] = states.get(seen, 0) + 1
        times += 1
    hall.ask("stop")
    hall.end()
    at_once, gaps = [], []
    for seat in frames_by_seat(hall.folder / "frames.csv").values():
        for n in range(1, len(seat)):
            if 0.8 * OUT_S < seat[n] - seat[n - 1] < 5 * OUT_S:
                gaps.append(seat[n] - seat[n - 1])
                at_once.append(sum(at < seat[n] + 0.5 / rate for at in seat[n : n + 100]))
    counts = {number: at_once.count(number) for number in sorted(set(at_once))}
    told = ", ".join(f"{number}: {times}" for number, times in counts.items())
    print(f"| {rate} | {times} | {told} | {statistics.median(gaps):.2f}, {max(gaps):.2f} | {fastest(hall.folder / 'moves.csv'):.1f} | {states} | {os.getloadavg()[1]:.1f} |", flush=True)


def stretch(hall, seconds, but):
    """p99 of the lateness, and what became of the frames of all but one."""
    before = hall.status()
    time.sleep(seconds)
    after = hall.status()
    time.sleep(SETTLE_S)
    settled = hall.status()
    counts = [b - a for a, b in zip(before["lateness"]["histogram"]["counts"], after["lateness"]["histogram"]["counts"])]
    total = lambda status: {key: sum(one[key] for n, one in enumerate(status["controllers"]) if n != but) for key in SEEN}
    since, until = total(before), total(settled)
    return percentile(before["lateness"]["histogram"]["bounds_us"], counts, 0.99), {key: until[key] - since[key] for key in SEEN}


def deaths(hall, chance, args, rate):
    ratios, alive, dead, sums, end = [], [], [], dict.fromkeys(SEEN, 0), time.monotonic() + 60 * args.minutes
    for seat in chance.sample(range(args.controllers), args.controllers)[: args.times]:
        if time.monotonic() > end:
            break
        quiet, _ = stretch(hall, args.seconds, seat)
        hall.happens(f"{seat + 1}@mute=1")
        hall.until("loss", lambda: hall.status()["controllers"][seat]["health"] == "lost")
        late, grown = stretch(hall, args.seconds, seat)
        hall.happens(f"{seat + 1}@mute=0")
        hall.plays_again()
        ratios.append(late / quiet)
        alive.append(quiet)
        dead.append(late)
        sums = {key: sums[key] + grown[key] for key in SEEN}
    told = lambda values, digits: f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f}..{max(values):.{digits}f})"
    print(f"| {rate} | {len(ratios)} | {told(alive, 0)} | {told(dead, 0)} | {told(ratios, 2)} | {sums['sent']} | {sums['lost']} | {sums['send_failed']} | {os.getloadavg()[1]:.1f} |", flush=True)


def stopped_ack(program, port):
    """What a controller answers to a motion frame while it is stopped."""
    command = [program, "sim", "--safe", "--host-port", "0", "--listen", f"127.0.0.1:{port}", "--script", "0:estop=1"]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as sim:
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
                peer.settimeout(0.2)
                # Frame 0x01020304, 100 ms, no motion of three axes, nothing switched.
                frame = bytes.fromhex("55aa000014010000ffffffff0102030400000064") + bytes(12 + 6)
                for _ in range(50):
                    peer.sendto(frame, ("127.0.0.1", port))
                    with contextlib.suppress(OSError):
                        return peer.recv(2048)
        finally:
            sim.terminate()
    sys.exit("no ack to learn from")


def forgeries(hall, chance, args, rate):
    ack = stopped_ack(hall.program, args.port + 200)
    place = ack.index(bytes.fromhex("01020304"))
    print(f"an ack that is forged: {ack.hex()}", file=sys.stderr)
    before, done, states = hall.status(), {}, set()
    for name, own in {"another port": ("127.0.0.1", 0), "another address, the right port": ("127.0.0.2", args.port + 1)}.items():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.bind(own)
            for n in range(10_000):
                if n % 100 == 0:
                    status = hall.status()
                    states.add(status["state"])
                    newest = status["controllers"][0]["sent"]
                number = max(1, newest + chance.randrange(-50, 200))
                peer.sendto(ack[:place] + number.to_bytes(4, "big") + ack[place + 4 :], ("127.0.0.1", args.port))
                time.sleep(0.0002)
            done[name] = 10_000
    time.sleep(SETTLE_S)
    after = hall.status()
    states.add(after["state"])
    grown = {key: sum(one[key] for one in after["controllers"]) - sum(one[key] for one in before["controllers"]) for key in ("acked", "refused", "lost")}
    stopped = sum(one["emergency_stop"] for one in after["controllers"])
    print(f"| {rate} | {sum(done.values())} | {', '.join(done)} | {', '.join(sorted(states))} | {grown['acked']} | {grown['refused']} | {grown['lost']} | {stopped} | {os.getloadavg()[1]:.1f} |", flush=True)


KINDS = {
    "forged": (forgeries, 8, "| ticks/s | forged | from | states seen | acked | refused | lost | seats that are stopped | load |"),
    "stall": (stalls, 8, "| ticks/s | stalls | frames of a controller within half a period of the wake-up: how often | gap of frames, s, p50, greatest |"
              " fastest move of a motor, mm/s, of 240 | states until it played again | load |"),
    "dead": (deaths, 64, "| ticks/s | rounds | lateness p99, all alive, us | one dead | ratio | frames of the others | lost | not taken by the kernel | load |"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/kinocue", type=pathlib.Path)
    parser.add_argument("--only", choices=list(KINDS))
    parser.add_argument("--times", default=20, type=int)
    parser.add_argument("--rates", nargs="+", default=[100, 1000], type=int, help="ticks per second")
    parser.add_argument("--minutes", default=10.0, type=float, help="nothing new is begun after so long, for each row")
    parser.add_argument("--seconds", default=8.0, type=float, help="length of each stretch with and without a dead controller")
    parser.add_argument("--controllers", type=int, help="8 for stalls, 64 for a dead one")
    parser.add_argument("--port", default=27410, type=int, help="the frame port; the controllers take those after it")
    parser.add_argument("--seed", default=1, type=int)
    args = parser.parse_args()
    given, chance = args.controllers, random.Random(args.seed)
    for kind in [args.only] if args.only else list(KINDS):
        measure, usual, head = KINDS[kind]
        args.controllers = given or usual
        print(head + "\n" + "|" + "---|" * (head.count("|") - 1), flush=True)
        for rate in args.rates:
            with tempfile.TemporaryDirectory(prefix="kinocue-trouble.") as name:
                folder = pathlib.Path(name)
                folder.chmod(0o755)
                hall = Troubled(args.program.resolve(), folder, args.controllers, rate, args.port, folder, logs=kind == "stall")
                try:
                    hall.play()
                    measure(hall, chance, args, rate)
                finally:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(hall.server.pid, signal.SIGCONT)
                    hall.end()


if __name__ == "__main__":
    main()
