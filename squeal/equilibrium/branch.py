"""The equilibrium branch over mu, continued by arc length through contact changes and folds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from squeal.equilibrium.statics import Statics
from squeal.model.equations import PadModel
from squeal.model.states import State

MOST_STEPS = 4000


@dataclass(frozen=True)
class Point:
    """A point of the branch in natural units: z = (x, y, w theta, mu), and the contact state."""

    z: np.ndarray
    state: State


@dataclass
class Branch:
    """Equilibria from mu = 0 on.

    points: in order along the branch; changes: indices of the points at which the contact state
    changes (the point itself lies on the switching surface and carries the new state); folds:
    points at which the branch turns back in mu; reached: whether the wanted mu was reached (the
    last point is there); end: why the branch stops.
    """

    statics: Statics
    points: list[Point] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    folds: list[Point] = field(default_factory=list)
    reached: bool = False
    end: str = ""


def _tangent(statics: Statics, z: np.ndarray, state: State) -> np.ndarray:
    """Unit vector along the branch at z (sign open)."""
    return np.asarray(np.linalg.svd(statics.derivative(z, state))[2][3])


def _correct(
    statics: Statics, z: np.ndarray, state: State, row: np.ndarray, value: float
) -> np.ndarray | None:
    """Newton's method on the balance with the fourth condition row.z = value."""
    z = z.copy()
    for _ in range(12):
        f = np.append(statics.residual(z, state), row @ z - value)
        J = np.vstack([statics.derivative(z, state), row])
        try:
            step = np.linalg.solve(J, f)
        except np.linalg.LinAlgError:
            return None
        z -= step
        if not np.all(np.isfinite(z)):
            return None
        if np.max(np.abs(step)) <= 1e-13 * (1.0 + np.max(np.abs(z))):
            return z
    return None


def _at_contact_change(
    statics: Statics, z: np.ndarray, state: State, point: int
) -> np.ndarray | None:
    """The place near z at which the gap of a contact point vanishes along the branch."""
    z = z.copy()
    for _ in range(30):
        f = np.append(statics.residual(z, state), statics.gaps(z)[point])
        J = np.vstack([statics.derivative(z, state), statics.gap_derivative(z, point)])
        try:
            step = np.linalg.solve(J, f)
        except np.linalg.LinAlgError:
            return None
        z -= step
        if not np.all(np.isfinite(z)):
            return None
        if np.max(np.abs(step)) <= 1e-12 * (1.0 + np.max(np.abs(z))):
            return z
    return None


def _fold(statics: Statics, a: np.ndarray, b: np.ndarray, state: State) -> np.ndarray:
    """The point between a and b at which mu is stationary along the branch, by bisection."""
    chord = (b - a) / np.linalg.norm(b - a)
    low, high = float(chord @ a), float(chord @ b)
    z = a
    ahead = _tangent(statics, a, state)
    sign = np.sign(ahead[3] * (ahead @ chord))
    for _ in range(100):
        middle = 0.5 * (low + high)
        found = _correct(statics, z + (middle - chord @ z) * chord, state, chord, middle)
        if found is None:
            break
        z = found
        ahead = _tangent(statics, z, state)
        if np.sign(ahead[3] * (ahead @ chord)) == sign:
            low = middle
        else:
            high = middle
        if high - low <= 1e-15 * (abs(low) + abs(high)):
            break
    return z


