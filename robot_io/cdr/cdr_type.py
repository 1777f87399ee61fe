"""ROS 2 messages as bytes: plain CDR, little-endian, for any `msgspec.Struct` (field rules: `shape`).

    ODOMETRY = CdrType(Odometry, "nav_msgs/msg/Odometry")
    payload = ODOMETRY.encode(odometry)
    odometry == ODOMETRY.decode(payload)

Wire form (DDS-XTypes 1.3, 7.4.1, encoding version 1): four bytes 00 01 00 00, then the fields in order, each number
aligned to its own size counted from behind those four bytes. A sequence is a uint32 count and its elements; padding
before the elements exists only if there are any.

All bits of a float64 survive, those of a NaN too.
"""

from __future__ import annotations

import struct
from typing import Generic, TypeVar

import msgspec

from robot_io.cdr.parts import Layout
from robot_io.cdr.shape import Nested, schema_text, shape_of
from robot_io.cdr.wire import HEADER_BYTES, NotThisType
from robot_io.errors import LogDamaged

MessageT = TypeVar("MessageT", bound=msgspec.Struct)

ENCAPSULATION = b"\x00\x01\x00\x00"


class CdrType(Generic[MessageT]):
    """Encoder, decoder and schema of one message type; `name` is the ROS name, "pkg/msg/Name".

    Raises TypeError when the Struct has a field without a ROS 2 form.
    """

    def __init__(self, struct_type: type[MessageT], name: str) -> None:
        shape = shape_of(struct_type)
        if not isinstance(shape, Nested):
            raise TypeError(f"{struct_type!r} is not a Struct")
        self.struct_type = struct_type
        self.name = name
        self.shape = shape
        self.schema_text = schema_text(shape)
        self._layout = Layout(shape)

    @property
    def fixed_size(self) -> bool:
        """Return whether all payloads have one size: no strings, no sequences."""
        return self._layout.fixed

    def encode(self, value: MessageT) -> bytes:
        """Return the payload of `value`. Raises ValueError when a value does not fit its field."""
        out = bytearray(ENCAPSULATION)
        try:
            self._layout.write(value, out)
        except (struct.error, TypeError, AttributeError, ValueError) as error:
            raise ValueError(f"{self.name}: {error}") from error
        return bytes(out)

    def decode(self, payload: bytes) -> MessageT:
        """Return the message of a payload. Raises LogDamaged unless it is exactly one message of this type."""
        try:
            if payload[:HEADER_BYTES] != ENCAPSULATION:
                raise NotThisType("it does not start as little-endian CDR")
            value, end = self._layout.read(payload, HEADER_BYTES)
            if end != len(payload):
                raise NotThisType(f"{len(payload) - end} bytes left over")
        except (NotThisType, struct.error, ValueError) as error:
            raise LogDamaged(
                f"a payload of {len(payload)} bytes is not a {self.name}: {error}",
                do="Look at the log with `push log info`",
            ) from None
        decoded: MessageT = value
        return decoded
