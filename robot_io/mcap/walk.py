"""Walks over the records of a log and believes nothing: every byte is checked, damage is one clear error.

A log is untrusted data. Lengths are compared with what is left of the file before anything is made of them, and a
compressed chunk may not grow beyond a limit. A log of ours must have its closing mark and the CRC of each chunk, of
each attachment and of the summary, all right, and that of the data section right where there is one; it holds nothing
that our writer does not write. In a file by others, which its header tells apart, whatever the MCAP specification
leaves to its writer may be there or not; a checksum that is there must be right all the same. Records are parsed by
the `mcap` package; the walk over them is done here, because its readers allocate what a length field says and do not
check the summary.
"""

from __future__ import annotations

import os
import stat
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema

from robot_io.errors import LogDamaged, UsageError
from robot_io.mcap.log_file import LIBRARY, MESSAGE_ENCODING, PROFILE, SCHEMA_ENCODING
from robot_io.mcap.parts import ExactStream, attachment_of, checksum_holds, chunk_content
from robot_io.mcap.refusal import RECORD_LIMIT, altered, beyond, too_large, truncated

MAGIC = b"\x89MCAP0\r\n"
NO_SCHEMA = Schema(id=0, data=b"", encoding="", name="")
"""Stands for the schema of a channel that has none."""
_TABLE_LIMIT = 1000
_SCHEMA_LIMIT = 1 << 20

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_FOOTER = struct.Struct("<QQI")
_LAST_OPCODE = int(Opcode.DATA_END)
"""Those beyond are private or of a later specification: they may stand anywhere, and are passed over."""
_CONTENT = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
_SUMMARY = (
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.STATISTICS,
    Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT_INDEX,
    Opcode.METADATA_INDEX,
    Opcode.SUMMARY_OFFSET,
)


class Topic(NamedTuple):
    """A topic of a log, and the type of its messages (`NO_SCHEMA` for a log by others that does not say it)."""

    channel: Channel
    schema: Schema


LogItem = Header | Topic | Message | Attachment | Metadata

Grown = Callable[[int], int]
"""Waits until a log has at least this many bytes or is no longer written, and returns its size."""


def walk(path: Path, *, finished: bool = True, grown: Grown | None = None) -> Iterator[LogItem]:
    """Yield the verified records of a log, its Header first and each Topic once, before its first message.

    With `finished=False` everything before the first damage is yielded. With `grown` the log may still be written
    while it is read, and may be damaged in any part not yet yielded. Raises UsageError or LogDamaged.
    """
    if grown is not None:
        grown(len(MAGIC))
    with _opened(path) as file, _damage_named(path):
        size = os.fstat(file.fileno()).st_size
        if file.read(len(MAGIC)) != MAGIC:
            empty = ", it is empty" if size == 0 else ""
            raise LogDamaged(f"this is not an MCAP file{empty}", where=str(path), do="Give a log written by `push run`")
        if finished and grown is None:
            file.seek(max(0, size - len(MAGIC)))
            if size < 2 * len(MAGIC) or file.read(len(MAGIC)) != MAGIC:
                raise truncated(path)
            file.seek(len(MAGIC))
        yield from _Walk(path, file, grown or (lambda _: size)).items()


def _opened(path: Path) -> BinaryIO:
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise UsageError(
                "a log is read more than once, and this can be read only once (a pipe or a device)",
                where=str(path),
                do="Save it to a file first",
            )
        return path.open("rb")
    except OSError as error:
        raise UsageError(f"the log cannot be read: {error.strerror}", where=str(path), do="Check the name") from None


