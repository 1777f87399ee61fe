"""Level `sim`: three simulated devices on a virtual clock, in one process and thread; same core, gate and log.

Two runs with the same rig and seed give identical files: log times start at a fixed epoch.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from msgspec.structs import astuple, replace

from control.ft_input import ft_input
from control.laws.law import Law
from control.notes.run_notes import RunNotes, outcome
from robot_io.clock import NS_PER_S, SIM_START_NS, SIM_WALL_OFFSET_NS, ClockNs, VirtualClock
from robot_io.ipc.gate_frame import GateFrame
from robot_io.log.gate_log import GateLog
from robot_io.messages import ArmRecord
from robot_io.rig.config import RigConfig, rig_from_toml
from robot_io.rig.declared import FT300, FT300_FACTS
from robot_io.rig.fault_words import FaultWord
from robot_io.tick import TICK_CDR, ControlTick, HostInput, Operator, TickInput, TickOutput, TickState
from safety.gate_shell import GateShell
from safety.motion_bounds import total_bounds
from sim_backend.injection.arm import InjectedArm
from sim_backend.injection.base import InjectedBase
from sim_backend.injection.event import event_writer
from sim_backend.injection.injection import Injection
from sim_backend.injection.sensor import InjectedSensor
from sim_backend.ridgeback.settings import ridgeback_settings
from sim_backend.sim.ft300 import SimFt300
from sim_backend.sim.ridgeback import SimRidgeback
from sim_backend.sim.ur10 import SimUr10
from sim_backend.world.world import World
from tools.kinds import name_of
from tools.live.feed import LiveFeed
from tools.log.run_parts import RunParts
from tools.log.world_log import ring_listener
from tools.places.saved_tare import SavedTare
from tools.run.facts.run_facts import run_facts
from tools.run.law_clock import LawClock
from tools.run.run_state import initial_state
from tools.run.tick_core import TickCore

START_NS = SIM_START_NS
MAX_SIMULATED_S = 4 * 3600.0


class LockstepLog(Protocol):
    """Receives the records of a lockstep run, a `RunParts` say."""

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        """Receive one ring record."""
        ...

    def tick(self, time_ns: int, payload: bytes, tick: ControlTick | None) -> None:
        """Receive one tick, encoded and decoded."""
        ...


class Lockstep:
    """One push in lockstep. `log` receives each record as the rings would; `run` returns the final figures.

    log: None keeps nothing, so that no record is made at all; nothing else changes. law: the rig's law where it is
    not a shipped one; raises ConfigError without it. timed: whether a step of such a law that takes too long is a
    fault: what else this machine does may then change a run. compiled: see `World`; for whoever makes many pushes.
    """

    def __init__(
        self,
        rig: RigConfig,
        seed: int,
        log: LockstepLog | None,
        *,
        saved: SavedTare | None = None,
        law: Law | None = None,
        timed: bool = True,
        compiled: bool = False,
    ) -> None:
        self.rig = rig
        self._log = log
        self._clock = VirtualClock(START_NS)
        self._period_ns = round(NS_PER_S / rig.loop.rate_hz)
        on_record = None if log is None else ring_listener(log.record)
        self.world = World(rig, seed, START_NS, on_record, compiled=compiled)
        world = rig.world
        self._ft = simulated_sensor(rig, self.world, self._clock)
        self._arm = SimUr10(self.world, self._clock, rate_hz=world.arm_cycle_hz, phase=world.arm_phase)
        self._base = SimRidgeback(
            self.world, self._clock, settings=ridgeback_settings(rig, seed), pose_source=rig.base.pose_source
        )
        self._note_injected = None if log is None else event_writer(log.record, SIM_WALL_OFFSET_NS)
        self.first_injected_ns: int | None = None
        self.injection = Injection(rig.faults.inject, self._clock, self._on_injected)
        self.injection.begin(START_NS)
        self._ft_edge = InjectedSensor(self._ft, self.injection, rig)
        self._arm_edge = InjectedArm(self._arm, self.injection)
        self._base_edge = InjectedBase(self._base, self.injection)
        self._law = LawClock(law, round(rig.limits.law_ms * 1e6)) if law is not None and timed else None
        self._core = TickCore.of(rig, in_contact=saved is not None, law=self._law or law)
        self._state = initial_state(saved)
        self._recorded = False
        self._gate = GateShell(self._core.safety.envelope, total_bounds(rig), START_NS)
        self._gate_log = None if log is None else GateLog(log.record, SIM_WALL_OFFSET_NS)
        self.notes = RunNotes()
        self.operator = Operator.NONE
        self.paused = False
        self.began = False
        """Whether it has come to its first tick."""

    def run(self, on_tick: Callable[[TickInput, TickState, TickOutput], None]) -> dict[str, Any]:
        """Run to the end and return the figures; `on_tick` is called after each tick (to pace and to display)."""
        devices = (self._ft, self._arm, self._base)
        for device in devices:
            info = device.open()
            device.start()
        if self._gate_log is not None:
            self._gate_log.clock(START_NS, info.clock)  # the base is the last
        tick = 0
        self.began = True
        while True:
            now_ns = START_NS + tick * self._period_ns
            self._clock.advance_to(now_ns)
            inp, output = self._tick(tick, now_ns)
            on_tick(inp, self._state, output)
            if output.finished or now_ns > MAX_SIMULATED_S * NS_PER_S:
                break
            tick += 1
        counters = {
            name_of(self.rig.ft.kind): self._ft.health().counters,
            name_of(self.rig.arm.kind): {"packets": inp.arm.packets},
            name_of(self.rig.base.kind): self._base.health().counters,
        }
        for device in devices:
            device.stop()
            device.close()
        return {
            **outcome(inp, self._state, output),
            "loop": {"rate_hz": self.rig.loop.rate_hz, "ticks": tick + 1, "skipped": 0},
            **self.notes.figures(),
            "devices": counters,
            "injected": self.injection.counts(),
        }

    def _tick(self, tick: int, now_ns: int) -> tuple[TickInput, TickOutput]:
        readings = self._ft_edge.drain()
        self._take_base(now_ns)
        operator, self.operator = self.operator, Operator.NONE
        inp = TickInput(
            tick,
            now_ns,
            int(operator),
            HostInput(0, 0, True, True, True, False, 0, law_ns=0 if self._law is None else self._law.take_ns()),
            ft_input(readings, self._ft_edge.health(), 0),
            self._arm_edge.read() or ArmRecord(),
            self._gate.record,
            self.paused,
        )
        try:
            after, output = self._core.fold(self._state, inp)
        except Exception:  # as in the loop: the base gets zero and the log says so; the caller gets the error
            failed = replace(inp, host=replace(inp.host, loop_error=True))
            self._finish_tick(failed, *self._core.fold(self._state, failed))
            raise
        self._finish_tick(inp, after, output)
        return inp, output

    def _finish_tick(self, inp: TickInput, after: TickState, output: TickOutput) -> None:
        self._send(inp.tick, inp.now_ns, output)
        if self._log is not None:
            message = ControlTick(0, 0, inp, () if self._recorded else (self._state,), after, output)
            self._recorded = True
            self._log.tick(inp.now_ns, TICK_CDR.encode(message), message)
        self._state = after
        self.notes.note(inp, after, output)

    def _send(self, tick: int, now_ns: int, output: TickOutput) -> None:
        """Pass the command through the gate, as the gate process does."""
        frame = GateFrame(self._gate.gate.seq + 1, tick, now_ns, output.mode, output.command_body)
        self._gate = self._gate.on_frames((frame,), now_ns, now_ns)
        self._turn_gate(now_ns)

    def _turn_gate(self, now_ns: int) -> None:
        """Let the gate judge and send what is due."""
        self._gate = self._gate.on_clock(now_ns, self._base_edge.health())
        self._gate, latching = self._gate.on_leaving(now_ns)
        if latching is not None and self._gate_log is not None:
            self._gate_log.latched(now_ns, *astuple(latching))
        wanted = self._gate.due(now_ns)
        if wanted is not None:
            left_ns = self._base_edge.sent_ns
            really = self._base_edge.command(wanted)
            if self._base_edge.sent_ns == left_ns:  # nothing is sent over a lost link
                self._gate = self._gate.on_sent(wanted, None, now_ns)
                return
            self._gate = self._gate.on_sent(wanted, really, now_ns)
            if self._gate_log is not None:
                self._gate_log.sent(now_ns, really)

    def _on_injected(self, word: FaultWord, now_ns: int) -> None:
        if self.first_injected_ns is None:
            self.first_injected_ns = now_ns
        if self._note_injected is not None:
            self._note_injected(word, now_ns)

    def _take_base(self, now_ns: int) -> None:
        samples = self._base_edge.drain()
        if self._gate_log is not None:
            for sample in samples:
                self._gate_log.inbound(sample)
        # No pings here: there is no bridge that could answer.
        self._gate = self._gate.on_samples(samples).on_publish(
            now_ns, newest_inbound_ns=self._base_edge.newest_inbound_ns, newest_pong_ns=0
        )


def open_log(
    path: Path,
    config_text: str,
    seed: int,
    *,
    in_contact: bool,
    note: str = "",
    to_view: socket.socket | None = None,
    derive: bool = True,
) -> RunParts:
    """Open the log of a lockstep run; its facts hold nothing that differs from run to run.

    to_view: a live view's. derive: whether the topics made of others are written, too.
    """
    facts = run_facts(rig_from_toml(config_text), seed, in_contact=in_contact, note=note)
    also = LiveFeed(to_view).add if to_view is not None else None
    return RunParts(
        path, config_text=config_text, metadata=facts, wall_offset_ns=SIM_WALL_OFFSET_NS, also=also, derive=derive
    )


def simulated_sensor(rig: RigConfig, world: World, clock: ClockNs) -> SimFt300:
    """Return the sensor of level sim: an FT 300, or any other kind as it declares itself."""
    model, facts = rig.world.sensor, rig.ft.declared
    if rig.ft.kind == FT300:
        return SimFt300(world, clock, rate_hz=model.rate_hz, phase=model.phase, latency_ms=model.latency_ms)
    # Never an exact multiple of the loop's rate, or every run would test one fixed phase.
    rate_hz = facts.rate_hz * model.rate_hz / FT300_FACTS.rate_hz
    return SimFt300(
        world, clock, rate_hz=rate_hz, phase=model.phase, latency_ms=0, resolution=facts.resolution, limit=facts.range
    )
