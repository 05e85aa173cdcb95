"""Stability over (alpha1, alpha2), or over any two parameters of a scene.

B3 maps linearise about the origin. B1 and B2 maps find the sliding equilibrium of every point
first, by continuation from mu = 0 of all points together.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from squeal.analysis.points import Names, normalised, points_at
from squeal.analysis.sensitivity import parameters
from squeal.equilibrium.admissible import LIMITED
from squeal.io.scene import Scene, takes_scene
from squeal.linear import VERDICTS, damped_verdicts, sum_verdicts, undamped_verdicts
from squeal.model.equations import PadModel
from squeal.model.linear import about_origin, spring_directions
from squeal.model.pad import PARAMETERS, Pad
from squeal.numerics.outline import Codes, Outline, outline
from squeal.schema.arguments import Instance, Several, takes
from squeal.schema.place import Place
from squeal.schema.values import Number, Whole

BEYOND_FOLD = len(VERDICTS)  # the branch from mu = 0 turns back before the pad's mu
NAMES = (*VERDICTS, "beyond a fold")
COUNT = Whole(1, 100_000)
PART = "two whole numbers, the first below the second, from 0 to n"


@dataclass(frozen=True)
class Axis:
    """One parameter of a map: n values at the middles of n equal cells between low and high.

    log: the cells are equal in the logarithm; part: only the values with numbers from the first to
    below the second, for a map in parts. Raises InputError for an unknown parameter or for values
    that it may not take.
    """

    name: str
    low: float
    high: float
    n: int
    log: bool = False
    part: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        at = Place("Axis")
        check_axis(self.name, self.low, self.high, self.n, at, self.log)
        if self.part is not None:
            first, stop = Several(Whole(0, self.n), PART, 2).read(self.part, at / "part")
            if not first < stop:
                raise (at / "part").must_be(self.part, PART)

    @property
    def values(self) -> np.ndarray:
        """The n values, or those of the part."""
        numbers = np.arange(*(self.part or (0, self.n)))
        low, high = self.ends
        return np.asarray(self.uneven(low + (high - low) * (numbers + 0.5) / self.n))

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends as the cells are equal in them."""
        return self.even(self.low), self.even(self.high)

    def at(self, share: Any) -> Any:
        """Values at shares of the way from low to high."""
        low, high = self.ends
        return self.uneven(low + (high - low) * share)

    def share(self, value: Any) -> Any:
        """What `at` makes values of."""
        low, high = self.ends
        return (self.even(value) - low) / (high - low)

    def even(self, value: Any) -> Any:
        """Values as the cells are equal in them: themselves or their logarithms."""
        return np.log10(value) if self.log else value

    def uneven(self, value: Any) -> Any:
        """What `even` was made from."""
        return 10.0**value if self.log else value


def check_axis(name: str, low: float, high: float, n: int, at: Place, log: bool = False) -> None:
    """Refuse an axis that no pad could take; `at` tells messages where it stands."""
    if name not in PARAMETERS:
        raise at.must_be(name, f"one of {', '.join(PARAMETERS)}")
    Number().check(low, at / "low")
    Number().check(high, at / "high")
    COUNT.read(n, at / "n")
    if not low < high:
        raise at.must_be(f"{low:g} to {high:g}", "a range with low < high")
    if log and not low > 0.0:
        raise at.must_be(f"{low:g} to {high:g}", "a range above 0 on a logarithmic axis")
    half = (high / low) ** (0.5 / n) if log else (high - low) / 2 / n
    for end in (low * half, high / half) if log else (low + half, high - half):
        PARAMETERS[name].kind.check(end, at)


def angle_axes(n: int) -> tuple[Axis, Axis]:
    """The axes of Fig. 13: alpha1 and alpha2 between 0 and pi."""
    return Axis("alpha1", 0.0, math.pi, n), Axis("alpha2", 0.0, math.pi, n)


