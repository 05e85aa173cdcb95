"""Tables with named columns: .csv files, and the nodes or elements of input files (.inp)."""

import csv
import re
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from squeal.io.cells import cell_name
from squeal.schema import ANY, NOT_NEGATIVE, Kind, Place, read_content

MOST_NODES = 20  # of an element that are read: corners, and middles of edges
# keywords of a deck, without blanks, that say what is not read
REFUSED_KEYWORDS = {
    "*CYCLICSYMMETRYMODEL": "the matrices of a sector are not those of the structure; write all of "
    "its sectors",
    **dict.fromkeys(("*INSTANCE", "*SYSTEM"), "write the file without parts and local axes"),
    **dict.fromkeys(
        ("*ELCOPY", "*ELGEN", "*NCOPY", "*NFILL", "*NGEN", "*NMAP"),
        "write out each node and element",
    ),
}
HELD = "a node that it ties has no row; mode shapes, loads and contact take it as held"
WARNINGS_OF_KEYWORDS = {
    **dict.fromkeys(("*COUPLING", "*DISTRIBUTINGCOUPLING", "*KINEMATICCOUPLING"), HELD),
    **dict.fromkeys(("*EMBEDDEDELEMENT", "*EQUATION", "*MPC", "*PRE-TENSIONSECTION"), HELD),
    **dict.fromkeys(("*RIGIDBODY", "*SHELLTOSOLIDCOUPLING", "*TIE"), HELD),
    "*TRANSFORM": "rows are taken along x, y and z, as CalculiX writes them; Abaqus writes them "
    "along the local axes",
}


class Line(NamedTuple):
    """A line of a table: its place, and its cells by the names of their columns."""

    at: Place
    cells: dict[str, str]


class _Row(NamedTuple):
    """A line of a file: its number and its cells."""

    number: int
    cells: list[str]


def read_table(path: Path, names: Sequence[str], more: str = "") -> tuple[Place, list[Line]]:
    """The place of a .csv file and its lines; it must have the columns `names`, and may have one
    `more`. The lines below *NODE or *ELEMENT, by the first name, where it is an .inp file.

    Raises InputError.
    """
    at = Place(str(path))
    try:
        if path.suffix.lower() == ".inp":
            rows = list(_input_file_rows(path, names[0]))
        else:
            table = csv.reader(_text_lines(path, at))
            rows = [_Row(table.line_num, cells) for cells in table]
    except csv.Error as error:
        raise at.refuse(f"no table of comma-separated values: {error}") from None
    rows = [row for row in rows if "".join(row.cells).strip()]
    first_cells = rows[0].cells if rows else []
    heads = [cell.strip().lower() for cell in first_cells]
    missing = [name for name in names if name not in heads]
    if missing and path.suffix.lower() == ".inp":
        raise at.refuse(
            f"names nodes, not the {missing[0]} of each row; the matrices need labels, such as "
            "those of the file .dof that CalculiX writes beside them, or a .csv file"
        )
    if missing:
        needed = ", ".join(names)
        if more:
            needed += f" and {more}"
        raise at.refuse(
            f"no column {missing[0]}; the first line of a .csv file must name, with commas, "
            f"{needed}"
        )
    lines = []
    for row in rows[1:]:
        here = at / f"line {row.number}"
        surplus = row.cells[len(heads) :]
        if any(cell.strip() for cell in surplus):
            raise here.refuse(f"{len(row.cells)} cells; the first line names {len(heads)} columns")
        pairs = zip_longest(heads, row.cells[: len(heads)], fillvalue="")
        lines.append(Line(here, dict(pairs)))
    return at, lines


def number_in(text: str, at: Place, kind: Kind = ANY) -> float:
    """The number in a cell of a table. Raises InputError."""
    try:
        number = float(text)
    except ValueError:
        raise at.must_be(text, kind.named) from None
    return float(kind.read(number, at))


def read_over_frequency(path: Path, names: Sequence[str], more: str = "") -> list[list[float]]:
    """Columns of numbers of at least 0, the first of rising frequencies, and the one `more`, of
    zeros if it is missing. Raises InputError."""
    at, lines = read_table(path, names, more)
    rows: list[list[float]] = []
    for here, cells in lines:
        row = [number_in(cells[name], here / name, NOT_NEGATIVE) for name in names]
        if more:
            row.append(number_in(cells.get(more) or "0", here / more, NOT_NEGATIVE))
        if rows and row[0] <= rows[-1][0]:
            raise here.refuse(f"frequency {row[0]:g} is not allowed; frequencies must rise")
        rows.append(row)
    if len(rows) < 2:
        raise at.refuse(f"{len(rows)} lines of numbers; 2 or more are needed")
    return [list(column) for column in zip(*rows, strict=True)]


