"""The wheel's receive interface, read so that its known traps do no harm.

It gives its last values for ever when the link is gone, may tear a snapshot over two packets, and says that it
is disconnected 2.5 s late (measured with ur_rtde 1.6.5). So: the controller's time stamp is read before and
after, and every packet is known by its stamp.
"""

from __future__ import annotations

import math
import time
from typing import Any

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import DeviceUnreachable
from robot_io.messages import ArmError, JointState
from robot_io.ur10.generation import Generation
from robot_io.ur10.state import UrModes

VARIABLES = [
    "timestamp",
    "actual_q",
    "actual_qd",
    "robot_mode",
    "joint_mode",
    "safety_mode",
    "runtime_state",
    "robot_status_bits",
    "safety_status_bits",
]
FLOW_PACKETS = 10
FLOW_WITHIN_NS = 1 * NS_PER_S
_KEEP_PRIORITY = -1
"""Any non-negative value lets the wheel change the scheduling of the calling thread."""


class ArmReader:
    """Connects with the wheel (blocks for ever on a silent controller: run the preflight first) and reads packets."""

    def __init__(self, host: str, generation: Generation) -> None:
        import rtde_receive  # 1.8 MB of C++, needed in the arm's process only

        self._host = host
        self.generation = generation
        try:
            self._rtde: Any = rtde_receive.RTDEReceiveInterface(
                host, generation.rate_hz, VARIABLES, False, False, _KEEP_PRIORITY
            )
        except RuntimeError as error:
            raise DeviceUnreachable(
                f"the receive interface did not connect ({error})",
                where=host,
                do="Check that RTDE (port 30004) is reachable",
            ) from error
        self.packets = 0
        self.changed_ns = 0
        self.error = ArmError.NONE
        self.joints: JointState | None = None
        self.modes = UrModes()
        self.own_program = False
        """A program that runs is ours (active holding)."""

    def wait_flowing(self) -> JointState:
        """Return the newest state once 10 packets came in a row. Raises DeviceUnreachable after 1 s."""
        deadline_ns = monotonic_ns() + FLOW_WITHIN_NS
        while self.packets < FLOW_PACKETS or self.joints is None:
            if monotonic_ns() > deadline_ns:
                raise DeviceUnreachable(
                    f"it accepted the connection and sent {self.packets} of {FLOW_PACKETS} packets within 1 s",
                    where=f"{self._host}:30004",
                    do="Restart the controller if this stays",
                )
            time.sleep(0.002)
            self.poll(monotonic_ns())
        return self.joints

    def poll(self, now_ns: int) -> bool:
        """Take a packet when there is a new one; `error` says what is wrong with the link or the packet."""
        rtde = self._rtde
        stamp_s = rtde.getTimestamp()
        if self.joints is not None and _same(stamp_s, self.joints.controller_time_s):
            if not rtde.isConnected():
                self.error = ArmError.LINK_LOST
            return False
        snapshot = self._snapshot()
        if snapshot is None:
            return False
        joints, modes = snapshot
        if self.joints is not None and joints.controller_time_s < self.joints.controller_time_s:
            self.error = ArmError.TIME_WENT_BACK
        elif not all(map(math.isfinite, (*joints.position, *joints.velocity, joints.controller_time_s))):
            self.error = ArmError.NOT_FINITE
        elif self.error == ArmError.NOT_FINITE:
            self.error = ArmError.NONE
        self.joints, self.modes = joints, modes
        self.packets += 1
        self.changed_ns = now_ns
        return True

    def _snapshot(self) -> tuple[JointState, UrModes] | None:
        rtde = self._rtde
        for _ in range(3):  # a second tear in a row is impossible: packets are 2 or 8 ms apart
            stamp_s = rtde.getTimestamp()
            q, qd, modes = rtde.getActualQ(), rtde.getActualQd(), rtde.getJointMode()
            numbers = (
                rtde.getRobotMode(),
                rtde.getSafetyMode(),
                rtde.getSafetyStatusBits(),
                rtde.getRobotStatus(),
                rtde.getRuntimeState(),
            )
            if _same(rtde.getTimestamp(), stamp_s):
                break
        if len(q) != 6 or len(qd) != 6 or len(modes) != 6:
            return None
        found = UrModes(*numbers, tuple(modes))
        state = found.state(own_program=self.own_program)
        return JointState(tuple(q), tuple(qd), int(state), found.packed(), stamp_s), found


def _same(a_s: float, b_s: float) -> bool:
    """Return whether two time stamps are equal, NaN to NaN as well: a stamp that stays NaN must not look like news."""
    return a_s == b_s or (math.isnan(a_s) and math.isnan(b_s))
