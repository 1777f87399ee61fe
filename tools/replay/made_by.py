"""Which code made a log, in words: the same as today's, or other code, which explains a difference."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from robot_io.log.log_format import LOG_FORMAT
from tools.run.code_facts import COMMIT_FACT, DIRTY_FACT, PROGRAM_FACT

_SHOWN = 12


class MadeBy(msgspec.Struct, frozen=True):
    """The code of a log beside today's."""

    format: int
    commit: str
    dirty: bool
    other: bool
    """Not known to be today's: another commit, an unknown one, or uncommitted changes then or now."""
    code: str
    """Both in words: "commit 1f9c..., today's is commit 07ab..."."""

    @property
    def note(self) -> str:
        """What to say of a log that came out identical; "" when there is nothing to say."""
        return f"made by {self.code}" if self.other else ""

    @property
    def cause(self) -> str:
        """What to say of one that did not; "" when the code is the same."""
        return f"made by other code ({self.code})" if self.other else ""


def made_by(log: Mapping[str, str], today: Mapping[str, str], its_format: int) -> MadeBy:
    """Compare the facts of a log with those of the code that runs now."""
    commit, dirty = log.get(COMMIT_FACT, ""), log.get(DIRTY_FACT) == "True"
    if commit or today.get(COMMIT_FACT):
        same = commit == today.get(COMMIT_FACT) and not dirty and today.get(DIRTY_FACT) != "True"
    else:  # two installations, neither of them a checkout
        same = log.get(PROGRAM_FACT) == today.get(PROGRAM_FACT) and its_format == LOG_FORMAT
    return MadeBy(its_format, commit, dirty, not same, f"{_words(log)}; today's is {_words(today)}")


def _words(facts: Mapping[str, str]) -> str:
    commit = facts.get(COMMIT_FACT, "")
    if not commit:
        return f"an unknown commit of {facts.get(PROGRAM_FACT, 'an unknown version')}"
    return f"commit {commit[:_SHOWN]}{', with uncommitted changes' if facts.get(DIRTY_FACT) == 'True' else ''}"
