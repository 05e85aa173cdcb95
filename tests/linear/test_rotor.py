"""A rotor on one crossing of which a third root lies halfway between two others."""

import numpy as np
import pytest
from scipy.optimize import brentq

from squeal.linear import thresholds

MASSES = np.array([1.0, 0.02])
EXTERNAL_DAMPING = np.array([0.8, 0.006])
INTERNAL_DAMPING = np.array([1.5, 0.01])
GYROSCOPIC_INERTIA = np.array([0.0, 0.012])
STIFFNESS = np.array([[1e4, -300.0], [-300.0, 60.0]])
CROSS_COUPLING = np.array([20.0, 0.0])
ROTATION = np.array([[0.0, 1.0], [-1.0, 0.0]])


def rotor(speed):
    """Deflection and tilt of a disc, each in two planes."""
    circulatory = speed * INTERNAL_DAMPING + CROSS_COUPLING
    damping = np.diag(EXTERNAL_DAMPING + INTERNAL_DAMPING)
    gyroscopic = np.kron(np.diag(speed * GYROSCOPIC_INERTIA), ROTATION)
    return (
        np.kron(np.diag(MASSES), np.eye(2)),
        np.kron(damping, np.eye(2)) + gyroscopic,
        np.kron(STIFFNESS, np.eye(2)) + np.kron(np.diag(circulatory), ROTATION),
    )


def characteristic(speed, omega):
    """Determinant of the two planes as one complex plane, at the exponent i omega."""
    circulatory = speed * INTERNAL_DAMPING + CROSS_COUPLING
    damping = EXTERNAL_DAMPING + INTERNAL_DAMPING
    direct = np.diag(STIFFNESS) - MASSES * omega**2 + speed * GYROSCOPIC_INERTIA * omega
    first, second = direct + 1j * (damping * omega - circulatory)
    return first * second - STIFFNESS[0, 1] ** 2


def whirl(speed):
    """The frequency next to 88 rad/s at which the real part of the determinant vanishes."""
    return brentq(lambda omega: characteristic(speed, omega).real, 80.0, 95.0, xtol=1e-13)


@pytest.fixture(scope="module")
def onset():
    """The speed at which its imaginary part vanishes, too."""
    return brentq(lambda w: characteristic(w, whirl(w)).imag, 100.0, 150.0, xtol=1e-13)


@pytest.mark.parametrize("highest_speed", [*range(130, 500, 35), 300])
def test_one_crossing_is_located_to_rounding_from_every_range(onset, highest_speed):
    point = thresholds(rotor, float(highest_speed)).points[0]
    assert point.kind == "flutter"
    assert point.converged
    assert point.mu == pytest.approx(onset, rel=1e-12)
    assert point.interval[0] <= onset <= point.interval[1]
    assert point.frequency_hz == pytest.approx(whirl(onset) / (2 * np.pi), rel=1e-9)
