"""A wall-clock run: starts and watches the processes, owns terminal and signals, and reports how it ended.

    emulators   one process with the world and its wire servers (emulated devices only)
    recorder    drains the log rings into run.mcap, finishes it when control has ended
    live        serves what is recorded to viewers (with --live); nothing depends on it
    gate        sole holder of the base connection
    arm         the ur_rtde library, publishing a shared record
    control     the loop: sensor, law, supervisor, envelope, one frame to the gate per tick

How they are connected: `processes`. The launcher itself has no device and no real-time work.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import msgspec

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import OperatorStop
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import leave_realtime, try_realtime
from robot_io.ipc.spawn import Child
from robot_io.messages import Pose2D
from robot_io.rig.config import RigConfig
from robot_io.rig.fault_words import parse_fault
from safety.gate import Latch
from tools.kinds import name_of
from tools.live.view import where_words
from tools.places import run_dir
from tools.places.atomic_file import write_json
from tools.places.running import announce, forget
from tools.places.saved_tare import SavedTare
from tools.run.facts.ended import final_figures
from tools.run.facts.process_notes import process_notes, warn_without_realtime
from tools.run.processes import Processes
from tools.terminal.live_line import LiveLine
from tools.terminal.operator_keys import OperatorKeys
from tools.terminal.start_errors import combined_error, start_timeout
from tools.verdict.first_cause import with_dead_emulators
from tools.verdict.object_pose import ObjectPose, object_pose
from tools.verdict.witness import Witness, witness_of

PRIORITY = 1
"""Below all other processes of the run. Not for its work: a killed process needs processor time to die, and the
death of this one stops the base."""
EMULATORS_READY_NS = 20 * NS_PER_S
READY_NS = 20 * NS_PER_S
"""Each device has its own, shorter deadline; these only catch a process that hangs before that."""
OTHER_FAILURES_NS = 4 * NS_PER_S
"""After the first device failed, the others may still report their own errors for this long."""
FROZEN_NS = NS_PER_S
"""If the gate has latched and control has sent no status for this long, it is frozen and is killed."""
FIRST_STATUS_NS = 5 * NS_PER_S
"""If control has sent no status this long after its start, it froze before the gate could detect it."""
BEAT_NS = NS_PER_S // 10
"""How often control is told that the launcher lives: silent for 0.5 s, the base holds, for 2 s, it stops (F73)."""
SECOND_STOP_NS = NS_PER_S
"""A second stop counts only this long after the first: `timeout` and shells may send one stop twice."""
ENDS_WITHIN_S = {"control": 2.0, "gate": 1.5, "emulators": 2.0, "arm": 3.0, "recorder": 5.0, "live": 1.0}
"""Processes in the order in which they end."""


class Launcher:
    """One run at level emulated, hardware or a mix; `run` returns its final figures, `notes` holds further remarks."""

    def __init__(
        self,
        rig: RigConfig,
        out: Path,
        *,
        seed: int,
        saved: SavedTare | None,
        live: LiveLine,
        kind_folder: str,
        note: str = "",
        live_port: int | None = None,
    ) -> None:
        self._rig = rig
        self._out = out
        self._live = live
        self._loop = EventLoop()
        self.log = out / "run.mcap"
        self.notes: list[str] = []
        self._processes = Processes(
            rig,
            seed=seed,
            saved=saved,
            log=self.log,
            kind_folder=kind_folder,
            note=note,
            live_port=live_port,
            on_spawn=self._listen,
        )
        self._children = self._processes.children
        self._began = self._ending = self._paused = self._killed_by_operator = False
        self._stop_asked_ns = self._status_ns = 0
        self._emulators_died_ns = 0
        self._gate_latch = ""

    def run(self) -> dict[str, Any]:
        """Run to the end; return the figures. Raises PushError if the run did not start or its result is unknown."""
        self._keys = keys = OperatorKeys(self._loop, self._stop, self._resume, self._pause)
        self._loop.call_every(BEAT_NS, lambda _: self._processes.send_to_control(b"H"))
        try:
            try:
                self._start()
                self._watch()
            finally:
                self._end()
                keys.close()
                self._loop.close()
            self.notes += process_notes(self._children)
            return self._figures()
        finally:
            self._live.close()
            forget()
            for child in self._children.values():
                child.close()
            self._processes.close()

    @property
    def began(self) -> bool:
        """Return whether the loop was started."""
        return self._began

    def devices(self, figures: dict[str, Any]) -> dict[str, dict[str, int]]:
        """Return the counters of the three drivers, by device name."""
        counters, injected = self._finished_event("gate").get("counters", {}), self.injected(figures)
        return {
            name_of(self._rig.ft.kind): figures["ft"],
            name_of(self._rig.arm.kind): {"packets": figures["arm_packets"]},
            name_of(self._rig.base.kind): {k: n for k, n in counters.items() if k not in injected},
        }

    def witness(self, figures: dict[str, Any]) -> Witness:
        """Return what the other processes say of the run, once `run` has returned."""
        children = (self._children[name] for name in ("recorder", "gate"))
        recorder, gate = (child.finished or f"the {child.name} process {child.how_it_ended()}" for child in children)
        return witness_of(self.log, figures["loop"]["ticks"], recorder=recorder, gate=gate)

    def pushed(self) -> ObjectPose | None:
        """Return where the object is, once `run` has returned; None if that is not known."""
        poses = msgspec.convert(self._finished_event("recorder").get("object_poses"), tuple[Pose2D, Pose2D] | None)
        return object_pose(self._rig.path, poses)

    def latencies(self) -> dict[str, Any]:
        """Return how old messages were when they arrived, by topic, once `run` has returned."""
        return dict(self._finished_event("recorder").get("latencies", {}))

    def injected(self, figures: dict[str, Any]) -> dict[str, int]:
        """Return how many samples each injected fault changed, by its words; none for a process that did not say."""
        by_gate: dict[str, int] = self._finished_event("gate").get("counters", {})
        by_control: dict[str, int] = figures.get("injected", {})
        words = {parse_fault(word).text for word in self._rig.faults.inject}
        return by_control | {word: n for word, n in by_gate.items() if word in words}

    def _start(self) -> None:
        self._wait_ready(self._processes.start_emulators(), EMULATORS_READY_NS)
        names = self._processes.start_remaining(run_dir.write_config(self._out, self._rig))
        pids = {"launcher": os.getpid(), **self._processes.pids}
        write_json(self._out / "processes.json", {"schema": 1, **pids})
        announce(self._rig, pids, self.log)
        self._wait_ready(names, READY_NS)
        warn_without_realtime(self._children, self._live.say)
        if errors := self._children["recorder"].errors:  # it was ready, and then the disk was full
            raise errors[0]
        self._began = True
        self._processes.send_to_control(b"GP" if self._paused else b"G")

    def _listen(self, child: Child) -> None:
        self._loop.add_fd(child.status.fd, lambda _events: self._hear(child))
        if child.name == "live":
            self._live.say(where_words(child))

    def _hear(self, child: Child) -> None:
        for event in child.hear():
            if event.get("event") == "status":
                self._status_ns = monotonic_ns()
                self._live.show(event, keys=self._keys.heard)
            elif event.get("event") == "latched" and event["latch"] != Latch.EOF:
                self._gate_latch = event["text"]
                self._live.say(f"gate: {event['text']}")
            elif event.get("event") == "warning":
                self._live.say(event["text"])
                if child.name == "gate":
                    self.notes.append(event["text"])
            elif child.name == "recorder" and event.get("event") == "error":
                self._live.say(f"recorder: {event['error']['what']}")
                if self._began:
                    self._processes.send_to_control(b"L")
        if not child.status.open:
            self._loop.remove_fd(child.status.fd)
            if child.name == "emulators" and not self._ending:
                self._emulators_died_ns = monotonic_ns()
                self._live.say("the emulators have ended: every emulated device is gone")
            elif child.name == "live" and not self._ending:
                self._live.say("the live view has ended; the run goes on")

    def _wait_ready(self, names: list[str], within_ns: int) -> None:
        """Wait until all are ready. Raises PushError naming everything that failed and what to do about each."""
        deadline_ns = monotonic_ns() + within_ns
        while True:
            waiting = [self._children[name] for name in names if self._children[name].ready is None]
            if not waiting:
                return
            if self._stop_asked_ns:
                raise OperatorStop("stopped before the start")
            failed = [child for child in waiting if self._failed(child)]
            if failed:
                deadline_ns = min(deadline_ns, monotonic_ns() + OTHER_FAILURES_NS)
            # Control opens the sensor, the gate the base, the arm's process the arm: all three may still report.
            if failed and (len(failed) == len(waiting) or monotonic_ns() > deadline_ns):
                raise combined_error(failed, self._rig)
            if monotonic_ns() > deadline_ns:
                raise start_timeout(waiting, self._rig)
            self._loop.run_once(20)

    def _failed(self, child: Child) -> bool:
        ended = child.process.poll() is not None  # checked first: all its output is in the pipe by then
        if child.status.open:
            self._hear(child)
        return bool(child.errors) or (ended and child.ready is None)

    # --- watch -----------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        """Wait until control has ended."""
        control = self._children["control"]
        went_ns = monotonic_ns()
        try_realtime(PRIORITY)
        try:
            while control.process.poll() is None:
                self._loop.run_once(50)
                self._live.mark_old()
                allowed_ns = FROZEN_NS if self._gate_latch else FIRST_STATUS_NS if not self._status_ns else None
                if allowed_ns and monotonic_ns() - (self._status_ns or went_ns) > allowed_ns:
                    control.process.kill()  # the base has its zeros; a frozen control would only delay the end
        finally:
            leave_realtime()
        self._hear(control)
        self._live.end()

    def _stop(self) -> None:
        now_ns = monotonic_ns()
        late = now_ns - self._stop_asked_ns > SECOND_STOP_NS
        if not self._stop_asked_ns:
            self._stop_asked_ns = now_ns
            self._live.say("stopping ...")
            self._processes.send_to_control(b"S")
        elif late and "control" in self._children and not self._killed_by_operator:
            self._killed_by_operator = True
            self._live.say("stopping at once")
            self._children["control"].process.kill()

    def _resume(self) -> None:
        if self._began:  # before the start, any byte but G and H would end control
            self._paused = False
            self._processes.send_to_control(b"CR")

    def _pause(self) -> None:
        self._paused = not self._paused
        if self._began:
            self._processes.send_to_control(b"P" if self._paused else b"C")

    # --- end -------------------------------------------------------------------------------------------------

    def _end(self) -> None:
        """End all: the gate by control's EOF, the recorder by that of all producers, the others by SIGTERM."""
        self._ending = True
        self._processes.hang_up()
        control = self._children.get("control")
        if control is not None and control.ready is None:
            control.terminate()
        for name, within_s in ENDS_WITHIN_S.items():
            child = self._children.get(name)
            if child is None:
                continue
            if name == "emulators":
                child.terminate()
            child.end(within_s)
            if name == "control" and "arm" in self._children:
                self._children["arm"].terminate()  # before the emulated robot that it would miss
            if child.status.open:
                child.hear()
            self._loop.remove_fd(child.status.fd)

    def _finished_event(self, name: str) -> dict[str, Any]:
        return self._children[name].finished or {}

    def _figures(self) -> dict[str, Any]:
        """Return control's figures, or those from the log if control could not report them."""
        rate_hz, killed = self._rig.loop.rate_hz, self._killed_by_operator
        figures, notes = final_figures(self._children["control"], self.log, rate_hz, killed_by_operator=killed)
        self.notes += notes
        return with_dead_emulators(figures, self._emulators_died_ns)
