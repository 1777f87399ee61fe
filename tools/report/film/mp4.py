"""Write a film as MP4 with ffmpeg, where it is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from robot_io.errors import EnvironmentFault
from tools.report.compare.given_runs import ComparedRun
from tools.report.film.frames import Film

FINISH_S = 120.0
"""How long ffmpeg may take after the last frame."""


def find_ffmpeg() -> str:
    """Return the path of ffmpeg. Raises EnvironmentFault where it is not installed."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise EnvironmentFault(
            "--mp4 needs ffmpeg, which is not installed", do="Run `sudo apt install ffmpeg`, or use --gif"
        )
    return found


def write_mp4(runs: Sequence[ComparedRun], out: Path) -> None:
    """Write a film of these runs. Raises UsageError where there is nothing to show, EnvironmentFault."""
    ffmpeg, film = find_ffmpeg(), Film(runs)
    part = out.with_name(f".{out.name}.{os.getpid()}.part")
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{film.width}x{film.height}", "-r", f"{film.frames_per_s:g}"]
    encoded = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
    command = [ffmpeg, "-loglevel", "error", "-nostdin", "-y", *raw, "-i", "-", *encoded, str(part)]
    try:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        errors = _feed(process, film)
        if process.returncode:
            why = errors.strip().splitlines()[-1] if errors.strip() else f"it ended with code {process.returncode}"
            raise EnvironmentFault(f"ffmpeg could not write the film: {why}", where=str(out), do="Use --gif")
        part.replace(out)
    except OSError as error:
        raise EnvironmentFault(
            f"the film cannot be written: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    finally:
        part.unlink(missing_ok=True)


def _feed(process: subprocess.Popen[bytes], film: Film) -> str:
    """Give all frames to ffmpeg and wait for its end; return what it said. It is killed where it does not end."""
    assert process.stdin is not None
    try:
        for frame in film.frames():
            process.stdin.write(frame.tobytes())
    except BrokenPipeError:
        pass  # it says why
    except BaseException:
        process.kill()
        raise
    try:
        _, errors = process.communicate(timeout=FINISH_S)
    except subprocess.TimeoutExpired:
        process.kill()
        _, errors = process.communicate()
    return errors.decode(errors="replace")
