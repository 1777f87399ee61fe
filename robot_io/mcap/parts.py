"""Takes the parts of an MCAP file out of their records: exactly as long as they say, and with the right checksum.

A checksum of 0 is one that the writer left out (MCAP specification); our writer leaves none out, so that in a log of
ours a 0 is damage.
"""

from __future__ import annotations

import io
import zlib
from pathlib import Path

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.records import Attachment, Chunk

from robot_io.mcap.refusal import RECORD_LIMIT, altered, beyond, too_large


class ExactStream(ReadDataStream):
    """The body of a record for the parsers of the `mcap` package, which by themselves take less than a length says."""

    def __init__(self, body: bytes) -> None:
        super().__init__(io.BytesIO(body))
        self._size = len(body)

    def read(self, length: int) -> bytes:
        """Return exactly this many bytes. Raises EndOfFile."""
        if length > self._size - self.count:
            raise EndOfFile
        return super().read(length)


def checksum_holds(said: int, crc: int, *, ours: bool) -> bool:
    """Return whether a checksum is right, or left out where that is allowed."""
    return said == crc or (said == 0 and not ours)


def attachment_of(body: bytes, path: Path, *, ours: bool) -> Attachment:
    """Return an attachment whose checksum holds. Raises LogDamaged."""
    stream = ExactStream(body)
    attachment: Attachment = Attachment.read(stream)
    end = stream.count - 4
    said = int.from_bytes(body[end : stream.count], "little")
    if not checksum_holds(said, zlib.crc32(body[:end]), ours=ours) or (ours and stream.count != len(body)):
        raise altered(path, "the checksum of an attachment is wrong")
    return attachment


def chunk_content(body: bytes, path: Path, *, ours: bool) -> bytes:
    """Return the records of a chunk. Raises LogDamaged, without making more than `RECORD_LIMIT` bytes."""
    chunk = Chunk.read(ExactStream(body))
    if chunk.uncompressed_size > RECORD_LIMIT:
        if ours:
            raise altered(path, "a chunk is larger than any of ours")
        raise too_large(path, "a chunk", chunk.uncompressed_size)
    if chunk.compression != "zstd" and ours:
        raise altered(path, "the compression of a chunk is not ours")
    data = _unpacked(chunk, path)
    if len(data) != chunk.uncompressed_size:
        raise altered(path, "a chunk has another size than it says")
    if not checksum_holds(chunk.uncompressed_crc, zlib.crc32(data), ours=ours):
        raise altered(path, "the checksum of a chunk is wrong")
    return data


def _unpacked(chunk: Chunk, path: Path) -> bytes:
    """Return the content, at most one byte more than it should have."""
    most = chunk.uncompressed_size + 1
    if chunk.compression == "" or not chunk.data:
        return chunk.data
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as reader:
            return reader.read(most)
    if chunk.compression == "lz4":
        try:
            data: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most)
        except RuntimeError as error:
            raise altered(path, f"a chunk cannot be unpacked ({error})") from None
        return data
    raise beyond(path, f"its chunks are compressed with {chunk.compression[:20]!r}; none, lz4 and zstd are known")
