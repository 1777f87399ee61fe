"""The starts from which models of the floor, and engines, are compared: a box and a barrel, easy and hard.

The box measures 0.4 x 0.6 m, the barrel has a radius of 0.25 m; floor friction is 0.3, and both are pushed 0.15 m above
the floor, 6 m far.
"""

from __future__ import annotations

from math import asin

import msgspec

from robot_io.rig.config import RigConfig, load_rig

DISTANCE_M = 6.0
PUSH_HEIGHT_M = 0.15
FLOOR_FRICTION = 0.3
SLIDERS = {
    "box": ('shape="rectangle"', "length_m=0.4", "width_m=0.6", "mass_kg=4.5"),
    "barrel": ('shape="circle"', "radius_m=0.25", "mass_kg=5.0"),
}
HALF_WIDTH_M = {"box": 0.3, "barrel": 0.25}
QUIET = (
    "world.sensor.noise_force_N=0",
    "world.sensor.noise_torque_Nm=0",
    "world.mocap_noise_m=0",
    "world.mocap_noise_deg=0",
    "world.odometry_noise_m_per_s=0",
    "world.start.spread=0",
    "world.start.lateral_offset_m=0",
)


class Start(msgspec.Struct, frozen=True):
    """One start: where the ball meets the object, how that stands, the contact's friction and the gains.

    offset_share: how far from the line through the object's middle, of its half width (left positive).
    """

    slider: str
    contact_friction: float
    offset_share: float
    heading_deg: float
    k_f: float
    k_y_rad_per_m: float


def _both(friction: float, share: float, heading_deg: float, gains: tuple[float, float]) -> tuple[Start, Start]:
    return (
        Start("box", friction, share, heading_deg, *gains),
        Start("barrel", friction, share, 0.0, *gains),
    )


STARTS = (
    *_both(0.5, 0.4, 0.0, (0.3, 0.2)),
    *_both(0.0, 0.4, 0.0, (0.3, 0.2)),
    *_both(0.5, 0.8, -22.5, (0.3, 0.5)),
    *_both(1.0, 0.4, 22.5, (0.1, 0.3)),
)


def edge_offset_m(start: Start) -> float:
    """Return where along the pushed side the ball touches, from the middle (an arc on the barrel; left positive)."""
    across = start.offset_share * HALF_WIDTH_M[start.slider]
    if start.slider == "box":
        return across
    radius = HALF_WIDTH_M["barrel"]
    return radius * asin(across / radius)


def rig_settings(start: Start) -> list[str]:
    """Return the settings of rig `sim` for a whole run from a start, without any noise."""
    return [
        *(f"world.slider.{setting}" for setting in SLIDERS[start.slider]),
        f"world.slider.floor_friction={FLOOR_FRICTION}",
        f"world.slider.contact_friction={start.contact_friction}",
        f"frames.contact_in_base_m=[1.0, 0.0, {PUSH_HEIGHT_M}]",
        f"control.k_f={start.k_f}",
        f"control.k_y_rad_per_m={start.k_y_rad_per_m}",
        f"control.distance_m={DISTANCE_M}",
        f"world.start.edge_offset_m={edge_offset_m(start)!r}",
        f"world.start.heading_deg={start.heading_deg}",
        *QUIET,
    ]


def rig_of(start: Start, settings: tuple[str, ...] = ()) -> RigConfig:
    """Return the rig of a whole run from a start, with `key=value` settings laid over it. Raises ConfigError."""
    return load_rig("sim", [*rig_settings(start), *settings])
