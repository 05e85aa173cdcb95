"""Pads and matrices with one stiffness far greater than the others, against 50 digits."""

import mpmath as mp
import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.pad import Pad
from squeal.queries.pads.equilibrium import analyse, branch_system
from squeal.queries.pads.stack import PadStack
from squeal.queries.systems.all_roots import motion_rates
from squeal.queries.systems.roots import system_roots
from squeal.queries.thresholds import critical_friction
from squeal.results.sources import EigenvalueSelection
from tests.exact import Exact, discriminant
from tests.known import system_of
from tests.linear.conftest import exact_damped

VALUES = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6, "L1": 0.8, "L2": 0.8,
    "alpha1": np.pi / 2, "alpha2": np.pi, "mu": 0.4, "F_n": 4500.0,
}  # fmt: skip
HIDDEN = "no eigenvalue can be given: one stiffness"


def stiff(decades):
    """The inclined spring k1 by decades stiffer than the contact springs."""
    return Scene("B1", Pad(**VALUES, k1=8.7e6 * 10.0**decades))


@pytest.mark.parametrize("decades", [8, 11])
def test_the_interval_of_a_threshold_holds_it_however_stiff_a_spring_is(decades):
    scene = stiff(decades)
    (point,) = critical_friction(scene, 1.0).points
    _, path = branch_system(scene, 1.0)
    z, state = path.at(point.mu)
    exact = Exact(scene, state)

    def coalescence(q, mu):
        a, b, c = exact.cubic(q, mu)
        return discriminant((a, b, c)) / (a * b) ** 2

    with mp.workdps(50):
        _, mu = exact.critical(coalescence, path.branch.statics.to_si(z), point.mu)
    assert point.kind == "flutter"
    assert point.interval[0] <= mu <= point.interval[1]
    assert not point.converged


@pytest.mark.parametrize("decades", [9, 12])
def test_slow_roots_of_a_stiff_pad_lie_within_their_rounding(decades):
    scene = stiff(decades)
    analysis = analyse(scene)
    exact = Exact(scene, analysis.state)
    with mp.workdps(50):
        q = exact.equilibrium(analysis.q, scene.pad.mu)
        frequencies = sorted(float(mp.sqrt(s.real)) for s in exact.squares(q, scene.pad.mu))
    values = sorted(e.value.imag for e in analysis.spectrum.eigenvalues if e.value.imag > 0)
    assert analysis.judgement.verdict == "marginal"
    assert values == pytest.approx(frequencies, rel=1e-15 * 10**decades)


@pytest.mark.filterwarnings("ignore:system. no matrix depends")
@pytest.mark.parametrize("stiffness", [9.0, 0.0])
def test_a_light_motion_hides_neither_roots_nor_verdict_of_plain_matrices(stiffness):
    M = np.array([[1.0, 1 - 1e-6], [1 - 1e-6, 1.0]])
    C = 0.1 * np.eye(2)
    K = np.diag([4.0, 9.0])
    K[1] *= stiffness / 9.0
    given = system_of(M, C, K)
    found = squeal.eigenvalues(given)
    assert found.verdict == ("stable" if stiffness else "marginal")
    assert np.sum(found.values == 0) == (not stiffness)
    for exact in exact_damped(M, C, K):
        assert np.abs(found.values - complex(exact)).min() <= 1e-9 * abs(exact)
    assert squeal.thresholds(given, 1.0).verdict == found.verdict
    assert squeal.sweep(given, [0.0]).steps[0].verdict == found.verdict


@pytest.mark.parametrize(("stiffness", "damping"), [(1e14, 0.1), (1e20, 0.0)])
def test_no_root_is_too_fast_to_be_listed(stiffness, damping):
    """Two modes of 1 and 3 rad^2/s^2 beside a third that nothing couples to them."""
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, stiffness]])
    roots = system_roots(system_of(np.eye(3), damping * np.eye(3), K))
    exact = [complex(-damping / 2, np.sqrt(k - damping**2 / 4)) for k in (1.0, 3.0, stiffness)]
    assert (roots.certified, len(roots.eigenvalues)) == (True, 6)
    upper = [e.value for e in roots.eigenvalues if e.value.imag > 0.0]
    assert upper == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("decades", [13, 14])
