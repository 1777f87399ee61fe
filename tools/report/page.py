"""Write the end-of-run report: one self-contained HTML page made from a log alone.

`push run` runs `python -m tools.report.page LOG HTML PARENT` in a separate process, so that a failing report does not
fail the run.
"""

from __future__ import annotations

import base64
import html
import importlib
import json
import re
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

from robot_io.errors import EnvironmentFault, PushError, UsageError
from robot_io.mcap.walk import Grown
from safety.faults import FAULTS
from tools.laws import law_label
from tools.places.atomic_file import write_atomically
from tools.report import run_summary, run_verdict
from tools.report.growing_log import GrowingLog
from tools.report.run_data import RunData, read_run
from tools.report.style import PHASE_COLOURS, phase_spans

TEMPLATE = Path(__file__).with_name("page.html")
MOST_SUMMARY_BYTES = 4 << 20
MOST_ROWS = 200
CAPTIONS = {
    "trajectory": "From above, in the frame of the path. Arrows: force on the object. Circles: contact ball, if known.",
    "force": "Force on the object, and on a logarithmic scale the raw reading (bias removed) against the limits.",
    "speed": "Speed of the base: requested by the law, allowed by safety, measured by odometry.",
    "tracking": "Lateral offset of the contact point, angles of force and push, heading error of the base.",
    "timing": "How late the ticks of the loop started, and when ticks were skipped.",
    "safety": "Mode of the supervisor and faults over time.",
}


def write_report(log: Path, out_html: Path, *, grown: Grown | None = None) -> dict[str, bytes]:
    """Write the page of a log, using `summary.json` beside the log if it exists. Returns the PNGs.

    `grown`: see `walk`, for a log that is still being written.

    Raises UsageError (no such log, or `out_html` is the report of another run), LogDamaged (the log cannot be
    trusted), EnvironmentFault (the page cannot be written).
    """
    from tools.report.figures import figures

    run = read_run(log, grown=grown)
    mark = run_mark(run)
    if not may_write(out_html, mark):
        raise UsageError("there is already a report of another run", where=str(out_html), do="Give another --out")
    pngs = figures(run)
    text = page(run, read_summary_file(log.with_name("summary.json")), pngs, mark)
    try:
        write_atomically(out_html, text.encode())
    except OSError as error:
        raise EnvironmentFault(f"the report cannot be written: {error.strerror}", where=str(out_html)) from None
    return pngs


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


def page(run: RunData, summary: dict[str, Any], pngs: dict[str, bytes], mark: str) -> str:
    """Return the page. Everything that comes from the log or the summary is escaped."""
    verdict = run_verdict.verdict(run, summary)
    rig = run.rig
    level = run.facts.get("level", "unknown level")
    name = rig.name if rig.name == level else f"{rig.name} ({level})"
    subtitle = f"{name}, {law_label(rig)}, seed {run.facts.get('seed', '-')}, {run.log.name}"
    baseline = run_summary.baseline_of(rig)
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        run_mark=mark,
        title=_esc(f"{verdict.line} - {rig.name}"),
        verdict=_esc(verdict.line),
        verdict_class="good" if verdict.good else "bad",
        verdict_why=_esc(verdict.why),
        subtitle=_esc(subtitle),
        notes="\n".join(f"<p>{_esc(note)}</p>" for note in _notes(run, summary)),
        tiles="\n".join(f"<div><dt>{_esc(a)}</dt><dd>{_esc(b)}</dd></div>" for a, b in run_summary.tiles(run)),
        trust=_table(("", "says", ""), run_verdict.trust_rows(verdict.trust)) or "<p>Nothing is known.</p>",
        figures=_figures(run, pngs),
        safety=_safety(run),
        devices="\n".join(
            f"<div><h3>{_esc(device)}</h3>{_table(('', ''), rows, numbers=1) or '<p>No data.</p>'}</div>"
            for device, rows in run_summary.counters(run, summary).items()
        ),
        timing=_table(("", ""), run_summary.timing_rows(run), numbers=1) or "<p>The log contains no ticks.</p>",
        baseline=_esc(baseline),
        settings=_table(("setting", "shipped", "this run"), run_summary.differences(rig, baseline)) or "<p>None.</p>",
        facts=_table(("", ""), sorted(run.facts.items())),
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


def _figures(run: RunData, pngs: dict[str, bytes]) -> str:
    blocks = []
    used = dict.fromkeys(phase for phase, _, _ in phase_spans(run.ticks))
    key = "".join(
        f'<span><i style="background:{PHASE_COLOURS[phase]}"></i>{_esc(phase.name.lower().replace("_", " "))}</span>'
        for phase in used
    )
    for name, data in pngs.items():
        caption = _esc(CAPTIONS[name])
        source = f"data:image/png;base64,{base64.b64encode(data).decode()}"
        block = f'<figure><img src="{source}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'
        if name == "force" and key:
            block = f'<p class="key soft">Shading: {key}</p>\n{block}'
        blocks.append(block)
    return "\n".join(blocks)


def _safety(run: RunData) -> str:
    rows = []
    for span in run.faults:
        known = FAULTS.get(span.name)
        reaction = ("counted only" if not known.mode else known.mode.name) if known else "-"
        rows.append((f"{span.begin_s:.2f}", f"{span.end_s - span.begin_s:.2f}", span.name, span.text, reaction))
    if not rows:
        return "<p>None.</p>"
    more = f"<p>... and {len(rows) - MOST_ROWS} more.</p>" if len(rows) > MOST_ROWS else ""
    return _table(("at (s)", "for (s)", "fault", "what", "reaction"), rows[:MOST_ROWS]) + more


def _replay(run: RunData, summary: dict[str, Any]) -> str:
    result = summary.get("replay")
    line = f"<p>{_esc(result)}</p>" if isinstance(result, str) else ""
    return (
        f"{line}<p><code>push replay {_esc(run.log.name)}</code> re-runs the log's ticks and compares every byte.</p>"
    )


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 0) -> str:
    """Return an HTML table, "" without rows; the last `numbers` columns are right-aligned."""
    if not rows:
        return ""
    classes = [' class="n"' if i >= len(heads) - numbers else "" for i in range(len(heads))]
    lines = ['<div class="wide"><table>']
    if any(heads):
        cells = "".join(f"<th{c}>{_esc(head)}</th>" for c, head in zip(classes, heads, strict=True))
        lines.append(f"<tr>{cells}</tr>")
    for row in rows:
        cells = "".join(f"<td{c}>{_esc(cell)}</td>" for c, cell in zip(classes, row, strict=True))
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join([*lines, "</table></div>"])


def _esc(text: str) -> str:
    """Escape text of unknown origin: unprintable characters become blanks, and long text is cut."""
    shown = "".join(letter if letter.isprintable() else " " for letter in text[:2000])
    return html.escape(re.sub(" {2,}", " ", shown), quote=True)


def main(argv: Sequence[str]) -> int:
    """Read the log until a byte on stdin says it is finished, then write the report; die with the parent process.

    argv: LOG HTML PARENT (process id). Returns the exit code; an error is one line on stderr.
    """
    from robot_io.ipc.process import die_with_parent
    from tools.report.style import warm_up

    die_with_parent(int(argv[2]))
    importlib.import_module("tools.report.figures")
    warm_up()
    log = Path(argv[0])
    try:
        write_report(log, Path(argv[1]), grown=GrowingLog(log, sys.stdin.fileno()).wait_for_size)
    except PushError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
