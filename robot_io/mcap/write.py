"""Writes MCAP: chunks compressed with zstd, an index of each, a summary, and CRC-32 over every part.

The bytes are those of the `mcap` package's own writer, whose records are used here too. It spends 5 us on each message
(measured, Python 3.11), which was a third of level `sim`'s time; packing a message and its index entry directly
takes 1 us.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from typing import BinaryIO

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1 << 20
"""A chunk is closed when it has grown beyond this."""

_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_FIXED = _MESSAGE.size - 9
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_INDEX = struct.Struct("<BQHI")
_FOOTER = struct.Struct("<BQQQ")


class McapWriter:
    """Writes one file to a stream that it does not close. Errors of the disk come out as OSError."""

    def __init__(self, stream: BinaryIO, profile: str, library: str) -> None:
        self._stream = stream
        self._compressor = zstandard.ZstdCompressor()
        self._at = 0
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks = bytearray()
        """Their indexes as the summary has them: as records they would take ten times as much for an hour."""
        self._chunk_count = 0
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._start_ns: int | None = None
        self._end_ns = 0
        self._chunk = bytearray()
        self._index: dict[int, list[int]] = {}
        """Of the open chunk: channel -> time and offset of each message, in turns."""
        self._put(MAGIC)
        self._put(_bytes(Header(profile, library)))

    @property
    def size_bytes(self) -> int:
        """Number of bytes written, without the chunk in progress."""
        return self._at

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Declare a schema and return its number."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._append(_bytes(self._schemas[-1]))
        return self._schemas[-1].id

    def register_channel(self, topic: str, message_encoding: str, schema_id: int, metadata: dict[str, str]) -> int:
        """Declare a channel and return its number."""
        number = len(self._channels) + 1
        self._channels.append(Channel(number, topic, message_encoding, metadata, schema_id))
        self._append(_bytes(self._channels[-1]))
        return number

    def add_message(self, channel_id: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append a message of a declared channel; times in ns since 1970."""
        chunk = self._chunk
        entry = self._index.get(channel_id)
        if entry is None:
            entry = self._index[channel_id] = []
        entry += (log_time, len(chunk))
        chunk += _MESSAGE.pack(
            _MESSAGE_OPCODE, _MESSAGE_FIXED + len(data), channel_id, sequence, log_time, publish_time
        )
        chunk += data
        if len(chunk) > CHUNK_BYTES:
            self._end_chunk()

    def add_attachment(self, create_time: int, log_time: int, name: str, media_type: str, data: bytes) -> None:
        """Write a file that goes with the log; times in ns since 1970, 0 when unknown."""
        record = _bytes(Attachment(create_time, log_time, name, media_type, data))
        index = AttachmentIndex(self._at, len(record), log_time, create_time, len(data), name, media_type)
        self._attachments.append(index)
        self._put(record)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write some facts under a name."""
        record = _bytes(Metadata(name, data))
        self._metadata.append(MetadataIndex(self._at, len(record), name))
        self._put(record)

    def flush(self) -> None:
        """End the chunk in progress and hand everything to the operating system."""
        self._end_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the rest, and the summary with its indexes."""
        self._end_chunk()
        self._put(_bytes(DataEnd(self._crc)))
        start = self._at
        summary, offsets = self._summary(start)
        footer = _FOOTER.pack(Opcode.FOOTER, 8 + 8 + 4, start, start + len(summary))
        crc = zlib.crc32(footer, zlib.crc32(summary + offsets))
        self._put(summary + offsets + _bytes(Footer(start, start + len(summary), crc)) + MAGIC)

    def _append(self, record: bytes) -> None:
        self._chunk += record
        if len(self._chunk) > CHUNK_BYTES:
            self._end_chunk()

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._at += len(data)

    def _end_chunk(self) -> None:
        if not self._index:
            return
        data, index = bytes(self._chunk), self._index
        self._chunk, self._index = bytearray(), {}
        start_ns = min(min(entry[::2]) for entry in index.values())
        end_ns = max(max(entry[::2]) for entry in index.values())
        self._start_ns = start_ns if self._start_ns is None else min(self._start_ns, start_ns)
        self._end_ns = max(self._end_ns, end_ns)
        packed = self._compressor.compress(data)
        chunk_at = self._at
        self._put(_bytes(Chunk("zstd", packed, end_ns, start_ns, zlib.crc32(data), len(data))))
        index_at = self._at
        offsets = {}
        for channel_id, entry in index.items():
            offsets[channel_id] = self._at
            size = len(entry) * 8
            head = _INDEX.pack(Opcode.MESSAGE_INDEX, 2 + 4 + size, channel_id, size)
            self._put(head + struct.pack(f"<{len(entry)}Q", *entry))
            self._counts[channel_id] = self._counts.get(channel_id, 0) + len(entry) // 2
        self._chunk_count += 1
        self._chunks += _bytes(
            ChunkIndex(
                chunk_length=index_at - chunk_at,
                chunk_start_offset=chunk_at,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=end_ns,
                message_index_length=self._at - index_at,
                message_index_offsets=offsets,
                message_start_time=start_ns,
                uncompressed_size=len(data),
            )
        )

    def _summary(self, start: int) -> tuple[bytes, bytes]:
        """Return the summary's records, to be written at `start`, and the table of where each kind begins."""
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self._chunk_count,
            message_count=sum(self._counts.values()),
            message_end_time=self._end_ns,
            message_start_time=self._start_ns or 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        groups = (
            (Opcode.SCHEMA, _all_bytes(self._schemas)),
            (Opcode.CHANNEL, _all_bytes(self._channels)),
            (Opcode.STATISTICS, _bytes(statistics)),
            (Opcode.CHUNK_INDEX, bytes(self._chunks)),
            (Opcode.ATTACHMENT_INDEX, _all_bytes(self._attachments)),
            (Opcode.METADATA_INDEX, _all_bytes(self._metadata)),
        )
        summary = offsets = b""
        for opcode, group in groups:
            offsets += _bytes(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        return summary, offsets


def _all_bytes(records: Iterable[McapRecord]) -> bytes:
    return b"".join(map(_bytes, records))


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]  # mcap leaves it without annotations
    return data
