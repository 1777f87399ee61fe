"""`python -m tools.dev.mutants [--since COMMIT] [PATH ...]`: exit 0 if every mutant is killed or listed, else 1.

Exit 2: no result (tests that fail without a mutant, an unknown commit, an invalid list).
"""

from __future__ import annotations

import argparse
import os
import sys
import time

from tools.dev.mutants import choose, digests
from tools.dev.mutants.equivalents import BadList, read_equivalents
from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.results import Results
from tools.dev.mutants.summary import NOTICED, Summary
from tools.dev.mutants.targets import ROOT, SHELLS, WHOLE_TESTS
from tools.dev.mutants.trial import reach
from tools.dev.mutants.trial.judge import Judge, Trial, Verdict
from tools.dev.mutants.trial.pool import run_jobs
from tools.dev.mutants.trial.session import run_tests
from tools.dev.mutants.trial.tree import Tree

KEPT = ROOT / ".mutants"
"""Results and measurements of earlier sessions; git ignores it, and it may be deleted at any time."""
LIST = ROOT / "tests" / "mutants_equivalent.toml"
SHELL_WORKERS = 1
"""Tests with processes and a wall clock get the machine to themselves."""
SHELL_LIMIT_S = 600.0
PROGRESS_EVERY_S = 30.0


def main(argv: list[str] | None = None) -> int:
    """Test the chosen mutants and print those that no test notices; returns the exit code."""
    parser = argparse.ArgumentParser(prog="make mutants", description="Find changes of the code that no test notices.")
    parser.add_argument("--since", metavar="COMMIT", help="only mutants on lines that changed since this commit")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="worker processes (default: cores)")
    parser.add_argument("paths", nargs="*", metavar="PATH", help="only files whose path begins like this")
    args = parser.parse_args(argv)
    try:
        listed = read_equivalents(LIST)
        whole, shells = choose.whole_mutants(), choose.shell_mutants()
        chosen_whole, chosen_shells = (_chosen(group, args.since, args.paths) for group in (whole, shells))
        chosen_shells = choose.sample(chosen_shells)
        results = Results(KEPT / "results.jsonl")
        verdicts = _test_whole(chosen_whole, results, args.workers)
        failing = _test_shells(chosen_shells, results, verdicts)
    except (BadList, choose.UnknownCommit, reach.TestsFail) as error:
        print(f"mutants: {_SENTENCES[type(error)].format(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("mutants: interrupted; results so far are kept, and the next run continues from there", file=sys.stderr)
        return 130
    summary = Summary(verdicts, listed, whole + shells)
    print("\n".join(summary.lines()))
    if failing:
        print(f"mutants: {_SENTENCES[reach.TestsFail].format(failing)}", file=sys.stderr)
        return 2
    return 0 if summary.clean else 1


_SENTENCES: dict[type[Exception], str] = {
    BadList: f"{LIST.relative_to(ROOT)} cannot be used: {{}}",
    choose.UnknownCommit: "unknown commit {}; give one that `git log` shows",
    reach.TestsFail: "tests fail without any mutant; fix them first: {}",
}


def _chosen(mutants: list[Mutant], since: str | None, paths: list[str]) -> list[Mutant]:
    if since is not None:
        mutants = choose.changed_since(mutants, since)
    return [mutant for mutant in mutants if not paths or mutant.path.startswith(tuple(paths))]


def _test_whole(mutants: list[Mutant], results: Results, workers: int) -> dict[Mutant, Verdict]:
    files = digests.test_files(WHOLE_TESTS)
    known = {mutant: results.verdict(mutant, files) for mutant in mutants}
    untested = [mutant for mutant in mutants if known[mutant] is None]
    if untested:
        print(
            f"{len(untested)} of {len(mutants)} mutants to test; measuring which tests reach which lines",
            file=sys.stderr,
        )
        reached = reach.measure(KEPT, workers)
        trials = [Trial(m, tests := reached.tests_for(m), {t: reached.seconds[t] for t in tests}) for m in untested]
        known |= _judged(trials, results, dict.fromkeys(untested, files), workers)
    return {mutant: verdict for mutant, verdict in known.items() if verdict is not None}


def _test_shells(mutants: list[Mutant], results: Results, verdicts: dict[Mutant, Verdict]) -> str:
    """Add the verdicts of the process shells; return the test files that fail without a mutant."""
    tests = {shell.path: list(shell.tests) for shell in SHELLS}
    files = {mutant: tests[mutant.path] for mutant in mutants}
    known = {mutant: results.verdict(mutant, files[mutant]) for mutant in mutants}
    untested = [mutant for mutant in mutants if known[mutant] is None]
    if untested:
        print(f"{len(untested)} of {len(mutants)} mutants of process shells to test", file=sys.stderr)
        wanted = list(dict.fromkeys(file for mutant in untested for file in files[mutant]))
        seconds = dict(run_jobs(wanted, _time_file, SHELL_WORKERS))
        if failing := [file for file, took in seconds.items() if took is None]:
            return ", ".join(failing)
        took = {file: s for file, s in seconds.items() if s is not None}
        trials = [Trial(mutant, files[mutant], took) for mutant in untested]
        known |= _judged(trials, results, files, SHELL_WORKERS)
    verdicts |= {mutant: verdict for mutant, verdict in known.items() if verdict is not None}
    return ""


def _time_file(tree: Tree, file: str) -> float | None:
    """Return how long a test file takes without a mutant, s; None if it fails."""
    begin = time.monotonic()
    ended = run_tests(tree.root, [file], None, SHELL_LIMIT_S)
    return time.monotonic() - begin if ended.passed else None


def _judged(
    trials: list[Trial], results: Results, files: dict[Mutant, list[str]], workers: int
) -> dict[Mutant, Verdict]:
    verdicts: dict[Mutant, Verdict] = {}
    reported_s = time.monotonic()
    for trial, verdict in run_jobs(trials, Judge(), workers):
        mutant = trial.mutant
        results.add(mutant, verdict, files[mutant])
        verdicts[mutant] = verdict
        if verdict.outcome not in NOTICED:
            print(f"{verdict.outcome}: {mutant.name}", file=sys.stderr, flush=True)
        if time.monotonic() - reported_s > PROGRESS_EVERY_S:
            reported_s = time.monotonic()
            print(f"{len(verdicts)} of {len(trials)} tested", file=sys.stderr, flush=True)
    return verdicts


if __name__ == "__main__":
    raise SystemExit(main())
