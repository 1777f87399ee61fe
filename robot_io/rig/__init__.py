"""The rig file: its types, how it is read and checked, and the rigs that come with the program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.rig.config import RigConfig, load_rig, rig_from_toml, rig_to_toml
    from robot_io.rig.files import shipped_rigs
    from robot_io.rig.topics import TopicsConfig

__all__ = ["RigConfig", "TopicsConfig", "load_rig", "rig_from_toml", "rig_to_toml", "shipped_rigs"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "RigConfig": "config",
        "TopicsConfig": "topics",
        "load_rig": "config",
        "rig_from_toml": "config",
        "rig_to_toml": "config",
        "shipped_rigs": "files",
    },
)
