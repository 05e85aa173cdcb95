"""Harwell-Boeing: real or complex, assembled, as Ansys' HBMAT writes it too.

No right-hand sides are read. A file .mapping beside it, which HBMAT writes, names the rows.
"""

import math
import re
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array

from squeal.io.digits import written_decimals, written_digits
from squeal.io.formats.matrix_file import (
    ANY_LETTERS,
    MatrixFile,
    check_indices,
    has_internal_nodes,
    read_labels,
)
from squeal.io.halves import complete_triangle


def read_harwell_boeing(path: Path) -> MatrixFile:
    """The matrix of a file of this format. Raises ValueError."""
    # a title, the numbers of lines of each part, type and sizes, the formats of the parts
    lines = path.read_text(encoding="ascii", errors=ANY_LETTERS).splitlines()
    if len(lines) < 5 or len(lines[2].split()) < 4:
        raise ValueError("the header is missing")
    kind, *sizes = lines[2].upper().split()
    if not re.fullmatch("[RIC][USZ]A", kind):
        raise ValueError(f"type {kind}; real or complex (R, C), U, S or Z, assembled (A) are read")
    is_complex = kind[0] == "C"
    symmetry = kind[1]
    rows, columns, count = map(int, sizes[:3])
    line_counts = lines[1].split()
    # the fifth count is that of the lines of right-hand sides; a fifth line of the head has their
    # format
    has_right_sides = len(line_counts) > 4 and int(line_counts[4]) > 0
    body = lines[5:] if has_right_sides else lines[4:]
    formats = lines[3]  # of pointers, of indices and of values, each in 16 columns
    pointer_words, body = _read_fields(body, formats, columns + 1)
    index_words, body = _read_fields(body, formats[16:], count)
    number_count = 2 * count if is_complex else count
    value_words, _ = _read_fields(body, formats[32:], number_count)
    pointers = np.array(pointer_words, np.int64) - 1
    indices = np.array(index_words, np.int64) - 1
    values = np.array(value_words, float)
    if is_complex:
        values = values.view(complex)  # real and imaginary parts in turn
    matrix = csc_array((values, indices, pointers), shape=(rows, columns))
    check_indices(matrix)
    # of S and Z, skew-symmetric, the format asks for one triangle; some programs write both
    if symmetry == "S":
        matrix = complete_triangle(matrix, 1)
    elif symmetry == "Z":
        matrix = complete_triangle(matrix, -1)
    labels = read_labels(path.with_suffix(".mapping"), rows)
    return MatrixFile(
        matrix,
        labels,
        numbered=has_internal_nodes(labels),
        digits=written_digits(value_words),
        decimals=written_decimals(value_words),
    )


def _read_fields(lines: list[str], fortran_format: str, count: int) -> tuple[list[str], list[str]]:
    """The first `count` fields of some lines, with E for D, and the lines behind them.

    fortran_format: how they were written, such as (1P,3D24.16). Raises ValueError.
    """
    if not count:
        return [], lines
    edit = re.search(r"(\d*)[IEDFG](\d{1,2})", fortran_format.upper())
    has_repeated_group = re.search(r"\d *\(", fortran_format)
    if not edit or has_repeated_group:
        raise ValueError(
            f"the format {fortran_format.strip()} is not read; (8I10) and (3D24.16) are"
        )
    # (8I10): 8 in a line, of 10 characters each; (I10): 1 in a line
    per_line = max(1, min(int(edit[1] or 1), count))
    width = int(edit[2])
    line_count = math.ceil(count / per_line)
    used = [line.upper().replace("D", "E") for line in lines[:line_count]]
    too_few = f"fewer numbers than the {count} of the header"
    character_count = sum(map(len, used))  # a field has at least one
    if line_count > len(lines) or count > character_count:
        raise ValueError(too_few)
    fields = " ".join(used).split()
    if len(fields) != count:  # no blanks between some fields: split by their width
        line_width = per_line * width
        text = "".join(line[:line_width].ljust(line_width) for line in used)
        fields = [text[start : start + width].strip() for start in range(0, count * width, width)]
        if not all(fields):
            raise ValueError(too_few)
    return fields, lines[line_count:]
