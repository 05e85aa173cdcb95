"""Maps over two parameters of a scene: verdicts, critical friction, growth, and the curves on which
stability is lost.

B3 maps linearise about the origin. The others find the sliding equilibrium of every point first, on
the branch from mu = 0 that a query follows; see `squeal.queries.pads.stack`. The curves cross the
lines between neighbouring points of which one has no unstable mode and the other has. Each crossing
is located by halving that line with the verdicts of the map; contourpy joins those on the sides of
one square.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.equilibrium.statics import LIMITS, excursion
from squeal.errors import InputError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.io.writing import unit_word
from squeal.linear import VERDICTS
from squeal.linear.continuation import Bools
from squeal.linear.matrices import Array
from squeal.linear.paths import Indices
from squeal.model.pad import PARAMETERS
from squeal.queries.pads.stack import STABLE_OR_MARGINAL, Names, PadStack, parameters, verdicts
from squeal.results.map import Axis, Map
from squeal.results.sources import PadSource
from squeal.schema import Place, Word

MARGINAL = VERDICTS.index("marginal")
# the pad has no equilibrium on the branch from mu = 0: the branch turns back at a fold before the
# pad's mu, ends otherwise or does not begin, see `BranchEnd`
BEYOND_FOLD = len(VERDICTS)
UNKNOWN = BEYOND_FOLD + 1  # whether the pad has one could not be decided
NAMES = (*VERDICTS, "beyond a fold", "unknown")
QUANTITIES = {
    "critical-friction": ("critical friction", "1"),
    "growth": ("growth rate of the most unstable mode", "1/s"),
    "frequency": ("frequency of the most unstable mode", "Hz"),
}
"""What may stand beside the verdicts: its name in words, and its unit."""
POINTS_AT_ONCE = 10_000  # whose verdicts are computed together; bounds the memory
COMPILED_FROM = 20_000  # points of a map from which on compiling pays
QUANTITY_POINTS = 2_000  # whose branches are followed together
HIGH = 2.0  # the friction up to which the critical one is searched
HALVINGS = 40  # of the line between two neighbours of the map on which a point of a curve lies


def angle_axes(n: int) -> tuple[Axis, Axis]:
    """The axes of Fig. 13: alpha1 and alpha2 between 0 and pi."""
    return Axis("alpha1", 0.0, math.pi, n), Axis("alpha2", 0.0, math.pi, n)


class PointVerdicts(NamedTuple):
    """Verdicts and equilibria at n points of a map.

    Attributes
    ----------
    codes : array (n,)
        The verdicts, indices into `NAMES`.
    contact : array (n,)
        Indices into the model's contact states; that of no contact where no equilibrium is known.
    beyond : array (3, n) of bool
        Whether tilt, travel and reaction of the equilibrium exceed their `LIMITS`, a row each;
        false where none is known, and in B3.
    doubtful : array (n,) of bool
        Where rounding may change the verdict; a map then leaves it open.
    """

    codes: NDArray[np.int8]
    contact: NDArray[np.int8]
    beyond: Bools
    doubtful: Bools


def verdicts_at(scene: Scene, names: Names, values: Array, compiled: bool = False) -> PointVerdicts:
    """Compute the verdict at each of n points, and what is known of the equilibrium there.

    At each point some parameters of the scene's pad are replaced. The verdict is that on the pad's
    equilibrium on the branch from mu = 0; B3 is linearised about the origin. Modal damping ratios
    refer to the modes that the pad of that point has without friction.

    Parameters
    ----------
    scene : Scene
        The scene.
    names : tuple of p str
        The parameters that are replaced.
    values : array (p, n)
        Their values, SI units.
    compiled : bool
        Whether the equilibria are computed in machine code. Only many points are worth the time
        that compiling takes.

    Returns
    -------
    PointVerdicts
        Arrays over the n points.

    Raises
    ------
    ComputationError
        Where a mode to which a damping ratio belongs is unstable without friction.
    """
    stack = PadStack.of(scene, names, values, compiled)
    equilibria, unknown = stack.at_mu()
    # of points without an equilibrium; those with one get their verdicts below
    codes = np.where(unknown, UNKNOWN, BEYOND_FOLD).astype(np.int8)
    existing = np.flatnonzero(equilibria.exists)
    at_existing = equilibria.some(existing)
    A, B = stack.matrices(existing, at_existing)  # mass-normalised stiffness and damping
    codes[existing] = verdicts(A, B)
    doubtful = np.zeros(stack.n, dtype=bool)
    doubtful[existing] = stack.doubtful(existing, at_existing, A, B)
    states = list(scene.pad_model.states)
    contact = np.full(stack.n, states.index(scene.pad_model.none), dtype=np.int8)
    for i, state in enumerate(states):
        in_state = np.all(equilibria.touching == np.array(state)[:, None], axis=0)
        contact[equilibria.exists & in_state] = i
    beyond = np.zeros((len(LIMITS), stack.n), dtype=bool)
    if not stack.linear:  # the origin of a linear model is no excursion
        statics = stack.statics.pick(existing)
        beyond[:, existing] = excursion(statics, at_existing.z, at_existing.touching).beyond()
    return PointVerdicts(codes, contact, beyond, doubtful)


class _Block(NamedTuple):
    """Points of a map that one task computes: pads of a scene with some parameters replaced.

    Attributes
    ----------
    scene : Scene
        The scene.
    names : tuple of 2 str
        The parameters that are replaced.
    points : array (2, k)
        Their values, SI units.
    """

    scene: Scene
    names: Names
    points: Array


def _blocks(scene: Scene, names: Names, x: Array, y: Array, size: int) -> Iterator[_Block]:
    """The grid of x (n1,) and y (n2,) cut into whole rows, of about `size` points each."""
    rows = max(1, size // len(y))
    for start in range(0, len(x), rows):
        grid = np.meshgrid(x[start : start + rows], y, indexing="ij")
        yield _Block(scene, names, np.reshape(grid, (2, -1)))


def _codes_of(compiled: bool, block: _Block) -> PointVerdicts:
    """The verdicts at the points of a block: a task of a process."""
    return verdicts_at(*block, compiled)


def on_grid(scene: Scene, names: tuple[str, str], x: Array, y: Array) -> PointVerdicts:
    """Compute the verdicts, contact states and exceeded limits on a grid of two parameters.

    Blocks of some values of x are computed at a time, to bound the memory. The blocks are the same
    for any number of workers.

    Parameters
    ----------
    scene : Scene
        The scene.
    names : (str, str)
        The two parameters.
    x, y : array (n1,), array (n2,)
        Their values, SI units.

    Returns
    -------
    PointVerdicts
        Its arrays have two axes (n1, n2) in place of the axis over points.
    """
    compiled = len(x) * len(y) >= COMPILED_FROM
    blocks = _blocks(scene, names, x, y, POINTS_AT_ONCE)
    codes_of_block = partial(_codes_of, compiled)
    parts = mapped(codes_of_block, blocks)
    grids = []
    for arrays_of_blocks in zip(*parts, strict=True):  # for each field of `PointVerdicts`
        joined = np.concatenate(arrays_of_blocks, axis=-1)  # along the points
        grids.append(joined.reshape(*joined.shape[:-1], len(x), len(y)))
    return PointVerdicts(*grids)


def _check(scene: Scene, axes: tuple[Axis, Axis], quantity: str | None) -> None:
    """Refuse axes that a map cannot have.

    Raises InputError for a parameter that the scene does not use, values that it may not take,
    one parameter twice, an unknown quantity, and the critical friction over friction.
    """
    if quantity is not None:
        Word(tuple(QUANTITIES)).read(quantity, Place("quantity"))
    allowed = parameters(scene.pad_model)
    at = Place("Axis")
    names = [axis.name for axis in axes]
    for axis in axes:
        if axis.name not in allowed:
            requirement = f"a parameter of the scene: {', '.join(allowed)}"
            raise (at / "name").must_be(axis.name, requirement)
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
    """Compute the map of verdicts over two parameters of a scene's pad.

    Parameters
    ----------
    scene : Scene
        The scene; the parameters of the axes replace its own.
    axes : (Axis, Axis), optional
        The two parameters and their values; 200 values from 0 to pi of each of the two spring
        angles if left out.
    quantity : str, optional
        One of `QUANTITIES` that is computed beside the verdicts, NaN where there is none or where
        it could not be decided. Growth and frequency are computed at the scene's mu, or at the mu
        of an axis. The critical friction is the first loss of stability, or of the equilibrium, as
        friction rises from 0 to `HIGH`.
    curves : bool
        Whether the curves on which stability is lost are located.

    Raises
    ------
    InputError
        For axes or a quantity that a map cannot have.
    ComputationError
        Where a mode to which a damping ratio belongs is unstable without friction.
    """
    axes = angle_axes(200) if axes is None else axes
    _check(scene, axes, quantity)
    names = (axes[0].name, axes[1].name)
    points = on_grid(scene, names, axes[0].values, axes[1].values)
    codes = np.where(points.doubtful, UNKNOWN, points.codes).astype(np.int8)
    beyond = points.beyond
    has_verdict = codes < len(VERDICTS)  # neither beyond a fold nor unknown
    admissible = has_verdict & ~beyond.any(axis=0)
    warnings = _inadmissible(codes, beyond)
    details: dict[str, Any] = {
        "admissible_share": float(admissible.mean()),
        "admissible": not warnings,  # here, before a warning of the quantity joins them
    }
    if curves:
        details["threshold_curve"] = threshold_curves(scene, axes, codes)
    name_unit_values = None
    notes = []
    if quantity is not None:
        quantity_name, unit = QUANTITIES[quantity]
        values, unknown = _quantity(scene, axes, quantity)
        unit = unit_word(unit)
        name_unit_values = (quantity, unit, values)
        notes.append(f"{quantity_name}: {_span(values, unit)}")
        if unknown.any():
            warnings.append(f"{quantity_name} could not be decided at {_share(unknown)}")
    if np.any(codes == MARGINAL) and scene.damping is None:
        notes.append("marginal: nothing damps; try `damping: {ratios: [0.02, 0.02, 0.02]}`")
    return Map(
        name=scene.model,
        axes=axes,
        units=(unit_word(PARAMETERS[names[0]].unit), unit_word(PARAMETERS[names[1]].unit)),
        verdicts=NAMES,
        codes=codes,
        quantity=name_unit_values,
        admissible=None if scene.pad_model.linear else admissible,
        warnings=tuple(warnings),
        details=details,
        notes=tuple(notes),
        source=PadSource(scene),
    )


def _inadmissible(codes: NDArray[np.int8], beyond: Bools) -> list[str]:
    """A sentence for each reason why points are inadmissible, with their share.

    codes (n1, n2), beyond (3, n1, n2): as of `PointVerdicts`, on the grid of the map.
    """
    reasons = {
        "lie beyond a fold or the end of the branch": codes == BEYOND_FOLD,
        "could not be decided": codes == UNKNOWN,
    }
    for limit, points in zip(LIMITS._fields, beyond, strict=True):
        reasons[f"exceed the limit of {limit}"] = points
    return [f"{_share(points)} {words}" for words, points in reasons.items() if points.any()]


def _span(values: Array, unit: str) -> str:
    """The range of the finite values, with its unit, in words."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "nowhere"
    return f"{finite.min():.6g} to {finite.max():.6g} {unit}"


