"""What moves the eigenvalues and thresholds of a pad: exact derivatives by its parameters.

A parameter changes the matrices directly and by shifting the equilibrium about which they are
taken; both are in the derivatives below. Damping by ratios or Rayleigh's factors follows the pad, a
damping matrix stays.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.pads import analyse, critical_friction
from squeal.analysis.stack import parameters
from squeal.equilibrium import Path
from squeal.equilibrium.damping import (
    damping_matrix,
    normalised_damping,
    normalised_damping_slope,
    without_friction,
)
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Mark, Panel, Table, in_order, number, plain
from squeal.linear import CriticalPoint
from squeal.linear.paths import mode_numbers
from squeal.linear.sensitivity import Singular, crossing_slopes, sensitivities
from squeal.model.contact import State
from squeal.model.equations import PadModel, linearise, net_loads
from squeal.model.pad import PARAMETERS, at_speed, coefficients, pose
from squeal.numerics import differentiation as dual
from squeal.numerics.differentiation import Dual, complex_step, with_derivative

DEGREE = math.pi / 180


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity(Answer):
    """Derivatives by each parameter, per unit of it, all others held.

    what: the eigenvalues `at`, or the first loss of stability in `parameter` at a value of it;
    slopes: (m,) of the eigenvalues, not finite at a coalescence, or (2,) of the loss and of its
    frequency in Hz, empty where stability is not lost; values, units: of the parameters;
    condition (m,): of the eigenvalues, 1 of real modes, infinite where two of them coalesce.
    """

    @property
    def panel(self) -> Panel:  # type: ignore[override]
        """Bars of the first loss, or of the mode that grows fastest."""
        if self.what == "threshold":
            return Panel("parameter", 2, Mark.BARS)
        return Panel("parameter", "dRe", Mark.BARS, "mode")

    what: str
    parameter: str
    at: Any
    kind: str
    slopes: Mapping[str, np.ndarray]
    values: Mapping[str, float]
    units: Mapping[str, str]
    condition: NDArray[np.float64] | None = None

    def table(self) -> Table:
        """What a small step of each parameter moves, the strongest first: the loss, or each mode
        of a pair's two, the fastest growing first. A step is 1 per cent, of an angle a degree, and
        1 of what is 0 and has no unit."""
        if self.what == "threshold":
            return self._table_of_loss()
        roots = np.asarray(self.at, complex)
        numbers = mode_numbers(roots)
        rows = []
        for i in sorted(np.flatnonzero(roots.imag >= 0.0).tolist(), key=lambda i: -roots[i].real):
            rate = roots[i].real
            mode = (int(numbers[i]), roots[i].imag / math.tau, rate)
            of_mode = []
            for name, slopes in self.slopes.items():
                step, words = self.step(name)
                pair = np.array([slopes[i].real, slopes[i].imag / math.tau])
                moved = step * (pair if np.isfinite(pair).all() else np.full(2, np.nan))
                if step:
                    of_mode.append((*mode, name, words, *moved.tolist()))
            of_mode.sort(key=_effect)
            # first in rank is the strongest of each mode that grows
            for k, row in enumerate(of_mode):
                rank = (True, -k) if rate > 0.0 else (False, rate)
                rows.append((*row, rank))
        heads = [("mode", ""), ("frequency_hz", ""), ("growth_rate", "1/s")]
        heads += [("parameter", ""), ("change", ""), ("dRe", "1/s"), ("df", "Hz")]
        title = "what a small change of a parameter does to each mode"
        nothing = "no root" if self.values else "no parameter is named"
        return Table(in_order(heads), rows, title, nothing, itemgetter(-1))

    def _table_of_loss(self) -> Table:
        """How far a small step of each parameter moves the first loss, the strongest first.

        Where nothing is lost `slopes` is empty, and so is the table.
        """
        rows = []
        for name, slopes in self.slopes.items():
            step, words = self.step(name)
            if step:
                rows.append((name, words, *(step * slopes).tolist()))
        rows.sort(key=_effect)
        # a long table is cut by the last cell; where all are alike it keeps the order of above
        same_rank = (False, 0.0)
        ranked = [(*row, same_rank) for row in rows]
        if self.at is None:
            moved = ("dRe", "1/s")
            title = "stability is not lost: nothing moves its loss"
            if_empty = title
        else:
            moved = (f"d {self.parameter}", "")
            title = f"what moves the first loss ({self.kind} at {self.parameter} = {self.at:.6g})"
            if_empty = "no other parameter"
        heads = [("parameter", ""), ("change", ""), moved, ("df", "Hz")]
        return Table(in_order(heads), ranked, title, if_empty, itemgetter(-1))

    def step(self, name: str) -> tuple[float, str]:
        """A small step of a parameter in its unit, and in words."""
        if self.units[name] == "rad":
            return DEGREE, "1 degree"
        step = 0.01 * self.values[name]
        if not step and not self.units[name]:
            return 1.0, "1"
        return step, "1 %"

    def parts(self) -> Sequence[str | Table]:
        """The table, and which modes leave it in doubt."""
        if self.condition is None:
            return [self.table()]
        numbers = mode_numbers(np.asarray(self.at))
        near = np.flatnonzero((0.01 * self.condition**2 >= 1.0) & (np.imag(self.at) >= 0.0))
        lines = [
            f"mode {numbers[i]} nearly coalesces with another one: its derivatives hold for "
            f"changes far below {number(100 * self.condition[i] ** -2, 2)} %"
            for i in near.tolist()
        ]
        return [self.table(), "\n".join(lines)]

    def to_dict(self) -> dict[str, Any]:
        if self.what == "threshold":
            loss: dict[str, Any] = {"mu": self.at, "value": self.at, "kind": self.kind}
            for key, k in (("parameters", 0), ("frequency_hz", 1)):
                loss[key] = {name: plain(float(pair[k])) for name, pair in self.slopes.items()}
            return {"sensitivity": loss if self.slopes else None}
        rows = []
        for name, slopes in self.slopes.items():
            moved = [
                {"real": d.real, "imag": d.imag} if cmath.isfinite(d) else None
                for d in slopes.astype(complex).tolist()
            ]
            rows.append({"parameter": name, "unit": self.units[name], "eigenvalues": moved})
        condition = [None if c == math.inf else c for c in np.asarray(self.condition).tolist()]
        return {"sensitivity": rows, "sensitivity_condition": condition}


def _effect(row: tuple[Any, ...]) -> float:
    """What sorts rows whose last but one entry is what moves: the largest first, NaN before."""
    return -float(np.nan_to_num(abs(row[-2]), nan=np.inf))


@dataclass(frozen=True, eq=False)
class Change:
    """Derivatives by one parameter p, SI units per unit of p.

    loads (3,): of (Fx, Fy, M) at a fixed place; M, C, K (3, 3): of the matrices about the moving
    equilibrium; gaps (points,): of the gaps there.
    """

    loads: np.ndarray
    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    gaps: np.ndarray


def change(model: PadModel, q: np.ndarray, state: State, name: str) -> Change:
    """Derivatives by the parameter `name` about q (3,) in a contact state, exact to rounding.

    Where the balance is singular (a fold) the equilibrium moves infinitely fast and only `loads` is
    finite. A linear model stays where it is.
    """
    pad = model.pad.replace(**{name: Dual(getattr(model.pad, name), 1.0)})
    c = coefficients(dual, pad, model.law.absolute_gap)

    def slopes(at: np.ndarray, dq: np.ndarray, speed: Any = None) -> np.ndarray:
        place = tuple(Dual(x, d) for x, d in zip(at, dq, strict=True))
        now = c if speed is None else at_speed(dual, c, pad.fall, speed)
        loads = net_loads(dual, now, model.law, place, state)
        return np.array(np.broadcast_arrays(*(dual.dual(f).slope + 0.0 * at[0] for f in loads)))

    dq = np.zeros(3)
    loads = slopes(q, dq)
    if not model.linear:
        try:
            dq = np.linalg.solve(linearise(model, q, state).K, loads)
        except np.linalg.LinAlgError:
            dq = np.full(3, np.inf)
    dM = np.diag([float(dual.dual(mass).slope) for mass in (c.m, c.m, c.I)])
    at = pose(dual, tuple(Dual(x, d) for x, d in zip(q, dq, strict=True)))  # type: ignore[arg-type]
    gaps = [float(dual.dual(g).slope) for g in model.law.gaps(c, at)]
    dC = np.zeros((3, 3))
    if pad.fall is not None:
        still = q.astype(complex)
        dC[:, :1] = -complex_step(lambda v: slopes(still, dq, v[0]), np.zeros(1))
    dK = -with_derivative(lambda q: slopes(q, dq), q)[1]
    return Change(loads, dM, dC, dK, np.array(gaps))


def _changes(scene: Scene, model: PadModel, q: np.ndarray, state: State) -> dict[str, Change]:
    """Derivatives by each parameter about q (3,), C with what follows from the scene's damping."""
    with np.errstate(invalid="ignore"):  # at a fold the equilibrium moves infinitely fast
        changes = {name: change(model, q, state, name) for name in parameters(model)}
    damping = scene.damping
    if damping is None or damping.matrix is not None:
        return changes
    at_rest, q_at_rest, state_at_rest = without_friction(scene)
    M, _, K = linearise(at_rest, q_at_rest, state_at_rest)
    masses = np.diag(M)
    root = np.outer(np.sqrt(masses), np.sqrt(masses))
    A = K / root
    B, _ = normalised_damping(damping, A)
    for name in changes.keys() - {"mu"}:
        by = change(at_rest, q_at_rest, state_at_rest, name)
        relative = np.diag(by.M) / (2 * masses)  # derivative of the root of each mass, over it
        of_root = np.add.outer(relative, relative)
        dA = by.K / root - of_root * A
        dC = root * (normalised_damping_slope(damping, A, dA) + of_root * B)
        changes[name] = replace(changes[name], C=changes[name].C + dC)
    return changes


