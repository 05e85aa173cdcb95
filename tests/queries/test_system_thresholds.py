"""Thresholds of systems, reduced and in full, in bands and at ends of a range: closed forms."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

import squeal
from squeal.errors import InputError
from squeal.linear.bends import undersampled_factor
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems import all_roots
from squeal.queries.systems import thresholds as critical
from squeal.queries.systems.thresholds import system_thresholds
from squeal.results.map import Axis
from squeal.results.sources import EigenvalueSelection
from squeal.sparse import region_roots
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.crossings import crossings_along
from tests import large
from tests.known import affine, coupled, known_system

ROWS = 420
MU = Formula("mu")


def beside(block, moved, damping):
    """Two modes, stiffness `block` + mu `moved`, among others far above, all damped alike."""
    others = np.linspace(1e4, 2e4, ROWS - 2) ** 2
    stiffness = block_diag([block, diags_array(others)], format="csc")
    change = block_diag([moved, csc_array((ROWS - 2, ROWS - 2))], format="csc")
    M = eye_array(ROWS, format="csc")
    return affine(M, stiffness, csc_array(change), damping * M)


def assert_threshold(found, kind, mu):
    assert found.verdict == "stable"
    assert [p.kind for p in found.points] == [kind]
    assert found.points[0].mu == pytest.approx(mu, rel=1e-9)
    assert not found.details["unconfirmed"]
    assert found.certified


@pytest.mark.parametrize(("place", "c"), [(0.25, 1e-4), (0.7, 0.01), (0.5, 0.1), (0.7, 10.0)])
def test_equally_damped_modes_flutter_where_they_have_parted_by_their_damping(place, c):
    """-omega^2 + i c omega = -(mean + i d) at d^2 = (g mu)^2 - (difference / 2)^2."""
    s = np.array([1e6, 1.1e6])
    half = (s[1] - s[0]) / 2
    mean = s.mean()
    g = half / place
    system = beside(np.diag(s), np.array([[0.0, g], [-g, 0.0]]), c)
    found = system_thresholds(
        system, 1.0, selection=EigenvalueSelection(band=(100.0, 200.0))
    ).answer
    assert_threshold(found, "flutter", math.sqrt(half**2 + c**2 * mean) / g)
    assert found.crossings[0].frequency_hz == pytest.approx(math.sqrt(mean) / (2 * math.pi))


@pytest.mark.parametrize(("place", "c"), [(0.25, 0.1), (0.7, 5.0)])
def test_a_damped_root_diverges_where_its_stiffness_ends(place, c):
    system = beside(np.diag([4.0, 900.0]), np.diag([-4.0 / place, 0.0]), c)
    found = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(0.0, 20.0))).answer
    assert_threshold(found, "divergence", place)


@pytest.mark.parametrize("seed", [304, 305])
def test_real_roots_that_pass_a_narrow_band_within_a_step_are_found(seed):
    """Growing by some 100 1/s over the range, through 1 1/s and less; several within a step."""
    rng = np.random.default_rng([seed, 77])
    system, expected = known_system(int(rng.integers(41, 50)), rng, True)
    found = squeal.thresholds(system, high=2.0, band=(0.0, rng.uniform(1.0, 2.5) / math.tau))
    exact = sorted(mu for mu, kind, _, _ in expected if kind == "divergence")
    assert [c.mu for c in found.crossings if c.kind == "divergence"] == pytest.approx(exact)
    assert not found.details["unconfirmed"]


def test_a_root_that_leaves_the_band_crosses_the_axis_before():
    """Both between two values that a first look takes, 0.253 and 0.340."""
    exact = 0.3
    leaves = 0.32
    rise = 6e5
    system = beside(np.diag([1e6, 3e6]), np.diag([rise, 0.0]), 1.0)
    less = csc_array(([-1.0 / exact], ([0], [0])), shape=(ROWS, ROWS))
    system = TermSystem(system.M, (*system.C, Term(less, MU)), system.K)
    edge = math.sqrt(1e6 + rise * leaves) / (2 * math.pi)
    found = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(100.0, edge))).answer
    assert [c.direction for c in found.crossings] == ["up"]
    assert found.crossings[0].mu == pytest.approx(exact)


@pytest.mark.parametrize(("band", "verdict"), [((250.0, 260.0), "no root"), ((100, 200), "stable")])
def test_a_band_without_a_root_has_no_threshold(band, verdict):
    system = beside(np.diag([1e6, 1.2e6]), np.diag([1e3, 0.0]), 1.0)
    found = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=band)).answer
    assert (found.verdict, found.crossings, found.certified) == (verdict, (), True)


def test_a_structural_loss_factor_flutters_where_it_is_known_to(monkeypatch):
    system, mu, omega = large.with_loss_factor(np.random.default_rng(4), 42)  # reduced
    region = EigenvalueSelection(region=Rectangle(-60.0, 60.0, 350.0, 600.0))
    found = system_thresholds(system, 1.4, selection=region).answer
    assert_threshold(found, "flutter", mu)
    assert found.points[0].frequency_hz == pytest.approx(omega / (2 * np.pi), rel=1e-10)
    with pytest.raises(InputError, match="band: is missing"):
        system_thresholds(system, 1.4)
    # a count that could not be settled certifies nothing
    whole = region_roots.modes_in
    monkeypatch.setattr(
        critical, "modes_in", lambda *given, **more: replace(whole(*given, **more), count=None)
    )
    found = system_thresholds(system, 1.4, selection=region).answer
    assert found.certified is False
    assert found.points[0].mu == pytest.approx(mu, rel=1e-10)


def test_counted_thresholds_of_a_large_band_say_so_under_proof():
    system = beside(np.diag([1e6, 1.1e6]), np.array([[0.0, 1e5], [-1e5, 0.0]]), 0.01)
    found = squeal.thresholds(system, 1.0, band=(100.0, 200.0))
    assert found.certified
    proof = found.to_dict()["proof"]
    assert (proof["status"], proof["by"]) == ("counted", "count")
    assert proof["growth_below"] is None
    assert proof["extent"] == [0.0, 1.0]


@pytest.mark.parametrize("seed", [6, 15])
def test_a_band_of_a_dense_system_has_its_known_thresholds(seed):
    """Roots dense in the band; real ones that come from above it and leave it within a step."""
    rng = np.random.default_rng([seed, 70])
    band = (0.0, 0.8)
    system, known = known_system(int(rng.integers(41, 71)), rng, damped=bool(seed % 2))
    found = system_thresholds(system, 2.0, selection=EigenvalueSelection(band=band)).answer
    known = [row for row in known if row[3] <= 2 * math.pi * band[1]]
    assert [c.mu for c in found.crossings] == pytest.approx([row[0] for row in known], rel=1e-8)
    ways = [(c.kind, c.direction) for c in found.crossings]
    assert ways == [row[1:3] for row in known]


def test_a_gyroscopic_band_flutters_where_two_frequencies_meet():
    """q'' + 2 J q' = s q, s = 0.1 + mu: lambda^4 + (4 - 2 s) lambda^2 + s^2 = 0, square at 1."""
    turn = csc_array(([2.0, -2.0], ([0, 1], [1, 0])), shape=(ROWS, ROWS))
    system = replace(beside(-0.1 * np.eye(2), -np.eye(2), 0.0), C=(Term(turn),))
    found = system_thresholds(system, 2.0, selection=EigenvalueSelection(band=(0.03, 0.5))).answer
    lower, upper = found.points[0].interval
    assert lower <= 0.9 <= upper
    assert upper - lower < 1e-6
    assert [c.frequency_hz for c in found.crossings] == pytest.approx([1 / (2 * math.pi)])
    assert found.certified


