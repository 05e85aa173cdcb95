"""What moves the eigenvalues and thresholds of a pad: exact derivatives by its parameters.

A parameter changes the matrices directly and by shifting the equilibrium about which they are
taken; both are in the derivatives below. Damping by ratios or Rayleigh's factors follows the pad, a
damping matrix stays.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from squeal.analysis.pads import Analysis
from squeal.analysis.stack import parameters
from squeal.equilibrium import Path
from squeal.equilibrium.find import (
    damping_matrix,
    normalised_damping,
    normalised_damping_slope,
    without_friction,
)
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear import CriticalPoint, Spectrum, complex_eigenvalues, sensitivities
from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import at_speed, coefficients, pose
from squeal.numerics import differentiation as dual
from squeal.numerics.differentiation import Dual, complex_step, with_derivative


@dataclass(frozen=True, eq=False)
class Change:
    """Derivatives by one parameter p, SI units per unit of p.

    loads (3,): of (Fx, Fy, M) at a fixed place; q (3,): of the equilibrium; M, C, K (3, 3): of the
    matrices about the moving equilibrium; gaps (points,): of the gaps there.
    """

    loads: np.ndarray
    q: np.ndarray
    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    gaps: np.ndarray


def change(model: PadModel, q: np.ndarray, state: State, name: str, held: bool = False) -> Change:
    """Derivatives by the parameter `name` about q (3,) in a contact state, exact to rounding.

    `held` keeps q where it is, as B3 does. Where the balance is singular (a fold) the equilibrium
    moves infinitely fast and only `loads` is finite.
    """
    pad = model.pad.replace(**{name: Dual(getattr(model.pad, name), 1.0)})
    c = coefficients(dual, pad, model.law.absolute_gap)

    def slopes(at: np.ndarray, dq: np.ndarray, speed: Any = None) -> np.ndarray:
        place = tuple(Dual(x, d) for x, d in zip(at, dq, strict=True))
        now = c if speed is None else at_speed(dual, c, pad.fall, speed)
        loads = net_loads(dual, now, model.law, place, state)  # type: ignore[arg-type]
        return np.array(np.broadcast_arrays(*(dual.dual(f).slope + 0.0 * at[0] for f in loads)))

    loads = dq = np.zeros(3)
    if not held:
        loads = slopes(q, dq)
        try:
            dq = np.linalg.solve(-model.jacobian(q, state), loads)
        except np.linalg.LinAlgError:
            dq = np.full(3, np.inf)
    dM = np.diag([float(dual.dual(mass).slope) for mass in (c.m, c.m, c.I)])
    at = pose(dual, tuple(Dual(x, d) for x, d in zip(q, dq, strict=True)))  # type: ignore[arg-type]
    edges = [float(dual.dual(g).slope) for g in model.law.gaps(c, at)]
    dC = np.zeros((3, 3))
    if pad.fall is not None:
        still = q.astype(complex)
        dC[:, :1] = -complex_step(lambda v: slopes(still, dq, v[0]), np.zeros(1))
    both = with_derivative(lambda q: slopes(q, dq), q)
    return Change(both[0] if held else loads, dq, dM, dC, -both[1], np.array(edges))


def _changes(
    scene: Scene, model: PadModel, q: np.ndarray, state: State, held: bool
) -> dict[str, Change]:
    """Derivatives by each parameter about q (3,), C with what follows from the scene's damping."""
    with np.errstate(invalid="ignore"):  # at a fold the equilibrium moves infinitely fast
        changes = {name: change(model, q, state, name, held) for name in parameters(model)}
    damping = scene.damping
    if damping is None or damping.matrix is not None:
        return changes
    own, q, state = without_friction(scene)
    M, K = own.mass_matrix, -own.jacobian(q, state)
    root = np.outer(np.sqrt(np.diag(M)), np.sqrt(np.diag(M)))
    A, (B, _) = K / root, normalised_damping(damping, K / root)
    for name in changes.keys() - {"mu"}:
        by = change(own, q, state, name, held=own.linear)
        drift = np.diag(by.M) / (2 * np.diag(M))  # of the root of M, over it
        turn = np.add.outer(drift, drift)
        slope = root * (normalised_damping_slope(damping, A, by.K / root - turn * A) + turn * B)
        changes[name] = replace(changes[name], C=changes[name].C + slope)
    return changes


