"""Whole runs of `push` for tests: each in a process of its own, watched from outside and searched for remains.

with started(tmp_path, "run", "emulated", *QUICK) as run:
    run.wait_for("PUSH")
    run.signal(signal.SIGINT)
    assert run.wait().code == 130
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from robot_io.log.world_messages import COMMAND_CDR, STATE_CDR
from robot_io.mcap.read import LogMessage, read_log
from robot_io.messages import BodyTwist
from tests.host_watch import HostStalled, HostWatch, repeated_when_the_host_stalls

ROOT = Path(__file__).resolve().parents[1]
PUSH = [sys.executable, "-c", "from robot_io._entry import main; raise SystemExit(main())"]
SAFETY_STOP = 5
SPOILING_MS = 30.0
"""The shortest pause that a safety check stops for by itself, 40 ms of silence of the arm, less a period of its own."""
MARK = "PUSH_TEST_RUN"
"""Inherited by every process of a run, so that what is left of it can be found."""

QUICK = (
    "--no-report",
    *("--set", "ft.tare_s=0.3"),
    *("--set", "control.approach_speed_m_per_s=0.1"),
    *("--set", "control.ramp_s=0.3"),
    *("--set", "control.retreat_m=0.0"),
)
"""Less waiting around a push; the push itself is the default one."""
FAST_TARE = ("--set", "ft.tare_s=1")
"""What a run gets that says nothing of its tare: the rigs' own 5 s are 4 s of waiting for every test."""


class Ended(NamedTuple):
    """What a program left behind."""

    code: int
    out: str
    err: str

    @property
    def last_object(self) -> dict[str, Any]:
        """The one object on stdout."""
        lines = self.out.splitlines()
        assert len(lines) == 1, self.out
        value: dict[str, Any] = json.loads(lines[0])
        return value


class Run:
    """A started program. `state` is its private state folder (locks, tares).

    host: where given, a safety stop while a processor of this machine stood still raises `HostStalled` in `wait`.
    """

    def __init__(self, state: Path, argv: tuple[str, ...], *, host: HostWatch | None = None, **popen: Any) -> None:
        self._host = host
        self._began_ns = time.monotonic_ns()
        self.mark = uuid.uuid4().hex
        self._files = state / self.mark
        self._files.mkdir(parents=True)
        env = {**os.environ, "XDG_STATE_HOME": str(state), MARK: self.mark, "TMPDIR": str(self._files)}
        env.setdefault("PYTHONPATH", str(ROOT))
        env.update(popen.pop("env", {}))
        popen.setdefault("stdin", subprocess.DEVNULL)
        with (self._files / "out").open("wb") as out, (self._files / "err").open("wb") as err:
            popen.setdefault("stdout", out)
            popen.setdefault("stderr", err)
            popen.setdefault("cwd", ROOT)
            if argv[:1] == ("run",) and not any("ft.tare_s" in word for word in argv):
                argv += FAST_TARE
            self.process = subprocess.Popen([*PUSH, *argv], env=env, start_new_session=True, **popen)

    @property
    def err(self) -> str:
        return (self._files / "err").read_text(errors="replace")

    @property
    def out(self) -> str:
        return (self._files / "out").read_text(errors="replace")

    def left_files(self) -> list[str]:
        """Return what it left in its folder for temporary files."""
        return sorted(path.name for path in self._files.iterdir() if path.name not in ("out", "err"))

    def wait_for(self, pattern: str, within_s: float = 40.0) -> None:
        """Wait until it has said something that matches `pattern` on stderr."""
        deadline_s = time.monotonic() + within_s
        while not re.search(pattern, self.err):
            if (code := self.process.poll()) is not None:
                self._blame_the_host(code)
            assert code is None, f"it ended before it said {pattern!r}: {self.err}"
            assert time.monotonic() < deadline_s, f"it did not say {pattern!r}: {self.err}"
            time.sleep(0.01)

    def signal(self, number: int) -> None:
        self.process.send_signal(number)

    def wait(self, within_s: float = 60.0) -> Ended:
        code = self.process.wait(within_s)
        self._blame_the_host(code)
        return Ended(code, (self._files / "out").read_text(errors="replace"), self.err)

    def _blame_the_host(self, code: int) -> None:
        if self._host is not None:
            blame_the_host(self._host, self._began_ns, code, self.err)

    def alive(self) -> dict[int, str]:
        """Return the processes of this run that are left (zombies are not counted), by pid."""
        return marked(self.mark)

    def wait_gone(self, within_s: float) -> None:
        """Wait until no process of this run is left."""
        deadline_s = time.monotonic() + within_s
        while left := self.alive():
            assert time.monotonic() < deadline_s, f"left after {within_s} s: {left}"
            time.sleep(0.02)

    def end(self) -> None:
        """Kill what is left."""
        self.process.kill()
        self.process.wait()
        for pid in self.alive():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def marked(mark: str) -> dict[int, str]:
    """Return the processes that were started with a mark (zombies are not counted), by pid."""
    needle = f"{MARK}={mark}".encode()
    found = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            if needle in (folder / "environ").read_bytes().split(b"\0") and _state(folder) != "Z":
                command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                found[int(folder.name)] = command
    return found


