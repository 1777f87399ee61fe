"""What tells runs from each other: the settings that differ between them, in a few words for a legend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from tools.laws import law_label
from tools.report.run_data import RunData
from tools.report.run_summary import flat_settings

MOST_WORDS = 3
FIRST = ("control.law", "control.k_f", "control.k_y_rad_per_m")
"""Settings that are named before all others."""
LAW_SETTINGS = "control.law_settings."
OF_THE_RIG = ("world.", "sliders.", "ft.", "arm.", "base.", "frames.", "limits.", "goal.", "workspace.")
"""Settings that a rig's name stands for where the names differ."""


def differing_settings(runs: Sequence[RunData]) -> dict[str, list[str]]:
    """Return the value of each run for each setting that is not the same in all, the seed among them."""
    settings = [_settings(run) for run in runs]
    names = dict.fromkeys(name for one in settings for name in one)
    values = {name: [str(one.get(name, "-")) for one in settings] for name in names}
    differing = {name: found for name, found in values.items() if len(set(found)) > 1}
    return dict(sorted(differing.items(), key=lambda pair: _rank(pair[0])))


def labels(runs: Sequence[RunData]) -> list[str]:
    """Return a label for each run, all different: its differing settings, and its folder where these are not enough."""
    differing = differing_settings(runs)
    if "control.law" in differing:  # a law's name stands for the settings that the others do not have
        differing = {n: found for n, found in differing.items() if not (n.startswith(LAW_SETTINGS) and "-" in found)}
    if "name" in differing:
        differing = {name: found for name, found in differing.items() if not name.startswith(OF_THE_RIG)}
    words = [[_words(name, found[i]) for name, found in differing.items()] for i in range(len(runs))]
    names = [", ".join(one[:MOST_WORDS]) for one in words]
    if len(set(names)) == len(names):
        return names
    folders = _folders(runs)
    return [", ".join(filter(None, (name, folder))) for name, folder in zip(names, folders, strict=True)]


def _settings(run: RunData) -> dict[str, Any]:
    found = flat_settings(msgspec.to_builtins(run.rig))
    found.pop("description", None)
    found = {name: value for name, value in found.items() if not name.startswith("control.law_facts")}
    return found | {"control.law": law_label(run.rig), "seed": run.facts.get("seed", "-")}


def _rank(name: str) -> tuple[int, str]:
    if name in FIRST:
        return FIRST.index(name), name
    return (3 if name == "name" else 4 if name.startswith("control.") else 6 if name == "seed" else 5), name


def _words(name: str, value: str) -> str:
    if name == "control.law":
        return value
    short = {"name": "rig", "control.k_y_rad_per_m": "k_y"}.get(name, name.rpartition(".")[2])
    return f"{short} {value}"


def _folders(runs: Sequence[RunData]) -> list[str]:
    """Return the shortest ends of the logs' paths that differ: the folder, or with the folder above it."""
    for parts in range(1, 8):
        ends = [
            "/".join(run.log.absolute().parent.parts[-parts:])
            if run.log.name == "run.mcap"
            else "/".join(run.log.absolute().parts[-parts:])
            for run in runs
        ]
        if len(set(ends)) == len(ends):
            return ends
    return [str(run.log) for run in runs]
