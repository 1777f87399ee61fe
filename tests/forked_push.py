"""`push` in a process of its own that is forked from one with the program imported: half a second less for each.

For what a command says, writes and ends with. What depends on how a process starts (standard descriptors, signals, a
terminal, another `tools` on the path) and all that drives a base goes through `tests.push_runs.started`.

    ended = forked(tmp_path / "state", "run", "sim", "--fast", "--json")
    assert ended.code == 0, ended.err
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
import uuid
from pathlib import Path

from tests.forked import start
from tests.push_runs import MARK, ROOT, Ended, marked


def forked(
    state: Path, *argv: str, cwd: Path = ROOT, within_s: float = 80.0, env: dict[str, str] | None = None
) -> Ended:
    """Run `push` with `argv` to its end, its state folder in `state`; nothing of it may be left then."""
    mark = uuid.uuid4().hex
    files = state / mark
    files.mkdir(parents=True)
    env = {**os.environ, "XDG_STATE_HOME": str(state), MARK: mark, "TMPDIR": str(files), **(env or {})}
    process = start(_push, argv, str(files), str(cwd), env)
    process.join(within_s)
    code = process.exitcode
    if code is None:
        for pid in (process.pid, *marked(mark)):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
    process.join()
    assert code is not None, f"not over after {within_s} s: {(files / 'err').read_text(errors='replace')}"
    deadline_s = time.monotonic() + 3.0
    while left := marked(mark):
        assert time.monotonic() < deadline_s, f"left after the end: {left}"
        time.sleep(0.02)
    return Ended(code, (files / "out").read_text(errors="replace"), (files / "err").read_text(errors="replace"))


def _push(argv: tuple[str, ...], files: str, cwd: str, env: dict[str, str]) -> None:
    """What the forked process does, as an interpreter started with `-c` in `cwd` would."""
    os.setsid()
    for number, name in ((1, "out"), (2, "err")):
        fd = os.open(os.path.join(files, name), os.O_WRONLY | os.O_CREAT)  # noqa: PTH118
        os.dup2(fd, number)
        os.close(fd)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    sys.path.insert(0, "")
    sys.argv[:] = ["push", *argv]
    code = 1
    try:
        from robot_io._entry import main

        code = main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code)  # no cleaning up of the server's things
