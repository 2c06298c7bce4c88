"""What the official Python reader finds in a recording, as one JSON object: tests/play/recording.rs compares it with what we say."""

import json
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def differences(packed):
    """The second differences of a column: groups of 32, an octet that says how many bits each takes, then these, lowest first."""
    while packed:
        width, packed = packed[0], packed[1:]
        bits, packed = int.from_bytes(packed[: 4 * width], "little"), packed[4 * width :]
        for at in range(32):
            word = bits >> at * width & (1 << width) - 1
            yield word >> 1 ^ -(word & 1)


def unfold(column, count):
    """The numbers of a column of second differences, which goes on as it was."""
    last = step = 0
    numbers, seconds = [], differences(column.packed)
    for _ in range(count):
        step += next(seconds, 0)
        last += step
        numbers.append(last)
    return numbers


with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
    summary = reader.get_summary()
    messages, ticks, frames, numbers = Counter(), 0, Counter(), []
    for schema, channel, message in reader.iter_messages():
        messages[channel.topic] += 1
        if schema.encoding == "jsonschema":
            json.loads(message.data)
    for _, _, _, block in reader.iter_decoded_messages(topics=["/full/sent"]):
        ticks += block.ticks
        for lane in block.lanes:
            frames[str(lane.lane)] += lane.frames
            numbers += unfold(lane.frame_columns[7], lane.frames)
    print(json.dumps({
        "messages": messages,
        "statistics": summary.statistics.message_count,
        "metadata": {one.name: one.metadata for one in reader.iter_metadata()},
        "attachments": {one.name: len(one.data) for one in reader.iter_attachments()},
        "ticks": ticks,
        "frames": frames,
        "numbers": numbers,
    }))
