"""The MCAP log: its topics and messages; writing, reading, checking and recovering it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.log.channels import CHANNELS, Kind
    from robot_io.log.mcap_log import McapLog
    from robot_io.log.mcap_read import LogMessage, LogSummary, read_log, read_summary
    from robot_io.log.mcap_recover import recover

__all__ = ["CHANNELS", "Kind", "LogMessage", "LogSummary", "McapLog", "read_log", "read_summary", "recover"]

__getattr__ = exports(
    __name__,
    {
        "CHANNELS": "channels",
        "Kind": "channels",
        "LogMessage": "mcap_read",
        "LogSummary": "mcap_read",
        "McapLog": "mcap_log",
        "read_log": "mcap_read",
        "read_summary": "mcap_read",
        "recover": "mcap_recover",
    },
)
