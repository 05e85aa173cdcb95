"""Crossings of the imaginary axis located on the full system, from a good guess.

Bordered by the vectors of a mode, P(lambda, p) stays regular where it is singular: in
[[P, b], [c^H, 0]] [x; g] = [0; 1] the number g vanishes exactly at the roots, with
dg = -y^H dP x. Newton's method on g(i omega, p) = 0, a complex equation for two real unknowns,
converges to the crossing to rounding. Next to it one factorisation serves several steps: what it
solves is refined until the residual is rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.linear.matrices import EPS
from squeal.sparse.factor import Factor, factorise
from squeal.sparse.quadratic import ComplexArray, Quadratic
from squeal.sparse.scaled import ScaledSystem

STEPS = 20
CONVERGED = 1e-12  # step relative to p and omega; Newton's error is its square
NEAR = 1e-3  # of p and omega: a step after which the factorisation serves once more, refined
REFINEMENTS = 8
REFINED = 4 * EPS  # residual of a refined solution, of the sizes of what it is the difference of
ROUNDING = 2 * EPS  # of the entries of the matrices and of a solution, for the interval


@dataclass(frozen=True, eq=False)
class AxisCrossing:
    """A pair or a real root of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p).
    """

    value: float
    omega: float  # rad/s, 0 for a real root
    direction: str  # up: growth begins with rising p; down: it ends
    slope: float
    interval: tuple[float, float]
    residual: float
    vector: ComplexArray = field(repr=False)  # (n,) in the scaled coordinates, of unit length

    @property
    def kind(self) -> str:
        """flutter for a pair, divergence for a real root."""
        return "flutter" if self.omega else "divergence"

    @property
    def frequency_hz(self) -> float:
        """omega / (2 pi)."""
        return self.omega / (2 * math.pi)


class _Bordered:
    """P(lambda) with its border; g and the vectors that its derivatives need.

    `other` lends its border and factorisation if what they solve can be refined.
    """

    def __init__(
        self,
        problem: Quadratic,
        value: complex,
        b: ComplexArray,
        c: ComplexArray,
        other: _Bordered | None = None,
    ):
        self.problem, self.value, n = problem, value, problem.n
        self.size = sum(s * abs(value) ** k for s, k in zip(problem.norms, (2, 1, 0), strict=True))
        scale = 2.0 ** round(math.log2(self.size)) if other is None else other.scale
        self.scale: float = scale
        whole = _with_border(problem.at(value), scale * b, scale * c.conj())
        end = np.zeros(n + 1, dtype=complex)
        end[n] = scale
        right: ComplexArray | None = None
        left: ComplexArray | None = None
        if other is not None:
            self.factor: Factor = other.factor
            right, left = (_refined(self.factor, whole, end, t) for t in (False, True))
        if right is None or left is None:
            self.factor = factorise(whole)
            right, left = (self.factor.solve(end, t) for t in (False, True))
        self.x, self.g, self.w = right[:n], right[n] * scale, left[:n]
        self.noise = ROUNDING * self.size * float(np.linalg.norm(self.x) * np.linalg.norm(self.w))

    def slope(self, matrix: Any) -> complex:
        """dg for a change `matrix` of P."""
        return complex(-(self.w @ (matrix @ self.x)))


def _with_border(P: Any, column: ComplexArray, row: ComplexArray) -> Any:
    """[[P, column], [row, 0]] of a CSC array P (n, n)."""
    from scipy.sparse import csc_array

    n, counts = P.shape[0], np.diff(P.indptr)
    starts = P.indptr + np.arange(n + 1)  # each column has one entry more
    inside = np.arange(P.nnz) + np.repeat(np.arange(n), counts)
    data = np.empty(P.nnz + 2 * n, dtype=complex)
    rows = np.empty(P.nnz + 2 * n, dtype=P.indices.dtype)
    data[inside], rows[inside] = P.data, P.indices
    data[starts[1:] - 1], rows[starts[1:] - 1] = row, n
    data[starts[n] :], rows[starts[n] :] = column, np.arange(n)
    return csc_array((data, rows, np.append(starts, P.nnz + 2 * n)), shape=(n + 1, n + 1))


def _refined(
    factor: Factor, matrix: Any, end: ComplexArray, transposed: bool
) -> ComplexArray | None:
    """The solution of matrix (or matrix') x = end by the factor of one nearby; None if it does
    not converge."""
    matrix = matrix.T if transposed else matrix
    size = float(abs(matrix).sum(axis=1).max())
    x = factor.solve(end, transposed)
    for _ in range(REFINEMENTS):
        rest = end - matrix @ x
        if np.abs(rest).max() <= REFINED * (size * np.abs(x).max() + np.abs(end).max()):
            return x
        x = x + factor.solve(rest, transposed)
    return None


def axis_crossing(
    scaled: ScaledSystem,
    name: str,
    value: float,
    omega: float,
    right: ComplexArray,
    left: ComplexArray,
) -> AxisCrossing:
    """The crossing of the axis next to a guess: parameter `name` at `value`, omega (rad/s; 0 for a
    real root), right and left vectors (n,) in the scaled coordinates.

    Raises ComputationError if Newton's method does not converge (no crossing is near, or two
    coincide).
    """
    c, b = right / np.linalg.norm(right), left / np.linalg.norm(left)
    p, w, real = float(value), float(omega), omega == 0.0
    scale_p = abs(p) or 1.0
    last: _Bordered | None = None
    for _ in range(STEPS):
        at = {name: p}
        problem = scaled.at(at)
        root = complex(0.0, w)
        try:
            bordered = _Bordered(problem, root, b, c, last)
        except ZeroDivisionError:
            break
        g_lambda = bordered.slope(problem.slope(root))
        g_p = bordered.slope(scaled.slope(name, at, root))
        if real:
            jacobian = np.array([[1.0, g_p.real], [0.0, g_p.imag]])
            step = -bordered.g.real / g_p.real if g_p.real else math.inf
            moves = np.array([0.0, step])
            amplification = 1.0 / abs(g_p.real) if g_p.real else math.inf
        else:
            along = 1j * g_lambda
            jacobian = np.array([[along.real, g_p.real], [along.imag, g_p.imag]])
            sizes = np.abs(jacobian).max(axis=0)
            if not sizes.all() or np.linalg.cond(jacobian / sizes) > 1e12:
                break
            moves = np.linalg.solve(jacobian, [-bordered.g.real, -bordered.g.imag])
            amplification = float(np.abs(np.linalg.inv(jacobian)[1]).sum())
        if not np.all(np.isfinite(moves)):
            break
        near = abs(moves[1]) <= NEAR * max(abs(p), scale_p) and abs(moves[0]) <= NEAR * abs(w)
        last = bordered if near else None
        shape = bordered.x / np.linalg.norm(bordered.x)
        if last is None:
            c, b = shape, bordered.w.conj() / np.linalg.norm(bordered.w)
        small = abs(moves[1]) <= CONVERGED * max(abs(p), scale_p)
        small &= abs(moves[0]) <= CONVERGED * max(abs(w), 1.0)
        w, p = w + float(moves[0]), p + float(moves[1])
        uncertain = bordered.noise * amplification
        if small or abs(moves[1]) <= uncertain:
            slope = -(g_p / g_lambda).real
            residual = problem.backward_errors(np.array([root]), shape[:, None])[0]
            half = uncertain + abs(float(moves[1])) + 2 * EPS * abs(p)
            return AxisCrossing(
                p,
                abs(w),
                "up" if slope > 0 else "down",
                float(slope),
                (p - half, p + half),
                float(residual),
                shape,
            )
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {value:.9g} at "
        f"{omega / (2 * math.pi):.6g} Hz"
    )
