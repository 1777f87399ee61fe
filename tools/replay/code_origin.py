"""Compare the code that wrote a log with today's: different code explains a difference in replay."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from robot_io.log.log_format import LOG_FORMAT
from tools.run.facts.code_facts import COMMIT_FACT, DIRTY_FACT, PROGRAM_FACT

_SHOWN = 12


class CodeOrigin(msgspec.Struct, frozen=True):
    """The code that wrote a log, compared with today's."""

    format: int
    commit: str
    dirty: bool
    other: bool
    """Not known to be the same as today's: a different or unknown commit, or uncommitted changes then or now."""
    code: str
    """Both as text: "commit 1f9c..., today's is commit 07ab..."."""

    @property
    def note(self) -> str:
        """Note on a log whose replay is identical; "" if there is nothing to note."""
        return f"made by {self.code}" if self.other else ""

    @property
    def cause(self) -> str:
        """Possible cause of a difference in replay; "" if the code is the same."""
        return f"made by other code ({self.code})" if self.other else ""


def compare_code(log: Mapping[str, str], today: Mapping[str, str], log_format: int) -> CodeOrigin:
    """Compare the code facts of a log with those of the running code."""
    commit, dirty = log.get(COMMIT_FACT, ""), log.get(DIRTY_FACT) == "True"
    if commit or today.get(COMMIT_FACT):
        same = commit == today.get(COMMIT_FACT) and not dirty and today.get(DIRTY_FACT) != "True"
    else:  # two installations, neither of them a checkout
        same = log.get(PROGRAM_FACT) == today.get(PROGRAM_FACT) and log_format == LOG_FORMAT
    return CodeOrigin(log_format, commit, dirty, not same, f"{_words(log)}; today's is {_words(today)}")


def _words(facts: Mapping[str, str]) -> str:
    commit = facts.get(COMMIT_FACT, "")
    if not commit:
        return f"an unknown commit of {facts.get(PROGRAM_FACT, 'an unknown version')}"
    return f"commit {commit[:_SHOWN]}{', with uncommitted changes' if facts.get(DIRTY_FACT) == 'True' else ''}"
