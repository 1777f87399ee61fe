"""Enums of other rooms whose values are in messages; the definitions in a log name them."""

from __future__ import annotations

from enum import IntEnum


class Latch(IntEnum):
    """Why the gate has latched."""

    NONE = 0
    SILENCE = 1
    EOF = 2
    NONSENSE = 3
    SEQUENCE = 4
    STALE = 5
    NOT_FINITE = 6
    ENVELOPE = 7
    STEP = 8
    FROZEN_TICK = 9
    OVERSPEED = 10
    LINK = 11
    EOF_MOVING = 12
    PAUSED = 13
    TRAVEL = 14
    MOVING_TIME = 15
    CONTACT_SPEED = 16
    SUSPENDED = 17
    ODOMETRY = 18


class Refusal(IntEnum):
    """Why a tare is refused."""

    NONE = 0
    UNSETTLED = 1
    SATURATED = 2
    DEAD = 3
    IMPLAUSIBLE = 4
    """Only where the run starts in contact: the force there is none that an object on the path can give."""


class ContactMode(IntEnum):
    """State of the simulated contact; left and right as seen along the inward normal."""

    STICKING = 0
    SLIDING_LEFT = 1
    SLIDING_RIGHT = 2
    FREE = 3
    """No contact, or none that needs a force."""
    HOLDING = 4
    """Ball at rest in contact: the last force is kept."""


class ArmError(IntEnum):
    """What the arm's process found wrong, for the log and the operator; safety judges the data itself."""

    NONE = 0
    LINK_LOST = 1
    """The RTDE connection is gone."""
    TIME_WENT_BACK = 2
    """The controller's clock jumped back: it was restarted."""
    NOT_FINITE = 3
    """The newest packet holds NaN or infinity; passed on as it is, and over with the next good packet."""
    SERVO_STOPPED = 4
    """Active holding ended by itself: the control script no longer runs, or refused the target."""
    SERVO_NOT_HOLDING = 5
    """Active holding was given up: the joints were too far from the held target."""
    SERVO_STALE = 6
    """Active holding was given up: no new packet for too long."""
