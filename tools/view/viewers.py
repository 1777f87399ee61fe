"""Find a viewer of logs on this machine, and open a log in it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from robot_io.errors import EnvironmentFault
from tools.view.panels import RERUN_APPLICATION

PROGRAMS = ("rerun", "lichtblick", "foxglove-studio")
"""Names of the programs on the PATH, in the order in which they are looked for; only Rerun takes a layout as well."""


class Layouts(NamedTuple):
    """The files with layouts that were written for a log."""

    lichtblick: Path
    rerun: Path


def has_display(platform: str = sys.platform, environment: Mapping[str, str] = os.environ) -> bool:
    """Return whether a program can open a window here."""
    return platform != "linux" or bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def find_viewer() -> Path | None:
    """Return the first viewer on the PATH, None if there is none."""
    found = (shutil.which(name) for name in PROGRAMS)
    return next((Path(path) for path in found if path), None)


def open_log(viewer: Path, log: Path, layouts: Layouts) -> None:
    """Open a log, and return when the viewer is closed. Raises EnvironmentFault if it cannot be opened."""
    if viewer.stem == "rerun":
        recording = layouts.rerun.with_suffix(".rrd")
        _run(viewer, "mcap", "convert", log, "--application-id", RERUN_APPLICATION, "-o", recording, quiet=True)
        _run(viewer, recording, layouts.rerun)
    else:
        _run(viewer, log)


def by_hand(log: Path, layouts: Layouts) -> list[str]:
    """Return what to do where no viewer is opened."""
    recording = layouts.rerun.with_suffix(".rrd")
    return [
        "Lichtblick or Foxglove: open the log, then import the layout from its file in the menu of layouts",
        f"Rerun: rerun mcap convert {log} --application-id {RERUN_APPLICATION} -o {recording} "
        f"&& rerun {recording} {layouts.rerun}",
    ]


def _run(program: Path, *words: str | Path, quiet: bool = False) -> None:
    """Run a program to its end; quiet: what it says is told only if it fails."""
    nowhere = subprocess.DEVNULL
    try:
        done = subprocess.run(
            [program, *words],
            stdin=nowhere,
            stdout=nowhere,
            stderr=subprocess.PIPE if quiet else None,
            text=True,
            errors="replace",
            check=False,
        )
    except OSError as error:
        raise EnvironmentFault(f"it cannot be started: {error.strerror}", where=str(program)) from None
    if done.returncode:
        said = (done.stderr or "").strip().splitlines()
        why = f": {said[-1]}" if said else ""
        raise EnvironmentFault(
            f"it ended with exit code {done.returncode}{why}", where=str(program), do="Open the log by hand"
        )
