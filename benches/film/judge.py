"""What a judge needs who trusts nothing of kinocue: a ramp as a cue, a relay that has the kernel stamp each frame, and a player
that is asked on a connection of the judge's own."""

import array
import bisect
import contextlib
import json
import math
import multiprocessing
import os
import pathlib
import random
import select
import socket
import statistics
import struct
import subprocess
import threading
import time
import wave

STROKE = 300_000  # pulses
EASE_S = 2.0  # at either end of the ramp
MOTION = (0x1301, 0x1401)


class Ramp:
    """A cue whose position says which instant of the film it is. Of a long film a pulse would be too many milliseconds: its ramp goes
    up and down, `times` in all."""

    def __init__(self, seconds, times=1):
        self.seconds, self.times, self.per_s = seconds, times, 1.0 / (seconds - EASE_S)

    def write(self, path):
        rows = (f"{20 * n},{self.of_film(n / 50):.9f}\n" for n in range(int(self.seconds * self.times * 50) + 1))
        path.write_text("time_ms,a1\n" + "".join(rows))
        return path

    def of_film(self, t):
        turn, within = divmod(t, self.seconds)
        return self.at(within) if turn % 2 == 0 else self.at(self.seconds - within)

    def at(self, t):
        if t < EASE_S:
            return self.per_s * t * t / (2 * EASE_S)
        if t > self.seconds - EASE_S:
            return 1.0 - self.per_s * (self.seconds - t) ** 2 / (2 * EASE_S)
        return self.per_s * (t - EASE_S / 2)

    def media(self, pulses, turn=0):
        """The instant of the film in the ramp's so many-th turn; None where the ramp is not straight."""
        media = pulses / STROKE / self.per_s + EASE_S / 2
        if not EASE_S < media < self.seconds - EASE_S:
            return None
        return turn * self.seconds + (media if turn % 2 == 0 else self.seconds - media)


