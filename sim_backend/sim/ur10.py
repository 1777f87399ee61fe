"""The arm at level `sim`: in process, on a virtual clock, with the same contract as the real driver.

Not modelled: the arm's process, its delays, and everything on the wire.
"""

from __future__ import annotations

from robot_io.clock import NS_PER_S, ClockNs
from robot_io.driver import DriverBase
from robot_io.errors import DeviceNotReady
from robot_io.messages import NO_ARM, ArmRecord, ArmState, DeviceHealth, DeviceInfo, JointState, LinkState, Stamped
from sim_backend.world.plant import ArmSource

_CYCLE_S = 0.008


class SimUr10(DriverBase):
    """A UR10 held still, sampled on a grid of its own: `rate_hz` and `phase` (0..1 of a period), `clock` in ns."""

    def __init__(self, source: ArmSource, clock: ClockNs, *, rate_hz: float = 124.99, phase: float = 0.21) -> None:
        self._source = source
        self._clock = clock
        self._period_ns = NS_PER_S / rate_hz
        self._phase_ns = phase * self._period_ns
        self._start_ns = 0
        self._state = LinkState.CLOSED
        self._record = NO_ARM
        self._drained = 0

    def open(self) -> DeviceInfo:
        """Identify the device and start the time grid."""
        self._start_ns = self._clock()
        self._record = NO_ARM
        self._drained = 0
        self._state = LinkState.OPENING
        return DeviceInfo("ur10", "sim", "UR10", "simulated")

    def start(self) -> None:
        """Start the flow of data. Raises DeviceNotReady when not open."""
        if self._state is LinkState.CLOSED:
            raise DeviceNotReady("it is not open", where="ur10 sim", do="Open it first")
        self._state = LinkState.UP

    def read(self) -> ArmRecord | None:
        """Return the record of the newest grid time up to now; None before the first."""
        if self._state == LinkState.UP:
            packets = int((self._clock() - self._start_ns - self._phase_ns) // self._period_ns) + 1
            if packets > self._record.packets:
                self._record = self._sample(packets)
        return self._record if self._record.packets else None

    def drain(self) -> tuple[Stamped[JointState], ...]:
        """Return the newest state if it is new since the last call (joints in rad), else nothing."""
        record = self.read()
        if self._state != LinkState.UP or record is None or record.packets == self._drained:
            return ()
        self._drained = record.packets
        return (Stamped(record.joints, record.packets, record.changed_ns, record.joints.controller_time_s),)

    def health(self) -> DeviceHealth:
        """Return link state and count."""
        return DeviceHealth(self._state, "", {"packets": self._record.packets}, NS_PER_S / self._period_ns)

    def stop(self) -> None:
        """Stop the flow of data; nothing is ever commanded."""
        self._state = LinkState.CLOSED

    def close(self) -> None:
        """Close; idempotent."""
        self._state = LinkState.CLOSED

    def _sample(self, packets: int) -> ArmRecord:
        at_ns = self._start_ns + int(self._phase_ns + (packets - 1) * self._period_ns)
        truth = self._source.read_arm(at_ns)
        joints = JointState(
            truth.position,
            truth.velocity,
            int(ArmState.HOLDING),
            0,
            packets * _CYCLE_S,
        )
        return ArmRecord(joints, packets, at_ns, at_ns, int(LinkState.UP))