def test_growth_of_a_billionth_of_the_frequency_is_counted(monkeypatch):
    """A chain whose dashpots change their sign at 0.5: w = 2 sin(k pi / (2 n + 2)) there."""
    monkeypatch.setattr(all_roots, "ALL_ROWS", 40)
    n = 80
    rate = 1e-9
    K = diags_array([[2.0] * n, [-1.0] * n, [-1.0] * n], offsets=[0, 1, -1], shape=(n, n))
    D = csc_array(diags_array(rate * np.random.default_rng(0).uniform(0.5, 1.5, n)))
    system = affine(eye_array(n, format="csc"), csc_array(K), C0=0.5 * D, C1=-D)
    found = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(0.016, 0.06))).answer
    hertz = np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2)) / np.pi
    hertz = hertz[(hertz > 0.016) & (hertz < 0.06)]
    assert sorted(c.frequency_hz for c in found.crossings) == pytest.approx(hertz)
    assert [c.mu for c in found.crossings] == pytest.approx([0.5] * len(hertz))
    assert found.certified


HERTZ = np.array([1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0])


@pytest.mark.parametrize(
    ("rates", "at", "hertz", "points"),
    [
        ((0.5, 1.0, -0.5), 0.0, [2.0, 1.0], [("flutter", 2.0)]),
        ((-0.5, -1.0, -0.2), 0.0, [], []),
        ((0.5, 1.0, 0.2), 1.0, [2.0, 1.0, 3.0], [("flutter", 2.0)]),
        ((-0.5, -1.0, -0.2), 1.0, [2.0, 1.0, 3.0], [("restabilised", 2.0)]),
        ((-0.5, 1.0, 0.2), 1.0, [2.0, 1.0, 3.0], []),
    ],
)
@pytest.mark.parametrize("rows", [400, 8], ids=["full", "reduced"])
def test_of_a_band_what_happens_at_an_end_is_listed_once_and_the_fastest_named(
    rates, at, hertz, points, rows, monkeypatch
):
    """Three modes in the band 0.5 to 5 Hz that grow by rate (p - at), others above."""
    monkeypatch.setattr(all_roots, "ALL_ROWS", rows)
    D = np.diag(np.r_[-2.0 * np.array(rates), np.zeros(6)])
    others = np.diag(np.r_[np.zeros(3), np.full(6, 0.3)])
    K = np.diag((2 * np.pi * HERTZ) ** 2)
    system = affine(np.eye(9), K, C0=others - at * D, C1=D)
    found = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(0.5, 5.0))).answer
    assert [c.mu for c in found.crossings] == pytest.approx([at] * len(hertz), rel=1e-12)
    assert sorted(c.frequency_hz for c in found.crossings) == pytest.approx(sorted(hertz))
    ways = {round(c.frequency_hz): c.direction for c in found.crossings}
    assert ways == {round(h): "up" if rates[round(h) - 1] > 0 else "down" for h in hertz}
    assert [p.kind for p in found.points] == [kind for kind, _ in points]
    assert [p.frequency_hz for p in found.points] == pytest.approx([f for _, f in points])
    assert sum(c.changes_verdict for c in found.crossings) == len(points)
    assert found.certified
    assert not found.details["unconfirmed"]
    assert not found.details["left_out"]


