"""Maps over two parameters of a scene: verdicts, critical friction and growth.

B3 maps linearise about the origin. The others find the sliding equilibrium of every point first, on
the branch from mu = 0 that a query follows; see `squeal.analysis.stack`.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from squeal.analysis.answers import Axis
from squeal.analysis.pads import MU_MAX
from squeal.analysis.stack import Names, PadStack, Places, parameters, verdicts
from squeal.equilibrium.statics import LIMITS
from squeal.errors import InputError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import VERDICTS, sum_verdicts
from squeal.model.equations import PadModel, about_origin, spring_directions
from squeal.model.pad import PARAMETERS
from squeal.schema.values import Instance, Place, Several, takes

BEYOND_FOLD = len(VERDICTS)  # the branch from mu = 0 turns back before the pad's mu
UNKNOWN = BEYOND_FOLD + 1  # whether it does could not be decided
NAMES = (*VERDICTS, "beyond a fold", "unknown")
QUANTITIES = {
    "critical-friction": ("critical friction", "1"),
    "growth": ("growth rate of the most unstable mode", "1/s"),
    "frequency": ("frequency of the most unstable mode", "Hz"),
}
"""What a field may show: its name in words, and its unit."""
FIELD_POINTS = 2_000  # that are followed together


def angle_axes(n: int) -> tuple[Axis, Axis]:
    """The axes of Fig. 13: alpha1 and alpha2 between 0 and pi."""
    return Axis("alpha1", 0.0, math.pi, n), Axis("alpha2", 0.0, math.pi, n)


@dataclass(frozen=True)
class StabilityMap:
    """codes (n1, n2) are indices into `NAMES`; the first axis runs along the rows.

    beyond (3, n1, n2) says which of the limits on tilt, travel and reaction an equilibrium exceeds.
    """

    axes: tuple[Axis, Axis]
    codes: np.ndarray = field(repr=False)
    beyond: np.ndarray = field(repr=False)

    @property
    def admissible(self) -> np.ndarray:
        """Where there is an equilibrium that the model means (B3: everywhere), shape (n1, n2)."""
        return (self.codes < BEYOND_FOLD) & ~self.beyond.any(axis=0)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each reason why some of the points are not admissible."""
        parts = [
            (self.codes == BEYOND_FOLD, "lie beyond a fold or the end of the branch"),
            (self.codes == UNKNOWN, "could not be decided"),
        ]
        parts += [
            (part, f"exceed the limit of {name}")
            for part, name in zip(self.beyond, LIMITS._fields, strict=True)
        ]
        return tuple(
            f"{100 * part.mean():.3g} % of the points {words}"
            for part, words in parts
            if part.any()
        )

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


class PointVerdicts(NamedTuple):
    """Verdicts and equilibria at n points of a map, arrays over them.

    `codes` are indices into `NAMES`, `contact` into the model's states (no contact beyond a
    fold), `beyond` (3, n) says which limits of `AdmissibleLimits` the equilibrium exceeds, `places`
    (4, n) is the equilibrium in the units of the scene's own pad.
    """

    codes: np.ndarray
    contact: np.ndarray
    beyond: np.ndarray
    places: np.ndarray


def codes_at(
    scene: Scene, names: Names, values: np.ndarray, places: Places | None = None
) -> PointVerdicts:
    """Verdicts with some parameters of the scene replaced by the values (len(names), n).

    They are those of the equilibria on the branches from mu = 0 (B3: about the origin), or of
    others, `places`. Modal damping ratios refer to the modes without friction of each point's own
    pad; raises ComputationError where such a mode is unstable.
    """
    stack = PadStack.of(scene, names, values)
    unknown = np.zeros(stack.n, dtype=bool)
    if places is None:
        places, unknown = stack.at_mu()
    codes = np.where(unknown, UNKNOWN, BEYOND_FOLD).astype(np.int8)
    here = np.flatnonzero(places.there)
    at = Places(*(part[..., here] for part in places))
    codes[here] = verdicts(*stack.matrices(here, at.z, at.touching))
    contact = np.full(stack.n, 1, dtype=np.int8)
    for i, state in enumerate(scene.pad_model.states):
        own = places.there & np.all(places.touching == np.array(state)[:, None], axis=0)
        contact[own] = i
    beyond = np.zeros((3, stack.n), dtype=bool)
    beyond[:, here] = stack.beyond(here, at)
    return PointVerdicts(codes, contact, beyond, places.z)


