"""Many pads at once that differ in a few parameters: equilibria, verdicts, critical friction.

Maps, contours and studies of random pads rest on it. Equilibria are those on the branches from
mu = 0, verdicts those of the array kernels of `squeal.linear`.

Shapes: a stack has n pads. A computation takes k cases, each of them a pad at some friction: `pad`
(k,) are the numbers of the pads, of which one may occur several times.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.equilibrium.branch import BranchEnd, Branches, NodeKind, follow
from squeal.equilibrium.damping import UNSTABLE, normalised_damping
from squeal.equilibrium.find import frictionless_equilibria
from squeal.equilibrium.statics import Equilibria, Statics
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear import VERDICTS, damped_verdicts, errors_may_change, undamped_verdicts
from squeal.linear.continuation import Bools
from squeal.linear.matrices import EPS, Array, first_order
from squeal.linear.paths import Indices
from squeal.linear.roots import ComplexArray
from squeal.model.contact import contact_model
from squeal.model.equations import PadModel, Units
from squeal.model.pad import PARAMETERS, Pad
from squeal.numerics.differentiation import complex_step

Names = tuple[str, ...]
StiffnessAndDamping = tuple[Array, Array | None]
STABLE_OR_MARGINAL = [VERDICTS.index("stable"), VERDICTS.index("marginal")]
GRID_POINTS = 64  # the least number of values of mu, from 0 to its end, for verdicts
HALVINGS = 44  # of the interval in which stability is lost: to rounding
SHRINKS = 25  # of an interval, by golden section, in which a margin of stability has its minimum
GOLDEN = (3.0 - 5.0**0.5) / 2.0  # 0.38: share at which golden section divides an interval
KNOWN = 5e-12  # share of an entry: to 12 digits, as the referee takes those of one pad
HIDDEN = 1e-12  # share of the largest square of a frequency, up to which rounding hides others
AT_ONCE = 50_000  # matrices that are judged together; bounds the memory
FOLD, BRANCH_END = "fold", "end of the branch"


def parameters(model: PadModel) -> Names:
    """Names of the parameters that a model's equilibria and matrices depend on."""
    uses = contact_model(model.name).uses
    names = []
    for name in PARAMETERS:
        is_given = getattr(model.pad, name) is not None
        # the speed of the surface counts only where friction falls with it
        is_without_effect = name == "V" and model.pad.fall is None
        if uses(name) and is_given and not is_without_effect:
            names.append(name)
    return tuple(names)


class _Intervals(NamedTuple):
    """The branches of n pads from mu = 0 up, cut into m intervals between their nodes.

    Within an interval the contact state stays, so that the matrices are smooth in mu.

    Attributes
    ----------
    pad, start, stop : array (m,)
        Number of the pad of each interval, and mu at its ends.
    begins_at_change : array (m,) of bool
        Whether contact changes at its start.
    at : callable
        Gives the equilibria of pads (k,) at mu (k,).
    mu_end : array (n,)
        Where the branch ends; NaN if it reaches the end of the range, 0 for a pad without an
        equilibrium at mu = 0.
    ends : list of n str
        What happens there: a fold or, for any other end, "end of the branch". That also stands
        where the branch reaches the end of the range; "" of a linear model, which has no branch.
    interrupted : array (n,) of bool
        Whether the branch could not be continued numerically.
    no_start : array (n,) of bool
        Pads without an equilibrium in contact at mu = 0.
    """

    pad: Indices
    start: Array
    stop: Array
    begins_at_change: Bools
    at: Callable[[Indices, Array], Equilibria]
    mu_end: Array
    ends: list[str]
    interrupted: Bools
    no_start: Bools


class _Stability(NamedTuple):
    """Stability of k cases.

    Attributes
    ----------
    no_unstable_mode : array (k,) of bool
        Whether all modes are stable or marginal.
    margins : array (2, k)
        Numbers that vanish where a pair, and where a real root, begins to grow; see `margins`.
    """

    no_unstable_mode: Bools
    margins: Array


