"""Small systems, of which all eigenvalues are computed: which they are, and the values alone."""

import math
from typing import NamedTuple

import numpy as np

from squeal.linear.matrices import components, is_regular, reaches
from squeal.linear.roots import ComplexArray, ordered
from squeal.linear.system import TermSystem
from squeal.linear.verdicts import assumed_rounding, is_undamped
from squeal.numerics.differentiation import Parameters
from squeal.queries.options import Band
from squeal.queries.systems.matrices import ALL_ROWS
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.dense import dense_values

NO_BAND = (
    "band: is missing, such as 500 to 5000 Hz; systems of more than 400 rows, complex "
    "matrices, matrices that follow the frequency, and the methods reduced and modal need one"
)


def is_small(system: TermSystem) -> bool:
    """True if all roots of a system are computed: few rows, and no matrix follows the frequency."""
    return system.n <= ALL_ROWS and not system.follows


def in_band(roots: ComplexArray, band: Band | None) -> ComplexArray:
    """The roots with frequencies within a band in Hz, ends included; all without one."""
    if band is None:
        return roots
    low, high = band
    return roots[(roots.imag >= math.tau * low) & (roots.imag <= math.tau * high)]


def roots_of_all(
    system: TermSystem, selection: EigenvalueSelection, changes: Parameters
) -> ComplexArray:
    """Compute all roots of a small system and select those of a band or region, without vectors.

    Parameters
    ----------
    system : TermSystem
        A small system (see `is_small`).
    selection : EigenvalueSelection
        The band or region; its number of modes is left to the caller.
    changes : mapping
        Parameters that do not have the system's own values.

    Returns
    -------
    array (m,)
        Roots in rad/s by rising frequency. Of real matrices without a band also the conjugates; of
        complex ones only those with Im >= 0, as others describe no motion.
    """
    # `balanced`: the roots are the same, in units of rows in which rounding hides less
    roots = dense_values(*system.balanced.arrays(changes))
    if not system.real:
        # a real root that rounding puts below the real axis would be left out otherwise. Rounding
        # with `undamped` is the greater one, which also holds for two real roots that nearly
        # coincide
        is_real = np.abs(roots.imag) <= assumed_rounding(roots, undamped=True)
        roots = np.where(is_real, roots.real, roots)
        roots = roots[roots.imag >= 0.0]
    if selection.band is not None:  # a band bounds no growth rate
        roots = in_band(roots, selection.band)
    elif selection.rectangle is not None:  # the region, with the real axis if it begins there
        roots = roots[selection.rectangle.contains(roots)]
    return roots[ordered(roots)]


HIDDEN = 1e-4
"""Share of the fastest motion below which rounding may hide a motion: it moves a fourfold defective
root by EPS^(1/4) of the fastest."""


class MotionRates(NamedTuple):
    """|lambda|, rad/s, of the slowest motion that is not free, of the slowest oscillation (of the
    slowest motion if nothing oscillates) and of the fastest motion; 0 if all motions are free."""

    slowest: float
    slowest_oscillation: float
    fastest: float


def motion_rates(system: TermSystem, changes: Parameters) -> MotionRates:
    """How fast the slowest and the fastest motions of a small system are.

    Each strong component (rows that depend on one another) is solved by itself, so that rounding
    of a stiff or strongly damped component hides no slow motion of another component. Within a
    component rounding moves each root by about EPS fastest, so that slow ones may be noise. The
    reversed problem, with M and K exchanged, has the roots 1 / lambda. Rounding moves those by
    about EPS / slowest, so that fast ones may be noise. Of both problems the relative errors of a
    root, EPS fastest / |lambda| and EPS |lambda| / slowest, are equal where
    |lambda|^2 = slowest fastest: slower roots are taken from the reversed problem.

    Parameters
    ----------
    system : TermSystem
        A small system (see `is_small`).
    changes : mapping
        Parameters that do not have the system's own values.

    Returns
    -------
    MotionRates
        |lambda|, rad/s: the least of roots that are not zero, the least of roots that oscillate
        (the former if none does), and the greatest of all.
    """
    M, C, K = system.balanced.arrays(changes)
    pattern = (M != 0.0) | (K != 0.0)
    if C is not None:
        pattern |= C != 0.0
    fastest = 0.0
    moving: list[float] = []
    oscillating: list[float] = []
    for rows in components(reaches(pattern)):
        block = np.ix_(rows, rows)
        damping = None if C is None else C[block]
        if not M[block].any() and (damping is None or not damping.any()):
            continue  # springs alone have no roots
        roots = dense_values(M[block], damping, K[block])
        sizes = np.abs(roots)
        fastest_here = float(sizes.max(initial=0.0))
        fastest = max(fastest, fastest_here)
        if np.any(sizes <= HIDDEN * fastest_here) and is_regular(K[block]):
            inverses = dense_values(K[block], damping, M[block])
            roots = _more_exact_of(roots, 1.0 / inverses[inverses != 0.0])
            sizes = np.abs(roots)
        rounding = assumed_rounding(roots, is_undamped(M[block], damping, K[block]))
        oscillates = np.abs(roots.imag) > rounding
        oscillating += sizes[oscillates].tolist()
        moving += sizes[sizes > 0.0].tolist()
    slowest = min(moving, default=0.0)
    return MotionRates(slowest, min(oscillating, default=slowest), fastest)


def _more_exact_of(roots: ComplexArray, reversed_roots: ComplexArray) -> ComplexArray:
    """Roots (m,), the slower ones replaced by those of the reversed problem (see `motion_rates`).

    Roots of equal rank by size are one root, computed in two ways. Where the product of both sizes
    is at most slowest fastest, that of the reversed problem has the smaller error.

    reversed_roots: those of the reversed problem, in rad/s, the fastest possibly left out.
    """
    direct = roots[np.argsort(np.abs(roots))]
    others = reversed_roots[np.argsort(np.abs(reversed_roots))][: len(direct)]
    products = np.abs(direct[: len(others)]) * np.abs(others)
    is_slow = products <= np.abs(others[0]) * np.abs(direct[-1])
    direct[: len(others)][is_slow] = others[is_slow]
    return direct
