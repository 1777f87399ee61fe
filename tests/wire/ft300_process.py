"""An FT 300 emulator in a process of its own, for tests; also what runs in that process.

    with ft300_process(latency_ms=16, knobs={"ack": False}) as emulator:
        Ft300(emulator.port)
        emulator.ask("stall", 0.2)

Commands and answers are one JSON line each; the process ends when its stdin does.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import time
from collections.abc import Iterator
from typing import Any

from robot_io.ipc.event_loop import EventLoop
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.ft300.knobs import Ft300Knobs
from tests.forked import Forked

START_LIMIT_S = 20.0

WRENCH = (12.34, -56.78, 100.0, 0.1, -1.23, 3.21)


class Ramp:
    """A source whose Fx counts samples (0.01 N each, modulo 200 N), so that every packet tells its place."""

    def __init__(self) -> None:
        self.reads = 0

    def read_ft(self, t_ns: int) -> tuple[float, float, float, float, float, float]:
        self.reads += 1
        return (self.reads % 20000) / 100, -56.78, 100.0, 0.1, -1.23, 3.21


class Pressed:
    """A source with a constant wrench, until told another."""

    def __init__(self, wrench: tuple[float, ...]) -> None:
        self.wrench = wrench

    def read_ft(self, t_ns: int) -> tuple[float, ...]:
        return self.wrench


class EmulatorProcess:
    def __init__(self, process: Forked) -> None:
        self._process = process
        self.pid = process.pid
        self.port = str(self._answer()["port"])

    def ask(self, command: str, *args: Any) -> dict[str, Any]:
        """Send a command; return its answer."""
        self._process.stdin.write(json.dumps([command, *args]) + "\n")
        return self._answer()

    def counters(self) -> dict[str, int]:
        return self.ask("counters")

    def _answer(self) -> dict[str, Any]:
        ready, _, _ = select.select([self._process.stdout], [], [], START_LIMIT_S)
        line = self._process.stdout.readline() if ready else ""
        assert line, "the emulator process gave no answer"
        answer: dict[str, Any] = json.loads(line)
        return answer


@contextlib.contextmanager
def ft300_process(**options: Any) -> Iterator[EmulatorProcess]:
    """Run an emulator; options as of `Ft300Emulator`, plus `wrench`, `ramp` and `knobs` (a dict)."""
    with Forked(main, options) as process:
        yield EmulatorProcess(process)


def until(condition: Any, limit_s: float = 5.0, pause_s: float = 0.002) -> bool:
    """Wait until `condition()`; False when it is not true within the limit."""
    deadline_s = time.monotonic() + limit_s
    while time.monotonic() < deadline_s:
        if condition():
            return True
        time.sleep(pause_s)
    return bool(condition())


def main(options: dict[str, Any]) -> None:
    loop = EventLoop()
    wrench = tuple(options.pop("wrench", WRENCH))
    source = Ramp() if options.pop("ramp", False) else Pressed(wrench)
    knobs = Ft300Knobs(**options.pop("knobs", {}))
    emulator = Ft300Emulator(loop, source, knobs=knobs, **options)
    emulator.start()
    print(json.dumps({"port": emulator.port}), flush=True)

    def on_command(_events: int) -> None:
        text = os.read(0, 4096).decode()
        if not text:
            loop.stop()
        for line in text.splitlines():
            command, *args = json.loads(line)
            if command == "knobs":
                emulator.knobs = Ft300Knobs(**args[0])
            elif command == "press" and isinstance(source, Pressed):
                source.wrench = tuple(args[0])
            elif command in ("stall", "hang_up"):
                getattr(emulator, command)(*args)
            print(json.dumps({**emulator.counters, "streaming": emulator.streaming}), flush=True)

    loop.add_fd(0, on_command)
    loop.run()
    emulator.close()
    loop.close()
