"""Before the first motion: every topic speaks, nobody else commands the base, and what we send comes back.

All websocket clients of a bridge are one node to ROS, so names cannot tell two of them apart; messages can.
"""

from __future__ import annotations

from collections.abc import Callable

from robot_io.clock import NS_PER_MS, NS_PER_S, ClockNs
from robot_io.errors import DeviceNotReady
from robot_io.messages import BodyTwist
from robot_io.ridgeback.echo_watch import EchoWatch

LISTEN_NS = 300 * NS_PER_MS
"""How long the command topic is listened to before anything is sent: six messages of a joystick at 20 Hz."""
FIRST_ECHO_NS = 2 * NS_PER_S
"""How long zeros are sent at most until one of them is heard back: ROS may take a second to connect."""
ZERO_PERIOD_NS = 50 * NS_PER_MS


def check_alone(
    echoes: EchoWatch, receive_until: Callable[[int], None], send_zero: Callable[[], object], clock: ClockNs, where: str
) -> None:
    """Listen, then send zeros until one is heard back; at most 2.3 s.

    receive_until: takes in what comes until a time, and raises where the link breaks. Raises DeviceNotReady when a
    velocity of somebody else is heard, or none of ours.
    """
    receive_until(clock() + LISTEN_NS)
    _refuse_others(echoes, where)
    until_ns = clock() + FIRST_ECHO_NS
    while not echoes.heard:
        now_ns = clock()
        if now_ns > until_ns:
            raise DeviceNotReady(
                f"none of our zero velocities was heard back within {FIRST_ECHO_NS / NS_PER_S:g} s",
                where=where,
                do="Commands do not reach the robot's ROS: restart rosbridge and check base.topics.command",
            )
        send_zero()
        receive_until(now_ns + ZERO_PERIOD_NS)
        _refuse_others(echoes, where)


def in_words(twist: BodyTwist) -> str:
    """Return a velocity for people."""
    return f"{twist.vx:.2f} m/s forward, {twist.vy:.2f} m/s left, {twist.omega:.2f} rad/s"


def _refuse_others(echoes: EchoWatch, where: str) -> None:
    if echoes.foreign:
        raise DeviceNotReady(
            f"somebody else commands the base: {in_words(echoes.newest_foreign)} was heard on the command topic",
            where=where,
            do="End the other program (`rostopic info` of the command topic lists the nodes), then start again",
        )
