"""A wall-clock run: starts the processes, watches them, owns terminal and signals, and tells how it ended.

    emulators   one process with the world and its wire servers (emulated devices only)
    recorder    drains the log rings into run.mcap, finishes it when control is gone
    gate        sole holder of the base connection
    arm         the ur_rtde wheel, publishing a shared record
    control     the loop: sensor in, law, supervisor, envelope, one frame to the gate a tick

How they are wired: `processes`. The launcher itself has no device and no real-time duty: a blocked terminal never
touches a tick.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import OperatorStop, PushError, SafetyStop
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.process import leave_realtime, try_realtime
from robot_io.ipc.spawn import Child
from robot_io.rig.config import RigConfig
from safety.gate import Latch
from tools.kinds import name_of
from tools.places import run_dir
from tools.places.saved_tare import SavedTare
from tools.places.whole_file import write_json
from tools.run.aftermath import figures_of
from tools.run.processes import Processes
from tools.terminal.live_line import LiveLine
from tools.terminal.operator_keys import OperatorKeys
from tools.terminal.start_errors import combined, not_in_time

PRIORITY = 1
"""Below all others of the run. Not for its work: a process that is killed needs the processor to die, and the base is
stopped by this one's death."""
EMULATORS_READY_NS = 20 * NS_PER_S
READY_NS = 20 * NS_PER_S
"""Each device has its own, shorter deadline; these only catch a process that hangs before it."""
OTHERS_NS = 4 * NS_PER_S
"""After the first device failed, the others may still say what is wrong with them."""
FROZEN_NS = NS_PER_S
"""The gate has latched and control has not spoken for this long: it is frozen, and is killed."""
FIRST_WORD_NS = 5 * NS_PER_S
"""Control was let go and its loop has said nothing for this long: it froze before the gate could know it by silence."""
AGAIN_NS = NS_PER_S
"""A second stop counts from here on; before, it is the same one (`timeout` and shells signal twice)."""
ENDS_WITHIN_S = {"control": 2.0, "gate": 1.5, "emulators": 2.0, "arm": 3.0, "recorder": 5.0}
"""In this order."""


