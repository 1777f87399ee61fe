"""`push watch [RIG]`: force, arm and base, live; nothing moves and nothing is changed."""

from __future__ import annotations

import argparse
from pathlib import Path

from robot_io.error_report import tell
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.rig.config import RigConfig
from tools.live.arguments import add_live_arguments
from tools.live.view import check_live, live_view
from tools.places.device_locks import FreeDevices
from tools.places.running import RunningRun
from tools.rig import devices_at, folder_of, resolve_rig
from tools.terminal.rig_arguments import add_rig
from tools.watch.find_run import run_to_watch
from tools.watch.seen import DEVICES, Seen
from tools.watch.show import Show


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push watch`."""
    add_rig(parser)
    add_live_arguments(parser)
    parser.add_argument("--json", action="store_true", help="a line of JSON five times a second")


def run(args: argparse.Namespace) -> int:
    """Show until q or Ctrl-C, or until the run that is watched has ended; return 0. Raises PushError."""
    rig = resolve_rig(args.rig, args.overrides)
    if args.live:
        check_live(args.live_port)
    found = run_to_watch(rig)
    if found is not None:
        return watch_run(args, found)
    if devices_at(rig, "sim"):
        raise UsageError(
            f"level sim has no devices, and no run of rig {rig.name!r} is under way: there is nothing to watch",
            where="push watch",
            do="Start one in another terminal, or watch the rig `emulated`",
        )
    return watch_devices(args, rig)


def watch_run(args: argparse.Namespace, found: RunningRun) -> int:
    """Show a run under way, through its log."""
    from tools.watch.attached import AttachedRun, rig_of_run

    seen = Seen(rig_of_run(found))
    with live_view(args.live_port if args.live else None) as to_view, AttachedRun(found, to_view) as attached:
        why = Show(seen, attached, f"the run in {Path(found.log).parent}", as_json=args.json).run()
    if why:
        tell(why)
    return 0


def watch_devices(args: argparse.Namespace, rig: RigConfig) -> int:
    """Open the devices and show them."""
    from tools.doctor.emulated import emulators
    from tools.live.feed import LiveFeed
    from tools.watch.live_topics import LiveTopics
    from tools.watch.own_devices import OwnDevices

    folder = folder_of(args.rig)
    with FreeDevices(rig) as free:
        if len(free.held) == len(DEVICES):
            raise EnvironmentFault(
                f"every device is in use by another program ({free.held['ft']})",
                where="push watch",
                do="Wait for it; once a run has started, `push watch` attaches to it",
            )
        with (
            live_view(args.live_port if args.live else None) as to_view,
            emulators(rig, folder, ()) as served,
            OwnDevices(served, folder, free.held) as devices,
        ):
            topics = LiveTopics(served, LiveFeed(to_view)) if to_view is not None else None
            Show(Seen(served), devices, "devices opened here", as_json=args.json, topics=topics).run()
    return 0
