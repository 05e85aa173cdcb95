"""Crossings of the axis on the full system: closed forms, known blocks, dense eigenvalues."""

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

import squeal
from squeal.errors import ComputationError, InputError
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.sparse import singular_stiffness as static
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.axis_crossing import CrossingGuess, axis_crossing
from squeal.sparse.crossings import crossings_along
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import reduce_system
from squeal.sparse.singular_stiffness import singular_stiffness, without_zeros
from tests import large
from tests.known import affine

W1 = 2 * np.pi * 100
W2 = 2 * np.pi * 75
E1 = 0.02
E2 = 0.04


def assert_the_crossing(system, mu, omega, region, values):
    """The only crossing of a known system, held against its place, and the reduced system."""
    reduction = reduce_system(ScaledSystem(system), region, [{"mu": v} for v in values])
    (crossing,), unconfirmed = crossings_along(reduction, "mu", values)
    assert not unconfirmed
    assert (crossing.value, crossing.omega) == pytest.approx((mu, omega), rel=1e-10)
    assert crossing.interval[0] <= mu <= crossing.interval[1]
    assert (crossing.kind, crossing.direction) == ("flutter", 1)
    return crossing, reduction


def test_crossings_are_found_and_located(rng):
    """Hulten's drum brake, damped: closed-form threshold by Routh and Hurwitz, among others."""
    c1 = E1 * W1
    c2 = E2 * W2
    a3 = c1 + c2
    a2 = W1**2 + W2**2 + c1 * c2
    a1 = c1 * W2**2 + c2 * W1**2
    mu = np.sqrt(a1 * (a2 * a3 - a1) / (a3**2 * W1**2 * W2**2) - 1)
    a = rng.uniform(2.0, 9.0, 60)
    w = rng.uniform(300.0, 900.0, 60)
    C = np.diag(np.r_[c1, c2, 2 * a])
    K0 = np.diag(np.r_[W1**2, W2**2, a**2 + w**2])
    K1 = csc_array(([-(W2**2), W1**2], ([0, 1], [1, 0])), shape=(62, 62))
    M, C, K0, K1 = large.mixed(rng, np.eye(62), C, K0, K1)
    known = affine(M, K0, K1, C), mu, np.sqrt(a1 / a3)
    values = [0.0, 0.2, 0.4, 0.6]
    region = Rectangle(-40.0, 60.0, 350.0, 700.0)
    crossing, reduction = assert_the_crossing(*known, region, values)
    assert crossing.interval[1] - crossing.interval[0] < 1e-8
    assert crossing.residual < 1e-14
    guess = CrossingGuess(mu + 1e-4, crossing.omega, crossing.right, crossing.left)
    found, _ = crossings_along(reduction, "mu", values, [guess, guess])
    assert len(found) == 1  # known from elsewhere, perhaps twice, and located from the reduced one
    reduction.region = Rectangle(-2.0, -1.0, 1.0, 2.0)
    with pytest.raises(InputError, match="must hold a part of the upper imaginary axis"):
        crossings_along(reduction, "mu", values)


def test_both_ends_of_a_window_between_two_values_are_found():
    """Re lambda = (p - 1/2)^2 - 1/64 in a block: two crossings within one step, down then up."""
    growth = Formula("-2*((p - 0.5)**2 - 0.015625)")
    w = np.linspace(20.0, 40.0, 30)
    M = csc_array(np.eye(31))
    K = csc_array(np.diag([100.0, *(w**2)]))
    first = csc_array(np.diag([1.0] + [0.0] * 30))
    rest = csc_array(np.diag([0.0] + [0.4] * 30))
    system = TermSystem((Term(M),), (Term(rest), Term(first, growth)), (Term(K),), {"p": 0.0}, "p")
    region = Rectangle(-5.0, 5.0, 5.0, 15.0)
    values = [0.0, 1.0]
    reduction = reduce_system(ScaledSystem(system), region, [{"p": v} for v in values])
    crossings, _ = crossings_along(reduction, "p", values)
    assert [c.direction for c in crossings] == [-1, 1]
    found = np.array([(c.value, c.omega, c.slope) for c in crossings])
    assert np.allclose(found[:, :2], [[0.375, 10.0], [0.625, 10.0]], rtol=1e-10, atol=1e-8)
    assert np.allclose(found[:, 2], [-0.25, 0.25], rtol=1e-8)


