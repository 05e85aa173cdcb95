"""Maps over two parameters of a scene: verdicts, critical friction, growth, and the curves on which
stability is lost.

B3 maps linearise about the origin. The others find the sliding equilibrium of every point first, on
the branch from mu = 0 that a query follows; see `squeal.analysis.stack`. The curves cross the lines
between neighbouring points of which one is quiet and the other is not. Each crossing is located by
halving that line with the verdicts of the map; contourpy joins those on the sides of one square.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.answers import led
from squeal.analysis.stack import QUIET, Names, PadStack, parameters, verdicts
from squeal.equilibrium.statics import LIMITS, excursion
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Table, in_order, picked, plain, unit_word
from squeal.linear import VERDICTS, sum_verdicts
from squeal.model.equations import PadModel, about_origin, spring_directions
from squeal.model.pad import PARAMETERS
from squeal.schema import Number, Place, Whole

BEYOND_FOLD = len(VERDICTS)  # the branch from mu = 0 turns back before the pad's mu
UNKNOWN = BEYOND_FOLD + 1  # whether it does could not be decided
NAMES = (*VERDICTS, "beyond a fold", "unknown")
QUANTITIES = {
    "critical-friction": ("critical friction", "1"),
    "growth": ("growth rate of the most unstable mode", "1/s"),
    "frequency": ("frequency of the most unstable mode", "Hz"),
}
"""What may stand beside the verdicts: its name in words, and its unit."""
QUANTITY_POINTS = 2_000  # that are followed together
HIGH = 2.0  # up to which critical frictions are searched
HALVINGS = 40  # of the distance of two neighbouring points of the map


@dataclass(frozen=True)
class Axis:
    """One parameter of a map: n values at the middles of n equal cells between low and high.

    log: the cells are equal in the logarithm. Raises InputError for an empty range.
    """

    name: str
    low: float
    high: float
    n: int
    log: bool = False

    def __post_init__(self) -> None:
        at = Place("Axis", self.name)
        Whole(1, 100_000).read(self.n, at / "n")
        Number().check(self.low, at, "low")
        Number().check(self.high, at, "high")
        if not self.low < self.high or (self.log and not self.low > 0.0):
            allowed = "a range with low < high" + (", above 0 on a logarithmic axis" * self.log)
            raise at.must_be(f"{self.low:g} to {self.high:g}", allowed)

    @property
    def values(self) -> NDArray[np.float64]:
        """The n values."""
        return np.asarray(self.at((np.arange(self.n) + 0.5) / self.n))

    def at(self, share: Any) -> Any:
        """Values at shares of the way from low to high."""
        if self.log:
            low, high = np.log10(self.low), np.log10(self.high)
            return 10.0 ** (low + (high - low) * share)
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, eq=False, repr=False)
class Map(Answer):
    """The verdict over two parameters.

    codes (n1, n2): indices into `verdicts`; quantity: name, unit and values (n1, n2) of a number
    beside them; admissible (n1, n2): where a pad has an equilibrium that the model means.
    """

    name: str
    axes: tuple[Axis, Axis]
    units: tuple[str, str]
    verdicts: tuple[str, ...]
    codes: NDArray[np.int8]
    quantity: tuple[str, str, NDArray[np.float64]] | None = None
    admissible: NDArray[np.bool_] | None = None
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    source: Any = None

    @property
    def share(self) -> dict[str, float]:
        """Share of the area for each verdict."""
        counts = np.bincount(self.codes.ravel(), minlength=len(self.verdicts))
        pairs = zip(self.verdicts, counts.tolist(), strict=True)
        return {name: count / self.codes.size for name, count in pairs}

    def table(self) -> Table:
        grid = np.meshgrid(*(axis.values for axis in self.axes), indexing="ij")
        each = [("verdict", "", np.array(self.verdicts)[self.codes])]
        each += [] if self.quantity is None else [self.quantity]
        each += [] if self.admissible is None else [("admissible", "", 1 * self.admissible)]
        names = (led(axis.name, [name for name, *_ in each]) for axis in self.axes)
        each[:0] = zip(names, self.units, grid, strict=True)
        rows = zip(*(part.ravel().tolist() for *_, part in each), strict=True)
        return Table(in_order(head[:2] for head in each), list(rows))

    def parts(self) -> Sequence[str | Table]:
        (a, b), shape = self.axes, self.codes.shape
        title = f"share of the area: {a.name} x {b.name}, {shape[0]} x {shape[1]} points"
        share = Column("share, %", value=lambda pair: f"{100 * pair[1]:.3f}")
        shares = (Column("verdict", value=itemgetter(0)), share)
        return [Table(shares, list(self.share.items()), title), *self.notes]

    def curves(self) -> Table:
        """A row for each point of each curve on which stability is lost."""
        rows = [
            (k, *point, curve["kind"], hertz)
            for k, curve in enumerate(self.details["threshold_curve"], 1)
            for point, hertz in zip(curve["points"], curve["frequency_hz"], strict=True)
        ]
        names = ["curve", *(axis.name for axis in self.axes), "kind", "frequency_hz"]
        return Table(in_order(zip(names, ["", *self.units, "", ""], strict=True)), rows)

    def to_dict(self) -> dict[str, Any]:
        axes = [
            picked(axis, "name low high") | {"scale": "log" if axis.log else "linear"}
            for axis in self.axes
        ]
        answer = {"share": self.share, "n": int(self.codes.shape[0]), "axes": axes}
        if self.admissible is not None:
            answer["admissible_share"] = float(self.admissible.mean())
        if self.quantity is not None:
            name, unit, numbers = self.quantity
            rows = [[plain(value) for value in row] for row in numbers.tolist()]
            answer |= {"quantity": name, "unit": unit, "values": rows}
        return answer | picked(self, "details")["details"]


def angle_axes(n: int) -> tuple[Axis, Axis]:
    """The axes of Fig. 13: alpha1 and alpha2 between 0 and pi."""
    return Axis("alpha1", 0.0, math.pi, n), Axis("alpha2", 0.0, math.pi, n)


class PointVerdicts(NamedTuple):
    """Verdicts and equilibria at n points of a map, arrays over them.

    `codes` are indices into `NAMES`, `contact` into the model's states (no contact beyond a
    fold), `beyond` (3, n) says which limits of `Excursion` the equilibrium exceeds.
    """

    codes: np.ndarray
    contact: np.ndarray
    beyond: np.ndarray


def codes_at(scene: Scene, names: Names, values: np.ndarray) -> PointVerdicts:
    """Verdicts with some parameters of the scene replaced by the values (len(names), n).

    They are those of the equilibria on the branches from mu = 0 (B3: about the origin). Modal
    damping ratios refer to the modes without friction of each point's own pad; raises
    ComputationError where such a mode is unstable.
    """
    stack = PadStack.of(scene, names, values)
    places, unknown = stack.at_mu()
    codes = np.where(unknown, UNKNOWN, BEYOND_FOLD).astype(np.int8)
    here = np.flatnonzero(places.exists)
    at = places.some(here)
    codes[here] = verdicts(*stack.matrices(here, at))
    contact = np.full(stack.n, 1, dtype=np.int8)
    for i, state in enumerate(scene.pad_model.states):
        own = places.exists & np.all(places.touching == np.array(state)[:, None], axis=0)
        contact[own] = i
    beyond = np.zeros((3, stack.n), dtype=bool)
    if not stack.linear:
        with np.errstate(all="ignore"):
            far = excursion(stack.statics.pick(here), at.z, at.touching)
        beyond[:, here] = far.beyond()
    return PointVerdicts(codes, contact, beyond)


def on_grid(scene: Scene, names: tuple[str, str], x: np.ndarray, y: np.ndarray) -> PointVerdicts:
    """`codes_at` on the grid of x (n1,) and y (n2,): each array (..., n1, n2)."""
    rows, parts = max(1, 20_000 // len(y)), []
    for start in range(0, len(x), rows):
        grid = np.meshgrid(x[start : start + rows], y, indexing="ij")
        points = codes_at(scene, names, np.array([values.ravel() for values in grid]))
        parts.append([part.reshape(*part.shape[:-1], -1, len(y)) for part in points])
    return PointVerdicts(*(np.concatenate(part, axis=-2) for part in zip(*parts, strict=True)))


def _angle_codes(model: PadModel, axes: tuple[Axis, Axis]) -> np.ndarray:
    """Codes of a B3 map over the angles: K is the contact's plus one rank-one term a spring."""
    pad = model.pad
    a1, a2 = spring_directions(pad, (axes[0].values, axes[1].values))
    unit = 1.0 / np.sqrt([pad.m, pad.m, pad.I])  # makes the mass matrix one
    u1, u2 = (unit[:, None] * np.sqrt(k) * a for k, a in ((pad.k1, a1), (pad.k2, a2)))
    contact = unit[:, None] * about_origin(model.replace(k1=0.0, k2=0.0)).K * unit
    return sum_verdicts(contact[:, :, None] + np.einsum("in,jn->ijn", u2, u2), u1)


