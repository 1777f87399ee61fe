"""Write the end-of-run report: one self-contained HTML page made from a log alone.

`push run` runs `python -m tools.report.page LOG HTML PARENT` in a separate process, so that a failing report does not
fail the run.
"""

from __future__ import annotations

import importlib
import json
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

from robot_io.errors import EnvironmentFault, PushError, UsageError
from robot_io.mcap.files import has_parts
from robot_io.mcap.walk import Grown
from safety.faults import FAULTS
from tools.laws import law_label
from tools.places.atomic_file import write_atomically
from tools.report import run_facts, run_summary, run_verdict
from tools.report.advice.what_to_try import what_to_try
from tools.report.alt_texts import alt_texts
from tools.report.drawing.style import PHASE_COLOURS, phase_spans
from tools.report.growing_log import GrowingLog
from tools.report.html_parts import content_policy, escaped, figure, items, style_sheet, table
from tools.report.player.course import as_json, course
from tools.report.run_data import RunData, read_run

TEMPLATE = Path(__file__).with_name("page.html")
SCRIPT = Path(__file__).with_name("player") / "player.js"
MOST_SUMMARY_BYTES = 4 << 20
MOST_ROWS = 200
PLAN_NAME = "trajectory"
CAPTIONS = {
    "trajectory": "From above, in the frame of the path. Arrows: force on the object. Circles: contact ball, if known.",
    "force": "Force on the object, filtered: horizontal magnitude and component to the left of the path. Below, on a "
    "logarithmic scale, the magnitude of the raw reading (bias removed) against the limits.",
    "speed": "Speed of the base: requested by the law, commanded after safety, measured by odometry.",
    "tracking": "Lateral offset of the contact point, angles of force and push, heading error of the base.",
    "timing": "How late the ticks of the loop started, and when ticks were skipped.",
    "safety": "Mode of the supervisor and faults over time.",
}


def write_report(log: Path, out_html: Path, *, png: bool = False, grown: Grown | None = None) -> list[Path]:
    """Write the page of a log, using `summary.json` beside the log if it exists. Returns the paths written.

    `png`: also write the figures beside it. `grown`: see `walk`, for a log that is still being written.

    Raises UsageError (no such log, or a file to write is not of this run), LogDamaged (the log cannot be trusted),
    EnvironmentFault (the page cannot be written).
    """
    from tools.report.drawing.figures import FIGURES
    from tools.report.drawing.style import png as as_png
    from tools.report.drawing.style import style
    from tools.report.drawing.svg import inline_svg

    run = read_run(log, grown=grown)
    mark = run_mark(run)
    if not may_write(out_html, mark):
        raise UsageError("there is already a report of another run", where=str(out_html), do="Give another --out")
    pictures = [out_html.with_name(f"{name}.png") for name in FIGURES] if png else []
    # A picture beside a report belongs to it and may be overwritten with it; any other is kept.
    if kept := [picture for picture in pictures if picture.exists() and not out_html.exists()]:
        raise UsageError("there is already a file of this name", where=str(kept[0]), do="Give another --out")
    with style():
        drawn = {name: draw(run) for name, draw in FIGURES.items()}
        alts = alt_texts(run)
        svgs = {name: inline_svg(one, name, alts[name]) for name, one in drawn.items()}
        text = page(run, read_summary_file(log.with_name("summary.json")), svgs, mark)
        try:
            write_atomically(out_html, text.encode())
            for picture in pictures:
                write_atomically(picture, as_png(drawn[picture.stem]))
        except OSError as error:
            raise EnvironmentFault(
                f"the report cannot be written: {error.strerror}", where=str(out_html), do="Give another --out"
            ) from None
    return [out_html, *pictures]


def run_mark(run: RunData) -> str:
    """Return an identifier of the run: a checksum over its settings and the facts known at its start."""
    facts = sorted(run.run_facts.items())
    return f"{zlib.crc32(json.dumps([run.config_text, facts]).encode()):08x}"


def may_write(out_html: Path, mark: str) -> bool:
    """Return whether the file does not exist yet or is a report of the same run."""
    try:
        with out_html.open(encoding="utf-8", errors="replace") as file:
            head = file.read(4096)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return f'<meta name="push-run" content="{mark}">' in head


