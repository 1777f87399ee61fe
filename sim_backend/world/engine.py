"""The engine that moves the pushed object: the closed form, or MuJoCo where the rig says so."""

from __future__ import annotations

from typing import Protocol

from robot_io.errors import ConfigError
from robot_io.messages import Pose2D
from robot_io.rig.config import RigConfig
from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.contact_outcome import ContactOutcome
from sim_backend.physics.steady.slider import SteadySlider
from sim_backend.physics.support import centre_of, leaning
from sim_backend.world.base_plant import GRID_NS
from sim_backend.world.scene import floor_of, shape_of, slider_model, support_of


class PushedObject(Protocol):
    """The object on the floor and its contact with one ball, WORLD frame."""

    @property
    def pose(self) -> Pose2D:
        """Pose of its body origin."""
        ...

    def step(self, ball_from: tuple[float, float], ball_to: tuple[float, float], dt_s: float) -> ContactOutcome:
        """Move the ball's centre (m) in `dt_s` and return the contact in it."""
        ...


def pushed_object(rig: RigConfig, seed: int, pose: Pose2D) -> PushedObject:
    """Return the rig's object at a pose.

    Raises ConfigError for an impossible one, and EnvironmentFault without its engine.
    """
    world = rig.world
    at = (pose.x, pose.y, pose.yaw)
    if world.engine == "mujoco":
        return _rigid_slider(rig, at)
    model, floor = slider_model(world.slider), floor_of(rig, seed)
    if world.solver == "exact" and floor is not None and floor.steady is not None:
        return SteadySlider(model, at, world.ball_radius_m, floor)
    return PushedSlider(model, at, world.ball_radius_m, world.solver, floor)


def _rigid_slider(rig: RigConfig, at: tuple[float, float, float]) -> PushedObject:
    world = rig.world
    slider, floor, settings = world.slider, world.floor, world.mujoco
    if floor.along_over_across != 1.0 or floor.patch_strength > 0.0 or world.solver != "exact":
        raise ConfigError(
            "MuJoCo's floor is even, and its solver is its own",
            where="world.engine",
            do="Leave out world.floor.along_over_across, world.floor.patch_strength and world.solver",
        )
    step_ns = settings.timestep_s * 1e9
    if abs(GRID_NS / step_ns - round(GRID_NS / step_ns)) > 1e-9:
        raise ConfigError(
            f"the world's millisecond is not a multiple of {settings.timestep_s:g} s",
            where="world.mujoco.timestep_s",
            do="Use 0.001, 0.0005, 0.00025 or another whole part of it",
        )
    height = rig.push_height_m
    support = support_of(rig)
    x, y = centre_of(support)
    leaning(support, (x + slider.floor_friction * height, y))  # tips over, or not

    from sim_backend.rigid.body import RigidSlider  # loads MuJoCo: only on request
    from sim_backend.rigid.model import RigidModel

    return RigidSlider(
        RigidModel(
            shape_of(slider),
            support,
            slider.mass_kg,
            slider.floor_friction,
            slider.contact_friction,
            world.ball_radius_m,
            height,
            settings.timestep_s,
            settings.impratio,
        ),
        at,
    )
