"""The referee on nonlinear pads, judged by their equations at 50 digits."""

import itertools
from dataclasses import replace
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from benchmarks.random_pads import examine
from benchmarks.random_pads import scene_of as random_scene
from squeal.equilibrium.damping import damped_model, without_friction
from squeal.io.scene import Damping, Scene
from squeal.model.contact import State
from squeal.model.equations import linearise
from squeal.model.pad import Pad
from squeal.proof.branches import PadBranch
from squeal.proof.loads import BITS
from squeal.proof.pads import (
    Claim,
    _BranchComparison,
    _count_in_right_half_plane,
    _determinant,
    _growing_count,
    _sign_within,
    prove_pad,
)
from squeal.proof.signs import Sign, signs
from squeal.queries.thresholds import critical_friction
from squeal.results.sources import PadSource
from tests.conftest import scene_of
from tests.exact import Exact, det, discriminant

flint = pytest.importorskip("flint")


@pytest.fixture
def digits():
    with mp.workdps(50):
        yield


def branch(scene, high: float) -> PadBranch:
    _, start, _ = without_friction(scene)
    return PadBranch(damped_model(scene), start, high)


def stiff_scene() -> Scene:
    """A line contact that is much stiffer than the springs, touched by one edge."""
    pad = Pad(
        m=0.2, w=0.04, h=0.014, k1=5767.0, k2=26700.0, k_c=1.7e9, L1=0.8, L2=0.8, alpha1=1.21,
        alpha2=2.474, mu=0.3, F_n=61.8, y0=-0.02, theta0=0.02,
    )  # fmt: skip
    return Scene("B2", pad)


def as_mpf(ball) -> mp.mpf:
    """The midpoint of a ball, all its digits."""
    mantissa, exponent = ball.mid().man_exp()
    return mp.mpf(int(mantissa)) * mp.mpf(2) ** int(exponent)


def test_signs_of_polynomials_are_those_at_50_digits(digits):
    """Polynomials with roots at random places, some of them double, and with wide coefficients."""
    rng = np.random.default_rng(0)
    for trial in range(60):
        zeros = rng.uniform(-1.2, 1.2, 4)
        if trial % 3 == 0:
            zeros[1] = zeros[0]
        exact = flint.arb_poly([1])
        for zero in zeros.tolist():
            exact = exact * flint.arb_poly([-zero, 1])
        wide = 10.0 ** rng.uniform(-16.0, -2.0)
        pieces = signs(exact + flint.arb_poly([flint.arb(0, wide)]), -1.0, 1.0)
        assert (pieces[0].low, pieces[-1].high) == (-1.0, 1.0)
        for before, after in itertools.pairwise(pieces):
            assert before.high == after.low
        for piece in pieces:
            for t in np.linspace(piece.low, piece.high, 7).tolist():
                value = mp.mpf(1)
                for zero in zeros.tolist():
                    value *= mp.mpf(t) - mp.mpf(zero)
                if piece.sign:
                    assert value * piece.sign > wide / 2


def test_between_two_signs_an_interval_of_one_ulp_has_none():
    """Its middle is one of its ends, at which a neighbour has a sign."""
    zero = 0.3
    beyond = float(np.nextafter(zero, 1.0))
    pieces = [Sign(0.0, zero, 1), Sign(zero, beyond, 0), Sign(beyond, 1.0, -1)]
    assert [_sign_within(pieces, piece.low, piece.high) for piece in pieces] == [1, 0, -1]


