"""What the start decides: the kind of motion over the height and tilt of the start."""

from squeal.article.records import Missing, Record, Result, Share

KINDS = (
    *("no loss", "loss at an edge", "separation", "alternate losses", "never in full contact"),
    "model ends",
)
"""What becomes of a motion after its first full contact, each beyond those before it.

No contact is lost; that of an edge is; both are at once; they are lost in turn, with `TURNS`
changes of the edge at least; none is lost, but an edge is off all the time; the pad turns past 90
degrees.
"""
TURNS = 4
TOLERANCE = 1e-6
"""Of the motions, of which the kind alone is asked."""


class Map(Record):
    """Kinds of motion until one time.

    windows: how many times the scene's time; rows: a row a tilt, from the least, a digit a height:
    index into `KINDS`; own: of the scene's own start; starts: of the map but the equilibrium,
    which would stay but for rounding; share: of these, by kind.
    """

    windows: int
    rows: tuple[str, ...]
    own: int
    starts: int
    share: dict[str, Share]


class Swinging(Record):
    """Of the starts of the first map, how many hammer by the way of delta over its time, and of
    these how many never leave full contact after first contact, and how many never separate."""

    starts: int
    hammer: int
    full: int
    touching: int


class SceneStarts(Record):
    """Maps of a scene, whose starts are at rest about its equilibrium.

    height: of the scene's own start over the equilibrium (m), 1 on the axis; lever: what a tilt of
    one on the axis lifts an edge by (m), the static compression of the contact; swinging: None with
    model B1.
    """

    height: float
    lever: float
    maps: tuple[Map, ...]
    swinging: Swinging | None = None


class Starts(Result):
    """By name of the scene; reach: how far the axes go from the equilibrium to both sides."""

    scenes: dict[str, SceneStarts | Missing]
    reach: float
