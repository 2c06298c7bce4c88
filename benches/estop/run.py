#!/usr/bin/env python3
"""Emergency stops of one seat in mid-show: how long after the first reply that tells of it the seat still gets motion frames. The stop is pressed
at random instants by the simulator's own command, released, cleared, and the show begins anew. Prints a row for each rate; shown, not gated.

    cargo build --release && benches/estop/run.py [--presses 100] [--rates 100 1000]

The judge is the simulator's own log of the frames that came to that seat, whose times are when it took each, just before it answered. Loopback
only, in a folder of its own, which it removes; it ends only what it started. Python 3.9 or later, nothing besides.
"""

import argparse
import collections
import contextlib
import os
import pathlib
import random
import socket
import statistics
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "abuse"))
from run import Hall, curve  # noqa: E402

STOPPED = "4"  # the reply code of an emergency stop
LISTENED_S = 1.0  # how long after the press frames are counted: the others rest by then
GOAL_MS = 1.0  # beyond one period


class Pressed(Hall):
    """The hall of the abuse, with seats that move from the first second on, a log of all frames, and a socket for emergency stops."""

    frames, rest, columns = None, "", None

    def write(self, count, rate, disk):
        super().write(count, rate, disk)
        middle = lambda n, axis: 0.5 + (float(curve(n + 1_000, axis)) - 0.5) * min(1.0, n / 10)
        rows = (f"{100 * n},{middle(n, 0):.6f},{middle(n, 1):.6f},{middle(n, 2):.6f}\n" for n in range(600))
        (disk / "cues" / "waves.csv").write_text("time_ms,a1,a2,a3\n" + "".join(rows))

    def start(self, arguments, log, **more):
        more_words = [*self.logged(), "--control", self.folder / "sim.sock"] if arguments[0] == "sim" else []
        return super().start([*arguments, *more_words], log, **more)

    def logged(self):
        return ["--log", self.folder / "frames.csv"]

    def happens(self, *commands):
        """Commands to the controllers."""
        with socket.socket(socket.AF_UNIX) as peer:
            peer.connect(str(self.folder / "sim.sock"))
            answers = peer.makefile()
            for command in commands:
                peer.sendall(f"{command}\n".encode())
                if (answer := answers.readline().strip()) != "ok":
                    sys.exit(f"{command}: {answer}")

    def came(self, seat):
        """Frames to that seat since the last look: when each came, s, and what it was answered. The log is written some rows at a time, so the
        last may come with the next look."""
        self.frames = self.frames or (self.folder / "frames.csv").open()
        *lines, self.rest = (self.rest + self.frames.read()).split("\n")
        if self.columns is None:
            self.columns = lines.pop(0).split(",")
        at, controller, function, reply = (self.columns.index(name) for name in ("time_s", "controller", "function", "reply"))
        rows = (line.split(",", reply + 1) for line in lines)
        return [(float(row[at]), row[reply]) for row in rows if row[controller].endswith(f":{self.port + seat}") and row[function]]

    def reaches(self, state, seconds=60.0):
        self.until(state, lambda: self.state() == state, seconds)

    def again(self):
        """Released, cleared, parked, and a show that plays."""
        self.until("clear", lambda: self.status()["next"].startswith("clear"))
        self.ask("clear")
        self.until("park", lambda: self.status()["next"].startswith("park"))
        self.ask("park")
        self.reaches("parked")
        self.begin()

    def begin(self):
        for words in (["load", "waves"], ["arm"], ["go"]):
            self.ask(*words)
        self.reaches("playing")


def press(hall, chance, count):
    """One emergency stop of one seat; frames that came to it from then on, counted from the first that was answered with it."""
    seat = chance.randrange(1, count + 1)
    hall.happens("pa91=0")  # as soon as it is released it is over
    time.sleep(chance.uniform(0.5, 2.5))
    hall.happens(f"{seat}@estop=1")
    hall.reaches("stopped")
    time.sleep(LISTENED_S)
    hall.happens(f"{seat}@estop=0")
    hall.again()
    hall.happens("pa91=2")
    refused = [at for at, reply in hall.came(seat) if reply == STOPPED]
    return [at - refused[0] for at in refused]


def told(rate, frames, load):
    """A row: each of `frames` is one press, with the frames that were refused, s after the first of them."""
    period = 1 / rate
    lasts = sorted(1000 * one[-1] for one in frames if one)
    more = collections.Counter(len(one) - 1 for one in frames if one)
    by_report = sum(not one for one in frames)
    within = sum(last <= 1000 * period + GOAL_MS for last in lasts) + by_report
    p99 = lasts[min(len(lasts) - 1, int(0.99 * len(lasts)))]
    print(
        f"| {rate} | {len(frames)} | {by_report} | {', '.join(f'{number}: {times}' for number, times in sorted(more.items()))} | "
        f"{statistics.median(lasts):.2f} / {p99:.2f} / {lasts[-1]:.2f} | {lasts[-1] / 1000 / period:.2f} | {within} of {len(frames)} | {load:.1f} |",
        flush=True,
    )


def one(program, rate, args, chance):
    with tempfile.TemporaryDirectory(prefix="kinocue-estop.") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        hall = Pressed(program, folder, args.controllers, rate, args.port, folder)
        frames, loads, end = [], [], time.monotonic() + 60 * args.minutes
        try:
            hall.play()
            while len(frames) < args.presses and time.monotonic() < end:
                frames.append(press(hall, chance, args.controllers))
                loads.append(os.getloadavg()[0])
        finally:
            with contextlib.suppress(SystemExit):
                hall.ask("stop")
            hall.end()
            if frames and any(frames):
                told(rate, frames, statistics.mean(loads))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/kinocue", type=pathlib.Path)
    parser.add_argument("--presses", default=100, type=int)
    parser.add_argument("--rates", nargs="+", default=[100, 1000], type=int, help="ticks per second")
    parser.add_argument("--minutes", default=20.0, type=float, help="no press is begun after so long, for each rate")
    parser.add_argument("--controllers", default=8, type=int)
    parser.add_argument("--port", default=26410, type=int, help="the frame port; the controllers take those after it")
    parser.add_argument("--seed", default=1, type=int, help="seed of seats and instants")
    args = parser.parse_args()
    chance = random.Random(args.seed)
    print("| ticks/s | presses | told by a report before any frame | frames after the first refused one: how often |"
          " last frame after that reply, ms, p50 / p99 / greatest | greatest, periods | within a period and 1 ms | load |")
    print("|" + "---|" * 8)
    for rate in args.rates:
        one(args.program.resolve(), rate, args, chance)


if __name__ == "__main__":
    main()
