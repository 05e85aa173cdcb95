"""Systems whose matrices are lists of terms, rows or files, each with a factor in parameters.

```yaml
name: brake
parameters: {Omega: 12.566, mu: 0.4}     # named numbers
parameter: Omega                         # the one that is swept
M: {file: M.mtx}
C: [{file: D.mtx, factor: 1/Omega}]
K: [{file: K0.mtx}, {file: K1.mtx, factor: mu}]
damping: {rayleigh: [2.0, 1.0e-7]}
coordinates: {file: nodes.csv}
```
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from squeal.errors import InputError, InputWarning
from squeal.io.coordinates import Coordinates, read_coordinates
from squeal.io.document import read_document
from squeal.io.matrices import FORMATS, aligned, read_matrix
from squeal.io.matrix_text import Found
from squeal.linear.dampings import modal, rayleigh, structural, structure_stiffness
from squeal.linear.system import Term, TermSystem, without_supports
from squeal.numerics.formula import ALLOWED, Formula
from squeal.schema.arguments import FILE, takes
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Flag, Kind, Named, Number, Numbers, Row, Square, Text

PARTS = ("M", "C", "K")
OWN = ("parameters", "C", "K", "damping", "coordinates")  # keys that the short form has not
MOST_ROWS = 2000  # of a matrix written into the file
FULL = 0.2  # share of entries above which a matrix from a file is kept dense
FULL_ROWS = 2000

SUFFIXES = ", ".join(suffix for one in FORMATS for suffix in one.suffixes)
TERM = Group(
    {
        "file": Key(f"matrix file beside this one ({SUFFIXES})", Text()),
        "key": Key("which matrix of a .mat, .npz or .op4 file", Text(), default="the only one"),
        "matrix": Key("the rows themselves, instead of a file", Square(most=MOST_ROWS)),
        "symmetric": Key(
            "whether entries on one side of the diagonal stand for the other side too",
            Flag(),
            default="what the file says",
        ),
        "factor": Key(f"what it is multiplied with: {ALLOWED}", Text(), default="1"),
    }
)


@dataclass(frozen=True)
class Part(Kind):
    """A matrix of the system: its rows, a term, or a list of terms, as mappings of `TERM`."""

    def allowed(self) -> str:
        return "rows of numbers, {file: NAME}, or a list of terms {file: NAME, factor: FORMULA}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[dict[str, Any], ...]:
        """The terms, none of them read from its file yet. Raises InputError."""
        if isinstance(value, dict):
            return (self._term(value, at),)
        if not isinstance(value, list) or not value:
            raise at.must_be(value, self.allowed())
        if isinstance(value[0], list):
            return ({"matrix": Square(most=MOST_ROWS).read(value, at)},)
        return tuple(self._term(one, at / str(i)) for i, one in enumerate(value, 1))

    def _term(self, value: Any, at: Place) -> dict[str, Any]:
        if isinstance(value, dict) and isinstance(value.get("factor"), int | float):
            value = value | {"factor": repr(value["factor"])}
        found = TERM.read(value, at)
        if ("file" in found) == ("matrix" in found):
            raise at.refuse("it must hold one of file and matrix")
        for name in ("key", "symmetric"):
            if name in found and "file" not in found:
                raise (at / name).unused(found[name], "a matrix without a file")
        return found

    def schema(self) -> dict[str, Any]:
        one = TERM.schema()
        one["properties"]["factor"]["type"] = ["string", "number"]
        one["oneOf"] = [{"required": ["file"]}, {"required": ["matrix"]}]
        terms = {"type": "array", "items": one, "minItems": 1}
        return {"anyOf": [Square(most=MOST_ROWS).schema(), one, terms]}


NOT_NEGATIVE = Number(low=0.0, low_allowed=True)


@dataclass(frozen=True)
class Ratios(Kind):
    """One damping ratio for all modes, or a list of them for the first ones."""

    def allowed(self) -> str:
        return "a number of at least 0, or a list of them"

    def read(self, value: Any, at: Place, model: str = "") -> float | tuple[float, ...]:
        """The number or the numbers. Raises InputError."""
        if isinstance(value, list):
            if not value:
                raise at.must_be(value, self.allowed())
            return tuple(NOT_NEGATIVE.read(one, at / str(i)) for i, one in enumerate(value, 1))
        return NOT_NEGATIVE.read(value, at)

    def schema(self) -> dict[str, Any]:
        each = NOT_NEGATIVE.schema()
        return {"anyOf": [each, {"type": "array", "items": each, "minItems": 1}]}


DAMPING = Group(
    {
        "rayleigh": Key("alpha and beta: C gains alpha M + beta K", Row(2, NOT_NEGATIVE), "1/s, s"),
        "ratios": Key("damping ratios of the modes without friction", Ratios(), "1"),
        "structural": Key("loss factor eta: K becomes (1 + i eta) K", NOT_NEGATIVE, "1"),
    }
)
SYSTEM = Group(
    {
        "name": Key("what the system is called", Text(), default="the name of the file"),
        "reference": Key("where it is from", Text(), default="empty"),
        "parameters": Key("named numbers", Numbers(), default="none"),
        "parameter": Key("the one that is swept", Named(), default="mu"),
        "M": Key("mass", Part(), required=True),
        "C": Key("damping and gyroscopic forces", Part(), default="none"),
        "K": Key("stiffness, friction included", Part(), required=True),
        "damping": Key(
            "of the structure: M and the symmetric K without friction", DAMPING, default="none"
        ),
        "coordinates": Key(
            "a table with the columns node, dof, x, y, z, a line for each row; for mode shapes",
            Group({"file": Key("a .csv file", Text(), required=True)}, owner="coordinates"),
            default="none",
        ),
    },
    owner="every system",
)


@dataclass(frozen=True, eq=False)
class TermOrigin:
    """Where a matrix came from: the key of its part, its file (empty if in the system file)."""

    part: str
    file: str
    factor: str
    matrix: Any = field(repr=False)


@dataclass(frozen=True, eq=False)
class SystemFile:
    """A system from a file of the general form; `inputs` are the files that were read."""

    system: TermSystem
    reference: str = ""
    origins: tuple[TermOrigin, ...] = field(default=(), repr=False)
    inputs: tuple[Path, ...] = field(default=(), repr=False)
    coordinates: Coordinates | None = None


def is_general(document: dict[str, Any]) -> bool:
    """True if a mapping with M is of the general form and not of the short one."""
    mass = document.get("M")
    rows = isinstance(mass, list) and all(isinstance(row, list) for row in mass)
    return "M" in document and (not rows or any(key in document for key in OWN))


@takes(path=FILE)
def read_system(path: Path | str) -> SystemFile:
    """The system that a file of the general form describes, its matrices read and checked.

    Raises InputError with one sentence that names the file, the key, the value and what is
    allowed.
    """
    path = Path(path)
    return system_file(read_document(path), Place(str(path)), path.parent)


def system_file(document: dict[str, Any], at: Place, folder: Path) -> SystemFile:
    """The system in a mapping of the file's form; matrix files are named relative to `folder`."""
    given = SYSTEM.read(document, at)
    places, matrices = [], []
    seen: dict[Any, Found] = {}
    for part, here, term in _terms(given, at):
        places.append((part, here, term))
        matrices.append(_matrix(term, here, folder, seen))
    _compare_labels(at, [(part, m) for (part, _, _), m in zip(places, matrices, strict=True)])
    try:
        common = aligned(matrices)
    except InputError as error:
        raise at.refuse(str(error)) from None
    first = common[0].shape[0]
    dense = first <= FULL_ROWS and any(m.nnz > FULL * first * first for m in common)
    parts: dict[str, list[Term]] = {part: [] for part in PARTS}
    origins = []
    for (part, here, term), matrix in zip(places, common, strict=True):
        if matrix.shape != (first, first):
            raise here.refuse(
                f"{_named(term)} of {matrix.shape[0]} rows is not allowed; it must have the "
                f"{first} rows of {_named(places[0][2])} in M"
            )
        text = term.get("factor", "1")
        origins.append(TermOrigin(part, term.get("file", ""), text, matrix))
        with_factor = _formula(text, here)
        parts[part].append(Term(matrix.toarray() if dense else matrix, with_factor))
    return _complete(
        given, at, folder, parts, tuple(origins), tuple(dict.fromkeys(path for path, *_ in seen))
    )


