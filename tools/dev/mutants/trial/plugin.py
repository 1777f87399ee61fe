"""Pytest plugins for mutants: run the chosen tests in the chosen order, record failures and coverage."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from typing import Any

import hypothesis
import pytest

PROFILE = "mutants"


class ChosenTests:
    """Runs the tests named in `wanted`, in that order, and records which fail."""

    def __init__(self, wanted: list[str] | None) -> None:
        """wanted: names of tests; None means every collected test."""
        self.wanted = wanted
        self.failed: list[str] = []
        self.seconds: dict[str, float] = {}

    def pytest_collection(self) -> None:
        """Make Hypothesis use the same examples every time, without shrinking."""
        phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
        hypothesis.settings.register_profile(PROFILE, derandomize=True, database=None, phases=phases)
        hypothesis.settings.load_profile(PROFILE)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Keep the wanted tests, or all tests of a file that lacks one (a mutant can rename its parameters)."""
        if self.wanted is None:
            return
        order = {name: i for i, name in enumerate(self.wanted)}
        missing = {name.partition("::")[0] for name in order.keys() - {item.nodeid for item in items}}
        kept = [item for item in items if item.nodeid in order or item.nodeid.partition("::")[0] in missing]
        items[:] = sorted(kept, key=lambda item: order.get(item.nodeid, len(order)))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record duration and failure of one phase of a test."""
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Record a file that can no longer be imported."""
        if report.failed:
            self.failed.append(report.nodeid)


class CoverageContexts:
    """Tells the coverage tracer which test is running."""

    def __init__(self, tracer: Any) -> None:
        self.tracer = tracer

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """Attribute all lines run until the test ends, including fixtures, to it."""
        self.tracer.switch_context(item.nodeid)
        with contextlib.ExitStack() as stack:
            stack.callback(self.tracer.switch_context, "")
            return (yield)
