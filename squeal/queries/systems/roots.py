"""The selected roots of a system: all, those of a region, or the lowest; and if one is missing.

Up to 400 rows all roots are computed by a dense solver and the selected ones picked. Of a larger
system they are searched by shifted Krylov subspaces and counted by the argument principle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import DAMPED, problem_class_of
from squeal.linear.eigen import growing, spectrum_of, values_of
from squeal.linear.finite_roots import finite_root_count
from squeal.linear.matrices import (
    MCK,
    SingularTogetherError,
    normalised_system,
    unit_diagonal,
)
from squeal.linear.paths import Indices, mode_numbers
from squeal.linear.roots import STIFF, hides_slow_roots, lowest, ordered, roots_of
from squeal.linear.system import TermSystem
from squeal.numerics.differentiation import Parameters
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.proofs import (
    NO_MOTION,
    NOT_COUNTED,
    Data,
    EigenvalueTuple,
    Statement,
    VerdictAndCriterion,
    exact_spectrum,
    refereed,
)
from squeal.queries.systems.reduced import growth_limit, reduced_for
from squeal.queries.systems.region_ends import (
    NARROW,
    ROUGH,
    doubts_at_ends,
    growing_outside,
    may_lie_in,
    widened_in_frequency,
)
from squeal.queries.systems.verdicts import judge_roots, rounding_of
from squeal.results.columns import OPEN
from squeal.results.eigenvalues import eigenvalues_of_arrays
from squeal.results.sources import LOWEST, EigenvalueSelection
from squeal.sparse.argument_principle import Disc, Rectangle
from squeal.sparse.dense import dense_spectrum
from squeal.sparse.dispersive import DispersiveReduction, frequencies, modes_at_own_frequencies
from squeal.sparse.first_look import FirstLook
from squeal.sparse.lowest_roots import DENSE_ROWS, lowest_modes
from squeal.sparse.quadratic import ScaledProblem, ScaledSystem
from squeal.sparse.region_roots import modes_in

MAY_BE_INFINITE = "M is singular, and only a proof tells which roots are infinite"
REGULAR = 1e8
"""A stiffness (with a unit diagonal) of a smaller condition is regular, and has no root of zero."""
WIDER = 1.1
"""The region of a band is so many times as wide as the largest growth or decay rate in it."""

AddErrors = Callable[[EigenvalueTuple], EigenvalueTuple]
"""Adds to roots how far their true values may be off, see `data_precision.error_bounds`."""


@dataclass(frozen=True, eq=False)
class SystemRoots:
    """Roots of a system, what shows that none is missing, and the verdict on them.

    Attributes
    ----------
    eigenvalues : tuple of Eigenvalue
        The selected roots by rising frequency.
    region : Rectangle, Disc or None
        The part of the plane that was searched; None is the whole plane.
    count : int or None
        How many roots the region holds, by an argument-principle count or by the degree of the
        characteristic polynomial; None if nothing was counted.
    verdict : str or None
        The verdict; None where it is open. Where only some roots are known it is the kind of the
        fastest growing root, None if no root grows. A root with a backward error above 1e-6 decides
        nothing.
    criterion : str
        What decided the verdict, in words.
    others : tuple of Eigenvalue
        Further roots of the region, beside the lowest ones that were selected.
    growth_limit : float or None
        Roots that grow faster, 1/s, were not searched; None without a limit of growth alone.
    outside : tuple of complex or None
        Growing roots outside of the region, the fastest first: all of a small system, of a large
        one those that the search met. None if it met none, which does not say that none exists.
    notes : tuple of str
        Lines for people.
    judged_by : Statement or None
        What the referee says of all roots, or `NOT_COUNTED`; None if the count decides.
    doubts : tuple of str
        Why a root of the region may be missing, or one may not belong to it.
    """

    eigenvalues: EigenvalueTuple = field(repr=False)
    region: Rectangle | Disc | None
    count: int | None
    verdict: str | None
    criterion: str
    others: EigenvalueTuple = field(default=(), repr=False)
    growth_limit: float | None = None
    outside: tuple[complex, ...] | None = None
    notes: tuple[str, ...] = ()
    judged_by: Statement | None = None
    doubts: tuple[str, ...] = ()

    @property
    def computed(self) -> EigenvalueTuple:
        """All computed roots of the region, the selected ones and the others."""
        return self.eigenvalues + self.others

    @property
    def numbers(self) -> Indices:
        """The numbers of the modes of the selected roots, those that they have among all computed
        ones: among the lowest alone a real root may lack the one that makes a mode with it."""
        return mode_numbers(values_of(self.computed))[: len(self.eigenvalues)]

    @property
    def certified(self) -> bool:
        """True if no root of the region is missing, by the referee's proof, else by the count."""
        return self.statement.status != "open"

    @property
    def statement(self) -> Statement:
        """What is known of the completeness of the list.

        Where the referee did not judge, the count must agree and each root solve the equations.
        """
        if self.doubts:
            by: str | None = "count"
            if self.judged_by is not None:
                by = self.judged_by.by
            return Statement("open", by, reason="; ".join(self.doubts))
        if self.judged_by is not None:
            return self.judged_by
        if self.count == len(self.computed) and all(root.decides for root in self.computed):
            return Statement("counted", "count")
        return Statement("open", "count", reason="no count agrees, others may be missing")

    def lowest(self, modes: int | None) -> SystemRoots:
        """The roots with the `modes` of least |lambda| selected, all if None.

        The others are kept, so that the count still shows that none is missing among these.
        """
        if modes is None:
            return self
        chosen = lowest(values_of(self.eigenvalues), modes).tolist()
        selected = tuple(self.eigenvalues[k] for k in chosen)
        left_out = set(range(len(self.eigenvalues))).difference(chosen)
        others = tuple(self.eigenvalues[k] for k in sorted(left_out))
        return replace(self, eigenvalues=selected, others=others)