def wall_to_mono():
    """What the wall clock is ahead of the machine's, by the narrowest of some readings."""
    readings = []
    for _ in range(5):
        before, wall, after = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
        readings.append((after - before, wall - (before + after) // 2))
    return min(readings)[1]


def hurry():
    """Takes real-time priority where it may: a controller shares no processor with whoever keeps this machine busy."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))


def relay(inner, controller, frames):
    """Passes on what goes to a controller and comes from it, and tells when the kernel had each frame."""
    hurry()
    inner.setsockopt(socket.SOL_SOCKET, socket.SO_TIMESTAMPNS_NEW if hasattr(socket, "SO_TIMESTAMPNS_NEW") else 35, 1)
    outer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    outer.connect(controller)
    host, batch = None, []
    while True:
        ready, _, _ = select.select([inner, outer], [], [], 0.1)
        if inner in ready:
            data, extra, _, host = inner.recvmsg(2_048, 64)
            stamp = next(struct.unpack("qq", value[:16]) for _, _, value in extra)
            mono = stamp[0] * 1_000_000_000 + stamp[1] - wall_to_mono()
            with contextlib.suppress(OSError):
                outer.send(data)
            batch.append((mono * 1e-9, data))
        if outer in ready and host:
            with contextlib.suppress(OSError):
                inner.sendto(outer.recv(2_048), host)
        if len(batch) >= 10 or (batch and not ready):
            frames.send(batch)
            batch = []


class Seat:
    """A simulated controller behind a relay."""

    def __init__(self, program, folder):
        command = [program, "sim", "--axes", "6", "--listen", "127.0.0.1:0", "--host-port", "0"]
        self.sim = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, preexec_fn=hurry)
        address = next(line.split()[-1] for line in self.sim.stderr if line.startswith("ready "))
        host, port = address.rsplit(":", 1)
        inner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        inner.bind(("127.0.0.1", 0))
        self.to = "127.0.0.1:%d" % inner.getsockname()[1]
        self.pipe, other = multiprocessing.Pipe(False)
        self.relay = multiprocessing.Process(target=relay, args=(inner, (host, int(port)), other), daemon=True)
        self.relay.start()
        self.seen = []
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        with contextlib.suppress(EOFError, OSError):
            while True:
                for at, data in self.pipe.recv():
                    if len(data) >= 24 and struct.unpack_from(">H", data, 4)[0] in MOTION:
                        self.seen.append((at, struct.unpack_from(">I", data, 16)[0] / 1e3, struct.unpack_from(">i", data, 20)[0]))

    def frames(self):
        """What went by since that was asked last: when, how long it takes, where it leads."""
        time.sleep(0.3)  # the relay tells of some at a time
        found, self.seen = self.seen, []
        return found

    def close(self):
        self.relay.terminate()
        self.sim.terminate()
        self.sim.wait()


def straight(those):
    """The straight line through instants and places, and its rate."""
    middle = statistics.fmean(at for at, _ in those)
    place = statistics.fmean(media for _, media in those)
    rate = sum((at - middle) * (media - place) for at, media in those) / sum((at - middle) ** 2 for at, _ in those)
    return (lambda t: place + rate * (t - middle)), rate


class Player:
    """mpv with a film, and the judge's own connection to it, which asks where its sound is."""

    def __init__(self, folder, film, more=(), ask_every=0.02):
        self.ask_every, self.socket = ask_every, folder / "player.sock"
        self.socket.unlink(missing_ok=True)
        command = ["mpv", "--no-config", "--really-quiet", "--vo=null", "--ao=null", f"--input-ipc-server={self.socket}"]
        self.process = subprocess.Popen([*command, *more, str(film)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        until(self.socket.exists)
        self.line = socket.socket(socket.AF_UNIX)
        until(self.connects)
        self.asked, self.answers, self.events, self.over = {}, [], [], False
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()
        self.tell("observe_property", 1, "pause")

    def connects(self):
        with contextlib.suppress(OSError):
            self.line.connect(str(self.socket))
            return True

    def tell(self, *command, number=0):
        self.line.sendall((json.dumps({"command": command, "request_id": number}) + "\n").encode())

    def listen(self):
        self.line.settimeout(min(self.ask_every / 4, 0.005))
        kept, number, due = b"", 0, time.monotonic()
        while not self.over:
            if time.monotonic() >= due:
                number, due = number + 1, max(due + self.ask_every, time.monotonic())
                self.asked[number] = time.monotonic()
                with contextlib.suppress(OSError):
                    self.tell("get_property", "audio-pts", number=number)
            try:
                got = self.line.recv(65_536)
            except TimeoutError:
                continue
            except OSError:
                return
            now, kept = time.monotonic(), kept + got
            *lines, kept = kept.split(b"\n")
            for line in lines:
                self.hear(json.loads(line), now)

    def hear(self, told, now):
        if "event" in told:
            self.events.append((now, told))
        elif told.get("error") == "success" and told.get("request_id") in self.asked:
            asked = self.asked.pop(told["request_id"])
            self.answers.append(((asked + now) / 2, now - asked, told["data"]))

    def clock(self, since, until):
        """The film as a straight line between two instants: place and rate at the middle, and how far the answers are from it, s."""
        those = self.prompt(since, until)
        place, rate = straight(those)
        left = [abs(media - place(at)) for at, media in those]
        return place, rate, sorted(left)[len(left) * 99 // 100]

    def bent(self, since, until):
        """The film as its player had it about each instant: a line through the answers of half a second, which bends as the player's clock does."""
        those = self.prompt(since - 1.0, until + 1.0)
        times = [at for at, _ in those]

        def place(t):
            near = those[bisect.bisect(times, t - 0.25) : bisect.bisect(times, t + 0.25)]
            return straight(near)[0](t) if len(near) > 4 else None

        return place

    def astray(self, since, until):
        """How far each answer is from the straight line through them all, and how often the player's clock stepped by over 2 ms, s."""
        those = self.prompt(since, until)
        place, rate = straight(those)
        steps = [(b[1] - a[1]) - rate * (b[0] - a[0]) for a, b in zip(those, those[1:])]
        return [abs(media - place(at)) for at, media in those], [step for step in steps if abs(step) > 0.002]

    def prompt(self, since, until):
        """Answers between two instants that took no longer than most."""
        those = [answer for answer in self.answers if since <= answer[0] <= until]
        quick = statistics.median(answer[1] for answer in those)
        return [(at, media) for at, trip, media in those if trip <= 2 * quick]

    def close(self):
        self.over = True
        self.process.terminate()
        self.process.wait()
        self.line.close()


class Sender:
    """Sends Art-Net timecode of 25 frames a second, each frame as much as 10 ms late, by a film that is the machine's clock."""

    def __init__(self, host, seconds):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((host, 0))
            self.to = "%s:%d" % free.getsockname()
        self.begun = time.monotonic() + 0.1
        self.process = multiprocessing.Process(target=self.send, args=(host, int(seconds * 25)), daemon=True)
        self.process.start()

    def send(self, host, frames):
        hurry()
        port = self.to.rsplit(":", 1)[1]
        out, dice = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), random.Random(4)
        out.bind((host, 0))
        for n in range(frames):
            time.sleep(max(self.begun + n / 25 + 0.01 * dice.random() - time.monotonic(), 0))
            label = bytes([n % 25, n // 25 % 60, n // 1_500 % 60, n // 90_000])
            with contextlib.suppress(ConnectionRefusedError):
                out.sendto(b"Art-Net\0\0\x97\0\x0e\0\0" + label + b"\1", (host, int(port)))

    def clock(self, *_):
        return (lambda t: t - self.begun), 1.0, 0.0

    def close(self):
        self.process.terminate()
        self.process.join()


class Between:
    """Stands between kinocue and the player: answers are lost, or say another place, as the judge will have it."""

    def __init__(self, folder, player, lost=0.0):
        self.socket, self.lost, self.chance = folder / "between.sock", lost, random.Random(5)
        self.ahead, self.passed = multiprocessing.Value("d", 0.0), multiprocessing.Value("d", 0.0)
        self.socket.unlink(missing_ok=True)
        self.door = socket.socket(socket.AF_UNIX)
        self.door.bind(str(self.socket))
        self.door.listen(1)
        # A process of its own: beside the judge's threads answers would wait for one another by up to 5 ms, and seats follow what they are told.
        self.process = multiprocessing.Process(target=self.serve, args=(str(player.socket),), daemon=True)
        self.process.start()

    @property
    def first(self):
        """When a position was passed on first since `forget`."""
        return self.passed.value

    def forget(self):
        self.passed.value = 0.0

    def serve(self, player):
        hurry()
        ours, theirs = self.door.accept()[0], socket.socket(socket.AF_UNIX)
        theirs.connect(player)
        kept = {ours: b"", theirs: b""}
        while True:
            for one in select.select([ours, theirs], [], [])[0]:
                try:
                    got = one.recv(65_536)
                except ConnectionError:
                    return
                if not got:
                    return
                *lines, kept[one] = (kept[one] + got).split(b"\n")
                for line in lines:
                    self.pass_on(line, theirs if one is ours else ours, one is theirs)

    def pass_on(self, line, to, is_told):
        told = json.loads(line)
        if is_told and told.get("request_id") and isinstance(told.get("data"), float):
            if self.chance.random() < self.lost:
                return
            self.passed.value = self.passed.value or time.monotonic()
            line = json.dumps(told | {"data": told["data"] + self.ahead.value}).encode()
        to.sendall(line + b"\n")

    def close(self):
        self.process.terminate()
        self.process.join()


class Play:
    """kinocue at work, and what it says."""

    def __init__(self, program, cue, to, source, rate, more=()):
        command = [program, "play", cue, "--to", f"{to},axes=6", "--bind", "127.0.0.1:0", "--rate", rate, "--chase", source, *more]
        self.lines = []
        self.process = subprocess.Popen(
            list(map(str, command)), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        threading.Thread(target=lambda: self.lines.extend(self.process.stderr), daemon=True).start()

    def says(self, word, since=0):
        until(lambda: any(word in line for line in self.lines[since:]) or self.process.poll() is not None)
        assert self.process.poll() is None, self.lines

    def close(self):
        self.process.send_signal(2)
        self.process.wait(30)


def until(true, seconds=30.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.01)


def film(folder, seconds, sound="pcm_s16le"):
    """A film of a small picture and a tone."""
    path = pathlib.Path(folder) / f"{sound}.mkv"
    made = f"av://lavfi:testsrc=size=64x48:rate=24:duration={seconds}[out0];sine=frequency=440:sample_rate=48000:duration={seconds}[out1]"
    subprocess.run(["mpv", "--no-config", "--no-terminal", made, f"--o={path}", "--ovc=mpeg4", f"--oac={sound}"], check=True)
    return path


def chords(folder, seconds):
    """The sound of a film: other chords every third of a second, over noise."""
    path, dice, rate = pathlib.Path(folder) / "chords.wav", random.Random(7), 8_000
    sound = array.array("h")
    for n in range(int(seconds * rate)):
        if n % 2_400 == 0:
            turns = [2 * math.pi * 120 * 20 ** dice.random() / rate for _ in range(4)]
        sound.append(int(2_000 * sum(math.sin(turn * n) for turn in turns) + 3_000 * (dice.random() - 0.5)))
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", None))
        file.writeframes(sound.tobytes())
    return path


def silence(folder, seconds):
    """A film of nothing but silence, which takes a player next to no time."""
    path = pathlib.Path(folder) / "silence.wav"
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 8_000, 0, "NONE", None))
        for _ in range(int(seconds)):
            file.writeframes(bytes(16_000))
    return path
