"""A slider pushed by a ball in MuJoCo: the same questions and answers as `PushedSlider`, six degrees of freedom inside.

MuJoCo is loaded here and nowhere else, so only rigs with `world.engine = "mujoco"` need it. WORLD frame throughout.
"""

from __future__ import annotations

from math import atan2, cos, hypot, isfinite, sin
from typing import Any

import msgspec

from robot_io.errors import EnvironmentFault
from robot_io.messages import Pose2D
from sim_backend.physics.contact_outcome import FREE, ContactMode, ContactOutcome
from sim_backend.rigid.model import RigidModel

try:
    import mujoco
    import numpy as np
except ImportError as error:
    raise EnvironmentFault(
        'this rig says `world.engine = "mujoco"`, and MuJoCo is not installed',
        where="world.engine",
        do="Install the extra: `.venv/bin/python -m pip install -e '.[mujoco]'`, or set world.engine=quasistatic",
    ) from error

AT_REST_M_PER_S = 1e-9
"""Below this speed the ball counts as at rest."""
SLIDING_M_PER_S = 1e-4
"""A contact that slips faster than this counts as sliding."""
NOWHERE_M = (1e6, 1e6)
_BALL_X, _BALL_Y = 7, 8
_V_BALL_X, _V_BALL_Y = 6, 7
"""A free body has seven coordinates (place and quaternion) and six velocities; the ball's joints come after it."""


class RigidSlider:
    """The slider's pose and its contact with one ball.

    model: what it is made of. pose: x, y (m), heading (rad) of its body origin, WORLD frame.
    """

    def __init__(self, model: RigidModel, pose: tuple[float, float, float]) -> None:
        self._model = compiled = mujoco.MjModel.from_xml_string(model.mjcf())
        self._data: Any = mujoco.MjData(compiled)
        self._timestep_s = model.timestep_s
        self._side, self._ball = compiled.geom("side").id, compiled.geom("ball").id
        per_kg = compiled.body_invweight0[:, 0]
        references = model.references(per_kg[compiled.body("slider").id], per_kg[compiled.body("ball").id])
        impedance = compiled.pair_solimp[:, 0]
        # MuJoCo multiplies the stiffness by the impedance and divides it by its square, and divides the damping by it
        compiled.pair_solref[:] = [
            (-share * each.stiffness, -share * each.damping) for share, each in zip(impedance, references, strict=True)
        ]
        compiled.pair_solreffriction[:, 1] = [
            -share * each.sticking for share, each in zip(impedance, references, strict=True)
        ]
        x, y, heading = pose
        self._place = self._data.qpos
        self._place[:7] = (x, y, -model.sag_m, cos(heading / 2), 0.0, 0.0, sin(heading / 2))
        self._velocity = self._data.qvel
        self._ball_velocity = (0.0, 0.0)
        self._force = np.zeros(6)

    @property
    def pose(self) -> Pose2D:
        """Pose of the slider's body origin, WORLD frame."""
        x, y, _, a, b, c, d = (float(value) for value in self._place[:7])
        return Pose2D(x, y, atan2(2 * (a * d + b * c), 1 - 2 * (c * c + d * d)))

    def step(self, ball_from: tuple[float, float], ball_to: tuple[float, float], dt_s: float) -> ContactOutcome:
        """Move the ball's centre from one point to another (WORLD, m) in `dt_s` and return the contact in it.

        The force is the mean over the step. A ball position that is not a number touches nothing.
        """
        x, y = ball_from
        dx, dy = ball_to[0] - x, ball_to[1] - y
        if not (isfinite(dx) and isfinite(dy)):
            x, y, dx, dy = *NOWHERE_M, 0.0, 0.0
        count = max(1, round(dt_s / self._timestep_s))
        force_x = force_y = 0.0
        last = FREE
        for i in range(count):
            self._move_ball(x + dx * i / count, y + dy * i / count, dx / dt_s, dy / dt_s)
            mujoco.mj_step(self._model, self._data)
            contact = self._contact()
            if contact is not None:
                last = contact
                force_x, force_y = force_x + contact.force_x / count, force_y + contact.force_y / count
        if count > 1 and last is not FREE:
            last = msgspec.structs.replace(last, force_x=force_x, force_y=force_y)
        return last

    def _move_ball(self, x: float, y: float, vx: float, vy: float) -> None:
        """Put the ball at a place, moving: a body that is only placed would have no velocity at its contact."""
        self._place[_BALL_X], self._place[_BALL_Y] = x, y
        self._velocity[_V_BALL_X], self._velocity[_V_BALL_Y] = self._ball_velocity = vx, vy

    def _contact(self) -> ContactOutcome | None:
        """Return the contact of ball and slider that MuJoCo has just solved, None without a force between them."""
        i = self._data.ncon - 1  # contacts are in the order of their bodies, so that the feet's come first
        if i < 0:
            return None
        contact = self._data.contact[i]
        if self._ball not in (contact.geom1, contact.geom2):
            return None
        mujoco.mj_contactForce(self._model, self._data, i, self._force)
        normal, one, other = self._force[:3].tolist()
        if normal <= 0.0:
            return None
        # rows of the frame: the normal, from the first geom to the second, and two tangents; the force is on the second
        nx, ny, _, sx, sy, _, tx, ty, _ = contact.frame.tolist()
        sign = 1.0 if contact.geom1 == self._ball else -1.0
        x, y, _ = contact.pos.tolist()
        size = sign * hypot(nx, ny)
        normal_x, normal_y = nx / size, ny / size
        return ContactOutcome(
            self._mode(x, y, normal_x, normal_y),
            sign * (normal * nx + one * sx + other * tx),
            sign * (normal * ny + one * sy + other * ty),
            x,
            y,
            normal_x,
            normal_y,
        )

    def _mode(self, x: float, y: float, normal_x: float, normal_y: float) -> ContactMode:
        """Return how the contact at a place moves, left and right as seen along the inward normal."""
        vx, vy, _, _, _, turn = self._velocity[:6].tolist()
        ball_vx, ball_vy = self._ball_velocity
        if hypot(ball_vx, ball_vy) < AT_REST_M_PER_S:
            return ContactMode.HOLDING
        at_x, at_y = vx - turn * (y - self._place[1]), vy + turn * (x - self._place[0])
        slip = normal_x * (ball_vy - at_y) - normal_y * (ball_vx - at_x)
        if abs(slip) < SLIDING_M_PER_S:
            return ContactMode.STICKING
        return ContactMode.SLIDING_LEFT if slip > 0.0 else ContactMode.SLIDING_RIGHT
