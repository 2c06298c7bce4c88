#!/usr/bin/env python3
"""Hours of shows in real time: 64 simulated controllers at 1 kHz of which one datagram in a hundred stays unanswered, while
levels, places, seats, pauses and stops are asked for at random. Prints a row for each ten minutes: what grows would show.

    cargo build --release && benches/soak/run.py [--hours 2] [--seed 1]

Loopback only, in a folder of its own, which it removes; it ends only what it started. Python 3.9 or later, nothing besides.
"""

import argparse
import contextlib
import json
import os
import pathlib
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "abuse"))
from run import Hall, percentile  # noqa: E402

SUMS = ("sent", "asked", "acked", "refused", "lost", "duplicate", "stale", "stray", "send_failed")


class Soak(Hall):
    """The hall of the abuse, with controllers that lose datagrams."""

    def __init__(self, *arguments, loss):
        self.loss = loss
        self.asked, self.turned_down = 0, []
        super().__init__(*arguments)

    def start(self, arguments, log, **more):
        lossy = [*arguments, "--loss", self.loss, "--seed", 1, "--json"] if arguments[0] == "sim" else arguments
        return super().start(lossy, log, **more)

    def does(self, *words):
        """Whether a command was done; one that was turned down is kept with its reason."""
        self.asked += 1
        command = [self.program, *map(str, words), "--socket", str(self.socket)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=90)
        if done.returncode != 0:
            said = (done.stderr + done.stdout).strip().splitlines()
            self.turned_down.append(f"{' '.join(map(str, words))}: {said[:4]}")
        return done.returncode == 0

    def go_on(self, chance):
        """One thing that a person might do in this state."""
        state = self.state()
        if state == "playing":
            self.anything(chance)
        elif state == "paused":
            self.does("resume")
        elif state in ("stopped", "fault"):
            self.does("clear")
        elif state == "recovering":
            # A person would home a seat that lost its place: at so many losses one does now and then.
            _ = self.does("park") or self.does("home", "--seats-empty")
        elif state == "parked":
            ready = self.does("preflight") and self.does("load", "waves")
            _ = ready and (self.does("arm") or self.does("home", "--seats-empty"))
        elif state == "armed":
            self.does("go")

    def anything(self, chance):
        seat, row = f"c{chance.randrange(64)}", chance.choice("ABCDEFGH")
        level = f"{chance.randrange(30, 101)}%"
        kinds = {
            ("level", "motion", level): 4,
            ("level", "vibration", level): 2,
            ("level", level, "--row", row): 3,
            ("seek", chance.randrange(0, 2300)): 4,
            ("trim", f"{chance.randrange(-200, 201)}ms"): 2,
            ("pause",): 2,
            ("disable", seat, "--why", "tried"): 1,
            ("mark", "soak"): 1,
            ("stop",): 1,
        }
        words = chance.choices(list(kinds), list(kinds.values()))[0]
        if self.does(*words) and words[0] == "disable":
            time.sleep(chance.uniform(2, 8))
            self.does("enable", seat)

    def sample(self):
        """What may grow, and the sums of the accounts."""
        own, helpers = self.memory_kib()
        process = pathlib.Path(f"/proc/{self.server.pid}")
        status = self.status()
        files = self.folder.rglob("*")
        sums = {key: sum(one.get(key, 0) for one in status["controllers"]) for key in SUMS}
        return {
            "at": time.monotonic(),
            "state": status["state"],
            "rss_kib": own,
            "helpers_kib": helpers,
            "fds": len(list((process / "fd").iterdir())),
            "threads": len(list((process / "task").iterdir())),
            "lines": self.lines(),
            "files_mib": sum(map(size, files)) / 2**20,
            "missed": status["missed_ticks"],
            "histogram": status["lateness"]["histogram"],
            **sums,
        }


def size(path):
    """Of a file, in octets; 0 of what is none, or has just been renamed."""
    with contextlib.suppress(FileNotFoundError):
        return path.stat().st_size if path.is_file() else 0
    return 0