def system_roots(
    system: TermSystem,
    selection: EigenvalueSelection | None = None,
    add_errors: AddErrors | None = None,
    data: Data | None = None,
) -> SystemRoots:
    """Compute the selected roots of a system at its parameters.

    A small system (`is_small`, up to 400 rows) is solved by the dense solver. A large one is
    searched by sparse factorisations; up to `DENSE_ROWS` (2000) rows the dense solver takes over if
    that search fails.

    Parameters
    ----------
    system : TermSystem
        The system.
    selection : EigenvalueSelection, optional
        Which roots; all of a small system, the lowest 20 modes of a large one if left out.
    add_errors : callable, optional
        Adds to roots their error by a reduction or by the digits of files. Roots whose error
        reaches into the region are listed too.
    data : Data, optional
        How precisely the entries of a small system are known: with it the referee judges its roots.

    Raises
    ------
    InputError
        For a selection that the system does not allow.
    ComputationError
        If the roots cannot be computed.
    """
    selection = selection or EigenvalueSelection()
    if is_small(system):
        roots = _roots_of_matrices(system.arrays(), selection, add_errors, data)
        return roots.lowest(selection.modes)  # all where `modes` is None
    if system.follows:  # some matrix depends on the frequency of the root
        return _at_own_frequencies(system, selection)
    problem = ScaledSystem(system).at()
    region = selection.rectangle
    modes = selection.modes
    try:
        if region is not None:
            roots = _roots_of_region(problem, region, add_errors)
            roots = replace(roots, growth_limit=growth_limit(selection, region))
        else:  # the lowest modes have no limit of growth
            if modes is None:
                modes = LOWEST
            roots = _lowest_roots(problem, modes, add_errors)
    except ComputationError:
        if system.n > DENSE_ROWS:
            raise
        # the sparse search failed, but the dense solver serves so few rows
        with_modes = replace(selection, modes=modes)
        return _roots_of_matrices(system.arrays(), with_modes, add_errors).lowest(modes)
    return roots.lowest(modes)


