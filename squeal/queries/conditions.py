"""The verb `conditions`: what grows at each combination of operating conditions.

Each condition is the subject at other parameters, as `--set` changes them: the equilibrium of a pad
and the seat of an assembly are found anew. Modes are matched over the conditions as `compare` pairs
them: those of two conditions that differ by one step along one axis, by frequency and MAC. Pairs
are united, those of least cost first, unless a mode would then stand twice at one condition.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from squeal.errors import ComputationError, meant
from squeal.io.processes import counted, one_thread
from squeal.io.scene import Scene
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue
from squeal.linear.verdicts import ACCEPTED
from squeal.queries.compare import Mode, assigned_pairs, pairing_costs
from squeal.queries.options import Band, Progress, Subject, Values, refuse_options
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.parameter_space import ParameterSpace
from squeal.results.conditions import Condition, Conditions, ModeAtCondition, at_parameters
from squeal.schema import Place, Positive, public

if TYPE_CHECKING:  # pads start without the solvers of systems
    from squeal.queries.systems.system_analysis import SystemAnalysis
    from squeal.sparse.reduction import Reduction

MOST = 100_000
"""The largest number of conditions."""
TOLERANCE = 0.1
"""What differs by more than this share of its frequency at the next value is another mode."""
UNLIKE = 1.0
"""The cost of a pair from which on its shapes or frequencies are not those of one mode."""
SERVED = 24
"""The number of conditions at which a reduced system has to be good."""
AT = Place("conditions", "axes")
Changes = Mapping[str, float]


@public
def conditions(
    subject: Subject,
    axes: Mapping[str, Values],
    band: Band | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
) -> Conditions:
    """Compute what grows at each combination of operating conditions.

    Parameters
    ----------
    subject : Scene, System, Assembly or SystemFile
        The equilibrium of a scene and the contact of an assembly are found anew at each condition.
    axes : mapping of str to sequence of float
        Values of each parameter, such as ``{"mu": [0.3, 0.5], "pressure": [1e6, 2e6]}``.
    band, memory, progress
        As `eigenvalues` takes them; a system of more than 400 rows needs a band.

    Returns
    -------
    Conditions
        A row for each condition, and for each mode the share of conditions at which it grows.

    Raises
    ------
    InputError
        For what is no parameter, for values out of range, and beyond the ends of tables.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
    >>> found = squeal.conditions(pair, {"mu": [0.2, 0.6, 1.0], "gap": [0.3, 0.7]})
    >>> [condition.unstable for condition in found.conditions]
    [0, 0, 1, 0, 1, 1]
    >>> [mode.propensity for mode in found.modes]
    [0.5]
    """
    grid = _combinations(ParameterSpace.of(subject, "conditions", 1.0, "growth"), axes)
    if isinstance(subject, Scene):
        refuse_options("a scene", band=band, memory=memory)
        solved = (_pad_condition(subject, changes) for changes in grid)
        return _answer(subject.model, axes, solved)
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.reduced import basis_of, reduced_for
    from squeal.queries.systems.system_analysis import SystemAnalysis
    from squeal.sparse.quadratic import PROGRESS

    analysis = SystemAnalysis.of(subject, band, None, None, memory, progress)
    system = analysis.system
    seated = analysis.file.assembly is not None
    for name in grid[0]:
        if not seated and name not in system.names:
            used = ", ".join(sorted(system.names)) or "no parameter"
            raise AT.refuse(f"{name} is not allowed, no matrix depends on it; {used} does")
    reduction = None
    if not seated and not is_small(system):
        served = grid[:: max(1, len(grid) // SERVED)]
        reduction = reduced_for(system, analysis.selection, served, "modal")
    computed = _system_conditions(analysis, reduction, grid)
    told = counted(computed, len(grid), PROGRESS.get(), "conditions")
    extent = "" if analysis.selection.band is None else analysis.selection.words()
    return _answer(
        system.name,
        axes,
        told,
        extent=extent,
        seated=seated,
        basis=basis_of(reduction, analysis.selection) or analysis.joined,
    )


def _combinations(space: ParameterSpace, axes: Mapping[str, Values]) -> list[Changes]:
    """All combinations of the values of the axes, the last one fastest. Raises InputError."""
    if not axes:
        raise AT.refuse("none is given; at least one parameter with its values is required")
    count = 1
    for name, values in axes.items():
        if name not in space.values:
            raise AT.refuse(f"{name} is no parameter here; {meant(name, space.values)}")
        if len(set(values)) < len(values):
            raise AT.refuse(f"{name} has a value twice; each value is allowed once")
        count *= len(values)
    if count > MOST:
        raise AT.refuse(f"{count} conditions are not allowed; it must be at most {MOST}")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _place(changes: Changes) -> Place:
    """A condition, for messages."""
    return Place("conditions", at_parameters(changes))


class _Solved(NamedTuple):
    """A condition, and the modes there with their shapes: their numbers are not known yet."""

    condition: Condition
    modes: Sequence[Mode]


def _pad_condition(scene: Scene, changes: Changes) -> _Solved:
    with _place(changes).named():
        changed = scene.replace(**changes)
    try:
        analysis = analyse(changed)
    except ComputationError as error:
        return _Solved(Condition(changes, reason=str(error)), ())
    roots = analysis.spectrum.eigenvalues
    return _solved(changes, roots, analysis.judgement.verdict, analysis.admissible)


def _system_conditions(
    analysis: SystemAnalysis, reduction: Reduction | None, grid: Sequence[Changes]
) -> Iterator[_Solved]:
    """What happens at each condition, with one thread of BLAS."""
    with one_thread():
        for changes in grid:
            try:
                with _place(changes).named():
                    solved = _system_condition(analysis, reduction, changes)
            except ComputationError as error:
                solved = _Solved(Condition(changes, reason=str(error)), ())
            yield solved


def _system_condition(
    analysis: SystemAnalysis, reduction: Reduction | None, changes: Changes
) -> _Solved:
    """What a system does at a condition: by the reduced one, or solved on its own."""
    from squeal.queries.systems.known import error_bounds
    from squeal.queries.systems.reduced import estimated_roots
    from squeal.queries.systems.roots import system_roots
    from squeal.queries.systems.verdicts import verdict_of

    if reduction is not None:
        roots = estimated_roots(reduction, changes)
        values = np.array([root.value for root in roots])
        verdict = verdict_of(values, np.array([root.rounding for root in roots]))
        # of the roots of a band only growth is a verdict
        return _solved(changes, roots, verdict if verdict in GROWING else None)
    file = analysis.file.replaced(changes)
    found = system_roots(
        file.system, analysis.selection, add_errors=error_bounds(file, file.system)
    )
    accepted = [root for root in found.every if root.residual <= ACCEPTED]
    return _solved(changes, accepted, found.verdict)


def _solved(
    changes: Changes, roots: Sequence[Eigenvalue], verdict: str | None, admissible: bool = True
) -> _Solved:
    """A condition from its roots."""
    rows: list[ModeAtCondition] = []
    modes: list[Mode] = []
    for root in roots:
        grows = root.kind in GROWING and root.value.imag >= -root.rounding
        if not grows and root.value.imag <= 0.0:
            continue
        row = ModeAtCondition(root.frequency_hz, root.growth_rate, root.damping_ratio, grows)
        damping = row.damping_ratio if grows else abs(row.damping_ratio)
        modes.append(Mode(len(rows), row.frequency_hz, damping, root.right))
        rows.append(row)
    condition = Condition(changes, verdict, tuple(rows), admissible)
    return _Solved(condition, modes)


ModeOverConditions = dict[int, int]
"""Which of the modes of a condition a mode is, by the conditions that have it."""


class _Link(NamedTuple):
    """A pair of modes of neighbouring conditions, each by its condition and its place there."""

    cost: float
    first: tuple[int, int]
    second: tuple[int, int]


def _links(
    solved: Iterable[_Solved], lengths: Sequence[int]
) -> tuple[list[Condition], list[_Link]]:
    """The conditions over a grid of these lengths, and the pairs between neighbours of it."""
    strides = [math.prod(lengths[axis + 1 :]) for axis in range(len(lengths))]
    conditions: list[Condition] = []
    links: list[_Link] = []
    modes: dict[int, Sequence[Mode]] = {}
    for k, (condition, here) in enumerate(solved):
        conditions.append(condition)
        modes[k] = here
        for stride, length in zip(strides, lengths, strict=True):
            if k // stride % length == 0:
                continue
            before = modes[k - stride]
            costs = pairing_costs(before, here, TOLERANCE)
            for i, j in assigned_pairs(costs, before, here, TOLERANCE):
                cost = float(costs.cost[i, j])
                if cost < UNLIKE:
                    links.append(_Link(cost, (k - stride, i), (k, j)))
        modes.pop(k - strides[0], None)  # whose neighbours are all known
    return conditions, links


def _united(
    conditions: Sequence[Condition], links: Sequence[_Link]
) -> dict[tuple[int, int], ModeOverConditions]:
    """The mode over all conditions that each mode of a condition, by (condition, row), belongs to.

    Links unite modes, the cheapest first, unless a condition would then have two of one mode.
    """
    mode_of: dict[tuple[int, int], ModeOverConditions] = {}
    for k, condition in enumerate(conditions):
        for row in range(len(condition.rows)):
            mode_of[k, row] = {k: row}
    for link in sorted(links):
        first = mode_of[link.first]
        second = mode_of[link.second]
        if first.keys() & second.keys():
            continue
        first.update(second)
        for place in second.items():
            mode_of[place] = first
    return mode_of


def _numbered(conditions: Sequence[Condition], links: Sequence[_Link]) -> tuple[Condition, ...]:
    """The conditions with the numbers of the modes that grow somewhere.

    They are numbered by the lowest frequency at which they grow; other modes have no number.
    """
    lowest: dict[int, float] = {}
    unstable: dict[int, ModeOverConditions] = {}
    for (k, row), mode in _united(conditions, links).items():
        found = conditions[k].rows[row]
        if found.grows:
            key = id(mode)
            unstable[key] = mode
            lowest[key] = min(lowest.get(key, math.inf), found.frequency_hz)
    numbers: dict[tuple[int, int], int] = {}
    for number, key in enumerate(sorted(lowest, key=lambda key: lowest[key]), 1):
        for place in unstable[key].items():
            numbers[place] = number
    numbered = []
    for k, condition in enumerate(conditions):
        rows_here = []
        for row, found in enumerate(condition.rows):
            rows_here.append(replace(found, mode=numbers.get((k, row))))
        numbered.append(replace(condition, rows=tuple(rows_here)))
    return tuple(numbered)


def _answer(
    name: str,
    axes: Mapping[str, Values],
    solved: Iterable[_Solved],
    extent: str = "",
    seated: bool = False,
    basis: Mapping[str, Any] | None = None,
) -> Conditions:
    """The answer from conditions as they are solved, in the order of the grid of the axes."""
    conditions, links = _links(solved, [len(values) for values in axes.values()])
    return Conditions(
        name=name,
        axes={axis: tuple(values) for axis, values in axes.items()},
        conditions=_numbered(conditions, links),
        tolerance=TOLERANCE,
        extent=extent,
        seated=seated,
        basis=basis,
    )
