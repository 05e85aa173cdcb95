"""Eigenvalues of a system at one value of its parameters: all, those of a region, the lowest."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.systems.checks import condition
from squeal.analysis.systems.wanted import MODES, TERMS, Wanted, is_small
from squeal.errors import ComputationError, InputError
from squeal.linear import GROWING, Judgement, UnstableMode
from squeal.linear.eigen import STIFF, ComplexArray, Eigenvalue, axis_noise, hidden, spectrum_of
from squeal.linear.judgement import judge_reduced
from squeal.linear.matrices import EPS, Reduced, first_order, reduce
from squeal.linear.system import TermSystem
from squeal.numerics.threads import one_thread
from squeal.schema.arguments import takes
from squeal.sparse.count import count_roots
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.growth import growth_bound
from squeal.sparse.merge import Roots
from squeal.sparse.modes import Modes, lowest_modes, modes_in
from squeal.sparse.quadratic import Quadratic
from squeal.sparse.region import Disc, Discs, Rectangle
from squeal.sparse.scaled import ScaledSystem, quadratic
from squeal.sparse.spectrum import dense_spectrum
from squeal.sparse.zeros import slow_noise

NO_ROOT = "no root"  # the verdict on a band or region without one
ROUNDING = 8 * EPS
ACCEPTED = 1e-6  # backward error of a root
REGULAR = 1e-8  # reciprocal condition of a stiffness that leaves no root at zero
SPLIT = 1e-7  # of |lambda|: what rounding may part two equal roots of an undamped system by


@dataclass(frozen=True, eq=False)
class SystemRoots:
    """Roots of a system, by rising frequency, what proves them complete, and the verdict on it.

    The verdict is of what was proven: where only some roots are known it is the kind of the
    fastest growing one, None if none of them grows; `criterion` says what was looked at. A root
    with a backward error above 1e-6 decides nothing. `region` None is the whole plane; `count` None
    if the number could not be settled. `others` are roots that were found and counted too, and that
    the verdict is on, beyond the lowest ones that were asked for. Roots of a band that grow faster
    than `growth_limit` (1/s) were not looked for; None if there are none. `growing_outside` pairs
    and real roots outside the region grow, None if that is not known.
    """

    eigenvalues: tuple[Eigenvalue, ...] = field(repr=False)
    region: Rectangle | Disc | None
    count: int | None
    verdict: str | None
    criterion: str
    noise: NDArray[np.float64] = field(repr=False)
    others: tuple[Eigenvalue, ...] = field(default=(), repr=False)
    growth_limit: float | None = None
    growing_outside: int | None = None

    @property
    def certified(self) -> bool:
        """True if the count proves that no root of the region is missing, and each one solves the
        equations."""
        every = (*self.eigenvalues, *self.others)
        return self.count == len(every) and all(e.residual <= ACCEPTED for e in every)

    def lowest(self, modes: int) -> SystemRoots:
        """The first of them, which the count still proves to be the first."""
        return replace(self, eigenvalues=self.eigenvalues[:modes], others=self.eigenvalues[modes:])


@takes(system=TERMS)
def system_roots(
    system: TermSystem,
    wanted: Wanted | None = None,
    changes: Mapping[str, float] | None = None,
    progress: Progress = quiet,
) -> SystemRoots:
    """The roots of a system at its parameters, some of them changed.

    Up to 400 rows all roots are computed and the wanted ones picked; of a larger system those of
    the band or region, or the lowest. A band reaches as far to the right as its roots may lie.
    Raises InputError and ComputationError.
    """
    wanted = wanted or Wanted()
    if wanted.rectangle is not None and wanted.modes is not None:
        whole = Wanted(wanted.band, wanted.region)
        return system_roots(system, whole, changes, progress).lowest(wanted.modes)
    if is_small(system):
        return _of_all(system.arrays(changes), wanted)
    problem = ScaledSystem(system).at(changes)
    rectangle, limit = wanted.rectangle, None
    if rectangle is not None and wanted.band is not None:
        found, limit = _band_modes(problem, rectangle, progress)
    elif rectangle is not None:
        found = modes_in(problem, rectangle, progress=progress)
    else:
        found = lowest_modes(problem, wanted.modes or MODES, progress=progress)
    upper = found.eigenvalues
    if isinstance(found.region, Disc):
        edge = -SPLIT * found.region.radius
        upper = tuple(e for e in upper if e.value.imag >= edge)
    count = found.count.inside if found.count else None
    if count is not None and len(upper) < len(found.eigenvalues):
        # the region mirrors itself: one of each conjugate pair is listed
        count = len(upper) if found.certified else None
    noise = noise_at(problem, upper)
    words = judged(upper, noise, complete=False)
    roots = SystemRoots(upper, found.region, count, *words, growth_limit=limit)
    return roots.lowest(wanted.modes or MODES) if isinstance(found.region, Disc) else roots


def _band_modes(
    problem: Quadratic, region: Rectangle, progress: Progress
) -> tuple[Modes, float | None]:
    """The roots of a band with all growth rates that it may hold; or those of its region, with
    the growth rate at which that ends."""
    bound = growth_bound(problem, region)
    if bound is not None:
        whole = replace(region, high_real=bound)
        with suppress(ComputationError):  # too many roots: of the region alone there are fewer
            found = modes_in(problem, region, progress=progress, whole=whole)
            if whole == region or (found.count and found.count.inside is not None):
                return found, None
    return modes_in(problem, region, progress=progress), region.high_real


def judged(
    values: tuple[Eigenvalue, ...], noise: NDArray[np.float64], complete: bool = True
) -> tuple[str | None, str, NDArray[np.float64]]:
    """Verdict on roots, what decided it, and the noise; a root within its noise of the axis lies
    on it. Unless they are `complete` no verdict but that of a growing root is proven."""
    solved = np.array([e.residual <= ACCEPTED for e in values], dtype=bool)
    if not solved.any():
        return None, f"{NO_ROOT} was found that solves the equations", noise
    found = decided(np.array([e.value for e in values])[solved], noise[solved])
    if found.verdict in GROWING or (complete and solved.all()):
        return found.verdict, str(found), noise
    rate = f"largest Re lambda = {found.value:.6g}"
    return None, f"none of {int(solved.sum())} roots grows: {rate}; the others are not known", noise


def decided(values: ComplexArray, noise: NDArray[np.float64]) -> Judgement:
    """The verdict on roots (m,) that lie within `noise` (m,), 1/s, of where they are computed."""
    growth = np.where(values.real > noise, values.real, 0.0)
    k = int(np.argmax(growth))
    if growth[k] > 0.0:
        oscillates = abs(values[k].imag) > noise[k]
        name = "flutter" if oscillates else "divergence"
    else:
        name = "marginal" if np.any(np.abs(values.real) <= noise) else "stable"
        k = int(np.argmax(values.real))
    return Judgement(name, "largest Re lambda", float(values[k].real), float(noise[k]))


def growing(roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """The roots that grow by more than rounding, the fastest first; of a pair the upper one."""
    found = []
    for e, noise in zip((*roots.eigenvalues, *roots.others), roots.noise, strict=True):
        if e.value.real > noise and e.value.imag > -noise:
            kind = "flutter" if e.value.imag > noise else "divergence"
            found.append(UnstableMode(kind, e.frequency_hz, e.growth_rate, e.damping_ratio))
    return tuple(sorted(found, key=lambda mode: -mode.growth_rate))


def noise_at(problem: Quadratic, values: tuple[Eigenvalue, ...]) -> NDArray[np.float64]:
    """How far from where they are computed roots of a problem may lie: condition times backward
    error, 1/s.

    No more than the square root of rounding, which is what two coalescing roots part by, or, of
    slow roots, what rounding of K moves their squares by.
    """
    size = np.array([abs(e.value) for e in values])
    error = np.array([max(e.residual, ROUNDING) * min(e.condition, 1 / EPS) for e in values])
    most = np.maximum(SPLIT * size, slow_noise(problem, size))
    return np.where(size > 0, np.minimum(error * size, most), 0.0)


def _of_all(
    matrices: tuple[np.ndarray, np.ndarray | None, np.ndarray], wanted: Wanted
) -> SystemRoots:
    from scipy.sparse import csc_array

    M, C, K = matrices
    words: tuple[str | None, str, NDArray[np.float64]] | None = None
    if not any(X is not None and np.iscomplexobj(X) for X in (M, C, K)):
        with suppress(InputError):  # M is singular or not symmetric: the pencil is solved
            reduced = reduce(M, C, K)
            if not hidden(reduced, K):
                values, verdict = spectrum_of(reduced).eigenvalues, judge_reduced(reduced)
                words = (verdict.verdict, str(verdict), standard_noise(reduced, values))
    if words is None:
        values = dense_spectrum(M, C, K)
        if not all(e.value for e in values) and condition(csc_array(K)) > REGULAR:
            raise ComputationError(f"no eigenvalue can be given: {STIFF}")
        words = judged(values, noise_at(quadratic(M, C, K), values))
    rectangle = wanted.rectangle
    if rectangle is None:
        if wanted.modes is not None:
            rising = np.array([e.value.imag >= 0.0 for e in values])
            upper = tuple(e for e, up in zip(values, rising, strict=True) if up)
            found = SystemRoots(upper, None, len(upper), *words[:2], words[2][rising])
            return found.lowest(wanted.modes)
        return SystemRoots(values, None, len(values), *words)
    if wanted.band is not None:
        rectangle = _whole_strip(rectangle, values)
    inside = rectangle.contains(np.array([e.value for e in values]))
    kept = tuple(e for e, keep in zip(values, inside, strict=True) if keep)
    count = _counted(quadratic(M, C, K), rectangle, values)
    others = tuple(e for e, keep in zip(values, inside, strict=True) if not keep)
    noise = words[2]
    outside = len(growing(SystemRoots(others, None, None, *judged(others, noise[~inside]))))
    # all roots are known: where none of the region grows the verdict is of all, unless one grows
    # elsewhere
    own = judged(kept, noise[inside], complete=False)
    words = own if own[0] is not None or outside else (*words[:2], noise[inside])
    return SystemRoots(kept, rectangle, count, *words, growing_outside=outside)


def standard_noise(reduced: Reduced, values: tuple[Eigenvalue, ...]) -> NDArray[np.float64]:
    """The same of roots from the standard form: what `judge` holds them against, in 1/s.

    Without damping they are exactly on the axes where they may be.
    """
    roots: ComplexArray = np.array([e.value for e in values])
    if reduced.B is None:
        return np.zeros(len(roots))
    matrix, rate = first_order(reduced.A, reduced.B)
    conditions = np.array([e.condition for e in values])
    noise = float(rate) * axis_noise(matrix, roots / rate, conditions, reduced.rounding)
    return np.where(roots == 0, 0.0, noise)


def _whole_strip(region: Rectangle, values: tuple[Eigenvalue, ...]) -> Rectangle:
    """The band with all real parts that occur in it."""
    inside = [e.value.real for e in values if region.low_imag < e.value.imag < region.high_imag]
    far = 1.1 * max((abs(x) for x in inside), default=0.0)
    wide = max(far, region.high_real)
    return Rectangle(-wide, wide, region.low_imag, region.high_imag)


def _counted(problem: Quadratic, region: Rectangle, values: tuple[Eigenvalue, ...]) -> int | None:
    """How many roots the argument principle counts in a region around which all are known."""
    numbers = np.array([e.value for e in values])
    vectors = np.array([e.right for e in values]).T / problem.scale[:, None]
    vectors = vectors / np.linalg.norm(vectors, axis=0)
    known = Roots(numbers, vectors, np.full_like(vectors, np.nan))
    everywhere = Discs(((0j, 4.0 * (region.radius + abs(region.centre))),))
    with one_thread():
        return count_roots(problem, region, known, everywhere).inside
