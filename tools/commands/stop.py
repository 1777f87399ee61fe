"""`push stop [RIG]`: stop the runs under way, or, where a named rig has none, send its base zeros."""

from __future__ import annotations

import argparse
import math
import signal
import time

from robot_io.driver import Base
from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import DeviceUnreachable
from robot_io.kinds import build_driver
from robot_io.messages import BaseOdometry, BodyTwist
from robot_io.rig.config import RigConfig
from robot_io.tick import REST_M_PER_S, REST_NS
from tools.kinds import is_shipped
from tools.places.device_locks import resources_of
from tools.places.running import RunningRun, running_runs
from tools.rig import devices_at, folder_of, resolve_rig
from tools.terminal.arguments import name_or_path

STOPS_WITHIN_S = 4.0
"""A run that was asked to stop: at most 1.5 s until it calls its base at rest, and its processes end."""
KILLED_WITHIN_S = 2.0
RESTS_WITHIN_S = 5.0
PERIOD_S = 0.02
MOVERS = ("control", "gate")
"""The processes without which nothing of a run moves the base."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags."""
    parser.add_argument(
        "rig", nargs="?", type=name_or_path, help="only runs of this rig or with its devices: a name or a path (all)"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change one value of the rig, repeatable"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(args: argparse.Namespace) -> int:
    """Stop; return 0 when all is at rest. Raises DeviceUnreachable (exit code 4) when that is not known."""
    rig = resolve_rig(args.rig, args.set) if args.rig else None
    runs = [found for found in running_runs() if rig is None or _concerns(found, rig)]
    for found in runs:
        tell(f"stopping the run of rig {found.rig!r} ({', '.join(found.alive())})")
    stop_runs(runs)
    zeros = False
    if not runs and rig is not None and "base" in devices_at(rig, "hardware"):
        tell(f"no run of rig {rig.name!r} is under way: connecting to {rig.base.url} and sending zeros")
        send_zeros(rig, folder_of(args.rig))
        zeros = True
    elif not runs:
        tell("no run is under way")
    if runs or zeros:
        tell("at rest")
    if args.json:
        say_json({"schema": SCHEMA, "stopped": [found.rig for found in runs], "zeros_sent": zeros, "at_rest": True})
    return 0


def _concerns(found: RunningRun, rig: RigConfig) -> bool:
    keys = {resource.key for resource in resources_of(rig)}
    return found.rig == rig.name or not keys.isdisjoint(found.devices)


def stop_runs(runs: list[RunningRun]) -> None:
    """Ask the runs to stop, kill the control of those that do not: their gates then send zeros and end.

    Raises DeviceUnreachable if a gate or control still runs after that.
    """
    for found in runs:
        for name in ("launcher", "control"):  # both, for either may be frozen
            if name in found.processes:
                found.processes[name].signal(signal.SIGTERM)
    if _ended(runs, STOPS_WITHIN_S):
        return
    for found in runs:
        if "control" in found.processes:
            found.processes["control"].signal(signal.SIGKILL)
    if not _ended(runs, KILLED_WITHIN_S):
        left = [f"{name} {found.processes[name].pid}" for found in runs for name in MOVERS if name in found.alive()]
        raise DeviceUnreachable(
            f"still alive: process {', '.join(left)}", do="Press the base's stop button, then kill the process"
        )


def _ended(runs: list[RunningRun], within_s: float) -> bool:
    deadline_s = time.monotonic() + within_s
    while any(name in found.alive() for found in runs for name in MOVERS):
        if time.monotonic() > deadline_s:
            return False
        time.sleep(PERIOD_S)
    return True


def send_zeros(rig: RigConfig, folder: str) -> None:
    """Send the base zeros until its odometry shows rest. Raises DeviceError, and DeviceUnreachable if it shows none."""
    options = {
        "topics": rig.base.topics,
        "pose_source": rig.base.pose_source,
        "base_from_marker": rig.frames.base_from_marker,
        **rig.base.options,
    }
    base: Base = build_driver("base", rig.base.kind, rig.base.url, options, folder=folder)
    try:
        base.open()
        if not is_shipped("base", rig.base.kind):
            base.start()
        _until_rest(base, rig)
    finally:
        base.stop()
        base.close()


def _until_rest(base: Base, rig: RigConfig) -> None:
    # A Ridgeback takes zeros before it has started, and its start would wait for a pose that a stop does not need.
    send = base.stop if is_shipped("base", rig.base.kind) else lambda: base.command(BodyTwist())
    deadline_s = time.monotonic() + RESTS_WITHIN_S
    rest_ns, heard = 0, False
    while time.monotonic() < deadline_s:
        send()
        for sample in base.drain():
            if isinstance(sample.value, BaseOdometry):
                heard = True
                twist = sample.value.twist
                moving = not math.hypot(twist.vx, twist.vy) < REST_M_PER_S  # also where it is not a number
                rest_ns = 0 if moving else rest_ns or sample.received_ns
                if rest_ns and sample.received_ns - rest_ns >= REST_NS:
                    return
        time.sleep(PERIOD_S)
    what = "its odometry still shows motion" if heard else "it sends no odometry"
    raise DeviceUnreachable(
        f"zeros were sent for {RESTS_WITHIN_S:g} s, and {what}", where=rig.base.url, do="Press the base's stop button"
    )
