"""Slopes of all roots against differences, where every matrix moves."""

import numpy as np
import pytest

from squeal.linear.continuation import Continuation

H = 1e-6


@pytest.mark.parametrize("form", ["undamped", "gyroscopic", "damped"])
@pytest.mark.parametrize("n", [3, 6])
def test_slopes_are_those_of_differences(form, n, rng):
    X, Y, Z, W = rng.normal(size=(4, n, n))
    skew, full = W - W.T, 0.1 * W

    def system(p):
        M = np.eye(n) + 0.1 * (X + X.T) / n + p * np.diag(np.arange(n) / n)
        K = np.diag(np.arange(1.0, n + 1) ** 2) + p * (Y + Y.T) / n + 0.1 * (form == "damped") * Z
        C = {"undamped": None, "gyroscopic": (1 + p) * skew, "damped": full + p * Z}[form]
        return M, C, K

    along = Continuation(system, 0.0, 1.0)
    assert along.form == form
    at, up, down = (along.at(p) for p in (0.4, 0.4 + H, 0.4 - H))
    nearest = [s.roots[np.argmin(np.abs(s.roots - at.roots[:, None]), axis=1)] for s in (up, down)]
    slopes = (nearest[0] - nearest[1]) / (2 * H)
    assert at.slopes == pytest.approx(slopes, abs=1e-7 * np.abs(slopes).max())
