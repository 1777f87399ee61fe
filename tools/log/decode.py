"""Decode the messages of a log into plain values, by the schemas stored in the log itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from mcap.records import Message

from robot_io.cdr.of_others import ReaderOfOthers
from robot_io.cdr.schema import shape_from_schema, type_from_schema
from robot_io.cdr.shape import Blob, Many, Nested, Shape
from robot_io.errors import LogDamaged, UsageError
from robot_io.mcap.log_file import LIBRARY, MESSAGE_ENCODING, SCHEMA_ENCODING
from robot_io.mcap.read import LogSummary, walk_all
from robot_io.mcap.walk import Topic

# Unit of each field, by message type; an empty field name applies to every field of the type.
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
    """One message with its decoded values and their shape."""

    topic: str
    log_time_ns: int
    type_name: str
    shape: Nested
    value: Any


class _Type(NamedTuple):
    """Type and encodings of a channel's messages; in a log by other software a topic may have several."""

    topic: str
    name: str
    text: str
    message_encoding: str
    schema_encoding: str


class _Decoder(NamedTuple):
    shape: Nested
    decode: Callable[[bytes], Any]


class Decoders:
    """Decodes the given topics of a log (None: all); `unreadable` gives the reason for each that cannot be decoded."""

    def __init__(self, summary: LogSummary, topics: list[str] | None) -> None:
        known = {channel.topic for channel in summary.channels}
        missing = sorted(set(topics or ()) - known)
        if missing:
            raise UsageError(f"the log has no topic {', '.join(missing)}", do=f"Choose from {', '.join(sorted(known))}")
        self._ours = summary.library == LIBRARY
        self._decoders: dict[_Type, _Decoder] = {}
        self.unreadable: dict[str, str] = {}
        for channel in summary.channels:
            if topics is None or channel.topic in topics:
                self._add(
                    _Type(
                        channel.topic,
                        channel.schema_name,
                        channel.schema_text,
                        channel.message_encoding,
                        channel.schema_encoding,
                    )
                )

    def read(self, path: Path) -> Iterator[Decoded]:
        """Yield the messages of the chosen, decodable topics.

        A payload that does not match its schema ends the decoding of that topic and type. Raises as `read_log`.
        """
        types: dict[int, _Type] = {}
        for item in walk_all(path):
            if isinstance(item, Topic):
                types[item.channel.id] = _type_of(item)
            elif isinstance(item, Message):
                message_type = types[item.channel_id]
                decoder = self._decoders.get(message_type)
                if decoder is None:
                    continue
                try:
                    value = decoder.decode(item.data)
                except LogDamaged as damage:
                    self.unreadable[message_type.topic] = damage.what
                    del self._decoders[message_type]
                    continue
                yield Decoded(message_type.topic, item.log_time, message_type.name, decoder.shape, value)

    def _add(self, message_type: _Type) -> None:
        try:
            _require_known_encoding(message_type)
            if self._ours:
                cdr_type = type_from_schema(message_type.name, message_type.text)
                self._decoders[message_type] = _Decoder(cdr_type.shape, cdr_type.decode)
            else:
                shape = shape_from_schema(message_type.name, message_type.text)
                self._decoders[message_type] = _Decoder(shape, ReaderOfOthers(message_type.name, shape).decode)
        except LogDamaged as damage:
            self.unreadable[message_type.topic] = damage.what


def _type_of(topic: Topic) -> _Type:
    channel, schema = topic
    text = schema.data.decode(errors="replace")
    return _Type(channel.topic, schema.name, text, channel.message_encoding, schema.encoding)


def _require_known_encoding(message_type: _Type) -> None:
    if message_type.message_encoding != MESSAGE_ENCODING:
        named = message_type.message_encoding[:20] or "an unnamed encoding"
        raise LogDamaged(f"its messages are in {named}; only {MESSAGE_ENCODING} can be read")
    if not message_type.schema_encoding:
        raise LogDamaged("it has no schema, so its bytes cannot be decoded")
    if message_type.schema_encoding != SCHEMA_ENCODING:
        raise LogDamaged(f"its schema is {message_type.schema_encoding[:20]}; only {SCHEMA_ENCODING} can be read")


def columns(shape: Nested, value: Any) -> list[tuple[str, Any]]:
    """Return a message of this shape as pairs (column name with unit, cell).

    Each leaf of a struct or fixed-length array becomes a column; a sequence of variable length is one cell of JSON.
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
