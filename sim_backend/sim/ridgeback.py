"""The Ridgeback of level `sim`, in process: the driver contract on a virtual clock, without a wire.

Samples appear at their rates and phases, each read from the world at its own time, oldest first; a pose from
motion capture arrives `mocap_latency_s` after it was measured. A command arrives at the moment it is given.
Not modelled: the bridge (its delays, silences and faults), the multiplexer, battery and stop changes.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Literal

from robot_io.clock import NS_PER_S, SIM_WALL_OFFSET_NS, ClockNs
from robot_io.driver import DriverBase
from robot_io.errors import DeviceNotReady
from robot_io.geometry import compose
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    ClockOffset,
    CommandEcho,
    DeviceHealth,
    DeviceInfo,
    LinkState,
    Pose2D,
    SliderPose,
    Stamped,
)
from robot_io.odometry_pose import OdometryPose
from sim_backend.ridgeback.feeds import seen_from
from sim_backend.ridgeback.noise import FeedNoise
from sim_backend.ridgeback.settings import RidgebackSettings
from sim_backend.world.plant import BaseSource
from sim_backend.world.truth import point_of

FILTERED_RATE_HZ = 50.0
STATUS_RATE_HZ = 1.0
_STATUS_PHASE = 0.01
"""Soon after the start: the emulated driver has waited for its first status when it reports ready."""


class _Feed:
    """A grid of sample times; a sample taken at t arrives `latency_ns` later."""

    def __init__(self, start_ns: int, rate_hz: float, phase: float, latency_ns: int = 0) -> None:
        self.period_ns = round(NS_PER_S / rate_hz)
        self.next_ns = start_ns + round(phase * self.period_ns)
        self.latency_ns = latency_ns


class SimRidgeback(DriverBase):
    """A base on top of a `BaseSource`: `clock` is the virtual clock, `settings` give rates, phases and latency."""

    def __init__(
        self,
        source: BaseSource,
        clock: ClockNs,
        *,
        settings: RidgebackSettings = RidgebackSettings(),  # noqa: B008 - frozen
        pose_source: Literal["mocap", "odometry", "joint_states"] = "mocap",
    ) -> None:
        self._source = source
        self._clock = clock
        self._settings = settings
        self._pose_source = pose_source
        self._state = LinkState.CLOSED
        self._feeds: dict[str, _Feed] = {}
        self._seq: Counter[str] = Counter()
        self._coming: list[Stamped[BaseFeed]] = []
        self._origin = Pose2D()
        self._base_noise, self._slider_noise = FeedNoise(settings, "base"), FeedNoise(settings, "slider")
        self._odometry_noise = FeedNoise(settings, "odometry")
        self.newest_inbound_ns = 0
        self.newest_pong_ns = 0
        self.sent_ns = 0

    def open(self) -> DeviceInfo:
        """Return the device's identity; there is nothing to connect to."""
        self._state = LinkState.OPENING
        return DeviceInfo("ridgeback", "simulated", "Ridgeback", clock=ClockOffset(0.0, 0.0))

    def start(self) -> None:
        """Start the feeds now. Raises DeviceNotReady when not open."""
        if self._state is LinkState.CLOSED:
            raise DeviceNotReady("it is not open", where="ridgeback sim", do="Open it first")
        now_ns = self._clock()
        settings = self._settings
        self._origin = self._source.read_base(now_ns).rolled
        mocap_ns = round(settings.mocap_latency_s * NS_PER_S)
        speed_up = 1.0 + settings.base_rate_error
        self._feeds = {
            "mocap": _Feed(now_ns, settings.mocap_rate_hz, settings.mocap_phase, mocap_ns),
            "odometry": _Feed(now_ns, FILTERED_RATE_HZ * speed_up, 0.11),
            "status": _Feed(now_ns, STATUS_RATE_HZ * speed_up, _STATUS_PHASE),
        }
        self._seq.clear()
        self._coming.clear()
        self._state = LinkState.UP

    def drain(self) -> tuple[Stamped[BaseFeed], ...]:
        """Return every sample that has arrived by now, oldest first."""
        now_ns = self._clock()
        if self._state != LinkState.UP:
            return ()
        self.newest_pong_ns = now_ns
        # The world only advances: sample everything in time order, and deliver it after its latency.
        while self._feeds:
            kind = min(self._feeds, key=lambda name: self._feeds[name].next_ns)
            feed = self._feeds[kind]
            if feed.next_ns > now_ns:
                break
            self._coming += self._sample(kind, feed.next_ns, feed.next_ns + feed.latency_ns)
            feed.next_ns += feed.period_ns
        self._coming.sort(key=lambda sample: sample.received_ns)
        arrived = [sample for sample in self._coming if sample.received_ns <= now_ns]
        del self._coming[: len(arrived)]
        if arrived:
            self.newest_inbound_ns = arrived[-1].received_ns
        return tuple(arrived)

    def command(self, wanted: BodyTwist) -> BodyTwist:
        """Send the wheels a velocity (BODY frame). Raises ValueError unless finite."""
        if not (math.isfinite(wanted.vx) and math.isfinite(wanted.vy) and math.isfinite(wanted.omega)):
            raise ValueError(f"a velocity must be finite, got {wanted}")
        if self._state != LinkState.UP:
            return BodyTwist()
        self.sent_ns = self._clock()
        self._source.command_base(wanted, self.sent_ns)
        self._coming.append(self._stamped("echo", CommandEcho(wanted), self.sent_ns, self.sent_ns))
        return wanted

    def health(self) -> DeviceHealth:
        """Return the state and the number of samples by kind."""
        rate_hz = self._settings.mocap_rate_hz if self._pose_source != "odometry" else FILTERED_RATE_HZ
        return DeviceHealth(self._state, "", dict(self._seq), rate_hz if self._state == LinkState.UP else 0.0)

    def stop(self) -> None:
        """Command zero."""
        self.command(BodyTwist())

    def close(self) -> None:
        """Do nothing: there is nothing to release."""
        self._state = LinkState.CLOSED

    def _sample(self, kind: str, t_ns: int, arrival_ns: int) -> list[Stamped[BaseFeed]]:
        if kind == "status":
            status = BaseStatus(stop_engaged=False, drivers_active=True, battery_v=self._settings.battery_v)
            return [self._stamped("status", BaseReport(status), arrival_ns, t_ns)]
        truth = self._source.read_base(t_ns)
        samples: list[Stamped[BaseFeed]] = []
        if kind == "odometry":
            twist = self._odometry_noise.twist(truth.twist)
            pose = seen_from(self._origin, truth.rolled)
            turned = (0.0, 0.0, math.sin(0.5 * pose.yaw), math.cos(0.5 * pose.yaw))
            sent = OdometryPose("odom", "base_link", (pose.x, pose.y, 0.0), turned)
            samples.append(self._stamped("odometry", BaseOdometry(twist, sent), arrival_ns, t_ns))
            if self._pose_source == "odometry":
                samples.append(self._stamped("pose", BasePose(pose), arrival_ns, t_ns))
            return samples
        if self._pose_source != "odometry":
            samples.append(self._stamped("pose", BasePose(self._seen(truth.pose)), arrival_ns, t_ns))
        if self._settings.topics.slider_pose:
            slider = self._slider_noise.pose(self._source.read_slider(t_ns))
            seen = SliderPose(point_of(slider, self._settings.slider_offset_m))
            samples.append(self._stamped("slider", seen, arrival_ns, t_ns))
        return samples

    def _seen(self, base: Pose2D) -> Pose2D:
        """Return the base's pose as a driver of the rig would find it from the markers."""
        pose, error = self._base_noise.pose(base), self._settings.marker_error
        return pose if self._pose_source != "mocap" or error == Pose2D() else compose(pose, error)

    def _stamped(self, kind: str, value: BaseFeed, arrival_ns: int, t_ns: int) -> Stamped[BaseFeed]:
        seq = self._seq[kind]
        self._seq[kind] = seq + 1
        return Stamped(value, seq, arrival_ns, t_ns / NS_PER_S, t_ns + SIM_WALL_OFFSET_NS)