def _check(scene: Scene, axes: tuple[Axis, Axis], quantity: str | None) -> None:
    """Raises InputError for what the scene does not use, values that a parameter may not take, one
    parameter twice, and a quantity over itself."""
    allowed, at, names = parameters(scene.pad_model), Place("Axis"), [axis.name for axis in axes]
    for axis in axes:
        if axis.name not in allowed:
            used = f"a parameter of the scene: {', '.join(allowed)}"
            raise (at / "name").must_be(axis.name, used)
        for end in axis.values[[0, -1]].tolist():
            PARAMETERS[axis.name].kind.check(end, at, axis.name)
    if names[0] == names[1]:
        raise (at / "name").refuse(f"{names[1]} is the first parameter too; take another one")
    if quantity == "critical-friction" and "mu" in names:
        raise InputError(f"quantity: {quantity} is not allowed over mu; take another parameter")


def stability_map(
    scene: Scene,
    axes: tuple[Axis, Axis] | None = None,
    quantity: str | None = None,
    curves: bool = False,
) -> Map:
    """Verdict over two parameters of a scene's pad, which replace its own; left out, the angles.

    Beside it one of `QUANTITIES`, NaN where there is none or where it could not be decided, and the
    curves on which stability is lost. Growth and frequency are taken at the scene's mu (or that of
    the axis), the critical friction is the first loss of stability, or of the equilibrium, on the
    way from mu = 0 up to `HIGH`. Raises InputError.
    """
    axes = angle_axes(200) if axes is None else axes
    _check(scene, axes, quantity)
    names, linear = (axes[0].name, axes[1].name), scene.pad_model.linear
    if linear and names == ("alpha1", "alpha2") and scene.damping is None:
        codes = _angle_codes(scene.pad_model, axes)
        beyond = np.zeros((3, *codes.shape), dtype=bool)
    else:
        codes, _, beyond = on_grid(scene, names, axes[0].values, axes[1].values)
    admissible = (codes < BEYOND_FOLD) & ~beyond.any(axis=0)
    reasons = {
        "lie beyond a fold or the end of the branch": codes == BEYOND_FOLD,
        "could not be decided": codes == UNKNOWN,
    }
    reasons |= {f"exceed the limit of {n}": b for n, b in zip(LIMITS._fields, beyond, strict=True)}
    warnings = [f"{_share(part)} {words}" for words, part in reasons.items() if part.any()]
    details: dict[str, Any] = {"admissible_share": float(admissible.mean())}
    details["admissible"] = not warnings  # those of a quantity say nothing of equilibria
    if curves:
        details["threshold_curve"] = threshold_curves(scene, axes, codes)
    beside, notes = None, list[str]()
    if quantity is not None:
        words, unit = QUANTITIES[quantity]
        values, unknown = _quantity(scene, axes, quantity)
        beside, known = (quantity, unit_word(unit), values), values[np.isfinite(values)]
        span = f"{known.min():.6g} to {known.max():.6g} {beside[1]}" if known.size else "nowhere"
        notes.append(f"{words}: {span}")
        if unknown.any():
            warnings.append(f"{words} could not be decided at {_share(unknown)}")
    units = (unit_word(PARAMETERS[names[0]].unit), unit_word(PARAMETERS[names[1]].unit))
    if np.any(codes == QUIET[1]) and scene.damping is None:
        notes.append('marginal: nothing damps; try --set "damping.ratios=[0.02, 0.02, 0.02]"')
    parts = beside, None if linear else admissible, tuple(warnings), details, tuple(notes), (scene,)
    return Map(scene.model, axes, units, NAMES, codes, *parts)


