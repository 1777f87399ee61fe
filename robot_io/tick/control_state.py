"""What control remembers from tick to tick."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec

from robot_io.messages import Vector3, Vector6
from robot_io.named_values import Refusal
from robot_io.tick.field_types import Counts6

_ZERO6: Vector6 = (0.0,) * 6


class Phase(IntEnum):
    """Where the push is in its sequence."""

    SETTLE = 0
    """Waiting until every device has sent data."""
    TARE = 1
    """At rest, out of contact: measuring bias and tool weight."""
    APPROACH = 2
    """Along the path until the force says contact."""
    PUSH = 3
    LOST = 4
    """The force is gone: circling back towards the path for a short while."""
    LOST_HOLD = 5
    """Given up circling: at rest, waiting for the operator for a moment."""
    REST = 6
    """The distance is reached: coming to rest."""
    RETREAT = 7
    """A few centimetres back, out of contact."""
    CHECK = 8
    """At rest, out of contact: does the sensor still read zero?"""
    DONE = 9
    FAILED = 10


REST_M_PER_S = 0.01
"""The base counts as being at rest below this measured speed ..."""
REST_NS = 300_000_000
"""... once it has stayed so for this long."""


class TareSums(msgspec.Struct, frozen=True, gc=False):
    """Sums of samples and of their squares (N, N*m, SENSOR frame): all, the first quarter, the last quarter.

    All are of the difference to the first sample (`origin`), so that a large bias costs no digits.
    """

    __ros_name__: ClassVar[str] = "push_msgs/msg/TareSums"
    count: int = 0
    origin: Vector6 = _ZERO6
    total: Vector6 = _ZERO6
    squares: Vector6 = _ZERO6
    first: Vector6 = _ZERO6
    first_squares: Vector6 = _ZERO6
    last: Vector6 = _ZERO6
    last_squares: Vector6 = _ZERO6
    second: Vector6 = _ZERO6
    third: Vector6 = _ZERO6
    """The second and the third distinct value of each axis; the first is `origin`."""
    distinct: Counts6 = (0,) * 6
    """How many distinct values each axis has shown: 4 means more than 3."""


class ContactState(msgspec.Struct, frozen=True, gc=False):
    """What control remembers of the force, to tell contact from none: N, WORLD frame where nothing else is said."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ContactState"
    packets: int = 0
    """How many readings the median has seen, at most 2."""
    before_last: Vector3 = (0.0, 0.0, 0.0)
    last: Vector3 = (0.0, 0.0, 0.0)
    """The last two readings, SENSOR frame, bias still in them."""
    means: tuple[float, ...] = ()
    """x, y, z of the mean force in each tenth of a second: up to one second, while a contact is sought."""
    bucket_since_ns: int = 0
    bucket_total: Vector3 = (0.0, 0.0, 0.0)
    bucket_count: int = 0
    """The tenth of a second that is not yet full."""
    overdue: bool = False
    """Whether the search has already passed the place where the object was expected."""
    samples: tuple[float, ...] = ()
    """Size of the filtered force at each centimetre of the first half metre of contact, N."""
    lost_below_N: float = 0.0
    """Below this force the contact is lost; 0 until the object has been felt."""


class ControlState(msgspec.Struct, frozen=True, gc=False):
    """What control remembers from tick to tick."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ControlState"
    phase: Annotated[int, "uint8", Phase] = 0
    phase_since_ns: int = 0
    tared: bool = False
    refusal: Annotated[int, "uint8", Refusal] = 0
    """Why the start was refused."""
    bias_force: Vector3 = (0.0, 0.0, 0.0)
    bias_torque: Vector3 = (0.0, 0.0, 0.0)
    tare: tuple[TareSums, ...] = ()
    """At most one: of the readings that count in this phase, TARE or CHECK, so far."""
    last_reading_ns: int = 0
    force_world: Vector3 = (0.0, 0.0, 0.0)
    """Filtered force on the slider, N, WORLD frame."""
    force_valid: bool = False
    contact_run: int = 0
    """Consecutive readings above the contact threshold."""
    held_joints: Vector6 = (0.0,) * 6
    held_yaw: float = 0.0
    approach_from_m: float = 0.0
    """Where along the path the approach started."""
    contact_seen: bool = False
    contact_from_m: float = 0.0
    """Where along the path the first contact was."""
    progress_m: float = 0.0
    lateral_m: float = 0.0
    theta_f: float = 0.0
    theta_p: float = 0.0
    speed: float = 0.0
    ramp_since_ns: int = 0
    ramp_from_speed: float = 0.0
    anchor_x: float = 0.0
    anchor_y: float = 0.0
    """Contact point in the WORLD frame where LOST or RETREAT began, m."""
    rest_since_ns: int = 0
    backward_ticks: int = 0
    """Ticks in a row in which the law asked for more than 135 degrees."""
    end_progress_m: float = 0.0
    end_lateral_m: float = 0.0
    residual_N: float = float("nan")
    """Force left after the run, out of contact; NaN when it was not checked."""
    lost_count: int = 0
    """How often the contact was lost after it was first found."""
    lost_m: float = 0.0
    """Distance travelled without the contact, as odometry measured it, since it was first found."""
    lost_ns: int = 0
    """Time in motion without the contact since it was first found."""
    early_contact: bool = False
    """Whether the first contact came more than 0.3 m, and half of the way, before it was expected."""
    force_before_contact_N: float = float("nan")
    """Size of the mean force in the half second before the first contact, where it should be 0; NaN before it."""
    felt_N: float = 0.0
    """Mean force along the motion over half a second, while a contact is sought."""
    contact: ContactState = ContactState()
    resumes: int = 0
    """How often the operator has resumed the push."""
    resume_refused: bool = False
    """Whether a further resume was refused in this rest."""
    law_state: tuple[float, ...] = ()
    """What the law remembers, as numbers; their names are in the log's metadata. Empty before its first step."""
    law_error: str = ""
    """What the law did wrong; "" while it has not."""
    sideways_m: float = 0.0
    """Way in one piece on which the law asked for more than 90 degrees, and was followed as far as 90."""
