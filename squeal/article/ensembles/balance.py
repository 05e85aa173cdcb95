"""Where the line contact's reaction acts on average, from the balances alone.

Over a long bounded motion the mean accelerations vanish. While the springs do not turn much, the
balances of both forces and of the moment then give the mean of delta weighted with the reaction,
whatever the contact law, the stiffnesses and the start, if delta's moment is "+"; for "-" the mean
of delta has the opposite sign.
"""

from __future__ import annotations

import math

from squeal.article.cases import CASES


def mean_place(case: str, mu: float, slender: float, load: float) -> float:
    """Mean of delta/w, weighted with R_n, in a case of model B2.

    slender: h/w; load: mean R_n over F_n. In cases (c) and (d) the load does not matter.
    """
    alpha1, alpha2 = CASES[case]
    if alpha1 == alpha2:
        return -mu * (math.tan(alpha1) + 2.0 * slender)
    # the upright spring takes what the reaction has beyond F_n, the level one the friction
    side = -1.0 if alpha1 < alpha2 else 1.0
    return side * (1.0 - 1.0 / load) - 2.0 * mu * slender


def flattest(case: str) -> float:
    """h/w below which the reaction acts on the trailing side on average, in case (c) or (d)."""
    return -math.tan(CASES[case][0]) / 2.0
