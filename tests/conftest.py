"""For all tests: start processes as a terminal would."""

import signal

# Whoever starts the tests in the background of a shell leaves SIGINT ignored, and every process they start would
# inherit that; a handler of our own is not inherited, and the default is back.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
