"""The pure core of a tick: step -> supervise -> envelope. Run by the loop, by level `sim` and by replay."""

from __future__ import annotations

import msgspec
from msgspec.structs import replace

from control.laws.law import Law
from control.settings import Settings
from control.step import step
from robot_io.messages import BodyTwist, WorldTwist
from robot_io.rig.config import RigConfig
from robot_io.tick import EnvelopeState, Mode, TickInput, TickOutput, TickState
from safety import envelope
from safety.checks.base_checks import trusted_pose
from safety.settings import SafetySettings
from safety.supervisor import give_up, note_command, supervise


class TickCore(msgspec.Struct, frozen=True):
    """The settings of control and safety; `fold` runs one tick."""

    control: Settings
    safety: SafetySettings

    @classmethod
    def of(cls, rig: RigConfig, *, in_contact: bool = False, law: Law | None = None) -> TickCore:
        """Resolve the settings of a rig. law: its law where it is not a shipped one; raises ConfigError without it."""
        return cls(Settings.of(rig, in_contact=in_contact, law=law), SafetySettings.of(rig))

    def fold(self, state: TickState, inp: TickInput) -> tuple[TickState, TickOutput]:
        """Return the state after this tick and its output. Pure: same arguments, same result, bit for bit."""
        if inp.host.loop_error:  # this tick has already failed once: none of it is computed again
            dead, verdict = give_up(state.safety, inp)
            still = EnvelopeState(BodyTwist(), state.envelope.clamps, False)
            return TickState(state.control, dead, still), TickOutput(
                int(verdict.mode),
                verdict.faults,
                WorldTwist(),
                BodyTwist(),
                BodyTwist(),
                0.0,
                0.0,
                True,
                verdict.exit_code,
                verdict.values,
            )
        pose = trusted_pose(self.safety, state.safety, inp)
        seen = inp if pose is inp.base.pose else replace(inp, base=replace(inp.base, pose=pose))
        held = state.safety.mode == Mode.HOLD or inp.paused
        control, wanted = step(self.control, state.control, seen, held=held)
        clamped = state.envelope.clamped
        safety, verdict = supervise(self.safety, state.safety, inp, control, wanted.body, clamped)
        new_envelope, command = envelope.apply(self.safety.envelope, state.envelope, wanted.body, verdict.mode)
        safety = note_command(safety, command, inp.now_ns)
        return TickState(control, safety, new_envelope), TickOutput(
            int(verdict.mode),
            verdict.faults,
            wanted.world,
            wanted.body,
            command,
            wanted.contact_x,
            wanted.contact_y,
            verdict.finished,
            verdict.exit_code,
            verdict.values,
        )
