"""`push calibrate WHAT [RIG]`: measure a constant of a rig, with its uncertainty, and write it for the rig to include.

Nothing is moved by this program: the operator presses, pulls, moves the arm by hand and drives with the joystick.
"""

from __future__ import annotations

import argparse

from robot_io.error_report import ignoring_output_errors, say_json
from robot_io.errors import UsageError
from tools.calibrate.estimators.estimate import Estimate
from tools.calibrate.force import measure_bias, measure_cord, measure_sign, measure_weight
from tools.calibrate.logs import measure_from_logs
from tools.calibrate.outcome import as_json, lines, saved
from tools.calibrate.places import (
    measure_contact_by_marker,
    measure_contact_by_plumb,
    measure_marker,
    measure_path,
)
from tools.calibrate.session import Session, open_session
from tools.places.apply_fragment import check_own
from tools.rig import resolve_rig
from tools.terminal.arguments import SEED, named_path, number
from tools.terminal.rig_arguments import add_rig

DIRECTIONS = "0,120,240"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what can be measured, and the flags of each."""
    whats = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
    bias = whats.add_parser("bias", help="the sensor's bias and its drift, at rest; kept as the saved tare")
    bias.add_argument("--seconds", type=number(10, 600), default=60.0, metavar="S", help="how long (60)")
    whats.add_parser("sign", help="which way round the sensor is mounted, by three presses of a hand")
    frame = whats.add_parser("frame", help="how the sensor is turned: by a cord, the tool's weight, or logs")
    ways = frame.add_mutually_exclusive_group(required=True)
    ways.add_argument(
        "--cord",
        type=angles,
        nargs="?",
        const=angles(DIRECTIONS),
        metavar="DEG,DEG,...",
        help=f"yaw, by a cord pulled along marks on the floor: degrees counter-clockwise from ahead ({DIRECTIONS})",
    )
    ways.add_argument("--weight", action="store_true", help="tilt, by the tool's weight in poses of the arm")
    ways.add_argument(
        "--from", dest="logs", type=named_path, nargs="+", metavar="LOG", help="yaw, by the ends of 15 m of pushes"
    )
    frame.add_argument(
        "--marking-deg", type=number(0.05, 2), default=0.3, metavar="DEG", help="how exact the marks are, 1 sigma (0.3)"
    )
    contact = whats.add_parser("contact", help="where the ball is: by base.topics.ball_pose, else by plumb lines")
    contact.add_argument(
        "--marking-mm", type=number(0.2, 10), default=1.0, metavar="MM", help="how exact plumbing is, 1 sigma (1)"
    )
    whats.add_parser("marker", help="where motion capture's frame is on the base, by a drive with the joystick")
    path = whats.add_parser("path", help="origin and direction of the path, from where the base stands")
    path.add_argument("--two-places", action="store_true", help="direction by a second place farther along")
    for what in whats.choices.values():
        _common(what)


def _common(parser: argparse.ArgumentParser) -> None:
    add_rig(parser)
    parser.add_argument("--out", type=named_path, metavar="FILE", help="where to write (calibration/WHAT-DATE.toml)")
    parser.add_argument("--apply", type=named_path, metavar="RIG", help="let this rig file include it; keeps RIG.bak")
    parser.add_argument("--rehearse", action="store_true", help="emulated only: a rehearsed person does what is asked")
    parser.add_argument("--seed", type=SEED, default=0, metavar="SEED", help="varies the rehearsal (0)")
    parser.add_argument("--json", action="store_true", help="the result as one line of JSON")


def angles(text: str) -> tuple[float, ...]:
    """Return the directions in a text such as 0,120,240. Raises ArgumentTypeError for anything else."""
    read = number(-360, 360)
    try:
        return tuple(read(word) for word in text.split(","))
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"`{text}` is not directions such as {DIRECTIONS} (the rig comes before --cord)"
        ) from None


def run(args: argparse.Namespace) -> int:
    """Measure, write and tell; return 0. Raises UsageError, ConfigError, DeviceError and EnvironmentFault."""
    rig = resolve_rig(args.rig, args.overrides)
    if args.apply is not None:
        check_own(args.apply)
    if args.out is not None and args.out.exists():
        raise UsageError("there is a file of this name already", where=str(args.out), do="Give another `--out`")
    logs = getattr(args, "logs", None) or []
    raw = None
    if logs:
        found = measure_from_logs(rig, logs)
    else:
        rehearsal = args.seed if args.rehearse else None
        with open_session(rig, args.rig, args.overrides, what=args.what, rehearsal=rehearsal) as here:
            found, raw = measure(args, here), here.raw
    written = saved(found, rig, raw, args.out, args.apply)
    with ignoring_output_errors():
        if args.json:
            say_json(as_json(found, written, logs))
        else:
            print("\n".join(lines(found, written, args.apply)))
    return 0


def measure(args: argparse.Namespace, here: Session) -> Estimate:
    """Measure what was asked for."""
    match args.what:
        case "bias":
            return measure_bias(here, args.seconds)
        case "sign":
            return measure_sign(here)
        case "frame":
            return measure_cord(here, args.cord, args.marking_deg) if args.cord else measure_weight(here)
        case "contact" if here.rig.base.topics.ball_pose:
            return measure_contact_by_marker(here)
        case "contact":
            return measure_contact_by_plumb(here, args.marking_mm / 1000.0)
        case "marker":
            return measure_marker(here)
    return measure_path(here, two_places=args.two_places)
