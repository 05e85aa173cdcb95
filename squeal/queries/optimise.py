"""Parameters within bounds at which the fastest growing root of a band grows least.

The largest growth rate has a kink wherever another mode takes the lead. So a bound t of all growth
rates is minimised instead, subject to growth_i(q) <= t, by sequential quadratic programming with
exact derivatives; the roots are computed anew at each q. Of a large system a reduced one serves,
and the full one is asked about the result.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Annotated, Any

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.writing import Answer, Column, Mark, Panel, Table, columns, number, picked
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import Array
from squeal.linear.sensitivity import sensitivities
from squeal.queries.options import Band, RandomNumbers, Region, seed_of
from squeal.queries.systems.all_roots import is_small, roots_of_all
from squeal.queries.systems.reduced import basis_of, reduced_for
from squeal.queries.systems.roots import SystemRoots, system_roots
from squeal.queries.systems.system_analysis import SystemAnalysis
from squeal.results.columns import UNSURE, basis_text
from squeal.results.sources import EigenvalueSelection
from squeal.schema import Place, Positive, Whole, public
from squeal.sparse.dense import roots_at
from squeal.sparse.quadratic import PROGRESS, Progress
from squeal.sparse.reduction import TOLERANCE, Reduction

LEADING = 12  # fastest growing roots whose growth rates are bounded at once
AGAIN = 4  # runs from the best point so far: a change of the lead may end one early
CORNERS = 3  # parameters up to which a reduced system serves the corners of the bounds too
ACTIVE = 1e-3  # of the fall of the growth rate: roots so close to the largest one hold it there


@dataclass(frozen=True)
class Bounded:
    """A parameter, its bounds, and its value before and after."""

    parameter: str
    low: float
    high: float
    before: float
    after: float

    @property
    def at(self) -> str | None:
        """The bound that holds it, if one does."""
        near = 1e-6 * (self.high - self.low)
        if self.after - self.low <= near:
            return "low"
        return "high" if self.high - self.after <= near else None


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(Answer):
    """Parameters at which the fastest growing root grows least, as far as it was found.

    before, after: roots of the full system, with the count that certifies them; starts: the largest
    growth rate (1/s) at the end of each search, the own parameters' first; evaluations: of all
    roots; basis: the reduced system that served.

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
    basis: Mapping[str, Any] | None = None

    @property
    def growth(self) -> tuple[float, float]:
        """The largest growth rate (1/s) in the full system before and after; NaN without a root."""
        return _largest_growth(self.before), _largest_growth(self.after)

    @property
    def active(self) -> tuple[Eigenvalue, ...]:
        """The roots whose growth rates hold the largest one where it is, the next to be changed."""
        first, last = self.growth
        upper = (e for e in self.after.every if e.value.imag >= 0.0)
        return tuple(e for e in upper if e.growth_rate >= last - ACTIVE * abs(first - last))

    def table(self) -> Table:
        names = columns("parameter low high before after")
        return Table((*names, Column("at", words="at bound")), self.parameters)

    def parts(self) -> Sequence[str | Table]:
        lines = [f"{self.name}: largest growth rate{self.extent}"]
        first, last = self.growth
        for words, growth, roots in (("before", first, self.before), ("after", last, self.after)):
            proof = "certified by a count" if roots.certified else UNSURE
            lines.append(f"  {words}: {number(growth)} 1/s ({proof})")
        ends = ", ".join(number(growth, 4) for growth in self.starts)
        lines.append(f"searches ended at {ends} 1/s (seed {self.seed})")
        table = columns("frequency_hz growth_rate damping_ratio%")
        active = Table(table, self.active, "roots that hold the largest growth rate there")
        parts: list[str | Table] = ["\n".join(lines), self.table(), active]
        if self.basis is not None:
            parts.append(basis_text(self.basis))
        return parts

    def to_dict(self) -> dict[str, Any]:
        sides = {
            words: {"growth_rate": growth} | picked(getattr(self, words), "certified verdict")
            for words, growth in zip(("before", "after"), self.growth, strict=True)
        }
        optimum = {one.parameter: one.after for one in self.parameters}
        head = {"name": self.name, "optimum": optimum, "parameters": self.table().records()}
        active = Table(columns("frequency_hz growth_rate"), self.active).records()
        return head | sides | {"active": active} | picked(self, "starts seed evaluations basis")