@pytest.mark.parametrize(
    ("diagonal", "ends", "exact"),
    [
        (["1 - p**2", "4 - p**2", "30 - p**2"], (-3.0, 3.3), [-2, -1, 1, 2]),
        (["300*((p - 1)**2 - 0.04)", "0.5"], (0.0, 3.3), [0.8, 1.2]),
        (["30*(p - 1)*(p - 2)", "0.5"], (0.0, 3.3), [1, 2]),
        (["-300*p", "0.5"], (-1.0, 1.0), [0]),
        (["-300*p", "0.5"], (-1.0, 1.1), [0]),
        (["1e6*(1 - p)", "0.1", "0.2", "0.3", "0.5"], (0.0, 1.7), [1]),
        ([f"{k} - p" for k in range(1, 9)], (0.5, 8.7), [1, 2, 3, 4, 5, 6, 7, 8]),
        (["1 - p", "1.00001 - p"], (0.0, 3.0), [1, 1.00001]),
        (["2 + p", "0.01 + p**2"], (-1.0, 2.0), []),
    ],
)
@pytest.mark.parametrize("free", [0, 3])
def test_every_place_where_the_stiffness_is_singular(diagonal, ends, exact, free):
    rows = len(diagonal) + 12 + free
    held = np.linspace(300.0, 9e3, 12)
    still = csc_array(np.diag(np.r_[np.zeros(len(diagonal)), held, np.zeros(free)]))
    units = [csc_array(([1.0], ([k], [k])), shape=(rows, rows)) for k in range(len(diagonal))]
    moved = (Term(A, Formula(text)) for A, text in zip(units, diagonal, strict=True))
    M = csc_array(np.eye(rows))
    system = TermSystem((Term(M),), (Term(0.01 * M),), (Term(still), *moved), {"p": 0.5}, "p")
    values = [ends[0] + x * (ends[1] - ends[0]) for x in (0.0, 0.26, 0.51, 0.78, 1.0)]
    bordered = without_zeros(ScaledSystem(system), values)
    assert bordered.zeros == free  # C acts on all free motions
    found, unclear = singular_stiffness(bordered, values)
    assert sorted(one.value for one in found) == pytest.approx(exact, abs=1e-8)
    assert not unclear
    low, high = ends
    loss = squeal.thresholds(system, low=low, high=high, band=(0.0, 0.01), prove=False)
    assert sorted(c.mu for c in loss.crossings) == pytest.approx(exact, abs=1e-8)


def test_free_motions_that_friction_pushes_hide_no_static_loss(rng):
    """K = Q [[E - p D, 0], [p R, 0]] Q' with an orthogonal Q: a real root passes zero where one of
    E - p D vanishes, at 1 and 2, beside three pairs of zeros at each p."""
    held = np.diag(np.r_[1.0, 2.0, np.linspace(300.0, 9e3, 12), 0, 0, 0])
    moved = np.diag(np.r_[-1.0, -1.0, np.zeros(15)])
    moved[14:, :14] = rng.uniform(-7.0, 7.0, (3, 14))
    Q = np.linalg.qr(rng.standard_normal((17, 17)))[0]
    K0, K1 = (csc_array(Q @ A @ Q.T) for A in (held, moved))
    M = csc_array(np.eye(17))
    scaled = ScaledSystem(affine(M, K0, K1, 0.01 * M))
    for high, exact in ((0.8, []), (2.5, [1, 2])):
        values = np.linspace(0.0, high, 4).tolist()
        found, unclear = singular_stiffness(without_zeros(scaled, values), values)
        assert not unclear
        assert sorted(crossing.value for crossing in found) == pytest.approx(exact)


