"""What is done to the show server: each attack runs in a process of its own until its time is over, and tells what it did."""

import os
import pathlib
import random
import socket
import time

HOST = "Host: localhost\r\n"
STATUS = f"GET /api/v1/status HTTP/1.1\r\n{HOST}\r\n".encode()


def connect(target, timeout=2.0):
    peer = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    peer.settimeout(timeout)
    peer.connect(target["socket"])
    return peer


def over(seconds):
    end = time.monotonic() + seconds
    return lambda: time.monotonic() >= end


def connections(target, seconds):
    """A thousand connections, each with the beginning of a request that never ends."""
    done, held, refused = over(seconds), [], 0
    while not done():
        if len(held) < 1000:
            try:
                peer = connect(target, 0.2)
                peer.sendall(b"GET /api/v1/status HTTP/1.1\r\nX-Slow: ")
                held.append(peer)
            except OSError:
                refused += 1
                time.sleep(0.005)
        else:
            time.sleep(0.05)
    return f"{len(held)} held, {refused} refused"


def slow_readers(target, seconds):
    """Two hundred subscribers to events, and as many that ask for the largest page again and again; nobody reads."""
    done, peers, failed = over(seconds), [], 0
    asks = ["/api/v1/events", "/api/v1/openapi.json"]
    for n in range(400):
        try:
            peer = connect(target, 0.5)
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            request = f"GET {asks[n % 2]} HTTP/1.1\r\n{HOST}\r\n".encode()
            peer.sendall(request * (1 if n % 2 == 0 else 50))
            peers.append(peer)
        except OSError:
            failed += 1
    while not done():
        time.sleep(0.05)
    return f"{len(peers)} open, {failed} refused"


def header(target, seconds):
    """Headers of 100 MB, one after the other."""
    done, sent, cut = over(seconds), 0, 0
    piece = b"x" * 65536
    while not done():
        try:
            with connect(target) as peer:
                peer.sendall(b"GET /api/v1/status HTTP/1.1\r\nX-Long: ")
                for _ in range(100_000_000 // len(piece)):
                    peer.sendall(piece)
                    sent += len(piece)
                    if done():
                        break
        except OSError:
            cut += 1
            time.sleep(0.002)
    return f"{sent / 1e6:.0f} MB sent, cut off {cut} times"


def requests(target, seconds, rate=10_000, batch=50):
    """10,000 requests a second for the status, pipelined on kept connections; all replies are read."""
    done, begin, asked, lanes, lost = over(seconds), time.monotonic(), 0, [], 0
    while not done():
        behind = (time.monotonic() - begin) * rate - asked
        if behind < batch:
            time.sleep((batch - behind) / rate)
            continue
        try:
            while len(lanes) < 8:
                lanes.append(connect(target))
            peer = lanes[asked // batch % len(lanes)]
            peer.setblocking(False)
            try:
                while peer.recv(1 << 20):
                    pass
                raise ConnectionError  # closed by the server
            except BlockingIOError:
                peer.settimeout(0.5)
            peer.sendall(STATUS * batch)
        except OSError:
            lost += 1
            for peer in lanes:
                peer.close()
            lanes = []
        asked += batch
    return f"{asked / seconds:.0f}/s asked, {lost} times cut off"


def full_disk(target, seconds):
    """Not an octet left in library, state and logs, while operators do what wants to be written down."""
    folder, done, changes = pathlib.Path(target["disk"]), over(seconds), 0
    filler = folder / "filler"
    try:
        with filler.open("wb", buffering=0) as file:
            for size in (65536, 1):
                try:
                    while True:
                        file.write(b"\0" * size)
                except OSError:
                    pass
        while not done():
            # What it is already: the journal has a line of it, and the seats do not move otherwise.
            changes += put(target, "/api/v1/levels", "application/json", [b'{"motion":1.0}'])[0] == 200
            put(target, "/api/v1/cues/wanted", "text/csv", [b"time_ms,a1\n0,0.5\n"] * 64)
            time.sleep(0.1)
    finally:
        filler.unlink(missing_ok=True)
    return f"{changes} changes made"


def put(target, path, kind, body):
    """One PUT with a chunked body, cut short where the server says no. Its status, 0 for none, and octets sent."""
    sent = 0
    try:
        with connect(target, 1.0) as peer:
            peer.sendall(
                f"PUT {path} HTTP/1.1\r\n{HOST}Content-Type: {kind}\r\nTransfer-Encoding: chunked\r\n"
                "Connection: close\r\n\r\n".encode()
            )
            try:
                for piece in body:
                    peer.sendall(f"{len(piece):x}\r\n".encode() + piece + b"\r\n")
                    sent += len(piece)
                peer.sendall(b"0\r\n\r\n")
            except OSError:
                pass  # it has said enough; the answer may be there
            answer = peer.recv(4096).split(b" ", 2)
            return (int(answer[1]) if len(answer) > 1 else 0), sent
    except (OSError, ValueError):
        return 0, sent


def bomb(target, seconds):
    """Cues without end: rows for ever, a line for ever; and one as long as may be, which has to be looked through."""
    done, sent, answers = over(seconds), 0, {}
    rows = b"".join(b"%d,0.5\n" % (1_000_000 + n) for n in range(8192))

    def endless(first, piece):
        yield first
        while not done():
            yield piece

    bodies = [
        lambda: endless(b"time_ms,a1\n0,0.5\n", rows),
        lambda: endless(b"time_ms,a1\n0,0.", b"5" * 65536),
        lambda: [b"time_ms,a1\n0,0.5\n", *[rows] * (60_000_000 // len(rows))],
    ]
    n = 0
    while not done():
        body = bodies[n % len(bodies)]()
        status, octets = put(target, "/api/v1/cues/bomb", "text/csv", body)
        sent += octets
        answers[status] = answers.get(status, 0) + 1
        n += 1
        time.sleep(0.01)
    told = ", ".join(f"{count} x {status or 'no answer'}" for status, count in sorted(answers.items()))
    return f"{sent / 1e6:.0f} MB in {n} uploads: {told}"


def datagrams(target, seconds, rate=50_000, batch=500):
    """50,000 datagrams a second at the frame port that are none of ours, some with a good beginning."""
    done, begin, sent = over(seconds), time.monotonic(), 0
    chance = random.Random(7)
    beginnings = [b"", bytes.fromhex("55aa"), bytes.fromhex("55aa0000"), bytes.fromhex("33cc")]
    pool = [chance.choice(beginnings) + chance.randbytes(chance.randrange(1400)) for _ in range(256)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        while not done():
            behind = (time.monotonic() - begin) * rate - sent
            if behind < batch:
                time.sleep((batch - behind) / rate)
                continue
            for n in range(batch):
                try:
                    peer.sendto(pool[(sent + n) % len(pool)], ("127.0.0.1", target["frame_port"]))
                except OSError:
                    pass
            sent += batch
    return f"{sent / seconds:.0f}/s sent"


ALL = {
    "1,000 connections": connections,
    "slow readers": slow_readers,
    "header of 100 MB": header,
    "10,000 requests/s": requests,
    "full disk": full_disk,
    "upload of a bomb": bomb,
    "50,000 datagrams/s": datagrams,
}


def run(name, target, seconds, results):
    """For a process of its own."""
    os.nice(5)
    try:
        results.put((name, ALL[name](target, seconds)))
    except Exception as error:  # whatever it is, the table has to say so
        results.put((name, f"failed: {error!r}"))