def _largest_growth(roots: SystemRoots) -> float:
    return max((root.growth_rate for root in roots.every), default=math.nan)


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """Growth rates (m,), 1/s, falling, at q (p,), and their derivatives by q (m, p)."""

    q: Array
    rates: Array
    slopes: Array

    @property
    def largest(self) -> float:
        """The largest growth rate."""
        return float(self.rates[0])


class _Search:
    """The largest growth rates of a system, or a reduced one, over q in [0, 1]^p, shares of the
    ways between bounds (p,)."""

    def __init__(
        self, model: Any, selection: EigenvalueSelection, bounds: Mapping[str, Band]
    ) -> None:
        self.model = model
        self.selection = selection
        self.names = list(bounds)
        self.low, high = np.array(list(bounds.values())).T
        self.width = high - self.low
        self.seen: list[_Evaluation] = []

    def values(self, q: Array) -> dict[str, float]:
        """The parameters at q."""
        return dict(zip(self.names, (self.low + self.width * q).tolist(), strict=True))

    def leading(self, q: Array) -> tuple[Array, Array]:
        """The largest growth rates (m,), 1/s, falling, and their derivatives by q (m, p)."""
        for evaluation in self.seen[:-4:-1]:
            if np.array_equal(evaluation.q, q):
                return evaluation.rates, evaluation.slopes
        model = self.model
        reduced = isinstance(model, Reduction)
        parameters = self.values(q)
        roots = (
            model.values(parameters) if reduced else roots_of_all(model, self.selection, parameters)
        )
        upper = roots[roots.imag >= 0.0]
        if not len(upper):
            where = ", ".join(f"{name} = {value:.6g}" for name, value in parameters.items())
            raise ComputationError(f"no root lies in the band at {where}; a wider band is required")
        leading = upper[np.argsort(-upper.real)[:LEADING]]
        system = (model.system if reduced else model).replace(parameters)
        M, C, K = system.arrays()
        if reduced:
            modes = model.roots(parameters, True, leading)
        else:
            modes = roots_at(M, C, K, leading, True)
        eigenvalues = [
            Eigenvalue(value, right, left, math.nan, math.nan)
            for value, right, left in zip(modes.values, modes.right.T, modes.left.T, strict=True)
        ]
        derivatives = {name: system.derivative(name) for name in parameters}
        by_parameter, _ = sensitivities((M, C, K), derivatives, eigenvalues)
        slopes = self.width * np.array([by_parameter[name].real for name in parameters]).T
        slopes = np.where(np.isfinite(slopes), slopes, 0.0)
        falling = np.argsort(-modes.values.real)
        evaluation = _Evaluation(q.copy(), modes.values.real[falling], slopes[falling])
        self.seen.append(evaluation)
        largest = evaluation.largest
        PROGRESS.get()(f"evaluation {len(self.seen)}: largest growth rate {largest:.6g} 1/s")
        return evaluation.rates, evaluation.slopes

    def least(self, start: Array) -> tuple[float, Array]:
        """The least of the largest growth rate that a search from q comes to, and its place."""
        from scipy.optimize import minimize

        first = len(self.seen)
        q = start
        rates, slopes = self.leading(q)
        best = float(rates[0])
        # a search of flat functions ends where it begins
        unit = float(np.abs(slopes[0]).max() or np.abs(slopes).max()) or 1.0

        def slack(v: Array) -> Array:
            """t - growth_i(q) of v = (q, t); 1 of roots that there are not."""
            rates, _ = self.leading(v[:-1])
            slack = np.ones(LEADING)
            slack[: len(rates)] = v[-1] - rates / unit
            return slack

        def slack_slope(v: Array) -> Array:
            """The derivative (LEADING, p + 1) of the slack by v."""
            _, slopes = self.leading(v[:-1])
            slope = np.zeros((LEADING, len(v)))
            slope[: len(slopes), :-1] = -slopes / unit
            slope[: len(slopes), -1] = 1.0
            return slope

        by_t = np.append(np.zeros(len(q)), 1.0)
        for _ in range(AGAIN):
            before = best
            minimize(
                lambda v: float(v[-1]),
                np.append(q, best / unit),
                jac=lambda _: by_t,
                method="SLSQP",
                bounds=[(0.0, 1.0)] * len(q) + [(None, None)],
                constraints={"type": "ineq", "fun": slack, "jac": slack_slope},
                options={"maxiter": 40, "ftol": 1e-8},
            )
            least = min(self.seen[first:], key=lambda evaluation: evaluation.largest)
            best = least.largest
            q = least.q
            if best > before - 1e-6 * unit:
                break
        return best, q


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

    Local searches with exact derivatives, from the own parameters and from random ones. Of a system
    of more than 400 rows a reduced one is searched, until its residual in the full problem is small
    at the result; growth rates before and after are those of the full system.

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
    at = Place("optimise")
    analysis = SystemAnalysis.of(subject, band, region, None, memory, progress)
    system = analysis.system
    selection = analysis.selection
    seed = seed_of(rng, "optimise")
    random = np.random.default_rng(seed)
    ends: dict[str, Band] = {}
    for name, (low, high) in bounds.items():
        if name not in system.names:
            allowed = ", ".join(sorted(system.names)) or "none"
            raise (at / name).refuse(f"no matrix depends on it; allowed are {allowed}")
        if not low < high:
            raise (at / name).must_be(f"{low:g} to {high:g}", "a range with low < high")
        ends[name] = low, high
    if not ends:
        raise at.refuse("no bounds are given; a range of a parameter is required")
    system.at()  # refuses matrices at the frequency of each root
    if not is_small(system) and selection.rectangle is None:
        raise InputError("band: is missing; a large system is optimised in a band or a region")
    search = _Search(system, selection, ends)
    reduction = None
    at_start = np.array([system.parameters[name] for name in ends])
    places = [np.clip((at_start - search.low) / search.width, 0.0, 1.0)]
    places += list(random.random((starts - 1, len(ends))))
    served = list(places)
    if len(ends) <= CORNERS:
        served += map(np.array, itertools.product((0.0, 1.0), repeat=len(ends)))
    for _ in range(AGAIN):
        if not is_small(system):
            reduction = reduced_for(system, selection, [{}, *map(search.values, served)])
            search = _Search(reduction, selection, ends)
        found = [search.least(place) for place in places]
        _, q = min(found, key=itemgetter(0))
        values = search.values(q)
        residual = 0.0 if reduction is None else float(reduction.modes(values)[1].max())
        if residual <= TOLERANCE:
            break
        served = [*served, q]
        places = [q]
    PROGRESS.get()("the full system before and after")
    before = system_roots(system, selection)
    after = system_roots(system, selection, values)
    assumptions = analysis.file.assumptions
    if residual > TOLERANCE:
        words = f"a residual of {residual:.2g} in the full problem, {TOLERANCE:g} is wanted"
        at.warn(f"the reduced system has {words}; the result may be improved")
    parameters = tuple(
        Bounded(name, *ends[name], system.parameters[name], values[name]) for name in ends
    )
    extent = " (not its onset)"
    free = system.parameter
    if free not in ends:
        extent = f" at {free} = {system.parameters[free]:g}{extent}"
    if selection.rectangle is not None:
        extent += f", {selection.words()}"
    return Optimum(
        name=system.name,
        extent=extent,
        parameters=parameters,
        before=replace(before, doubts=(*before.doubts, *assumptions)),
        after=replace(after, doubts=(*after.doubts, *assumptions)),
        starts=tuple(growth for growth, _ in found),
        seed=seed,
        evaluations=len(search.seen),
        basis=basis_of(reduction, selection),
    )
