"""The gate's logic around `safety.gate`, pure: what it accepts, sends, publishes and logs, and when it ends.

The gate's process and level sim each hold one `GateShell`, pass it what arrived and the time, and do what it
returns; neither decides anything itself. The order of calls in one turn:

    shell = shell.on_frames(frames, began_ns, now_ns)  # control's frames, before any silence is judged
    shell = shell.on_samples(base.drain())
    shell = shell.on_clock(now_ns, base.health())
    shell = shell.on_asleep(asleep_ns)                 # before anything leaves
    shell, latching = shell.on_leaving(now_ns)         # log and publish `latching` unless None
    wanted = shell.due(now_ns)                         # send it unless None, then call `on_sent`
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
from msgspec.structs import replace

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseRecord,
    BaseReport,
    BodyTwist,
    DeviceHealth,
    LinkState,
    SliderPose,
    Stamped,
)
from safety import gate
from safety.bridge_lag import Lag
from safety.checks.clock_checks import JUMP_NS
from safety.envelope import EnvelopeLimits
from safety.gate import GateState, Latch
from safety.motion_bounds import TravelLimits
from safety.travel import Travel

PUBLISH_NS = 10_000_000
"""A record is published at least this often, and whenever something changes."""
LAST_ZEROS_NS = 500_000_000
"""How long zeros are sent after control has ended, at most."""
FIRST_EFFECT_NS = 120_000_000
"""Odometry that arrives within this time after the final zeros began may have been measured before they took effect."""
REST_M_PER_S = REST_RAD_PER_S = 0.005


class Latching(msgspec.Struct, frozen=True, gc=False):
    """A latch to be logged: the last good frame's sequence number and tick, the cause, and its text."""

    seq: int
    tick: int
    latch: Latch
    text: str
    fault: str
    """The row of the fault table, "" for the normal end."""


