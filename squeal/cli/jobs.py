"""Jobs that are computed in parts: what a file of workflow/jobs may say, and the rows of a part.

A job has a size, in rows of a map, values of a sweep or blocks of random pads; a part is a range of
it. The gathered table is the same bytes whatever the number of parts.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from squeal.analysis.maps import BINS, NAMES, PADS, SEED, Axis, RandomPads, Range, stability_map
from squeal.analysis.maps import COUNT as POINTS
from squeal.cli.map import write_map
from squeal.cli.numbers import band_of, spaced
from squeal.cli.source import read_source
from squeal.cli.sweep import sweep, write_sweep
from squeal.io.document import read_document
from squeal.io.scene import Scene, read_scene
from squeal.io.short_form import PlainSystem
from squeal.io.writing import write_csv
from squeal.model.pad import PARAMETERS
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Angle, Text, Word

if TYPE_CHECKING:
    from squeal.analysis.systems.wanted import Wanted
    from squeal.linear.system import TermSystem

_RANGE = {
    "low": Key("least value", Angle(), required=True),
    "high": Key("greatest value", Angle(), required=True),
    "spread": Key("what is spread evenly", Word(("values", "logarithms"))),
}
_FILE = Key(
    "scene file, or for a sweep a system file, from the repository's folder", Text(), required=True
)
_AXIS = Group({**_RANGE, "n": Key("number of points", POINTS, required=True)}, "an axis")
_SPREAD = Group(_RANGE, "a range")
_EACH = {name: Key(about.meaning, Text()) for name, about in PARAMETERS.items()}


def _each(kind: Group) -> Group:
    return Group({name: dataclasses.replace(key, kind=kind) for name, key in _EACH.items()})


KINDS = {
    "map": Group(
        {"scene": _FILE, "axes": Key("two parameters", _each(_AXIS), required=True)}, "map"
    ),
    "sweep": Group(
        {
            "scene": _FILE,
            "values": Key("A:B:N, that many values from A to B", Text(), required=True),
            "band": Key("LOW:HIGH in Hz, of a system from matrices", Text(), default="all roots"),
        },
        "sweep",
    ),
    "pads": Group(
        {
            "scene": _FILE,
            "ranges": Key("parameters that are drawn", _each(_SPREAD), required=True),
            "count": Key("number of pads", PADS, required=True),
            "bins": Key("parts of the first range", BINS),
            "seed": Key("seed of the random numbers", SEED),
        },
        "pads",
    ),
}
"""What a job may say, by its one key."""


class Job(Protocol):
    """What every kind of job offers."""

    @property
    def size(self) -> int:
        """How many units it has."""

    def write(self, path: Path, start: int, stop: int) -> None:
        """Write the units from start to stop as a table with a head."""

    def gather(self, path: Path, parts: Sequence[Path]) -> None:
        """Write the whole table from those of the parts, which are given in their order."""
        head, tables = _read(parts)
        write_csv(path, head, (row for table in tables for row in table))


def _read(parts: Sequence[Path]) -> tuple[list[str], list[list[list[str]]]]:
    """The head, which all parts share, and the rows of each. Raises InputError if they differ."""
    tables = [list(csv.reader(part.read_text(encoding="utf-8").splitlines())) for part in parts]
    for part, table in zip(parts, tables, strict=True):
        if not table or table[0] != tables[0][0]:
            raise Place(str(part)).refuse("its columns are not those of the first part")
    return tables[0][0], [table[1:] for table in tables]


@dataclass(frozen=True)
class Map(Job):
    """The verdict over two parameters, as `squeal map --csv`; a unit is a row of points."""

    scene: Scene
    axes: tuple[Axis, Axis]

    @property
    def size(self) -> int:
        """Points along the first axis."""
        return self.axes[0].n

    def write(self, path: Path, start: int, stop: int) -> None:
        """The verdicts at these values of the first parameter."""
        rows = dataclasses.replace(self.axes[0], part=(start, stop))
        found = stability_map(self.scene, (rows, self.axes[1]))
        write_map(path, found, None, not self.scene.pad_model.linear)


@dataclass(frozen=True)
class Sweep(Job):
    """Eigenvalues at values of the parameter, as `squeal eigenvalues --mu A:B:N --csv`."""

    source: Scene | PlainSystem
    values: tuple[float, ...]

    @property
    def size(self) -> int:
        """The number of values."""
        return len(self.values)

    def write(self, path: Path, start: int, stop: int) -> None:
        """The eigenvalues at these values."""
        # up to the same last value in every part: the steps on the way are the same then
        steps = sweep(self.source, (*self.values[start:stop], self.values[-1]))
        write_sweep(path, steps[:-1])


@dataclass(frozen=True)
class SystemSweep(Job):
    """Roots of a system from matrices, each value solved on the full system.

    As `squeal eigenvalues --sweep A:B:N --method full --csv`; a basis that serves all values would
    be made anew in every part.
    """

    system: TermSystem
    wanted: Wanted
    values: tuple[float, ...]

    @property
    def size(self) -> int:
        """The number of values."""
        return len(self.values)

    def write(self, path: Path, start: int, stop: int) -> None:
        """The roots at these values."""
        from squeal.analysis.systems.sweeps import full_rows
        from squeal.cli.systems import write_sweep

        rows = list(full_rows(self.system, self.wanted, self.values[start:stop]))
        write_sweep(path, self.system.parameter, rows)


@dataclass(frozen=True)
class Pads(Job):
    """How many random pads have each verdict; a unit is a block of them."""

    pads: RandomPads

    @property
    def size(self) -> int:
        """The number of blocks."""
        return self.pads.blocks

    def _write(self, path: Path, counts: np.ndarray) -> None:
        first, edges = self.pads.names[0], self.pads.edges.tolist()
        rows = zip(edges[:-1], edges[1:], counts.sum(axis=1), *counts.T, strict=True)
        write_csv(path, [f"{first} from", f"{first} to", "pads", *NAMES], rows)

    def write(self, path: Path, start: int, stop: int) -> None:
        """The numbers among these blocks."""
        self._write(path, self.pads.counts(start, stop))

    def gather(self, path: Path, parts: Sequence[Path]) -> None:
        """The sum of the parts."""
        _, tables = _read(parts)
        counts = [[row[-len(NAMES) :] for row in table] for table in tables]
        self._write(path, np.array(counts, dtype=np.int64).sum(axis=0))


def _kind(file: Path) -> tuple[str, dict[str, Any]]:
    """Kind of a job and what is said of it; axes and ranges in the file's order."""
    document = read_document(file)
    owner = Group({name: Key(name, kind) for name, kind in KINDS.items()}, only_one=True)
    ((name, given),) = owner.read(document, Place(str(file))).items()
    for key in {"axes", "ranges"} & given.keys():
        given[key] = {each: given[key][each] for each in document[name][key]}
    return name, given


