"""A slider pushed by an independent ball: finds the contact, solves the motion and removes the drift in each step.

The ball does not turn and its centre moves in a straight line within a step. A quasistatic slider without force is at
rest, so it stops when the ball leaves, and the next touch is found in closed form inside the step. WORLD frame
outside, BODY frame of the slider inside; floats only, so that the same steps give the same bits.
"""

from __future__ import annotations

from math import ceil, cos, hypot, pi, remainder, sin
from typing import Literal

import msgspec

from robot_io.errors import ConfigError
from robot_io.messages import Pose2D
from sim_backend.physics.contact_geometry import Nearest, Outline
from sim_backend.physics.contact_outcome import FREE, ContactMode, ContactOutcome
from sim_backend.physics.corner import solve_at_corner
from sim_backend.physics.floor import Floor
from sim_backend.physics.slider import SliderModel
from sim_backend.physics.slider_exact import SEPARATING, ContactSolution, ContactSolver, Grain, Moving, solve_exact

__all__ = ["FREE", "ContactMode", "ContactOutcome", "PushedSlider"]

TOUCH_M = 1e-9
"""A gap below this is contact."""
LONGEST_PIECE_M = 1e-3
"""Longer motions of the ball are cut into pieces of at most this: the result does not depend on the caller's step."""
MOST_PIECES = 1000
FIRST_TURNS, LATER_TURNS = 12, 2
"""How often the push is found anew with the grip it causes: at a first touch there is no earlier one to begin with."""
REST_M_PER_S = 1e-9
"""Below this speed the ball counts as at rest and the force is held."""
SMALLEST_BALL_M = 1e-3
"""A ball is a point (0) or at least this: a smaller one would go round a corner within a piece."""
_MODES = (ContactMode.STICKING, ContactMode.SLIDING_LEFT, ContactMode.SLIDING_RIGHT)


