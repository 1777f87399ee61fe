"""A wall-clock run: starts the processes, watches them, owns terminal and signals, and tells how it ended.

    emulators   one process with the world and its wire servers (emulated devices only)
    recorder    drains the log rings into run.mcap, finishes it when control is gone
    gate        sole holder of the base connection
    arm         the ur_rtde wheel, publishing a shared record
    control     the loop: sensor in, law, supervisor, envelope, one frame to the gate a tick

The launcher itself has no device and no real-time duty: a blocked terminal never touches a tick.
"""

from __future__ import annotations

import contextlib
import os
import platform
import signal
import socket
import tempfile
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from robot_io.arm_record import ARM_RECORD_BYTES
from robot_io.base_record import BASE_RECORD_BYTES
from robot_io.clock import NS_PER_S, monotonic_ns, wall_offset_ns
from robot_io.config import RigConfig, rig_to_toml
from robot_io.errors import DeviceError, OperatorStop, SafetyStop
from robot_io.event_loop import EventLoop
from robot_io.ring import Ring
from robot_io.shared_record import SharedRecord
from robot_io.ur10 import spawn_child
from safety.gate import GateLimits, Latch
from safety.gate_process import GateJob
from safety.settings import SafetySettings
from tools import run_dir
from tools.children import Child, spawn
from tools.jobs import ControlJob, EmulatorJob
from tools.live_line import LiveLine
from tools.operator_keys import OperatorKeys
from tools.recorder import Job as RecorderJob
from tools.recorder import RingSource
from tools.rig import devices_at
from tools.run_facts import level_of, run_facts
from tools.saved_tare import SavedTare

RING_BYTES = {"control": 32 << 20, "gate": 8 << 20, "world": 8 << 20}
"""Room for about two minutes of a recorder that does not drain."""
EMULATORS_READY_NS = 8 * NS_PER_S
READY_NS = 9 * NS_PER_S
"""Each device has its own, shorter deadline; this one only catches a process that hangs before it."""
OTHERS_NS = 4 * NS_PER_S
"""After the first device failed, the others may still say what is wrong with them."""
FROZEN_NS = NS_PER_S
"""The gate has latched and control has not spoken for this long: it is frozen, and is killed."""

DEVICE_NAMES = {"ft": "ft300", "arm": "ur10", "base": "ridgeback"}


