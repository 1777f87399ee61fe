"""Calibration rehearsed: the emulators run in a process of their own, and a rehearsed person does what is asked.

The person presses the emulated ball, moves the emulated arm and drives the emulated base with a joystick of its own, a
second client of the bridge. Like a person it is a little off: marks by 0.3 degrees, tape by 1 mm, presses by 6 degrees.
"""

from __future__ import annotations

import contextlib
import math
import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from robot_io.errors import EnvironmentFault
from robot_io.geometry import base_pose_from_marker, compose, point_outside
from robot_io.ipc.process import fresh_interpreter
from robot_io.messages import BodyTwist, Pose2D, Vector3
from robot_io.ridgeback import Ridgeback
from robot_io.rig.config import RigConfig
from robot_io.rig.declared import TOOL_FORCE
from sim_backend.world.truth import true_frames
from tools.calibrate.people import Act, Done, Drive, PoseArm, Press
from tools.rig import devices_at, with_addresses

READY_WITHIN_S = 30.0
ENDS_WITHIN_S = 3.0
FELT_AFTER_S = 0.5
ARM_MOVES_S = 1.0
MARKING_DEG = 0.3
PLUMB_M = 0.001
PRESS_DEG = 6.0
_PROGRAM = (
    "import signal, sys; from robot_io.ipc.process import die_with_parent; "
    "die_with_parent(int(sys.argv[1]), signal.SIGTERM); from tools.cli import main; sys.exit(main(sys.argv[2:]))"
)
_DEVICES = {"port": "ft", "host": "arm", "url": "base"}
"""By what an emulator calls its address."""


class Emulators:
    """`push emulate all` in a process of its own; told on its stdin what the rehearsed person does."""

    def __init__(self, rig_name: str, overrides: Sequence[str], seed: int, count: int = len(_DEVICES)) -> None:
        """Start `count` of them; raises EnvironmentFault where they do not come up."""
        command, environment = fresh_interpreter("-")
        pid = os.getpid()
        # Each emulated arm needs an address of its own: its ports are fixed.
        host = f"127.77.{pid // 250 % 250}.{pid % 250 + 1}"
        flags = [flag for setting in overrides for flag in ("--set", setting)]
        words = ["emulate", "all", rig_name, *flags, f"--seed={seed}", "--base-port=0", f"--arm-host={host}", "--json"]
        self._stderr = tempfile.TemporaryFile(prefix="push-")  # noqa: SIM115 - closed with the process
        self._process = subprocess.Popen(
            [*command[:2], "-c", _PROGRAM, str(pid), *words],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            start_new_session=True,
        )
        try:
            self.addresses = self._hear(count)
        except BaseException:
            self.close()
            raise

    def say(self, message: dict[str, Any]) -> None:
        """Tell them what the person does."""
        assert self._process.stdin is not None
        self._process.stdin.write(msgspec.json.encode(message) + b"\n")
        self._process.stdin.flush()

    def close(self) -> None:
        """End the process."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for file in (self._process.stdin, self._process.stdout, self._stderr):
            if file is not None:
                with contextlib.suppress(OSError):
                    file.close()

    def _hear(self, count: int) -> dict[str, str]:
        assert self._process.stdout is not None
        found: dict[str, str] = {}
        deadline_s, rest = time.monotonic() + READY_WITHIN_S, b""
        while len(found) < count:
            left_s = deadline_s - time.monotonic()
            ready = select.select([self._process.stdout], [], [], max(0.0, left_s))[0]
            more = os.read(self._process.stdout.fileno(), 4096) if ready else b""
            if not more:
                self._stderr.seek(0)
                words = self._stderr.read().decode(errors="replace").strip().splitlines()
                raise EnvironmentFault(f"the emulators did not start{': ' + words[-1] if words else ''}")
            *lines, rest = (rest + more).split(b"\n")
            for line in lines:
                told = msgspec.json.decode(line)
                if "error" in told:
                    raise EnvironmentFault(told["error"]["what"], where=told["error"]["where"], do=told["error"]["do"])
                found |= {_DEVICES[key]: address for key, address in told.items() if key in _DEVICES}
        return found


@contextlib.contextmanager
def emulators(
    rig: RigConfig, rig_name: str, overrides: Sequence[str], seed: int
) -> Iterator[tuple[RigConfig, Emulators]]:
    """Serve the rig's emulated devices; give the rig with their addresses, and the process."""
    of_the_arm = rig.ft.kind == TOOL_FORCE
    served = Emulators(rig_name, overrides, seed, len(_DEVICES) - of_the_arm)
    if of_the_arm:
        served.addresses["ft"] = served.addresses["arm"]
    try:
        mine = devices_at(rig, "emulated")
        yield with_addresses(rig, {device: at for device, at in served.addresses.items() if device in mine}), served
    finally:
        served.close()


