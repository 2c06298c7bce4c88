"""What the official Python reader finds in a recording, as one JSON object: tests/play/recording.rs compares it with what we say."""

import json
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def unfold(column, count):
    """The numbers of a column of second differences, which goes on as it was."""
    last = step = 0
    numbers = []
    for at in range(count):
        step += column.second_differences[at] if at < len(column.second_differences) else 0
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
