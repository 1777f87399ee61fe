"""Measure which tests run which lines, and how long they take; results are kept for each test file."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from tools.dev.mutants import digests
from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.targets import WHOLE, WHOLE_TESTS
from tools.dev.mutants.trial.pool import run_jobs
from tools.dev.mutants.trial.session import run_tests
from tools.dev.mutants.trial.tree import Tree

PATIENCE_S = 12.0
"""Of the tests that reach a mutant, the quickest are run, up to this total time."""
FILE_LIMIT_S = 900.0
Measured = dict[str, Any]
"""`seconds`: test to s; `reach`: test to file to lines; `failed`: names of tests."""


class TestsFail(Exception):
    """Tests fail without any mutant; the message names them."""


class Reach:
    """Tells which tests reach a mutant, the quickest first."""

    def __init__(self, measured: list[Measured]) -> None:
        self.seconds: dict[str, float] = {}
        self._tests: dict[str, dict[int, set[str]]] = {}
        for one in measured:
            self.seconds |= one["seconds"]
            for test, files in one["reach"].items():
                for path, lines in files.items():
                    for line in lines:
                        self._tests.setdefault(path, {}).setdefault(line, set()).add(test)

    def tests_for(self, mutant: Mutant) -> list[str]:
        """Return the tests that run the mutant's lines.

        Code run at import belongs to no test: the tests of the module's functions come first, then all others.
        """
        lines = self._tests.get(mutant.path, {})
        if mutant.function:
            wanted = {mutant.statement_line, *range(mutant.line, mutant.last_line + 1)}
            return self._within_patience(set().union(*(lines.get(line, set()) for line in wanted)), set())
        near: set[str] = set().union(*lines.values())
        return self._within_patience(near, self.seconds.keys() - near)

    def _within_patience(self, near: set[str], far: set[str]) -> list[str]:
        chosen: list[str] = []
        left_s = PATIENCE_S
        for group in (near, far):
            for test in sorted(group, key=lambda test: (self.seconds.get(test, 0.0), test)):
                left_s -= self.seconds.get(test, 0.0)
                if left_s < 0.0 and chosen:
                    return chosen
                chosen.append(test)
        return chosen


def measure(folder: Path, workers: int) -> Reach:
    """Return the reach of the tests of completely mutated parts; `folder` stores measurements for later sessions.

    Raises TestsFail.
    """
    files = digests.test_files(WHOLE_TESTS)
    kept = folder / "reach"
    kept.mkdir(parents=True, exist_ok=True)
    places = {file: kept / f"{_key(file)}.json" for file in files}
    for file, one in run_jobs([file for file in files if not places[file].exists()], _measure_file, workers):
        if one["failed"]:
            raise TestsFail(", ".join(one["failed"]))
        places[file].write_text(json.dumps(one))
    for stale in set(kept.iterdir()) - set(places.values()):
        stale.unlink()
    return Reach([json.loads(place.read_text()) for place in places.values()])


def _key(file: str) -> str:
    text = f"{file} {digests.of_tests([file])} {digests.of_product()} {WHOLE}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _measure_file(tree: Tree, file: str) -> Measured:
    """Time the tests without tracing, then trace them, which is several times slower."""
    timed = run_tests(tree.root, [file], None, FILE_LIMIT_S, stop=False)
    failed = timed.failed
    if failed:  # a test disturbed by a busy machine passes when run alone
        failed = run_tests(tree.root, [file], failed, FILE_LIMIT_S, stop=False).failed
    if not (timed.passed or timed.seconds):
        failed = [file]
    globs = ",".join(f"{tree.root}/{glob}" for glob in WHOLE)
    traced = run_tests(tree.root, [file], None, FILE_LIMIT_S, stop=False, measure=globs)
    return {"seconds": timed.seconds, "reach": traced.reach, "failed": failed}
