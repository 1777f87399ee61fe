"""The paper's law and the integral of the offset over distance, which takes away its steady offset (docs/laws.md)."""

from __future__ import annotations

from typing import Annotated, ClassVar

import msgspec
from msgspec import Meta

from control import push_law
from control.laws.law import Seen
from robot_io.rig.config import ControlConfig

COUNTED_M = 0.25
"""Of an offset no more than this is added up; both constants were chosen by study (docs/laws.md)."""
TURNED_RAD = (0.2, 0.4)
"""Up to the first direction of the push all of it is added up, from the second on nothing."""


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
    """theta_p = (k_f + 1) theta_f + k_y y_c + I, PATH frame; dI/ds = k_i y_c over the way s, and k_i fades with it.

    Of an offset y_c far from the path, and while the push is turned, only a part counts (`step`).
    """

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

        Far from the middle the paper's law is on its way back for metres, and an integral of all the offset meanwhile
        would have to be taken back later: of a large one only a part counts, and of that none while the push is turned.
        """
        proportional = push_law.push_angle(seen.theta_f_rad, seen.lateral_m, self._k_f, self._k_y)
        straight, turned = TURNED_RAD
        share = (turned - abs(proportional + state.integral_rad)) / (turned - straight)
        counted = min(max(seen.lateral_m, -COUNTED_M), COUNTED_M) * min(max(share, 0.0), 1.0)
        k_i = self._k_i * self._fade_m / max(seen.progress_m, self._fade_m)
        change = k_i * counted * seen.speed_m_per_s * seen.dt_s
        integral = min(max(state.integral_rad + change, -self._most), self._most)
        return proportional + integral, IntegralState(integral)
