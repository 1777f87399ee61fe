"""The event in the log at the first sample that an injected fault changes."""

from __future__ import annotations

from collections.abc import Callable

from robot_io.log.channels import Kind
from robot_io.log.messages import INJECTED, SAFETY_EVENT, SafetyEvent
from robot_io.log.ros_messages import BASE_FRAME, Header, ros_time
from robot_io.rig.fault_words import FaultWord


def event_writer(push: Callable[[int, int, bytes], object], wall_offset_ns: int) -> Callable[[FaultWord, int], None]:
    """Return what to call at a first change: it pushes an event to the log; `push` is that of a log ring."""

    def write(word: FaultWord, now_ns: int) -> None:
        header = Header(ros_time(now_ns + wall_offset_ns), BASE_FRAME)
        event = SafetyEvent(header, 0, INJECTED, "", f"{INJECTED}: {word.text}", 0, 0)
        push(int(Kind.SAFETY_EVENT), now_ns, SAFETY_EVENT.encode(event))

    return write
