"""The processes of a wall-clock run and the descriptors between them.

    what               from -> to                                    kind
    log rings          control, gate, emulators -> recorder          memfd, one each
    alive pipes        control, gate, emulators -> recorder          nothing is written: EOF means it has ended
    gate link          control <-> gate                              SEQPACKET; EOF means control has ended
    records            gate -> control, arm -> control               memfd, newest wins
    pidfds             gate, arm, recorder -> control                readable when the process has ended
    run pipe           control -> arm, emulators                     nothing is written: EOF means control has ended
    launcher pipe      launcher -> gate                              nothing is written: EOF means it has ended
    live feed          recorder -> live                              SEQPACKET, with --live; drops, nobody waits
    operator pipe      launcher -> control                           a byte each: go, stop, pause, ..., alive
    status pipes       each of them -> launcher                      JSON lines

A copy of an inherited descriptor left open in the launcher would hide the end of the process that holds it, so all
are closed here as soon as the last process has its own.
"""

from __future__ import annotations

import contextlib
import os
import platform
import socket
from collections.abc import Callable
from pathlib import Path

import msgspec
from msgspec.structs import asdict, replace

from robot_io.clock import wall_offset_ns
from robot_io.ipc.record import ARM_RECORD, BASE_RECORD, TypedRecord
from robot_io.ipc.ring import Ring
from robot_io.ipc.spawn import Child, spawn
from robot_io.rig.config import RigConfig, rig_to_toml
from robot_io.ur10.driver import spawn_arm
from robot_io.ur10.generation import wanted_model
from robot_io.ur10.job import ArmJob
from safety.gate_process import GateJob
from safety.motion_bounds import total_bounds
from safety.settings import SafetySettings
from tools.kinds import is_shipped
from tools.live.view import start_live
from tools.places.saved_tare import SavedTare
from tools.rig import devices_at, faults_of, with_addresses
from tools.run.facts.run_facts import run_facts
from tools.run.injected_gate import InjectedGateJob
from tools.run.jobs import ArmKindJob, ControlJob, EmulatorJob
from tools.run.recorder import Job as RecorderJob
from tools.run.recorder import RingSource

RING_BYTES = {"control": 32 << 20, "gate": 8 << 20, "world": 8 << 20}
"""Room for about two minutes without a drain by the recorder."""


MOST_DESCRIPTORS = 128
"""Files and sockets that any process of a run has open at the same time, with room to spare."""


