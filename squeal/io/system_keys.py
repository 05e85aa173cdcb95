"""Every key of a file that describes a system of matrices: `SYSTEM`."""

from collections.abc import Sequence
from typing import Any, TypeAlias

from squeal.io.matrix_formats import FORMATS
from squeal.numerics.differentiation import ALLOWED
from squeal.schema import (
    ANY,
    FLAG,
    NOT_NEGATIVE,
    TEXT,
    Group,
    Key,
    Kind,
    Named,
    Place,
    Several,
    Square,
    Whole,
    row,
)

Document: TypeAlias = dict[str, Any]
"""A mapping of a file's form, or its values as `Group.read` converts them."""

MOST_ROWS = 2000  # of a matrix written into the file
POWER = 9  # highest, of the parameter
SUFFIXES = ", ".join(suffix for one in FORMATS for suffix in one.suffixes)


def _factor_text(value: object) -> object:
    """A formula or a number as text; None for anything else."""
    return TEXT.convert(repr(value) if type(value) in (int, float) else value)


FACTOR = Kind("text or a number", _factor_text)
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
        "which matrix of a file that may hold several (.mat, .npz, .op4, .op2, .pch, .full), in "
        "the case in which it was written", TEXT,
        default="the only one", needs=("file",)),
    "matrix": Key("the rows themselves", Square(most=MOST_ROWS), instead="file"),
    "symmetric": Key(
        "whether entries on one side of the diagonal stand for the other side too",
        FLAG, default="what the file says", needs=("file",)),
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
    "digits": Key(
        "significant digits to which its entries are known, where more are written",
        Whole(1, 15), default="what the file shows"),
    "errors": Key(
        "matrix file of how far each entry may be off, where that is not half a unit of the last "
        "of its digits", TEXT, default="none", needs=("digits",)),
    "rounding": Key(
        "how far rounding may have moved any entry of a matrix that was computed", NOT_NEGATIVE,
        "that of the matrix", default="0"),
    "rayleigh": Key(
        "alpha of a term of M, beta of one of K, in place of those of the whole", NOT_NEGATIVE,
        "1/s, s"),
}, owner="a term")
# fmt: on


class Part(Kind):
    """A matrix of the system: its rows, a term, or a list of terms, as mappings of `TERM`."""

    def read(self, value: object, at: Place, model: str = "") -> object:
        if isinstance(value, dict):
            return (TERM.read(value, at),)
        if isinstance(value, list) and value and isinstance(value[0], list):
            return ({"matrix": Square(most=MOST_ROWS).read(value, at)},)
        return Several(TERM, self.allowed).read(value, at)


PART = Part("rows of numbers, {file: NAME}, or a list of terms {file: NAME, factor: FORMULA}")


class Ratios(Kind):
    """One damping ratio for all modes, a list of them for the first ones, or a table."""

    def read(self, value: object, at: Place, model: str = "") -> object:
        if isinstance(value, dict):
            return CSV.read(value, at)
        if isinstance(value, list):
            return Several(NOT_NEGATIVE, self.allowed).read(value, at)
        return NOT_NEGATIVE.read(value, at)


# fmt: off
POWERS: dict[str, Key] = {}
for _part in "CK":
    for _power in range(POWER + 1):
        POWERS[f"{_part}{_power}"] = Key(
            "what is multiplied with that power of the parameter", Square(), default="0",
            instead=_part)
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
    "assumptions": Key(
        "what was guessed, left out or approximated when it was made, as `export` writes it; "
        "nothing is certified after it", Several(TEXT, "a list of texts"), default="none"),
    "parameters": Key(
        "named numbers", Named(ANY, "a mapping of names to finite numbers"), default="none"),
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


def named_files(keys: Document) -> list[str]:
    """The files that a document names, in the order of its keys, those in mappings included."""
    names: list[str] = []
    for key, value in keys.items():
        if key in ("file", "errors", "residual_flexibility") and isinstance(value, str):
            names.append(value)
        entries: Sequence[object] = [value]
        if isinstance(value, tuple):  # such as terms
            entries = value
        for entry in entries:
            if isinstance(entry, dict):
                names += named_files(entry)
    return names
