"""The warning of `push run` about gains with little stability margin for the sliders its rig assumes."""

from __future__ import annotations

import contextlib

from control.laws.force_integral import IntegralSettings
from robot_io.errors import ConfigError
from robot_io.rig.config import ControlConfig, RigConfig
from sim_backend.physics.assumed_sliders import pushed_body, samples
from sim_backend.physics.floor import FloorEffects
from sim_backend.physics.gain_limits import WARN_SHARE, PushedBody, integral_limit, limit
from sim_backend.physics.slider import Circle, Rectangle
from sim_backend.world.scene import slider_model
from tools.rig import devices_at

GAINS_MATTER = ("force", "force-integral")
"""The laws whose gains the limits are for."""


def gain_warning(rig: RigConfig) -> str | None:
    """Return a warning if a rig's gains exceed 0.7 of the limit for a slider it may push, else None.

    Raises ConfigError if the simulated slider is not possible (it would tip over).
    """
    control, bodies = rig.control, rig_bodies(rig)
    if control.law not in GAINS_MATTER or not bodies:
        return None
    highest = limit(bodies, control.k_f)
    if control.k_y_rad_per_m <= WARN_SHARE * highest:
        return _integral_warning(control, bodies) if control.law == "force-integral" else None
    margin = f"the limit is k_y {highest:.3g} rad/m" if highest > 0 else "no k_y is stable"
    return (
        f"gains {control.k_f:g}/{control.k_y_rad_per_m:g} may oscillate: for the sliders of this rig at this k_f "
        f"{margin}, and beyond {WARN_SHARE:g} of it there is little margin; `push tune` finds better ones"
    )


def _integral_warning(control: ControlConfig, bodies: list[PushedBody]) -> str | None:
    k_i = float(str(control.law_settings.get("k_i_rad_per_m2", IntegralSettings().k_i_rad_per_m2)))
    highest = integral_limit(bodies, control.k_f, control.k_y_rad_per_m)
    if k_i <= WARN_SHARE * highest:
        return None
    return (
        f"the integral's k_i {k_i:g} rad/m^2 may make the push swing: for the sliders of this rig at these gains the "
        f"limit is {highest:.2g}, and beyond {WARN_SHARE:g} of it there is little margin; "
        "`push tune --law force-integral` finds a better one"
    )


def rig_bodies(rig: RigConfig) -> list[PushedBody]:
    """Return the sliders of `[sliders]`, and the simulated one if there is one."""
    world, pressure = rig.world, rig.sliders.pressure
    effects = FloorEffects(
        shift_m=world.slider.floor_friction * rig.push_height_m,
        turning=world.floor.turning,
        along_over_across=world.floor.along_over_across,
    )
    bodies = []
    for length in samples(rig.sliders.shortest_m, rig.sliders.longest_m):
        for outline in (Rectangle(length, length), Circle(length / 2)):
            with contextlib.suppress(ConfigError):  # it would tip over: nobody pushes it at that height
                bodies.append(pushed_body(outline, pressure, effects, world.ball_radius_m))
    if not devices_at(rig, "hardware"):
        shape = slider_model(world.slider).shape
        assert isinstance(shape, Circle | Rectangle)
        bodies.append(pushed_body(shape, world.slider.pressure, effects, world.ball_radius_m))
    return bodies
