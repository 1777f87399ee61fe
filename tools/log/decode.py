"""Reads the messages of a log as plain values: by the schema that stands in the log itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.schema import type_from_schema
from robot_io.cdr.shape import Blob, Many, Nested, Shape
from robot_io.errors import LogDamaged, UsageError
from robot_io.log.mcap_read import ChannelInfo, LogSummary, read_log

# Unit of a field by the type that holds it; an empty field name stands for every field of the type.
_UNITS: dict[str, dict[str, str]] = {
    "geometry_msgs/msg/Wrench": {"force": "N", "torque": "N*m"},
    "geometry_msgs/msg/Twist": {"linear": "m/s", "angular": "rad/s"},
    "geometry_msgs/msg/Transform": {"translation": "m"},
    "geometry_msgs/msg/Point": {"": "m"},
    "sensor_msgs/msg/JointState": {"position": "rad", "velocity": "rad/s"},
    "push_msgs/msg/Pose2D": {"x": "m", "y": "m", "yaw": "rad"},
    "push_msgs/msg/BodyTwist": {"vx": "m/s", "vy": "m/s", "omega": "rad/s"},
    "push_msgs/msg/WorldTwist": {"vx": "m/s", "vy": "m/s", "omega": "rad/s"},
    "push_msgs/msg/BaseStatus": {"battery_v": "V"},
    "push_msgs/msg/WorldState": {"force_x": "N", "force_y": "N", "contact_x": "m", "contact_y": "m"},
    "push_msgs/msg/FtReading": {"force": "N", "torque": "N*m"},
    "push_msgs/msg/JointState": {"position": "rad", "velocity": "rad/s"},
}


class Decoded(NamedTuple):
    """One message with its values."""

    topic: str
    log_time_ns: int
    type_name: str
    value: Any


class Decoders:
    """Types of the topics of a log; `unreadable` names those whose schema cannot be used, with the reason."""

    def __init__(self, summary: LogSummary, topics: list[str] | None) -> None:
        known = {channel.topic for channel in summary.channels}
        missing = sorted(set(topics or ()) - known)
        if missing:
            raise UsageError(f"the log has no topic {', '.join(missing)}", do=f"It has {', '.join(sorted(known))}")
        self.types: dict[str, CdrType[Any]] = {}
        self.unreadable: dict[str, str] = {}
        for channel in summary.channels:
            if topics is None or channel.topic in topics:
                self._add(channel)

    def read(self, path: Path) -> Iterator[Decoded]:
        """Yield the messages of the wanted, readable topics; a payload that does not fit makes its topic unreadable."""
        for topic, log_time_ns, payload, type_name in read_log(path):
            cdr_type = self.types.get(topic)
            if cdr_type is None or topic in self.unreadable:
                continue
            try:
                value = cdr_type.decode(payload)
            except LogDamaged as damage:
                self.unreadable[topic] = damage.what
                continue
            yield Decoded(topic, log_time_ns, type_name, value)

    def _add(self, channel: ChannelInfo) -> None:
        try:
            self.types[channel.topic] = type_from_schema(channel.schema_name, channel.schema_text)
        except LogDamaged as damage:
            self.unreadable[channel.topic] = damage.what


def columns(shape: Nested, value: Any) -> list[tuple[str, Any]]:
    """Return a message of this shape as (column name with its unit, cell).

    Structs and arrays of fixed length become a column each; a sequence of any length is one cell of JSON.
    """
    return [(f"{name} [{unit}]" if unit else name, cell) for name, unit, cell in _cells(shape, value, "", "")]


def _cells(shape: Shape, value: Any, path: str, unit: str) -> Iterator[tuple[str, str, Any]]:
    match shape:
        case Nested(_, ros_name, fields):
            units = _UNITS.get(ros_name, {})
            for name, field in fields:
                at = f"{path}.{name}" if path else name
                yield from _cells(field, getattr(value, name), at, units.get(name, units.get("", unit)))
        case Many(element, int()):
            for i, item in enumerate(value):
                yield from _cells(element, item, f"{path}.{i}", unit)
        case Many() | Blob():
            yield path, unit, msgspec.json.encode(value).decode()
        case _:
            yield path, unit, value
