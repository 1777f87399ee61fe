"""How a rig's gains stand to the limits of the sliders it assumes: for the warning of `push run`, and for doctor."""

from __future__ import annotations

import msgspec

from control.laws.force_integral import IntegralSettings
from robot_io.rig.config import ControlConfig, RigConfig
from sim_backend.physics.assumed_sliders import AssumedSlider, bodies, pessimistic_bodies
from sim_backend.physics.gain_limits import WARN_SHARE, integral_limit, limit
from tools.terminal.rig_sliders import rig_sliders

GAINS_MATTER = ("force", "force-integral")
"""The laws whose gains the limits are for."""


class GainMargin(msgspec.Struct, frozen=True):
    """The greatest stable k_y (rad/m) at the rig's k_f, and the ellipsoid's, which is pessimistic; 0: none is."""

    k_y_rad_per_m: float
    limit_rad_per_m: float
    pessimistic_rad_per_m: float

    @property
    def words(self) -> str:
        """Which share of the limit, and of the pessimistic one, the gain is."""
        return f"{_share(self.k_y_rad_per_m, self.limit_rad_per_m)}{_pessimistic(self)}"


def gain_margin(rig: RigConfig) -> GainMargin | None:
    """Return how a rig's k_y stands to the limits; None for a law without limits, or where nothing stays upright.

    Raises ConfigError if the simulated slider is not possible (it would tip over).
    """
    control, sliders = rig.control, rig_sliders(rig)
    if control.law not in GAINS_MATTER or not sliders:
        return None
    highest, pessimistic = (limit(some, control.k_f) for some in (bodies(sliders), pessimistic_bodies(sliders)))
    return GainMargin(control.k_y_rad_per_m, max(highest, 0.0), max(pessimistic, 0.0))


def gain_warning(rig: RigConfig) -> str | None:
    """Return a warning if a rig's gains exceed 0.7 of the limit for a slider it may push, else None.

    Raises ConfigError as `gain_margin`.
    """
    control, margin = rig.control, gain_margin(rig)
    if margin is None:
        return None
    if control.k_y_rad_per_m <= WARN_SHARE * margin.limit_rad_per_m:
        return _integral_warning(control, rig_sliders(rig)) if control.law == "force-integral" else None
    return (
        f"gains {control.k_f:g}/{control.k_y_rad_per_m:g} may oscillate: for the sliders of this rig k_y is "
        f"{margin.words}, and beyond {WARN_SHARE:g} of it there is little margin; `push tune` finds better ones"
    )


def _share(k_y: float, highest: float) -> str:
    return (
        f"{k_y / highest:.2f} of the limit {highest:.3g} rad/m" if highest > 0 else "beyond the limit: none is stable"
    )


def _pessimistic(margin: GainMargin) -> str:
    if margin.limit_rad_per_m <= 0 or margin.pessimistic_rad_per_m >= margin.limit_rad_per_m:
        return ""
    if margin.pessimistic_rad_per_m <= 0:
        return " (by the pessimistic one none is stable)"
    share = margin.k_y_rad_per_m / margin.pessimistic_rad_per_m
    return f" ({share:.2f} of the pessimistic one, {margin.pessimistic_rad_per_m:.3g})"


def _integral_warning(control: ControlConfig, sliders: list[AssumedSlider]) -> str | None:
    k_i = float(str(control.law_settings.get("k_i_rad_per_m2", IntegralSettings().k_i_rad_per_m2)))
    highest = integral_limit(bodies(sliders), control.k_f, control.k_y_rad_per_m)
    if k_i <= WARN_SHARE * highest:
        return None
    return (
        f"the integral's k_i {k_i:g} rad/m^2 may make the push swing: for the sliders of this rig at these gains the "
        f"limit is {highest:.2g}, and beyond {WARN_SHARE:g} of it there is little margin; "
        "`push tune --law force-integral` finds a better one"
    )