def _lowest_roots(problem: ScaledProblem, modes: int, add_errors: AddErrors | None) -> SystemRoots:
    """Compute the `modes` lowest roots with Im >= 0 of a large system, and count them."""
    solution = lowest_modes(problem, modes)
    roots = _upper_half(solution.eigenvalues, not problem.is_real)
    count = solution.count
    if count is not None:  # of a disc: as many roots lie below the real axis as computed there
        count -= len(solution.eigenvalues) - len(roots)
    if add_errors is not None:
        roots = add_errors(roots)
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(roots, solution.region, count, verdict, criterion)


def _roots_of_region(
    problem: ScaledProblem, region: Rectangle, add_errors: AddErrors | None
) -> SystemRoots:
    """Compute and count the roots of a large system in a region.

    Roots are searched a little beyond the ends of the region, and further if they have errors: the
    true value of a root outside may lie inside. Growing roots that the search meets outside are
    listed as `outside`.

    add_errors: puts the error of each root (rad/s) beside it, as of a reduced system; None where
    roots have none.
    """
    share = NARROW
    if add_errors is not None:
        share = ROUGH
    searched = widened_in_frequency(region, share)
    solution = modes_in(problem, searched)
    roots = solution.eigenvalues
    if add_errors is not None:
        roots = add_errors(roots)
    count = solution.count
    if count is not None:  # of the searched region: roots beyond the ends of `region` do not count
        count -= int(np.sum(~region.contains(values_of(roots))))
    doubts = doubts_at_ends(roots, region)
    # a root above the searched region was not computed, and may reach into the region by its error.
    # This error is taken to be at most that of the roots in the upper half of the region
    largest_error = 0.0
    for root in roots:
        if root.value.imag > region.high_imag / 2:
            largest_error = max(largest_error, root.error or 0.0)
    if largest_error > ROUGH * region.high_imag:
        doubts.append(f"errors reach up to {largest_error / math.tau:.2g} Hz over the ends")
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


def _at_own_frequencies(system: TermSystem, selection: EigenvalueSelection) -> SystemRoots:
    """Compute the roots of a band where matrices follow the frequency of each root.

    Newton's method starts from the roots of matrices frozen at several frequencies of the band. A
    root that is reached from frequencies below it alone, or above it alone, may have neighbours
    that no start reaches: nothing counts them.
    """
    reduction = reduced_for(system, selection, [{}])  # at the system's own parameters
    assert isinstance(reduction, DispersiveReduction)
    roots, from_one_side = modes_at_own_frequencies(reduction, {})
    frozen_count = len(frequencies(system, reduction.region))
    note = (
        f"each root at its own frequency, found from matrices frozen at {frozen_count} frequencies"
        " of the band"
    )
    if from_one_side:
        note += f"; {from_one_side} of {len(roots)} roots were reached from frequencies on one side"
        note += " of them alone"
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(
        eigenvalues=roots,
        region=selection.rectangle,
        count=None,
        verdict=verdict,
        criterion=criterion,
        growth_limit=growth_limit(selection, reduction.region),
        notes=(note,),
        judged_by=NOT_COUNTED,
    ).lowest(selection.modes)


def roots_of_first_look(
    first_look: FirstLook, selection: EigenvalueSelection, changes: Parameters
) -> SystemRoots:
    """The selected roots at some parameters as a first look estimates them, without vectors.

    A first look is a projection of a large system onto real modes and their corrections. Nothing
    counts its roots. Their `rounding` is the error of the estimate, 1/s.
    """
    estimate = first_look.estimate_by_basis(changes)
    values = estimate.values
    errors = np.maximum(estimate.errors, rounding_of(first_look.scaled.system, values))
    order = ordered(values)
    roots = eigenvalues_of_arrays(values[order], estimate.residuals[order], errors[order])
    verdict, criterion = judge_roots(roots, complete=False)
    return SystemRoots(
        eigenvalues=roots,
        region=first_look.region,
        count=None,
        verdict=verdict,
        criterion=criterion,
        growth_limit=growth_limit(selection, first_look.region),
        outside=growing_outside(estimate.rough_values.tolist(), first_look.region),
        judged_by=NOT_COUNTED,
    ).lowest(selection.modes)


