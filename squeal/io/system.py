"""Systems of matrices from files: lists of terms with a factor each, or powers of one parameter.

Their keys stand in `SYSTEM`. In place of K there may be K0, K1, ..., rows of numbers: K is then
K0 + K1 mu + K2 mu^2 + ...; C likewise.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import zip_longest
from keyword import iskeyword
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal import schema
from squeal.io.matrices import aligned, all_labels, read_matrix
from squeal.io.matrix_formats import FORMATS, MatrixFile
from squeal.linear.damping import Damped, damped
from squeal.linear.matrices import dense, reduce
from squeal.linear.moduli import FREQUENCY, Modulus, Table, Tabulated
from squeal.linear.system import Term, TermSystem, supported, without_supports
from squeal.numerics.differentiation import ALLOWED, Formula
from squeal.schema import (
    ANY,
    NOT_NEGATIVE,
    TEXT,
    Group,
    Key,
    Kind,
    Place,
    Several,
    Square,
    row,
    scalar,
)

PARTS = ("M", "C", "K")
MOST_ROWS = 2000  # of a matrix written into the file
FULL = 0.2  # share of entries above which a matrix from a file becomes dense
POWER = 9  # highest, of the parameter
SUFFIXES = ", ".join(suffix for one in FORMATS for suffix in one.suffixes)
COLUMNS = ("node", "dof", "x", "y", "z")
DIRECTIONS = {"1": 0, "2": 1, "3": 2, "x": 0, "y": 1, "z": 2}
# rotations, and what has no place in space
DIRECTIONS |= dict.fromkeys(("4", "5", "6", "rx", "ry", "rz", "-"), -1)
FIXED = -2  # of a node that no row moves
DIRECTIONS["fixed"] = FIXED
DOF = schema.Word(tuple(DIRECTIONS))


class Cell(NamedTuple):
    """A kind of element: its corners, its numbers in VTK and UNV files, its types in Abaqus and
    CalculiX up to what follows the number of nodes, corners of its faces."""

    corners: int
    vtk: int
    unv: int
    types: str
    faces: tuple[tuple[int, ...], ...]


_PRISM = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_BRICK = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
CELLS = {
    "triangle": Cell(3, 5, 91, "(S|M3D|R3D|SFM3D)[36]|STRI65", ((0, 1, 2),)),
    "quad": Cell(4, 9, 94, "(S|M3D|R3D|SFM3D)[489]", ((0, 1, 2, 3),)),
    "tetra": Cell(4, 10, 111, "C3D(4|10)", ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))),
    "wedge": Cell(6, 13, 112, "(C3D|COH3D|GK3D|SC)(6|15|18)", _PRISM),
    "hexahedron": Cell(8, 12, 115, "(C3D|COH3D|GK3D|SC)(8|20|27)", _BRICK),
}
CELL = schema.Word(tuple(CELLS))
POINTS = "mode shapes are points; `elements: {file: job.inp}` in the system file gives faces"

FACTOR = Kind("text or a number", lambda v: TEXT.convert(repr(v) if type(v) in (int, float) else v))
CSV = Group({"file": Key("a .csv file", TEXT, required=True)}, owner="a table")
# fmt: off
TABLE = Group({
    "file": Key("a .csv file with a column of the parameter's name, rising", TEXT, required=True),
    "column": Key("which of its columns multiplies the term, such as kxx", TEXT, required=True),
    "over": Key("the parameter", TEXT, default="the one that is swept"),
}, owner="a table")
TERM = Group({
    "file": Key(
        f"matrix file beside this one ({SUFFIXES})", TEXT, required=True, unless="matrix",
        default="refused, unless matrix gives it"),
    "key": Key(
        "which matrix of a file that may hold several (.mat, .npz, .op4, .op2, .pch, .full)", TEXT,
        default="the only one", needs=("file",)),
    "matrix": Key("the rows themselves", Square(most=MOST_ROWS), instead="file"),
    "symmetric": Key(
        "whether entries on one side of the diagonal stand for the other side too",
        schema.FLAG, default="what the file says", needs=("file",)),
    "factor": Key(f"what it is multiplied with: {ALLOWED}", FACTOR, default="1"),
    "structural": Key(
        "loss factor eta of a term of K, in place of that of the whole: 1 + i eta times it",
        Kind("a number of at least 0, or a formula", FACTOR.convert), "1"),
    "modulus": Key(
        "table of storage and loss factors over the frequency, which multiply it too",
        CSV, instead="structural"),
    "table": Key(
        "quantity over a parameter, such as a bearing's stiffness over speed, which multiplies it "
        "too", TABLE, instead="modulus"),
    "rayleigh": Key(
        "alpha of a term of M, beta of one of K, in place of those of the whole", NOT_NEGATIVE,
        "1/s, s"),
}, owner="a term")
# fmt: on


class Part(Kind):
    """A matrix of the system: its rows, a term, or a list of terms, as mappings of `TERM`."""

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        if isinstance(value, dict):
            return (TERM.read(value, at),)
        if isinstance(value, list) and value and isinstance(value[0], list):
            return ({"matrix": Square(most=MOST_ROWS).read(value, at)},)
        return Several(TERM, self.named).read(value, at)


PART = Part("rows of numbers, {file: NAME}, or a list of terms {file: NAME, factor: FORMULA}")


class Ratios(Kind):
    """One damping ratio for all modes, a list of them for the first ones, or a table."""

    def read(self, value: Any, at: Place, model: str = "") -> Any:
        if isinstance(value, dict):
            return CSV.read(value, at)
        each = Several(NOT_NEGATIVE, self.named) if isinstance(value, list) else NOT_NEGATIVE
        return each.read(value, at)


# fmt: off
POWERS = {
    f"{letter}{power}": Key(
        "what is multiplied with that power of the parameter", Square(), default="0",
        instead=letter)
    for letter in "CK" for power in range(POWER + 1)
}
DAMPING = Group({
    "rayleigh": Key("alpha and beta: C gains alpha M + beta K", row(2, NOT_NEGATIVE), "1/s, s"),
    "ratios": Key(
        "damping ratios of the modes without friction",
        Ratios("a number of at least 0, a list of them, or {file: TABLE.csv}"), "1"),
    "structural": Key("loss factor eta: K becomes (1 + i eta) K", NOT_NEGATIVE, "1"),
    "K4": Key("structural damping matrix: K gains i K4, as of Nastran or Abaqus", PART),
})
SYSTEM = Group({
    "name": Key("what the system is called", TEXT, default="the name of the file"),
    "reference": Key("where it is from", TEXT, default="empty"),
    "parameters": Key(
        "named numbers", schema.Named(ANY, "a mapping of names to finite numbers"), default="none"),
    "parameter": Key("the one that is swept", TEXT, default="mu"),
    "M": Key("mass", PART, required=True),
    "C": Key("damping and gyroscopic forces", PART, default="none"),
    "K": Key(
        "stiffness, friction included, or K0, K1 and so on", PART, required=True, unless="K0",
        default="refused, unless K0 is given"),
    **POWERS,
    "damping": Key(
        "of the structure: M and the symmetric K without friction", DAMPING, default="none"),
    "coordinates": Key(
        "a table with the columns node, dof, x, y, z, a line for each row, or node, x, y, z where "
        "the matrices name their rows, or there an input file (.inp) of Abaqus or CalculiX; for "
        "mode shapes and the mass", CSV, default="none"),
    "elements": Key(
        "a table with the columns element, type (triangle, quad, tetra, wedge, hexahedron) and "
        "nodes in the order of VTK, corners first, or an input file (.inp) of Abaqus or CalculiX; "
        "for faces in pictures and files of mode shapes",
        CSV, default="none", needs=("coordinates",)),
}, owner="every system")
# fmt: on


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Node and direction of each row of a system, and the places (m) of the nodes.

    `nodes` (n,) indices into `places` (nodes, 3); `directions` (n,) 0 to 2 for x, y, z, -1 for
    rotations and other degrees of freedom, which move nothing. `names` (nodes,) of the nodes;
    `cells` kind and corners (indices of nodes) of each element. `bases` are the diagonal blocks of
    what gives these rows from those of a reduced system.
    """

    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)
    names: tuple[str, ...] = ()
    cells: tuple[tuple[str, tuple[int, ...]], ...] = field(default=(), repr=False)
    bases: tuple[NDArray[np.float64], ...] = field(default=(), repr=False)

    def without(self, rows: NDArray[np.intp]) -> "Coordinates":
        """The same nodes without some rows of the system."""
        nodes, directions = np.delete(self.nodes, rows), np.delete(self.directions, rows)
        return replace(self, nodes=nodes, directions=directions)

    def followed(self, count: int) -> "Coordinates":
        """The same with so many rows more that move nothing."""
        nodes, directions = np.zeros(count, self.nodes.dtype), np.full(count, -1)
        both = np.concatenate([self.nodes, nodes]), np.concatenate([self.directions, directions])
        return replace(self, nodes=both[0], directions=both[1])

    def displacements(self, shape: NDArray) -> NDArray:
        """Displacements (nodes, 3) of the nodes from a mode shape (n,)."""
        if self.bases:
            parts = np.split(shape, np.cumsum([V.shape[1] for V in self.bases])[:-1])
            shape = np.concatenate([V @ x for V, x in zip(self.bases, parts, strict=True)])
        moved = np.zeros((len(self.places), 3), dtype=np.asarray(shape).dtype)
        moving = self.directions >= 0
        moved[self.nodes[moving], self.directions[moving]] = np.asarray(shape)[moving]
        return moved


