"""A system of terms as a state space of python-control."""

from collections.abc import Mapping

import control
import numpy as np
from control import StateSpace

from squeal.analysis.systems.wanted import ALL_ROWS, TERMS
from squeal.errors import InputError
from squeal.linear.loop import state_matrices
from squeal.linear.system import TermSystem
from squeal.schema.arguments import takes


@takes(system=TERMS)
def system_state_space(
    system: TermSystem, changes: Mapping[str, float] | None = None
) -> StateSpace:
    """M q'' + C q' + K q = f at the parameters, some of them changed; outputs are q.

    States are (q, q'); the poles are the eigenvalues. Raises InputError for more than 400 rows (a
    large system is reduced first), for complex matrices and for an M that is not regular.
    """
    if system.n > ALL_ROWS:
        raise InputError(
            f"system_state_space: {system.n} rows are not allowed; at most {ALL_ROWS} are, so "
            "reduce the system first"
        )
    M, C, K = system.arrays(changes)
    n = len(M)
    C = np.zeros((n, n)) if C is None else C
    if any(np.iscomplexobj(X) for X in (M, C, K)) or np.linalg.matrix_rank(M) < n:
        raise InputError("system_state_space: real matrices and a regular M are required")
    A, B = state_matrices(M, C, K)
    return control.ss(A, B, np.eye(n, 2 * n), np.zeros((n, n)))
