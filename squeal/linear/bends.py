"""Whether factors of terms bend so much over a step that roots may do what its ends do not tell.

A root z is -lambda^2 of an undamped system, -i lambda of an undamped gyroscopic one and lambda of
any other, see `continuation`. The line on which nothing grows or decays is the real axis of the
first two, of an undamped one from 0 up (below, it diverges), and the imaginary axis of the third.
What cannot be told from the ends is that two roots meet on the line, or that one crosses it or
leaves it at its end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.linear.continuation import DAMPED, UNDAMPED, Continuation, SpectrumAtParameter
from squeal.linear.functions import SystemFunction
from squeal.linear.matrices import MCK, Array, dense
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.roots import ComplexArray
from squeal.linear.steps import Step
from squeal.linear.system import System
from squeal.numerics.differentiation import Formula


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor of terms as a function of the free parameter.

    name: of the parameter; values: of all parameters; change: what it multiplies in M, C and K.
    """

    formula: Formula | Modulus | Tabulated
    name: str
    values: dict[str, float]
    change: MCK

    def deviation(self, low: float, high: float) -> float:
        """By how much it may deviate from a straight line between two values of the parameter.

        0 if its slope changes by at most a quarter of itself, so that roots move as by a straight
        factor; inf if no bound is known.
        """
        curvature = self.formula.curvature(self.values, self.name, low, high)
        slopes = [self.formula.slope(self.values | {self.name: p}, self.name) for p in (low, high)]
        length = high - low
        if 4 * curvature * length <= min(map(abs, slopes)):
            return 0.0
        return float(curvature * length**2 / 8)


def factors_of(system: SystemFunction) -> list[Factor]:
    """The factors that depend on the free parameter, each once; none of a plain function.

    Each multiplies the sum of the matrices of its terms, for M, C and K.
    """
    if not isinstance(system, System):
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

    At both ends it is estimated what its deviation from a straight line, more or less of it, does
    to the roots there. This guard is for ranges that nobody proves unasked: those of systems of
    more than 40 rows, and of factors that are tabulated over the parameter.
    """
    deviation = factor.deviation(step.before.value, step.after.value)
    if deviation in (0.0, np.inf):
        return deviation > 0.0
    for spectrum in (step.before, step.after):
        couplings = continuation.couplings(spectrum, factor.change)
        if _may_leave_line(spectrum, couplings, deviation):
            return True
    return False


def _may_leave_line(spectrum: SpectrumAtParameter, W: ComplexArray, deviation: float) -> bool:
    """True if two roots may meet on the line, or one cross it, while a factor deviates by so much.

    To first order a root moves by the deviation times its slope. Two move towards each other by the
    deviation times the difference of their slopes and twice their coupling: that is their pull.

    Parameters
    ----------
    spectrum : SpectrumAtParameter
        At one end of a step, with m roots z.
    W : array (m, m)
        The matrices that the factor multiplies, in the eigenvectors of the spectrum: the slopes of
        its z per unit of the factor on the diagonal, their couplings beside it.
    deviation : float
        By how much the factor may deviate.
    """
    slopes = W.diagonal()
    coupling = np.sqrt(np.abs(W * W.T))  # of roots k and l: sqrt |W_kl W_lk|
    pulls = deviation * (np.abs(slopes[:, None] - slopes) + 2 * coupling)
    if spectrum.problem is DAMPED:
        return _may_cross_axis(spectrum, deviation * np.abs(slopes.real), pulls)
    if _may_meet_on_line(spectrum, pulls):
        return True
    if spectrum.problem is UNDAMPED:
        return _real_root_may_pass_zero(spectrum, deviation * np.abs(slopes))
    return False  # gyroscopic: real roots of either sign are frequencies


def _may_cross_axis(spectrum: SpectrumAtParameter, movements: Array, pulls: Array) -> bool:
    """True if a root of a damped system may cross the imaginary axis; those on it are left out.

    Another root at a distance g pulls a root by h (m, m) and, if it is near, 4 h > g, moves it by
    sqrt(g h). A root may cross if it lies from the axis within twice the sum of this and of its own
    movement towards the axis (m,).
    """
    distances = np.abs(spectrum.z[:, None] - spectrum.z)
    by_coupling = np.sqrt(np.where(4 * pulls > distances, distances * pulls, 0.0)).max(axis=1)
    reach = 2 * (movements + by_coupling)
    return bool(np.any(reach > np.abs(spectrum.z.real), where=~spectrum.on_line))


def _may_meet_on_line(spectrum: SpectrumAtParameter, pulls: Array) -> bool:
    """True if two roots of a system without damping, both on the line or conjugate, may meet on it.

    They may if four times their pull (m, m) exceeds their distance; roots that are one already are
    left out.
    """
    z = spectrum.z
    distances = np.abs(z[:, None] - z)
    pairs = (spectrum.on_line[:, None] & spectrum.on_line) | spectrum.conjugate
    return bool(np.any(pairs & ~spectrum.close & (4 * pulls > distances)))


def _real_root_may_pass_zero(spectrum: SpectrumAtParameter, movements: Array) -> bool:
    """True if a real root z = -lambda^2 that is not zero may pass zero, where divergence begins:
    it lies within twice its movement (m,)."""
    sizes = np.abs(spectrum.z)
    is_real = spectrum.z_is_real & (sizes > spectrum.rounding)
    return bool(np.any(2 * movements > sizes, where=is_real))
