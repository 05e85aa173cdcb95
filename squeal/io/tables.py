"""Tables with named columns: .csv files, and the nodes or elements of input files (.inp)."""

import csv
import re
from collections.abc import Iterator, Sequence
from io import StringIO
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from squeal.io.cells import cell_name, node_count
from squeal.schema import ANY, Kind, Place, Whole, read_content

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
    """A line of a table: its place, and its cells, without blanks around them, by the names of
    their columns."""

    at: Place
    cells: dict[str, str]


def read_table(path: Path, names: Sequence[str]) -> tuple[Place, list[Line]]:
    """Read a table with named columns: the place of its file and its lines below the heads.

    Parameters
    ----------
    path : Path
        A .csv file or an input file (.inp). Of an input file the lines below *NODE are read if the
        first of `names` is "node", else the lines below *ELEMENT.
    names : sequence of str
        Columns that the table must have.

    Raises
    ------
    InputError
    """
    at = Place(str(path))
    if path.suffix.lower() == ".inp":
        return at, list(_deck_table(path, names))
    rows: list[tuple[Place, list[str]]] = []  # lines that are not empty, with their places
    # line breaks stay, for quoted cells that hold some; strict: a quote that nothing closes would
    # take all lines below it for one cell
    table = csv.reader(StringIO(_text(path, at), newline=""), strict=True)
    end = 0  # number of the last line of the rows before
    try:
        for row in table:
            end = table.line_num
            cells = [cell.strip() for cell in row]
            if any(cells):
                rows.append((at / f"line {end}", cells))
    except csv.Error as error:
        here = at / f"line {end + 1}"
        raise here.refuse(f"no table of comma-separated values: {error}") from None
    heads = []
    if rows:
        _, first_cells = rows[0]
        heads = [cell.lower() for cell in first_cells]
    for name in names:
        if name not in heads:
            raise at.refuse(
                f"no column {name}; the first line of a .csv file must name, with commas, "
                f"{', '.join(names)}"
            )
    for name in filter(None, heads):  # columns without a name may be several
        if heads.count(name) > 1:
            raise at.refuse(f"{heads.count(name)} columns {name}; one is allowed")
    lines = []
    for here, cells in rows[1:]:
        if any(cells[len(heads) :]):
            raise here.refuse(f"{len(cells)} cells; the first line names {len(heads)} columns")
        # cells that the line lacks at its end are empty
        pairs = zip_longest(heads, cells[: len(heads)], fillvalue="")
        lines.append(Line(here, dict(pairs)))
    return at, lines


def number_in(text: str, at: Place, kind: Kind = ANY) -> float:
    """The number in a cell of a table, of a kind of numbers. Raises InputError."""
    try:
        number = float(text)
    except ValueError:
        raise at.must_be(text, kind.allowed) from None
    return float(kind.read(number, at))


def row_in(text: str, at: Place, count: int) -> int:
    """The index of the row of a number from 1 to `count` in a cell. Raises InputError."""
    number = int(text) if text.isdecimal() else text  # a text is refused as no whole number
    return Whole(1, count).read(number, at) - 1


def read_rising(
    path: Path, names: Sequence[str], kind: Kind = ANY, optional: str = ""
) -> list[list[float]]:
    """The numbers, of a kind, in each column of a table; those of the first column rise.

    A column `optional`, if one is named, follows those of `names`; it is zeros if the table has
    none. Raises InputError.
    """
    at, lines = read_table(path, names)
    rows: list[list[float]] = []
    for here, cells in lines:
        row = [number_in(cells[name], here / name, kind) for name in names]
        if optional:
            row.append(number_in(cells.get(optional) or "0", here / optional, kind))
        if rows and row[0] <= rows[-1][0]:
            raise here.refuse(f"{names[0]} {row[0]:g} is not allowed; it must rise")
        rows.append(row)
    if len(rows) < 2:
        raise at.refuse(f"{len(rows)} lines of numbers; 2 or more are needed")
    return [list(column) for column in zip(*rows, strict=True)]


