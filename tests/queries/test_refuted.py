"""Answers that an adversary who saw no code found wrong, although they were certified."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from scipy import sparse

import squeal
from squeal.io.scene import Scene
from squeal.linear.moduli import Modulus
from squeal.linear.terms import Term
from squeal.model.contact import State
from squeal.numerics.differentiation import Formula
from squeal.results.sources import PadSource
from squeal.schema import Place
from tests.conftest import scene_of
from tests.exact import Exact


@pytest.mark.parametrize("damping", [0.3, 3e7, 3e15])
@pytest.mark.parametrize("mu", [1 / 3, 0.7, 0.123])
def test_terms_that_cancel_but_for_rounding_leave_the_verdict_open(damping, mu):
    """C = mu b - fl(mu b) is zero in doubles; the exact number is not, and decides."""
    rounded = damping * mu
    exact = Fraction(damping) * Fraction(mu) - Fraction(rounded)
    assert exact != 0
    system = squeal.System([[1.0]], C={"1": [[-rounded]], "mu": [[damping]]}, K=[[4.0]])
    found = squeal.eigenvalues(system, at=mu)
    assert not found.certified
    assert found.verdict in (None, "stable" if exact > 0 else "flutter")


def test_a_formula_that_loses_its_parameter_to_rounding_is_not_proved():
    system = squeal.System([[1.0]], C={"1 + mu - 1": [[-1.0]]}, K=[[4.0]])
    found = squeal.eigenvalues(system, at=1e-17)  # exactly flutter, of 5e-18 1/s
    assert not found.certified


def test_terms_that_cancel_without_rounding_are_proved():
    system = squeal.System([[1.0]], C={"1": [[-1.5]], "mu": [[2.0]]}, K=[[4.0]])
    found = squeal.eigenvalues(system, at=0.75)
    assert (found.verdict, found.certified) == ("marginal", True)


def test_what_is_proved_to_grow_is_listed_among_the_unstable_modes():
    """Two nearly parallel rows; a root grows by 2^-32.3 1/s, less than the distance to which it is
    known, but no less proved."""
    M = [[38.5, 26.5], [26.5, 18.5]]
    C = [[191.99999999907686, 127.99999999907413], [191.99999999907413, 127.99999999907232]]
    K = [[803.5, 537.5], [539.5, 361.5]]
    growth = 1.8626451492309571e-10  # of the determinant in rational numbers
    found = squeal.eigenvalues(squeal.System(M, C=C, K=K))
    assert (found.verdict, found.certified) == ("flutter", True)
    (mode,) = found.unstable
    assert mode.kind == "flutter"
    assert mode.growth_rate == pytest.approx(growth, rel=1e-3)
    assert "1 unstable mode" in found.conclusion


@pytest.mark.parametrize("width", [0.03125, 0.0078125])
@pytest.mark.parametrize("centre", [0.81, 0.3])
def test_a_window_of_structural_damping_is_proved(width, centre):
    """Two rows with structural damping: they grow exactly for |mu - centre| < width / 2."""
    damping = width * 2.0**-3
    stiffness = np.array([[400.0 - centre, 5 * damping], [-5 * damping, 400.0 + centre]])
    K = {"1": stiffness + 3j * damping * np.eye(2), "mu": np.diag([1.0, -1.0])}
    system = squeal.System(np.eye(2), K=K)
    found = squeal.thresholds(system, 1.0, band=(0.1, 20.0))
    true = [centre - width / 2, centre + width / 2]
    assert [c.mu for c in found.crossings] == pytest.approx(true, abs=1e-6)
    assert (found.certified, found.proof["status"]) == (True, "proved")


def test_a_window_under_a_modulus_whose_loss_varies_is_proved():
    """Two rows of loss h = 400 c mu, coupled by e: they grow where h^2 < e^2 - (mu - centre)^2."""
    centre = 0.5
    coupling = 2.0**-7
    c = 2.0**-18
    one = np.eye(2)
    K = (
        Term(400.0 * one, Modulus(loss=Formula(f"{c!r} * mu"))),
        Term(coupling * np.array([[0.0, 1.0], [-1.0, 0.0]])),
        Term(np.diag([1.0, -1.0]), Formula(f"mu - {centre!r}")),
    )
    system = squeal.System((Term(one),), K=K, parameters={"mu": 0.0})
    found = squeal.thresholds(system, 1.0, band=(0.1, 20.0))
    # (1 + (400 c)^2) mu^2 - 2 centre mu + centre^2 - e^2 = 0
    ends = np.roots([1.0 + (400.0 * c) ** 2, -2.0 * centre, centre**2 - coupling**2])
    assert [x.mu for x in found.crossings] == pytest.approx(np.sort(ends), abs=1e-9)
    assert found.certified


def test_a_root_that_is_met_more_often_than_there_are_rows_has_vectors():
    """-2 twice in two rows of their own, and +2 once."""
    M = np.diag([64.0, 0.0, 64.0])
    C = [[256.0, 0, 0], [-1, -1, 0], [0, 0, 256.0]]
    K = np.diag([256.0, 2.0, 256.0])
    found = squeal.eigenvalues(squeal.System(M, C=C, K=K))
    assert np.sort(found.values.real) == pytest.approx([-2, -2, -2, -2, 2], abs=1e-6)
    assert found.verdict == "divergence"


def test_regular_matrices_without_a_finite_root_have_no_verdict():
    """det(lambda^2 M + K) = -1 for every lambda; half an ulp more on M gives growing roots."""
    system = squeal.System([[1.0, -1.0], [-1.0, 1.0]], K=[[4.0, -3.0], [-3.0, 2.0]])
    found = squeal.eigenvalues(system)
    assert (found.verdict, found.certified) == (None, False)
    assert "there are 0" in found.proof["reason"]


@pytest.mark.parametrize("rows", [1, 2])
def test_all_motions_are_free_without_a_stiffness(rows):
    assert squeal.check(squeal.System(np.eye(rows), K=np.zeros((rows, rows)))).free == rows


@pytest.mark.parametrize(("offset", "loss"), [(0.7, 0.0), (0.0, 0.2)])
def test_a_growing_mode_that_enters_a_band_is_not_proved_away(offset, loss):
    """Row 1 grows exactly for |mu - 3/8| < d, and dips into the band at a place p within."""
    d = 1.0 / 64.0
    p = 0.375 + offset * d
    damping = f"0.1 * (1 - 2 / (1 + ((mu - 0.375) / {d})**2))"
    square = f"{4 * np.pi**2} * (1.9 - 1 / (1 + (100 / {d})**2 * (mu - {p})**2))"
    one = np.diag([1.0, 0.0])
    rest = np.diag([0.0, 20.0])
    K = {square: one, "1": rest + 1j * loss * rest if loss else rest}
    system = squeal.System(np.eye(2), C={damping: one, "1": 0.1 * rest / 20.0}, K=K)
    band = (0.5, 1.0)
    found = squeal.thresholds(system, 1.0, band=band)
    assert not found.certified
    assert found.proof["status"] == "open"
    assert "outside of the band" in found.proof_line
    at_dip = squeal.eigenvalues(system, at=p, band=band)
    assert (at_dip.verdict, at_dip.certified) == ("flutter", True)


@pytest.mark.parametrize("damper", [1e7, 1e9, 1e12])
def test_a_damper_hides_no_crossing_of_another_row(damper):
    """Row 2, q'' + (3 - 4 mu) q' + q = 0, grows for every mu > 3/4."""
    C = {"1": np.diag([damper, 3.0]), "mu": np.diag([0.0, -4.0])}
    found = squeal.thresholds(squeal.System(np.eye(2), C=C, K=np.eye(2)))
    assert found.crossings[0].mu == pytest.approx(0.75, abs=1e-9)
    assert found.certified
    assert found.proof["growth_below"] < 1e-3 * (3 - np.sqrt(5)) / 2  # slowest root of row 2