def _share(is_point: Bools) -> str:
    """The share of the points at which an array of bool is true, in words."""
    return f"{100 * is_point.mean():.3g} % of the points"


def _quantity(scene: Scene, axes: tuple[Axis, Axis], name: str) -> tuple[Array, Bools]:
    """Compute one of the `QUANTITIES` over two axes.

    Returns its values (n1, n2), NaN where there is none, and where (n1, n2) it is unknown.
    """
    names = (axes[0].name, axes[1].name)
    blocks = _blocks(scene, names, axes[0].values, axes[1].values, QUANTITY_POINTS)
    parts = mapped(partial(_quantity_of, name), blocks)
    values, unknown = zip(*parts, strict=True)  # arrays of each block
    shape = (axes[0].n, axes[1].n)
    return np.concatenate(values).reshape(shape), np.concatenate(unknown).reshape(shape)


def _quantity_of(name: str, block: _Block) -> tuple[Array, Bools]:
    """One of the `QUANTITIES` at the points (k,) of a block, and where it is unknown (k,): a task
    of a process."""
    stack = PadStack.of(*block)
    if name == "critical-friction":
        losses = stack.first_losses(HIGH)
        return losses.mu, losses.unknown
    fastest, unknown = stack.fastest()
    if name == "growth":
        return fastest.real, unknown
    # only an unstable mode has a frequency in the map
    hertz = np.abs(fastest.imag) / math.tau
    return np.where(fastest.real > 0.0, hertz, np.nan), unknown


