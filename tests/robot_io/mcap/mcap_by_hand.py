"""MCAP files made byte by byte from the specification, for what no writer at hand writes."""

from __future__ import annotations

import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"
HELLO = b"\x00\x01\x00\x00" + struct.pack("<I", 6) + b"hello\x00"
"""A std_msgs/msg/String."""


def text(value: str) -> bytes:
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def header(profile: str = "ros2", library: str = "another recorder", more: bytes = b"") -> bytes:
    return record(1, text(profile) + text(library) + more)


def schema(number: int = 1, name: str = "std_msgs/msg/String", data: str = "string data", more: bytes = b"") -> bytes:
    return record(3, struct.pack("<H", number) + text(name) + text("ros2msg") + text(data) + more)


def channel(number: int = 1, schema_id: int = 1, topic: str = "/t", encoding: str = "cdr", more: bytes = b"") -> bytes:
    return record(4, struct.pack("<HH", number, schema_id) + text(topic) + text(encoding) + text("") + more)


def message(number: int = 1, payload: bytes = HELLO, time_ns: int = 5) -> bytes:
    return record(5, struct.pack("<HIQQ", number, 0, time_ns, time_ns) + payload)


def chunk(content: bytes, compression: str = "", packed: bytes | None = None, crc: int | None = 0) -> bytes:
    """Return a chunk; `crc` None is the right one."""
    data = content if packed is None else packed
    said = zlib.crc32(content) if crc is None else crc
    head = struct.pack("<QQQI", 0, 0, len(content), said) + text(compression)
    return record(6, head + struct.pack("<Q", len(data)) + data)


def attachment(name: str, data: bytes, *, crc: int | None = 0, more: bytes = b"") -> bytes:
    body = struct.pack("<QQ", 0, 0) + text(name) + text("text/plain") + struct.pack("<Q", len(data)) + data
    return record(9, body + struct.pack("<I", zlib.crc32(body) if crc is None else crc) + more)


def metadata(name: str, more: bytes = b"") -> bytes:
    return record(12, text(name) + text("") + more)


def data_end(crc: int = 0, more: bytes = b"") -> bytes:
    return record(15, struct.pack("<I", crc) + more)


def footer(start: int = 0, crc: int = 0, more: bytes = b"") -> bytes:
    return record(2, struct.pack("<QQI", start, 0, crc) + more)


def file(*records: bytes, end: bytes | None = None) -> bytes:
    """Return a file with these records between its header and its end; without a summary unless `end` has one."""
    return MAGIC + b"".join(records) + (data_end() + footer() if end is None else end) + MAGIC