@dataclass(frozen=True)
class StabilityMap:
    """codes (n1, n2) are indices into `NAMES`; the first axis runs along the rows.

    beyond (3, n1, n2) says which of the limits on tilt, travel and reaction an equilibrium exceeds;
    `outline` holds the boundaries between the codes, if the map was asked to trace them.
    """

    axes: tuple[Axis, Axis]
    codes: np.ndarray = field(repr=False)
    beyond: np.ndarray = field(repr=False)
    outline: Outline | None = field(default=None, repr=False)

    @property
    def admissible(self) -> np.ndarray:
        """Where there is an equilibrium that the model means (B3: everywhere), shape (n1, n2)."""
        return (self.codes != BEYOND_FOLD) & ~self.beyond.any(axis=0)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each reason why some of the points are not admissible."""
        parts = [(self.codes == BEYOND_FOLD, "lie beyond a fold or the end of the branch")]
        parts += [
            (part, f"exceed the limit of {name}")
            for part, name in zip(self.beyond, LIMITED, strict=True)
        ]
        told = (f"{100 * p.mean():.3g} % of the points {words}" for p, words in parts if p.any())
        return tuple(told)

    @property
    def share(self) -> dict[str, float]:
        """Share of the area for each verdict that occurs, and for those that could."""
        counts = np.bincount(self.codes.ravel(), minlength=len(NAMES))
        return {name: float(c) / self.codes.size for name, c in zip(NAMES, counts, strict=True)}


def _angle_rows(model: PadModel, axes: tuple[Axis, Axis]) -> np.ndarray:
    """Codes of a B3 map over the angles: K is the contact's plus one rank-one term a spring."""
    pad = model.pad
    a1, a2 = spring_directions(pad, (axes[0].values, axes[1].values))
    unit = 1.0 / np.sqrt([pad.m, pad.m, pad.I])  # makes the mass matrix one
    u1, u2 = (unit[:, None] * np.sqrt(k) * a for k, a in ((pad.k1, a1), (pad.k2, a2)))
    contact = unit[:, None] * about_origin(model.replace(k1=0.0, k2=0.0)).K * unit
    return sum_verdicts(contact[:, :, None] + np.einsum("in,jn->ijn", u2, u2), u1)


def _verdicts(pad: Pad, K: np.ndarray, B: np.ndarray | None) -> np.ndarray:
    """Codes of n pads with K (3, 3, n), and B (n, 3, 3) as `Points` holds it."""
    mass = (pad.m, pad.m, pad.I)
    if B is None:
        return undamped_verdicts([K[i, j] / mass[i] for i in range(3) for j in range(3)])
    A, damped = normalised(pad, K), B.any(axis=(1, 2))
    codes = undamped_verdicts(list(A.reshape(-1, 9).T))
    codes[damped] = damped_verdicts(A[damped], B[damped])
    return codes


class Found(NamedTuple):
    """What is found at n points of a map, arrays over them.

    `codes` are indices into `NAMES`, `contact` into the model's states (no contact beyond a
    fold), `beyond` (3, n) says which limits of `AdmissibleLimits` the equilibrium exceeds. Except
    for B3 `places` (4, n) hold the equilibrium in the map's own units and the sign of the
    determinant of its balance; they let other points start from there.
    """

    codes: np.ndarray
    contact: np.ndarray
    beyond: np.ndarray
    places: np.ndarray | None = None


def codes_at(
    scene: Scene, names: Names, values: np.ndarray, near: np.ndarray | None = None
) -> Found:
    """Verdicts with some parameters of the scene replaced, see `points_at`."""
    at = points_at(scene, names, values, near)
    codes = np.full(len(at.there), BEYOND_FOLD, dtype=np.int8)
    codes[at.there] = _verdicts(at.pads, at.K, at.B)
    states = scene.pad_model.states
    contact = np.full(len(at.there), 1, dtype=np.int8)
    for i, state in enumerate(states):
        here = at.there & np.all(at.touching == np.array(state)[:, None], axis=0)
        contact[here] = i
    beyond = np.zeros((3, len(at.there)), dtype=bool)
    beyond[:, at.there] = at.beyond
    return Found(codes, contact, beyond, at.places)


