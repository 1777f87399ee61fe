"""MCAP files, ours and those of others: writing, reading and checking them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.mcap.log_file import McapLog
    from robot_io.mcap.read import LogMessage, LogSummary, read_log, read_summary

__all__ = ["LogMessage", "LogSummary", "McapLog", "read_log", "read_summary"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "LogMessage": "read",
        "LogSummary": "read",
        "McapLog": "log_file",
        "read_log": "read",
        "read_summary": "read",
    },
)
