"""From the file of a study to its pushes: every combination of its axes with every seed, each with its whole rig."""

from __future__ import annotations

import itertools
import json
import random
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from robot_io.errors import ConfigError
from robot_io.rig import toml as toml_text
from robot_io.rig.config import ControlConfig, RigConfig, rig_to_toml
from robot_io.rig.files import shipped_rigs
from tools.laws import LawAnswer, LawQuestion, query_law
from tools.rig import folder_of, resolve_rig
from tools.study.study_file import Drawn, Listed, StudyFile, flat

SIMULATED = tuple(f"{device}.level=sim" for device in ("ft", "arm", "base"))
"""A study simulates whatever rig it is given."""


class Push(msgspec.Struct, frozen=True):
    """One push. axes: the value of each axis as text. rig: as TOML. folder: where its law may be found."""

    run: int
    seed: int
    axes: dict[str, str]
    rig: str
    folder: str

    @property
    def cases(self) -> tuple[Push]:
        """The one case of this item."""
        return (self,)


def base_rig(study: StudyFile) -> str:
    """Return the study's rig: a shipped name, or a path, looked for beside the study's file first."""
    if study.rig in shipped_rigs():
        return study.rig
    beside = Path(study.folder) / study.rig
    return str(beside) if beside.is_file() else study.rig


def law_folders(study: StudyFile) -> tuple[str, ...]:
    """Return where the study's laws are looked for, besides the Python path."""
    return study.law_folders or tuple(dict.fromkeys((study.folder, folder_of(base_rig(study)))))


def _folder_of_law(law: str, folders: Sequence[str]) -> str:
    """Return the first folder that has the module of `module:Class`, else the first."""
    module = law.partition(":")[0].partition(".")[0]
    having = [one for one in folders if (Path(one) / f"{module}.py").is_file() or (Path(one) / module).is_dir()]
    return (*having, *folders)[0]


def pushes_of(study: StudyFile) -> list[Push]:
    """Return all pushes, the seed fastest. Raises ConfigError for a combination that is no rig."""
    path, folders = base_rig(study), law_folders(study)
    rigs: dict[tuple[str, ...], tuple[str, str]] = {}
    ask = _remembering(folders)
    pushes: list[Push] = []
    for values in combinations(study):
        for seed in study.seeds:
            drawn = values | draws(study, seed)
            settings = _settings(study, drawn)
            key = tuple(settings)
            if key not in rigs:
                rig = _rig(study, path, settings, drawn, ask)
                rigs[key] = rig_to_toml(rig), _folder_of_law(rig.control.law, folders)
            axes = {axis: text(drawn[axis]) for axis in study.keys}
            pushes.append(Push(len(pushes), seed, axes, *rigs[key]))
    return pushes


def combinations(study: StudyFile) -> Iterator[dict[str, Any]]:
    """Yield the values of the listed axes: every combination, the last axis fastest, or side by side."""
    listed = [axis for axis in study.axes if isinstance(axis, Listed)]
    rows: Iterator[Sequence[Any]]
    if study.mode == "zip" and listed:
        rows = zip(*(axis.values for axis in listed), strict=True)
    else:
        rows = itertools.product(*(axis.values for axis in listed))
    for row in rows:
        yield dict(zip((axis.key for axis in listed), row, strict=True))


def draws(study: StudyFile, seed: int) -> dict[str, Any]:
    """Return what a seed draws: the same for every combination, and for an axis whatever the others are."""
    found: dict[str, Any] = {}
    for axis in study.axes:
        if isinstance(axis, Drawn):
            rng = random.Random(f"study-{seed}-{axis.key}")
            found[axis.key] = rng.choice(axis.one_of) if axis.one_of else rng.uniform(axis.low, axis.high)
    return found


def text(value: Any) -> str:
    """Return one value of an axis as a cell: plain where it can be, `key=value ...` for a table."""
    if isinstance(value, Mapping):
        return " ".join(f"{key}={text(item)}" for key, item in flat("", value) for key in [key[1:]])
    if isinstance(value, str):
        return value
    return repr(value) if isinstance(value, float) else json.dumps(value, default=str)


def _settings(study: StudyFile, values: Mapping[str, Any]) -> list[str]:
    over = [*study.settings, *(pair for key, value in values.items() for pair in flat(key, value))]
    return [*(f"{key}={_toml(value)}" for key, value in over), *SIMULATED]


def _toml(value: Any) -> str:
    return toml_text.emit({"value": value}).removeprefix("value = ").rstrip("\n")


def _remembering(folders: Sequence[str]) -> LawQuestion:
    """Return a question to a law of one's own, in one of some folders, that is asked once for each `[control]`."""
    known: dict[bytes, LawAnswer] = {}

    def ask(control: ControlConfig, _: str) -> LawAnswer:
        key = msgspec.json.encode(control)
        if key not in known:
            known[key] = query_law(control, _folder_of_law(control.law, folders))
        return known[key]

    return ask


def _rig(
    study: StudyFile, path: str, settings: Sequence[str], values: Mapping[str, Any], ask: LawQuestion
) -> RigConfig:
    try:
        return resolve_rig(path, settings, ask)
    except ConfigError as error:
        where = error.where.removeprefix("--set ")
        at = "" if where.startswith(path) or where in values else f" ({where})"
        told = ", ".join(f"{key} = {text(value)}" for key, value in values.items())
        raise ConfigError(error.what + at, where=f"{study.where}{f', {told}' if told else ''}", do=error.do) from None
