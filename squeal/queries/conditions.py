"""The verb `conditions`: what grows at each combination of operating conditions.

Each condition is the subject at other parameters, as `--set` changes them: the equilibrium of a pad
and the seat of an assembly are computed anew. Modes are matched over the conditions as `compare`
pairs them, by frequency and MAC: a link joins the same mode at two neighbouring conditions, which
differ by one step along one axis. Linked modes are united, those of least cost first, unless one
condition would then have the united mode twice.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from squeal.errors import ComputationError, suggestion
from squeal.io.processes import with_progress
from squeal.io.scene import Scene
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue, values_of
from squeal.model.pad import PARAMETERS
from squeal.queries.compare import Mode, assigned_pairs, pairing_costs
from squeal.queries.options import Band, Progress, Subject, Values, refuse_options
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.parameter_space import ParameterSpace
from squeal.results.conditions import Condition, Conditions, ModeAtCondition, at_parameters
from squeal.schema import Place, Positive, public

if TYPE_CHECKING:  # pads start without the solvers of systems
    from squeal.queries.systems.system_analysis import SystemAnalysis
    from squeal.sparse.reduction import Reduction

MOST_CONDITIONS = 100_000  # that a grid may have
TOLERANCE = 0.1
"""Modes of neighbouring conditions whose frequencies differ by a larger share are two modes."""
UNLIKE = 1.0
"""Pairs of this cost or more (see `pairing_costs`) are not taken for one mode."""
BASIS_CONDITIONS = 24
"""About so many conditions, evenly chosen, are those that a reduced system is made at."""
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
    # no threshold is searched: `high`, the end of a range of friction, may be any allowed value
    space = ParameterSpace.of(subject, "conditions", high=1.0, quantity="growth")
    grid = _combinations(space, axes)
    if isinstance(subject, Scene):
        refuse_options("a scene", band=band, memory=memory)
        solved = _solve_all(partial(_pad_condition, subject), grid)
        units = {name: PARAMETERS[name].unit for name in axes if name in PARAMETERS}
        return replace(_answer(subject.model, axes, solved), units=units)
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.reduced import basis_of, reduced_for
    from squeal.queries.systems.system_analysis import SystemAnalysis, refuse_without_effect
    from squeal.sparse.quadratic import PROGRESS

    analysis = SystemAnalysis.of(subject, band, memory=memory, progress=progress)
    system = analysis.system
    # the static contact of an assembly is solved anew at each condition (the contact is "seated"):
    # no reduced system serves two conditions, and each parameter may have an effect
    seated = analysis.file.assembly is not None
    if not seated:
        refuse_without_effect(analysis.file, axes, AT)
    reduction = None
    if not seated and not is_small(system):
        conditions_of_basis = grid[:: max(1, len(grid) // BASIS_CONDITIONS)]
        reduction = reduced_for(system, analysis.selection, conditions_of_basis, method="modal")
    solved = _solve_all(partial(_system_condition, analysis, reduction), grid)
    solved = with_progress(solved, len(grid), PROGRESS.get(), "conditions")  # reports the progress
    extent = "" if analysis.selection.band is None else analysis.selection.words()
    return _answer(
        system.name,
        axes,
        solved,
        extent=extent,
        seated=seated,
        basis=basis_of(reduction, analysis.selection) or analysis.component_reduction,
    )


def _combinations(space: ParameterSpace, axes: Mapping[str, Values]) -> list[Changes]:
    """All combinations of the values of the axes, the last axis varying fastest.

    Raises InputError for no axis, unknown parameters, repeated values and too many combinations.
    """
    if not axes:
        raise AT.refuse("none is given; at least one parameter with its values is required")
    count = 1
    for name, values in axes.items():
        if name not in space.values:
            raise AT.refuse(f"{name} is no parameter here; {suggestion(name, space.values)}")
        if len(set(values)) < len(values):
            raise AT.refuse(f"{name} has a value twice; each value is allowed once")
        count *= len(values)
    if count > MOST_CONDITIONS:
        raise AT.refuse(f"{count} conditions are not allowed; it must be at most {MOST_CONDITIONS}")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


class _Solved(NamedTuple):
    """A solved condition.

    condition: its rows, one for each mode, have no mode numbers yet; modes: the same modes in the
    same order, with their shapes, as `compare` pairs them.
    """

    condition: Condition
    modes: Sequence[Mode]


def _solve_all(solve: Callable[[Changes], _Solved], grid: Sequence[Changes]) -> Iterator[_Solved]:
    """Solve a pad or a system at each condition.

    A condition that cannot be solved, as without an equilibrium, has a reason and no modes.
    """
    for changes in grid:
        try:
            with Place("conditions", at_parameters(changes)).prefixing_errors():
                solved = solve(changes)
        except ComputationError as error:
            solved = _Solved(Condition(changes, reason=str(error)), ())
        yield solved


def _pad_condition(scene: Scene, changes: Changes) -> _Solved:
    """Solve a scene at a condition. Raises ComputationError without an equilibrium."""
    analysis = analyse(scene.replace(**changes))
    roots = analysis.spectrum.eigenvalues
    return _condition_of_roots(changes, roots, analysis.verdict, analysis.admissible)


def _system_condition(
    analysis: SystemAnalysis, reduction: Reduction | None, changes: Changes
) -> _Solved:
    """Solve a system at a condition, on the reduced system if there is one.

    Roots whose backward error is too large are left out.
    """
    from squeal.queries.systems.data_precision import roots_of_file
    from squeal.queries.systems.reduced import estimated_roots
    from squeal.queries.systems.verdicts import verdict_of_some

    if reduction is not None:
        roots = estimated_roots(reduction, changes)
        values = values_of(roots)
        rounding = np.array([root.rounding for root in roots])
        return _condition_of_roots(changes, roots, verdict_of_some(values, rounding))
    file = analysis.file.replaced(changes)
    solution = roots_of_file(file, analysis.selection, is_judged=False)  # without the referee
    # where the backward error of a root is too large for a verdict the referee may know better
    if not all(root.decides for root in solution.computed):
        solution = roots_of_file(file, analysis.selection)
    accepted = [root for root in solution.computed if root.decides]
    return _condition_of_roots(changes, accepted, solution.verdict)


def _condition_of_roots(
    changes: Changes, roots: Sequence[Eigenvalue], verdict: str | None, admissible: bool = True
) -> _Solved:
    """A solved condition from its roots: a row for each mode with Im > 0, and each growing one.

    changes: of the parameters at this condition; roots: with right vectors, which pairing compares;
    verdict: on all roots, None if it is open; admissible: whether the model means the equilibrium.
    """
    rows: list[ModeAtCondition] = []
    modes: list[Mode] = []
    for root in roots:
        # taken: roots with Im > 0, and growing real roots, whose imaginary part may be below 0 by
        # their rounding. Left out: the conjugate of a taken root, and decaying real roots
        grows = root.kind in GROWING and root.value.imag >= -root.rounding
        if not grows and root.value.imag <= 0.0:
            continue
        row = ModeAtCondition(root.frequency_hz, root.growth_rate, root.damping_ratio, grows)
        # pairing prefers modes that both grow or both decay, which it tells by the sign of the
        # damping: a mode that does not grow has a positive one, whatever rounding makes of it
        damping = row.damping_ratio if grows else abs(row.damping_ratio)
        modes.append(Mode(len(rows), row.frequency_hz, damping, root.right))
        rows.append(row)
    condition = Condition(changes, verdict, tuple(rows), admissible)
    return _Solved(condition, modes)


ModeIndex = tuple[int, int]
"""A mode at one condition: the index of the condition, and that of the mode's row there."""
UnitedMode = dict[int, int]
"""A mode over conditions: by the index of each condition that has it, that of its row there."""


