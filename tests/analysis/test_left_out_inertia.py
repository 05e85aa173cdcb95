"""I that a file leaves out follows m, w and h wherever a pad is varied: against I written out."""

import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.analysis.maps import field_of
from squeal.analysis.thresholds import critical_friction
from squeal.analysis.variations import Spread, Spreads, Tolerance, advise, scatter
from squeal.io.scene import Scene
from squeal.model.pad import Pad

PAD = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6,
    "L1": 0.8, "L2": 0.8, "alpha1": 0.5 * np.pi, "alpha2": np.pi, "mu": 0.4, "F_n": 4500.0,
}  # fmt: skip
SCENE = Scene("B1", Pad(**PAD))


def written_out(**changes):
    """The first threshold of the pad with I of the uniform rectangle as a number of its own."""
    values = PAD | changes
    inertia = values["m"] * (values["w"] ** 2 + values["h"] ** 2) / 3
    first = critical_friction(Scene("B1", Pad(**values, I=inertia)), 2.0).first
    return np.nan if first is None else first.mu


def held(**changes):
    """The same with the I of the pad before the change: what must not come out."""
    inertia = PAD["m"] * (PAD["w"] ** 2 + PAD["h"] ** 2) / 3
    first = critical_friction(Scene("B1", Pad(**(PAD | changes), I=inertia)), 2.0).first
    return np.nan if first is None else first.mu


@pytest.mark.parametrize("name", ["w", "h"])
def test_contours_and_levers(name):
    low, high = 0.9 * PAD[name], 1.1 * PAD[name]
    shown = field_of(
        SCENE, (Axis(name, low, high, 3), Axis("F_n", 4000.0, 5000.0, 1)), "critical-friction"
    )
    expected = [written_out(**{name: float(v), "F_n": 4500.0}) for v in shown.axes[0].values]
    assert shown.values[:, 0] == pytest.approx(expected, rel=1e-6)
    levers = advise(SCENE, {name: Tolerance(0.05)}).levers
    (lever,) = [one for one in levers if one.parameter == name]
    for outcome, factor in ((lever.lowered, 0.95), (lever.raised, 1.05)):
        assert outcome.critical == pytest.approx(
            written_out(**{name: factor * PAD[name]}), rel=1e-9
        )
        assert outcome.critical != pytest.approx(held(**{name: factor * PAD[name]}), rel=1e-4)


def test_scatter():
    found = scatter(
        SCENE, Spreads((Spread("w", "within", 0.004), Spread("m", "relative", 0.1)), 6, 3)
    )
    again = np.random.default_rng(3)
    w = 0.04 + 0.004 * again.uniform(-1.0, 1.0, 6)
    m = 0.2 + 0.02 * again.standard_normal(6)
    pairs = list(zip(w.tolist(), m.tolist(), strict=True))
    assert found.critical == pytest.approx(
        sorted(written_out(w=a, m=b) for a, b in pairs), rel=1e-9
    )
    wrong = sorted(held(w=a, m=b) for a, b in pairs)
    assert np.abs(found.critical - wrong).max() > 1e-3
