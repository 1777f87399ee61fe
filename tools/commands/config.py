"""`push config show|check`: print a rig with every value resolved, or only check whether it is valid."""

from __future__ import annotations

import argparse
import sys

import msgspec

from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.rig.config import rig_to_toml, shipped_rigs
from tools.rig import resolve_rig
from tools.terminal.arguments import name_or_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags."""
    parser.add_argument(
        "action", choices=("show", "check"), help="show: print every value; check: only report whether it is valid"
    )
    parser.add_argument(
        "rig",
        nargs="?",
        type=name_or_path,
        default="emulated",
        help=f"{', '.join(shipped_rigs())}, or a path (emulated)",
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="change one value, repeatable")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(args: argparse.Namespace) -> int:
    """Resolve the rig; return 0. Raises ConfigError (exit code 2) for an invalid one."""
    rig = resolve_rig(args.rig, args.set)
    if args.json:
        shown = {"rig": msgspec.to_builtins(rig)} if args.action == "show" else {"name": rig.name, "good": True}
        say_json({"schema": SCHEMA, **shown})
    elif args.action == "show":
        sys.stdout.write(rig_to_toml(rig))
    else:
        tell(f"{args.rig}: valid ({rig.description or rig.name})")
    return 0
