"""Every processor kept busy at normal priority while something else is measured."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator

LONGEST_S = 900
"""The busy processes end by themselves after this long, whatever becomes of us."""
_BUSY = f"import signal; signal.alarm({LONGEST_S})\nwhile True: pass"


@contextlib.contextmanager
def full_load(*, wanted: bool = True) -> Iterator[None]:
    """Keep one process per processor busy; nothing if not `wanted`."""
    count = (os.cpu_count() or 1) if wanted else 0
    busy = [subprocess.Popen([sys.executable, "-c", _BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()
