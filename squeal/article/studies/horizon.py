"""How far ahead a stiff contact can be computed: errors that impacts amplify, and their limit.

The motions start pressed in by twice the static depth, with a contact stiffness of 1 to 1e8 times
that of a support spring. Reference solution is the motion in quad precision, which the rounding of
doubles does not reach. Beside it stand the default path in doubles, a second method with equations
of its own (`_independent`), and quad precision from a start that is off by 1e-15. If the errors of
the first two grow as the difference of the third does, it is the motion that amplifies them.
Whether it does depends on the pad: `RandomSets` counts others.

The runs are stored; `python -m benchmarks.horizon` makes them anew.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

from squeal.article.records import Record, Result, read_json
from squeal.model.pad import Model

LEVELS = (1e-9, 1e-6)
"""Relative errors of the place whose first excess is a horizon."""
START_ERROR = 1e-15  # of the perturbed start, relative
STIFF = 1e3  # contact over support stiffness from which motions are lost within ten periods
FORETOLD = 1e6  # beyond, the exponent of the short window foretells the horizon within four only
ROUNDING = 1e-16  # of a double, from which the exponent predicts the horizon
Periods = Annotated[float, ".2f"]


class Errors(Record):
    """Relative errors of the place against quad precision at the times of a motion."""

    double: tuple[float, ...]
    independent: tuple[float, ...]
    start: tuple[float, ...]


class Run(Record):
    """The motions of a model at one contact stiffness; times in support periods.

    stiffness: of each contact spring over that of a support spring; window: time computed in quad
    precision; changes: contact changes in it; found: contact changes of the double run and of the
    second method; horizons: of the double run from starts changed in the last bit, of the second
    method, of the perturbed start, each for both of `LEVELS`, None where the window ends before;
    exponent: greatest Lyapunov exponent by renormalised neighbours, per support period; one, ten:
    contact changes in one and ten periods, None where they were not computed; errors at `times`.
    """

    model: Model
    stiffness: float
    window: Periods
    changes: int
    found: tuple[int, int]
    double: tuple[tuple[float | None, ...], ...]
    independent: tuple[float | None, ...]
    start: tuple[float | None, ...]
    exponent: float
    one: int | None
    ten: int | None
    times: tuple[float, ...]
    errors: Errors

    @property
    def horizon(self) -> tuple[float, float] | None:
        """Least and greatest horizon of the double runs, None where the window ends before."""
        horizons = [at_first_level for at_first_level, _ in self.double]
        reached = [at for at in horizons if at is not None]
        if len(reached) < len(horizons):
            return None
        return min(reached), max(reached)

    @property
    def predicted(self) -> float:
        """Time in which an error of `ROUNDING` grows to the first level by the exponent."""
        if self.exponent <= 0.0:
            return math.inf
        return math.log(LEVELS[0] / ROUNDING) / self.exponent

    def after(self, periods: float) -> float | None:
        """Error of the double run about that time, None beyond the window or the horizon."""
        if self.window < periods:
            return None
        if self.horizon is not None and self.horizon[0] < periods:
            return None
        later = next(i for i, t in enumerate(self.times) if t >= periods * (1.0 - 1e-9))
        return self.errors.double[later]

    @property
    def per_impact(self) -> float:
        """Factor by which an impact, two contact changes, multiplies an error.

        An error grows by exp(exponent t); the window holds changes / 2 impacts.
        """
        return math.exp(2.0 * self.exponent * self.window / self.changes)


class RandomSets(Record):
    """How many of the first valid random parameter sets have a horizon.

    Case (c) with contacts `stiffness` times as stiff as a support, pressed in by twice the static
    depth, level, over ten support periods in doubles: lost counts by model the sets whose motions
    from starts that differ by `start_error` come to differ by the first of `LEVELS`.
    """

    sets: int
    stiffness: float
    start_error: float
    lost: dict[str, int]


class Horizon(Result):
    """The stored runs; example: stiffness of the one that is drawn with its errors."""

    runs: tuple[Run, ...]
    random: RandomSets
    example: float = 1e3
    levels: tuple[float, float] = (LEVELS[0], LEVELS[1])
    start_error: float = START_ERROR

    def with_model(self, model: Model) -> tuple[Run, ...]:
        """The runs of a model, the softest contact first."""
        return tuple(run for run in self.runs if run.model == model)

    @property
    def reached(self) -> tuple[Run, ...]:
        """The runs whose horizon lies within the window."""
        return tuple(run for run in self.runs if run.horizon is not None)

    @property
    def prediction(self) -> tuple[float, float]:
        """Least and greatest horizon over the prediction by the exponent, up to `FORETOLD`; NaN
        where no run has a horizon."""
        ratios: list[float] = []
        for run in self.reached:
            if run.stiffness <= FORETOLD:
                ratios += [at / run.predicted for at in run.horizon or ()]
        return min(ratios, default=math.nan), max(ratios, default=math.nan)

    @property
    def second(self) -> tuple[float, float]:
        """Least and greatest horizon of the second method over the default path's; NaN where no run
        has both."""
        ratios: list[float] = []
        for run in self.reached:
            second = run.independent[0]
            if second is not None:
                ratios += [second / at for at in run.horizon or ()]
        return min(ratios, default=math.nan), max(ratios, default=math.nan)


def first_excess(times: np.ndarray, errors: np.ndarray, level: float) -> float | None:
    """The first time at which an error exceeds a level, None if none does."""
    beyond = np.flatnonzero(errors > level)
    return float(times[beyond[0]]) if beyond.size else None


def study(files: Sequence[Path]) -> Horizon:
    """The runs of a stored file."""
    (file,) = files
    return read_json(Horizon, file)


def sentences(record: Horizon) -> dict[str, bool]:
    """What the paper says of stiff contact."""
    # the runs with stiff contact
    points = [run for run in record.with_model("B1") if run.stiffness >= STIFF]
    line = [run for run in record.with_model("B2") if run.stiffness >= STIFF]
    return {
        "stiff-contact-has-a-horizon": all(run.horizon is not None for run in (*points, *line)),
        "the-motion-amplifies-the-errors": _near_one(record.prediction)
        and _near_one(record.second),
        "an-impact-multiplies-errors-by-per-cents-on-points-and-tenths-on-the-line": all(
            1.005 < run.per_impact < 1.06 for run in points
        )
        and all(1.08 < run.per_impact < 1.40 for run in line),
        "in-some-random-sets-only-the-motion-is-lost": all(
            0.15 < lost / record.random.sets < 0.5 for lost in record.random.lost.values()
        ),
        "one-period-is-computed-up-to-1e4": all(
            run.horizon is None or run.horizon[0] > 1.0
            for run in record.runs
            if run.stiffness < 2e4
        ),
    }


def _near_one(ratios: tuple[float, float]) -> bool:
    """Whether the least and the greatest ratio are within a factor of two."""
    return ratios[0] >= 0.5 and ratios[1] <= 2.0