def read_summary_file(path: Path) -> dict[str, Any]:
    """Return a run's summary, {} if there is no usable one."""
    try:
        if path.stat().st_size > MOST_SUMMARY_BYTES:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def page(run: RunData, summary: dict[str, Any], svgs: dict[str, str], mark: str) -> str:
    """Return the page. Everything that comes from the log or the summary is escaped."""
    verdict = run_verdict.verdict(run, summary)
    rig = run.rig
    subtitle = [run_facts.level_words(run), law_label(rig), f"seed {run.facts.get('seed', '-')}", run.log.name]
    baseline = run_summary.baseline_of(rig)
    advice = items(what_to_try(run, verdict))
    script = SCRIPT.read_text(encoding="utf-8")
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        run_mark=mark,
        content_policy=content_policy(script),
        style=style_sheet(),
        script=script,
        course=as_json(course(run)),
        title=escaped(f"{verdict.line} - {rig.name}"),
        verdict=escaped(verdict.line),
        verdict_class="good" if verdict.good else "bad",
        verdict_why=escaped(verdict.why),
        subtitle=escaped(", ".join(filter(None, [*subtitle, run_facts.note_of(run, summary)]))),
        notes="\n".join(f"<p>{escaped(note)}</p>" for note in _notes(run, summary)),
        **{"try": f"<h2>What to try</h2>\n{advice}" if advice else ""},
        tiles="\n".join(f"<div><dt>{escaped(a)}</dt><dd>{escaped(b)}</dd></div>" for a, b in run_summary.tiles(run)),
        trust=table(("", "says", ""), run_verdict.trust_rows(verdict.trust)) or "<p>Nothing is known.</p>",
        plan="".join(figure(svg, CAPTIONS[name], "plan") for name, svg in svgs.items() if name == PLAN_NAME),
        key=_key(run),
        figures="\n".join(figure(svg, CAPTIONS[name]) for name, svg in svgs.items() if name != PLAN_NAME),
        safety=_safety(run),
        devices="\n".join(
            f"<div><h3>{escaped(device)}</h3>{table(('', ''), rows, numbers=1) or '<p>No data.</p>'}</div>"
            for device, rows in run_summary.counters(run, summary).items()
        ),
        timing=table(("", ""), run_summary.timing_rows(run), numbers=1) or "<p>The log contains no ticks.</p>",
        baseline=escaped(baseline),
        settings=table(("setting", "shipped", "this run"), run_summary.differences(rig, baseline)) or "<p>None.</p>",
        facts=_facts(run, summary),
        replay=_replay(run, summary),
    )


def _notes(run: RunData, summary: dict[str, Any]) -> list[str]:
    notes = []
    if run.recovered:
        notes.append(f"This log was recovered ({run.recovered}): everything after its last intact part is missing.")
    if run.tick_stride > 1:
        notes.append(f"This log is long: figures show one tick in {run.tick_stride}.")
    if not run.slider_source:
        notes.append("The pose of the object is unknown: the log contains no motion capture of it.")
    more = summary.get("notes")
    return notes + [str(note) for note in more[:20]] if isinstance(more, list) else notes


def _key(run: RunData) -> str:
    used = dict.fromkeys(phase for phase, _, _ in phase_spans(run.ticks))
    shown = "".join(
        f'<span><i style="background:var(--c{PHASE_COLOURS[phase][1:]}, {PHASE_COLOURS[phase]})"></i>'
        f"{escaped(phase.name.lower().replace('_', ' '))}</span>"
        for phase in used
    )
    return f"Shading: {shown}" if shown else ""


def _facts(run: RunData, summary: dict[str, Any]) -> str:
    rest = table(("", ""), sorted(run.facts.items()))
    return (
        f"{table(('', ''), run_facts.reader_facts(run, summary))}"
        f"<details><summary>All that the log says of itself: versions and checksums</summary>{rest}</details>"
    )


def _safety(run: RunData) -> str:
    rows = []
    for span in run.faults:
        known = FAULTS.get(span.name)
        reaction = ("counted only" if not known.mode else known.mode.name) if known else "-"
        rows.append((f"{span.begin_s:.2f}", f"{span.end_s - span.begin_s:.2f}", span.name, span.text, reaction))
    if not rows:
        return "<p>None.</p>"
    more = f"<p>... and {len(rows) - MOST_ROWS} more.</p>" if len(rows) > MOST_ROWS else ""
    return table(("at (s)", "for (s)", "fault", "what", "reaction"), rows[:MOST_ROWS]) + more


def _replay(run: RunData, summary: dict[str, Any]) -> str:
    result = summary.get("replay")
    line = f"<p>{escaped(result)}</p>" if isinstance(result, str) else ""
    command = f"<code>push replay {escaped(run.log.name)}</code>"
    return f"{line}<p>{command} re-runs the log's ticks and compares every byte.</p>"


def main(argv: Sequence[str]) -> int:
    """Read the log until a byte on stdin says it is finished, then write the report; die with the parent process.

    argv: LOG HTML PARENT (process id). Returns the exit code; an error is one line on stderr.
    """
    from robot_io.ipc.process import die_with_parent
    from tools.report.drawing.style import warm_up

    die_with_parent(int(argv[2]))
    importlib.import_module("tools.report.drawing.figures")
    warm_up()
    log = Path(argv[0])
    try:
        grown = None if has_parts(log) else GrowingLog(log, sys.stdin.fileno()).wait_for_size
        write_report(log, Path(argv[1]), grown=grown)
    except PushError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
