"""What the referee makes of answers at a value, of systems whose roots are known."""

import importlib

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import squeal
from benchmarks.refute import rows_of
from squeal.errors import InputError, InputWarning
from squeal.linear.eigen import Spectrum
from tests.proof.families import sample

roots_module = importlib.import_module("squeal.queries.systems.roots")


def proof(answer):
    return answer.to_dict()["proof"]


def test_a_flutter_pair_is_proved():
    """s = 2 +- sqrt(1 - 4/3), with s = -lambda^2."""
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=[[2, 1 / 3], [-1, 2]]), prove=True)
    assert (found.verdict, found.certified) == ("flutter", True)
    known = {"status": "proved", "by": "enclosure", "growth_below": 0.0, "data": "half an ulp"}
    assert proof(found) == known | {"reason": None, "where": None}
    assert "4 roots, proved: no other mode grows\n" in str(found)


def test_a_defective_pair_that_rounding_parts_is_open():
    """A rotation by 1 rad cannot be written in doubles: half an ulp gives flutter or none."""
    c = np.cos(1.0)
    s = np.sin(1.0)
    Q = np.array([[c, -s], [s, c]])
    found = squeal.eigenvalues(
        squeal.System(np.eye(2), K=Q @ [[4.0, 1.0], [0.0, 4.0]] @ Q.T), prove=True
    )
    assert (found.verdict, found.certified) == (None, False)
    assert proof(found)["status"] == "open"
    assert "last digits" in proof(found)["reason"]
    assert "4 roots, open: " in str(found)
    assert found.conclusion.startswith("Open: ")


@pytest.mark.parametrize("corner", [1e-15, -1e-15, 1e-16, -1e-16])
def test_a_list_that_the_entries_as_given_refute_gives_way_to_their_roots(corner):
    """(4 - s)^3 = -corner with s = -lambda^2: two of three squares around 4 are complex. Within
    half an ulp of the 4 all of them may be real."""
    K = np.array([[4.0, 1.0, 0.0], [0.0, 4.0, 1.0], [corner, 0.0, 4.0]])
    squares = 4.0 + np.cbrt(corner) * np.exp(2j * np.pi * np.arange(3) / 3.0)
    exact = np.concatenate([1j * np.sqrt(squares), -1j * np.sqrt(squares)])
    found = squeal.eigenvalues(squeal.System(np.eye(3), K=K))
    assert (found.verdict, found.certified) == (None, False)
    assert "as given the verdict is flutter" in proof(found)["reason"]
    for root in found.values:
        assert np.min(np.abs(exact - root)) < 1e-12
    for root in exact:
        assert np.min(np.abs(found.values - root)) < 1e-12
    assert proof(found)["growth_below"] >= exact.real.max()
    assert not found.unstable  # none grows for all entries within half an ulp
    assert all(root.error > abs(root.value.real) for root in found.eigenvalues)


@pytest.mark.parametrize("damping", [1e-17, -1e-17, 1e-20, -1e-20])
@pytest.mark.parametrize("stiffness", [1.0, 2.0, 3.0, 4.0])
def test_a_damped_root_that_is_computed_on_the_axis_is_proved_as_any_other(damping, stiffness):
    """q'' + c q' + k q = 0, of which the solver finds a real part of exactly 0 for k = 1 and 4."""
    found = squeal.eigenvalues(squeal.System([[1.0]], [[damping]], [[stiffness]]))
    assert (found.verdict, found.certified) == ("stable" if damping > 0.0 else "flutter", True)
    assert found.eigenvalues[0].growth_rate == pytest.approx(-damping / 2.0, rel=1e-12)
    assert len(found.unstable) == (damping < 0.0)


def test_a_defective_pair_of_integers_is_proved_as_given():
    """An integer matrix of determinant one hides the Jordan block exactly."""
    R = np.array([[2.0, 1.0], [1.0, 1.0]])
    inverse = np.array([[1.0, -1.0], [-1.0, 2.0]])
    K = R @ [[4.0, 1.0], [0.0, 4.0]] @ inverse
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=K), prove=True)
    assert (found.verdict, found.certified) == ("marginal", True)
    assert (proof(found)["by"], proof(found)["data"]) == ("exact", "as given")
    assert "proved: no other mode grows (entries as given)" in str(found)


R = np.array([[2, 1, 0], [1, 1, 0], [0, 1, 1]])
INVERSE = np.array([[1, -1, 0], [-1, 2, 0], [1, -2, 1]])


