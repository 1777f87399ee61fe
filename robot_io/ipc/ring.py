"""A ring of records in shared memory: one process pushes, one other pops, nobody ever waits.

Layout of the memfd: head, tail and dropped count as uint64, each on its own cache line, then `capacity` bytes that are
used round and round. Head and tail only grow; position n lies at byte n mod capacity. A record is

    uint32 bytes of payload | uint32 kind | int64 time_ns | payload | zeros up to a multiple of 8

and may wrap around the end. The producer writes the record first and moves the head after it; the consumer copies,
then moves the tail. Both counters are stored through `memoryview.cast("Q")`, one machine store each:
`struct.pack_into` clears the bytes first, and the other side was seen to catch that zero. That a record is seen
before the head that announces it is the memory order of x86; other processors were not tried.
"""

from __future__ import annotations

import mmap
import os
import struct
from typing import NamedTuple, Self

from robot_io.errors import LogDamaged

_DATA = 192
_HEAD, _TAIL, _DROPPED = 0, 8, 16  # in units of 8 bytes: bytes 0, 64 and 128
_RECORD = struct.Struct("<IIq")


class Record(NamedTuple):
    """One popped record: kind, the producer's time in ns, payload."""

    kind: int
    time_ns: int
    payload: bytes


class Ring:
    """A single-producer single-consumer ring of variable-length records in a memfd."""

    def __init__(self, fd: int) -> None:
        """Map an existing ring. Raises ValueError when `fd` is too small for one."""
        self.fd = fd
        self.capacity = os.fstat(fd).st_size - _DATA
        if self.capacity < 8 or self.capacity % 8:
            raise ValueError(f"descriptor {fd} is not a ring: {self.capacity + _DATA} bytes")
        self._map = mmap.mmap(fd, _DATA + self.capacity)
        self._all = memoryview(self._map)
        self._counters = self._all[:_DATA].cast("Q")
        self._data = self._all[_DATA:]

    @classmethod
    def create(cls, name: str, capacity_bytes: int) -> Self:
        """Make an empty ring of `capacity_bytes` (rounded up to pages); its `fd` can be passed to a child."""
        fd = os.memfd_create(name, os.MFD_CLOEXEC)
        pages = -(-(capacity_bytes + _DATA) // mmap.PAGESIZE)
        os.ftruncate(fd, pages * mmap.PAGESIZE)
        return cls(fd)

    @property
    def dropped(self) -> int:
        """How many records did not fit since the ring was made."""
        return self._counters[_DROPPED]

    @property
    def consumed(self) -> int:
        """How many bytes have been popped since the ring was made; it only grows."""
        return self._counters[_TAIL]

    @property
    def unread(self) -> int:
        """How many bytes wait to be popped."""
        return self._counters[_HEAD] - self._counters[_TAIL]

    def push(self, kind: int, time_ns: int, payload: bytes) -> bool:
        """Append a record; False, and one more dropped, when it does not fit. Producer only; never blocks."""
        counters = self._counters
        head = counters[_HEAD]
        size = len(payload)
        record = _RECORD.pack(size, kind, time_ns) + payload + bytes(-size & 7)
        if len(record) > self.capacity - (head - counters[_TAIL]):
            counters[_DROPPED] += 1
            return False
        start = head % self.capacity
        first = min(len(record), self.capacity - start)
        self._data[start : start + first] = record[:first]
        if first < len(record):
            self._data[: len(record) - first] = record[first:]
        counters[_HEAD] = head + len(record)
        return True

    def pop_all(self, limit: int = 1_000_000) -> list[Record]:
        """Take at most `limit` records, oldest first. Consumer only; never blocks.

        Raises LogDamaged when the next bytes are not a record (a program error: a producer that dies leaves none);
        everything in the ring is then skipped, so that the next call starts clean.
        """
        head, tail = self._counters[_HEAD], self._counters[_TAIL]
        records: list[Record] = []
        while tail != head and len(records) < limit:
            record = self._record_at(tail, head - tail)
            if record is None:
                if records:
                    break  # the good ones first; the next call comes here again
                self._counters[_TAIL] = head
                raise LogDamaged(
                    "a log ring holds bytes that are not a record; they are skipped", where=f"{self.capacity} byte ring"
                )
            records.append(record)
            tail += _RECORD.size + len(record.payload) + (-len(record.payload) & 7)
        self._counters[_TAIL] = tail
        return records

    def close(self) -> None:
        """Unmap and close the descriptor; idempotent."""
        if self.fd >= 0:
            self._counters.release()
            self._data.release()
            self._all.release()
            self._map.close()
            os.close(self.fd)
            self.fd = -1

    def _record_at(self, position: int, filled: int) -> Record | None:
        if not _RECORD.size <= filled <= self.capacity:
            return None
        size, kind, time_ns = _RECORD.unpack(self._copy(position, _RECORD.size))
        if _RECORD.size + size + (-size & 7) > filled:
            return None
        return Record(kind, time_ns, self._copy(position + _RECORD.size, size))

    def _copy(self, position: int, size: int) -> bytes:
        start = position % self.capacity
        first = self._data[start : start + size].tobytes()
        return first if len(first) == size else first + self._data[: size - len(first)].tobytes()
