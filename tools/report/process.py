"""The report of a run, made in a process of its own: a report that cannot be made is no failure of the run.

Level `sim` starts it with the run, so that its imports and the reading of the log (most of its time) pass beside the
run; a wall-clock run starts it only after its end, because nothing may disturb the loop.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from robot_io.errors import EnvironmentFault
from robot_io.ipc.process import fresh_interpreter

TIMEOUT_S = 60.0


class ReportProcess:
    """`python -m tools.report.page LOG HTML PARENT`, which reads the log as it grows; a byte on stdin: it is whole."""

    def __init__(self, log: Path, page: Path) -> None:
        """Start it. Raises EnvironmentFault when no process can be started."""
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
            raise EnvironmentFault(f"no process for the report: {error.strerror}") from None

    def make(self) -> str:
        """Tell it that the log is finished, and let it write the page; return why it could not, "" when it did."""
        try:
            _, said = self._process.communicate(b"G", timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.drop()
            return f"it took longer than {TIMEOUT_S:g} s"
        except KeyboardInterrupt:
            self.drop()
            return "stopped by the operator"
        if self._process.returncode == 0:
            return ""
        lines = said.decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"its process ended with code {self._process.returncode}"

    def drop(self) -> None:
        """End it without a report; idempotent."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()