class _Link(NamedTuple):
    """Two modes of neighbouring conditions that are taken for one, and the cost of the pair."""

    cost: float
    first: ModeIndex
    second: ModeIndex


def _conditions_and_links(
    solved: Iterable[_Solved], lengths: Sequence[int]
) -> tuple[list[Condition], list[_Link]]:
    """Collect the conditions of a grid, and link the modes of neighbours.

    Parameters
    ----------
    solved : iterable of _Solved
        The conditions as they are solved, the last axis of the grid varying fastest.
    lengths : sequence of int
        The number of values on each axis.
    """
    # how far apart neighbours along each axis are in the list: 3 and 1 of the lengths 2 and 3
    strides = [math.prod(lengths[axis + 1 :]) for axis in range(len(lengths))]
    conditions: list[Condition] = []
    links: list[_Link] = []
    modes_of: dict[int, Sequence[Mode]] = {}  # of a condition, by its number in the grid
    for k, (condition, modes) in enumerate(solved):
        conditions.append(condition)
        modes_of[k] = modes
        for stride, length in zip(strides, lengths, strict=True):
            is_first_of_axis = k // stride % length == 0
            if is_first_of_axis:
                continue
            neighbour = k - stride  # the condition before this one along the axis
            neighbour_modes = modes_of[neighbour]
            costs = pairing_costs(neighbour_modes, modes, TOLERANCE)
            for i, j in assigned_pairs(costs, neighbour_modes, modes, TOLERANCE):
                cost = float(costs.cost[i, j])
                if cost < UNLIKE:
                    links.append(_Link(cost, (neighbour, i), (k, j)))
        # the last neighbour of a condition is the next one along the first axis, strides[0] later:
        # the shapes of condition k - strides[0] have served now
        modes_of.pop(k - strides[0], None)
    return conditions, links


