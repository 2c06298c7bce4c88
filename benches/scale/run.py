#!/usr/bin/env python3
"""How many controllers one machine can lead: shows of ever more of them, every frame acked and accounted for. Prints a row for each hall,
with what each thread of the server took of a processor, and what `kinocue serve` says of it at its start.

    cargo build --release && benches/scale/run.py [--seconds 20] [--halls 64x1000 256x1000 1024x100]

The controllers are simulated on the same machine, and want about as much of it as the server. Loopback only, in a folder of its own, which
it removes; it ends only what it started. Python 3.9 or later, nothing besides.
"""

import argparse
import contextlib
import os
import pathlib
import resource
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "abuse"))
from run import SETTLE_S, Hall, percentile  # noqa: E402

HALLS = ["64x1000", "128x1000", "256x250", "256x1000", "512x100", "1024x50", "1024x100"]
COUNTS = ("sent", "asked", "acked", "refused", "lost", "send_failed")


def threads(pid):
    """Processor time of each thread of a process so far, s."""
    tick, all = os.sysconf("SC_CLK_TCK"), {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):
            name, rest = (task / "stat").read_text().split("(", 1)[1].rsplit(")", 1)
            fields = rest.split()
            all[name] = all.get(name, 0.0) + (int(fields[11]) + int(fields[12])) / tick
    return all


def sums(status):
    return {key: sum(one.get(key, 0) for one in status["controllers"]) for key in COUNTS}


def measured(hall, seconds):
    before, since = hall.status(), time.monotonic()
    own, sim = threads(hall.server.pid), threads(hall.sim.pid)
    time.sleep(seconds)
    after, passed = hall.status(), time.monotonic() - since
    share = lambda now, then: {name: (now[name] - then.get(name, 0.0)) / passed for name in now}
    own, sim = share(threads(hall.server.pid), own), share(threads(hall.sim.pid), sim)
    out = sum(one["health"] not in ("ok", "degraded") for one in after["controllers"])
    time.sleep(SETTLE_S)
    counts, first = sums(hall.status()), sums(before)
    grown = {key: counts[key] - first[key] for key in COUNTS}
    bounds = before["lateness"]["histogram"]["bounds_us"]
    late = [b - a for a, b in zip(before["lateness"]["histogram"]["counts"], after["lateness"]["histogram"]["counts"])]
    return {
        "state": after["state"],
        "ticks": after["ticks"] - before["ticks"],
        "missed": after["missed_ticks"] - before["missed_ticks"],
        "p50": percentile(bounds, late, 0.5),
        "p99": percentile(bounds, late, 0.99),
        "out": out,
        "threads": sorted(((name, part) for name, part in own.items() if part >= 0.01), key=lambda one: -one[1]),
        "sim": sum(sim.values()),
        **grown,
    }


def told(count, rate, found, warning):
    took = ", ".join(f"{name} {part:.0%}" for name, part in found["threads"])
    print(
        f"| {count} x {rate} | {found['state']} | {found['missed']} of {found['missed'] + found['ticks']} | {found['p50']:.0f} / {found['p99']:.0f} | "
        f"{found['sent']} | {found['acked']} | {found['lost']} | {found['out']} | {took} | {found['sim']:.0%} | {warning} |",
        flush=True,
    )


def one(program, count, rate, seconds, port):
    with tempfile.TemporaryDirectory(prefix="kinocue-scale.") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        hall = None
        try:
            hall = Hall(program, folder, count, rate, port, folder)
            lines = (folder / "serve.log").read_text().splitlines()
            crowded = next((line for line in lines if "ticks may be missed" in line), "")
            hall.play()
            time.sleep(2)
            told(count, rate, measured(hall, seconds), crowded.split(": ", 1)[-1].replace("|", "/"))
        except SystemExit as why:
            print(f"| {count} x {rate} | {str(why).splitlines()[0][:300]} |", flush=True)
        if hall:
            with contextlib.suppress(SystemExit):
                hall.ask("stop")
            hall.end()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/kinocue", type=pathlib.Path)
    parser.add_argument("--seconds", default=20.0, type=float, help="length of each show")
    parser.add_argument("--halls", nargs="+", default=HALLS, help="controllers x ticks per second")
    parser.add_argument("--port", default=31410, type=int, help="the frame port; the controllers take those after it")
    args = parser.parse_args()
    # A socket for each controller.
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    print("| hall | state | missed ticks | lateness p50 / p99, us | sent | acked | lost | seats out | server's threads, of a core | controllers | said at the start |")
    print("|" + "---|" * 11)
    for hall in args.halls:
        count, rate = map(int, hall.split("x"))
        one(args.program.resolve(), count, rate, args.seconds, args.port)


if __name__ == "__main__":
    main()
