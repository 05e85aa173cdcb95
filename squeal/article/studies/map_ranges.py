"""Fig. 13 over its parameters: how large the black area is, and where model B2 has equilibria."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from squeal.article.equations import bounds
from squeal.article.outline import outline
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.io.scene import Scene
from squeal.linear import VERDICTS
from squeal.model.contact import FULL, STATES
from squeal.model.pad import Pad
from squeal.queries.pads.maps import BEYOND_FOLD, angle_axes, verdicts_at

VALUES = {
    "h/w": np.linspace(0.1, 1.0, 10),
    "k2/k1": np.geomspace(0.25, 4.0, 9),
    "mu": np.linspace(0.1, 0.9, 9),
}
"""Flat to square pads, springs of like size, brake linings."""
SPREAD = {
    "h/w": (0.1, 0.5, 0.9),
    "k2/k1": (0.25, 1.0, 4.0),
    "mu": (0.1, 0.5, 0.9),
    "k_c/k1": (0.05, 0.4, 3.0),
    "preload": (0.0, 4.0, 8.0),
}
"""Flat to square pads, springs of unlike size, soft to stiff contact, and springs that press with
-y0 k1 over F_n."""
SHAPES = {"h/w": (0.1, 0.3, 1.0), "k2/k1": (0.25, 1.0, 4.0), "mu": (0.1, 0.4, 0.9)}
"""Values of each parameter at which the area of the printed conditions is outlined."""
CELLS = 60  # a side of the maps of all combinations
FINE = 80  # a side of the maps whose area is outlined
# a side of the maps of equilibria, and the same for many sets
COARSE = 16
COARSEST = 9
SPARSE = 5  # values of a parameter at which equilibria are searched
STABLE = [VERDICTS.index("stable"), VERDICTS.index("marginal")]

Curve = tuple[tuple[float, float], ...]


class Span(Record):
    """Least and greatest share of the map over a range of parameter sets."""

    low: float
    high: float


class Sweep(Record):
    """The map over one parameter, the others as in the scene.

    own: the scene's value; values: of the parameter; printed, complete: share of the map on which
    (23a, b) hold as printed, and the complete necessary conditions; low, high: of printed, over all
    values of the other two; sparse: values at which equilibria of B2 are searched; reached, stable:
    share on which the branch from mu = 0 has one, and on which no mode grows about it; shapes:
    curves around the area of the printed conditions, by value.
    """

    own: float
    values: tuple[float, ...]
    printed: tuple[float, ...]
    complete: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    sparse: tuple[float, ...]
    reached: tuple[float, ...]
    stable: tuple[float, ...]
    shapes: dict[str, tuple[Curve, ...]]


class Full(Span):
    """Shares of the map with a stable equilibrium in full contact, as the article's sliding state
    is, over so many parameter sets; touching: in any contact."""

    pads: int
    touching: Span


class MapRanges(Result):
    """By parameter (h/w, k2/k1, mu), and over all of them together.

    pads: how many combinations; printed, complete: spans of the shares.
    """

    sweeps: dict[str, Sweep]
    pads: int
    printed: Span
    complete: Span
    full: Full


def with_values(pad: Pad, h_over_w: Any, k2_over_k1: Any, mu: Any) -> Pad:
    """The pad with other h/w, k2/k1 (of the same sum) and mu; I grows as that of a rectangle.

    The values are numbers, or arrays (n,) for many pads.
    """
    h = h_over_w * pad.w
    inertia = pad.I * (pad.w**2 + h**2) / (pad.w**2 + pad.h**2)
    k1 = (pad.k1 + pad.k2) / (1.0 + k2_over_k1)
    return pad.replace(h=h, I=inertia, k1=k1, k2=k2_over_k1 * k1, mu=mu)


def _axes(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Axes of the map with one cell more along the second.

    No point then lies on a diagonal, where K21 = 0 if k1 = k2, so that the bounds are infinite.
    """
    return angle_axes(cells)[0].values, angle_axes(cells + 1)[1].values


