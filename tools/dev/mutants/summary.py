"""Summarise a session: survivors, wrong entries in the list, figures by folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from tools.dev.mutants.equivalents import Equivalent
from tools.dev.mutants.mutant import Mutant
from tools.dev.mutants.trial.judge import Verdict

NOTICED = ("killed", "timeout")


class Summary:
    """Sorts verdicts into expected ones and those to report."""

    def __init__(self, verdicts: dict[Mutant, Verdict], listed: list[Equivalent], existing: Iterable[Mutant]) -> None:
        """existing: all mutants of today's code, tested or not; an entry that matches none of them is stale."""
        places = {entry.place for entry in listed}
        there = {mutant.place for mutant in existing}
        self.verdicts = verdicts
        self.survivors = [m for m, v in verdicts.items() if v.outcome not in NOTICED and m.place not in places]
        self.stale = [entry for entry in listed if entry.place not in there]
        killed = {m.place for m, v in verdicts.items() if v.outcome in NOTICED}
        survived = {m.place for m, v in verdicts.items() if v.outcome not in NOTICED}
        self.not_equivalent = [entry for entry in listed if entry.place in killed - survived]
        self.equivalents = {m for m, v in verdicts.items() if v.outcome not in NOTICED and m.place in places}

    @property
    def clean(self) -> bool:
        """Return whether every mutant was killed or is listed, and every entry in the list is correct."""
        return not (self.survivors or self.stale or self.not_equivalent)

    def lines(self) -> list[str]:
        """Return the lines to print: survivors first, the figures last."""
        text = [mutant.name for mutant in self.survivors]
        text += [f"listed, but no such mutant: {_words(entry)}" for entry in self.stale]
        text += [f"listed as equivalent, but a test kills it: {_words(entry)}" for entry in self.not_equivalent]
        total: Counter[str] = Counter()
        killed: Counter[str] = Counter()
        for mutant, verdict in self.verdicts.items():
            if mutant in self.equivalents:
                continue
            folder = mutant.path.rpartition("/")[0]
            total[folder] += 1
            killed[folder] += verdict.outcome in NOTICED
        text += [f"{folder:24} {killed[folder]:5}/{total[folder]} killed" for folder in sorted(total)]
        unreached = sum(self.verdicts[mutant].outcome == "unreached" for mutant in self.survivors)
        more = f", {len(self.equivalents)} equivalent" + (f", {unreached} reached by no test" if unreached else "")
        text.append(f"{'all':24} {killed.total():5}/{total.total()} killed{more}")
        return text


def _words(entry: Equivalent) -> str:
    return f"{entry.path}: {entry.before} -> {entry.after}"