@pytest.mark.parametrize(
    ("M", "C", "kind", "exact"),
    [
        ([[1, 1], [1, 2]], [[1, 0], [0, 1]], "flutter", 11 / 3),
        ([[1, 0], [0, 1]], [[1, 1], [1, 2]], "divergence", 4.0),
    ],
)
def test_a_loss_beside_a_free_motion_with_its_own_damping_is_certified(M, C, kind, exact):
    """det P = s (s^3 + ...): of K = [[0, mu], [0, 4]] the first loses stability by flutter at 11/3
    and keeps its real roots, the second by a real root at 4."""
    high_frequencies = np.linspace(1e4, 1.4e4, 420)
    others = np.diag(high_frequencies**2)
    K0 = block_diag([np.array([[0.0, 0.0], [0.0, 4.0]]), others], format="csc")
    K1 = csc_array(([1.0], ([0], [1])), shape=K0.shape)
    M = block_diag([np.array(M), np.eye(420)], format="csc")
    C = block_diag([np.array(C), 0.02 * np.diag(high_frequencies)], format="csc")
    system = squeal.System(M, C, {"1": K0, "mu": K1})
    answer = squeal.thresholds(system, 6.0, band=(0.0, 2.0))
    assert answer.certified
    (crossing,) = answer.crossings
    assert (crossing.kind, crossing.direction) == (kind, "up")
    assert crossing.mu == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(
    ("dampers", "zeros"), [((0.0, 0.0, 0.0), 4), ((0.0, 0.3, 0.0), 3), ((0.4, 0.2, 0.3), 2)]
)
def test_a_static_loss_beside_free_motions_that_dampers_hold(dampers, zeros, way, rng):
    """Three free motions, two of them with dampers to the ground, one with a spring k (0.7 - p) of
    either sign; C couples all, and an orthogonal matrix mixes the rows with 420 fast ones."""
    coupling = rng.uniform(-0.1, 0.1, (3, 3))
    C = np.diag(dampers) + coupling @ coupling.T * np.outer(dampers, dampers) + 0.0
    C[2, 2] += 0.5
    frequencies = rng.uniform(300.0, 900.0, 420)
    Q = np.linalg.qr(rng.standard_normal((8, 8)))[0]
    Q = block_diag([*([Q] * 52), np.eye(7)], format="csc")
    order = rng.permutation(423)
    mixed = []
    for block, fast in (
        (np.eye(3), np.ones(420)),
        (C, 0.02 * frequencies),
        (np.diag([0.0, 0.0, 0.7 * way]), frequencies**2),
        (np.diag([0.0, 0.0, -1.0 * way]), np.zeros(420)),
    ):
        A = block_diag([block, np.diag(fast)], format="csc")[order][:, order]
        mixed.append(csc_array(Q @ A @ Q.T))
    M, C, K0, K1 = mixed
    system = squeal.System(M, C, {"1": K0, "mu": K1})
    held = without_zeros(ScaledSystem(system), [0.0, 0.3, 1.5])
    assert held.zeros == zeros
    answer = squeal.thresholds(system, 1.5, band=(0.0, 2.0))
    (crossing,) = answer.crossings
    assert crossing.mu == pytest.approx(0.7, abs=1e-8)
    assert crossing.direction == ("up" if way > 0 else "down")
    assert answer.certified


def test_a_change_of_sign_that_is_not_located_is_said(monkeypatch):
    monkeypatch.setattr(static, "singular_between", lambda *_: None)
    system = affine(np.eye(2), np.diag([1.0, 9.0]), np.diag([-1.0, 0.0]), 0.1 * np.eye(2))
    found, (text,) = singular_stiffness(ScaledSystem(system), [0.0, 2.0])
    assert not found
    assert "was not located" in text


def test_a_real_root_that_reaches_zero_is_a_divergence(rng):
    """K loses its rank at p = 0.7 in a mixed block: divergence, omega exactly zero."""
    mixed = large.blocks(rng.uniform(0.5, 1.5, 20), rng.uniform(3.0, 9.0, 20), rng)
    parts = zip((1, 3, 1.4), mixed, strict=True)
    M, C, K = (block_diag([[[x]], y], format="csc") for x, y in parts)
    K1 = csc_array(([-2.0], ([0], [0])), shape=(21, 21))
    system = TermSystem((Term(M),), (Term(C),), (Term(K), Term(K1, Formula("p"))), {"p": 0.5}, "p")
    scaled = ScaledSystem(system)
    near = np.ones(21) * 0.1 + np.eye(21)[0] + 0j
    crossing = axis_crossing(scaled, "p", CrossingGuess(0.69, 0.0, near, near))
    assert crossing.value == pytest.approx(0.7, rel=1e-10)
    assert (crossing.kind, crossing.direction) == ("divergence", 1)
    assert crossing.slope == pytest.approx(2.0 / 3.0, rel=1e-9)
    still = TermSystem(system.M, system.C, (system.K[0], Term(K1, Formula("0*p"))), {"p": 0.5}, "p")
    for omega in (0.0, 5.0):
        with pytest.raises(ComputationError, match="no crossing"):
            axis_crossing(ScaledSystem(still), "p", CrossingGuess(0.3, omega, near, near))


