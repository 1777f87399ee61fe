"""All that a log holds beyond its records, made from them: by the recorder while it writes, by replay to compare.

The tick gives what people plot, the object's pose its frame, the rig what a 3-D viewer needs.
"""

from __future__ import annotations

from robot_io.log.ros_messages import POSE_STAMPED, planar_pose
from robot_io.log.world_messages import WorldState
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick
from tools.log.scene_topics import scene_messages, slider_frame, slider_pose
from tools.log.tick_topics import Message, TickTopics

TICK_TOPIC = "/control/tick"
WORLD_TOPIC = "/world/state"
SLIDER_TOPIC = "/slider/pose"


class Derivation:
    """Takes the records of one log in the order in which they were written; times are log times in ns."""

    def __init__(self, rig: RigConfig, wall_offset_ns: int) -> None:
        self._rig = rig
        self._topics = TickTopics(wall_offset_ns)
        # With motion capture of the object its pose is what was seen, else it is the world's truth.
        self.slider_is_seen = bool(rig.base.topics.slider_pose)

    def scene(self, first_ns: int) -> list[Message]:
        """Return what is said once, before the first record, which is of `first_ns`."""
        return scene_messages(self._rig, first_ns)

    def tick(self, tick: ControlTick) -> list[Message]:
        """Return what is made from a tick."""
        return self._topics.expand(tick)

    def world(self, state: WorldState, log_time_ns: int) -> list[Message]:
        """Return what is made from a state of the world."""
        if self.slider_is_seen:
            return []
        pose = planar_pose(state.slider.x, state.slider.y, state.slider.yaw)
        return [slider_pose(pose, log_time_ns), slider_frame(pose, log_time_ns)]

    def slider(self, payload: bytes, log_time_ns: int) -> list[Message]:
        """Return what is made from a pose of the object that was seen. Raises LogDamaged when it is none."""
        return [slider_frame(POSE_STAMPED.decode(payload).pose, log_time_ns)] if self.slider_is_seen else []
