"""The equations of `model.equations` as heyoka's expressions, for every integrator made of them.

The numbers of a pad are runtime parameters, so the compiled code, which heyoka keeps on disk,
serves every pad.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import heyoka as hy

from squeal.model.equations import net_loads
from squeal.model.law import ContactLaw, Touching
from squeal.model.mechanics import Coefficients, at_speed, facing, pose, spring_vectors
from squeal.simulation.legs import COLLAPSED

# its warnings would go to standard output; a lost root shows in the check at the end of a leg
hy.set_logger_level_critical()

# A gap that is exactly zero at the start of a step hides the next root of the same step from
# heyoka 7.13: its bracketing search then stops at the left end. This offset, far below the
# rounding of any gap, puts the start on the side of the contact state.
NEVER_ZERO = 1e-300
# heyoka's tolerance is relative to the largest of state and event functions: a limit of order one
# would loosen the error control of a small motion.
FAINT = 1e-30
# Up to so many contact points each state has compiled code of its own, which is fastest; with more
# points one code serves all states.
OWN_CODE = 2
# of the runtime parameters of `equations`, in their order
NAMES = [f.name for f in fields(Coefficients)]


def equations(
    law: ContactLaw, on: Touching, terms: tuple[str, ...] = ()
) -> tuple[list[tuple[Any, Any]], list[Any], list[Any]]:
    """Symbolic equations of motion, the gaps of the contact points and the model's limits.

    `on` is the contact state, as constants or as symbols; `terms` are those with velocities, see
    `PadModel.terms`, whose numbers are the last runtime parameters, see
    `PadModel.term_values`.

    The limits are positive as long as the model holds, in the order of `LIMITS`.

    The state is (x, y, w theta) and rates; coefficients are runtime parameters in the order of
    `Coefficients`.
    """
    c = Coefficients(**{name: hy.par[i] for i, name in enumerate(NAMES)})
    x, y, s, u, v, r = hy.make_vars("x", "y", "s", "u", "v", "r")
    q = c.place((x, y, s))
    first, v3 = len(NAMES) + law.points, (u, v, r)
    if "falling" in terms:
        c = at_speed(hy, c, (hy.par[first + 9], hy.par[first + 10]), u)
    total = net_loads(hy, c, law, q, on)
    system = [
        (x, u),
        (y, v),
        (s, r),
        (u, total.x / c.m),
        (v, total.y / c.m),
        (r, c.w * total.moment / c.I),
    ]
    if "damping" in terms:
        for i in range(3):
            drag = sum(hy.par[first + 3 * i + j] * v3[j] for j in range(3))
            system[3 + i] = (system[3 + i][0], system[3 + i][1] - drag)
    at = pose(hy, q)
    limits = [facing(c, at)] + [
        hy.sqrt(vx * vx + vy * vy) / L - COLLAPSED
        for (vx, vy), L in zip(spring_vectors(c, at), (c.L1, c.L2), strict=True)
    ]
    if "falling" in terms:
        limits.append(hy.par[first + 11] - u)
    return system, list(law.gaps(c, at)), [FAINT * limit for limit in limits]


def state_parameters(law: ContactLaw) -> tuple[Any, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(NAMES) + i] for i in range(law.points))


def rising(heights: list[Any], on: Touching) -> list[Any]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    pairs = zip(heights, on, strict=True)
    return [(2.0 * touches - 1.0) * gap - NEVER_ZERO for gap, touches in pairs]
