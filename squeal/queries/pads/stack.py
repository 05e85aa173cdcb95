"""Many pads at once that differ in a few parameters: equilibria, verdicts, critical friction.

Maps, contours and studies of random pads rest on it. Equilibria are those of the branches that a
query follows, verdicts those of the array kernels of `squeal.linear`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from squeal.equilibrium.branch import BranchEnd, Branches, NodeKind, follow
from squeal.equilibrium.damping import UNSTABLE, normalised_damping
from squeal.equilibrium.find import rests
from squeal.equilibrium.statics import Equilibria, Statics
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear import VERDICTS, damped_verdicts, undamped_verdicts
from squeal.linear.matrices import first_order
from squeal.model.contact import contact_model
from squeal.model.equations import PadModel, Units
from squeal.model.pad import PARAMETERS, Pad
from squeal.numerics.differentiation import complex_step

Names = tuple[str, ...]
Stiffness = tuple[np.ndarray, np.ndarray | None]
QUIET = [VERDICTS.index("stable"), VERDICTS.index("marginal")]
LEVELS = 64  # of mu, between 0 and its end, at which verdicts are taken at least
HALVINGS = 44  # of the interval in which stability is lost: to rounding
SHRINKS = 25  # of an interval in which a margin of stability has its least value
GOLDEN = (3.0 - 5.0**0.5) / 2.0
AT_ONCE = 50_000  # matrices that are judged together; bounds the memory
FOLD, BRANCH_END = "fold", "end of the branch"


def parameters(model: PadModel) -> Names:
    """Names of the parameters that a model's equilibria and matrices depend on."""
    uses = contact_model(model.name).uses
    return tuple(
        name
        for name in PARAMETERS
        if uses(name)
        and getattr(model.pad, name) is not None
        and (name != "V" or model.pad.fall is not None)
    )


class _Ways(NamedTuple):
    """The ways of n pads from mu = 0 up, in m intervals between nodes of their branches.

    pad, start, stop (m,): pad of each interval, and mu at its ends; begins_at_change (m,): whether
    contact changes at its start; at: the equilibria of pads (k,) at mu (k,); mu_end (n,): where the
    branch ends, NaN if it reaches the end of the range, 0 for a pad that rests nowhere; ends: what
    happens there; lost (n,): whether the branch was lost; nowhere (n,): pads that rest nowhere.
    """

    pad: np.ndarray
    start: np.ndarray
    stop: np.ndarray
    begins_at_change: np.ndarray
    at: Callable[[np.ndarray, np.ndarray], Equilibria]
    mu_end: np.ndarray
    ends: list[str]
    lost: np.ndarray
    nowhere: np.ndarray


class _Judged(NamedTuple):
    """Of k pads at some friction: where (k,) no mode is unstable, and margins (2, k), see
    `margins`."""

    no_unstable_mode: np.ndarray
    margins: np.ndarray


