"""How old the measured constants of a rig are, and which of them were never measured. Pure: the time is given."""

from __future__ import annotations

from typing import NamedTuple

from robot_io.rig.config import RigConfig

NEEDED = ("frame", "contact")
"""Without these two, nobody knows what a force angle and an offset are worth."""
NAMES = {
    "bias": "the sensor's bias",
    "sign": "the sensor's mounting",
    "frame": "the sensor's frame",
    "contact": "the contact point",
    "marker": "the marker's frame",
    "path": "the path",
}
AHEAD_DAYS = 1.0
"""A calibration dated this far ahead was not made by a clock that agrees with this one."""


class CalibrationAge(NamedTuple):
    """What was never measured (of those that are needed), and what was not measured lately, in words."""

    never: tuple[str, ...]
    stale: tuple[str, ...]
    oldest_days: float | None

    @property
    def words(self) -> str:
        """All of it in one sentence, "" where there is nothing to say."""
        never = (f"never calibrated: {' and '.join(self.never)}",) if self.never else ()
        return "; ".join((*never, *self.stale))


def calibration_age(rig: RigConfig, now_s: float) -> CalibrationAge:
    """Return how old the rig's calibrations are. now_s: s since the epoch."""
    ages, limit = rig.calibration.ages_days(now_s), rig.calibration.max_age_days
    stale = [f"{NAMES[what]} was calibrated {days:.0f} days ago" for what, days in ages.items() if days > limit]
    stale += [
        f"the calibration of {NAMES[what]} is dated {-days:.0f} days ahead of this machine's clock"
        for what, days in ages.items()
        if days < -AHEAD_DAYS
    ]
    made = rig.calibration.made()
    never = [NAMES[what] for what in NEEDED if what not in made]
    never += [f"{NAMES[what]} in {made[what].unseen}" for what in NEEDED if what in made and made[what].unseen]
    return CalibrationAge(tuple(never), tuple(stale), max(ages.values()) if ages else None)
