"""Curves over two parameters on which stability is lost, continued by arc length.

On such a curve the equilibrium q and the two parameters obey the balance of the loads and one
condition: a double root of the undamped characteristic polynomial or a real part of zero
(flutter), a singular stiffness (divergence, a fold), or a gap of zero (the contact changes). All
derivatives that Newton's method takes are exact.
"""

import math
from dataclasses import dataclass

import numpy as np

from squeal.analysis.maps import AXES, BEYOND_FOLD, Axis, Found, codes_at
from squeal.analysis.stack import QUIET
from squeal.analysis.threshold import Kind, Threshold
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import VERDICTS, complex_eigenvalues
from squeal.model.linear import linearise
from squeal.model.states import State
from squeal.numerics.newton import newton
from squeal.schema.arguments import takes

HALVINGS = 20  # of the distance of two neighbouring points of the map, before Newton's method
STEP, SHORTEST = 0.02, 1e-5  # of the curve, in shares of the map's sides
COSINE = 0.97  # least, between the tangents of a step
MOST_STEPS = 2000
NEAR = 0.01  # of the map's sides: the curve's start to where verdicts differ


@dataclass(frozen=True, eq=False)
class ThresholdCurve:
    """points (n, 2): the two parameters along the curve; kind: what happens there; frequency_hz
    (n,) of the mode that starts to grow, 0 where none vibrates; closed: it returns to its start."""

    points: np.ndarray
    kind: Kind
    frequency_hz: np.ndarray
    closed: bool


def _correct(local: Threshold, z: np.ndarray, row: np.ndarray, value: float) -> np.ndarray | None:
    """Newton's method on the threshold with the further condition row.z = value."""
    found = _corrected(local, z, row, value)
    return None if found is None else found[0]