def _complete(
    given: dict[str, Any],
    at: Place,
    folder: Path,
    parts: dict[str, list[Term]],
    origins: tuple[TermOrigin, ...],
    inputs: tuple[Path, ...],
) -> SystemFile:
    M, C, K = (tuple(parts[part]) for part in PARTS)
    coordinates = None
    if "coordinates" in given:
        path = folder / given["coordinates"]["file"]
        rows = M[0].matrix.shape[0]
        coordinates, inputs = read_coordinates(path, rows), (*inputs, path)
    try:
        own, parameter = given.get("parameters", {}), given.get("parameter", "mu")
        system = TermSystem(M, C, K, own, parameter, given.get("name") or Path(at.source).stem)
        system, held = without_supports(system)
        if held.size:
            _warn(
                at / "K",
                f"{held.size} rows whose diagonal stands decades above all others are "
                f"taken for supports and left out, the first is row {held[0] + 1}",
            )
            coordinates = coordinates and coordinates.without(held)
        system = _damped(system, given.get("damping", {}), at)
    except InputError as error:
        raise at.refuse(str(error)) from None
    return SystemFile(system, given.get("reference", ""), origins, inputs, coordinates)


def _warn(at: Place, words: str) -> None:
    warnings.warn(f"{at}: {words}", InputWarning, stacklevel=3)