# Real modes are of the structure as it stands, whatever formula its stiffness has

N = 300


def disc_and_pad(kc):
    """A chain held by a contact at its first row alone, whose friction acts on the second."""
    chain = diags_array([[2.0] * (N - 1) + [1.0], [-1.0] * N, [-1.0] * N], offsets=[0, 1, -1])
    contact = csc_array(([1.0], ([0], [0])), shape=(N, N))
    friction = csc_array(([1.0], ([1], [0])), shape=(N, N))
    free = csc_array(1e6 * (chain - contact))
    held = Term(contact, Formula("kc")) if kc == "named" else Term(contact * 4e6)
    K = Term(free), held, Term(friction * 4e6, MU)
    return TermSystem((Term(eye_array(N, format="csc")),), (), K, {"kc": 4e6, "mu": 0.2})


def test_a_contact_with_a_factor_keeps_its_stiffness_in_a_modal_sweep():
    plain = squeal.sweep(disc_and_pad("plain"), [0.0, 0.2], band=(1.0, 40.0), method="modal").steps
    named = squeal.sweep(disc_and_pad("named"), [0.0, 0.2], band=(1.0, 40.0), method="modal").steps
    assert len(plain[0].roots) > 5
    for one, other in zip(plain, named, strict=True):
        assert np.allclose(one.roots, other.roots, rtol=1e-9, atol=1e-6)
    K = disc_and_pad("named").at({"mu": 0.0})[2]
    full = np.sqrt(np.linalg.eigvalsh(K.toarray()))
    inside = full[(full > 2 * np.pi) & (full < 80 * np.pi)]
    assert named[0].roots.imag == pytest.approx(inside, rel=1e-6)


def test_a_chart_over_a_parameter_that_no_matrix_uses_is_refused():
    with pytest.raises(InputError, match="kc"):
        squeal.map(disc_and_pad("plain"), (Axis("mu", 0.0, 1.0, 2), Axis("kc", 1e6, 2e6, 2)))