def blame_the_host(host: HostWatch, began_ns: int, code: int, err: str) -> None:
    """Raise HostStalled when a program ended in a safety stop while a processor stood still or was overloaded."""
    if code != SAFETY_STOP:
        return
    now_ns = time.monotonic_ns()
    stall_ms = max(host.worst_ms(began_ns, now_ns), host.worst_wait_ms(began_ns, now_ns))
    if stall_ms > SPOILING_MS:
        raise HostStalled(f"the host kept a process waiting for {stall_ms:.0f} ms: {err[-300:]}")


@contextlib.contextmanager
def started(state: Path, *argv: str, **popen: Any) -> Iterator[Run]:
    """Start `push` with `argv`; whatever happens, nothing of it stays."""
    run = Run(state, argv, **popen)
    try:
        yield run
    finally:
        run.end()


def pushed(folder: Path, *argv: str, host: HostWatch, stopped_by: str = "") -> Ended:
    """Run `push` with `argv` in `folder`, where `out` is its run folder; again when the host spoilt it.

    stopped_by: the fault that is to stop it, which is never the host's.
    """
    found: list[Ended] = []
    earlier: list[Path] = []

    @repeated_when_the_host_stalls
    def attempt(tmp_path: Path) -> None:
        if earlier:
            shutil.rmtree(folder / "out", ignore_errors=True)
        earlier.append(tmp_path)
        began_ns = time.monotonic_ns()
        with started(tmp_path / "state", *argv, cwd=folder) as run:
            found.append(run.wait())
            assert run.alive() == {}
        if not (stopped_by and stopped_by in found[-1].err):
            blame_the_host(host, began_ns, found[-1].code, found[-1].err)

    attempt(tmp_path=Path(tempfile.mkdtemp(dir=folder.parent)))
    return found[-1]


def finished(state: Path, *argv: str, within_s: float = 90.0, **popen: Any) -> Ended:
    """Run `push` with `argv` to its end; nothing of it may be left then."""
    with started(state, *argv, **popen) as run:
        ended = run.wait(within_s)
        run.wait_gone(3.0)
        return ended


def one_error(ended: Ended, code: int) -> dict[str, Any]:
    """Check that a program with `--json` failed with one sentence and one object; return the error in it."""
    assert ended.code == code, ended
    assert "Traceback" not in ended.err, ended.err
    assert set(ended.last_object) == {"schema", "error"}
    error: dict[str, Any] = ended.last_object["error"]
    assert error["code"] == code
    sentences = [line for line in ended.err.splitlines() if line.startswith("push: ")]
    assert len(sentences) == 1, ended.err
    assert error["what"] in ended.err
    return error


def messages(log: Path, topic: str) -> list[LogMessage]:
    """Return the messages of a topic."""
    return [message for message in read_log(log) if message.topic == topic]


def world_of(log: Path) -> tuple[list[tuple[int, BodyTwist]], list[tuple[int, BodyTwist]]]:
    """Return when (CLOCK_MONOTONIC, ns) which command came to the base, and the velocity of its wheels over time."""
    commands = [COMMAND_CDR.decode(message.payload) for message in messages(log, "/world/command")]
    states = [STATE_CDR.decode(message.payload) for message in messages(log, "/world/state")]
    return [(c.arrival_ns, c.twist) for c in commands if not c.is_switch], [(s.t_ns, s.velocity) for s in states]


def stands(twist: BodyTwist) -> bool:
    """Return whether a velocity is exactly zero."""
    return (twist.vx, twist.vy, twist.omega) == (0.0, 0.0, 0.0)


def _state(folder: Path) -> str:
    return (folder / "stat").read_text().rpartition(")")[2].split()[0]
