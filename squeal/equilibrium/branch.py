"""The equilibrium branch over mu, continued by arc length through contact changes and folds."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from squeal.equilibrium.located import contact_change, fold
from squeal.equilibrium.settings import DEFAULT, ContinuationSettings
from squeal.equilibrium.statics import Point, Statics
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.numerics.newton import complex_step

FIRST = 1e-6  # of the distance from the origin: the least first step
TURNED = 1e-3  # between two steps: less may be rounding, and tells nothing of the next step
CLOSE = 1e-6  # of a step: what places that were located may lie outside of it


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


def _correct(
    statics: Statics, start: np.ndarray, state: State, row: np.ndarray, value: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Newton's method on the balance with the fourth condition row.z = value: the place, and the
    derivative (3, 4) of the balance from where the last step began."""
    J = np.empty((3, 4))

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J[:] = statics.linearised(z, state)
        return np.append(f, row @ z - value), np.vstack([J, row])

    # after a step of 1e-9 what is left is rounding
    found = statics.solve(conditions, start, start[4:], 1e-9, 0.0)
    return None if found is None else (found, J)


def _at_tilt(statics: Statics, z: np.ndarray, state: State, tilt: float) -> np.ndarray | None:
    """The place near z at which the pad has turned by `tilt` (rad, with its sign)."""
    row = complex_step(lambda z: statics.tilt(z)[None], z)[0]
    found = _correct(statics, z, state, row, float(row @ z) + tilt - float(statics.tilt(z)))
    return None if found is None else found[0]


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


class _Step(NamedTuple):
    """A step that was corrected: the new place, how far rounding moves its mu, the tangent there in
    the old contact state, the contact point that changes there, and a fold on the way."""

    z: np.ndarray
    error: float
    turn: np.ndarray
    point: int | None
    fold: Point | None