def _levels(ways: _Ways, mu_max: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of mu on all ways: interval (k,) of each, its number (k,) within it, and mu (k,)."""
    parts = np.maximum(np.ceil((ways.stop - ways.start) / mu_max * LEVELS), 2).astype(int)
    counts = parts + 1
    interval = np.repeat(np.arange(len(counts)), counts)
    first_of_interval = np.cumsum(counts) - counts
    level = np.arange(interval.size) - np.repeat(first_of_interval, counts)
    share = np.minimum(level / parts[interval], 1.0 - 1e-9)  # the contact of the interval
    mu = ways.start[interval] + share * (ways.stop - ways.start)[interval]
    return interval, level, mu


class Losses(NamedTuple):
    """Where n pads first lose stability or the equilibrium: mu (n,), NaN if they keep both.

    kinds, hertz (n,): of what happens there; unknown (n,): where that could not be decided;
    nowhere (n,): pads that rest nowhere without friction, whose mu is 0.
    """

    mu: np.ndarray
    kinds: list[str]
    hertz: np.ndarray
    unknown: np.ndarray
    nowhere: np.ndarray


def normalised(pad: Pad, X: np.ndarray) -> np.ndarray:
    """Matrices X (3, 3, n) of pads in coordinates with a mass matrix of one, (n, 3, 3)."""
    unit = 1.0 / np.sqrt(np.broadcast_arrays(pad.m, pad.m, pad.I, X[0, 0])[:3])
    return np.moveaxis(X * (unit[:, None] * unit), -1, 0)


@dataclass(frozen=True, eq=False)
class PadStack:
    """The pads of a scene with the parameters `names` replaced by values (len(names), n).

    statics: in units of the scene's own pad; B3, which is linearised about the origin, has no
    branches.
    """

    scene: Scene
    names: Names
    values: np.ndarray
    statics: Statics

    @staticmethod
    def of(scene: Scene, names: Names, values: np.ndarray) -> "PadStack":
        """Raises InputError for values that a parameter may not take."""
        changes: dict[str, Any] = dict(zip(names, values, strict=True))
        model = scene.pad_model.replace(**changes)
        if model.linear:
            units = Units(mass=1.0, length=1.0, time=1.0, lever=1.0)
        else:
            units = Statics.of(scene.pad_model).units
        return PadStack(scene, names, values, Statics(units.scaled(model), units))

    @property
    def n(self) -> int:
        return self.values.shape[1]

    @property
    def linear(self) -> bool:
        return self.scene.pad_model.linear

    @property
    def mu(self) -> np.ndarray:
        """The friction (n,) of each pad."""
        return np.broadcast_to(np.asarray(self.statics.model.pad.mu, dtype=float), (self.n,))

    @cached_property
    def rest(self) -> Equilibria:
        """Where the pads rest without friction."""
        return rests(self.statics, self.n)

    def branches(self, mu_max: np.ndarray) -> tuple[Branches, np.ndarray]:
        """The branches from mu = 0 to mu_max (n,), and pads (n,) whose branch was lost."""
        branches = follow(self.statics, self.rest, mu_max)
        return branches, branches.end == BranchEnd.LOST

    def origin(self, mu: np.ndarray) -> Equilibria:
        """Full contact about the origin at frictions mu (k,)."""
        z = np.zeros((4, mu.size))
        z[3] = mu
        on = np.ones((self.statics.model.law.points, mu.size), dtype=bool)
        return Equilibria(z, on, np.ones(mu.size, dtype=bool))

    def at_mu(self) -> tuple[Equilibria, np.ndarray]:
        """The equilibrium of each pad at its own friction, and where (n,) that is unknown."""
        at = self.origin(self.mu)
        if self.linear:
            return at, np.zeros(self.n, dtype=bool)
        branches, unknown = self.branches(self.mu)
        if not branches.owner.size:  # none rests anywhere
            return at._replace(exists=~at.exists), unknown
        at = branches.at(np.arange(self.n), self.mu)
        hidden = at.exists & self.statics.hidden(at.z)
        touches = at.touching.any(axis=0)
        return at._replace(exists=at.exists & touches & ~hidden), unknown | hidden

    @cached_property
    def damping(self) -> np.ndarray | None:
        """Mass-normalised damping matrices (n, 3, 3) that the scene names, None without.

        Ratios and Rayleigh damping refer to the modes without friction. Raises ComputationError
        where a mode with a ratio is unstable.
        """
        damping = self.scene.damping
        units = self.statics.units
        if damping is None:
            return None
        if damping.matrix is not None:
            turn = np.array([1.0, 1.0, 1.0 / units.length])
            C = np.array(damping.matrix) * np.outer(turn, turn) * units.time / units.mass
            of_each = np.broadcast_to(C[:, :, None], (3, 3, self.n))
            return normalised(self.statics.model.pad, of_each)
        if damping.rayleigh is not None:
            alpha, beta = damping.rayleigh
            damping = Damping(rayleigh=(alpha * units.time, beta / units.time))
        B, stable = normalised_damping(damping, self._at_rest)
        if not self.linear:
            stable |= ~self.rest.exists  # nothing is asked of a pad that rests nowhere
        if not stable.all():
            values = self.values[:, int(np.argmin(stable))]
            pairs = zip(self.names, values, strict=True)
            at = ", ".join(f"{name} = {value:.6g}" for name, value in pairs)
            raise ComputationError(f"{UNSTABLE} at {at}")
        return B

    @cached_property
    def _at_rest(self) -> np.ndarray:
        """Mass-normalised stiffness (n, 3, 3) without friction."""
        if self.linear:
            at = self.origin(np.zeros(self.n))
        else:
            # pads that rest nowhere as if in full contact
            at = self.rest._replace(touching=self.rest.touching | ~self.rest.exists)
        stiffness, _ = self._matrices(np.arange(self.n), at)
        return stiffness

    def _matrices(self, pad: np.ndarray, at: Equilibria) -> Stiffness:
        """Mass-normalised stiffness, and what falling friction adds to the damping, (k, 3, 3)."""
        part = self.statics.pick(pad)
        model = part.model.replace(mu=at.z[3])
        q = part.place(at.z)
        contact = 1.0 * at.touching
        K = -complex_step(partial(model.loads, state=contact), q)
        if model.pad.mu_s is None:
            return normalised(model.pad, K), None
        C = -complex_step(partial(model.loads, q, contact), np.zeros(q.shape))
        return normalised(model.pad, K), normalised(model.pad, C)

    def matrices(self, pad: np.ndarray, at: Equilibria) -> Stiffness:
        """Mass-normalised stiffness and damping (k, 3, 3) of pads (k,) about places, the damping
        None where no pad has any."""
        A, B = self._matrices(pad, at)
        if self.damping is not None:
            B = self.damping[pad] if B is None else B + self.damping[pad]
        return A, B

    def fastest(self) -> tuple[np.ndarray, np.ndarray]:
        """Of each pad at its own friction the eigenvalue (n,) of largest real part in rad/s, NaN
        without an equilibrium, and where (n,) that is unknown.

        Without damping, real parts of the size of rounding, next to a coalescence the square root
        of it, are zero.
        """
        places, unknown = self.at_mu()
        here = np.flatnonzero(places.exists)
        A, B = self.matrices(here, places.some(here))
        if B is None:
            values = np.sqrt(-np.linalg.eigvals(A).astype(complex))
            values = np.where(values.real < 0.0, -values, values)
            size = np.abs(values).max(axis=1, keepdims=True)
            values.real[values.real <= 1e-8 * size] = 0.0
        else:
            values = np.linalg.eigvals(first_order(A, B, 1.0)[0]).astype(complex)
        # of several that grow alike the one of largest frequency
        best = np.lexsort((np.abs(values.imag), values.real), axis=1)[:, -1]
        fastest = np.full(self.n, np.nan, dtype=complex)
        fastest[here] = values[np.arange(here.size), best] / self.statics.units.time
        return fastest, unknown

    def _ways(self, mu_max: float) -> _Ways:
        """The ways of all pads from mu = 0 to mu_max, or to the end of their branches."""
        if self.linear:
            return _Ways(
                pad=np.arange(self.n),
                start=np.zeros(self.n),
                stop=np.full(self.n, mu_max),
                begins_at_change=np.zeros(self.n, dtype=bool),
                at=lambda _pad, mu: self.origin(mu),
                mu_end=np.full(self.n, np.nan),
                ends=[""] * self.n,
                lost=np.zeros(self.n, dtype=bool),
                nowhere=np.zeros(self.n, dtype=bool),
            )
        branches, lost = self.branches(np.full(self.n, mu_max))
        nowhere = branches.end == BranchEnd.NO_EQUILIBRIUM
        mu_end = np.where(nowhere, 0.0, branches.mu_end)
        mu_end[branches.end == BranchEnd.REACHED] = np.nan
        nodes = np.arange(len(branches.owner))
        starts = nodes[nodes < branches.last[branches.owner]]
        return _Ways(
            pad=branches.owner[starts],
            start=branches.z[3, starts],
            stop=branches.z[3, starts + 1],
            begins_at_change=branches.kind[starts] == NodeKind.CONTACT_CHANGE,
            at=branches.at,
            mu_end=mu_end,
            ends=[FOLD if end == BranchEnd.FOLD else BRANCH_END for end in branches.end],
            lost=lost,
            nowhere=nowhere,
        )

    def _judge(self, ways: _Ways, pad: np.ndarray, mu: np.ndarray) -> _Judged:
        """Of pads (k,) at mu (k,) on their ways where no mode is unstable, and the margins."""
        no_unstable_mode = np.empty(pad.size, dtype=bool)
        margin = np.empty((2, pad.size))
        for first in range(0, pad.size, AT_ONCE):
            part = slice(first, first + AT_ONCE)
            equilibria = ways.at(pad[part], mu[part])
            A, B = self.matrices(pad[part], equilibria)
            no_unstable_mode[part] = np.isin(verdicts(A, B), QUIET) & equilibria.exists
            margin[:, part] = margins(A, B)
        return _Judged(no_unstable_mode, margin)

    def first_losses(self, mu_max: float) -> Losses:
        """Where each pad first loses stability or its equilibrium, on the way from 0 to mu_max.

        Verdicts are taken at `LEVELS` values of mu or more between all nodes of the branch, in the
        contact state there, and the first interval with a change is halved. An interval within
        which a margin of stability comes close to zero is looked into; narrower windows may be
        missed.
        """
        ways = self._ways(mu_max)
        interval, level, mu = _levels(ways, mu_max)
        pad = ways.pad[interval]
        judged = self._judge(ways, pad, mu)
        for which in range(len(judged.margins)):
            self._look_between(ways, pad, interval, mu, judged, which)
        unstable = np.flatnonzero(~judged.no_unstable_mode)
        losing, index = np.unique(pad[unstable], return_index=True)
        first = unstable[index]
        low = mu[np.maximum(first - 1, 0)]
        high = mu[first]
        # where stability is lost at once, or with a change of contact, that is the place
        begins_there = (high == 0.0) | ways.begins_at_change[interval[first]]
        low = np.where((level[first] == 0) & begins_there, high, low)
        for _ in range(HALVINGS):
            i = np.flatnonzero(high - low > 4e-16 * mu_max)
            if not i.size:
                break
            middle = (low[i] + high[i]) / 2
            still = self._judge(ways, losing[i], middle).no_unstable_mode
            low[i] = np.where(still, middle, low[i])
            high[i] = np.where(still, high[i], middle)
        loss = ways.mu_end.copy()
        loss[losing] = high
        kinds = list(ways.ends)
        hertz = np.where(np.array(kinds) == FOLD, 0.0, np.nan)
        equilibria = ways.at(losing, high)
        A, B = self.matrices(losing, equilibria)
        codes = np.where(equilibria.exists, verdicts(A, B), QUIET[0])
        for i, code, frequency in zip(losing, codes, self.meeting(A, B), strict=True):
            if code not in QUIET:
                kinds[i] = VERDICTS[code]
                hertz[i] = frequency if kinds[i] == "flutter" else 0.0
        lost_before = ways.lost & ~np.isin(np.arange(self.n), losing)
        unknown = lost_before | self._slow_modes_hidden()
        return Losses(
            mu=np.where(unknown, np.nan, loss),
            kinds=kinds,
            hertz=hertz,
            unknown=unknown,
            nowhere=ways.nowhere,
        )

    def _look_between(
        self,
        ways: _Ways,
        pad: np.ndarray,
        interval: np.ndarray,
        mu: np.ndarray,
        judged: _Judged,
        which: int,
    ) -> None:
        """Where a margin has a low least value between levels (k,), look for unstable modes there
        by golden section; a level beside which they are found is moved there."""
        margin = judged.margins[which]
        stable = judged.no_unstable_mode
        i = np.arange(1, pad.size - 1)
        before, here, after = margin[i - 1], margin[i], margin[i + 1]
        with np.errstate(all="ignore"):  # of the parabola through the three
            least = here - (after - before) ** 2 / (8 * (before - 2 * here + after))
        is_low = (here < before) & (here < after) & (least < here / 2)
        same_interval = (interval[i - 1] == interval[i]) & (interval[i] == interval[i + 1])
        all_stable = stable[i - 1] & stable[i] & stable[i + 1]
        j = i[same_interval & all_stable & is_low]
        if not j.size:
            return
        low = mu[j - 1]
        high = mu[j + 1]
        for _ in range(SHRINKS):
            width = high - low
            left = low + GOLDEN * width
            right = high - GOLDEN * width
            inner = self._judge(ways, np.tile(pad[j], 2), np.concatenate([left, right]))
            margins_inside = np.where(inner.no_unstable_mode, inner.margins[which], -np.inf)
            at_left, at_right = margins_inside.reshape(2, -1)
            keep_left = at_left <= at_right
            low = np.where(keep_left, low, left)
            high = np.where(keep_left, right, high)
        unstable = np.minimum(at_left, at_right) == -np.inf
        mu[j[unstable]] = np.where(keep_left, left, right)[unstable]
        stable[j[unstable]] = False

    def _slow_modes_hidden(self) -> np.ndarray:
        """Where (n,) rounding of one stiffness or damping may hide the slow modes."""
        sizes = np.linalg.svd(self._at_rest, compute_uv=False)
        largest = sizes[:, 0]
        if self.damping is not None:
            rates = np.linalg.norm(self.damping, 2, axis=(1, 2))
            largest = np.maximum(largest, rates**2)
        return np.asarray(sizes[:, -1] <= 1e-12 * largest)

    def meeting(self, A: np.ndarray, B: np.ndarray | None) -> np.ndarray:
        """Frequencies (k,) in Hz of the pairs that are next to growth: of the two nearest modes
        without damping, else of the pair that grows most."""
        rows = np.arange(len(A))
        if B is None or not B.any():
            squares = np.linalg.eigvals(A).astype(complex)
            i, j = np.triu_indices(3, 1)
            nearest = np.argmin(np.abs((squares[:, i] - squares[:, j]).real), axis=1)
            one = np.sqrt(squares[rows, i[nearest]])
            other = np.sqrt(squares[rows, j[nearest]])
            rate = (one + other).real / 2
        else:
            roots = np.linalg.eigvals(first_order(A, B, 1.0)[0])
            growth = np.where(roots.imag > 0.0, roots.real, -np.inf)
            rate = roots.imag[rows, np.argmax(growth, axis=1)]
        return np.asarray(rate / self.statics.units.time / (2 * np.pi))


def verdicts(A: np.ndarray, B: np.ndarray | None) -> np.ndarray:
    """Verdict codes (k,), indices into `VERDICTS`, of z'' + B z' + A z = 0, stacks (k, 3, 3)."""
    if B is None or not B.any():
        return undamped_verdicts(A)
    codes = np.empty(len(A), dtype=np.int8)
    damped = B.any(axis=(1, 2))
    codes[~damped] = undamped_verdicts(A[~damped])
    codes[damped] = damped_verdicts(A[damped], B[damped])
    return codes


def margins(A: np.ndarray, B: np.ndarray | None) -> np.ndarray:
    """Two smooth numbers (2, k) that are positive where z'' + B z' + A z = 0 does not grow and of
    which one vanishes where it begins to: by a pair, and by a real root.

    Without damping the discriminant of the polynomial in lambda^2, else the product of the sums of
    two roots (the last Hurwitz determinant but one); and the determinant of A.
    """
    det = np.linalg.det(A)
    if B is None or not B.any():
        squares = np.linalg.eigvals(A)
        a, b, c = squares.T
        differences = (a - b) * (a - c) * (b - c)
        return np.array([(differences * differences).real, det])
    roots = np.linalg.eigvals(first_order(A, B, 1.0)[0])
    i, j = np.triu_indices(roots.shape[1], 1)
    return np.array([-np.prod(roots[:, i] + roots[:, j], axis=1).real, det])
