"""Measures how long the steps of a law of one's own take: the next tick's input says so, and safety judges it.

A busy machine must not make a law slow: where another process took the processor during a step that did not wait by
itself, only the law's own processor time counts, and the garbage collector of this process does not run then.
"""

from __future__ import annotations

import gc
import resource
import time
from typing import Any

from control.laws.law import Law, Seen


class LawClock:
    """A law that is timed. `take_ns` returns the time of the last step once, 0 without one.

    least_ns: shorter steps count as 0, for level sim, where two runs with one seed give the same bytes.
    """

    def __init__(self, law: Law, least_ns: int = 0) -> None:
        self.name, self.Settings, self.State, self.initial = law.name, law.Settings, law.State, law.initial
        self.returns_to_path: bool = getattr(law, "returns_to_path", True)
        self._law = law
        self._least_ns = least_ns
        self._step_ns = 0

    def take_ns(self) -> int:
        """Return how long the last step took since the last call."""
        taken, self._step_ns = self._step_ns, 0
        return taken if taken > self._least_ns else 0

    def step(self, state: Any, seen: Seen) -> tuple[float, Any]:
        """Return what the law says."""
        collecting = gc.isenabled()
        gc.disable()
        before = resource.getrusage(resource.RUSAGE_THREAD)
        own_ns, began_ns = time.thread_time_ns(), time.monotonic_ns()
        try:
            return self._law.step(state, seen)
        finally:
            took_ns, own_ns = time.monotonic_ns() - began_ns, time.thread_time_ns() - own_ns
            after = resource.getrusage(resource.RUSAGE_THREAD)
            if after.ru_nvcsw == before.ru_nvcsw and after.ru_nivcsw != before.ru_nivcsw:
                took_ns = own_ns  # it did not wait, it was made to
            self._step_ns = max(took_ns, 1)
            if collecting:
                gc.enable()
