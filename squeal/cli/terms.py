"""`squeal terms`: a matrix at two values of a parameter gives its two terms, a third checks them.

Finite-element programs write K at one friction after the other; K = K0 + p K1 follows.
"""

import argparse
from operator import itemgetter
from pathlib import Path
from typing import Any

from squeal.analysis.systems.matrices import AGREES, Separation, separated
from squeal.cli.command import Parser, Reply
from squeal.cli.options import numbers
from squeal.errors import ComputationError, InputError
from squeal.io.answer import Column, Table, number
from squeal.io.matrices import fingerprint, read_matrix, write_matrix
from squeal.io.writing import whole_folder
from squeal.schema.values import Name

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
    if Name().convert(given.parameter) is None:
        raise InputError(f"--parameter {given.parameter}: is not allowed; it must be a name")
    if len(given.matrices) not in (2, 3):
        raise InputError(f"{len(given.matrices)} matrices are not allowed; 2 or 3 {PAIR} are")
    values, files = zip(*map(_pair, given.matrices), strict=True)
    found = separated(values, [read_matrix(file, given.key).matrix for file in files])
    if found.error is not None and found.error > AGREES:
        raise ComputationError(
            f"{files[2]}: differs from K0 + {given.parameter} K1 by {found.error:.2g} of its "
            f"largest entry; the matrix is not linear in {given.parameter}"
        )
    written = _write(given, found)
    return Reply(
        lambda: _data(given, found, written), lambda: _text(given, found, written), list(files)
    )


def _pair(given: str) -> tuple[float, Path]:
    value, colon, name = given.partition(":")
    if not colon or not name:
        raise InputError(f"{given}: is not allowed; it must be {PAIR}")
    return numbers(value, given, 1, PAIR)[0], Path(name)


def _write(given: argparse.Namespace, found: Separation) -> list[Path]:
    if given.output is None:
        return []
    path: Path = given.output
    names = [path.with_name(f"{path.stem}{k}{path.suffix}") for k in (0, 1)]
    for name in names:
        if name.exists():
            raise InputError(f"--output {name}: exists; another name is allowed")
    with whole_folder(path.parent) as place:
        for name, matrix in zip(names, (found.constant, found.linear), strict=True):
            write_matrix(place / name.name, matrix, "K")
    return names


def _data(given: argparse.Namespace, found: Separation, written: list[Path]) -> dict[str, Any]:
    factors = ("1", given.parameter)
    files = [path.name for path in written] or [None, None]  # type: ignore[list-item]
    parts = zip(factors, files, (found.constant, found.linear), strict=True)
    return {
        "rows": int(found.constant.shape[0]),
        "terms": [
            {"factor": f, "file": file, "nonzeros": int(m.nnz), "fingerprint": fingerprint(m)}
            for f, file, m in parts
        ],
        "error": found.error,
        "checked": found.error is not None,
    }


def _text(given: argparse.Namespace, found: Separation, written: list[Path]) -> str:
    data = _data(given, found, written)
    checked = "no third matrix was given to check it"
    if found.error is not None:
        checked = f"the third matrix agrees to {number(found.error, 2)} of its largest entry"
    head = f"K = K0 + {given.parameter} K1, {data['rows']} rows; {checked}"
    names = ("factor", "file", "nonzeros", "fingerprint")
    told = [Column(name, value=itemgetter(name)) for name in names]
    lines = [Table(told, data["terms"], head).text()]
    if written:
        one, two = (path.name for path in written)
        lines.append(f"K: [{{file: {one}}}, {{file: {two}, factor: {given.parameter}}}]")
    return "\n".join(lines)