def _roots_of_matrices(
    matrices: MCK,
    selection: EigenvalueSelection,
    add_errors: AddErrors | None,
    data: Data | None = None,
) -> SystemRoots:
    """Compute all roots of M, C and K (n, n), have them judged, and select some of them.

    The solver judges by the roots and how far they may be off; with `data` the referee then proves
    or refutes its verdict. Of complex matrices only roots with Im >= 0 describe a motion, and are
    judged. selection, add_errors, data: as `system_roots` takes them.
    """
    M, C, K = matrices
    is_complex = any(X is not None and np.iscomplexobj(X) for X in matrices)
    normalised_roots = _mass_normalised_roots(matrices)
    if normalised_roots is None:
        roots = _dense_roots(matrices)
        conservative = False
    else:
        roots = normalised_roots
        # undamped or gyroscopic: a root that is near the imaginary axis to rounding lies on it
        conservative = problem_class_of([matrices]) is not DAMPED
    if add_errors is not None:
        roots = add_errors(roots)
    # judged: the verdict and its criterion, by the solver, then by the referee
    motion_roots = roots
    if is_complex:
        motion_roots = _upper_half(roots, is_complex)
    if add_errors is None:
        judged = judge_roots(motion_roots, conservative=conservative)
    else:
        # a root without a bound decides nothing
        bounded = tuple(root for root in motion_roots if root.rounding < math.inf)
        # where the errors leave the sign of a root open only growth of another root is a verdict
        judged = judge_roots(bounded, complete=not any(root.sign_is_open for root in bounded))
    statement: Statement | None = None
    if data is not None:
        roots, judged, statement = refereed(matrices, roots, judged, data)
    # at most how many roots there are: one that is not listed may change the verdict
    count = len(roots)
    doubts: list[str] = []
    if statement is None or statement.status != "proved":
        count = finite_root_count(M, C, K, guess=len(roots))
        if count != len(roots):
            from squeal.proof.referee import LAST_DIGITS  # which few answers need

            numbers = f"{len(roots)} roots are listed, there may be up to {count}"
            judged = None, f"{OPEN}{LAST_DIGITS}: {numbers}"
        if statement is None and count < 2 * len(M):  # M is singular
            doubts.append(MAY_BE_INFINITE)
    # the selection
    if selection.rectangle is not None:
        is_whole = count == len(roots)
        return _select_region(is_complex, roots, selection, judged, statement, is_whole)
    selected = roots  # all roots of real matrices are listed with their conjugates
    if selection.modes is not None or is_complex:
        selected = _upper_half(roots, is_complex)
        count -= len(roots) - len(selected)  # without the roots below the real axis
    verdict, criterion = judged
    notes = () if roots else (NO_MOTION,)
    return SystemRoots(
        eigenvalues=selected,
        region=None,  # the whole plane
        count=count,
        verdict=verdict,
        criterion=criterion,
        notes=notes,
        judged_by=statement,
        doubts=tuple(doubts),
    )


def _dense_roots(matrices: MCK) -> EigenvalueTuple:
    """Compute all finite roots by the quadratic eigensolver, which allows a singular or complex M.

    Where rounding hides which of them are zero they are computed in exact arithmetic. Raises
    ComputationError where that fails.
    """
    M, C, K = matrices
    try:
        roots = dense_spectrum(M, C, K)
    except SingularTogetherError as error:  # exact arithmetic tells whether they are
        roots = exact_spectrum(M, C, K, error)
    has_zeros = not all(root.value for root in roots)
    # det K = 0 at a root of zero: where K is clearly regular the zeros are slow roots that are lost
    if has_zeros and np.linalg.cond(unit_diagonal(K)) < REGULAR:
        return exact_spectrum(M, C, K, ComputationError(f"no eigenvalue can be given: {STIFF}"))
    return roots


