"""What the emulated controller is: the models of both generations, their software, clock, kinematics and limits. Pure.

Sources: Universal Robots, "Parameters for calculations of kinematics and dynamics" (Denavit-Hartenberg), user manuals
CB3 3.15 and e-Series 5.12 (joint ranges and speeds, force sensor), dashboard server and RTDE guides (what each says).
"""

from __future__ import annotations

import math
from typing import Literal

import msgspec

Version = tuple[int, int, int, int]
Six = tuple[float, float, float, float, float, float]
Generation = Literal["CB3", "e-Series"]

ALPHA_RAD: Six = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)
"""The same for every model."""


class UrModel(msgspec.Struct, frozen=True):
    """One arm with its controller."""

    name: str
    """As on the arm: `UR10e`."""
    generation: Generation
    version: Version
    """Of PolyScope and of the controller."""
    version_date: str
    """As the dashboard gives it behind the version."""
    serial: str
    rate_hz: float
    """Control cycles, packets of RTDE and of the real-time stream in a second."""
    d_m: Six
    a_m: Six
    range_rad: Six
    """Each joint turns so far either way; infinite where it turns without end."""
    speed_rad_per_s: Six
    """The most of each joint."""
    force_range_N: float | None = None
    """Of the sensor at the flange, each axis; None: it has none, and forces are estimated from motor currents."""
    torque_range_Nm: float | None = None

    @property
    def cycle_s(self) -> float:
        """Return the length of a control cycle."""
        return 1.0 / self.rate_hz

    @property
    def dashboard_name(self) -> str:
        """Return what the dashboard answers to `get robot model`: the e of an e-Series arm is missing there."""
        return self.name.removesuffix("e")


def _cb3(name: str, d_m: Six, a_m: Six, range_rad: Six, speed_rad_per_s: Six) -> UrModel:
    version, serial = (3, 15, 8, 106339), "2015301234"
    return UrModel(name, "CB3", version, "Oct 05 2021", serial, 125.0, d_m, a_m, range_rad, speed_rad_per_s)


def _e_series(name: str, d_m: Six, a_m: Six, range_rad: Six, speed_rad_per_s: Six, force_N: float) -> UrModel:
    version, date, serial = (5, 12, 1, 1101497), "Jun 20 2022", "20225301234"
    return UrModel(
        name, "e-Series", version, date, serial, 500.0, d_m, a_m, range_rad, speed_rad_per_s, force_N, 10.0
    )  # fmt: skip


def _upper_arm(a2_m: float, a3_m: float) -> Six:
    return (0.0, a2_m, a3_m, 0.0, 0.0, 0.0)


def _d(d1_m: float, d4_m: float, d5_m: float, d6_m: float) -> Six:
    return (d1_m, 0.0, 0.0, d4_m, d5_m, d6_m)


_TURN = 2.0 * math.pi
_ALL_ONE_TURN: Six = (_TURN,) * 6
_ENDLESS_WRIST_3: Six = (_TURN,) * 5 + (math.inf,)
_HALF_TURN_A_SECOND: Six = (math.pi,) * 6
_QUICK_WRISTS: Six = (math.pi,) * 3 + (_TURN,) * 3
_SLOW_SHOULDER: Six = (_TURN / 3,) * 2 + (math.pi,) * 4

UR10 = _cb3("UR10", _d(0.1273, 0.163941, 0.1157, 0.0922), _upper_arm(-0.612, -0.5723), _ALL_ONE_TURN, _SLOW_SHOULDER)

MODELS: tuple[UrModel, ...] = (
    _cb3("UR3", _d(0.1519, 0.11235, 0.08535, 0.0819), _upper_arm(-0.24365, -0.21325), _ENDLESS_WRIST_3, _QUICK_WRISTS),
    _cb3(
        "UR5", _d(0.089159, 0.10915, 0.09465, 0.0823), _upper_arm(-0.425, -0.39225), _ALL_ONE_TURN, _HALF_TURN_A_SECOND
    ),
    UR10,
    _e_series(
        "UR3e",
        _d(0.15185, 0.13105, 0.08535, 0.0921),
        _upper_arm(-0.24355, -0.2132),
        _ENDLESS_WRIST_3,
        _QUICK_WRISTS,
        30.0,
    ),
    _e_series(
        "UR5e",
        _d(0.1625, 0.1333, 0.0997, 0.0996),
        _upper_arm(-0.425, -0.3922),
        _ALL_ONE_TURN,
        _HALF_TURN_A_SECOND,
        50.0,
    ),
    _e_series(
        "UR10e",
        _d(0.1807, 0.17415, 0.11985, 0.11655),
        _upper_arm(-0.6127, -0.57155),
        _ALL_ONE_TURN,
        _SLOW_SHOULDER,
        100.0,
    ),
    _e_series(
        "UR16e",
        _d(0.1807, 0.17415, 0.11985, 0.11655),
        _upper_arm(-0.4784, -0.36),
        _ALL_ONE_TURN,
        _SLOW_SHOULDER,
        160.0,
    ),
)
BY_NAME = {model.name.lower(): model for model in MODELS}
"""The models by what `push emulate ur --model` calls them: `ur10e`."""
