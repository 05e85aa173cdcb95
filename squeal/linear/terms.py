"""Terms of a system: matrices times a formula, with how far their entries are known.

They are made from arrays and data frames by `read_terms`, and from other terms by `Term.mapped` and
`sum_of_terms`. A factor may be complex and depend on the frequency.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.linear.labels import Label, labels_of, refuse_other_labels
from squeal.linear.matrices import Matrix, given_matrix, is_sparse
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.precision import half_units, precision_of_floats, short_floats
from squeal.numerics.differentiation import ONE, Formula
from squeal.schema import TEXT, Place


class SparseMatrix(Protocol):
    """A SciPy sparse array or matrix."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def tocsc(self) -> Any: ...


@dataclass(frozen=True, eq=False)
class Term:
    """A copy of a finite matrix (n, n), and the formula or complex modulus that multiplies it.

    `digits` are the significant digits to which its entries are known, None if they are exact.
    `rounding` is how far rounding may have moved each entry where the matrix was computed from
    others. `errors` (n, n) are how far each entry may be off by the digits of the data; None if it
    is half a unit of the last digit, as in a file. `mapped` and `sum_of_terms`, which make a term
    from others, carry all three along. `name` is what damping is called that has no matrix in the
    file.

    Examples
    --------
    >>> import numpy as np
    >>> friction = Term(np.array([[0.0, 1.0], [0.0, 0.0]]), Formula("mu / 2"))
    >>> friction.factor.value({"mu": 0.5})
    0.25
    """

    matrix: Matrix = field(repr=False)
    factor: Formula | Modulus | Tabulated = ONE
    digits: int | None = None
    rounding: float = 0.0
    errors: Matrix | None = field(default=None, repr=False)
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", given_matrix(self.matrix).copy())
        if self.errors is None:
            return
        from scipy.sparse import csc_array

        errors = csc_array(self.errors)
        is_known = np.all((errors.data >= 0.0) & (errors.data < np.inf))
        if self.digits is None or not is_known:
            raise InputError(
                "Term: errors: must be finite numbers of at least 0, with the digits of the data "
                "beside them"
            )
        object.__setattr__(self, "errors", errors)

    @property
    def data_errors(self) -> Matrix | None:
        """How far digits of data leave each entry open (n, n), sparse; None of exact entries."""
        if self.digits is None:
            return None
        return half_units(self.matrix, self.digits) if self.errors is None else self.errors

    def mapped(
        self,
        change: Callable[[Matrix], Matrix],
        size: Callable[[Matrix], Matrix] | None = None,
        factor: Formula | None = None,
    ) -> Term:
        """The term with a linear map of its matrix, and the errors of the new entries.

        Parameters
        ----------
        change : callable
            The map, such as that to some of the rows.
        size : callable, optional
            From the sizes of entries (n, n) to bounds of the sizes of the new entries: the map with
            absolute values of its factors, such as |V|' X |V| of V' X V. It is left out for a map
            that only moves or averages entries.
        factor : Formula, optional
            Another factor than that of the term.

        Examples
        --------
        >>> import numpy as np
        >>> term = Term(np.array([[1.23457, 0.0], [0.0, 1.0]]), digits=6)
        >>> half = term.mapped(lambda X: X / 2, lambda X: X / 2)
        >>> half.digits, half.data_errors.toarray()[0, 0].round(9)
        (6, np.float64(2.5e-06))
        """
        from scipy.sparse import eye_array

        # entries that are moved or averaged keep their digits. Of others the digits say nothing, so
        # that the errors that they leave are mapped
        errors = self.errors if size is None else self.data_errors
        rounding = self.rounding
        if errors is not None:
            errors = (size or change)(errors)
        if rounding and size is not None:
            # all entries may be off by `rounding`, so that the map of a matrix of ones is needed.
            # Its largest entry is at most that of the map of n I, which is sparse: of |V|' X |V| by
            # the inequality of Cauchy and Schwarz, (sum |v_i|)^2 <= n sum |v_i|^2
            n = self.matrix.shape[0]
            rounding *= float(size(n * eye_array(n)).max())
        return Term(change(self.matrix), factor or self.factor, self.digits, rounding, errors)


def sum_of_terms(
    matrix: Matrix, factor: Formula | Modulus | Tabulated, parts: Sequence[tuple[float, Term]]
) -> Term:
    """A term whose matrix (n, n) is a sum of multiples of others, with the errors of its entries.

    matrix: the sum; factor: that of the new term; parts: of each summand, the number that
    multiplies a term, and the term.
    """
    digits = [term.digits for _, term in parts if term.digits is not None]
    errors: Matrix | None = None
    for weight, term in parts:
        of_term = term.data_errors
        if of_term is not None:
            of_term = abs(weight) * of_term
            errors = of_term if errors is None else errors + of_term
    rounding = sum(abs(weight) * term.rounding for weight, term in parts)
    return Term(matrix, factor, min(digits, default=None), rounding, errors)


SystemMatrix = ArrayLike | Sequence[object] | SparseMatrix | Mapping[str, object] | tuple[Term, ...]
"""A matrix as `System` takes it: one array, arrays by their factors, or terms."""


def are_terms(matrix: object) -> bool:
    """True for a matrix in the form of a tuple of terms."""
    return isinstance(matrix, tuple) and all(isinstance(term, Term) for term in matrix)


def read_terms(
    matrices: Mapping[str, Any],
) -> tuple[dict[str, tuple[Term, ...]], tuple[Label, ...]]:
    """The terms of M, C and K, and the labels of their rows.

    Raises InputError for what is no matrix, and for data frames whose labels differ.

    Parameters
    ----------
    matrices : mapping of str to terms, array or mapping of formulas to arrays
        By the letters M, C and K. Terms are taken as they are, an array has the factor 1.

    Returns
    -------
    parts : dict of str to tuple of Term
        By the same letters.
    labels : tuple
        Those of data frames, empty without.
    """
    parts: dict[str, tuple[Term, ...]] = {}
    labels: dict[str, list[Label]] = {}  # of rows and columns, by what messages call them
    for part, value in matrices.items():
        if are_terms(value):
            parts[part] = value
            continue
        has_factors = isinstance(value, Mapping) and not is_sparse(value)
        arrays = value if has_factors else {"1": value}
        terms = []
        with Place("System", part).prefixing_errors():
            for factor, array in arrays.items():
                array_labels = labels_of(array)
                if array_labels is not None:
                    name = f"{part} {factor}" if has_factors else part
                    labels[f"index of {name}"] = array_labels[0]
                    labels[f"columns of {name}"] = array_labels[1]
                matrix = given_matrix(array, real=part == "M")
                formula = Formula(TEXT.read(factor, Place("factor")))
                digits, errors = precision_of_floats(matrix, short_floats(array))
                terms.append(Term(matrix, formula, digits, errors=errors))
        parts[part] = tuple(terms)
    with Place("System").prefixing_errors():
        refuse_other_labels(labels)
    first_labels = next(iter(labels.values()), [])  # all others are the same
    return parts, tuple(first_labels)
