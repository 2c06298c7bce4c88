#!/usr/bin/env python3
"""How old a desk's picture of its halls is, what that costs the engine, and how soon all of them hear a stop.

    benches/fleet/run.py [--halls N] [--real N [--play]] [--seconds S] [--program PATH]

Light halls speak for themselves alone, each with its own key and connection: a status of the length of a real one twice a second, and an
answer to each stop. `--real` adds whole halls with two simulated seats each, with their links; `--play` has each of them play, and kills the
engine in mid-show, before all are stopped. Engine, desk and halls are on this machine, on loopback, and share its processors. Needs nats-server, and nats-py with nkeys (pip install nats-py nkeys).
"""

import argparse
import asyncio
import json
import math
import os
import random
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import nats

ROOT = Path(__file__).resolve().parents[2]
# Below the ports that the system gives out by itself: among so many halls it would give one out twice.
PORTS = 21_000
# The seats of a show have joined after so long, at the most.
JOINED_S = 10
# As one of our halls tells of itself in a show.
STATUS = {
    "format": 1, "at": "2026-11-21T19:05:12.400+01:00", "seq": 0, "hall": "", "version": "0.1.0", "state": "playing",
    "cause": "the seats that take part are on the cue", "next": "nothing; pause, park or stop as needed", "since_s": 312.4, "moving": True,
    "show": {"cue": "storm", "sha256": "0" * 64, "length_s": 5400.0, "position_s": 312.4}, "level": 0.8,
    "seats": {"total": 64, "taking_part": 63, "lost": 1}, "warnings_total": 1,
    "warnings": [{"id": "seat-lost", "severity": "error", "controller": "F4", "text": "answered nothing for 0.5 s",
                  "remedy": "check its power and its network; it rejoins by itself once it answers", "since": "2026-11-21T19:03:10.000+01:00"}],
}


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def processor_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mib(pid):
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


async def light_hall(name, url, seed, told):
    client = await nats.connect(url, nkeys_seed=str(seed), inbox_prefix=f"_INBOX_hall.{name}".encode())

    async def stop(message):
        told[name] = time.monotonic()
        await message.respond(json.dumps({"hall": name, "status": 200, "reply": {"stopping": True}}).encode())

    site = name.split(".")[0]
    for subject in (f"kc.stop.{name}.*", f"kc.stop.{site}.all.*"):
        await client.subscribe(subject, cb=stop)
    await asyncio.sleep(random.random() / 2)
    status, due = {**STATUS, "hall": name}, time.monotonic()
    while True:
        status["seq"] += 1
        await client.publish(f"kc.status.{name}", json.dumps(status).encode())
        due += 0.5
        await asyncio.sleep(max(0, due - time.monotonic()))


def ask(address, path, body=None):
    request = urllib.request.Request(f"{address}api/v1/fleet/{path}", data=body and json.dumps(body).encode())
    with urllib.request.urlopen(request, timeout=20) as reply:
        return json.load(reply)


def quantile(figures, part):
    return sorted(figures)[min(len(figures) - 1, int(len(figures) * part))]


