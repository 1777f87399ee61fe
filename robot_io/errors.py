"""Every error a user can meet, as one tree.

    PushError                 base: code, what happened, where, what to do
    |-- UsageError        2   bad flag, unknown rig, bad value on the command line
    |   `-- ConfigError   2   a rig file that cannot be used (unknown key, range, missing calibration)
    |-- EnvironmentFault  3   this machine: foreign package in the way, missing extra, rig already in use
    |-- DeviceError       4   a device that does not answer as it should
    |   |-- DeviceUnreachable 4   port missing or busy, nothing listens, no reply in time
    |   |-- DeviceProtocolError 4 it answers, but not as this device (wrong version, wrong type)
    |   `-- DeviceNotReady    4   it answers and says no (not running, stop engaged, not settled)
    |-- SafetyStop        5   the run was stopped by a safety check
    |-- ContactLost       6   the object was lost, or never met
    |-- ReplayDiffers     7   a log folds to other bytes than it holds
    |-- LogDamaged        8   a log that cannot be trusted or read
    |-- NotDone           9   the distance was reached, but off the line or on evidence that cannot be trusted
    `-- OperatorStop    130   stopped by the operator, after a clean brake

The number is the exit code of the `push` program. Each message says what happened, where, and what to do.
"""

from __future__ import annotations

from typing import ClassVar


class PushError(Exception):
    """Base of every error meant for a person: `what` happened, `where`, and what to `do` about it."""

    exit_code: ClassVar[int] = 1

    def __init__(self, what: str, *, where: str = "", do: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self.do = do

    def __str__(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        return f"{head}. {self.do}" if self.do else head

    def as_json(self) -> dict[str, object]:
        """Return the error as the object printed with `--json`: code, what, where, do."""
        return {"code": self.exit_code, "what": self.what, "where": self.where, "do": self.do}


class UsageError(PushError):
    """Bad flag, unknown rig or command, a value that makes no sense."""

    exit_code = 2


class ConfigError(UsageError):
    """A rig file that cannot be used: unknown key, value out of range, missing calibration."""


class EnvironmentFault(PushError):
    """This machine is in the way: a foreign package, a missing extra, a rig already in use."""

    exit_code = 3


class DeviceError(PushError):
    """A device that does not do what it should."""

    exit_code = 4


class DeviceUnreachable(DeviceError):
    """Port missing or busy, nothing listens, or no reply within the named time."""


class DeviceProtocolError(DeviceError):
    """Something answers, but not as this device: wrong version, wrong identity, wrong message type."""


class DeviceNotReady(DeviceError):
    """The device answers and cannot be used now: not running, stop engaged, reading not settled."""


class SafetyStop(PushError):
    """The run was stopped by a safety check."""

    exit_code = 5


class ContactLost(PushError):
    """The object was lost on the way, or never met."""

    exit_code = 6


class ReplayDiffers(PushError):
    """Replaying a log gave other outputs than it holds."""

    exit_code = 7


class LogDamaged(PushError):
    """A log that is truncated, altered or not a log of this program."""

    exit_code = 8


class NotDone(PushError):
    """The push reached its distance, but off the line or on evidence that cannot be trusted."""

    exit_code = 9


class OperatorStop(PushError):
    """Stopped by the operator (a key, SIGINT or SIGTERM), after a clean brake."""

    exit_code = 130