class _Walk:
    """The end of a branch so far: place z, contact state, unit vector ahead and its change over
    distance, length of a step.

    Lengths and vectors are those of `scale` z: mu counts as what it displaces at the start.
    """

    def __init__(self, branch: Branch, mu_max: float, rising: bool) -> None:
        self.branch, self.mu_max, self.rising = branch, mu_max, rising
        self.statics, self.settings = branch.statics, branch.settings
        self.z, self.state = branch.points[-1].z, branch.points[-1].state
        self.scale = np.ones(4)
        self.scale[3] = 1.0 / max(abs(self._tangent(self.z)[3]), 1e-12)
        ahead = self._tangent(self.z)
        self.ahead = ahead * np.sign(ahead[3])
        self.bend = np.zeros(4)
        # far from the origin rounding hides shorter steps
        self.step = max(self.settings.first_step, FIRST * float(np.max(np.abs(self.z))))

    def _tangent(self, z: np.ndarray, like: np.ndarray | None = None) -> np.ndarray:
        return self._along(self.statics.linearised(z, self.state)[1], like)

    def _along(self, J: np.ndarray, like: np.ndarray | None = None) -> np.ndarray:
        found = np.linalg.svd(J / self.scale)[2][3]
        return np.asarray(found if like is None else found * np.sign(found @ like))

    def _far(self, a: np.ndarray, b: np.ndarray) -> float:
        return float(np.linalg.norm((a - b) * self.scale))

    def _ends(self, why: str) -> bool:
        self.branch.end = why
        return False

    def advance(self) -> bool:
        """Go one step on, or halve it; False where the branch ends."""
        taken = self._corrected()
        ended = None if taken is None else self._ended(taken)
        if taken is None or ended is None:
            self.step /= 2
            if self.step >= self.settings.shortest_step:
                return True
            why = self.statics.why_hidden(self.z)
            at = f"the branch from mu = 0 is lost at mu = {self.z[3]:.9g}"
            return self._ends(f"{at}: {why}" if why else at)
        if ended:
            return False
        new, turn = taken.z, taken.turn
        if taken.fold is not None:
            self.branch.folds.append(taken.fold)
            self.branch.points.append(taken.fold)
        if taken.point is not None:
            turned = self._changed(taken, taken.point)
            if turned is None:
                return self._ends(f"contact is lost at mu = {new[3]:.9g}")
            turn = turned
        falls = new[3] < self.branch.points[-1].z[3] and self.branch.folds
        self.branch.points.append(Point(new, self.state, taken.error))
        if new[3] < 0.0 or (falls and self.rising):
            return self._ends(_turned_back(self.branch))
        pad = self.statics.model.pad
        if np.max(np.abs(new[:2])) > self.settings.farthest * (pad.L1 + pad.L2):
            return self._ends(f"the equilibrium runs away to infinity near mu = {new[3]:.9g}")
        if why := self.statics.why_hidden(new):
            return self._ends(f"the branch from mu = 0 is lost at mu = {new[3]:.9g}: {why}")
        turned = turn - self.ahead
        known = taken.point is None and np.max(np.abs(turned)) > TURNED
        self.bend = turned / self.step if known else np.zeros(4)
        self.z, self.ahead = new, turn
        longest = self.settings.longest_step * (1.0 + 0.1 * float(np.max(np.abs(new * self.scale))))
        self.step = min(self.settings.growth * self.step, longest)
        return True

    def _corrected(self) -> _Step | None:
        """The next step; None where it is too long."""
        guess = self.z + self.step * self.ahead / self.scale
        row = self.ahead * self.scale
        start = guess + self.step**2 / 2 * self.bend / self.scale
        found = _correct(self.statics, start, self.state, row, float(row @ guess))
        if found is None or self._far(found[0], guess) > self.settings.correction * self.step:
            return None
        new, turn = found[0], self._along(found[1], self.ahead)
        point, error = None, 0.0
        if turn @ self.ahead < self.settings.cosine:
            return None
        first = self.step
        for one in _changes(self.statics, new, self.state):
            crossing = contact_change(self.statics, new, self.state, one)
            if crossing is None or not self._within(crossing.z, guess):
                return None
            along = float(self.ahead @ ((crossing.z - self.z) * self.scale))
            if point is None or along < first:
                first, at, point = along, crossing, one
        if point is not None:
            new, error = at.z, at.error
            turn = self._tangent(new, self.ahead)
        between = self._between(new, turn)
        if _changes(self.statics, between, self.state):
            return None  # a gap that passes zero twice
        if np.sign(turn[3]) == np.sign(self.ahead[3]):
            folds_twice = np.any(np.diff(between[3]) * turn[3] < 0.0)
            return None if folds_twice else _Step(new, error, turn, point, None)
        share = self.ahead[3] / (self.ahead[3] - turn[3])
        turns = fold(self.statics, self.z + share * (new - self.z), self.state)
        if turns is None or not self._within(turns.z, new):
            return None
        return _Step(new, error, turn, point, turns)

    def _between(self, new: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """Places (4, n) on the way to a new one, by the cubic with the tangents at both ends."""
        s, length = np.linspace(0.0, 1.0, 9), self._far(new, self.z)
        start, end = length * self.ahead / self.scale, length * turn / self.scale
        chord = new - self.z
        bend = np.outer(start - chord, (1.0 - s)) - np.outer(end - chord, s)
        return self.z[:, None] + np.outer(chord, s) + s * (1.0 - s) * bend

    def _within(self, z: np.ndarray, new: np.ndarray) -> bool:
        """True if a place that was located lies between the present one and a new one."""
        along = float(self.ahead @ ((z - self.z) * self.scale)) / self.step
        whole = float(self.ahead @ ((new - self.z) * self.scale)) / self.step
        close = self._far(z, self.z) / self.step <= along / self.settings.cosine + CLOSE
        return close and -CLOSE <= along <= whole + CLOSE

    def _ended(self, taken: _Step) -> bool | None:
        """True if the branch ends within the step, at the wanted mu or where the pad has turned
        past 90 degrees; None where that asks for a shorter one."""
        new, tilt = taken.z, float(self.statics.tilt(taken.z))
        over = abs(tilt) >= self.settings.tilt
        if over:
            limit = float(np.copysign(self.settings.tilt, tilt))
            at = _at_tilt(self.statics, new, self.state, limit)
            if at is None or taken.fold is not None:
                return None
            new = at
        if taken.fold is not None and taken.fold.z[3] - taken.fold.error > self.mu_max:
            share = (self.mu_max - self.z[3]) / (taken.fold.z[3] - self.z[3])
            # there mu is stationary
            return self._finish(taken.fold.z, 1.0 - np.sqrt(1.0 - share)) or None
        if new[3] >= self.mu_max:
            return self._finish(new, (self.mu_max - self.z[3]) / (new[3] - self.z[3])) or None
        if over:
            self.branch.points.append(Point(new, self.state))
            self._ends(f"the pad turns past 90 degrees on the branch at mu = {new[3]:.9g}")
        return over

    def _finish(self, to: np.ndarray, share: float) -> bool:
        """End the branch at the wanted mu, near a share of the way to a place; False if that
        cannot be done."""
        near = self.z + share * (to - self.z)
        near[3] = self.mu_max
        end = self.statics.newton(near, self.state)
        if end is None or abs(self.statics.tilt(end)) >= self.settings.tilt:
            return False
        if not self._within(end, to) or self._tangent(end, self.ahead)[3] < 0.0:
            return False
        self.branch.points.append(Point(end, self.state))
        self.branch.reached, self.branch.end = True, f"mu = {self.mu_max:g} is reached"
        return True

    def _changed(self, taken: _Step, point: int) -> np.ndarray | None:
        """Go over to the new contact state: the tangent there, None without contact."""
        new, old, self.state = taken.z, self.state, self.state.flip(point)
        if not any(self.state):
            self.branch.points.append(Point(new, old, taken.error))
            return None
        turn = self._tangent(new)
        opens = 1.0 if not self.state[point] else -1.0
        slope = self.statics.gap_derivative(new, point) / self.scale
        turn = turn * np.sign(opens * (slope @ turn))
        self.branch.changes.append(len(self.branch.points))
        if (turn[3] < 0) != (taken.turn[3] < 0):
            self.branch.folds.append(Point(new, self.state, taken.error))
        return np.asarray(turn)


def _changes(statics: Statics, z: np.ndarray, state: State) -> list[int]:
    """The contact points whose gaps at z (4, ...) do not tell the state, beyond rounding."""
    gaps = statics.gaps(z)
    sides = np.where(list(state), 1.0, -1.0)
    wrong = statics.rounding(z) < (gaps.T * sides).T
    return [e for e in range(len(state)) if np.any(wrong[e])]


def _turned_back(branch: Branch) -> str:
    fold = max(branch.folds, key=lambda point: float(point.z[3]), default=None)
    at = f" at mu = {fold.z[3]:.9g}" if fold is not None else ""
    return f"the branch from mu = 0 turns back in a fold{at}"
