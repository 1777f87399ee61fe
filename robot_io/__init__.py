"""Drivers of the FT 300, the UR10 and the Ridgeback, their messages, the rig file and the log.

    from robot_io import Ft300, Ridgeback, Ur10

Each driver is usable on its own; nothing here imports another package of the project. Names are imported when they are
first used, so that a program pays only for the devices it opens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io import errors, messages
    from robot_io.ft300.driver import Ft300
    from robot_io.kinds import open_device
    from robot_io.ridgeback.driver import Ridgeback
    from robot_io.ur10.driver import Ur10

__version__ = "0.1.0"
__all__ = ["Ft300", "Ridgeback", "Ur10", "errors", "messages", "open_device"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "Ft300": "ft300.driver",
        "Ridgeback": "ridgeback.driver",
        "Ur10": "ur10.driver",
        "errors": "",
        "messages": "",
        "open_device": "kinds",
    },
)
