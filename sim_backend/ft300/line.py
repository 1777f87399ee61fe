"""Timing of bytes between a host and an FT 300: the line's speed and the USB adapter's latency timer. Pure.

19200 baud with ten bits per byte carries 1920 bytes a second in each direction. An FTDI adapter hands received
bytes to the host only when its latency timer fires (1 or 16 ms; 0 here stands for "at once"), regardless of packet
boundaries; opening the port resets the adapter, which loses what it holds and starts its timer. Not modelled: the
adapter's 64-byte buffer (16 ms of data never fill it), USB frames, framing errors.
"""

from __future__ import annotations

from collections import deque

from robot_io.clock import NS_PER_MS, NS_PER_S

BYTES_PER_S = 1920
BYTE_NS = NS_PER_S // BYTES_PER_S
QUEUE_LIMIT = 4096


class WireDirection:
    """One direction of the line: bytes are put in at once and arrive one by one at the line's speed."""

    def __init__(self, *, paced: bool) -> None:
        self._byte_ns = BYTE_NS if paced else 0
        self._queue: deque[tuple[int, int]] = deque()
        self._free_ns = 0
        self._taken_ns = 0

    def __len__(self) -> int:
        """Return the number of bytes that have not been taken yet."""
        return len(self._queue)

    @property
    def free_ns(self) -> int:
        """When the last queued byte will have arrived."""
        return self._free_ns

    @property
    def room(self) -> int:
        """How many more bytes an open port may put in before its writer has to wait; less than 0 after a close."""
        return QUEUE_LIMIT - len(self._queue)

    def is_busy(self, at_ns: int) -> bool:
        """Return whether bytes are on the wire at `at_ns`."""
        return at_ns < self._free_ns

    def put(self, data: bytes, at_ns: int) -> None:
        """Put bytes on the wire at `at_ns`, behind those still on it."""
        arrival_ns = max(at_ns, self._free_ns)
        for byte in data:
            arrival_ns += self._byte_ns
            self._queue.append((arrival_ns, byte))
        self._free_ns = arrival_ns

    def next_ns(self) -> int | None:
        """Return when the next byte arrives; None when nothing is in transit."""
        return self._queue[0][0] if self._queue else None

    def next_began_ns(self) -> int | None:
        """Return when the next byte began to travel; None when nothing is in transit."""
        return self._queue[0][0] - self._byte_ns if self._queue else None

    def take(self, until_ns: int) -> bytes:
        """Return the bytes that have arrived by `until_ns`."""
        taken = bytearray()
        while self._queue and self._queue[0][0] <= until_ns:
            self._taken_ns, byte = self._queue.popleft()
            taken.append(byte)
        return bytes(taken)

    def taken_ns(self, bytes_behind: int = 0) -> int:
        """Return when the byte arrived that was taken last but `bytes_behind`, if they came without a pause."""
        return self._taken_ns - bytes_behind * self._byte_ns

    def cut(self, at_ns: int) -> None:
        """Discard what has not begun to travel at `at_ns`: its sender falls silent."""
        while self._queue and self._queue[-1][0] - self._byte_ns >= at_ns:
            self._queue.pop()
        self._free_ns = self._queue[-1][0] if self._queue else min(self._free_ns, at_ns)

    def clear(self) -> None:
        """Discard what is in transit."""
        self._queue.clear()
        self._free_ns = 0


def next_delivery_ns(arrival_ns: int, latency_ms: int, since_ns: int = 0) -> int:
    """Return when a byte that reached the adapter at `arrival_ns` is handed to the host; its timer runs `since_ns`."""
    if latency_ms == 0:
        return arrival_ns
    timer_ns = latency_ms * NS_PER_MS
    return since_ns - (since_ns - arrival_ns) // timer_ns * timer_ns


def last_delivery_ns(now_ns: int, latency_ms: int, since_ns: int = 0) -> int:
    """Return when the adapter last handed bytes to the host."""
    timer_ns = latency_ms * NS_PER_MS
    return now_ns if latency_ms == 0 else since_ns + (now_ns - since_ns) // timer_ns * timer_ns
