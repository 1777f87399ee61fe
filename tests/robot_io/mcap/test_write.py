"""The MCAP writer against the `mcap` package's own: the same calls must give the same bytes."""

from __future__ import annotations

import io
import random

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from robot_io.mcap.write import McapWriter


def call_all(writer: Writer | McapWriter, seed: int, messages: int) -> None:
    """Declare, write, flush and attach in an order that depends on the seed only."""
    rng = random.Random(seed)
    writer.add_attachment(0, 5, "config.toml", "application/toml", b"x = 1\n")
    writer.add_metadata("run", {"seed": str(seed), "name": "m\u00fcde"})
    channels = []
    for n in range(5):
        schema = writer.register_schema(f"pkg/msg/T{n}", "ros2msg", rng.randbytes(n * 40))
        channels.append(writer.register_channel(f"/topic_{n}", "cdr", schema, {"qos": "x"} if n == 2 else {}))
    writer.flush()  # a chunk without a message is not written
    for n in range(messages):
        time_ns = 10**18 + n * 1000 + rng.randrange(-5000, 5000)
        writer.add_message(rng.choice(channels[:-1]), time_ns, rng.randbytes(rng.randrange(3000)), time_ns - 7, n)
        if rng.random() < 0.003:
            writer.flush()
        if rng.random() < 0.003:
            writer.add_metadata(f"note {n}", {})
        if rng.random() < 0.003:
            writer.add_attachment(n, 0, f"file {n}", "", rng.randbytes(100))
    writer.finish()


@pytest.mark.parametrize(("seed", "messages"), [(1, 3000), (2, 1200), (3, 1), (4, 0)])
def test_the_bytes_are_those_of_the_mcap_package(seed, messages):
    theirs, ours = io.BytesIO(), io.BytesIO()
    writer = Writer(theirs, compression=CompressionType.ZSTD, enable_crcs=True, enable_data_crcs=True)
    writer.start("ros2", "library")
    call_all(writer, seed, messages)
    call_all(McapWriter(ours, "ros2", "library"), seed, messages)
    assert ours.getvalue() == theirs.getvalue()
    ours.seek(0)
    summary = make_reader(ours, validate_crcs=True).get_summary()
    assert summary.statistics.message_count == messages
    if messages == 3000:
        assert summary.statistics.chunk_count > 4
