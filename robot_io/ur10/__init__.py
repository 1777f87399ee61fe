"""The UR10: driver, the process that holds its connection, its readiness checks, and how it is read and held."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.ur10.driver import Ur10

__all__ = ["Ur10"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "Ur10": "driver",
    },
)
