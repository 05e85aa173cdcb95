"""The map of Fig. 13 over its parameters, and the equilibria that lie off its branch."""

from typing import Annotated, Literal

from squeal.article.results.records import Record, Result

Curve = tuple[tuple[float, float], ...]
Where = Literal["inside", "on the edge", "outside"]
Share = Annotated[float, ".1%"]


class Span(Record):
    """Least and greatest share of the map over a range of pads."""

    low: Share
    high: Share


class Sweep(Record):
    """The map over one parameter, the others as in the scene.

    own: the scene's value; values: of the parameter; printed, signs: share of the map on which
    (23a, b) hold as printed and with signs followed; low, high: of printed, over all values of the
    other two; sparse: values at which equilibria of B2 are sought; reached, kept: share on which
    the branch from mu = 0 has one, and on which nothing grows about it; shapes: curves around the
    area of the printed conditions, by value.
    """

    own: float
    values: tuple[float, ...]
    printed: tuple[float, ...]
    signs: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    sparse: tuple[float, ...]
    reached: tuple[float, ...]
    kept: tuple[float, ...]
    shapes: dict[str, tuple[Curve, ...]]


class Member(Record):
    """Where a case lies in the map as printed.

    own: with the scene's parameters; inside, edge, outside: shares of all pads of the ranges.
    """

    alpha1: float
    alpha2: float
    own: Where
    inside: Share
    edge: Share
    outside: Share


class OffBranch(Record):
    """Equilibria where the branch from mu = 0 does not reach the scene's mu.

    points: of the grid, beyond: of them without the branch; found: of those with another
    equilibrium; kept: with one about which nothing grows; upright: that is tilted by less than
    `tilt` (rad). A search from many places may miss some.
    """

    points: int
    beyond: int
    found: int
    kept: int
    upright: int
    tilt: float


class Upright(Record):
    """Where an equilibrium is kept in full contact, as the article's sliding state is.

    pads: how many, over five parameters; low, high: least and greatest share of the map;
    small: on how many pads it is below `below`, which counts as small; small_at: of these by
    parameter and its values, each of which equally many pads have; cells: points of the grid of
    angles that a share rests on; near, near_others: how many of the small and of the others are
    within `margin` of the map of `below`, which a finer grid may turn; touching: shares with an
    equilibrium kept in any contact.
    """

    pads: int
    low: Share
    high: Share
    small: int
    below: Share
    small_at: dict[str, dict[str, int]]
    cells: int
    near: int
    near_others: int
    margin: float
    touching: Span


class MapRanges(Result):
    """By parameter (h/w, k2/k1, mu), and over all of them together.

    pads: how many combinations; printed, signs: spans of the shares; members: by case, on the edge
    if the conditions change within `near` (rad); flat: keys of the cases with K21 = 0 for all pads.
    """

    sweeps: dict[str, Sweep]
    pads: int
    printed: Span
    signs: Span
    members: dict[str, Member]
    near: float
    full: Upright
    flat: tuple[str, ...]
    off_branch: OffBranch
