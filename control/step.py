"""One step of control: (settings, state, input) -> (state, wanted velocity). Pure."""

from __future__ import annotations

import msgspec

from control.base_velocity import body_from_world, contact_point_world, heading_rate
from control.sensing import sense
from control.sequence import advance
from control.settings import Settings
from robot_io.messages import BodyTwist, WorldTwist
from robot_io.tick import ControlState, TickInput


class Wanted(msgspec.Struct, frozen=True, gc=False):
    """The output of control: the wanted velocity in both frames, and where the contact ball is (m, WORLD frame)."""

    world: WorldTwist
    body: BodyTwist
    contact_x: float
    contact_y: float


def step(settings: Settings, state: ControlState, inp: TickInput, *, held: bool = False) -> tuple[ControlState, Wanted]:
    """Return the state after this tick and the wanted velocity of the base; `held`: whether it is held or paused."""
    pose = inp.base.pose
    contact = contact_point_world(pose.x, pose.y, pose.yaw, settings.contact_x, settings.contact_y)
    state = sense(settings, state, inp.ft.readings, pose.yaw, inp.now_ns)
    state = advance(settings, state, inp, contact, held)
    if state.speed == 0.0:
        return state, Wanted(WorldTwist(), BodyTwist(), *contact)
    dx, dy = settings.path.direction_in_world(state.theta_p)
    control = settings.control
    omega = heading_rate(state.held_yaw, pose.yaw, control.heading_gain_per_s, control.max_turn_rate_rad_per_s)
    world = WorldTwist(state.speed * dx, state.speed * dy, omega)
    return state, Wanted(world, body_from_world(world, pose.yaw), *contact)
