#!/usr/bin/env python3
"""A show that goes on while its server is abused: 64 simulated controllers at 1 kHz, each attack in turn beside a quiet run
of the same length, then all of them together. Prints the table of benches/README.md; shown, not gated.

    cargo build --release && benches/abuse/run.py [--seconds 10] [--only "slow readers"]

Loopback only, in a folder of its own, which it removes; it ends only what it started. As root it also mounts a small file
system for the full disk, and unmounts it; else that attack is left out. Python 3.9 or later, nothing besides.
"""

import argparse
import contextlib
import json
import math
import multiprocessing
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

import attacks

GOALS = {"ratio": 2.0, "lost": 0, "memory_mib": 64.0, "lines": 20}
SETTLE_S = 1.5  # a frame counts as lost after a second without a reply


class Hall:
    """Controllers and a show server, started and ended."""

    def __init__(self, program, folder, count, rate, port, disk):
        self.program, self.folder, self.port = program, folder, port
        self.socket, self.started = folder / "control.sock", []
        self.write(count, rate, disk)
        sim = ["sim", "--safe", "--count", count, "--axes", 3, "--listen", f"127.0.0.1:{port + 1}", "--host-port", port]
        self.sim = self.start(sim, "sim.log", preexec_fn=first_in_line)
        self.until("controllers", lambda: (folder / "sim.log").read_text().count("ready") == count)
        serve = ["serve", "--config", folder / "hall.toml", "--socket", self.socket, "--state", disk / "state"]
        self.server = self.start(serve, "serve.log")
        self.until("control socket", self.socket.exists)

    def write(self, count, rate, disk):
        for name in ("cues", "log", "state"):
            (disk / name).mkdir(exist_ok=True)
        rows = (f"{100 * n},{curve(n, 0)},{curve(n, 1)},{curve(n, 2)}\n" for n in range(24_000))
        (disk / "cues" / "waves.csv").write_text("time_ms,a1,a2,a3\n" + "".join(rows))
        controllers = (
            f'[[controller]]\nname = "c{n}"\nrow = "{row_name(n)}"\nseat = "bench3"\n'
            f'address = "127.0.0.1:{self.port + 1 + n}"\n'
            for n in range(count)
        )
        (self.folder / "hall.toml").write_text(
            f'[show]\nrate_hz = {rate}\nbind = "127.0.0.1:{self.port}"\nlibrary = "{disk}/cues"\n'
            f'[log]\ndir = "{disk}/log"\n[library]\nmax_cue_mib = 64\n'
            "[seat.bench3]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n"
            "max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n"
            + "".join(controllers)
        )

    def start(self, arguments, log, **more):
        command = [self.program, *map(str, arguments)]
        with (self.folder / log).open("w") as output:
            self.started.append(subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, **more))
            return self.started[-1]

    def until(self, what, true, seconds=30.0):
        end = time.monotonic() + seconds
        while not true():
            if time.monotonic() > end:
                logs = [self.folder / "serve.log", self.folder / "sim.log"]
                said = "".join(log.read_text()[-2000:] for log in logs if log.exists())
                for process in self.started:
                    process.kill()
                sys.exit(f"no {what} within {seconds:.0f} s: {said}")
            time.sleep(0.05)

    def ask(self, *words):
        """A client command."""
        command = [self.program, *words, "--socket", str(self.socket)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=90)
        if done.returncode != 0:
            sys.exit(f"{' '.join(words)}: {done.stderr}")

    def state(self):
        return self.status().get("state")

    def status(self):
        """The newest status, asked for until it comes: under abuse it may not come at once."""
        for _ in range(200):
            with contextlib.suppress(OSError, ValueError):
                with attacks.connect({"socket": str(self.socket)}) as peer:
                    peer.sendall(attacks.STATUS.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
                    answer = b"".join(iter(lambda: peer.recv(1 << 20), b""))
                    head, body = answer.split(b"\r\n\r\n", 1)
                    if head.split(b" ", 2)[1] == b"200":
                        return json.loads(body[body.index(b"{") : body.rindex(b"}") + 1])
            time.sleep(0.05)
        sys.exit("the server gives no status any more")

    def play(self):
        self.until("rest", lambda: self.state() in ("parked", "recovering"))
        if self.state() != "parked":
            self.ask("park")
            self.until("parked seats", lambda: self.state() == "parked", 60)
        for words in (["preflight"], ["load", "waves"], ["arm"], ["go"]):
            self.ask(*words)
        self.until("show", lambda: self.state() == "playing", 60)

    def lines(self):
        return (self.folder / "serve.log").read_text(errors="replace").count("\n")

    def memory_kib(self):
        """Resident memory of the server, and of the helpers that it started."""
        own, helpers = 0, 0
        for status in pathlib.Path("/proc").glob("[0-9]*/status"):
            with contextlib.suppress(OSError, KeyError, ValueError):
                fields = dict(line.split(":\t", 1) for line in status.read_text().splitlines() if ":\t" in line)
                resident = int(fields["VmRSS"].split()[0])
                own += resident * (int(fields["Pid"]) == self.server.pid)
                helpers += resident * (int(fields["PPid"]) == self.server.pid)
        return own, helpers

    def end(self):
        """The seats park; then the controllers go. How the server ended."""
        codes = []
        for process in (self.server, self.sim):
            process.terminate()
            try:
                codes.append(process.wait(40))
            except subprocess.TimeoutExpired:
                process.kill()
                codes.append(process.wait())
        return codes[0]


def row_name(n):
    """Of the row of that controller, eight to a row: A to Z, then R26 and so on."""
    return chr(65 + n // 8) if n < 208 else f"R{n // 8}"


def first_in_line():
    """Controllers are other machines: no attack here takes their processor away. Below the tick thread, above all else."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))


def curve(n, axis):
    """Slow waves about the middle, well within the limits; rows at 10 Hz, a spline between them."""
    return f"{0.5 + 0.2 * math.sin(0.1 * n * 1.3 + axis) * min(1.0, n / 100):.6f}"


class Window:
    """What the server did in a stretch of time: what grew from its beginning to its end."""

    def __init__(self, hall):
        self.hall, self.before, self.lines = hall, hall.status(), hall.lines()
        (self.least, _), self.most, self.helpers = hall.memory_kib(), 0, 0
        self.done = threading.Event()
        self.watch = threading.Thread(target=self.look)
        self.watch.start()

    def look(self):
        while not self.done.wait(0.2):
            own, helpers = self.hall.memory_kib()
            self.most, self.helpers = max(self.most, own), max(self.helpers, helpers)

    def close(self):
        after = self.hall.status()
        self.done.set()
        self.watch.join()
        time.sleep(SETTLE_S)
        settled = self.hall.status()
        count = lambda status, key: sum(one[key] for one in status["controllers"])
        grown = lambda key: count(settled, key) - count(self.before, key)
        counts = [
            b - a
            for a, b in zip(self.before["lateness"]["histogram"]["counts"], after["lateness"]["histogram"]["counts"])
        ]
        return {
            "p99_us": percentile(after["lateness"]["histogram"]["bounds_us"], counts, 0.99),
            "missed": after["missed_ticks"] - self.before["missed_ticks"],
            "lost": grown("lost") + grown("send_failed"),
            "memory_mib": max(0, self.most - self.least) / 1024,
            "helpers_mib": self.helpers / 1024,
            "lines": self.hall.lines() - self.lines,
            "state": settled["state"],
        }


def percentile(bounds, counts, share):
    """By counts in buckets; within one as if they were spread evenly."""
    wanted, below, low = share * sum(counts), 0, 0.0
    for high, count in zip([*bounds, 2 * bounds[-1]], counts):
        if count and below + count >= wanted:
            return low + (high - low) * (wanted - below) / count
        below, low = below + count, high
    return math.nan


def under(hall, names, target, seconds):
    """A stretch with these attacks, and what they did."""
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    window = Window(hall)
    started = [context.Process(target=attacks.run, args=(name, target, seconds, results)) for name in names]
    for process in started:
        process.start()
    for process in started:
        process.join(seconds + 30)
        if process.is_alive():
            process.kill()
    told = window.close()
    achieved = {}
    while not results.empty():
        name, what = results.get()
        achieved[name] = what
    return told, "; ".join(achieved.get(name, "no answer") for name in names)


def quiet(hall, seconds):
    window = Window(hall)
    time.sleep(seconds)
    return window.close()


def row(name, before, told, achieved):
    ratio = told["p99_us"] / before["p99_us"]
    found = {"ratio": ratio, "lost": told["lost"], "memory_mib": told["memory_mib"], "lines": told["lines"]}
    missed = [key for key, goal in GOALS.items() if not found[key] <= goal]
    words = "met" if not missed else "missed: " + ", ".join(missed)
    if told["state"] != "playing":
        words = f"the show did not go on: {told['state']}"
    print(
        f"| {name} | {achieved} | {before['p99_us']:.0f} | {told['p99_us']:.0f} | {ratio:.2f} | "
        f"{before['missed']} / {told['missed']} | {before['lost']} / {told['lost']} | {told['memory_mib']:.1f} / {told['helpers_mib']:.0f} | {told['lines']} | {words} |",
        flush=True,
    )


@contextlib.contextmanager
def small_disk(folder):
    """A file system of 160 MiB, where this process may mount one."""
    disk = folder / "disk"
    disk.mkdir()
    if os.geteuid() != 0:
        yield disk, False
        return
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=160m", "kinocue-abuse", disk], capture_output=True)
    try:
        yield disk, done.returncode == 0
    finally:
        if done.returncode == 0:
            subprocess.run(["umount", disk], check=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/kinocue", type=pathlib.Path)
    parser.add_argument("--seconds", default=10.0, type=float, help="length of each stretch")
    parser.add_argument("--controllers", default=64, type=int)
    parser.add_argument("--rate", default=1000, type=int, help="ticks per second")
    parser.add_argument("--port", default=28410, type=int, help="the frame port; the controllers take those after it")
    parser.add_argument("--only", choices=list(attacks.ALL), help="this attack alone")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="kinocue-abuse.") as name, small_disk(pathlib.Path(name)) as (disk, full):
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        hall = Hall(args.program.resolve(), folder, args.controllers, args.rate, args.port, disk)
        try:
            hall.play()
            target = {"socket": str(hall.socket), "frame_port": args.port, "disk": str(disk)}
            names = [args.only] if args.only else list(attacks.ALL)
            if not full and "full disk" in names:
                print("full disk: left out, needs root for a small file system", file=sys.stderr)
                names.remove("full disk")
            print("| abuse | what came of it | p99 quiet, us | p99, us | ratio | missed ticks, quiet / abused |"
                  " frames lost, quiet / abused | server grew / helpers, MiB | log lines | goals |")
            print("|---|---|---|---|---|---|---|---|---|---|")
            for group in [[name] for name in names] + ([names] if len(names) > 1 else []):
                before = quiet(hall, args.seconds)
                told, achieved = under(hall, group, target, args.seconds)
                row(group[0] if len(group) == 1 else "all together", before, told, achieved)
        finally:
            code = hall.end()
        print(f"\nThe server parked and ended with {code}.")


if __name__ == "__main__":
    main()
