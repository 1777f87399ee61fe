"""All the outside world that one tick sees."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec

from robot_io.messages import ArmRecord, BaseRecord, LinkState, Vector3


class Operator(IntEnum):
    """What the operator asked for since the last tick."""

    NONE = 0
    STOP = 1
    RESUME = 2


def link_number(state: int) -> int:
    """Return a driver's `LinkState` as a record holds it: one that is none of a driver's is that of a lost link."""
    return int(state) if 0 <= state < 2**8 else int(LinkState.LOST)


class FtReading(msgspec.Struct, frozen=True, gc=False):
    """One packet of the force-torque sensor: N, N*m in the SENSOR frame, bias still in it."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/FtReading"
    received_ns: int
    seq: int
    force: Vector3
    torque: Vector3


class FtInput(msgspec.Struct, frozen=True, gc=False):
    """The sensor since the last tick: every packet, oldest first, and the state of its link."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/FtInput"
    readings: tuple[FtReading, ...]
    link: Annotated[int, "uint8", LinkState]
    packets_ok: int
    crc_fail: int
    junk_bytes: int
    bias_jumps: int = 0
    """How often the sensor's bias has jumped since it started, where its driver can tell."""


class HostInput(msgspec.Struct, frozen=True, gc=False):
    """The host: how late this tick woke, how many periods were skipped before it, and who is still alive."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/HostInput"
    late_ns: int
    skipped: int
    gate_alive: bool
    arm_alive: bool
    recorder_alive: bool
    loop_error: bool
    log_dropped: int
    launcher_silent_ns: int = 0
    """How long the launcher, which has the operator's keys, has given no sign of life."""
    recorder_silent_ns: int = 0
    """How long the recorder has taken nothing of what waited for it."""
    asleep_ns: int = 0
    """CLOCK_BOOTTIME minus CLOCK_MONOTONIC: grows only while this machine is suspended (0 at level sim)."""
    last_tick_ns: int = 0
    """How long the tick before this one took, from its waking to the end of its record (0 at level sim)."""
    law_ns: int = 0
    """How long the law's last step took, told once; 0 for a shipped law, and at level sim within the limit."""


class TickInput(msgspec.Struct, frozen=True, gc=False):
    """Everything the tick sees of the world."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickInput"
    tick: int
    now_ns: int
    operator: Annotated[int, "uint8", Operator]
    host: HostInput
    ft: FtInput
    arm: ArmRecord
    base: BaseRecord
    paused: bool = False
    """Whether the operator has paused the run and not yet let it go on."""
