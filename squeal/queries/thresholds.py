"""The verb `thresholds`: every change of stability of a pad or of a system over its parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from squeal.equilibrium import Path
from squeal.equilibrium.damping import damped_model
from squeal.equilibrium.statics import excursion
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.linear import GROWING, CriticalPoint, Crossing, SystemFunction
from squeal.linear import thresholds as located_thresholds
from squeal.linear.continuation import ContinuationOptions
from squeal.linear.matrices import checked, reduce
from squeal.linear.roots import STIFF, hides_slow_roots
from squeal.linear.system import TermSystem
from squeal.queries.options import (
    Band,
    Progress,
    Region,
    Subject,
    Workers,
    refuse_options,
    upper_end,
)
from squeal.queries.pads.equilibrium import branch_system, roots_and_verdict
from squeal.results.sources import EigenvalueSelection, PadSource
from squeal.results.thresholds import MISSED, Thresholds
from squeal.schema import Number, Place, Positive, public

if TYPE_CHECKING:  # pads start without the referee and the solvers of systems
    from squeal.queries.ranges import RangeStatement
    from squeal.queries.systems.system_analysis import SystemAnalysis

MU_MAX = Number(low=0.0, high=1000.0)
ADMISSIBLE_TO = 1e-9  # relative: to which the end of the admissible range is located
NEAR_FOLD = 1e-9  # relative: so close to a fold rounding makes thresholds
GROWS_OUTSIDE = "what grows outside of the band or region may enter it while it grows"

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
    workers: Workers | None = None,
    prove: bool | None = None,
) -> Thresholds:
    """Find every change of stability over a range of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, memory, progress, workers
        As `sweep` takes them. A system of more than 400 rows needs a band or a region.
    high : float, optional
        Upper end of the range; left out, 2 of `mu`, or the subject's own value if that is larger.
        Another parameter needs it unless its own value is above 2.
    low : float, optional
        Lower end, of systems; left out, 0, or a little above where a factor divides by the
        parameter.
    prove : bool, optional
        Whether the referee judges the list. If left out, it does so of a pad and of a system of up
        to 40 rows; with True also of up to 400 rows, which takes seconds to minutes. `proof` says
        what is proved, and of which extent.

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

    analysis = SystemAnalysis.of(subject, band, region, None, memory, progress)
    return system_thresholds_with_proof(analysis, high, low, workers or 1, prove)


def critical_friction(scene: Scene, high: float = 2.0, prove: bool | None = False) -> Thresholds:
    """Thresholds of the scene's pad along the branch of equilibria from mu = 0.

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. B3 is linearised about the origin and has no branch.

    Parameters
    ----------
    scene : Scene
        The scene.
    high : float
        Upper end of the friction.
    prove : bool, optional
        Whether the referee judges the list, which it does too if this is None. Its `proof` says up
        to where, and thresholds get the intervals in which they are proved. If it refutes the list,
        the search is repeated once with a step that ends at the friction in question.

    Raises
    ------
    InputError
        For a friction that is not `MU_MAX`.
    ComputationError
        If there is no equilibrium without friction.
    """
    high = MU_MAX.read(high, Place("thresholds", "high"))
    system, path = branch_system(scene, high)
    if path is not None and path.mu_end <= 0.0:
        raise ComputationError(f"no threshold can be given: {path.end}")
    M, C, K = checked(*system(0.0))
    if path is not None and hides_slow_roots(reduce(M, C, K), C, K):
        raise ComputationError(f"no threshold can be given: {STIFF}")
    answer = _without_proof(scene, high, system, path)
    if prove is False:
        return answer
    fastest = math.sqrt(float(np.linalg.norm(np.linalg.solve(M, K), 2)))
    proved, refuted_at = _proved(scene, path, answer, fastest)
    if refuted_at is None:
        return proved
    again = _without_proof(scene, high, system, path, [refuted_at])
    proved_again, refuted_again_at = _proved(scene, path, again, fastest)
    return proved if refuted_again_at is not None else proved_again


