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

from squeal.analysis.answers import UNSURE, basis_text
from squeal.analysis.of_systems import Question
from squeal.analysis.systems.roots import (
    SystemRoots,
    Wanted,
    basis_of,
    is_small,
    reduced_for,
    roots_of_all,
    system_roots,
)
from squeal.analysis.verbs import Band, Region
from squeal.errors import ComputationError, InputError
from squeal.io.writing import Answer, Column, Table, columns, number, picked
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import Array
from squeal.linear.sensitivity import sensitivities
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
    """

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
        before, after = (
            max((e.growth_rate for e in roots.every), default=math.nan)
            for roots in (self.before, self.after)
        )
        return before, after

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
        text = f"{self.name}: largest growth rate{self.extent}\n"
        for words, growth in zip(("before", "after"), self.growth, strict=True):
            proof = "certified by a count" if getattr(self, words).certified else UNSURE
            text += f"  {words}: {number(growth)} 1/s ({proof})\n"
        found = ", ".join(number(growth, 4) for growth in self.starts)
        text += f"searches ended at {found} 1/s (seed {self.seed})"
        table = columns("frequency_hz growth_rate damping_ratio%")
        active = Table(table, self.active, "roots that hold the largest growth rate there")
        basis = [] if self.basis is None else [basis_text(self.basis)]
        return [text, self.table(), active, *basis]

    def to_dict(self) -> dict[str, Any]:
        sides = {
            words: {"growth_rate": growth} | picked(getattr(self, words), "certified verdict")
            for words, growth in zip(("before", "after"), self.growth, strict=True)
        }
        optimum = {one.parameter: one.after for one in self.parameters}
        head = {"name": self.name, "optimum": optimum, "parameters": self.table().records()}
        active = Table(columns("frequency_hz growth_rate"), self.active).records()
        return head | sides | {"active": active} | picked(self, "starts seed evaluations basis")


class _Search:
    """The largest growth rates of a system, or a reduced one, over q in [0, 1]^p, shares of the
    ways between bounds (p,)."""

    def __init__(self, model: Any, wanted: Wanted, bounds: Mapping[str, Band]) -> None:
        self.model, self.wanted, self.names = model, wanted, list(bounds)
        self.low, high = np.array(list(bounds.values())).T
        self.wide = high - self.low
        self.seen: list[tuple[float, Array, Array, Array]] = []

    def values(self, q: Array) -> dict[str, float]:
        """The parameters at q."""
        return dict(zip(self.names, (self.low + self.wide * q).tolist(), strict=True))

    def leading(self, q: Array) -> tuple[Array, Array]:
        """The largest growth rates (m,), 1/s, falling, and their derivatives by q (m, p)."""
        for _, other, *known in self.seen[:-4:-1]:
            if np.array_equal(other, q):
                return known[0], known[1]
        model, at = self.model, self.values(q)
        reduced = isinstance(model, Reduction)
        z = model.values(at) if reduced else roots_of_all(model, self.wanted, at)
        z = z[z.imag >= 0.0]
        if not len(z):
            where = ", ".join(f"{name} = {value:.6g}" for name, value in at.items())
            raise ComputationError(f"no root lies in the band at {where}; a wider band is required")
        z = z[np.argsort(-z.real)[:LEADING]]
        own = (model.system if reduced else model).replace(at)
        M, C, K = own.arrays()
        roots = model.roots(at, True, z) if reduced else roots_at(M, C, K, z, True)
        pairs = zip(roots.values, roots.right.T, roots.left.T, strict=True)
        each = [Eigenvalue(*one, math.nan, math.nan) for one in pairs]
        slopes, _ = sensitivities((M, C, K), {name: own.derivative(name) for name in at}, each)
        by = self.wide * np.array([slopes[name].real for name in at]).T
        order = np.argsort(-roots.values.real)
        rates, by = roots.values.real[order], np.where(np.isfinite(by), by, 0.0)[order]
        self.seen.append((float(rates[0]), q.copy(), rates, by))
        PROGRESS.get()(f"evaluation {len(self.seen)}: largest growth rate {rates[0]:.6g} 1/s")
        return rates, by

    def least(self, q: Array) -> tuple[float, Array]:
        """The least of the largest growth rate that a search from q comes to, and its place."""
        from scipy.optimize import minimize

        first = len(self.seen)
        rates, by = self.leading(q)
        # a search of flat functions ends where it begins
        best, unit = float(rates[0]), float(np.abs(by[0]).max() or np.abs(by).max()) or 1.0

        def below(v: Array) -> Array:
            """t - growth_i(q) of v = (q, t); 1 of roots that there are not."""
            rates, rest = self.leading(v[:-1])[0], np.ones(LEADING)
            rest[: len(rates)] = v[-1] - rates / unit
            return rest

        def slope(v: Array) -> Array:
            by, rest = self.leading(v[:-1])[1], np.zeros((LEADING, len(v)))
            rest[: len(by)] = np.hstack([-by / unit, np.ones((len(by), 1))])
            return rest

        last = np.append(np.zeros(len(q)), 1.0)
        for _ in range(AGAIN):
            before = best
            within = [(0.0, 1.0)] * len(q) + [(None, None)]
            how: Any = {"jac": lambda _: last, "method": "SLSQP", "bounds": within}
            how |= {"constraints": {"type": "ineq", "fun": below, "jac": slope}}
            how |= {"options": {"maxiter": 40, "ftol": 1e-8}}
            minimize(lambda v: float(v[-1]), np.append(q, best / unit), **how)
            best, q, *_ = min(self.seen[first:], key=lambda one: one[0])
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
    seed: Annotated[int, Whole(0, 2**32 - 1)] = 1,
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
    starts, seed : int
        Number of searches, and of the random numbers that they start at.

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
    question = Question.of(subject, band, region, None, memory, progress)
    system, wanted, ends = question.system, question.wanted, dict[str, Band]()
    random = np.random.default_rng(seed)
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
    if not is_small(system) and wanted.rectangle is None:
        raise InputError("band: is missing; a large system is optimised in a band or a region")
    search, reduction = _Search(system, wanted, ends), None
    own = np.array([system.parameters[name] for name in ends])
    places = [np.clip((own - search.low) / search.wide, 0.0, 1.0)]
    places += list(random.random((starts - 1, len(ends))))
    served = list(places)
    if len(ends) <= CORNERS:
        served += map(np.array, itertools.product((0.0, 1.0), repeat=len(ends)))
    for _ in range(AGAIN):
        if not is_small(system):
            reduction = reduced_for(system, wanted, [{}, *map(search.values, served)])
            search = _Search(reduction, wanted, ends)
        found = [search.least(place) for place in places]
        _, q = min(found, key=itemgetter(0))
        values = search.values(q)
        residual = 0.0 if reduction is None else float(reduction.modes(values)[1].max())
        if residual <= TOLERANCE:
            break
        served, places = [*served, q], [q]
    PROGRESS.get()("the full system before and after")
    before, after = (
        replace(roots, doubts=(*roots.doubts, *question.file.assumptions))
        for roots in (system_roots(system, wanted), system_roots(system, wanted, values))
    )
    if residual > TOLERANCE:
        words = f"a residual of {residual:.2g} in the full problem, {TOLERANCE:g} is wanted"
        at.warn(f"the reduced system has {words}; the result may be improved")
    parameters = tuple(
        Bounded(name, *ends[name], system.parameters[name], values[name]) for name in ends
    )
    free = system.parameter
    own_at = f" at {free} = {system.parameters[free]:g}" * (free not in ends)
    where = f", {wanted.words()}" * (wanted.rectangle is not None)
    head = system.name, f"{own_at} (not its onset){where}", parameters, before, after
    ended = tuple(growth for growth, _ in found)
    return Optimum(*head, ended, seed, len(search.seen), basis_of(reduction, wanted))
