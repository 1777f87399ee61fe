"""How far the force points aside at the end of a push, and how much of that the start and the tare can explain."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robot_io.rig.config import RigConfig
from robot_io.tick import Phase
from sim_backend.physics.assumed_sliders import bodies
from sim_backend.physics.gain_limits import decay_per_m
from tools.report.run_data import RunData
from tools.terminal.rig_sliders import rig_sliders

SHORTEST_M = 1.0
"""A shorter push says nothing of where it would have settled."""
LAST_SHARE = 0.25
"""The angle is the mean over this share of the push, its end."""
K = 2.0
"""Coverage of the tare's error: two standard errors."""


class ForceAngle(NamedTuple):
    """The mean angle of the force over the last `over_m` of a push (rad, left positive), and what may explain it.

    offset_rad: the angle that the offset at the end stands for, once the push has settled there.
    transient_rad: what may be left of the greatest angle before, by the slowest pole of the rig's sliders.
    tare_rad: two standard errors of the tare or what the sensor read after the push, whichever is more, at `force_N`.
    """

    seen_rad: float
    offset_rad: float
    over_m: float
    transient_rad: float
    tare_rad: float
    force_N: float

    @property
    def points_at_the_frame(self) -> bool:
        """Return whether start and tare together leave something that the sensor's mounting has to explain.

        Angle and offset have to tell of it alike: the floor alone can turn the force for a metre or two.
        """
        alike = self.seen_rad * self.offset_rad > 0.0
        return alike and min(abs(self.seen_rad), abs(self.offset_rad)) > self.transient_rad + self.tare_rad


def force_angle(run: RunData) -> ForceAngle | None:
    """Return the angle at the end of a push by the law; None where it was too short, or says nothing."""
    control = run.rig.control
    pushing = (run.ticks["phase"] == Phase.PUSH) & np.isfinite(run.ticks["theta_f"])
    along, angle = run.ticks["along_m"][pushing], run.ticks["theta_f"][pushing]
    known = np.isfinite(along)
    along, angle = along[known], angle[known]
    if control.law != "force" or not control.k_y_rad_per_m or len(along) < 2 or run.last is None:
        return None
    pushed_m = float(along[-1] - along[0])
    if pushed_m < SHORTEST_M:
        return None
    over_m = LAST_SHARE * pushed_m
    last = along >= along[-1] - over_m
    before = np.flatnonzero(~last)
    force_N = float(np.nanmedian(np.hypot(run.ticks["force_x"], run.ticks["force_y"])[pushing][known][last]))
    if not len(before) or not force_N > control.force_min_N:
        return None
    peak = before[np.argmax(np.abs(angle[before]))]
    rate = decay_per_m(bodies(rig_sliders(run.rig)), control.k_f, control.k_y_rad_per_m)
    left = math.exp(-rate * float(along[last][0] - along[peak])) * _mean_decay(rate * over_m)
    residual_N = run.last.after.control.residual_N
    tare_N = max(tare_error_newtons(run.rig), residual_N if math.isfinite(residual_N) else 0.0)
    return ForceAngle(
        seen_rad=float(np.mean(angle[last])),
        offset_rad=-run.last.after.control.end_lateral_m * control.k_y_rad_per_m / (1.0 + control.k_f),
        over_m=over_m,
        transient_rad=abs(float(angle[peak])) * left,
        tare_rad=math.atan2(tare_N, force_N),
        force_N=force_N,
    )


def tare_error_newtons(rig: RigConfig) -> float:
    """Return the uncertainty (two standard errors) of an axis of the tare (N), by the sensor's own noise."""
    facts = rig.ft.declared
    return K * max(facts.noise[:3]) / math.sqrt(max(facts.rate_hz * rig.ft.tare_s, 1.0))


def _mean_decay(exponent: float) -> float:
    """Return the mean of exp(-x) from 0 to `exponent`."""
    return (1.0 - math.exp(-exponent)) / exponent if exponent > 0 else 1.0
