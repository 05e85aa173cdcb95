"""What moves the eigenvalues and thresholds of a pad: exact derivatives by its parameters.

A parameter changes the matrices directly and by shifting the equilibrium about which they are
taken; both are in the derivatives below. Damping by ratios or Rayleigh's factors follows the pad, a
damping matrix stays.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import Analysis
from squeal.analysis.stack import parameters
from squeal.equilibrium import Path
from squeal.equilibrium.damping import (
    damping_matrix,
    modal_damping,
    modal_damping_slope,
    without_friction,
)
from squeal.errors import ComputationError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import CriticalPoint, complex_eigenvalues, sensitivities
from squeal.model.equations import PadModel, net_loads
from squeal.model.mechanics import at_speed, coefficients, pose
from squeal.model.states import State
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


def _damping_slopes(scene: Scene) -> dict[str, np.ndarray]:
    """dC/dp (3, 3) of the scene's damping by each parameter on which it depends, in SI units."""
    damping = scene.damping
    if damping is None or damping.matrix is not None:
        return {}
    model, q, state = without_friction(scene)
    M, K = np.diag(model.mass_matrix), -model.jacobian(q, state)
    root = np.sqrt(M)
    found = {}
    for name in parameters(model):
        if name == "mu":
            continue
        by = change(model, q, state, name, held=model.linear)
        if damping.rayleigh is not None:
            alpha, beta = damping.rayleigh
            found[name] = alpha * by.M + beta * (by.K + by.K.T) / 2
            continue
        assert damping.ratios is not None
        A = K / np.outer(root, root)
        drift = np.diag(by.M) / (2 * M)  # of the root, over it
        B, _ = modal_damping(A, damping.ratios)
        dA = by.K / np.outer(root, root) - np.add.outer(drift, drift) * A
        dB = modal_damping_slope(A, dA, damping.ratios) + np.add.outer(drift, drift) * B
        found[name] = np.outer(root, root) * dB
    return found


@takes_scene
def eigenvalue_sensitivities(scene: Scene, analysis: Analysis) -> dict[str, np.ndarray]:
    """d lambda/dp (6,) for each parameter p, in the order of the analysis' eigenvalues.

    rad/s per unit of p in SI units, with all other parameters and what the scene's damping names
    held fixed (I too, unless it was left out and so follows m, w and h); infinite at a
    coalescence, NaN where modes of one frequency have different damping ratios, see
    `squeal.linear.sensitivities`. Where an edge only just touches, the derivative is that
    within the present contact state.
    """
    model, q = scene.pad_model, np.array(analysis.q)
    m = analysis.matrices
    found = {}
    damping = _damping_slopes(scene)
    for name in parameters(model):
        by = change(model, q, analysis.state, name, held=scene.pad_model.linear)
        by = replace(by, C=by.C + damping.get(name, 0.0))
        found[name] = sensitivities(*m, dM=by.M, dC=by.C, dK=by.K, spectrum=analysis.spectrum)
    return found


@takes_scene
def threshold_sensitivities(scene: Scene, point: CriticalPoint) -> dict[str, float]:
    """d mu_c/dp of a threshold on the branch for each parameter p but mu.

    With y, x the left and right null vectors at the threshold, y'(dK - s dM)x = 0 keeps a double
    root s (flutter) or a zero one (divergence), y'dF = 0 a fold; a change of contact keeps the
    gap at zero, and with damping the pair stays on the imaginary axis. Raises ComputationError
    where none of these holds, for an exchange of growth rates. A threshold at mu = 0 stays there
    for all parameters, since without friction nothing grows; with a damping matrix it is refused.
    """
    names = parameters(scene.pad_model)
    if point.mu == 0.0:
        if scene.damping is not None and scene.damping.matrix is not None:
            raise ComputationError("with a damping matrix a threshold at mu = 0 has no derivatives")
        return {name: 0.0 for name in names if name != "mu"}
    path = Path.of(scene.pad_model, point.mu * (1 + 1e-6)) if not scene.pad_model.linear else None
    if path is None:
        q, state = np.zeros(3), scene.pad_model.full
    else:
        z, state = path.at(min(point.mu, path.mu_end))
        q = path.statics.to_si(z)
    model = scene.pad_model.replace(mu=point.mu)
    by = {name: change(model, q, state, name, held=path is None) for name in names}
    if path is not None and any(abs(b - point.mu) <= 1e-12 * point.mu for b in path.breakpoints):
        edge = int(np.argmin(np.abs(model.gaps(q))))
        rate = {name: by[name].gaps[edge] for name in names}
    else:
        C = damping_matrix(scene) - model.rate_jacobian(q, state)
        damping = _damping_slopes(scene)
        by = {name: replace(one, C=one.C + damping.get(name, 0.0)) for name, one in by.items()}
        rate = _rates(model, q, state, C, point, by)
    return {name: -rate[name] / rate["mu"] + 0.0 for name in names if name != "mu"}


def _rates(
    model: PadModel,
    q: np.ndarray,
    state: State,
    C: np.ndarray,
    point: CriticalPoint,
    by: dict[str, Change],
) -> dict[str, float]:
    """What must not change at a threshold, differentiated by each parameter."""
    M, K = model.mass_matrix, -model.jacobian(q, state)
    if point.kind == "fold":
        y, _ = _null(K, M)
        return {name: float(y @ one.loads) for name, one in by.items()}
    if C.any():
        spectrum = complex_eigenvalues(M, C, K)

        def derivative(one: Change) -> np.ndarray:
            return sensitivities(M, C, K, dM=one.M, dC=one.C, dK=one.K, spectrum=spectrum)

        k = int(np.argmin(np.abs(spectrum.values.real) - 1e-9 * np.abs(spectrum.values.imag)))
        return {name: float(derivative(one)[k].real) for name, one in by.items()}
    s = 0.0 if point.kind == "divergence" else (2 * np.pi * point.frequency_hz) ** 2
    y, x = _null(K - s * M, M)
    scale = np.linalg.norm(K)
    if np.abs(y @ (K - s * M) @ x) > 1e-6 * scale * np.linalg.norm(x) * np.linalg.norm(y):
        raise ComputationError(f"the threshold at mu = {point.mu:.9g} is no coalescence")
    return {name: float(y @ (one.K - s * one.M) @ x) for name, one in by.items()}


def _null(matrix: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right null vectors of a singular matrix, found in mass-normalised coordinates."""
    unit = 1.0 / np.sqrt(np.diag(M))
    U, _, rows = np.linalg.svd(unit[:, None] * matrix * unit)
    return unit * U[:, -1], unit * rows[-1]
