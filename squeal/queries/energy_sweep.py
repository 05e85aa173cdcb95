"""The verb `energy_sweep`: what each term does to each mode at each value of a sweep.

The contributions are those of `squeal.queries.energy`, with the mode numbers of the sweep.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from squeal.io.writing import Answer, Column, Table, in_order
from squeal.queries.eigenvalues import pad_eigenvalues
from squeal.queries.energy import ROUNDING, Contribution, energy
from squeal.results.columns import parameter_heading
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import PadSource
from squeal.results.sweep import Step, Sweep
from squeal.schema import public

OF_TERM = (
    ("frequency_hz", ""),
    ("growth_rate", "1/s"),
    ("part", ""),
    ("term", ""),
    ("role", ""),
    ("growth", "1/s"),
    ("frequency", "Hz"),
    ("d_real", "1/s"),
    ("d_hz", ""),
)
"""Columns of a contribution, and their units."""
TABLES = 3  # modes that have a table for people


class SweptContribution(NamedTuple):
    """What a term does to a mode at a value of the parameter.

    mode: the number of the mode over the sweep, None where the sweep has lost which mode is which;
    of_term: the row of `energy`, with the number that the mode has at this value alone.
    """

    value: float
    mode: int | None
    of_term: Contribution


@dataclass(frozen=True, eq=False, repr=False)
class EnergySweep(Answer):
    """Contributions of each term to each mode with Im lambda >= 0, at each value of a sweep.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], [[0.2, 0], [0, 0.2]], K)
    >>> found = squeal.energy_sweep(squeal.sweep(pair, [0.5, 1.0, 1.5]))
    >>> sorted(found.modes)
    [1, 2, 3, 4]
    """

    name: str
    parameter: str
    contributions: tuple[SweptContribution, ...] = field(repr=False)

    @property
    def modes(self) -> list[int]:
        """Numbers of the modes, the fastest growing first."""
        fastest: dict[int, float] = {}
        for _, mode, row in self.contributions:
            if mode is not None:
                fastest[mode] = max(fastest.get(mode, row.growth_rate), row.growth_rate)
        return sorted(fastest, key=lambda mode: -fastest[mode])

    def frequency_of(self, mode: int) -> float:
        """The frequency of a mode where it grows fastest, Hz.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K)
        >>> round(squeal.energy_sweep(squeal.sweep(pair, [0.0])).frequency_of(1), 4)
        0.1592
        """
        rows = [row for _, number, row in self.contributions if number == mode]
        return max(rows, key=attrgetter("growth_rate")).frequency_hz

    def growth_of(self, mode: int) -> tuple[list[float], list[float], dict[str, list[float]]]:
        """The values of the sweep that have a mode, its growth rate there, and what each term adds.

        Returns
        -------
        values, rates : list of float
            The values, rising, and the growth rate at each of them, 1/s.
        terms : dict of str to list of float
            By term what it adds to the rate at each value, 1/s; NaN where the mode does not
            oscillate. Terms that do no work but for rounding are left out.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], [[0.2, 0], [0, 0.2]], K)
        >>> found = squeal.energy_sweep(squeal.sweep(pair, [0.5, 1.0, 1.5]))
        >>> found.growth_of(1)[0]  # the values that have the mode
        [0.5]
        """
        rates: dict[float, float] = {}  # by value
        rounding = 0.0  # 1/s, the largest of all values
        growth_of_terms: dict[str, dict[float, float]] = {}  # by term and value
        for value, number, row in self.contributions:
            if number == mode:
                # a mode may have two real roots: its rate is that of the faster growing one
                rates[value] = max(rates.get(value, row.growth_rate), row.growth_rate)
                rounding = max(rounding, ROUNDING * math.tau * row.frequency_hz)
                growth = np.nan if row.growth is None else row.growth
                growth_at_values = growth_of_terms.setdefault(f"{row.part}: {row.term}", {})
                # terms of one name are added, as those of two contacts
                growth_at_values[value] = growth_at_values.get(value, 0.0) + growth
        values = sorted(rates)
        terms = {}
        for term, growth_at in growth_of_terms.items():
            growths = [growth_at.get(value, 0.0) for value in values]
            if any(abs(growth) > rounding for growth in growths):  # False of NaN
                terms[term] = growths
        return values, [rates[value] for value in values], terms

    def table(self) -> Table:
        others = [Column("mode")]
        for head, unit in OF_TERM:
            others.append(Column(head, unit, attrgetter(f"of_term.{head}")))
        name = parameter_heading(self.parameter, [column.name for column in others])
        return Table([Column(name, value=attrgetter("value")), *others], self.contributions)

    def parts(self) -> Sequence[str | Table]:
        parts: list[str | Table] = []
        for mode in self.modes[:TABLES]:
            values, rates, terms = self.growth_of(mode)
            heads = [(self.parameter, ""), ("growth_rate", "1/s"), *((term, "") for term in terms)]
            rows = list(zip(values, rates, *terms.values(), strict=True))
            title = f"what each term does to mode {mode} over {self.parameter}, 1/s"
            parts.append(Table(in_order(heads), rows, title))
        return parts

    def to_dict(self) -> dict[str, Any]:
        return {"energy_sweep": self.table().records()}


@public
def energy_sweep(swept: Sweep) -> EnergySweep:
    """Compute what each term of M, C and K does to each mode at each value of a sweep.

    Each value is solved on the system itself, also where a reduced one served the sweep.

    Parameters
    ----------
    swept : Sweep
        Of a pad or of a system.

    Returns
    -------
    EnergySweep
        The contributions at each value, see `energy`. Over the terms growth in 1/s sums to
        Re lambda of a mode that oscillates; it is None of another one.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], [[0.2, 0], [0, 0.2]], K)
    >>> found = squeal.energy_sweep(squeal.sweep(pair, [0.5, 1.0, 1.5]))
    >>> values, rates, terms = found.growth_of(found.modes[0])
    >>> [round(growth, 3) for growth in terms["K: mu"]]
    [0.204, 0.348]
    """
    contributions: list[SweptContribution] = []
    for step, eigenvalues in _eigenvalues_of_steps(swept):
        number_of = _numbers_in_sweep(step, eigenvalues)
        for row in energy(eigenvalues).contributions:
            contributions.append(SweptContribution(step.value, number_of.get(row.mode), row))
    return EnergySweep(swept.name, swept.parameter, tuple(contributions))


def _eigenvalues_of_steps(swept: Sweep) -> Iterator[tuple[Step, Eigenvalues]]:
    """Each step of a sweep that has roots, with eigenvalues computed anew, which have vectors."""
    steps = [step for step in swept.steps if step.roots is not None]
    source = swept.source
    # `prove=False`: the referee need not look at the roots, of which the vectors alone are used
    if isinstance(source, PadSource):
        for step in steps:
            yield step, pad_eigenvalues(source.scene.replace(mu=step.value), prove=False)
        return
    assert source is not None
    from squeal.queries.systems.eigenvalues import system_eigenvalues
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis(source.file, source.selection)
    for step in steps:
        yield step, system_eigenvalues(analysis, step.value, prove=False)


def _numbers_in_sweep(step: Step, eigenvalues: Eigenvalues) -> dict[int, int | None]:
    """The number of each mode over the sweep, by its number at the value of the step alone.

    Eigenvalues are assigned to the roots of the step so that the sum of their distances is least.
    A number is None where the sweep has lost which mode is which.
    """
    assert step.roots is not None
    distances = np.abs(eigenvalues.values[:, None] - step.roots)  # rad/s
    number_of: dict[int, int | None] = {}
    # two real roots may be one mode: the first of them gives the number
    for k, root in np.transpose(linear_sum_assignment(distances)).tolist():  # pairs of indices
        number_of.setdefault(int(eigenvalues.modes[k]), step.mode_numbers[root])
    return number_of
