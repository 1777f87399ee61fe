"""Start poses of a simulated push: turns the rig's `[world.start]` into poses in the WORLD frame."""

from __future__ import annotations

import math
import random

import msgspec

from robot_io.errors import ConfigError
from robot_io.geometry import StraightPath, rotated
from robot_io.messages import Pose2D
from robot_io.rig.config import RigConfig
from robot_io.rig.world import SliderConfig
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import SliderModel
from sim_backend.physics.support import SupportPoint, support_points
from sim_backend.world.truth import true_frames


class Scene(msgspec.Struct, frozen=True):
    """Pose of base and slider (m, rad, WORLD frame)."""

    base: Pose2D
    slider: Pose2D


def slider_model(config: SliderConfig) -> SliderModel:
    """Return the slider of a rig file. Raises ConfigError for an impossible one."""
    own_points = not isinstance(config.pressure, str)
    if own_points and config.cof_m != (0.0, 0.0):
        raise ConfigError(
            "`world.slider.cof_m` is for a named pressure: a list of support points has its own centre",
            where="slider",
            do="Leave cof_m out, or change the shares",
        )
    return SliderModel.from_mass(
        shape_of(config),
        mass_kg=config.mass_kg,
        floor_friction=config.floor_friction,
        contact_friction=config.contact_friction,
        pressure=config.pressure,
        cof_m=None if own_points else config.cof_m,
    )


def shape_of(config: SliderConfig) -> Circle | Rectangle:
    """Return the shape of a rig's slider. Raises ConfigError for an impossible one."""
    return Circle(config.radius_m) if config.shape == "circle" else Rectangle(config.length_m, config.width_m)


def support_of(rig: RigConfig) -> tuple[SupportPoint, ...]:
    """Return the points on which the rig's slider stands at rest: x, y (m, BODY frame), share of the load.

    Raises ConfigError when it cannot stand on them.
    """
    slider = rig.world.slider
    cof = slider.cof_m if slider.cof_m != (0.0, 0.0) else None
    return support_points(shape_of(slider), slider.pressure, rig.world.floor.support_points, cof)


def floor_of(rig: RigConfig, seed: int) -> Floor | None:
    """Return the rig's floor effects beyond the slider's ellipsoid, or None without any. Raises ConfigError."""
    config, slider = rig.world.floor, rig.world.slider
    effects = FloorEffects(
        shift_m=slider.floor_friction * rig.push_height_m,
        turning=config.turning,
        along_over_across=config.along_over_across,
        grain_rad=math.radians(rig.path.direction_deg),
        patch_strength=config.patch_strength,
        patch_m=config.patch_m,
        seed=seed,
    )
    if effects.has_none:
        return None
    return Floor(slider_model(slider), slider.pressure, effects, config.support_points)


def place(rig: RigConfig, seed: int) -> Scene:
    """Return the start poses of base and slider; each seed varies the start within the rig's `spread`.

    The ball's centre starts at the path's origin, moved sideways by the lateral offset. It meets the object
    after `gap_m` along the path, at `edge_offset_m` from the middle of the pushed face.
    """
    start, world = rig.world.start, rig.world
    dice = random.Random(seed)
    lateral = start.lateral_offset_m * _spread(dice, start.spread)
    edge = start.edge_offset_m * _spread(dice, start.spread)
    heading = math.radians(start.heading_deg) * _spread(dice, start.spread)
    # PATH frame first: the contact point, then the object's centre behind it.
    contact_body_x, contact_body_y, normal_angle = _contact_in_body(world.slider, edge)
    normal_x, normal_y = math.cos(heading + normal_angle), math.sin(heading + normal_angle)
    contact_x = start.gap_m + world.ball_radius_m * normal_x
    contact_y = lateral + world.ball_radius_m * normal_y
    offset_x, offset_y = rotated(contact_body_x, contact_body_y, heading)
    path = StraightPath.of(rig.path.origin_m, rig.path.direction_deg)
    slider = path.point_in_world(contact_x - offset_x, contact_y - offset_y)
    ball_x, ball_y = path.point_in_world(0.0, lateral)
    reach_x, reach_y = rotated(*true_frames(rig).contact_in_base_m[:2], path.heading)
    return Scene(
        Pose2D(ball_x - reach_x, ball_y - reach_y, path.heading),
        Pose2D(*slider, math.remainder(path.heading + heading, math.tau)),
    )


def _spread(dice: random.Random, spread: float) -> float:
    return 1.0 + spread * dice.uniform(-1.0, 1.0)


def _contact_in_body(slider: SliderConfig, edge_m: float) -> tuple[float, float, float]:
    """Return the contact point (m) and the angle of the inward normal (rad) in the slider's body frame."""
    if slider.shape == "circle":
        angle = math.pi - edge_m / slider.radius_m
        return slider.radius_m * math.cos(angle), slider.radius_m * math.sin(angle), angle - math.pi
    return -slider.length_m / 2, edge_m, 0.0
