"""Frequencies, growth and amplitudes of motions that are known in closed form."""

import numpy as np
import pytest
from scipy.linalg import expm

from squeal.numerics.oscillation import exponent, line, spectrum, swing

STEP = 0.2
T = STEP * np.arange(600)


def sum_of(*components):
    """Samples (n, 6) of sum_k Re(c_k v_k exp(lambda_k t)) about a place of rest."""
    rng = np.random.default_rng(4)
    total = np.ones((len(T), 6)) * rng.standard_normal(6)
    for value, size in components:
        vector = rng.standard_normal(6) + 1j * rng.standard_normal(6)
        total += size * (np.exp(value * T)[:, None] * vector).real
    return total


@pytest.mark.parametrize(
    ("components", "expected"),
    [
        ([(0.01 + 1j, 1.0)], 0.01 + 1j),
        ([(-0.02 + 0.7j, 1.0)], -0.02 + 0.7j),
        ([(0.3j, 1.0)], 0.3j),
        # flutter: a growing and a decaying motion of one frequency
        ([(0.03 + 0.8j, 1.0), (-0.03 + 0.8j, 1.0), (1.1j, 1.0)], 0.03 + 0.8j),
        # what grows wins in the end, also from a faint start
        ([(0.1 + 0.8j, 1e-3), (1.1j, 1.0)], 0.1 + 0.8j),
        # of motions that last alike, the faster in space
        ([(0.8j, 1.0), (0.3j, 20.0)], 0.3j),
        ([(0.8j, 3.0), (0.3j, 1.0)], 0.8j),
        # growth without oscillation
        ([(0.05, 1.0), (1.1j, 1.0)], 0.05),
        # a small motion, whose samples hold rounding
        ([(0.01 + 1j, 1e-7), (0.5j, 1e-8)], 0.01 + 1j),
    ],
)
def test_exponent_of_a_sum_of_exponentials(components, expected):
    small = min(size for _, size in components) < 1e-6
    assert exponent(sum_of(*components), STEP) == pytest.approx(
        expected, abs=1e-5 if small else 1e-9
    )


def test_exponent_of_matrices():
    rng = np.random.default_rng(2)
    for _ in range(20):
        K, C = rng.standard_normal((2, 3, 3))
        A = np.zeros((6, 6))
        A[:3, 3:], A[3:, :3], A[3:, 3:] = np.eye(3), -np.eye(3) - 0.2 * K, -0.02 * C
        state, map_of_step = rng.standard_normal(6), expm(STEP * A)
        samples = [state]
        for _ in range(599):
            samples.append(map_of_step @ samples[-1])
        values = np.linalg.eigvals(A)
        found = exponent(np.array(samples), STEP)
        assert found is not None
        # the one that is strongest at the end is among them, and grows
        assert np.abs(values - found).min() < 1e-6
        assert found.real >= np.sort(values.real)[-4]


def test_what_is_no_sum_of_exponentials_has_no_exponent():
    assert exponent(np.ones((600, 6)), STEP) is None
    rng = np.random.default_rng(1)
    assert exponent(rng.standard_normal((600, 6)).cumsum(axis=0), STEP) is None
    assert exponent(np.abs(sum_of((1j, 1.0), (0.37j, 1.0))), STEP) is None


@pytest.mark.parametrize("periods", [1.9, 2.1])
def test_an_exponent_needs_two_periods(periods):
    samples = sum_of((0.01 + 1j, 1.0))[: int(periods * 2 * np.pi / STEP) + 2]
    assert (exponent(samples, STEP) is None) == (periods < 2.0)


def test_growth_that_ends_is_that_of_the_start():
    samples = sum_of((0.02 + 1j, 1.0))
    samples[300:] = samples[300]
    assert exponent(samples, STEP) == pytest.approx(0.02 + 1j, abs=1e-6)


@pytest.mark.parametrize("frequency", [0.05, 0.0513, 0.4, 1.0])
def test_the_line_of_a_sine(frequency):
    signals = np.array([3.0 + np.sin(2 * np.pi * frequency * T + 0.3), np.cos(6.28 * T) / 9]).T
    found, share = line(signals, STEP)
    assert found == pytest.approx(frequency, rel=1e-4)
    assert share > 0.95


def test_the_share_of_a_line():
    two = np.array([np.sin(2 * np.pi * 0.3 * T) + 2 * np.sin(2 * np.pi * 0.81 * T)]).T
    found, share = line(two, STEP)
    assert found == pytest.approx(0.81, rel=1e-4)
    assert share == pytest.approx(0.8, abs=0.01)
    noise = np.random.default_rng(0).standard_normal((600, 3))
    assert line(noise, STEP)[1] < 0.1
    assert line(np.ones((600, 2)), STEP) == (0.0, 0.0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", [1, 2, 5])
def test_few_samples_have_no_line(n):
    assert line(np.arange(2.0 * n).reshape(n, 2) ** 3, STEP) == (0.0, 0.0)


def test_the_spectrum_shows_amplitudes():
    n, k = len(T), 45
    sine = 0.7 * np.sin(2 * np.pi * k / (n * STEP) * T) + 5.0
    frequencies, amplitudes = spectrum(sine[:, None], STEP)
    assert frequencies[k] == pytest.approx(k / (n * STEP))
    assert amplitudes[k, 0] == pytest.approx(0.7, rel=1e-9)
    assert amplitudes[10, 0] < 1e-9


def test_swing_is_half_of_the_range():
    t = np.arange(0.0, 40.0, 0.25)
    signals = np.array([3.0 + 2.0 * np.sin(t), -0.1 * np.cos(t + 1.0), 0.0 * t, t]).T
    assert swing(signals) == pytest.approx([2.0, 0.1, 0.0, t[-1] / 2], rel=1e-4)
