"""Compare payloads of topics that have today's type, or an earlier one with the same fields."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from robot_io.errors import LogDamaged
from robot_io.log.channels import BY_TOPIC
from robot_io.log.logged_type import LoggedType
from robot_io.mcap.read import ChannelInfo
from tools.replay.difference import Difference, difference


def is_current_type(channel: ChannelInfo) -> bool:
    """Return whether a log's topic has today's type, or is not one of this program's topics."""
    known = BY_TOPIC.get(channel.topic)
    if known is None:
        return True
    return (channel.schema_name, channel.schema_text) == (known.cdr_type.name, known.cdr_type.schema_text)


def earlier_types(channels: Iterable[ChannelInfo], log_format: int) -> dict[str, LoggedType[Any]]:
    """Return how to read the topics of a log whose type differs from today's in widths or names alone."""
    found = dict[str, LoggedType[Any]]()
    for channel in channels:
        if is_current_type(channel):
            continue
        try:
            logged = LoggedType(BY_TOPIC[channel.topic].cdr_type, channel.schema_name, channel.schema_text, log_format)
        except LogDamaged:
            continue
        if not (logged.missing or logged.gone):
            found[channel.topic] = logged
    return found


def payloads_equal(
    topic: str, one: bytes, other: bytes, tolerance: float | None, ignored: frozenset[str] = frozenset()
) -> bool:
    """Return whether two payloads are equal: in every byte, or, with a tolerance, in every number to within it.

    ignored: dotted paths of fields that may differ.
    """
    if one == other or (tolerance is None and not ignored):
        return one == other
    cdr_type = BY_TOPIC[topic].cdr_type
    try:
        return difference(0, cdr_type.decode(one), cdr_type.decode(other), tolerance, ignored) is None
    except LogDamaged:
        return False


def payload_difference(
    log_time_ns: int,
    topic: str,
    logged: bytes | None,
    replayed: bytes | None,
    ignored: frozenset[str] = frozenset(),
) -> Difference:
    """Return the field that differs, but for those `ignored`, or which of the two is missing."""
    if logged is None or replayed is None:
        found = ("a message", "none") if replayed is None else ("no message", "one")
        return Difference(log_time_ns, topic, *found)
    cdr_type = BY_TOPIC[topic].cdr_type
    try:
        leaf = difference(log_time_ns, cdr_type.decode(logged), cdr_type.decode(replayed), None, ignored)
    except LogDamaged:
        leaf = None
    if leaf is None:
        return Difference(log_time_ns, topic, "bytes", "other bytes")
    return Difference(log_time_ns, f"{topic} {leaf.field}", leaf.logged, leaf.replayed)