class GateShell(msgspec.Struct, frozen=True, gc=False):
    """The gate's complete state. Every method returns the next shell; times are CLOCK_MONOTONIC ns."""

    limits: EnvelopeLimits
    bounds: TravelLimits
    """What the whole run can need."""
    ran_ns: int
    """When the gate could last send; used to detect a pause of the gate that is too long."""
    gate: GateState = GateState()
    travel: Travel = Travel()
    lag: Lag = Lag()
    record: BaseRecord = BaseRecord()
    """The record of base and gate that control reads."""
    asleep_ns: int | None = None
    """How long this machine has been suspended since it was started; None while it is not known."""
    told: Latch = Latch.NONE
    """The latch that has been logged."""
    link_cause: str = ""
    zeros_since_ns: int = 0
    """When control ended; 0 while it is running."""

    def on_frames(self, frames: Sequence[GateFrame | None], began_ns: int, read_ns: int) -> GateShell:
        """Judge the waiting frames (None: unreadable), oldest first, read from `began_ns` to `read_ns`.

        A pause of the gate in between does not age a frame and does not count as silence of control.
        """
        if not frames:
            return self
        state = gate.on_frames(self.limits, self.gate, frames, began_ns)
        if not state.latch:
            state = replace(state, frame_ns=read_ns)
        record = replace(self.record, accepted_seq=state.seq, verdict=int(state.latch))
        return replace(self, gate=state, record=record)

    def on_control_gone(self, now_ns: int) -> GateShell:
        """Latch because control closed its end of the socket, and begin the final zeros."""
        return replace(self, gate=gate.on_eof(self.gate), zeros_since_ns=now_ns)

    def on_samples(self, samples: Sequence[Stamped[BaseFeed]]) -> GateShell:
        """Process samples from the base, oldest first; three consecutive measured speeds beyond the limits latch."""
        state, travel, lag, changes = self.gate, self.travel, self.lag, dict[str, Any]()
        pose_seq, odometry_seq = self.record.pose_seq, self.record.odometry_seq
        for sample in samples:
            value, at_ns, stamp_ns = sample.value, sample.received_ns, sample.epoch_ns
            if isinstance(value, BasePose):
                pose_seq += 1
                changes.update(pose=value.pose, pose_valid=value.valid, pose_received_ns=at_ns, pose_stamp_ns=stamp_ns)
            elif isinstance(value, BaseOdometry):
                odometry_seq += 1
                lag = lag.on_stamp(at_ns, sample.device_time_s)
                changes.update(odometry=value.twist, odometry_received_ns=at_ns, odometry_stamp_ns=stamp_ns)
                changes.update(lag_ns=lag.growth_ns)
                state = gate.on_speed(self.limits, state, value.twist)
                travel = travel.on_speed(value.twist, at_ns)
            elif isinstance(value, BaseReport):
                changes.update(status=value.status, status_received_ns=at_ns)
            elif isinstance(value, SliderPose) and not value.flaw:
                changes.update(object_pose=value.pose, object_received_ns=at_ns)
            # The echo of our own commands is for the driver.
        if not changes:
            return self
        record = replace(self.record, pose_seq=pose_seq, odometry_seq=odometry_seq, **changes)
        return replace(self, gate=state, travel=travel, lag=lag, record=record)

    def on_clock(self, now_ns: int, health: DeviceHealth) -> GateShell:
        """Latch when control has been silent too long or the base's link is gone."""
        state = gate.on_clock(self.gate, now_ns)
        if health.state != LinkState.LOST:
            return self if state is self.gate else replace(self, gate=state)
        return replace(self, gate=gate.latched(state, Latch.LINK), link_cause=health.cause)

    def on_asleep(self, asleep_ns: int | None) -> GateShell:
        """Latch when this machine was suspended since the last look (None: not readable just now, so look again)."""
        if asleep_ns is None:
            return self
        known = self.asleep_ns is not None and abs(asleep_ns - self.asleep_ns) > JUMP_NS
        state = gate.latched(self.gate, Latch.SUSPENDED) if known else self.gate
        return replace(self, gate=state, asleep_ns=asleep_ns)

    def on_leaving(self, now_ns: int) -> tuple[GateShell, Latching | None]:
        """Judge the gate's own pause and the way so far; return the latch to be logged now, if there is a new one.

        Called before anything is sent, whatever woke the gate: after a freeze, nothing leaves before this is judged.
        """
        travel = self.travel.on_time(now_ns, self.record.sent)
        state = gate.on_own_pause(self.gate, now_ns - self.ran_ns)
        state = gate.on_travel(self.bounds, state, travel)
        latch = state.latch
        shell = replace(self, gate=state, travel=travel, ran_ns=now_ns, told=latch)
        if latch == self.told:
            return shell, None
        text = ": ".join(filter(None, (gate.LATCH_TEXT[latch], shell.cause())))
        fault = "" if latch == Latch.EOF else gate.LATCH_FAULT.get(latch, "F36")
        return shell, Latching(state.seq, state.tick, latch, text, fault)

    def cause(self) -> str:
        """Return what more is known of the latch, in words; "" where nothing is."""
        if self.gate.latch == Latch.LINK:
            return self.link_cause
        if self.gate.latch == Latch.TRAVEL:
            return f"{self.travel.distance_m:.2f} m, limit {self.bounds.distance_m:.2f} m"
        if self.gate.latch == Latch.MOVING_TIME:
            return f"{self.travel.moving_ns * 1e-9:.0f} s, limit {self.bounds.moving_s:.0f} s"
        return ""

    def due(self, now_ns: int) -> BodyTwist | None:
        """Return the command to send now, or None when nothing is due yet."""
        return gate.due(self.limits, self.gate, now_ns)

    def on_sent(self, wanted: BodyTwist, really: BodyTwist | None, now_ns: int) -> GateShell:
        """Record the wanted command and the one actually sent (None: nothing, because the link is lost)."""
        record = self.record if really is None else replace(self.record, sent=really, sent_ns=now_ns)
        return replace(self, gate=gate.sent(self.gate, wanted, now_ns), record=record)

    def publish_due(self, now_ns: int) -> bool:
        """Return whether a record must be published although nothing has changed."""
        return now_ns - self.record.published_ns >= PUBLISH_NS

    def on_publish(self, now_ns: int, *, newest_inbound_ns: int, newest_pong_ns: int) -> GateShell:
        """Return the shell whose `record` is to be published now."""
        latch = self.gate.latch
        record = replace(
            self.record,
            newest_inbound_ns=newest_inbound_ns,
            newest_pong_ns=newest_pong_ns,
            latched=latch != Latch.NONE,
            latch_cause=int(latch),
            published_ns=now_ns,
            travel_m=self.travel.distance_m,
            moving_s=self.travel.moving_ns * 1e-9,
        )
        return replace(self, record=record)

    def ends(self, now_ns: int, link: LinkState) -> bool:
        """Return whether control is gone and zeros were sent long enough, the base rests, or the link is lost."""
        if not self.zeros_since_ns:
            return False
        return now_ns >= self.zeros_since_ns + LAST_ZEROS_NS or link == LinkState.LOST or self._at_rest()

    def _at_rest(self) -> bool:
        twist = self.record.odometry
        fresh = self.record.odometry_received_ns > self.zeros_since_ns + FIRST_EFFECT_NS
        still = abs(twist.vx) < REST_M_PER_S and abs(twist.vy) < REST_M_PER_S and abs(twist.omega) < REST_RAD_PER_S
        return fresh and still