def of_threshold(scene: Scene, point: CriticalPoint) -> dict[str, tuple[float, float]]:
    """Derivatives of a threshold on the branch, of its friction and of its frequency (Hz), by each
    parameter but mu.

    What does not change there: a gap of zero at a change of contact, the balance along y at a
    fold, of which no frequency is known (NaN), the root on the axis elsewhere (`crossing_slopes`).
    Raises ComputationError where none of these holds, for an exchange of growth rates. A threshold
    at mu = 0 stays there for all parameters, since without friction nothing grows; with a damping
    matrix it is refused.
    """
    if point.mu == 0.0:
        if scene.damping is not None and scene.damping.matrix is not None:
            raise ComputationError("with a damping matrix a threshold at mu = 0 has no derivatives")
        still = (0.0, math.nan)
        return {name: still for name in parameters(scene.pad_model) if name != "mu"}
    model = scene.pad_model.replace(mu=point.mu)
    if model.linear:
        q = np.zeros(3)
        state = model.full
        breakpoints = []
    else:
        path = Path.of(scene.pad_model, point.mu * (1 + 1e-6))
        z, state = path.at(min(point.mu, path.mu_end))
        q = path.statics.to_si(z)
        breakpoints = path.breakpoints
    changes = _changes(scene, model, q, state)
    M, C, K = linearise(model, q, state)
    unit = np.sqrt(np.outer(1.0 / np.diag(M), 1.0 / np.diag(M)))  # makes the mass matrix one
    matrices = M * unit, (C + damping_matrix(scene)) * unit, K * unit
    # derivatives, by each parameter, of what does not change there
    if any(abs(mu - point.mu) <= 1e-12 * point.mu for mu in breakpoints):
        edge = int(np.argmin(np.abs(model.gaps(q))))
        constant = {name: by.gaps[edge] for name, by in changes.items()}
    elif point.kind == "fold":
        left = np.sqrt(np.diag(unit)) * Singular.of(matrices, 0j).left.conj()
        constant = {name: left @ by.loads for name, by in changes.items()}
    else:
        scaled = {n: (by.M * unit, by.C * unit, by.K * unit) for n, by in changes.items()}
        at = Singular.of(matrices, 2j * np.pi * point.frequency_hz)
        by_mu = scaled.pop("mu")
        return crossing_slopes(at, matrices, by_mu, scaled)
    by_mu = constant.pop("mu")
    return {name: (-float((by / by_mu).real) + 0.0, math.nan) for name, by in constant.items()}


