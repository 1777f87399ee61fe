"""Shows a source of reports until the operator ends it: on a terminal, as one line a second, or as lines of JSON."""

from __future__ import annotations

import contextlib
from typing import Protocol

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.error_report import say_json
from robot_io.ipc.event_loop import EventLoop
from tools.watch.live_topics import LiveTopics
from tools.watch.reports import DeviceReport, Report, ReportReader, RunReport
from tools.watch.screen import one_line, picture
from tools.watch.seen import Seen
from tools.watch.terminal import Signals, Terminal
from tools.watch.view import View, as_json, view_of

DRAW_NS = 100 * NS_PER_MS
JSON_NS = 200 * NS_PER_MS
LINE_NS = NS_PER_S
SILENT_NS = 4 * NS_PER_S
"""A run that logs nothing for this long is said to be silent; at level sim its log grows every second or two."""


class Source(Protocol):
    """Where reports come from."""

    reports: ReportReader

    def read(self) -> list[Report]:
        """Return what came since the last call."""
        ...


class Show:
    """Takes reports of `source` in and shows them; `run` returns why it ended, "" when the operator ended it."""

    def __init__(
        self, seen: Seen, source: Source, words: str, *, as_json: bool, topics: LiveTopics | None = None
    ) -> None:
        """words: what is shown, for the title. topics: the live view of devices that were opened here."""
        self._seen = seen
        self._source = source
        self._words = words
        self._as_json = as_json
        self._topics = topics
        self._ended: str | None = None
        self._told_ns = monotonic_ns()
        self._loop = EventLoop()

    def run(self) -> str:
        """Show until the operator ends it or the source has ended."""
        with contextlib.ExitStack() as stack:
            stack.callback(self._loop.close)
            signals = stack.enter_context(Signals())
            terminal = stack.enter_context(Terminal()) if Terminal.is_there() and not self._as_json else None
            self._loop.add_fd(self._source.reports.fileno(), lambda _: self._take())
            self._loop.add_fd(signals.fileno(), lambda _: self._on_signal(signals))
            if terminal is not None:
                self._loop.add_fd(terminal.fileno(), lambda _: self._on_keys(terminal))
            period_ns = DRAW_NS if terminal is not None else JSON_NS if self._as_json else LINE_NS
            next_ns = shown_ns = monotonic_ns()
            while self._ended is None:
                self._loop.run_once(max(0, (next_ns - monotonic_ns()) // NS_PER_MS))
                if (now_ns := monotonic_ns()) < next_ns:
                    continue
                next_ns = now_ns + DRAW_NS
                self._take()
                view = self._view(now_ns)
                if self._topics is not None:
                    self._topics.show(view)
                if now_ns >= shown_ns:
                    self._show(view, terminal)
                    shown_ns = now_ns + period_ns
            if self._ended and terminal is None:
                self._show(self._view(monotonic_ns()), None)
        return self._ended

    def _take(self) -> None:
        for report in self._source.read():
            if isinstance(report, DeviceReport):
                self._seen.take_device(report)
                if self._topics is not None:
                    self._topics.take(report)
            elif isinstance(report, RunReport):
                self._seen.take_run(report)
                self._told_ns = monotonic_ns()
            else:
                self._ended = self._ended or report.text

    def _view(self, now_ns: int) -> View:
        words = self._words
        if self._seen.stage is not None and now_ns - self._told_ns > SILENT_NS:
            words += f" (SILENT for {(now_ns - self._told_ns) // NS_PER_S} s)"
        return view_of(self._seen, words, now_ns)

    def _show(self, view: View, terminal: Terminal | None) -> None:
        if terminal is not None:
            terminal.draw(picture(view, terminal.columns(), unicode=terminal.unicode))
        elif self._as_json:
            say_json(as_json(view))
        else:
            print(one_line(view), flush=True)

    def _on_signal(self, signals: Signals) -> None:
        signals.take()
        if signals.asked:
            self._ended = self._ended or ""

    def _on_keys(self, terminal: Terminal) -> None:
        keys = terminal.keys().lower()
        if "q" in keys:
            self._ended = self._ended or ""
        elif "t" in keys:
            self._seen.tare.begin()
