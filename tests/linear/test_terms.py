"""Systems of terms: sums, exact derivatives, damping, dense and sparse alike."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csc_array, csc_matrix, diags_array, eye_array

import squeal
from squeal.errors import InputError
from squeal.linear import complex_eigenvalues, thresholds
from squeal.linear.damping import damped, structure_stiffness
from squeal.linear.digits import rounding_of_sums
from squeal.linear.functions import with_slopes
from squeal.linear.matrices import dense, is_sparse
from squeal.linear.paths import continued
from squeal.linear.real_modes import real_modes
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula

M = np.diag([1.0, 2.0])
C = np.array([[0.1, 0.2], [-0.2, 0.3]])
K0 = np.array([[3.0, -1.0], [-1.0, 4.0]])
K1 = np.array([[0.0, 1.0], [0.0, 0.0]])
KINDS = pytest.mark.parametrize("kind", [np.asarray, csc_array])


def _system(kind=np.asarray):
    friction = Term(kind(K1), Formula("mu*Omega**2"))
    damping = Term(kind(C), Formula("1/Omega - 1"))
    numbers = {"Omega": 2.0, "mu": 0.5}
    return TermSystem((Term(kind(M)),), (damping,), (Term(kind(K0)), friction), numbers, "Omega")


@KINDS
def test_matrices_are_sums_of_terms_and_derivatives_those_of_their_factors(kind):
    system = _system(kind)
    given = system.at({"mu": 0.25})
    assert {is_sparse(X) for X in given} == {kind is csc_array}
    found = [dense(X) for X in given]
    for X, expected in zip(found, (M, -0.5 * C, K0 + K1), strict=True):
        assert pytest.approx(expected, rel=1e-15) == X
    dM, dC, dK = system.derivative("Omega")
    assert dM is None
    assert np.array_equal(dense(dC), -0.25 * C)
    assert np.array_equal(dense(dK), 2.0 * K1)
    assert np.array_equal(dense(system(3.0)[2]), K0 + 4.5 * K1)
    assert system.derivative("mu")[1] is None


@pytest.mark.parametrize(
    "ask",
    [
        lambda: TermSystem((Term(M),), (), (Term(K0, Formula("nu")),)),
        lambda: TermSystem((Term(M),), (), (Term(np.eye(3)),)),
        lambda: TermSystem((Term(M),), (), ()),
        lambda: _system().at({"k": 1.0}),
        lambda: _system().derivative("k"),
        lambda: damped(_system(), ratios=[0.1] * 3),
        lambda: damped(TermSystem((Term(M),), (), (Term(K0, Formula("mu")),)), (0.0, 1.0)),
        lambda: damped(TermSystem((Term(-M),), (), (Term(K0),)), ratios=0.1),
        lambda: continued(lambda _: 3, [0.0, 1.0]),  # type: ignore[arg-type, return-value]
        lambda: thresholds(lambda _: (1, 2), 1.0).points,  # type: ignore[arg-type, return-value]
    ],
)
def test_what_is_no_system_of_terms_is_refused(ask):
    with pytest.raises(InputError):
        ask()


@KINDS
def test_damping_refers_to_the_symmetric_stiffness_without_friction(kind):
    skew = np.array([[0.0, 0.5], [-0.5, 0.0]])
    friction = Term(kind(K1), Formula("mu*Omega**2"))
    numbers = {"Omega": 2.0, "mu": 0.5, "lining": 1.0}
    # a factor of one leaves every damping as it is: growth was 183.5 instead of 172.1 1/s
    for structure in (Term(kind(K0 + skew)), Term(kind(K0 + skew), Formula("lining"))):
        K = (structure, friction)
        system = TermSystem((Term(kind(M)),), (Term(kind(C)),), K, numbers, "Omega")
        added = damped(system, (2.0, 0.25))[0].at()[1] - system.at()[1]
        assert dense(added) == pytest.approx(2 * M + 0.25 * K0, rel=1e-15)
        turned = damped(system, structural=0.01)[0].at()[2] - system.at()[2]
        assert dense(turned) == pytest.approx(0.01j * K0, rel=1e-15)
        assert structure_stiffness(system)[1] == (0,)


def test_friction_of_another_name_is_known_by_its_unsymmetric_matrices():
    for name, matrix, terms in (("f", K1, (0,)), ("lining", K1 + K1.T, (0, 1))):
        K = (Term(K0), Term(matrix, Formula(name)))
        system = TermSystem((Term(M),), (), K, {name: 0.5}, name)
        assert structure_stiffness(system)[1] == terms


def _condensed(K, count):
    """The stiffness of the first rows where the others have no mass."""
    inner = np.linalg.solve(K[count:, count:], K[count:, :count])
    return K[:count, :count] - K[:count, count:] @ inner


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("heavy", [1, 2, 3, 4])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_modal_ratios_where_some_rows_have_no_mass(heavy, turned, free, seed):
    """Turned, rounding gives the motions without mass one that is positive or negative."""
    random = np.random.default_rng(seed)
    A = random.normal(size=(5, 5))
    if free:  # a free motion, of all rows together
        A = A - A.mean(axis=1, keepdims=True)
    K = A.T @ A
    M = np.diag([*np.arange(1.0, heavy + 1), *[0.0] * (5 - heavy)])
    squares = np.linalg.eigvals(np.linalg.solve(M[:heavy, :heavy], _condensed(K, heavy))).real
    omega = np.sqrt(np.maximum(np.sort(squares), 0.0))
    Q = np.linalg.qr(random.normal(size=(5, 5)))[0] if turned else np.eye(5)
    system = TermSystem((Term(Q.T @ M @ Q),), (), (Term(Q.T @ K @ Q),))
    M_turned, C, K_turned = damped(system, ratios=0.1)[0].at()
    values = squeal.eigenvalues(squeal.System(M_turned, C=C, K=K_turned)).values
    wanted = [w * complex(-0.1, 0.99**0.5) for w in omega if w > 1e-6]
    assert np.count_nonzero(abs(values) > 1e-6) == 2 * len(wanted)
    for z in wanted:
        assert min(abs(values - z)) < 1e-9 * abs(z)
    with pytest.raises(InputError, match=f"of {heavy} modes are not allowed"):
        damped(system, ratios=[0.1] * (heavy + 1))


@pytest.mark.parametrize("stiffness", [1e2, 1e8, 1e12])
@pytest.mark.parametrize("units", [(1.0, 1.0, 1.0, 1.0, 1.0), (1.0, 1e3, 1e-6, 1e4, 1e-3)])
@pytest.mark.parametrize("coupling", [0.0, 0.5])
@pytest.mark.parametrize("mass", [0.0, 1e-3, 1.0])
def test_stiff_rows_without_mass_leave_slow_modes_their_digits(stiffness, units, coupling, mass):
    """Two masses, of which one moves two massless rows of the stiffness k [[2, -1], [-1, 2]]; their
    static reaction takes 2/3 of coupling^2 from its own stiffness. The last row stands alone."""
    K = np.diag([3.3, 2.2, 2 * stiffness, 2 * stiffness, stiffness])
    K[0, 1] = K[1, 0] = -1.0
    K[1, 2] = K[2, 1] = coupling * stiffness**0.5
    K[2, 3] = K[3, 2] = -stiffness
    M = np.diag([1.0, 1.0, 0.0, 0.0, mass])
    scale = np.outer(units, units)
    omega, modes = real_modes(K * scale, M * scale, 5, ratios=None)
    condensed = 2.2 - 2 / 3 * coupling**2
    middle, half = (3.3 + condensed) / 2, (3.3 - condensed) / 2
    squares = [middle - np.hypot(half, 1.0), middle + np.hypot(half, 1.0)]
    if mass:
        squares.append(stiffness / mass)
    assert omega**2 == pytest.approx(squares, rel=1e-9)
    assert modes.T @ (M * scale) @ modes == pytest.approx(np.eye(len(squares)), abs=1e-9)


@pytest.mark.parametrize("stiffness", [1.0, 1e12, 1e16])
def test_a_stiff_row_without_mass_leaves_a_sparse_chain_its_modes(stiffness):
    """A chain of n unit masses between walls has the frequencies 2 sin(k pi / (2 n + 2))."""
    n = 500
    neighbours = np.append(-np.ones(n - 1), 0.0)
    diagonal = np.append(2.0 * np.ones(n), stiffness)
    K = csc_array(diags_array([neighbours, diagonal, neighbours], offsets=[-1, 0, 1]))
    M = csc_array(diags_array(np.append(np.ones(n), 0.0)))
    omega, _ = real_modes(K, M, 5, ratios=None)
    assert omega == pytest.approx(2 * np.sin(np.arange(1, 6) * np.pi / (2 * n + 2)), rel=1e-9)


def test_modal_ratios_are_the_damping_ratios():
    for factor in ("1", "lining"):
        K = (Term(K0, Formula(factor)), Term(K1, Formula("mu")))
        system = TermSystem((Term(M),), (), K, {"mu": 0.0, "lining": 1.0})
        found = complex_eigenvalues(*damped(system, ratios=[0.01, 0.03])[0].at())
        assert [e.damping_ratio for e in found.eigenvalues[::2]] == pytest.approx([0.01, 0.03])


def test_every_kind_of_system_takes_one_form():
    terms = _system()
    exact = with_slopes(terms, [1.0, 2.2, 3.0], 1.0, 3.0)
    found = with_slopes(lambda p: terms(p), [1.0, 2.2, 3.0], 1.0, 3.0)
    for (at, slopes), (exact_at, exact_slopes) in zip(found, exact, strict=True):
        assert np.array_equal(np.array(at), np.array(exact_at))
        assert np.array(slopes) == pytest.approx(np.array(exact_slopes), rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("kind", ["datetime64[D]", "timedelta64[s]", "V8", "S3", "U3"])
def test_arrays_of_no_numbers_are_refused(kind):
    with pytest.raises(InputError, match="must be a matrix of finite numbers"):
        Term(np.zeros((2, 2), kind))


def test_masked_entries_are_no_numbers():
    """Their values, whatever they are, entered the matrix."""
    masked = np.ma.masked_equal([[1.0, 0.0], [0.0, 1e20]], 1e20)
    with pytest.raises(InputError, match="masked"):
        Term(masked)
    assert Term(np.ma.masked_equal(np.eye(2), 7.0)).matrix.tolist() == np.eye(2).tolist()


@pytest.mark.parametrize("factor", ["1/3", "mu/3", "3", "mu"])
def test_rounding_of_a_factor_is_that_of_its_numbers_in_fractions(factor):
    entries = np.random.default_rng(0).uniform(1.0, 2.0, 400)
    # two terms: the rounding of products counts beside that of the factor
    system = TermSystem(
        (Term(np.eye(20)),),
        (),
        (Term(entries.reshape(20, 20), Formula(factor)), Term(np.zeros((20, 20)))),
        {"mu": 1.1},
    )
    mu = Fraction(1.1)
    exact = {"1/3": Fraction(1, 3), "mu/3": mu / 3, "3": Fraction(3), "mu": mu}
    bounds = rounding_of_sums(system)[2].ravel()
    for entry, computed, bound in zip(entries, system.at()[2].ravel(), bounds, strict=True):
        assert abs(Fraction(computed) - exact[factor] * Fraction(entry)) <= Fraction(bound)


def test_sparse_matrices_of_the_older_kind_are_taken_as_arrays():
    # as scipy.io.mmread returns them
    K = diags_array([np.arange(1.0, 6.0)], offsets=[0])
    friction = csc_matrix((np.ones(4), (np.arange(4), np.arange(1, 5))), shape=(5, 5))
    answers = []
    for kind in (csc_array, csc_matrix):
        system = squeal.System(
            kind(np.eye(5)), kind(0.01 * np.eye(5)), {"1": kind(K), "mu": kind(friction)}
        )
        assert isinstance(system.K[0].matrix, csc_array)
        answers.append(str(squeal.thresholds(system, high=0.2, band=(0.2, 0.4))))
    assert answers[0] == answers[1]


def test_a_frequency_that_is_replaced_is_held():
    K = {"1": [[1.0]], "frequency": [[2.0]]}
    following = squeal.System([[1.0]], [[0.1]], K)
    held = following.replace({"frequency": 4.0})
    assert (following.follows, held.follows) == (("frequency",), ())
    roots = squeal.eigenvalues(held).eigenvalues
    assert roots[0].value == pytest.approx(-0.05 + 1j * np.sqrt(9.0 - 0.05**2))


def test_a_parameter_may_have_the_name_of_a_greek_letter():
    system = squeal.System([[1.0]], K={"1": [[1.0]], "Ω": [[2.0]]}, parameter="Ω")
    assert system(0.5)[2].item() == 2.0


def test_matrices_of_a_large_sparse_system_take_no_dense_array():
    """An array of 400,000 rows and columns would take 1.3 TB."""
    n = 400_000
    stiffness = diags_array(np.arange(1.0, n + 1.0), format="csc")
    system = squeal.System(eye_array(n, format="csc"), K={"1": stiffness, "mu": stiffness})
    _, _, K = system.at({"mu": 1.0})
    assert K.nnz == n
    assert K.diagonal()[-1] == 2.0 * n
