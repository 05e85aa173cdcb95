"""`python -m squeal.cli.parts JOB.yaml --part 3-of-8 --out FILE`: a job in parts.

A job of workflow/jobs is a map, a sweep, or random pads; its size is in rows of the map, values of
the sweep, or blocks of pads, and a part is a range of it. A part's table ends with a line that says
which part of which job it is; `--gather PART ... --out FILE` checks these lines and writes the
whole table, the same bytes whatever the number of parts.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import hashlib
import io
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

import squeal
from squeal.analysis import maps
from squeal.analysis.of_pads import map_over
from squeal.cli.options import band, spaced
from squeal.cli.source import read_source
from squeal.cli.streams import exit_code
from squeal.io.answer import Column, Table
from squeal.io.document import read_document
from squeal.io.parts import cut
from squeal.io.scene import Scene, read_scene
from squeal.io.writing import write_csv, write_text
from squeal.model.pad import PARAMETERS
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Angle, Text, Word

_RANGE = {
    "low": Key("least value", Angle(), required=True),
    "high": Key("greatest value", Angle(), required=True),
    "spread": Key("what is spread evenly", Word(("values", "logarithms"))),
}
_FILE = Key(
    "scene file, or for a sweep a system file, from the repository's folder", Text(), required=True
)
_AXIS = Group({**_RANGE, "n": Key("number of points", maps.COUNT, required=True)}, "an axis")


def _each(kind: Group) -> Group:
    return Group({name: Key(about.meaning, kind) for name, about in PARAMETERS.items()})


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
            "ranges": Key("parameters drawn", _each(Group(_RANGE, "a range")), required=True),
            "count": Key("number of pads", maps.PADS, required=True),
            "bins": Key("parts of the first range", maps.BINS),
            "seed": Key("seed of the random numbers", maps.SEED),
        },
        "pads",
    ),
}
"""What a job may say, by its one key."""


@dataclass(frozen=True)
class Job:
    """A job of some size: the table of a range of it, and what makes the whole of parts' rows."""

    size: int
    table: Callable[[int, int], Table]
    whole: Callable[[list[list[list[str]]]], list[list[Any]]] = lambda parts: [*chain(*parts)]


def _map(given: dict[str, Any], scene: Scene) -> Job:
    first, second = (
        maps.Axis(name, each["low"], each["high"], each["n"], each.get("spread") == "logarithms")
        for name, each in given["axes"].items()
    )

    def table(start: int, stop: int) -> Table:
        rows = dataclasses.replace(first, part=(start, stop))
        return map_over(scene, (rows, second), None, False).table()

    return Job(first.n, table)


def _sweep(given: dict[str, Any], at: Place) -> Job:
    subject, _ = read_source(given["scene"], ()).subject()
    values = spaced(given["values"], str(at / "values"))
    asked: dict[str, Any] = {}
    if not isinstance(subject, Scene):  # a basis that serves all values would be made in each part
        asked = {"method": "full"}
        if "band" in given:
            asked["band"] = band(given["band"], str(at / "band"))
    elif "band" in given:
        raise (at / "band").must_be(given["band"], "left out with a scene, which has six roots")

    def table(start: int, stop: int) -> Table:
        part = values[start:stop]
        if asked:
            return squeal.sweep(subject, part, **asked).table()
        # up to the same last value in every part: the steps on the way are the same then
        found = squeal.sweep(subject, [*part, values[-1]])
        return dataclasses.replace(found, steps=found.steps[:-1]).table()

    return Job(len(values), table)


