"""What a log of this program holds: its topics, messages, format, seal and chain; recovery of a truncated one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.log.channels import CHANNELS, Kind
    from robot_io.log.recovery import recover

__all__ = ["CHANNELS", "Kind", "recover"]

__getattr__, __dir__ = exports(__name__, {"CHANNELS": "channels", "Kind": "channels", "recover": "recovery"})
