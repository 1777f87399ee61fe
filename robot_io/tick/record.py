"""What a tick says, and the record of it that the log holds and replay runs again."""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec
from msgspec.structs import replace

from robot_io.cdr.cdr_type import CdrType
from robot_io.messages import BodyTwist, WorldTwist
from robot_io.tick.control_state import ContactState, ControlState
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

    The state before a tick is that after the tick before. It is in the message itself where that one is no tick of the
    same fold, or missing: at the start of a log, after records that did not fit into the ring, and in a tick that
    failed; in a log also every 10 s, so that replay can start there.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/ControlTick"
    crc32_before: U32
    reserved: U32
    """`SHORTENED` in a log since format 5, else 0."""
    input: TickInput
    before: tuple[TickState, ...]
    """At most one."""
    after: TickState
    output: TickOutput


SHORTENED = 1
"""Of such a tick, `after` holds of safety and of the search for contact what `shortened` keeps; the rest is zero."""


def shortened(tick: ControlTick) -> ControlTick:
    """Return a tick as a log holds most: without what only safety remembers. The state is whole in `before` of others.

    What explains how a run ended stays: mode, latched faults, and the first fault with its value and time.
    """
    safety, control = tick.after.safety, tick.after.control
    kept = SafetyState(
        mode=safety.mode,
        first_ns=safety.first_ns,
        latched=safety.latched,
        first_fault=safety.first_fault,
        first_value=safety.first_value,
        first_fault_ns=safety.first_fault_ns,
    )
    after = TickState(replace(control, contact=_NO_CONTACT), kept, tick.after.envelope)
    return replace(tick, reserved=SHORTENED, after=after)


_NO_CONTACT = ContactState()
TICK_CDR = CdrType(ControlTick, "push_msgs/msg/ControlTick")
