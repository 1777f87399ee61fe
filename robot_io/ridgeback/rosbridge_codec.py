"""The rosbridge v2 protocol, pure: our operations to JSON text, the bridge's JSON to typed messages.

Outwards nothing that is not finite can be written. Inwards every text is parsed as JSON (slashes may be
escaped); the messages inside are decoded by `rosbridge_messages`. Decoding raises `ValueError` for what is not
the asked-for thing.
Source: rosbridge protocol document, checked against rosbridge_suite 0.11.17.
"""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import BodyTwist
from robot_io.ridgeback.rosbridge_messages import decoder_of, is_stamped


class Published(msgspec.Struct, frozen=True, gc=False):
    """A message on a topic; `msg` is its JSON, still to be decoded by the topic's type."""

    topic: str
    msg: bytes


class ServiceAnswer(msgspec.Struct, frozen=True, gc=False):
    """The answer to a service call; `values` is its JSON (an object, or a string when `ok` is False)."""

    call_id: str
    ok: bool
    values: bytes


class OtherOperation(msgspec.Struct, frozen=True, gc=False):
    """An operation that this program does not use."""

    op: str


Inbound = Published | ServiceAnswer | OtherOperation


def spell_type(type_name: str, ros_version: int) -> str:
    """Spell a message type as ROS 1 (`pkg/Type`) or ROS 2 (`pkg/msg/Type`) does."""
    package, _, name = type_name.replace("/msg/", "/").partition("/")
    return f"{package}/msg/{name}" if ros_version == 2 else f"{package}/{name}"


def type_fits(ours: str, reported: str) -> bool:
    """Return whether a bridge that reports a topic as `reported` takes `ours` (ROS 2 resolves the short form)."""
    return reported in (ours, spell_type(ours, 2))


def encode_advertise(topic: str, type_name: str) -> bytes:
    """Announce that we publish `type_name` on `topic`, with a queue of one."""
    return _json(
        {"op": "advertise", "id": f"adv:{topic}", "topic": topic, "type": type_name, "queue_size": 1, "latch": False}
    )


def encode_subscribe(topic: str, type_name: str) -> bytes:
    """Ask for every message of `topic`; the server keeps at most the newest one when it is behind."""
    return _json(
        {
            "op": "subscribe",
            "id": f"sub:{topic}",
            "topic": topic,
            "type": type_name,
            "throttle_rate": 0,
            "queue_length": 1,
        }
    )


def encode_call(call_id: str, service: str, arguments: dict[str, str]) -> bytes:
    """Call a service; the answer carries `call_id`."""
    return _json({"op": "call_service", "id": call_id, "service": service, "args": arguments})


def check_finite(twist: BodyTwist) -> None:
    """Raise ValueError unless all three numbers are finite: the base would take NaN for full speed backwards."""
    if not (math.isfinite(twist.vx) and math.isfinite(twist.vy) and math.isfinite(twist.omega)):
        raise ValueError(f"a velocity must be finite, got {twist}")


def encode_twist(topic: str, type_name: str, twist: BodyTwist) -> bytes:
    """Publish a velocity. Raises ValueError unless all three numbers are finite.

    The stamped form leaves the stamp out of its header: the bridge then fills in the robot's own time (ROS 2
    does so only when there is a header at all), so that the two clocks need not agree.
    """
    check_finite(twist)
    message: dict[str, object] = {
        "linear": {"x": float(twist.vx), "y": float(twist.vy), "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": float(twist.omega)},
    }
    if is_stamped(type_name):
        message = {"header": {"frame_id": "base_link"}, "twist": message}
    return _json({"op": "publish", "topic": topic, "msg": message})


_json = msgspec.json.Encoder().encode


class _Envelope(msgspec.Struct, gc=False):
    op: str
    topic: str = ""
    msg: msgspec.Raw = msgspec.Raw(b"null")
    id: str | int | None = None
    values: msgspec.Raw = msgspec.Raw(b"null")
    result: bool = True


class _TopicType(msgspec.Struct, gc=False):
    type: str


class _Publishers(msgspec.Struct, gc=False):
    publishers: list[str]


class _Subscribers(msgspec.Struct, gc=False):
    subscribers: list[str]


class _Time(msgspec.Struct, gc=False):
    secs: int = 0
    nsecs: int = 0
    sec: int = 0
    nanosec: int = 0


class _TimeAnswer(msgspec.Struct, gc=False):
    time: _Time


_decode_envelope = decoder_of(_Envelope)
_decode_topic_type = decoder_of(_TopicType)
_decode_subscribers = decoder_of(_Subscribers)
_decode_publishers = decoder_of(_Publishers)
_decode_time = decoder_of(_TimeAnswer)


def decode_frame(text: bytes) -> Inbound:
    """Decode one text frame of the bridge."""
    envelope = _decode_envelope(text)
    if envelope.op == "publish":
        return Published(envelope.topic, bytes(envelope.msg))
    if envelope.op == "service_response":
        return ServiceAnswer(str(envelope.id), envelope.result, bytes(envelope.values))
    return OtherOperation(envelope.op)


def decode_topic_type(values: bytes) -> str:
    """Decode the answer of /rosapi/topic_type ("" for a topic nobody knows)."""
    return _decode_topic_type(values).type


def decode_publishers(values: bytes) -> list[str]:
    """Decode the answer of /rosapi/publishers: node names."""
    return _decode_publishers(values).publishers


def decode_subscribers(values: bytes) -> list[str]:
    """Decode the answer of /rosapi/subscribers: node names."""
    return _decode_subscribers(values).subscribers


def decode_time(values: bytes) -> float:
    """Decode the answer of /rosapi/get_time: the robot's wall clock, s."""
    at = _decode_time(values).time
    return (at.secs or at.sec) + (at.nsecs or at.nanosec) * 1e-9
