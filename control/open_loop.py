"""The baseline of the paper's experiment: straight along the path, regardless of the force."""

from __future__ import annotations


def push_angle() -> float:
    """Return theta_p = 0: along the path."""
    return 0.0
