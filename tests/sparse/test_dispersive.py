"""Matrices that depend on the frequency of each root: closed forms and larger linear systems."""

from contextlib import nullcontext

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from scipy.sparse import csc_array

import squeal
from squeal import Term, TermSystem
from squeal.errors import InputError
from squeal.linear.moduli import Modulus, Table
from squeal.numerics.differentiation import Formula
from squeal.sparse import dense, reduction
from squeal.sparse.axis_crossing import CrossingGuess, axis_crossing
from squeal.sparse.quadratic import ScaledSystem

RATE = 2 * np.pi * 1000.0
LATE = 1 / (0.9 * RATE)  # s, relaxation
BAND = (300.0, 3000.0)
K0 = RATE**2 * np.array([[1.0, -0.3, 0.0], [-0.3, 1.1, -0.2], [0.0, -0.2, 1.6]])
C0 = 1e-3 / RATE * K0
b = np.array([1.0, 0.5, -0.2])
B = 0.2 * RATE**2 * np.outer(b, b)
SHORT = Table("t.csv", (200.0, 3100.0), (1.0, 1.2), (0.1, 0.1))
FRICTION = np.zeros((3, 3))
FRICTION[:2, :2] = 0.5 * RATE**2 * np.array([[0.0, 1.0], [-1.0, 0.0]])
STORAGE = f"(omega*{LATE!r})**2/(1 + (omega*{LATE!r})**2)"
LOSS = f"1/(omega*{LATE!r})"


def _brake(modulus, kind=np.asarray, mu=0.1):
    K = (Term(kind(K0)), Term(kind(B), modulus), Term(kind(FRICTION), Formula("mu")))
    return TermSystem((Term(kind(np.eye(3))),), (Term(kind(C0)),), K, {"mu": mu})


def _with_internal_coordinate():
    """The same Maxwell branch, k s T/(1 + s T), as a linear system of one row more."""
    M = np.zeros((4, 4))
    C = np.zeros((4, 4))
    K = np.zeros((4, 4))
    F = np.zeros((4, 4))
    M[:3, :3] = np.eye(3)
    C[:3, :3] = C0
    F[:3, :3] = FRICTION
    K[:3, :3] = K0 + B
    K[3, 3] = 0.2 * RATE**2
    K[:3, 3] = K[3, :3] = -K[3, 3] * b
    C[3, 3] = LATE * K[3, 3]
    return squeal.System(M, C, {"1": K, "mu": F}, {"mu": 0.1})


def _fastest(brake, mu):
    return max(squeal.eigenvalues(brake, mu, band=BAND).eigenvalues, key=lambda e: e.value.real)


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
def test_thresholds_of_a_maxwell_branch_are_those_of_its_internal_coordinate(kind):
    """On the imaginary axis the modulus at omega = |Im lambda| is that at s = lambda."""
    brake = _brake(Modulus(Formula(STORAGE), Formula(LOSS)), kind)
    found = squeal.thresholds(brake, 2.0, band=BAND)
    exact = squeal.thresholds(_with_internal_coordinate(), 2.0, band=BAND)
    assert len(found.crossings) == len(exact.crossings) == 1
    assert found.certified is None
    for name in ("mu", "frequency_hz", "direction", "kind"):
        one = getattr(found.crossings[0], name)
        other = getattr(exact.crossings[0], name)
        assert one == (other if isinstance(other, str) else pytest.approx(other, rel=1e-12))
    # eigenvalues cross there, and the sweep and the map say so
    at = [exact.crossings[0].mu * x for x in (0.999, 1.001)]
    verdicts = [step.verdict for step in squeal.sweep(brake, at, band=BAND).steps]
    assert verdicts == [squeal.eigenvalues(brake, x, band=BAND).verdict for x in at]
    assert verdicts == [None, "flutter"]


def test_thresholds_solve_each_frozen_problem_of_a_basis_once(monkeypatch):
    """The search of the basis, that of the crossings and the comparison ask for the same ones."""
    solved = []
    dense_values = dense.dense_values

    def noted(*problem):
        solved.append(b"".join(matrix.tobytes() for matrix in problem[:3]))
        return dense_values(*problem)

    monkeypatch.setattr(reduction, "dense_values", noted)
    squeal.thresholds(_brake(Modulus(Formula(STORAGE), Formula(LOSS)), csc_array), 2.0, band=BAND)
    assert len(solved) == len(set(solved)) > 13 * 7  # values of mu times frozen frequencies


