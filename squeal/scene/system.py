"""Plain systems M q'' + C q' + K(mu) q = 0 from a YAML file.

```yaml
name: mode coupling           # free text, optional
reference: where it is from   # free text, optional
parameter: mu                 # what the free parameter is called, optional
M: [[1, 0], [0, 1]]           # symmetric, positive definite
C0: [[0, 0], [0, 0]]          # optional: C = C0 + C1 mu + C2 mu^2 + ...
K0: [[2, -1], [-1, 2]]        # K = K0 + K1 mu + K2 mu^2 + ...
K1: [[0, 1.333], [0, 0]]      # a power that is left out is zero
```
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.errors import InputError
from squeal.files.document import read_document
from squeal.files.values import Keys, number, shown
from squeal.stability.matrices import Array, reduce

TEXTS = ("name", "reference", "parameter")
SIZE = 100  # degrees of freedom: dense eigenvalue problems beyond it are not what this is for
POWER = 9
_COEFFICIENT = re.compile(r"[CK][0-9]")
_MATRIX = "a square matrix of finite numbers, a list of rows"


@dataclass(frozen=True, eq=False)
class PlainSystem:
    """M q'' + C(mu) q' + K(mu) q = 0 with polynomials C and K; call it with mu for (M, C, K)."""

    name: str
    reference: str
    parameter: str
    M: Array  # (n, n)
    C: tuple[Array, ...]  # coefficients of rising powers of mu, (n, n) each; none if undamped
    K: tuple[Array, ...]

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.M)

    def __call__(self, mu: float) -> tuple[Array, Array | None, Array]:
        """The matrices at mu; C is None for an undamped system."""
        return self.M, _polynomial(self.C, mu) if self.C else None, _polynomial(self.K, mu)


def _polynomial(coefficients: tuple[Array, ...], mu: float) -> Array:
    result = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        result = result * mu + coefficient
    return result


def read_plain(path: Path | str) -> PlainSystem:
    """The system that a YAML file describes, completely checked.

    Raises InputError with one sentence that names the file, the key, the value and what is
    allowed.
    """
    return plain_system(read_document(Path(path)), Keys(str(path)))


def plain_system(document: dict[str, Any], at: Keys) -> PlainSystem:
    """The system in a mapping of the file's form; `at` tells messages where it stands."""
    for key in document:
        if key not in (*TEXTS, "M") and not _COEFFICIENT.fullmatch(key):
            raise (at / key).refuse(
                f"unknown key; allowed are {', '.join(TEXTS)}, M, C0 to C{POWER}, K0 to K{POWER}"
            )
    texts = {key: _text(document.get(key, ""), at / key) for key in TEXTS}
    for key in ("M", "K0"):
        if key not in document:
            raise (at / key).refuse(f"missing; it must be {_MATRIX}")
    M = _matrix(document["M"], at / "M", None)
    try:
        reduce(M, None, np.zeros_like(M))
    except InputError:
        raise (at / "M").refuse(
            f"{shown(document['M'])} is not allowed; it must be symmetric and positive definite"
        ) from None
    return PlainSystem(
        texts["name"] or Path(at.file).stem,
        texts["reference"],
        texts["parameter"] or "mu",
        M,
        _coefficients("C", document, at, len(M)),
        _coefficients("K", document, at, len(M)),
    )


def _coefficients(letter: str, document: dict[str, Any], at: Keys, n: int) -> tuple[Array, ...]:
    given = [p for p in range(POWER + 1) if f"{letter}{p}" in document]
    result = [np.zeros((n, n)) for _ in range(max(given, default=-1) + 1)]
    for power in given:
        key = f"{letter}{power}"
        result[power] = _matrix(document[key], at / key, n)
    return tuple(result)


def _text(value: Any, at: Keys) -> str:
    if not isinstance(value, str):
        raise at.refuse(f"{shown(value)} is not allowed; it must be text")
    return value


def _matrix(value: Any, at: Keys, n: int | None) -> Array:
    size = "n x n" if n is None else f"{n} x {n} like M"
    allowed = f"it must be {_MATRIX}, {size}"
    if not isinstance(value, list) or not value or len(value) > SIZE:
        raise at.refuse(f"{shown(value)} is not allowed; {allowed} with at most {SIZE} rows")
    n = n or len(value)
    if len(value) != n:
        raise at.refuse(f"{len(value)} rows are not allowed; {allowed}")
    for i, row in enumerate(value):
        if not isinstance(row, list) or len(row) != n:
            raise at.refuse(f"row {i + 1}, {shown(row)}, is not allowed; {allowed}")
    return np.array([[number(x, at / f"row {i + 1}") for x in row] for i, row in enumerate(value)])
