"""Eigenvalues of a system at one value of its parameters: all, those of a region, the lowest."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.analysis.systems.matrices import condition
from squeal.analysis.systems.wanted import MODES, TERMS, Wanted, is_small
from squeal.errors import ComputationError, InputError
from squeal.linear import GROWING, UnstableMode
from squeal.linear.eigen import STIFF, Eigenvalue, hidden, spectrum_of
from squeal.linear.matrices import rank_of, reduce, unit_diagonal
from squeal.linear.system import TermSystem
from squeal.linear.verdict import ACCEPTED, decide, judge_reduced
from squeal.schema.values import takes
from squeal.sparse.argument_principle import Disc, Rectangle, count_roots, disc_around, growth_bound
from squeal.sparse.dense import dense_spectrum
from squeal.sparse.eigensolver import OPTIONS, Modes, lowest_modes, modes_in
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.quadratic import Quadratic, ScaledSystem, quadratic

NO_ROOT = "no root"  # the verdict on a band or region without one


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
    upper, count, disc = found.eigenvalues, found.count, isinstance(found.region, Disc)
    if disc:
        upper, count = _upper(upper, count, problem.real)
    words = judged(upper, complete=False)
    roots = SystemRoots(upper, found.region, count, *words, growth_limit=limit)
    return roots.lowest(wanted.modes or MODES) if disc else roots


def _band_modes(
    problem: Quadratic, region: Rectangle, progress: Progress
) -> tuple[Modes, float | None]:
    """The roots of a band with all growth rates that it may hold; or those of its region, with
    the growth rate at which that ends."""
    bound = growth_bound(problem, region)
    if bound is not None and bound > region.high_real:
        if bound <= 16 * region.high_real or problem.n <= OPTIONS.steps:
            with suppress(ComputationError):  # too many roots: of the region there are fewer
                found = modes_in(problem, replace(region, high_real=bound), progress=progress)
                if found.count is not None:
                    return found, None
        bound = None
    found = modes_in(problem, region, progress=progress)
    return found, None if bound is not None else region.high_real


def judged(values: tuple[Eigenvalue, ...], complete: bool = True) -> tuple[str | None, str]:
    """Verdict on roots and what decided it. Unless they are `complete` no verdict but that of a
    growing root is proven."""
    solved = [e for e in values if e.residual <= ACCEPTED]
    if not solved:
        return None, f"{NO_ROOT} was found that solves the equations"
    found = decide([e.value for e in solved], [e.rounding for e in solved])
    if found.verdict in GROWING or (complete and len(solved) == len(values)):
        return found.verdict, str(found)
    rate = f"largest Re lambda = {found.value:.6g}"
    return None, f"none of {len(solved)} roots grows: {rate}; the others are not known"


def growing(values: tuple[Eigenvalue, ...]) -> tuple[UnstableMode, ...]:
    """The roots that grow by more than rounding, the fastest first; of a pair the upper one."""
    found = [e for e in values if e.grows and e.value.imag >= -e.rounding]
    found.sort(key=lambda e: -e.growth_rate)
    return tuple(
        UnstableMode.of(e, "flutter" if e.oscillates else "divergence")
        for e in found
        if e.residual <= ACCEPTED
    )


def _of_all(
    matrices: tuple[np.ndarray, np.ndarray | None, np.ndarray], wanted: Wanted
) -> SystemRoots:
    from scipy.sparse import csc_array

    M, C, K = matrices
    words: tuple[str | None, str] | None = None
    real = not any(X is not None and np.iscomplexobj(X) for X in (M, C, K))
    if real:
        with suppress(InputError):  # M is singular or not symmetric: the pencil is solved
            reduced = reduce(M, C, K)
            if not hidden(reduced, K):
                every, verdict = spectrum_of(reduced).eigenvalues, judge_reduced(reduced)
                words = (verdict.verdict, str(verdict))
    if words is None:
        every = dense_spectrum(M, C, K)
        if not all(e.value for e in every) and condition(csc_array(K)) > 1e-8:
            raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    # of complex matrices those of falling motion mean nothing
    values = every if real else tuple(e for e in every if e.value.imag >= 0.0)
    words = words or judged(values)
    problem, known = quadratic(M, C, K), np.array([e.value for e in every], dtype=complex)
    rectangle = wanted.rectangle
    if rectangle is None:
        count = _degree(problem, known)
        if wanted.modes is None:
            count = None if count is None else count - len(every) + len(values)
            return SystemRoots(values, None, count, *words)
        values, count = _upper(every, count, real)
        return SystemRoots(values, None, count, *words).lowest(wanted.modes)
    if wanted.band is not None:
        rectangle = _whole_strip(rectangle, values)
    kept = tuple(e for e in values if rectangle.contains(np.array(e.value)))
    others = tuple(e for e in values if not rectangle.contains(np.array(e.value)))
    disc = disc_around(rectangle, known, 2.0 * float(np.max(np.abs(known), initial=0.0)))
    count = count_roots(problem, disc, known)
    # all roots of the disc are in the list, or it is not known where the others are
    complete = count == int(np.sum(disc.contains(known)))
    inside = int(np.sum(rectangle.contains(known))) if complete else None
    outside = len(growing(others))
    # all roots are known: where none of the region grows the verdict is of all, unless one grows
    # elsewhere
    own = judged(kept, complete=False)
    words = own if own[0] is not None or outside else words
    return SystemRoots(kept, rectangle, inside, *words, growing_outside=outside)


def _upper(
    every: tuple[Eigenvalue, ...], count: int | None, real: bool
) -> tuple[tuple[Eigenvalue, ...], int | None]:
    """The roots with Im >= 0, and how many there are if `count` is that of all.

    Of real matrices they come in pairs but for those that are real; of complex ones as many lie
    below as were found there.
    """
    upper = tuple(e for e in every if e.value.imag >= 0.0)
    if count is None:
        return upper, None
    if not real:
        return upper, count - len(every) + len(upper)
    reals = sum(e.value.imag == 0.0 for e in upper)
    return upper, None if (count + reals) % 2 else (count + reals) // 2


def _degree(problem: Quadratic, known: np.ndarray) -> int | None:
    """How many finite roots there are: 2n where M is regular, the degree of det P, else as many as
    the argument principle counts on a circle around all that are known."""
    sizes = np.linalg.svd(unit_diagonal(problem.M.toarray()), compute_uv=False)
    if rank_of(sizes) == problem.n:
        return 2 * problem.n
    disc = Disc(2.0 * float(np.max(np.abs(known), initial=problem.rate)))
    return count_roots(problem, disc, known)


def _whole_strip(region: Rectangle, values: tuple[Eigenvalue, ...]) -> Rectangle:
    """The band with all real parts that occur in it."""
    inside = [e.value.real for e in values if region.low_imag < e.value.imag < region.high_imag]
    far = 1.1 * max((abs(x) for x in inside), default=0.0)
    wide = max(far, region.high_real)
    return Rectangle(-wide, wide, region.low_imag, region.high_imag)
