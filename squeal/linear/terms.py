"""Systems M, C(p), K(p) whose matrices are sums of factors in named parameters times matrices.

M q'' + C q' + K q = 0 with M = sum_i f_i(p) M_i and so on, f_i a formula; dense or sparse. Called
with one value of its free parameter such a system is a `System` like any other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from squeal.errors import InputError, MatrixError
from squeal.numerics.formula import ONE, Formula

Matrix = Any
"""A square NumPy array or SciPy sparse array (n, n)."""


MOST = {"C": 1e150, "K": 1e300}  # sizes over that of M, of roots up to 1e150 rad/s


def is_sparse(matrix: Matrix) -> bool:
    """True for a SciPy sparse array or matrix."""
    return hasattr(matrix, "tocsc")


def dense(matrix: Matrix) -> np.ndarray:
    """The matrix as a NumPy array."""
    return np.asarray(matrix.toarray() if is_sparse(matrix) else matrix)


@dataclass(frozen=True, eq=False)
class Term:
    """One matrix (n, n) and the formula that it is multiplied with."""

    matrix: Matrix = field(repr=False)
    factor: Formula = ONE

    @property
    def constant(self) -> bool:
        """True if the factor depends on no parameter."""
        return not self.factor.names


@dataclass(frozen=True, eq=False)
class TermSystem:
    """M(p) q'' + C(p) q' + K(p) q = 0; C may have no terms (undamped).

    Raises InputError when made if matrices differ in shape or a factor names no parameter.
    """

    M: tuple[Term, ...]
    C: tuple[Term, ...]
    K: tuple[Term, ...]
    parameters: Mapping[str, float] = field(default_factory=dict)
    parameter: str = "mu"
    name: str = ""

    def __post_init__(self) -> None:
        if not self.M or not self.K:
            raise InputError("M and K: at least one matrix each is required")
        values = {self.parameter: 0.0} | dict(self.parameters)
        object.__setattr__(self, "parameters", values)
        shape = self.M[0].matrix.shape
        for letter, _, term in self._all():
            if term.matrix.shape != shape or shape[0] != shape[1] or not shape[0]:
                raise InputError(
                    f"{letter}: shape {term.matrix.shape}; every matrix must be square and of "
                    f"the shape of the first M, {shape}"
                )
            for name in sorted(term.factor.names - values.keys()):
                raise InputError(
                    f"{letter}: factor {term.factor.text}: {name} is no parameter; allowed are "
                    f"{', '.join(sorted(values))}"
                )

    def _all(self) -> Iterator[tuple[str, int, Term]]:
        for letter in ("M", "C", "K"):
            for index, term in enumerate(getattr(self, letter)):
                yield letter, index, term

    @property
    def names(self) -> frozenset[str]:
        """Parameters that some matrix depends on."""
        return frozenset().union(*(term.factor.names for _, _, term in self._all()))

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.M[0].matrix.shape[0])

    @property
    def sparse(self) -> bool:
        """True if any matrix is sparse; the sums are then sparse too."""
        return any(is_sparse(term.matrix) for _, _, term in self._all())

    @property
    def real(self) -> bool:
        """True if all matrices are real, so that roots come in conjugate pairs."""
        return not any(np.iscomplexobj(term.matrix) for _, _, term in self._all())

    def values(self, changes: Mapping[str, float] | None = None) -> dict[str, float]:
        """The parameters with some of them changed. Raises InputError for an unknown name."""
        for name in changes or {}:
            if name not in self.parameters:
                raise InputError(
                    f"{name}: is no parameter; allowed are {', '.join(sorted(self.parameters))}"
                )
        return dict(self.parameters) | dict(changes or {})

    def replace(self, changes: Mapping[str, float]) -> TermSystem:
        """The same system with other values of some parameters."""
        return dataclasses.replace(self, parameters=self.values(changes))

    def simplified(self) -> TermSystem:
        """The same system with one term for each factor, all constant ones in a single term."""
        parts = []
        for terms in self._parts():
            groups: dict[str, list[Term]] = {}
            for term in terms:
                groups.setdefault("" if term.constant else term.factor.text, []).append(term)
            parts.append(
                tuple(
                    Term(
                        self._sum(same, [1.0 if text else t.factor.value({}) for t in same]),
                        same[0].factor if text else ONE,
                    )
                    for text, same in groups.items()
                )
            )
        M, C, K = parts
        return dataclasses.replace(self, M=M, C=C, K=K)

    def at(
        self, changes: Mapping[str, float] | None = None
    ) -> tuple[Matrix, Matrix | None, Matrix]:
        """M, C, K (C None without terms) at the parameters, some of them changed.

        Raises InputError where their sizes are beyond what can be computed with.
        """
        p = self.values(changes)
        with np.errstate(over="ignore", invalid="ignore"):
            M, C, K = (
                self._sum(terms, [t.factor.value(p) for t in terms]) for terms in self._parts()
            )
        self.check_sizes(p, *(0.0 if X is None else _largest(X) for X in (M, C, K)))
        return M, C, K

    def arrays(
        self, changes: Mapping[str, float] | None = None
    ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
        """The same as NumPy arrays."""
        M, C, K = self.at(changes)
        return dense(M), None if C is None else dense(C), dense(K)

    def check_sizes(
        self, p: Mapping[str, float], mass: float, damping: float, stiffness: float
    ) -> None:
        """Refuse matrices of sizes whose roots cannot be computed at parameters p.

        Raises InputError naming the parameters.
        """
        for letter, size in (("M", mass), ("C", damping), ("K", stiffness)):
            finite, most = bool(np.isfinite(size)), MOST.get(letter, np.inf)
            if finite and not (mass and size / most > mass):
                continue
            names = sorted(self.names) or sorted(self.parameters)
            where = ", ".join(f"{name} = {p[name]:g}" for name in names)
            allowed = f"at most {most:g} times that of M" if finite else "finite"
            raise MatrixError(
                f"{letter}: entries of size {size:.3g} at {where} are not allowed; their size must "
                f"be {allowed}"
            )

    def __call__(self, value: float) -> tuple[Matrix, Matrix | None, Matrix]:
        """M, C, K at a value of the free parameter."""
        return self.at({self.parameter: value})

    def derivative(
        self, name: str, changes: Mapping[str, float] | None = None
    ) -> tuple[Matrix | None, Matrix | None, Matrix | None]:
        """Derivatives of M, C, K by a parameter, exact; None where they vanish."""
        p = self.values(changes)
        if name not in p:
            self.values({name: 0.0})  # refuses
        result = []
        for terms in self._parts():
            moved = [t for t in terms if name in t.factor.names]
            result.append(self._sum(moved, [t.factor.slope(p, name) for t in moved]))
        return result[0], result[1], result[2]

    def _parts(self) -> tuple[tuple[Term, ...], ...]:
        return self.M, self.C, self.K

    def _sum(self, terms: tuple[Term, ...] | list[Term], factors: list[float]) -> Matrix | None:
        if not terms:
            return None
        if not self.sparse:
            return sum(
                (f * np.asarray(t.matrix) for f, t in zip(factors, terms, strict=True)),
                np.zeros((self.n, self.n)),
            )
        from scipy.sparse import csc_array

        total = csc_array((self.n, self.n))
        for factor, term in zip(factors, terms, strict=True):
            if factor:
                total = total + factor * csc_array(term.matrix)
        return total


def _largest(X: Matrix) -> float:
    """Size of the largest entry, NaN if one is."""
    entries = X.data if is_sparse(X) else X
    return float(np.abs(entries).max(initial=0.0))