def test_a_chart_over_the_frequency_of_each_root_is_refused():
    stiffer_with_frequency = {"1 + omega": np.eye(2), "mu": [[0.0, 1.0], [-1.0, 0.0]]}
    system = squeal.System(np.eye(2), K=stiffer_with_frequency)
    axes = Axis("mu", 0.0, 1.0, 2), Axis("omega", 0.0, 1.0, 2)
    with pytest.raises(InputError, match="omega is not allowed, each root has its own; allowed"):
        squeal.map(system, axes, band=(0.1, 1.0))


def test_growth_that_no_crossing_explains_is_not_certified(monkeypatch):
    monkeypatch.setattr(critical, "crossings_along", lambda *_: ((), ()))
    block, pushed = (coupled(mu)[2] for mu in (0.0, 1.0))  # flutters from mu = 3/4 on
    system = beside(block, pushed - block, 1e-2)
    answer = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(0.05, 1.0))).answer
    assert not answer.certified
    assert "flutter at mu = 0.7" in answer.details["unconfirmed"][0]
    assert answer.details["doubts"] == answer.details["unconfirmed"]


@pytest.mark.parametrize(
    ("located", "doubt"), [(1, "flutter of one more mode at mu = 0.6"), (0, "flutter at mu = 0.5")]
)
def test_a_crossing_that_is_missed_before_or_while_a_mode_grows_is_noticed(
    located, doubt, monkeypatch
):
    """Pairs of frequencies w^2 (1 +- 0.02) that friction couples flutter from mu = 0.3 and 0.6."""
    monkeypatch.setattr(all_roots, "ALL_ROWS", 40)
    n = 60
    squares = (2 * np.pi * np.linspace(2000.0, 9000.0, n)) ** 2
    coupling = np.zeros((n, n))
    for row, hertz, onset in ((0, 500.0, 0.3), (2, 900.0, 0.6)):
        square = (2 * np.pi * hertz) ** 2
        squares[row : row + 2] = 0.98 * square, 1.02 * square
        coupling[row, row + 1] = 0.02 * square / onset
        coupling[row + 1, row] = -coupling[row, row + 1]
    K = {"1": csc_array(diags_array(squares)), "mu": csc_array(coupling)}
    system = squeal.System(csc_array(eye_array(n)), csc_array(0.1 * eye_array(n)), K)
    found = squeal.thresholds(system, 1.0, band=(300.0, 1200.0))
    assert found.certified
    assert [crossing.mu for crossing in found.crossings] == pytest.approx([0.3, 0.6], rel=1e-4)

    def some_crossings(*args):
        events, unconfirmed = crossings_along(*args)
        return events[:located], unconfirmed

    monkeypatch.setattr(critical, "crossings_along", some_crossings)
    missed = squeal.thresholds(system, 1.0, band=(300.0, 1200.0))
    assert missed.certified is False
    assert doubt in missed.details["unconfirmed"][0]


def test_an_answer_of_too_few_values_says_why_it_is_in_doubt(monkeypatch):
    A = np.random.default_rng(1).normal(size=(6, 6)) / 2
    K = {"1": np.diag(np.arange(1.0, 7.0)), "mu": A}
    system = squeal.System(np.eye(6), 0.01 * np.eye(6), K, {"mu": 1.0})
    full = squeal.thresholds(system)
    monkeypatch.setattr("squeal.linear.search.STEPS", 2)
    monkeypatch.setattr("squeal.linear.search.BUDGET", 3)
    few = squeal.thresholds(system, prove=False)
    assert (full.certified, full.details["doubts"]) == (True, [])
    assert few.certified is False
    assert few.details["doubts"]
    C, K = system(full.first.mu)[1:]
    grows = np.block([[np.zeros((6, 6)), np.eye(6)], [-K, -C]])
    assert np.linalg.eigvals(grows).real.max() == pytest.approx(0.0, abs=1e-9)


def test_errors_in_tables_are_numbers():
    """They were texts beside numbers."""
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    found = squeal.thresholds(squeal.System(np.eye(2), K=K, parameters={"mu": 0.1}), high=1.0)
    (row,) = found.to_records()
    assert row["low"] <= 0.75 <= row["high"]
    assert 0.0 <= row["error"] <= row["high"] - row["low"]


