"""The Robotiq FT 300: driver, stream codec, Modbus registers and the links it is reached by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.ft300.driver import Ft300, Ft300Reading

__all__ = ["Ft300", "Ft300Reading"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "Ft300": "driver",
        "Ft300Reading": "driver",
    },
)
