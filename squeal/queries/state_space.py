"""State spaces of python-control from pads and systems; friction as the gain of a loop."""

import math
import warnings
from typing import NamedTuple

import control
import numpy as np
from control import StateSpace
from numpy.typing import NDArray

from squeal.errors import InputError, InputWarning
from squeal.io.scene import Scene
from squeal.linear.condensation import state_pencil
from squeal.linear.matrices import EPS, Array, dense, rank_of, state_matrices
from squeal.linear.moduli import Tabulated
from squeal.linear.system import System
from squeal.queries.options import Subject, refuse_options
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.systems.system_analysis import SystemAnalysis
from squeal.schema import public

MOST_ROWS = 2000
"""The most rows of a system of which a state space, which is dense, is made."""
NO_FEEDTHROUGH = 0.0  # a matrix D of zeros, whatever its shape
STATES = ["x", "y", "theta", "x_dot", "y_dot", "theta_dot"]


@public
def state_space(subject: Subject, mu: float | None = None, loop: str | None = None) -> StateSpace:
    """Make a :class:`control.StateSpace` of a pad about its sliding equilibrium, or of a system.

    Its poles are the eigenvalues. Inputs of a pad are a force along and normal to the surface (N)
    and a moment (N m), outputs are x, y (m) and theta (rad) from the equilibrium. Inputs of a
    system are a force on each row, outputs are its displacements. Rows without mass bring no more
    states than they have roots.

    With `loop`, the terms of this parameter are left out, and what they do is the loop: under the
    negative feedback u = -p y the poles are the eigenvalues at the value p, so that `root_locus`
    and `margin` of python-control take the parameter as the loop gain.

    Parameters
    ----------
    subject
        As `eigenvalues` takes it; a system of up to 2000 rows, with real matrices.
    mu : float, optional
        Friction of a pad, or the value of a system's free parameter; left out, its own.
    loop : str, optional
        A parameter of a system that K and C are linear in, friction for example.

    Returns
    -------
    control.StateSpace
        With `loop`, as many inputs as outputs: the rank of the parameter's terms. One contact pair
        has rank 1. Of a greater rank r, `control.feedback(plant, p * numpy.eye(r))` closes the
        loops; `root_locus` and `margin` take a single gain only, so that they do not serve.

    Raises
    ------
    InputError
        For a mu that is not allowed, complex matrices, a parameter that is no gain, and for motions
        that have neither mass, damper nor spring.
    ComputationError
        If no steady sliding exists.

    Warns
    -----
    InputWarning
        Of what speaks against the equilibrium of a pad.

    Examples
    --------
    Two modes that friction couples, damped equally: flutter from mu = 3/4 (1 + 2 c^2) on.

    >>> import control, squeal
    >>> c, K = 0.1, {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> system = squeal.System([[1, 0], [0, 1]], [[c, 0], [0, c]], K)
    >>> plant = squeal.state_space(system, loop="mu")
    >>> gain, *_ = control.margin(plant)
    >>> round(float(gain), 9), round(squeal.thresholds(system).first.mu, 9)
    (0.765, 0.765)
    """
    if isinstance(subject, Scene):
        refuse_options("a scene", loop=loop)
        return _of_pad(subject, mu)
    system = SystemAnalysis.of(subject).system
    if system.n > MOST_ROWS:
        raise InputError(
            f"{system.name}: {system.n} rows are too many for a state space, which takes up to "
            f"{MOST_ROWS}; squeal.reduce(system, band=...) has fewer"
        )
    changes = {} if mu is None else {system.parameter: mu}
    if loop is None:
        rows = np.eye(system.n)  # a force on each row, and its displacement
        ports = _Ports(forces=rows, displacements=rows, velocities=np.zeros_like(rows))
        return _of_system(system, changes, ports)
    if loop in changes:
        raise InputError(f"mu: is not allowed with loop={loop!r}; its value is the loop's gain")
    ports = _ports_of_loop(system, loop, changes)
    return _of_system(system, changes | {loop: 0.0}, ports)  # the loop adds the rest


