"""For all tests: draws that repeat, processes started as by a terminal, what every push needs, what was not measured.

Hypothesis draws the same every time. `make test-all` draws anew, from a seed that it prints:
`make test-all SEED=NUMBER` draws it again.
"""

import contextlib
import signal

import hypothesis
import pytest

from tests.host_watch import UNMEASURED, HostWatch

hypothesis.settings.register_profile("same", derandomize=True, database=None, deadline=None)
hypothesis.settings.register_profile("anew", database=None, deadline=None)
hypothesis.settings.load_profile("same")

# Whoever starts the tests in the background of a shell leaves SIGINT ignored, and every process they start would
# inherit that; a handler of our own is not inherited, and the default is back.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module")
def state(tmp_path_factory):
    """A state folder (locks, tares) that is not the user's."""
    return tmp_path_factory.mktemp("state")


@pytest.fixture(scope="module")
def host():
    """Watches this machine while a module's tests run."""
    with contextlib.closing(HostWatch()) as watch:
        yield watch


def pytest_addoption(parser):
    parser.addoption("--measure-all", action="store_true", help="fail where the host kept a bound from being measured")


def pytest_configure(config):
    UNMEASURED.fails = config.getoption("--measure-all")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    report.user_properties = [*report.user_properties, *(("unmeasured", what) for what in UNMEASURED.take())]
    return report


def pytest_terminal_summary(terminalreporter, config):
    seed = config.getoption("--hypothesis-seed")
    if seed is not None:
        terminalreporter.write_line(f"Hypothesis drew from seed {seed}; again: make test-all SEED={seed}")
    found = [
        f"UNMEASURED {report.nodeid}: {what}"
        for reports in terminalreporter.stats.values()
        for report in reports
        if isinstance(report, pytest.TestReport)
        for name, what in report.user_properties
        if name == "unmeasured"
    ]
    if found:
        terminalreporter.section("the host stalled: measure these on a quiet machine")
        for line in found:
            terminalreporter.write_line(line)