def _text(path: Path, at: Place) -> str:
    """The text of a file; bytes that are no UTF-8 become escapes. Raises InputError."""
    return read_content(path, at).decode("utf-8-sig", "backslashreplace")


INCLUDE = re.compile(r"\s*\*\s*INCLUDE\s*,\s*INPUT\s*=\s*\"?([^\",]+)", re.IGNORECASE)


def _with_included(path: Path, including: tuple[Path, ...] = ()) -> Iterator[tuple[Place, str]]:
    """The lines of an input file: the place of each in its file, and its text.

    The lines of a file that *INCLUDE names stand in place of the line that names it. `including`
    are the files that include this one, so that no file includes itself. Raises InputError.
    """
    file = Place(str(path))
    chain = (*including, path.resolve())
    for number, text in enumerate(_text(path, file).splitlines(), 1):
        at = file / f"line {number}"
        name = INCLUDE.match(text)
        if not name:
            yield at, text
            continue
        included = path.parent / name[1].strip()
        if included.resolve() in chain:
            raise at.refuse(f"{included.name} includes itself")
        yield from _with_included(included, chain)


UNFINISHED = "ends an element that has more nodes than are given; is the file cut?"
MOST_NUMBERS = 16  # in a line of a deck


class DeckLine(NamedTuple):
    """A line of data of an input file.

    Attributes
    ----------
    at : Place
        Where it stands: its file, which may be an included one, and its number there.
    keyword : list of str
        The line of the keyword above it, in capitals and split at its commas; its name has no
        blanks.
    cells : list of str
        The line itself, split at its commas.
    step : int
        How many steps have begun before it.
    """

    at: Place
    keyword: list[str]
    cells: list[str]
    step: int

    def option(self, name: str) -> str:
        """What an option of the keyword is set to, in capitals; "" if it is left out."""
        for option in self.keyword[1:]:
            key, _, value = option.partition("=")
            if key.strip() == name:
                return value.strip()
        return ""


def deck_lines(path: Path) -> Iterator[DeckLine]:
    """The lines of data of an input file of Abaqus or CalculiX and of the files that it includes.

    The nodes of an element may fill several lines, and so may the options of a keyword, each line
    but the last ending with a comma: they are joined here. Warns of keywords that tie or turn rows.
    Raises InputError for keywords that generate nodes and elements or set local axes, and for an
    element that is cut off.
    """
    file = Place(str(path))
    keyword = [""]  # none yet
    step = 0  # how many keywords *STEP came before
    unfinished = ""  # the lines so far of an element whose nodes go on in the next line
    is_open = False  # whether the last line was of a keyword and ended with a comma
    for at, text in _with_included(path):
        line = text.strip()
        if not line or line.startswith("**"):
            continue
        is_new = line.startswith("*")
        # after the comma numbers and names of sets are data
        goes_on = is_open and re.match(r"[^,]*=|(GENERATE|INTERNAL|UNSORTED)\b", line.upper())
        is_open = bool(is_new or goes_on) and line.endswith(",")
        if goes_on:
            keyword = [*keyword[:-1], *_cells(line.upper())]
            _check_keyword(keyword, file, at)
            continue
        if is_new:
            if unfinished:
                raise at.refuse(UNFINISHED)
            keyword = _cells(line.upper())
            _check_keyword(keyword, file, at)
            keyword[0] = keyword[0].replace(" ", "")  # blanks in it mean nothing
            if keyword[0] == "*STEP":
                step += 1
            continue
        full_line = unfinished + line
        data = DeckLine(at, keyword, _cells(full_line), step)
        if keyword[0] == "*ELEMENT" and _element_goes_on(data, line):
            unfinished = full_line if line.endswith(",") else f"{full_line},"
            continue
        unfinished = ""
        yield data
    if unfinished:
        raise file.refuse(UNFINISHED)


