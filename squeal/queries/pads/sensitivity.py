"""Derivatives of the eigenvalues and thresholds of a pad by its parameters, exact to rounding.

A parameter changes the matrices directly and by shifting the equilibrium about which they are
taken; both are in the derivatives below. Damping by ratios or Rayleigh's factors follows the pad, a
damping matrix stays.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from squeal.equilibrium import Path
from squeal.equilibrium.damping import (
    damping_matrix,
    normalised_damping,
    normalised_damping_slope,
    without_friction,
)
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear import CriticalPoint
from squeal.linear.matrices import Array
from squeal.linear.paths import mode_numbers
from squeal.linear.sensitivity import Singular, crossing_slopes, sensitivities
from squeal.model.contact import State
from squeal.model.equations import PadModel, linearise, net_loads
from squeal.model.pad import PARAMETERS, at_speed, coefficients, pose_of
from squeal.numerics import differentiation as dual
from squeal.numerics.differentiation import Dual, complex_step
from squeal.queries.pads.stack import parameters
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import PadAnalysis
from squeal.results.thresholds import Thresholds


@dataclass(frozen=True, eq=False)
class ParameterSlopes:
    """Derivatives by one parameter p about an equilibrium, in SI units per unit of p.

    Attributes
    ----------
    loads : array (3,)
        Of the forces and the moment (Fx, Fy, M) on the pad, which is held at the equilibrium.
    M, C, K : array (3, 3)
        Of the matrices, taken about the equilibrium that moves with p.
    gaps : array (points,)
        Of the gaps of the contact points at that equilibrium.
    """

    loads: Array
    M: Array
    C: Array
    K: Array
    gaps: Array


def parameter_slopes(model: PadModel, q: Array, state: State, name: str) -> ParameterSlopes:
    """Compute the derivatives by one parameter p about an equilibrium, exact to rounding.

    Dual numbers (value and derivative by p) carry p through the model; the derivatives by the
    coordinates are complex steps. Since loads(q, p) = 0 at the equilibrium and K = -d loads / dq,
    it moves by dq with K dq = d loads / dp of the pad held there. At a fold, where K is singular,
    it moves infinitely fast and only `loads` is finite. A linear model stays at the origin.

    Parameters
    ----------
    model : PadModel
        The model, at the friction of the equilibrium.
    q : array (3,)
        The equilibrium (x, y, theta), SI units.
    state : State
        Its contact state.
    name : str
        The parameter p.
    """
    pad = model.pad.replace(**{name: Dual(getattr(model.pad, name), 1.0)})
    c = coefficients(dual, pad, model.law.absolute_gap)  # dual numbers where they depend on p

    def load_slopes(position: Array, dq: Array, speed: complex | None = None) -> Array:
        """d loads / dp (3,) of the pad at a `position` (3,), which moves by dq (3,) per p.

        speed: velocity of the pad along the surface, which friction may depend on; 0 if left out.
        """
        c_at_speed = c if speed is None else at_speed(dual, c, pad.fall, speed)
        loads = net_loads(dual, c_at_speed, model.law, _moving(position, dq), state)
        # `complex_step` calls this with k positions at once, (3, k): the sum repeats a slope
        # that does not depend on the position for each of them
        slopes = [dual.dual(load).slope + 0.0 * position[0] for load in loads]
        return np.array(np.broadcast_arrays(*slopes))

    dloads = load_slopes(q, np.zeros(3))  # of the pad held at q
    dq = np.zeros(3)
    if not model.linear:
        try:
            dq = np.linalg.solve(linearise(model, q, state).K, dloads)
        except np.linalg.LinAlgError:
            dq = np.full(3, np.inf)
    dM = np.diag([float(dual.dual(mass).slope) for mass in (c.m, c.m, c.I)])
    dC = np.zeros((3, 3))
    # where friction falls with the sliding speed the loads depend on x_dot, and C = -d loads / d
    # (x_dot, y_dot, theta_dot) has a first column. The damping that the scene names is added to it
    # in `_slopes_with_damping`
    if pad.fall is not None:
        dC[:, :1] = -complex_step(lambda x_dot: load_slopes(q, dq, x_dot[0]), np.zeros(1))
    dK = -complex_step(lambda position: load_slopes(position, dq), q)
    gaps = model.law.gaps(c, pose_of(dual, _moving(q, dq)))
    dgaps = np.array([float(dual.dual(gap).slope) for gap in gaps])
    return ParameterSlopes(dloads, dM, dC, dK, dgaps)


def _moving(q: Array, dq: Array) -> tuple[Dual, Dual, Dual]:
    """A position (x, y, theta) as dual numbers: q (3,) with the derivative dq (3,)."""
    x, y, theta = map(Dual, q, dq)
    return x, y, theta


def _slopes_with_damping(
    scene: Scene, model: PadModel, q: Array, state: State
) -> dict[str, ParameterSlopes]:
    """Compute the derivatives by each parameter about an equilibrium q (3,), with the damping.

    Damping by ratios or Rayleigh's factors is C = M^1/2 B(A) M^1/2 with A = M^-1/2 K M^-1/2 of the
    pad without friction, and so follows M and K: C_ij = R_ij B_ij and A_ij = K_ij / R_ij with
    R_ij = (m_i m_j)^1/2. Its derivative, by the product rule, is added to the derivative of C. A
    damping matrix is constant.

    Parameters
    ----------
    scene : Scene
        Its damping.
    model : PadModel
        Its model, at the friction of the equilibrium.
    q : array (3,)
        The equilibrium.
    state : State
        Its contact state.
    """
    with np.errstate(invalid="ignore"):  # at a fold the equilibrium moves infinitely fast
        slopes = {name: parameter_slopes(model, q, state, name) for name in parameters(model)}
    damping = scene.damping
    if damping is None or damping.matrix is not None:
        return slopes
    model_at_rest, q_at_rest, state_at_rest = without_friction(scene)
    M, _, K = linearise(model_at_rest, q_at_rest, state_at_rest)
    masses = np.diag(M)
    R = np.outer(np.sqrt(masses), np.sqrt(masses))
    A = K / R
    B, _ = normalised_damping(damping, A)
    for name in slopes.keys() - {"mu"}:  # the pad without friction does not depend on mu
        at_rest = parameter_slopes(model_at_rest, q_at_rest, state_at_rest, name)
        # d R_ij / R_ij = d m_i / 2 m_i + d m_j / 2 m_j
        half_relative = np.diag(at_rest.M) / (2 * masses)
        relative_R = np.add.outer(half_relative, half_relative)
        dA = at_rest.K / R - relative_R * A
        dC = R * (normalised_damping_slope(damping, A, dA) + relative_R * B)
        slopes[name] = replace(slopes[name], C=slopes[name].C + dC)
    return slopes


def of_threshold(scene: Scene, point: CriticalPoint) -> dict[str, tuple[float, float]]:
    """Compute the derivatives of a threshold on the branch of equilibria by each parameter but mu.

    A threshold is where a function g(mu, p) vanishes, so that d mu / dp = -g_p / g_mu. At a change
    of contact g is the gap that closes or opens, at a fold the loads along the left singular vector
    of K; neither has a frequency. Elsewhere it is the real part of the root on the imaginary axis
    (`crossing_slopes`). A threshold at mu = 0 stays there for all parameters, since without
    friction nothing grows.

    Parameters
    ----------
    scene : Scene
        The scene.
    point : CriticalPoint
        The threshold.

    Returns
    -------
    dict of str to (float, float)
        For each parameter the derivatives of the friction, and of the frequency in Hz, NaN if there
        is none.

    Raises
    ------
    ComputationError
        Where no function g is known: for an exchange of growth rates, and at mu = 0 with a damping
        matrix, by which modes may grow without friction.
    """
    if point.mu == 0.0:
        if scene.damping is not None and scene.damping.matrix is not None:
            raise ComputationError("with a damping matrix a threshold at mu = 0 has no derivatives")
        fixed = (0.0, math.nan)
        return {name: fixed for name in parameters(scene.pad_model) if name != "mu"}
    model = scene.pad_model.replace(mu=point.mu)
    if model.linear:
        q = np.zeros(3)
        state = model.full
        contact_changes = []
    else:
        path = Path.of(scene.pad_model, point.mu * (1 + 1e-6))  # a little beyond the threshold
        # a threshold at a fold is the end of the branch, which this path may locate a rounding
        # lower: a path has no equilibria beyond its end
        z, state = path.at(min(point.mu, path.mu_end))
        q = path.statics.to_si(z)
        contact_changes = path.breakpoints
    slopes = _slopes_with_damping(scene, model, q, state)
    # g by the kind of threshold: a change of contact, a fold, or a root on the imaginary axis. A
    # change of contact is recognised by its friction, since its kind is that of the growth there
    if any(abs(mu - point.mu) <= 1e-12 * point.mu for mu in contact_changes):
        changing = int(np.argmin(np.abs(model.gaps(q))))  # the gap that closes or opens
        return _without_frequency({name: of_p.gaps[changing] for name, of_p in slopes.items()})
    M, C, K = linearise(model, q, state)
    inverse_masses = 1.0 / np.diag(M)
    # M^-1/2 K M^-1/2 is K * normalising, entry by entry
    normalising = np.sqrt(np.outer(inverse_masses, inverse_masses))
    matrices = M * normalising, (C + damping_matrix(scene)) * normalising, K * normalising
    if point.kind == "fold":
        # the left vector y of the singular matrix has y^H M^-1/2 K M^-1/2 = 0, so that the row
        # y^H M^-1/2 is the left singular vector of K
        left = np.sqrt(inverse_masses) * Singular.of(matrices, 0j).left.conj()
        return _without_frequency(
            {name: complex(left @ of_p.loads) for name, of_p in slopes.items()}
        )
    by_parameter = {}
    for name, of_p in slopes.items():
        by_parameter[name] = (of_p.M * normalising, of_p.C * normalising, of_p.K * normalising)
    crossing = Singular.of(matrices, 2j * np.pi * point.frequency_hz)
    by_mu = by_parameter.pop("mu")
    return crossing_slopes(crossing, matrices, by_mu, by_parameter)


def _without_frequency(g_slopes: dict[str, complex]) -> dict[str, tuple[float, float]]:
    """d mu / dp = -g_p / g_mu for each parameter p but mu, with NaN for the frequency.

    g_slopes: the derivatives of g by each parameter, mu among them.
    """
    slopes = {}
    for name, g_p in g_slopes.items():
        if name != "mu":
            # the left vector of a fold has a complex factor, which cancels in the quotient; adding
            # 0.0 makes 0 of -0.0
            slopes[name] = (-float((g_p / g_slopes["mu"]).real) + 0.0, math.nan)
    return slopes


def pad_root_sensitivity(scene: Scene, analysis: PadAnalysis) -> Sensitivity:
    """Compute the derivatives of the eigenvalues about an equilibrium of a scene by each parameter.

    Derivatives are in rad/s per unit of a parameter in SI units. All other parameters are held
    fixed (I too, unless it was left out and so follows m, w and h), and so are the numbers of the
    scene's damping. Derivatives are infinite at a coalescence, and NaN where modes of one frequency
    have different damping ratios. Where an edge only just touches they hold for the present contact
    state.
    """
    by_name = _slopes_with_damping(scene, scene.pad_model, np.array(analysis.q), analysis.state)
    by_parameter = {name: (of_p.M, of_p.C, of_p.K) for name, of_p in by_name.items()}
    spectrum = analysis.spectrum
    slopes, condition = sensitivities(analysis.matrices, by_parameter, spectrum.eigenvalues)
    values, units = _values_and_units(scene)
    return Sensitivity(
        what="eigenvalues",
        parameter="mu",
        at=spectrum.values,
        kind=analysis.verdict or "",
        slopes=slopes,
        values=values,
        units=units,
        condition=condition,
        modes=mode_numbers(spectrum.values),
    )


def loss_sensitivity(scene: Scene, answer: Thresholds) -> Sensitivity:
    """Compute the derivatives of the first loss of stability of a scene by each parameter.

    There are no derivatives where stability is not lost.
    """
    loss = answer.first
    slopes = {}  # by name the derivatives of mu and of the frequency (Hz) of the loss
    if loss is not None:
        slopes = {name: np.array(pair) for name, pair in of_threshold(scene, loss).items()}
    values, units = _values_and_units(scene)
    return Sensitivity(
        what="threshold",
        parameter="mu",
        at=None if loss is None else loss.mu,
        kind="" if loss is None else loss.kind,
        slopes=slopes,
        values=values,
        units=units,
    )


def _values_and_units(scene: Scene) -> tuple[dict[str, float], dict[str, str]]:
    """The value and the unit of each parameter that equilibria and matrices depend on."""
    names = parameters(scene.pad_model)
    values = {name: getattr(scene.pad, name) for name in names}
    units = {name: PARAMETERS[name].unit for name in names}
    return values, units