@pytest.mark.parametrize("error", [1e-2, 1e-4])
def test_a_crossing_has_its_frequency_where_the_parameter_is_known(error):
    """Damping 0.2 - p of row 2 alone: p is exact from the start, and only omega has to move."""
    frequencies = np.arange(1.0, 7.0)  # rad/s
    C = {"1": 0.2 * np.eye(6), "p": -np.diag(np.eye(6)[1])}
    system = squeal.System(np.eye(6), C, np.diag(frequencies**2), {"p": 0.1}, parameter="p")
    mode = np.eye(6)[1] + 0j
    guess = CrossingGuess(0.2, 2.0 * (1 + error), mode, mode)
    crossing = axis_crossing(ScaledSystem(system), "p", guess)
    assert crossing.value == pytest.approx(0.2, rel=1e-14)
    assert crossing.omega == pytest.approx(2.0, rel=1e-14)
    assert crossing.residual < 1e-10


@pytest.mark.parametrize("low", [350.0, -600.0])
def test_a_root_of_a_structural_loss_factor_crosses_where_it_is_known_to(low, rng):
    """One root and no mirror image: below the axis lie images that grow without meaning."""
    region = Rectangle(-60.0, 60.0, low, 600.0)
    assert_the_crossing(*large.with_loss_factor(rng), region, [0.0, 0.7, 1.4])


def system_with(block_of_0, block_of_1, damping, others):
    """A diagonal system of 401 rows but for a first block (m, m): K = K0 + mu K1."""
    n = 401
    m = len(damping)
    frequencies = np.r_[others, np.linspace(7000.0, 30000.0, n - m - len(others))]
    K0 = block_diag([np.array(block_of_0), np.diag(frequencies**2)], format="csc")
    K1 = block_diag([np.array(block_of_1), csc_array((n - m, n - m))], format="csc")
    C = np.diag(np.r_[damping, 2e-3 * frequencies])
    return squeal.System(csc_array(np.eye(n)), csc_array(C), {"1": K0, "mu": K1})


@pytest.mark.parametrize(
    ("middle", "half", "damping"),
    [
        (0.21, 9.4e-4, (0.27, 1.36e-4)),  # the window is 22 times wider than the coalescence
        (0.28841316584493715, 0.0010546382761000158, (1.0029242140838364, 4.022070177394877e-4)),
        (0.4267785643359989, 1.0429272997736784e-4, (0.041698575842344356, 2.951308306352077e-4)),
        (0.3131, 9.4e-4, (1.36e-4, 0.27)),
    ],
)
def test_both_ends_of_a_window_of_unequally_damped_modes_are_found(middle, half, damping):
    """Routh and Hurwitz: with d = slope (mu - middle), c = c1 c2 and s = c1 + c2 the ends are the
    zeros of 4 c d^2 + s (c2 - c1) c d + s^2 (w^2 c - e^2)."""
    w = 4300.0
    slope = 2e5
    e = half * slope
    block = [[w**2 - slope * middle, e], [-e, w**2 + slope * middle]]
    system = system_with(block, np.diag([slope, -slope]), damping, [3900.0, 4550.0])
    c1, c2 = damping
    c = c1 * c2
    s = c1 + c2
    ends = np.sort(np.roots([4 * c, s * (c2 - c1) * c, s**2 * (w**2 * c - e**2)])) / slope
    answer = squeal.thresholds(system, 1.0, 0.0, band=(600.0, 800.0))
    assert [crossing.direction for crossing in answer.crossings] == ["up", "down"]
    assert [crossing.mu for crossing in answer.crossings] == pytest.approx(middle + ends, rel=1e-9)
    assert answer.certified


