"""Which laws of one's own have passed a run with every device emulated: by the SHA-256 of their source."""

from __future__ import annotations

import time
from pathlib import Path

import msgspec

from robot_io.rig.types import LawFacts
from tools.places.atomic_file import write_atomically
from tools.places.state_dir import state_dir


class LawProof(msgspec.Struct, frozen=True):
    """A passed run."""

    name: str
    rig: str
    log: str
    made_s: float
    """Wall clock."""


def save(facts: LawFacts, rig: str, log: str) -> None:
    """Note that a law has passed. Raises OSError and EnvironmentFault."""
    if facts.source_sha256:
        proof = LawProof(facts.name, rig, log, time.time())
        write_atomically(_path(facts.source_sha256), msgspec.json.encode(proof), mode=0o600)


def has_passed(facts: LawFacts) -> bool:
    """Return whether a law with this very source has passed. Raises EnvironmentFault."""
    if not facts.source_sha256:
        return False
    try:
        msgspec.json.decode(_path(facts.source_sha256).read_bytes(), type=LawProof)
    except (OSError, msgspec.MsgspecError):
        return False
    return True


def _path(sha256: str) -> Path:
    return state_dir() / f"law-{sha256}.json"
