"""Define the paper's simulation study: Table I, 2 x 243 pushes of ten simulated minutes.

Source: Heins & Schoellig, "Robust Single-Point Pushing with Force Feedback", section IV and Table I.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from tools.sweep.grid import Case, Study, TimeTable, product, timing_of

SAMPLE_START = {"y0_m": -0.4, "phi0_rad": -math.pi / 8, "s0_m": -0.4, "pressure": "uniform"}
"""Start of the paper's four sample trajectories; each shape with contact friction 0 and 1."""


def paper_study(changes: Mapping[str, Any], dt_s: float | None = None) -> Study:
    """Return Table I ordered by shape, tau_max, mu, y0, phi0, s0, with `changes` (gains, controller) in all cases."""
    cases = tuple(
        msgspec.convert({**combination, **changes}, Case)
        for combination in product(
            shape=("square", "circle"),
            pressure=("point", "uniform", "rim"),
            contact_friction=(0.0, 0.5, 1.0),
            y0_m=(-0.4, 0.0, 0.4),
            phi0_rad=(-math.pi / 8, 0.0, math.pi / 8),
            s0_m=(-0.4, 0.0, 0.4),
        )
    )
    return Study("paper", cases, timing_of(TimeTable(), dt_s))


def sample_cases(cases: Sequence[Case]) -> list[int]:
    """Return the indices of the cases shown in the paper's figure of four samples."""
    return [
        i
        for i, case in enumerate(cases)
        if case.contact_friction in (0.0, 1.0)
        and all(getattr(case, name) == value for name, value in SAMPLE_START.items())
    ]
