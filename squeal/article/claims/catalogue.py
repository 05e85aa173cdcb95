"""What the article says of its results, one checkable statement an entry, in our words.

Times count from the first contact. A signal that is zero at the start must have the right sign at
each later time; its margin is taken from its first turning point on.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from squeal.article.cases import CASES, stem
from squeal.article.claims import rules
from squeal.article.claims.rules import Outcome
from squeal.model.contact import FULL, LEAD, LEADING, NONE, TRAIL, TRAILING

ROOM = 0.2  # margin that counts as ample, where no other is named
TILT = 0.3  # the same for tilts, over F_n / (k1 w)


@dataclass(frozen=True)
class Consequence:
    """Why a claim carries no information of its own.

    implied: it holds where all claims `by` hold; identity: algebra makes it hold whatever the
    numbers; almost sure: the motions for which it fails have no volume; free: a number that is not
    printed can be chosen to make it hold.
    """

    kind: Literal["implied", "identity", "almost sure", "free"]
    derivation: str
    by: tuple[str, ...] = ()


def _implied(by: str, derivation: str) -> Consequence:
    return Consequence("implied", derivation, tuple(by.split()))


@dataclass(frozen=True)
class Claim:
    """One statement: the scenes it is about, where the article makes it, and its rule.

    The rule takes the measures of these scenes in their order (b3: those of the linear model).
    ample: margin beyond which a search gains no more, over F_n / (k1 w) if `by_load` (a tilt grows
    with the load); conflicts: claims that cannot hold together with this one; follows: why its
    verdict carries no information of its own, None where it does.
    """

    id: str
    scenes: tuple[str, ...]
    where: str
    statement: str
    rule: Callable[..., Outcome]
    ample: float = ROOM
    by_load: bool = False
    conflicts: tuple[str, ...] = ()
    follows: Consequence | None = None

    @property
    def informative(self) -> bool:
        """Whether its verdict is no consequence of others, algebra, missing damping or a free V."""
        return self.follows is None

    @cached_property
    def case(self) -> str:
        """The cases it is about, "all" where it is about every one."""
        letters = sorted({scene[-1] for scene in self.scenes} & CASES.keys())
        return ", ".join(letters) if 0 < len(letters) < len(CASES) else "all"


_ALL_B1 = tuple(stem("B1", case) for case in CASES)
_ALL_B2 = tuple(stem("B2", case) for case in CASES)

# fmt: off
CLAIMS = (
    Claim("B1-a-lead-loss", ("b1-a",), "Fig. 4(a)",
          "the leading edge separates after first contact", rules.apart(LEADING),
          follows=_implied(
              "B1-a-states", "states 2 and 4, which occur, separate the leading edge")),
    Claim("B1-a-trail-loss", ("b1-a",), "Fig. 4(b)",
          "the trailing edge separates after first contact", rules.apart(TRAILING),
          follows=_implied(
              "B1-a-states", "states 2 and 3, which occur, separate the trailing edge")),
    Claim("B1-a-trail-high", ("b1-a",), "Sec. 4, Fig. 4", "F4 has the higher peak: max F4 > max F3",
          rules.trailing_higher),
    Claim("B1-a-states", ("b1-a",), "Fig. 4", "all four contact states occur",
          rules.states((FULL, NONE, LEAD, TRAIL), ()), ample=0.02),
    Claim("B1-b-trail-loss", ("b1-b",), "Fig. 5", "the trailing edge separates after first contact",
          rules.apart(TRAILING),
          follows=_implied("B1-b-states", "state 3, which occurs, separates the trailing edge")),
    Claim("B1-b-lead-kept", ("b1-b",), "Sec. 4", "the leading edge never separates (F3 > 0)",
          rules.positive("first", "F_n"),
          follows=_implied(
              "B1-b-states", "the leading edge touches in states 1 and 3, and no other occurs")),
    Claim("B1-b-states", ("b1-b",), "Fig. 5", "only states 1 and 3 occur",
          rules.states((FULL, LEAD), (NONE, TRAIL))),
    Claim("B1-b-ratio", ("b1-b",), "Sec. 4", "max F3 is almost three times max F4 (2.5 to 3)",
          rules.leading_almost_threefold, ample=0.25),
    Claim("B1-c-sum", ("b1-c",), "Sec. 4", "some edge is always in contact (F3 + F4 > 0)",
          rules.positive("together", "F_n"), ample=0.05,
          follows=_implied("B1-c-states", "F3 + F4 = 0 is state 2, which does not occur")),
    Claim("B1-c-states", ("b1-c",), "Fig. 6", "states 1, 3 and 4 occur, state 2 does not",
          rules.states((FULL, LEAD, TRAIL), (NONE,)), ample=0.02),
    Claim("B1-d-states", ("b1-d",), "Fig. 7", "states 1, 3 and 4 occur, state 2 does not",
          rules.states((FULL, LEAD, TRAIL), (NONE,)), ample=0.02),
    Claim("B1-d-mostly-full", ("b1-d",), "Sec. 4", "state 1 lasts more than half of the time",
          rules.mostly_full),
    Claim("B1-d-alternate", ("b1-d",), "Sec. 4", "contact losses alternate between the edges",
          rules.alternate, ample=0.3),
    Claim("B1-all-separate", _ALL_B1, "Sec. 5, end", "in each case at least one edge separates",
          rules.each_separates,
          follows=_implied(
              "B1-a-states B1-b-states B1-c-states B1-d-states",
              "in each case a state other than 1 occurs")),
    Claim("B2-a-contact", ("b2-a",), "Sec. 5, Fig. 9(a)", "contact is never lost (Rn > 0)",
          rules.positive("first", "F_n"),
          follows=_implied("B2-only-c", "no separation in case a is a part of it")),
    Claim("B2-a-leading", ("b2-a",), "Sec. 5, Fig. 9(b)",
          "delta < 0 and theta0 + theta > 0 at all times",
          rules.on_leading_edge, ample=TILT, by_load=True),
    Claim("B2-b-contact", ("b2-b",), "Sec. 5, Fig. 10(a)", "contact is never lost (Rn > 0)",
          rules.positive("first", "F_n"),
          follows=_implied("B2-only-c", "no separation in case b is a part of it")),
    Claim("B2-b-trailing", ("b2-b",), "Sec. 5, Fig. 10(b)", "delta > 0 at all times",
          rules.positive("second", "w"), ample=0.01),
    Claim("B2-b-tilt", ("b2-b",), "Sec. 5", "theta0 + theta < 0 at all times",
          rules.tilted_down, ample=TILT, by_load=True,
          conflicts=("B2-b-theta", "B2-b-theta-line"),
          follows=_implied(
              "B2-b-trailing B2-only-c",
              "delta from the mass centre is on the side that dips, while the pad tilts little")),
    Claim("B2-b-theta", ("b1-b", "b2-b"), "Sec. 5, end",
          "theta0 + theta > 0 at all times in models B1 and B2",
          rules.both_tilted_up, ample=TILT, by_load=True, conflicts=("B2-b-tilt",),
          follows=_implied(
              "B1-b-theta B2-b-theta-line", "the same of each model alone")),
    Claim("B1-b-theta", ("b1-b",), "Sec. 5, end", "theta0 + theta > 0 at all times in model B1",
          rules.tilted_up, ample=TILT, by_load=True),
    Claim("B2-b-theta-line", ("b2-b",), "Sec. 5, end",
          "theta0 + theta > 0 at all times in model B2",
          rules.tilted_up, ample=TILT, by_load=True, conflicts=("B2-b-tilt",)),
    Claim("B1-b-trail-only", ("b1-b",), "Sec. 5, end",
          "in model B1 contact is lost at the trailing edge only, if at all",
          rules.trailing_edge_alone,
          follows=_implied(
              "B1-b-states", "the leading edge touches in states 1 and 3, and no other occurs")),
    Claim("B2-b-trail-only", ("b2-b",), "Sec. 5, end",
          "in model B2 contact is lost at the trailing edge only, if at all",
          rules.trailing_edge_alone,
          follows=_implied(
              "B2-b-theta-line B2-only-c",
              "the leading edge is the lower one, and the surfaces never separate")),
    Claim("B2-b-twice", ("b2-a", "b2-b"), "Sec. 5",
          "Rn of b is almost twice that of a (read as their means, 1.7 to 2)",
          rules.mean_almost_doubles, ample=0.1),
    Claim("B2-c-loss", ("b2-c",), "Fig. 11(a)", "the surfaces separate for some time (Rn = 0)",
          rules.surfaces_separate, ample=0.02,
          follows=_implied("B2-only-c", "separation in case c is a part of it")),
    Claim("B2-c-hammer", ("b2-c",), "Fig. 11(b)",
          "blows fall on both edges in turn, repeatedly, and contact is lost in between",
          rules.hammers, ample=0.1,
          follows=_implied("B12-c-severe", "hammering of B2 in case c is a part of it")),
    Claim("B2-d-contact", ("b2-d",), "Fig. 12(a)", "contact is never lost (Rn > 0)",
          rules.positive("first", "F_n"),
          follows=_implied("B2-only-c", "no separation in case d is a part of it")),
    Claim("B2-d-trailing", ("b2-d",), "Fig. 12(b)", "0 < delta < w at all times",
          rules.within_trailing_half, ample=0.01),
    Claim("B2-only-c", _ALL_B2, "Sec. 5, end", "the surfaces separate in case c only",
          rules.only_c_separates, ample=0.02),
    Claim("B3-singular", ("b3",), "Sec. 6", "the stiffness matrix of Eq. (21) is singular",
          rules.singular, ample=0.1,
          follows=Consequence(
              "identity", "K is a sum of two matrices of rank one: det K = 0 for all numbers")),
    Claim("B3-small-region", ("b3",), "Sec. 6-7, Fig. 13",
          "(23a, b) hold on a small part (under a quarter) of the map",
          rules.small_region, ample=0.05),
    Claim("B3-none", (*_ALL_B1, *_ALL_B2), "Sec. 7",
          "no simulated case settles into zero acceleration", rules.none_settles, ample=0.1,
          follows=Consequence(
              "almost sure",
              "without damping phase volume is conserved, so that almost no motion comes to rest")),
    Claim("B2-b-raised", ("b2-b",), "Sec. 5",
          "friction raises the reaction at rest", rules.friction_raises,
          follows=Consequence(
              "identity",
              "at rest in full contact, with springs that turn little, it is multiplied by "
              "(1 + 4 r) / (1 + 4 r - 6 r mu h/w), r = k2/k_c, above 1 up to divergence")),
    Claim("B12-c-severe", (*_ALL_B1, *_ALL_B2), "Sec. 5, end",
          "the pad hammers with both models in case c and in no other",
          rules.only_c_hammers, ample=0.1),
    Claim("B12-more-loss", (*_ALL_B1, *_ALL_B2), "Sec. 5, end",
          "in more cases of B1 than of B2 an edge loses its contact force", rules.more_loss_in_b1,
          follows=_implied(
              "B1-all-separate B2-only-c",
              "in all four cases of B1, in case c of B2 alone")),
    Claim("B12-sliding", (*_ALL_B1, *_ALL_B2), "Sec. 5",
          "no sprag-slip: sliding never stops (by our measure, x_dot < V)",
          rules.sliding_lasts,
          follows=Consequence(
              "free", "V is not printed, and with V large enough sliding never stops")),
)
# fmt: on