def _without_proof(
    scene: Scene,
    high: float,
    system: SystemFunction,
    path: Path | None,
    looked_at: Sequence[float] = (),
) -> Thresholds:
    """The thresholds of a pad as they are located, without a proof.

    Parameters
    ----------
    system : SystemFunction
        mu -> (M, C, K) about the equilibrium.
    path : Path or None
        The branch of equilibria; None of a model that is linearised about the origin.
    looked_at : sequence of float
        Values of friction at which steps of the search end.
    """
    _, at_zero = roots_and_verdict(*checked(*system(0.0)))
    if path is None:
        located = located_thresholds(system, high, [*looked_at])
        return Thresholds(
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
            source=PadSource(scene),
        )
    reach = path.mu_end
    if path.fold is not None:
        # nearer to it rounding makes thresholds, and at it the contact may have changed
        reach = max(path.fold * (1 - NEAR_FOLD) - path.error(path.fold), path.fold / 2)
    located = located_thresholds(system, reach, [*path.breakpoints, *looked_at])
    points = located.points
    admissible_to, warnings = _admissible(path)
    if path.fold is not None:
        interval = (path.fold, path.fold)
        points.append(CriticalPoint(path.fold, "fold", 0.0, interval, True))
        if path.fold < scene.pad.mu <= high:
            warnings.append(
                f"the scene's mu = {scene.pad.mu:g} lies beyond a fold: the branch from mu = 0 "
                f"turns back at mu = {path.fold:.9g}"
            )
    return Thresholds(
        name=scene.model,
        parameter="mu",
        low=0.0,
        high=path.mu_end,
        verdict=at_zero.verdict,
        points=tuple(_widened_by_rounding(point, path) for point in points),
        crossings=tuple(_widened_by_rounding(crossing, path) for crossing in located.crossings),
        end=path.end,
        certified=located.certified,
        warnings=tuple(warnings),
        details={"admissible_to": min(admissible_to, path.mu_end)},
        source=PadSource(scene, branch=path),
    )


def _proved(
    scene: Scene, path: Path | None, answer: Thresholds, fastest: float
) -> tuple[Thresholds, float | None]:
    """The answer with what the referee says of it, and the friction at which it is refuted.

    fastest: the largest |lambda| without friction, rad/s. The friction is None if nothing is
    refuted.
    """
    from squeal.queries.ranges import pad_statement  # here, since few answers need it

    start = np.zeros(3)
    if path is not None:
        at_rest = path.equilibrium(0.0)
        assert at_rest is not None
        start = np.array(at_rest.q)
    losses = [point.mu for point in answer.points if point.kind in GROWING]
    statement, places = pad_statement(
        damped_model(scene),
        start,
        answer.crossings,
        answer.high,
        losses[0] if losses else None,
        fastest,
        None if path is None else path.fold,
    )
    return with_statement(answer, statement, places), statement.refuted_at


def with_statement(
    answer: Thresholds, statement: RangeStatement, intervals: Sequence[tuple[float, float]]
) -> Thresholds:
    """The answer with the referee's statement on it.

    intervals: those in which thresholds are proved; a threshold in one of them gets it as its own.
    """

    def widened(located: Located) -> Located:
        for low, high in intervals:
            if low <= located.mu <= high:
                return replace(located, interval=(low, high))
        return located

    proved = statement.status == "proved"
    notes = answer.notes
    details = {**answer.details}
    if proved:
        notes = tuple(note for note in notes if not note.endswith(MISSED))
    if "doubts" in details:
        details["doubts"] = [] if proved else [statement.reason]
    return replace(
        answer,
        notes=notes,
        details=details,
        points=tuple(map(widened, answer.points)),
        crossings=tuple(map(widened, answer.crossings)),
        certified=proved,
        proof=statement.to_dict(),
        proof_line=statement.words,
    )


