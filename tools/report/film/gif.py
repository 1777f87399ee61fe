"""Write a film as GIF, at most 10 MB: where it is larger, every other frame is left out."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robot_io.errors import EnvironmentFault
from tools.places.atomic_file import write_atomically
from tools.report.compare.given_runs import ComparedRun
from tools.report.film.frames import Film

MOST_BYTES = 10_000_000
COLOURS = 128
LAST_MS = 2000
"""How long the last frame stays before the film begins again."""


def write_gif(runs: Sequence[ComparedRun], out: Path) -> None:
    """Write a film of these runs. Raises UsageError where there is nothing to show, EnvironmentFault."""
    from PIL import Image

    film = Film(runs)
    frames = [Image.fromarray(frame) for frame in film.frames()]
    palette = frames[-1].quantize(COLOURS)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    per_frame_ms = 1000.0 / film.frames_per_s
    while len(data := _encoded(small, per_frame_ms)) > MOST_BYTES and len(small) > 2:
        small, per_frame_ms = small[::2], 2.0 * per_frame_ms
    try:
        write_atomically(out, data)
    except OSError as error:
        raise EnvironmentFault(
            f"the film cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None


def _encoded(frames: Sequence[Any], per_frame_ms: float) -> bytes:
    target = io.BytesIO()
    times_ms = [*[round(per_frame_ms / 10) * 10] * (len(frames) - 1), LAST_MS]
    frames[0].save(target, format="GIF", save_all=True, append_images=frames[1:], duration=times_ms, loop=0)
    return target.getvalue()
