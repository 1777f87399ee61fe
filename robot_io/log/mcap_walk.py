"""Walks over the records of a log and believes nothing: every byte is checked, damage is one clear error.

A log is untrusted data. The closing mark, the CRC of each chunk, of each attachment and of the summary must all be
there and right, and that of the data section right where there is one; lengths are compared with what is left of the
file before anything is made of them, and a compressed chunk may not grow beyond a limit. Records are parsed by the
`mcap` package; the walk over them is done here, because its readers allocate what a length field says and do not check
the summary.
"""

from __future__ import annotations

import io
import os
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Message, Metadata, Schema

from robot_io.errors import LogDamaged, UsageError
from robot_io.log.mcap_log import MESSAGE_ENCODING, PROFILE, SCHEMA_ENCODING

MAGIC = b"\x89MCAP0\r\n"
RECORD_LIMIT = 64 << 20
"""Largest record, and largest chunk after decompression, in bytes. Ours are about 1 MiB."""
_TABLE_LIMIT = 1000
_SCHEMA_LIMIT = 1 << 20

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_FOOTER = struct.Struct("<BQQQI")


class Topic(NamedTuple):
    """A topic of a log, and the type of its messages."""

    channel: Channel
    schema: Schema


LogItem = Header | Topic | Message | Attachment | Metadata

Grown = Callable[[int], int]
"""Waits until a log has at least so many bytes or is no longer written, and returns its size."""


def walk(path: Path, *, finished: bool = True, grown: Grown | None = None) -> Iterator[LogItem]:
    """Yield the verified records of a log; each Topic once, before its first message.

    With `finished=False` everything before the first damage is yielded. With `grown` the log may still be written
    while it is read, and may be damaged in any part not yet yielded. Raises UsageError or LogDamaged.
    """
    if grown is not None:
        grown(len(MAGIC))
    try:
        file = path.open("rb")
    except OSError as error:
        raise UsageError(f"the log cannot be read: {error.strerror}", where=str(path), do="Check the name") from None
    with file, _damage_named(path):
        size = os.fstat(file.fileno()).st_size
        if file.read(len(MAGIC)) != MAGIC:
            raise LogDamaged("this is not an MCAP file", where=str(path), do="Give a log written by `push run`")
        if finished and grown is None:
            file.seek(max(0, size - len(MAGIC)))
            if size < 2 * len(MAGIC) or file.read(len(MAGIC)) != MAGIC:
                raise _truncated(path)
            file.seek(len(MAGIC))
        yield from _Walk(path, file, grown or (lambda _: size)).items()


