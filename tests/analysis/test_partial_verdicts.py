"""A verdict is of what was proven: some of a system's roots cannot make it stable."""

import numpy as np
import pytest
from scipy import sparse

from squeal.analysis.systems.roots import system_roots
from squeal.analysis.systems.wanted import Wanted
from squeal.linear.system import Term, TermSystem
from squeal.sparse.argument_principle import Disc

HIGH = 6400.0  # Hz, of the pair that grows


def brake(n, growth):
    """n rows of 10 Hz and more, damped, and above all of them a pair at HIGH that grows (1/s)."""
    omega = 2 * np.pi * np.concatenate([10.0 * np.arange(1, n), [HIGH]])
    C = np.full(n, 0.5)
    C[-1] = -2 * growth
    terms = [sparse.csr_array(sparse.diags(d)) for d in (np.ones(n), C, omega**2)]
    mass, damping, stiffness = ((Term(X),) for X in terms)
    return TermSystem(mass, damping, stiffness)


@pytest.mark.parametrize("n", [100, 420])
@pytest.mark.parametrize("growth", [-20.0, 20.0])
def test_the_lowest_roots_alone_never_say_stable(n, growth):
    found = system_roots(brake(n, growth))
    if isinstance(found.region, Disc):
        assert found.verdict is None
        assert found.certified  # of the disc that is named
    else:
        assert found.verdict == ("flutter" if growth > 0 else "stable")


@pytest.mark.parametrize("n", [100, 420])
@pytest.mark.parametrize("growth", [-20.0, 20.0])
def test_a_band_is_judged_by_what_grows_in_it(n, growth):
    system = brake(n, growth)
    above = system_roots(system, Wanted(band=(HIGH - 100, HIGH + 100)))
    below = system_roots(system, Wanted(band=(5.0, 205.0)))
    assert above.verdict == ("flutter" if growth > 0 else (None if n > 400 else "stable"))
    whole = n <= 400 and growth < 0
    assert below.verdict == ("stable" if whole else None)
    assert len(below.eigenvalues) == 20


def test_a_root_that_does_not_solve_the_equations_decides_nothing():
    """A penalty of 1e30 leaves the other roots no digit."""
    K = np.array([[1e30, 0.0, 0.0], [0.0, 4e6, 1e6], [0.0, 0.0, 9e6]])
    system = TermSystem((Term(np.eye(3)),), (), (Term(K),))
    found = system_roots(system)
    solved = [e for e in found.eigenvalues if e.residual <= 1e-6]
    assert found.verdict not in ("flutter", "divergence")
    assert all(e.value.real <= 1e-6 * abs(e.value) for e in solved)
