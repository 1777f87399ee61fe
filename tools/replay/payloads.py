"""Compare payloads of topics that still have today's type."""

from __future__ import annotations

from robot_io.errors import LogDamaged
from robot_io.log.channels import BY_TOPIC
from robot_io.mcap.read import ChannelInfo
from tools.replay.difference import Difference, difference


def is_current_type(channel: ChannelInfo) -> bool:
    """Return whether a log's topic has today's type, or is not one of this program's topics."""
    known = BY_TOPIC.get(channel.topic)
    if known is None:
        return True
    return (channel.schema_name, channel.schema_text) == (known.cdr_type.name, known.cdr_type.schema_text)


def payloads_equal(topic: str, one: bytes, other: bytes, tolerance: float | None) -> bool:
    """Return whether two payloads are equal: in every byte, or, with a tolerance, in every number to within it."""
    if one == other or tolerance is None:
        return one == other
    cdr_type = BY_TOPIC[topic].cdr_type
    try:
        return difference(0, cdr_type.decode(one), cdr_type.decode(other), tolerance) is None
    except LogDamaged:
        return False


def payload_difference(log_time_ns: int, topic: str, logged: bytes | None, replayed: bytes | None) -> Difference:
    """Return the field that differs, or which of the two is missing."""
    if logged is None or replayed is None:
        found = ("a message", "none") if replayed is None else ("no message", "one")
        return Difference(log_time_ns, topic, *found)
    cdr_type = BY_TOPIC[topic].cdr_type
    try:
        leaf = difference(log_time_ns, cdr_type.decode(logged), cdr_type.decode(replayed), None)
    except LogDamaged:
        leaf = None
    if leaf is None:
        return Difference(log_time_ns, topic, "bytes", "other bytes")
    return Difference(log_time_ns, f"{topic} {leaf.field}", leaf.logged, leaf.replayed)
