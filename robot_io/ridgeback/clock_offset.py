"""How far the robot's wall clock is ahead of this machine's, as the bridge tells it."""

from __future__ import annotations

import time

from robot_io.clock import NS_PER_S, ClockNs
from robot_io.messages import ClockOffset
from robot_io.ridgeback.rosbridge_codec import ServiceAnswer, decode_frame, decode_time, encode_call
from robot_io.ridgeback.websocket_link import WebSocketLink

ROUNDS = 5
ANSWER_S = 0.1
_CALL = "clock"


def ask_clock(link: WebSocketLink, clock: ClockNs) -> ClockOffset | None:
    """Ask the bridge for its time, at most 0.5 s; None where it does not answer. Raises `LinkLost`.

    Of five answers the one that came soonest counts: the truth is within half of its round trip.
    """
    nearest: ClockOffset | None = None
    for number in range(ROUNDS):
        asked_ns, wall_ns = clock(), time.time_ns()
        link.send_text(encode_call(f"{_CALL}:{number}", "/rosapi/get_time", {}))
        told_ns, came_ns = _answer(link, f"{_CALL}:{number}", asked_ns + int(ANSWER_S * NS_PER_S))
        if told_ns is None:
            return nearest
        half_ns = (came_ns - asked_ns) // 2
        found = ClockOffset((told_ns - wall_ns - half_ns) / NS_PER_S, half_ns / NS_PER_S)
        nearest = found if nearest is None or found.within_s < nearest.within_s else nearest
    return nearest


def _answer(link: WebSocketLink, call_id: str, until_ns: int) -> tuple[int | None, int]:
    """Return the time (ns) in the answer to a call and when it came; None where it says none."""
    while link.wait_readable(until_ns):
        for text, came_ns in link.receive():
            try:
                frame = decode_frame(text)
                if isinstance(frame, ServiceAnswer) and frame.call_id == call_id:
                    return round(decode_time(frame.values) * NS_PER_S), came_ns
            except ValueError:  # no rosapi: the call failed, and its values are a sentence
                return None, 0
    return None, 0