class _FrictionGrid(NamedTuple):
    """k values of mu on all intervals, at which verdicts are computed, interval by interval.

    Attributes
    ----------
    interval : array (k,)
        Number of the interval in which the value lies.
    number : array (k,)
        Number of the value within its interval, from 0.
    mu : array (k,)
        The value.
    """

    interval: Indices
    number: Indices
    mu: Array


def _friction_grid(intervals: _Intervals, mu_max: float) -> _FrictionGrid:
    """Even values in each interval, its ends included, `GRID_POINTS` or more over 0 to mu_max."""
    widths = intervals.stop - intervals.start
    steps = np.maximum(np.ceil(widths / mu_max * GRID_POINTS), 2).astype(int)
    counts = steps + 1
    interval = np.repeat(np.arange(len(counts)), counts)
    first_of_interval = np.cumsum(counts) - counts
    number = np.arange(interval.size) - np.repeat(first_of_interval, counts)
    # the last value lies just before the end of the interval, where contact may change
    share = np.minimum(number / steps[interval], 1.0 - 1e-9)
    mu = intervals.start[interval] + share * widths[interval]
    return _FrictionGrid(interval, number, mu)


class Losses(NamedTuple):
    """Where n pads first lose stability or their equilibrium, by rising friction.

    Attributes
    ----------
    mu : array (n,)
        The friction; NaN if nothing is lost, or if it is unknown.
    kinds : list of n str
        What happens there: flutter, divergence, a fold or the end of the branch. Where mu is NaN
        nothing may have happened: what stands there is as in `ends` of `_Intervals`.
    frequency_hz : array (n,)
        Of the mode that loses stability, 0 if none vibrates, NaN if there is none.
    unknown : array (n,) of bool
        Where it could not be decided.
    no_start : array (n,) of bool
        Pads without an equilibrium in contact at mu = 0; their mu is 0.
    """

    mu: Array
    kinds: list[str]
    frequency_hz: Array
    unknown: Bools
    no_start: Bools


def compiled_statics(statics: Statics, n: int) -> Statics:
    """Statics of n pads in machine code, or as they are where heyoka is not installed."""
    try:
        from squeal.equilibrium.compiled import CompiledStatics  # a query needs no compiler
    except ImportError:
        return statics
    return CompiledStatics.of_pads(statics, n)


def normalised(pad: Pad, X: Array) -> Array:
    """Mass-normalise matrices X (3, 3, n) of n pads: M^-1/2 X M^-1/2, (n, 3, 3)."""
    # m, m, I of the coordinates x, y, theta, each broadcast to (n,) as X[0, 0] is
    masses = np.broadcast_arrays(pad.m, pad.m, pad.I, X[0, 0])[:3]
    unit = 1.0 / np.sqrt(masses)
    return np.moveaxis(X * (unit[:, None] * unit), -1, 0)