def on_grid(scene: Scene, names: tuple[str, str], x: np.ndarray, y: np.ndarray) -> PointVerdicts:
    """`codes_at` on the grid of x (n1,) and y (n2,): each array (..., n1, n2)."""
    rows, parts = max(1, 20_000 // len(y)), []
    for start in range(0, len(x), rows):
        grid = np.meshgrid(x[start : start + rows], y, indexing="ij")
        points = codes_at(scene, names, np.array([values.ravel() for values in grid]))
        parts.append([part.reshape(*part.shape[:-1], -1, len(y)) for part in points])
    return PointVerdicts(*(np.concatenate(part, axis=-2) for part in zip(*parts, strict=True)))


def check_axes(scene: Scene, axes: tuple[Axis, Axis]) -> None:
    """Refuse to map what the scene does not use, values that a parameter may not take, or one
    parameter twice. Raises InputError."""
    allowed, at = parameters(scene.pad_model), Place("Axis")
    for axis in axes:
        if axis.name not in allowed:
            used = f"a parameter of the scene: {', '.join(allowed)}"
            raise (at / "name").must_be(axis.name, used)
        for end in axis.values[[0, -1]].tolist():
            PARAMETERS[axis.name].kind.check(end, at / axis.name)
    if axes[0].name == axes[1].name:
        raise (at / "name").refuse(f"{axes[1].name} is the first parameter too; take another one")


AXES = Several(Instance(Axis, "an Axis"), "two of Axis, such as angle_axes(200) gives", 2)


@takes_scene
@takes(axes=AXES)
def stability_map(scene: Scene, axes: tuple[Axis, Axis]) -> StabilityMap:
    """Verdict over two parameters of a scene's pad; the mapped ones replace the scene's.

    Raises InputError for a parameter that the scene does not use, or the same one twice.
    """
    names = (axes[0].name, axes[1].name)
    check_axes(scene, axes)
    x, y = axes[0].values, axes[1].values
    if scene.pad_model.linear and names == ("alpha1", "alpha2") and scene.damping is None:
        codes = _angle_rows(scene.pad_model, axes)
        beyond = np.zeros((3, *codes.shape), dtype=bool)
    else:
        points = on_grid(scene, names, x, y)
        codes, beyond = points.codes, points.beyond
    return StabilityMap(axes, codes, beyond)


@dataclass(frozen=True, eq=False)
class Field:
    """A quantity over two parameters; values (n1, n2), NaN where there is none.

    There is no critical friction where stability lasts up to mu_max, no growth rate where there
    is no equilibrium, and no frequency where nothing grows. unknown (n1, n2): where the value could
    not be decided, NaN too.
    """

    quantity: str
    axes: tuple[Axis, Axis]
    values: np.ndarray = field(repr=False)
    unknown: np.ndarray = field(repr=False)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence if some values could not be decided."""
        share = 100 * self.unknown.mean()
        name, _ = QUANTITIES[self.quantity]
        return (f"{name} could not be decided at {share:.3g} % of the points",) if share else ()

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return QUANTITIES[self.quantity][1]


@takes_scene
@takes(axes=AXES, mu_max=MU_MAX)
def field_of(scene: Scene, axes: tuple[Axis, Axis], quantity: str, mu_max: float = 2.0) -> Field:
    """One of `QUANTITIES` over two parameters, which replace the scene's.

    Growth and frequency are taken at the scene's mu (or that of the axis), the critical friction
    is the first loss of stability, or of the equilibrium, on the way from mu = 0 up to mu_max.
    Raises InputError for another quantity, and for a critical friction over mu itself.
    """
    if quantity not in QUANTITIES:
        raise InputError(
            f"quantity: {quantity} is not allowed; it must be one of {', '.join(QUANTITIES)}"
        )
    check_axes(scene, axes)
    names = (axes[0].name, axes[1].name)
    if quantity == "critical-friction" and "mu" in names:
        raise InputError(
            "quantity: critical-friction is not allowed over mu; take another parameter, or the "
            "map of verdicts"
        )
    grid = np.meshgrid(axes[0].values, axes[1].values, indexing="ij")
    values = np.array([part.ravel() for part in grid])
    parts = [
        _quantity(
            PadStack.of(scene, names, values[:, start : start + FIELD_POINTS]), quantity, mu_max
        )
        for start in range(0, values.shape[1], FIELD_POINTS)
    ]
    each = (np.concatenate(part).reshape(grid[0].shape) for part in zip(*parts, strict=True))
    return Field(quantity, axes, *each)


def _quantity(stack: PadStack, quantity: str, mu_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Values (n,) of a quantity, and where they are unknown."""
    if quantity == "critical-friction":
        lost = stack.first_losses(mu_max)
        return lost.mu, lost.unknown
    fastest, unknown = stack.fastest()
    if quantity == "growth":
        return fastest.real, unknown
    grows = fastest.real > 0.0
    return np.where(grows, np.abs(fastest.imag) / (2 * math.pi), np.nan), unknown