class Processes:
    """Starts the processes of one run, by `start_emulators` and `start_remaining`; `children` has them by name.

    saved: the tare of a run that starts in contact. log: where the recorder writes. note: the operator's, for the log.
    kind_folder: another place to look for modules of the rig's kinds. live_port: where to serve a live view, None for
    none. on_spawn: called with each child as soon as it has been started.
    """

    def __init__(
        self,
        rig: RigConfig,
        *,
        seed: int,
        saved: SavedTare | None,
        log: Path,
        kind_folder: str,
        note: str,
        live_port: int | None,
        on_spawn: Callable[[Child], None],
    ) -> None:
        self._rig = rig
        self._seed = seed
        self._saved = saved
        self._log = log
        self._kind_folder = kind_folder
        self._note = note
        self._live_port = live_port
        self._on_spawn = on_spawn
        self._offset_ns = wall_offset_ns()
        self._rings = {name: Ring.create(f"{name}-log", size) for name, size in RING_BYTES.items()}
        self._alive = {name: os.pipe() for name in RING_BYTES}
        self._run = os.pipe()
        self._operator_fd = self._launcher_fd = -1
        self.children: dict[str, Child] = {}

    @property
    def pids(self) -> dict[str, int]:
        """Process ids by name."""
        return {name: child.pid for name, child in self.children.items()}

    def start_emulators(self) -> list[str]:
        """Start the world and the wire servers of all devices at level emulated; return the name of the process."""
        emulated = tuple(devices_at(self._rig, "emulated"))
        if not emulated:
            return []
        ring_fd, alive_fd = self._rings["world"].fd, self._alive["world"][1]
        run_fd = self._run[0]
        job = EmulatorJob(
            rig_to_toml(self._rig), self._kind_folder, self._seed, emulated, os.getpid(), ring_fd, run_fd, -1
        )
        self._spawn("emulators", "tools.run.emulator_process", job, [ring_fd, alive_fd, run_fd])
        return ["emulators"]

    def start_remaining(self, config_text: str) -> list[str]:
        """Start recorder, gate, arm and control, once the emulators are ready; return their names.

        config_text: the resolved rig, for the log.
        """
        rig = self._with_endpoints()
        arm = TypedRecord.create("arm", ARM_RECORD)
        base = TypedRecord.create("base", BASE_RECORD)
        control_end, gate_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        operator_read, self._operator_fd = os.pipe()
        os.set_blocking(self._operator_fd, False)
        launcher_read, self._launcher_fd = os.pipe()
        self._start_recorder(config_text)
        self._start_gate(rig, gate_end.fileno(), base.fd, launcher_read)
        self._start_arm(rig, arm.fd)
        self._start_control(rig, control_end.fileno(), base.fd, arm.fd, operator_read)
        control_end.close()
        gate_end.close()
        os.close(operator_read)
        os.close(launcher_read)
        for read_end, write_end in (*self._alive.values(), self._run):
            os.close(read_end)
            os.close(write_end)
        for ring in self._rings.values():
            ring.close()
        arm.close()
        base.close()
        return ["recorder", "gate", "arm", "control"]

    def send_to_control(self, key: bytes) -> None:
        """Send bytes to control: G (go), S (stop), R (resume), P (pause), C (continue), L (log failed), H (alive).

        Ignored if it is not running.
        """
        if self._operator_fd >= 0:
            with contextlib.suppress(OSError):
                os.write(self._operator_fd, key)

    def hang_up(self) -> None:
        """Close the operator pipe, which control treats as a stop; idempotent."""
        if self._operator_fd >= 0:
            os.close(self._operator_fd)
            self._operator_fd = -1

    def close(self) -> None:
        """Close what shows the gate that the launcher lives, once all have ended; idempotent."""
        if self._launcher_fd >= 0:
            os.close(self._launcher_fd)
            self._launcher_fd = -1

    def _spawn(self, name: str, module: str, job: msgspec.Struct, fds: list[int]) -> None:
        self._adopt(spawn(name, module, job, fds))

    def _adopt(self, child: Child) -> None:
        self.children[child.name] = child
        self._on_spawn(child)

    def _with_endpoints(self) -> RigConfig:
        """Return the rig with the addresses of its emulators filled in."""
        emulators = self.children.get("emulators")
        ready = (emulators.ready if emulators else None) or {}
        return with_addresses(self._rig, ready.get("addresses", {}))

    def _start_recorder(self, config_text: str) -> None:
        facts = run_facts(self._rig, self._seed, in_contact=self._saved is not None, note=self._note)
        facts["kernel"] = platform.release()
        rings = [RingSource(name, ring.fd) for name, ring in self._rings.items()]
        alive = [self._alive[name][0] for name in ("control", "gate", "world")]
        job = RecorderJob(str(self._log), config_text, facts, self._offset_ns, rings, alive, -1)
        fds = [*(ring.fd for ring in rings), *alive]
        if self._live_port is None:
            self._spawn("recorder", "tools.run.recorder", job, fds)
            return
        child, feed = start_live(self._live_port)
        self._adopt(child)
        with feed:
            job = replace(job, live_fd=feed.fileno())
            self._spawn("recorder", "tools.run.recorder", job, [*fds, feed.fileno()])

    def _start_gate(self, rig: RigConfig, control_fd: int, record_fd: int, launcher_fd: int) -> None:
        limits = SafetySettings.of(rig).envelope
        bounds = total_bounds(rig)
        ring_fd = self._rings["gate"].fd
        fds = [control_fd, record_fd, ring_fd, launcher_fd]
        job = GateJob(
            *(rig.base, rig.frames, self._kind_folder, limits, bounds),
            *(control_fd, record_fd, ring_fd, launcher_fd, -1, self._offset_ns),
        )
        module = "safety.gate_process"
        if faults := faults_of(rig, "base"):
            job, module = InjectedGateJob(**asdict(job), faults=faults), "tools.run.injected_gate"
        self._spawn("gate", module, job, [*fds, self._alive["gate"][1]])

    def _start_arm(self, rig: RigConfig, record_fd: int) -> None:
        if not is_shipped("arm", rig.arm.kind):
            own = ArmKindJob(rig_to_toml(rig), self._kind_folder, os.getpid(), record_fd, self._run[0], -1)
            self._spawn("arm", "tools.run.arm_process", own, [record_fd, self._run[0]])
            return
        pose, tolerance_rad = rig.arm.held_pose_rad, rig.arm.held_pose_tolerance_rad
        model = wanted_model(rig.arm.options)
        job = ArmJob(
            rig.arm.host, rig.arm.hold, record_fd, os.getpid(), model, pose, tolerance_rad, run_fd=self._run[0]
        )
        self._adopt(spawn_arm(job))

    def _start_control(self, rig: RigConfig, gate_fd: int, base_fd: int, arm_fd: int, operator_fd: int) -> None:
        ring_fd, alive_fd = self._rings["control"].fd, self._alive["control"][1]
        # Opened here, where even a process that has ended can still be opened: it has not been waited for yet.
        pidfds = [os.pidfd_open(self.children[name].pid) for name in ("gate", "arm", "recorder")]
        job = ControlJob(
            rig_to_toml(rig),
            self._kind_folder,
            self._saved,
            os.getpid(),
            gate_fd,
            base_fd,
            arm_fd,
            ring_fd,
            operator_fd,
            -1,
            pidfds[0],
            pidfds[1],
            pidfds[2],
            self._offset_ns,
        )
        fds = [gate_fd, base_fd, arm_fd, ring_fd, alive_fd, operator_fd, self._run[1], *pidfds]
        self._spawn("control", "tools.run.control_process", job, fds)
        for pidfd in pidfds:
            os.close(pidfd)
