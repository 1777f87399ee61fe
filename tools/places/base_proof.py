"""When a base was last seen to stop by itself after its commands had ended."""

from __future__ import annotations

import time

import msgspec

from robot_io.rig.config import RigConfig
from tools.places.atomic_file import write_atomically
from tools.places.state_dir import file_name, state_dir


class BaseProof(msgspec.Struct, frozen=True):
    """A proof, and what it is of."""

    url: str
    command_topic: str
    stopped_after_s: float
    made_s: float
    """Wall clock."""


def save(rig: RigConfig, stopped_after_s: float) -> None:
    """Save a proof of the rig's base. Raises OSError and EnvironmentFault."""
    proof = BaseProof(rig.base.url, rig.base.topics.command, stopped_after_s, time.time())
    write_atomically(state_dir() / f"{file_name(rig.name)}.base-timeout.json", msgspec.json.encode(proof), mode=0o600)


def age_s(rig: RigConfig) -> float | None:
    """Return how old the proof of the rig's base is; None where there is none of this address and topic."""
    try:
        content = (state_dir() / f"{file_name(rig.name)}.base-timeout.json").read_bytes()
        proof = msgspec.json.decode(content, type=BaseProof)
    except (OSError, msgspec.MsgspecError):
        return None
    old_s = time.time() - proof.made_s
    fits = (proof.url, proof.command_topic) == (rig.base.url, rig.base.topics.command)
    return old_s if fits and old_s >= 0.0 else None