def _of_pad(scene: Scene, mu: float | None) -> StateSpace:
    """The state space of a pad about its sliding equilibrium."""
    analysis = analyse(scene if mu is None else scene.replace(mu=mu))
    for words in analysis.warnings:
        warnings.warn(words, InputWarning, stacklevel=4)
    A, B = state_matrices(*analysis.matrices)
    labels = {"inputs": ["force x", "force y", "moment"], "outputs": STATES[:3], "states": STATES}
    return control.ss(A, B, np.eye(3, 6), NO_FEEDTHROUGH, name=scene.model, **labels)


class _Ports(NamedTuple):
    """Where inputs act on the rows, and what outputs read of displacements and velocities."""

    forces: Array  # (n, r)
    displacements: Array  # (r, n)
    velocities: Array  # (r, n)


def _ports_of_loop(system: System, loop: str, changes: dict[str, float]) -> _Ports:
    """Ports between which a parameter p is the gain of a loop.

    The terms of p in K q + C q' are p times one matrix (n, 2 n) of (q, q'). Its factors of full
    rank r are the forces (n, r) and what is measured (r, 2 n).

    Raises InputError where K and C are not linear in p, or complex, or M depends on p.
    """
    parameters = system.values(changes | {loop: 0.0})
    for term in system.terms:
        factor = term.factor
        # `curvature` bounds the second derivative between two values, and is 0 of a linear factor.
        # A formula that is linear between -1 and 1 is linear everywhere; a table may bend beyond
        reach = math.inf if isinstance(factor, Tabulated) else 1.0
        if loop in factor.names and factor.curvature(parameters, loop, -reach, reach) != 0.0:
            reason = f"is not linear in {loop}, which is no gain then"
            raise InputError(f"loop: the factor {factor.text} {reason}")
    mass, damping, stiffness = system.derivative(loop, parameters)
    if mass is not None:
        raise InputError(f"loop: M of {system.name} depends on {loop}; K and C alone may")
    zero = np.zeros((system.n, system.n))
    slopes = [zero if matrix is None else dense(matrix) for matrix in (stiffness, damping)]
    if any(map(np.iscomplexobj, slopes)):
        raise InputError(f"loop: what {loop} multiplies is complex, and a state space is real")
    forces, measured = _factored(np.hstack(slopes))
    if not forces.size:
        raise InputError(f"loop: no matrix of {system.name} depends on {loop} at these parameters")
    return _Ports(forces, *np.hsplit(measured, 2))


def _factored(matrix: Array) -> tuple[Array, Array]:
    """Factors (n, r), (r, m) of a matrix (n, m) of rank r, by elimination with complete pivoting.

    Their product is the matrix to rounding; of a matrix of zeros both are empty.

    Singular vectors would fill rows and columns of zeros with rounding, from which python-control
    computes zeros of the transfer function that do not exist.
    """
    left = []
    right = []
    remainder = matrix
    noise = 4 * EPS * len(matrix) * np.linalg.norm(matrix)
    while np.abs(remainder).max() > noise:
        row, column = np.unravel_index(np.abs(remainder).argmax(), remainder.shape)
        left.append(remainder[:, column])
        right.append(remainder[row] / remainder[row, column])
        remainder = remainder - np.outer(left[-1], right[-1])
    return np.array(left).T, np.array(right)


