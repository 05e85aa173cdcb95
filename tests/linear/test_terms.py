"""Systems of terms: sums, exact derivatives, damping, dense and sparse alike."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.linear.dampings import modal, rayleigh, structural, structure_stiffness
from squeal.linear.system import (
    Batched,
    Parametrised,
    Term,
    TermSystem,
    dense,
    supports,
    without_supports,
)
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
def test_damping_refers_to_the_symmetric_stiffness_without_friction(kind):
    skew = np.array([[0.0, 0.5], [-0.5, 0.0]])
    written = (Term(kind(K0 + skew)), Term(kind(K1), Formula("mu*Omega**2")))
    as_factor = (Term(kind(K0 + skew), Formula("lining")), written[1])
    numbers = {"Omega": 2.0, "mu": 0.5, "lining": 1.0}
    for K in (written, as_factor):
        system = TermSystem((Term(kind(M)),), (Term(kind(C)),), K, numbers, "Omega")
        added = rayleigh(system, 2.0, 0.25).at()[1] - system.at()[1]
        assert dense(added) == pytest.approx(2 * M + 0.25 * K0, rel=1e-15)
        turned = structural(system, 0.01).at()[2] - system.at()[2]
        assert dense(turned) == pytest.approx(0.01j * K0, rel=1e-15)
        assert structure_stiffness(system)[1] == (0,)


def test_a_factor_of_one_leaves_every_damping_as_it_is():
    """Growth was 183.5 instead of 172.1 1/s after `factor: lining` with lining = 1."""
    plain = TermSystem((Term(M),), (), (Term(K0), Term(K1, Formula("mu"))), {"mu": 0.5})
    factor = Term(K0, Formula("lining"))
    other = TermSystem((Term(M),), (), (factor, plain.K[1]), {"mu": 0.5, "lining": 1.0})
    for damp in (lambda s: rayleigh(s, 1.0, 0.1), lambda s: modal(s, [0.01, 0.02])):
        assert dense(damp(other).at()[1]) == pytest.approx(dense(damp(plain).at()[1]), rel=1e-14)
    assert structural(other, 0.1).at()[2] == pytest.approx(structural(plain, 0.1).at()[2])


def test_friction_of_another_name_is_known_by_its_unsymmetric_matrices():
    for name, matrix, terms in (("f", K1, (0,)), ("lining", K1 + K1.T, (0, 1))):
        system = TermSystem(
            (Term(M),), (), (Term(K0), Term(matrix, Formula(name))), {name: 0.5}, name
        )
        assert structure_stiffness(system)[1] == terms


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
@pytest.mark.parametrize("penalty", [1e22, 1e36])
def test_penalties_on_the_diagonal_are_supports(kind, penalty):
    size = 1e6
    held = np.diag([0.0, penalty, 0.0, 3.0 * penalty])
    K = size * (np.eye(4) + 0.1 * np.arange(16).reshape(4, 4)) + held
    system = TermSystem((Term(kind(np.eye(4))),), (), (Term(kind(K)),))
    assert supports(system).tolist() == [1, 3]
    rest, rows = without_supports(system)
    assert rows.tolist() == [1, 3]
    assert dense(rest.at()[2]) == pytest.approx(K[::2, ::2], rel=1e-15)


def test_stiff_springs_between_coordinates_and_mixed_units_are_no_supports():
    def rows(K, M=None):
        M = np.eye(len(K)) if M is None else M
        return supports(TermSystem((Term(M),), (), (Term(np.array(K)),))).tolist()

    spring = 1e20 * np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    assert rows(np.eye(3) + spring) == []
    assert rows([[1e12, 0.0], [0.0, 1.0]], np.diag([1.0, 1e-12])) == []  # N/m beside N m/rad
    assert rows([[1.0, 0.2], [0.2, 1e6]]) == []
    assert rows([[1.0]]) == []
    assert rows([[0.0, 0.0], [0.0, 4.0]]) == []


def test_one_form_of_every_kind_of_system():
    terms = _system()
    plain = Parametrised(lambda p: terms(p), 1.0, 3.0)
    many = Parametrised(Batched(terms, lambda ps: [terms(p) for p in ps]), 1.0, 3.0)
    exact = Parametrised(terms, 1.0, 3.0)
    for p in (1.0, 2.2, 3.0):
        for family in (plain, many):
            for X, Y in zip(family.at(p), exact.at(p), strict=True):
                assert np.array_equal(X, Y)
            for X, Y in zip(family.derivative(p), exact.derivative(p), strict=True):
                assert pytest.approx(Y, rel=1e-5, abs=1e-9) == X
    for one, other in zip(many.at_many([1.0, 2.0]), exact.at_many([1.0, 2.0]), strict=True):
        assert all(np.array_equal(X, Y) for X, Y in zip(one, other, strict=True))


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
    with pytest.raises(InputError, match="without friction"):
        rayleigh(TermSystem((Term(M),), (), (Term(K0, Formula("mu")),)), 0.0, 1.0)
    with pytest.raises(InputError, match="0 ratios of 2 rows"):
        modal(system, [])
