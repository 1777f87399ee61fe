"""`push emulate ft300|ur|ur10|ridgeback|all`: run the wire emulators for any client, until SIGTERM or Ctrl-C.

A single device is fed by a constant source; `all` runs the three on one simulated world, and reads what a person does
to the robot by hand as JSON lines on stdin (`tools.run.emulated.hands`). Everything listens on loopback only.
One line per endpoint is printed as soon as it accepts clients.
"""

from __future__ import annotations

import argparse
import contextlib
import ipaddress
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType

from robot_io.clock import monotonic_ns
from robot_io.error_report import printable, say_json, tell
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import set_timer_slack_1ns
from robot_io.rig.declared import TOOL_FORCE
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.ft300.standalone import ConstantWrench, parse_wrench
from sim_backend.ridgeback.standalone import standalone_emulator
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.ur10.modelled import MODELLED
from sim_backend.ur10.models import BY_NAME, Version
from sim_backend.ur10.standalone import StillArm
from sim_backend.world.world import World
from tools.rig import resolve_rig
from tools.run.emulated import modelled
from tools.run.emulated.emulators import Emulator, endpoint, open_ft300, open_ridgeback, open_ur10
from tools.run.emulated.hands import Hands
from tools.terminal.arguments import SEED, name_or_path, number

ARM_HOST = "127.0.0.10"
BASE_HOST = "127.0.0.1"
BASE_PORT = 9090
"""rosbridge's own default."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the devices and their flags."""
    devices = parser.add_subparsers(dest="device", required=True, metavar="DEVICE")

    ft = devices.add_parser("ft300", help="Robotiq FT 300 on a pty", description=modelled.FT300)
    wrench = "FX,FY,FZ,MX,MY,MZ"
    ft.add_argument("--wrench", default="0,0,0,0,0,0", metavar=wrench, help="N, N*m; as in --wrench=-10,0,0,0,0,0")
    ft.add_argument(
        "--step-after-s", type=number(0, 86400), metavar="S", help="change to --step-wrench this long after the start"
    )
    ft.add_argument("--step-wrench", metavar=wrench, help="as in --step-wrench=-20,0,0,0,0,0")
    ft.add_argument("--streaming", action="store_true", help="already streaming, as after a client that crashed")
    ft.add_argument(
        "--latency-ms", type=int, choices=(0, 1, 16), default=1, help="latency timer of the USB adapter (1)"
    )
    ft.set_defaults(open_devices=_open_ft300)

    wrench_help = "what the sensor at the flange reads: N, N*m; as in --wrench=-10,0,0,0,0,0"
    ur = devices.add_parser("ur", help="UR controller (RTDE, scripts, dashboard), CB3 or e-Series, standing still")
    ur.add_argument(
        "--model", type=str.lower, choices=tuple(BY_NAME), default="ur10", help="which arm (ur10); with an e: e-Series"
    )
    ur.add_argument("--wrench", metavar=wrench, help=f"{wrench_help} (e-Series)")
    ur10 = devices.add_parser("ur10", help="the same as `ur --model ur10`")
    ur10.set_defaults(model="ur10", wrench=None)
    for arm in (ur, ur10):
        arm.description = MODELLED
        arm.add_argument(
            "--polyscope", type=_polyscope, metavar="VERSION", help="another software than the model's, as in 3.4"
        )
        arm.add_argument(
            "--host", type=_loopback, default=ARM_HOST, help=f"127.x.y.z ({ARM_HOST}); one robot per address"
        )
        arm.set_defaults(open_devices=_open_ur)

    base = devices.add_parser("ridgeback", help="Ridgeback behind a rosbridge server", description=modelled.RIDGEBACK)
    base.add_argument("--host", type=_loopback, default=BASE_HOST, help=f"127.x.y.z ({BASE_HOST})")
    base.add_argument("--port", type=_port, default=BASE_PORT, help=f"0 picks a free one ({BASE_PORT})")
    base.set_defaults(open_devices=_open_ridgeback)

    everything = devices.add_parser(
        "all", help="all three on one simulated world; stdin takes what hands do, as JSON lines"
    )
    everything.add_argument(
        "rig", nargs="?", type=name_or_path, default="emulated", help="whose world: a shipped name or a path (emulated)"
    )
    everything.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change one value of the rig, repeatable"
    )
    everything.add_argument("--seed", type=SEED, metavar="SEED", default=0, help="varies the start and the noise (0)")
    everything.add_argument("--arm-host", type=_loopback, default=ARM_HOST, help=f"127.x.y.z ({ARM_HOST})")
    everything.add_argument("--base-host", type=_loopback, default=BASE_HOST, help=f"127.x.y.z ({BASE_HOST})")
    everything.add_argument("--base-port", type=_port, default=BASE_PORT, help=f"0 picks a free one ({BASE_PORT})")
    everything.set_defaults(open_devices=_open_all)

    for device in (ft, ur, ur10, base, everything):
        device.add_argument("--json", action="store_true", help="one JSON line per endpoint on stdout")


