"""The faults of one run: which device each belongs to, when the run began, and what each of them has changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from robot_io.clock import ClockNs
from robot_io.rig.fault_words import FaultWord, parse_fault
from sim_backend.injection.stages import Progress


class Injection:
    """The faults that `words` ask for, on `clock`; `on_first(word, ns)` is called when one first changes a sample.

    Nothing is changed before `begin`. Raises ConfigError for a word that cannot be read.
    """

    def __init__(self, words: Sequence[str], clock: ClockNs, on_first: Callable[[FaultWord, int], None]) -> None:
        self.clock = clock
        self._faults = [Progress(parse_fault(word), on_first) for word in words]

    def begin(self, at_ns: int) -> None:
        """Count the times of the faults from `at_ns`, the first tick; later calls have no effect."""
        for fault in self._faults:
            if fault.begin_ns is None:
                fault.begin_ns = at_ns

    def of(self, device: str) -> list[Progress]:
        """Return the faults of a device (`base` has four: base.pose, ...)."""
        return [fault for fault in self._faults if fault.word.device == device]

    def counts(self, *devices: str) -> dict[str, int]:
        """Return how many samples each fault has changed, by its words; of some devices only, if named."""
        return {fault.word.text: fault.changed for fault in self._faults if not devices or fault.word.device in devices}


def padded(value: tuple[float, ...], size: int) -> tuple[float, ...]:
    """Return a value with zeros behind it."""
    return (*value, *(0.0,) * (size - len(value)))
