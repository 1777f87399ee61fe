"""Reads a finished, verified log, in one file or in parts: its messages one by one, or a summary of what it holds.

for topic, log_time_ns, payload, schema_name in read_log(Path("run.mcap")): ...
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mcap.records import Attachment, Message, Metadata

from robot_io.mcap.files import files_of
from robot_io.mcap.walk import LogItem, Topic, walk

_LATCHED = re.compile(r"\bdurability: *(1|transient_local)\b")
"""In the quality of service of a channel, as rmw numbers or names it."""


class LogMessage(NamedTuple):
    """One message of a log, in the order of the file."""

    topic: str
    log_time_ns: int
    payload: bytes
    schema_name: str


class ChannelInfo(NamedTuple):
    """One channel of a log. Logs by others may have several of one topic, without a schema, of any encoding."""

    topic: str
    schema_name: str
    schema_text: str
    latched: bool
    messages: int
    message_encoding: str
    schema_encoding: str


class LogSummary(NamedTuple):
    """What a whole, verified log holds."""

    size_bytes: int
    library: str
    channels: tuple[ChannelInfo, ...]
    attachments: dict[str, bytes]
    metadata: dict[str, dict[str, str]]
    messages: int
    start_ns: int
    end_ns: int


def walk_all(path: Path) -> Iterator[LogItem]:
    """Yield the verified records of all files of a finished log; each part declares its topics anew. As `walk`."""
    for file in files_of(path):
        yield from walk(file)


def read_log(path: Path) -> Iterator[LogMessage]:
    """Yield every message of a finished log, in the order of the file; of a log in parts, one part after another.

    Raises UsageError when there is no such file, LogDamaged at the latest at the end: read all of it before you
    trust any of it.
    """
    names: dict[int, tuple[str, str]] = {}
    for item in walk_all(path):
        if isinstance(item, Message):
            topic, schema_name = names[item.channel_id]
            yield LogMessage(topic, item.log_time, item.data, schema_name)
        elif isinstance(item, Topic):
            names[item.channel.id] = (item.channel.topic, item.schema.name)


def read_summary(path: Path) -> LogSummary:
    """Read a finished log to its end and return what it holds. Raises as `read_log`.

    Of a log in parts, counts and times are those of all; facts and attachments are the newest of each name.
    """
    files = files_of(path)
    summaries = [_read_summary(file) for file in files]
    return summaries[0] if len(files) == 1 else _together(summaries)


def _together(parts: list[LogSummary]) -> LogSummary:
    channels: dict[tuple[str, ...], ChannelInfo] = {}
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    for part in parts:
        metadata |= part.metadata
        attachments |= part.attachments
        for one in part.channels:
            key = (one.topic, one.schema_name, one.schema_text, one.message_encoding, one.schema_encoding)
            known = channels.get(key)
            channels[key] = one if known is None else one._replace(messages=known.messages + one.messages)
    filled = [part for part in parts if part.messages]
    return LogSummary(
        sum(part.size_bytes for part in parts),
        parts[0].library,
        tuple(channels.values()),
        attachments,
        metadata,
        sum(part.messages for part in parts),
        min((part.start_ns for part in filled), default=0),
        max((part.end_ns for part in filled), default=0),
    )


def _read_summary(path: Path) -> LogSummary:
    library, attachments, metadata = "", {}, {}
    topics: list[Topic] = []
    counts: dict[int, int] = {}
    start_ns, end_ns = 2**64, 0
    for item in walk(path):
        if isinstance(item, Message):
            counts[item.channel_id] = counts.get(item.channel_id, 0) + 1
            start_ns, end_ns = min(start_ns, item.log_time), max(end_ns, item.log_time)
        elif isinstance(item, Topic):
            topics.append(item)
        elif isinstance(item, Attachment):
            attachments[item.name] = item.data
        elif isinstance(item, Metadata):
            metadata[item.name] = item.metadata
        else:
            library = item.library
    table = tuple(
        ChannelInfo(
            channel.topic,
            schema.name,
            schema.data.decode(errors="replace"),
            _LATCHED.search(channel.metadata.get("offered_qos_profiles", "")) is not None,
            counts.get(channel.id, 0),
            channel.message_encoding,
            schema.encoding,
        )
        for channel, schema in topics
    )
    messages = sum(counts.values())
    return LogSummary(
        path.stat().st_size, library, table, attachments, metadata, messages, start_ns if messages else 0, end_ns
    )
