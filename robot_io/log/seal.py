"""Seals a log: figures of all it holds, written at its end, so that a change, loss or duplicate is found.

The chain of `chain` says which tick was altered; the seal covers every other topic, the settings, and how the log
ends. It does not depend on the order of messages, so that a log sorted by time stays valid.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping

CONFIG_FACT = "config_crc32"
_TIME = struct.Struct("<Q")


class LogSeal:
    """Counts messages and sums up the CRC-32 of each one's topic, type, log time and payload."""

    def __init__(self) -> None:
        self.messages = 0
        self._sum = 0
        self._topics: dict[str, int] = {}

    def declare(self, topic: str, schema_name: str, schema_text: bytes) -> None:
        """Take a topic and its type, before its first message."""
        self._topics[topic] = zlib.crc32(b"\0".join((topic.encode(), schema_name.encode(), schema_text)))

    def note(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take one message of a declared topic."""
        self.messages += 1
        self._sum += zlib.crc32(payload, zlib.crc32(_TIME.pack(log_time_ns), self._topics[topic]))

    def facts(self) -> dict[str, str]:
        """Return the seal as metadata."""
        return {"messages": str(self.messages), "message_sum": f"{self._sum % 2**32:08x}"}


class PayloadSeal:
    """The first seal, of some logs of format 1: of topics and payloads only."""

    def __init__(self) -> None:
        self.messages = 0
        self._sum = 0

    def declare(self, topic: str, schema_name: str, schema_text: bytes) -> None:
        """Take a topic, as `LogSeal`; its type is not covered."""

    def note(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take one message; its time is not covered."""
        self.messages += 1
        self._sum += zlib.crc32(payload, zlib.crc32(topic.encode()))

    def facts(self) -> dict[str, str]:
        """Return the seal as metadata."""
        return {"messages": str(self.messages), "payload_sum": f"{self._sum % 2**32:08x}"}


class NoSeal(PayloadSeal):
    """That of the oldest logs of format 1, which have none."""

    def facts(self) -> dict[str, str]:
        """Return nothing to be compared."""
        return {}


def seal_of(end: Mapping[str, str], log_format: int) -> LogSeal | PayloadSeal:
    """Return the seal that a log of this format was finished with; `end` are the facts of its end."""
    if log_format > 1 or "message_sum" in end:
        return LogSeal()
    return PayloadSeal() if "payload_sum" in end else NoSeal()


def config_seal(config: bytes) -> dict[str, str]:
    """Return the seal of the attached config as metadata."""
    return {CONFIG_FACT: f"{zlib.crc32(config):08x}"}
