"""Re-run the ticks of a log from their inputs, and compare every byte of what comes out."""

from __future__ import annotations

from robot_io.log.logged_type import LoggedType
from robot_io.tick import SHORTENED, TICK_CDR, ControlTick, TickState, shortened
from tools.replay.difference import Difference, difference
from tools.run.tick_core import TickCore


class TickReplayer:
    """Re-runs ticks given in order and compares each; after a gap the state comes from the log."""

    def __init__(self, core: TickCore, tolerance: float | None, logged: LoggedType[ControlTick]) -> None:
        self._core = core
        self._logged = logged
        self._tolerance = tolerance
        self._state: TickState | None = None
        self.count = self.identical = self.gaps = 0
        self.last = -1
        self.first: Difference | None = None

    @property
    def state(self) -> TickState | None:
        """The state after the newest tick; None where it is not known."""
        return self._state

    def take(self, tick: ControlTick, payload: bytes) -> None:
        """Re-run and compare one tick."""
        number = tick.input.tick
        if self._state is None or number != self.last + 1 + tick.input.host.skipped:
            self.gaps += self._state is not None
            self._state = tick.before[0] if tick.before else None
        found: Difference | None = Difference(number, "before", "no state", "a state to start from")
        after: TickState | None = None if tick.reserved == SHORTENED else tick.after
        if self._state is not None:
            found, after = self._compare(tick, payload, self._state)
        self.count += 1
        self.identical += found is None
        self.first = self.first or found
        self._state = after if self._tolerance is None else self._as_logged(tick, after)
        self.last = number

    def _as_logged(self, tick: ControlTick, after: TickState | None) -> TickState | None:
        """Return the log's own state where it is whole, so that rounding errors do not accumulate; else `after`."""
        if tick.reserved != SHORTENED:
            return tick.after
        return self._core.fold(tick.before[0], tick.input)[0] if tick.before and after is not None else after

    def _compare(
        self, tick: ControlTick, payload: bytes, before: TickState
    ) -> tuple[Difference | None, TickState | None]:
        number = tick.input.tick
        try:
            after, output = self._core.fold(before, tick.input)
            kept = (before,) if tick.before else ()
            replayed = ControlTick(tick.crc32_before, 0, tick.input, kept, after, output)
            if tick.reserved == SHORTENED:
                replayed = shortened(replayed)
            encoded = TICK_CDR.encode(replayed)
            if self._logged.exact and encoded == payload:
                return None, after
            replayed = TICK_CDR.decode(encoded)  # as a log holds it: a whole number where a float belongs is one
        except Exception as error:  # nothing in a log may crash its replay; the run itself survived this tick
            state = None if tick.reserved == SHORTENED else tick.after
            return Difference(number, "output", "a tick", f"{type(error).__name__}: {error}"), state
        found = difference(number, tick, replayed, self._tolerance, self._logged.missing)
        if found is None and self._tolerance is None and self._logged.exact:
            found = Difference(number, "", "bytes", "other bytes")
        return found, after
