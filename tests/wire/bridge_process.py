"""Runs an emulated bridge in a process of its own and tells the test, on request, what the base heard.

There: JSON lines in (`{"do": "freeze", "args": [3]}`, `{"do": "report"}`), JSON lines out.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import BodyTwist, Pose2D
from robot_io.rig.topics import TopicsConfig
from sim_backend.ridgeback.faults import BridgeFaults
from sim_backend.ridgeback.settings import BridgeSettings, RidgebackSettings
from sim_backend.ridgeback.standalone import StandaloneBase, standalone_emulator
from tests.forked import Forked


def serve(options: dict[str, Any]) -> None:
    settings = msgspec.convert(options.get("settings", {}), RidgebackSettings)
    bridge = msgspec.convert(options.get("bridge", {}), BridgeSettings)
    loop = EventLoop()
    emulator = standalone_emulator(loop, port=0, settings=settings, bridge=bridge)
    faults = BridgeFaults(loop, emulator)
    heard: list[tuple[int, float, float, float]] = []
    source = emulator.nodes._source
    assert isinstance(source, StandaloneBase)
    forward = source.command_base

    def command_base(twist: BodyTwist, arrival_ns: int) -> None:
        heard.append((arrival_ns, twist.vx, twist.vy, twist.omega))
        forward(twist, arrival_ns)

    source.command_base = command_base  # type: ignore[method-assign]  # a tap on the wire for the test

    def answer(value: Any) -> None:
        print(json.dumps(value), flush=True)

    def report() -> None:
        now_ns = time.monotonic_ns()
        truth = source.read_base(now_ns)
        answer(
            {
                "now_ns": now_ns,
                "heard": heard,
                "counters": emulator.counters,
                "clients": len(emulator.server.peers),
                "velocity": [truth.twist.vx, truth.twist.vy, truth.twist.omega],
                "pose": [truth.pose.x, truth.pose.y, truth.pose.yaw],
            }
        )

    def request(_: int) -> None:
        data = os.read(0, 65536)
        if not data:
            loop.stop()
            return
        for line in data.splitlines():
            order = json.loads(line)
            if order["do"] == "report":
                report()
            else:
                arguments = [
                    msgspec.convert(value, {"jump_pose": Pose2D, "joystick": BodyTwist}[order["do"]])
                    if isinstance(value, dict)
                    else value
                    for value in order.get("args", [])
                ]
                getattr(faults, order["do"])(*arguments)
                answer({"done": order["do"], "now_ns": time.monotonic_ns()})

    loop.add_fd(0, request)
    answer({"url": emulator.url})
    loop.run()
    faults.close()
    emulator.close()
    loop.close()


class Bridge:
    """A running emulator."""

    def __init__(self, process: Forked) -> None:
        self.process = process
        self.url: str = self._read()["url"]

    def do(self, fault: str, *arguments: Any) -> int:
        """Ask for a fault; return the emulator's time (ns) at which it began."""
        return int(self._ask({"do": fault, "args": [msgspec.to_builtins(value) for value in arguments]})["now_ns"])

    def report(self) -> dict[str, Any]:
        return self._ask({"do": "report"})

    def heard(self) -> list[tuple[int, float, float, float]]:
        return [tuple(entry) for entry in self.report()["heard"]]

    def _ask(self, order: dict[str, Any]) -> dict[str, Any]:
        self.process.stdin.write(json.dumps(order) + "\n")
        return self._read()

    def _read(self) -> dict[str, Any]:
        line = self.process.stdout.readline()
        assert line, "the emulator has ended"
        answer: dict[str, Any] = json.loads(line)
        return answer


@contextlib.contextmanager
def running_bridge(
    settings: dict[str, Any] | None = None, bridge: dict[str, Any] | None = None, topics: TopicsConfig | None = None
) -> Iterator[Bridge]:
    settings = dict(settings or {})
    if topics is not None:
        settings["topics"] = msgspec.to_builtins(topics)
    with Forked(serve, {"settings": settings, "bridge": bridge or {}}) as process:
        yield Bridge(process)


def until(condition: Callable[[], bool], seconds: float = 5.0, every_s: float = 0.005) -> bool:
    """Wait until the condition holds; tell whether it did in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(every_s)
    return True
