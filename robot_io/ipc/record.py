"""One record shared between two processes: the newest value wins, nobody waits.

Layout of the memfd: a head counter (8 bytes), then eight slots of `payload_size` bytes. The writer packs into
slot n mod 8, then stores n. A reader takes slot n and retries if the head has moved on by seven or more while
it copied. The head is stored through `memoryview.cast("Q")`, one machine store: `struct.pack_into` clears the
bytes first, and readers were seen to catch that zero.
"""

from __future__ import annotations

import mmap
import os
from typing import Self

SLOTS = 8
_HEAD_BYTES = 64  # its own cache line


class SharedRecord:
    """A fixed-size record in shared memory with one writer and any number of readers."""

    def __init__(self, fd: int, payload_size: int) -> None:
        self.fd = fd
        self.payload_size = payload_size
        self._stride = (payload_size + 63) // 64 * 64
        self._map = mmap.mmap(fd, _HEAD_BYTES + SLOTS * self._stride)
        self._bytes = memoryview(self._map)
        self._head = self._bytes[:8].cast("Q")

    @classmethod
    def create(cls, name: str, payload_size: int) -> Self:
        """Make a new record; its `fd` can be passed to a child process."""
        fd = os.memfd_create(name, os.MFD_CLOEXEC)
        os.ftruncate(fd, _HEAD_BYTES + SLOTS * ((payload_size + 63) // 64 * 64))
        return cls(fd, payload_size)

    @property
    def count(self) -> int:
        """How many payloads were ever published."""
        return self._head[0]

    def publish(self, payload: bytes) -> None:
        """Publish `payload` (exactly `payload_size` bytes); never blocks."""
        if len(payload) != self.payload_size:
            raise ValueError(f"payload of {len(payload)} bytes in a record of {self.payload_size}")
        n = self._head[0] + 1
        start = _HEAD_BYTES + (n % SLOTS) * self._stride
        self._bytes[start : start + self.payload_size] = payload
        self._head[0] = n

    def read(self) -> tuple[int, bytes] | None:
        """Return (count, newest payload), or None when nothing was published yet."""
        while True:
            n = self._head[0]
            if n == 0:
                return None
            start = _HEAD_BYTES + (n % SLOTS) * self._stride
            payload = bytes(self._bytes[start : start + self.payload_size])
            if self._head[0] - n < SLOTS - 1:
                return n, payload

    def close(self) -> None:
        """Unmap and close the descriptor; idempotent."""
        if self.fd >= 0:
            self._head.release()
            self._bytes.release()
            self._map.close()
            os.close(self.fd)
            self.fd = -1
