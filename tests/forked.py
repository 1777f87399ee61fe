"""A function in a process of its own, forked from one that has imported the program: what tests start by hundreds.

    with Forked(serve, "127.0.0.2") as emulator:
        emulator.stdin.write("report\n")
        assert emulator.stdout.readline()

The process they are forked from has no threads, and nothing of the tests' own process is in it.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload([
    "tests.forked", "tests.forked_push", "tests.wire.bridge_process", "tests.wire.ft300_process",
    "sim_backend.ft300.standalone", "sim_backend.ur10.emulator", "sim_backend.ur10.standalone", "tools.run.lockstep",
    *(f"tools.commands.{name}" for name in ("run", "run_trials", "replay", "report", "log", "config")),
])  # fmt: skip


def start(target: Callable[..., object], *args: Any) -> BaseProcess:
    """Start a function of a module; it ends with the tests, if not before."""
    with contextlib.chdir(ROOT):  # where the server finds the program first
        forkserver.ensure_running()
    process = SERVER.Process(target=target, args=args, daemon=True)
    process.start()
    return process


class Forked:
    """A running function whose stdin and stdout are pipes of text; the names are those of `subprocess.Popen`."""

    def __init__(self, target: Callable[..., object], *args: Any) -> None:
        their_in, our_in = SERVER.Pipe(duplex=False)
        our_out, their_out = SERVER.Pipe(duplex=False)
        self._process = start(_on_pipes, their_in, their_out, target, args)
        assert self._process.pid is not None
        self.pid = self._process.pid
        self.stdin = os.fdopen(os.dup(our_in.fileno()), "w", buffering=1)
        self.stdout = os.fdopen(os.dup(our_out.fileno()))
        for end in (their_in, our_in, our_out, their_out):
            end.close()

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def wait(self, within_s: float | None = None) -> int:
        """Return the exit code; raises subprocess.TimeoutExpired."""
        self._process.join(within_s)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("a forked process", within_s or 0.0)
        return self._process.exitcode

    def kill(self) -> None:
        """SIGKILL; idempotent."""
        self._process.kill()

    def close(self, within_s: float = 5.0) -> None:
        """End its stdin, and kill it when it does not end by that."""
        with contextlib.suppress(BrokenPipeError):
            self.stdin.close()
        try:
            self.wait(within_s)
        except subprocess.TimeoutExpired:
            self.kill()
            self.wait()
        self.stdout.close()

    def __enter__(self) -> Forked:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _on_pipes(stdin: Connection, stdout: Connection, target: Callable[..., object], args: tuple[Any, ...]) -> None:
    for number, end in ((0, stdin), (1, stdout)):
        os.dup2(end.fileno(), number)
        end.close()
    target(*args)
    sys.stdout.flush()
    os._exit(0)  # without what the server has registered for its own end
