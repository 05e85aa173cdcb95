"""State spaces of systems of terms: their poles are the roots that the queries give."""

import numpy as np
import pytest

from squeal.analysis.systems.roots import system_roots
from squeal.analysis.systems.state_space import system_state_space
from squeal.errors import InputError
from squeal.linear.system import Term, TermSystem
from tests.known import known_system


def test_the_poles_are_the_roots():
    system, _ = known_system(9, np.random.default_rng(2), damped=True)
    for mu in (0.1, 1.3):
        roots = np.array([e.value for e in system_roots(system, None, {"mu": mu}).eigenvalues])
        poles = system_state_space(system, {"mu": mu}).poles()
        distance = np.abs(poles[:, None] - roots[None, :])
        assert len(poles) == len(roots)
        assert max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 1e-9


def test_a_constant_force_bends_it_as_its_stiffness_does():
    system, _ = known_system(5, np.random.default_rng(3), damped=True)
    assert np.allclose(system_state_space(system).dcgain(), np.linalg.inv(system.at()[2]))


def test_refusals():
    eye = np.eye(3)
    for M, K in ((np.diag([1.0, 1, 0]), eye), (eye, eye * (1 + 0.1j))):
        with pytest.raises(InputError, match="real matrices and a regular M"):
            system_state_space(TermSystem((Term(M),), (), (Term(K),)))
    with pytest.raises(InputError, match="at most 400"):
        system_state_space(TermSystem((Term(np.eye(401)),), (), (Term(np.eye(401)),)))