def sensitivity(scene: Scene, of: str, high: float, known: Any) -> Sensitivity:
    """What moves the eigenvalues, or the first loss of stability; `known`: its answer.

    The slopes of the eigenvalues are rad/s per unit of p in SI units, with all other parameters and
    what the scene's damping names held fixed (I too, unless it was left out and so follows m, w and
    h); infinite at a coalescence, NaN where modes of one frequency have different damping ratios.
    Where an edge only just touches, a derivative is that within the present contact state.
    """
    names = parameters(scene.pad_model)
    result: dict[str, Any] = {
        "what": of,
        "parameter": "mu",
        "values": {name: getattr(scene.pad, name) for name in names},
        "units": {name: PARAMETERS[name].unit for name in names},
    }
    if of == "eigenvalues":
        if known is None:
            analysis = analyse(scene)
        else:
            scene = scene.replace(mu=known.value)
            result["values"]["mu"] = scene.pad.mu
            _, analysis = known.source
        q = np.array(analysis.q)
        changes = _changes(scene, scene.pad_model, q, analysis.state)
        moved = {name: (by.M, by.C, by.K) for name, by in changes.items()}
        spectrum = analysis.spectrum
        slopes, condition = sensitivities(analysis.matrices, moved, spectrum.eigenvalues)
        return Sensitivity(
            at=spectrum.values,
            kind=analysis.judgement.verdict,
            slopes=slopes,
            condition=condition,
            **result,
        )
    loss = (critical_friction(scene, high) if known is None else known).first
    if loss is None:
        return Sensitivity(at=None, kind="", slopes={}, **result)
    slopes = {name: np.array(pair) for name, pair in of_threshold(scene, loss).items()}
    return Sensitivity(at=loss.mu, kind=loss.kind, slopes=slopes, **result)
