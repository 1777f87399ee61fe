"""Store results as lines of JSON, so that an interrupted session continues where it stopped."""

from __future__ import annotations

import json
from pathlib import Path

from tools.dev.mutants import digests
from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.targets import ROOT
from tools.dev.mutants.trial.judge import Verdict


class Results:
    """Results that are still valid: neither the source nor the killing test (if none, any test) has changed."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._known: dict[str, dict[str, str]] = {}
        if file.exists():
            for line in file.read_text().splitlines():
                try:
                    one = json.loads(line)
                except ValueError:  # a line cut short when a session was killed
                    continue
                self._known[one["id"]] = one

    def verdict(self, mutant: Mutant, files: list[str]) -> Verdict | None:
        """Return the stored verdict on a mutant whose tests are in `files`, or None."""
        one = self._known.get(_id(mutant))
        if one is None:
            return None
        killer = one["killer"].partition("::")[0]
        if killer and not (ROOT / killer).exists():
            return None
        if one["tests"] != digests.of_tests([killer] if killer else files):
            return None
        return Verdict(one["outcome"], one["killer"])

    def add(self, mutant: Mutant, verdict: Verdict, files: list[str]) -> None:
        """Store a result immediately."""
        killer = verdict.killer.partition("::")[0]
        tests = digests.of_tests([killer] if killer else files)
        one = {
            "id": _id(mutant),
            "outcome": verdict.outcome,
            "killer": verdict.killer,
            "tests": tests,
            "name": mutant.name,
        }
        self._known[one["id"]] = one
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a") as out:
            out.write(json.dumps(one) + "\n")


def _id(mutant: Mutant) -> str:
    """Return an id: the mutant's position in one version of its file."""
    return f"{digests.of_file(mutant.path)[:16]} {mutant.path} {mutant.start} {mutant.end} {mutant.text}"
