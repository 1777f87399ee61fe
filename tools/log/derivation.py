"""Derive the additional topics of a log from its records: the recorder writes them, replay compares them.

Ticks give the topics people plot, the object's pose gives its frame, the rig gives what a 3-D viewer needs.
"""

from __future__ import annotations

from robot_io.log.log_format import LOG_FORMAT
from robot_io.log.ros_messages import POSE_STAMPED, planar_pose
from robot_io.log.world_messages import WorldState
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick
from tools.log.scene_topics import scene_messages, slider_frame, slider_pose
from tools.log.thinned_topics import VIEWER_NS, Thinned
from tools.log.tick_topics import Message, TickTopics

TICK_TOPIC = "/control/tick"
WORLD_TOPIC = "/world/state"
SLIDER_TOPIC = "/slider/pose"


class Derivation:
    """Derives messages from the records of one log, given in the order written; times are log times in ns.

    log_format: of that log, so that replay derives what a log of an earlier format held.
    """

    def __init__(self, rig: RigConfig, wall_offset_ns: int, log_format: int = LOG_FORMAT) -> None:
        self._rig = rig
        self._topics = TickTopics(rig, wall_offset_ns, log_format)
        self._object = Thinned(VIEWER_NS if log_format >= 5 else 0)
        # With motion capture the object's pose is measured, otherwise it is the simulated ground truth.
        self.slider_is_tracked = bool(rig.base.topics.slider_pose)

    def scene(self, first_ns: int) -> list[Message]:
        """Return the messages written once, before the first record, whose log time is `first_ns`."""
        return scene_messages(self._rig, first_ns)

    def tick(self, tick: ControlTick) -> list[Message]:
        """Return the messages derived from a tick."""
        return self._topics.expand(tick)

    def world(self, state: WorldState, log_time_ns: int) -> list[Message]:
        """Return the messages derived from a state of the simulated world."""
        if self.slider_is_tracked or not self._object.due(log_time_ns):
            return []
        pose = planar_pose(state.slider.x, state.slider.y, state.slider.yaw)
        return [slider_pose(pose, log_time_ns), slider_frame(pose, log_time_ns)]

    def slider(self, payload: bytes, log_time_ns: int) -> list[Message]:
        """Return the messages derived from a tracked pose of the object. Raises LogDamaged if it cannot be decoded."""
        if not self.slider_is_tracked:
            return []
        pose = POSE_STAMPED.decode(payload).pose
        return [slider_frame(pose, log_time_ns)] if self._object.due(log_time_ns) else []