def threshold_curves(
    scene: Scene, axes: tuple[Axis, Axis], codes: NDArray[np.int8]
) -> list[dict[str, Any]]:
    """Trace the curves on which stability is lost: between stable or marginal points and others.

    contourpy joins the lines between neighbouring points that a curve crosses; each crossing is
    then located by halving its line, all of them at once.

    Parameters
    ----------
    scene : Scene
        The scene.
    axes : (Axis, Axis)
        The two parameters of the map.
    codes : array (n1, n2)
        Its verdicts, indices into `NAMES`.

    Returns
    -------
    list of dict
        For each curve its `kind` (flutter, divergence, contact or fold), whether it is `closed`,
        its `points`, pairs of both parameters, and for each point the `frequency_hz` of the mode
        that begins to grow, 0 where no mode vibrates. Curves end next to unknown points, at the
        edges of the map, and where the kind changes.
    """
    stable = np.isin(codes, STABLE_OR_MARGINAL)
    decided = codes != UNKNOWN
    if min(codes.shape) < 2 or len(np.unique(stable[decided])) < 2:  # no neighbours that differ
        return []
    from contourpy import contour_generator  # here, since it takes a fifth of a query's time

    names = (axes[0].name, axes[1].name)
    # 1 at stable points, 0 at others: the level 0.5 passes halfway between two neighbours
    field = np.ma.masked_array(1.0 * stable, ~decided)
    # without `corner_mask` a square of the map with an undecided corner has no curve at all
    traced: Any = contour_generator(z=field, corner_mask=False).lines(0.5)
    # (2, points) each: a traced point lies on a line between two neighbours, a stable and another
    # one. These are the places of both, in rows for the first and the second axis, as shares from
    # 0 to 1 of the axis
    shares_stable, shares_other = _ends_across(traced, stable)
    for _ in range(HALVINGS):  # bisection of all lines between neighbours at once
        middle = (shares_stable + shares_other) / 2
        codes_in_middle = verdicts_at(scene, names, _values_at(axes, middle)).codes
        is_stable = np.isin(codes_in_middle, STABLE_OR_MARGINAL)
        shares_stable[:, is_stable] = middle[:, is_stable]
        shares_other[:, ~is_stable] = middle[:, ~is_stable]
    points = _values_at(axes, shares_stable)
    # verdicts on the stable side of the curve, and on the other one, name what happens on it
    inside = verdicts_at(scene, names, points)
    outside = verdicts_at(scene, names, _values_at(axes, shares_other))
    kinds = np.where(outside.codes == VERDICTS.index("divergence"), "divergence", "flutter")
    kinds[inside.contact != outside.contact] = "contact"  # other points touch on the other side
    kinds[outside.codes == BEYOND_FOLD] = "fold"
    stack = PadStack.of(scene, names, points)
    equilibria, _ = stack.at_mu()  # without the array that says where an equilibrium is unknown
    # mass-normalised stiffness and damping (points, 3, 3)
    A, B = stack.matrices(np.arange(stack.n), equilibria)
    hertz = np.where(kinds == "flutter", stack.frequency_at_onset(A, B), 0.0)
    # `_ends_across` has put the points of all lines in one row: cut it into the lines again
    curves = []
    ends_of_lines = np.cumsum([len(line) for line in traced])
    numbers_of_lines = np.split(np.arange(points.shape[1]), ends_of_lines[:-1])
    for line in numbers_of_lines:
        for part, closed in _parts_of_one_kind(line, points, kinds):
            curves.append(
                {
                    "kind": str(kinds[part[0]]),
                    "closed": closed,
                    "points": points[:, part].T.tolist(),
                    "frequency_hz": hertz[part].tolist(),
                }
            )
    return curves


