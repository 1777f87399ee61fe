"""A UR10 emulator in a process of its own, for tests: started here, driven by JSON lines on its stdin."""

import ctypes
import json
import os
import select
import signal
import time
from collections.abc import Callable, Iterable
from typing import Any

from tests.forked import Forked

READY_WITHIN_S = 10.0
_next_address = 0


def fresh_address() -> str:
    """Return a loopback address no other test process uses: from this process's id and a counter."""
    global _next_address
    _next_address += 1
    pid = os.getpid()
    return f"127.{1 + (pid >> 8) % 250}.{pid % 250}.{_next_address % 250 + 2}"


def wait_until(condition: Callable[[], Any], what: str, within_s: float = 5.0) -> Any:
    """Return the condition's first true value; fail with `what` when there is none in time."""
    deadline = time.monotonic() + within_s
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < deadline, f"not within {within_s} s: {what}"
        time.sleep(0.002)


class EmulatorProcess:
    """Calls of methods run in the emulator: `robot.call("freeze", True)`, `robot.get("requests.script_bytes")`."""

    def __init__(self, host: str | None = None, **options: Any) -> None:
        self.host = host or fresh_address()
        self._process = Forked(serve, {"host": self.host, **options})
        assert self._read() == "ready"

    def call(self, name: str, *args: Any) -> Any:
        """Call `emulator.<name>(*args)` there."""
        return self._ask({"call": name, "args": args})

    def get(self, path: str) -> Any:
        """Return an attribute there, by dotted path, as JSON."""
        return self._ask({"get": path})

    def freeze_process(self) -> None:
        """SIGSTOP."""
        self._process.send_signal(signal.SIGSTOP)

    def thaw_process(self) -> None:
        """SIGCONT."""
        self._process.send_signal(signal.SIGCONT)

    def kill(self) -> None:
        """SIGKILL and reap; idempotent."""
        self._process.kill()
        self._process.close()

    def __enter__(self) -> "EmulatorProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def _ask(self, question: dict[str, Any]) -> Any:
        self._process.stdin.write(json.dumps(question) + "\n")
        return self._read()

    def _read(self) -> Any:
        readable, _, _ = select.select([self._process.stdout], [], [], READY_WITHIN_S)
        line = self._process.stdout.readline() if readable else ""
        if not line:
            self._process.kill()
            raise AssertionError("the emulator gave no answer")
        return json.loads(line)


def serve(options: dict[str, Any]) -> None:
    """Serve one emulator until stdin ends."""
    from robot_io.ipc.event_loop import EventLoop
    from sim_backend.ft300.standalone import ConstantWrench
    from sim_backend.ur10.emulator import UrEmulator
    from sim_backend.ur10.models import BY_NAME
    from sim_backend.ur10.standalone import StillArm

    ctypes.CDLL(None).prctl(1, int(signal.SIGKILL), 0, 0, 0)  # die with the test
    if "version" in options:
        options["version"] = tuple(options["version"])
    if "model" in options:
        options["model"] = BY_NAME[options["model"]]
    if "wrench" in options:
        options["wrench"] = ConstantWrench(tuple(options["wrench"]))
    loop = EventLoop()
    emulator = UrEmulator(loop, StillArm(), **options)
    rest = b""

    def on_command(_events: int) -> None:
        nonlocal rest
        data = os.read(0, 65536)
        if not data:
            loop.stop()
            return
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            say(answer(json.loads(line)))

    def answer(question: dict[str, Any]) -> Any:
        value: Any = emulator
        for part in question.get("get", question.get("call")).split("."):
            value = value[part] if isinstance(value, dict) else getattr(value, part)
        return value(*question["args"]) if "call" in question else value

    def plain(value: Any) -> Any:
        return list(value) if isinstance(value, Iterable) else repr(value)

    def say(value: Any) -> None:
        print(json.dumps(value, default=plain), flush=True)

    loop.add_fd(0, on_command)
    say("ready")
    loop.run()
    emulator.close()
