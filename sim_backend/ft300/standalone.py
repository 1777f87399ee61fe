"""A constant wrench for an FT 300 emulator running alone, with one optional step; no noise, no bias."""

from __future__ import annotations

import math

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import UsageError
from robot_io.messages import Vector6

ZERO: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LARGEST_FORCE_N = 327.67
LARGEST_TORQUE_NM = 32.767
"""The range of the wire's int16."""


class ConstantWrench:
    """An `FtSource`: `wrench` (N, N*m, SENSOR frame), then `step_wrench` from `step_after_s` after `started_ns` on."""

    def __init__(
        self,
        wrench: Vector6 = ZERO,
        *,
        step_after_s: float | None = None,
        step_wrench: Vector6 | None = None,
        started_ns: int | None = None,
    ) -> None:
        if (step_after_s is None) != (step_wrench is None):
            raise UsageError("a step needs both its time and its wrench", do="Give --step-after-s and --step-wrench")
        step_ns = math.inf if step_after_s is None else step_after_s * NS_PER_S
        if step_after_s is not None and not 0.0 <= step_ns < math.inf:
            raise UsageError(
                f"a step after {step_after_s} s is impossible", do="Give seconds from the start, 0 or more"
            )
        self._wrench = wrench
        self._step_wrench = step_wrench or wrench
        start_ns = monotonic_ns() if started_ns is None else started_ns
        self._step_ns = start_ns + step_ns

    def read_ft(self, t_ns: int) -> Vector6:
        """Return the wrench at `t_ns`."""
        return self._wrench if t_ns < self._step_ns else self._step_wrench


def parse_wrench(text: str) -> Vector6:
    """Return "fx,fy,fz,mx,my,mz" (N, N*m) as numbers. Raises UsageError for anything the wire cannot carry."""
    help_text = f"Give six numbers fx,fy,fz,mx,my,mz: forces up to {LARGEST_FORCE_N} N, torques {LARGEST_TORQUE_NM} N*m"
    try:
        fx, fy, fz, mx, my, mz = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{text!r} is not a wrench", do=help_text) from None
    forces_fit = all(abs(value) <= LARGEST_FORCE_N for value in (fx, fy, fz))
    if not (forces_fit and all(abs(value) <= LARGEST_TORQUE_NM for value in (mx, my, mz))):
        raise UsageError(f"{text!r} is beyond what the sensor can report", do=help_text)
    return fx, fy, fz, mx, my, mz
