"""`squeal terms`: a matrix at two values of a parameter gives its two terms, a third checks them.

Finite-element programs write K at one friction after the other; K = K0 + p K1 follows.
"""

import argparse
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from squeal.analysis.systems.matrices import AGREES, separated
from squeal.cli.command import Parser, Reply
from squeal.cli.options import not_allowed, numbers
from squeal.errors import ComputationError, InputError
from squeal.io.matrices import fingerprint, read_matrix, write_matrix
from squeal.io.writing import Column, Table, number, whole_folder
from squeal.schema.values import Name, Place

PAIR = "VALUE:FILE, the parameter's value and the matrix there"


def options(parser: Parser) -> None:
    """Options of `squeal terms`."""
    parser.add_argument(
        "matrices",
        metavar="VALUE:FILE",
        nargs="+",
        help="a value of the parameter and the matrix there, two or three times",
    )
    parser.add_argument("--parameter", metavar="NAME", default="mu", help="its name (mu)")
    parser.add_argument("--key", metavar="KEY", help="which matrix of .mat, .npz or .op4 files")
    parser.add_argument(
        "--output", metavar="NAME.mtx", type=Path, help="write NAME0.mtx and NAME1.mtx"
    )


def run(given: argparse.Namespace) -> Reply:
    """Read the matrices and split them."""
    name = Name().read(given.parameter, Place(f"--parameter {given.parameter}"))
    if len(given.matrices) not in (2, 3):
        raise InputError(f"{len(given.matrices)} matrices are not allowed; 2 or 3 {PAIR} are")
    values, files = zip(*map(_pair, given.matrices), strict=True)
    terms = separated(values, [read_matrix(file, given.key).matrix for file in files])
    if terms.error is not None and terms.error > AGREES:
        raise ComputationError(
            f"{files[2]}: differs from K0 + {name} K1 by {terms.error:.2g} of its "
            f"largest entry; the matrix is not linear in {name}"
        )
    matrices = (terms.constant, terms.linear)
    written = _write(given.output, matrices)
    rows = [
        {"factor": factor, "file": file, "nonzeros": int(m.nnz), "fingerprint": fingerprint(m)}
        for factor, file, m in zip(("1", name), written or (None, None), matrices, strict=True)
    ]
    data = {
        "rows": int(terms.constant.shape[0]),
        "terms": rows,
        "error": terms.error,
        "checked": terms.error is not None,
    }
    checked = "no third matrix was given to check it"
    if terms.error is not None:
        checked = f"the third matrix agrees to {number(terms.error, 2)} of its largest entry"
    columns = [Column(column, value=itemgetter(column)) for column in rows[0]]
    head = f"K = K0 + {name} K1, {data['rows']} rows; {checked}"
    text = Table(columns, rows, head).text()
    if written:
        text += f"\nK: [{{file: {written[0]}}}, {{file: {written[1]}, factor: {name}}}]"
    return Reply(lambda: data, lambda: text, list(files))


def _pair(given: str) -> tuple[float, Path]:
    value, colon, name = given.partition(":")
    if not colon or not name:
        raise not_allowed(given, PAIR)
    return numbers(value, given, 1, PAIR)[0], Path(name)


def _write(path: Path | None, matrices: Sequence[Any]) -> list[str]:
    """The names of the files in which the terms now stand. Raises InputError."""
    if path is None:
        return []
    names = [f"{path.stem}{k}{path.suffix}" for k in (0, 1)]
    for name in names:
        if path.with_name(name).exists():
            raise InputError(f"--output {path.with_name(name)}: exists; another name is allowed")
    with whole_folder(path.parent) as place:
        for name, matrix in zip(names, matrices, strict=True):
            write_matrix(place / name, matrix, "K")
    return names