class Rehearsed:
    """The rehearsed person, who sees where things really are; `seed` of how far off its hands are."""

    def __init__(self, rig: RigConfig, served: Emulators, seed: int) -> None:
        self._rig = rig
        self._served = served
        self._true = true_frames(rig)
        self._dice = random.Random(f"hand-{seed}")
        self._free_s = 0.0

    def begin(self, act: Act) -> Done:
        """See `Operator.begin`."""
        print(f"{act.text} (rehearsed)", file=sys.stderr, flush=True)
        if isinstance(act, Drive):
            return _Joystick(self._rig, act)
        if isinstance(act, Press):
            return self._pressing(act)
        if isinstance(act, PoseArm):
            self._served.say({"arm_rad": act.joints, "in_s": ARM_MOVES_S})
            return _after(ARM_MOVES_S + FELT_AFTER_S)
        return _after(max(0.0, self._free_s - time.monotonic()))

    def _pressing(self, act: Press) -> Done:
        """Press as soon as the hand is free: two presses at a time would add up."""
        force, free_s, felt = self._aimed(act.force_body_N), self._free_s, list[Done]()

        def done() -> bool:
            if not felt and time.monotonic() >= free_s:
                self._served.say({"hand": {"force_body_N": force, "for_s": act.for_s}})
                self._free_s = time.monotonic() + act.for_s + FELT_AFTER_S
                felt.append(_after(FELT_AFTER_S))
            return bool(felt) and felt[0]()

        return done

    def plumb(self, text: str, base: Pose2D) -> tuple[float, float]:
        """See `Operator.plumb`: where the ball really is, read from a tape."""
        markers = compose(base, Pose2D(*self._rig.frames.base_from_marker))
        true = base_pose_from_marker(markers, Pose2D(*self._true.base_from_marker))
        x, y = point_outside(true.x, true.y, true.yaw, *self._true.contact_in_base_m[:2])
        x, y = (round(value + self._dice.gauss(0.0, PLUMB_M), 4) for value in (x, y))
        print(f"{text} (rehearsed): {x},{y}", file=sys.stderr, flush=True)
        return x, y

    def _aimed(self, force: Vector3) -> Vector3:
        """Return a force as a hand gives it: a cord along its mark, a press a few degrees off any way."""
        x, y, z = force
        size = math.hypot(x, y, z)
        if abs(z) < 1e-9 and size > 20.0:
            angle = math.atan2(y, x) + math.radians(self._dice.gauss(0.0, MARKING_DEG))
            return size * math.cos(angle), size * math.sin(angle), 0.0
        sway = size * math.tan(math.radians(PRESS_DEG))
        a, b, c = (part + self._dice.gauss(0.0, sway / 2.0) for part in force)
        return a, b, c


def _after(seconds: float) -> Done:
    due_s = time.monotonic() + seconds
    return lambda: time.monotonic() >= due_s


class _Joystick:
    """Drives the emulated base through its legs while it is asked whether it is done."""

    def __init__(self, rig: RigConfig, act: Drive) -> None:
        base = rig.base
        self._base = Ridgeback(base.url, topics=base.topics, base_from_marker=rig.frames.base_from_marker)
        self._base.open()
        self._base.start()
        self._legs = list(act.legs)
        self._until_s = time.monotonic() + self._legs[0][1]

    def __call__(self) -> bool:
        if not self._legs:
            return True
        self._base.drain()
        if time.monotonic() >= self._until_s:
            self._legs.pop(0)
            if not self._legs:
                self._base.stop()
                self._base.close()
                return True
            self._until_s += self._legs[0][1]
        twist: BodyTwist = self._legs[0][0]
        self._base.command(twist)
        return False
