"""Where things stand before a simulated push: from the rig's `[world.start]` to poses in the WORLD frame."""

from __future__ import annotations

import math
import random

import msgspec

from robot_io.messages import Pose2D
from robot_io.rig.config import RigConfig
from robot_io.rig.world import FloorConfig, SliderConfig
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import SliderModel


class Scene(msgspec.Struct, frozen=True):
    """Pose of base and slider (m, rad, WORLD frame)."""

    base: Pose2D
    slider: Pose2D


def slider_model(config: SliderConfig) -> SliderModel:
    """Return the slider of a rig file. Raises ConfigError for an impossible one."""
    shape: Circle | Rectangle
    if config.shape == "circle":
        shape = Circle(config.radius_m)
    else:
        shape = Rectangle(config.length_m, config.width_m)
    return SliderModel.from_mass(
        shape,
        mass_kg=config.mass_kg,
        floor_friction=config.floor_friction,
        contact_friction=config.contact_friction,
        pressure=config.pressure,
        cof_m=config.cof_m,
    )


def floor_of(rig: RigConfig, seed: int) -> Floor | None:
    """Return what the rig's floor does beyond the slider's ellipsoid, None for nothing. Raises ConfigError."""
    config = rig.world.floor
    if config == FloorConfig():
        return None
    effects = FloorEffects(
        shift_m=rig.world.slider.floor_friction * config.push_height_m,
        turning=config.turning,
        along_over_across=config.along_over_across,
        grain_rad=math.radians(rig.path.direction_deg),
        patch_strength=config.patch_strength,
        patch_m=config.patch_m,
        seed=seed,
    )
    return Floor(slider_model(rig.world.slider), rig.world.slider.pressure, effects)


def place(rig: RigConfig, seed: int) -> Scene:
    """Return where base and slider stand; each seed varies the start within the rig's `spread`.

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
    cos, sin = math.cos(heading), math.sin(heading)
    slider_x = contact_x - (cos * contact_body_x - sin * contact_body_y)
    slider_y = contact_y - (sin * contact_body_x + cos * contact_body_y)
    yaw = math.radians(rig.path.direction_deg)
    slider = _to_world(rig, slider_x, slider_y, heading)
    ball = _to_world(rig, 0.0, lateral, 0.0)
    reach_x, reach_y, _ = rig.frames.contact_in_base_m
    base_x = ball.x - (math.cos(yaw) * reach_x - math.sin(yaw) * reach_y)
    base_y = ball.y - (math.sin(yaw) * reach_x + math.cos(yaw) * reach_y)
    return Scene(Pose2D(base_x, base_y, yaw), slider)


def _spread(dice: random.Random, spread: float) -> float:
    return 1.0 + spread * dice.uniform(-1.0, 1.0)


def _contact_in_body(slider: SliderConfig, edge_m: float) -> tuple[float, float, float]:
    """Return the contact point (m) and the angle of the inward normal (rad) in the slider's body frame."""
    if slider.shape == "circle":
        angle = math.pi - edge_m / slider.radius_m
        return slider.radius_m * math.cos(angle), slider.radius_m * math.sin(angle), angle - math.pi
    return -slider.length_m / 2, edge_m, 0.0


def _to_world(rig: RigConfig, x_path: float, y_path: float, heading_path: float) -> Pose2D:
    angle = math.radians(rig.path.direction_deg)
    cos, sin = math.cos(angle), math.sin(angle)
    origin_x, origin_y = rig.path.origin_m
    yaw = math.remainder(angle + heading_path, math.tau)
    return Pose2D(origin_x + cos * x_path - sin * y_path, origin_y + sin * x_path + cos * y_path, yaw)