@dataclass(frozen=True, eq=False)
class PadStack:
    """n pads, each of them that of a scene with some parameters replaced.

    Attributes
    ----------
    scene : Scene
        The scene.
    names : tuple of p str
        The parameters that are replaced.
    values : array (p, n)
        Their values in each pad, SI units.
    statics : Statics
        The statics of all pads, in natural units of the scene's own pad. B3, which is linearised
        about the origin, has no branches of equilibria.
    """

    scene: Scene
    names: Names
    values: Array
    statics: Statics

    @staticmethod
    def of(scene: Scene, names: Names, values: Array, compiled: bool = False) -> "PadStack":
        """The pads of a scene with the parameters `names` replaced by values (len(names), n).

        compiled: in machine code where heyoka is installed, see `squeal.equilibrium.compiled`.
        Raises InputError for values that a parameter may not take.
        """
        model = scene.pad_model.replace(**dict(zip(names, values, strict=True)))
        if model.linear:
            # natural units serve the tolerances of steps along a branch, and need a load: a linear
            # model has neither a branch nor a load
            units = Units(mass=1.0, length=1.0, time=1.0, lever=1.0)
        else:
            units = Statics.of(scene.pad_model).units
        statics = Statics(units.scaled(model), units)
        if compiled and not model.linear:
            statics = compiled_statics(statics, values.shape[1])
        return PadStack(scene, names, values, statics)

    @staticmethod
    def of_scenes(scene: Scene, changed: Sequence[Scene]) -> "PadStack":
        """The pads of scenes that are a scene with some parameters changed."""
        # all parameters, since a change of one may move others, as I follows from m
        names = parameters(scene.pad_model)
        rows = []  # of each parameter its values in all pads
        for name in names:
            rows.append([getattr(changed_scene.pad, name) for changed_scene in changed])
        return PadStack.of(scene, names, np.array(rows))

    @property
    def n(self) -> int:
        """The number of pads."""
        return self.values.shape[1]

    @property
    def linear(self) -> bool:
        """True if the model is linear, so that it is linearised about the origin."""
        return self.scene.pad_model.linear

    @property
    def mu(self) -> Array:
        """The friction (n,) of each pad."""
        return np.broadcast_to(np.asarray(self.statics.model.pad.mu, dtype=float), (self.n,))

    @cached_property
    def without_friction(self) -> Equilibria:
        """The equilibria of the n pads without friction."""
        return frictionless_equilibria(self.statics, self.n)

    def branches(self, mu_max: Array) -> Branches:
        """Follow the branches of equilibria from mu = 0 to mu_max (n,)."""
        return follow(self.statics, self.without_friction, mu_max)

    def origin(self, mu: Array) -> Equilibria:
        """Full contact about the origin at frictions mu (k,), as if an equilibrium."""
        z = np.zeros((4, mu.size))  # rows: x, y, w theta and mu
        z[3] = mu
        touching = np.ones((self.statics.model.law.points, mu.size), dtype=bool)
        return Equilibria(z, touching, np.ones(mu.size, dtype=bool))

    def at_mu(self) -> tuple[Equilibria, Bools]:
        """Compute the equilibria of the n pads, each at its own friction.

        A pad has no equilibrium (`exists` is false) where the branch from mu = 0 ends below its
        friction, or where nothing touches. The array (n,) beside the equilibria says where it is
        unknown whether a pad has one: where the branch could not be continued, and where rounding
        hides the contact forces. A linear model counts the origin as an equilibrium of each pad.
        """
        origin = self.origin(self.mu)
        if self.linear:
            return origin, np.zeros(self.n, dtype=bool)
        branches = self.branches(self.mu)
        interrupted = branches.end == BranchEnd.INTERRUPTED
        if not branches.owner.size:  # no branch: no pad has an equilibrium without friction
            return origin._replace(exists=self.without_friction.exists), interrupted
        at_mu = branches.at(np.arange(self.n), self.mu)
        hidden = at_mu.exists & self.statics.unresolved(at_mu.z)  # by rounding
        touches = at_mu.touching.any(axis=0)
        return at_mu._replace(exists=at_mu.exists & touches & ~hidden), interrupted | hidden

    @cached_property
    def damping(self) -> Array | None:
        """Mass-normalised damping matrices (n, 3, 3) that the scene names, in natural units.

        None without damping.

        Ratios and Rayleigh damping refer to the modes without friction. Raises ComputationError
        where a mode with a ratio is unstable.
        """
        damping = self.scene.damping
        units = self.statics.units
        if damping is None:
            return None
        if damping.matrix is not None:
            C = units.scaled_damping(damping.matrix)
            same_for_all = np.broadcast_to(C[:, :, None], (3, 3, self.n))
            return normalised(self.statics.model.pad, same_for_all)
        if damping.rayleigh is None:
            in_natural_units = damping  # ratios have no unit
        else:
            alpha, beta = damping.rayleigh
            in_natural_units = Damping(rayleigh=(alpha * units.time, beta / units.time))
        # has_ratios (n,): whether each mode of a pad without friction may have a damping ratio
        B, has_ratios = normalised_damping(in_natural_units, self._stiffness_without_friction)
        if not self.linear:
            has_ratios |= ~self.without_friction.exists  # a pad without an equilibrium has no modes
        if not has_ratios.all():
            values = self.values[:, int(np.argmin(has_ratios))]  # of the first pad without them
            texts = []
            for name, value in zip(self.names, values, strict=True):
                texts.append(f"{name} = {value:.6g}")
            raise ComputationError(f"{UNSTABLE} at {', '.join(texts)}")
        return B

    @cached_property
    def _stiffness_without_friction(self) -> Array:
        """Mass-normalised stiffness (n, 3, 3) without friction.

        Pads without an equilibrium have that of full contact, which no answer shows.
        """
        if self.linear:
            at = self.origin(np.zeros(self.n))
        else:
            rest = self.without_friction
            at = rest._replace(touching=rest.touching | ~rest.exists)
        stiffness, _ = self._matrices(np.arange(self.n), at)
        return stiffness

    def _matrices(self, pad: Indices, equilibria: Equilibria) -> StiffnessAndDamping:
        """Linearise pads (k,) about k equilibria, without the damping that the scene names.

        Returns the mass-normalised stiffness, and the damping that falling friction makes, each
        (k, 3, 3): minus the derivatives of the loads by the coordinates (x, y, theta) and by the
        velocities. Both are exact to rounding: complex steps, and for the stiffness of many pads
        formulas that heyoka derives. Without falling friction the damping is None.
        """
        statics = self.statics.pick(pad)
        contact = 1.0 * equilibria.touching
        K = statics.stiffness(equilibria.z, contact)
        # mu_s is set only where friction falls with speed, as are mu_k and v_ref
        if statics.model.pad.mu_s is None:
            return normalised(statics.model.pad, K), None
        model = statics.model.replace(mu=equilibria.z[3])  # the fourth row of z is mu
        q = statics.q(equilibria.z)
        C = -complex_step(partial(model.loads, q, contact), np.zeros(q.shape))
        return normalised(model.pad, K), normalised(model.pad, C)

    def matrices(self, pad: Indices, at: Equilibria) -> StiffnessAndDamping:
        """Linearise pads (k,) about k equilibria: z'' + B z' + A z = 0.

        Returns the mass-normalised stiffness A and damping B (k, 3, 3); B is None where no pad has
        any damping.
        """
        A, B = self._matrices(pad, at)
        if self.damping is not None:
            B = self.damping[pad] if B is None else B + self.damping[pad]
        return A, B

    def doubtful(self, pad: Indices, at: Equilibria, A: Array, B: Array | None) -> Bools:
        """Where (k,) rounding may change the verdict on pads (k,) about k equilibria.

        A, B: their `matrices`. The verdict is in doubt too where rounding hides slow modes.
        """
        errors = np.zeros(A.shape)
        if not self.linear:
            statics = self.statics.pick(pad)
            of_entries = statics.stiffness_error(at.z, 1.0 * at.touching)
            errors = normalised(statics.model.pad, of_entries)
        hides_modes = hides_slow_modes(A, B) & ~has_free_coordinate(A)
        return hangs_on_rounding(A, B, errors) | hides_modes

    def fastest(self) -> tuple[ComplexArray, Bools]:
        """Compute the eigenvalue (n,) of largest real part of each pad at its own friction, rad/s.

        The eigenvalue is NaN of a pad without an equilibrium; the second array (n,) of bool says
        where it is unknown whether a pad has one. A real part above zero is set to zero where the
        verdict is stable or marginal, so that the real part is rounding.
        """
        equilibria, unknown = self.at_mu()
        existing = np.flatnonzero(equilibria.exists)
        A, B = self.matrices(existing, equilibria.some(existing))
        if B is None:
            # lambda^2 are the eigenvalues of -A; of +-lambda the principal root does not decay
            values = np.sqrt(-np.linalg.eigvals(A).astype(complex))
        else:
            form, _ = first_order(A, B, frequency_scale=1.0)
            values = np.linalg.eigvals(form).astype(complex)
        # by the last key first: the largest real part, and of several the largest frequency
        leading = np.lexsort((np.abs(values.imag), values.real), axis=1)[:, -1]
        roots = values[np.arange(existing.size), leading]
        is_rounding = np.isin(verdicts(A, B), STABLE_OR_MARGINAL) & (roots.real > 0.0)
        roots.real[is_rounding] = 0.0
        fastest = np.full(self.n, np.nan, dtype=complex)
        fastest[existing] = roots / self.statics.units.time
        return fastest, unknown

    def _intervals(self, mu_max: float) -> _Intervals:
        """Follow the branches of all pads from mu = 0 to mu_max or to their end, as intervals.

        A linear model has one interval for each pad, about the origin.
        """
        if self.linear:
            of_no_pad = np.zeros(self.n, dtype=bool)
            return _Intervals(
                pad=np.arange(self.n),
                start=np.zeros(self.n),
                stop=np.full(self.n, mu_max),
                begins_at_change=of_no_pad,
                at=lambda _pad, mu: self.origin(mu),
                mu_end=np.full(self.n, np.nan),
                ends=[""] * self.n,
                interrupted=of_no_pad,
                no_start=of_no_pad,
            )
        branches = self.branches(np.full(self.n, mu_max))
        no_start = branches.end == BranchEnd.NO_EQUILIBRIUM
        mu_end = np.where(no_start, 0.0, branches.mu_end)
        mu_end[branches.end == BranchEnd.REACHED] = np.nan
        nodes = np.arange(len(branches.owner))
        # intervals start at all nodes but the last one of each pad
        starts = nodes[nodes < branches.last[branches.owner]]
        return _Intervals(
            pad=branches.owner[starts],
            start=branches.z[3, starts],  # row 3 is mu
            stop=branches.z[3, starts + 1],
            begins_at_change=branches.kind[starts] == NodeKind.CONTACT_CHANGE,
            at=branches.at,
            mu_end=mu_end,
            ends=[FOLD if end == BranchEnd.FOLD else BRANCH_END for end in branches.end],
            interrupted=branches.end == BranchEnd.INTERRUPTED,
            no_start=no_start,
        )

    def _judge(self, intervals: _Intervals, pad: Indices, mu: Array) -> _Stability:
        """The stability of pads (k,) at mu (k,) on their branches, computed some at a time."""
        no_unstable_mode = np.empty(pad.size, dtype=bool)
        margins_of_cases = np.empty((2, pad.size))
        for first in range(0, pad.size, AT_ONCE):
            part = slice(first, first + AT_ONCE)
            equilibria = intervals.at(pad[part], mu[part])
            A, B = self.matrices(pad[part], equilibria)
            no_unstable_mode[part] = np.isin(verdicts(A, B), STABLE_OR_MARGINAL) & equilibria.exists
            margins_of_cases[:, part] = margins(A, B)
        return _Stability(no_unstable_mode, margins_of_cases)

    def first_losses(self, mu_max: float) -> Losses:
        """Locate where each pad first loses stability or its equilibrium, as friction rises from 0.

        Verdicts are computed on a grid of `GRID_POINTS` values of mu or more, with all nodes of the
        branch, and the step to the first unstable value is bisected. Steps within which a margin of
        stability comes close to zero are searched too. Instability that begins and ends within
        one step may be missed all the same.
        """
        intervals = self._intervals(mu_max)
        grid = _friction_grid(intervals, mu_max)
        pad = intervals.pad[grid.interval]  # (k,), the pad of each point of the grid
        stability = self._judge(intervals, pad, grid.mu)
        # by the margin of pairs, and by that of real roots; both change grid and stability in place
        for margin_index in range(len(stability.margins)):
            self._move_points_to_instability(intervals, grid, stability, margin_index)
        unstable = np.flatnonzero(~stability.no_unstable_mode)
        # the pads that lose stability, and the first unstable point of each: points of a pad are in
        # order of mu, and `np.unique` gives the first index of each pad
        losing, index = np.unique(pad[unstable], return_index=True)
        first = unstable[index]
        first_unstable = grid.mu[first]
        # the stable point before it, on the same branch, maybe in the interval before
        last_stable = grid.mu[np.maximum(first - 1, 0)]
        # nothing is to be bisected where a pad is unstable at mu = 0, its first point, or from a
        # change of contact on: stability is lost at this very value
        begins_at_change = intervals.begins_at_change[grid.interval[first]]
        is_first_of_interval = grid.number[first] == 0  # numbers count within an interval
        is_located = is_first_of_interval & ((first_unstable == 0.0) | begins_at_change)
        last_stable = np.where(is_located, first_unstable, last_stable)
        # tolerance: two roundings of the largest mu, closer than which no value lies between
        mu_of_loss = self._bisect(
            intervals, losing, last_stable, first_unstable, tolerance=4e-16 * mu_max
        )
        return self._losses(intervals, losing, mu_of_loss)

    def _bisect(
        self,
        intervals: _Intervals,
        pad: Indices,
        stable: Array,
        unstable: Array,
        tolerance: float,
    ) -> Array:
        """Locate by bisection where k pads lose stability, each between two values of mu.

        Parameters
        ----------
        intervals : _Intervals
            The branches.
        pad : array (k,)
            Numbers of the pads.
        stable, unstable : array (k,)
            A value of mu at which all modes are stable or marginal, and a larger one at which one
            grows or there is no equilibrium; equal where nothing is to be halved.
        tolerance : float
            The distance of the two at which bisection ends.

        Returns
        -------
        array (k,)
            The least value of mu that was seen to be unstable.
        """
        low = stable.copy()
        high = unstable.copy()
        for _ in range(HALVINGS):
            wide = np.flatnonzero(high - low > tolerance)
            if not wide.size:
                break
            middle = (low[wide] + high[wide]) / 2
            is_stable = self._judge(intervals, pad[wide], middle).no_unstable_mode
            low[wide] = np.where(is_stable, middle, low[wide])
            high[wide] = np.where(is_stable, high[wide], middle)
        return high

    def _losses(self, intervals: _Intervals, losing: Indices, mu: Array) -> Losses:
        """Name what happens first to each of the n pads, and its frequency.

        Pads of the numbers `losing` (k,) lose stability at mu (k,). All other pads lose their
        equilibrium at the end of the branch, if the branch ends within the range.
        """
        loss = intervals.mu_end.copy()
        loss[losing] = mu
        kinds = list(intervals.ends)
        hertz = np.where(np.array(kinds) == FOLD, 0.0, np.nan)  # no mode loses stability at an end
        equilibria = intervals.at(losing, mu)
        A, B = self.matrices(losing, equilibria)
        codes = verdicts(A, B)
        frequencies = self.frequency_at_onset(A, B)
        for i, pad in enumerate(losing):
            # the kind stays that of the end of the branch in two cases: without an equilibrium at
            # mu, since the bisection has led to this end, and where the verdict at mu is stable:
            # the bisection had another one by rounding alone, which depends on the other cases of
            # the array
            if not equilibria.exists[i] or codes[i] in STABLE_OR_MARGINAL:
                continue
            kinds[pad] = VERDICTS[codes[i]]
            hertz[pad] = frequencies[i] if kinds[pad] == "flutter" else 0.0
        interrupted_while_stable = intervals.interrupted & ~np.isin(np.arange(self.n), losing)
        stiffness = self._stiffness_without_friction
        unknown = interrupted_while_stable | hides_slow_modes(stiffness, self.damping)
        return Losses(
            mu=np.where(unknown, np.nan, loss),
            kinds=kinds,
            frequency_hz=hertz,
            unknown=unknown,
            no_start=intervals.no_start,
        )

    def _move_points_to_instability(
        self, intervals: _Intervals, grid: _FrictionGrid, stability: _Stability, margin_index: int
    ) -> None:
        """Search for instability between stable points of a grid, where a margin nearly vanishes.

        Of a margin that is lower at a point than at both neighbours the minimum lies between the
        neighbours, where golden section searches it. If the search meets an unstable case the point
        of the grid is moved there, and marked as unstable: `grid.mu` and
        `stability.no_unstable_mode` are changed in place.

        margin_index: 0 for the margin of pairs, 1 for that of real roots.
        """
        margin = stability.margins[margin_index]
        stable = stability.no_unstable_mode  # this array and the next are changed
        mu = grid.mu
        interval = grid.interval
        pad = intervals.pad[interval]
        i = np.arange(1, pad.size - 1)
        before = margin[i - 1]
        here = margin[i]
        after = margin[i + 1]
        # the parabola m(s) through the points at s = -1, 0, 1 has m'(0) = (after - before) / 2 and
        # m'' = before - 2 here + after, so that its minimum is m(0) - m'(0)^2 / (2 m'')
        with np.errstate(all="ignore"):
            minimum = here - (after - before) ** 2 / (8 * (before - 2 * here + after))
        # a minimum above half of the margin at the point is far from vanishing
        is_low = (here < before) & (here < after) & (minimum < here / 2)
        same_interval = (interval[i - 1] == interval[i]) & (interval[i] == interval[i + 1])
        all_stable = stable[i - 1] & stable[i] & stable[i + 1]
        j = i[same_interval & all_stable & is_low]  # points that have a low minimum beside them
        if not j.size:
            return
        low = mu[j - 1]
        high = mu[j + 1]
        for _ in range(SHRINKS):
            width = high - low
            left = low + GOLDEN * width
            right = high - GOLDEN * width
            inner = self._judge(intervals, np.tile(pad[j], 2), np.concatenate([left, right]))
            # an unstable case counts as the lowest margin, so that the search stays with it
            margins_inside = np.where(inner.no_unstable_mode, inner.margins[margin_index], -np.inf)
            at_left, at_right = margins_inside.reshape(2, -1)
            keep_left = at_left <= at_right
            low = np.where(keep_left, low, left)
            high = np.where(keep_left, right, high)
        # golden section keeps the inner point of lower margin inside the interval, and this is one
        # of the two inner points of the next pass. An unstable case, once met, is therefore one of
        # the last two: the left one if `keep_left`
        unstable = np.minimum(at_left, at_right) == -np.inf
        mu[j[unstable]] = np.where(keep_left, left, right)[unstable]
        stable[j[unstable]] = False

    def frequency_at_onset(self, A: Array, B: Array | None) -> Array:
        """Compute the frequency (k,) in Hz of the pair that is about to flutter.

        Without damping that is the mean of the two frequencies nearest to each other, which are
        about to coalesce, else the frequency of the pair that grows most or decays least.

        A, B: mass-normalised stiffness and damping (k, 3, 3) of z'' + B z' + A z = 0 in natural
        units; B None without damping.
        """
        rows = np.arange(len(A))
        squares = np.linalg.eigvals(A).astype(complex)  # (k, 3), omega^2 without damping
        i, j = np.triu_indices(3, 1)  # the pairs (0, 1), (0, 2), (1, 2) of squares
        # real parts alone: once a pair has coalesced its squares are conjugates, whose imaginary
        # parts tell how far beyond the onset they are
        nearest = np.argmin(np.abs((squares[:, i] - squares[:, j]).real), axis=1)
        first = np.sqrt(squares[rows, i[nearest]])
        second = np.sqrt(squares[rows, j[nearest]])
        omega = (first + second).real / 2
        if B is not None:
            damped = B.any(axis=(1, 2))
            state_matrices, _ = first_order(A[damped], B[damped], frequency_scale=1.0)
            roots = np.linalg.eigvals(state_matrices)  # (damped, 6)
            growth = np.where(roots.imag > 0.0, roots.real, -np.inf)
            omega[damped] = roots.imag[np.arange(len(roots)), np.argmax(growth, axis=1)]
        return omega / self.statics.units.time / (2 * np.pi)