def test_what_rounding_hides_is_not_given(decades):
    scene = stiff(decades)
    with pytest.raises(ComputationError, match=HIDDEN):
        analyse(scene)
    with pytest.raises(ComputationError):
        critical_friction(scene, 0.1)
    assert PadStack.of(scene, ("k2",), np.array([[2.6e7]])).first_losses(1.0).unknown.all()


@pytest.mark.parametrize("slow", [-3.0, 3.0])
@pytest.mark.parametrize("modes", [None, 1])
def test_a_stiff_spring_hides_nothing_of_a_slow_motion(slow, modes):
    """Whether it is coupled with it, where the solver in doubles computes zeros, or not."""
    pytest.importorskip("flint")
    apart = np.diag([1e18, 1e18, slow])
    joined = apart + np.diag([1e17, 1.0], 1) + np.diag([1e17, 1.0], -1)
    for K in (apart, joined):
        (first, *_) = system_roots(
            system_of(np.eye(3), None, K), EigenvalueSelection(modes=modes)
        ).eigenvalues
        assert abs(first.value) == pytest.approx(np.sqrt(3.0), rel=1e-14)
        assert first.kind == ("divergence" if slow < 0.0 else "marginal")


@pytest.mark.parametrize(
    ("K", "damping"),
    [([[1e15, 1.0], [1.0, 2.0]], 0.0), ([[1e18, 1e9], [1e9, 2.0]], 0.0), (np.eye(2), 1e20)],
)
def test_the_slowest_and_the_fastest_motion_are_known_however_far_apart_they_are(K, damping):
    """Stiffness or damping of the first row is decades above that of the second."""
    C = np.diag([damping, 0.0]) + 0.5
    exact = [abs(root) for root in exact_damped(np.eye(2), C if damping else 0.0 * C, np.array(K))]
    rates = motion_rates(system_of(np.eye(2), C if damping else None, np.array(K)), {})
    assert rates.slowest == pytest.approx(float(min(exact)))
    assert rates.fastest == pytest.approx(float(max(exact)))


@pytest.mark.parametrize("damping", [1e9, 1e14])
def test_rounding_of_a_fast_decay_hides_neither_the_slowest_motion_nor_oscillation(damping):
    """A slow decay, an oscillation, and a decay that is decades faster, all coupled."""
    M = np.eye(2)
    C = np.array([[damping, 1.0], [-1.0, 1e-3]])
    K = np.array([[1.0, 0.2], [0.1, 1.0]])
    exact = exact_damped(M, C, K)
    oscillations = [abs(root) for root in exact if abs(root.imag) > 1e-3 * abs(root)]
    rates = motion_rates(system_of(M, C, K), {})
    assert rates.slowest == pytest.approx(float(min(map(abs, exact))), rel=1e-8, abs=0.0)
    assert rates.slowest_oscillation == pytest.approx(float(min(oscillations)), rel=1e-4)
    assert rates.fastest == pytest.approx(float(max(map(abs, exact))))


@pytest.mark.filterwarnings("ignore:.*M is no mass")
@pytest.mark.parametrize(
    ("stiffness", "rows"), [(-7e-15, 3), (-7e-15, 2), (7e-15, 3), (-3e-17, 3), (-2.5e-16, 4)]
)
def test_a_slow_row_beside_a_regular_block_has_exact_roots(stiffness, rows):
    """lambda^4 = stiffness * 2 of the first two rows, where the solver computes zeros."""
    pytest.importorskip("flint")
    M = np.eye(rows)
    M[:2, :2] = [[0.0, 1.0], [1.0, 0.0]]
    K = np.diag([stiffness, 2.0, 3.0, 5.0][:rows])
    answer = squeal.eigenvalues(squeal.System(M, K=K))
    known = [root.value for root in answer.eigenvalues if abs(root.value) < 1.0]
    assert answer.certified
    assert answer.verdict == ("flutter" if stiffness < 0.0 else "divergence")
    assert len(known) == 4
    assert np.array(known) ** 4 == pytest.approx(2.0 * stiffness, rel=1e-6)
