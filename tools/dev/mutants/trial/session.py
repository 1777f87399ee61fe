"""Run pytest in a forked process: fast, because libraries are already loaded, and without side effects afterwards."""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import select
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import NamedTuple

import pytest

from tools.dev.mutants.targets import PRODUCT, ROOT
from tools.dev.mutants.trial.plugin import ChosenTests, CoverageContexts

PRELOADED = (
    "hypothesis.strategies",
    "hypothesis.internal.conjecture.engine",
    "msgspec",
    "mcap.reader",
    "serial",
    "numpy",
)
LOADED_BEFORE = "ignore:Module already imported:pytest.PytestAssertRewriteWarning"
OPTIONS = ["-q", "--tb=line", "-p", "no:cacheprovider", "-p", "no:xdist", "-W", LOADED_BEFORE]
_SUBREAPER = 36
"""PR_SET_CHILD_SUBREAPER of prctl(2): orphans of a killed test become our children, so that they can be killed too."""


class SessionResult(NamedTuple):
    """The result of a session."""

    passed: bool
    failed: list[str]
    """The tests that failed, in order; empty after a timeout or a crash of pytest itself."""
    seconds: dict[str, float]
    reach: dict[str, dict[str, list[int]]]
    """Lines by file by test; only for a measured session."""
    output: str


def prepare() -> None:
    """Load the libraries that tests use, and adopt orphans. Call it once, in the process that will fork."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # numpy would start threads, and threads do not survive a fork
    for name in PRELOADED:
        importlib.import_module(name)
    ctypes.CDLL(None, use_errno=True).prctl(_SUBREAPER, 1, 0, 0, 0)


def run_tests(
    root: Path, files: list[str], wanted: list[str] | None, limit_s: float, *, stop: bool = True, measure: str = ""
) -> SessionResult:
    """Run tests of the tree at `root` and return the result; after `limit_s` all its processes are killed.

    measure: comma-separated globs of files whose lines are recorded for each test. stop: end at the first failure.
    """
    out = root / ".session.json"
    out.unlink(missing_ok=True)
    pid = os.fork()
    if pid == 0:
        _child(root, files, wanted, out, stop=stop, measure=measure)
    try:
        _wait(pid, limit_s)
    finally:
        _kill_all(pid)
    text = (root / ".session.log").read_text(errors="replace")
    try:
        value = json.loads(out.read_text())
    except (OSError, ValueError):
        return SessionResult(False, [], {}, {}, text)
    return SessionResult(value["code"] == 0, value["failed"], value["seconds"], value["reach"], text)


def _wait(pid: int, limit_s: float) -> None:
    fd = os.pidfd_open(pid)
    try:
        select.select([fd], [], [], limit_s)
    finally:
        os.close(fd)


def _kill_all(pid: int) -> None:
    """Kill the session and the orphans adopted from it, until none is left."""
    _kill_group(pid)
    os.waitpid(pid, 0)
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
        if not children:
            return
        for child in map(int, children):
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _kill_group(pid: int) -> None:
    for kill in (os.killpg, os.kill):  # the group may not exist yet
        try:
            kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue


def _child(root: Path, files: list[str], wanted: list[str] | None, out: Path, *, stop: bool, measure: str) -> None:
    """Run pytest in another tree; does not return."""
    code = 70
    try:
        os.setsid()
        os.chdir(root)
        log = os.open(".session.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(log, 1)
        os.dup2(log, 2)
        _move_to(root)
        code = _pytest(files, wanted, out, stop=stop, measure=measure)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _move_to(root: Path) -> None:
    # Each session would compile the program and rewrite its tests' assertions again where byte code is not kept.
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPATH"] = str(root)
    here = {"", str(ROOT), str(ROOT.resolve())}
    sys.path[:] = [str(root), *(entry for entry in sys.path if entry not in here)]
    for name in list(sys.modules):
        if name.partition(".")[0] in {*PRODUCT, "tests"}:
            del sys.modules[name]
    importlib.invalidate_caches()


def _pytest(files: list[str], wanted: list[str] | None, out: Path, *, stop: bool, measure: str) -> int:
    chosen = ChosenTests(wanted)
    plugins: list[object] = [chosen]
    tracer = None
    if measure:
        from coverage import Coverage

        tracer = Coverage(data_file=None, include=measure.split(","), config_file=False)
        tracer.start()
        plugins.append(CoverageContexts(tracer))
    options = [*OPTIONS, "-x"] if stop else OPTIONS
    code = int(pytest.main([*options, *files], plugins=plugins))
    if wanted is None and code == pytest.ExitCode.NO_TESTS_COLLECTED:
        code = 0  # all tests of the file are long ones
    reach: dict[str, dict[str, list[int]]] = {}
    if tracer is not None:
        tracer.stop()
        data = tracer.get_data()
        for file in data.measured_files():
            path = Path(file).relative_to(Path.cwd()).as_posix()
            for line, tests in data.contexts_by_lineno(file).items():
                for test in filter(None, tests):
                    reach.setdefault(test, {}).setdefault(path, []).append(line)
    value = {"code": code, "failed": chosen.failed, "seconds": chosen.seconds, "reach": reach}
    out.write_text(json.dumps(value))
    return code
