"""Frequencies, growth and amplitudes of motions that are known in closed form."""

import numpy as np
import pytest

from squeal.numerics.oscillation import exponent, half_range, spectrum, strongest_line

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


SUMS = [
    (-0.02 + 0.7j, [(-0.02 + 0.7j, 1.0)]),
    (0.3j, [(0.3j, 1.0)]),
    # flutter: a growing and a decaying motion of one frequency
    (0.03 + 0.8j, [(0.03 + 0.8j, 1.0), (-0.03 + 0.8j, 1.0), (1.1j, 1.0)]),
    (0.1 + 0.8j, [(0.1 + 0.8j, 1e-3), (1.1j, 1.0)]),  # what grows wins in the end
    (0.3j, [(0.8j, 1.0), (0.3j, 20.0)]),  # of motions that last alike, the faster in space
    (0.8j, [(0.8j, 3.0), (0.3j, 1.0)]),
    (0.05, [(0.05, 1.0), (1.1j, 1.0)]),  # growth without oscillation
    (0.01 + 1j, [(0.01 + 1j, 1e-7), (0.5j, 1e-8)]),  # a small motion, whose samples hold rounding
]


@pytest.mark.parametrize(("expected", "components"), SUMS)
def test_the_exponent_of_a_sum_of_exponentials_is_that_of_what_lasts(expected, components):
    small = min(size for _, size in components) < 1e-6
    found = exponent(sum_of(*components), STEP)
    assert found == pytest.approx(expected, abs=1e-5 if small else 1e-9)


def test_what_is_no_sum_of_exponentials_over_two_periods_has_no_exponent():
    rng = np.random.default_rng(1)
    assert exponent(np.ones((600, 6)), STEP) is None
    assert exponent(rng.standard_normal((600, 6)).cumsum(axis=0), STEP) is None
    assert exponent(np.abs(sum_of((1j, 1.0), (0.37j, 1.0))), STEP) is None
    growing = sum_of((0.02 + 1j, 1.0))
    for periods in (1.9, 2.1):
        count = int(periods * 2 * np.pi / STEP) + 2
        assert (exponent(growing[:count], STEP) is None) == (periods < 2.0)
    growing[300:] = growing[300]  # growth that ends is that of the start
    assert exponent(growing, STEP) == pytest.approx(0.02 + 1j, abs=1e-6)


@pytest.mark.parametrize("frequency", [0.05, 0.0513, 0.4, 1.0])
def test_a_sine_has_its_line_at_its_frequency(frequency):
    signals = np.array([3.0 + np.sin(2 * np.pi * frequency * T + 0.3), np.cos(6.28 * T) / 9]).T
    found, share = strongest_line(signals, STEP)
    assert found == pytest.approx(frequency, rel=1e-4)
    assert share > 0.95


@pytest.mark.filterwarnings("error")
def test_the_share_of_a_line_is_its_part_of_the_power():
    two = np.array([np.sin(2 * np.pi * 0.3 * T) + 2 * np.sin(2 * np.pi * 0.81 * T)]).T
    assert strongest_line(two, STEP) == pytest.approx((0.81, 0.8), abs=0.01)
    assert strongest_line(np.random.default_rng(0).standard_normal((600, 3)), STEP)[1] < 0.1
    assert (
        strongest_line(np.ones((600, 2)), STEP)
        == strongest_line(np.arange(5.0)[:, None], STEP)
        == (0.0, 0.0)
    )


def test_amplitudes_of_sines_are_found_by_spectrum_and_by_range():
    n = len(T)
    k = 45
    sine = 0.7 * np.sin(2 * np.pi * k / (n * STEP) * T) + 5.0
    frequencies, amplitudes = spectrum(sine[:, None], STEP)
    assert frequencies[k] == pytest.approx(k / (n * STEP))
    assert amplitudes[[k, 10], 0] == pytest.approx([0.7, 0.0], abs=1e-9)
    t = np.arange(0.0, 40.0, 0.25)
    signals = np.array([3.0 + 2.0 * np.sin(t), -0.1 * np.cos(t + 1.0), 0.0 * t, t]).T
    assert half_range(signals) == pytest.approx([2.0, 0.1, 0.0, t[-1] / 2], rel=1e-4)


def test_the_range_of_a_motion_that_only_falls_ends_at_its_samples():
    # nearly straight, and exp(-t) cos(t + 0.3), which is greatest before its first sample
    t = np.linspace(0.0, 1.0, 21)
    signals = np.array([-t - 1e-4 * t**2, np.exp(-t) * np.cos(t + 0.3)]).T
    assert half_range(signals) == pytest.approx((signals[0] - signals[-1]) / 2)
