"""Formats of matrix files, recognised by their content or else by their suffix: `FORMATS`.

To add a format: a function that returns `MatrixFile` and a line of `FORMATS`, which is where
refusals, documentation and `squeal` itself find it; its round trip goes to
tests/io/test_matrices.py. Matrix Market is read here and not by SciPy, which takes 2.0D+01 for 2
and may crash on a line that was cut off.
"""

import io
import itertools
import math
import os
import pickle
import re
import subprocess
import sys
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from squeal.errors import InputError
from squeal.io.digits import written_digits
from squeal.schema import Place

HEAD = 4096  # bytes that a format is recognised by
MOST_ROWS = 5_000_000  # of a file: empty rows cost memory and no byte of the file
MOST_FULL = 10_000_000  # numbers of full arrays, for each 1e6 bytes of a file
FULL_MEMORY = 800_000_000  # bytes to read a .full, for each 1e6 of its own
SYMMETRIES = ("general", "symmetric", "skew-symmetric")
MATRIX, COMPRESSED = 14, 15  # data elements of MATLAB's version 5
STRUCT, SPARSE = 2, 5  # classes of its arrays
NESTED = 8  # structs within structs that are looked into
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# Ansys' names of degrees of freedom, with the numbers of the other programs
FREEDOMS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6, "PRES": 8, "TEMP": 11}
DMIG_FORMS = {"1": "square", "2": "rectangular", "6": "symmetric", "9": "rectangular"}
OTHER_FREEDOMS = 100  # numbers above are of other names


@dataclass(frozen=True, eq=False)
class MatrixFile:
    """A matrix as it stands in a file.

    `labels` are the (node, degree of freedom) of its rows, if they are named so; `open_ended` is
    true if the file does not say how many rows there are (the last may be empty). `symmetric` says
    whether entries on one side of the diagonal stand for those on the other too, None if the file
    does not say. `form` names the format that the file was read as. `numbered` is true if some
    labels only number rows, so that the file goes with files of the same labels alone. `digits` are
    the significant digits that its entries were rounded to, None if they are exact or doubles.
    `assumptions` say what was guessed of it.
    """

    matrix: Any = field(repr=False)
    labels: tuple[tuple[int, int], ...] | None = field(default=None, repr=False)
    open_ended: bool = False
    symmetric: bool | None = False
    form: str = ""
    numbered: bool = False
    digits: int | None = None
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True)
class UnbuiltMatrix:
    """A matrix of a file of several, built only when it is picked; `form` says what it is."""

    form: str
    build: Callable[[], MatrixFile]


def _numbers(lines: Any, places: int, values: int) -> tuple[NDArray, NDArray]:
    """The whole numbers (lines, places) and the numbers (lines, values) behind them, of each line.

    Raises ValueError.
    """
    fields = ("places", np.int64, (places,)), ("values", np.float64, (values,))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of no data
        try:
            table = np.loadtxt(lines, [one for one in fields if one[2] != (0,)], comments=None)
        except ValueError as error:
            words = str(error).partition(";")[0].replace("the dtype passed requires ", "")
            raise ValueError(words.replace("int64", "whole numbers")) from None
    table = np.atleast_1d(table)
    where, entries = (
        table[name] if n[0] else np.empty((len(table), 0), kind) for name, kind, n in fields
    )
    return where, entries


def _assembled(
    path: Path, indices: NDArray, values: NDArray, shape: tuple[int, int]
) -> tuple[Any, tuple[str, ...]]:
    """The matrix of entries at (row, column) `indices` (2, entries), and what was assumed of it:
    those that meet are summed."""
    if max(shape) > MOST_ROWS:
        raise ValueError(f"{max(shape):.6g} rows; at most {MOST_ROWS} are read")
    matrix = coo_array((values, tuple(indices)), shape=shape).tocsc()
    count_summed = len(values) - matrix.nnz
    if count_summed:
        places, count = np.unique(indices, axis=1, return_counts=True)
        row, column = places[:, np.argmax(count > 1)] + 1
        words = f"{count_summed} entries stand where another one stands, the first "
        Place(str(path)).warn(f"{words}at row {row}, column {column}; they are summed")
    summed = f"{path.name}: {count_summed} entries of one place are summed"
    return matrix, (summed,) * bool(count_summed)


