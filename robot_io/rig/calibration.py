"""When and how the constants of a rig were measured: `[calibration]` and its tables."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

import msgspec
from msgspec import Meta

from robot_io.rig.types import NonNegative, Positive, Table

SECONDS_PER_DAY = 86400.0


class Calibration(Table, frozen=True):
    """How one of them was measured."""

    made: Annotated[datetime, Meta(tz=True)]
    """When, with its time zone: `2026-07-01T12:00:00+00:00`."""
    uncertainty: NonNegative | tuple[NonNegative, ...]
    """Of the result, k = 2 (about 95 %), in `unit`; several where there are several results."""
    unit: str
    """For several results, with commas: `m, m, rad`."""
    residual: NonNegative | tuple[NonNegative, ...] | None = None
    """What the result leaves unexplained (rms), in `unit`."""
    source: str = ""
    """What was measured: by which means, or from which logs."""
    rig: str = ""
    """Name of the rig on which it was made."""
    unseen: str | None = None
    """What this way of measuring cannot show, and is as before: `yaw` where the tool was weighed."""


class CalibrationConfig(Table, frozen=True):
    """What of the rig was measured, and when. It comes with an included file, one for each calibration."""

    max_age_days: Positive = 30.0
    """After this long doctor warns of a calibration, and the verdict of a push mentions it."""
    bias: Calibration | None = None
    sign: Calibration | None = None
    frame: Calibration | None = None
    contact: Calibration | None = None
    marker: Calibration | None = None
    path: Calibration | None = None

    def made(self) -> dict[str, Calibration]:
        """Return those that there are, by what was measured."""
        found = {what: getattr(self, what) for what in WHATS}
        return {what: calibration for what, calibration in found.items() if calibration is not None}

    def ages_days(self, now_s: float) -> dict[str, float]:
        """Return how old each of them is, by what was measured. now_s: s since the epoch."""
        return {what: (now_s - one.made.timestamp()) / SECONDS_PER_DAY for what, one in self.made().items()}


WHATS = tuple(field.name for field in msgspec.structs.fields(CalibrationConfig) if field.name != "max_age_days")
"""What can be measured: bias, sign, frame, contact, marker, path."""
