"""How far entries of a matrix may be off that were written with few digits or as short floats.

A number with n significant digits is known to half a unit of the last one, a float of single
precision to half a unit in the last place of its 24 bits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import EPS, Array, Matrix, divisor, is_sparse, unwrapped

if TYPE_CHECKING:  # pads start without SciPy's sparse matrices
    from scipy.sparse import csc_array

ROUNDED = 128.0 * EPS
"""By which share a power of ten, and the sum of both errors, may be too small in doubles."""


class Precision(NamedTuple):
    """To how many significant digits entries are known, and how far each may be off.

    Attributes
    ----------
    digits : int or None
        The digits, rounded down; None of doubles, and of entries that are exact.
    errors : csc_array (n, n), or None
        How far each entry may be off; None where it is half a unit of the last of these digits.
    """

    digits: int | None = None
    errors: csc_array | None = None


def half_units(matrix: Matrix, digits: int) -> csc_array:
    """How far each entry of a matrix (n, n) may be off that was written with `digits` digits.

    It is half a unit of the last significant digit, and how far the double lies from the number
    that was written, for real and imaginary part.
    """

    def half_unit(numbers: Array) -> Array:
        size = np.abs(numbers)
        # 1e-9: a number just below a power of ten may have been written as the power itself, whose
        # unit is ten times as wide
        leading_power = np.floor(np.log10(divisor(size)) + 1e-9)
        units = 0.5 * 10.0 ** (leading_power + 1 - digits) + np.spacing(size) / 2.0
        return np.where(size > 0.0, units * (1.0 + ROUNDED), 0.0)

    return _errors(matrix, half_unit)


def short_floats(value: object) -> np.dtype[np.floating] | None:
    """The type of floats, shorter than doubles, that the entries of a matrix were rounded to.

    None of other numbers, and where every entry has at most half of the bits that the type holds,
    such as small whole numbers: these were not rounded.

    >>> short_floats(np.array([[0.1]], dtype=np.float32))
    dtype('float32')
    >>> short_floats(np.array([[2.0, -0.5]], dtype=np.float32)), short_floats(np.array([[0.1]]))
    (None, None)
    """
    matrix: Any = unwrapped(value)
    entries: NDArray = np.asarray(matrix.tocoo().data if is_sparse(matrix) else matrix)
    if entries.dtype.kind not in "fc":
        return None
    parts = [entries.real, entries.imag] if entries.dtype.kind == "c" else [entries]
    type_of_parts = parts[0].dtype
    if type_of_parts.itemsize >= 8:
        return None
    few_bits = (np.finfo(type_of_parts).nmant + 1) // 2
    for part in parts:
        mantissas, _ = np.frexp(part.astype(float))
        scaled = np.ldexp(mantissas, few_bits)  # whole numbers if no entry has more bits
        if np.any(scaled != np.round(scaled)):
            return type_of_parts
    return None


def precision_of_floats(matrix: Matrix, floats: np.dtype[np.floating] | None) -> Precision:
    """The precision of doubles (n, n) that stand for floats of a shorter type; None of doubles."""
    if floats is None:
        return Precision()

    def half_unit(numbers: Array) -> Array:
        spacings = np.spacing(np.abs(numbers).astype(floats)).astype(float)
        return np.where(numbers == 0.0, 0.0, spacings / 2.0)

    digits = int((np.finfo(floats).nmant + 1) * np.log10(2.0))
    return Precision(digits, _errors(matrix, half_unit))


def precision_of_decimals(matrix: Matrix, decimals: int) -> Precision:
    """The precision of entries (n, n) that are written to `decimals` decimals, whatever their size.

    Its digits are those of the smallest entry that is not zero; without one those of 1.
    """
    from scipy.sparse import csc_array

    unit = 10.0**-decimals

    def half_unit(numbers: Array) -> Array:
        return np.where(numbers == 0.0, 0.0, unit / 2.0 + np.spacing(np.abs(numbers)) / 2.0)

    errors = _errors(matrix, half_unit)
    sizes = np.abs(csc_array(matrix).data)
    smallest = sizes[sizes > 0.0].min() if sizes.any() else 1.0
    # 1e-9: the logarithm of a power of ten may be rounded to just below a whole number
    return Precision(int(np.log10(smallest / unit) + 1e-9) + 1, errors)


def _errors(matrix: Matrix, half_unit: Callable[[Array], Array]) -> csc_array:
    """The errors of entries (n, n): `half_unit` of real parts, plus that of imaginary parts."""
    from scipy.sparse import csc_array

    X = csc_array(matrix)
    errors = half_unit(X.data.real)
    if np.iscomplexobj(X.data):
        errors += half_unit(X.data.imag)
    return csc_array((errors, X.indices, X.indptr), shape=X.shape)
