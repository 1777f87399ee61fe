"""One record shared between two processes: the newest value wins, nobody waits.

Layout of the memfd: a head counter (8 bytes), then eight slots of `payload_size` bytes. The writer packs into
slot n mod 8, then stores n. A reader takes slot n and retries if the head has moved on by seven or more while
it copied. The head is stored through `memoryview.cast("Q")`, one machine store: `struct.pack_into` clears the
bytes first, and readers were seen to catch that zero.
"""

from __future__ import annotations

import mmap
import os
from typing import Generic, Self, TypeVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.messages import ArmRecord, BaseRecord

MessageT = TypeVar("MessageT", bound=msgspec.Struct)

ARM_RECORD = CdrType(ArmRecord, "push_msgs/msg/ArmRecord")
BASE_RECORD = CdrType(BaseRecord, "push_msgs/msg/BaseRecord")

SLOTS = 8
_HEAD_BYTES = 64  # its own cache line


class SharedRecord:
    """A fixed-size record in shared memory with one writer and any number of readers."""

    def __init__(self, fd: int, payload_size: int) -> None:
        self.fd = fd
        self.payload_size = payload_size
        self._stride = _stride(payload_size)
        self._map = mmap.mmap(fd, _HEAD_BYTES + SLOTS * self._stride)
        self._bytes = memoryview(self._map)
        self._head = self._bytes[:8].cast("Q")

    @classmethod
    def create(cls, name: str, payload_size: int) -> Self:
        """Make a new record; its `fd` can be passed to a child process."""
        return cls(cls.create_fd(name, payload_size), payload_size)

    @staticmethod
    def create_fd(name: str, payload_size: int) -> int:
        """Return a descriptor of memory for a new record."""
        fd = os.memfd_create(name, os.MFD_CLOEXEC)
        os.ftruncate(fd, _HEAD_BYTES + SLOTS * _stride(payload_size))
        return fd

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


class TypedRecord(Generic[MessageT]):
    """A `SharedRecord` of messages of one type, all encoded in the same number of bytes (CDR).

    Raises TypeError for a type with strings or sequences, or whose fields lack defaults.
    """

    def __init__(self, fd: int, message_type: CdrType[MessageT]) -> None:
        self._type = message_type
        self._record = SharedRecord(fd, _fixed_bytes(message_type))

    @classmethod
    def create(cls, name: str, message_type: CdrType[MessageT]) -> Self:
        """Make a new record; its `fd` can be passed to a child process."""
        return cls(SharedRecord.create_fd(name, _fixed_bytes(message_type)), message_type)

    @property
    def fd(self) -> int:
        """The memory's descriptor, -1 once closed."""
        return self._record.fd

    @property
    def count(self) -> int:
        """How many messages were ever published."""
        return self._record.count

    def publish(self, message: MessageT) -> None:
        """Publish a message; never blocks."""
        self._record.publish(self._type.encode(message))

    def read(self) -> tuple[int, MessageT] | None:
        """Return (count, newest message), or None when nothing was published yet."""
        found = self._record.read()
        return None if found is None else (found[0], self._type.decode(found[1]))

    def close(self) -> None:
        """Unmap and close the descriptor; idempotent."""
        self._record.close()


def _stride(payload_size: int) -> int:
    return (payload_size + 63) // 64 * 64


def _fixed_bytes(message_type: CdrType[MessageT]) -> int:
    if not message_type.fixed_size:
        raise TypeError(f"{message_type.name} has no fixed size")
    return len(message_type.encode(message_type.struct_type()))
