"""The equations of `model.equations` as heyoka's expressions, for every integrator made of them.

The numbers of a pad are runtime parameters, so the compiled code, which heyoka keeps on disk,
serves every pad.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import heyoka as hy

from squeal.model.equations import net_loads, term_count
from squeal.model.law import ContactLaw, Touching
from squeal.model.mechanics import Coefficients, Number, at_speed, facing, pose, spring_lengths
from squeal.simulation.hybrid import COLLAPSED

# its warnings would go to standard output; a lost root shows in the check at the end of a leg
hy.set_logger_level_critical()

# A gap that is exactly zero at the start of a step hides the next root of the same step from
# heyoka 7.13: its bracketing search then stops at the left end. This offset, far below the
# rounding of any gap, puts the start on the side of the contact state.
NEVER_ZERO = 1e-300
# heyoka's tolerance is relative to the largest of state and event functions: a limit of order one
# would loosen the error control of a small motion.
FAINT = 1e-30
# With more contact points than so many heyoka compiles functions instead of unrolled code.
UNROLLED = 2
# of the runtime parameters of `equations`, in their order
NAMES = Coefficients._fields


class Motion(NamedTuple):
    """Rates (6,) of the state, gaps of the contact points, and limits, which are positive as long
    as the model holds, in the order of `LIMITS`."""

    rates: list[Number]
    gaps: list[Number]
    limits: list[Number]


def motion(
    ops: Any,
    c: Coefficients,
    law: ContactLaw,
    state: Sequence[Number],
    on: Touching,
    terms: tuple[str, ...],
    numbers: Sequence[Number],
) -> Motion:
    """What drives and bounds a state (x, y, w theta and rates), over any arithmetic.

    `on` is the contact state; `terms` are those with velocities, see `PadModel.terms`, and
    `numbers` theirs, see `PadModel.term_values`.
    """
    u, v, r = state[3:]
    q = c.place(state)
    if "falling" in terms:
        c = at_speed(ops, c, (numbers[9], numbers[10]), u)
    total = net_loads(ops, c, law, q, on)
    rates = [u, v, r, total.x / c.m, total.y / c.m, c.w * total.moment / c.I]
    if "damping" in terms:
        for i in range(3):
            drag = sum(numbers[3 * i + j] * speed for j, speed in enumerate((u, v, r)))
            rates[3 + i] = rates[3 + i] - drag
    at = pose(ops, q)
    limits = [facing(c, at)] + [
        length / L - COLLAPSED
        for length, L in zip(spring_lengths(ops, c, at), (c.L1, c.L2), strict=True)
    ]
    if "falling" in terms:
        limits.append(numbers[11] - u)
    return Motion(rates, list(law.gaps(c, at)), limits)


def symbols(
    law: ContactLaw, terms: tuple[str, ...]
) -> tuple[Coefficients, tuple[Any, ...], list[Any]]:
    """Runtime parameters: coefficients, which points touch, numbers of the terms."""
    c = Coefficients(**{name: hy.par[i] for i, name in enumerate(NAMES)})
    first = len(NAMES) + law.points
    return c, state_parameters(law), [hy.par[first + i] for i in range(term_count(terms))]


def equations(
    law: ContactLaw, on: Touching, terms: tuple[str, ...] = ()
) -> tuple[list[tuple[Any, Any]], list[Any], list[Any]]:
    """Symbolic equations of motion, the gaps of the contact points and the model's limits.

    `on` is the contact state, as constants or as symbols; see `motion` and `symbols`. The state is
    (x, y, w theta) and rates.
    """
    c, _, numbers = symbols(law, terms)
    state = hy.make_vars("x", "y", "s", "u", "v", "r")
    found = motion(hy, c, law, state, on, terms, numbers)
    limits = [FAINT * limit for limit in found.limits]
    return list(zip(state, found.rates, strict=True)), found.gaps, limits


def state_parameters(law: ContactLaw) -> tuple[Any, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(NAMES) + i] for i in range(law.points))


def rising(heights: list[Any], on: Touching) -> list[Any]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    pairs = zip(heights, on, strict=True)
    return [(2.0 * touches - 1.0) * gap - NEVER_ZERO for gap, touches in pairs]
