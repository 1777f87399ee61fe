"""What the operator is asked to do, and the operator at a terminal: told in words, done at Enter."""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Callable
from typing import Protocol

import msgspec

from robot_io.errors import OperatorStop, UsageError
from robot_io.messages import BodyTwist, Joints, Pose2D, Vector3

POLL_S = 0.02


class Rest(msgspec.Struct, frozen=True):
    """Let go of everything, nothing touches or moves the robot."""

    text: str


class Press(msgspec.Struct, frozen=True):
    """Press or pull the ball with this force (N, BODY), for so long after it was begun."""

    text: str
    force_body_N: Vector3
    for_s: float


class PoseArm(msgspec.Struct, frozen=True):
    """Move the arm by hand to these joints (rad), or to others as different."""

    text: str
    joints: Joints


class Drive(msgspec.Struct, frozen=True):
    """Drive the base with the joystick: velocities (BODY), each for so many seconds."""

    text: str
    legs: tuple[tuple[BodyTwist, float], ...]


Act = Rest | Press | PoseArm | Drive
Done = Callable[[], bool]


class Operator(Protocol):
    """Who does what is asked: a person at a terminal, or a rehearsed one."""

    def begin(self, act: Act) -> Done:
        """Ask for an act; the result says, whenever it is called, whether it is done (or held, for a press)."""
        ...

    def plumb(self, text: str, base: Pose2D) -> tuple[float, float]:
        """Ask for a point on the floor: x, y in m, WORLD. base: where it was measured to be."""
        ...


def ask(operator: Operator, act: Act, idle: Callable[[], object] = lambda: None) -> None:
    """Have an act done; `idle` is called meanwhile, 50 times a second."""
    done = operator.begin(act)
    while not done():
        idle()
        time.sleep(POLL_S)


def tell(text: str) -> None:
    """Tell the operator what goes on."""
    print(text, file=sys.stderr, flush=True)


class Terminal:
    """A person at a terminal. Raises UsageError where stdin is none."""

    def __init__(self) -> None:
        if sys.stdin is None or not sys.stdin.isatty():
            raise UsageError(
                "it tells a person what to do and waits for Enter, and stdin is not a terminal",
                where="push calibrate",
                do="Run it in a terminal, or rehearse it: `push calibrate WHAT emulated --rehearse`",
            )

    def begin(self, act: Act) -> Done:
        """See `Operator.begin`. Raises OperatorStop at the end of the input."""
        print(f"{act.text}, then press Enter ", end="", file=sys.stderr, flush=True)
        return self._entered

    def plumb(self, text: str, base: Pose2D) -> tuple[float, float]:
        """See `Operator.plumb`; asks again until two numbers are typed."""
        while True:
            print(f"{text} (x,y in m): ", end="", file=sys.stderr, flush=True)
            words = _line().split(",")
            try:
                x, y = (float(word) for word in words)
            except ValueError:
                print("two numbers with a comma between them, such as 1.234,-0.567", file=sys.stderr)
            else:
                return x, y

    def _entered(self) -> bool:
        if not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        _line()
        return True


def _line() -> str:
    text = sys.stdin.readline()
    if not text:
        raise OperatorStop("stopped at a prompt; nothing was written", where="push calibrate")
    return text.strip()
