"""Choose the mutants to test: all, those on changed lines, or a sample that does not change with other code."""

from __future__ import annotations

import hashlib
import re
import subprocess

from tools.dev.mutants.find import find_mutants
from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.targets import ROOT, SAMPLE, SEED, SHELLS, whole_paths


class UnknownCommit(Exception):
    """Git does not know this commit."""


def whole_mutants() -> list[Mutant]:
    """Return every mutant of the parts that are mutated completely."""
    return [mutant for path in whole_paths() for mutant in find_mutants(path, (ROOT / path).read_bytes())]


def shell_mutants() -> list[Mutant]:
    """Return every mutant of the process shells."""
    return [mutant for shell in SHELLS for mutant in find_mutants(shell.path, (ROOT / shell.path).read_bytes())]


def sample(mutants: list[Mutant], size: int = SAMPLE) -> list[Mutant]:
    """Return `size` of the mutants in their order, selected by a digest of each."""

    def draw(mutant: Mutant) -> bytes:
        return hashlib.sha256("\0".join((SEED, *mutant.place)).encode()).digest()

    drawn = set(sorted(mutants, key=draw)[:size])
    return [mutant for mutant in mutants if mutant in drawn]


def changed_since(mutants: list[Mutant], commit: str) -> list[Mutant]:
    """Return the mutants on lines that differ from `commit`; raises UnknownCommit."""
    lines = {path: _changed_lines(path, commit) for path in {mutant.path for mutant in mutants}}
    return [m for m in mutants if not lines[m.path].isdisjoint(range(m.line, m.last_line + 1))]


def lines_of_diff(diff: str) -> set[int]:
    """Return the new line numbers in a diff without context."""
    found: set[int] = set()
    for start, count in re.findall(r"^@@ -\S+ \+(\d+)(?:,(\d+))? @@", diff, re.MULTILINE):
        found.update(range(int(start), int(start) + int(count or 1)))
    return found


def _changed_lines(path: str, commit: str) -> set[int]:
    command = ["git", "diff", "--unified=0", "--no-color", "--no-ext-diff", "--end-of-options", commit, "--", path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise UnknownCommit(commit)
    return lines_of_diff(done.stdout)