def is_half(matrix: Any) -> bool:
    """True if no entry has another one on the other side of the diagonal, in whatever order."""
    rows, columns = matrix.tocoo().coords
    if np.all(rows >= columns) or np.all(rows <= columns):
        return True
    off = rows != columns
    places = np.sort([rows[off], columns[off]], axis=0).astype(np.int64)
    places = np.sort(places[0] * matrix.shape[0] + places[1])  # np.unique takes 20 times as long
    return bool(np.all(np.diff(places)))


def mirrored(matrix: Any, sign: int = 1) -> Any:
    """Half a matrix with its mirror image added, the diagonal taken once. Raises ValueError."""
    if not is_half(matrix):
        words = "symmetric" if sign > 0 else "skew-symmetric"
        raise ValueError(f"a {words} file holds one triangle, and this has entries on both sides")
    entries = matrix.tocoo()
    (rows, columns), data = entries.coords, entries.data
    off = rows != columns
    where = np.append(rows, columns[off]), np.append(columns, rows[off])
    return coo_array((np.append(data, sign * data[off]), where), shape=matrix.shape).tocsc()


def _with_both_triangles(matrix: csc_array, sign: int) -> csc_array:
    """A matrix of a symmetric (1) or skew-symmetric (-1) Harwell-Boeing file, with both triangles.

    The format asks for one triangle; some programs write both, which must then agree to the last
    digit. Raises ValueError.
    """
    if is_half(matrix):
        return csc_array(mirrored(matrix, sign))
    if abs(matrix - sign * matrix.T).max() > 0.0:
        words = "symmetric" if sign > 0 else "skew-symmetric"
        raise ValueError(f"a {words} file holds both triangles, and they differ")
    return matrix


def _read_matrix_market(path: Path) -> MatrixFile:
    """Coordinate or array, general, symmetric or skew-symmetric."""
    with path.open(encoding="utf-8") as stream:
        _, kind, form, entry, symmetry, *_ = [*stream.readline().lower().split(), *[""] * 5]
        if kind != "matrix" or form not in ("coordinate", "array") or symmetry not in SYMMETRIES:
            words = f"matrix, coordinate or array, {', '.join(SYMMETRIES)} are read"
            raise ValueError(f"{kind} {form} {symmetry}: {words}")
        size = next((line for line in stream if line.strip() and line.lstrip()[0] != "%"), "")
        placed, width = form == "coordinate", {"pattern": 0, "complex": 2}.get(entry, 1)
        body = (line for line in stream if line.lstrip()[:1] != "%")
        where, parts = _numbers(body, 2 * placed, width)
    digits = written_digits(_market_words(path, 2 * placed, width))
    general, skew = symmetry == "general", symmetry[:4] == "skew"
    numbers = [int(word) for word in size.split()]
    if len(numbers) != 2 + placed:
        raise ValueError(f"the line of sizes, {size.strip()}, must hold {2 + placed} numbers")
    n = (numbers[0], numbers[1])
    count = math.prod(n) if general else n[0] * (n[0] + 1 - 2 * skew) // 2
    count = numbers[2] if placed else count
    if len(parts) != count:
        raise ValueError(f"{len(parts)} entries; {count} are required")
    if entry == "integer" and np.any(parts != np.round(parts)):
        raise ValueError("entries must be whole numbers, as the first line says")
    if placed:
        if where.min(initial=1) < 1:
            raise ValueError("rows and columns must count from 1")
        where = where.T - 1
    elif general:
        where = np.array(np.unravel_index(np.arange(count), n, order="F"))
    else:
        where = np.array(np.triu_indices(n[0], int(skew)))[::-1]
    values = np.ones(count) if entry == "pattern" else parts[:, 0]
    if entry == "complex":
        values = values + 1j * parts[:, 1]
    matrix, assumed = _assembled(path, where, values, n)
    if skew and np.any(matrix.diagonal()):
        raise ValueError("a skew-symmetric file has no diagonal, and this has")
    matrix = matrix if general else mirrored(matrix, -1 if skew else 1)
    return MatrixFile(matrix, digits=digits, assumptions=assumed)


