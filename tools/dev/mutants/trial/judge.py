"""Judge whether a test notices a mutant."""

from __future__ import annotations

from typing import NamedTuple

from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.trial.session import run_tests
from tools.dev.mutants.trial.tree import Tree

FIRST_S = 0.5
"""The quickest tests, up to this total time and from few files, run first: most mutants are killed by them."""
FIRST_FILES = 3
SLOWER = 10.0
"""A mutant's tests may take this many times as long as without it, plus `MORE_S`, before it counts as a timeout."""
MORE_S = 10.0


class Trial(NamedTuple):
    """A mutant and the tests to run against it: tests by name, or complete files in this order."""

    mutant: Mutant
    tests: list[str]
    seconds: dict[str, float]


class Verdict(NamedTuple):
    """The result for one mutant."""

    outcome: str
    """killed, timeout (which counts as killed), survived or unreached."""
    killer: str
    """The first test that failed."""


class Judge:
    """Judges one mutant after another, and remembers which tests killed most."""

    def __init__(self) -> None:
        self._kills: dict[str, dict[str, int]] = {}

    def __call__(self, tree: Tree, trial: Trial) -> Verdict:
        """Run the tests in a tree to which the mutant is applied."""
        if not trial.tests:
            return Verdict("unreached", "")
        mutant = trial.mutant
        source = mutant.apply((tree.root / mutant.path).read_bytes())
        with tree.changed(mutant.path, source):
            for batch in self._batches(trial):
                verdict = self._run(tree, trial, batch)
                if verdict.outcome != "survived":
                    return verdict
        return Verdict("survived", "")

    def _run(self, tree: Tree, trial: Trial, batch: list[str]) -> Verdict:
        limit_s = MORE_S + SLOWER * sum(trial.seconds.get(test, 0.0) for test in batch)
        files = list(dict.fromkeys(_file(test) for test in batch))
        result = run_tests(tree.root, files, batch if "::" in batch[0] else None, limit_s)
        if result.passed:
            return Verdict("survived", "")
        if not result.failed:
            return Verdict("timeout", "")
        kills = self._kills.setdefault(trial.mutant.path, {})
        kills[result.failed[0]] = kills.get(result.failed[0], 0) + 1
        return Verdict("killed", result.failed[0])

    def _batches(self, trial: Trial) -> list[list[str]]:
        """Return the tests in two batches, those that killed mutants of this file first; complete files one by one."""
        if "::" not in trial.tests[0]:
            return [[file] for file in trial.tests]
        kills = self._kills.get(trial.mutant.path, {})
        order = sorted(trial.tests, key=lambda test: trial.seconds.get(test, 0.0) / (1 + kills.get(test, 0)))
        first: list[str] = []
        files: set[str] = set()
        left_s = FIRST_S
        for test in order:
            left_s -= trial.seconds.get(test, 0.0)
            if first and (left_s < 0.0 or len(files | {_file(test)}) > FIRST_FILES):
                break
            first.append(test)
            files.add(_file(test))
        taken = set(first)
        rest = [test for test in order if test not in taken]
        return [_by_file(first), _by_file(rest)] if rest else [_by_file(first)]


def _file(test: str) -> str:
    return test.partition("::")[0]


def _by_file(tests: list[str]) -> list[str]:
    """Return the tests grouped by file, so that a file's fixtures are set up once."""
    order = {file: i for i, file in enumerate(dict.fromkeys(map(_file, tests)))}
    return sorted(tests, key=lambda test: order[_file(test)])