@pytest.mark.parametrize(
    ("middle", "coupling", "ratios", "share"),
    [
        (0.43, 0.02265516, (5e-4, 5e-2), 0.45),
        (0.34780611957, 0.01453353, (1.0424491e-4, 0.0670165065), 0.55713481),
        (0.4502773220253142, 0.02723272, (6.161627083244698e-4, 0.06369452031257139), 0.58586374),
    ],
)
def test_a_window_beside_the_closest_approach_is_found(middle, coupling, ratios, share):
    """As before with e = coupling w^2 mu: near tangency unequal damping moves the window away from
    where the frequencies meet."""
    w = 2 * np.pi * 450
    slope = share * w**2
    e = coupling * w**2
    c1, c2 = (2 * w * ratio for ratio in ratios)
    c = c1 * c2
    s = c1 + c2
    d = np.poly1d([slope, -slope * middle])
    ends = np.sort(
        (4 * c * d * d + s * (c2 - c1) * c * d + s**2 * np.poly1d([-(e**2), 0, w**2 * c])).r
    )
    change = np.array([[slope, e], [-e, -slope]])
    block = np.diag([w**2 - slope * middle, w**2 + slope * middle])
    others = 2 * np.pi * np.geomspace(945.0, 5000.0, 30)
    system = system_with(block, change, [c1, c2], others)
    answer = squeal.thresholds(system, 1.0, 0.0, band=(270.0, 675.0))
    assert [crossing.direction for crossing in answer.crossings] == ["up", "down"]
    assert [crossing.mu for crossing in answer.crossings] == pytest.approx(ends, rel=1e-6)


def test_one_mode_that_left_the_band_explains_no_end_of_growth_of_another():
    """A real root grows out of the band; a window after it, whose end is hard to locate."""
    half = 1e-3
    slope = 1e3
    w = 200.0
    block = np.diag([300.0**2, w**2 - 0.75 * slope, w**2 + 0.75 * slope])
    block[1, 2] = half * slope
    block[2, 1] = -half * slope
    change = np.diag([-(300.0**2) / 0.3, slope, -slope])
    system = system_with(block, change, [0.6, 4e-6, 4e-6], [900.0, 1500.0])
    answer = squeal.thresholds(system, 1.0, 0.0, band=(0.0, 100.0))
    ends_at = [crossing.mu for crossing in answer.crossings if crossing.direction == "down"]
    if answer.certified:
        assert ends_at == pytest.approx([0.751], abs=1e-9)


@pytest.mark.parametrize("change", [1e-3, 1e-9, 1e-308])
def test_a_step_beyond_a_table_ends_the_search_for_a_crossing_that_is_none(change, tmp_path):
    """A damped mode that the parameter hardly moves crosses nothing up to the end of the table."""
    (tmp_path / "table.csv").write_text("mu,factor\n0,0\n1,1\n")
    path = tmp_path / "system.yaml"
    path.write_text(
        "parameters: {mu: 0}\nM: [[1]]\nC: [[0.1]]\nK:\n- matrix: [[1]]\n"
        f"- {{matrix: [[{change:.1e}]], table: {{file: table.csv, column: factor}}}}\n"
    )
    unit = np.ones(1, complex)
    scaled = ScaledSystem(squeal.read_system(path).system)
    with pytest.raises(ComputationError, match="no crossing"):
        axis_crossing(scaled, "mu", CrossingGuess(0.5, 1.0, unit, unit))


def test_a_mode_that_rises_over_the_axis_between_two_decaying_values_is_found():
    """Two modes coupled in K and C; the thresholds are from eigenvalues of 40 digits."""
    block = [[125130180.95296195, 79359.56265270051], [-476524.6810242374, 130185440.26346163]]
    others = np.linspace(3.2e4, 7e4, 399)
    K0 = block_diag([np.array(block), np.diag(others**2)], format="csc")
    K1 = csc_array(([8642290.6220732], ([0], [0])), shape=K0.shape)
    damping = np.r_[19.076059421011003, 27.026718815065976, 2e-3 * others]
    gyroscopic = 66.86039977934944
    C1 = csc_array(([-gyroscopic, gyroscopic], ([0, 1], [1, 0])), shape=K0.shape)
    C = {"1": csc_array(np.diag(damping)), "mu": C1}
    system = squeal.System(csc_array(np.eye(401)), C, {"1": K0, "mu": K1})
    for high in (0.999, 1.0, 1.2):
        answer = squeal.thresholds(system, high, 0.0, band=(890.166348, 2848.532315))
        found = [crossing.mu for crossing in answer.crossings]
        assert found == pytest.approx([0.5669851941, 0.5702320797], rel=1e-8)
        assert answer.certified


