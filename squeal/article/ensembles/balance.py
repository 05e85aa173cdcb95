"""Where the line contact's reaction acts on average, from the balances alone.

Over a long bounded motion the mean accelerations vanish. While the springs do not turn much, the
balances of both forces and of the moment then give the mean of delta weighted with the reaction,
whatever the contact law, the stiffnesses and the start, if delta's moment is "+"; for "-" the mean
of delta has the opposite sign.
"""

import math

from squeal.article.cases import CASES


def flattest(case: str) -> float:
    """h/w below which the reaction acts on the trailing side on average, in case (c) or (d)."""
    return -math.tan(CASES[case][0]) / 2.0
