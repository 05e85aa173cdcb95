"""Onset of modes against closed forms."""

import cmath
import math

import numpy as np
import pytest
from scipy.linalg import block_diag

import squeal
from squeal.linear import thresholds, unstable_modes
from squeal.linear.continuation import Continuation
from squeal.linear.paths import links, mode_numbers_at
from tests.known import coupled


def of(system, mu):
    return unstable_modes(system, mu, thresholds(system, mu))


def test_two_coupled_modes_have_growth_and_onset_of_the_closed_form():
    (mode,) = of(coupled, 1.0)
    root = cmath.sqrt(-(2 - 1j / math.sqrt(3)))  # omega^2 = 2 +- sqrt(1 - 4 mu / 3) at mu = 1
    assert (mode.kind, mode.growth_rate) == ("flutter", pytest.approx(root.real, rel=1e-12))
    assert mode.frequency_hz == pytest.approx(root.imag / (2 * math.pi), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(-root.real / abs(root), rel=1e-12)
    assert mode.onset == pytest.approx(0.75, rel=1e-12)
    assert of(coupled, 0.749) == ()
    assert of(coupled, 0.751)[0].onset == pytest.approx(0.75, rel=1e-12)
    assert unstable_modes(coupled, 1.0)[0].onset is None  # nobody looked for it


def pair(middle, drive):
    """Squares of frequencies middle +- sqrt(1/4 - drive): flutter where drive > 1/4."""
    return np.array([[middle - 0.5, -drive], [1.0, middle + 0.5]])


def several(mu):
    """Flutter from 0.2 to 0.6, from 0.4 on, and from 0.5 on; the last two change places in
    frequency at 0.7, both growing; divergence from 1 on."""
    window = 0.25 + (mu - 0.2) * (0.6 - mu)
    second = pair(30 + 10 * (mu - 0.7), 0.25 + (mu - 0.4))
    third = pair(30 - 10 * (mu - 0.7), 0.25 + 2 * (mu - 0.5))
    K = block_diag(pair(10.0, window), second, third, 1.0 - mu)
    return np.eye(7), None, K


ONSETS = [
    (0.1, []),
    (0.3, [0.2]),
    (0.45, [0.2, 0.4]),
    (0.55, [0.2, 0.4, 0.5]),
    (0.65, [0.4, 0.5]),
    (0.9, [0.4, 0.5]),
    (1.2, [0.4, 0.5, 1.0]),
]


@pytest.mark.parametrize(("mu", "onsets"), ONSETS)
def test_each_pair_keeps_its_own_onset(mu, onsets):
    modes = of(several, mu)
    assert sorted(m.onset for m in modes) == pytest.approx(onsets, abs=1e-9)
    for mode in modes:
        square = (2 * math.pi * mode.frequency_hz) ** 2 - mode.growth_rate**2
        squares = {0.2: 10.0, 0.4: 30 + 10 * (mu - 0.7), 0.5: 30 - 10 * (mu - 0.7), 1.0: 1.0 - mu}
        assert square == pytest.approx(squares[round(mode.onset, 6)])
        assert (mode.kind == "divergence") == (mode.frequency_hz == 0.0) == (square < 0.0)
    assert [m.growth_rate for m in modes] == sorted((m.growth_rate for m in modes), reverse=True)


def test_what_grows_from_the_start_has_no_onset():
    (mode,) = of(lambda mu: coupled(mu + 1.0), 0.5)
    assert mode.onset is None
    assert mode.kind == "flutter"


@pytest.mark.parametrize("values", [[0.0, 0.1, 1.0], [1.0, 0.0]])
def test_a_mode_enters_a_band_that_held_none(values):
    one = squeal.System([[1.0]], [[0.01]], {"1": [[1.0]], "mu": [[3.0]]})
    sweep = squeal.sweep(one, values, band=(1.5 / math.tau, 3 / math.tau))
    (mode,) = sweep.modes
    assert mode.first_hz == pytest.approx(math.sqrt(4.0 - 2.5e-5) / math.tau, rel=1e-12)
    assert [loss.kind for loss in sweep.losses] == ["begin"]
    assert [len(step.roots) for step in sweep.steps] == [int(v == 1.0) for v in values]


@pytest.mark.parametrize("share", [0.65, 0.75, 0.9])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_whether_two_roots_meet_within_a_step_that_is_not_halved(sign, share):
    """z = 10 -+ sqrt(p^2 + sign e^2) for |p| <= 0.1: they avoid each other, or meet twice."""
    e = 0.1 * share
    K = np.array([[10.0, e], [sign * e, 10.0]])
    along = Continuation(lambda p: (np.eye(2), None, K + np.diag([p, -p])), -0.1, 0.1)
    (link,) = links(along.at, -0.1, 0.1, iter(()), depth=0)
    assert np.all(link.is_certain == (sign > 0))
    assert link.indistinct == ([] if sign > 0 else [[0, 1]])
    if sign > 0:
        assert link.after.z[link.order] == pytest.approx(link.before.z, abs=1e-12)


def test_no_two_eigenvalues_have_the_number_of_one_root():
    """Two rows, of which the spectrum has but one."""
    values = np.array([1j, 1.0002j])
    spectrum = Continuation(lambda mu: (np.eye(1), None, np.eye(1)), 0.0, 1.0).at(0.0)
    assert mode_numbers_at(spectrum, np.array([4]), values).tolist() == [4, 0]


def test_onsets_are_read_below_mu_also_from_thresholds_of_a_longer_range():
    # three pairs of modes that couple by friction; each onset by a search up to mu alone
    K1 = np.triu(np.random.default_rng(3).uniform(0.0, 1.0, (6, 6)), 1)
    K0 = np.diag([1.0, 1.3, 2.0, 2.3, 4.0, 4.3])

    def system(mu):
        return np.eye(6), None, K0 + mu * (K1 - K1.T)

    longer = thresholds(system, 2.0)
    for mu in (0.1, 0.4, 1.0, 1.5):
        expected = [mode.onset for mode in unstable_modes(system, mu, thresholds(system, mu))]
        found = [mode.onset for mode in unstable_modes(system, mu, longer)]
        assert found == pytest.approx(expected, rel=1e-9)
    assert expected == pytest.approx([0.16838590161, 0.20458726627, 1.00317097282])


def test_a_system_without_stiffness_has_vectors_and_no_threshold():
    result = thresholds(lambda mu: (np.eye(2), None, np.zeros((2, 2))), 1.0)
    assert result.points == []
    (search,) = result.searched
    assert np.array_equal(search.continuation.at(1.0).right, np.eye(2))
