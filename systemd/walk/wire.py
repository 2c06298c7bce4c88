"""What goes over the loopback between hall and seats: captured as it passes, read afterwards by `kinocue decode`.

    python3 wire.py FILE      captures into a pcap file until SIGTERM; ends with 1 where the kernel dropped packets
"""

import csv
import json
import signal
import socket
import struct
import subprocess
import sys
from collections import defaultdict
from typing import NamedTuple

PORTS = range(7408, 7416)  # the eight controllers of simulated.toml
MM_PER_PULSE = 5.0 / 10_000

ETH_P_IP = 0x0800
SOL_PACKET, PACKET_STATISTICS = 263, 6
SO_TIMESTAMPNS = 35
IP_AT, UDP_AT = 14, 34  # behind the Ethernet header, which the loopback has too
PCAP_NS, ETHERNET = 0xA1B23C4D, 1


class Frame(NamedTuple):
    """A motion frame."""

    at: float  # unix time at which it passed, s
    number: int
    over: float  # the time in which the seat is to be there, s
    mm: tuple  # where each axis is to be
    outputs: frozenset  # which of Y01 to Y12 are on


def capture(path):
    """Captures until SIGTERM; returns how many packets the kernel dropped."""
    signal.signal(signal.SIGTERM, lambda *_: (_ for _ in ()).throw(SystemExit))
    tap = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_IP))
    tap.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
    tap.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    tap.bind(("lo", ETH_P_IP))
    with open(path, "wb") as file:
        file.write(struct.pack("=IHHiIII", PCAP_NS, 2, 4, 0, 0, 65535, ETHERNET))
        print("ready", flush=True)
        try:
            while True:
                bytes, ancillary, _, address = tap.recvmsg(2048, 64)
                if address[2] == socket.PACKET_HOST and is_ours(bytes):  # each passes twice, going out and coming in
                    seconds, nanoseconds = struct.unpack("=qq", ancillary[0][2])
                    file.write(struct.pack("=IIII", seconds, nanoseconds, len(bytes), len(bytes)) + bytes)
        except SystemExit:
            pass
    _, dropped = struct.unpack("=II", tap.getsockopt(SOL_PACKET, PACKET_STATISTICS, 8))
    return dropped


def is_ours(bytes):
    if len(bytes) < UDP_AT + 8 or bytes[IP_AT + 9] != socket.IPPROTO_UDP:
        return False
    source, destination = struct.unpack_from("!HH", bytes, UDP_AT)
    return source in PORTS or destination in PORTS


def read(path):
    """The motion frames of a capture, by the port of their controller, in the order in which they passed."""
    decode = subprocess.run(["kinocue", "decode", path, "--json"], capture_output=True, text=True, check=True)
    frames = defaultdict(list)
    for line in decode.stdout.splitlines():
        message = json.loads(line)
        if "positions" in message and message["direction"] == "host to controller":
            port = int(message["destination"].rsplit(":", 1)[1])
            mm = tuple(pulses * MM_PER_PULSE for pulses in message["positions"])
            at, over = message["time_ns"] / 1e9, message["time_ms"] / 1000
            frames[port].append(Frame(at, message["frame"], over, mm, frozenset(message["outputs"]["on"])))
    return dict(frames)


def motor_ends(frames, frame_log, move_log):
    """When each move of the simulated motors ended, unix time, and whether it led anywhere; by port.

    The simulator counts its time from its own start; a frame that both it and the capture saw tells the difference.
    """
    captured = {(port, frame.number): frame.at for port, all_of in frames.items() for frame in all_of}
    ahead = []
    with open(frame_log) as file:
        for row in csv.DictReader(file):
            key = (int(row["controller"].rsplit(":", 1)[1]), int(row["frame"] or -1))
            if key in captured:
                ahead.append(captured[key] - float(row["time_s"]))
    start = sorted(ahead)[len(ahead) // 2]
    ends = defaultdict(list)
    with open(move_log) as file:
        for row in csv.DictReader(file):
            port = int(row["controller"].rsplit(":", 1)[1])
            moved = any(row[f"from_{axis}"] != row[f"to_{axis}"] for axis in (1, 2, 3))
            ends[port].append((start + float(row["time_s"]) + float(row["duration_ms"]) / 1000, moved))
    return dict(ends)


if __name__ == "__main__":
    lost = capture(sys.argv[1])
    if lost:
        sys.exit(f"wire.py: the kernel dropped {lost} packets")
