"""Stability charts: the verdict on a system over two of its parameters."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.systems.roots import NO_ROOT
from squeal.analysis.systems.sweeps import noise_of, reduced_for, roots_of_all, verdict_of
from squeal.analysis.systems.wanted import TERMS, Wanted, is_small
from squeal.errors import InputError
from squeal.io.writing import Checkpoint
from squeal.linear import VERDICTS
from squeal.linear.system import TermSystem
from squeal.schema.arguments import takes
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.reduction import Reduction

NAMES = (*VERDICTS, NO_ROOT)
SAMPLES = 5  # values a side at which a reduced system has to be good


@dataclass(frozen=True)
class Side:
    """A parameter of a chart: n values at the middles of n equal cells between low and high."""

    name: str
    low: float
    high: float
    n: int

    @property
    def values(self) -> NDArray[np.float64]:
        """The n values."""
        return self.low + (self.high - self.low) * (np.arange(self.n) + 0.5) / self.n


@dataclass(frozen=True)
class Chart:
    """Verdict codes (n1, n2), indices into NAMES, and the largest growth rates (1/s; NaN
    without a root)."""

    sides: tuple[Side, Side]
    codes: NDArray[np.int8] = field(repr=False)
    growth: NDArray[np.float64] = field(repr=False)  # largest real part
    reduction: Reduction | None = field(default=None, repr=False)

    @property
    def share(self) -> dict[str, float]:
        """Share of the points for each verdict."""
        return {name: float(np.mean(self.codes == k)) for k, name in enumerate(NAMES)}


@takes(system=TERMS)
def system_chart(
    system: TermSystem,
    sides: tuple[Side, Side],
    wanted: Wanted | None = None,
    progress: Progress = quiet,
    checkpoint: Checkpoint | None = None,
) -> Chart:
    """The verdict on the wanted roots over two parameters.

    A large system is reduced once for the whole rectangle; a `checkpoint` keeps what there is of
    that. Raises InputError for a parameter that
    it has not, and for a large system without a band or region.
    """
    wanted = wanted or Wanted()
    first, second = sides
    terms = [term for part in (system.M, system.C, system.K) for term in part]
    used = {name for term in terms for name in term.factor.names}
    for side in sides:
        system.values({side.name: 0.0})
        if side.name not in used:
            raise InputError(
                f"{side.name}: is not allowed in a chart, no matrix depends on it; "
                f"{', '.join(sorted(used)) or 'no parameter'} does"
            )
    if first.name == second.name:
        raise InputError(f"{first.name}: is not allowed twice; a chart has two parameters")
    reduction, region = None, wanted.rectangle
    if not is_small(system):
        corners = [
            {first.name: float(a), second.name: float(b)}
            for a in np.linspace(first.low, first.high, SAMPLES)
            for b in np.linspace(second.low, second.high, SAMPLES)
        ]
        reduction, region = reduced_for(
            system, wanted, corners, progress=progress, checkpoint=checkpoint
        )
    codes = np.zeros((first.n, second.n), dtype=np.int8)
    growth = np.zeros((first.n, second.n))
    noise = noise_of(system)
    for i, a in enumerate(first.values):
        progress(f"{first.name} = {a:.6g}")
        for j, b in enumerate(second.values):
            changes = {first.name: float(a), second.name: float(b)}
            if reduction is not None and region is not None:
                roots = reduction.values(region, changes)
            else:
                roots = roots_of_all(system, wanted, changes)
            codes[i, j] = NAMES.index(verdict_of(roots, noise))
            growth[i, j] = roots.real.max() if len(roots) else np.nan
    return Chart(sides, codes, growth, reduction)