def read_table(
    path: Path, names: Sequence[str], more: str = ""
) -> tuple[Place, list[tuple[Place, dict[str, str]]]]:
    """The lines of a .csv file that has some columns, perhaps one `more`, or of the nodes or
    elements of an .inp file. Raises InputError."""
    at = Place(str(path))
    text = _lines_of(path, at)
    is_input_file = path.suffix.lower() == ".inp"
    if is_input_file:
        text = list(_with_included(path, text, at, (path.resolve(),)))
    table = csv.reader(text)
    rows = ((table.line_num, cells) for cells in table)
    try:
        lines = _input_file(text, at, names[0]) if is_input_file else rows
        (_, head), *rest = [one for one in lines if "".join(one[1]).strip()] or [(1, [])]
    except csv.Error as error:
        raise at.refuse(f"no table of comma-separated values: {error}") from None
    heads = [name.strip().lower() for name in head]
    if missing := [name for name in names if name not in heads]:
        named = ", ".join(names) + (f" and {more}" if more else "")
        words = f"no column {missing[0]}; the first line of a .csv file must name, with commas,"
        raise at.refuse(f"{words} {named}")
    known = []
    for number, cells in rest:
        here = at / f"line {number}"
        if any(cell.strip() for cell in cells[len(heads) :]):
            raise here.refuse(f"{len(cells)} cells; the first line names {len(heads)} columns")
        known.append((here, dict(zip_longest(heads, cells[: len(heads)], fillvalue=""))))
    return at, known