@pytest.mark.parametrize("region", [(-10, 10, 0, 3), (-10, 10, -3, 3), (-10, 10, -1, 3)])
def test_a_region_that_ends_on_the_real_axis_holds_divergence(region):
    """q'' + q'/4 + (3/2 - mu) q = 0 has a positive real root from mu = 3/2 on."""
    K = {"1": np.diag([1.5, 4.0]), "mu": np.diag([-1.0, 0.0])}
    found = squeal.thresholds(squeal.System(np.eye(2), np.diag([0.25, 0.5]), K), region=region)
    assert found.first.kind == "divergence"
    assert found.first.mu == pytest.approx(1.5, rel=1e-12)
    assert [crossing.changes_verdict for crossing in found.crossings] == [True]


@pytest.mark.parametrize("prove", [None, False])
@pytest.mark.parametrize("region", [(-1, 1, -3, -0.5), (-1, 1, -3, 0.5)])
def test_a_region_below_the_real_axis_is_refused_by_every_question(region, prove):
    """A pair flutters at 3/4, of which the region holds the conjugate alone."""
    pair = squeal.System(np.eye(2), K={"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]})
    with pytest.raises(InputError, match="conjugates, which are no motions"):
        squeal.thresholds(pair, 1.0, region=region, prove=prove)
    with pytest.raises(InputError, match="conjugates, which are no motions"):
        squeal.sweep(pair, [0.0, 1.0], region=region, method="reduced")


@pytest.mark.parametrize("own", [0.0, 1000.0])
def test_the_verdict_at_the_start_is_that_of_the_digits_there(own):
    """At p = 0 nothing is rounded; at 1000 six digits leave the small decay open."""
    coupled_by_p = {"1": np.diag([1.0, 1.5]), "p": [[0.0, 1.23456], [1.11111, 0.0]]}
    damping = 1e-6 * np.eye(2)
    system = squeal.System(np.eye(2), damping, coupled_by_p, parameters={"p": own}, parameter="p")
    exact, rounded = system.K
    system = replace(system, K=(exact, replace(rounded, digits=6)))
    assert squeal.thresholds(system, 0.01, low=0.0).verdict == "stable"


@pytest.mark.parametrize("region", [(0.0625, 3, 0.5, 3), (-3, -0.0625, 0.5, 3)])
def test_a_region_without_the_imaginary_axis_has_no_thresholds(region):
    C = {"mu-0.5": np.diag([-4.0, 0.0]), "1": np.diag([0.0, 0.5])}
    system = squeal.System(np.eye(2), C, np.diag([4.0, 4.0]))
    with pytest.raises(InputError, match="holds no part of the imaginary axis"):
        squeal.thresholds(system, region=region)


def test_dampers_without_a_stiffness_lose_stability_where_they_drive():
    """q'' + (1 - mu) q' = 0 for both rows: a root is mu - 1, twice."""
    C = {"1": np.eye(2), "mu": -np.eye(2)}
    found = squeal.thresholds(squeal.System(np.eye(2), C, np.zeros((2, 2))), 2.0)
    assert [crossing.kind for crossing in found.crossings] == ["divergence"] * 2
    assert [crossing.mu for crossing in found.crossings] == pytest.approx([1.0, 1.0], abs=1e-9)


@pytest.mark.parametrize(
    ("factor", "crossings"),
    [("1/(1 + ((mu - 0.3712)/0.0001)**2)", []), ("mu**2", [0.5])],
)
def test_a_large_list_is_not_certified_where_a_factor_peaks_between_values(
    factor, crossings, monkeypatch
):
    """One of many rows decays by 1 - 4 f(mu): with the peak it grows from 0.3712 - 1.7e-4 to
    0.3712 + 1.7e-4 alone, where no value was looked at."""
    monkeypatch.setattr(all_roots, "ALL_ROWS", 40)
    n = 60
    omega = 4096.0 + 16.0 * np.arange(n)
    C = {"1": eye_array(n), factor: csc_array(([-4.0], ([50], [50])), shape=(n, n))}
    system = squeal.System(eye_array(n), C, diags_array(omega**2), parameters={"mu": 0.0})
    band = ((omega[48] - 8.0) / (2 * np.pi), (omega[52] + 8.0) / (2 * np.pi))
    found = squeal.thresholds(system, 1.0, band=band)
    assert [crossing.mu for crossing in found.crossings] == pytest.approx(crossings)
    assert found.certified == bool(crossings)
    assert any(factor in doubt for doubt in found.doubts) != bool(crossings)


@pytest.mark.parametrize(
    ("factor", "is_unseen"),
    [
        ("3 - 2*mu", False),
        ("mu*(1 - mu)", False),
        ("1/mu", False),
        ("1/(1 + mu)**3", False),
        ("1 - 2/(1 + ((mu - 0.44)/0.001)**2)", True),
        ("mu + 1/(1 + ((mu - 0.96)/0.001)**2)", True),
        ("mu + 0.24/(1 + ((mu - 0.9612)/0.002)**2)", True),
        ("mu**1.5", False),
        ("mu**0.5", False),
        ("mu/(1 + mu)", False),
        ("(1 + mu)/(1 + mu)*2", False),
        ("(1 + mu)*(1/(1 + mu))", False),
        ("(2 + mu)**0.5/(2 + mu)**0.5", False),
        ("2 + 1e-5/(1 + ((mu - 0.44)/0.001)**2)", True),
        ("((mu - 0.46)**2 + 1e-4)**0.5", False),
    ],
)
def test_a_factor_is_unseen_if_it_may_leave_the_values_that_it_shows(factor, is_unseen):
    one = np.eye(1)
    system = squeal.System(one, None, {"1": one, factor: one}, parameters={"mu": 0.5})
    least = 0.01 if factor == "1/mu" else 0.0
    values = np.linspace(least, 1.0, 12).tolist()
    assert (undersampled_factor(system, values) is not None) == is_unseen


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_intervals_of_a_reduced_undamped_system_hold_thresholds_of_exact_matrices(seed):
    """Pairs of rows with squares a and a + gap, and coupling c mu, -c mu, coalesce at
    mu = gap / 2 c; single rows diverge at k / s. Sums and products below are exact in doubles."""
    rng = np.random.default_rng(seed)
    exact: list[Fraction] = []
    K0 = np.zeros((402, 402))
    K1 = np.zeros_like(K0)
    squares = np.round(rng.uniform(4e7, 9e8, len(K0)))  # outside of the band
    np.fill_diagonal(K0, squares)
    for k in (0, 2, 4):
        low = np.round(rng.uniform(9e3, 1e4) * (k + 1))
        gap, coupling = np.round(rng.uniform([200.0, 500.0], [400.0, 900.0]))
        K0[k, k] = low
        K0[k + 1, k + 1] = low + gap
        K1[k, k + 1] = coupling
        K1[k + 1, k] = -coupling
        exact.append(Fraction(float(gap)) / Fraction(float(2 * coupling)))
    for k in (6, 7):
        K0[k, k] = np.round(rng.uniform(1e3, 8e3))
        K1[k, k] = -np.round(K0[k, k] / rng.uniform(0.3, 0.9))
        exact.append(-Fraction(float(K0[k, k])) / Fraction(float(K1[k, k])))
    left, right = np.eye(len(K0)), np.eye(len(K0))
    for factor in (left, right):  # half of the rows, or columns, added to the other half
        rows, columns = rng.permutation(len(K0)).reshape(2, -1)
        factor[rows, columns] = 1.0
    K = {"1": left @ K0 @ right, "mu": left @ K1 @ right}
    found = squeal.thresholds(squeal.System(left @ right, K=K), 1.0, band=(0.0, 60.0))
    assert found.certified
    crossings = sorted(found.crossings, key=lambda crossing: crossing.mu)
    for crossing, value in zip(crossings, sorted(exact), strict=True):
        lower, upper = crossing.interval
        assert lower <= value <= upper
        assert upper - lower < 1e-6  # |K| is a million times larger than the couplings


def test_a_root_that_passes_zero_beside_a_free_motion_is_certified():
    """K = [[0, mu], [0, 4 - mu]] beside stiff rows: divergence from 4 on, undamped."""
    others = np.linspace(1e8, 2e8, 420)
    K0 = block_diag([np.array([[0.0, 0.0], [0.0, 4.0]]), diags_array(others)], format="csc")
    K1 = csc_array(([1.0, -1.0], ([0, 1], [1, 1])), shape=K0.shape)
    system = squeal.System(eye_array(422), None, {"1": K0, "mu": K1})
    answer = squeal.thresholds(system, 6.0, band=(0.0, 2.0))
    (crossing,) = answer.crossings
    assert crossing.interval == pytest.approx((4.0, 4.0))
    assert (crossing.kind, crossing.direction) == ("divergence", "up")
    assert answer.certified
