"""Whether factors of terms bend so much over a step that roots may do what its ends do not tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.linear.continuation import (
    DAMPED,
    UNDAMPED,
    ComplexArray,
    Continuation,
    SpectrumAtParameter,
)
from squeal.linear.matrices import Change, dense
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.steps import Step
from squeal.linear.system import SystemFunction, TermSystem
from squeal.numerics.differentiation import Formula


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor of terms as a function of the free parameter.

    name: of the parameter; values: of all parameters; change: what it multiplies in M, C and K.
    """

    formula: Formula | Modulus | Tabulated
    name: str
    values: dict[str, float]
    change: Change

    def largest_curvature(self, low: float, high: float) -> float:
        """A bound of |its second derivative| from low to high."""
        return float(self.formula.curvature(self.values, self.name, low, high))

    def slope_size(self, p: float) -> float:
        """|its first derivative| at a value."""
        return float(abs(self.formula.slope(self.values | {self.name: p}, self.name)))


def factors_of(system: SystemFunction) -> list[Factor]:
    """The factors that depend on the free parameter, each once; none of a plain function.

    Each multiplies the sum of the matrices of its terms, for M, C and K.
    """
    if not isinstance(system, TermSystem):
        return []
    formulas = {term.factor.text: term.factor for term in system.terms}
    factors = []
    for text, formula in formulas.items():
        if system.parameter not in formula.names:
            continue
        sums = [np.zeros((system.n, system.n)) for _ in system.parts]
        for i, terms in enumerate(system.parts):
            for term in terms:
                if term.factor.text == text:
                    sums[i] = sums[i] + dense(term.matrix)
        change = (sums[0], sums[1], sums[2])
        factors.append(Factor(formula, system.parameter, system.values(), change))
    return factors


def bends_within(continuation: Continuation, step: Step, factor: Factor) -> bool:
    """True if a factor bends so much within a step that roots may do what its ends do not tell.

    A factor whose slope changes over the step by at most a quarter of itself moves the roots as a
    straight one does. Another one may deviate from a straight line by curvature length^2 / 8: it is
    checked what that may do to the roots at both ends. Systems of more than 40 rows, whose range is
    proved on request only, need this guard.
    """
    before = step.before
    after = step.after
    length = after.value - before.value
    curvature = factor.largest_curvature(before.value, after.value)
    if not curvature < np.inf:  # no bound is known
        return True
    smaller_slope = min(factor.slope_size(before.value), factor.slope_size(after.value))
    if 4 * curvature * length <= smaller_slope:
        return False
    deviation = curvature * length**2 / 8
    for state in (before, after):
        if _may_change(state, continuation.couplings(state, factor.change), deviation):
            return True
    return False


def _may_change(state: SpectrumAtParameter, W: ComplexArray, deviation: float) -> bool:
    """True if two roots may meet on the line, or one cross it, while a factor deviates.

    The deviation pulls two roots at a distance g towards each other by h, their coupling included.

    - With damping a root may cross the line if it lies within twice the sum of its own movement and
      of sqrt(g h), by which a root that is near (4 h > g) may move it.
    - Without damping two roots on the line, or two conjugate ones, may meet there if 4 h > g.
    - A real root s = -lambda^2 may pass zero within twice its own movement.

    Roots on the line, pairs that are one and roots of zero at the state itself are left out in
    these cases, in this order: the spectrum there shows them.

    Parameters
    ----------
    state : SpectrumAtParameter
        One end of a step.
    W : array (m, m)
        What the factor multiplies, in the eigenvectors of the state: its slopes of the roots on the
        diagonal, their couplings beside it.
    deviation : float
        By how much the factor may deviate.
    """
    z = state.roots
    slopes = W.diagonal()
    distances = np.abs(z[:, None] - z)  # g
    # the difference of two roots per unit of the factor: by their slopes, and by their coupling
    relative = np.abs(slopes[:, None] - slopes) + 2 * np.sqrt(np.abs(W * W.T))
    pull = deviation * relative  # h
    if state.problem is DAMPED:
        by_coupling = np.sqrt(np.where(4 * pull > distances, distances * pull, 0.0)).max(axis=1)
        reach = 2 * (deviation * np.abs(slopes.real) + by_coupling)
        return bool(np.any(reach > np.abs(z.real), where=~state.on_line))
    conjugate = np.abs(z[:, None] - z.conj()) <= np.add.outer(state.rounding, state.rounding)
    pairs = (state.on_line[:, None] & state.on_line) | conjugate
    if np.any(pairs & ~state.close & (4 * pull > distances)):
        return True
    if state.problem is not UNDAMPED:
        return False
    may_pass_zero = state.real & (np.abs(z) > state.rounding)
    return bool(np.any(2 * deviation * np.abs(slopes) > np.abs(z), where=may_pass_zero))
