#!/usr/bin/env python3
"""How far the seats are from the film, judged on the wire: mpv shows a film, `kinocue play --chase` follows it with a cue that is
one ramp, so that each frame's position says for which instant of the film it was made, and the kernel's stamp when it left. Where
the film is, mpv is asked on a connection of the judge's own. Prints the table of benches/README.md; shown, not gated.

    cargo build --release && benches/film/run.py [--seconds 120] [--only "idle"] [--only "two hours"] [--rate 100]

Loopback only, in a folder of its own. Needs mpv; for "jack" also jackd, for "ltc" and "sound" jack_capture as well. Python 3.10 or later, nothing besides.
"""

import argparse
import contextlib
import json
import multiprocessing
import os
import pathlib
import shutil
import statistics
import subprocess
import tempfile
import time

from judge import Between, Play, Player, Ramp, Seat, Sender, chords, film, silence

SETTLED_S = 10.0  # after a join; of five in a minute the next waits for a person


def spread(values):
    values = sorted(values)
    p99 = values[(len(values) - 1) * 99 // 100]
    return f"median {statistics.median(values):.2f}, p99 {p99:.2f}, most {values[-1]:.2f} ms of {len(values)}"


class Show:
    """One play of one film."""

    def __init__(self, args, folder, player=(), lost=0.0, between=False, seconds=200.0, until="playing: ", source=None, film=None, more=(), shown=None, ask_every=0.02, ramp=None):
        self.ramp = ramp or Ramp(seconds)
        self.seat = Seat(args.program, folder)
        self.player = shown or Player(folder, film or args.film, player, ask_every)
        self.between = Between(folder, self.player, lost) if lost or between else None
        self.until = until
        source = source or f"mpv:{(self.between or self.player).socket}"
        cue = self.ramp.write(folder / "ramp.csv")
        self.play = Play(args.program, cue, self.seat.to, source, args.rate, more)

    def __enter__(self):
        try:
            self.play.says(self.until)
        except BaseException:
            self.__exit__()
            raise
        self.began, self.said = time.monotonic(), len(self.play.lines)
        return self

    def holds(self):
        """How often the seats have held since they had joined."""
        return sum("waiting: " in line for line in self.play.lines[self.said :])

    def errors(self, frames, since, until, ahead_s=0.0):
        """How far the film is ahead of the seats where each frame ends, ms."""
        place, self.film_rate, self.film_left = self.player.clock(since, until)
        ends = ((at, at + lasts, self.ramp.media(pulses)) for at, lasts, pulses in frames if since <= at <= until)
        return [(at, (place(end) + ahead_s - media) * 1e3) for at, end, media in ends if media is not None]

    def errors_of_bent(self, frames, since, until):
        """The same by a film that bends as its player's clock does."""
        place = self.player.bent(since, until)
        ends = ((place(at + lasts), self.ramp.media(pulses)) for at, lasts, pulses in frames if since <= at <= until)
        return [(film - media) * 1e3 for film, media in ends if film is not None and media is not None]

    def __exit__(self, *_):
        self.play.close()
        if self.between:
            self.between.close()
        self.player.close()
        self.seat.close()


def follow(args, folder, player=(), lost=0.0):
    with Show(args, folder, player, lost, seconds=args.seconds + 40) as show:
        time.sleep(SETTLED_S + args.seconds)
        frames = show.seat.frames()
        holds = show.holds()
    span = show.began + SETTLED_S, show.began + SETTLED_S + args.seconds
    errors, bent = [error for _, error in show.errors(frames, *span)], show.errors_of_bent(frames, *span)
    bias, gap = statistics.median(errors), max(b[0] - a[0] for a, b in zip(frames, frames[1:]))
    told = "; ".join(" ".join(line.split()) for line in show.play.lines if line.startswith(("ticks", "lateness")))
    astray, steps = show.player.astray(*span)
    film = f"film {1e6 * (show.film_rate - 1):+.0f} ppm, its own answers beside a straight line {spread(1e3 * one for one in astray)}"
    film += f", {len(steps)} steps of over 2 ms, the greatest {1e3 * max(map(abs, steps), default=0.0):.1f} ms"
    film += f"; |error| by the player's own answers around each frame {spread(map(abs, bent))}"
    return f"|error| {spread(map(abs, errors))}; bias {bias:+.2f} ms, holds {holds}, longest gap between frames {1e3 * gap:.0f} ms; {told}; {film}"


def two_hours(args, folder):
    """A player that is 300 ppm fast, each four minutes of it held to a straight line of their own: in two hours this machine's clock bends."""
    turn_s, turns_each, stretches = 120.0, 2, args.stretches
    stretch_s = turn_s * turns_each
    sound = silence(folder, stretch_s * (stretches + 1) + 60)
    with Show(args, folder, ["--ao-null-speed=1.0003"], film=sound, ramp=Ramp(turn_s, turns_each * (stretches + 1))) as show:
        medians, errors, bent = [], [], []
        time.sleep(SETTLED_S)
        for turn in range(stretches):
            since, said = time.monotonic(), len(show.play.lines)
            time.sleep(stretch_s)
            frames = [frame for frame in show.seat.frames() if since <= frame[0] <= since + stretch_s]
            line, rate, left = show.player.clock(since, since + stretch_s)
            those, by_answers = (off(show.ramp, frames, place) for place in (line, show.player.bent(since, since + stretch_s)))
            if those and by_answers:
                medians.append(statistics.median(those))
                errors += map(abs, those)
                bent += map(abs, by_answers)
                told = f"median {medians[-1]:+.3f} ms, {spread(map(abs, those))}; by its answers {spread(map(abs, by_answers))}"
            else:
                told = f"nothing to judge: {len(frames)} frames"
            told += f"; film {1e6 * (rate - 1):+.1f} ppm, answers within {1e3 * left:.2f} ms; holds {show.holds()}, load {os.getloadavg()[0]:.1f}"
            print(f"  {(turn + 1) * stretch_s / 60:.0f} min: {told}", *show.play.lines[said:], sep="\n    ", flush=True)
    told = f"|error| {spread(errors)}; by its answers {spread(bent)}; "
    told += f"medians of four minutes {min(medians):+.3f} to {max(medians):+.3f}, first {medians[0]:+.3f}, last {medians[-1]:+.3f} ms"
    return told + "; " + "; ".join(" ".join(line.split()) for line in show.play.lines if line.startswith(("ticks", "lateness", "film")))


def off(ramp, frames, place):
    """How far a film of many turns is ahead of the seats where each frame ends, ms."""
    ends = ((place(at + lasts), pulses) for at, lasts, pulses in frames)
    there = ((film_s, ramp.media(pulses, int(film_s // ramp.seconds))) for film_s, pulses in ends if film_s is not None)
    return [(film_s - media) * 1e3 for film_s, media in there if media is not None]


def loaded(args, folder, measure=follow):
    busy = [multiprocessing.Process(target=spin, daemon=True) for _ in range(os.cpu_count())]
    [one.start() for one in busy]
    try:
        return measure(args, folder)
    finally:
        [one.terminate() for one in busy]


def spin():
    while True:
        pass


@contextlib.contextmanager
def jack_server():
    """JACK without a sound card, under a name of its own."""
    os.environ["JACK_DEFAULT_SERVER"] = name = f"kinocue-{os.getpid()}"
    command = ["jackd", "--realtime", "-n", name, "-d", "dummy", "-r", "48000", "-p", "256"]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        time.sleep(2)
        yield
    finally:
        server.terminate()
        server.wait()


JACK = ["--ao=jack", "--jack-autostart=no"]
CAPTURE = "pipe:jack_capture -ws --channels 1 --port mpv:out_0 --no-stdin"


def jack(args, folder):
    if not shutil.which("jackd"):
        return "not measured: no jackd"
    with jack_server():
        return follow(args, folder, JACK)


def captured(args, folder, source, more, film, begin_s):
    """A film that is heard of JACK's port, against the player's own clock; what is late on the whole is calibrated."""
    with jack_server(), Show(args, folder, JACK, seconds=args.seconds + 40, source=source, film=film, more=more) as show:
        time.sleep(begin_s)
        since = time.monotonic()
        measuring = [args.program, "sync", "calibrate", source, "--against", f"mpv:{show.player.socket}", "--seconds", "20", *more, "--json"]
        told = json.loads(subprocess.run(list(map(str, measuring)), capture_output=True, text=True, check=True).stdout)["median_ms"]
        time.sleep(max(since + args.seconds - time.monotonic(), 0))
        frames = show.seat.frames()
        holds = show.holds()
    errors = [error for _, error in show.errors(frames, since, since + args.seconds)]
    bias = statistics.median(errors)
    off = spread(abs(error - bias) for error in errors)
    return f"|error - bias| {off}; bias {bias:+.2f} ms, calibrated as {told:+.2f} ms: {abs(bias - told):.2f} ms are left; holds {holds}"


def ltc(args, folder):
    if not shutil.which("jackd") or not shutil.which("jack_capture"):
        return "not measured: no jackd, or no jack_capture"
    tape = folder / "tape.wav"
    made = [args.program, "sync", "send", "--ltc", "--film-fps", "25", "--seconds", f"{args.seconds + 60:.0f}", "-o", tape]
    subprocess.run(list(map(str, made)), check=True)
    return captured(args, folder, f"ltc:{CAPTURE}", ["--film-fps", "25"], tape, SETTLED_S)


def artnet(args, folder):
    sender = Sender("127.0.0.1", args.seconds + 60)
    more = ["--film-fps", "25"]
    with Show(args, folder, seconds=args.seconds + 40, source=f"artnet:127.0.0.1,bind={sender.to}", more=more, shown=sender) as show:
        time.sleep(SETTLED_S + args.seconds)
        frames = show.seat.frames()
        holds = show.holds()
    errors = [error for _, error in show.errors(frames, show.began + SETTLED_S, show.began + SETTLED_S + args.seconds)]
    return f"sent 0 to 10 ms late: |error| {spread(map(abs, errors))}; bias {statistics.median(errors):+.2f} ms, holds {holds}"


def sound(args, folder):
    if not shutil.which("jackd") or not shutil.which("jack_capture"):
        return "not measured: no jackd, or no jack_capture"
    storm, index = chords(folder, args.seconds + 60), folder / "storm.kidx"
    subprocess.run([args.program, "sync", "index", storm, "-o", index], check=True, stdout=subprocess.DEVNULL)
    return captured(args, folder, f"sound:{CAPTURE},index={index}", [], storm, SETTLED_S)


def lock(args, folder):
    took = []
    for _ in range(args.times):
        with Show(args, folder, ["--pause"], between=True, until="waiting: ") as show:
            time.sleep(1.0)
            show.between.forget()
            show.player.tell("set_property", "pause", False)
            show.play.says("playing: ")
            time.sleep(0.3)
            took.append(1e3 * (show.seat.frames()[0][0] - show.between.first))
    return f"first position to first frame {spread(took)}, of which 500 ms are waited whether it stays so"


def step(args, folder):
    after = []
    with Show(args, folder, between=True) as show:
        time.sleep(SETTLED_S)
        for turn in range(6):
            since = time.monotonic()
            ahead_s = show.between.ahead.value = 0.038 * ((turn + 1) % 2)
            time.sleep(7.0)
            errors = show.errors(show.seat.frames(), since, since + 7.0, ahead_s)
            worst = lambda first: max(abs(error) for at, error in errors if at - since >= first)
            sign = 1 if turn % 2 == 0 else -1
            after.append((worst(3.0), worst(4.5), max(-sign * error for _, error in errors)))
        holds = show.holds()
    three, four, over = (max(column) for column in zip(*after))
    return f"38 ms to either side, {len(after)} times, holds {holds}: after 3 s {three:.1f} ms, after 4.5 s {four:.1f} ms, over by {over:.1f} ms at most"


def pause(args, folder):
    slower, still = [], []
    with Show(args, folder) as show:
        time.sleep(5.0)
        usual = show.ramp.per_s * 300_000
        for _ in range(args.times):
            show.seat.frames()
            said = len(show.play.lines)
            show.player.tell("set_property", "pause", True)
            time.sleep(1.5)
            told = [at for at, event in show.player.events if event.get("name") == "pause" and event.get("data")][-1]
            frames = [frame for frame in show.seat.frames() if frame[0] > told - 0.1]
            steps = [(b[0], (b[2] - a[2]) / b[1] / usual) for a, b in zip(frames, frames[1:])]
            slower.append(1e3 * (next(at for at, pace in steps if at > told and pace < 0.95) - told))
            still.append(1e3 * (next((at for at, pace in steps if at > told and pace == 0), frames[-1][0]) - told))
            show.play.says("waiting: ", said)
            show.player.tell("set_property", "pause", False)
            show.play.says("playing: ", said)
            time.sleep(10.0)
    return f"told to first slower frame {spread(slower)}; to rest {spread(still)}"


def seek(args, folder, sound="ac3"):
    """Of a film whose sound is in small blocks, as films have it. What mpv writes as PCM is silent after a seek until the next block of a third of a second."""
    film_of = film(folder, max(args.seconds + 60, 220), sound)
    columns = {"its sound has a clock": [], "from then the join's first frame": [], "landed to that frame": [], "the join": [], "from its end within 20 ms": []}
    with Show(args, folder, film=film_of, ask_every=0.005) as show:
        time.sleep(5.0)
        usual = show.ramp.per_s * 300_000
        for turn in range(args.times):
            show.seat.frames()
            target = 20.0 + 50.0 * ((turn + 1) % 2) + turn
            show.player.tell("seek", target, "absolute")
            time.sleep(3.5)
            at = [when for when, event in show.player.events if event["event"] == "playback-restart"][-1]
            clock = next((when for when, _, _ in show.player.answers if when > at), None)
            frames, until = show.seat.frames(), time.monotonic()
            rests = [b[0] for a, b in zip(frames, frames[1:]) if b[0] > at and a[2] == b[2]]
            steps = [(b[0], (b[2] - a[2]) / b[1] / usual) for a, b in zip(frames, frames[1:]) if rests and b[0] > rests[0]]
            moves = next((when for when, pace in steps if pace != 0), None)
            joined = next((when for when, pace in reversed(steps) if abs(pace - 1.0) > 0.15), None)
            errors = show.errors(frames, at + 0.05, until) if clock else []
            near = next((when for when, error in errors if all(abs(e) < 20 for w, e in errors if w >= when)), None)
            if clock and moves and joined and near:
                took = (clock - at, moves - clock, moves - at, joined - moves, max(near - joined, 0.0))
                [column.append(1e3 * one) for column, one in zip(columns.values(), took)]
            time.sleep(9.5)
    return "; ".join(f"{name} {spread(column)}" for name, column in columns.items())


CASES = {
    "lock": lock,
    "idle": follow,
    "busy": loaded,
    "jack": jack,
    "jack, busy": lambda args, folder: loaded(args, folder, jack),
    "artnet": artnet,
    "ltc": ltc,
    "sound": sound,
    "300 ppm": lambda args, folder: follow(args, folder, ["--ao-null-speed=1.0003"]),
    "two hours": two_hours,
    "losses": lambda args, folder: follow(args, folder, lost=0.2),
    "step": step,
    "pause": pause,
    "seek": seek,
    "seek in PCM": lambda args, folder: seek(args, folder, "pcm_s16le"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--program", type=pathlib.Path, default=root / "target/release/kinocue")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--times", type=int, default=12, help="pauses, and seeks")
    parser.add_argument("--rate", type=int, default=100)
    parser.add_argument("--stretches", type=int, default=29, help="of \"two hours\", four minutes each")
    parser.add_argument("--only", choices=CASES, action="append")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(KeyboardInterrupt):
        folder = pathlib.Path(folder)
        args.film = film(folder, max(args.seconds + 60, 220)) if args.only != ["two hours"] else None
        for name in args.only or (name for name in CASES if name != "two hours"):
            print(f"{name:11} {CASES[name](args, folder)}", flush=True)


if __name__ == "__main__":
    main()
