"""The friction loop in python-control against the eigenvalues and thresholds of the toolkit."""

import control
import numpy as np
import pytest

from squeal.stability import complex_eigenvalues, critical_points, friction_loop, verdict
from tests.stability.conftest import random_pad


def _starts_and_ends(system, mu_max):
    found, growing = [], verdict(*system(0.0)) in ("flutter", "divergence")
    for p in critical_points(system, mu_max):
        if (p.kind != "restabilised") != growing:
            growing = not growing
            found.append(p.mu)
    return found


def _loop(system, reaction=None):
    answer = friction_loop(system, reaction=reaction)
    assert answer.loop is not None, answer.reason
    return answer.loop


def _random(rng, damping):
    M, _, K0 = random_pad(rng)
    K0 = (K0 + K0.T) / 2
    unit = np.sqrt(np.diag(M))
    b, c = 1e3 * unit * rng.normal(size=3), 1e3 * unit * rng.normal(size=3)
    C = None if not damping else damping * np.diag(unit**2 * rng.uniform(0.5, 1.5, 3))
    return (lambda mu: (M, C, K0 + mu * np.outer(b, c))), c


@pytest.mark.parametrize("damping", [0.0, 5.0, 200.0])
def test_gain_margin_is_the_critical_friction(rng, damping):
    count = 0
    for _ in range(40):
        system, c = _random(rng, damping)
        loop = _loop(system, c)
        expected = _starts_and_ends(system, 2.0)
        assert loop.thresholds(2.0) == pytest.approx(expected, rel=1e-9)
        count += len(expected)
    assert count > 10


def test_python_control_finds_the_same_margin_with_damping(mode_coupling):
    for C in (1e-3 * np.diag([1.0, 2.0]), 0.2 * np.diag([1.0, 2.0])):
        system = lambda mu, C=C: (np.eye(2), C, mode_coupling(mu)[2])  # noqa: E731
        loop = _loop(system)
        margin, *_ = control.margin(loop.plant)
        assert loop.critical_friction(2.0) == pytest.approx(margin, rel=1e-9)


def test_undamped_margin_comes_from_the_breakaway_point(mode_coupling):
    loop = _loop(mode_coupling)
    assert loop.critical_friction(2.0) == pytest.approx(0.75, rel=1e-12)
    assert loop.critical_friction(0.7) is None


def test_poles_and_root_locus_are_the_eigenvalues(rng):
    system, c = _random(rng, 20.0)
    loop = _loop(system, c)
    mus = [0.0, 0.3, 1.1]
    locus = loop.root_locus(mus)
    assert locus.gains == pytest.approx(mus)
    for k, mu in enumerate(mus):
        expected = complex_eigenvalues(*system(mu)).values
        size = np.abs(expected).max()
        for poles in (locus.loci[k], loop.closed(mu).poles()):
            distance = np.abs(np.asarray(poles)[:, None] - expected[None, :])
            assert distance.min(axis=0).max() < 1e-9 * size
            assert distance.min(axis=1).max() < 1e-9 * size


def test_static_gain_of_the_plant(mode_coupling):
    # K0 = [[2, -1], [-1, 2]], force on the first mass, reaction at the second: 1/3 per unit force
    loop = _loop(mode_coupling, [0.0, 1.0])
    assert np.real(loop.plant.dcgain()).item() == pytest.approx(4 / 3 / 3, rel=1e-12)
    assert loop.b == pytest.approx([4 / 3, 0.0])


@pytest.mark.parametrize(
    ("system", "reason"),
    [
        (lambda mu: (np.eye(2), None, 3 * np.eye(2) + mu * np.array([[0, 1], [-1, 0]])), "rank"),
        (lambda mu: (np.eye(2), None, np.array([[2, mu**2], [1, 3]])), "not linear"),
        (lambda mu: (np.eye(2), None, np.eye(2)), "does not depend"),
        (lambda mu: ((1 + mu) * np.eye(2), None, np.eye(2)), "mass"),
        (lambda mu: (np.eye(2), mu * np.eye(2), np.eye(2)), "damping"),
    ],
)
def test_reason_is_given_where_there_is_no_loop(system, reason):
    answer = friction_loop(system)
    assert answer.loop is None
    assert reason in answer.reason


def test_a_wrong_reaction_is_noticed(mode_coupling):
    answer = friction_loop(mode_coupling, reaction=[1.0, 1.0])
    assert answer.loop is None
    assert "reaction" in answer.reason
