"""Fault injection for an emulated UR10: every method acts and returns at once."""

from __future__ import annotations

from collections.abc import Sequence

from sim_backend.ur10.controller import UrController
from sim_backend.ur10.dashboard import DashboardServer
from sim_backend.ur10.modes import RobotMode, SafetyMode, SafetyStatus
from sim_backend.ur10.registers import REGISTERS
from sim_backend.ur10.rtde_server import RtdeServer
from sim_backend.ur10.tcp import TcpServer


class UrFaults:
    """Fault injection on the parts of one emulator."""

    controller: UrController
    rtde: RtdeServer
    dashboard: DashboardServer
    scripts: list[TcpServer]

    def set_robot_mode(self, mode: int) -> None:
        """Set the robot mode (see `RobotMode`); below RUNNING the program ends."""
        if mode != RobotMode.RUNNING:
            self.controller.stop_program()
        self.controller.robot_mode = RobotMode(mode)

    def set_safety_mode(self, mode: int) -> None:
        """Set the safety mode (see `SafetyMode`) and nothing else."""
        self.controller.safety_mode = SafetyMode(mode)

    def protective_stop(self) -> None:
        """Stop as for a collision; a program is paused."""
        self.controller.trip_protective_stop()

    def safeguard_stop(self) -> None:
        """Stop as for an opened safety fence; a program is paused."""
        self.controller.trip_safeguard_stop()

    def enabling_stop(self) -> None:
        """Stop as by a three-position enabling switch let go (e-Series); a program is paused."""
        self.controller.trip_safeguard_stop(SafetyStatus.SYSTEM_THREE_POSITION_ENABLING_STOP)

    def zero_force(self) -> None:
        """Zero the force on the tool from the pendant."""
        self.controller.zero_force_sensor()

    def jump_force(self, wrench: Sequence[float]) -> None:
        """Let the sensor at the flange read this much more in each axis (N, N*m), at once and for good."""
        fx, fy, fz, mx, my, mz = wrench
        self.controller.force_sensor.jump = (fx, fy, fz, mx, my, mz)

    def break_force(self) -> None:
        """Let the sensor at the flange read NaN."""
        self.controller.force_sensor.broken = True

    def emergency_stop(self) -> None:
        """Stop as by the red button: power off."""
        self.controller.trip_emergency_stop()

    def clear_stop(self) -> None:
        """Return to safety mode NORMAL; power and program are unchanged."""
        self.controller.clear_stop()

    def resume_program(self) -> None:
        """Resume a paused program, as from the pendant."""
        self.controller.resume_program()

    def power_off(self) -> None:
        """Power off from the pendant."""
        self.controller.power_off()

    def teach_button(self, pressed: bool) -> None:
        """Press or release the button that makes the arm compliant."""
        self.controller.teach_button = pressed

    def play_other_program(self, name: str = "other") -> None:
        """Start another program, as from the pendant."""
        self.controller.play_other_program(name)

    def pause_program(self) -> None:
        """Pause the running program from the pendant."""
        self.controller.pause_program()

    def stop_program(self) -> None:
        """Stop the running program from the pendant."""
        self.controller.stop_program()

    def ignore_scripts(self, on: bool = True) -> None:
        """Ignore uploaded programs."""
        self.controller.ignore_scripts = on

    def drift_step(self, joints_rad: Sequence[float]) -> None:
        """Shift the joints at once by six angles (rad)."""
        self.controller.motion.offset = [
            was + by for was, by in zip(self.controller.motion.offset, joints_rad, strict=True)
        ]

    def drift_rate(self, joints_rad_per_s: Sequence[float]) -> None:
        """Let the joints drift at six rates (rad/s); zeros end it."""
        if len(joints_rad_per_s) != 6:
            raise ValueError("six rates, one per joint")
        self.controller.motion.drift_rate = list(joints_rad_per_s)

    def nan_joint(self, joint: int, on: bool = True) -> None:
        """Report NaN for one joint (0..5)."""
        (self.controller.nan_joints.add if on else self.controller.nan_joints.discard)(joint)

    def jump_time(self, seconds: float) -> None:
        """Make the controller's time stamp jump, backwards if negative."""
        self.controller.time_jump_s += seconds

    def mute(self, on: bool = True) -> None:
        """Answer RTDE requests but send no data."""
        self.rtde.muted = on

    def mute_dashboard(self, on: bool = True) -> None:
        """Accept dashboard connections but send nothing."""
        self.dashboard.muted = on

    def take_inputs(self) -> None:
        """Hold every general-purpose input register, as a fieldbus does."""
        names = [f"input_{kind}_register_{i}" for kind in ("int", "double") for i in range(REGISTERS)]
        self.rtde.owners.update(dict.fromkeys(names, self))

    def be_model(self, model: str) -> None:
        """Call itself another robot."""
        self.dashboard.dashboard.model = model

    def freeze(self, on: bool = True) -> None:
        """Freeze the controller as SIGSTOP does: the kernel accepts connections, nothing is read or answered."""
        for server in self._servers():
            server.freeze(on)

    def drop_data(self, frames: int) -> None:
        """Drop the next data frames."""
        for client in self.rtde.rtde_clients:
            client.skip_frames += frames

    def truncate_data(self, values_bytes: int) -> None:
        """Cut the values of the next data frame; its header matches the shortened frame."""
        for client in self.rtde.rtde_clients:
            client.cut_frame_to = values_bytes

    def truncate_all_data(self, values_bytes: int) -> None:
        """Cut the values of every data frame from now on."""
        self.rtde.cut_frames_to = values_bytes

    def send_garbage(self, data_hex: str = "00000000ffff55") -> None:
        """Send raw bytes (hex) in place of a frame."""
        for client in self.rtde.rtde_clients:
            client.send(bytes.fromhex(data_hex))

    def send_text(self, text: str) -> None:
        """Send an RTDE text message to every client."""
        for client in self.rtde.rtde_clients:
            client.send_text(text)

    def close_clients(self) -> None:
        """End all connections with FIN; the ports stay open."""
        for server in self._servers():
            server.close_clients()

    def reset_clients(self) -> None:
        """End all connections with RST; the ports stay open."""
        for server in self._servers():
            server.close_clients(reset=True)

    def close_rtde_clients(self) -> None:
        """End the RTDE connections only."""
        self.rtde.close_clients()

    def _servers(self) -> list[TcpServer]:
        return [self.rtde, self.dashboard, *self.scripts]
