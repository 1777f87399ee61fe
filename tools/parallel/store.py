"""Store a study in a folder: finished work survives interruptions, and files of others are never overwritten.

`study.json` identifies the study (with a fingerprint of everything its numbers depend on), `parts/` contains one file
per item, written atomically, and the results are assembled from the parts in the order of the cases.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robot_io.errors import UsageError
from tools.parallel.part import Part, Row
from tools.places.atomic_file import check_writable, write_atomically, write_json

STUDY_FILE = "study.json"


def fingerprint(what: object, sources: Sequence[Path]) -> str:
    """Return a digest of a study's definition and of the source files its numbers come from."""
    digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode())
    for source in sources:
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


class Store:
    """A study's folder. Raises UsageError if it cannot be used.

    out: the folder, created if missing. mark: the study's fingerprint. resume: whether to continue an
    existing study (a folder without a finished part is accepted, so that a restartable job can always set it).
    """

    def __init__(self, out: Path, name: str, mark: str, *, resume: bool) -> None:
        self.out = out
        self._mark = mark
        found = _found(out)
        if found is not None and not any((out / "parts").glob("*.npz")):
            found = None  # nothing came of it
        if found is not None and found != mark:
            raise UsageError(
                "this folder contains another study (or one by another version of the program)",
                where=str(out),
                do="Give another --out",
            )
        if found is not None and not resume:
            raise UsageError(
                "this folder already contains this study", where=str(out), do="Add --resume, or give another --out"
            )
        try:
            (out / "parts").mkdir(parents=True, exist_ok=True)
            if found is None:
                self.write_json(STUDY_FILE, {"schema": 1, "study": name, "fingerprint": mark})
            check_writable(out)
        except OSError as error:
            raise UsageError(
                f"this folder cannot be written: {error.strerror}", where=str(out), do="Give another --out"
            ) from None

    def finished(self, items: int) -> set[int]:
        """Return the numbers of the items whose parts are present and intact."""
        return {index for index in range(items) if self._read(index) is not None}

    def save(self, index: int, part: Part) -> None:
        """Save the part of one item."""
        rows = np.frombuffer(json.dumps(part.rows).encode(), dtype=np.uint8)
        mark = np.frombuffer(self._mark.encode(), dtype=np.uint8)
        self.write_bytes(f"parts/{index:06d}.npz", _npz({"mark": mark, "rows": rows, **part.arrays}))

    def load(self, items: int) -> list[Part]:
        """Return all parts in order; every item must be finished."""
        return list(self.each(items))

    def each(self, items: int) -> Iterator[Part]:
        """Yield all parts in order, one at a time; every item must be finished."""
        for index in range(items):
            if (part := self._read(index)) is not None:
                yield part

    def write_csv(self, name: str, columns: Sequence[str], rows: Sequence[Row]) -> None:
        """Write rows as CSV; floats as the shortest text that reads back to the same bits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_text(row.get(column, "")) for column in columns] for row in rows)
        self.write_bytes(name, text.getvalue().encode())

    def write_arrays(self, name: str, arrays: dict[str, Any]) -> None:
        """Write arrays as an npz file; the same arrays give the same bytes."""
        self.write_bytes(name, _npz(arrays))

    def write_json(self, name: str, value: object) -> None:
        """Write indented JSON."""
        write_json(self.out / name, value)

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file atomically."""
        write_atomically(self.out / name, content)

    def _read(self, index: int) -> Part | None:
        path = self.out / "parts" / f"{index:06d}.npz"
        try:
            raw = path.read_bytes()
            with np.load(io.BytesIO(raw), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            if _npz(arrays) != raw:  # not the bytes that these arrays were written as, a name for instance
                return None
            if arrays.pop("mark").tobytes().decode() != self._mark:
                return None
            return Part(json.loads(arrays.pop("rows").tobytes()), arrays)
        except Exception:  # missing or damaged, whatever one byte makes of an archive: the item is run again
            return None


def _found(out: Path) -> str | None:
    """Return the fingerprint of the study in a folder, None for a new or empty folder; UsageError for anything else."""
    try:
        entries = list(out.iterdir())
    except FileNotFoundError:
        return None
    except OSError as error:
        raise UsageError(
            f"this cannot be a study folder: {error.strerror}", where=str(out), do="Give another --out"
        ) from None
    if not entries:
        return None
    try:
        found = json.loads((out / STUDY_FILE).read_text(encoding="utf-8"))["fingerprint"]
    except (OSError, ValueError, KeyError, TypeError):
        found = None
    if not isinstance(found, str):
        raise UsageError("this is not a study folder", where=str(out), do="Give another --out")
    return found


def _npz(arrays: dict[str, Any]) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _text(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)