def eigenvalue_sensitivities(scene: Scene, analysis: Analysis) -> dict[str, np.ndarray]:
    """d lambda/dp (6,) for each parameter p, in the order of the analysis' eigenvalues.

    rad/s per unit of p in SI units, with all other parameters and what the scene's damping names
    held fixed (I too, unless it was left out and so follows m, w and h); infinite at a
    coalescence, NaN where modes of one frequency have different damping ratios, see
    `squeal.linear.sensitivities`. Where an edge only just touches, the derivative is that
    within the present contact state.
    """
    model = scene.pad_model
    changes = _changes(scene, model, np.array(analysis.q), analysis.state, model.linear)
    at, spectrum = analysis.matrices, analysis.spectrum
    return {name: _slopes(by, *at, spectrum) for name, by in changes.items()}


def _slopes(
    by: Change, M: np.ndarray, C: np.ndarray, K: np.ndarray, spectrum: Spectrum
) -> np.ndarray:
    return sensitivities(M, C, K, dM=by.M, dC=by.C, dK=by.K, spectrum=spectrum)


def threshold_sensitivities(scene: Scene, point: CriticalPoint) -> dict[str, float]:
    """d mu_c/dp of a threshold on the branch for each parameter p but mu.

    With y, x the left and right null vectors at the threshold, y'(dK - s dM)x = 0 keeps a double
    root s (flutter) or a zero one (divergence), y'dF = 0 a fold; a change of contact keeps the
    gap at zero, and with damping the pair stays on the imaginary axis. Raises ComputationError
    where none of these holds, for an exchange of growth rates. A threshold at mu = 0 stays there
    for all parameters, since without friction nothing grows; with a damping matrix it is refused.
    """
    if point.mu == 0.0:
        if scene.damping is not None and scene.damping.matrix is not None:
            raise ComputationError("with a damping matrix a threshold at mu = 0 has no derivatives")
        return {name: 0.0 for name in parameters(scene.pad_model) if name != "mu"}
    model, breakpoints = scene.pad_model.replace(mu=point.mu), list[float]()
    q, state = np.zeros(3), model.full
    if not model.linear:
        path = Path.of(scene.pad_model, point.mu * (1 + 1e-6))
        z, state = path.at(min(point.mu, path.mu_end))
        q, breakpoints = path.statics.to_si(z), path.breakpoints
    changes = _changes(scene, model, q, state, model.linear)
    if any(abs(mu - point.mu) <= 1e-12 * point.mu for mu in breakpoints):
        edge = int(np.argmin(np.abs(model.gaps(q))))
        rate = {name: by.gaps[edge] for name, by in changes.items()}
    else:
        condition = _condition(scene, model, q, state, point)
        rate = {name: condition(by) for name, by in changes.items()}
    return {name: -rate[name] / rate["mu"] + 0.0 for name in changes if name != "mu"}


def _condition(
    scene: Scene, model: PadModel, q: np.ndarray, state: State, point: CriticalPoint
) -> Callable[[Change], float]:
    """The derivative of what must not change at a threshold."""
    M, K = model.mass_matrix, -model.jacobian(q, state)
    C = damping_matrix(scene) - model.rate_jacobian(q, state)
    if point.kind == "fold":
        left, _ = _null(K, M)
        return lambda by: float(left @ by.loads)
    if C.any():
        spectrum = complex_eigenvalues(M, C, K)
        k = int(np.argmin(np.abs(spectrum.values.real) - 1e-9 * np.abs(spectrum.values.imag)))
        return lambda by: float(_slopes(by, M, C, K, spectrum)[k].real)
    s = 0.0 if point.kind == "divergence" else (2 * np.pi * point.frequency_hz) ** 2
    y, x = _null(K - s * M, M)
    size = np.linalg.norm(K) * np.linalg.norm(x) * np.linalg.norm(y)
    if np.abs(y @ (K - s * M) @ x) > 1e-6 * size:
        raise ComputationError(f"the threshold at mu = {point.mu:.9g} is no coalescence")
    return lambda by: float(y @ (by.K - s * by.M) @ x)


def _null(matrix: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right null vectors of a singular matrix, in mass-normalised coordinates."""
    unit = 1.0 / np.sqrt(np.diag(M))
    U, _, rows = np.linalg.svd(unit[:, None] * matrix * unit)
    return unit * U[:, -1], unit * rows[-1]
