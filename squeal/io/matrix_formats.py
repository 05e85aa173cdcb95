"""Formats of matrix files, recognised by their content or else by their suffix: `FORMATS`.

To add a format: a module of `squeal/io/formats` with a function that takes a path and returns a
`MatrixFile`, and a line of `FORMATS`, which is where refusals, documentation and `squeal` itself
find it; its round trip goes to tests/io/test_matrices.py.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from squeal.io.formats.abaqus import read_abaqus
from squeal.io.formats.ansys_full import read_full
from squeal.io.formats.harwell_boeing import read_harwell_boeing
from squeal.io.formats.matlab import read_mat
from squeal.io.formats.matrix_file import MatrixFile, NamedMatrices
from squeal.io.formats.matrix_market import read_matrix_market
from squeal.io.formats.nastran import read_dmig, read_op2, read_op4
from squeal.io.formats.numpy_files import read_npy, read_npz

HEAD = 4096  # bytes that a format is recognised by


@dataclass(frozen=True)
class Format:
    """One kind of matrix file.

    `head` is what its first bytes match, None leaves it to the suffix. `read` gives the matrix, or
    those of a file that may hold several by their names.
    """

    name: str
    suffixes: tuple[str, ...]
    head: bytes | None
    read: Callable[[Path], MatrixFile | NamedMatrices]


# a type such as RUA begins the third line, and the second counts lines
_HARWELL_BOEING = rb"[^\n]*\n[ \d]+\r?\n(?i:[rcpi][suhzr][ae])\s"
# a head of four numbers, a name and perhaps a format; the same in binary, of either byte order
_OP4 = rb"(?s)(?:[ \d-]{7}\d){4}[A-Z]\w{0,7} *1P,|(?:\x18\0\0\0|\0\0\0\x18).{16}[A-Z]\w{0,7} *"
_OP2 = rb"\x04\0\0\0\x03\0\0\0\x04|\0\0\0\x04\0\0\0\x03\0\0\0\x04|\x08\0\0\0\x03\0\0\0\0"
# a card of a matrix, or what stands above all cards of a job
_DMIG = rb"(?ims)(?:.*^)?(?:DMIG[ *,]|CEND\b|BEGIN +BULK)"
# a keyword or comment comes first, or a line of 3 or 5 numbers (the last as 1,5 is refused later)
_BOM = rb"(?:\xef\xbb\xbf)?"
_ABAQUS = _BOM + rb"\s*(?:\*|(?:(?:-?\d+[ \t,]+){2}){1,2}\S+[ \t]*\r?(?:\n|$))"
# fmt: off
FORMATS = (
    Format("Matrix Market", (".mtx",), b"(?i)" + _BOM + b"%%matrixmarket", read_matrix_market),
    Format("MATLAB", (".mat",), b"MATLAB ", read_mat),
    Format("NumPy archive", (".npz",), b"PK\x03\x04", read_npz),
    Format("NumPy", (".npy",), b"\x93NUMPY", read_npy),
    Format("Harwell-Boeing", (".hb", ".rua", ".rsa"), _HARWELL_BOEING, read_harwell_boeing),
    Format("Nastran OP4", (".op4",), _OP4, read_op4),
    Format("Nastran OP2", (".op2",), _OP2, read_op2),
    Format("Nastran DMIG", (".pch", ".bdf", ".nas"), _DMIG, read_dmig),
    Format("Ansys full", (".full",), None, read_full),
    Format("Abaqus text", (".inp", ".txt", ".sti", ".mas"), _ABAQUS, read_abaqus),
)
# fmt: on
