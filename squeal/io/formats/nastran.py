"""Nastran: cards DMIG of bulk data or a punch file, and its OP4 and OP2 files by pyyeti."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.io.digits import written_digits
from squeal.io.formats.matrix_file import (
    MatrixFile,
    NamedMatrices,
    UnbuiltMatrix,
    labelled_matrix,
    matrices_by_name,
)

DMIG_FORMS = {"1": "square", "2": "rectangular", "6": "symmetric", "9": "rectangular"}
SQUARE = "1"
SYMMETRIC = "6"
NUMBER = re.compile(r"[+-]?\d\.\d+[ED][+-]?\d+")
"""A number of OP4 in text, where columns of fixed width may follow without a blank between them."""
SINGLE = {1: np.float32, 3: np.complex64}  # types of OP4 in single precision
COMPLEX_TYPES = ("3", "4")  # single and double precision


def read_dmig(path: Path) -> dict[str, UnbuiltMatrix]:
    """Cards DMIG, in small, large or free fields. Raises ValueError.

    Each matrix is built only when it is picked: a punch file of EXTOUT also holds rectangular ones.
    A head card has the fields name, 0, form, type, type of the result, polar. A card of a column
    has name, node and degree of freedom of the column, and an empty field. Then come node, degree
    of freedom, real and imaginary part of each row.
    """
    cards = _dmig_cards(path.read_text(encoding="latin-1"))
    heads: dict[str, list[str]] = {}
    for card in cards:
        if card[1] == "0":
            if card[0] in heads:
                raise ValueError(f"the card DMIG {card[0]} 0 stands twice; one is allowed")
            heads[card[0]] = card
    headless = {card[0] for card in cards} - heads.keys()
    if headless:
        raise ValueError(f"the card DMIG {headless.pop()} 0, which says what it holds, is missing")
    matrices = {}
    for name, head in heads.items():
        form = DMIG_FORMS.get(head[2], f"form {head[2]}")
        matrices[name] = UnbuiltMatrix(form, partial(_build_dmig, path, head, cards))
    return matrices


def _dmig_cards(text: str) -> list[list[str]]:
    """The fields behind the word DMIG of each such card, with those of its continuations."""
    cards: list[list[str]] = []
    in_dmig = False  # whether the last card was a DMIG, to which continuations belong
    for full_line in text.splitlines():
        line = full_line.partition("$")[0].rstrip().expandtabs(8).upper()
        name, fields = _card_fields(line)
        # `DMIG*` ends with the star of large fields; a continuation is blank or begins with + or *,
        # as *ABC does
        continues = not name or name[0] in "+*"
        if not continues:
            in_dmig = name.rstrip(" *") == "DMIG"
            if in_dmig:
                cards.append(fields)
        elif in_dmig and line:
            cards[-1] += fields
    return cards


def _card_fields(line: str) -> tuple[str, list[str]]:
    """The name or mark that begins a line, and the fields behind it: 8, or 4 large ones."""
    if "," in line:
        name, *cells = line.split(",")
        cells += [""] * 8
        del cells[4 if "*" in name else 8 :]
    else:
        name = line[:8]
        width = 16 if "*" in name else 8
        cells = [line[start : start + width] for start in range(8, 72, width)]
    # Nastran reads 5.0 D+5 as one number
    fields = [re.sub(r"\s+(?=[DE+-])", "", cell.strip()) for cell in cells]
    return name.strip(), fields


def _build_dmig(path: Path, head: list[str], cards: list[list[str]]) -> MatrixFile:
    """The matrix that a head card announces, from the cards of its columns among all `cards`.

    For the fields of both kinds of cards see `read_dmig`. Raises InputError, ValueError.
    """
    name = head[0]
    form = head[2]  # 1 square, 6 symmetric; others are refused
    type_in = head[3]  # 1 to 4: real or complex, single or double precision
    polar = head[5]  # empty or 0: entries are real and imaginary parts
    if form not in (SQUARE, SYMMETRIC):
        kind = DMIG_FORMS.get(form, "unknown")
        raise InputError(
            f"the matrix {name} has the form {form} ({kind}); 1 (square) and 6 (symmetric) are read"
        )
    entries = _dmig_entries(name, cards)
    fields: list[str] = []
    for entry in entries:
        fields += [field or "0" for field in entry]
    text = " ".join(fields).replace("D", "E")
    words = re.sub(r"([\d.])([+-])", r"\1E\2", text).split()  # 1.5+3 is 1.5E+3
    if len(words) != 6 * len(entries):
        raise ValueError(f"a field of {name} is no number")
    # columns: node and degree of freedom of the row, the same of the column, real and imaginary
    # part of the entry, or its magnitude and phase
    table = np.array(words, dtype=float).reshape(-1, 6)
    positions = table[:, :4]
    if np.any(positions != np.round(positions)):
        raise ValueError(f"nodes and degrees of freedom of {name} must be whole numbers")
    values: NDArray = table[:, 4]
    if polar not in ("", "0"):  # magnitude, and phase in degrees
        values = values * np.exp(1j * np.radians(table[:, 5]))
    elif type_in in COMPLEX_TYPES:
        values = values + 1j * table[:, 5]
    # the last two of the six fields of an entry
    value_words = (word for i, word in enumerate(words) if i % 6 >= 4)
    digits = written_digits(value_words)
    return labelled_matrix(path, positions.astype(np.int64), values, form == SYMMETRIC, digits)


def _dmig_entries(name: str, cards: list[list[str]]) -> list[tuple[str, ...]]:
    """The six fields of each entry of a matrix, from the cards of its columns.

    They are node and degree of freedom of the row, the same of the column, real and imaginary part.
    A card holds: name, node and degree of freedom of the column, an empty field; then four fields
    for each entry, which are node and degree of freedom of the row, real and imaginary part.
    """
    entries: list[tuple[str, ...]] = []
    for card in cards:
        if card[0] != name or card[1] == "0":  # 0: the head of a matrix
            continue
        column = (card[1], card[2] or "0")
        for start in range(4, len(card) - 3, 4):
            row_node, row_freedom, real, imaginary = card[start : start + 4]
            if row_node:
                entries.append((row_node, row_freedom or "0", *column, real, imaginary))
    return entries


@contextmanager
def _import_of_pyyeti() -> Iterator[None]:
    """Refuse where pyyeti, which Numba compiles, finds no folder for what is compiled."""
    try:
        with np.printoptions():  # the import changes how NumPy prints: change it back
            yield
    except RuntimeError as error:
        reason = f"pyyeti: {error}; the environment variable NUMBA_CACHE_DIR may name a folder"
        raise InputError(f"{reason} that can be written") from None


def read_op4(path: Path) -> NamedMatrices:
    """The matrices of an OP4 file, their names in capitals as Nastran writes them.

    How precise the entries are is stored with each matrix: `digits` are those of the numbers in a
    text file; of a binary file of single precision the array has that type, although pyyeti reads
    it as double.
    """
    with _import_of_pyyeti():
        from pyyeti.nastran import op4

    with path.open("rb") as stream:
        is_binary = b"\0" in stream.read(64)  # no text holds zero bytes, every binary head does
    digits = None
    if not is_binary:
        digits = written_digits(match[0] for match in NUMBER.finditer(path.read_text("latin-1")))
    # the third list holds the forms (square, symmetric, ...), the fourth the types of the numbers
    names, matrices, _, kinds = op4.load(str(path), into="list", sparse=True)
    named = []
    for name, matrix, kind in zip(names, matrices, kinds, strict=True):
        stored = csc_array(matrix)
        if is_binary and kind in SINGLE:
            stored = stored.astype(SINGLE[kind])
        named.append((name.upper(), MatrixFile(stored, digits=digits)))
    return matrices_by_name(named)


def read_op2(path: Path) -> NamedMatrices:
    """The matrices of an OP2 file."""
    with _import_of_pyyeti():
        from pyyeti.nastran.op2 import OP2

    with OP2(str(path)) as file:
        matrices = file.rdop2mats(which="all")
    return matrices_by_name((name, matrix) for name in matrices for matrix in matrices[name])
