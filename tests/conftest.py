"""For all tests: start processes as a terminal would; what every push of a test needs."""

import contextlib
import signal

import pytest

from tests.host_watch import HostWatch

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
