"""`push view LOG`: write layouts for the viewers of logs, and open the log in one that is installed."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from robot_io.error_report import SCHEMA, say_json, tell
from robot_io.errors import EnvironmentFault
from robot_io.mcap.read import read_summary
from tools.places.atomic_file import write_atomically
from tools.places.find_log import find_log
from tools.terminal.arguments import named_path
from tools.view import lichtblick
from tools.view.panels import SIGNALS_TOPIC
from tools.view.viewers import PROGRAMS, Layouts, by_hand, find_viewer, has_display, open_log

_BLUEPRINT = Path(lichtblick.__file__).with_name("push.rbl")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `push view`."""
    parser.add_argument("log", type=named_path, help="run.mcap, or a run's folder")
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for the layouts (default: view, beside the log)"
    )
    parser.add_argument("--json", action="store_true", help="write only, and say where, as one line of JSON on stdout")


def run(args: argparse.Namespace) -> int:
    """Write the layouts and open a viewer; return 0. Raises UsageError, LogDamaged, EnvironmentFault."""
    log = find_log(args.log)
    topics = {channel.topic for channel in read_summary(log).channels}
    layouts = write_layouts(args.out or log.parent / "view")
    tell(f"layout for Lichtblick and Foxglove: {layouts.lichtblick}")
    tell(f"layout for Rerun: {layouts.rerun}")
    if SIGNALS_TOPIC not in topics:
        tell(f"note: this log has no {SIGNALS_TOPIC}, from which the plots are drawn; they stay empty")
    if args.json:
        files = {name: str(path) for name, path in layouts._asdict().items()}
        say_json({"schema": SCHEMA, "log": str(log), "layouts": files, "signals": SIGNALS_TOPIC in topics})
        return 0
    viewer = find_viewer()
    if viewer is not None and has_display():
        tell(f"opening {viewer}")
        open_log(viewer, log, layouts)
        return 0
    tell("there is no display" if viewer else f"no viewer was found (looked for: {', '.join(PROGRAMS)})")
    for line in by_hand(log, layouts):
        tell(line)
    return 0


def write_layouts(folder: Path) -> Layouts:
    """Write the layouts into a folder, over those that are there. Raises EnvironmentFault."""
    layouts = Layouts(folder / "lichtblick.json", folder / "push.rbl")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(layouts.lichtblick, (json.dumps(lichtblick.layout(), indent=2) + "\n").encode())
        write_atomically(layouts.rerun, _BLUEPRINT.read_bytes())
    except OSError as error:
        raise EnvironmentFault(
            f"the layouts cannot be written: {error.strerror}", where=str(folder), do="Give another --out"
        ) from None
    return layouts
