"""The equilibrium branch over mu, continued by arc length through contact changes and folds."""

import math
from dataclasses import dataclass, field

import numpy as np

from squeal.equilibrium.settings import DEFAULT, ContinuationSettings
from squeal.equilibrium.statics import Statics
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.numerics.newton import complex_step, newton

_MU = np.array([0.0, 0.0, 0.0, 1.0])


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
    last point is there); end: why the branch stops; settings: how it was followed.
    """

    statics: Statics
    points: list[Point] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    folds: list[Point] = field(default_factory=list)
    reached: bool = False
    end: str = ""
    settings: ContinuationSettings = DEFAULT


def _tangent(statics: Statics, z: np.ndarray, state: State) -> np.ndarray:
    return np.asarray(np.linalg.svd(statics.linearised(z, state)[1])[2][3])


def _correct(
    statics: Statics, z: np.ndarray, state: State, row: np.ndarray, value: float
) -> np.ndarray | None:
    """Newton's method on the balance with the fourth condition row.z = value."""

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = statics.linearised(z, state)
        return np.append(f, row @ z - value), np.vstack([J, row])

    # after a step of 1e-9 what is left is rounding
    found = newton(conditions, z, tolerance=1e-9, steps=12)
    return found.x if found.converged else None


def _at_contact_change(
    statics: Statics, z: np.ndarray, state: State, point: int
) -> np.ndarray | None:
    """The place near z at which the gap of a contact point vanishes along the branch."""

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = statics.linearised(z, state)
        gap, slope = statics.gaps(z)[point], statics.gap_derivative(z, point)
        return np.append(f, gap), np.vstack([J, slope])

    found = newton(conditions, z, tolerance=1e-12)
    return found.x if found.converged else None


def _at_tilt(statics: Statics, z: np.ndarray, state: State, tilt: float) -> np.ndarray | None:
    """The place near z at which the pad has turned by `tilt` (rad, with its sign)."""
    row = complex_step(lambda z: statics.tilt(z)[None], z)[0]
    return _correct(statics, z, state, row, float(row @ z) + tilt - float(statics.tilt(z)))


def _fold(statics: Statics, a: np.ndarray, b: np.ndarray, state: State) -> np.ndarray:
    """The point between a and b at which mu is stationary along the branch, by regula falsi."""
    chord = (b - a) / np.linalg.norm(b - a)

    def rise(z: np.ndarray) -> float:
        ahead = _tangent(statics, z, state)
        return float(ahead[3] * np.sign(ahead @ chord))

    z, at, side = a, math.inf, None
    low, high = (float(chord @ a), rise(a)), (float(chord @ b), rise(b))
    for _ in range(100):
        last, at = at, (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1])
        # mu itself is stationary there, and so twice as exact
        if abs(at - last) <= 1e-10 * (abs(low[0]) + abs(high[0])):
            break
        found = _correct(statics, z + (at - chord @ z) * chord, state, chord, at)
        if found is None:
            break
        z, here = found, rise(found)
        # an end that stays for the second time counts half (Illinois)
        before, side = side, (here > 0) == (low[1] > 0)
        share = 0.5 if side == before else 1.0
        if side:
            low, high = (at, here), (high[0], share * high[1])
        else:
            high, low = (at, here), (low[0], share * low[1])
    return z


def follow(
    model: PadModel,
    z: np.ndarray,
    state: State,
    mu_max: float,
    settings: ContinuationSettings = DEFAULT,
    rising: bool = False,
) -> Branch:
    """Continue an equilibrium z (natural units, mu = 0) until mu first reaches `mu_max`.

    Within a contact state the branch is smooth and pseudo-arc-length continuation follows it,
    folds included. Where a gap passes zero the point is located and the branch goes on in the new
    state, in the direction that opens or closes that gap. It ends where the pad has turned past
    90 degrees, so that no equilibrium beyond is reached; with `rising` just past its first fold.
    """
    walk = _Walk(Branch(Statics.of(model), [Point(z, state)], settings=settings), mu_max, rising)
    if mu_max <= 0.0:
        walk.branch.reached, walk.branch.end = True, "mu = 0"
        return walk.branch
    for _ in range(settings.most_steps):
        if not walk.advance():
            return walk.branch
    walk.branch.end = f"the branch was not followed beyond mu = {walk.z[3]:.9g}"
    return walk.branch


