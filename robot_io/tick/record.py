"""What a tick says, and the record of it that the log holds and replay runs again."""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.messages import BodyTwist, WorldTwist
from robot_io.tick.control_state import ControlState
from robot_io.tick.field_types import U32
from robot_io.tick.input import TickInput
from robot_io.tick.safety_state import EnvelopeState, Mode, SafetyState


class TickState(msgspec.Struct, frozen=True, gc=False):
    """Everything that is kept from tick to tick."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickState"
    control: ControlState = ControlState()
    safety: SafetyState = SafetyState()
    envelope: EnvelopeState = EnvelopeState()


class TickOutput(msgspec.Struct, frozen=True, gc=False):
    """What the tick says."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/TickOutput"
    mode: Annotated[int, "uint8", Mode]
    faults: tuple[str, ...]
    wanted_world: WorldTwist
    wanted_body: BodyTwist
    """Before the envelope."""
    command_body: BodyTwist
    """After the envelope: what goes to the gate."""
    contact_x: float
    contact_y: float
    """Contact ball centre, m, WORLD frame."""
    finished: bool
    exit_code: Annotated[int, "uint8"]
    fault_values: tuple[float, ...] = ()
    """What was measured for each of `faults`, in the unit of its row; NaN where nothing is."""


class ControlTick(msgspec.Struct, frozen=True, gc=False):
    """The message on `/control/tick`. `crc32_before` chains it to the message before (0 at the start of a file).

    The state before a tick is `after` of the message before. It is in the message itself only where that one is no
    tick of the same fold, or missing: at the start of a log, after records that did not fit into the ring, and in a
    tick that failed.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/ControlTick"
    crc32_before: U32
    reserved: U32
    input: TickInput
    before: tuple[TickState, ...]
    """At most one."""
    after: TickState
    output: TickOutput


TICK_CDR = CdrType(ControlTick, "push_msgs/msg/ControlTick")
