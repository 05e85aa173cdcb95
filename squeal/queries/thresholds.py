"""The verb `thresholds`: every change of stability of a pad or of a system over its parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from squeal.equilibrium import Path
from squeal.equilibrium.damping import damped_model
from squeal.equilibrium.statics import excursion
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.linear import GROWING, CriticalPoint, Crossing, SystemFunction
from squeal.linear import thresholds as located_thresholds
from squeal.linear.eigen import Eigenvalue
from squeal.linear.events import EVENT_TOLERANCE
from squeal.linear.matrices import checked, dense, is_regular, normalised_system
from squeal.linear.roots import STIFF, ComplexArray, hides_slow_roots
from squeal.linear.system import TermSystem
from squeal.queries.options import (
    MU_MAX,
    Band,
    Progress,
    Region,
    Subject,
    Workers,
    refuse_options,
    upper_end,
)
from squeal.queries.pads.equilibrium import branch_system, roots_and_verdict
from squeal.results.columns import OPEN
from squeal.results.sources import EigenvalueSelection, PadSource
from squeal.results.thresholds import MISSED, Thresholds
from squeal.schema import Place, Positive, public

if TYPE_CHECKING:  # pads start without the referee and the solvers of systems
    from squeal.queries.ranges import RangeStatement
    from squeal.queries.systems.system_analysis import SystemAnalysis

ADMISSIBLE_TO = 1e-9  # relative: to which the end of the admissible range is located
NEAR_FOLD = 1e-9  # relative: closer to a fold rounding makes spurious thresholds
GROWS_OUTSIDE = "what grows outside of the band or region may enter it while it grows"
FEW_ROWS = 5  # up to which exact thresholds take less time than a search
NO_FREQUENCY = "of a crossing that is not located to rounding no frequency is proved"

Located = TypeVar("Located", CriticalPoint, Crossing)


@public
def thresholds(
    subject: Subject,
    high: float | None = None,
    low: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,  # `public` reads it
    prove: bool | None = None,
) -> Thresholds:
    """Find every change of stability over a range of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, memory, progress, workers
        As `sweep` takes them. A system of more than 400 rows needs a band or a region.
    high : float, optional
        Upper end of the range. Left out, it is 2 for the friction `mu`, or the subject's own value
        if that is larger; for another parameter it is twice its own value, which must be above 0.
    low : float, optional
        Lower end, of systems; left out, 0, or a little above where a factor divides by the
        parameter.
    prove : bool, optional
        Whether the referee judges the list: a check in interval arithmetic, independent of the
        search. If left out, it judges that of a pad and of a system of up to 40 rows; with True
        also of up to 400 rows, which takes seconds to minutes. `proof` says what is proved, and of
        which extent.

    Returns
    -------
    Thresholds
        Changes of the verdict, and all crossings of the imaginary axis, by rising value.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> loss = squeal.thresholds(squeal.System([[1, 0], [0, 1]], K=K)).first
    >>> loss.kind, round(loss.mu, 9)
    ('flutter', 0.75)
    """
    high = upper_end(subject, high)
    if isinstance(subject, Scene):
        refuse_options("a scene", band=band, region=region, memory=memory, low=low, workers=workers)
        return critical_friction(subject, high, prove)
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(
        subject, band, region, modes=None, memory=memory, progress=progress
    )
    return system_thresholds_with_proof(analysis, high, low, prove)


def critical_friction(scene: Scene, high: float = 2.0, prove: bool | None = False) -> Thresholds:
    """Locate the thresholds of a scene's pad along the branch of equilibria from mu = 0.

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. B3 is linearised about the origin and has no branch.

    Parameters
    ----------
    scene : Scene
        The scene.
    high : float
        Upper end of the friction.
    prove : bool, optional
        Whether the referee judges the list; None counts as True. Its `proof` says up to where, and
        thresholds get the intervals in which they are proved. If it refutes the list, the search is
        repeated once with a step that ends at the friction in question.

    Raises
    ------
    InputError
        For an upper end that `MU_MAX` does not allow.
    ComputationError
        If there is no equilibrium without friction.
    """
    high = MU_MAX.read(high, Place("thresholds", "high"))
    system, path = branch_system(scene, high)
    if path is not None and path.mu_end <= 0.0:
        raise ComputationError(f"no threshold can be given: {path.why_it_ends}")
    M, C, K = checked(*system(0.0))
    # `roots_and_verdict` skips this check for a pad with a free coordinate; here it is made for any
    # pad on a branch, that is not for B3
    if path is not None and hides_slow_roots(normalised_system(M, C, K), C, K):
        raise ComputationError(f"no threshold can be given: {STIFF}")
    # a bound of |lambda| without friction and damping, rad/s
    fastest = math.sqrt(float(np.linalg.norm(np.linalg.solve(M, K), 2)))
    step_ends: list[float] = []  # the friction at which the referee refuted an earlier list
    for _ in range(2):  # the last answer stands, also if it is refuted
        answer = pad_thresholds(scene, high, system, path, step_ends)
        if prove is False:
            break
        answer, refuted_at = _judged(scene, path, answer, fastest)
        if refuted_at is None:  # the list is proved, or open
            break
        step_ends.append(refuted_at)
    return answer


def pad_thresholds(
    scene: Scene,
    high: float,
    system: SystemFunction,
    path: Path | None,
    step_ends: Sequence[float],
) -> Thresholds:
    """Locate the thresholds of a pad without the referee.

    Parameters
    ----------
    scene : Scene
        The scene.
    high : float
        Upper end of the friction.
    system : SystemFunction
        mu -> (M, C, K) about the equilibrium.
    path : Path or None
        The branch of equilibria; None of a model that is linearised about the origin.
    step_ends : sequence of float
        Values of friction at which steps of the search end.
    """
    _, at_zero = roots_and_verdict(*checked(*system(0.0)))
    end_of_search = high if path is None else path.mu_end
    if path is not None and path.fold is not None:
        # the search ends a little below the fold: next to it rounding makes spurious thresholds,
        # and within the error of the fold contact may have changed. Half of the branch is searched
        # in any case, however large this error is
        end_of_search = max(path.fold * (1 - NEAR_FOLD) - path.error(path.fold), path.fold / 2)
    breakpoints = () if path is None else path.breakpoints
    located = located_thresholds(system, end_of_search, [*breakpoints, *step_ends])
    answer = Thresholds(
        name=scene.model,
        parameter="mu",
        low=0.0,
        high=high,
        verdict=at_zero.verdict,
        points=tuple(located.points),
        crossings=tuple(located.crossings),
        end=f"mu = {high:g} is reached",
        certified=located.certified,
        details={"admissible_to": high},
        source=PadSource(scene, branch=path),
    )
    return answer if path is None else _on_branch(answer, scene, path)


def _on_branch(answer: Thresholds, scene: Scene, path: Path) -> Thresholds:
    """Add to located thresholds the end of the branch of equilibria, and the limits of the model.

    A fold is the last threshold. The intervals of thresholds at a fold or a change of contact are
    widened to the rounding of the equilibrium there.
    """
    points = list(answer.points)
    admissible_to, warnings = _admissible(path)
    if path.fold is not None:
        interval = (path.fold, path.fold)  # widened to the rounding of the fold below
        fold = CriticalPoint(path.fold, "fold", frequency_hz=0.0, interval=interval, converged=True)
        points.append(fold)
        if path.fold < scene.pad.mu <= answer.high:
            warnings.append(
                f"the scene's mu = {scene.pad.mu:g} lies beyond a fold: the branch from mu = 0 "
                f"turns back at mu = {path.fold:.9g}"
            )
    return replace(
        answer,
        high=path.mu_end,
        points=tuple(_widened_by_rounding(point, path) for point in points),
        crossings=tuple(_widened_by_rounding(crossing, path) for crossing in answer.crossings),
        end=path.why_it_ends,
        warnings=tuple(warnings),
        details={"admissible_to": min(admissible_to, path.mu_end)},
    )


class _Refereed(NamedTuple):
    """Thresholds with what the referee says of them."""

    answer: Thresholds
    refuted_at: float | None  # value of the parameter at which it refutes them; None: it does not


def _judged(scene: Scene, path: Path | None, answer: Thresholds, fastest: float) -> _Refereed:
    """Let the referee judge the thresholds of a pad.

    fastest: a bound of |lambda| without friction and damping, rad/s, the scale of the growth that
    the proof cannot exclude.
    """
    from squeal.queries.ranges import pad_statement  # here, since few answers need it

    q_at_rest = np.zeros(3)  # B3, which has no branch, is linearised about the origin
    fold = None
    if path is not None:
        at_rest = path.equilibrium(0.0)
        assert at_rest is not None
        q_at_rest = np.array(at_rest.q)
        fold = path.fold
    first_loss = next((point.mu for point in answer.points if point.kind in GROWING), None)
    statement, intervals = pad_statement(
        damped_model(scene), q_at_rest, answer.crossings, answer.high, first_loss, fastest, fold
    )
    return _Refereed(with_statement(answer, statement, intervals), statement.refuted_at)


def with_statement(
    answer: Thresholds, statement: RangeStatement, intervals: Sequence[tuple[float, float]]
) -> Thresholds:
    """The answer with the referee's statement on its thresholds, certified if they are proved.

    intervals: in which thresholds are proved. Each threshold gets the interval that holds it.
    """

    def with_proved_interval(located: Located) -> Located:
        for low, high in intervals:
            if low <= located.mu <= high:
                return replace(located, interval=(low, high))
        return located

    proved = statement.status == "proved"
    notes = answer.notes
    details = {**answer.details}
    if proved:  # the note that some may be missed is dropped
        notes = tuple(note for note in notes if not note.endswith(MISSED))
    # the referee has judged the whole range anew: what it leaves open is the doubt that remains
    if "doubts" in details:
        details["doubts"] = [] if proved else [statement.reason]
    return replace(
        answer,
        notes=notes,
        details=details,
        points=tuple(map(with_proved_interval, answer.points)),
        crossings=tuple(map(with_proved_interval, answer.crossings)),
        certified=proved,
        proof=statement.to_dict(),
        proof_line=statement.words,
    )


def _widened_by_rounding(located: Located, path: Path) -> Located:
    """Give a fold or a change of contact the interval in which rounding leaves it.

    Other thresholds are returned as they are.
    """
    error = path.error(located.mu)
    if not error:
        return located
    interval = (located.mu - error, located.mu + error)
    if isinstance(located, Crossing):
        return replace(located, interval=interval)
    converged = 2 * error <= EVENT_TOLERANCE * located.mu
    return replace(located, interval=interval, converged=converged)


def _admissible(path: Path) -> tuple[float, list[str]]:
    """Locate by bisection up to which mu equilibria satisfy all limits of the model (nine digits).

    Returns this mu, and a sentence for each limit that is exceeded from there on. Where no node of
    the branch exceeds a limit the mu is that of the end of the branch, and there is no sentence.
    Limits that are exceeded between two nodes alone are not seen.
    """

    def beyond_limit(z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """Indices of the equilibria z (4, m), touching (points, m), that exceed a limit.

        A pad that nothing presses on the surface, at the end of the branch, does not count.
        """
        excursions = excursion(path.statics, z, touching)
        return np.flatnonzero(excursions.beyond().any(axis=0) & (excursions.reaction > 0.0))

    outside = beyond_limit(path.branch.z, path.branch.touching)
    if not outside.size:
        return path.mu_end, []
    first_outside = outside[0]
    mu_of_nodes = path.branch.z[3]  # rows: x, y, w theta and mu
    low = float(mu_of_nodes[max(first_outside - 1, 0)])
    high = float(mu_of_nodes[first_outside])
    # ends at once where the first node, at mu = 0, is beyond a limit: both ends are 0
    while high - low > ADMISSIBLE_TO * high:
        middle = (low + high) / 2
        equilibrium = path.equilibria([middle])
        if beyond_limit(equilibrium.z, equilibrium.touching).size:
            high = middle
        else:
            low = middle
    equilibrium_beyond = path.equilibrium(high)
    assert equilibrium_beyond is not None
    return low, [f"from mu = {high:.6g} on {limit}" for limit in equilibrium_beyond.excesses]


def system_thresholds_with_proof(
    analysis: SystemAnalysis,
    high: float,
    low: float | None = None,
    prove: bool | None = None,
) -> Thresholds:
    """Locate every threshold of the selected roots of a system, and let the referee judge them.

    The referee proves the thresholds of a system of few rows whose entries are given. For another
    small real system it counts growing roots on both sides of each threshold. If it refutes the
    list, the search is repeated with a step that ends at the value in question; the last of up to
    `SEARCHES` lists stands. Once at most, thresholds that are exact for the entries, see
    `exact_range`, replace a search: the first one where M is singular, since a search may fail
    there, and where few rows have roots that pass zero together; else the one after a list that is
    not certified.

    Parameters
    ----------
    analysis : SystemAnalysis
        The system and the selection of its roots.
    high, low : float
        The range of the free parameter; see `system_thresholds`.
    prove : bool, optional
        False: the referee is not called. None: it proves the list of up to `PROVED_ROWS` rows, and
        counts for other small real systems. True: it proves that of up to 400 rows, however long it
        takes; a system of a kind that it cannot prove is refused.

    Raises
    ------
    InputError
        For an empty range, and with `prove` for a system that cannot be proved.
    """
    from squeal.queries.ranges import PROVED_ROWS, SEARCHES, exact_range, refuse_poles
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.data_precision import with_doubts
    from squeal.queries.systems.matrices import ALL_ROWS
    from squeal.queries.systems.seat import thresholds_as_seated
    from squeal.queries.systems.sensitivity import widened
    from squeal.queries.systems.thresholds import start_of_range, system_thresholds
    from squeal.queries.systems.verdicts import NO_ROOT

    system = analysis.system
    selection = analysis.selection
    assumptions = analysis.file.assumptions
    small = is_small(system)
    can_be_proved = small and not analysis.component_reduction and not assumptions
    lists_all = selection == EigenvalueSelection()
    if prove and analysis.component_reduction:
        raise InputError(
            "prove: nothing is proved of components that were reduced, which moves their roots; "
            "without `cutoff` and a band they are not"
        )
    if prove and assumptions:
        raise InputError(f"prove: nothing is proved of what was assumed: {'; '.join(assumptions)}")
    if prove and not (can_be_proved and lists_all):
        raise InputError(
            f"prove: all thresholds of real systems of up to {ALL_ROWS} rows whose matrices do not "
            "follow the frequency can be proved, without a band or a region"
        )
    is_to_be_proved = can_be_proved and (
        prove is True or (prove is None and system.n <= PROVED_ROWS)
    )
    analysis.warn_of_unused_parameter()
    if low is None:
        low = start_of_range(system, high)
    refuse_poles(system, low, high)
    exact_thresholds = None
    may_try_exact = is_to_be_proved and lists_all  # at most once
    if may_try_exact:
        is_singular = not is_regular(dense(system(low)[0]))
        if is_singular or system.n <= FEW_ROWS:
            exact_thresholds = exact_range(system, low, high)
        # a search divides its steps in vain beside roots that pass zero together
        if not is_singular and not (exact_thresholds and exact_thresholds.passes_zero_together):
            exact_thresholds = None
        may_try_exact = not is_singular and exact_thresholds is None
    step_ends: list[float] = []  # values at which the referee refuted an earlier list
    for _ in range(SEARCHES):
        # of a band `all_crossings` are those of all roots, None if these were not followed
        answer, all_crossings = system_thresholds(
            system, high, low, selection, step_ends=step_ends, exact_range=exact_thresholds
        )
        refuted_at = None
        if is_to_be_proved and all_crossings is not None:
            answer, refuted_at = _proved_system(
                system,
                selection,
                answer,
                all_crossings,
                at_any_cost=prove is True,
                is_exact=exact_thresholds is not None,
            )
        elif small and system.real and prove is not False:
            answer, refuted_at = _counted_system(system, answer, is_complete=lists_all)
        if may_try_exact and not answer.certified:
            may_try_exact = False
            exact_thresholds = exact_range(system, low, high)
            if exact_thresholds is not None:  # they take the place of this list
                continue
        if refuted_at is None:  # the list is proved, or open
            break
        exact_thresholds = None  # they were refuted, or there are none: search
        step_ends.append(refuted_at)
    if answer.certified and answer.proof is None:
        answer = _counted_not_proved(answer, is_certified=not small)
    # the intervals get wider by what data with few digits and reduced components leave open; where
    # the contact would leave the seat at which it was held, nothing is certified
    answer = widened(analysis.file, system, answer)
    answer = thresholds_as_seated(analysis.file, answer)
    if assumptions:
        answer = with_doubts(answer, assumptions)
    if small and answer.verdict != NO_ROOT:
        return _judged_at_start(analysis, answer, prove is not False)
    return answer


def _judged_at_start(analysis: SystemAnalysis, answer: Thresholds, refereed: bool) -> Thresholds:
    """The thresholds with the verdict at the lower end of the range, as `eigenvalues` gives it.

    Where this verdict is open, and a root there may grow by more than the proof of the thresholds
    leaves out, nothing is certified: the list does not say whether that root grows from there on.

    refereed: whether the referee judges the roots at the lower end.
    """
    from squeal.queries.systems.data_precision import open_by_digits, roots_of_file, with_doubts

    file = analysis.file
    system = file.system.replace({file.system.parameter: answer.low})
    roots = roots_of_file(file, analysis.selection, system, refereed)
    answer = replace(answer, verdict=roots.verdict)
    proof = answer.proof or {}  # as JSON holds it
    # without a proof nothing is certified of a small system; an open one gets a further reason
    if roots.verdict is not None or proof.get("status") not in ("proved", "open"):
        return answer
    growth_below = proof.get("growth_below")  # slower growth is not excluded by the proof either
    if growth_below is not None and _growth_bound(roots.eigenvalues) <= growth_below:
        return answer
    reason = (open_by_digits(file, roots.computed) or roots.criterion).removeprefix(OPEN)
    at_start = f"the verdict at {answer.parameter} = {answer.low:g} is open: {reason}"
    return with_doubts(answer, [at_start])


def _growth_bound(roots: Sequence[Eigenvalue]) -> float:
    """The largest growth rate, 1/s, that one of the roots may have by its error or rounding."""
    bound = -math.inf
    for root in roots:
        error = root.rounding if root.error is None else root.error
        bound = max(bound, root.value.real + error)
    return bound


def _counted_not_proved(answer: Thresholds, is_certified: bool) -> Thresholds:
    """State that the thresholds of an answer were counted: no proof was made.

    A mode may grow between two values at which growing roots were counted. Of a small system a
    proof is expected, so that counts alone do not certify its list: `is_certified` is then False.
    """
    from squeal.queries.ranges import RangeStatement

    statement = RangeStatement(
        status="counted",
        by="count",
        reason="a window of growth between two values that were counted is not excluded",
        parameter=answer.parameter,
        low=answer.low,
        until=answer.high,
        high=answer.high,
    )
    return replace(
        answer, certified=is_certified, proof=statement.to_dict(), proof_line=statement.words
    )


def _proved_system(
    system: TermSystem,
    selection: EigenvalueSelection,
    answer: Thresholds,
    all_crossings: Sequence[Crossing],
    at_any_cost: bool,
    is_exact: bool,
) -> _Refereed:
    """Let the referee prove the thresholds of a small system on their whole range.

    The referee counts all roots: nothing is proved of a band or region while roots outside of it
    grow, since they may enter it.

    Parameters
    ----------
    system : TermSystem
        The system.
    selection : EigenvalueSelection
        The band or region that the answer is about.
    answer : Thresholds
        The located thresholds.
    all_crossings : sequence of Crossing
        All crossings of the system, of which the answer may list those of a band or region.
    at_any_cost : bool
        Whether the proof was requested, however long it takes.
    is_exact : bool
        Whether the thresholds are exact for the entries as given.

    Returns
    -------
    _Refereed
        The answer with the statement of the referee and with the intervals that it proves, and
        where it refutes the answer, if it does.
    """
    from squeal.queries.ranges import enclosed_frequencies, system_statement
    from squeal.queries.systems.all_roots import motion_rates, roots_of_all

    changes = {system.parameter: answer.low}
    all_roots = roots_of_all(system, EigenvalueSelection(), changes)
    rates = motion_rates(system, changes)  # of the slowest and the fastest motion, rad/s
    statement, intervals = system_statement(
        system, all_crossings, answer.low, answer.high, rates, at_any_cost, is_exact
    )
    doubts = list(answer.details["unconfirmed"])  # sentences on growth that no threshold explains
    selected = roots_of_all(system, selection, changes)
    grows_outside = _number_growing(system, all_roots) > _number_growing(system, selected)
    if grows_outside or len(all_crossings) > len(answer.crossings):
        doubts.append(GROWS_OUTSIDE)
    if statement.status == "proved" and not is_exact:
        frequencies = enclosed_frequencies(system, answer.crossings, intervals)
        if None in frequencies.values():
            doubts.append(NO_FREQUENCY)

        def with_frequency(located: Located) -> Located:
            hertz = frequencies.get((located.mu, located.frequency_hz))
            return located if hertz is None else replace(located, frequency_hz=hertz)

        answer = replace(
            answer,
            points=tuple(map(with_frequency, answer.points)),
            crossings=tuple(map(with_frequency, answer.crossings)),
        )
    if statement.status == "proved" and doubts:
        reason = "; ".join(doubts)
        statement = replace(statement, status="open", growth_below=None, reason=reason)
    return _Refereed(with_statement(answer, statement, intervals), statement.refuted_at)


def _number_growing(system: TermSystem, roots: ComplexArray) -> int:
    """How many modes grow by more than rounding may move them."""
    from squeal.queries.systems.verdicts import rounding_of

    grows = roots.real > rounding_of(system, roots)
    return int(np.count_nonzero(grows & (roots.imag >= 0.0)))


def _counted_system(system: TermSystem, answer: Thresholds, is_complete: bool) -> _Refereed:
    """Withdraw the certificate of a small system's thresholds if counts of growing roots differ.

    The referee counts the growing roots at some values. A count that it cannot decide withdraws the
    certificate too; counts that agree give none. Returns the answer, and a value of the parameter
    at which a count refutes it, None without one.

    is_complete: whether the list holds all thresholds, not only those of a band or region.
    """
    from squeal.queries.ranges import doubt_of_counts

    doubt, refuted_at = doubt_of_counts(
        system, answer.crossings, answer.low, answer.high, is_complete
    )
    if not doubt:
        return _Refereed(answer, None)
    details = {**answer.details, "doubts": [*answer.doubts, doubt]}
    return _Refereed(replace(answer, certified=False, details=details), refuted_at)
