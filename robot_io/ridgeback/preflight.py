"""Asks the bridge, before anything moves, what it would never say by itself: are names and types right, who is there.

A bridge drops a message of the wrong type in silence, so a typing error in the rig file would look like a base
that does not move. The answers come from the `rosapi` node; without it the checks are left out and counted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import msgspec

from robot_io.clock import NS_PER_S, ClockNs
from robot_io.errors import DeviceNotReady, DeviceProtocolError
from robot_io.ridgeback.rosbridge_codec import (
    ServiceAnswer,
    decode_frame,
    decode_publishers,
    decode_subscribers,
    decode_topic_type,
    encode_advertise,
    encode_call,
    encode_subscribe,
    type_fits,
)
from robot_io.ridgeback.websocket_link import WebSocketLink

ROSAPI_TIMEOUT_S = 3.0
"""`rosapi` starts some seconds after the bridge, and answers slowly at first."""
ASK_AGAIN_S = 0.3
"""A question that failed, because `rosapi` is not there yet, is asked again after this."""

_WHO_LISTENS = "subscribers"
_WHO_COMMANDS = "publishers"


class Answers(msgspec.Struct, frozen=True):
    """What the bridge said of the topics."""

    unanswered: tuple[str, ...]
    """The questions that nobody answered."""
    asked: int
    others: tuple[str, ...]
    """Other nodes that may publish on the command topic; clients of the bridge itself do not show."""

    def remarks(self, command_topic: str) -> tuple[str, ...]:
        """Return what an operator should know, in words."""
        words = []
        if self.unanswered:
            words.append(
                f"rosapi left {len(self.unanswered)} of {self.asked} questions unanswered: "
                "names and types of the base's topics, and who uses them, are not all checked"
            )
        if self.others:
            words.append(f"{', '.join(self.others)} may command the base, too, on {command_topic}")
        return tuple(words)


def check_topics(
    link: WebSocketLink, where: str, command_topic: str, types: Mapping[str, str], clock: ClockNs
) -> Answers:
    """Check the type of every topic of `types` and that somebody listens to `command_topic`; takes at most 3 s.

    Raises DeviceProtocolError (a topic carries another type),
    DeviceNotReady (nobody listens to the commands) and `LinkLost`.
    """
    questions = {
        _WHO_LISTENS: encode_call(_WHO_LISTENS, "/rosapi/subscribers", {"topic": command_topic}),
        _WHO_COMMANDS: encode_call(_WHO_COMMANDS, "/rosapi/publishers", {"topic": command_topic}),
        **{f"type:{topic}": encode_call(f"type:{topic}", "/rosapi/topic_type", {"topic": topic}) for topic in types},
    }
    listeners: list[str] | None = None
    others: list[str] = []
    unanswered = set(questions)
    for answer in _answers(link, questions, clock):
        try:
            if answer.call_id == _WHO_LISTENS:
                listeners = decode_subscribers(answer.values)
            elif answer.call_id == _WHO_COMMANDS:
                others = _other_nodes(decode_publishers(answer.values))
            else:
                topic = answer.call_id.removeprefix("type:")
                _check_type(where, topic, types[topic], decode_topic_type(answer.values))
        except ValueError:  # not what rosapi says
            continue
        unanswered.discard(answer.call_id)
    if listeners is not None and not _other_nodes(listeners):
        raise DeviceNotReady(
            f"nothing subscribes to the command topic {command_topic}",
            where=where,
            do="Start the base's software (twist_mux and the wheel controller), or correct base.topics.command",
        )
    return Answers(tuple(sorted(unanswered)), len(questions), tuple(others))


def _answers(link: WebSocketLink, questions: Mapping[str, bytes], clock: ClockNs) -> Iterator[ServiceAnswer]:
    """Ask everything and give the answers as they come; what fails is asked again, and given up when time is over."""
    until_ns = clock() + int(ROSAPI_TIMEOUT_S * NS_PER_S)
    waiting, failed = set(questions), set(questions)
    while waiting and clock() < until_ns:
        for call_id in questions:
            if call_id in failed:
                link.send_text(questions[call_id])
        failed.clear()
        again_ns = clock() + int(ASK_AGAIN_S * NS_PER_S)
        while waiting and link.wait_readable(min(again_ns if failed else until_ns, until_ns)):
            for text, _ in link.receive():
                answer = _answer(text)
                if answer is None or answer.call_id not in waiting:
                    continue
                if not answer.ok:  # no rosapi, or not yet
                    failed.add(answer.call_id)
                    continue
                waiting.discard(answer.call_id)
                yield answer


def _other_nodes(nodes: list[str]) -> list[str]:
    """Leave out the bridge, which is the node of all its clients, also of some that are gone."""
    return [node for node in nodes if "rosbridge" not in node]


def join(link: WebSocketLink, command_topic: str, command_type: str, types: Mapping[str, str]) -> None:
    """Announce our commands, and ask for them to be heard back and for every topic of `types`. Raises `LinkLost`."""
    link.send_text(encode_advertise(command_topic, command_type))
    for topic, type_name in types.items():
        link.send_text(encode_subscribe(topic, type_name))
    link.send_text(encode_subscribe(command_topic, command_type))


def _answer(text: bytes) -> ServiceAnswer | None:
    try:
        frame = decode_frame(text)
    except ValueError:
        return None
    return frame if isinstance(frame, ServiceAnswer) else None


def _check_type(where: str, topic: str, ours: str, reported: str) -> None:
    if reported and not type_fits(ours, reported):  # "": nobody has named this topic yet
        raise DeviceProtocolError(
            f"{topic} carries {reported}, the rig file says {ours}",
            where=where,
            do="Correct the type (or ros_version) under [base.topics]",
        )
