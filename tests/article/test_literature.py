"""The toolkit on systems of the literature, against closed forms and printed numbers.

Of the bicycle the numbers are those of Table 2 of the benchmark, in the public transcriptions by
other authors, which agree; of the wing they follow from the matrices; all others are closed forms.
"""

import cmath
import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from squeal.io.system_files import read_system
from squeal.linear import complex_eigenvalues, thresholds
from squeal.linear.terms import Term
from tests.conftest import ROOT
from tests.linear.conftest import exact_damped

SYSTEMS = ROOT / "squeal" / "article" / "literature" / "systems"
BICYCLE = {
    0.0: (3.13164324790656, 5.53094371765393, -3.13164324790656, -5.53094371765393),
    4.0: (0.41325331521125 + 3.07910818603206j, -1.42944427361326),
    5.0: (-0.77534188219585 + 4.46486771378823j, -0.32286642900409, -14.07838969279820),
    7.0: (-2.13875644258362 + 7.19525913329805j, 0.10268170574766, -18.15788466125262),
    10.0: (-3.72016840437287 + 10.90681139476287j, 0.16105338653172, -24.62459635017404),
}
SPEEDS = {"flutter": 0.68428307889246, "restabilised": 4.29238253634111}
SPEEDS |= {"divergence": 6.02426201538837}
WING = (0.09472173 + 2.52287659j, -0.88483025 + 8.44151216j, -0.91799817 + 1.7605842j)


def system(name):
    entry = read_system(SYSTEMS / f"{name}.yaml")
    assert entry.reference
    return entry.system


def first(points, kind, attribute="mu"):
    return next((getattr(p, attribute) for p in points if p.kind == kind), None)


def nearest(matrices, value):
    values = complex_eigenvalues(*matrices).values
    return values[np.argmin(np.abs(values - value))]


def test_two_coupled_modes_flutter_where_the_closed_form_says():
    own = system("mode_coupling")
    points = thresholds(own, 2.0).points
    assert first(points, "flutter") == pytest.approx(0.75, rel=1e-12)
    frequency = math.sqrt(2) / (2 * math.pi)
    assert first(points, "flutter", "frequency_hz") == pytest.approx(frequency, rel=1e-12)
    for mu in (0.5, 0.8, 1.0):
        for sign in (1, -1):
            value = cmath.sqrt(-(2 + sign * cmath.sqrt(1 - 4 * mu / 3)))
            assert nearest(own(mu), value) == pytest.approx(value, rel=1e-12)
    reverse = thresholds(
        replace(own, K=(own.K[0], Term(-own.K[1].matrix, own.K[1].factor))), 10.0
    ).points
    assert first(reverse, "flutter") is None
    assert first(reverse, "divergence") == pytest.approx(2.25, rel=1e-12)


def test_the_drum_brake_flutters_where_routh_and_hurwitz_say():
    own = system("drum_brake")
    w1 = math.sqrt(own.K[0].matrix[0, 0])
    w2 = math.sqrt(own.K[0].matrix[1, 1])
    undamped = first(thresholds(own, 1.0).points, "flutter")
    assert undamped == pytest.approx(abs(w1**2 - w2**2) / (2 * w1 * w2), rel=1e-12)
    for e1, e2 in ((0.02, 0.02), (0.02, 0.04)):
        c1 = e1 * w1
        c2 = e2 * w2
        # Routh-Hurwitz conditions of the quartic
        a3 = c1 + c2
        a2 = w1**2 + w2**2 + c1 * c2
        a1 = c1 * w2**2 + c2 * w1**2
        mu = math.sqrt(a1 * (a2 * a3 - a1) / (a3 * w1 * w2) ** 2 - 1)
        points = thresholds(replace(own, C=(Term(np.diag([c1, c2])),)), 1.0).points
        assert first(points, "flutter") == pytest.approx(mu, rel=1e-10)
        frequency = math.sqrt(a1 / a3) / (2 * math.pi)
        assert first(points, "flutter", "frequency_hz") == pytest.approx(frequency, rel=1e-10)
    assert mu < undamped  # unequal damping destabilises


def test_damping_moves_the_follower_load_as_the_closed_form_says():
    own = system("ziegler")
    undamped = first(thresholds(own, 4.0).points, "flutter")
    assert undamped == pytest.approx(3.5 - math.sqrt(2), rel=1e-12)
    for c in (0.01, 0.1, 1.0):
        damped = replace(own, C=(Term(c * np.array([[2.0, -1.0], [-1.0, 1.0]])),))
        load = first(thresholds(damped, 4.0).points, "flutter")
        assert load == pytest.approx(41 / 28 + c**2 / 2, rel=1e-10)


def test_the_wing_has_its_published_eigenvalues_to_the_last_printed_digit():
    M, C, K = system("wing")(0.0)
    exact = exact_damped(M, C, K)
    for value in WING:
        assert nearest((M, C, K), value) == pytest.approx(value, rel=1e-8)
        close = complex(min(exact, key=lambda root: abs(root - mp.mpc(value))))
        assert abs(close - value) < 9e-9


def test_the_bicycle_has_its_published_speeds_and_eigenvalues():
    own = system("bicycle")
    points = thresholds(own, 10.0).points
    for kind, speed in SPEEDS.items():
        assert first(points, kind) == pytest.approx(speed, rel=1e-11)
    for speed, values in BICYCLE.items():
        for value in values:
            assert nearest(own(speed), value) == pytest.approx(value, rel=1e-11)