def on_grid(scene: Scene, names: tuple[str, str], x: np.ndarray, y: np.ndarray) -> Found:
    """`codes_at` on the grid of x (n1,) and y (n2,), without places: each array (..., n1, n2)."""
    codes, contact = (np.empty((len(x), len(y)), dtype=np.int8) for _ in range(2))
    beyond = np.zeros((3, len(x), len(y)), dtype=bool)
    rows = max(1, 20_000 // len(y))
    for start in range(0, len(x), rows):
        grid = np.meshgrid(x[start : start + rows], y, indexing="ij")
        found = codes_at(scene, names, np.array([values.ravel() for values in grid]))
        for whole, part in zip((codes, contact), found[:2], strict=True):
            whole[start : start + rows] = part.reshape(-1, len(y))
        beyond[:, start : start + rows] = found.beyond.reshape(3, -1, len(y))
    return Found(codes, contact, beyond)


def check_names(scene: Scene, names: Sequence[str], at: Place) -> None:
    """Refuse to map what the scene does not use, or one parameter twice. Raises InputError."""
    allowed = parameters(scene.pad_model)
    for name in names:
        if name not in allowed:
            raise at.must_be(name, f"a parameter of the scene: {', '.join(allowed)}")
    if len(set(names)) < len(names):
        raise at.refuse(f"{names[-1]} is the first parameter too; take another one")


AXES = Several(Instance(Axis, "an Axis"), "two of Axis, such as angle_axes(200) gives", 2)


@takes_scene
@takes(axes=AXES)
def stability_map(scene: Scene, axes: tuple[Axis, Axis], traced: bool = False) -> StabilityMap:
    """Verdict over two parameters of a scene's pad; the mapped ones replace the scene's.

    `traced` finds the boundaries between the points by bisection, for drawing. Raises InputError
    for a parameter that the scene does not use, or the same one twice.
    """
    names = (axes[0].name, axes[1].name)
    check_names(scene, names, Place("Axis") / "name")
    x, y = axes[0].values, axes[1].values
    if scene.pad_model.linear and names == ("alpha1", "alpha2") and scene.damping is None:
        codes = _angle_rows(scene.pad_model, axes)
        beyond = np.zeros((3, *codes.shape), dtype=bool)
    else:
        found = on_grid(scene, names, x, y)
        codes, beyond = found.codes, found.beyond
    return StabilityMap(axes, codes, beyond, traced_map(scene, axes, codes) if traced else None)


def traced_map(
    scene: Scene,
    axes: tuple[Axis, Axis],
    codes: np.ndarray,
    told: Callable[[Found, np.ndarray], np.ndarray] = lambda found, _: found.codes,
) -> Outline:
    """The outline of codes (n1, n2) on the points of a map.

    `told` makes codes of what is found at points (2, n), for maps of more than the verdict.
    """
    names = (axes[0].name, axes[1].name)

    def plain(points: np.ndarray) -> np.ndarray:
        return np.array([a.uneven(row) for a, row in zip(axes, points, strict=True)])

    def at(points: np.ndarray) -> np.ndarray:
        points = plain(points)
        return told(codes_at(scene, names, points), points)

    def near(low: np.ndarray, high: np.ndarray) -> Codes:
        one, other = (codes_at(scene, names, plain(end)) for end in (low, high))
        assert one.places is not None
        assert other.places is not None
        places = np.where(one.codes == BEYOND_FOLD, other.places, one.places)

        def close(points: np.ndarray) -> np.ndarray:
            points = plain(points)
            found = codes_at(scene, names, points, places)
            here = found.codes != BEYOND_FOLD
            assert found.places is not None
            places[:, here] = found.places[:, here]  # ever closer to where the branch ends
            return told(found, points)

        return close

    x, y = (a.even(a.values) for a in axes)
    quick = near if not scene.pad_model.linear else None
    found = outline((axes[0].ends, axes[1].ends), x, y, codes, at, quick)
    corners = (plain(np.moveaxis(part, -1, 0)) for part in (found.segments, found.polygons))
    segments, polygons = (np.moveaxis(part, 0, -1) for part in corners)
    return dataclasses.replace(found, segments=segments, polygons=polygons)
