"""`push study`: whole pushes of the program over axes of settings, seeds and laws, on all cores."""

from __future__ import annotations

import argparse
import time

from robot_io.error_report import say_json, tell
from tools.parallel.work import add_work_arguments, working
from tools.study.plan import out_of, run_study
from tools.study.study_file import find_study, load_study, shipped_studies
from tools.terminal.arguments import name_or_path, named_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "study", metavar="FILE.toml", type=name_or_path, help=f"a study file, or one of {', '.join(shipped_studies())}"
    )
    parser.add_argument(
        "--out", type=named_path, metavar="DIR", help="folder for the results (default: studies/NAME-TIME)"
    )
    parser.add_argument("--resume", action="store_true", help="continue the study in --out, skipping finished pushes")
    parser.add_argument(
        "--log", choices=("full", "ticks", "none"), default="none",
        help="log of each push in DIR/logs: as `push run` writes it, without derived topics, or none (default)",
    )  # fmt: skip
    add_work_arguments(parser)
    parser.add_argument("--json", action="store_true", help="the summary as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Run the study and write its results; return the exit code."""
    began = time.monotonic()
    study = load_study(find_study(args.study))
    out = out_of(args, study)
    with working(args):
        summary = run_study(study, out, args)
    for line in summary["lines"]:
        tell(line)
    tell(f"results in {out}: {', '.join(summary['files'])}")
    if args.json:
        del summary["lines"]
        say_json({**summary, "out": str(out), "elapsed_s": round(time.monotonic() - began, 3)})
    return 0