@pytest.mark.parametrize("share", [1.0 - 1e-13, 1.0, 1.0 + 1e-13])
def test_growth_that_may_be_rounding_is_not_certified(share):
    """Two unequally damped modes that just touch the axis, see above: the zeros d coincide."""
    w = 4300.0
    slope = 2e5
    c1, c2 = 0.27, 1.36e-4
    c = c1 * c2
    e = share * np.sqrt(c * (w**2 - (c2 - c1) ** 2 / 16))
    block = [[w**2 - 0.21 * slope, e], [-e, w**2 + 0.21 * slope]]
    system = system_with(block, np.diag([slope, -slope]), (c1, c2), [3900.0, 4550.0])
    answer = squeal.thresholds(system, 1.0, 0.0, band=(600.0, 800.0))
    assert not (answer.crossings and answer.certified)


def test_a_free_motion_that_turns_with_the_parameter_certifies_no_list():
    """K = 1e4 [[p^2, -p], [-p, 1]] has the null vector (1, p); the third row diverges for a
    while around 0.5."""
    n = 408
    others = np.linspace(400.0, 4000.0, n - 3) ** 2
    turning = csc_array((np.array([-1e4, -1e4, 0.0]), ([0, 1, 2], [1, 0, 2])), shape=(n, n))
    fixed = csc_array(np.diag(np.r_[0.0, 1e4, 0.0, others]))
    first = csc_array(([1e4], ([0], [0])), shape=(n, n))
    third = csc_array(([1e6], ([2], [2])), shape=(n, n))
    K = {"1": fixed, "p": turning, "p**2": first, "(p - 0.5)**2 - 1e-7": third}
    system = squeal.System(csc_array(np.eye(n)), None, K, parameter="p", parameters={"p": 0.0})
    assert not squeal.thresholds(system, 1.0, 0.0, band=(0.0, 50.0)).certified


def test_a_growing_mode_that_leaves_the_band_is_told_beside_another_that_grows():
    """w = 100 with c = 2 - 10 p, and w^2 = 150^2 + p (250^2 - 150^2) with c = 3 - 10 p, which is
    beyond the end of the band, 200 1/s, from p = 0.4375 on."""
    n = 407
    others = np.linspace(2000.0, 4000.0, n - 2)
    K0 = csc_array(np.diag(np.r_[100.0**2, 150.0**2, others**2]))
    K1 = csc_array(([250.0**2 - 150.0**2], ([1], [1])), shape=(n, n))
    C0 = csc_array(np.diag(np.r_[2.0, 3.0, 1e-3 * others]))
    C1 = csc_array(([-10.0, -10.0], ([0, 1], [0, 1])), shape=(n, n))
    system = squeal.System(csc_array(np.eye(n)), {"1": C0, "mu": C1}, {"1": K0, "mu": K1})
    answer = squeal.thresholds(system, 1.0, 0.0, band=(5.0, 200.0 / (2 * np.pi)))
    assert [one.mu for one in answer.crossings] == pytest.approx([0.2, 0.3])
    assert "fewer modes are found to grow" in answer.details["left_out"][0]


def passing_mode(drift, onset, rows=401, parameter="mu"):
    """A mode with K = w^2 (1 + drift (p - onset)) and C = 8.8 (1 - mu / onset) beside others: for p
    = mu it begins to grow at the onset, at 700 Hz, which it passes. A neighbour stays there."""
    w = 2 * np.pi * 700
    others = np.r_[w * 1.00005, np.linspace(7000.0, 30000.0, rows - 2)]
    one = np.eye(rows)[0]
    C = {"1": diags_array(np.r_[8.8, 2e-3 * others]), "mu": diags_array(-8.8 / onset * one)}
    K_rest = diags_array(np.r_[w**2 * (1 - drift * onset), others**2])
    K = {"1": K_rest, parameter: diags_array(w**2 * drift * one)}
    return squeal.System(eye_array(rows, format="csc"), C, K, {"mu": 0.0, parameter: onset})