def follow(model: PadModel, z: np.ndarray, state: State, mu_max: float) -> Branch:
    """Continue an equilibrium z (natural units, mu = 0) until mu first reaches `mu_max`.

    Within a contact state the branch is smooth and pseudo-arc-length continuation follows it,
    folds included. Where a gap passes zero the point is located and the branch goes on in the new
    state, in the direction that opens or closes that gap.
    """
    statics = Statics.of(model)
    branch = Branch(statics, [Point(z, state)])
    if mu_max <= 0.0:
        branch.reached, branch.end = True, "mu = 0"
        return branch
    ahead = _tangent(statics, z, state)
    ahead = ahead * np.sign(ahead[3])
    step, longest = 0.02, 0.25
    for _ in range(MOST_STEPS):
        guess = z + step * ahead
        new = _correct(statics, guess, state, ahead, float(ahead @ guess))
        if new is not None:
            turn = _tangent(statics, new, state)
            turn = turn * np.sign(turn @ ahead)
        if new is None or turn @ ahead < 0.95 or np.linalg.norm(new - guess) > 0.2 * step:
            step /= 2
            if step < 1e-10:
                branch.end = f"the branch from mu = 0 is lost at mu = {z[3]:.9g}"
                return branch
            continue
        point = _first_change(statics, z, new, state)
        if point is not None:
            crossing = _at_contact_change(statics, new, state, point)
            if crossing is None or np.linalg.norm(crossing - z) > 2 * step:
                step /= 2
                if step < 1e-10:
                    branch.end = f"the branch from mu = 0 is lost at mu = {z[3]:.9g}"
                    return branch
                continue
            new = crossing
        if (turn[3] < 0) != (ahead[3] < 0) and point is None:
            fold = _fold(statics, z, new, state)
            branch.folds.append(Point(fold, state))
            if fold[3] >= mu_max:
                share = (mu_max - z[3]) / (fold[3] - z[3])
                if _finish(branch, z + share * (fold - z), state, mu_max):
                    return branch
            branch.points.append(branch.folds[-1])
        if new[3] >= mu_max and _finish(branch, new, state, mu_max):
            return branch
        if point is not None:
            state = state.flip(point)
            if not any(state):
                branch.end = f"contact is lost at mu = {new[3]:.9g}"
                branch.points.append(Point(new, state.flip(point)))
                return branch
            turn = _tangent(statics, new, state)
            opens = 1.0 if not state[point] else -1.0
            turn = turn * np.sign(opens * (statics.gap_derivative(new, point) @ turn))
            branch.changes.append(len(branch.points))
            if (turn[3] < 0) != (ahead[3] < 0):
                branch.folds.append(Point(new, state))
        branch.points.append(Point(new, state))
        if new[3] < 0.0:
            branch.end = _turned_back(branch)
            return branch
        if abs(statics.tilt(new)) >= np.pi / 2:
            branch.end = f"the pad turns past 90 degrees on the branch at mu = {new[3]:.9g}"
            return branch
        if np.max(np.abs(new[:2])) > 100 * (statics.model.pad.L1 + statics.model.pad.L2):
            branch.end = f"the equilibrium runs away to infinity near mu = {new[3]:.9g}"
            return branch
        z, ahead = new, turn
        step = min(1.5 * step, longest * (1.0 + 0.1 * float(np.max(np.abs(z[:3])))))
    branch.end = f"the branch was not followed beyond mu = {z[3]:.9g}"
    return branch


def _finish(branch: Branch, near: np.ndarray, state: State, mu_max: float) -> bool:
    """End the branch at mu_max, from a place near it; False if that cannot be reached."""
    end = _correct(branch.statics, near, state, np.array([0.0, 0.0, 0.0, 1.0]), mu_max)
    if end is None:
        return False
    branch.points.append(Point(end, state))
    branch.reached, branch.end = True, f"mu = {mu_max:g} is reached"
    return True


def _first_change(statics: Statics, old: np.ndarray, new: np.ndarray, state: State) -> int | None:
    """The contact point whose gap changes side first between two places, None if none does."""
    before, after = statics.gaps(old), statics.gaps(new)
    crossed = [
        (before[e] / (before[e] - after[e]) if before[e] != after[e] else 0.0, e)
        for e in range(len(state))
        if (after[e] > 0.0) == state[e] and abs(after[e]) > statics.rounding(new)
    ]
    return min(crossed)[1] if crossed else None


def _turned_back(branch: Branch) -> str:
    fold = max(branch.folds, key=lambda point: float(point.z[3]), default=None)
    at = f" at mu = {fold.z[3]:.9g}" if fold is not None else ""
    return f"the branch from mu = 0 turns back in a fold{at}"
