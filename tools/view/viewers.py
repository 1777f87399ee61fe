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
from robot_io.mcap.files import files_of, part_path
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
        recordings = _recordings(log, layouts)
        for file, recording in recordings.items():
            _run(viewer, "mcap", "convert", file, "--application-id", RERUN_APPLICATION, "-o", recording, quiet=True)
        _run(viewer, *recordings.values(), layouts.rerun)
    else:
        _run(viewer, *files_of(log))


def by_hand(log: Path, layouts: Layouts) -> list[str]:
    """Return what to do where no viewer is opened."""
    recordings = _recordings(log, layouts)
    converted = [
        f"rerun mcap convert {file} --application-id {RERUN_APPLICATION} -o {recording}"
        for file, recording in recordings.items()
    ]
    return [
        "Lichtblick or Foxglove: open the log, then import the layout from its file in the menu of layouts",
        f"Rerun: {' && '.join(converted)} && rerun {' '.join(map(str, recordings.values()))} {layouts.rerun}",
    ]


def _recordings(log: Path, layouts: Layouts) -> dict[Path, Path]:
    """Return what Rerun makes of each file of a log."""
    files, rrd = files_of(log), layouts.rerun.with_suffix(".rrd")
    if len(files) == 1:
        return {files[0]: rrd}
    return {file: part_path(rrd, number) for number, file in enumerate(files, 1)}


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