def _angles(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Both spring angles at the points of the map."""
    a1, a2 = np.meshgrid(*_axes(cells), indexing="ij")
    return a1.ravel(), a2.ravel()


def _shares(pad: Pad) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the map on which both readings of (23a, b) hold, over all combinations of `VALUES`:
    arrays (h/w, k2/k1, mu)."""
    angles = _angles(CELLS)
    ratios, springs, frictions = VALUES.values()
    shape = (len(ratios), len(springs), len(frictions))
    printed = np.empty(shape)
    complete = np.empty(shape)
    for i, j, k in np.ndindex(*shape):
        holds = bounds(with_values(pad, ratios[i], springs[j], frictions[k]), angles)
        printed[i, j, k] = holds.as_printed.mean()
        complete[i, j, k] = holds.complete.mean()
    return printed, complete


def _curves(pad: Pad) -> tuple[Curve, ...]:
    """Around the area of the map on which the printed conditions hold."""

    def holds(angles: np.ndarray) -> np.ndarray:
        return np.asarray(bounds(pad, (angles[0], angles[1])).as_printed).astype(int)

    a1, a2 = _axes(FINE)
    codes = holds(np.array(_angles(FINE)))
    region = outline(((0.0, math.pi), (0.0, math.pi)), a1, a2, codes.reshape(FINE, -1), holds)
    curves: list[Curve] = []
    for points, _ in region.curves:
        curves.append(tuple((round(x, 5), round(y, 5)) for x, y in points.tolist()))
    return tuple(curves)


class EquilibriumShares(NamedTuple):
    """By pad, (n,) each: shares of the map on which the branch has an equilibrium, on which it is
    stable, and on which it is so in full contact."""

    reached: np.ndarray
    stable: np.ndarray
    stable_full: np.ndarray


def equilibria(scene: Scene, pads: Pad, cells: int = COARSE) -> EquilibriumShares:
    """Shares of the map with sliding equilibria, of the scene with the parameters of each pad.

    pads: parameters are numbers or arrays (n,); cells: how many along each side of the map.
    """
    a1, a2 = _angles(cells)  # (points,) each
    names = ("h", "I", "k1", "k2", "mu", "k_c", "y0")
    parameters = np.broadcast_arrays(*(getattr(pads, name) for name in names))
    count = len(parameters[0])
    points = len(a1)
    # all angles of the first pad, then those of the next
    repeated = [np.repeat(values, points) for values in parameters]
    # (parameter, count * points)
    rows = np.array([np.tile(a1, count), np.tile(a2, count), *repeated])
    computed = verdicts_at(scene, ("alpha1", "alpha2", *names), rows)
    stable = np.isin(computed.codes, STABLE)

    def share(holds: np.ndarray) -> np.ndarray:
        """The share (n,) of the map on which something holds, of each pad."""
        return np.asarray(holds.reshape(count, points).mean(axis=1))

    return EquilibriumShares(
        reached=share(computed.codes != BEYOND_FOLD),
        stable=share(stable),
        stable_full=share(stable & (computed.contact == STATES.index(FULL))),
    )


def _span(shares: np.ndarray) -> Span:
    return Span(float(shares.min()), float(shares.max()))


def full(scene: Scene) -> Full:
    """Stable equilibria in full contact over the sets of `SPREAD`."""
    grids = [grid.ravel() for grid in np.meshgrid(*SPREAD.values(), indexing="ij")]
    ratio, springs, mu, contact, preload = grids
    pads = with_values(scene.pad, ratio, springs, mu)
    assert pads.F_n is not None
    pressed = pads.replace(k_c=contact * pads.k1, y0=-preload * pads.F_n / pads.k1)
    shares = equilibria(scene, pressed, COARSEST)
    full_contact = shares.stable_full
    return Full.of(_span(full_contact), pads=full_contact.size, touching=_span(shares.stable))


def study(files: Sequence[Path]) -> MapRanges:
    """The map for the pad of case (c) of model B2, which the four cases share.

    One parameter after the other takes the values of `VALUES`, while the other two keep those of
    the scene; the spans `low` to `high` are taken over all combinations of the three.
    """
    scene = read_scenes(files, ["b2-c"])["b2-c"]
    pad = scene.pad
    values_of_scene = {"h/w": pad.h / pad.w, "k2/k1": pad.k2 / pad.k1, "mu": pad.mu}

    def with_other(name: str, value: Any) -> Pad:
        """The pad with another value of one parameter of the map."""
        changed = values_of_scene | {name: value}
        return with_values(pad, changed["h/w"], changed["k2/k1"], changed["mu"])

    printed, complete = _shares(pad)  # each of an axis for h/w, one for k2/k1 and one for mu
    sweeps = {}
    for axis, (name, values) in enumerate(VALUES.items()):
        # at each value, whether the printed and the complete conditions hold at each point of the
        # map
        holds = [bounds(with_other(name, v), _angles(CELLS)) for v in values.tolist()]
        other_axes = tuple(i for i in range(len(VALUES)) if i != axis)
        # the first value, the last one, and `SPARSE` - 2 between them
        sparse = values[np.linspace(0, len(values) - 1, SPARSE).astype(int)]
        shares = equilibria(scene, with_other(name, sparse))
        sweeps[name] = Sweep(
            own=values_of_scene[name],
            values=tuple(values.tolist()),
            printed=tuple(float(at_value.as_printed.mean()) for at_value in holds),
            complete=tuple(float(at_value.complete.mean()) for at_value in holds),
            low=tuple(printed.min(axis=other_axes).tolist()),
            high=tuple(printed.max(axis=other_axes).tolist()),
            sparse=tuple(sparse.tolist()),
            reached=tuple(shares.reached.tolist()),
            stable=tuple(shares.stable.tolist()),
            shapes={f"{v:g}": _curves(with_other(name, v)) for v in SHAPES[name]},
        )
    return MapRanges(
        sweeps=sweeps,
        pads=printed.size,
        printed=_span(printed),
        complete=_span(complete),
        full=full(scene),
    )


def sentences(record: MapRanges) -> Mapping[str, bool]:
    """What the supplement says of these maps."""
    return {
        "printed-below-complete-over-parameters": all(
            printed < complete
            for sweep in record.sweeps.values()
            for printed, complete in zip(sweep.printed, sweep.complete, strict=True)
        ),
        "complete-conditions-hold-on-less-than-half-over-parameters": record.complete.high < 0.5,
    }