def run(args: argparse.Namespace) -> int:
    """Serve until SIGTERM or SIGINT; return 0. Raises UsageError, ConfigError, EnvironmentFault (address taken)."""
    set_timer_slack_1ns()
    loop = EventLoop()
    with contextlib.closing(loop), contextlib.ExitStack() as opened:
        opened.enter_context(stopped_by_signals(loop))
        for emulator in args.open_devices(loop, args, opened):
            where = endpoint(emulator)
            if args.json:
                say_json(where)
            else:
                print("  ".join(where.values()), flush=True)
        loop.run()
    return 0


@contextlib.contextmanager
def stopped_by_signals(loop: EventLoop) -> Iterator[None]:
    """Make SIGTERM and SIGINT end `loop.run()`.

    A handler alone would not: Python resumes the wait after it. The wake-up pipe wakes the loop.
    """
    read_end, write_end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signals = (signal.SIGTERM, signal.SIGINT)
    before_fd = signal.set_wakeup_fd(write_end)  # first: a signal between the two calls would be lost
    before = [signal.signal(number, _note) for number in signals]
    loop.add_fd(read_end, lambda _: loop.stop())
    try:
        yield
    finally:
        loop.remove_fd(read_end)
        signal.set_wakeup_fd(before_fd)
        for number, handler in zip(signals, before, strict=True):
            signal.signal(number, handler)
        os.close(read_end)
        os.close(write_end)


def _note(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: the byte in the wake-up pipe is the event."""


def _open_ft300(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Emulator]:
    step_wrench = parse_wrench(args.step_wrench) if args.step_wrench is not None else None
    source = ConstantWrench(parse_wrench(args.wrench), step_after_s=args.step_after_s, step_wrench=step_wrench)
    emulator = Ft300Emulator(loop, source, latency_ms=args.latency_ms, streaming=args.streaming)
    opened.callback(emulator.close)
    emulator.start()
    return [emulator]


def _open_ur(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Emulator]:
    model = BY_NAME[args.model]
    if args.wrench is not None and model.force_range_N is None:
        raise UsageError(
            f"a {model.name} has no force sensor", where="--wrench", do="Give an e-Series arm: --model ur10e"
        )
    version = args.polyscope
    if version is not None and (version[0] >= 5) != (model.generation == "e-Series"):
        raise UsageError(
            f"a {model.name} has no PolyScope {version[0]}", where="--polyscope",
            do="Give 3.0 or later for a CB3 arm, 5.0 or later for an e-Series one",
        )  # fmt: skip
    wrench = None if model.force_range_N is None else ConstantWrench(parse_wrench(args.wrench or "0,0,0,0,0,0"))
    with _elsewhere("--host 127.x.y.z"):
        emulator = UrEmulator(loop, StillArm(), host=args.host, model=model, version=version, wrench=wrench, warn=_warn)
    opened.callback(emulator.close)
    return [emulator]


def _open_ridgeback(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Emulator]:
    with _elsewhere("--host 127.x.y.z or --port"):
        emulator = standalone_emulator(loop, host=args.host, port=args.port)
    opened.callback(emulator.close)
    return [emulator]


def _open_all(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Emulator]:
    rig = resolve_rig(args.rig, args.set)
    world = World(rig, args.seed, monotonic_ns())
    emulators: list[Emulator] = []
    for open_device, options in (
        (lambda: open_ft300(loop, world, rig), ""),
        (lambda: open_ur10(loop, world, rig, (args.arm_host,), _warn), "--arm-host 127.x.y.z"),
        (
            lambda: open_ridgeback(loop, world, rig, args.base_host, args.base_port),
            "--base-host 127.x.y.z or --base-port",
        ),
    )[rig.ft.kind == TOOL_FORCE :]:  # then the arm is the sensor
        with _elsewhere(options):
            emulators.append(open_device())
        opened.callback(emulators[-1].close)
    if sys.stdin is not None:
        Hands(loop, sys.stdin.fileno(), world, lambda words: tell(printable(f"push: {words}")))
    return emulators


@contextlib.contextmanager
def _elsewhere(options: str) -> Iterator[None]:
    """Name, where an emulator cannot listen, the options that give it another address."""
    try:
        yield
    except EnvironmentFault as error:
        if options:
            error.do = f"End what runs there, or give another address: {options}"
        raise


def _loopback(text: str) -> str:
    """Return `text` if it is an IPv4 loopback address. Raises UsageError otherwise."""
    try:
        loopback = ipaddress.IPv4Address(text).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        raise UsageError(
            f"{text!r} is not a loopback address", where="command line", do="The emulators listen on 127.x.y.z only"
        )
    return text


def _polyscope(text: str) -> Version:
    """Return the version in `3.4` or `5.12.1`. Raises UsageError for anything else."""
    parts = text.split(".")
    if not 2 <= len(parts) <= 4 or not all(part.isascii() and part.isdigit() for part in parts) or parts[0] not in "35":
        raise UsageError(f"{text!r} is no PolyScope version", where="command line", do="Give one as in 3.4 or 5.12.1")
    major, minor, bugfix, build = (*map(int, parts), 0, 0, 0)[:4]
    return (major, minor, bugfix, build)


def _warn(words: str) -> None:
    tell(printable(f"push: {words}"))


def _port(text: str) -> int:
    """Return a TCP port number. Raises UsageError for anything else."""
    if not (text.isascii() and text.isdigit() and int(text) <= 65535):
        raise UsageError(f"{text!r} is not a TCP port", where="command line", do="Give 0..65535")
    return int(text)