def _widened_by_rounding(located: Located, path: Path) -> Located:
    """A fold or a change of contact with the interval in which rounding leaves it."""
    error = path.error(located.mu)
    if not error:
        return located
    interval = (located.mu - error, located.mu + error)
    if isinstance(located, Crossing):
        return replace(located, interval=interval)
    converged = 2 * error <= ContinuationOptions.same * located.mu
    return replace(located, interval=interval, converged=converged)


def _admissible(path: Path) -> tuple[float, list[str]]:
    """The mu up to which equilibria satisfy all limits of the model, to nine digits.

    Also a sentence for each limit that is exceeded from there on; none if the branch ends before.
    """

    def beyond_limit(z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """Which of m equilibria z (4, m), touching (points, m), exceed a limit: their numbers."""
        at = excursion(path.statics, z, touching)
        return np.flatnonzero(at.beyond().any(axis=0) & (at.reaction > 0.0))

    outside = beyond_limit(path.branch.z, path.branch.touching)
    if not outside.size:
        return path.mu_end, []
    first_outside = outside[0]
    mu_of_nodes = path.branch.z[3]
    low = float(mu_of_nodes[max(first_outside - 1, 0)])
    high = float(mu_of_nodes[first_outside])
    while high - low > ADMISSIBLE_TO * high:
        middle = (low + high) / 2
        if beyond_limit(*path.places([middle])).size:
            high = middle
        else:
            low = middle
    at = path.equilibrium(high)
    assert at is not None
    return low, [f"from mu = {high:.6g} on {words}" for words in at.excesses]


def system_thresholds_with_proof(
    analysis: SystemAnalysis,
    high: float,
    low: float | None = None,
    workers: int = 1,
    prove: bool | None = None,
) -> Thresholds:
    """Every threshold of the selected roots of a system, and what the referee says of them.

    The referee proves the thresholds of a system of few rows whose entries are given, and
    counts growing roots beside those of other small real systems. If it refutes the list, the
    search is repeated with a step that ends at the value in question.

    Parameters
    ----------
    analysis : SystemAnalysis
        The system and the selection of its roots.
    high, low : float
        The range of the free parameter; see `system_thresholds`.
    workers : int
        Processes that count roots.
    prove : bool, optional
        False: the referee is not asked. True: it is asked of up to 400 rows, however long that
        takes, and what it cannot prove of its kind is refused.

    Raises
    ------
    InputError
        For an empty range, and with `prove` for a system that cannot be proved.
    """
    from squeal.queries.ranges import PROVED_ROWS, SEARCHES
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.known import thresholds_as_known
    from squeal.queries.systems.matrices import ALL_ROWS
    from squeal.queries.systems.seat import thresholds_as_seated
    from squeal.queries.systems.sensitivity import widened_by_reduction
    from squeal.queries.systems.thresholds import system_thresholds
    from squeal.queries.systems.verdicts import NO_ROOT

    system = analysis.system
    selection = analysis.selection
    assumptions = analysis.file.assumptions
    can_be_proved = is_small(system) and not analysis.joined and not assumptions
    lists_all = selection == EigenvalueSelection()
    if prove and analysis.joined:
        raise InputError(
            "prove: nothing is proved of components that were reduced, which moves their roots; "
            "without `cutoff` and a band they are not"
        )
    if prove and assumptions:
        raise InputError(f"prove: nothing is proved of what was assumed: {'; '.join(assumptions)}")
    if prove and not (can_be_proved and lists_all):
        raise InputError(
            f"prove: all thresholds of real systems of up to {ALL_ROWS} rows can be proved, "
            "without a band or a region"
        )
    proof_is_wanted = prove is True or (prove is None and system.n <= PROVED_ROWS)
    analysis.warn_of_unused_parameter()
    looked_at: list[float] = []
    for _ in range(SEARCHES):
        answer, every = system_thresholds(
            system, high, low, selection, workers, looked_at=looked_at
        )
        refuted_at = None
        if can_be_proved and every is not None and proof_is_wanted:
            answer, refuted_at = _proved_system(system, selection, answer, every, prove is True)
        elif is_small(system) and system.real and prove is not False:
            answer, refuted_at = _counted_system(system, answer, lists_all)
        if refuted_at is None:
            break
        looked_at.append(refuted_at)
    if answer.certified and answer.proof is None and is_small(system):
        answer = _counted_not_proved(answer)
    if analysis.joined:
        answer = widened_by_reduction(system, analysis.file.assembly, answer)
    if is_small(system) and prove is not False and answer.verdict != NO_ROOT:
        answer = replace(answer, verdict=_judged_start(analysis, answer.low))
    answer = thresholds_as_seated(analysis.file, answer)
    return thresholds_as_known(analysis.file, selection, answer)


def _judged_start(analysis: SystemAnalysis, low: float) -> str | None:
    """The verdict at the lower end of the range, as `eigenvalues` has it there."""
    from squeal.queries.systems.known import data_of, error_bounds
    from squeal.queries.systems.roots import system_roots

    file = analysis.file
    system = file.system
    changes = {system.parameter: low}
    data = data_of(file, system)
    bounded = error_bounds(file, system)
    return system_roots(system, analysis.selection, changes, bounded, data).verdict


def _counted_not_proved(answer: Thresholds) -> Thresholds:
    """The answer of a system so small that a proof is expected: not certified by counts alone,
    since a mode may grow between two values at which growing roots were counted."""
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
    return replace(answer, certified=False, proof=statement.to_dict(), proof_line=statement.words)


def _proved_system(
    system: TermSystem,
    selection: EigenvalueSelection,
    answer: Thresholds,
    every: Sequence[Crossing],
    at_any_cost: bool,
) -> tuple[Thresholds, float | None]:
    """The answer with what the referee says of its whole range, and where it is refuted.

    The referee counts all roots: of a band nothing is proved while others grow, which may enter it.

    every: all crossings, of which the answer may list those of a band or region; at_any_cost:
    whether the proof was asked for, however long it takes.
    """
    from squeal.queries.ranges import system_statement
    from squeal.queries.systems.all_roots import roots_of_all
    from squeal.queries.systems.verdicts import rounding_of

    changes = {system.parameter: answer.low}
    roots = roots_of_all(system, EigenvalueSelection(), changes)
    sizes = np.abs(roots)
    oscillates = np.abs(roots.imag) > rounding_of(system, roots)
    fastest = float(np.max(sizes, initial=0.0))
    slowest = float(np.min(sizes[oscillates], initial=fastest))
    statement, intervals = system_statement(
        system, every, answer.low, answer.high, (slowest, fastest), at_any_cost
    )
    doubts = list(answer.details["unconfirmed"])
    selected = roots_of_all(system, selection, changes)
    grows_outside = _number_growing(system, roots) > _number_growing(system, selected)
    if grows_outside or len(every) > len(answer.crossings):
        doubts.append(GROWS_OUTSIDE)
    if statement.status == "proved" and doubts:
        words = "; ".join(doubts)
        statement = replace(statement, status="open", growth_below=None, reason=words)
    return with_statement(answer, statement, intervals), statement.refuted_at


def _number_growing(system: TermSystem, roots: NDArray[np.complex128]) -> int:
    """How many modes grow by more than rounding may move them."""
    from squeal.queries.systems.verdicts import rounding_of

    grows = roots.real > rounding_of(system, roots)
    return int(np.count_nonzero(grows & (roots.imag >= 0.0)))


def _counted_system(
    system: TermSystem, answer: Thresholds, is_complete: bool
) -> tuple[Thresholds, float | None]:
    """The answer, certified only if the counts of the referee agree with it, and where they refute
    it; `is_complete` says that all thresholds are listed, not those of a band or region alone."""
    from squeal.queries.ranges import doubt_of_counts

    doubt, refuted_at = doubt_of_counts(
        system, answer.crossings, answer.low, answer.high, is_complete
    )
    if not doubt:
        return answer, None
    details = {**answer.details, "doubts": [*answer.details["doubts"], doubt]}
    return replace(answer, certified=False, details=details), refuted_at
