"""The sending end of the live view: whoever writes a log sends its messages here too. What does not fit is dropped.

A packet holds one or more messages: topic's length (uint16), log time (ns, int64), payload's length (uint32), topic,
payload. Sending never waits, and a reader that has died is noticed and forgotten.
"""

from __future__ import annotations

import errno
import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

from robot_io.log.channels import BY_TOPIC

PACKET_BYTES = 32 << 10
_HEAD = struct.Struct("<HqI")


class LiveMessage(NamedTuple):
    """An encoded message of the log: topic, log time in ns since 1970, payload."""

    topic: str
    log_time_ns: int
    payload: bytes


class LiveFeed:
    """Sends messages over a SEQPACKET socket; `sent` and `dropped` count them."""

    def __init__(self, to_view: socket.socket) -> None:
        to_view.setblocking(False)
        self._socket: socket.socket | None = to_view
        self._packet = bytearray()
        self._in_packet = 0
        self._kept: list[bytes] = []
        """Messages that late viewers need as well, and that did not fit: sent with a later packet."""
        self._latched: list[bytes] = []
        self.sent = self.dropped = 0

    def add(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Add a message to the packet in progress, which leaves when it is full or at `flush`."""
        if self._socket is None:
            self.dropped += 1
            return
        name = topic.encode()
        packed = _HEAD.pack(len(name), log_time_ns, len(payload)) + name + payload
        if self._packet and len(self._packet) + len(packed) > PACKET_BYTES:
            self.flush()
        if BY_TOPIC[topic].latched:
            self._latched.append(packed)
        self._packet += packed
        self._in_packet += 1

    def flush(self) -> None:
        """Send the packet in progress, or drop it where the reader is behind or gone. Never waits."""
        kept, self._kept = self._kept, []
        packet, count = b"".join([*kept, self._packet]), len(kept) + self._in_packet
        latched = [*kept, *self._latched]
        self._packet, self._in_packet, self._latched = bytearray(), 0, []
        if not count:
            return
        try:
            if self._socket is not None:
                self._socket.send(packet)
                self.sent += count
                return
        except BlockingIOError:
            self._kept = latched
            count -= len(latched)
        except OSError as error:
            if error.errno != errno.EMSGSIZE:
                self.close()
        self.dropped += count

    def counts(self) -> dict[str, int]:
        """Return how many messages were sent, and how many dropped."""
        return {"sent": self.sent, "dropped": self.dropped}

    def close(self) -> None:
        """Close it; the reader ends. Idempotent."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def unpacked(packet: bytes) -> Iterator[LiveMessage]:
    """Yield the messages of a packet."""
    at = 0
    while at < len(packet):
        topic_bytes, log_time_ns, payload_bytes = _HEAD.unpack_from(packet, at)
        at += _HEAD.size
        topic = packet[at : at + topic_bytes].decode()
        at += topic_bytes
        yield LiveMessage(topic, log_time_ns, packet[at : at + payload_bytes])
        at += payload_bytes
