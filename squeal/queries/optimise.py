"""Parameters within bounds at which the fastest growing root of a band grows least.

The largest growth rate is not smooth: it has a kink wherever another mode becomes the fastest one.
So an upper limit t of the growth rates g_i is minimised over (q, t) instead, subject to
g_i(q) <= t, which is smooth. That is done by sequential quadratic programming with exact
derivatives. A large system is searched on a reduced one, and the result computed on the full one.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Annotated, Any, Literal

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.writing import Answer, Column, Mark, Panel, Table, columns, copied_attributes, number
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray
from squeal.linear.sensitivity import sensitivities
from squeal.linear.system import TermSystem
from squeal.queries.options import Band, RandomNumbers, Region, seed_of
from squeal.queries.systems.all_roots import is_small, roots_of_all
from squeal.queries.systems.data_precision import roots_of_file
from squeal.queries.systems.reduced import basis_of, reduced_for
from squeal.queries.systems.roots import SystemRoots
from squeal.queries.systems.seat import warn_of_held_seat
from squeal.queries.systems.system_analysis import SystemAnalysis, refuse_without_effect
from squeal.results.columns import UNSURE, basis_text
from squeal.results.sources import EigenvalueSelection
from squeal.schema import Place, Positive, Whole, public
from squeal.sparse.dense import roots_at
from squeal.sparse.quadratic import PROGRESS, Progress
from squeal.sparse.reduction import RESIDUAL_TOLERANCE, Reduction

LEADING = 12  # fastest growing roots whose growth rates are bounded at once
RUNS = 4  # of the minimiser in a search: a change of the fastest mode may end one early
REDUCTIONS = 4  # reduced systems made at most, each with the result on the one before
CORNERS = 3  # parameters up to which a reduced system serves the corners of the bounds too
ACTIVE = 1e-3  # of the fall of the growth rate: roots so close to the largest one hold it there
AT_BOUND = 1e-6  # of the range: so close to a bound a parameter is held by it


@dataclass(frozen=True)
class Bounded:
    """A parameter, its bounds, and its value before and after the search."""

    parameter: str
    low: float
    high: float
    before: float
    after: float

    @property
    def at(self) -> Literal["low", "high"] | None:
        """The bound that the parameter lies at, if it does."""
        near = AT_BOUND * (self.high - self.low)
        if self.after - self.low <= near:
            return "low"
        if self.high - self.after <= near:
            return "high"
        return None


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(Answer):
    """Parameters at which the fastest growing root grows least, as far as it was found.

    Attributes
    ----------
    name : str
        The system.
    extent : str
        At which value of the free parameter and of which band that holds, for people.
    parameters : tuple of Bounded
        The parameters that changed, with their bounds.
    before, after : SystemRoots
        Roots of the full system at the own parameters and at the result, with the count that
        certifies them.
    starts : tuple of float
        The largest growth rate (1/s) at the end of each search, the search from the own parameters
        first. Where a reduced system was made anew there is one search on the last reduced system.
    seed : int
        Of the random numbers from which the other searches start.
    evaluations : int
        How often roots were computed in these searches.
    basis : mapping or None
        The last reduced system that was searched.

    Examples
    --------
    >>> import squeal
    >>> C = {"share": [[0.1, 0], [0, 0]], "1 - share": [[0, 0], [0, 0.1]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], C, [[1, 0], [0, 4]], {"share": 0.9})
    >>> best = squeal.optimise(pair, {"share": (0.0, 1.0)})
    >>> [round(growth, 6) for growth in best.growth]
    [-0.005, -0.025]
    """

    panel = Panel("parameter", "after", Mark.BARS)

    name: str
    extent: str
    parameters: tuple[Bounded, ...]
    before: SystemRoots = field(repr=False)
    after: SystemRoots = field(repr=False)
    starts: tuple[float, ...]
    seed: int
    evaluations: int
    basis: Mapping[str, object] | None = None

    @property
    def growth(self) -> tuple[float, float]:
        """The largest growth rate (1/s) in the full system before and after; NaN without a root."""
        return _largest_growth(self.before), _largest_growth(self.after)

    @property
    def active(self) -> tuple[Eigenvalue, ...]:
        """The roots that grow as fast as the fastest one at the result, to `ACTIVE`.

        They keep the largest growth rate from falling further. Of a pair, the root with Im >= 0.
        """
        before, after = self.growth
        least = after - ACTIVE * abs(before - after)
        active = []
        for root in self.after.computed:
            if root.value.imag >= 0.0 and root.growth_rate >= least:
                active.append(root)
        return tuple(active)

    def table(self) -> Table:
        names = columns("parameter low high before after")
        return Table((*names, Column("at", words="at bound")), self.parameters)

    def parts(self) -> Sequence[str | Table]:
        lines = [f"{self.name}: largest growth rate{self.extent}"]
        for when, roots in (("before", self.before), ("after", self.after)):
            proof = "certified" if roots.certified else UNSURE
            lines.append(f"  {when}: {number(_largest_growth(roots))} 1/s ({proof})")
        ends = ", ".join(number(growth, 4) for growth in self.starts)
        lines.append(f"searches ended at {ends} 1/s (seed {self.seed})")
        table = columns("frequency_hz growth_rate damping_ratio%")
        active = Table(table, self.active, "roots that hold the largest growth rate there")
        parts: list[str | Table] = ["\n".join(lines), self.table(), active]
        if self.basis is not None:
            parts.append(basis_text(self.basis))
        return parts

    def to_dict(self) -> dict[str, Any]:
        entry: dict[str, Any] = {
            "name": self.name,
            "optimum": {bounded.parameter: bounded.after for bounded in self.parameters},
            "parameters": self.table().records(),
        }
        for when, roots in (("before", self.before), ("after", self.after)):
            entry[when] = {"growth_rate": _largest_growth(roots)}
            entry[when] |= copied_attributes(roots, "certified verdict")
        entry["active"] = Table(columns("frequency_hz growth_rate"), self.active).records()
        return entry | copied_attributes(self, "starts seed evaluations basis")


def _largest_growth(roots: SystemRoots) -> float:
    """The largest growth rate in 1/s, NaN without a root."""
    return max((root.growth_rate for root in roots.computed), default=math.nan)


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """The m <= `LEADING` fastest growing roots at q (p,).

    rates (m,): their growth rates in 1/s, falling; slopes (m, p): derivatives of these by q.
    """

    q: Array
    rates: Array
    slopes: Array

    @property
    def largest(self) -> float:
        """The largest growth rate in 1/s."""
        return float(self.rates[0])


class _Search:
    """The largest growth rates of a system, or a reduced one, as functions of its p parameters.

    q (p,), each from 0 to 1, stands for the parameters: 0 is the lower bound, 1 the upper one.
    """

    def __init__(
        self,
        model: TermSystem | Reduction,
        selection: EigenvalueSelection,
        bounds: Mapping[str, Band],
    ) -> None:
        self.model = model
        self.selection = selection
        self.names = list(bounds)
        self.low, high = np.array(list(bounds.values())).T
        self.width = high - self.low
        self.evaluations: list[_Evaluation] = []

    def parameters(self, q: Array) -> dict[str, float]:
        """The parameters at q."""
        return dict(zip(self.names, (self.low + self.width * q).tolist(), strict=True))

    def evaluate(self, q: Array) -> _Evaluation:
        """The growth rates and their derivatives at q, which `evaluations` keeps.

        Raises ComputationError if no root lies in the band.
        """
        # SLSQP asks for values and for slopes at the same q: one of the last three may have it
        for evaluation in self.evaluations[:-4:-1]:
            if np.array_equal(evaluation.q, q):
                return evaluation
        parameters = self.parameters(q)
        roots = self._roots(parameters)
        upper = roots[roots.imag >= 0.0]  # one root of each pair
        if not len(upper):
            where = ", ".join(f"{name} = {value:.6g}" for name, value in parameters.items())
            raise ComputationError(f"no root lies in the band at {where}; a wider band is required")
        leading = upper[np.argsort(-upper.real)[:LEADING]]
        evaluation = self._with_slopes(q, parameters, leading)
        self.evaluations.append(evaluation)
        count = len(self.evaluations)
        PROGRESS.get()(f"evaluation {count}: largest growth rate {evaluation.largest:.6g} 1/s")
        return evaluation

    def _roots(self, parameters: Mapping[str, float]) -> ComplexArray:
        """The selected roots (m,)."""
        if isinstance(self.model, Reduction):
            return self.model.values(parameters)
        return roots_of_all(self.model, self.selection, parameters)

    def _with_slopes(
        self, q: Array, parameters: Mapping[str, float], leading: ComplexArray
    ) -> _Evaluation:
        """The growth rates of leading roots (m,) at q, and their derivatives by q.

        The vectors are computed here, see `roots_at`, and the roots are made more precise by them.
        A slope by q is one by the parameter times the width of its range. Where roots coalesce
        derivatives are infinite: 0 stands for them.
        """
        unchanged = self.model.system if isinstance(self.model, Reduction) else self.model
        system = unchanged.replace(parameters)
        matrices = system.arrays()
        modes = roots_at(*matrices, leading)
        eigenvalues = []
        for value, right, left in zip(modes.values, modes.right.T, modes.left.T, strict=True):
            # derivatives need neither the residual nor the condition
            eigenvalues.append(
                Eigenvalue(value, right, left, residual=math.nan, condition=math.nan)
            )
        derivatives = {name: system.derivative(name) for name in parameters}
        by_parameter, _ = sensitivities(matrices, derivatives, eigenvalues)
        slopes = self.width * np.array([by_parameter[name].real for name in parameters]).T
        slopes = np.where(np.isfinite(slopes), slopes, 0.0)
        falling = np.argsort(-modes.values.real)
        return _Evaluation(q.copy(), modes.values.real[falling], slopes[falling])

    def minimise_from(self, start: Array) -> _Evaluation:
        """Minimise the largest growth rate from q = start, and return the best evaluation.

        The largest of several growth rates g_i(q) has kinks where the leading root changes. So the
        limit t is minimised instead, by sequential quadratic programming, under the constraints
        t >= g_i(q) of all leading roots, which are smooth. The unknowns are v = (q, t / unit). The
        unit is the steepest slope at the start (1/s), so that all unknowns are of the order of one.
        """
        from scipy.optimize import minimize

        first = len(self.evaluations)
        best = self.evaluate(start)
        # where the largest rate is flat (its slopes are 0) the other rates set the unit, and where
        # all are flat it is 1
        steepest = np.abs(best.slopes[0]).max() or np.abs(best.slopes).max()
        unit = float(steepest) or 1.0

        def slack(v: Array) -> Array:
            """(t - g_i(q)) / unit (LEADING,), to be 0 or more; 1 where there are fewer roots."""
            rates = self.evaluate(v[:-1]).rates
            distances = np.ones(LEADING)
            distances[: len(rates)] = v[-1] - rates / unit
            return distances

        def slack_slope(v: Array) -> Array:
            """The derivative (LEADING, p + 1) of the slack by v."""
            slopes = self.evaluate(v[:-1]).slopes
            slope = np.zeros((LEADING, len(v)))
            slope[: len(slopes), :-1] = -slopes / unit
            slope[: len(slopes), -1] = 1.0
            return slope

        def limit(v: Array) -> float:
            """t / unit, which is minimised."""
            return float(v[-1])

        slope_of_limit = np.append(np.zeros(len(start)), 1.0)
        q = start
        for _ in range(RUNS):
            before = best.largest
            # what it returns is not needed: `evaluate` keeps all points that it tries
            minimize(
                limit,
                np.append(q, before / unit),
                jac=lambda _: slope_of_limit,
                method="SLSQP",
                bounds=[(0.0, 1.0)] * len(q) + [(None, None)],
                constraints={"type": "ineq", "fun": slack, "jac": slack_slope},
                options={"maxiter": 40, "ftol": 1e-8},
            )
            # the evaluation of the start may be one of an earlier search, before number `first`:
            # `best` holds it
            best = min([best, *self.evaluations[first:]], key=attrgetter("largest"))
            q = best.q
            # the run gained less than a step of 1e-6 in q does along the steepest slope
            if best.largest > before - 1e-6 * unit:
                break
        return best


@public
def optimise(
    subject: object,
    bounds: Mapping[str, Band],
    band: Band | None = None,
    region: Region | None = None,
    starts: Annotated[int, Whole(1, 10_000)] = 4,
    rng: RandomNumbers = 1,
    memory: Positive | None = None,
    progress: Progress | None = None,
) -> Optimum:
    """Minimise the largest growth rate of the roots in a band over bounded parameters.

    Local searches with exact derivatives, from the own parameters and from random ones. A system of
    more than 400 rows is searched on a reduced system, until the residual of the result in the full
    problem is small. Growth rates before and after are those of the full system.

    Parameters
    ----------
    subject : SystemFile or TermSystem
        What `read_system` gives, or a `System`.
    bounds : mapping of str to (float, float)
        Lowest and highest value of each parameter that may change.
    band, region, memory, progress
        As `eigenvalues` takes them. A system of more than 400 rows needs a band or a region.
    starts : int
        Number of searches.
    rng : int or numpy.random.Generator
        Of the random numbers that they start at, as `scatter` takes it.

    Returns
    -------
    Optimum
        Parameters, growth rates before and after, and the roots that hold the largest one.

    Raises
    ------
    InputError
        For what is no system or parameter, and for bounds that are none.
    ComputationError
        If no root lies in the band somewhere within the bounds.

    Examples
    --------
    The sum of two dampings is shared out, one mode each; the best is half each:

    >>> import numpy as np, squeal
    >>> C = {"share": np.diag([0.1, 0.0]), "1 - share": np.diag([0.0, 0.1])}
    >>> pair = squeal.System(np.eye(2), C, np.diag([1.0, 4.0]), {"share": 0.9})
    >>> best = squeal.optimise(pair, {"share": (0.0, 1.0)})
    >>> round(best.parameters[0].after, 6), [round(growth, 6) for growth in best.growth]
    (0.5, [-0.005, -0.025])
    """
    analysis = SystemAnalysis.of(subject, band, region, memory=memory, progress=progress)
    system = analysis.system
    selection = analysis.selection
    seed = seed_of(rng, "optimise")
    refuse_without_effect(analysis.file, bounds, Place("optimise"))
    ranges = _checked_bounds(bounds)
    system.at()  # raises InputError where matrices follow the frequency: no single M, C, K then
    if not is_small(system) and selection.rectangle is None:
        raise InputError("band: is missing; a large system is optimised in a band or a region")
    result = _best_of_searches(system, selection, ranges, starts, seed)
    PROGRESS.get()("the full system before and after")
    before = roots_of_file(analysis.file, selection)
    after = roots_of_file(analysis.file, selection, system.replace(result.parameters))
    if result.residual > RESIDUAL_TOLERANCE:
        Place("optimise").warn(
            f"the reduced system has a residual of {result.residual:.2g} in the full problem, "
            f"{RESIDUAL_TOLERANCE:g} is wanted; the result may be improved"
        )
    warn_of_held_seat(analysis.file, "optimise")
    changed = []
    for name, (low, high) in ranges.items():
        bounded = Bounded(
            name, low, high, before=system.parameters[name], after=result.parameters[name]
        )
        changed.append(bounded)
    assumptions = analysis.file.assumptions
    return Optimum(
        name=system.name,
        extent=_extent(system, selection, ranges),
        parameters=tuple(changed),
        before=replace(before, doubts=(*before.doubts, *assumptions)),
        after=replace(after, doubts=(*after.doubts, *assumptions)),
        starts=tuple(result.growth_rates),
        seed=seed,
        evaluations=result.evaluations,
        basis=basis_of(result.reduction, selection),
    )


def _checked_bounds(bounds: Mapping[str, Band]) -> dict[str, Band]:
    """The bounds of each parameter. Raises InputError for a range that is none."""
    at = Place("optimise")
    checked: dict[str, Band] = {}
    for name, (low, high) in bounds.items():
        if not low < high:
            raise (at / name).must_be(f"{low:g} to {high:g}", "a range with low < high")
        checked[name] = (low, high)
    if not checked:
        raise at.refuse("no bounds are given; a range of a parameter is required")
    return checked


@dataclass(frozen=True, eq=False)
class _SearchResult:
    """The best parameters of several searches.

    growth_rates: the largest one (1/s) at the end of each search on the last reduced system;
    evaluations: of roots in these searches; residual: the largest one of a root of the reduced
    system in the full problem at the result, 0 without a reduced system.
    """

    parameters: dict[str, float]
    growth_rates: list[float]
    evaluations: int
    reduction: Reduction | None
    residual: float


def _best_of_searches(
    system: TermSystem,
    selection: EigenvalueSelection,
    bounds: Mapping[str, Band],
    starts: int,
    seed: int,
) -> _SearchResult:
    """Search from the own parameters and from random ones, `starts` searches in all.

    A large system is searched on a reduced one, made at the starting points and, of few parameters,
    at the corners of the bounds. Where the residual at the result is large, the reduced system is
    made anew with the result as a further point, and searched from the result alone. It is made
    `REDUCTIONS` times at most.
    """
    search = _Search(system, selection, bounds)
    nominal = np.array([system.parameters[name] for name in bounds])
    starting_points = [np.clip((nominal - search.low) / search.width, 0.0, 1.0)]
    starting_points += list(np.random.default_rng(seed).random((starts - 1, len(bounds))))
    points_of_basis = list(starting_points)
    if len(bounds) <= CORNERS:
        points_of_basis += map(np.array, itertools.product((0.0, 1.0), repeat=len(bounds)))
    reduction = None
    residual = 0.0  # as of a small system, which is searched itself
    for _ in range(REDUCTIONS):
        if not is_small(system):
            changes = [search.parameters(point) for point in points_of_basis]
            reduction = reduced_for(system, selection, [{}, *changes])  # {}: the own parameters
            search = _Search(reduction, selection, bounds)
        ends = [search.minimise_from(point) for point in starting_points]
        best = min(ends, key=attrgetter("largest"))
        parameters = search.parameters(best.q)
        if reduction is not None:
            residual = float(reduction.modes(parameters).residuals.max())
        if residual <= RESIDUAL_TOLERANCE:  # always true without a reduced system
            break
        points_of_basis.append(best.q)
        starting_points = [best.q]
    return _SearchResult(
        parameters=parameters,
        growth_rates=[end.largest for end in ends],
        evaluations=len(search.evaluations),
        reduction=reduction,
        residual=residual,
    )


def _extent(system: TermSystem, selection: EigenvalueSelection, bounds: Mapping[str, Band]) -> str:
    """At which value of the free parameter, and of which band, growth is minimised, in words.

    It is the growth at that value that is minimised, not the value from which on something grows.
    """
    extent = " (not its onset)"
    free = system.parameter
    if free not in bounds:
        extent = f" at {free} = {system.parameters[free]:g}{extent}"
    if selection.rectangle is not None:
        extent += f", {selection.words()}"
    return extent
