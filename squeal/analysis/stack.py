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
        model, linear = scene.pad_model.replace(**changes), scene.pad_model.linear
        units = Units(1.0, 1.0, 1.0, 1.0) if linear else Statics.of(scene.pad_model).units
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
        z, on, there = branches.at(np.arange(self.n), self.mu)
        hidden = there & self.statics.hidden(z)
        return Equilibria(z, on, there & on.any(axis=0) & ~hidden), unknown | hidden

    @cached_property
    def damping(self) -> np.ndarray | None:
        """Mass-normalised damping matrices (n, 3, 3) that the scene names, None without.

        Ratios and Rayleigh damping refer to the modes without friction. Raises ComputationError
        where a mode with a ratio is unstable.
        """
        damping, units = self.scene.damping, self.statics.units
        if damping is None:
            return None
        if damping.matrix is not None:
            turn = np.array([1.0, 1.0, 1.0 / units.length])
            C = np.array(damping.matrix) * np.outer(turn, turn) * units.time / units.mass
            return normalised(
                self.statics.model.pad, np.broadcast_to(C[:, :, None], (3, 3, self.n))
            )
        if damping.rayleigh is not None:
            alpha, beta = damping.rayleigh
            damping = Damping(rayleigh=(alpha * units.time, beta / units.time))
        B, stable = normalised_damping(damping, self._at_rest)
        stable |= False if self.linear else ~self.rest.exists
        if not stable.all():
            own = zip(self.names, self.values[:, int(np.argmin(stable))], strict=True)
            at = ", ".join(f"{name} = {value:.6g}" for name, value in own)
            raise ComputationError(f"{UNSTABLE} at {at}")
        return B

    @cached_property
    def _at_rest(self) -> np.ndarray:
        """Mass-normalised stiffness (n, 3, 3) without friction."""
        at = self.origin(np.zeros(self.n))
        if not self.linear:
            at = self.rest._replace(touching=self.rest.touching | ~self.rest.exists)
        return self._matrices(np.arange(self.n), at)[0]

    def _matrices(self, pad: np.ndarray, at: Equilibria) -> Stiffness:
        """Mass-normalised stiffness, and what falling friction adds to the damping, (k, 3, 3)."""
        part = self.statics.pick(pad)
        model, q = part.model.replace(mu=at.z[3]), part.place(at.z)
        on, falling = 1.0 * at.touching, None
        K = -complex_step(partial(model.loads, state=on), q)
        if model.pad.mu_s is not None:
            rates = -complex_step(partial(model.loads, q, on), np.zeros(q.shape))
            falling = normalised(model.pad, rates)
        return normalised(model.pad, K), falling

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
        A, B = self.matrices(here, Equilibria(*(part[..., here] for part in places)))
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

    def first_losses(self, mu_max: float) -> Losses:
        """Where each pad first loses stability or its equilibrium, on the way from 0 to mu_max.

        Verdicts are taken at `LEVELS` values of mu or more between all nodes of the branch, in the
        contact state there, and the first interval with a change is halved. An interval within
        which a margin of stability comes close to zero is looked into; narrower windows may be
        missed.
        """
        owner = every = np.arange(self.n)
        starts, stops = np.zeros(self.n), np.full(self.n, mu_max)
        jumps = unknown = nowhere = np.zeros(self.n, dtype=bool)
        lost, kinds = np.full(self.n, np.nan), [""] * self.n
        at: Callable[[np.ndarray, np.ndarray], Equilibria] = lambda _, mu: self.origin(mu)  # noqa: E731
        if not self.linear:
            branches, unknown = self.branches(np.full(self.n, mu_max))
            nowhere = branches.end == BranchEnd.NO_EQUILIBRIUM
            lost = np.where(nowhere, 0.0, branches.mu_end)
            lost[branches.end == BranchEnd.REACHED] = np.nan
            kinds = [
                "fold" if end == BranchEnd.FOLD else "end of the branch" for end in branches.end
            ]
            j = np.arange(len(branches.owner))
            j = j[j < branches.last[branches.owner]]
            owner, starts, stops = branches.owner[j], branches.z[3, j], branches.z[3, j + 1]
            jumps = branches.kind[j] == NodeKind.CONTACT_CHANGE
            at = branches.at

        def calm_at(pad: np.ndarray, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Where nothing grows, and the margins of stability."""
            places = at(pad, mu)
            A, B = self.matrices(pad, places)
            return np.isin(verdicts(A, B), QUIET) & places.exists, margins(A, B)

        parts = np.maximum(np.ceil((stops - starts) / mu_max * LEVELS), 2).astype(int) + 1
        piece = np.repeat(np.arange(len(parts)), parts)
        k = np.arange(piece.size) - np.repeat(np.cumsum(parts) - parts, parts)
        share = np.minimum(k / (parts[piece] - 1), 1.0 - 1e-9)  # the contact of the interval
        pad, mu = owner[piece], starts[piece] + share * (stops - starts)[piece]
        calm, margin = np.empty(pad.size, dtype=bool), np.empty((2, pad.size))
        for first in range(0, pad.size, 50_000):  # bounds the memory
            part = slice(first, first + 50_000)
            calm[part], margin[:, part] = calm_at(pad[part], mu[part])
        i = np.arange(1, pad.size - 1)
        same = (piece[i - 1] == piece[i]) & (piece[i] == piece[i + 1])
        for which in range(2):  # where a margin has a low least value between values of mu
            before, here, after = (margin[which, i + d] for d in (-1, 0, 1))
            with np.errstate(all="ignore"):
                least = here - (after - before) ** 2 / (8 * (before - 2 * here + after))
            low_one = (here < before) & (here < after) & (least < here / 2)
            j = i[same & calm[i - 1] & calm[i] & calm[i + 1] & low_one]
            if not j.size:
                continue
            low, high = mu[j - 1], mu[j + 1]
            for _ in range(SHRINKS):
                inner = np.array([low + GOLDEN * (high - low), high - GOLDEN * (high - low)])
                quiet, at_inner = calm_at(np.tile(pad[j], 2), inner.ravel())
                one, other = np.where(quiet, at_inner[which], -np.inf).reshape(2, -1)
                left = one <= other
                low, high = np.where(left, low, inner[0]), np.where(left, inner[1], high)
            grows = np.minimum(one, other) == -np.inf
            mu[j[grows]], calm[j[grows]] = np.where(left, *inner)[grows], False
        grows = np.flatnonzero(~calm)
        who, index = np.unique(pad[grows], return_index=True)
        node = grows[index]
        low, high = mu[np.maximum(node - 1, 0)], mu[node]
        low = np.where((k[node] == 0) & (jumps[piece[node]] | (high == 0.0)), high, low)  # exact
        for _ in range(HALVINGS):
            i = np.flatnonzero(high - low > 4e-16 * mu_max)
            if not i.size:
                break
            middle = (low[i] + high[i]) / 2
            quiet = calm_at(who[i], middle)[0]
            low[i], high[i] = np.where(quiet, middle, low[i]), np.where(quiet, high[i], middle)
        # rounding of one stiffness or damping may hide the slow modes
        sizes = np.linalg.svd(self._at_rest, compute_uv=False)
        squares = sizes[:, 0]
        if self.damping is not None:
            squares = np.maximum(squares, np.linalg.norm(self.damping, 2, axis=(1, 2)) ** 2)
        stiff = sizes[:, -1] <= 1e-12 * squares
        lost[who], unknown = high, (unknown & ~np.isin(every, who)) | stiff
        hertz = np.where(np.array(kinds) == "fold", 0.0, np.nan)
        places = at(who, high)
        A, B = self.matrices(who, places)
        codes = np.where(places.exists, verdicts(A, B), QUIET[0])
        for i, code, frequency in zip(who, codes, self.meeting(A, B), strict=True):
            if code not in QUIET:
                kinds[i] = VERDICTS[code]
                hertz[i] = frequency if kinds[i] == "flutter" else 0.0
        return Losses(np.where(unknown, np.nan, lost), kinds, hertz, unknown, nowhere)

    def meeting(self, A: np.ndarray, B: np.ndarray | None) -> np.ndarray:
        """Frequencies (k,) in Hz of the pairs that are next to growth: of the two nearest modes
        without damping, else of the pair that grows most."""
        rows = np.arange(len(A))
        if B is None or not B.any():
            s = np.linalg.eigvals(A).astype(complex)
            i, j = np.triu_indices(3, 1)
            pair = np.argmin(np.abs((s[:, i] - s[:, j]).real), axis=1)
            rate = (np.sqrt(s[rows, i[pair]]) + np.sqrt(s[rows, j[pair]])).real / 2
        else:
            roots = np.linalg.eigvals(first_order(A, B, 1.0)[0])
            growth = np.where(roots.imag > 0.0, roots.real, -np.inf)
            rate = roots.imag[rows, np.argmax(growth, axis=1)]
        return np.asarray(rate / self.statics.units.time / (2 * np.pi))


def verdicts(A: np.ndarray, B: np.ndarray | None) -> np.ndarray:
    """Verdict codes (k,), indices into `VERDICTS`, of z'' + B z' + A z = 0, stacks (k, 3, 3)."""
    if B is None or not B.any():
        return undamped_verdicts(A)
    codes, damped = np.empty(len(A), dtype=np.int8), B.any(axis=(1, 2))
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
        s = np.linalg.eigvals(A)
        gaps = (s[:, 0] - s[:, 1]) * (s[:, 0] - s[:, 2]) * (s[:, 1] - s[:, 2])
        return np.array([(gaps * gaps).real, det])
    roots = np.linalg.eigvals(first_order(A, B, 1.0)[0])
    i, j = np.triu_indices(roots.shape[1], 1)
    return np.array([-np.prod(roots[:, i] + roots[:, j], axis=1).real, det])