def _element_goes_on(element: DeckLine, line: str) -> bool:
    """Whether the nodes of an element, whose last line so far is `line`, go on in the next one.

    The type says how many there are. Where it does not, a comma at the end of the line says so, of
    elements without faces, such as those of users, only behind a full line.
    """
    element_type = element.option("TYPE")
    needed = node_count(element_type)
    if needed:
        return len([cell for cell in element.cells[1:] if cell]) < needed
    is_full = line.count(",") >= MOST_NUMBERS
    return line.endswith(",") and (is_full or bool(cell_name(element_type)))


def _check_keyword(keyword: Sequence[str], file: Place, at: Place) -> None:
    """Warn of a keyword, or refuse it in its line `at`.

    A warning names the deck `file` and no line, so that equal ones are shown once. Raises
    InputError.
    """
    name = keyword[0].replace(" ", "")
    if name in REFUSED_KEYWORDS:
        raise at.refuse(f"{keyword[0]} is not allowed; {REFUSED_KEYWORDS[name]}")
    if "=" in name:
        raise at.refuse(f"{keyword[0]} is not allowed; a comma is needed before its options")
    if name in WARNINGS_OF_KEYWORDS:
        file.warn(f"{keyword[0]}: {WARNINGS_OF_KEYWORDS[name]}")
    if name not in ("*NODE", "*ELEMENT", "*NSET", "*ELSET"):
        return
    for option in keyword:
        if option.startswith("INPUT"):
            raise at.refuse(f"INPUT of {name} is not read; name the file below *INCLUDE")
        if name == "*NSET" and option.startswith("ELSET"):
            file.warn("ELSET of *NSET is not read: such a set lacks the nodes of the elements")
        if name == "*NODE" and re.match(r"SYSTEM\s*=\s*[^R\s]", option):
            raise at.refuse(f"{option} of *NODE is not allowed; R, along x, y and z, is")


def _deck_table(path: Path, names: Sequence[str]) -> Iterator[Line]:
    """The nodes or the elements of an input file of Abaqus or CalculiX as lines of a table.

    names: the columns that are needed. If the first one is "node", the lines below *NODE are read,
    else those below *ELEMENT. Missing coordinates are 0; elements without faces, such as springs,
    are left out. Raises InputError, also for an element with more nodes than its type has.
    """
    keyword = "*ELEMENT"
    heads = ["element", "type", *map(str, range(MOST_NODES))]  # nodes in the columns 0, 1, ...
    if names[0] == "node":
        keyword = "*NODE"
        heads = ["node", "x", "y", "z"]
    for name in names:
        if name not in heads:
            raise Place(str(path)).refuse(
                f"names nodes, not the {name} of each row; the matrices need labels, such as "
                "those of the file .dof that CalculiX writes beside them, or a .csv file"
            )
    for line in deck_lines(path):
        if line.keyword[0] != keyword:
            continue
        if keyword == "*NODE":
            padded = [*line.cells, "0", "0", "0"]
            cells = [cell or "0" for cell in padded[:4]]
        else:
            element_type = line.option("TYPE")
            kind = cell_name(element_type)
            if not kind:
                continue
            count = len([cell for cell in line.cells[1:] if cell])
            needed = node_count(element_type)
            # cohesive elements with pore pressure, such as COH3D8P, may have nodes in the middle
            if 0 < needed < count and not element_type.startswith("COH"):
                raise line.at.refuse(
                    f"{count} nodes; an element of type {element_type} has {needed}"
                )
            cells = [line.cells[0], kind, *line.cells[1 : 1 + MOST_NODES]]
        yield Line(line.at, dict(zip_longest(heads, cells, fillvalue="")))


def _cells(line: str) -> list[str]:
    """The cells of a line between its commas, without blanks and quotes around them.

    A comma within quotes belongs to the name that they enclose.
    """
    if '"' not in line:
        return [cell.strip() for cell in line.split(",")]
    # an even number of quotes follows a comma that none encloses
    cells = re.split(r',(?=[^"]*(?:"[^"]*"[^"]*)*$)', line)
    return [cell.replace('"', "").strip() for cell in cells]