def hangs_on_rounding(A: Array, B: Array | None, errors: Array) -> Bools:
    """Where (k,) the verdict on z'' + B z' + A z = 0 is in doubt.

    Parameters
    ----------
    A, B, errors : array (k, 3, 3)
        In mass-normalised coordinates, and how far rounding of the equilibrium may move the entries
        of A, infinite where it hides the contact. Of all entries 12 digits count.
    """
    unknown = np.any(~np.isfinite(errors), axis=(1, 2))
    known_errors = np.where(unknown[:, None, None], 0.0, errors)
    return unknown | errors_may_change(A, B, np.maximum(known_errors, KNOWN * np.abs(A)))


def has_free_coordinate(A: Array) -> Bools:
    """Where (k,) a mass-normalised stiffness A (k, 3, 3) holds a coordinate by no spring.

    Springs at right angles to the surface, for instance, hold the pad along it by k cos^2(90
    degrees), which is 1e-33 k in doubles. The eigenvalues of such a coordinate are zero: a check
    would take them for hidden by rounding.
    """
    # squared frequencies of each coordinate with the others held
    squares = np.abs(np.diagonal(A, axis1=1, axis2=2))
    return np.asarray(squares.min(axis=1) <= EPS**2 * squares.max(axis=1))


def hides_slow_modes(A: Array, B: Array | None) -> Bools:
    """Where (k,) rounding of a very large stiffness or damping may hide slow modes of
    z'' + B z' + A z = 0 with A, B (k, 3, 3).

    They are hidden where the least square of a frequency is `HIDDEN` of the largest or less, which
    rounding (1e-16) leaves with four digits at most.
    """
    singular_values = np.linalg.svd(A, compute_uv=False)
    largest = singular_values[:, 0]
    if B is not None:
        rates = np.linalg.norm(B, 2, axis=(1, 2))  # as fast as a frequency
        largest = np.maximum(largest, rates**2)
    return singular_values[:, -1] <= HIDDEN * largest