def _compare_labels(at: Place, named: Sequence[tuple[str, Found]]) -> None:
    """Warn of rows (node, dof) that M or K alone have."""
    found = {
        part: {label for p, m in named if p == part for label in m.labels or ()} for part in "MK"
    }
    for part, other in ("MK", "KM"):
        alone = sorted(found[part] - found[other])
        if alone and found[other]:
            node, dof = alone[0]
            _warn(
                at,
                f"{len(alone)} rows stand in {part} and not in {other}, the first is degree "
                f"of freedom {dof} of node {node}; their entries in {other} are taken as zero",
            )


def _damped(system: TermSystem, damping: dict[str, Any], at: Place) -> TermSystem:
    if not damping:
        return system
    varied = [i for i in structure_stiffness(system)[1] if not system.K[i].constant]
    if varied:
        terms = ", ".join(f"K.{i + 1} ({system.K[i].factor.text})" for i in varied)
        _warn(at / "damping", f"also damps {terms}, at the values of the parameters given here")
    if "rayleigh" in damping:
        system = rayleigh(system, *damping["rayleigh"])
    if "ratios" in damping:
        ratios = damping["ratios"]
        system = modal(system, ratios if isinstance(ratios, tuple) else (ratios,) * system.n)
    if "structural" in damping:
        system = structural(system, damping["structural"])
    return system


def _terms(given: dict[str, Any], at: Place) -> Iterator[tuple[str, Place, dict[str, Any]]]:
    for part in PARTS:
        terms: Sequence[dict[str, Any]] = given.get(part, ())
        for i, term in enumerate(terms, 1):
            yield part, at / part / str(i) if len(terms) > 1 else at / part, term


def _named(term: dict[str, Any]) -> str:
    return f"file {term['file']}" if "file" in term else "the matrix"


def _formula(text: str, at: Place) -> Formula:
    place = at / "factor"
    try:
        found = Formula(text, str(place))
    except InputError as error:
        raise place.refuse(str(error)) from None
    if not found.names:
        found.value({})
    return found


def _matrix(term: dict[str, Any], at: Place, folder: Path, seen: dict[Any, Found]) -> Found:
    if "matrix" in term:
        from scipy.sparse import csc_array

        return Found(csc_array(np.array(term["matrix"])))
    path = folder / term["file"]
    asked = path, term.get("key"), term.get("symmetric")
    if asked not in seen:
        try:
            seen[asked] = read_matrix(*asked)
        except InputError as error:
            raise (at / "file").refuse(str(error)) from None
    return seen[asked]