def _of_system(system: System, changes: dict[str, float], ports: _Ports) -> StateSpace:
    """The state space of a system between its ports.

    In the singular vectors of M, q = V1 a + V2 b: the m motions a have mass, motions b have none.
    Their equation M_a a'' + C_a a' + C_b b' + K_a a + K_b b = F u is, with z = (a, a', b),

        [1  0    0  ]      [   0     1     0  ]     [0]
        [0  M_a  C_b] z' = [ -K_a  -C_a  -K_b ] z + [F] u,

    the descriptor system E z' = A z + B u. The states are a, a' and those b that a damper holds.

    Raises InputError for complex matrices, for a loop that damps motions without mass, and where
    some motion has neither mass, damper nor spring (see `_condensed`).
    """
    M, C, K = system.arrays(changes)
    n = system.n
    if C is None:
        C = np.zeros((n, n))
    if any(np.iscomplexobj(matrix) for matrix in (M, C, K)):
        raise InputError(f"{system.name}: complex matrices have no real state space")
    # M = left diag(masses) right with singular values that fall; (V1 V2) = right.T
    left, masses, right = np.linalg.svd(M)
    m = rank_of(masses)
    if m == n:  # M is regular: the rows themselves are the motions a
        left = right = np.eye(n)
    unit = masses[0] or 1.0  # all matrices are divided by it, so that E is about one; 1 if M is 0
    mass, damping, stiffness = (left.T @ (matrix / unit) @ right.T for matrix in (M, C, K))
    forces = left.T @ (ports.forces / unit)
    displacements = ports.displacements @ right.T
    velocities = ports.velocities @ right.T
    # b' is no state, and must not be measured. M q' holds the rates a' alone: an output of
    # velocities without b' is a combination of rows of M, and added to these leaves their rank
    scale = np.linalg.norm(velocities) or 1.0
    rows = np.vstack([M / unit, ports.velocities / scale])
    if rank_of(np.linalg.svd(rows, compute_uv=False)) > m:
        raise InputError(f"{system.name}: the loop damps motions without mass, which has no gain")
    C_b = damping[:, m:]
    A, E = state_pencil(mass, damping, stiffness, m)
    B = np.vstack([np.zeros((m, forces.shape[1])), forces])
    outputs = np.hstack([displacements[:, :m], velocities[:, :m], displacements[:, m:]])
    # E is block triangular, so that its rank is the sum of those of its diagonal blocks: m of the
    # unit matrix, m of the masses in M_a, and that of the dampers between motions without mass,
    # which are the last rows of C_b
    rank_of_E = 2 * m + _rank_in(damping, C_b[m:])
    if rank_of_E < n + m:  # some motion has neither mass nor damper
        return _condensed(_Descriptor(E, A, B, outputs), rank_of_E, stiffness, system.name)
    rates_by_state = np.linalg.solve(E, A)
    rates_by_input = np.linalg.solve(E, B)
    return control.ss(rates_by_state, rates_by_input, outputs, NO_FEEDTHROUGH, name=system.name)


class _Descriptor(NamedTuple):
    """E z' = A z + B u, of which outputs z are read."""

    E: Array
    A: Array
    B: Array
    outputs: Array


def _condensed(descriptor: _Descriptor, rank: int, stiffness: Array, name: str) -> StateSpace:
    """The state space of a descriptor system whose E has the given rank, below its size.

    In the singular vectors of E the first `rank` rows are diag(s) z1' = A11 z1 + A12 z2 + B1 u with
    its singular values s > 0. The last rows have no rate: 0 = A21 z1 + A22 z2 + B2 u is solved for
    z2, which leaves the states z1 (a Schur complement of A22).

    Raises InputError where A22 is singular, compared with the stiffness (n, n).
    """
    left, singular_values, right = np.linalg.svd(descriptor.E)
    A = left.T @ descriptor.A @ right.T
    B = left.T @ descriptor.B
    outputs = descriptor.outputs @ right.T
    A22 = A[rank:, rank:]
    if _rank_in(stiffness, A22) < len(A22):
        raise InputError(
            f"{name}: some motion has neither mass, damper nor spring of its own (a Lagrange "
            "multiplier, for example); a state space needs it eliminated"
        )
    z2_by_z1 = -np.linalg.solve(A22, A[rank:, :rank])
    z2_by_input = -np.linalg.solve(A22, B[rank:])
    return control.ss(
        (A[:rank, :rank] + A[:rank, rank:] @ z2_by_z1) / singular_values[:rank, None],
        (B[:rank] + A[:rank, rank:] @ z2_by_input) / singular_values[:rank, None],
        outputs[:, :rank] + outputs[:, rank:] @ z2_by_z1,
        outputs[:, rank:] @ z2_by_input,
        name=name,
    )


def _rank_in(whole: NDArray, block: NDArray) -> int:
    """The rank of a block of a matrix, to rounding of the whole matrix."""
    if not block.size:
        return 0
    return rank_of(np.linalg.svd(block, compute_uv=False), float(np.linalg.norm(whole, 2)))