def _pads(given: dict[str, Any], scene: Scene) -> Job:
    ranges = tuple(
        maps.Range(name, each["low"], each["high"], each.get("spread") == "logarithms")
        for name, each in given["ranges"].items()
    )
    more = {name: given[name] for name in ("bins", "seed") if name in given}
    drawn = maps.RandomPads(scene, ranges, given["count"], **more)
    first, edges = drawn.names[0], drawn.edges.tolist()
    heads = (f"{first} from", f"{first} to", "pads", *maps.NAMES)

    def rows(counts: np.ndarray) -> list[list[Any]]:
        ends = zip(edges[:-1], edges[1:], counts.sum(axis=1), *counts.T, strict=True)
        return [list(row) for row in ends]

    def table(start: int, stop: int) -> Table:
        told = [Column(name, value=itemgetter(k)) for k, name in enumerate(heads)]
        return Table(told, rows(drawn.counts(start, stop)))

    def whole(parts: list[list[list[str]]]) -> list[list[Any]]:
        counts = [[row[3:] for row in part] for part in parts]
        return rows(np.array(counts, dtype=np.int64).sum(axis=0))

    return Job(drawn.blocks, table, whole)


def read_job(file: Path) -> Job:
    """The job of a file, its axes and ranges in the file's order. Raises InputError."""
    document, at = read_document(file), Place(str(file))
    owner = Group({name: Key(name, kind) for name, kind in KINDS.items()}, only_one=True)
    ((kind, given),) = owner.read(document, at).items()
    for key in {"axes", "ranges"} & given.keys():
        given[key] = {each: given[key][each] for each in document[kind][key]}
    if kind == "sweep":
        return _sweep(given, at)
    scene = read_scene(Path(given["scene"]))
    if kind == "pads":
        return _pads(given, scene)
    if len(given["axes"]) != 2:
        raise (at / "axes").must_be(", ".join(given["axes"]), "two parameters")
    return _map(given, scene)


def _seal(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def write_part(file: Path, part: str, out: Path) -> None:
    """Write the table of one part, with a last line that says which it is. Raises InputError."""
    job = read_job(file)
    start, stop = cut(part, job.size)
    table = job.table(start, stop)
    stream = io.StringIO()
    lines = csv.writer(stream, lineterminator="\n")
    lines.writerow([f"{one.name} [{one.unit}]" if one.unit else one.name for one in table.columns])
    lines.writerows([record.values() for record in table.records()])
    text = stream.getvalue()
    write_text(out, f"{text}# {part} {_seal(file.read_text())} {_seal(text)}\n")


def gather(file: Path, parts: Sequence[Path], out: Path) -> None:
    """Write the whole table from those of all parts. Raises InputError where one is missing, is
    there twice, is cut, or belongs to another job."""
    job, own, tables, head = read_job(file), _seal(file.read_text()), dict[int, Any](), [""]
    count = len(parts)
    for part in parts:
        at = Place(str(part))
        try:
            text, _, last = part.read_text(encoding="utf-8").rstrip("\n").rpartition("\n")
        except (OSError, UnicodeDecodeError) as error:
            raise at.refuse(f"cannot be read: {error}") from None
        found = re.fullmatch(r"# (\d+)-of-(\d+) (\w+) (\w+)", last)
        if not found or found[4] != _seal(f"{text}\n"):
            raise at.refuse("is no whole part; compute it again")
        if found[3] != own or int(found[2]) != count or int(found[1]) in tables:
            words = f"is part {found[1]} of {found[2]}"
            raise at.refuse(f"{words}; each of {count} parts of {file} once is allowed")
        head, *tables[int(found[1])] = csv.reader(text.splitlines())
    write_csv(out, head, job.whole([tables[number] for number in sorted(tables)]))


def main(given: Sequence[str] | None = None) -> int:
    """Write a part or the whole; 2 for what is refused, 1 for what fails, 130 if it is stopped."""
    parser = argparse.ArgumentParser(description="Compute a job in parts.")
    parser.add_argument("job", type=Path, metavar="JOB.yaml")
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--part", metavar="I-of-N")
    wanted.add_argument("--gather", nargs="+", type=Path, metavar="PART")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    chosen = parser.parse_args(given)

    def work() -> int:
        if chosen.part is None:
            gather(chosen.job, chosen.gather, chosen.out)
        else:
            write_part(chosen.job, chosen.part, chosen.out)
        return 0

    return exit_code(chosen.job.stem, work)


if __name__ == "__main__":
    sys.exit(main())