@pytest.mark.parametrize(
    ("drift", "onset", "width", "rows"),
    [
        (0.2, 0.7, 20.0, 401),  # at no end of the range and not in its middle in the band
        (1.0, 0.23, 100.0, 401),
        (0.5, 0.23, 60.0, 900),
        (0.2, 0.7, 20.0, 100),
        (0.2, 0.7, 0.01, 401),  # its crossing of a basis of modes is further away than that
        (3.0, 0.23, 1.0, 401),  # jumps over the band between any two of the values looked at
    ],
)
def test_a_mode_that_grows_while_it_passes_the_band_is_found(drift, onset, width, rows):
    system = passing_mode(drift, onset, rows)
    answer = squeal.thresholds(system, 1.0, 0.0, band=(700.0 - width / 2, 700.0 + width / 2))
    (crossing,) = answer.crossings
    assert crossing.direction == "up"
    assert crossing.mu == pytest.approx(onset, rel=1e-9)
    assert crossing.frequency_hz == pytest.approx(700.0, rel=1e-9)


@pytest.mark.parametrize("scale", [7e4, 1e5, 2e5])
@pytest.mark.parametrize("excess", [3e-3, 1e-5])
def test_a_mode_that_is_heavily_damped_at_all_values_but_some_is_found(scale, excess):
    """C = scale ((mu - p)^2 (mu - q)^2 - excess): it decays fast at 0, 1/2 and 1."""
    p = (2 - 2**0.5) / 4
    q = 1 - p
    rest = np.r_[3900.0, 4900.0, np.linspace(7000.0, 30000.0, 398)]
    C = {
        "1": diags_array(np.r_[0.0, 2e-3 * rest]),
        f"((mu - {p}) * (mu - {q}))**2 - {excess}": diags_array(scale * np.eye(401)[0]),
    }
    K = diags_array(np.r_[4300.0, rest] ** 2)
    system = squeal.System(eye_array(401, format="csc"), C, K, {"mu": 0.0})
    answer = squeal.thresholds(system, 1.0, 0.0, band=(600.0, 800.0))
    # (mu - p)(mu - q) = (mu - 1/2)^2 - 1/8 is plus or minus the root of the excess
    offsets = np.sqrt([1 / 8 - excess**0.5, 1 / 8 + excess**0.5])
    exact = np.sort(np.r_[0.5 - offsets, 0.5 + offsets])
    assert [crossing.mu for crossing in answer.crossings] == pytest.approx(exact, rel=1e-8)
    assert answer.certified


def test_a_mode_that_passes_the_band_is_in_sweeps_and_maps():
    """Verdicts by the frequency and the damping of the passing mode, in closed form."""
    system = passing_mode(2.0, 0.5, parameter="s")
    band = (500.0, 900.0)

    def grows(mu, s):
        frequency = 700.0 * np.sqrt(1 + 2.0 * (s - 0.5))
        return mu > 0.5 and band[0] < frequency < band[1]

    axes = squeal.Axis("mu", 0.0, 0.9, 7), squeal.Axis("s", 0.03, 1.0, 15)
    for cell in squeal.map(system, axes, band=band).to_records():
        assert (cell["verdict"] == "flutter") == grows(cell["mu"], cell["s"])
    values = np.linspace(0.0, 1.0, 61).tolist()
    sweep = squeal.sweep(passing_mode(0.2, 0.7), values, band=(690.0, 710.0))
    for value, step in zip(values, sweep.steps, strict=True):
        frequency = 700.0 * np.sqrt(1 + 0.2 * (value - 0.7))
        assert len(step.roots) == (2 if 690.0 < frequency < 710.0 else 1)


def test_two_modes_that_swap_sides_of_a_narrow_band_are_found():
    """One with w^2 (1 + 3 d), d = mu - 0.29, begins to grow at 700 Hz; the other one comes down."""
    w2 = (2 * np.pi * 700.0) ** 2
    others = np.linspace(7000.0, 30000.0, 399)
    K = {
        "1": diags_array(np.r_[w2 * (1 - 3 * 0.29), w2 * (1 + 3 * 0.29), others**2]),
        "mu": diags_array(3 * w2 * np.r_[1.0, -1.0, np.zeros(399)]),
    }
    C = {
        "1": diags_array(np.r_[8.8, 8.8, 2e-3 * others]),
        "mu": diags_array(8.8 / 0.29 * np.r_[-1.0, np.zeros(400)]),
    }
    system = squeal.System(eye_array(401, format="csc"), C, K, {"mu": 0.0})
    answer = squeal.thresholds(system, 0.6, 0.0, band=(699.5, 700.5))
    (crossing,) = answer.crossings
    assert crossing.mu == pytest.approx(0.29, rel=1e-9)
    assert answer.certified


