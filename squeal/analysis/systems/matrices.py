"""Matrices of a system before anything is solved: what they are and their files."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from squeal.io.matrices import fingerprint, write_matrix
from squeal.io.system import SystemFile
from squeal.io.writing import whole_folder, write_csv, write_text
from squeal.linear.matrices import EPS, dense, norm_of, unit_diagonal
from squeal.linear.moduli import Modulus
from squeal.linear.system import Matrix, TermSystem

ALL_ROWS = 400  # up to so many rows all roots are computed


def is_symmetric(matrix: Matrix) -> bool:
    """True if A and A' differ by rounding only."""
    rest = abs(matrix - matrix.T).max() if matrix.shape[0] else 0.0
    return bool(rest <= 1e-12 * abs(matrix).max())


def _words(matrix: Matrix) -> str:
    """Symmetry of M or K; of a small one whether it is definite, and its condition."""
    if np.iscomplexobj(matrix):
        return "complex"
    parts = ["symmetric" if is_symmetric(matrix) else "not symmetric"]
    if matrix.shape[0] <= ALL_ROWS:
        X = unit_diagonal(dense(matrix))
        reciprocal = float(1 / np.linalg.cond(X))
        if reciprocal <= 4 * EPS:
            parts.append("numerically singular")
        elif parts[0] == "symmetric" and np.linalg.eigvalsh(X)[0] > 0.0:
            parts.append("positive definite")
        else:
            parts.append("regular")
        parts.append(f"reciprocal condition {reciprocal:.2g}")
    return ", ".join(parts)


def system_checks(system: TermSystem) -> dict[str, str]:
    """What is to be said of M, C and K at the system's parameters."""
    M, C, K = system.frozen().at()
    checks = {"M": _words(M), "K": _words(K)}
    if C is not None and norm_of(C):
        checks["C"] = "symmetric" if is_symmetric(C) else "not symmetric"
    return checks


def matrix_list(file: SystemFile) -> list[dict[str, Any]]:
    """Each matrix of a system file: its part, file and how that was read, factor, size, symmetry
    and fingerprint."""
    return [
        {
            "part": o.part,
            "file": o.file or None,
            "key": o.key or None,
            "format": o.form or None,
            "labels": o.labelled,
            "factor": o.factor,
            "rows": int(o.matrix.shape[0]),
            "nonzeros": int(o.matrix.nnz),
            "symmetric": is_symmetric(o.matrix),
            "fingerprint": fingerprint(o.matrix),
        }
        for o in file.origins
    ]


def write_system(
    folder: Path, system: TermSystem, suffix: str, **more: Any
) -> list[dict[str, Any]]:
    """Write the terms of a system and a system file into a folder; a row for each matrix.

    `more` are other keys of the system file. Raises InputError for what the format does not hold;
    nothing is written then.
    """
    rows = []
    document: dict[str, Any] = {"name": system.name}
    own = {name: v for name, v in system.parameters.items() if name not in system.follows}
    document |= {"parameters": own, "parameter": system.parameter}
    with whole_folder(folder) as place:
        for part, terms in zip("MCK", system.parts, strict=True):
            for i, term in enumerate(terms):
                name = f"{part}{i}.{suffix}"
                write_matrix(place / name, term.matrix, part)
                keys: dict[str, Any] = {"file": name, "factor": term.factor.text}
                row = {"part": part} | keys | {"fingerprint": fingerprint(term.matrix)}
                group, key = document, part
                if isinstance(modulus := term.factor, Modulus):
                    keys["factor"] = modulus.factor.text
                    if modulus.loss:
                        keys["structural"] = modulus.loss.text
                    if table := modulus.table:
                        keys["modulus"] = {"file": f"{part}{i}.csv"}
                        lines = zip(table.frequencies, table.storage, table.loss, strict=True)
                        write_csv(place / f"{part}{i}.csv", ["frequency", "storage", "loss"], lines)
                    if modulus.imaginary:
                        group, key = document.setdefault("damping", {}), "K4"
                group.setdefault(key, []).append(keys)
                rows.append(row)
        write_text(place / "system.yaml", yaml.safe_dump(document | more, sort_keys=False))
    return rows