def verdicts(A: Array, B: Array | None) -> NDArray[np.int8]:
    """Verdicts (k,), indices into `VERDICTS`, on z'' + B z' + A z = 0 with A, B (k, 3, 3).

    B may be None. Cases without damping get the verdict on undamped systems.
    """
    if B is None or not B.any():
        return undamped_verdicts(A)
    codes = np.empty(len(A), dtype=np.int8)
    damped = B.any(axis=(1, 2))
    codes[~damped] = undamped_verdicts(A[~damped])
    codes[damped] = damped_verdicts(A[damped], B[damped])
    return codes


def margins(A: Array, B: Array | None) -> Array:
    """Compute two margins (2, k) of stability of z'' + B z' + A z = 0 with A, B (k, 3, 3).

    Both are smooth and positive where nothing grows. The first vanishes where a pair begins to
    grow: without damping it is the discriminant of det(A + s), which vanishes where two frequencies
    coalesce, else minus the product of the sums z_i + z_j of all 15 pairs of roots, which is
    positive for roots in the left half-plane (the last Hurwitz determinant but one, by Orlando's
    formula). The second vanishes where a real root begins to grow: it is the determinant of A, the
    product of all roots.
    """
    det = np.linalg.det(A)
    if B is None or not B.any():
        squares = np.linalg.eigvals(A)
        a, b, c = squares.T
        differences = (a - b) * (a - c) * (b - c)
        return np.array([(differences * differences).real, det])
    form, _ = first_order(A, B, frequency_scale=1.0)
    roots = np.linalg.eigvals(form)
    i, j = np.triu_indices(roots.shape[1], 1)  # the pairs of two roots
    return np.array([-np.prod(roots[:, i] + roots[:, j], axis=1).real, det])
