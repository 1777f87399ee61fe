"""Write the page, the picture and the table of several runs into a folder."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from string import Template

from robot_io.errors import EnvironmentFault, UsageError
from tools.places.atomic_file import write_atomically
from tools.report.compare.given_runs import ComparedRun, path_notes
from tools.report.compare.labels import differing_settings
from tools.report.compare.picture import line_of, overlay
from tools.report.compare.results import HEADS, Result, as_cells, as_csv, result
from tools.report.drawing.style import png, style
from tools.report.drawing.svg import inline_svg, svg
from tools.report.html_parts import content_policy, escaped, figure, style_sheet, table

TEMPLATE = Path(__file__).with_name("compare.html")
NAMES = ("compare.html", "compare.svg", "compare.csv", "compare.png", "film.gif", "film.mp4")
CAPTION = (
    "The object's centre beside its path (the contact point where the object was not seen), as in the paper's Fig. 6; "
    "black: without force feedback; a cross: contact lost; shaded: the corridor. The two axes have different scales."
)


def folder_for(out: Path | None) -> Path:
    """Return the folder to write to, made where needed. Raises UsageError where it already holds a comparison."""
    folder = out or Path(f"compare-{time.strftime('%Y%m%d-%H%M%S')}")
    try:
        if existing := [name for name in NAMES if (folder / name).exists()]:
            raise UsageError(
                "there is already a file of this name", where=str(folder / existing[0]), do="Give another --out"
            )
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(
            f"this folder cannot be written: {error.strerror}", where=str(folder), do="Give another --out"
        ) from None
    return folder


def write_comparison(runs: Sequence[ComparedRun], folder: Path, *, as_png: bool = False) -> list[Path]:
    """Write `compare.html`, `.svg` and `.csv` (and with `as_png` the picture as PNG); return the paths.

    Raises EnvironmentFault where they cannot be written.
    """
    results = [result(one) for one in runs]
    with style():
        picture = overlay(runs)
        content = {
            "compare.html": page(runs, results, inline_svg(picture, "compare", alt_text(results))).encode(),
            "compare.svg": svg(picture).encode(),
            "compare.csv": as_csv(results).encode(),
        }
        if as_png:
            content["compare.png"] = png(picture, dpi=150)
    try:
        for name, data in content.items():
            write_atomically(folder / name, data)
    except OSError as error:
        raise EnvironmentFault(
            f"the comparison cannot be written: {error.strerror}", where=str(folder), do="Give another --out"
        ) from None
    return [folder / name for name in content]


def page(runs: Sequence[ComparedRun], results: Sequence[Result], picture: str) -> str:
    """Return the page. Everything that comes from logs is escaped."""
    counted = Counter(row.verdict for row in results)
    differing = differing_settings([one.run for one in runs])
    numbers = [str(one.number) for one in runs]
    settings = table(("setting", *numbers), [(name, *values) for name, values in differing.items()], stacked=True)
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        content_policy=content_policy(),
        style=style_sheet(),
        title=f"{len(runs)} runs compared",
        verdicts=escaped(", ".join(f"{count} {verdict}" for verdict, count in counted.most_common()) + "."),
        notes="\n".join(f"<p>{escaped(note)}</p>" for note in path_notes(runs)),
        picture=figure(picture, CAPTION, "plan"),
        results=_results(runs, results),
        settings=settings or "<p>None: these runs have the same settings and the same seed.</p>",
        logs=table(("", ""), [(str(row.run), row.log) for row in results]),
    )


def alt_text(results: Sequence[Result]) -> str:
    """Return what the picture shows in words."""
    return "Lateral course of each run over its path. " + "; ".join(
        f"run {row.run} ({row.settings}): {row.verdict} after {row.distance_m:.2f} m, object "
        f"{row.object_end_m:+.3f} m, pusher {row.pusher_end_m:+.3f} m beside the path at the end"
        for row in results
    )


def _results(runs: Sequence[ComparedRun], results: Sequence[Result]) -> str:
    """Return the table, each run's number in the colour of its line."""
    text = table(HEADS, [as_cells(row) for row in results], stacked=True)
    for one in runs:
        colour = line_of(one).colour
        swatch = f'<i class="swatch" style="background:var(--c{colour[1:].lower()}, {colour})"></i>'
        text = text.replace(f"<tr><td>{one.number}</td>", f"<tr><td>{swatch}{one.number}</td>", 1)
    return f'<div class="results">{text}</div>'
