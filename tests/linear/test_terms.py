"""Systems of terms: sums, exact derivatives, damping, dense and sparse alike."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.linear.dampings import modal, rayleigh, structural
from squeal.linear.terms import Term, TermSystem
from squeal.numerics.formula import Formula

M = np.diag([1.0, 2.0])
C = np.array([[0.1, 0.2], [-0.2, 0.3]])
K0 = np.array([[3.0, -1.0], [-1.0, 4.0]])
K1 = np.array([[0.0, 1.0], [0.0, 0.0]])


def _system(kind=np.asarray):
    return TermSystem(
        (Term(kind(M)),),
        (Term(kind(C), Formula("1/Omega - 1")),),
        (Term(kind(K0)), Term(kind(K1), Formula("mu*Omega**2"))),
        {"Omega": 2.0, "mu": 0.5},
        "Omega",
    )


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
def test_sums_and_derivatives(kind):
    def plain(matrix):
        return None if matrix is None else np.asarray(getattr(matrix, "toarray", lambda: matrix)())

    system = _system(kind)
    assert system.sparse == (kind is csc_array)
    found = [plain(x) for x in system.at({"mu": 0.25})]
    assert np.array_equal(found[0], M)
    assert np.allclose(found[1], -0.5 * C, rtol=1e-15)
    assert np.array_equal(found[2], K0 + K1)
    dM, dC, dK = map(plain, system.derivative("Omega"))
    assert dM is None
    assert np.array_equal(dC, -0.25 * C)
    assert np.array_equal(dK, 2.0 * K1)
    assert np.array_equal(plain(system(3.0)[2]), K0 + 4.5 * K1)
    assert plain(system.derivative("mu")[1]) is None


def test_refusals():
    with pytest.raises(InputError, match="nu is no parameter; allowed are mu"):
        TermSystem((Term(M),), (), (Term(K0, Formula("nu")),))
    with pytest.raises(InputError, match="of the shape of the first M"):
        TermSystem((Term(M),), (), (Term(np.eye(3)),))
    with pytest.raises(InputError, match="at least one"):
        TermSystem((Term(M),), (), ())
    with pytest.raises(InputError, match="allowed are Omega, mu"):
        _system().at({"k": 1.0})
    with pytest.raises(InputError, match="allowed are Omega, mu"):
        _system().derivative("k")


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
def test_rayleigh_and_structural_leave_friction_out(kind):
    damped = rayleigh(_system(kind), 2.0, 0.25)
    difference = damped.at()[1] - _system(kind).at()[1]
    difference = getattr(difference, "toarray", lambda: difference)()
    assert np.allclose(difference, 2 * M + 0.25 * K0, rtol=1e-15)
    K = structural(_system(kind), 0.01).at()[2]
    K = getattr(K, "toarray", lambda: K)()
    assert np.allclose(K, K0 + 2 * K1 + 0.01j * K0, rtol=1e-15)


def test_modal_ratios_are_the_damping_ratios():
    system = TermSystem((Term(M),), (), (Term(K0),))
    M1, C1, K1 = modal(system, [0.01, 0.03]).at()
    block = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M1, K1), -np.linalg.solve(M1, C1)]]
    )
    values = np.linalg.eigvals(block)
    values = values[values.imag > 0][np.argsort(values.imag[values.imag > 0])]
    assert np.allclose(-values.real / np.abs(values), [0.01, 0.03], rtol=1e-12)
    with pytest.raises(InputError, match=r"damping\.ratios: 3 ratios of 2 rows"):
        modal(system, [0.1] * 3)
    with pytest.raises(InputError, match="without"):
        rayleigh(TermSystem((Term(M),), (), (Term(K0, Formula("mu")),)), 0.0, 1.0)
    with pytest.raises(InputError, match="0 ratios of 2 rows"):
        modal(system, [])
