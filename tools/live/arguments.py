"""The options of the live view, for each command that has one."""

from __future__ import annotations

import argparse

from tools.live.view import PORT
from tools.terminal.arguments import whole_number


def add_live_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare `--live` and `--live-port`."""
    parser.add_argument(
        "--live", action="store_true", help="serve it to Foxglove or Lichtblick on this machine (extra `live`)"
    )
    parser.add_argument(
        "--live-port",
        type=whole_number(1, 65535),
        default=PORT,
        metavar="PORT",
        help=f"port of --live on 127.0.0.1 ({PORT})",
    )
