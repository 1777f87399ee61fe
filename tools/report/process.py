"""Make the report of a run in a separate process, so that a failing report does not fail the run.

At level `sim` it starts with the run, so that its imports and the reading of the log (most of its time) happen during
the run; a wall-clock run starts it only at its end, because nothing may disturb the loop.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from robot_io.errors import EnvironmentFault
from robot_io.ipc.process import fresh_interpreter

TIMEOUT_S = 60.0


class ReportProcess:
    """Runs `python -m tools.report.page LOG HTML PARENT`, which follows the log until a byte on stdin ends it."""

    def __init__(self, log: Path, page: Path) -> None:
        """Start the process. Raises EnvironmentFault if it cannot be started."""
        self.page = page
        command, environment = fresh_interpreter("tools.report.page")
        try:
            self._process = subprocess.Popen(
                [*command, str(log), str(page), str(os.getpid())],
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        except OSError as error:
            raise EnvironmentFault(f"the report's process cannot be started: {error.strerror}") from None

    def make(self) -> str:
        """Tell the process that the log is finished and wait for the page; return why it failed, "" if it succeeded."""
        try:
            _, errors = self._process.communicate(b"G", timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.drop()
            return f"it took longer than {TIMEOUT_S:g} s"
        except KeyboardInterrupt:
            self.drop()
            return "stopped by the operator"
        if self._process.returncode == 0:
            return ""
        lines = errors.decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"its process ended with code {self._process.returncode}"

    def drop(self) -> None:
        """End the process without a report; idempotent."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()