def _text_lines(path: Path, at: Place) -> list[str]:
    return read_content(path, at).decode("utf-8-sig", "backslashreplace").splitlines()


def _with_included(
    path: Path, text: Sequence[str], at: Place, including: tuple[Path, ...]
) -> Iterator[str]:
    """The lines of an input file with those of the files that *INCLUDE names in their places.

    `including` are the files that include this one. Raises InputError.
    """
    for number, line in enumerate(text, 1):
        name = re.match(r"\s*\*INCLUDE\s*,\s*INPUT\s*=\s*\"?([^\",]+)", line, re.IGNORECASE)
        if not name:
            yield line
            continue
        included = path.parent / name[1].strip()
        if included.resolve() in including:
            raise (at / f"line {number}").refuse(f"{included.name} includes itself")
        here = Place(str(included))
        included_text = _text_lines(included, here)
        yield from _with_included(included, included_text, here, (*including, included.resolve()))


UNFINISHED = "ends an element whose last line of nodes ends with a comma; is the file cut?"


class DeckLine(NamedTuple):
    """A line of data of an input file: its place, its number, the line of the keyword above it in
    capitals and split at its commas, its own cells, and how many steps have begun before it."""

    at: Place
    number: int
    keyword: list[str]
    cells: list[str]
    step: int

    def option(self, name: str) -> str:
        """What an option of the keyword is set to, in capitals; "" if it is left out."""
        for option in self.keyword[1:]:
            key, _, value = option.partition("=")
            if key.strip() == name:
                return value.strip().strip('"')
        return ""


def deck_lines(path: Path) -> Iterator[DeckLine]:
    """The lines of data of an input file of Abaqus or CalculiX and of those that it includes;
    elements that go on in the next line are one. Warns of keywords that tie or turn rows, and
    raises InputError for those that make nodes and elements or local axes."""
    at = Place(str(path))
    text = _with_included(path, _text_lines(path, at), at, (path.resolve(),))
    keyword = [""]
    step = 0
    begun = ""  # of an element whose nodes go on in the next line
    for number, line in enumerate(text, 1):
        if line.startswith("**"):
            continue
        here = at / f"line {number}"
        if line.startswith("*"):
            if begun:
                raise here.refuse(UNFINISHED)
            keyword = _cells(line.upper())
            if keyword[0] == "*STEP":
                step += 1
            _check_keyword(keyword, at, here)
            continue
        full_line = begun + line
        if not full_line.strip():
            continue
        cells = _cells(full_line)
        goes_on = keyword[0] == "*ELEMENT" and not cells[-1]
        begun = full_line if goes_on else ""
        if not goes_on:
            yield DeckLine(here, number, keyword, cells, step)
    if begun:
        raise at.refuse(UNFINISHED)


def _check_keyword(keyword: Sequence[str], at: Place, here: Place) -> None:
    """Warn of a keyword, once for its file `at`, or refuse it `here`. Raises InputError."""
    name = keyword[0].replace(" ", "")
    has_local_axes = any(option.startswith("SYSTEM") for option in keyword)
    way_on = REFUSED_KEYWORDS["*SYSTEM"] if has_local_axes else REFUSED_KEYWORDS.get(name)
    if way_on:
        raise here.refuse(f"{keyword[0]} is not allowed; {way_on}")
    if name in ("*NODE", "*ELEMENT", "*NSET", "*ELSET"):
        if any(option.startswith("INPUT") for option in keyword):
            raise here.refuse(f"INPUT of {name} is not read; name the file below *INCLUDE")
    elif name in WARNINGS_OF_KEYWORDS:
        at.warn(f"{keyword[0]}: {WARNINGS_OF_KEYWORDS[name]}")


def _input_file_rows(path: Path, wanted: str) -> Iterator[_Row]:
    """The head of a table and the lines below *NODE or *ELEMENT of an input file of Abaqus or
    CalculiX. Elements without faces, such as springs, are left out. Raises InputError."""
    of_nodes = wanted == "node"
    if of_nodes:
        yield _Row(0, ["node", "x", "y", "z"])
    else:
        yield _Row(0, ["element", "type", *map(str, range(MOST_NODES))])
    for line in deck_lines(path):
        if line.keyword[0] != f"*{wanted.upper()}":
            continue
        if of_nodes:
            padded = [*line.cells, "0", "0", "0"]
            yield _Row(line.number, [cell or "0" for cell in padded[:4]])
        elif kind := cell_name(line.keyword):
            yield _Row(line.number, [line.cells[0], kind, *line.cells[1 : 1 + MOST_NODES]])


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split(",")]
