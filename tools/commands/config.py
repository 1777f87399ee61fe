"""`push config show|check|schema`: print a rig with every value resolved, check one, or print what a rig may hold."""

from __future__ import annotations

import argparse
import json
import sys

import msgspec

from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import UsageError
from robot_io.rig.config import origins_of, rig_to_toml
from robot_io.rig.files import shipped_rigs
from robot_io.rig.toml import with_origins
from tools.rig import resolve_rig
from tools.terminal.arguments import name_or_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags."""
    parser.add_argument(
        "action",
        choices=("show", "check", "schema"),
        help="show: print every value; check: only report whether it is valid; schema: a JSON Schema for editors",
    )
    parser.add_argument("rig", nargs="?", type=name_or_path, help=f"{', '.join(shipped_rigs())}, or a path (emulated)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change one value of the rig, repeatable"
    )
    parser.add_argument("--origin", action="store_true", help="show: also say where each value was written")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(args: argparse.Namespace) -> int:
    """Resolve the rig, or print the schema; return 0. Raises ConfigError (exit code 2) for an invalid rig."""
    if args.origin and args.action != "show":
        raise UsageError("--origin goes with `show` only", where=f"push config {args.action}", do="Leave it out")
    if args.action == "schema":
        return _schema(args)
    rig = resolve_rig(args.rig or "emulated", args.set)
    origins = origins_of(args.rig or "emulated", args.set) if args.origin else {}
    if args.json:
        shown = {"rig": msgspec.to_builtins(rig)} if args.action == "show" else {"name": rig.name, "good": True}
        told = {"origins": {".".join(key): where for key, where in origins.items()}} if args.origin else {}
        say_json({"schema": SCHEMA, **shown, **told})
    elif args.action == "show":
        text = rig_to_toml(rig)
        sys.stdout.write(with_origins(text, origins) if args.origin else text)
    else:
        tell(f"{args.rig or 'emulated'}: valid ({rig.description or rig.name})")
    return 0


def _schema(args: argparse.Namespace) -> int:
    from robot_io.rig.editor_schema import rig_schema

    if args.rig or args.set:
        raise UsageError("the schema is the same for every rig", where="push config schema", do="Leave the rig out")
    if args.json:
        say_json({"schema": SCHEMA, "rig_schema": rig_schema()})
    else:
        print(json.dumps(rig_schema(), indent=2))
    return 0
