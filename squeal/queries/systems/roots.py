"""The selected roots of a system: all, those of a region, the lowest; and their completeness."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import DAMPED, problem_class_of
from squeal.linear.eigen import (
    ACCEPTED,
    STIFF,
    Eigenvalue,
    growing,
    hidden,
    ordered,
    roots_of,
    spectrum_of,
)
from squeal.linear.matrices import checked, rank_of, reduce, unit_diagonal
from squeal.linear.system import Matrix, TermSystem
from squeal.queries.systems.all_roots import Changes, is_small
from squeal.queries.systems.proofs import Data, Statement, counted, refereed
from squeal.queries.systems.reduced import reduced_for
from squeal.queries.systems.region_ends import (
    ROUGH,
    doubts_at_ends,
    growing_outside,
    may_lie_in,
    widened_in_frequency,
)
from squeal.queries.systems.verdicts import judge_roots, rounding_of
from squeal.results.sources import LOWEST, EigenvalueSelection
from squeal.sparse.argument_principle import Disc, Rectangle, count_roots, disc_around
from squeal.sparse.dense import dense_spectrum
from squeal.sparse.dispersive import (
    DispersiveReduction,
    frequencies,
    modes_at_own_frequencies,
)
from squeal.sparse.eigensolver import DENSE_ROWS, lowest_modes, modes_in
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import Quadratic, ScaledSystem, quadratic

REGULAR = 1e8  # condition of a stiffness below which a root of zero is one that rounding hides
WIDER = 1.1  # than the largest growth or decay rate: the region of a band

Known = tuple[Eigenvalue, ...]
WithErrors = Callable[[Known], Known]


@dataclass(frozen=True, eq=False)
class SystemRoots:
    """Roots of a system, by rising frequency, what proves them complete, and the verdict on it.

    The verdict is of what was proven: where only some roots are known it is the kind of the
    fastest growing one, None if none of them grows; `criterion` says what was looked at. A root
    with a backward error above 1e-6 decides nothing.
    """

    eigenvalues: Known = field(repr=False)
    region: Rectangle | Disc | None  # None is the whole plane
    count: int | None  # None if the number could not be settled
    verdict: str | None
    criterion: str
    others: Known = field(default=(), repr=False)  # found, counted and judged beside the lowest
    growth_limit: float | None = None  # 1/s: of a band faster growth was not looked for
    outside: tuple[complex, ...] | None = None  # what grows outside the region, if known or seen
    notes: tuple[str, ...] = ()
    judged_by: Statement | None = None  # what the referee says of all roots, None if not asked
    doubts: tuple[str, ...] = ()  # why a root of the region may be missing, or one too many

    @property
    def every(self) -> Known:
        """All roots that were found and counted."""
        return self.eigenvalues + self.others

    @property
    def certified(self) -> bool:
        """True if the referee proves the list; where it was not asked, if the count says that no
        root of the region is missing, and each one solves the equations."""
        if self.doubts:
            return False
        if self.judged_by is not None:
            return self.judged_by.status == "proved"
        return self.count == len(self.every) and all(e.residual <= ACCEPTED for e in self.every)

    @property
    def statement(self) -> Statement:
        """What is known of the list."""
        return self.judged_by or counted(self.certified)

    def lowest(self, modes: int | None) -> SystemRoots:
        """The first of them, which the count still proves to be the first; all if None."""
        if modes is None:
            return self
        return replace(self, eigenvalues=self.eigenvalues[:modes], others=self.eigenvalues[modes:])


def system_roots(
    system: TermSystem,
    selection: EigenvalueSelection | None = None,
    changes: Changes | None = None,
    bounded: WithErrors | None = None,
    data: Data | None = None,
) -> SystemRoots:
    """The roots of a system at its parameters, some of them changed.

    Up to 400 rows all roots are computed and the selected ones picked; of a larger system those of
    the band or region, or the lowest.
    `bounded` gives roots the error of a reduction or of the digits of data; those whose error
    reaches over an end of the region are listed. With what is assumed of the `data` the referee is
    asked of all roots of a small system. Raises InputError and ComputationError.
    """
    selection = selection or EigenvalueSelection()
    if is_small(system):
        roots = _roots_of_matrices(system.arrays(changes), selection, bounded, data)
        return roots.lowest(selection.modes)
    if system.follows:
        return _at_own_frequencies(system, selection, changes or {})
    problem = ScaledSystem(system).at(changes)
    region = selection.rectangle
    modes = selection.modes
    if region is None and modes is None:
        modes = LOWEST
    try:
        if region is None:
            roots = _lowest_roots(problem, modes or LOWEST, bounded)
        else:
            roots = _roots_of_region(problem, region, bounded)
    except ComputationError:
        if system.n > DENSE_ROWS:
            raise
        whole = replace(selection, modes=modes)
        return _roots_of_matrices(system.arrays(changes), whole, bounded).lowest(modes)
    if selection.band is not None and region is not None:
        roots = replace(roots, growth_limit=region.high_real)
    return roots.lowest(modes)


def _lowest_roots(problem: Quadratic, modes: int, bounded: WithErrors | None) -> SystemRoots:
    """So many of the lowest roots of a large system, and their conjugates."""
    solution = lowest_modes(problem, modes)
    roots, count = _upper(solution.eigenvalues, solution.count, problem.real)
    if bounded is not None:
        roots = bounded(roots)
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(roots, solution.region, count, verdict, criterion)


def _roots_of_region(
    problem: Quadratic, region: Rectangle, bounded: WithErrors | None
) -> SystemRoots:
    """The roots of a large system in a region, and what was seen to grow outside."""
    searched = region if bounded is None else widened_in_frequency(region)
    solution = modes_in(problem, searched)
    roots = solution.eigenvalues
    if bounded is not None:
        roots = bounded(roots)
    count = solution.count
    if count is not None:
        count -= sum(not region.contains(np.array(root.value)) for root in roots)
    doubts = doubts_at_ends(roots, region)
    # errors of roots that were not looked at are like those of the upper ones
    errors = [root.error or 0.0 for root in roots if root.value.imag > region.high_imag / 2]
    farthest = max(errors, default=0.0)
    if farthest > ROUGH * region.high_imag:
        doubts.append(f"errors reach up to {farthest / math.tau:.2g} Hz over the ends")
    inside = tuple(root for root in roots if may_lie_in(root, region))
    verdict, criterion = judge_roots(inside, complete=False)
    return SystemRoots(
        eigenvalues=inside,
        region=region,
        count=count,
        verdict=verdict,
        criterion=criterion,
        outside=growing_outside(solution.rough_values, region),
        doubts=tuple(doubts),
    )


def _at_own_frequencies(
    system: TermSystem, selection: EigenvalueSelection, changes: Changes
) -> SystemRoots:
    """The roots of a band of matrices that depend on the frequency of each; nothing counts them."""
    reduction = reduced_for(system, selection, [changes])
    assert isinstance(reduction, DispersiveReduction)
    roots, unsure = modes_at_own_frequencies(reduction, changes)
    frozen = len(frequencies(system, reduction.region))
    note = f"each root at its own frequency, found from matrices frozen at {frozen} frequencies"
    if unsure:
        note += f"; {unsure} of {len(roots)} roots were met from one side only"
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(
        eigenvalues=roots,
        region=selection.rectangle,
        count=None,
        verdict=verdict,
        criterion=criterion,
        growth_limit=None if selection.band is None else reduction.region.high_real,
        notes=(note,),
    ).lowest(selection.modes)


def roots_of_first_look(
    first_look: FirstLook, selection: EigenvalueSelection, changes: Changes
) -> SystemRoots:
    """The selected roots at some parameters as a first look has them: nothing counts them."""
    found = first_look.estimate_by_basis(changes)
    errors = np.maximum(found.errors, rounding_of(first_look.scaled.system, found.values))
    no_vector = np.empty(0, dtype=complex)
    roots = []
    for k in ordered(found.values):
        root = complex(found.values[k])
        residual = float(found.residuals[k])
        error = float(errors[k])
        roots.append(Eigenvalue(root, no_vector, no_vector, residual, math.nan, error))
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(
        eigenvalues=tuple(roots),
        region=first_look.region,
        count=None,
        verdict=verdict,
        criterion=criterion,
        growth_limit=None if selection.band is None else first_look.region.high_real,
        outside=growing_outside(found.rough_values.tolist(), first_look.region),
    ).lowest(selection.modes)


def _roots_of_matrices(
    matrices: tuple[Matrix, Matrix | None, Matrix],
    selection: EigenvalueSelection,
    bounded: WithErrors | None,
    data: Data | None = None,
) -> SystemRoots:
    """All roots of a small system, those of the band or region, or the upper ones."""
    M, C, K = matrices
    problem = quadratic(M, C, K)
    roots, words = _reduced_spectrum(problem, matrices)
    if words is None:
        roots = dense_spectrum(M, C, K)
        if not all(root.value for root in roots) and np.linalg.cond(unit_diagonal(K)) < REGULAR:
            raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    if bounded is not None:
        roots = bounded(roots)
        finite = tuple(root for root in roots if root.rounding < math.inf)
        words = judge_roots(finite, complete=not any(root.open for root in finite))
    statement: Statement | None = None
    if data is not None:
        if words is None:
            words = judge_roots(roots if problem.real else _upper(roots, None, False)[0])
        roots, words, statement = refereed(matrices, roots, words, data)
    proved = statement is not None and statement.status == "proved"
    # of complex matrices those of falling motion mean nothing
    upper, _ = _upper(roots, None, problem.real)
    meaningful = roots if problem.real else upper
    if words is None:
        words = judge_roots(meaningful)
    if selection.rectangle is not None:
        return _part_of_all(problem, roots, meaningful, selection, words, statement)
    count = len(roots) if proved else _number_of_roots(problem, roots)
    if selection.modes is not None or not problem.real:
        meaningful, count = _upper(roots, count, problem.real)
    verdict, criterion = words
    return SystemRoots(meaningful, None, count, verdict, criterion, judged_by=statement)


def _reduced_spectrum(
    problem: Quadratic, matrices: tuple[Matrix, Matrix | None, Matrix]
) -> tuple[Known, tuple[str | None, str] | None]:
    """All roots and the verdict on them from the mass-normalised system; none of complex matrices,
    where M is singular or not symmetric, and where rounding hides slow ones."""
    M, C, K = matrices
    if problem.real:
        with suppress(InputError):
            reduced = reduce(M, C, K)
            values = roots_of(reduced)
            if not hidden(reduced, C, K, values):
                roots = spectrum_of(reduced, values).eigenvalues
                conservative = problem_class_of([checked(M, C, K)]) is not DAMPED
                return roots, judge_roots(roots, conservative=conservative)
    return (), None


def _number_of_roots(problem: Quadratic, roots: Known) -> int | None:
    """The degree of det P, from a count where M is singular."""
    singular_values = np.linalg.svd(unit_diagonal(problem.M.toarray()), compute_uv=False)
    if rank_of(singular_values) == problem.n:
        return 2 * problem.n
    values = np.array([root.value for root in roots], dtype=complex)
    farthest = float(np.max(np.abs(values), initial=0.0))
    return count_roots(problem, Disc(2 * max(farthest, problem.frequency_scale)), values)


def _part_of_all(
    problem: Quadratic,
    every: Known,
    meaningful: Known,
    selection: EigenvalueSelection,
    words: tuple[str | None, str],
    statement: Statement | None,
) -> SystemRoots:
    """Of all roots of a small system those of the band or region, with the verdict `words` on all
    where none of the region grows, unless one grows elsewhere."""
    region = selection.rectangle
    assert region is not None
    values = np.array([root.value for root in every], dtype=complex)
    if selection.band is not None:  # with all real parts that occur in it
        in_band = (values.imag > region.low_imag) & (values.imag < region.high_imag)
        largest = float(np.max(np.abs(values.real[in_band]), initial=0.0))
        wide = max(WIDER * largest, region.high_real)
        region = replace(region, low_real=-wide, high_real=wide)
    inside = tuple(root for root in meaningful if may_lie_in(root, region))
    outside = growing(root for root in meaningful if root not in inside)
    disc = disc_around(region, values, 2 * float(np.max(np.abs(values), initial=0.0)))
    proved = statement is not None and statement.status == "proved"
    # all roots of the disc are in the list, or it is not known where the others are
    complete = proved or count_roots(problem, disc, values) == int(np.sum(disc.contains(values)))
    verdict, criterion = judge_roots(inside, complete=False)
    if verdict is None and not outside:
        verdict, criterion = words
    return SystemRoots(
        eigenvalues=inside,
        region=region,
        count=int(np.sum(region.contains(values))) if complete else None,
        verdict=verdict,
        criterion=criterion,
        outside=tuple(mode.root for mode in outside),
        judged_by=statement,
        doubts=tuple(doubts_at_ends(inside, region)),
    )


def _upper(roots: Known, count: int | None, real: bool) -> tuple[Known, int | None]:
    """The roots with Im >= 0, of complex matrices some below by rounding, and how many there are if
    `count` is that of all and as many lie below as were found there."""
    upper = tuple(root for root in roots if root.value.imag >= (0.0 if real else -root.rounding))
    if count is not None:
        count += len(upper) - len(roots)
    return upper, count
