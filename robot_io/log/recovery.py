"""Repairs a truncated log: keeps what is readable and seals it, so that a later change is found."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from mcap.records import Attachment, Header, Message, Metadata

from robot_io.errors import EnvironmentFault, LogDamaged, UsageError
from robot_io.log.seal import LogSeal, PayloadSeal, config_seal
from robot_io.mcap.log_file import CONFIG_ATTACHMENT, create_new, finish_writer
from robot_io.mcap.walk import NO_SCHEMA, LogItem, Topic, walk
from robot_io.mcap.write import McapWriter

RECOVERED_METADATA = "recovered"


class Recovered(NamedTuple):
    """What was saved, and what was wrong with the source."""

    messages: int
    cause: str


def recover(path: Path, out_path: Path) -> Recovered:
    """Copy everything before the first damage of `path` into a new, finished log.

    Raises UsageError when `out_path` exists or `path` is whole, LogDamaged when nothing can be saved,
    EnvironmentFault when the disk does not take it.
    """
    if out_path.exists():
        raise UsageError("there is already a file of this name", where=str(out_path), do="Give another name with --out")
    items = walk(path, finished=False)
    first = _header(items, path)  # nothing is created for a file that is not a log
    assert isinstance(first, Header)
    stream = create_new(out_path)
    try:
        # A log by others stays one: it is not held to what our own writer would have written.
        copy = LogCopy(McapWriter(stream, first.profile, first.library), LogSeal())
        cause = ""
        try:
            for item in items:
                copy.take(item)
        except LogDamaged as damage:
            cause = damage.what
        if not cause:
            raise UsageError("the log is intact; there is nothing to recover", where=str(path))
        if copy.seal.messages == 0:
            raise _nothing_saved(path, cause)
        copy.writer.flush()
        facts = {"source": path.name, "cause": cause, **copy.seal.facts(), **config_seal(copy.config)}
        copy.writer.add_metadata(RECOVERED_METADATA, facts)
        finish_writer(copy.writer, stream)
    except BaseException as error:
        with suppress(OSError):  # it flushes, onto a disk that may be full
            stream.close()
        out_path.unlink()
        if isinstance(error, OSError):
            raise EnvironmentFault(
                f"the log cannot be written: {error.strerror}",
                where=str(out_path),
                do="Make room, or give another --out",
            ) from None
        raise
    return Recovered(copy.seal.messages, cause)


def _header(items: Iterator[LogItem], path: Path) -> LogItem:
    try:
        return next(items)
    except LogDamaged as damage:
        if "push log recover" in damage.do:  # which is what runs here
            raise _nothing_saved(path, damage.what) from None
        raise


def _nothing_saved(path: Path, cause: str) -> LogDamaged:
    do = "If the run is over, take another copy of it"
    return LogDamaged(f"no message can be saved: {cause}", where=str(path), do=do)


class LogCopy:
    """A log being copied record by record: what was written so far, under its new numbers, and its seal."""

    def __init__(self, writer: McapWriter, seal: LogSeal | PayloadSeal) -> None:
        self.writer = writer
        self.seal = seal
        self.config = b""
        self._schemas: dict[int, int] = {NO_SCHEMA.id: NO_SCHEMA.id}
        self._channels: dict[int, tuple[int, str]] = {}
        """New number and topic, by the old number."""

    def take(self, item: LogItem) -> None:
        """Append one record."""
        if isinstance(item, Message):
            channel_id, topic = self._channels[item.channel_id]
            self.writer.add_message(channel_id, item.log_time, item.data, item.publish_time, item.sequence)
            self.seal.note(topic, item.log_time, item.data)
        elif isinstance(item, Topic):
            channel, schema = item
            self.seal.declare(channel.topic, schema.name, schema.data)
            if schema.id not in self._schemas:
                self._schemas[schema.id] = self.writer.register_schema(schema.name, schema.encoding, schema.data)
            channel_id = self.writer.register_channel(
                channel.topic, channel.message_encoding, self._schemas[schema.id], channel.metadata
            )
            self._channels[channel.id] = (channel_id, channel.topic)
        elif isinstance(item, Attachment):
            self.writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
            if item.name == CONFIG_ATTACHMENT:
                self.config = item.data
        elif isinstance(item, Metadata):
            self.writer.add_metadata(item.name, item.metadata)