def _mass_normalised_roots(matrices: MCK) -> EigenvalueTuple | None:
    """Compute all roots from the mass-normalised system L^-1 K L^-T, M = L L^T, if that serves.

    None where another solver is needed: for complex matrices, where M is singular or not symmetric,
    and where rounding hides slow roots.
    """
    M, C, K = matrices
    try:
        normalised = normalised_system(M, C, K)
        values = roots_of(normalised)
        if hides_slow_roots(normalised, C, K, values):
            return None
        return spectrum_of(normalised, values).eigenvalues
    except InputError:  # M is not positive definite, or a matrix is complex
        return None


def _select_region(
    is_complex: bool,
    roots: EigenvalueTuple,
    selection: EigenvalueSelection,
    judged: VerdictAndCriterion,
    statement: Statement | None,
    is_whole: bool,
) -> SystemRoots:
    """Select those of all roots, of a densely solved system, that lie in a band or region.

    Parameters
    ----------
    is_complex : bool
        Whether a matrix is complex.
    roots : tuple of Eigenvalue
        All roots.
    selection : EigenvalueSelection
        The band or region.
    judged : (str or None, str)
        The verdict on all roots and what decided it. If no root grows anywhere it holds for the
        region too, with one exception: a root outside makes the list of all marginal, and in the
        region all roots decay, or there is none. The verdict is then that of the region's roots.
    statement : Statement or None
        What the referee says of all roots; None if it did not judge them.
    is_whole : bool
        Whether `roots` are as many as the equations have.

    Returns
    -------
    SystemRoots
        `eigenvalues` are the roots that lie in the region or may do so by their errors; `count` is
        the number of roots strictly inside, None unless the list of all is whole. The two differ
        by what errors leave open.
    """
    region = selection.rectangle
    assert region is not None  # this selection has a band or a region
    values = values_of(roots)
    if selection.band is not None:
        # a band has no limit of growth rates: its rectangle is made wider than the fastest growth
        # or decay in the band
        in_band = (values.imag > region.low_imag) & (values.imag < region.high_imag)
        largest = float(np.max(np.abs(values.real[in_band]), initial=0.0))
        half_width = max(WIDER * largest, region.high_real)
        region = replace(region, low_real=-half_width, high_real=half_width)
    # of complex matrices roots with Im < 0 are no motions; of real ones they are conjugates, which
    # a region below the real axis holds
    motion_roots = roots
    if is_complex:
        motion_roots = _upper_half(roots, is_complex)
    inside = []
    others = []
    for root in motion_roots:
        if may_lie_in(root, region):
            inside.append(root)
        else:
            others.append(root)
    outside = growing(others)
    count = None
    if is_whole:
        count = int(np.sum(region.contains(values_of(motion_roots))))
    verdict, criterion = judge_roots(inside, complete=False)
    if verdict is None and not outside:  # nothing grows
        verdict, criterion = judged
        verdict_inside, criterion_inside = judge_roots(inside)
        # a root outside may make the list of all marginal; an empty region has no verdict
        if verdict == "marginal" and (not inside or verdict_inside == "stable"):
            verdict = verdict_inside
            criterion = criterion_inside
    return SystemRoots(
        eigenvalues=tuple(inside),
        region=region,
        count=count,
        verdict=verdict,
        criterion=criterion,
        outside=tuple(mode.root for mode in outside),
        judged_by=statement,
        doubts=tuple(doubts_at_ends(motion_roots, region)),
    )


def _upper_half(roots: EigenvalueTuple, is_complex: bool) -> EigenvalueTuple:
    """The roots with Im >= 0, which describe all motions of real and of complex matrices.

    Of complex matrices a real root may lie below the axis by its rounding.
    """
    upper = []
    for root in roots:
        lowest_imag = -root.rounding if is_complex else 0.0
        if root.value.imag >= lowest_imag:
            upper.append(root)
    return tuple(upper)
