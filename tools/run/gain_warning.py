"""What `push run` says about gains that leave little room, for the slider its rig assumes."""

from __future__ import annotations

from msgspec.structs import replace

from robot_io.config import RigConfig
from sim_backend.gain_limits import WARN_SHARE, PushedBody, limit
from sim_backend.scene import floor_of, slider_model


def gain_warning(rig: RigConfig) -> str | None:
    """Return one sentence if a rig's gains are beyond 0.7 of the limit for its `[world.slider]`, else None."""
    control, slider = rig.control, rig.world.slider
    if control.controller != "force":
        return None
    is_round = slider.shape == "circle"
    even = replace(rig, world=replace(rig.world, floor=replace(rig.world.floor, patch_strength=0.0)))
    floor = floor_of(even, seed=0)
    d = slider_model(slider).d_m if floor is None else floor.grip(0.0, 0.0, 1.0, 0.0, 1.0, 0.0)[2]
    body = PushedBody(
        is_round,
        slider.radius_m if is_round else slider.length_m / 2,
        d,
        rig.world.ball_radius_m,
        slider.floor_friction * rig.world.floor.push_height_m,
        rig.world.floor.along_over_across,
    )
    highest = limit([body], control.k_f)
    if control.k_y_rad_per_m <= WARN_SHARE * highest:
        return None
    told = f"the limit is k_y {highest:.3g} rad/m" if highest > 0 else "no k_y is stable"
    return (
        f"gains {control.k_f:g}/{control.k_y_rad_per_m:g} may weave: for the slider of [world.slider] at this k_f "
        f"{told}, and beyond {WARN_SHARE:g} of it there is little margin; `push tune` finds others"
    )
