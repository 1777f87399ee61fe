"""The paper's law and the integral of the offset over distance, which takes away its steady offset (docs/laws.md)."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import msgspec
from msgspec import Meta

from control import push_law
from control.laws.law import Seen
from robot_io.rig.config import ControlConfig

_BACKWARD_RAD = math.pi / 2


class IntegralSettings(msgspec.Struct, frozen=True):
    """Gain, bound and fading of the integral; the defaults were chosen by study (docs/laws.md)."""

    k_i_rad_per_m2: Annotated[float, Meta(ge=0, le=5)] = 0.06
    """rad for each metre of offset over a metre of way."""
    max_integral_rad: Annotated[float, Meta(gt=0, le=1.5)] = 0.5
    """The most that the integral may add to either side."""
    fade_m: Annotated[float, Meta(gt=0, le=1000)] = 6.0
    """After this way the gain falls in proportion to 1 / way: the error is constant, the noise is not."""


class IntegralState(msgspec.Struct, frozen=True):
    """What has been added up so far, rad."""

    integral_rad: float = 0.0


class ForceIntegral:
    """theta_p = (k_f + 1) theta_f + k_y y_c + I, where dI/ds = k_i y_c over the way s, and k_i fades with it."""

    name: ClassVar[str] = "force with integral"
    Settings: ClassVar = IntegralSettings
    State: ClassVar = IntegralState

    def __init__(self, control: ControlConfig, settings: IntegralSettings) -> None:
        self._k_f, self._k_y = control.k_f, control.k_y_rad_per_m
        self._k_i, self._most, self._fade_m = settings.k_i_rad_per_m2, settings.max_integral_rad, settings.fade_m

    def initial(self) -> IntegralState:
        """Return the integral before the first step."""
        return IntegralState()

    def step(self, state: IntegralState, seen: Seen) -> tuple[float, IntegralState]:
        """Return theta_p in rad, and the integral after this tick.

        Against windup the integral is bounded, and it does not grow while the direction is at 90 degrees or beyond.
        """
        proportional = push_law.push_angle(seen.theta_f_rad, seen.lateral_m, self._k_f, self._k_y)
        k_i = self._k_i * self._fade_m / max(seen.progress_m, self._fade_m)
        change = k_i * seen.lateral_m * seen.speed_m_per_s * seen.dt_s
        wanted = proportional + state.integral_rad
        if abs(wanted) >= _BACKWARD_RAD and change * wanted > 0.0:
            return wanted, state
        integral = min(max(state.integral_rad + change, -self._most), self._most)
        return proportional + integral, IntegralState(integral)
