"""What can be said of matrices before anything is solved: symmetry, definiteness, condition."""

from typing import Any

import numpy as np

from squeal.io.system import SystemFile
from squeal.linear.matrices import norm_of
from squeal.linear.system import Matrix, TermSystem
from squeal.sparse.factor import definite, factorise

SYMMETRIC = 1e-12  # of the largest entry
SINGULAR = 1e-15  # reciprocal condition, 1-norm, of the scaled matrix
CHECKED_ROWS = 20_000  # larger ones are not factorised for a report


def is_symmetric(matrix: Matrix) -> bool:
    """True if A and A' differ by rounding only."""
    rest = abs(matrix - matrix.T).max() if matrix.shape[0] else 0.0
    return bool(rest <= SYMMETRIC * abs(matrix).max())


def condition(matrix: Any) -> float:
    """Reciprocal condition of a CSC array in the 1-norm, estimated, its diagonal scaled to one."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import LinearOperator, onenormest

    size = np.sqrt(np.abs(matrix.diagonal()))
    size = diags_array(1.0 / np.where(size > 0, size, 1.0))
    scaled = csc_array(size @ matrix @ size)
    try:
        factor = factorise(scaled)
    except ZeroDivisionError:
        return 0.0
    n = scaled.shape[0]
    inverse = LinearOperator(
        (n, n),
        matvec=lambda b: factor.solve(np.ravel(b)),
        rmatvec=lambda b: factor.solve(np.ravel(b).conj(), True).conj(),
        dtype=scaled.dtype,
    )
    largest = float(onenormest(inverse)) if n > 4 else float(abs(inverse @ np.eye(n)).sum(0).max())
    return 1.0 / (largest * float(abs(scaled).sum(axis=0).max()))


def told_of(name: str, matrix: Matrix) -> str:
    """Symmetry, definiteness and condition of M or K in words."""
    from scipy.sparse import csc_array

    sparse = csc_array(matrix)
    if np.iscomplexobj(sparse.data):
        return "complex"
    parts = ["symmetric" if is_symmetric(sparse) else "not symmetric"]
    if sparse.shape[0] <= CHECKED_ROWS:
        reciprocal = condition(sparse)
        if reciprocal <= SINGULAR:
            parts.append("numerically singular")
        elif parts[0] == "symmetric" and definite(sparse):
            parts.append("positive definite")
        else:
            parts.append("regular")
        parts.append(f"reciprocal condition {reciprocal:.2g}")
    return ", ".join(parts)


def system_checks(system: TermSystem) -> dict[str, str]:
    """What is to be said of M, C and K at the system's parameters."""
    M, C, K = system.at()
    found = {"M": told_of("M", M), "K": told_of("K", K)}
    if C is not None and norm_of(C):
        found["C"] = "symmetric" if is_symmetric(C) else "not symmetric"
    return found


def matrix_list(file: SystemFile) -> list[dict[str, Any]]:
    """Each matrix of a system file: its part, file, factor, size, symmetry and fingerprint."""
    from squeal.io.matrices import fingerprint

    return [
        {
            "part": o.part,
            "file": o.file or None,
            "factor": o.factor,
            "rows": int(o.matrix.shape[0]),
            "nonzeros": int(o.matrix.nnz),
            "symmetric": is_symmetric(o.matrix),
            "fingerprint": fingerprint(o.matrix),
        }
        for o in file.origins
    ]