class _Walk:
    """The end of a branch so far: place z, contact state, unit vector ahead, length of a step."""

    def __init__(self, branch: Branch, mu_max: float, rising: bool) -> None:
        self.branch, self.mu_max, self.rising = branch, mu_max, rising
        self.statics, self.settings = branch.statics, branch.settings
        self.z, self.state = branch.points[-1].z, branch.points[-1].state
        ahead = _tangent(self.statics, self.z, self.state)
        self.ahead = ahead * np.sign(ahead[3])
        self.step = self.settings.first_step

    def _ends(self, why: str) -> bool:
        self.branch.end = why
        return False

    def advance(self) -> bool:
        """Go one step on, or halve it; False where the branch ends."""
        taken = self._corrected()
        if taken is None:
            self.step /= 2
            lost = self.step < self.settings.shortest_step
            why = f"the branch from mu = 0 is lost at mu = {self.z[3]:.9g}"
            return self._ends(why) if lost else True
        new, turn, point = taken
        if self._turned_over(new) or self._reached(new, turn, point):
            return False
        if point is not None:
            turned = self._changed(new, point)
            if turned is None:
                return self._ends(f"contact is lost at mu = {new[3]:.9g}")
            turn = turned
        falls = new[3] < self.branch.points[-1].z[3]
        self.branch.points.append(Point(new, self.state))
        if new[3] < 0.0 or (falls and self.rising):
            return self._ends(_turned_back(self.branch))
        pad = self.statics.model.pad
        if np.max(np.abs(new[:2])) > self.settings.farthest * (pad.L1 + pad.L2):
            return self._ends(f"the equilibrium runs away to infinity near mu = {new[3]:.9g}")
        self.z, self.ahead = new, turn
        longest = self.settings.longest_step * (1.0 + 0.1 * float(np.max(np.abs(new[:3]))))
        self.step = min(self.settings.growth * self.step, longest)
        return True

    def _corrected(self) -> tuple[np.ndarray, np.ndarray, int | None] | None:
        """The next point, the tangent there, and the contact point that changes at it, if any.

        None where the step is too long.
        """
        guess = self.z + self.step * self.ahead
        new = _correct(self.statics, guess, self.state, self.ahead, float(self.ahead @ guess))
        if new is None or np.linalg.norm(new - guess) > self.settings.correction * self.step:
            return None
        turn = _tangent(self.statics, new, self.state)
        turn = turn * np.sign(turn @ self.ahead)
        if turn @ self.ahead < self.settings.cosine:
            return None
        point = _first_change(self.statics, self.z, new, self.state)
        if point is None:
            return new, turn, None
        crossing = _at_contact_change(self.statics, new, self.state, point)
        far = self.settings.overshoot * self.step
        if crossing is None or np.linalg.norm(crossing - self.z) > far:
            return None
        return crossing, turn, point

    def _turned_over(self, new: np.ndarray) -> bool:
        """True if the branch ends before `new`, where the pad has turned past 90 degrees.

        It may reach the wanted mu before.
        """
        tilt = float(self.statics.tilt(new))
        if abs(tilt) < self.settings.tilt:
            return False
        at = _at_tilt(self.statics, new, self.state, float(np.copysign(self.settings.tilt, tilt)))
        at = new if at is None else at
        if at[3] >= self.mu_max and self._finish(at):
            return True
        self.branch.points.append(Point(at, self.state))
        self._ends(f"the pad turns past 90 degrees on the branch at mu = {at[3]:.9g}")
        return True

    def _reached(self, new: np.ndarray, turn: np.ndarray, point: int | None) -> bool:
        """Note a fold before `new`; True if the wanted mu is reached on the way."""
        if (turn[3] < 0) != (self.ahead[3] < 0) and point is None:
            fold = _fold(self.statics, self.z, new, self.state)
            self.branch.folds.append(Point(fold, self.state))
            if fold[3] >= self.mu_max:
                share = (self.mu_max - self.z[3]) / (fold[3] - self.z[3])
                if self._finish(self.z + share * (fold - self.z)):
                    return True
            self.branch.points.append(self.branch.folds[-1])
        return bool(new[3] >= self.mu_max) and self._finish(new)

    def _changed(self, new: np.ndarray, point: int) -> np.ndarray | None:
        """Go over to the new contact state at `new`: the tangent there, None without contact."""
        old, self.state = self.state, self.state.flip(point)
        if not any(self.state):
            self.branch.points.append(Point(new, old))
            return None
        turn = _tangent(self.statics, new, self.state)
        opens = 1.0 if not self.state[point] else -1.0
        turn = turn * np.sign(opens * (self.statics.gap_derivative(new, point) @ turn))
        self.branch.changes.append(len(self.branch.points))
        if (turn[3] < 0) != (self.ahead[3] < 0):
            self.branch.folds.append(Point(new, self.state))
        return np.asarray(turn)

    def _finish(self, near: np.ndarray) -> bool:
        """End the branch at the wanted mu, from a place near it; False if that cannot be done."""
        end = _correct(self.statics, near, self.state, _MU, self.mu_max)
        if end is None or abs(self.statics.tilt(end)) >= self.settings.tilt:
            return False
        self.branch.points.append(Point(end, self.state))
        self.branch.reached, self.branch.end = True, f"mu = {self.mu_max:g} is reached"
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