def _lines_of(path: Path, at: Place) -> list[str]:
    return schema.read_content(path, at).decode("utf-8-sig", "backslashreplace").splitlines()


def _with_included(
    path: Path, text: Sequence[str], at: Place, opened: tuple[Path, ...]
) -> Iterator[str]:
    """The lines of an input file with those of the files that *INCLUDE names in their places.

    `opened` are the files that include this one. Raises InputError.
    """
    for number, line in enumerate(text, 1):
        name = re.match(r"\s*\*INCLUDE\s*,\s*INPUT\s*=\s*\"?([^\",]+)", line, re.IGNORECASE)
        if not name:
            yield line
            continue
        included = path.parent / name[1].strip()
        if included.resolve() in opened:
            raise (at / f"line {number}").refuse(f"{included.name} includes itself")
        here = Place(str(included))
        inside = _lines_of(included, here)
        yield from _with_included(included, inside, here, (*opened, included.resolve()))


def _input_file(text: list[str], at: Place, wanted: str) -> Iterator[tuple[int, list[str]]]:
    """The head of a table and the lines below *NODE or *ELEMENT of an input file of Abaqus or
    CalculiX. Elements without faces, such as springs, are left out. Raises InputError."""
    below, kind, begun = False, "", ""
    yield (
        0,
        ["node", "x", "y", "z"] if wanted == "node" else ["element", "type", *map(str, range(8))],
    )
    for number, line in enumerate(text, 1):
        line = line.upper() if line.startswith("*") else begun + line
        cells = [cell.strip() for cell in line.split(",")]
        if line.startswith("*") and not line.startswith("**"):
            if cells[0] in ("*INSTANCE", "*SYSTEM") or any(c.startswith("SYSTEM") for c in cells):
                words = f"{cells[0]} is not allowed; write the file without parts and local axes"
                raise (at / f"line {number}").refuse(words)
            below, begun = cells[0] == f"*{wanted.upper()}", ""
            typed = "".join(c.split("=")[-1].strip() for c in cells if c.startswith("TYPE"))
            fit = (k for k, c in CELLS.items() if re.fullmatch(f"({c.types})[A-Z]*5?", typed))
            kind = next(fit, "")
        elif below and line.strip() and line[0] != "*":
            if wanted == "node":
                yield number, [cell or "0" for cell in [*cells, "0", "0", "0"][:4]]
            elif kind and cells[-1]:
                yield number, [cells[0], kind, *cells[1:9]]
            begun = line if wanted != "node" and not cells[-1] else ""  # goes on in the next one


