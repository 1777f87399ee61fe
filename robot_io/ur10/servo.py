"""Active holding (`hold = "servo"`): keep the arm where it was at start, with the controller-side watchdog armed.

Opt-in, because a running control script only adds ways to move. Facts about ur_rtde 1.6.5 that shape it:
constructing the control interface ends whatever program plays, `servoJ` returns True on a dead link, its own
thread connects again and restarts the script unasked, and calls on a dead link do not return for minutes. So:
nothing is constructed while a program plays, only what the *receive* side reports counts as evidence, and after
the first fault nothing is called any more: the watchdog stops the program and the process ends.
"""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Iterator
from typing import Any

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.errors import DeviceNotReady
from robot_io.messages import ArmError, Joints, JointState
from robot_io.ur10.preflight import is_program_running
from robot_io.ur10.reader import ArmReader
from robot_io.ur10.state import RUNTIME_PLAYING, RUNTIME_STOPPED

WATCHDOG_HZ = 10.0
"""The controller stops the program when this many commands a second do not arrive (URScript rtde_set_watchdog)."""
STALE_NS = 100 * NS_PER_MS
LOOKAHEAD_S = 0.1
GAIN = 300.0
AT_REST_RAD_PER_S = 0.02
SCRIPT_START_NS = 1 * NS_PER_S
END_WITHIN_S = 2.0
COMMAND_WITHIN_S = 0.5
FIRST_COMMAND_WITHIN_S = 5.0
"""The wheel itself waits up to 4 s for its script to be ready."""


class ActiveHold:
    """Holds the joints measured at construction (rad). Raises DeviceNotReady when that is not safe to begin.

    Construction starts the control script, `begin` arms its watchdog: nothing slow may come between `begin` and the
    first `tick`, and no more than 0.1 s between two.
    """

    def __init__(self, host: str, reader: ArmReader, held_pose_rad: Joints | None, tolerance_rad: float) -> None:
        self.target: Joints = _check_may_start(host, reader, held_pose_rad, tolerance_rad)
        self._tolerance_rad = tolerance_rad
        self._cycle_s = reader.generation.cycle_s
        self._rtde = _control_interface(host, reader.generation.rate_hz)
        reader.own_program = True
        self._host = host
        self._ended = False
        try:
            _wait_playing(host, reader)
        except BaseException:
            self.end()
            raise

    def begin(self) -> None:
        """Arm the watchdog and command the first target. Raises DeviceNotReady, having ended, when it is refused."""
        try:
            if not self._rtde.setWatchdog(WATCHDOG_HZ):
                raise DeviceNotReady(
                    "the control script refused the watchdog", where=self._host, do="Use hold = monitor, or try again"
                )
            if not self._command(FIRST_COMMAND_WITHIN_S):  # waits until the script is ready; later calls return at once
                raise DeviceNotReady(
                    "the control script refused the first target",
                    where=self._host,
                    do="Use hold = monitor, or try again",
                )
        except BaseException:
            self.end()
            raise

    def tick(self, reader: ArmReader, now_ns: int) -> ArmError:
        """Command the target once more, or say why holding is over; call it every cycle of the controller."""
        if self._ended or reader.joints is None:
            return ArmError.SERVO_STOPPED
        fault = self._fault(reader, reader.joints, now_ns)
        if fault == ArmError.NONE and not self._command(COMMAND_WITHIN_S):
            fault = ArmError.SERVO_STOPPED
        if fault != ArmError.NONE:
            self._ended = True
        return fault

    def end(self) -> None:
        """Stop servoing and end the script, only while the link is known to be alive; at most 2 s."""
        if self._ended:
            return
        self._ended = True
        with _killed_after(END_WITHIN_S):
            self._rtde.servoStop()
            self._rtde.stopScript()

    def _command(self, within_s: float) -> bool:
        with _killed_after(within_s):
            accepted: bool = self._rtde.servoJ(list(self.target), 0.0, 0.0, self._cycle_s, LOOKAHEAD_S, GAIN)
        return accepted

    def _fault(self, reader: ArmReader, joints: JointState, now_ns: int) -> ArmError:
        if reader.error != ArmError.NONE:
            return reader.error
        if now_ns - reader.changed_ns > STALE_NS:
            return ArmError.SERVO_STALE
        if not reader.modes.playing:
            return ArmError.SERVO_STOPPED
        if max_difference(joints.position, self.target) > self._tolerance_rad:
            return ArmError.SERVO_NOT_HOLDING
        return ArmError.NONE


@contextlib.contextmanager
def _killed_after(seconds: float) -> Iterator[None]:
    """Have the kernel end this process (SIGALRM) when the calls inside hang in C++, where nothing else helps."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)


def max_difference(a: Joints, b: Joints) -> float:
    """Return the largest difference of any joint (rad)."""
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def _check_may_start(host: str, reader: ArmReader, held_pose_rad: Joints | None, tolerance_rad: float) -> Joints:
    """Return the joints measured now (rad). Raises DeviceNotReady when holding them must not begin."""
    start = reader.wait_flowing()
    if reader.modes.runtime_state != RUNTIME_STOPPED or is_program_running(host):
        raise DeviceNotReady(
            "a program is running on the controller, and active holding would end it",
            where=host,
            do="Stop the program at the teach pendant, or use hold = monitor",
        )
    if max(map(abs, start.velocity)) > AT_REST_RAD_PER_S:
        raise DeviceNotReady("the arm is moving", where=host, do="Wait until it is at rest")
    if held_pose_rad is not None and max_difference(start.position, held_pose_rad) > tolerance_rad:
        raise DeviceNotReady(
            f"a joint is {max_difference(start.position, held_pose_rad):.3f} rad from the held pose, "
            f"more than {tolerance_rad:g}",
            where=host,
            do="Move the arm to the held pose of the rig, or correct held_pose_rad",
        )
    return start.position


def _control_interface(host: str, rate_hz: float) -> Any:
    import rtde_control  # C++, and only for active holding

    try:
        return rtde_control.RTDEControlInterface(
            host,
            rate_hz,
            rtde_control.RTDEControlInterface.FLAG_UPLOAD_SCRIPT | rtde_control.RTDEControlInterface.FLAG_NO_EXT_FT,
            50002,  # the wheel's default port of its optional UR cap, which is not used
            -1,  # leave this thread's priority alone
        )
    except RuntimeError as error:
        raise DeviceNotReady(
            f"the control script did not start ({str(error).splitlines()[0]})",
            where=host,
            do="Check that no fieldbus or other client holds the RTDE input registers, or use hold = monitor",
        ) from error


def _wait_playing(host: str, reader: ArmReader) -> None:
    deadline_ns = monotonic_ns() + SCRIPT_START_NS
    while reader.joints is None or reader.modes.runtime_state != RUNTIME_PLAYING:
        if monotonic_ns() > deadline_ns:
            raise DeviceNotReady("the control script is not running", where=host, do="Try again")
        time.sleep(0.002)
        reader.poll(monotonic_ns())