def test_a_growth_rate_that_jumps_from_one_side_of_the_region_to_the_other_is_found():
    """C = 15 w (0.29 - mu): from a decay to a growth of more than a tenth of w within a step."""
    w = 2 * np.pi * 700.0
    others = np.linspace(7000.0, 30000.0, 400)
    one = np.eye(401)[0]
    C = {
        "1": diags_array(np.r_[15 * w * 0.29, 2e-3 * others]),
        "mu": diags_array(-15 * w * one),
    }
    K = diags_array(np.r_[w, others] ** 2)
    system = squeal.System(eye_array(401, format="csc"), C, K, {"mu": 0.0})
    answer = squeal.thresholds(system, 1.0, 0.0, band=(600.0, 800.0))
    assert [crossing.mu for crossing in answer.crossings] == pytest.approx([0.29], rel=1e-9)


def test_growth_that_a_real_crossing_does_not_explain_is_not_certified():
    """A free motion with a slight damper beside one without: a pair of 4e-5 Hz begins to grow,
    turns real, and one of the two ceases to grow where det K of the third row changes its sign."""
    fast = np.linspace(300.0, 900.0, 398)

    def beside_fast(block, diagonal):
        return block_diag([np.array(block), np.diag(diagonal)], format="csc")

    M = beside_fast([[1.24, 0.13, -0.02], [0.13, 1.09, -0.02], [-0.02, -0.02, 1.01]], np.ones(398))
    C = beside_fast(np.diag([2.3e-5, 0.0, 0.5]), 0.02 * fast)
    K0 = beside_fast(np.diag([0.0, 0.0, 2.24]), fast**2)
    K1 = beside_fast([[0.0, 0.0, 0.0], [0.0, 0.0, 2.6], [0.0, 0.0, -1.69]], 0.0 * fast)
    system = squeal.System(M, C, {"1": K0, "mu": K1}, {"mu": 0.0})
    answer = squeal.thresholds(system, 3.35, 0.0, band=(0.0, 2.0))
    begins = [crossing.mu for crossing in answer.crossings if crossing.direction == "up"]
    # by 40 digits growth begins between 1.36 and 1.3639
    assert not answer.certified or begins == pytest.approx([1.362], abs=0.002)


def test_crossings_are_located_where_large_terms_cancel():
    """Damping 100 (T8(2 mu - 1) + 1 - 1e-5) in powers of mu, coefficients up to 1e7: Chebyshev's
    polynomial is -1 at four values, beside each of which a mode grows."""
    powers = np.polynomial.Polynomial([0.0])
    x = np.polynomial.Polynomial([-1.0, 2.0])
    for k, coefficient in enumerate(np.polynomial.chebyshev.cheb2poly([0.0] * 8 + [1.0])):
        powers = powers + coefficient * x**k
    damping = 100.0 * (powers + 1.0 - 1e-5)
    rest = np.r_[3900.0, 4900.0, np.linspace(7000.0, 30000.0, 398)]
    one = np.eye(401)[0]
    C = {"1": diags_array(np.r_[damping.coef[0], 2e-3 * rest])}
    for k, coefficient in enumerate(damping.coef[1:], 1):
        C[f"mu**{k}"] = diags_array(coefficient * one)
    K = diags_array(np.r_[4300.0, rest] ** 2)
    system = squeal.System(eye_array(401, format="csc"), C, K, {"mu": 0.0})
    answer = squeal.thresholds(system, 1.0, 0.0, band=(600.0, 800.0))
    # T8(cos a) = cos 8 a
    beside = np.arccos(1e-5 - 1.0) / 8
    angles = [k * np.pi / 4 + side * beside for k in range(9) for side in (-1, 1)]
    exact = sorted((1 + np.cos(a)) / 2 for a in angles if 0.0 < a < np.pi)
    found = [crossing.mu for crossing in answer.crossings]
    assert found == pytest.approx(exact, abs=1e-7)
