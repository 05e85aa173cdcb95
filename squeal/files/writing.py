"""Writing results: whole or not at all."""

from __future__ import annotations

import csv
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import IO, Any

from squeal.errors import BEYOND, ComputationError, InputError


def check_writable(path: Path, option: str) -> None:
    """Refuse an output file that could not be written, before anything is computed."""
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "not a plain file"
        raise InputError(f"{option} {path}: is {kind}; the name of a file is allowed")
    if not path.parent.is_dir():
        raise InputError(f"{option} {path}: the folder {path.parent} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{option} {path}: the folder {path.parent} is not writable")


def write_whole(path: Path, write: Callable[[IO[Any]], None], binary: bool = False) -> None:
    """Write a file beside its place and move it there when it is complete."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") if binary else os.fdopen(handle, "w", newline="") as stream:
            write(stream)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(name, 0o666 & ~umask)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""

    def write(stream: IO[str]) -> None:
        stream.write(text)

    write_whole(path, write)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A CSV file with a header line; None and NaN become empty fields."""

    def cell(value: Any) -> Any:
        if isinstance(value, float):
            return "" if math.isnan(value) else repr(value)
        return "" if value is None else value

    def write(stream: IO[str]) -> None:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(header)
        table.writerows([cell(value) for value in row] for row in rows)

    write_whole(path, write)


def to_json(value: Any) -> str:
    """JSON text. Raises ComputationError if a number in it is not finite, which JSON cannot say."""
    try:
        return json.dumps(value, allow_nan=False, indent=1)
    except ValueError:
        raise ComputationError(f"a result is not a finite number; {BEYOND}") from None
