"""K = K0 + p K1 from matrices at two values of p, checked by a third."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from squeal.errors import InputError

ROUNDING = 16 * float(np.finfo(float).eps)  # of the largest entry: what is left of equal entries
AGREES = 1e-9  # of the largest entry: what a third matrix may differ by


@dataclass(frozen=True, eq=False)
class Separation:
    """CSC arrays K0 and K1; `error` is what a third matrix differs by, of its largest entry."""

    constant: Any = field(repr=False)
    linear: Any = field(repr=False)
    error: float | None


def separated(values: Sequence[float], matrices: Sequence[Any]) -> Separation:
    """The terms of K = K0 + p K1 from K at two values of p, and what a third says to them.

    Differences of a few roundings count as zero, so that K1 has the entries that depend on p
    alone. Raises InputError for equal values, different shapes or terms that are not finite.
    """
    from scipy.sparse import csc_array

    twice = next((v for i, v in enumerate(values) if v in values[:i]), None)
    if twice is not None:
        raise InputError(f"{twice:g}: is there twice; different values are allowed")
    shapes = {matrix.shape for matrix in matrices}
    if len(shapes) != 1:
        listed = " and ".join(str(m.shape[0]) for m in matrices)
        raise InputError(f"matrices of {listed} rows are not allowed; they must be of one size")
    (a, b), (A, B) = values[:2], (csc_array(m) for m in matrices[:2])
    largest = max(abs(A).max(), abs(B).max())
    with np.errstate(over="ignore", invalid="ignore"):
        difference = csc_array(B - A)
        difference.data[np.abs(difference.data) <= ROUNDING * largest] = 0.0
        difference.eliminate_zeros()
        linear = csc_array(difference / (b - a))
        constant = csc_array(A - a * linear)
    if not (np.isfinite(linear.data).all() and np.isfinite(constant.data).all()):
        raise InputError(
            f"the matrices at {a:g} and {b:g}: their difference over that of the values is not "
            "finite; values farther apart are allowed"
        )
    constant.data[np.abs(constant.data) <= ROUNDING * largest] = 0.0
    constant.eliminate_zeros()
    error = None
    if len(values) == 3:
        rest = abs(constant + values[2] * linear - matrices[2])
        error = float(rest.max() / abs(matrices[2]).max())
    return Separation(constant, linear, error)
