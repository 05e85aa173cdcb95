"""Whether factors of terms bend so much over a step that it may hide a change of stability.

A root z is -lambda^2 of an undamped system, -i lambda of an undamped gyroscopic one and lambda of
any other, see `continuation`. The line on which nothing grows or decays is the real axis of the
first two, of an undamped one from 0 up (below, it diverges), and the imaginary axis of the third.
Such a change is that two roots meet on the line, or that one crosses it or leaves it at its end; it
is hidden where the spectra at both ends of the step show no sign of it.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.linear.continuation import DAMPED, UNDAMPED, Continuation, SpectrumAtParameter
from squeal.linear.functions import SystemFunction
from squeal.linear.matrices import MCK, Array, dense
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.roots import ComplexArray
from squeal.linear.steps import Step
from squeal.linear.system import System
from squeal.numerics.differentiation import Formula

NEGLECTED_SHARE = 0.05
"""How far a factor may leave the range of its values at two neighbours, over its whole range."""
NEGLECTED_OF_SIZE = 1e-6
"""... over its size, so that rounding of a factor that is constant does not count."""
HALVINGS = 8
"""How often the interval of two values is halved until bounds of a factor are narrow enough."""


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor of terms of a system as a function of the free parameter."""

    system: System
    formula: Formula | Modulus | Tabulated

    @cached_property
    def matrices(self) -> MCK:
        """The matrices (n, n) that it multiplies in M, C and K: sums over the terms with it."""
        sums = []
        for terms in self.system.parts:
            total = np.zeros((self.system.n, self.system.n))
            for term in terms:
                if term.factor.text == self.formula.text:
                    total = total + dense(term.matrix)
            sums.append(total)
        M, C, K = sums
        return M, C, K

    def _parameters(self, value: float) -> dict[str, float]:
        """All parameters at a value of the free one."""
        return self.system.values() | {self.system.parameter: value}

    def points(self, values: Sequence[float]) -> Array:
        """The factor at m values of the parameter, real and imaginary part as columns (m, 2)."""
        numbers = [self.formula.value(self._parameters(value)) for value in values]
        return np.array([[number.real, number.imag] for number in numbers])

    def chord_error(self, low: float, high: float) -> float:
        """How far the factor may lie from its chord between two values of the parameter.

        It is the error of linear interpolation, max |f''| (high - low)^2 / 8; inf if no bound of
        f'' is known.
        """
        name = self.system.parameter
        curvature = self.formula.curvature(self._parameters(low), name, low, high)
        return float(curvature * (high - low) ** 2 / 8)

    def deviation(self, low: float, high: float) -> float:
        """As `chord_error`, but 0 if the slope changes by a quarter of itself at most, so that
        roots move as they would for a linear factor.

        The slope changes by max |f''| (high - low) at most, which is 8 errors / (high - low).
        """
        error = self.chord_error(low, high)
        name = self.system.parameter
        slopes = [abs(self.formula.slope(self._parameters(p), name)) for p in (low, high)]
        if 32 * error <= (high - low) * min(slopes):
            return 0.0
        return error

    def stays_within(
        self, box: tuple[Array, Array], ends: tuple[float, float], halvings: int = HALVINGS
    ) -> bool:
        """True if the factor is known to stay within a box between two values of the parameter.

        It does if its values at both, widened by `chord_error`, lie in the box. Otherwise each half
        of the interval is examined in the same way, down to intervals halved `halvings` times. If
        no bound of the error is known even there (inf), as of mu**1.5 from 0, the values decide.

        Parameters
        ----------
        box : (lowest, highest)
            Bounds of the real and of the imaginary part, arrays (2,).
        ends : (low, high)
            The two values of the parameter.
        """
        lowest, highest = box
        low, high = ends
        error = self.chord_error(low, high)
        at_ends = self.points(ends)  # (2, 2): real and imaginary part at each end
        if not halvings and math.isinf(error):
            error = 0.0
        if np.all(at_ends - error >= lowest) and np.all(at_ends + error <= highest):
            return True
        if not halvings:
            return False
        middle = (low + high) / 2
        halves = ((low, middle), (middle, high))
        return all(self.stays_within(box, half, halvings - 1) for half in halves)


