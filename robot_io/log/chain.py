"""Chains the messages of `/control/tick`: each holds the CRC-32 of the payload before it, so that none can be
changed, lost or swapped unseen.

The field is the first of the message: a uint32 at bytes 4..8 of the payload, behind the encapsulation header.
"""

from __future__ import annotations

import struct
import zlib

_FIELD = slice(4, 8)
_CRC = struct.Struct("<I")


class TickChain:
    """The chain of one part of a log; `crc32` is that of the newest payload, 0 at its start."""

    def __init__(self) -> None:
        self.crc32 = 0
        self.ticks = 0

    def link(self, payload: bytes) -> bytes:
        """Return the payload with its `crc32_before` filled in."""
        linked = payload[: _FIELD.start] + _CRC.pack(self.crc32) + payload[_FIELD.stop :]
        self._note(linked)
        return linked

    def holds(self, payload: bytes) -> bool:
        """Return whether a payload that was read is the next link; the chain continues with it either way."""
        good = len(payload) >= _FIELD.stop and payload[_FIELD] == _CRC.pack(self.crc32)
        self._note(payload)
        return good

    def _note(self, payload: bytes) -> None:
        self.crc32 = zlib.crc32(payload)
        self.ticks += 1
