"""State spaces of python-control from pads and systems, and systems from state spaces."""

import warnings

import control
import numpy as np
from control import StateSpace

from squeal.errors import InputError, InputWarning
from squeal.io.scene import Scene
from squeal.linear.matrices import EPS, state_matrices
from squeal.linear.system import TermSystem
from squeal.queries.pads.equilibrium import analyse
from squeal.schema import public

STATES = ["x", "y", "theta", "x_dot", "y_dot", "theta_dot"]


@public
def state_space(subject: Scene | TermSystem, mu: float | None = None) -> StateSpace:
    """A pad about its sliding equilibrium, or a system, as a :class:`control.StateSpace`.

    Friction mu is the scene's own if left out; of a system it is the value of its free parameter.
    Inputs of a pad are a force along and normal to the surface (N) and a moment (N m), outputs are
    x, y (m) and theta (rad) from the equilibrium. Inputs of a system are a force on each row,
    outputs are its displacements. The poles are the eigenvalues. Warns (InputWarning) of what
    speaks against the equilibrium. Raises InputError for a mu that is not allowed or a system
    with a singular or complex matrix, ComputationError if no steady sliding exists.
    """
    if isinstance(subject, TermSystem):
        return _of_system(subject, mu)
    analysis = analyse(subject if mu is None else subject.replace(mu=mu))
    for words in analysis.warnings:
        warnings.warn(words, InputWarning, stacklevel=3)
    A, B = state_matrices(*analysis.matrices)
    labels = {"inputs": ["force x", "force y", "moment"], "outputs": STATES[:3], "states": STATES}
    return control.ss(A, B, np.eye(3, 6), np.zeros((3, 3)), name=subject.model, **labels)


def _of_system(system: TermSystem, value: float | None) -> StateSpace:
    """Raises InputError."""
    changes = {} if value is None else {system.parameter: value}
    M, C, K = system.arrays(changes)
    n = system.n
    damping = np.zeros((n, n)) if C is None else C
    if any(np.iscomplexobj(matrix) for matrix in (damping, K)):
        raise InputError(f"{system.name}: complex matrices have no real state space")
    if np.linalg.cond(M) > 1.0 / EPS:
        raise InputError(f"{system.name}: M is singular; each row needs a mass")
    A, B = state_matrices(M, damping, K)
    return control.ss(A, B, np.eye(n, 2 * n), np.zeros((n, n)))
