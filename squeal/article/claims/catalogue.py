"""What the article says of its results, one checkable statement an entry, in our words.

Times count from the first contact; an instant of zero length at the start
does not count.
"""

from __future__ import annotations

from typing import NamedTuple


class Claim(NamedTuple):
    """One statement: the case it is about, where the article makes it, what is measured.

    `conflicts` names a claim that cannot hold together with this one.
    """

    id: str
    case: str
    where: str
    statement: str
    conflicts: str = ""


CLAIMS = (
    Claim("B1-a-lead-loss", "a", "Fig. 4(a)", "the leading edge separates after first contact"),
    Claim("B1-a-trail-loss", "a", "Fig. 4(b)", "the trailing edge separates after first contact"),
    Claim("B1-a-trail-high", "a", "Sec. 4, Fig. 4", "F4 has the higher peak: max F4 > max F3"),
    Claim("B1-a-states", "a", "Fig. 4", "all four contact states occur"),
    Claim("B1-b-trail-loss", "b", "Fig. 5", "the trailing edge separates after first contact"),
    Claim("B1-b-lead-kept", "b", "Sec. 4", "the leading edge never separates (F3 > 0)"),
    Claim("B1-b-states", "b", "Fig. 5", "only states 1 and 3 occur"),
    Claim("B1-b-ratio", "b", "Sec. 4", "max F3 is almost three times max F4 (2.5 to 3)"),
    Claim("B1-c-sum", "c", "Sec. 4", "some edge is always in contact (F3 + F4 > 0)"),
    Claim("B1-c-states", "c", "Fig. 6", "states 1, 3 and 4 occur, state 2 does not"),
    Claim("B1-d-states", "d", "Fig. 7", "states 1, 3 and 4 occur, state 2 does not"),
    Claim("B1-d-mostly-full", "d", "Sec. 4", "state 1 lasts more than half of the time"),
    Claim("B1-d-alternate", "d", "Sec. 4", "contact losses alternate between the edges"),
    Claim("B1-all-separate", "all", "Sec. 5, end", "in each case at least one edge separates"),
    Claim("B2-a-contact", "a", "Sec. 5, Fig. 9(a)", "contact is never lost (Rn > 0)"),
    Claim(
        "B2-a-leading", "a", "Sec. 5, Fig. 9(b)", "delta < 0 and theta0 + theta > 0 at all times"
    ),
    Claim("B2-b-contact", "b", "Sec. 5, Fig. 10(a)", "contact is never lost (Rn > 0)"),
    Claim("B2-b-trailing", "b", "Sec. 5, Fig. 10(b)", "delta > 0 at all times"),
    Claim("B2-b-tilt", "b", "Sec. 5", "theta0 + theta < 0 at all times", "B2-b-theta"),
    Claim(
        "B2-b-theta",
        "b",
        "Sec. 5, end",
        "theta0 + theta > 0 at all times in models B1 and B2",
        "B2-b-tilt",
    ),
    Claim("B2-b-twice", "a, b", "Sec. 5", "mean Rn of b is almost twice that of a (1.7 to 2)"),
    Claim("B2-c-loss", "c", "Fig. 11(a)", "the surfaces separate for some time (Rn = 0)"),
    Claim("B2-c-hammer", "c", "Fig. 11(b)", "delta goes to both edges in turn, repeatedly"),
    Claim("B2-d-contact", "d", "Fig. 12(a)", "contact is never lost (Rn > 0)"),
    Claim("B2-d-trailing", "d", "Fig. 12(b)", "0 < delta < w at all times"),
    Claim("B2-only-c", "all", "Sec. 5, end", "the surfaces separate in case c only"),
    Claim("B3-singular", "all", "Sec. 6", "the stiffness matrix of Eq. (21) is singular"),
    Claim(
        "B3-small-region",
        "all",
        "Sec. 6-7, Fig. 13",
        "(23a, b) hold on a small part (under a quarter) of the map",
    ),
    Claim("B3-none", "all", "Sec. 7", "no simulated case settles into zero acceleration"),
)