def _values_at(axes: tuple[Axis, Axis], shares: Array) -> Array:
    """Both parameters (2, points) at shares (2, points) of their axes."""
    return np.array([axes[0].at(shares[0]), axes[1].at(shares[1])])


def _ends_across(traced: Sequence[Array], stable: Bools) -> tuple[Array, Array]:
    """The two neighbouring points of the map between which each traced point lies.

    Parameters
    ----------
    traced : sequence of array (k, 2)
        Lines of k points halfway between two neighbours, as (column, row) of the map.
    stable : array (n1, n2) of bool
        Which points of the map are stable or marginal.

    Returns
    -------
    shares_stable, shares_other : array (2, points)
        The stable neighbour and the other one, as shares of the two axes from 0 to 1.
    """
    # (2, points): row and column of each point, one of both halfway between two whole numbers
    middle = np.concatenate(traced)[:, ::-1].T
    below = np.floor(middle).astype(int)
    above = np.ceil(middle).astype(int)
    below_is_stable = stable[tuple(below)]
    size = np.array(stable.shape)[:, None]
    # a point lies in the middle of its cell of the map: number k of n at the share (k + 1/2) / n
    shares_stable = (np.where(below_is_stable, below, above) + 0.5) / size
    shares_other = (np.where(below_is_stable, above, below) + 0.5) / size
    return shares_stable, shares_other


def _parts_of_one_kind(
    line: Indices, points: Array, kinds: NDArray[np.str_]
) -> list[tuple[Indices, bool]]:
    """Cut a line where its kind changes.

    Parameters
    ----------
    line : array (k,)
        Numbers of points, along the line; a closed one ends with the point that it begins with.
    points : array (2, points)
        Both parameters of all points.
    kinds : array (points,)
        What happens at each point.

    Returns
    -------
    list of (array, bool)
        The numbers of the points of each part that has two or more, and whether it is closed.
    """
    cuts = _changes_of(kinds[line])
    closed = np.array_equal(points[:, line[0]], points[:, line[-1]])
    if closed and cuts.size:
        # a closed line, whose last point is its first one, is turned to begin where the kind
        # changes, so that no part runs over its end
        opened = np.roll(line[:-1], -cuts[0])
        parts = np.split(opened, _changes_of(kinds[opened]))
    else:
        parts = np.split(line, cuts)
    is_whole = closed and len(parts) == 1
    return [(part, is_whole) for part in parts if len(part) > 1]


def _changes_of(values: NDArray) -> Indices:
    """The indices at which a value differs from the one before."""
    return np.flatnonzero(values[1:] != values[:-1]) + 1