async def measure(args, folder):
    names = [f"h{number:04}" for number in range(args.halls + args.real)]
    engine_at = f"127.0.0.1:{free_port()}"
    init = ["fleet", "init", "--site", "bench", "--halls", ",".join(names), "--engine", engine_at, "--folder", str(folder / "fleet")]
    subprocess.run([args.program, *init], check=True, stdout=subprocess.DEVNULL)
    conf = folder / "fleet/nats-server.conf"
    conf.write_text(conf.read_text().replace("/var/lib/nats/jetstream", str(folder / "store")))
    running = []

    def start(*command, **more):
        running.append(subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, **more))
        return running[-1]

    try:
        serve = lambda: start(shutil.which("nats-server") or "/usr/sbin/nats-server", "-c", str(conf), stderr=subprocess.DEVNULL)
        engine = serve()
        settings = folder / "fleet/office/desk.toml"
        settings.write_text(settings.read_text() + '[api]\nlisten = ["127.0.0.1:0"]\nopen_role = "view"\n')
        while socket.socket().connect_ex(("127.0.0.1", int(engine_at.split(":")[1]))):
            await asyncio.sleep(0.05)
        desk = start(args.program, "fleet", "desk", "--desk", str(settings), stderr=subprocess.PIPE, text=True)
        address = next(line.split(" at ")[1].strip() for line in desk.stderr if " at http" in line)
        for number, name in enumerate(names[args.halls :]):
            start_hall(args.program, folder, name, PORTS + 3 * number, start)
        told = {}
        of = lambda name: light_hall(f"bench.{name}", f"nats://{engine_at}", folder / f"fleet/{name}/fleet.nk", told)
        halls = [asyncio.create_task(of(name)) for name in names[: args.halls]]
        loop = asyncio.get_running_loop()
        page = lambda: loop.run_in_executor(None, ask, address, "halls")
        await hear_all(page)
        shows = [Show(args.program, folder / name) for name in names[args.halls :] if args.play]
        ages, replies_ms, before, began = [], [], (processor_s(engine.pid), processor_s(desk.pid)), time.monotonic()
        while time.monotonic() - began < args.seconds:
            asked = time.monotonic()
            ages += [hall["age_s"] for hall in (await page())["halls"]]
            replies_ms.append((time.monotonic() - asked) * 1000)
            await asyncio.sleep(0.1)
        took = time.monotonic() - began
        share = [100 * (processor_s(one.pid) - earlier) / took for one, earlier in zip((engine, desk), before)]
        print(f"{args.halls} light and {args.real} whole halls, {took:.0f} s, {len(replies_ms)} looks")
        print(f"age of a status      p50 {statistics.median(ages):.2f}  p99 {quantile(ages, 0.99):.2f}  p99.9 {quantile(ages, 0.999):.2f}  greatest {max(ages):.2f} s")
        print(f"a look at the page   p50 {statistics.median(replies_ms):.1f}  p99 {quantile(replies_ms, 0.99):.1f} ms")
        print(f"engine               {share[0]:.1f} % of a core, {resident_mib(engine.pid):.0f} MiB")
        print(f"desk                 {share[1]:.1f} % of a core, {resident_mib(desk.pid):.0f} MiB")
        if shows:
            engine.kill()
            await asyncio.sleep(10)
            engine = serve()
            await hear_all(page)
            lost, other = sum(show.lost() for show in shows), [show.own.name for show in shows if not show.plays_on()]
            print(f"{len(shows)} shows           {sum(show.sent() for show in shows)} frames, {lost} lost; not on in their show: {', '.join(other) or 'none'}")
        asked = time.monotonic()
        answers = await loop.run_in_executor(None, ask, address, "stop", {"halls": ["all"]})
        all_ms = (time.monotonic() - asked) * 1000
        heard_ms = [(at - asked) * 1000 for at in told.values()]
        heard = f"; light halls heard it after p50 {statistics.median(heard_ms):.1f}, greatest {max(heard_ms):.1f} ms" if heard_ms else ""
        done = sum(answer["done"] for answer in answers)
        print(f"a stop of all        {done} of {len(answers)} done after {all_ms:.0f} ms{heard}")
        for hall in halls:
            hall.cancel()
    finally:
        for one in reversed(running):
            one.terminate()
        for one in running:
            one.wait(30)


async def hear_all(page):
    """Waits until the desk hears all halls."""
    began = time.monotonic()
    while silent := [hall["name"] for hall in (await page())["halls"] if hall["silent"]]:
        if time.monotonic() - began > 120:
            sys.exit(f"not heard after 120 s: {', '.join(silent)}")
        await asyncio.sleep(0.5)


class Show:
    """A hall that plays; what became of that, asked of the hall itself."""

    def __init__(self, program, own):
        self.program, self.own = program, own
        for words in (["preflight"], ["load", "waves"], ["arm"], ["go"]):
            self.ask(*words)
        self.went = time.monotonic()

    def ask(self, *words):
        command = [self.program, *words, "--socket", str(self.own / "control.sock")]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def status(self):
        return json.loads(self.ask("status", "--json"))

    def counted(self, what):
        return sum(one[what] for one in self.status()["controllers"])

    def sent(self):
        return self.counted("sent")

    def lost(self):
        return self.counted("lost") + self.counted("refused") + self.counted("send_failed")

    def plays_on(self):
        """It has been playing since its seats had joined."""
        status = self.status()
        return status["state"] == "playing" and status["since_s"] > time.monotonic() - self.went - JOINED_S


def start_hall(program, folder, name, port, start):
    """A whole hall that sends from that port to two simulated seats at those after it, and its link."""
    own = folder / name
    (own / "cues").mkdir(parents=True)
    waves = (f"{n},{0.5 + 0.2 * math.sin(1.3 * n) * min(1, n / 10):.4f}\n" for n in range(600))
    (own / "cues/waves.csv").write_text("# interpolation: spline\ntime_s,a1\n" + "".join(waves))
    ports = [port + 1, port + 2]
    seats = "".join(f'[[controller]]\nname = "A{n}"\nseat = "s"\naddress = "127.0.0.1:{port}"\n' for n, port in enumerate(ports))
    (own / "hall.toml").write_text(
        f'[show]\nname = "{name}"\nbind = "127.0.0.1:{port}"\nlibrary = "{own}/cues"\n[seat.s]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n'
        "max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n"
        f"{seats}{(folder / f'fleet/{name}/kinocue-fleet.toml').read_text()}"
    )
    state = ["--socket", str(own / "control.sock"), "--state", str(own / "state")]
    start(program, "serve", "--rehearse", "--config", str(own / "hall.toml"), *state, stderr=subprocess.DEVNULL)
    settings = ["--config", str(folder / f"fleet/{name}/fleet.toml"), "--socket", str(own / "fleet.sock")]
    start(program, "fleet", "link", *settings, stderr=subprocess.DEVNULL)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--halls", type=int, default=1000, help="light halls")
    parser.add_argument("--real", type=int, default=0, help="whole halls")
    parser.add_argument("--play", action="store_true", help="a show in each whole hall")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--program", default=str(ROOT / "target/release/kinocue"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="kinocue-fleet-") as folder:
        asyncio.run(measure(args, Path(folder)))


main()
