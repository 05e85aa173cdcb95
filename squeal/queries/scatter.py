"""The verb `scatter`: what tolerances or ranges of many parameters make of stability.

Samples of the parameters are drawn, and for each the critical friction, or the largest growth rate
in a band, is computed (see `samples`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.linear.matrices import Array
from squeal.linear.system import TermSystem
from squeal.queries import sample_journal
from squeal.queries.options import FRICTION_END, Band, RandomNumbers, Workers, seed_of, upper_end
from squeal.queries.parameter_space import (
    NO_EQUILIBRIUM,
    NO_PAD,
    ROUNDING,
    ParameterSpace,
)
from squeal.queries.samples import Changes, SampleComputer, sample_computer, samples_of
from squeal.queries.sampling import SPREADS, parameters_at, points_of_unit_cube, require_spreads
from squeal.queries.systems.reduced import basis_of
from squeal.queries.systems.seat import warn_of_held_seat
from squeal.queries.systems.system_analysis import file_of, refuse_without_effect
from squeal.queries.variance_indices import points_for_indices, sobol_indices
from squeal.results.scatter import CONFIDENCE, Index, Measure, Sample, Scatter, Spread
from squeal.results.sources import EigenvalueSelection, digest_of
from squeal.schema import Place, Positive, public

CHUNK = 64  # pads that are computed together


class _Plan(NamedTuple):
    """How samples are drawn, as `SPREADS` reads it; see `scatter`."""

    spreads: dict[str, Spread]
    samples: int
    seed: int
    design: str
    indices: bool

    def points(self) -> Array:
        """Points of the unit cube, one for each sample, see `parameters_at`."""
        dimensions = len(self.spreads)
        if not self.indices:
            return points_of_unit_cube(self.design, self.samples, dimensions, self.seed)
        pairs = points_of_unit_cube(self.design, self.samples, 2 * dimensions, self.seed)
        return points_for_indices(pairs)


@public
def scatter(
    subject: object,
    spreads: Mapping[str, Spread],
    samples: int = 400,
    rng: RandomNumbers = 1,
    high: Positive | None = None,
    of: Measure = "threshold",
    band: Band | None = None,
    design: str = "random",
    indices: bool = False,
    workers: Workers = 1,  # `public` reads it
    journal: Path | str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Scatter:
    """Draw samples whose parameters scatter, and compute the stability of each.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        What scatters. A system of more than 400 rows needs a band.
    spreads : mapping of str to mapping
        How each parameter scatters, independently of the others: normally with the standard
        deviation ``relative`` to its value or ``absolute`` in its unit, evenly ``within`` its value
        plus and minus so much, or evenly ``between`` two values, such as
        ``{"k1": {"relative": 0.05}}``.
    samples : int
        How many are drawn.
    rng : int or numpy.random.Generator
        Of the random numbers: the same seed draws the same samples. A generator draws the seed,
        which the answer names.
    high : float, optional
        Upper end of the range that is searched for the threshold, as `thresholds` takes it.
    of : {"threshold", "growth"}
        The first loss of stability, searched for and not proved as by `thresholds`, or the largest
        growth rate and the squeal propensity index at the parameters of the sample. The free
        parameter may scatter for growth.
    band : (float, float), optional
        Frequencies in Hz whose roots are judged, of systems.
    design : {"random", "latin", "sobol"}
        Independent samples, a Latin hypercube, or a Sobol sequence.
    indices : bool
        Whether Sobol indices are computed, by the estimators of Saltelli et al., Computer Physics
        Communications 181 (2010) 259-270, which draws twice as many samples, and ``samples`` times
        the number of parameters more. A threshold that lies beyond ``high`` counts as ``high``.
    workers : int
        Threads for a large system, else processes, which start by import: a script must guard its
        main part.
    journal : path, optional
        A file that keeps what is computed, so that an interrupted run goes on.
    progress : callable, optional
        Called with (done, count) now and then.

    Returns
    -------
    Scatter
        The samples by rising value, quantiles, shares and indices.

    Raises
    ------
    InputError
        For a spread that does not fit the scene or system, and for a range of thresholds that ends
        below the value of the parameter in the subject.
    ComputationError
        If no sample can be computed.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> answer = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=16)

    Flutter begins at (a - b) / 2:

    >>> [0.45 <= q.value <= 0.55 for q in answer.quantiles if q.level == 0.5]
    [True]
    """
    options = {
        "spreads": spreads,
        "samples": samples,
        "seed": seed_of(rng, "scatter"),
        "design": design,
        "indices": indices,
    }
    plan = _Plan(**SPREADS.read(options, Place("scatter")))
    require_spreads(plan.spreads)
    if of == "growth" and high is None:  # no threshold is searched: any end is allowed
        high = FRICTION_END
    high = upper_end(subject, high)
    space = _space_of(subject, of, high, plan.spreads)
    changes = parameters_at(space, plan.spreads, plan.points())
    computer = sample_computer(space, of, high, EigenvalueSelection(band), changes)
    question = (of, high, band, plan.spreads, plan.design, plan.seed, plan.indices, plan.samples)
    rows = _compute_all(space.subject, changes, computer, journal, question, progress)
    return _summary(rows, plan, of, high, space, computer)


def _space_of(
    subject: object, measure: Measure, high: float, spreads: dict[str, Spread]
) -> ParameterSpace:
    """The parameters of the subject, of which those that scatter must have an effect.

    measure: what is computed of each sample; high: up to which friction or value of the free
    parameter; spreads: by the parameters that scatter.

    Raises InputError, also for thresholds up to a value below that of the subject itself.
    """
    space = ParameterSpace.of(subject, "scatter", high, measure)
    if measure == "threshold" and high < space.at:
        allowed = f"at least {space.free} = {space.at:g}, at which samples are stable or not"
        raise Place("scatter", "high").must_be(high, allowed)
    if isinstance(space.subject, TermSystem):
        file = file_of(subject)
        refuse_without_effect(file, spreads, Place("scatter", "spreads"))
        warn_of_held_seat(file, "scatter")
    return space


def _summary(
    rows: Sequence[Sample],
    plan: _Plan,
    measure: Measure,
    high: float,
    space: ParameterSpace,
    computer: SampleComputer,
) -> Scatter:
    """Sum up all samples, which come in the order in which they were drawn.

    measure: what was computed of each, a threshold or growth; high: the end of the range of the
    free parameter in which thresholds were searched.

    Raises ComputationError if none of them was computed.
    """
    sobol: tuple[Index, ...] = ()
    if plan.indices:
        sobol = _indices_of(rows, plan, high)
        # of the samples at A, B and each AB_i, which are columns of A and B, only those at A and B
        # are independent of one another
        rows = rows[: 2 * plan.samples]
    computed = [row for row in rows if row.reason is None]
    if not computed:
        raise ComputationError(f"no sample can be computed: {_first_reason(rows)}")
    computed.sort(key=attrgetter("has_no_threshold", "value"))  # False comes before True
    no_pad = sum(row.kind == NO_PAD for row in rows)
    failed = len(rows) - len(computed) - no_pad
    number_stable = sum(_is_stable(row, measure, space.at) for row in computed)
    basis = basis_of(computer.reduction, computer.selection)
    if basis is not None:
        basis["residual"] = max(sample.residual or 0.0 for sample in computed)
    return Scatter(
        name=space.free,
        of=measure,
        mu=space.at,
        mu_max=high,
        band=computer.selection.band,
        spreads=plan.spreads,
        design=plan.design,
        seed=plan.seed,
        samples=len(rows),
        rows=tuple(computed),
        no_pad=no_pad,
        failed=failed,
        stable=number_stable / len(computed),
        interval=_interval_of_share(number_stable, failed, len(computed) + failed),
        indices=sobol,
        basis=basis,
    )


def _first_reason(rows: Sequence[Sample]) -> str:
    """Why the first sample was not computed, for a message; none was. Samples whose parameters are
    allowed come before the others."""
    first = min(rows, key=lambda row: row.kind == NO_PAD)  # False comes before True
    return first.reason or NO_EQUILIBRIUM


def _is_stable(row: Sample, of: Measure, mu: float) -> bool:
    """True if a computed sample is stable at the friction or free parameter `mu`.

    Of a threshold: up to it, since nothing is known of what follows the first loss.
    """
    if of == "growth":
        return not row.unstable
    return row.has_no_threshold or row.value > mu


def _indices_of(rows: Sequence[Sample], plan: _Plan, high: float) -> tuple[Index, ...]:
    """Sobol indices from the samples at A, then B, then each AB_i, `plan.samples` of each.

    A threshold beyond `high`, the end of its range, counts as `high`; what could not be computed is
    left out. Of growth rates each sample has a value.
    """
    values = []
    for row in rows:
        if row.reason is not None:
            values.append(math.inf)  # which `sobol_indices` leaves out
        elif row.has_no_threshold:
            values.append(high)
        else:
            values.append(row.value)
    names = list(plan.spreads)
    table = np.array(values).reshape(len(names) + 2, plan.samples)  # a row for A, B, each AB_i
    return sobol_indices(names, table, plan.seed, same=ROUNDING)


def _interval_of_share(stable: int, unknown: int, count: int) -> tuple[float, float]:
    """Wilson's confidence interval of the share of stable samples.

    Of `count` samples `stable` are known to be stable and `unknown` may be: the lower end takes
    them as unstable, the upper end as stable.
    """
    from scipy.stats import binomtest

    low = binomtest(stable, count).proportion_ci(CONFIDENCE, "wilson").low
    high = binomtest(stable + unknown, count).proportion_ci(CONFIDENCE, "wilson").high
    return float(low), float(high)


def _compute_all(
    subject: Scene | TermSystem,
    changes: Sequence[Changes],
    computer: SampleComputer,
    journal: Path | str | None,
    question: Sequence[object],
    progress: Callable[[int, int], None] | None,
) -> list[Sample]:
    """Compute the samples of all changes, chunk by chunk, and return them in their order.

    question: the options that decide the samples. Chunks that a journal holds for the same subject
    and question are not computed again; a journal with chunks of another size is refused.
    progress: called with (samples done, samples in all).
    """
    size = CHUNK if isinstance(subject, Scene) else 1  # systems are computed one by one
    chunks = [changes[start : start + size] for start in range(0, len(changes), size)]
    chunks_done: dict[int, list[Sample]] = {}  # by number of the chunk
    if journal is not None:
        # with the size: a journal holds chunks by number
        digest = digest_of(subject, *question, size)
        chunks_done = sample_journal.read_or_begin(Path(journal), digest)
    missing = [number for number in range(len(chunks)) if number not in chunks_done]
    done = sum(len(samples) for samples in chunks_done.values())
    tasks = [chunks[number] for number in missing]
    # a reduction exists of large systems alone: their workers are threads, which share it
    in_threads = computer.reduction is not None
    computed = mapped(partial(samples_of, computer), tasks, in_threads)
    for number, samples in zip(missing, computed, strict=True):
        chunks_done[number] = samples
        done += len(samples)
        if journal is not None:
            sample_journal.append(Path(journal), number, samples)
        if progress is not None:
            progress(done, len(changes))
    in_order = []
    for number in range(len(chunks)):
        in_order += chunks_done[number]
    return in_order