def told(minutes, since, until, samples):
    """One row, of the samples of these minutes."""
    counts = [b - a for a, b in zip(since["histogram"]["counts"], until["histogram"]["counts"])]
    share = lambda part: percentile(since["histogram"]["bounds_us"], counts, part)
    middle = lambda key: statistics.median(one[key] for one in samples)
    grown = lambda key: until[key] - since[key]
    load = os.getloadavg()[1]
    print(
        f"| {minutes} | {middle('rss_kib') / 1024:.1f} | {max(one['rss_kib'] for one in samples) / 1024:.1f} | {middle('fds'):.0f} | "
        f"{middle('threads'):.0f} | {grown('lines')} | {until['files_mib']:.0f} | {share(0.5):.0f} | {share(0.99):.0f} | {grown('missed')} | "
        f"{grown('sent')} | {grown('acked')} | {grown('refused')} | {grown('lost')} | {grown('send_failed')} | {load:.1f} |",
        flush=True,
    )


def soak(hall, chance, seconds, step_s):
    since = hall.sample()
    start, samples, row = time.monotonic(), [since], 0
    next_row, next_sample = start + step_s, start + 10
    while time.monotonic() - start < seconds:
        time.sleep(chance.uniform(0.2, 6))
        if hall.server.poll() is not None:
            sys.exit(f"the server ended with {hall.server.returncode}: {(hall.folder / 'serve.log').read_text()[-3000:]}")
        hall.go_on(chance)
        now = time.monotonic()
        if now >= next_sample:
            samples.append(hall.sample())
            next_sample += 10 * (1 + (now - next_sample) // 10)
        if now >= next_row:
            row += 1
            told(f"{(row - 1) * step_s / 60:.0f} to {row * step_s / 60:.0f}", since, samples[-1], samples)
            since, samples = samples[-1], [samples[-1]]
            next_row += step_s


def simulated(folder):
    """What all controllers counted together."""
    told = json.loads((folder / "sim.log").read_text().strip().splitlines()[-1])["controllers"]
    numbers = [key for key, value in told[0].items() if isinstance(value, int)]
    return {key: sum(one[key] for one in told) for key in numbers}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/kinocue", type=pathlib.Path)
    parser.add_argument("--hours", default=2.0, type=float)
    parser.add_argument("--step", default=10.0, type=float, help="minutes of a row")
    parser.add_argument("--controllers", default=64, type=int)
    parser.add_argument("--rate", default=1000, type=int, help="ticks per second")
    parser.add_argument("--loss", default=0.01, type=float, help="share of datagrams that stay unanswered")
    parser.add_argument("--port", default=29410, type=int, help="the frame port; the controllers take those after it")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for the log of the server and its recordings")
    parser.add_argument("--seed", default=1, type=int, help="seed of what is asked for")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="kinocue-soak.") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        hall = Soak(args.program.resolve(), folder, args.controllers, args.rate, args.port, folder, loss=args.loss)
        try:
            hall.play()
            print("| minutes | resident, MiB | at most | descriptors | threads | log lines | files, MiB | lateness p50, us | p99 | missed ticks |"
                  " sent | acked | refused | lost | not sent | load |")
            print("|" + "---|" * 16)
            soak(hall, random.Random(args.seed), 3600 * args.hours, 60 * args.step)
        finally:
            with contextlib.suppress(SystemExit):
                hall.does("stop")
                time.sleep(3)
                sums = {key: value for key, value in hall.sample().items() if key in SUMS}
            code = hall.end()
            if args.keep:
                shutil.copytree(folder, args.keep, ignore=shutil.ignore_patterns("*.sock"), dirs_exist_ok=True)
        print(f"\nThe accounts at the end: {json.dumps(sums)}")
        print(f"Simulated controllers: {json.dumps(simulated(folder))}")
        print(f"{hall.asked} requests, {len(hall.turned_down)} turned down: {json.dumps(sorted(set(hall.turned_down))[:20], indent=1)}")
        print(f"The server ended with {code}.")


if __name__ == "__main__":
    main()
