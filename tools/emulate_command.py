"""`push emulate ft300|ur10|ridgeback|all`: the wire emulators alone, for any client, until SIGTERM or Ctrl-C.

Alone, a device is fed by a constant source; `all` puts the three on one simulated world. Everything listens
on loopback only. One line per endpoint says where, as soon as clients are accepted there.
"""

from __future__ import annotations

import argparse
import contextlib
import ipaddress
import os
import signal
from collections.abc import Iterator
from types import FrameType

from robot_io.error_report import say_json
from robot_io.errors import UsageError
from robot_io.event_loop import EventLoop
from robot_io.process import set_timer_slack_1ns
from sim_backend.plant import ArmSource, FtSource

Endpoint = dict[str, str]
ARM_HOST = "127.0.0.10"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the devices and their flags."""
    devices = parser.add_subparsers(dest="device", required=True, metavar="DEVICE")

    ft = devices.add_parser("ft300", help="Robotiq FT 300 on a pty", allow_abbrev=False)
    wrench = "FX,FY,FZ,MX,MY,MZ"
    ft.add_argument("--wrench", default="0,0,0,0,0,0", metavar=wrench, help="N, N*m; as in --wrench=-10,0,0,0,0,0")
    ft.add_argument("--step-after-s", type=float, metavar="S", help="change to --step-wrench this long after the start")
    ft.add_argument("--step-wrench", metavar=wrench, help="as in --step-wrench=-20,0,0,0,0,0")
    ft.add_argument("--streaming", action="store_true", help="found streaming, as after a client that crashed")
    ft.add_argument("--latency-ms", type=int, choices=(0, 1, 16), default=1, help="latency timer of the adapter (1)")
    ft.set_defaults(open_devices=_open_ft300)

    ur = devices.add_parser(
        "ur10", help="UR10 controller (RTDE, scripts, dashboard) standing still", allow_abbrev=False
    )
    ur.add_argument("--host", type=_loopback, default=ARM_HOST, help=f"127.x.y.z ({ARM_HOST}); one robot per address")
    ur.set_defaults(open_devices=_open_ur10)

    for device in (ft, ur):
        device.add_argument("--json", action="store_true", help="one JSON line per endpoint on stdout")


def run(args: argparse.Namespace) -> int:
    """Serve until SIGTERM or SIGINT; return 0. UsageError for an address that is not loopback, else DeviceError."""
    set_timer_slack_1ns()
    loop = EventLoop()
    with contextlib.closing(loop), contextlib.ExitStack() as opened:
        opened.enter_context(stopped_by_signals(loop))
        for endpoint in args.open_devices(loop, args, opened):
            if args.json:
                say_json(endpoint)
            else:
                device, where = endpoint.values()
                print(f"{device:<10} {where}", flush=True)
        loop.run()
    return 0


@contextlib.contextmanager
def stopped_by_signals(loop: EventLoop) -> Iterator[None]:
    """Make SIGTERM and SIGINT end `loop.run()`.

    A handler alone would not: Python goes back into the wait after it. The wake-up pipe makes the loop ready.
    """
    read_end, write_end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signals = (signal.SIGTERM, signal.SIGINT)
    before = [signal.signal(number, _note) for number in signals]
    before_fd = signal.set_wakeup_fd(write_end)
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
    """Do nothing: the byte in the wake-up pipe does it."""


def _open_ft300(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Endpoint]:
    from sim_backend.ft300_standalone import ConstantWrench, parse_wrench

    step_wrench = parse_wrench(args.step_wrench) if args.step_wrench is not None else None
    source = ConstantWrench(parse_wrench(args.wrench), step_after_s=args.step_after_s, step_wrench=step_wrench)
    return [_serve_ft300(loop, source, opened, latency_ms=args.latency_ms, streaming=args.streaming)]


def _open_ur10(loop: EventLoop, args: argparse.Namespace, opened: contextlib.ExitStack) -> list[Endpoint]:
    from sim_backend.ur_standalone import StillArm

    return [_serve_ur10(loop, StillArm(), opened, host=args.host)]


def _serve_ft300(
    loop: EventLoop, source: FtSource, opened: contextlib.ExitStack, *, latency_ms: int, streaming: bool
) -> Endpoint:
    from sim_backend.ft300_emulator import Ft300Emulator

    emulator = Ft300Emulator(loop, source, latency_ms=latency_ms, streaming=streaming)
    opened.callback(emulator.close)
    emulator.start()
    return {"device": "ft300", "port": emulator.port}


def _serve_ur10(loop: EventLoop, source: ArmSource, opened: contextlib.ExitStack, *, host: str) -> Endpoint:
    from sim_backend.ur_emulator import UrEmulator

    emulator = UrEmulator(loop, source, host=host)
    opened.callback(emulator.close)
    return {"device": "ur10", "host": emulator.host}


def _loopback(text: str) -> str:
    """Return `text` when it is an IPv4 loopback address; UsageError otherwise."""
    try:
        loopback = ipaddress.IPv4Address(text).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        raise UsageError(
            f"{text!r} is not a loopback address", where="command line", do="The emulators listen on 127.x.y.z only"
        )
    return text