def number_in(text: str, at: Place, kind: Kind = ANY) -> float:
    """The number in a cell of a table. Raises InputError."""
    try:
        number = float(text)
    except ValueError:
        raise at.must_be(text, kind.named) from None
    return float(kind.read(number, at))


def _read_numbers(path: Path, names: Sequence[str], more: str = "") -> list[list[float]]:
    """Columns of numbers, the first of rising frequencies, the others of at least 0; of zeros for
    the one `more` if it is missing. Raises InputError."""
    at, lines = read_table(path, names, more)
    rows: list[list[float]] = []
    for here, line in lines:
        cells = [number_in(line[name], here / name, NOT_NEGATIVE) for name in names]
        if more:
            cells.append(number_in(line.get(more) or "0", here / more, NOT_NEGATIVE))
        if rows and cells[0] <= rows[-1][0]:
            raise here.refuse(f"frequency {cells[0]:g} is not allowed; frequencies must rise")
        rows.append(cells)
    if len(rows) < 2:
        raise at.refuse(f"{len(rows)} lines of numbers; 2 or more are needed")
    return [list(column) for column in zip(*rows, strict=True)]


def _read_coordinates(path: Path, rows: int, labels: Sequence[tuple[int, int]] = ()) -> Coordinates:
    """The table of a .csv file with the columns node, dof, x, y, z, one line a row of the system.

    dof is 1 to 3 or x, y, z for displacements, 4 to 6 or rx, ry, rz for rotations, - for what does
    not move a node in space; a line with fixed, which is none of a row, gives a node that nothing
    moves its place. Where matrices have `labels`, these name the rows: a line for each node
    suffices, in any order, and internal nodes, below zero, need none; a node without a line has no
    part in mode shapes, which is warned of. Raises InputError.
    """
    at, lines = read_table(path, [name for name in COLUMNS if name != "dof" or not labels])
    names, directions, places = [], [], []
    for here, line in lines:
        if not labels:
            directions.append(DIRECTIONS[DOF.read(line["dof"].strip().lower(), here / "dof")])
        names.append(line["node"].strip())
        if not names[-1]:
            raise (here / "node").must_be("", "the name of a node")
        places.append([number_in(line[name], here / name) for name in "xyz"])
    each, first, nodes = np.unique(names, return_index=True, return_inverse=True)
    if labels:
        index = {name: i for i, name in enumerate(each.tolist())}
        named = {node for node, _ in labels if node > 0}
        missing = sorted(node for node in named if str(node) not in index)
        if missing:
            words = f"no line for {len(missing)} nodes of the matrices, the first is {missing[0]}"
            if len(missing) == len(named):
                raise at.refuse(words)
            at.warn(f"{words}; they have no place in mode shapes")
        nodes = np.array([index.get(str(node), 0) for node, _ in labels])
        directions = [
            way - 1 if str(node) in index and 1 <= way <= 3 else -1 for node, way in labels
        ]
    moves = np.array(directions)
    if len(moved := np.flatnonzero(moves > FIXED)) != rows:
        raise at.refuse(f"{len(moved)} lines; the system's {rows} rows need one each")
    own = np.array(places)[first], tuple(each.tolist())
    return Coordinates(nodes[moved], moves[moved], *own)