def test_what_moves_roots_and_thresholds_is_taken_at_their_own_frequency():
    brake = _brake(Modulus(Formula(STORAGE), Formula(LOSS)), mu=0.6)
    exact = _with_internal_coordinate()
    wide = np.zeros((4, 4))
    wide[:3, :3] = B
    found = squeal.sensitivity(brake, "threshold", band=BAND, matrices={"q": {"K": B}})
    other = squeal.sensitivity(exact, "threshold", band=BAND, matrices={"q": {"K": wide}})
    assert found.slopes["q"] == pytest.approx(other.slopes["q"], rel=1e-9)
    found = squeal.sensitivity(brake, band=BAND)
    h = 1e-4
    up = squeal.eigenvalues(brake, 0.6 + h, band=BAND).values
    down = squeal.eigenvalues(brake, 0.6 - h, band=BAND).values
    assert found.slopes.keys() == {"mu"}
    assert found.slopes["mu"] == pytest.approx((up - down) / (2 * h), rel=1e-5)


def test_the_slope_of_a_crossing_is_that_of_the_root_at_its_own_frequency():
    stiff = Modulus(Formula(f"30*{STORAGE}"), Formula(f"0.2*{LOSS}"))
    brake = _brake(stiff)
    h = 1e-4
    (there,) = squeal.thresholds(brake, 2.0, band=BAND).crossings
    near = _fastest(brake, there.mu)
    guess = CrossingGuess(there.mu, near.value.imag, near.right, near.left.conj())
    found = axis_crossing(ScaledSystem(brake), "mu", guess)
    assert found.value == pytest.approx(there.mu, rel=1e-12)
    up = _fastest(brake, there.mu + h).value.real
    down = _fastest(brake, there.mu - h).value.real
    assert found.slope == pytest.approx((up - down) / (2 * h), rel=1e-8)


def test_one_degree_of_freedom_is_the_root_of_its_cubic():
    """lambda^2 + w^2 (1 + i eta) (a + b omega) = 0 with omega = Im lambda."""
    for eta, slope in ((0.0, 0.3), (0.04, 0.3), (0.04, -0.1)):
        K = {f"1 + {slope}*omega/{RATE!r}": [[RATE**2 * (1 + 1j * eta)]]}
        (root,) = squeal.eigenvalues(squeal.System([[1.0]], K=K), band=BAND).values / RATE
        # lambda = omega (i - t), where t is the share that the angle of 1 + i eta makes
        t = np.tan(np.arctan(eta) / 2)
        size = np.sqrt((1 + eta**2) ** 0.5) * np.cos(np.arctan(eta) / 2)
        omega = max(np.roots([1.0, -slope * size**2, -(size**2)]).real)
        assert root == pytest.approx(omega * (1j - t), rel=1e-13)


def test_a_table_of_a_formula_is_the_formula():
    hertz = np.linspace(200.0, 3100.0, 400)
    x = (2 * np.pi * hertz * LATE) ** 2
    table = Table("t.csv", *map(np.ndarray.tolist, (hertz, x / (1 + x), 1 / np.sqrt(x))))
    given = Modulus(table=table), Modulus(Formula(STORAGE), Formula(LOSS))
    one, other = (squeal.eigenvalues(_brake(m), 0.6, band=BAND) for m in given)
    assert len(one.values) == 3
    assert one.values == pytest.approx(other.values, rel=1e-6)
    assert max(e.residual for e in one.eigenvalues) < 1e-14
    slope = (given[0].value({"frequency": 700.001}) - given[0].value({"frequency": 699.999})) / 2e-3
    assert given[0].slope({"frequency": 700.0}, "frequency") == pytest.approx(slope, rel=1e-7)


def test_every_root_is_found_where_frequencies_are_double_and_moduli_strong():
    """Each root solves the system frozen at its frequency, and as many lie below any frequency as
    with the matrices frozen there: roots move with it by less than it does."""
    random = np.random.default_rng(1)
    Q, _ = np.linalg.qr(random.standard_normal((40, 40)))
    own = 2 * np.pi * np.repeat(np.linspace(600.0, 3000.0, 20), 2)
    half = Q[:, :12] * 200.0
    K = Q * own**2 @ Q.T
    change = half @ half.T
    system = squeal.System(np.eye(40), K={"1": (1 + 0.01j) * K, "omega / 9": (1 + 0.3j) * change})

    def frozen(omega):
        roots = np.sqrt(-np.linalg.eigvals(system.frozen(omega).at()[2]))
        return np.where(roots.imag > 0, roots, -roots)

    found = squeal.eigenvalues(system, band=(500.0, 4500.0)).values
    assert len(found) == 40
    for z in found:
        assert np.min(np.abs(frozen(z.imag) - z)) < 1e-7 * abs(z)
    for omega in np.linspace(600.0, 4400.0, 12) * 2 * np.pi:
        assert np.sum(found.imag < omega) == np.sum(frozen(omega).imag < omega)