@pytest.mark.parametrize("stiffness", [1e15, 1e17, 1e20])
def test_a_stiff_row_beside_a_free_one_hides_no_crossing(stiffness):
    """Row 2, q'' + (1/2 - mu) q' + q = 0, grows for every mu > 1/2."""
    C = {"1": np.diag([0.0, 0.5, 0.0]), "mu": np.diag([0.0, -1.0, 0.0])}
    found = squeal.thresholds(squeal.System(np.eye(3), C=C, K=np.diag([0.0, 1.0, stiffness])))
    assert [one.mu for one in found.crossings] == pytest.approx([0.5], abs=1e-9)
    assert found.certified
    assert found.proof["growth_below"] <= 1e-3


@pytest.mark.parametrize("damper", [2.0**22, 2.0**28])
def test_a_window_beside_a_strong_damper_is_found(damper):
    """Row 1 grows where (mu - 5/4)^2 < 2^-8."""
    C = {"1": np.diag([-(2.0**-8), damper]), "(mu-1.25)**2": np.diag([1.0, 0.0])}
    found = squeal.thresholds(squeal.System(np.eye(2), C=C, K=np.diag([4.0, 1.0])))
    assert [one.mu for one in found.crossings] == pytest.approx([1.1875, 1.3125], abs=1e-9)
    assert found.certified