def _market_words(path: Path, places: int, values: int) -> Iterator[str]:
    """The numbers behind the places of each line, as they are written."""
    with path.open(encoding="utf-8") as stream:
        lines = (line for line in stream if line.strip() and line.lstrip()[0] != "%")
        next(lines, None)  # the sizes
        for line in lines:
            yield from line.split()[places : places + values]


def _read_abaqus(path: Path) -> MatrixFile | dict[str, MatrixFile]:
    """Lines `row, column, value` or `node, dof, node, dof, value`, by commas or blanks.

    Internal nodes, such as those of Lagrange multipliers, have labels below zero. A line that
    begins with * may say TYPE=SYMMETRIC or UNSYMMETRIC; each *MATRIX INPUT begins a matrix.
    """
    text = path.read_text(encoding="utf-8").replace(",", " ")
    for mark in "#%":
        if mark in text:
            raise ValueError(f"{mark} is not what Abaqus writes; comments begin with **")
    blocks = [["", "", ""]]  # name, what is said of it, entries
    for part in re.split(r"(?m)^[ \t]*(\*.*)$", text) if "*" in text else [text]:
        if part.startswith("*"):
            if re.match(r"\*\s*MATRIX\s*INPUT", part, re.IGNORECASE):
                name = re.search(r"NAME\s*=\s*(\S+)", part, re.IGNORECASE)
                blocks.append([name[1] if name else "", "", ""])
            elif not part.startswith("**"):
                raise ValueError(f"the keyword {part.strip()} is not allowed; *MATRIX INPUT is")
            blocks[-1][1] += f" {part.upper()} "
        else:
            blocks[-1][2] += part
    blocks = [block for block in blocks if block[2].strip()]
    found = {name: _abaqus_matrix(path, *rest) for name, *rest in blocks}
    if len(found) < len(blocks) or not found:
        raise ValueError("two matrices of one name" if blocks else "no entries")
    return next(iter(found.values())) if len(found) == 1 else found


def _abaqus_matrix(path: Path, head: str, text: str) -> MatrixFile:
    """A matrix from its entries and what is said of it."""
    width = len(next(line for line in io.StringIO(text) if line.strip()).split())
    if width not in (3, 5):
        raise ValueError(f"{width} columns; 3 or 5 are read, decimals behind a point")
    given, values = _numbers(io.StringIO(text), width - 1, 1)
    kind = re.search(r"TYPE\s*=\s*(UN)?SYMMETRIC", head)
    scale = re.search(r"SCALE\s*FACTOR\s*=\s*(\S+)", head)
    entries = float(scale[1]) * values[:, 0] if scale else values[:, 0]
    digits = written_digits(line.split()[-1] for line in io.StringIO(text) if line.strip())
    if digits is not None and scale:
        digits -= 1  # a product may lose up to one
    symmetric = kind[1] is None if kind else None
    if width == 5:
        return replace(_labelled(path, given, entries, symmetric), digits=digits)
    if given.min() < 1:
        raise ValueError("rows and columns must count from 1")
    n = int(given.max())
    labels = _labels(path.with_suffix(".dof"), n)
    n = len(labels) if labels else n
    matrix, assumed = _assembled(path, given.T - 1, entries, (n, n))
    numbered = any(node < 0 for node, _ in labels or ())
    return MatrixFile(
        matrix,
        labels,
        labels is None,
        symmetric,
        numbered=numbered,
        digits=digits,
        assumptions=assumed,
    )


def _labelled(path: Path, given: NDArray, values: NDArray, symmetric: bool | None) -> MatrixFile:
    """The matrix of entries at (entries, 4) nodes and degrees of freedom of rows and columns."""
    if not len(given):
        raise ValueError("no entries")
    nodes, directions = given[:, ::2], given[:, 1::2]
    if directions.min() < 0:
        raise ValueError("degrees of freedom must be at least 0")
    base = int(directions.max()) + 1
    each = (nodes * base + directions).T
    codes = np.sort(each, axis=None)  # np.unique hashes, which takes twice as long
    codes = codes[np.diff(codes, prepend=codes[0] - 1) > 0]
    labels = tuple(divmod(code, base) for code in codes.tolist())
    n = len(labels)
    matrix, assumed = _assembled(path, np.searchsorted(codes, each), values, (n, n))
    return MatrixFile(matrix, labels, symmetric=symmetric, assumptions=assumed)