def _read_elements(path: Path, where: Coordinates) -> Coordinates:
    """The same with the elements of a .csv file: element, type, and nodes of which the corners
    count. Raises InputError."""
    _, lines = read_table(path, ("element", "type"))
    index, cells = {name: k for k, name in enumerate(where.names)}, dict[str, Any]()
    for here, line in lines:
        own = line.pop("element").strip()
        kind = CELL.read(line.pop("type").strip().lower(), here / "type")
        corners = [name.strip() for name in line.values()][: CELLS[kind].corners]
        if missing := [name for name in corners if name not in index]:
            allowed = "a node with a line in the table of coordinates"
            raise here.must_be(missing[0], allowed)
        if len({*corners}) < CELLS[kind].corners or not own or own in cells:
            words = f"an element named once and {CELLS[kind].corners} different nodes are needed"
            raise here.refuse(words)
        cells[own] = kind, tuple(index[name] for name in corners)
    return replace(where, cells=tuple(cells.values()))


class Origin(NamedTuple):
    """Where a matrix came from: the key of its part, its file (empty if in the system file), the
    format that was read, whether it names its rows, its key in a file of several, and the digits
    that it was rounded to."""

    part: str
    file: str
    factor: str
    matrix: Any
    form: str
    labelled: bool
    key: str
    digits: int | None = None


@dataclass(frozen=True, eq=False)
class SystemFile:
    """A system from a file; `inputs` are the other files that were read, `damped` says what has
    damping that is not given as a matrix, `assembly` is what components were joined to, `labels`
    are the (node, degree of freedom) of the rows where matrices name them. `assumptions` say what
    was guessed, left out or united: nothing is certified after it."""

    system: TermSystem
    reference: str = ""
    origins: tuple[Origin, ...] = field(default=(), repr=False)
    inputs: tuple[Path, ...] = field(default=(), repr=False)
    coordinates: Coordinates | None = None
    damped: tuple[Damped, ...] = ()
    assembly: Any = field(default=None, repr=False)
    labels: tuple[tuple[int, int], ...] = field(default=(), repr=False)
    assumptions: tuple[str, ...] = ()


