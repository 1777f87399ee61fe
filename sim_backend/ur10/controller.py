"""The emulated controller: power, safety, program, registers and joints, one control cycle at a time (8 ms or 2 ms).

It has no sockets. Simplified: power steps take a fixed time; a protective stop pauses the running program and
unlocking leaves it paused; an emergency stop ends the program and switches the power off.
"""

from __future__ import annotations

import math

from robot_io.clock import NS_PER_MS, NS_PER_S
from robot_io.messages import Joints
from sim_backend.ur10.force_sensor import ForceSensor
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.modes import MAY_MOVE, RobotMode, RuntimeState, SafetyMode, SafetyStatus
from sim_backend.ur10.motion import ArmMotion
from sim_backend.ur10.program import OtherProgram, Program, program_of
from sim_backend.ur10.registers import Registers, Watchdog
from sim_backend.world.plant import ArmSource, FtSource

PROGRAM_START_NS = 50 * NS_PER_MS
UNLOCK_AFTER_NS = 5 * NS_PER_S
START_TIME_S = 1000.0
"""The controller's own clock when the emulator starts."""


class UrController:
    """State of one robot; `cycle` advances it, everything else changes it at once."""

    def __init__(
        self,
        source: ArmSource,
        model: UrModel,
        now_ns: int,
        power_step_s: float = 1.0,
        wrench: FtSource | None = None,
    ) -> None:
        self.model = model
        self.version = model.version
        self.registers = Registers()
        self.motion = ArmMotion(model.range_rad)
        self.watchdog: Watchdog | None = None
        self.payload_kg = 0.0
        self.payload_cog_m = (0.0, 0.0, 0.0)
        self.tcp_offset: Joints = (0.0,) * 6
        self.external_wrench: Joints = (0.0,) * 6
        self.force_sensor = ForceSensor(wrench)
        self.robot_mode = RobotMode.RUNNING
        self.safety_mode = SafetyMode.NORMAL
        self.safeguard = SafetyStatus.SAFEGUARD_STOP
        self.runtime_state = RuntimeState.STOPPED
        self.teach_button = False
        self.program: Program | None = None
        self.time_jump_s = 0.0
        self.nan_joints: set[int] = set()
        self.ignore_scripts = False
        self.counters = {"cycles": 0, "programs_started": 0, "scripts_refused": 0, "watchdog_trips": 0}
        self._source = source
        self._power_step_ns = int(power_step_s * NS_PER_S)
        self._now_ns = now_ns
        self._stopped_ns = 0
        self._waiting: tuple[int, Program] | None = None
        self._power_at: tuple[int, RobotMode] | None = None
        self.motion.step(source.read_arm(now_ns), model.cycle_s)

    @property
    def time_s(self) -> float:
        """The controller's own clock, s: it advances by exactly one cycle time per cycle."""
        return START_TIME_S + self.counters["cycles"] * self.model.cycle_s + self.time_jump_s

    @property
    def safety_status(self) -> SafetyStatus:
        """The safety mode as an e-Series says it, which tells safeguard stops apart."""
        return self.safeguard if self.safety_mode == SafetyMode.SAFEGUARD_STOP else SafetyStatus(self.safety_mode)

    @property
    def raw_wrench(self) -> Joints:
        """What the sensor at the flange reads, in its axes: N, N*m. Zeros without one."""
        return self.force_sensor.raw(self._now_ns)

    @property
    def tcp_force(self) -> Joints:
        """Wrench on the tool in the axes of the arm's base: N, N*m. Of the sensor, or as a client feeds it in."""
        if not self.force_sensor.fitted:
            return self.external_wrench
        return self.force_sensor.compensated(self._now_ns, self.motion.actual, self.payload_kg, self.payload_cog_m)

    def zero_force_sensor(self) -> None:
        """Make the force on the tool zero as it is now, as `zero_ftsensor()` does. The raw wrench stays."""
        self.force_sensor.zero(self._now_ns, self.motion.actual, self.payload_kg, self.payload_cog_m)

    @property
    def reported_q(self) -> Joints:
        """Joints as reported (rad), with injected faults."""
        if not self.nan_joints:
            return self.motion.actual
        a, b, c, d, e, f = (math.nan if i in self.nan_joints else q for i, q in enumerate(self.motion.actual))
        return (a, b, c, d, e, f)

    def cycle(self, now_ns: int) -> None:
        """Run one control cycle at `now_ns` (a grid time, monotonic)."""
        self._now_ns = now_ns
        self.counters["cycles"] += 1
        if self._power_at is not None and now_ns >= self._power_at[0]:
            self.robot_mode = self._power_at[1]
            self._power_at = None
        if self._waiting is not None and now_ns >= self._waiting[0]:
            self._begin_program(self._waiting[1])
        if self.watchdog is not None and self.watchdog.tripped(now_ns):
            self.counters["watchdog_trips"] += 1
            self.stop_program()
        playing = self.runtime_state == RuntimeState.PLAYING
        if playing and self.program is not None and not self.program.step(self, now_ns):
            self.stop_program()
        self.motion.step(self._source.read_arm(now_ns), self.model.cycle_s)

    def upload(self, text: str) -> None:
        """Accept a program from a script port; it replaces a running one. Ignored silently when not ready."""
        if self.ignore_scripts or not self.ready:
            self.counters["scripts_refused"] += 1
            return
        self.start_program(program_of(text))

    @property
    def ready(self) -> bool:
        """Return whether programs may run."""
        return self.robot_mode == RobotMode.RUNNING and self.safety_mode in MAY_MOVE

    def start_program(self, program: Program) -> None:
        """Stop the running program and start `program` a moment later."""
        self.stop_program()
        self._waiting = (self._now_ns + PROGRAM_START_NS, program)

    def _begin_program(self, program: Program) -> None:
        self._waiting = None
        if not self.ready:  # it was ready when the program arrived
            self.counters["scripts_refused"] += 1
            return
        self.program = program
        self.runtime_state = RuntimeState.PLAYING
        self.counters["programs_started"] += 1

    def play_other_program(self, name: str = "other") -> None:
        """Run another program, as from the pendant."""
        self.start_program(OtherProgram(name))

    def stop_program(self) -> None:
        """End the running program; the arm stays where it is."""
        self.program = None
        self._waiting = None
        self.watchdog = None
        self.runtime_state = RuntimeState.STOPPED
        self.motion.hold()

    def pause_program(self) -> None:
        """Pause the running program; the arm stays where it is."""
        if self.runtime_state == RuntimeState.PLAYING:
            self.runtime_state = RuntimeState.PAUSED
            self.motion.hold()

    def resume_program(self) -> None:
        """Resume a paused program."""
        if self.runtime_state == RuntimeState.PAUSED and self.ready:
            self.runtime_state = RuntimeState.PLAYING

    def power_on(self) -> None:
        """Power on the arm; a moment later it is IDLE, brakes still on."""
        if self.robot_mode == RobotMode.POWER_OFF and self.safety_mode in MAY_MOVE:
            self.robot_mode = RobotMode.BOOTING
            self._power_at = (self._now_ns + self._power_step_ns, RobotMode.IDLE)

    def release_brakes(self) -> None:
        """Release the brakes: from IDLE to RUNNING a moment later."""
        if self.robot_mode == RobotMode.IDLE:
            self._power_at = (self._now_ns + self._power_step_ns, RobotMode.RUNNING)

    def power_off(self) -> None:
        """Engage the brakes and switch the power off, at once."""
        self.stop_program()
        self._power_at = None
        self.robot_mode = RobotMode.POWER_OFF

    def trip_protective_stop(self) -> None:
        """Stop as for a collision; the program is paused."""
        self.pause_program()
        self.safety_mode = SafetyMode.PROTECTIVE_STOP
        self._stopped_ns = self._now_ns

    def trip_safeguard_stop(self, status: SafetyStatus = SafetyStatus.SAFEGUARD_STOP) -> None:
        """Stop as for an opened safety fence; the program is paused. An e-Series tells which safeguard it was."""
        self.safeguard = status
        self.pause_program()
        self.safety_mode = SafetyMode.SAFEGUARD_STOP

    def trip_emergency_stop(self) -> None:
        """Stop as by the red button: power off, program ended."""
        self.power_off()
        self.safety_mode = SafetyMode.ROBOT_EMERGENCY_STOP

    def unlock_protective_stop(self) -> bool:
        """Unlock; return False within 5 s of the stop. The program stays paused."""
        if self.safety_mode == SafetyMode.PROTECTIVE_STOP:
            if self._now_ns - self._stopped_ns < UNLOCK_AFTER_NS:
                return False
            self.safety_mode = SafetyMode.NORMAL
        return True

    def clear_stop(self) -> None:
        """Return to safety mode NORMAL from any other; power and program are unchanged."""
        self.safety_mode = SafetyMode.NORMAL
