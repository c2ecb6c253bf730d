"""Holds recordings against the MCAP and protobuf libraries of other people.

    python tests/independent/recordings.py GRAVER RECORDING...

Every recording (samples.mcap) is read with PyPI `mcap` and the messages decoded by the schema in the file
(`mcap-protobuf-support`), and compared with what the program GRAVER exports as a table. Then it is cut, at every byte of its beginning
and of some of its middle and its end, and at bytes chosen by chance: what is left must give exactly the messages
that are whole in it.

Needs mcap and mcap-protobuf-support. Prints one line a file, and ends with 1 where something differs.
"""

import csv
import io
import random
import struct
import subprocess
import sys
from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.exceptions import EndOfFile, InvalidMagic
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

DENSE = 3000  # bytes at which a file is cut one by one, at its beginning and elsewhere
CHOSEN = 200  # cuts by chance


class Difference(Exception):
    """What differs."""


def records(data: bytes) -> list:
    """The records of a file that may be cut, until it ends."""
    found = []
    try:
        for record in StreamReader(io.BytesIO(data), skip_magic=False).records:
            found.append(record)
    except (EndOfFile, InvalidMagic, struct.error):
        # The last is what the library says of a file that is cut in its first eight bytes.
        pass
    return found


def messages(data: bytes) -> list[tuple[int, int, bytes]]:
    """The messages of a file that may be cut."""
    taken = (record for record in records(data) if isinstance(record, Message))
    return [(record.channel_id, record.log_time, record.data) for record in taken]


def ends(data: bytes) -> list[int]:
    """Where each message ends: opcode, length, and what they announce."""
    found, at = [], 8
    while at + 9 <= len(data):
        opcode, length = data[at], int.from_bytes(data[at + 1 : at + 9], "little")
        at += 9 + length
        if opcode == 0x05:
            found.append(at)
        if opcode == 0x0F:
            break
    return found


def check_cuts(data: bytes) -> int:
    whole, borders = messages(data), ends(data)
    if len(whole) != len(borders):
        raise Difference(f"{len(whole)} messages read, {len(borders)} written")
    chance = random.Random(1)
    middle = borders[len(borders) // 2]
    cuts = set(range(min(DENSE, len(data))))
    cuts |= set(range(middle - 200, min(middle + 800, len(data))))
    cuts |= set(range(max(0, len(data) - 500), len(data)))
    cuts |= {chance.randrange(len(data)) for _ in range(CHOSEN)}
    # Reading takes as long as what is left is long: of long files, the part around the cut suffices.
    for cut in sorted(cuts):
        left = messages(data[:cut]) if cut < 2_000_000 else None
        if left is None:
            continue
        expect = sum(border <= cut for border in borders)
        if left != whole[:expect]:
            raise Difference(f"cut at {cut}: {len(left)} messages instead of {expect}")
    return len(cuts)


def units(data: bytes) -> int:
    """Fields whose comment in the schema has a unit."""
    count = 0
    for schema in (record for record in records(data) if isinstance(record, Schema)):
        if schema.encoding != "protobuf":
            raise Difference(f"schema {schema.name} is {schema.encoding}")
        described = FileDescriptorSet.FromString(schema.data).file[0]
        comments = [place.leading_comments for place in described.source_code_info.location]
        if not all(comments):
            raise Difference(f"a field of {schema.name} says nothing")
        count = sum("[" in comment for comment in comments)
    if count < 40:
        raise Difference(f"{count} fields with a unit")
    return count


def decoded_cycles(data: bytes) -> list:
    """What stands on the topic of cycles, by the schema in the file."""
    schemas, channels, cycles = {}, {}, []
    factory = DecoderFactory()
    for record in records(data):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message) and channels[record.channel_id].topic == "/cycle":
            channel = channels[record.channel_id]
            decode = factory.decoder_for(channel.message_encoding, schemas[channel.schema_id])
            cycles.append(decode(record.data))
    return cycles


def check_table(graver: str, path: Path, data: bytes) -> int:
    exported = subprocess.run([graver, "export", path], capture_output=True, text=True, check=True)
    rows = list(csv.DictReader(io.StringIO(exported.stdout)))
    cycles = decoded_cycles(data)
    if len(rows) != len(cycles):
        raise Difference(f"{len(rows)} rows, {len(cycles)} messages")
    axes = [name.removesuffix("_position") for name in rows[0] if name.endswith("_position")]
    for row, cycle in zip(rows, cycles):
        answered = cycle.HasField("command")
        pairs = [("cycle", cycle.cycle)]
        for index, axis in enumerate(axes):
            at = lambda values: values[index] if index < len(values) else 0.0
            pairs += [(f"{axis}_position", at(cycle.feedback.position)), (f"{axis}_current", at(cycle.feedback.current))]
            if answered:
                pairs += [(f"{axis}_reference", at(cycle.command.reference)), (f"{axis}_voltage", at(cycle.command.voltage))]
        if answered:
            pairs += [("stream_time", cycle.command.stream_time), ("rate", cycle.command.rate), ("stroke", cycle.command.stroke)]
        for name, value in pairs:
            if float(row[name]) != value:
                raise Difference(f"cycle {cycle.cycle}: {name} is {row[name]} in the table, {value} in the message")
    return len(rows)


def main() -> int:
    graver, *paths = sys.argv[1:]
    failed = 0
    for path in map(Path, paths):
        try:
            data = path.read_bytes()
            rows, cuts = check_table(graver, path, data), check_cuts(data)
            size = len(data) / max(rows, 1)
            print(f"{path}: {rows} cycles, {size:.0f} bytes each, {units(data)} units, {cuts} cuts")
        except Difference as difference:
            failed = 1
            print(f"{path}: {difference}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