def _fixed(lines: list[str], form: str, count: int) -> tuple[NDArray, list[str]]:
    """Numbers (count,) in fields of a Fortran format such as (1P,3D24.16), and the lines behind."""
    fields, rest = _fields(lines, form, count)
    return np.array(fields, np.int64 if "I" in form.upper() else float), rest


def _fields(lines: list[str], form: str, count: int) -> tuple[list[str], list[str]]:
    """The fields of a Fortran format as they are written, and the lines behind."""
    found = re.search(r"(\d*)[IEDFG](\d{1,2})", form.upper())
    if not found:
        raise ValueError(f"the format {form.strip()} is not read; (8I10) and (3D24.16) are")
    each, width = max(1, min(int(found[1] or 1), count)), int(found[2])
    used = -(-count // each)
    if not 0 < used <= len(lines) or count > sum(map(len, lines[:used])):
        raise ValueError(f"fewer numbers than the {count} of the header")
    fields = " ".join(lines[:used]).upper().replace("D", "E").split()
    if len(fields) != count:  # they touch each other
        text = "".join(line[: each * width].ljust(each * width) for line in lines[:used])
        text = text.upper().replace("D", "E")
        fields = [text[k : k + width].strip() for k in range(0, count * width, width)]
        if not all(fields):
            raise ValueError(f"fewer numbers than the {count} of the header")
    return fields, lines[used:]


def _read_harwell_boeing(path: Path) -> MatrixFile:
    """Real or complex, assembled, as Ansys' HBMAT writes them too; no right-hand sides.

    A file .mapping beside it, which HBMAT writes, names the rows.
    """
    lines = path.read_text(encoding="ascii").splitlines()
    if len(lines) < 5 or len(lines[2].split()) < 4:
        raise ValueError("the header is missing")
    kind, *sizes = lines[2].upper().split()
    if not re.fullmatch("[RIC][USZ]A", kind):
        raise ValueError(f"type {kind}; real or complex (R, C), U, S or Z, assembled (A) are read")
    rows, columns, count = map(int, sizes[:3])
    sides, forms = int((lines[1].split() + [*"00000"])[4]), lines[3]
    rest = lines[4 + (sides > 0) :]
    pointers, rest = _fixed(rest, forms, columns + 1)
    indices, rest = _fixed(rest, forms[16:], count)
    words, _ = _fields(rest, forms[32:], count * (1 + (kind[0] == "C")))
    values = np.array(words, float)
    if kind[0] == "C":
        values = values.view(complex)
    matrix = csc_array((values, indices - 1, pointers - 1), shape=(rows, columns))
    sound(matrix)
    if kind[1] != "U":
        matrix = _with_both_triangles(matrix, 1 if kind[1] == "S" else -1)
    labels = _labels(path.with_suffix(".mapping"), rows)
    numbered = any(node < 0 for node, _ in labels or ())
    return MatrixFile(matrix, labels, numbered=numbered, digits=written_digits(words))


def _labels(path: Path, rows: int) -> tuple[tuple[int, int], ...] | None:
    """The (node, degree of freedom) of each row, from lines `node.dof` of CalculiX or `row node
    name` of Ansys; None without such a file.

    CalculiX expands shells and beams to solids and gives several rows the label of one node. Those
    rows become internal, with the negative of the row's number for a node.
    """
    if not path.is_file():
        return None
    text = path.read_text(encoding="ascii").upper()
    found = re.findall(r"(?m)^\s*(?:\d+\s+)?(\d+)(?:\.|\s+)(\w+)\s*$", text)
    labels = [(int(node), _freedom(name)) for node, name in found]
    if len(labels) < rows:
        raise ValueError(f"{path.name} names {len(labels)} of its {rows} rows")
    count = Counter(labels)
    repeated = [row for row, label in enumerate(labels) if count[label] > 1]
    if repeated:
        node, dof = labels[repeated[0]]
        Place(str(path)).warn(
            f"{len(repeated)} of {len(labels)} rows share their label with another row, the first "
            f"is degree of freedom {dof} of node {node}; they are told apart by their row numbers "
            "and take no part in mode shapes"
        )
    for row in repeated:
        labels[row] = (-row - 1, labels[row][1])
    return tuple(labels)


def _read_dmig(path: Path) -> dict[str, UnbuiltMatrix]:
    """Cards DMIG of bulk data or a punch file, in small, large or free fields.

    Each matrix is built only when it is picked: a punch file of EXTOUT also holds rectangular ones.
    """
    cards: list[list[str]] = []
    ours = False
    for full in path.read_text(encoding="latin-1").splitlines():
        line = full.partition("$")[0].rstrip().expandtabs(8).upper()
        if "," in line:
            head, *cells = line.split(",")
        else:
            head, cells = line[:8], [line[8:]]
        large = "*" in head
        if "," in line:
            data = [_field(cell) for cell in [*cells, *[""] * 8]]
            data = data[: 4 if large else 8]
        else:
            width = 16 if large else 8
            data = [_field(line[k : k + width]) for k in range(8, 72, width)]
        mark = head.strip()
        # a name ends with *, a mark of a continuation begins with it, whatever follows
        continues = not mark or mark[0] in "+*"
        if not continues:
            ours = mark.rstrip(" *") == "DMIG"
            if ours:
                cards.append(data)
        elif ours and line:
            cards[-1] += data
    heads = {card[0]: card for card in cards if card[1] == "0"}
    if missing := {card[0] for card in cards} - heads.keys():
        raise ValueError(f"the card DMIG {missing.pop()} 0, which says what it holds, is missing")
    found = {}
    for name, card in heads.items():
        form = DMIG_FORMS.get(card[2], f"form {card[2]}")
        found[name] = UnbuiltMatrix(form, partial(_dmig, path, card, cards))
    return found


def _freedom(name: str) -> int:
    """The number of a degree of freedom of any name; those that move no node in space, such as
    WARP or VOLT, get one of their own, the same in every file."""
    if name.isdigit():
        return int(name)
    return FREEDOMS.get(name) or OTHER_FREEDOMS + zlib.crc32(name.encode())


def _field(cell: str) -> str:
    """A field of a card, without blanks before an exponent: Nastran reads 5.0 D+5 as one number."""
    return re.sub(r"\s+(?=[DE+-])", "", cell.strip())


def _dmig(path: Path, head: list[str], cards: list[list[str]]) -> MatrixFile:
    """One of the matrices that cards DMIG hold."""
    name, form, polar = head[0], head[2], head[5]
    if form not in ("1", "6"):
        kind = DMIG_FORMS.get(form, "unknown")
        raise InputError(
            f"the matrix {name} has the form {form} ({kind}); 1 (square) and 6 (symmetric) are read"
        )
    each = [  # node, degree of freedom of row and column; real and imaginary part
        (card[k], card[k + 1] or "0", card[1], card[2] or "0", card[k + 2], card[k + 3])
        for card in cards
        if card[0] == name and card[1] != "0"
        for k in range(4, len(card) - 3, 4)
        if card[k]
    ]
    text = " ".join(word or "0" for entry in each for word in entry).replace("D", "E")
    words = re.sub(r"([\d.])([+-])", r"\1E\2", text).split()
    if len(words) != 6 * len(each):
        raise ValueError(f"a field of {name} is no number")
    table = np.array(words, dtype=float).reshape(-1, 6)
    if np.any(table[:, :4] != np.round(table[:, :4])):
        raise ValueError(f"nodes and degrees of freedom of {name} must be whole numbers")
    values = table[:, 4]
    if polar not in ("", "0"):
        values = values * np.exp(1j * np.radians(table[:, 5]))
    elif head[3] in ("3", "4"):
        values = values + 1j * table[:, 5]
    digits = written_digits(
        itertools.chain.from_iterable(zip(words[4::6], words[5::6], strict=True))
    )
    labelled = _labelled(path, table[:, :4].astype(np.int64), values, form == "6")
    return replace(labelled, digits=digits)


def _bounded(path: Path, shapes: Iterable[Sequence[int]]) -> None:
    """Refuse full arrays that a file holds compressed, or names only. Raises InputError."""
    count = sum(map(math.prod, shapes))
    most = MOST_FULL * max(1, path.stat().st_size // 1_000_000)
    if count > most:
        raise InputError(f"{count:.6g} numbers in so small a file; at most {most} are read")


def _read_mat(path: Path) -> dict[str, Any]:
    with path.open("rb") as stream:
        head = stream.read(128)
    readers = {b"\x00\x01IM": _read_mat5, b"\x01\x00MI": _read_mat5, b"\x00\x02IM": _read_hdf5}
    if (version := head[124:]) not in readers:
        raise ValueError("save -v7 of MATLAB writes what is read, or -v7.3 with h5py")
    return readers[version](path)


def _read_mat5(path: Path) -> dict[str, Any]:
    """Read here, since SciPy trusts what stands in the file: a damaged one ends the process."""
    data, found = path.read_bytes(), dict[str, Any]()
    try:
        for name, matrix in _variables(data[128:], "<" if data[126:128] == b"IM" else ">"):
            found[name] = matrix
            _bounded(path, [(one.size,) for one in found.values()])
    except InputError:
        raise
    except (ValueError, LookupError, zlib.error):
        raise ValueError("the file is damaged") from None
    return found


def _variables(data: bytes, order: str) -> Iterator[tuple[str, Any]]:
    """Names and matrices among the data elements of MATLAB's version 5; text and the like is left
    out. Raises ValueError, LookupError, zlib.error."""
    for kind, inside in _elements(data, order):
        if kind == COMPRESSED:
            unpack = zlib.decompressobj()
            unpacked = unpack.decompress(inside, 8 * MOST_FULL + 100 * len(inside))
            if unpack.unconsumed_tail:
                raise InputError("more numbers than so small a file may hold; a sparse matrix may")
            if not unpack.eof:
                raise ValueError
            yield from _variables(unpacked, order)
        elif kind != MATRIX:
            raise ValueError
        elif inside:
            yield from _array(inside, order, "")


def _array(inside: bytes, order: str, owner: str) -> Iterator[tuple[str, Any]]:
    """The name and the matrix of an array of MATLAB's version 5, of a struct those of its fields.

    owner: what stands before the name, as `model.` does before a field of the struct `model`.
    Raises ValueError, LookupError.
    """
    (_, flags), (_, sizes), (_, name), *parts = _elements(inside, order)
    flag, _ = np.frombuffer(flags, f"{order}u4").tolist()
    shape = np.frombuffer(sizes, f"{order}i4").tolist()
    form, imaginary = flag & 0xFF, flag >> 11 & 1
    full_name = owner + name.decode("latin-1")
    if not full_name or len(shape) != 2:
        return
    if min(shape) < 0:
        raise ValueError
    if form == STRUCT:
        (_, width), (_, names), *fields = parts
        size = int(np.frombuffer(width, f"{order}i4")[0])
        if size < 1 or len(names) % size:
            raise ValueError
        padded = [names[at : at + size] for at in range(0, len(names), size)]
        keys = [one.split(b"\0")[0].decode("latin-1") for one in padded]
        count = math.prod(shape)
        if len(fields) != len(keys) * count:
            raise ValueError
        if full_name.count(".") >= NESTED:
            return
        for place, (kind, part) in enumerate(fields):
            member, of_key = divmod(place, len(keys))
            which = f"({member + 1})" if count > 1 else ""
            if kind == MATRIX and part:
                yield from _array(part, order, f"{full_name}{which}.{keys[of_key]}")
        return
    if not SPARSE <= form <= 15:
        return
    arrays = [np.frombuffer(part, order + TYPES[kind]) for kind, part in parts]
    *index, values = arrays[: len(arrays) - imaginary]
    if imaginary:
        values = values + 1j * arrays[-1].reshape(values.shape)
    if len(index) != (2 if form == SPARSE else 0):
        raise ValueError
    if form == SPARSE:
        rows, starts = index
        count = starts[-1]
        if not 0 <= count <= min(len(rows), len(values)):
            raise ValueError
        yield full_name, csc_array((values[:count], rows[:count], starts), shape=shape)
    else:
        yield full_name, values.reshape(shape, order="F")


def _elements(data: bytes, order: str) -> list[tuple[int, bytes]]:
    """The data elements of MATLAB's version 5, their types and bytes. Raises ValueError."""
    at, found = 0, []
    while at < len(data):
        kind, size = np.frombuffer(data[at : at + 8], f"{order}u4").tolist()
        at += 8
        if kind >> 16:  # a small element holds its data in the tag
            kind, size, place, after = kind & 0xFFFF, kind >> 16, at - 4, at
        else:
            place, after = at, at + size + (-size % 8 if kind != COMPRESSED else 0)
        inside = data[place : min(place + size, after)]
        if not 1 <= kind <= 18 or len(inside) != size:
            raise ValueError
        found.append((kind, inside))
        at = after
    return found


def _read_hdf5(path: Path) -> dict[str, Any]:
    """MATLAB's -v7.3: transposed arrays, sparse ones as groups data, ir, jc, structs as groups."""
    import h5py

    def numbers(data: Any) -> Any:
        _bounded(path, [data.shape])
        value = data[()]
        return value["real"] + 1j * value["imag"] if value.dtype.names else value

    found: dict[str, Any] = {}

    def collect(group: Any, owner: str) -> None:
        for name, item in group.items():
            if name.startswith("#"):  # MATLAB's own, as what references point to
                continue
            if "MATLAB_sparse" in item.attrs:
                columns = numbers(item["jc"]).astype(np.int64)
                rows = numbers(item["ir"]).astype(np.int64) if "ir" in item else columns[:0]
                values = numbers(item["data"]) if "data" in item else columns[:0].astype(float)
                shape = (int(item.attrs["MATLAB_sparse"]), len(columns) - 1)
                found[owner + name] = csc_array((values, rows, columns), shape=shape)
            elif isinstance(item, h5py.Group):  # a struct
                if owner.count(".") < NESTED:
                    collect(item, f"{owner}{name}.")
            elif getattr(item, "ndim", 0) == 2 and _is_numeric(item):
                found[owner + name] = numbers(item).T

    with h5py.File(path) as file:
        collect(file, "")
    return found


def _is_numeric(item: Any) -> bool:
    """Whether a dataset of HDF5 holds numbers, neither references nor text."""
    return item.dtype.kind in "biufcV" and item.attrs.get("MATLAB_class") != b"char"


def _read_npz(path: Path) -> MatrixFile | dict[str, Any]:
    from scipy.sparse import load_npz

    with ZipFile(path) as members:
        _bounded(path, [(one.file_size // 8,) for one in members.infolist()])
    with np.load(path, allow_pickle=False) as archive:
        if "format" in archive:
            return MatrixFile(load_npz(path))
        found = dict(archive)
        _bounded(path, [array.shape for array in found.values()])
        return found


def _read_op4(path: Path) -> dict[str, Any]:
    with np.printoptions():  # it takes digits from all that NumPy prints
        from pyyeti.nastran import op4

    found = op4.read(str(path), into="dct", sparse=True)
    return {name.upper(): matrix for name, matrix in found.items()}  # as Nastran writes them


def _read_op2(path: Path) -> dict[str, Any]:
    with np.printoptions():  # see `_read_op4`
        from pyyeti.nastran.op2 import OP2

    with OP2(str(path)) as file:
        return dict(file.rdop2mats())


def _read_full(path: Path) -> dict[str, MatrixFile]:
    """K and M of Ansys, one triangle each, without constrained rows.

    They are read in a process of its own, of bounded memory, for the package trusts what a damaged
    file says and takes its process down.
    """
    if find_spec("ansys") is None:
        raise ImportError(name="ansys")
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    work = "from squeal.io.matrix_formats import send_full; send_full()"
    done = subprocess.run([sys.executable, "-c", work, path], capture_output=True, env=paths)
    if done.returncode:
        raise ValueError("the file is damaged")
    found = pickle.loads(done.stdout)
    if isinstance(found, Exception):
        raise found
    return dict(found)


def send_full() -> None:
    """Write what stands in the file that the first argument names, or the error that it raises."""
    out = os.dup(1)
    os.dup2(2, 1)  # where the package prints to
    try:
        found: Any = _full(Path(sys.argv[1]))
    except Exception as error:  # the package's own need not be known where it is read
        found = error if isinstance(error, ImportError) else ValueError(str(error))
    with open(out, "wb") as stream:
        pickle.dump(found, stream)


def _full(path: Path) -> dict[str, MatrixFile]:
    from ansys.mapdl.reader import read_binary

    with suppress(ImportError):  # Windows has no such limits
        import resource

        most = FULL_MEMORY * (1 + path.stat().st_size // 10**6)
        resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))
    file = read_binary(str(path))
    rows, *matrices = file.load_km()
    held = set(map(tuple, file.const.tolist()))
    free = [i for i, row in enumerate(rows.tolist()) if tuple(row) not in held]
    labels = tuple((node, freedom + 1) for node, freedom in rows[free].tolist())
    return {
        name: MatrixFile(csc_array(X)[free][:, free], labels, symmetric=True)
        for name, X in zip("KM", matrices, strict=True)
        if X is not None
    }


def sound(matrix: Any) -> None:
    """SciPy trusts indices, and checks no pointers whose last one is 0. Raises ValueError."""
    matrix.check_format(full_check=True)
    if np.any(np.diff(matrix.indptr) < 0):
        raise ValueError("index pointers must not decrease")


@dataclass(frozen=True)
class Format:
    """One kind of matrix file.

    `head` is what its first bytes match, None leaves it to the suffix. `read` gives the matrix, or
    those of a file that may hold several by their names.
    """

    name: str
    suffixes: tuple[str, ...]
    head: bytes | None
    read: Callable[[Path], MatrixFile | Mapping[str, Any]]


# a type such as RUA begins the third line, and the second counts lines
_TYPE = rb"[^\n]*\n[ \d]+\r?\n(?i:[rcpi][suhzr][ae])\s"
# a head of four numbers, a name and perhaps a format; the same in binary, of either byte order
_OP4 = rb"(?s)(?:[ \d-]{7}\d){4}[A-Z]\w{0,7} *1P,|(?:\x18\0\0\0|\0\0\0\x18).{16}[A-Z]\w{0,7} *"
_OP2 = rb"\x04\0\0\0\x03\0\0\0\x04|\0\0\0\x04\0\0\0\x03\0\0\0\x04|\x08\0\0\0\x03\0\0\0\0"
# the first line neither blank nor with * holds 3 or 5 numbers (the last as 1,5 is refused later)
_ROWS = rb"(?:[ \t]*(?:\*.*)?\r?\n)*[ \t]*(?:(?:-?\d+[ \t,]+){2}){1,2}\S+[ \t]*\r?(?:\n|$)"
# fmt: off
FORMATS = (
    Format("Matrix Market", (".mtx",), b"(?i)%%matrixmarket", _read_matrix_market),
    Format("MATLAB", (".mat",), b"MATLAB ", _read_mat),
    Format("NumPy", (".npz",), b"PK\x03\x04", _read_npz),
    Format("Harwell-Boeing", (".hb", ".rua", ".rsa"), _TYPE, _read_harwell_boeing),
    Format("Nastran OP4", (".op4",), _OP4, _read_op4),
    Format("Nastran OP2", (".op2",), _OP2, _read_op2),
    Format("Nastran DMIG", (".pch", ".bdf", ".nas"), rb"(?ims)(?:.*^)?DMIG[ *,]", _read_dmig),
    Format("Ansys full", (".full",), None, _read_full),
    Format("Abaqus text", (".inp", ".txt", ".sti", ".mas"), _ROWS, _read_abaqus),
)
# fmt: on
