"""The file of a study: which rig, which settings for all pushes, and what differs from push to push."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from msgspec import Meta

from robot_io.errors import ConfigError
from robot_io.rig import toml as toml_text
from robot_io.rig.checks import build
from robot_io.rig.types import Table

FILES = Path(__file__).parent / "files"
MOST_PUSHES = 1_000_000
LAW = "control.law"
ONE_OF = "one_of"
_SEED = Annotated[int, Meta(ge=0, le=2**63 - 1)]


class StudyTable(Table, frozen=True):
    """The table `[study]`. seeds: how many (0, 1, 2, ...), or which."""

    name: Annotated[str, Meta(pattern=r"^\w[\w .+-]{0,63}$")]
    rig: str = "sim"
    law: str = ""
    seeds: Annotated[int, Meta(ge=1, le=MOST_PUSHES)] | tuple[_SEED, ...] = 1
    mode: Literal["grid", "random", "zip"] = "grid"


class _Tables(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A whole file; the keys of `settings` and `axes` are those of a rig."""

    study: StudyTable
    settings: dict[str, Any] = {}
    axes: dict[str, Any] = {}


class Listed(NamedTuple):
    """An axis of which each value is pushed with."""

    key: str
    values: tuple[Any, ...]


class Drawn(NamedTuple):
    """An axis of which each seed draws its value: between two numbers, or one of some."""

    key: str
    low: float = 0.0
    high: float = 0.0
    one_of: tuple[Any, ...] = ()


class StudyFile(msgspec.Struct, frozen=True):
    """A study as its file says it. text: of the file. folder: where it is, and its rig may be.

    law_folders: where laws are looked for, besides the Python path; by default beside the file and beside its rig.
    """

    name: str
    rig: str
    seeds: tuple[int, ...]
    mode: str
    settings: tuple[tuple[str, Any], ...]
    axes: tuple[Listed | Drawn, ...]
    text: str
    where: str
    folder: str
    law_folders: tuple[str, ...] = ()

    def with_rig(self, rig: str, law_folders: tuple[str, ...]) -> StudyFile:
        """Return the study of another rig, with the folders where its laws are looked for."""
        return msgspec.structs.replace(self, rig=rig, law_folders=law_folders)

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of the axes, in the order of the file."""
        return tuple(axis.key for axis in self.axes)


def shipped_studies() -> list[str]:
    """Return the names of the studies that come with the program."""
    return sorted(path.stem for path in FILES.glob("*.toml"))


def find_study(name_or_path: str) -> Path:
    """Return the file of a shipped study or of a path. Raises ConfigError where there is none."""
    if name_or_path in (shipped := shipped_studies()):
        return FILES / f"{name_or_path}.toml"
    path = Path(name_or_path)
    if path.is_file():
        return path
    if path.suffix == ".toml" or "/" in name_or_path:
        raise ConfigError("there is no such study file", where=name_or_path, do="Check the name")
    near = difflib.get_close_matches(name_or_path, shipped, n=1)
    hint = f"Did you mean `{near[0]}`? " if near else ""
    raise ConfigError(
        f"there is no study named `{name_or_path}`",
        do=f"{hint}Shipped studies: {', '.join(shipped)}; or give the path of a file",
    )


def load_study(path: Path) -> StudyFile:
    """Read the file of a study. Raises ConfigError, with its line, for what cannot be a study."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read it: {error}", where=str(path)) from None
    return read_study(text, str(path), str(path.resolve().parent))


def read_study(text: str, where: str, folder: str) -> StudyFile:
    """Read the text of a study. where: its name in errors. folder: what its paths are relative to. As `load_study`."""
    data, origins = toml_text.parse(text, where)
    tables = build(_Tables, data, origins, where)
    study = tables.study
    settings = dict(_leaves(tables.settings))
    axes = tuple(_axis(key, value, study.mode, where) for key, value in _axes(tables.axes))
    if study.law:
        if LAW in (*settings, *(axis.key for axis in axes)):
            raise ConfigError("the law is given twice: as `law` of `[study]` and as `control.law`", where=where)
        settings = {LAW: study.law} | settings
    for axis in axes:
        for key in settings:
            if f"{key}.".startswith(f"{axis.key}.") or f"{axis.key}.".startswith(f"{key}."):
                raise ConfigError(f"`{key}` is a setting, and `{axis.key}` an axis", where=where, do="Leave one out")
    seeds = tuple(range(study.seeds)) if isinstance(study.seeds, int) else study.seeds
    if not seeds or len(set(seeds)) < len(seeds):
        raise ConfigError("`study.seeds` is a number of seeds, or a list of different ones", where=where)
    found = StudyFile(
        study.name, study.rig, seeds, study.mode, tuple(settings.items()), axes, text, where, folder
    )  # fmt: skip
    _check_size(found)
    return found


def _axis(key: str, value: Any, mode: str, where: str) -> Listed | Drawn:
    place = f"{where}, axes.{key}"
    if mode == "random" and isinstance(value, Mapping):
        choices = value.get(ONE_OF)
        if set(value) != {ONE_OF} or not isinstance(choices, list) or not choices:
            raise ConfigError("a draw is `[low, high]` or `{ one_of = [...] }`", where=place)
        return Drawn(key, one_of=tuple(choices))
    if not isinstance(value, list) or not value:
        raise ConfigError("an axis is a list of values", where=place, do=f'For example: "{key}" = [...]')
    if mode == "random" and len(value) == 2 and all(type(item) in (int, float) for item in value):
        low, high = value
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ConfigError(f"[{low}, {high}] is not a range: low, then high", where=place)
        return Drawn(key, float(low), float(high))
    return Listed(key, tuple(value))


def _check_size(study: StudyFile) -> None:
    listed = [len(axis.values) for axis in study.axes if isinstance(axis, Listed)]
    if study.mode == "zip" and len(set(listed)) > 1:
        told = ", ".join(f"{axis.key} {len(axis.values)}" for axis in study.axes if isinstance(axis, Listed))
        raise ConfigError(f"the axes of a zip are of one length ({told})", where=study.where)
    combinations = listed[0] if study.mode == "zip" and listed else math.prod(listed)
    if combinations * len(study.seeds) > MOST_PUSHES:
        raise ConfigError(
            f"{combinations * len(study.seeds)} pushes are more than {MOST_PUSHES}",
            where=study.where,
            do="Leave out values or seeds",
        )


def _leaves(table: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    """Return dotted keys and values of nested tables, whichever way they were written."""
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        found += _leaves(value, f"{above}{key}.") if isinstance(value, Mapping) else [(f"{above}{key}", value)]
    return found


def _axes(table: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        nested = isinstance(value, Mapping) and ONE_OF not in value
        found += _axes(value, f"{above}{key}.") if nested else [(f"{above}{key}", value)]
    return found


def flat(key: str, value: Any) -> list[tuple[str, Any]]:
    """Return the settings that one value of an axis makes: itself, or those of a table."""
    return _leaves({key: value})
