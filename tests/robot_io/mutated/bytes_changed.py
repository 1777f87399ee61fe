"""Changes a sound frame a little or a lot, cheaply; the same draws give the same bytes."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

Turn = Callable[[random.Random], None]
"""Takes in one spoilt frame."""
TELLING = (b"\x00", b"\xff", b"\x7f", b"\x80", b"\x00" * 4, b"\xff" * 4, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00" * 8)
"""Bytes that lengths, counts and signs go wrong with."""


def changed(draw: random.Random, sound: bytes, others: Sequence[bytes], telling: Sequence[bytes] = TELLING) -> bytes:
    """Return `sound` with one to three changes; `others` lend their parts, `telling` goes in anywhere."""
    data = bytearray(sound)
    for _ in range(1 + (draw.random() < 0.3) + (draw.random() < 0.2)):
        size = len(data)
        at = int(draw.random() * size) if size else 0
        how = int(draw.random() * 10)
        if how < 3 and size:
            data[at] ^= 1 << int(draw.random() * 8)
        elif how < 4 and size:
            data[at] = int(draw.random() * 256)
        elif how < 6:
            piece = telling[int(draw.random() * len(telling))]
            data[at : at + (len(piece) if draw.random() < 0.7 else 0)] = piece
        elif how == 6:
            del data[at:]
        elif how == 7:
            del data[at : at + 1 + int(draw.random() * 8)]
        elif how == 8:
            data[at:at] = data[at : at + 1 + int(draw.random() * 32)]
        else:
            other = others[int(draw.random() * len(others))]
            data[at:] = other[int(draw.random() * len(other)) :]
    return bytes(data)
