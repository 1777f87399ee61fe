"""The Clearpath Ridgeback over rosbridge: driver, codec, feeds, preflight and websocket link."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.ridgeback.driver import Ridgeback

__all__ = ["Ridgeback"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "Ridgeback": "driver",
    },
)