@pytest.mark.parametrize("blocks", [[4, 4, 4], [4, 4, 9], [4, 9, 16], [0, 0, 4], [0, 4, 4]])
@pytest.mark.parametrize("above", [[0, 0], [1, 0], [0, 1], [1, 1]])
@pytest.mark.parametrize("prove", [None, False])
def test_a_double_frequency_of_one_shape_is_the_limit_of_flutter(blocks, above, prove):
    """t sin(omega t) is a motion where K - omega^2 has fewer null vectors than omega^2 is a root.

    Numbers above the diagonal of K leave its roots alone, and the vectors only of distinct ones.
    """
    triangle = np.diag(blocks) + np.diag(above, 1)
    K = R @ triangle @ INVERSE
    limits = []
    for square in sorted({*blocks} - {0}):
        shapes = 3 - np.linalg.matrix_rank(K - square * np.eye(3))
        if shapes < blocks.count(square):
            limits.append(np.sqrt(square) / (2 * np.pi))
    found = squeal.eigenvalues(squeal.System(np.eye(3), K=K), prove=prove)
    if prove is None:
        assert (found.verdict, found.certified) == ("marginal", True)
    if found.verdict is None:  # three that coincide, which rounding parts by 1e-5
        return
    if limits:
        assert f"on the limit of flutter, modes at {limits[0]:.4g} Hz" in found.conclusion
    else:
        assert found.conclusion == "Marginal: no mode grows, not all decay"


@pytest.mark.parametrize("coupling", [3e7, 1e8, 1e9])
@pytest.mark.parametrize(
    "ones", [[[0, 0, 1], [0, 0, 1], [0, 0, 0]], np.kron(np.eye(2), [[0, 1], [0, 0]])]
)
@pytest.mark.parametrize("turn", [np.eye(4), np.tri(4)])
def test_a_double_frequency_of_two_shapes_is_no_limit_of_flutter(coupling, ones, turn):
    """However large the conditions are that a third mode brings."""
    n = len(ones)
    turn = turn[:n, :n]
    K = np.diag([4, 4, 5] if n == 3 else [4, 5, 4, 5]) + coupling * np.array(ones)
    K = turn @ K @ np.round(np.linalg.inv(turn))
    assert n - np.linalg.matrix_rank(K - 4 * np.eye(n)) == 2
    found = squeal.eigenvalues(squeal.System(np.eye(n), K=K))
    assert found.conclusion == "Marginal: no mode grows, not all decay"


def test_two_frequencies_that_rounding_does_not_tell_apart_have_one_shape_to_rounding():
    """Roots 1 -+ 1.5e-8, whose vectors differ by as much."""
    t = 2.0**-50
    K = [[1 + (1 + t) / 2, (1 - t) / 2], [-(1 - t) / 2, 1 - (1 + t) / 2]]
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=K))
    assert found.conclusion.startswith("Marginal: to rounding on the limit of flutter")


def test_a_report_at_the_threshold_says_that_it_is_the_limit():
    """s = 2 +- sqrt(1 - 4 mu / 3), of which both are 2 at mu = 3/4: in doubles, exactly."""
    K = {"1": [[2.0, -1.0], [-0.75, 2.0]], "mu": [[0.0, 0.0], [1.0, 0.0]]}
    system = squeal.System(np.eye(2), K=K, parameters={"mu": 0.75})
    assert squeal.report(system).advice.startswith("On the limit of flutter at mu = 0.75.")


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_free_body_is_proved_marginal(damping):
    chain = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    found = squeal.eigenvalues(squeal.System(np.eye(3), C=damping * chain, K=chain), prove=True)
    assert (found.verdict, found.certified, found.count) == ("marginal", True, 6)
    assert found.conclusion == "Marginal: no mode grows, not all decay"  # its drift is no fault


def test_a_shuffled_triangle_is_proved():
    order = [2, 0, 3, 1]
    T = np.diag([1.0, 4.0, 9.0, 16.0]) + 1e6 * np.triu(np.ones((4, 4)), 1)
    found = squeal.eigenvalues(squeal.System(np.eye(4), K=T[np.ix_(order, order)]), prove=True)
    assert (found.verdict, found.certified) == ("marginal", True)
    upper = sorted(z.imag for z in found.values if z.imag > 0.0)
    assert upper == pytest.approx([1.0, 2.0, 3.0, 4.0], rel=1e-9)


