"""Facts about a run that are written into its log: code, machine, level, seed."""

from __future__ import annotations

import json
import platform

from robot_io.rig.config import RigConfig
from tools.laws import law_label, shipped_state
from tools.run.facts.bounds import bounds_of
from tools.run.facts.code_facts import code_facts, engine_facts

LAW_FACT, LAW_SOURCE_FACT = "law", "law_source_sha256"


def code_and_machine() -> dict[str, str]:
    """Return the facts that can make a replay differ: format, program, packages, Python, C library, processor."""
    return {
        **code_facts(),
        "python": platform.python_version(),
        "libm": " ".join(platform.libc_ver()),
        "machine": platform.machine(),
    }


def run_facts(rig: RigConfig, seed: int, *, in_contact: bool, note: str = "") -> dict[str, str]:
    """Return the facts of a run; none differs between two runs of the same code on the same machine."""
    return {
        **code_and_machine(),
        **engine_facts(rig),
        "level": level_of(rig),
        "seed": str(seed),
        "in_contact": str(in_contact),
        **law_facts(rig),
        **({"note": note} if note else {}),
        **({"faults_injected": "; ".join(rig.faults.inject)} if rig.faults.inject else {}),
        "bounds": json.dumps(bounds_of(rig)),
    }


def law_facts(rig: RigConfig) -> dict[str, str]:
    """Return the law: its name, and of one that is not shipped its source and the names of its state's numbers."""
    own = rig.control.law_facts
    facts = {LAW_FACT: law_label(rig)}
    if own.source_sha256:
        facts[LAW_SOURCE_FACT] = own.source_sha256
    if names := own.state or shipped_state(rig.control.law):
        facts["law_state"] = ", ".join(names)
    return facts


def level_of(rig: RigConfig) -> str:
    """Return the level of a run: sim, emulated, hardware or mixed."""
    levels = {rig.ft.level, rig.arm.level, rig.base.level}
    return levels.pop() if len(levels) == 1 else "mixed"