class PushedSlider:
    """The slider's pose and its contact with one ball.

    model: the slider. pose: x, y (m), heading (rad) of its body origin, WORLD frame. ball_radius_m: 0 (a point) or at
    least 1 mm. solver: the closed form or OSQP. floor: what the floor does beyond the model's ellipsoid. Raises
    ConfigError for a radius in between.
    """

    def __init__(
        self,
        model: SliderModel,
        pose: tuple[float, float, float],
        ball_radius_m: float,
        solver: Literal["exact", "osqp"] = "exact",
        floor: Floor | None = None,
    ) -> None:
        if not (ball_radius_m == 0.0 or SMALLEST_BALL_M <= ball_radius_m < float("inf")):
            raise ConfigError(
                f"a ball of radius {ball_radius_m} m cannot be simulated", do="Give 0 for a point, or at least 0.001 m"
            )
        self.model = model
        self._outline = Outline(model.shape)
        self._radius = ball_radius_m
        self._point_on_polygon = ball_radius_m == 0.0 and bool(self._outline.rows)
        self._solve = (floor and floor.own_solver(solver, self._point_on_polygon)) or _solver(solver)
        self._piece_m = min(LONGEST_PIECE_M, ball_radius_m / 2) if ball_radius_m else LONGEST_PIECE_M
        self._d, self._f_max, self._mu = model.d_m, model.f_max_N, model.contact_friction
        self._cof_x, self._cof_y = model.cof_m
        self._grain: Grain | None = None
        self._floor = floor
        self._push_x = self._push_y = 0.0  # direction of the push force, BODY
        self._new = True  # no push of a step before
        self.x_m, self.y_m, self.heading_rad = pose
        self._cos, self._sin = cos(self.heading_rad), sin(self.heading_rad)
        self._ball = (float("nan"), float("nan"))
        self._touching = False
        # the contact, BODY frame: inward normal, point, face (-1: a corner), and the corner a point pusher sticks to
        self._nx = self._ny = self._cx = self._cy = 0.0
        self._face = -1
        self._corner = -1
        self._outcome = FREE

    @property
    def pose(self) -> Pose2D:
        """Pose of the slider's body origin, WORLD frame."""
        yaw = remainder(self.heading_rad, 2 * pi)
        return Pose2D(self.x_m, self.y_m, pi if yaw == -pi else yaw)

    def gap_m(self, ball_xy: tuple[float, float]) -> float:
        """Return the free distance between a ball at `ball_xy` and the slider (negative: overlap)."""
        return self._outline.nearest(*self._to_body(*ball_xy))[0] - self._radius

    def step(self, ball_from: tuple[float, float], ball_to: tuple[float, float], dt_s: float) -> ContactOutcome:
        """Move the ball's centre from one point to another (WORLD, m) in `dt_s` (> 0) and return the contact in it.

        Intended for steps of about 1 ms. A ball position that is not a number touches nothing.
        """
        x, y = ball_from
        dx, dy = ball_to[0] - x, ball_to[1] - y
        moved = hypot(dx, dy)
        if not moved < float("inf"):
            self._touching = False
            self._outcome = FREE
            return FREE
        if ball_from != self._ball:
            self._place_ball(x, y)
        self._ball = ball_to
        if not self._touching:
            reach = self._outline.bounding_radius_m + self._radius + moved + TOUCH_M
            if hypot(x - self.x_m, y - self.y_m) > reach:
                self._outcome = FREE
                return FREE
        if moved <= self._piece_m:
            self._outcome = self._advance_piece(x, y, ball_to[0], ball_to[1], dt_s)
            return self._outcome
        pieces = min(ceil(moved / self._piece_m), MOST_PIECES)
        for i in range(1, pieces + 1):
            last = i == pieces
            to_x, to_y = ball_to if last else (ball_from[0] + dx * i / pieces, ball_from[1] + dy * i / pieces)
            self._outcome = self._advance_piece(x, y, to_x, to_y, dt_s / pieces)
            x, y = to_x, to_y
        return self._outcome

    def _advance_piece(self, x: float, y: float, to_x: float, to_y: float, dt_s: float) -> ContactOutcome:
        """Advance by one short straight motion of the ball."""
        vx, vy = (to_x - x) / dt_s, (to_y - y) / dt_s
        if hypot(vx, vy) < REST_M_PER_S:
            return self._outcome_at_rest()
        done = 0.0 if self._touching else self._first_touch(x, y, to_x - x, to_y - y)
        if done is None:
            return FREE
        outcome = FREE
        for _ in range(4):  # each turn after the first starts at a corner a point pusher has slid to
            left = (1.0 - done) * dt_s
            v_body_x = self._cos * vx + self._sin * vy
            v_body_y = self._cos * vy - self._sin * vx
            solution = self._respond(v_body_x, v_body_y)
            if not isinstance(solution, Moving):
                # leaving, or brushing along the face without a normal motion: no force is needed for either
                self._touching, self._corner = False, -1
                return FREE
            outcome = self._outcome_of(solution)
            share = self._share_to_corner(solution.slip, left)
            self._move(solution, left * share)
            done += (1.0 - done) * share
            self._remove_drift(x + done * (to_x - x), y + done * (to_y - y))
            if share == 1.0 or not self._touching:
                break
        return outcome

    def _respond(self, vx: float, vy: float) -> ContactSolution:
        """Return the response to the ball's velocity (BODY, m/s); stores the push, and the face at a corner."""
        floor = self._floor
        solution: ContactSolution = SEPARATING
        # the floor's grip depends on the push, and the push on the grip: last step's push is only an initial guess
        turns = FIRST_TURNS if self._new else LATER_TURNS
        self._new = False
        for _ in range(turns if floor is not None and floor.follows_push else 1):
            if floor is not None:
                self._update_grip(floor)
            solution = self._solve_contact(vx, vy)
            if not isinstance(solution, Moving):
                break
            self._push_x, self._push_y = solution.fx, solution.fy
        if self._face >= 0:
            self._corner = -1
        return solution

    def _solve_contact(self, vx: float, vy: float) -> ContactSolution:
        """Solve the current contact, on a face or at a corner."""
        x, y = self._cx - self._cof_x, self._cy - self._cof_y
        if self._corner < 0:
            return self._solve(x, y, self._nx, self._ny, vx, vy, self._d, self._f_max, self._mu, self._grain)
        arguments = (x, y, self._d, self._f_max, self._mu, self._grain)
        choice = solve_at_corner(self._outline.rows, self._corner, self._solve, vx, vy, arguments)
        if choice is None:
            return SEPARATING
        solution, self._nx, self._ny, self._face = choice
        return solution

    def _first_touch(self, x: float, y: float, dx: float, dy: float) -> float | None:
        """Find the first touch of a ball that is clear or just leaving, and set the contact there."""
        bx, by = self._to_body(x, y)
        b_dx, b_dy = self._cos * dx + self._sin * dy, self._cos * dy - self._sin * dx
        nearest = self._outline.nearest(bx, by, self._face)
        fraction: float | None = 0.0
        if nearest[0] - self._radius > TOUCH_M:
            fraction = self._outline.first_touch(bx, by, b_dx, b_dy, self._radius)
            if fraction is None:
                return None
            nearest = self._outline.nearest(bx + fraction * b_dx, by + fraction * b_dy)
        self._set_contact(nearest)
        if self._corner < 0 and self._nx * b_dx + self._ny * b_dy < 0.0:
            return None
        self._touching = True
        return fraction

    def _set_contact(self, nearest: Nearest) -> None:
        _, self._nx, self._ny, self._cx, self._cy, self._face = nearest
        self._push_x, self._push_y = self._nx, self._ny
        self._new = True
        self._corner = -1
        if self._point_on_polygon:
            for corner, row in enumerate(self._outline.rows):
                if hypot(row[7] - self._cx, row[8] - self._cy) < TOUCH_M:
                    self._corner, self._cx, self._cy = corner, row[7], row[8]

    def _update_grip(self, floor: Floor) -> None:
        """Update the floor's grip on the slider; the push is along the last force, or the normal at a first touch."""
        size = hypot(self._push_x, self._push_y)
        self._cof_x, self._cof_y, self._d, self._f_max, self._grain = floor.grip(
            self.x_m, self.y_m, self._cos, self._sin, self._push_x / size, self._push_y / size
        )

    def _move(self, solution: Moving, dt_s: float) -> None:
        """Rotate and shift the slider by its twist about the centre of friction."""
        c, s = self._cos, self._sin
        cof_x = self.x_m + c * self._cof_x - s * self._cof_y + (c * solution.vx - s * solution.vy) * dt_s
        cof_y = self.y_m + s * self._cof_x + c * self._cof_y + (s * solution.vx + c * solution.vy) * dt_s
        self.heading_rad += solution.omega * dt_s
        c, s = cos(self.heading_rad), sin(self.heading_rad)
        self._cos, self._sin = c, s
        self.x_m = cof_x - (c * self._cof_x - s * self._cof_y)
        self.y_m = cof_y - (s * self._cof_x + c * self._cof_y)

    def _remove_drift(self, ball_x: float, ball_y: float) -> None:
        """Shift the slider along the normal so that the gap is 0 again; the Euler step leaves a second-order error."""
        bx, by = self._to_body(ball_x, ball_y)
        if self._corner >= 0:
            gap_x, gap_y = bx - self._cx, by - self._cy
        else:
            if self._point_on_polygon:
                nx, ny, offset, _, _, _, _, _, _ = self._outline.rows[self._face]
                out = offset - (nx * bx + ny * by)
                self._cx, self._cy = bx + out * nx, by + out * ny
            else:
                out, self._nx, self._ny, self._cx, self._cy, self._face = self._outline.nearest(bx, by, self._face)
            gap = self._radius - out
            gap_x, gap_y = gap * self._nx, gap * self._ny
        self.x_m += self._cos * gap_x - self._sin * gap_y
        self.y_m += self._sin * gap_x + self._cos * gap_y

    def _share_to_corner(self, slip: float, left_s: float) -> float:
        """Return the share of the remaining time until a point pusher slides off its face; stores the corner."""
        if not self._point_on_polygon or self._corner >= 0 or slip == 0.0:
            return 1.0
        nx, ny, _, low, high, low_x, low_y, high_x, high_y = self._outline.rows[self._face]
        u = nx * self._cy - ny * self._cx
        room = high - u if slip > 0.0 else low - u
        share = max(room / (slip * left_s), 0.0) if left_s > 0.0 else 1.0
        if share >= 1.0:
            return 1.0
        count = len(self._outline.rows)
        self._corner = self._face if slip > 0.0 else (self._face + 1) % count
        self._cx, self._cy = (high_x, high_y) if slip > 0.0 else (low_x, low_y)
        return share

    def _place_ball(self, x: float, y: float) -> None:
        """Accept a ball that was moved since the last step; an overlap pushes the slider out."""
        nearest = self._outline.nearest(*self._to_body(x, y))
        self._set_contact(nearest)
        gap = self._radius - nearest[0]
        self._touching = self._touching and gap >= -TOUCH_M
        if gap > 0.0:
            self.x_m += gap * (self._cos * self._nx - self._sin * self._ny)
            self.y_m += gap * (self._sin * self._nx + self._cos * self._ny)

    def _outcome_at_rest(self) -> ContactOutcome:
        """Return the outcome for a ball at rest: the last force is kept as long as they touch."""
        last = self._outcome
        if not self._touching or last.mode in (ContactMode.FREE, ContactMode.HOLDING):
            return last if self._touching else FREE
        return msgspec.structs.replace(last, mode=ContactMode.HOLDING)

    def _outcome_of(self, solution: Moving) -> ContactOutcome:
        c, s = self._cos, self._sin
        return ContactOutcome(
            _MODES[solution.mode],
            c * solution.fx - s * solution.fy,
            s * solution.fx + c * solution.fy,
            self.x_m + c * self._cx - s * self._cy,
            self.y_m + s * self._cx + c * self._cy,
            c * self._nx - s * self._ny,
            s * self._nx + c * self._ny,
        )

    def _to_body(self, x: float, y: float) -> tuple[float, float]:
        dx, dy = x - self.x_m, y - self.y_m
        return (self._cos * dx + self._sin * dy, self._cos * dy - self._sin * dx)


def _solver(name: str) -> ContactSolver:
    if name == "exact":
        return solve_exact
    if name == "osqp":
        from sim_backend.physics.slider_qp import QpSolver  # loads osqp and numpy: only on request

        return QpSolver()
    raise ConfigError(f"there is no solver '{name}'", do="Use 'exact' or 'osqp'")
