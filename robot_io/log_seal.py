"""Seals a log: figures of all its messages, written at its end, so that none is changed, lost or doubled unseen.

The chain of `tick_chain` says which tick was altered; the seal covers every other topic, and how the log ends. It does
not depend on the order of messages, so that a tool that sorts a log by time leaves it whole.
"""

from __future__ import annotations

import zlib


class LogSeal:
    """Counts messages and sums up the CRC-32 of each one's topic and payload."""

    def __init__(self) -> None:
        self.messages = 0
        self._sum = 0
        self._topics: dict[str, int] = {}

    def note(self, topic: str, payload: bytes) -> None:
        """Take one message."""
        start = self._topics.get(topic)
        if start is None:
            start = self._topics[topic] = zlib.crc32(topic.encode())
        self.messages += 1
        self._sum += zlib.crc32(payload, start)

    def facts(self) -> dict[str, str]:
        """Return the seal as metadata."""
        return {"messages": str(self.messages), "payload_sum": f"{self._sum % 2**32:08x}"}
