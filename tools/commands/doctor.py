"""`push doctor [RIG]`: look at every device, this machine and the rig, and say what is wrong; nothing moves unasked."""

from __future__ import annotations

import argparse

import msgspec

from robot_io.error_report import ignoring_output_errors, say_json
from robot_io.errors import DeviceError, UsageError
from robot_io.ft300.adapters import adapters
from robot_io.rig.config import RigConfig
from tools.doctor.check import SCHEMA, Check, lines, report, summary_line
from tools.doctor.examine import looked_at
from tools.doctor.find import adapter_lines
from tools.places.device_locks import FreeDevices
from tools.rig import folder_of, resolve_rig
from tools.terminal.rig_arguments import add_faults, add_rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push doctor`."""
    add_rig(parser)
    add_faults(parser, 'what an emulated device does wrong: "ft.latency=16", "arm.protective-stop at 0 s"')
    parser.add_argument(
        "--prove-base-timeout",
        action="store_true",
        help="also drive the base 2 cm, fall silent, and measure its stop; needs --move-robot",
    )
    parser.add_argument(
        "--move-robot", action="store_true", help="needed for --prove-base-timeout, and for nothing else"
    )
    parser.add_argument("--find", action="store_true", help="list serial adapters by id instead; none is opened")
    parser.add_argument("--json", action="store_true", help="the report as one line of JSON")


def run(args: argparse.Namespace) -> int:
    """Look, print the rows; return 0 without failed ones, else 4. Raises ConfigError and UsageError of the rig."""
    if args.find:
        return find(as_json=args.json)
    rig = resolve_rig(args.rig, args.overrides)
    check_flags(args, rig)
    checks: list[Check] = []
    with FreeDevices(rig) as free:
        looked = looked_at(rig, folder_of(args.rig), held=free.held, faults=args.faults, prove=args.prove_base_timeout)
        for check in looked:
            checks.append(check)
            with ignoring_output_errors():
                if not args.json:
                    print("\n".join(lines([check])), flush=True)
    told = report(rig.name, checks)
    with ignoring_output_errors():
        if args.json:
            say_json(told)
        else:
            moved = "the base was moved" if args.prove_base_timeout else "nothing was moved"
            print(f"{rig.name}: {summary_line(checks)}; {moved}")
    return 0 if told["ok"] else DeviceError.exit_code


def check_flags(args: argparse.Namespace, rig: RigConfig) -> None:
    """Raise UsageError for a proof that may not be made; nothing has been opened yet."""
    if not args.prove_base_timeout:
        return
    if rig.base.level == "sim":
        raise UsageError("level sim has no base to prove anything of", where="push doctor", do="Use `emulated`")
    if not args.move_robot:
        raise UsageError(
            "--prove-base-timeout drives the base 2 cm",
            where="push doctor",
            do="Clear the floor, hold the e-stop, and add --move-robot",
        )


def find(*, as_json: bool) -> int:
    """List the serial adapters; return 0."""
    found = adapters()
    with ignoring_output_errors():
        if as_json:
            say_json({"schema": SCHEMA, "adapters": msgspec.to_builtins(found)})
        else:
            print("\n".join(adapter_lines(found)))
    return 0
