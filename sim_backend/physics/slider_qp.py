"""The paper's program (2) solved with OSQP, as an independent check of `slider_exact`.

Unknowns are the slip and the slider's velocity at the contact, w = A h, in the contact frame (n, t): with rows of unit
norm the program is well conditioned for every slider. One solver object is reused; every status is checked.
"""

from __future__ import annotations

from math import hypot, isfinite, sqrt

import numpy as np
import osqp
from scipy import sparse

from robot_io.errors import PushError
from sim_backend.physics.slider_exact import SEPARATING, AtRest, ContactSolution, Grain, Moving, Sliding

TOLERANCE = 1e-10
"""Residuals OSQP must reach, at unit pusher speed."""
MAX_ITERATIONS = 20_000
RHO = 10.0
"""OSQP's step size: over the paper's states it takes 76 iterations on average, 155 at worst (0.1: 464 and 11,460)."""
AT_REST = 1e-7
"""|h| at unit speed below which the slider is at rest; also the least slip that counts as sliding."""


class QpNotSolved(PushError):
    """OSQP ended with a status other than solved; its result is not used."""


class QpSolver:
    """Program (2) with one OSQP object, called like `slider_exact.solve_exact`. Raises QpNotSolved."""

    def __init__(self) -> None:
        # columns: slip, w_n, w_t; rows: w_n = v_n, slip + w_t = v_t, and the two edges of the motion cone
        rows = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 1.0, -1.0]])
        cost = sparse.csc_matrix(np.diag([2.0, 0.0, 0.0]))
        constraints = sparse.csc_matrix(rows)
        self._lower = np.array([1.0, 0.0, 0.0, 0.0])
        self._upper = np.array([1.0, 0.0, np.inf, np.inf])
        self._cone_entries = np.array([2, 3, 5, 6], dtype=np.int32)  # column-wise places of the cone rows
        self._osqp = osqp.OSQP()
        self._osqp.setup(
            cost,
            np.zeros(3),
            constraints,
            self._lower,
            self._upper,
            verbose=False,
            eps_abs=TOLERANCE,
            eps_rel=TOLERANCE,
            max_iter=MAX_ITERATIONS,
            check_termination=5,
            # no warm start and nothing that depends on time: the same problem gives the same bits
            adaptive_rho=False,
            rho=RHO,
            warm_starting=False,
        )

    def __call__(
        self,
        cx: float,
        cy: float,
        nx: float,
        ny: float,
        vx: float,
        vy: float,
        d_m: float,
        f_max_N: float,
        contact_friction: float,
        grain: Grain | None = None,
    ) -> ContactSolution:
        """Return the same as `slider_exact.solve_exact`, to about 1e-9 of the pusher's speed."""
        vn = vx * nx + vy * ny
        vt = vy * nx - vx * ny
        if vn < 0.0:
            return SEPARATING
        speed = hypot(vn, vt)
        if speed == 0.0:
            return AtRest(0.0)
        jn = cx * ny - cy * nx
        jt = cx * nx + cy * ny
        pxx, pxy, pyy = grain or (1.0, 0.0, 1.0)
        pnn = pxx * nx * nx + 2.0 * pxy * nx * ny + pyy * ny * ny
        pnt = (pyy - pxx) * nx * ny + pxy * (nx * nx - ny * ny)
        ptt = pxx * ny * ny - 2.0 * pxy * nx * ny + pyy * nx * nx
        # A^-1 by its adjugate: A = P + J J'/d^2
        dd = d_m * d_m
        ann, ant, att = pnn + jn * jn / dd, pnt + jn * jt / dd, ptt + jt * jt / dd
        det = pxx * pyy - pxy * pxy + (ptt * jn * jn - 2 * pnt * jn * jt + pnn * jt * jt) / dd
        inn, int_, itt = att / det, -ant / det, ann / det
        left_n, left_t = contact_friction * inn + int_, contact_friction * int_ + itt
        right_n, right_t = contact_friction * inn - int_, contact_friction * int_ - itt
        left, right = hypot(left_n, left_t), hypot(right_n, right_t)
        entries = np.array([right_n / right, left_n / left, right_t / right, left_t / left])
        self._lower[0] = self._upper[0] = vn / speed
        self._lower[1] = self._upper[1] = vt / speed
        self._osqp.update(l=self._lower, u=self._upper, Ax=entries, Ax_idx=self._cone_entries)
        result = self._osqp.solve(raise_error=False)
        if result.info.status_val != osqp.SolverStatus.OSQP_SOLVED or not isfinite(float(result.x[0])):
            raise QpNotSolved(f"OSQP returned '{result.info.status}' for a contact", where="slider_qp")
        slip, wn, wt = (float(v) for v in result.x)
        hn = inn * wn + int_ * wt
        ht = int_ * wn + itt * wt
        turn = (jn * hn + jt * ht) / d_m
        un, ut = pnn * hn + pnt * ht, pnt * hn + ptt * ht
        size = sqrt(max(hn * un + ht * ut, 0.0) + turn * turn)
        if size < AT_REST:
            return AtRest(slip * speed)
        mode = Sliding.STICKING if abs(slip) < AT_REST else Sliding.LEFT if slip > 0 else Sliding.RIGHT
        fn, ft = hn * f_max_N / size, ht * f_max_N / size
        un, ut = un * speed, ut * speed
        omega = turn * speed / d_m
        return Moving(
            mode, un * nx - ut * ny, un * ny + ut * nx, omega, slip * speed, fn * nx - ft * ny, fn * ny + ft * nx
        )
