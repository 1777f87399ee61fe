"""`push doctor [RIG]`: look at every device, this machine and the rig, and say what is wrong; nothing moves."""

from __future__ import annotations

import argparse

import msgspec

from robot_io.error_report import ignoring_output_errors, say_json
from robot_io.errors import DeviceError
from tools.doctor.check import SCHEMA, lines, report, summary_line
from tools.doctor.examine import examine
from tools.doctor.find import adapter_lines, adapters
from tools.places.device_locks import FreeDevices
from tools.rig import folder_of, resolve_rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push doctor`."""
    parser.add_argument("rig", nargs="?", default="emulated", help="a shipped rig or a TOML file (default: emulated)")
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE", help="one setting")
    parser.add_argument(
        "--fault",
        dest="faults",
        action="append",
        default=[],
        metavar="WORDS",
        help='what an emulated device does wrong: "ft.latency=16", "arm.protective-stop at 0 s"',
    )
    parser.add_argument("--find", action="store_true", help="list serial adapters by id instead; none is opened")
    parser.add_argument("--json", action="store_true", help="the report as one line of JSON")


def run(args: argparse.Namespace) -> int:
    """Look, print the rows; return 0 without failed ones, else 4. Raises ConfigError and UsageError of the rig."""
    if args.find:
        return find(as_json=args.json)
    rig = resolve_rig(args.rig, args.overrides)
    with FreeDevices(rig) as free:
        checks = examine(rig, folder_of(args.rig), held=free.held, faults=args.faults)
    told = report(rig.name, checks)
    with ignoring_output_errors():
        if args.json:
            say_json(told)
        else:
            print("\n".join([*lines(checks), f"{rig.name}: {summary_line(checks)}; nothing was moved"]))
    return 0 if told["ok"] else DeviceError.exit_code


def find(*, as_json: bool) -> int:
    """List the serial adapters; return 0."""
    found = adapters()
    with ignoring_output_errors():
        if as_json:
            say_json({"schema": SCHEMA, "adapters": msgspec.to_builtins(found)})
        else:
            print("\n".join(adapter_lines(found)))
    return 0