@pytest.mark.parametrize("region", [None, (-500.0, 500.0, -1.0, 19000.0)])
def test_a_modulus_that_is_flat_at_a_frozen_frequency_adds_no_root(region):
    """A root of the frozen matrices has no step there, but the frequency has to be its own."""
    frequencies = (0.0, 1000.0, 2000.0, 4000.0)  # Hz
    storage = (1.0, 1.0, 1.5, 1.5)
    table = Modulus(table=Table("flat.csv", frequencies, storage, (0.0, 0.0, 0.0, 0.0)))
    own = np.array([1.0, 2.5])
    K = (Term(RATE**2 * np.diag(own)), Term(RATE**2 / 2 * np.eye(2), table))
    system = TermSystem((Term(np.eye(2)),), (), K, {"mu": 0.0})
    where = {"region": region} if region else {"band": (200.0, 3000.0)}
    found = squeal.eigenvalues(system, **where)
    curve = PchipInterpolator(frequencies, storage)
    exact = [brentq(lambda hz, k=k: hz - 1000 * np.sqrt(k + curve(hz) / 2), 500, 3000) for k in own]
    assert found.values.imag / (2 * np.pi) == pytest.approx(exact, rel=1e-9)


def test_structural_damping_is_viscous_damping_at_the_frequency():
    """eta K of one root is C = eta K / omega there."""
    for eta in (0.02, 0.3):
        structural = Term(np.array([[RATE**2]]), Modulus(loss=Formula(repr(eta))))
        viscous = Term(np.array([[RATE**2]]), Formula(f"{eta} / omega"))
        mass = (Term(np.eye(1)),)
        spring = Term(np.array([[RATE**2]]))
        pair = TermSystem(mass, (), (structural,)), TermSystem(mass, (viscous,), (spring,))
        one, other = (squeal.eigenvalues(s, band=BAND).values[0] for s in pair)
        z = 1j * RATE * np.sqrt(1 + 1j * eta)
        assert one == pytest.approx(z, rel=1e-13)
        w = other.imag
        assert other**2 + other * eta * RATE**2 / w + RATE**2 == pytest.approx(0, abs=1e-6)
        assert other.real == pytest.approx(one.real, rel=eta)


@pytest.mark.parametrize(
    "ask",
    [
        lambda s: squeal.eigenvalues(s),
        lambda s: squeal.eigenvalues(s, band=(100.0, 3000.0)),
        lambda s: squeal.thresholds(s, band=(300.0, 4000.0)),
        lambda s: squeal.eigenvalues(s, region=(-1.0, 1.0, -5.0, -1.0)),
        lambda s: squeal.advise(s),
    ],
)
def test_what_a_dispersive_system_cannot_answer_is_refused(ask):
    with pytest.raises(InputError):
        ask(_brake(Modulus(table=SHORT)))


@pytest.mark.parametrize(
    ("band", "covered"),
    [((200.0, 3100.0), True), ((199.0, 3000.0), False), ((300.0, 3101.0), False)],
)
def test_tables_must_cover_the_band(band, covered):
    with nullcontext() if covered else pytest.raises(InputError):
        squeal.eigenvalues(_brake(Modulus(table=SHORT)), band=band)


@pytest.mark.parametrize(("slope", "beside"), [(0.0, 0), (-0.05, 0), (0.4, 3)])
def test_frequencies_that_meet_without_damping_flutter(slope, beside):
    """diag(1, 1.2) (1 + slope omega) + 0.2 mu J: they meet at 0.5 (1 + slope omega), where omega^2
    is 1.1 (1 + slope omega)."""
    stiffness = np.diag([1.0, 1.2, *(3.0 + np.arange(beside))])
    friction = np.zeros((2 + beside,) * 2)
    friction[:2, :2] = [[0.0, 1.0], [-1.0, 0.0]]
    K = {f"1 + {slope}*omega": stiffness, "0.2*mu": friction}
    system = squeal.System(np.eye(2 + beside), K=K, parameters={"mu": 0.0})
    found = squeal.thresholds(system, 1.0, band=(0.05, 0.5))
    omega = (1.1 * slope + np.sqrt((1.1 * slope) ** 2 + 4.4)) / 2
    (one,) = found.crossings
    assert (one.kind, one.direction, one.changes_verdict) == ("flutter", "up", True)
    assert one.mu == pytest.approx(0.5 * (1.0 + slope * omega), rel=1e-11)
    assert 2 * np.pi * one.frequency_hz == pytest.approx(omega, rel=1e-9)


@pytest.mark.parametrize("offset", [0.125, 0.25])
def test_frequencies_that_meet_nowhere_at_their_own_frequency_are_no_threshold(offset):
    """diag(3, 5) / 4 + mu J, times (offset + omega)^2: frozen at omega the two meet at the
    frequency offset + omega, which is nowhere omega, and differs from it by the same everywhere."""
    factor = f"({offset} + omega)**2"
    friction = np.array([[0.0, 1.0], [-1.0, 0.0]])
    K = {factor: np.diag([0.75, 1.25]), f"{factor}*mu": friction}
    system = squeal.System(np.eye(2), K=K, parameters={"mu": 0.0})
    assert not squeal.thresholds(system, 1.0, band=(0.05, 0.5)).crossings