def matrices_file(document: dict[str, Any], at: Place, folder: Path) -> SystemFile:
    """The system in a mapping of a file's form; matrix files are named relative to `folder`.

    Raises InputError.
    """
    given = SYSTEM.read(document, at)
    parameter, terms = _terms(given, at)
    read: dict[Any, MatrixFile] = {}  # by file, key and symmetry, since terms may share one
    opened: dict[Path, Any] = {}  # files that hold several
    matrices = []
    for part, here, term in terms:
        if "matrix" in term:
            matrices.append(MatrixFile(csc_array(np.array(term["matrix"]))))
            continue
        wanted = folder / term["file"], term.get("key"), term.get("symmetric")
        if wanted not in read:
            with (here / "file").named():
                read[wanted] = read_matrix(*wanted, opened)
        if part in ("M", "K4") and np.iscomplexobj(read[wanted].matrix):
            words = "is complex and not allowed; M and K4 must be real, K and C may be complex"
            raise (here / "file").refuse(f"{term['file']} {words}")
        matrices.append(read[wanted])
    assumptions = [words for one in matrices for words in one.assumptions]
    assumptions += _compare_labels(at, [part for part, *_ in terms], matrices)
    with at.named():
        common = aligned(matrices)
    rows = common[0].shape[0]
    full = any("matrix" in term for *_, term in terms)
    full = rows <= MOST_ROWS and (full or any(m.nnz > FULL * rows * rows for m in common))
    parts: dict[str, list[Term]] = {part: [] for part in PARTS}
    origins, own, inputs = [], _Own(), list(dict.fromkeys(path for path, *_ in read))
    for (part, here, term), matrix, known in zip(terms, common, matrices, strict=True):
        if matrix.shape[0] != rows:
            name = f"file {term['file']}" if "file" in term else "the matrix"
            raise here.refuse(
                f"{name} of {matrix.shape[0]} rows is not allowed; it must have the {rows} of M"
            )
        with (here / "factor").named():
            formula = Formula(term.get("factor", "1"), str(here / "factor"))
        if not formula.names:
            formula.value({})  # may be none
        matrix = matrix.toarray() if full else matrix
        if "table" in term:
            factor: Formula | Modulus | Tabulated = _tabulated(
                part, term, formula, here, folder, parameter
            )
        else:
            factor = _modulus(part, term, formula, here, folder)
        source, how = (part, term.get("file", ""), factor.text), (known.form, bool(known.labels))
        origins.append(Origin(*source, csc_array(matrix), *how, term.get("key", ""), known.digits))
        own.add(part, term, len(parts[part[0]]), matrix, formula, known.digits)
        parts[part[0]].append(Term(matrix, factor, known.digits))
        for key in ("modulus", "table"):
            if key in term:
                inputs.append(folder / term[key]["file"])
    parts["C"] += own.terms
    coordinates, labels = None, all_labels(matrices)
    if "coordinates" in given:
        inputs.append(folder / given["coordinates"]["file"])
        coordinates = _read_coordinates(inputs[-1], rows, labels)
        if "elements" in given:
            inputs.append(folder / given["elements"]["file"])
            coordinates = _read_elements(inputs[-1], coordinates)
    with at.named():
        M, C, K = (tuple(parts[part]) for part in PARTS)
        name = given.get("name") or Path(at.source).stem
        system = TermSystem(M, C, K, given.get("parameters", {}), parameter, name)
        if not POWERS.keys().isdisjoint(given):
            mass = dense(system.at()[0])
            reduce(mass, None, np.zeros_like(mass))
        system, supports = without_supports(system)
        if supports.size:
            (at / "K").warn(supported(supports))
            coordinates = coordinates and coordinates.without(supports)
            held = set(supports.tolist())
            labels = [label for row, label in enumerate(labels) if row not in held]
        damping = {k: v for k, v in given.get("damping", {}).items() if k != "K4"}
        if isinstance(table := damping.get("ratios"), dict):
            inputs.append(folder / table["file"])
            columns = _read_numbers(inputs[-1], ("frequency", "ratio"))
            damping["ratios"] = partial(
                np.interp, xp=columns[0], fp=columns[1], left=np.nan, right=np.nan
            )
        rows, (system, done) = system.n, damped(system, **damping, own=own.named)
        varied = {
            one.of: system.K[int(one.of[2:]) - 1].factor for one in done if one.of[:2] == "K."
        }
        if any(factor.names for factor in varied.values()):
            of = ", ".join(f"{k} ({factor.text})" for k, factor in varied.items() if factor.names)
            words = f"also damps {of}, at the values of the parameters given here"
            (at / "damping").warn(words)
        coordinates = coordinates and coordinates.followed(system.n - rows)
    reference = given.get("reference", "")
    inputs, done = list(dict.fromkeys(inputs)), (*own.done, *done)
    origin = reference, tuple(origins), tuple(inputs)
    return SystemFile(
        system,
        *origin,
        coordinates,
        done,
        labels=tuple(labels),
        assumptions=tuple(dict.fromkeys([*assumptions, *system.assumptions])),
    )


class _Own:
    """The damping that terms name: terms of C, which terms of M and K have one, what is damped."""

    def __init__(self) -> None:
        self.terms: list[Term] = []
        self.named: dict[str, set[int]] = {"M": set(), "rayleigh": set(), "structural": set()}
        self.done: list[Damped] = []

    def add(
        self,
        part: str,
        term: dict[str, Any],
        index: int,
        matrix: Any,
        factor: Formula,
        digits: int | None,
    ) -> None:
        """Take what a term of M or K names, of which it is the one at `index`."""
        by = {name: term[name] for name in ("rayleigh", "structural", "modulus") if name in term}
        if part == "K4":
            self.named["structural"].add(index)
            self.done.append(Damped("K", "K4", factor.text))
        for name, value in by.items():
            key = "structural" if name == "modulus" else "M" if part == "M" else name
            self.named[key].add(index)
            value = value["file"] if name == "modulus" else scalar(str(value))
            self.done.append(Damped(f"{part}.{index + 1}", name, value))
            if name == "rayleigh":
                matrix = matrix.real if np.iscomplexobj(matrix) else matrix
                self.terms.append(
                    Term(matrix, Formula(f"{value!r} * ({factor.text})", factor.place), digits)
                )