class _Walk:
    """One pass over a file, from behind its magic."""

    def __init__(self, path: Path, file: BinaryIO, grown: Grown) -> None:
        self._path = path
        self._file = file
        self._grown = grown
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}

    def items(self) -> Iterator[LogItem]:
        crc = zlib.crc32(MAGIC)
        header: Header | None = None
        while True:
            head, body = self._record()
            opcode = head[0]
            if header is None:
                header = Header.read(_stream(body)) if opcode == Opcode.HEADER else Header("", "")
                if header.profile != PROFILE:
                    raise self._foreign(f"its profile is {header.profile!r}, not {PROFILE!r}")
                yield header
            elif opcode == Opcode.DATA_END:
                # The `mcap` package's own writer leaves this one out, which is 0, unless told otherwise.
                if body not in (struct.pack("<I", crc), bytes(4)):
                    raise _altered(self._path, "the checksum of all its data is wrong")
                self._check_summary()
                return
            elif opcode == Opcode.CHUNK:
                yield from self._chunk(Chunk.read(_stream(body)))
            elif opcode == Opcode.ATTACHMENT:
                if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
                    raise _altered(self._path, "the checksum of an attachment is wrong")
                yield Attachment.read(_stream(body))
            elif opcode == Opcode.METADATA:
                yield Metadata.read(_stream(body))
            elif opcode != Opcode.MESSAGE_INDEX:
                raise _altered(self._path, f"a record of kind {opcode} does not belong there")
            crc = zlib.crc32(body, zlib.crc32(head, crc))

    def _record(self) -> tuple[bytes, bytes]:
        at = self._file.tell() + _HEAD.size
        self._grown(at)
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise _truncated(self._path)
        _, length = _HEAD.unpack(head)
        if at + length > self._grown(at + min(length, RECORD_LIMIT)):
            raise _truncated(self._path)
        if length > RECORD_LIMIT:
            raise _altered(self._path, f"a record of {length} bytes is larger than any of ours")
        return head, self._file.read(length)

    def _chunk(self, chunk: Chunk) -> Iterator[LogItem]:
        if chunk.compression == "lz4":
            raise self._foreign("its chunks are compressed with lz4")
        if chunk.uncompressed_size > RECORD_LIMIT or chunk.compression not in ("zstd", ""):
            raise _altered(self._path, "a chunk is larger than any of ours, or its compression unknown")
        data = chunk.data
        if chunk.compression == "zstd":
            with zstandard.ZstdDecompressor().stream_reader(data) as reader:
                data = reader.read(chunk.uncompressed_size + 1)
        if len(data) != chunk.uncompressed_size or zlib.crc32(data) != chunk.uncompressed_crc:
            raise _altered(self._path, "the checksum of a chunk is wrong")
        at = 0
        while at < len(data):
            opcode, length = _HEAD.unpack_from(data, at)
            at += _HEAD.size
            if length > len(data) - at:
                raise _altered(self._path, "a record extends beyond its chunk")
            if opcode == _MESSAGE_OPCODE:
                yield self._message(data, at, length)
                at += length
                continue
            body = data[at : at + length]
            at += length
            if opcode == Opcode.SCHEMA:
                self._schema(Schema.read(_stream(body)))
            elif opcode == Opcode.CHANNEL:
                yield from self._channel(Channel.read(_stream(body)))

    def _message(self, data: bytes, at: int, length: int) -> Message:
        if length < _MESSAGE.size:
            raise _altered(self._path, "a message is shorter than its header")
        channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, at)
        if channel_id not in self._channels:
            raise _altered(self._path, f"a message of channel {channel_id}, which is not declared")
        return Message(
            channel_id=channel_id,
            sequence=sequence,
            log_time=log_time,
            publish_time=publish_time,
            data=data[at + _MESSAGE.size : at + length],
        )

    def _schema(self, schema: Schema) -> None:
        if schema.encoding != SCHEMA_ENCODING or len(schema.data) > _SCHEMA_LIMIT or len(self._schemas) > _TABLE_LIMIT:
            raise self._foreign(f"the schema of {schema.name[:100]} is not {SCHEMA_ENCODING}, or they are too many")
        if self._schemas.setdefault(schema.id, schema) != schema:
            raise _altered(self._path, f"schema {schema.id} is declared twice")

    def _channel(self, channel: Channel) -> Iterator[Topic]:
        if channel.message_encoding != MESSAGE_ENCODING or len(self._channels) > _TABLE_LIMIT:
            raise self._foreign(f"{channel.topic[:100]} is not {MESSAGE_ENCODING}, or there are too many channels")
        if channel.schema_id not in self._schemas:
            raise _altered(self._path, f"{channel.topic[:100]} has no schema")
        if self._channels.setdefault(channel.id, channel) is channel:
            yield Topic(channel, self._schemas[channel.schema_id])
        elif self._channels[channel.id] != channel:
            raise _altered(self._path, f"channel {channel.id} is declared twice")

    def _check_summary(self) -> None:
        start = self._file.tell()
        size = self._grown(sys.maxsize)
        crc = 0
        left = size - start - len(MAGIC) - 4
        while left > 0:
            block = self._file.read(min(left, 1 << 20))
            if not block:
                break
            crc = zlib.crc32(block, crc)
            left -= len(block)
        self._file.seek(max(start, size - len(MAGIC) - _FOOTER.size))
        tail = self._file.read(_FOOTER.size + len(MAGIC))
        if left != 0 or tail[_FOOTER.size :] != MAGIC:
            raise _truncated(self._path)
        opcode, length, summary_start, _, summary_crc = _FOOTER.unpack_from(tail)
        if (opcode, length, summary_start, summary_crc) != (Opcode.FOOTER, _FOOTER.size - _HEAD.size, start, crc):
            raise _altered(self._path, "the checksum of its summary is wrong")

    def _foreign(self, why: str) -> LogDamaged:
        return LogDamaged(
            f"this is not a log of this program: {why}", where=str(self._path), do="Give a log written by `push run`"
        )


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Turn what the record parsers raise on rubbish into LogDamaged."""
    try:
        yield
    except (McapError, struct.error, ValueError, zstandard.ZstdError) as error:
        raise _altered(path, f"a record cannot be read ({type(error).__name__})") from None


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(body))


def _truncated(path: Path) -> LogDamaged:
    return LogDamaged(
        "the log is truncated (its recorder was killed, the disk was full, or the run still goes on)",
        where=str(path),
        do=f"When the run is over, `push log recover {path}` repairs what is there",
    )


def _altered(path: Path, why: str) -> LogDamaged:
    return LogDamaged(
        f"the log is damaged: {why}",
        where=str(path),
        do=f"Take another copy of it; `push log recover {path}` keeps what comes before the damage",
    )
