"""UR arms of both generations: driver, the process that holds the connection, readiness checks, reading and holding."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.ur10.driver import Ur10
    from robot_io.ur10.tool_force import UrToolForce

__all__ = ["Ur10", "UrToolForce"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "Ur10": "driver",
        "UrToolForce": "tool_force",
    },
)
