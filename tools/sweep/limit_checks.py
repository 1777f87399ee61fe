"""Check the closed-form limits of gains by simulation, for the sliders that bind them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from sim_backend.physics.gain_limits import (
    PushedBody,
    frictionless_integral_limit,
    frictionless_limit,
    sticking_integral_limit,
    sticking_limit,
)
from tools.sweep.gain_check import simulated_integral_limit, simulated_limit


def check_limits(bodies: Sequence[PushedBody], k_f: float) -> list[dict[str, Any]]:
    """Simulate the limiting slider of each formula; return both limits and their relative difference."""
    formulas: dict[str, Callable[[PushedBody, float], float]] = {
        "sticking": sticking_limit,
        "frictionless": frictionless_limit,
    }
    found = []
    for shape, chosen in (("box", [b for b in bodies if not b.round]), ("circle", [b for b in bodies if b.round])):
        for contact, formula in formulas.items() if chosen else ():
            body = min(chosen, key=partial(_limit_at, formula, k_f))
            expected = formula(body, k_f)
            simulated = simulated_limit(body, k_f, frictionless=contact == "frictionless", near=expected)
            found.append(
                {
                    "shape": shape,
                    "contact": contact,
                    "rho_m": body.rho_m,
                    "d_m": body.d_m,
                    "closed_form_k_y": expected,
                    "simulated_k_y": simulated,
                    "difference": simulated / expected - 1,
                }
            )
    return found


def check_integral_limits(bodies: Sequence[PushedBody], k_f: float, k_y: float) -> list[dict[str, Any]]:
    """Simulate the slider that limits the integral in each kind of contact, as `check_limits` does for k_y."""
    formulas = {"sticking": sticking_integral_limit, "frictionless": frictionless_integral_limit}
    found = []
    for contact, formula in formulas.items():
        expected, body = min(((formula(one, k_f, k_y), one) for one in bodies), key=lambda pair: pair[0])
        simulated = simulated_integral_limit(body, k_f, k_y, frictionless=contact == "frictionless", near=expected)
        found.append(
            {
                "shape": "circle" if body.round else "box",
                "contact": f"{contact}, with integral",
                "rho_m": body.rho_m,
                "d_m": body.d_m,
                "closed_form_k_i": expected,
                "simulated_k_i": simulated,
                "difference": simulated / expected - 1,
            }
        )
    return found


def _limit_at(formula: Callable[[PushedBody, float], float], k_f: float, body: PushedBody) -> float:
    return formula(body, k_f)