class Launcher:
    """One run at level emulated, hardware or a mix; `run` returns what control said at its end."""

    def __init__(self, rig: RigConfig, out: Path, *, seed: int, saved: SavedTare | None, live: LiveLine) -> None:
        self._rig = rig
        self._out = out
        self._seed = seed
        self._saved = saved
        self._live = live
        self._loop = EventLoop()
        self._children: dict[str, Child] = {}
        self._stops = 0
        self._operator_fd = -1
        self._to_close: list[int] = []
        self._offset_ns = wall_offset_ns()
        self._gate_latch = ""
        self._status_ns = 0
        self.log = out / "run.mcap"

    def run(self) -> dict[str, Any]:
        """Run to the end; return control's figures. Raises PushError when it never began, or did not end by itself."""
        keys = OperatorKeys(self._loop, self._stop, self._resume)
        try:
            self._start()
            return self._watch()
        finally:
            self._end()
            keys.close()
            self._loop.close()

    @property
    def devices(self) -> dict[str, dict[str, int]]:
        """Counters of the three devices, as their drivers counted."""
        control, gate = self._said("control"), self._said("gate")
        return {
            "ft300": control.get("ft", {}),
            "ur10": {"packets": control.get("arm_packets", 0)},
            "ridgeback": gate.get("counters", {}),
        }

    def recorded(self) -> dict[str, Any]:
        """Return what the recorder said at its end."""
        return self._said("recorder")

    def _said(self, name: str) -> dict[str, Any]:
        child = self._children.get(name)
        return (child.finished if child else None) or {}

    # --- start -----------------------------------------------------------------------------------------------

    def _start(self) -> None:
        pipes = {name: os.pipe() for name in ("control", "gate", "world")}
        rings = {name: Ring.create(f"{name}-log", size) for name, size in RING_BYTES.items()}
        emulated = tuple(DEVICE_NAMES[device] for device in devices_at(self._rig, "emulated"))
        rig = self._rig
        if emulated:
            self._spawn(
                "emulators",
                "tools.emulator_process",
                lambda status: EmulatorJob(
                    rig_to_toml(rig), self._seed, emulated, os.getpid(), rings["world"].fd, pipes["world"][1], status
                ),
                [rings["world"].fd, pipes["world"][1]],
            )
            self._wait_ready(["emulators"], EMULATORS_READY_NS)
            rig = self._with_endpoints(rig)
        os.close(pipes["world"][1])
        config_text = run_dir.write_config(self._out, self._rig)
        arm = SharedRecord.create("arm", ARM_RECORD_BYTES)
        base = SharedRecord.create("base", BASE_RECORD_BYTES)
        control_end, gate_end = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        operator_read, self._operator_fd = os.pipe()
        os.set_blocking(self._operator_fd, False)
        self._spawn_recorder(config_text, rings, [pipes[name][0] for name in ("control", "gate", "world")])
        self._spawn_gate(rig, gate_end.fileno(), base.fd, rings["gate"].fd, pipes["gate"][1])
        self._spawn_arm(rig, arm.fd)
        self._spawn_control(
            rig, control_end.fileno(), base.fd, arm.fd, rings["control"].fd, pipes["control"][1], operator_read
        )
        # Every copy of an inherited end that stays open here would hide the end of the process that holds it.
        control_end.close()
        gate_end.close()
        for fd in (operator_read, pipes["control"][1], pipes["gate"][1], *(pipe[0] for pipe in pipes.values())):
            os.close(fd)
        for ring in rings.values():
            ring.close()
        for record in (arm, base):
            record.close()
        self._write_processes()
        self._wait_ready(["recorder", "gate", "arm", "control"], READY_NS)
        self._tell_priority()
        os.write(self._operator_fd, b"G")

    def _tell_priority(self) -> None:
        plain = [name for name, child in self._children.items() if (child.ready or {}).get("realtime") is False]
        if plain:
            self._live.say(
                f"no right to real-time priority: {', '.join(plain)} at normal priority (supported at 100 Hz)"
            )

    def _spawn(self, name: str, module: str, job: Any, fds: list[int]) -> Child:
        status = os.pipe()
        child = spawn(name, module, job(status[1]), fds, status)
        return self._adopt(child)

    def _adopt(self, child: Child) -> Child:
        self._children[child.name] = child
        self._loop.add_fd(child.status.fd, lambda _events: self._hear(child))
        return child

    def _spawn_recorder(self, config_text: str, rings: dict[str, Ring], alive: list[int]) -> None:
        facts = run_facts(level_of(self._rig), self._seed, in_contact=self._saved is not None)
        facts["kernel"] = platform.release()
        self._spawn(
            "recorder",
            "tools.recorder",
            lambda status: RecorderJob(
                str(self.log),
                config_text,
                facts,
                self._offset_ns,
                [RingSource(name, ring.fd) for name, ring in rings.items()],
                alive,
                status,
            ),
            [*(ring.fd for ring in rings.values()), *alive],
        )

    def _spawn_gate(self, rig: RigConfig, control_fd: int, record_fd: int, ring_fd: int, alive_fd: int) -> None:
        settings = SafetySettings.of(rig)
        envelope = settings.envelope
        limits = GateLimits(
            envelope.speed,
            envelope.turn_rate,
            envelope.acceleration,
            envelope.turn_acceleration,
            settings.period_ns,
        )
        self._spawn(
            "gate",
            "safety.gate_process",
            lambda status: GateJob(
                rig.base, rig.frames, limits, control_fd, record_fd, ring_fd, status, self._offset_ns
            ),
            [control_fd, record_fd, ring_fd, alive_fd],
        )

    def _spawn_arm(self, rig: RigConfig, record_fd: int) -> None:
        status = os.pipe()
        stderr = tempfile.TemporaryFile(prefix="push-")  # noqa: SIM115 - the Child closes it
        process = spawn_child(
            rig.arm.host,
            hold=rig.arm.hold,
            record_fd=record_fd,
            status_fd=status[1],
            held_pose_rad=rig.arm.held_pose_rad,
            held_pose_tolerance_rad=rig.arm.held_pose_tolerance_rad,
            stderr=stderr,
        )
        os.close(status[1])
        self._adopt(Child("arm", process, status[0], stderr))

    def _spawn_control(
        self, rig: RigConfig, gate_fd: int, base_fd: int, arm_fd: int, ring_fd: int, alive_fd: int, operator_fd: int
    ) -> None:
        self._spawn(
            "control",
            "tools.control_process",
            lambda status: ControlJob(
                rig_to_toml(rig),
                rig.ft.port,
                self._saved,
                os.getpid(),
                gate_fd,
                base_fd,
                arm_fd,
                ring_fd,
                alive_fd,
                operator_fd,
                status,
                self._children["gate"].pid,
                self._children["arm"].pid,
                self._children["recorder"].pid,
            ),
            [gate_fd, base_fd, arm_fd, ring_fd, alive_fd, operator_fd],
        )

    def _with_endpoints(self, rig: RigConfig) -> RigConfig:
        ready = self._children["emulators"].ready or {}
        for found in ready["endpoints"]:
            if found["device"] == "ft300":
                rig = replace(rig, ft=replace(rig.ft, port=found["port"]))
            elif found["device"] == "ur10":
                rig = replace(rig, arm=replace(rig.arm, host=found["host"]))
            else:
                rig = replace(rig, base=replace(rig.base, url=found["url"]))
        return rig

    def _write_processes(self) -> None:
        pids = {name: child.pid for name, child in self._children.items()}
        run_dir.write_json(self._out / "processes.json", {"schema": 1, "launcher": os.getpid(), **pids})

    # --- waiting ---------------------------------------------------------------------------------------------

    def _hear(self, child: Child) -> None:
        for event in child.hear():
            if event.get("event") == "status":
                self._status_ns = monotonic_ns()
                self._live.show(event)
            elif event.get("event") == "latched" and event["latch"] != Latch.EOF:
                self._gate_latch = event["text"]
                self._live.say(f"gate: {event['text']}")
            elif child.name == "recorder" and event.get("event") == "error":
                self._live.say(f"recorder: {event['what']}")
        if not child.status.open:
            self._loop.remove_fd(child.status.fd)

    def _wait_ready(self, names: list[str], within_ns: int) -> None:
        """Wait until all are ready. Raises DeviceError with everything that failed, each with what to do."""
        deadline_ns = monotonic_ns() + within_ns
        while True:
            waiting = [self._children[name] for name in names if self._children[name].ready is None]
            if not waiting:
                return
            failed = [child for child in waiting if child.errors or child.process.poll() is not None]
            if failed and deadline_ns > monotonic_ns() + OTHERS_NS:
                deadline_ns = monotonic_ns() + OTHERS_NS
            if self._stops:
                raise OperatorStop("stopped before the start")
            # Control opens the sensor, the gate the base, the arm's process the arm: all three may still speak.
            if failed and (len(failed) == len(waiting) or monotonic_ns() > deadline_ns):
                raise combined(failed)
            if monotonic_ns() > deadline_ns:
                raise DeviceError(f"not ready in time: {', '.join(child.name for child in waiting)}", do="Try again")
            self._loop.run_once(20)
            for child in self._children.values():
                if child.status.open:
                    self._hear(child)

    def _watch(self) -> dict[str, Any]:
        control = self._children["control"]
        while control.process.poll() is None:
            self._loop.run_once(50)
            if self._gate_latch and monotonic_ns() - self._status_ns > FROZEN_NS:
                control.process.kill()  # the base has its zeros; a frozen control would only hide the end
        self._hear(control)
        self._live.end()
        if control.finished is None:
            code = control.process.returncode
            how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
            words = control.last_words()
            raise SafetyStop(
                f"the control process {how}{f' ({words})' if words else ''}; the gate stopped the base"
                f"{f': {self._gate_latch}' if self._gate_latch else ''}",
                where="control",
                do=f"Its log is complete: push replay {self._out}",
            )
        figures: dict[str, Any] = control.finished
        return figures

    def _stop(self) -> None:
        self._stops += 1
        if self._stops == 1:
            self._live.say("stopping ...")
            self._tell(b"S")
        elif "control" in self._children:
            self._live.say("stopping at once")
            with contextlib.suppress(ProcessLookupError):
                self._children["control"].process.kill()

    def _resume(self) -> None:
        self._tell(b"R")

    def _tell(self, key: bytes) -> None:
        if self._operator_fd >= 0:
            with contextlib.suppress(OSError):
                os.write(self._operator_fd, key)

    # --- end -------------------------------------------------------------------------------------------------

    def _end(self) -> None:
        """End every process in order: control, gate (by control's EOF), emulators, arm, recorder (by their EOF)."""
        if self._operator_fd >= 0:
            os.close(self._operator_fd)
            self._operator_fd = -1
        order = (("control", 2.0), ("gate", 1.5), ("emulators", 2.0), ("arm", 3.0), ("recorder", 5.0))
        for name, within_s in order:
            child = self._children.get(name)
            if child is None:
                continue
            if name in ("emulators", "arm") or (name == "control" and child.ready is None):
                child.terminate()
            child.end(within_s)
            if child.status.open:
                child.hear()
        for child in self._children.values():
            if child.process.returncode not in (0, None) and child.name in ("recorder", "gate", "emulators"):
                words = child.last_words()
                if words:
                    self._live.say(f"{child.name}: {words}")
            self._loop.remove_fd(child.status.fd)
            child.close()


def combined(failed: list[Child]) -> DeviceError:
    """Return one error that names every device that failed, and what to do about each."""
    found: list[tuple[str, str, str]] = []
    for child in failed:
        for error in child.errors:
            found.append((str(error.get("what", "")), str(error.get("where", "")), str(error.get("do", ""))))
        if not child.errors:
            found.append((f"its process ended: {child.last_words()}", child.name, "See above"))
    what = "; ".join(f"{where}: {what}" if where else what for what, where, _ in found)
    return DeviceError(what, do="; ".join(dict.fromkeys(do for _, _, do in found if do)))
