"""What a Ridgeback's driver gives: one tagged union of samples, at every level (sim, emulated, hardware)."""

from __future__ import annotations

import msgspec

from robot_io.messages import BaseStatus, BodyTwist, Pose2D


class BasePose(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Pose of the base in the WORLD frame. `flaw` says why it is not usable ("" when it is)."""

    pose: Pose2D
    flaw: str = ""

    @property
    def valid(self) -> bool:
        """Whether the pose may be used."""
        return not self.flaw


class BaseOdometry(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Measured velocity in the BODY frame; NaN where the message held null."""

    twist: BodyTwist


class BaseReport(msgspec.Struct, frozen=True, gc=False, tag=True):
    """What the base's microcontroller says of stops, motors and battery."""

    status: BaseStatus


class SliderPose(msgspec.Struct, frozen=True, gc=False, tag=True):
    """Pose of the pushed object in the WORLD frame, from motion capture: for the log, never for control."""

    pose: Pose2D
    flaw: str = ""


class CommandEcho(msgspec.Struct, frozen=True, gc=False, tag=True):
    """A velocity heard on the base's own command topic, ours or another's: proof that commands get there."""

    twist: BodyTwist


BaseFeed = BasePose | BaseOdometry | BaseReport | SliderPose | CommandEcho