def _corrected(
    local: Threshold, z: np.ndarray, row: np.ndarray, value: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """As `_correct`, with the derivative of the threshold from where the last step began."""
    last: list[np.ndarray] = []

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = local.conditions(z)
        last[:] = [J]
        return np.append(f, row @ z - value), np.vstack([J, row])

    try:
        found = newton(conditions, z, tolerance=1e-11, steps=12, stalled=1e-9)
    except (InputError, ComputationError, np.linalg.LinAlgError):
        return None
    return (found.x, last[0]) if found.converged else None


def _tangent(J: np.ndarray) -> np.ndarray:
    """Unit vector along the curve (its part in the map has this length), sign open."""
    way = np.linalg.svd(J)[2][-1]
    return np.asarray(way / np.linalg.norm(way[-2:]))


def _half(local: Threshold, start: np.ndarray, sign: float) -> tuple[list[np.ndarray], bool]:
    """The curve on one side of its start, and whether it came back to it."""
    z, step, found = start, STEP / 4, list[np.ndarray]()
    way, bend = sign * _tangent(local.conditions(start)[1]), np.zeros(len(z))
    for _ in range(MOST_STEPS):
        guess = z + step * way
        met = _corrected(local, guess + step**2 / 2 * bend, way, float(way @ guess))
        new = None
        if met is not None and np.linalg.norm(met[0][-2:] - guess[-2:]) <= 0.3 * step:
            ahead = _tangent(met[1])
            ahead = ahead * np.sign(ahead[-2:] @ way[-2:])
            new = met[0] if ahead[-2:] @ way[-2:] >= COSINE else None
        if new is None:
            step /= 2
            if step < SHORTEST:
                return found, False
            continue
        u = new[-2:]
        if np.any(u < 0.0) or np.any(u > 1.0):
            side = int(np.argmax(np.maximum(-u, u - 1.0)))
            row = np.eye(len(z))[side - 2]
            last = _correct(local, z, row, 1.0 if u[side] > 0.5 else 0.0)
            return [*found, *([last] if last is not None else [])], False
        if not local.quiet(new):
            step /= 2
            if step < SHORTEST:
                return found, False
            continue
        found.append(new)
        if len(found) > 4 and np.linalg.norm(u - start[-2:]) < step:
            return [*found, start], True
        z, way, bend = new, ahead, (ahead - way) / step
        step = min(1.5 * step, STEP)
    return found, False


def _curve(local: Threshold, start: np.ndarray) -> ThresholdCurve | None:
    on, closed = _half(local, start, 1.0)
    back = [] if closed else _half(local, start, -1.0)[0]
    places = [*back[::-1], start, *on]
    if len(places) < 3:
        return None
    points = np.array([local.parameters(z[-2:]) for z in places])
    each = [(local.model(local.split(z)[1]), local.split(z)[0]) for z in places]
    rates = np.array([local.frequency(*one) for one in each])
    return ThresholdCurve(points, local.kind, rates / (2 * math.pi), closed)


def _seeds(
    scene: Scene, axes: tuple[Axis, Axis], codes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours in the map of which one is quiet, as u (2, n) of the quiet one and the other."""
    calm = np.isin(codes, QUIET)
    shape, ends = codes.shape, []
    for axis in range(2):
        one = np.moveaxis(calm, axis, 0)
        i, j = np.nonzero(one[1:] != one[:-1])
        low = np.array([i, j] if axis == 0 else [j, i])
        high = low + np.eye(2, dtype=int)[axis][:, None]
        first = calm[tuple(low)]
        ends.append((np.where(first, low, high), np.where(first, high, low)))
    quiet, loud = (np.concatenate([pair[k] for pair in ends], axis=1) for k in range(2))
    size = np.array(shape)[:, None]
    return (quiet + 0.5) / size, (loud + 0.5) / size


def _bisected(
    scene: Scene, axes: tuple[Axis, Axis], quiet: np.ndarray, loud: np.ndarray
) -> tuple[Found, Found]:
    """Both ends (2, n) drawn together to where stability is lost; what is found at them."""
    names = (axes[0].name, axes[1].name)

    def at(u: np.ndarray) -> Found:
        return codes_at(scene, names, np.array([a.at(row) for a, row in zip(axes, u, strict=True)]))

    for _ in range(HALVINGS):
        middle = (quiet + loud) / 2
        calm = np.isin(at(middle).codes, QUIET)
        quiet[:, calm], loud[:, ~calm] = middle[:, calm], middle[:, ~calm]
    return at(quiet), at(loud)


@takes_scene
@takes(axes=AXES)
def threshold_curves(
    scene: Scene, axes: tuple[Axis, Axis], codes: np.ndarray
) -> tuple[ThresholdCurve, ...]:
    """The curves between stable or marginal points of a map, codes (n1, n2), and the others.

    Each is continued from where two neighbouring points of the map differ, to both sides: to the
    map's border, back to its start, or to where another mode grows already or the contact changes.
    """
    quiet, loud = _seeds(scene, axes, codes)
    if not quiet.shape[1]:
        return ()
    one, other = _bisected(scene, axes, quiet, loud)
    cell = 1.0 / min(codes.shape)
    states = scene.pad_model.states
    units = None if scene.pad_model.linear else Statics.of(scene.pad_model)
    left = list(range(quiet.shape[1]))
    found: list[ThresholdCurve] = []
    while left:
        i = left.pop(0)
        state = states[int(one.contact[i])]
        curve = None
        for kind, point in _kinds_of(one, other, i, states):
            local = Threshold(scene, axes, kind, state, point, 1.0)
            z = quiet[:, i].copy()
            if units is not None:
                z = np.append(units.to_si(one.places[:, i]) / local.size, z)
            try:
                local = _with_pair(local, z)
                across = int(np.argmin(np.abs(loud[:, i] - quiet[:, i])))  # the same on both sides
                start = _started(local, z, across)
                curve = None if start is None else _curve(local, start)
            except (InputError, ComputationError, np.linalg.LinAlgError):
                continue
            if curve is not None:
                break
        if curve is None:
            continue
        found.append(curve)
        shares = np.array([a.share(p) for a, p in zip(axes, curve.points.T, strict=True)]).T
        left = [k for k in left if _distance(shares, quiet[:, k]) > 0.1 * cell]
    return tuple(found)


def _kinds_of(
    one: Found, other: Found, i: int, states: tuple[State, ...]
) -> list[tuple[Kind, int]]:
    """What may happen between a quiet point and the other, and which contact point changes."""
    before, after = (states[int(found.contact[i])] for found in (one, other))
    if other.codes[i] == BEYOND_FOLD:  # also where the contact changes and the branch turns back
        return [("fold", 0), *(("contact", k) for k in range(len(before)))]
    changed = [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    if changed:
        return [("contact", changed[0])]
    grows = VERDICTS[int(other.codes[i])]
    return [("divergence" if grows == "divergence" else "flutter", 0)]


def _with_pair(local: Threshold, z: np.ndarray) -> Threshold:
    """With damping: the frequency of the pair nearest to growth."""
    q, u = local.split(z)
    m = linearise(local.model(u), q, local.state)
    if local.kind != "flutter" or not m.C.any():
        return local
    values = complex_eigenvalues(*m).values
    pair = values[np.argmax(np.where(values.imag > 0.0, values.real, -np.inf))]
    return Threshold(
        local.scene, local.axes, local.kind, local.state, local.point, float(pair.imag)
    )


def _started(local: Threshold, z: np.ndarray, across: int) -> np.ndarray | None:
    """The place on the curve next to z, one parameter held if that leads to it: a free step may
    slide along the curve. None if Newton's method finds none near z."""
    held = _correct(local, z, np.eye(len(z))[across - 2], z[across - 2])
    if held is not None and np.linalg.norm(held[-2:] - z[-2:]) < NEAR and local.quiet(held):
        return held
    new = z.copy()
    for _ in range(20):
        f, J = local.conditions(new)
        step = np.linalg.lstsq(J, f, rcond=None)[0]
        new = new - step
        if np.abs(step).max() < 1e-11:
            near = np.linalg.norm(new[-2:] - z[-2:]) < NEAR
            return new if near and local.quiet(new) else None
    return None


def _distance(line: np.ndarray, place: np.ndarray) -> float:
    """From a place (2,) to a polygonal line (n, 2)."""
    a, d = line[:-1], np.diff(line, axis=0)
    length = np.maximum((d**2).sum(axis=1), 1e-300)
    t = np.clip(((place - a) * d).sum(axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(a + t[:, None] * d - place, axis=1).min())