def _share(part: np.ndarray) -> str:
    return f"{100 * part.mean():.3g} % of the points"


def _quantity(scene: Scene, axes: tuple[Axis, Axis], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Values (n1, n2) of a quantity, and where they are unknown."""
    grid = np.meshgrid(axes[0].values, axes[1].values, indexing="ij")
    points, values, unknown = np.reshape(grid, (2, -1)), [], []
    for start in range(0, points.shape[1], QUANTITY_POINTS):
        part = points[:, start : start + QUANTITY_POINTS]
        stack = PadStack.of(scene, (axes[0].name, axes[1].name), part)
        if name == "critical-friction":
            value, *_, hidden, _ = stack.first_losses(HIGH)
        else:
            fastest, hidden = stack.fastest()
            hertz = np.where(fastest.real > 0.0, np.abs(fastest.imag) / math.tau, np.nan)
            value = fastest.real if name == "growth" else hertz
        values.append(value)
        unknown.append(hidden)
    shape = grid[0].shape
    return np.concatenate(values).reshape(shape), np.concatenate(unknown).reshape(shape)


def threshold_curves(
    scene: Scene, axes: tuple[Axis, Axis], codes: np.ndarray
) -> list[dict[str, Any]]:
    """The curves between stable or marginal points of a map with `codes` (n1, n2) and the others.

    Of each its `points`, pairs of both parameters, its `kind`, what happens there, `frequency_hz`
    at each of them of the mode that starts to grow, 0 where none vibrates, and whether it is
    `closed`. They end beside points that are unknown, at the outermost points, and where something
    else happens.
    """
    calm, known = np.isin(codes, QUIET), codes != UNKNOWN
    if min(codes.shape) < 2 or len(np.unique(calm[known])) < 2:
        return []
    from contourpy import contour_generator  # a fifth of a query's time, which draws no curve

    field = np.ma.masked_array(1.0 * calm, ~known)
    traced: Any = contour_generator(z=field, corner_mask=False).lines(0.5)
    middle = np.concatenate(traced)[:, ::-1].T  # of a point and its neighbour along an axis
    below, above = np.floor(middle).astype(int), np.ceil(middle).astype(int)
    first, size = calm[tuple(below)], np.array(codes.shape)[:, None]
    quiet = (np.where(first, below, above) + 0.5) / size
    loud = (np.where(first, above, below) + 0.5) / size
    names = (axes[0].name, axes[1].name)

    def plain(shares: np.ndarray) -> np.ndarray:
        return np.array([axis.at(row) for axis, row in zip(axes, shares, strict=True)])

    for _ in range(HALVINGS):
        middle = (quiet + loud) / 2
        still = np.isin(codes_at(scene, names, plain(middle)).codes, QUIET)
        quiet[:, still], loud[:, ~still] = middle[:, still], middle[:, ~still]
    one, other = (codes_at(scene, names, plain(end)) for end in (quiet, loud))
    kinds = np.where(other.codes == VERDICTS.index("divergence"), "divergence", "flutter")
    kinds[one.contact != other.contact] = "contact"
    kinds[other.codes == BEYOND_FOLD] = "fold"
    points = plain(quiet)
    stack = PadStack.of(scene, names, points)
    hertz = stack.meeting(*stack.matrices(np.arange(stack.n), stack.at_mu()[0]))
    hertz[kinds != "flutter"] = 0.0
    curves = []
    stops = np.cumsum([len(segment) for segment in traced])
    for line in np.split(np.arange(points.shape[1]), stops[:-1]):
        cuts = np.flatnonzero(kinds[line][1:] != kinds[line][:-1]) + 1
        closed = np.array_equal(points[:, line[0]], points[:, line[-1]])
        if closed and cuts.size:  # begin where the kind changes
            line = np.roll(line[:-1], -cuts[0])
            cuts = np.flatnonzero(kinds[line][1:] != kinds[line][:-1]) + 1
        for part in np.split(line, cuts):
            if len(part) > 1:
                curve = {"kind": str(kinds[part[0]]), "closed": closed and not cuts.size}
                curve |= {
                    "points": points[:, part].T.tolist(),
                    "frequency_hz": hertz[part].tolist(),
                }
                curves.append(curve)
    return curves
