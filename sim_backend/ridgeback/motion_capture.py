"""The motion capture of the emulated laboratory, and the base pose derived from it, on the ROS graph.

A pose is that of `mocap_latency_s` ago, and is stamped accordingly. For an occluded body nothing is published: there is
no flag, the last pose just becomes stale.
"""

from __future__ import annotations

import random

from robot_io.clock import NS_PER_S
from robot_io.geometry import point_outside
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import Pose2D
from sim_backend.ridgeback.feeds import FeedWriter
from sim_backend.ridgeback.noise import FeedNoise
from sim_backend.ridgeback.ros_graph import Message, RosGraph
from sim_backend.ridgeback.settings import RidgebackSettings
from sim_backend.world.plant import BaseSource
from sim_backend.world.truth import point_of


class MotionCapture:
    """Publishes the base's markers, the object and /ridgeback/joint_states on one time grid, starting at `start_ns`."""

    def __init__(
        self,
        loop: EventLoop,
        graph: RosGraph,
        writer: FeedWriter,
        source: BaseSource,
        settings: RidgebackSettings,
        start_ns: int,
    ) -> None:
        self._loop, self._graph, self._writer, self._source = loop, graph, writer, source
        self._settings = settings
        self._jitter = random.Random(1)
        self._base_noise, self._slider_noise = FeedNoise(settings, "base"), FeedNoise(settings, "slider")
        self._ball_noise = FeedNoise(settings, "ball")
        self.offset = Pose2D()
        """Offset added to the measured pose of the base (a pose jump): m, m, rad."""
        self.base_hidden_until_ns = 0
        self.slider_hidden_until_ns = 0
        topics = settings.topics
        for name, type_name, node in (
            (topics.base_pose, topics.base_pose_type, "/vicon_bridge"),
            (settings.slider_topic, topics.slider_pose_type, "/vicon_bridge"),
            (topics.ball_pose, topics.slider_pose_type, "/vicon_bridge"),
            (topics.joint_states, topics.joint_states_type, "/ridgeback_vicon_estimator_node"),
        ):
            if name:
                graph.provide(name, type_name, node)
        period_ns = round(NS_PER_S / settings.mocap_rate_hz)
        first_ns = start_ns + round(settings.mocap_phase * period_ns)
        self._timer = loop.call_every(period_ns, self._frame, first_ns)

    def close(self) -> None:
        """Stop publishing."""
        self._timer.cancel()

    def _frame(self, t_ns: int) -> None:
        settings = self._settings
        messages: list[tuple[str, Message]] = []
        if t_ns >= self.base_hidden_until_ns:
            messages += self._base(t_ns)
        if t_ns >= self.slider_hidden_until_ns and self._graph.wanted(settings.slider_topic):
            slider = point_of(self._slider_noise.pose(self._source.read_slider(t_ns)), settings.slider_offset_m)
            messages.append((settings.slider_topic, self._writer.transform(settings.slider_topic, slider, t_ns)))
        if settings.topics.ball_pose and self._graph.wanted(settings.topics.ball_pose):
            messages.append(self._ball(t_ns))
        late_s = settings.mocap_latency_s + self._jitter.random() * settings.mocap_jitter_s
        if messages:
            self._loop.call_at(t_ns + round(late_s * NS_PER_S), lambda _: self._publish(messages))

    def _base(self, t_ns: int) -> list[tuple[str, Message]]:
        topics = self._settings.topics
        wanted = [name for name in (topics.base_pose, topics.joint_states) if name and self._graph.wanted(name)]
        if not wanted:
            return []
        truth = self._source.read_base(t_ns)
        pose, offset = self._base_noise.pose(truth.pose), self.offset
        seen = Pose2D(pose.x + offset.x, pose.y + offset.y, pose.yaw + offset.yaw)
        return [
            (name, self._writer.base_transform(name, seen, t_ns))
            if name == topics.base_pose
            else (name, self._writer.joint_states(name, seen, truth.twist, t_ns))
            for name in wanted
        ]

    def _ball(self, t_ns: int) -> tuple[str, Message]:
        base, topic = self._source.read_base(t_ns).pose, self._settings.topics.ball_pose
        x, y = point_outside(base.x, base.y, base.yaw, *self._settings.ball_in_base_m)
        return topic, self._writer.transform(topic, self._ball_noise.pose(Pose2D(x, y, base.yaw)), t_ns)

    def _publish(self, messages: list[tuple[str, Message]]) -> None:
        for name, message in messages:
            self._graph.publish(self._graph.topics[name], message)
