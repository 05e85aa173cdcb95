"""One step of many pads at once: a compiled function without branches, from the state to the next.

Each pad has a step size of its own. The polynomial of a gap over the step, in Bernstein form, says
whether it passes zero and, if it surely does so just once, Newton's method finds where. Otherwise
the pad tries again with half the step, so that no contact change is passed over.
"""

import math
from functools import reduce
from typing import Any

import heyoka as hy

from squeal.model.equations import term_count
from squeal.model.law import ContactLaw
from squeal.simulation.batch import passing
from squeal.simulation.batch.series import Series, SeriesFunctions, total
from squeal.simulation.integrators.kept import kept
from squeal.simulation.integrators.symbols import NAMES, motion, symbols

SHORT = 1e-9  # natural time: a step as short is not halved; a limit as near is reached
LONG = 1e30
SAMPLED = 4  # samples of a step that one call gives
WIDTH = 8  # lanes of the processor


# rows of a step's arrays: state, then these; after them the contact of each point (the input ends
# here), and the code of what happened
TIME, LEFT, LONGEST, STEPS, TOUCHING = range(6, 11)


def order_of(tolerance: float) -> int:
    """The order of the series for a tolerance, as heyoka's."""
    return max(2, math.ceil(1.0 - 0.5 * math.log(tolerance)))


def _step_size(series: list[Series], order: int) -> Any:
    """As heyoka's, from the last two coefficients, relative to the state if that is above one; but
    by sums of squares instead of the greatest."""
    size = passing.most(total([s[0] * s[0] for s in series]), 1.0)
    sizes = [
        hy.log(size / (total([s[k] * s[k] for s in series]) + 1e-300)) * (0.5 / k)
        for k in (order - 1, order)
    ]
    return hy.exp(passing.least(*sizes) - (2.0 + 0.7 / (order - 1)))


class _Expanded:
    """Series of the motion from given state and contact, all expressions."""

    def __init__(
        self, law: ContactLaw, order: int, terms: tuple[str, ...], state: list[Any], on: list[Any]
    ) -> None:
        numbers = [hy.par[len(NAMES) + i] for i in range(term_count(terms))]
        rates: list[Any] = []

        def series(i: int) -> Series:
            return Series(lambda k: rates[i][k - 1] * (1.0 / k) if k else state[i])

        self.state = [series(i) for i in range(6)]
        c, *_ = symbols(law, ())
        found = motion(SeriesFunctions(), c, law, self.state, on, terms, numbers)
        rates.extend(found.rates)
        self.gaps, self.limits = found.gaps, found.limits
        self._coefficients = [[s[k] for k in range(order + 1)] for s in self.state]

    def at(self, lapse: Any) -> list[Any]:
        """The state after a lapse of time."""
        return [passing.horner(s, lapse) for s in self._coefficients]


def compiled_step(law: ContactLaw, order: int, terms: tuple[str, ...]) -> Any:
    """The compiled function of a step.

    Input, a row each: state (6), time, time left, longest step allowed, steps so far, contact of
    each point. Output: the same, then a code: 0, 1 + the contact point that changes, or
    -1 - the limit that is reached. Where no time is left nothing changes. Parameters: the
    coefficients, and numbers of the terms with velocities.
    """
    given = [hy.make_vars(f"row_{i}") for i in range(TOUCHING + law.points)]
    left, on = given[LEFT], given[TOUCHING:]
    series = _Expanded(law, order, terms, given[:6], on)
    h = passing.least(_step_size(series.state, order), passing.least(left, given[LONGEST]))
    powers = [1.0, h]
    for k in range(2, order + 1):
        powers.append(powers[k // 2] * powers[k - k // 2])

    # in the sense in which each gap grows towards its next change
    passings = [
        passing.passing([(2.0 * touches - 1.0) * gap[k] * powers[k] for k in range(order + 1)])
        for touches, gap in zip(on, series.gaps, strict=True)
    ]
    going = passing.choose(passing.positive(left), 1.0, 0.0)
    sure = reduce(lambda a, b: a * b, [p.sure for p in passings])
    again = going * (1.0 - sure) * (1.0 - passing.below(h, SHORT))
    move = going * (1.0 - again)
    met: Any = hy.expression(1.0)  # share of the step that is taken
    code: Any = hy.expression(0.0)
    for number, limit in enumerate(series.limits):
        share = passing.before_zero([limit[k] * powers[k] for k in range(order)])
        reached = passing.positive(passing.below(h * share, SHORT) * (met - share))
        code, met = passing.choose(reached, -1.0 - number, code), passing.least(met, share)
    for point, p in enumerate(passings):
        first = passing.positive(p.ends * (met - p.at))
        code, met = passing.choose(first, point + 1.0, code), passing.choose(first, p.at, met)
    code, lapse = code * move, h * met * move

    # a pad that has reached a limit goes no further
    after = passing.choose(hy.lt(code, hy.expression(0.0)), 0.0, left - lapse)
    outputs = [*series.at(lapse), given[TIME] + lapse, after]
    outputs += [passing.choose(passing.positive(again), 0.5 * h, LONG), given[STEPS] + going]
    for point, touches in enumerate(on):
        this = passing.positive((code - (point + 0.5)) * ((point + 1.5) - code))
        outputs.append(passing.choose(this, 1.0 - touches, touches))
    return _compiled([*outputs, code], given)


def compiled_samples(law: ContactLaw, order: int, terms: tuple[str, ...]) -> Any:
    """The compiled function of samples within a step.

    Input: state (6) and contact where the step begins, lapse of time to the first sample, time
    between samples. Output: `SAMPLED` states (6), one after the other. Parameters as of a step.
    """
    given = [hy.make_vars(f"row_{i}") for i in range(8 + law.points)]
    *on, lapse, apart = given[6:]
    series = _Expanded(law, order, terms, given[:6], on)
    states = [series.at(lapse + float(i) * apart) for i in range(SAMPLED)]
    return _compiled([value for state in states for value in state], given)


def _compiled(outputs: list[Any], given: list[Any]) -> Any:
    how = {"fast_math": True, "batch_size": WIDTH}
    return kept(outputs, ("cfunc", given, how), lambda: hy.cfunc(outputs, given, **how))