def _modulus(
    part: str, term: dict[str, Any], factor: Formula, at: Place, folder: Path
) -> Formula | Modulus:
    """The factor of a term with its loss factor or table. Raises InputError."""
    for key, allowed in {"rayleigh": "MK", "structural": "K", "modulus": "CK"}.items():
        if key in term and part not in allowed:
            words = f"is not allowed at a term of {part}; terms of {' and '.join(allowed)} take it"
            raise (at / key).refuse(words)
    if part == "K4":
        return Modulus(factor, imaginary=True)
    if "modulus" in term:
        source = folder / term["modulus"]["file"]
        columns = _read_numbers(source, ("frequency", "storage"), "loss")
        if part == "C" and any(columns[2]):
            raise (at / "modulus").refuse(
                f"{source.name} has losses; at a term of C none are allowed"
            )
        return Modulus(factor, table=Table(str(source), *columns))
    if "structural" not in term:
        return factor
    with (at / "structural").named():
        loss = Formula(term["structural"], str(at / "structural"))
    if not loss.names:
        NOT_NEGATIVE.read(loss.value({}), at / "structural")
    return Modulus(factor, loss)


def _tabulated(
    part: str, term: dict[str, Any], factor: Formula, at: Place, folder: Path, parameter: str
) -> Tabulated:
    """The factor of a term with its table over a parameter. Raises InputError."""
    here = at / "table"
    if part not in ("C", "K"):
        raise here.refuse(f"is not allowed at a term of {part}; terms of C and K take it")
    for key in ("rayleigh", "structural"):
        if key in term:
            raise (at / key).refuse("is not allowed beside table")
    over = term["table"].get("over", parameter)
    if over in FREQUENCY:
        raise here.refuse(f"over {over} is not allowed; the key modulus takes tables over it")
    column = term["table"]["column"].strip().lower()
    source = folder / term["table"]["file"]
    _, lines = read_table(source, (over.lower(), column))
    places = list[float]()
    quantities = list[float]()
    for line_at, line in lines:
        place = number_in(line[over.lower()], line_at / over)
        if places and place <= places[-1]:
            raise line_at.refuse(f"{over} {place:g} is not allowed; it must rise")
        places.append(place)
        quantities.append(number_in(line[column], line_at / column))
    if len(places) < 2:
        raise here.refuse(f"{source.name}: {len(places)} lines of numbers; 2 or more are needed")
    return Tabulated(factor, over, str(source), column, tuple(places), tuple(quantities))


def _terms(given: dict[str, Any], at: Place) -> tuple[str, list[tuple[str, Place, dict[str, Any]]]]:
    """The name of the parameter; the part, the place and the values of each term."""
    parameter: str = given.get("parameter") or "mu"
    if POWERS.keys().isdisjoint(given):
        schema.NAME.read(parameter, at / "parameter")
    elif not parameter.isidentifier() or iskeyword(parameter):
        parameter = "p"  # in formulas a parameter is a word
    terms = []
    for part in PARTS:
        each = given.get(part, ())
        for i, term in enumerate(each, 1):
            terms.append((part, at / part / str(i) if len(each) > 1 else at / part, term))
        for power, name in enumerate(name for name in POWERS if name[0] == part):
            if name in given:
                factor = f"{parameter}**{power}" if power else "1"
                terms.append((part, at / name, {"matrix": given[name], "factor": factor}))
    each = given.get("damping", {}).get("K4", ())
    for i, term in enumerate(each, 1):
        here = at / "damping" / "K4"
        terms.append(("K4", here / str(i) if len(each) > 1 else here, term))
    return parameter, terms


def _compare_labels(at: Place, parts: Sequence[str], matrices: Sequence[MatrixFile]) -> list[str]:
    """Warn of rows (node, dof) that M or K alone have, or C besides, and say what is assumed of
    those of M without K; internal nodes, below zero, have no mass."""
    assumed = []
    labels = {part: set[tuple[int, int]]() for part in PARTS}
    for part, matrix in zip(parts, matrices, strict=True):
        labels[part[0]].update(matrix.labels or ())
    for part, other in ("MK", "KM", "CK"):
        alone = sorted(one for one in labels[part] - labels[other] if one[0] >= 0)
        if alone and labels[other]:
            node, dof = alone[0]
            at.warn(
                f"{len(alone)} rows stand in {part} and not in {other}, the first is degree "
                f"of freedom {dof} of node {node}; their entries in {other} are taken as zero"
            )
            if part == "M":
                assumed.append(f"{len(alone)} rows of M stand not in K, which is taken as zero")
    return assumed
