"""Text of Abaqus and CalculiX: `row, column, value` or `node, dof, node, dof, value` in each line.

Numbers are separated by commas or blanks. Internal nodes, such as those of Lagrange multipliers,
have labels below zero. A line that begins with * may say TYPE=SYMMETRIC or UNSYMMETRIC; each
*MATRIX INPUT begins a matrix. CalculiX names the rows in a file .dof beside it.
"""

import io
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.io.digits import written_decimals, written_digits
from squeal.io.formats.matrix_file import (
    ANY_LETTERS,
    MatrixFile,
    NamedMatrices,
    has_internal_nodes,
    labelled_matrix,
    matrices_by_name,
    read_columns,
    read_labels,
    sum_entries,
)


@dataclass
class _Block:
    """One matrix: its name, its keywords in capitals, and the lines of its entries."""

    name: str = ""
    keywords: str = ""
    entries: str = ""


def read_abaqus(path: Path) -> MatrixFile | NamedMatrices:
    """The matrix of a file, or those of a file with several, by their names. Raises ValueError."""
    text = path.read_text(encoding="utf-8-sig", errors=ANY_LETTERS)
    text = re.sub(r"(?m)^[ \t]*\*\*.*$", "", text)  # comments
    text = text.replace(",", " ")
    for mark in "#%;":
        if mark in text:
            raise ValueError(
                f"{mark} is not what Abaqus writes; comments begin with **, and commas or blanks "
                "stand between numbers"
            )
    blocks = [block for block in _blocks(text) if block.entries.strip()]
    if not blocks:
        raise ValueError("no entries")
    if len(blocks) == 1:
        return _matrix(path, blocks[0])
    return matrices_by_name((block.name, _matrix(path, block)) for block in blocks)


def _blocks(text: str) -> list[_Block]:
    """The matrices in a text: the lines before any keyword, then a block for each *MATRIX INPUT.

    The text has no comments, and blanks in place of commas. Raises ValueError for any other
    keyword.
    """
    blocks = [_Block()]
    if "*" not in text:
        blocks[0].entries = text
        return blocks
    # in turn what stands before a line that begins with *, and that line itself
    for part in re.split(r"(?m)^[ \t]*(\*.*)$", text):
        if not part.startswith("*"):
            blocks[-1].entries += part
            continue
        if re.match(r"\*\s*MATRIX\s*INPUT", part, re.IGNORECASE):
            name = re.search(r"NAME\s*=\s*(\S+)", part, re.IGNORECASE)
            blocks.append(_Block(name[1] if name else ""))
        else:
            raise ValueError(
                f"the keyword {part.strip()} is not allowed; *MATRIX INPUT is, and the matrices of "
                "a substructure (*USER ELEMENT) are read from .npy or Matrix Market"
            )
        blocks[-1].keywords += f" {part.upper()} "
    return blocks


def _refuse_sizes(first_line: str, positions: NDArray) -> None:
    """Refuse a first line that may hold sizes: rows, columns and how many entries follow.

    positions: row and column of all lines (lines, 2). Raises ValueError.
    """
    shape = positions[0]
    followers = positions[1:]
    counts_followers = first_line.split()[2] == str(len(followers))
    if followers.size and counts_followers and np.all(followers <= shape):
        raise ValueError(
            f"its first line, {' '.join(first_line.split())}, may hold the sizes or an entry; put "
            "%%MatrixMarket matrix coordinate real general above sizes, *MATRIX INPUT above entries"
        )


def _matrix(path: Path, block: _Block) -> MatrixFile:
    """The matrix of a block of the file at `path`, whose rows a file .dof beside it may name.
    Raises ValueError."""
    # Fortran writes 1.5D+03 for 1.5E+03
    text = re.sub(r"(?<=[\d.])[Dd](?=[+-]?\d)", "E", block.entries)
    lines = [line for line in io.StringIO(text) if line.strip()]
    # 3: row, column, value; 5: node and degree of freedom of the row and of the column, value
    width = len(lines[0].split())
    if width not in (3, 5):
        raise ValueError(
            f"{width} columns; 3 or 5 are read, decimals behind a point. A full table is read as "
            ".npy of NumPy"
        )
    # positions (lines, 2) or (lines, 4): the whole numbers before the value
    positions, columns = read_columns(io.StringIO(text), width - 1, 1)
    if width == 3 and not block.keywords:
        _refuse_sizes(lines[0], positions)
    values = columns[:, 0]
    words = [line.split()[-1] for line in lines]
    digits = written_digits(words)
    decimals = written_decimals(words)
    scale = re.search(r"SCALE\s*FACTOR\s*=\s*(\S+)", block.keywords)
    if scale:
        factor = float(scale[1])
        values = factor * values
        # rounding errors are scaled, too: 0.001234 +- 5e-7 times 100 is 0.1234 +- 5e-5, which has
        # 4 decimals instead of 6; a factor between powers of ten counts as the next higher power
        if decimals is not None and factor:
            decimals -= math.ceil(math.log10(abs(factor)))
        # 1.00 +- 0.005 times 9 is 9.00 +- 0.045: a product may have one significant digit less
        if digits is not None:
            digits -= 1
    symmetric = None  # where no keyword says so
    kind = re.search(r"TYPE\s*=\s*(UN)?SYMMETRIC", block.keywords)
    if kind:
        symmetric = kind[1] is None  # kind[1] is UN of UNSYMMETRIC
    if width == 5:
        labelled = labelled_matrix(path, positions, values, symmetric, digits)
        return replace(labelled, decimals=decimals)
    if positions.min() < 1:
        raise ValueError("rows and columns must count from 1")
    rows = int(positions.max())
    labels = read_labels(path.with_suffix(".dof"), rows)
    if labels:
        rows = len(labels)
    matrix, assumptions = sum_entries(path, positions.T - 1, values, (rows, rows))
    return MatrixFile(
        matrix,
        labels,
        open_ended=labels is None,
        symmetric=symmetric,
        numbered=has_internal_nodes(labels),
        digits=digits,
        decimals=decimals,
        assumptions=assumptions,
    )