@pytest.mark.parametrize(("damper", "coupling"), [(1e9, 1.0), (1e12, 1e-3)])
def test_a_coupled_damper_hides_no_crossing_behind_a_proof(damper, coupling):
    """As above, coupled: the search may miss the crossing near 3/4, a proof may not."""
    C = {"1": np.diag([damper, 3.0]), "mu": np.diag([0.0, -4.0])}
    K = np.array([[3.0, -coupling], [-coupling, 1.0]])
    found = squeal.thresholds(squeal.System(np.eye(2), C=C, K=K))
    assert found.crossings or not found.certified


@pytest.fixture
def counts_as_large(monkeypatch):
    """What more than 40 rows are treated as."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)


def congruent(squares, seed):
    """An undamped system of these -lambda^2, M = L L', K = L D L', of exact integers."""
    n = len(squares)
    rng = np.random.default_rng(seed)
    L = sparse.identity(n, format="csr")
    for _ in range(2):
        rows = rng.permutation(n)
        first, second = rows[: n // 2], rows[n // 2 : 2 * (n // 2)]
        step = sparse.csr_array((np.ones(n // 2), (first, second)), shape=(n, n))
        L = (sparse.identity(n, format="csr") + step) @ L
    K = L @ sparse.diags_array(squares) @ L.T
    return squeal.System(sparse.csr_array(L @ L.T), K=sparse.csr_array(K))


@pytest.mark.usefixtures("counts_as_large")
@pytest.mark.parametrize(("seed", "prove"), [(0, None), (1, None), (0, True)])
def test_a_multiple_root_of_a_large_undamped_system_does_not_grow(seed, prove):
    """M and K are positive definite: every root is imaginary, 50i one of 25 rows."""
    squares = np.r_[100 + 7.0 * np.arange(60) ** 2, np.full(25, 2500.0)]
    system = congruent(squares, seed)
    found = squeal.eigenvalues(system, band=(0.5, 100 / (2 * np.pi)), prove=prove)
    assert found.verdict not in ("flutter", "divergence")
    assert not found.unstable


def copies_in_neighbouring_bands(system, hertz, root, band_ends):
    """How many copies of a root two bands that meet at it list, and whether they are certified."""
    listed = []
    for band in ((band_ends[0], hertz), (hertz, band_ends[1])):
        found = squeal.eigenvalues(system, band=band)
        listed.append((np.count_nonzero(np.abs(found.values - root) < 1e-6), found))
    return listed


@pytest.mark.usefixtures("counts_as_large")
@pytest.mark.parametrize(("copies", "seed"), [(2, 1), (13, 4), (25, 1), (60, 0)])
def test_a_multiple_root_at_the_end_of_a_band_is_not_split_in_a_large_system(copies, seed):
    """The more copies, the further rounding moves the outermost ones, each computer by its own."""
    squares = np.r_[100 + 7.0 * np.arange(60) ** 2, np.full(copies, 2500.0)]
    hertz = 50 / (2 * np.pi)
    system = congruent(squares, seed)
    for number, found in copies_in_neighbouring_bands(system, hertz, 50j, (0.5, 2 * hertz)):
        assert number == copies
        assert not found.certified
        assert "lies at an end" in found.proof["reason"]


def test_a_multiple_root_at_the_end_of_a_band_is_not_split():
    """Five roots of 50i, which rounding of the matrices leaves on both sides of the end."""
    squares = np.r_[100 + 7.0 * np.arange(7) ** 2, np.full(5, 2500.0)]
    Q = np.linalg.qr(np.random.default_rng(17).normal(size=(12, 12)))[0]
    K = Q @ np.diag(squares) @ Q.T
    system = squeal.System(np.eye(12), K=(K + K.T) / 2)
    hertz = 50 / (2 * np.pi)
    for number, found in copies_in_neighbouring_bands(system, hertz, 50j, (0.5, 2 * hertz)):
        assert number == 5
        assert not found.certified
        assert "lies at an end" in found.proof["reason"]


def test_a_tiny_mass_is_not_taken_for_a_shared_null_vector():
    """M = L diag(1, 2^-30, 0, 1) R and K = L diag(4, 1, 1, 9) R, both of determinant 1: the roots
    are those of each row, 2i, 3i and two that decay."""
    L = np.array([[0.0, -1, 0, -1], [0, 1, -1, 1], [1, 1, 1, 0], [1, 1, 0, 1]])
    R = np.array([[3.0, -4, 4, 0], [1, -1, 1, 0], [0, 0, 1, 0], [-3, 5, -7, 1]])
    M = L @ np.diag([1.0, 2.0**-30, 0.0, 1.0]) @ R
    C = L @ np.diag([0.0, 1.0, 0.0, 0.0]) @ R
    K = L @ np.diag([4.0, 1.0, 1.0, 9.0]) @ R
    found = squeal.eigenvalues(squeal.System(M, C=C, K=K))
    assert found.verdict == "marginal" or not found.certified
    assert found.verdict in (None, "marginal")


@pytest.mark.parametrize("exponent", [10, 20, 25, 30, 35])
def test_roots_far_from_those_that_the_solver_computes_are_listed(exponent):
    """Of a singular M, where a damper is 2^30 times the mass: det P is w^6 times a quartic."""
    w = 2.0**exponent
    M = [[0, -1, 0], [0, 0, 1], [0, 0, -2]]
    K = np.array([[2.0, 0, -2], [0, -1, 2], [1, 0, 1]]) * w**2
    found = squeal.eigenvalues(squeal.System(M, np.diag([2.0, 2, 1]) * w, K))
    # det P(w r) = w^6 (4 r^4 + ...): the polynomial by its values at five points, in fractions
    points = range(5)
    values = []
    for r in points:
        P = [[Fraction(int(M[i][j] * r * r)) for j in range(3)] for i in range(3)]
        for i, damper in enumerate((2, 2, 1)):
            P[i][i] += damper * r
        for i, j in np.ndindex(3, 3):
            P[i][j] += Fraction(int(K[i, j] / w**2))
        (a, b, c), (d, e, f), (g, h, k) = P
        values.append(float(a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g)))
    coefficients = np.linalg.solve(np.vander(points, 5).astype(float), values)
    exact = np.roots(coefficients) * w
    growing = np.sort(exact.real[exact.real > 0])
    listed = np.sort([mode.growth_rate for mode in found.unstable])
    assert listed == pytest.approx(growing, rel=1e-6)
    assert found.verdict == "divergence"


@pytest.mark.parametrize("k", range(2, 12))
def test_a_root_at_a_real_end_of_a_region_is_not_proved_away(k):
    """Of s^2 = k the root rounds to the end: on which side it lies the doubles do not say."""
    system = squeal.System([[1.0]], K=[[-float(k)]])
    end = float(np.sqrt(k))
    for region in ((end, 2 * end, -1.0, 1.0), (end / 2, end, -1.0, 1.0)):
        found = squeal.eigenvalues(system, region=region)
        assert len(found.eigenvalues) == 1
        assert not found.certified
    inside = squeal.eigenvalues(system, region=(end / 2, 2 * end, -1.0, 1.0))
    assert inside.certified


@pytest.mark.parametrize("region", [(-1, 1, -4, -2), (0, 1, -4, -2), (-1, 1, -4, 2)])
def test_a_region_of_conjugates_is_refused(region):
    """A mode that grows was listed there by its conjugate, and no unstable mode told of."""
    system = squeal.System(np.eye(3), np.diag([0.1, 0.1, -0.1]), np.diag([1.0, 4.0, 9.0]))
    with pytest.raises(squeal.InputError, match="below the real axis lie conjugates"):
        squeal.eigenvalues(system, region=region)


@pytest.mark.parametrize("stiffness", [3.0, 2.75, 5.5, 6.5])
@pytest.mark.filterwarnings("ignore:damping.ratios. modes above .* are not damped")
def test_modes_without_a_damping_ratio_are_not_proved_to_grow(tmp_path, stiffness):
    """Only the first of three modes has a ratio: the others are undamped, none of them grows."""
    K = f"[[{stiffness}, -1, 0], [-1, 2.5, -1], [0, -1, 4]]"
    eye = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    shift = f"{{matrix: {eye}, factor: mu}}"
    text = f"M: {eye}\nK: [{{matrix: {K}}}, {shift}]\ndamping: {{ratios: [0.01]}}\n"
    (tmp_path / "modal.yaml").write_text(text)
    system = squeal.read_system(tmp_path / "modal.yaml")
    found = squeal.eigenvalues(system)
    assert found.verdict in (None, "marginal")
    assert not found.unstable
    assert not found.certified
    damped = [root for root in found.eigenvalues if root.growth_rate < -1e-6]
    assert len(damped) == 2
    for step in squeal.sweep(system, [0.0, 1.0]).steps:
        assert step.verdict in (None, "marginal")


@pytest.mark.parametrize("method", ["reduced", "modal"])
def test_a_reduced_system_is_not_certified(method):
    """It approximates the system whose roots are asked for."""
    chain = squeal.System(np.eye(60), K=np.diag((2 * np.pi * np.arange(1, 61)) ** 2))
    found = squeal.eigenvalues(squeal.reduce(chain, band=(0.5, 3.7), method=method))
    assert not found.certified


def bead_on_bead(mu):
    """Two beads whose contact stiffens with its force, seated at a friction."""
    one = squeal.Component(
        squeal.System(np.eye(2), K=np.diag([40.0, 60.0]), name="one"), [1, 1], [0, 2]
    )
    two = squeal.Component(
        squeal.System(np.eye(2), K=[[2.0, -1.2], [-1.2, 3.0]], name="two"),
        [1, 1],
        [0, 2],
        load=[0.0, -5.0],
    )
    contact = squeal.Contact(
        ("one", "two"),
        [(1, 1)],
        (0, 0, 1),
        stiffness=2.0,
        sliding=(1, 0, 0),
        exponent=0.5,
        reference=1.0,
    )
    return squeal.assemble([one, two], [contact], {"mu": mu})


def test_contact_that_another_friction_seats_differently_is_not_certified():
    assembly = bead_on_bead(0.0)
    held = squeal.eigenvalues(assembly, at=1.5015)
    anew = squeal.eigenvalues(bead_on_bead(1.5015))
    assert held.verdict != anew.verdict
    assert anew.certified
    assert not held.certified
    steps = squeal.sweep(assembly, [0.0, 1.5015]).steps
    assert [step.certified for step in steps] == [True, False]
    assert squeal.eigenvalues(assembly, at=0.0).certified


def test_growth_that_begins_at_no_listed_threshold_is_not_called_counted():
    """M = mu: what grows comes from infinity."""
    C = np.array([[0.0, 1.0], [-1.0, 0.0]])
    system = squeal.System({"mu": np.eye(2)}, C, [[1.0, 0.2], [-0.2, 1.5]])
    found = squeal.thresholds(system, 2.0, band=(0.0, 100.0))
    assert not found.certified
    assert found.details["unconfirmed"]
    assert "counted" not in str(found)
    assert "no change of stability was located" in str(found)


@pytest.mark.parametrize(
    ("M", "C", "K", "region"),
    [
        (
            [[1, 0], [1, 1]],
            [[-6, 0], [-4, -4]],
            [[25, 0], [20, 20]],
            (1, 4.5, -4.000000000000001, 9),
        ),
        ([[1]], [[-2]], [[2]], (-3, 2, -1, 3)),
    ],
)
def test_a_conjugate_at_the_lower_end_of_a_region_is_not_proved_away(M, C, K, region):
    """Roots 3 +- 4i and 2 +- 4i, which may or may not lie inside; and 1 +- i, one on the end."""
    found = squeal.eigenvalues(squeal.System(M, np.array(C, float), K), region=region)
    assert not found.certified
    assert len(found.eigenvalues) % 2 == 0


@pytest.mark.parametrize("damper", [2.0, -2.0])
@pytest.mark.parametrize("region", [(0, 1, 0, 7), (-1, 0, 1, 7), (-1e-6, 0, -7, 7)])
def test_copies_of_a_root_on_the_imaginary_axis_are_not_split_by_an_end_there(damper, region):
    """6i twice, and +-1 +- 2i, hidden by a congruence."""
    M = [[5, 2, 1], [2, 1, 0], [1, 0, 2]]
    K = [[180, 72, 36], [72, 36, 0], [36, 0, 41]]
    found = squeal.eigenvalues(squeal.System(M, np.diag([0, 0, damper]), K), region=region)
    copies = [root for root in found.eigenvalues if abs(root.value - 6j) < 1e-5]
    assert len(copies) in (0, 2)
    assert not (found.certified and found.verdict is None)


def light_touch(mu):
    """A pad on a stiff surface, which it leaves with one edge near mu = 0.757148."""
    # fmt: off
    pad = {
        "m": 0.2, "w": 0.04, "h": 0.014, "k1": 1485.0, "k2": 48961.0, "k_c": 1.7e10, "L1": 0.8,
        "L2": 0.8, "alpha1": 0.045, "alpha2": 2.893, "mu": mu, "F_n": 181.8, "y0": 0.02,
        "theta0": 0.02,
    }
    # fmt: on
    document = {"model": "B2", "parameters": pad, "formulation": {"line_force": "mean"}}
    return Scene.from_dict(document, Place("light touch"))


def exact_roots(scene, state, guess):
    """The roots about the exact equilibrium in a contact state, and its gaps."""
    exact = Exact(scene, state)
    q = exact.equilibrium(guess, scene.pad.mu)
    roots = []
    for square in exact.squares(q, scene.pad.mu):
        roots += [mp.sqrt(-square), -mp.sqrt(-square)]
    return roots, exact.gaps(q)


@pytest.mark.parametrize("mu", [0.757, 0.757148258, 0.7571483])
def test_contact_that_doubles_hide_is_judged_as_it_is(mu):
    """The penetration is 1e-9 m at y = 0.02 m: at 50 digits one edge is off and a pair grows."""
    scene = light_touch(mu)
    found = squeal.eigenvalues(scene)
    q = found.details["equilibrium"]
    guess = [q["x"], q["y"], q["theta"]]
    with mp.workdps(50):
        holding = []
        for state in (State(True, True), State(True, False)):
            roots, gaps = exact_roots(scene, state, guess)
            if [gap < 0 for gap in gaps] == list(state):
                holding.append(roots)
        (roots,) = holding
        grows = max(root.real for root in roots) > 1e-20
        assert found.certified
        assert found.verdict == ("flutter" if grows else "marginal")
        for root in found.eigenvalues:
            off = min(abs(exact - root.value) for exact in roots)
            assert off <= root.rounding
    (step,) = squeal.sweep(scene, [mu]).steps
    (condition,) = squeal.conditions(scene, {"mu": [mu]}).conditions
    assert step.verdict == condition.verdict == found.verdict


@pytest.mark.parametrize("mu", [1.1314856, 1.131485631, 1.13148563171])
def test_roots_beside_a_fold_lie_within_their_errors(mu):
    """There K hangs on digits of the friction that the equilibrium in doubles does not have."""
    scene = scene_of("b2-d").replace(mu=mu)
    found = squeal.eigenvalues(scene)
    assert found.certified
    assert isinstance(found.source, PadSource)
    assert found.source.analysis is not None
    state = found.source.analysis.state
    q = found.details["equilibrium"]
    with mp.workdps(50):
        guess = [q["x"], q["y"], q["theta"]]
        exact, gaps = exact_roots(scene, state, guess)
        assert [gap < 0 for gap in gaps] == list(state)
        for root in found.eigenvalues:
            assert min(abs(one - root.value) for one in exact) <= root.rounding
    (step,) = squeal.sweep(scene, [mu]).steps
    assert np.array_equal(step.roots, found.values)


def test_real_terms_that_cancel_around_a_complex_one_leave_their_rounding():
    """In doubles 1e16 + (1 + 0.3i) - 1e16 is 0.3i: the root is 0.9 times too far from its place."""
    K = (
        Term(np.array([[1e16]])),
        Term(np.array([[1.0]]), Modulus(loss=Formula("0.3"))),
        Term(np.array([[-1e16]])),
    )
    system = squeal.System((Term(np.eye(1)),), K=K)
    found = squeal.eigenvalues(system)
    assert (found.verdict, found.certified) == (None, False)


def test_a_start_that_is_open_leaves_growth_that_no_threshold_names_uncertified():
    """Six digits leave open whether the pair flutters; as written it does, at every value."""
    K = [[2.00001, 1.0], [-1.0, 3.99999]]
    system = squeal.System((Term(np.eye(2)),), K=(Term(np.array(K), digits=6),))
    with pytest.warns(UserWarning, match="no matrix depends on mu"):
        found = squeal.thresholds(system, 1.0)
    assert (found.verdict, found.certified) == (None, False)