class _Walk:
    """One pass over a file, from behind its magic."""

    def __init__(self, path: Path, file: BinaryIO, grown: Grown) -> None:
        self._path = path
        self._file = file
        self._grown = grown
        self._ours = True
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}

    def items(self) -> Iterator[LogItem]:
        head, body = self._record()
        crc = zlib.crc32(body, zlib.crc32(head, zlib.crc32(MAGIC)))
        if head[0] != Opcode.HEADER:
            raise altered(self._path, "it does not start with a header")
        header = Header.read(ExactStream(body))
        self._ours = header.library == LIBRARY
        self._require_ours(header.profile == PROFILE, f"its profile is {header.profile[:20]!r}")
        if not self._ours:
            self._schemas[0] = NO_SCHEMA
        yield header
        while True:
            head, body = self._record()
            if head[0] == Opcode.DATA_END:
                break
            yield from self._data(head[0], body)
            crc = zlib.crc32(body, zlib.crc32(head, crc))
        # The `mcap` package's own writer leaves this one out, which is 0, unless told otherwise; once it was ours.
        (said,) = struct.unpack_from("<I", body)
        if not checksum_holds(said, crc, ours=False) or (self._ours and len(body) != 4):
            raise altered(self._path, "the checksum of all its data is wrong")
        yield from self._summary()

    def _record(self) -> tuple[bytes, bytes]:
        at = self._file.tell() + _HEAD.size
        self._grown(at)
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise truncated(self._path)
        _, length = _HEAD.unpack(head)
        if at + length > self._grown(at + min(length, RECORD_LIMIT)):
            raise truncated(self._path)
        if length > RECORD_LIMIT:
            if self._ours:
                raise altered(self._path, f"a record of {length} bytes is larger than any of ours")
            raise too_large(self._path, "a record", length)
        return head, self._file.read(length)

    def _data(self, opcode: int, body: bytes) -> Iterator[LogItem]:
        """Take a record of the data section."""
        if opcode == Opcode.CHUNK:
            yield from self._chunk(chunk_content(body, self._path, ours=self._ours))
        elif opcode == Opcode.ATTACHMENT:
            yield attachment_of(body, self._path, ours=self._ours)
        elif opcode == Opcode.METADATA:
            yield Metadata.read(ExactStream(body))
        elif opcode in _CONTENT and not self._ours:
            yield from self._content(opcode, body)
        elif opcode != Opcode.MESSAGE_INDEX:
            self._require_unknown(opcode)

    def _chunk(self, data: bytes) -> Iterator[LogItem]:
        at = 0
        while at < len(data):
            opcode, length = _HEAD.unpack_from(data, at)
            at += _HEAD.size
            if length > len(data) - at:
                raise altered(self._path, "a record extends beyond its chunk")
            if opcode == _MESSAGE_OPCODE:
                yield self._message(data, at, length)
            else:
                yield from self._content(opcode, data[at : at + length])
            at += length

    def _content(self, opcode: int, body: bytes) -> Iterator[LogItem]:
        """Take a record that may stand in a chunk."""
        if opcode == _MESSAGE_OPCODE:
            yield self._message(body, 0, len(body))
        elif opcode == Opcode.SCHEMA:
            self._schema(Schema.read(ExactStream(body)))
        elif opcode == Opcode.CHANNEL:
            yield from self._channel(Channel.read(ExactStream(body)))
        else:
            self._require_unknown(opcode)

    def _message(self, data: bytes, at: int, length: int) -> Message:
        if length < _MESSAGE.size:
            raise altered(self._path, "a message is shorter than its header")
        channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, at)
        if channel_id not in self._channels:
            raise altered(self._path, f"a message of channel {channel_id}, which is not declared")
        return Message(channel_id, log_time, data[at + _MESSAGE.size : at + length], publish_time, sequence)

    def _schema(self, schema: Schema) -> None:
        named = schema.name[:100]
        self._require_ours(schema.encoding == SCHEMA_ENCODING, f"the schema of {named} is not {SCHEMA_ENCODING}")
        if len(schema.data) > _SCHEMA_LIMIT:
            raise beyond(self._path, f"the schema of {named} has {len(schema.data)} bytes")
        if len(self._schemas) > _TABLE_LIMIT:
            raise beyond(self._path, f"it has more than {_TABLE_LIMIT} schemas")
        if schema.id == 0 or self._schemas.setdefault(schema.id, schema) != schema:
            raise altered(self._path, f"schema {schema.id} is declared twice, or has no number")

    def _channel(self, channel: Channel) -> Iterator[Topic]:
        named = channel.topic[:100]
        self._require_ours(channel.message_encoding == MESSAGE_ENCODING, f"{named} is not {MESSAGE_ENCODING}")
        if channel.id not in self._channels and len(self._channels) >= _TABLE_LIMIT:
            raise beyond(self._path, f"it has more than {_TABLE_LIMIT} channels")
        if channel.schema_id not in self._schemas:
            raise altered(self._path, f"{named} has schema {channel.schema_id}, which is not declared")
        if self._channels.setdefault(channel.id, channel) is channel:
            yield Topic(channel, self._schemas[channel.schema_id])
        elif self._channels[channel.id] != channel:
            raise altered(self._path, f"channel {channel.id} is declared twice")

    def _summary(self) -> Iterator[LogItem]:
        """Check everything after the data; yield the topics of others without messages: only this part names them."""
        start = self._file.tell()
        size = self._grown(sys.maxsize)
        self._grown = lambda _: size
        crc = 0
        while True:
            head, body = self._record()
            if head[0] == Opcode.FOOTER:
                break
            if head[0] in (Opcode.SCHEMA, Opcode.CHANNEL) and not self._ours:
                yield from self._content(head[0], body)
            elif head[0] not in _SUMMARY:
                self._require_unknown(head[0])
            crc = zlib.crc32(body, zlib.crc32(head, crc))
        summary_start, _, said = _FOOTER.unpack_from(body)
        crc = zlib.crc32(body[: _FOOTER.size - 4], zlib.crc32(head, crc))
        if not checksum_holds(said, crc, ours=self._ours):
            raise altered(self._path, "the checksum of its summary is wrong")
        self._require_ours(summary_start == start and len(body) == _FOOTER.size, "its footer is not ours")
        if summary_start not in (0, start):
            raise altered(self._path, "its footer says that the summary is elsewhere")
        if self._file.read(len(MAGIC) + 1) != MAGIC:
            raise truncated(self._path)

    def _require_ours(self, right: bool, why: str) -> None:
        """Refuse in a log of ours what our writer does not write."""
        if self._ours and not right:
            raise altered(self._path, why)

    def _require_unknown(self, opcode: int) -> None:
        """Refuse a record of a known kind where it does not belong; a reader has to pass over unknown ones."""
        if self._ours or opcode <= _LAST_OPCODE:
            raise altered(self._path, f"a record of kind {opcode} does not belong there")


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Turn what the record parsers raise on rubbish into LogDamaged."""
    try:
        yield
    except (McapError, struct.error, ValueError, zstandard.ZstdError) as error:
        raise altered(path, f"a record cannot be read ({type(error).__name__})") from None