def _united_modes(conditions: Sequence[Condition], links: Sequence[_Link]) -> list[UnitedMode]:
    """Unite linked modes of single conditions to modes over all conditions.

    Links of least cost come first; a link that would give a condition two rows of one mode is left
    out. A mode without a link stands alone.
    """
    # by each mode at one condition the united mode that has it. All members of a united mode share
    # one dictionary: a link adds the second dictionary to the first, and its members get the first
    mode_of: dict[ModeIndex, UnitedMode] = {}
    for k, condition in enumerate(conditions):
        for row in range(len(condition.rows)):
            mode_of[k, row] = {k: row}
    for link in sorted(links):
        first = mode_of[link.first]
        second = mode_of[link.second]
        if first.keys() & second.keys():
            continue
        first.update(second)
        for k, row in second.items():
            mode_of[k, row] = first
    # `mode_of` has a united mode once for each member: here each is taken once, by its identity
    distinct = {id(mode): mode for mode in mode_of.values()}
    return list(distinct.values())


def _numbered(conditions: Sequence[Condition], links: Sequence[_Link]) -> tuple[Condition, ...]:
    """Give the modes that grow at some condition their numbers, in all conditions that have them.

    They are numbered by the lowest frequency at which they grow, then by where they grow first.
    Modes that grow nowhere have no number.
    """
    # the lowest frequency (Hz) at which a mode grows, the first condition in which it grows with
    # its row there, and the mode
    unstable: list[tuple[float, ModeIndex, UnitedMode]] = []
    for mode in _united_modes(conditions, links):
        growing = [(k, row) for k, row in mode.items() if conditions[k].rows[row].grows]
        if growing:
            lowest = min(conditions[k].rows[row].frequency_hz for k, row in growing)
            unstable.append((lowest, min(growing), mode))
    unstable.sort(key=itemgetter(0, 1))
    number_of: dict[ModeIndex, int] = {}
    for number, (_, _, mode) in enumerate(unstable, 1):
        for k, row in mode.items():
            number_of[k, row] = number
    numbered = []
    for k, condition in enumerate(conditions):
        rows = []
        for i, mode_at_condition in enumerate(condition.rows):
            rows.append(replace(mode_at_condition, mode=number_of.get((k, i))))
        numbered.append(replace(condition, rows=tuple(rows)))
    return tuple(numbered)


def _answer(
    name: str,
    axes: Mapping[str, Values],
    solved: Iterable[_Solved],
    extent: str = "",
    seated: bool = False,
    basis: Mapping[str, Any] | None = None,
) -> Conditions:
    """Number the modes of all conditions, and put the answer together.

    Parameters
    ----------
    name : str
        The model or system.
    axes : mapping of str to sequence of float
        The values of each parameter.
    solved : iterable of _Solved
        The conditions as they are solved, the last axis varying fastest.
    extent : str
        Which of the roots were judged, in words; empty for all.
    seated : bool
        Whether the static contact was solved anew at each condition.
    basis : mapping or None
        The reduced system that was solved, as JSON holds it.
    """
    lengths = [len(values) for values in axes.values()]
    conditions, links = _conditions_and_links(solved, lengths)
    return Conditions(
        name=name,
        axes={axis: tuple(values) for axis, values in axes.items()},
        conditions=_numbered(conditions, links),
        tolerance=TOLERANCE,
        extent=extent,
        seated=seated,
        basis=basis,
    )