@pytest.mark.parametrize("asked", [{}, {"modes": 5}, {"band": (0.1, 0.6)}])
def test_a_chain_of_sixty_is_proved(asked):
    """s = 2 - 2 cos(j pi / 61), damped in proportion; a band and the lowest are parts of it."""
    K = 2.0 * np.eye(60) - np.eye(60, k=1) - np.eye(60, k=-1)
    found = squeal.eigenvalues(squeal.System(np.eye(60), C=0.01 * K, K=K), prove=True, **asked)
    s = 2.0 - 2.0 * np.cos(np.arange(1, 61) * np.pi / 61)
    exact = -0.005 * s + 1j * np.sqrt(s - (0.005 * s) ** 2)
    assert (found.verdict, found.certified) == ("stable", True)
    assert proof(found)["status"] == "proved"
    for value in found.values[found.values.imag > 0.0]:
        assert np.abs(exact - value).min() < 1e-10
    low, high = (2.0 * np.pi * f for f in asked.get("band", (0.0, 1.0)))
    expected = asked.get("modes") or np.sum((exact.imag > low) & (exact.imag < high))
    assert np.sum(found.values.imag > 0.0) == expected


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_refuted_answer_never_reaches_the_user(damping, monkeypatch):
    """The solver moves a pair to growth; the listed roots are those of the system all the same."""
    solve = roots_module.spectrum_of

    def wrong(*known):
        each = list(solve(*known).eigenvalues)
        for k in (0, 1):
            moved = each[k].value + 0.3
            each[k] = type(each[k])(moved, each[k].right, each[k].left, 1e-16, 1.0, 1e-15)
        return Spectrum(tuple(each))

    monkeypatch.setattr(roots_module, "spectrum_of", wrong)
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    C = damping * np.eye(2)
    system = squeal.System(np.eye(2), C=C, K=K) if damping else squeal.System(np.eye(2), K=K)
    with pytest.warns(InputWarning, match="referee"):
        found = squeal.eigenvalues(system, prove=True)
    exact = [complex(-damping / 2, np.sqrt(s - damping**2 / 4)) for s in (1.0, 3.0)]
    assert [z for z in found.values if z.imag > 0.0] == pytest.approx(exact, rel=1e-12)
    assert (found.verdict, found.certified) == ("stable" if damping else "marginal", True)
    assert not found.unstable


def test_without_flint_the_enclosure_judges_alone(monkeypatch):
    monkeypatch.setattr(importlib.import_module("squeal.proof.exact"), "flint", None)
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=[[2, 1 / 3], [-1, 2]]), prove=True)
    assert found.certified
    twin = squeal.eigenvalues(squeal.System(np.eye(2), K=[[4, 1], [0, 4]]), prove=True)
    integers = squeal.System(np.eye(2), K=[[2.0, 4.0], [-1.0, 6.0]])  # a Jordan block at 4
    defective = squeal.eigenvalues(integers, prove=True)
    assert twin.certified  # its rows are two components
    assert (defective.certified, proof(defective)["status"]) == (False, "open")


def test_complex_matrices_are_proved_by_what_lies_above_the_real_axis():
    K = np.diag([1.0 + 0.1j, 4.0 - 0.4j])  # a loss factor of each sign: the second mode grows
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=K))
    assert (proof(found)["status"], proof(found)["by"]) == ("proved", "enclosure")
    assert (found.certified, found.verdict) == (True, "flutter")
    grows = np.sqrt(-K[1, 1]) if np.sqrt(-K[1, 1]).imag > 0 else -np.sqrt(-K[1, 1])
    assert np.isclose(found.unstable[0].growth_rate, grows.real)


@pytest.mark.parametrize(
    ("M", "K", "verdict"),
    [
        ([[1, 1], [1, 1]], [[1, 1], [1, 1 + 2.0**-52]], "marginal"),
        (
            [[1, 2, 3], [4, 5, 6], [7, 8, 9]],
            [[1, 2, 3], [4, 5, 6], [7, 8, 9 + 2.0**-49]],
            "marginal",
        ),
    ],
)
def test_matrices_that_rounding_takes_for_singular_together_have_their_roots(M, K, verdict):
    """det(K - s M) is no zero polynomial: of the first 2^-52 (1 - s)."""
    found = squeal.eigenvalues(squeal.System(np.array(M, float), K=np.array(K, float)))
    assert (found.verdict, found.certified) == (verdict, True)


def test_matrices_that_are_singular_together_are_refused():
    with pytest.raises(InputError, match="are singular together, so that"):
        squeal.eigenvalues(squeal.System(np.ones((2, 2)), K=2.0 * np.ones((2, 2))))


def test_a_system_without_any_motion_is_stable_and_says_so():
    """det(s^2 M + K) = 1: no number is a root."""
    found = squeal.eigenvalues(squeal.System([[0.0, 1.0], [0.0, 0.0]], K=np.eye(2)))
    assert (found.verdict, found.certified, found.count) == ("stable", True, 0)
    assert "no motion satisfies the equations" in str(found)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [5, 7, 9])
def test_soft_modes_beside_stiff_ones_are_listed_as_the_referee_knows_them(number):
    """Rounding moves roots of 1e-3 rad/s beside 1e6 rad/s further than they lie apart."""
    rng = np.random.default_rng([2911, 8, number])
    known = sample("modal", rows_of(rng, 24), bool(rng.integers(2)), rng)
    answer = squeal.eigenvalues(squeal.System(known.M, known.C, known.K))
    assert (answer.proof["status"], answer.verdict) == ("proved", known.verdict)
    listed = np.array([root.value for root in answer.eigenvalues])
    distances = np.abs(listed[:, None] - known.roots)
    pairs = linear_sum_assignment(distances)
    assert np.all(distances[pairs] <= 1e-12 * np.abs(known.roots[pairs[1]]))