def test_wide_balls_have_the_count_of_each_polynomial_in_them():
    """Cubics in s and polynomials in lambda whose coefficients are known to their sign alone."""
    rng = np.random.default_rng(0)
    counted = 0
    for _ in range(400):
        squares = rng.uniform(0.1, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
        coefficients = -np.poly(squares)[::-1]
        balls = [flint.arb(float(c), 0.99 * abs(float(c))) for c in coefficients]
        found = _growing_count(balls, 1, is_damped=False)
        if found is not None:
            counted += 1
            assert found == np.sum(squares < 0.0)
        roots = np.roots(rng.uniform(0.1, 1.0, 4) * rng.choice([-1.0, 1.0], 4))
        coefficients = np.poly(roots)[::-1]
        balls = [flint.arb(float(c), 1e-3 * abs(float(c))) for c in coefficients]
        found = _count_in_right_half_plane(balls)
        if found is not None:
            counted += 1
            assert found == np.sum(roots.real > 0.0)
    assert counted > 500


@pytest.mark.parametrize("seed", [69, 74])
def test_wide_enclosures_refute_no_right_list(seed):
    """Pads over eight decades whose lists are right at 50 digits."""
    pad = examine(seed, wide=True)
    assert not pad.wrong
    assert "disagrees" not in pad.open_reason


@pytest.mark.parametrize("stem", ["b1-b", "b2-a", "b2-b", "b2-c"])
def test_the_branch_holds_the_exact_equilibria(stem, digits):
    """Through changes of contact, and around a fold: at 50 digits they lie in their cells."""
    cells = list(branch(scene_of(stem), 2.0).cells())
    assert len({cell.state for cell in cells}) == 2
    for cell in cells:
        exact = Exact(scene_of(stem), cell.state)
        for t in (cell.start, (cell.start + cell.end) / 2.0, cell.end):
            place = cell.at(flint.arb(t))
            q = [as_mpf(ball) for ball in place]

            # at the pivot's value: Newton's method at the friction of the middle is not that
            def from_pivot(q: Any, mu: Any, pivot: int = cell.pivot, at: Any = q) -> Any:
                return [*q, mu][pivot] - at[pivot]

            z = exact.critical(from_pivot, q[:3], q[3])
            for ball, value in zip(place, [*z[0], z[1]], strict=True):
                miss = abs(value - as_mpf(ball))
                assert miss <= mp.mpf(float(ball.rad())) + mp.mpf(10) ** -24


def claims_of(answer) -> list[Claim]:
    claims = []
    for one in answer.crossings:
        roots = 2 if one.kind == "flutter" else 1
        claims.append(Claim(one.mu, roots if one.direction == "up" else -roots))
    return claims


def test_the_first_loss_of_stability_of_a_nonlinear_pad_is_proved(digits):
    """b1-a flutters where the discriminant at 50 digits vanishes."""
    scene = scene_of("b1-a")
    guess, state = without_friction(scene)[1:]
    exact = Exact(scene, state)
    _, onset = exact.critical(lambda q, mu: discriminant(exact.cubic(q, mu)), guess, 0.3458)
    right = prove_pad(branch(scene, 2.0), [Claim(float(onset), 2)], None, float(onset), 1e-1)
    assert (right.status, right.growth_below, right.until) == ("proved", 0.0, 2.0)
    ((low, high),) = right.intervals
    assert mp.mpf(low) <= onset <= mp.mpf(high)
    assert high - low < 1e-14


def test_hard_contact_hides_no_threshold_from_its_interval(digits):
    """Partial contact that presses so little that an ulp of y is 1e-11 of the friction.

    The discriminant at 50 digits vanishes in each interval.
    """
    scene = stiff_scene()
    answer = critical_friction(scene, prove=True)
    assert answer.certified, answer.proof_line
    assert len(answer.crossings) == 2
    assert isinstance(answer.source, PadSource)
    path = answer.source.branch
    assert path is not None
    for one in answer.crossings:
        z, state = path.at(one.mu)
        exact = Exact(scene, state)

        def coalescence(q: Any, mu: Any, at: Exact = exact) -> Any:
            return discriminant(at.cubic(q, mu))

        _, mu = exact.critical(coalescence, path.statics.to_si(z), one.mu)
        assert one.interval[0] <= mu <= one.interval[1]


@pytest.mark.parametrize(
    "wrong",
    [
        [],  # dropped
        [(0.34586737781 * (1 + 1e-7), 2)],  # moved
        [(0.34586737781 * (1 - 1e-7), 2)],
        [(0.3, 2), (0.34586737781, 2)],  # invented
        [(0.34586737781, -2)],  # the other direction
        [(0.34586737781, 1)],  # another kind
        [(0.34586737781, 2), (0.34586737781, 2)],  # doubled
        [(0.34586737781, 2), (1.5, -2)],  # never regained
    ],
)
def test_wrong_lists_are_refuted(wrong):
    claims = [Claim(*one) for one in wrong]
    assert prove_pad(branch(scene_of("b1-a"), 2.0), claims, None, 0.345, 1e-1).status == "refuted"


@pytest.mark.parametrize("rises", [(2, -2, 2), (2, 1, -1)])
def test_invented_thresholds_that_cancel_prove_nothing(rises):
    """A loss and a return beside the true loss leave the count as it is without both."""
    claims = [Claim(0.34586737781, rise) for rise in rises]
    proof = prove_pad(branch(scene_of("b1-a"), 2.0), claims, None, claims[0].mu, 1e-1)
    assert (proof.status, proof.intervals) == ("open", ())
    assert "cancel" in proof.reason


def test_a_fold_is_where_the_determinant_vanishes(digits):
    scene = scene_of("b2-c")
    *_, last = branch(scene, 2.0).cells()
    exact = Exact(scene, last.state)
    guess = [as_mpf(ball) for ball in last.at(flint.arb(0))]
    _, fold = exact.critical(lambda q, mu: det(exact.stiffness(q, mu)), guess[:3], guess[3])
    right = prove_pad(branch(scene, 2.0), [], float(fold), None, 1e-1)
    assert right.status == "proved"
    assert abs(right.until - float(fold)) < 1e-13
    for wrong in (None, float(fold) * (1 + 1e-7), float(fold) * (1 - 1e-7)):
        assert prove_pad(branch(scene, 2.0), [], wrong, None, 1e-1).status == "refuted"


@pytest.mark.parametrize("seed", [49, 69])
def test_a_change_of_contact_that_turns_the_branch_back_is_enclosed(digits, seed):
    """At 50 digits the gap vanishes between the ends of the interval, which are doubles."""
    scene = random_scene(seed)
    enclosed = branch(scene, 2.0)
    with flint.ctx.workprec(BITS):  # as `prove_pad` walks along it
        *_, last = enclosed.cells()
    exact = Exact(scene, last.state)
    *q, mu = [as_mpf(ball) for ball in last.at(flint.arb(last.end))]
    changed = min((0, 1), key=lambda i: abs(exact.gaps(q)[i]))
    _, fold = exact.critical(lambda q, mu: exact.gaps(q)[changed], q, mu)
    low, high = enclosed.fold_at_contact
    assert low < fold < high


@pytest.mark.parametrize("open_from", [0.0, 0.5])
def test_a_fold_at_a_contact_proves_no_part_without_a_count(monkeypatch, open_from):
    """The fold is claimed rightly, and nothing was counted on the way to it, or on half of it."""
    scene = random_scene(49)
    enclosed = branch(scene, 2.0)
    with flint.ctx.workprec(BITS):
        assert len(list(enclosed.cells())) > 0
    low, high = enclosed.fold_at_contact
    fold = (low + high) / 2.0
    claims = claims_of(critical_friction(scene))
    assert prove_pad(branch(scene, 2.0), claims, fold, None, 1e-1).status == "proved"
    by_signs = _BranchComparison._parts_by_signs

    def open_beyond(self: Any, cell: Any, start: float, end: float) -> Any:
        parts = by_signs(self, cell, start, end)
        return [
            part._replace(growing=None) if float(part.friction.mid()) >= open_from * fold else part
            for part in parts
        ]

    monkeypatch.setattr(_BranchComparison, "_parts_by_signs", open_beyond)
    assert prove_pad(branch(scene, 2.0), claims, fold, None, 1e-1).status == "open"


@pytest.mark.parametrize("claimed", [0.344, 0.34586737781, 0.348])
def test_a_threshold_within_a_wide_open_interval_is_open(claimed, monkeypatch):
    """b1-a flutters at 0.34587; signs around it are made unknown."""
    by_signs = _BranchComparison._parts_by_signs

    def open_between(self: Any, cell: Any, start: float, end: float) -> Any:
        parts = by_signs(self, cell, start, end)
        return [
            part._replace(growing=None) if 0.3 < float(part.friction.mid()) < 0.4 else part
            for part in parts
        ]

    monkeypatch.setattr(_BranchComparison, "_parts_by_signs", open_between)
    proof = prove_pad(branch(scene_of("b1-a"), 2.0), [Claim(claimed, 2)], None, None, 1e-1)
    assert proof.status == "open"
    assert not proof.intervals


@pytest.mark.parametrize(("stem", "ratio"), [("b1-a", 0.01), ("b2-a", 0.003), ("b1-d", 0.02)])
def test_damped_pads_are_proved_as_eigenvalues_at_40_digits_say(stem, ratio):
    """On both sides of what is proved as many roots grow as the list says, and none without."""
    scene = replace(scene_of(stem), damping=Damping(ratios=(ratio, 2 * ratio, ratio)))
    answer = critical_friction(scene, prove=True)
    assert answer.proof["status"] == "proved", answer.proof_line
    model = damped_model(scene)
    assert isinstance(answer.source, PadSource)
    path = answer.source.branch
    edges = [0.0]
    for one in answer.crossings:
        edges += list(one.interval)
    edges.append(answer.proof["extent"][1])
    count = 0
    rises = [0, *(claim.rise for claim in claims_of(answer))]
    for rise, (low, high) in zip(rises, zip(edges[::2], edges[1::2], strict=True), strict=True):
        count += rise
        for mu in np.linspace(low, high, 6)[1:-1].tolist():
            e = path.equilibrium(mu)
            M, C, K = linearise(model.replace(mu=mu), np.array(e.q), e.state)
            with mp.workdps(40):
                inverse = mp.matrix(np.diag(1.0 / np.diag(M)))
                A = mp.zeros(6)
                A[0:3, 3:6] = mp.eye(3)
                A[3:6, 0:3] = -inverse * mp.matrix(K)
                A[3:6, 3:6] = -inverse * mp.matrix(C)
                roots = mp.eig(A, left=False, right=False)
            assert sum(root.real > 0 for root in roots) == count


def test_stiffness_along_cells_is_that_of_the_model():
    """K at the start of a branch is the model's own, to rounding."""
    for stem in ("b1-a", "b2-b", "b2-c", "b2-d"):
        model, start, state = without_friction(scene_of(stem))
        cell = next(iter(PadBranch(model, start, 0.1).cells()))
        t = cell.t_of(flint.arb(float(start[cell.pivot]) if cell.pivot < 3 else 0.0))
        K = linearise(model, start, state).K
        for row, expected in zip(cell.slopes, K.tolist(), strict=True):
            for slope, value in zip(row[:3], expected, strict=True):
                assert abs(-slope(t) - value) < 1e-9 * np.abs(K).max()


@pytest.mark.parametrize("damping", [{"matrix": ((0.0,) * 3,) * 3}, {"ratios": (0.0,) * 3}])
def test_damping_of_zeros_is_none(damping):
    scene = replace(scene_of("b1-a"), damping=Damping(**damping))
    proof = prove_pad(branch(scene, 2.0), [Claim(0.34586737781, 2)], None, None, 1e-1)
    assert (proof.status, proof.until) == ("proved", 2.0)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_determinants_of_polynomials_are_those_of_their_values(n):
    rng = np.random.default_rng(n)
    values = rng.integers(-3, 4, (n, n))
    rows = [[flint.arb_poly([v, 1]) for v in row] for row in values.tolist()]
    exact = flint.fmpz_mat((values + 1).tolist()).det()
    assert _determinant(rows)(flint.arb(1)).contains(flint.arb(exact))


def test_a_branch_that_ends_is_open():
    """A start that is none."""
    model, start, _ = without_friction(scene_of("b1-a"))
    nowhere = PadBranch(model, start + 1e3, 0.1)
    assert prove_pad(nowhere, [], None, None, 1.0).status == "open"


@pytest.mark.parametrize("gap_by_point", [(0.4, 0.3), (0.3, 0.4)])
def test_gaps_that_may_vanish_at_the_same_t_are_one_change(monkeypatch, gap_by_point):
    """Gaps that vanish within 0.3..0.5 and 0.2..0.4 of t, in either order of their points."""
    pad_branch = branch(scene_of("b2-b"), 0.1)
    cell = replace(next(iter(pad_branch.cells())), state=State(False, False), start=-1.0)
    gaps = []
    for vanishes_at in gap_by_point:
        gaps.append(flint.arb_poly([flint.arb(vanishes_at, 0.1), -1]))
    monkeypatch.setattr("squeal.proof.branches.enclosing_polynomials", lambda *_: gaps)
    change = pad_branch._first_change(cell, same_state=True)
    assert change is not None
    assert sorted(change.points) == [0, 1]
    assert change.low == pytest.approx(0.2)
    assert change.high == pytest.approx(0.5)