def factors_of(system: SystemFunction) -> list[Factor]:
    """The factors that depend on the free parameter, each once; none of a plain function."""
    if not isinstance(system, System):
        return []
    formulas = {term.factor.text: term.factor for term in system.terms}
    depending = [formula for formula in formulas.values() if system.parameter in formula.names]
    return [Factor(system, formula) for formula in depending]


def undersampled_factor(system: System, values: Sequence[float]) -> str | None:
    """The text of the first factor for which a sequence of values is too coarse; None without one.

    It is too coarse if the factor may rise and fall again between two neighbouring values: if its
    real or its imaginary part may leave the range from its value at the one to that at the other
    by more than a margin. The margin is the larger of the share `NEGLECTED_SHARE` of the factor's
    range over all values and the share `NEGLECTED_OF_SIZE` of its size.

    values: of the free parameter, rising.
    """
    for factor in factors_of(system):
        sampled = factor.points(values)  # (values, 2): real and imaginary parts
        of_range = NEGLECTED_SHARE * np.ptp(sampled, axis=0).max()
        margin = max(of_range, NEGLECTED_OF_SIZE * np.abs(sampled).max())
        for ends in itertools.pairwise(values):
            at_ends = factor.points(ends)  # (2, 2)
            # the lowest and the highest real and imaginary part that the factor may have
            box = (np.min(at_ends, axis=0) - margin, np.max(at_ends, axis=0) + margin)
            if not factor.stays_within(box, ends):
                return factor.formula.text
    return None


def bends_within(continuation: Continuation, step: Step, factor: Factor) -> bool:
    """True if a factor bends so much within a step that it may hide a change of stability.

    Within the step the factor lies off its chord by its deviation at most. At both ends we estimate
    how far this moves the roots. The guard matters where no proof follows unless it is requested:
    for systems of more than 40 rows, and for factors that are tabulated over the parameter.
    """
    deviation = factor.deviation(step.before.value, step.after.value)
    if deviation == 0.0:
        return False
    if math.isinf(deviation):  # no bound is known
        return True
    for spectrum in (step.before, step.after):
        couplings = continuation.couplings(spectrum, factor.matrices)
        if _may_leave_line(spectrum, couplings, deviation):
            return True
    return False


def _may_leave_line(spectrum: SpectrumAtParameter, W: ComplexArray, deviation: float) -> bool:
    """True if two roots may meet on the line, or one cross it, as a factor leaves its chord.

    To first order a root moves by the deviation times its slope. The distance of two roots z_k, z_l
    of [[z_k, 0], [0, z_l]] + deviation [[W_kk, W_kl], [W_lk, W_ll]] has the square
    (z_k - z_l + deviation (W_kk - W_ll))^2 + 4 deviation^2 W_kl W_lk. So the distance changes by at
    most the pull of the pair: the deviation times (|W_kk - W_ll| + 2 sqrt |W_kl W_lk|).

    Parameters
    ----------
    spectrum : SpectrumAtParameter
        At one end of a step, with m roots z.
    W : array (m, m)
        The matrices that the factor multiplies, in the eigenvectors of the spectrum: the slopes of
        its z per unit of the factor on the diagonal, their couplings off it.
    deviation : float
        How far the factor may lie from its chord.
    """
    slopes = W.diagonal()
    coupling = np.sqrt(np.abs(W * W.T))
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

    Another root at a distance g that pulls by h counts as near if h > g / 4. It then moves a root
    by sqrt(g h): by g / 2 at h = g / 4, as if the two met in the middle, and with the square root
    of the pull beyond, as at a coalescence. A root may cross if its distance from the axis is less
    than twice (for safety) the sum of this and of its movement by its own slope.

    movements (m,): by their own slopes towards the axis; pulls (m, m): of each root by each other.
    """
    distances = np.abs(spectrum.z[:, None] - spectrum.z)
    by_coupling = np.sqrt(np.where(4 * pulls > distances, distances * pulls, 0.0)).max(axis=1)
    reach = 2 * (movements + by_coupling)
    return bool(np.any(reach > np.abs(spectrum.z.real), where=~spectrum.on_line))


def _may_meet_on_line(spectrum: SpectrumAtParameter, pulls: Array) -> bool:
    """True if two roots of a system without damping, both on the line or conjugate, may meet on it.

    They may if four times (for safety) their pull exceeds their distance; roots that are one to
    rounding already are left out. pulls: an array (m, m).
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
