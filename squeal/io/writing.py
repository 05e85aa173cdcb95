"""Writing results: whole or not at all."""

import csv
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from squeal.errors import BEYOND, ComputationError, InputError


def picked(source: object, names: str) -> dict[str, Any]:
    """Some attributes of an object by name."""
    return {name: getattr(source, name) for name in names.split()}


@contextmanager
def _written(path: Path) -> Iterator[None]:
    """Refuse the place that the system does not write to, because a disc is full for example."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def write_whole(path: Path, write: Callable[[IO[Any]], object], binary: bool = False) -> None:
    """Write a file beside its place and move it there when it is complete.

    Raises InputError if it cannot be written; nothing of it is left then.
    """
    place = Path(os.path.realpath(path)) if path.is_symlink() else path  # also of a link to no file
    with _written(path):
        handle, name = tempfile.mkstemp(dir=place.parent, prefix=f".{place.name}.")
        try:
            text = {} if binary else {"encoding": "utf-8", "newline": ""}
            with os.fdopen(handle, "wb" if binary else "w", **text) as file:  # type: ignore[call-overload]
                write(file)
            umask = os.umask(0)
            os.umask(umask)
            os.chmod(name, 0o666 & ~umask)
            os.replace(name, place)
        except BaseException:
            os.unlink(name)
            raise


@contextmanager
def new_folder(folder: Path) -> Iterator[None]:
    """Make a folder, with those that lead to it, unless it exists; if what follows fails, none of
    them is left."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    with _written(folder):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        for one in missing:
            one.rmdir()
        raise


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """A place for files that are moved to a folder when all of them are complete."""
    with _written(folder), tempfile.TemporaryDirectory(dir=folder, prefix=".") as place:
        yield Path(place)
        for path in sorted(Path(place).iterdir()):
            os.replace(path, folder / path.name)


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""
    write_whole(path, lambda stream: stream.write(text))


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A CSV file with a header line; None and NaN become empty fields."""

    def write(stream: IO[str]) -> None:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(header)
        table.writerows(map(plain, row) for row in rows)

    write_whole(path, write)


def write_table(path: Path, columns: Mapping[str, str], rows: Iterable[Sequence[Any]]) -> None:
    """A table whose columns have units ("" for none), as CSV, JSON or netCDF by the name's end.

    The CSV head reads "name [unit]"; the JSON holds `units` and a mapping for each of the `rows`.
    """
    if path.suffix == ".nc":
        write_whole(path, lambda stream: _write_netcdf(stream, columns, list(rows)), binary=True)
    elif path.suffix == ".json":
        records = [dict(zip(columns, map(plain, row), strict=True)) for row in rows]
        write_text(path, to_json({"units": dict(columns), "rows": records}) + "\n")
    else:
        write_csv(path, [f"{n} [{u}]" if u else n for n, u in columns.items()], rows)


def _write_netcdf(
    stream: IO[Any], columns: Mapping[str, str], rows: Sequence[Sequence[Any]]
) -> None:
    """A variable a column in a classic netCDF file: doubles, None as NaN, or characters.

    The dimension bears the name of the first column if that rises throughout, so that it is the
    coordinate of the others, else it is `row`.
    """
    from scipy.io import netcdf_file

    values = list(zip(*rows, strict=True)) or [()] * len(columns)
    arrays = dict(zip(columns, map(_array, values), strict=True))
    first, lead = next(iter(arrays.items()))
    dimension = first if lead.dtype == float and bool((np.diff(lead) > 0.0).all()) else "row"
    file = netcdf_file(stream, "w")
    file.source = "squeal"
    file.createDimension(dimension, len(rows))
    for name, column in arrays.items():
        kind, places = "f8", [dimension]
        if column.dtype != float:  # text, as rows of characters
            kind, places = "c", [dimension, f"{name}_length"]
            length = max(column.dtype.itemsize, 1)
            file.createDimension(places[1], length)
            column = column.astype(f"S{length}").view("S1").reshape(-1, length)
        variable = file.createVariable(name, kind, places)
        variable[:] = column
        if columns[name]:
            variable.units = columns[name]
    file.close()


def _array(values: Sequence[Any]) -> np.ndarray:
    if any(isinstance(value, str) for value in values):
        return np.array([("" if v is None else str(v)).encode() for v in values], dtype=bytes)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def column_name(head: str) -> str:
    """The name in a CSV head that `write_table` wrote."""
    return head.partition(" [")[0]


def _unsigned(value: Any) -> Any:
    if isinstance(value, float):
        return value + 0.0
    if isinstance(value, dict):
        return {key: _unsigned(entry) for key, entry in value.items()}
    return [_unsigned(entry) for entry in value] if isinstance(value, list | tuple) else value


def plain(value: Any) -> Any:
    """None for NaN, and no minus zero."""
    if isinstance(value, float):
        return None if math.isnan(value) else value + 0.0
    return value


def to_json(value: Any) -> str:
    """JSON text, zeros without a sign.

    Raises ComputationError if a number in it is not finite, which JSON cannot say.
    """
    try:
        return json.dumps(_unsigned(value), allow_nan=False, indent=1)
    except ValueError:
        raise ComputationError(f"a result is not a finite number; {BEYOND}") from None