class Launcher:
    """One run at level emulated, hardware or a mix; `run` returns the figures of its end, `notes` what else to say."""

    def __init__(
        self, rig: RigConfig, out: Path, *, seed: int, saved: SavedTare | None, live: LiveLine, kind_folder: str
    ) -> None:
        self._rig = rig
        self._out = out
        self._live = live
        self._loop = EventLoop()
        self.log = out / "run.mcap"
        self.notes: list[str] = []
        self._processes = Processes(
            rig, seed=seed, saved=saved, log=self.log, kind_folder=kind_folder, on_spawn=self._listen
        )
        self._children = self._processes.children
        self._began = False
        self._stop_asked_ns = 0
        self._killed_by_operator = False
        self._gate_latch = ""
        self._status_ns = 0

    def run(self) -> dict[str, Any]:
        """Run to the end. Raises PushError when it never began, or when nothing can be said of its end."""
        keys = OperatorKeys(self._loop, self._stop, self._resume)
        try:
            try:
                self._start()
                self._watch()
            finally:
                self._end()
                keys.close()
                self._loop.close()
            self._note_the_others()
            return self._figures()
        finally:
            for child in self._children.values():
                child.close()

    @property
    def began(self) -> bool:
        """Return whether every device was ready and the loop was let go."""
        return self._began

    def devices(self, figures: dict[str, Any]) -> dict[str, dict[str, int]]:
        """Return the counters of the three devices, as their drivers counted."""
        return {
            name_of(self._rig.ft.kind): figures["ft"],
            name_of(self._rig.arm.kind): {"packets": figures["arm_packets"]},
            name_of(self._rig.base.kind): self._said("gate").get("counters", {}),
        }

    # --- start -----------------------------------------------------------------------------------------------

    def _start(self) -> None:
        self._wait_ready(self._processes.start_emulators(), EMULATORS_READY_NS)
        names = self._processes.start_the_rest(run_dir.write_config(self._out, self._rig))
        pids = {"schema": 1, "launcher": os.getpid(), **self._processes.pids}
        write_json(self._out / "processes.json", pids)
        self._wait_ready(names, READY_NS)
        self._tell_priorities()
        self._began = True
        self._processes.tell_control(b"G")

    def _tell_priorities(self) -> None:
        plain = [name for name, child in self._children.items() if (child.ready or {}).get("realtime") is False]
        if plain:
            self._live.say(f"no permission for real-time priority for {', '.join(plain)}: only 100 Hz is supported")

    def _listen(self, child: Child) -> None:
        self._loop.add_fd(child.status.fd, lambda _events: self._hear(child))

    def _hear(self, child: Child) -> None:
        for event in child.hear():
            if event.get("event") == "status":
                self._status_ns = monotonic_ns()
                self._live.show(event)
            elif event.get("event") == "latched" and event["latch"] != Latch.EOF:
                self._gate_latch = event["text"]
                self._live.say(f"gate: {event['text']}")
            elif event.get("event") == "warning":
                self._live.say(event["text"])
            elif child.name == "recorder" and event.get("event") == "error":
                self._live.say(f"recorder: {event['error']['what']}")
                self._processes.tell_control(b"L")
        if not child.status.open:
            self._loop.remove_fd(child.status.fd)

    def _wait_ready(self, names: list[str], within_ns: int) -> None:
        """Wait until all are ready. Raises PushError with everything that failed, each with what to do."""
        deadline_ns = monotonic_ns() + within_ns
        while True:
            waiting = [self._children[name] for name in names if self._children[name].ready is None]
            if not waiting:
                return
            if self._stop_asked_ns:
                raise OperatorStop("stopped before the start")
            failed = [child for child in waiting if self._failed(child)]
            if failed:
                deadline_ns = min(deadline_ns, monotonic_ns() + OTHERS_NS)
            # Control opens the sensor, the gate the base, the arm's process the arm: all three may still speak.
            if failed and (len(failed) == len(waiting) or monotonic_ns() > deadline_ns):
                raise combined(failed, self._rig)
            if monotonic_ns() > deadline_ns:
                raise not_in_time(waiting, self._rig)
            self._loop.run_once(20)

    def _failed(self, child: Child) -> bool:
        ended = child.process.poll() is not None  # asked first: all it said is in the pipe by then
        if child.status.open:
            self._hear(child)
        return bool(child.errors) or (ended and child.ready is None)

    # --- watch -----------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        """Wait for control's end."""
        control = self._children["control"]
        went_ns = monotonic_ns()
        try_realtime(PRIORITY)
        try:
            while control.process.poll() is None:
                self._loop.run_once(50)
                allowed_ns = FROZEN_NS if self._gate_latch else FIRST_WORD_NS if not self._status_ns else None
                if allowed_ns and monotonic_ns() - (self._status_ns or went_ns) > allowed_ns:
                    control.process.kill()  # the base has its zeros; a frozen control would only hide the end
        finally:
            leave_realtime()
        self._hear(control)
        self._live.end()

    def _stop(self) -> None:
        now_ns = monotonic_ns()
        if not self._stop_asked_ns:
            self._stop_asked_ns = now_ns
            self._live.say("stopping ...")
            self._processes.tell_control(b"S")
        elif now_ns - self._stop_asked_ns > AGAIN_NS and "control" in self._children and not self._killed_by_operator:
            self._killed_by_operator = True
            self._live.say("stopping at once")
            self._children["control"].process.kill()

    def _resume(self) -> None:
        if self._began:  # before, anything but the word to go would end control
            self._processes.tell_control(b"R")

    # --- end -------------------------------------------------------------------------------------------------

    def _end(self) -> None:
        """End every process; the gate ends by control's EOF, the recorder by that of all, the others are told to."""
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
                self._children["arm"].terminate()  # before the robot it would miss
            if child.status.open:
                child.hear()
            self._loop.remove_fd(child.status.fd)

    def _said(self, name: str) -> dict[str, Any]:
        return self._children[name].finished or {}

    def _note_the_others(self) -> None:
        """Note what went wrong in the processes beside control."""
        for name in ("gate", "emulators", "arm", "recorder"):
            child = self._children.get(name)
            if child is not None and child.errors:
                self.notes.append(f"{name}: {child.errors[-1].what}")
            elif child is not None and child.process.returncode != 0:
                self.notes.append(f"the {name} process {child.how_it_ended()}")
        said = self._said("recorder")
        if not said.get("complete", False):
            self.notes.append("the log is not complete: `push log recover` may save it")
        if dropped := sum(said.get("dropped", {}).values()):
            self.notes.append(f"{dropped} records did not fit into the log's ring buffers")

    def _figures(self) -> dict[str, Any]:
        """Return control's figures, or those of the log when control cannot say them any more."""
        control = self._children["control"]
        if control.finished is not None:
            figures: dict[str, Any] = control.finished
            if figures["error"]:
                self.notes.append(f"{figures['error']}; this is a bug, its traceback is in {control.save_stderr()}")
            return figures
        if self._killed_by_operator:
            code, how = OperatorStop.exit_code, "was killed by the operator"
        elif control.process.returncode < 0:
            code, how = SafetyStop.exit_code, control.how_it_ended()
        else:
            code, how = control.process.returncode, f"{control.how_it_ended()}, see {control.save_stderr()}"
        stopped = f"the control process {how}; the gate stopped the base"
        try:
            figures = figures_of(self.log, self._rig.loop.rate_hz, code)
        except PushError as unreadable:
            raise SafetyStop(stopped, where="control", do=f"Its log holds nothing more ({unreadable.what})") from None
        self.notes.append(stopped)
        return figures
