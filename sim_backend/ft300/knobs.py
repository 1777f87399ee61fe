"""Assumptions about an FT 300 where the real one is not documented, and the faults that can be injected."""

from __future__ import annotations

from typing import Literal

import msgspec


class Ft300Knobs(msgspec.Struct, frozen=True):
    """Unknown behaviour of the real sensor, and faults. `..._every` counts packets; 0 means never."""

    paced: bool = True
    """Whether bytes travel at 19200 baud; False for tests that need no line."""
    collisions: bool = True
    """Whether bytes sent while the host is sending are garbled (the line is half duplex)."""
    answer_delay_ms: float = 2.0
    ack_delay_ms: float = 2.0
    ack: bool = True
    """Whether the start of the stream is acknowledged."""
    stop_bytes: int = 50
    """How many consecutive 0xFF bytes stop the stream."""
    mode_change_ms: float = 0.0
    """How long it ignores input after a stop (real: unknown; some clients ask at once, others wait 100 ms)."""
    unknown: Literal["exception", "silence"] = "exception"
    """Answer to unknown registers, functions and values."""
    echo: bool = False
    """Whether the adapter sends back what it is sent, as an RS-485 adapter does whose receiver stays on."""
    corrupt_answer_every: int = 0
    """As the others below, but it counts answers."""
    corrupt_every: int = 0
    drop_byte_every: int = 0
    insert_byte_every: int = 0
    drop_packet_every: int = 0


def damaged(packet: bytes, number: int, knobs: Ft300Knobs) -> bytes:
    """Return the packet of that number as the knobs have it sent."""
    sent = bytearray(packet)
    if is_every_nth(number, knobs.corrupt_every):
        sent[5] ^= 0x10
    if is_every_nth(number, knobs.drop_byte_every):
        del sent[7]
    if is_every_nth(number, knobs.insert_byte_every):
        sent.insert(9, 0x20)
    return bytes(sent)


def is_every_nth(number: int, every: int) -> bool:
    """Return whether it is that one's turn; never where `every` is 0."""
    return every > 0 and number % every == 0
