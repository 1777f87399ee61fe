"""`make paper`: run the shipped studies and the paper's sweep, and write the tables in docs that come of them anew.

    python -m tools.dev.paper [--out DIR] [--only NAME ...]

A table stands between `<!-- table NAME -->` and `<!-- end -->`. What is in `--out` already is not run again.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tools.study.results import Runs, groups, number, read_runs

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "simulation-studies.md"
SWEEP = "paper-sweep"
PUSH = "import sys; from robot_io._entry import main; sys.exit(main())"
Rows = list[dict[str, str]]
Cell = Callable[[Rows], str]
LAW, TURNING, MASS = "control.law", "world.floor.turning", "world.slider.mass_kg"
START, YAW, HAND, PRESSURE = (
    "world.start.edge_offset_m", "world.truth.sensor_yaw_deg", "world.hand", "world.slider.pressure",
)  # fmt: skip


class Matrix(NamedTuple):
    """A table of a study: a line for each value of `down`, a column for each of `across`."""

    down: tuple[str, ...]
    across: str
    cell: Cell
    heads: tuple[str, ...]


def ended(rows: Rows) -> str:
    """Return how many of some pushes were done, and what became of the others."""
    done = sum(row["verdict"] == "done" for row in rows)
    others: dict[str, int] = {}
    for row in rows:
        if row["verdict"] != "done":
            others[row["verdict"]] = others.get(row["verdict"], 0) + 1
    told = "".join(f", {count} {verdict}" for verdict, count in sorted(others.items()))
    return f"{done}/{len(rows)}{told}"


def end_offset(rows: Rows) -> str:
    """Return the median size of the end offset in cm of the pushes that arrived."""
    values = [abs(x) for row in rows if _arrived(row) and not math.isnan(x := number(row["end_lateral_m"]))]
    return f"{100 * median(values):.1f} cm" if values else "-"


def ended_and_offset(rows: Rows) -> str:
    """Return both."""
    return f"{ended(rows)}; {end_offset(rows)}" if any(map(_arrived, rows)) else ended(rows)


def object_at(rows: Rows) -> str:
    """Return where the object ends, in cm beside the path: the median, with its sign."""
    values = [x for row in rows if _arrived(row) and not math.isnan(x := number(row["object_lateral_m"]))]
    return f"{100 * median(values):+.1f} cm" if values else ended(rows)


TABLES = {
    "experiment-box": Matrix((START,), LAW, ended_and_offset, ("start, m",)),
    "experiment-barrel": Matrix((START,), LAW, ended_and_offset, ("start, m",)),
    "calibration": Matrix((YAW, HAND), LAW, end_offset, ("sensor turned, degrees", "tare off, N")),
    "floors": Matrix((PRESSURE, START), TURNING, object_at, ("pressure", "start, m")),
    "masses": Matrix((MASS,), LAW, ended_and_offset, ("mass, kg",)),
}
"""By the name of the study."""


def study_table(runs: Runs, matrix: Matrix) -> list[str]:
    """Return a study's table as lines of Markdown."""
    across = [value for (value,) in groups(runs, [matrix.across])]
    found = groups(runs, [*matrix.down, matrix.across])
    lines = _head((*matrix.heads, *across))
    for values in groups(runs, matrix.down):
        cells = [matrix.cell(found[*values, column]) if (*values, column) in found else "" for column in across]
        lines.append(_line((*map(_short, values), *cells)))
    return lines


def sweep_table(summary: dict[str, dict[str, dict[str, object]]]) -> list[str]:
    """Return the table of the paper's sweep: how many converged, and how far out they were."""
    lines = _head(("shape", "pushes", "converged", "offset at the end, median", "largest", "largest on the way"))
    for shape, found in summary["shapes"].items():
        end, most = (json.loads(json.dumps(found[key])) for key in ("final_abs_y_m", "max_abs_y_m"))
        cells = (shape, found["lanes"], found["converged"], _mm(end["median"]), _mm(end["max"]), f"{most['max']:.2f} m")
        lines.append(_line(tuple(map(str, cells))))
    return lines


def write_table(page: Path, name: str, lines: Sequence[str]) -> None:
    """Put a table between its marks. Raises ValueError where a page has none."""
    text = page.read_text(encoding="utf-8")
    marks = re.compile(rf"(<!-- table {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not marks.search(text):
        raise ValueError(f"{page.name} has no table {name}")
    whole = "\n".join(lines)
    page.write_text(marks.sub(lambda found: f"{found[1]}{whole}\n{found[2]}", text), encoding="utf-8")


def main(argv: Sequence[str]) -> int:
    """Run what is missing and write the tables; return the exit code of the first command that fails."""
    parser = argparse.ArgumentParser(prog="python -m tools.dev.paper", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("studies/paper"), help="where the results are kept")
    parser.add_argument("--only", action="append", choices=(*TABLES, SWEEP), help="this one only; may be repeated")
    args = parser.parse_args(argv)
    for name in args.only or (*TABLES, SWEEP):
        out = args.out / name
        words = ["sweep", "paper"] if name == SWEEP else ["study", name]
        if code := subprocess.run([sys.executable, "-c", PUSH, *words, "--out", str(out), "--resume"]).returncode:
            return code
        if name == SWEEP:
            lines = sweep_table(json.loads((out / "summary.json").read_text(encoding="utf-8")))
        else:
            lines = study_table(read_runs(out), TABLES[name])
        write_table(PAGE, name, lines)
    return 0


def _arrived(row: dict[str, str]) -> bool:
    return int(row["exit_code"]) in (0, 9)


def _short(value: str) -> str:
    """Return the force of a `world.hand` in N, and any other value as it is."""
    if not value.startswith("["):
        return value
    return str(sum(float(one["force_body_N"][1]) for one in json.loads(value)))


def _mm(metres: float) -> str:
    return f"{1000 * metres:.2g} mm"


def _head(cells: Sequence[str]) -> list[str]:
    return [_line(cells), "|" + "---|" * len(cells)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
