"""What is assumed of an emulated FT 300 where the real one is not documented, and the faults it can be given."""

from __future__ import annotations

from typing import Literal

import msgspec


class Ft300Knobs(msgspec.Struct, frozen=True):
    """What is unknown of the real sensor, and faults. `..._every` counts packets; 0 means never."""

    paced: bool = True
    """Bytes travel at 19200 baud; False for tests that need no line."""
    collisions: bool = True
    """Bytes sent while the host sends are garbled (the line is half duplex)."""
    answer_delay_ms: float = 2.0
    ack_delay_ms: float = 2.0
    ack: bool = True
    """Whether the start of the stream is acknowledged."""
    stop_bytes: int = 50
    """How many 0xFF in a row stop the stream."""
    mode_change_ms: float = 0.0
    """Deaf for this long after a stop (real: unknown; clients exist that ask at once, and others that wait 100 ms)."""
    unknown: Literal["exception", "silence"] = "exception"
    """Answer to unknown registers, functions and values."""
    corrupt_every: int = 0
    drop_byte_every: int = 0
    insert_byte_every: int = 0
    drop_packet_every: int = 0
