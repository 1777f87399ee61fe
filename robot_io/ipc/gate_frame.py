"""The fixed frame that control sends to the gate once a tick, over a local SEQPACKET socket.

Little-endian: magic "PUSH", version, mode, sequence (+1 always), tick, send time (CLOCK_MONOTONIC ns), the
twist (m/s, m/s, rad/s, BODY frame), and the CRC-32 of all before it.
"""

from __future__ import annotations

import struct
import zlib

import msgspec

from robot_io.messages import BodyTwist

_BODY = struct.Struct("<4sHHQQq3d")
_CRC = struct.Struct("<I")
_MAGIC = b"PUSH"
_VERSION = 1

FRAME_BYTES = _BODY.size + _CRC.size


class GateFrame(msgspec.Struct, frozen=True, gc=False):
    """One command for the gate."""

    seq: int
    tick: int
    sent_ns: int
    mode: int
    twist: BodyTwist


def pack_frame(frame: GateFrame) -> bytes:
    """Return the bytes of a frame."""
    twist = frame.twist
    body = _BODY.pack(
        _MAGIC, _VERSION, frame.mode, frame.seq, frame.tick, frame.sent_ns, twist.vx, twist.vy, twist.omega
    )
    return body + _CRC.pack(zlib.crc32(body))


def unpack_frame(payload: bytes) -> GateFrame | None:
    """Return the frame, or None for anything that is not exactly one (the gate treats that as nonsense)."""
    if len(payload) != FRAME_BYTES:
        return None
    body = payload[: _BODY.size]
    magic, version, mode, seq, tick, sent_ns, vx, vy, omega = _BODY.unpack(body)
    if magic != _MAGIC or version != _VERSION or zlib.crc32(body) != _CRC.unpack(payload[_BODY.size :])[0]:
        return None
    return GateFrame(seq, tick, sent_ns, mode, BodyTwist(vx, vy, omega))
