"""The simulated world: base, contact ball, pushed object and sensor on one fixed 1 ms grid.

The world advances to the requested time before it answers; reading never changes what happens. What happens
depends only on start, parameters, seed and the arrival of each command, and all of these go to `on_record`,
so that the world can be re-run bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable

from robot_io.geometry import point_outside, seen_from_frame
from robot_io.log.world_messages import WorldCommand, WorldStall, WorldStart, WorldState
from robot_io.messages import BodyTwist, Joints, Pose2D, Vector3
from robot_io.rig.config import RigConfig
from sim_backend.physics.contact_outcome import FREE
from sim_backend.physics.steady.slider import SteadySlider
from sim_backend.world.arm_geometry import held_elsewhere
from sim_backend.world.base_plant import GRID_NS, BasePlant
from sim_backend.world.engine import pushed_object
from sim_backend.world.human import Human
from sim_backend.world.plant import ArmTruth, BaseTruth
from sim_backend.world.scene import place
from sim_backend.world.sensor_model import SensorModel
from sim_backend.world.steady_push import SteadyPush
from sim_backend.world.truth import true_frames

STATE_EVERY_STEPS = 10
STALL_STEPS = 30
"""More than this many steps late means that the host paused, which is logged."""

WorldRecord = WorldStart | WorldCommand | WorldState | WorldStall


class World:
    """Implements FtSource, ArmSource and BaseSource over one slider world.

    rig: its `world`, `frames` and `path` tables are used. start_ns: origin of the grid (CLOCK_MONOTONIC or
    virtual). on_record: called with each record, in order; without it none is made. compiled: see `SteadyPush`.
    """

    def __init__(
        self,
        rig: RigConfig,
        seed: int,
        start_ns: int,
        on_record: Callable[[WorldRecord], None] | None = None,
        *,
        compiled: bool = False,
    ) -> None:
        scene = place(rig, seed)
        self.seed = seed
        self._plant = BasePlant(
            scene.base,
            start_ns,
            tick_phase=rig.world.base_phase,
            rate_error=rig.world.base_tick_rate_error,
            slip=rig.world.slip,
        )
        self._slider = pushed_object(rig, seed, scene.slider)
        self._sensor = SensorModel(rig, seed)
        frames = true_frames(rig)
        self._held, self._base_from_sensor = rig.arm.held_pose_rad, frames.base_from_sensor
        self._human = Human(self._held, rig.world.hand, start_ns)
        self._reach = frames.contact_in_base_m[:2]
        self._ball = point_outside(*self._plant.place, *self._reach)
        self._steady = None
        if isinstance(self._slider, SteadySlider):
            self._steady = SteadyPush(self._plant, self._slider, self._reach, compiled=compiled)
        self._contact = FREE
        self._arm_moved = False
        self._start_ns = start_ns
        self._steps = 0
        self._on_record = on_record
        self.stalls = 0
        if on_record is not None:
            on_record(WorldStart(seed, start_ns))
            on_record(self._state())

    @property
    def now_ns(self) -> int:
        """Grid time up to which the world has been simulated."""
        return self._start_ns + self._steps * GRID_NS

    def advance_to(self, t_ns: int) -> None:
        """Step to the last grid time that is not after `t_ns`."""
        due = (t_ns - self._start_ns) // GRID_NS - self._steps
        if due > STALL_STEPS:
            self.stalls += 1
            if self._on_record is not None:
                self._on_record(WorldStall(self.now_ns, due))
        while due > 0:
            due -= self._go_on(due) or self._step()

    def read_ft(self, t_ns: int) -> tuple[float, float, float, float, float, float]:
        """See `FtSource.read_ft`."""
        self.advance_to(t_ns)
        contact = self._contact
        pose = self._plant.pose
        if self._arm_moved:
            joints = self._human.arm(t_ns).position
            self._sensor.turn_to(held_elsewhere(self._base_from_sensor, self._held, joints))
        reading = self._sensor.true_reading(
            (contact.force_x, contact.force_y), _in_base(pose, contact.contact_x, contact.contact_y), pose.yaw
        )
        return self._sensor.with_noise(self._sensor.with_hand(reading, self._human.force(t_ns)))

    def read_arm(self, t_ns: int) -> ArmTruth:
        """See `ArmSource.read_arm`: the arm is held still, unless it is moved by hand."""
        self.advance_to(t_ns)
        return self._human.arm(t_ns)

    def read_base(self, t_ns: int) -> BaseTruth:
        """See `BaseSource.read_base`."""
        self.advance_to(t_ns)
        return BaseTruth(self._plant.pose, self._plant.velocity, self._plant.rolled)

    def read_slider(self, t_ns: int) -> Pose2D:
        """See `BaseSource.read_slider`."""
        self.advance_to(t_ns)
        return self._slider.pose

    def command_base(self, twist: BodyTwist, arrival_ns: int) -> None:
        """See `BaseSource.command_base`; it acts at the first base tick that is not before its arrival."""
        counted_ns = self._plant.command(twist, arrival_ns)
        if self._on_record is not None:
            self._on_record(WorldCommand(counted_ns, twist, False, True))

    def set_drivers(self, active: bool, at_ns: int) -> None:
        """See `BaseSource.set_drivers`."""
        counted_ns = self._plant.set_drivers(active, at_ns)
        if self._on_record is not None:
            self._on_record(WorldCommand(counted_ns, BodyTwist(), True, active))

    def press(self, force: Vector3, for_s: float, at_ns: int) -> None:
        """Press on the ball by hand, with a force in N (BODY frame) from `at_ns` on."""
        self._human.press(force, for_s, at_ns)

    def move_arm(self, joints: Joints, in_s: float, at_ns: int) -> None:
        """Move the arm by hand to `joints` (rad); the sensor turns with it.

        A push needs the arm in its held pose, so the ball of the world stays where that has it.
        """
        self._arm_moved = True
        self._human.move_arm(joints, in_s, at_ns)

    def _go_on(self, steps: int) -> int:
        """Advance by as many steps as the push goes on as it is, and at most to the next record; return how many."""
        if self._steady is None:
            return 0
        if self._on_record is not None:
            steps = min(steps, STATE_EVERY_STEPS - self._steps % STATE_EVERY_STEPS)
        found = self._steady.advance(steps, self._ball)
        if found is None:
            return 0
        done, self._ball, self._contact = found
        self._steps += done
        self._record()
        return done

    def _step(self) -> int:
        self._steps += 1
        self._plant.step_to(self.now_ns)
        ball = point_outside(*self._plant.place, *self._reach)
        self._contact = self._slider.step(self._ball, ball, GRID_NS * 1e-9)
        self._ball = ball
        self._record()
        return 1

    def _record(self) -> None:
        if self._on_record is not None and self._steps % STATE_EVERY_STEPS == 0:
            self._on_record(self._state())

    def _state(self) -> WorldState:
        contact = self._contact
        return WorldState(
            self.now_ns,
            self._plant.pose,
            self._plant.velocity,
            self._slider.pose,
            contact.force_x,
            contact.force_y,
            contact.contact_x,
            contact.contact_y,
            int(contact.mode),
        )


def _in_base(pose: Pose2D, x_world: float, y_world: float) -> tuple[float, float]:
    return seen_from_frame(x_world - pose.x, y_world - pose.y, pose.yaw)