def _sweep(given: dict[str, Any], at: Place) -> Job:
    source = read_source(given["scene"], ())
    general, plain = source.terms(), source.system()
    if general is not None:
        system = general.system
    elif plain is not None and "band" in given:
        system = plain.terms()
    elif "band" in given:
        raise (at / "band").must_be(given["band"], "left out with a scene, which has six roots")
    else:
        values = tuple(spaced(given["values"], str(at / "values"), 0.0))
        return Sweep(source.scene() if plain is None else plain, values)
    from squeal.analysis.systems.wanted import Wanted, check_memory, is_small

    if not is_small(system):
        check_memory(system, None)
    wanted = Wanted(band_of(given["band"], str(at / "band")) if "band" in given else None)
    return SystemSweep(system, wanted, tuple(spaced(given["values"], str(at / "values"))))


def read_job(file: Path) -> Job:
    """The job of a file. Raises InputError for what it may not say."""
    kind, given = _kind(file)
    if kind == "sweep":
        return _sweep(given, Place(str(file)))
    scene = read_scene(Path(given["scene"]))
    if kind == "pads":
        ranges = tuple(
            Range(name, each["low"], each["high"], each.get("spread") == "logarithms")
            for name, each in given["ranges"].items()
        )
        more = {name: given[name] for name in ("bins", "seed") if name in given}
        return Pads(RandomPads(scene, ranges, given["count"], **more))
    axes = [
        Axis(name, each["low"], each["high"], each["n"], each.get("spread") == "logarithms")
        for name, each in given["axes"].items()
    ]
    if len(axes) != 2:
        raise (Place(str(file)) / "axes").must_be(", ".join(given["axes"]), "two parameters")
    return Map(scene, (axes[0], axes[1]))
