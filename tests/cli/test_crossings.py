"""`squeal critical-friction` lists every crossing, those included that change no verdict."""

import numpy as np
import pytest

from squeal.io.scene import read_scene
from tests.cli.calls import answer

PAD = """\
model: B3
parameters: {m: 0.85, w: 0.0612, h: 0.0168, k1: 2.7e6, k2: 1.15e6, k_c: 1.38e8, alpha1: 1.34,
             alpha2: 1.70, mu: 0.25}
"""
PAIRS = """\
M: [[1,0,0,0,0],[0,1,0,0,0],[0,0,1,0,0],[0,0,0,1,0],[0,0,0,0,1]]
K0: [[2,-1,0,0,0],[-1,2,0,0,0],[0,0,20,-10,0],[0,0,-10,20,0],[0,0,0,0,1]]
K1: [[0,4,0,0,0],[0,0,0,0,0],[0,0,0,20,0],[0,0,0,0,0],[0,0,0,0,-1]]
"""


def test_divergence_of_a_pad_is_where_the_determinant_vanishes(tmp_path, capsys):
    file = tmp_path / "pad.yaml"
    file.write_text(PAD)
    found = answer(capsys, "critical-friction", file)["crossings"]
    (crossing,) = [c for c in found if c["kind"] == "divergence" and c["mu"] < 0.25]
    scene = read_scene(file)
    step = 1e-6

    def determinant(mu):
        from squeal.model.equations import about_origin

        return np.linalg.det(about_origin(scene.pad_model.replace(mu=mu)).K)

    low, high = (determinant(crossing["mu"] + side * step) for side in (-1.0, 1.0))
    assert low * high < 0.0
    assert (crossing["kind"], crossing["direction"]) == ("divergence", "up")
    assert crossing["mu"] == pytest.approx(0.2124, abs=5e-5)
    assert not crossing["changes_verdict"]  # the pair that flutters from 0.052 on grows faster


def test_all_thresholds_of_independent_parts_are_listed(tmp_path, capsys):
    file = tmp_path / "pairs.yaml"
    file.write_text(PAIRS)
    found = answer(capsys, "critical-friction", file)["crossings"]
    # (2 - s)^2 = 1 - 4 mu, (20 - s)^2 = 100 - 200 mu and s = 1 - mu
    assert [c["mu"] for c in found] == pytest.approx([0.25, 0.5, 1.0], rel=1e-9)
    assert [c["kind"] for c in found] == ["flutter", "flutter", "divergence"]
    assert found[0]["changes_verdict"]
    frequencies = [2**0.5 / (2 * np.pi), 20**0.5 / (2 * np.pi), 0.0]
    assert [c["frequency_hz"] for c in found] == pytest.approx(frequencies, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("depth", [1e-6, 1e-12])
def test_a_window_that_almost_closes_is_listed_with_intervals_that_hold_it(depth, tmp_path, capsys):
    # damping (mu - 1)^2 - depth: growth between 1 - sqrt(depth) and 1 + sqrt(depth), where it
    # changes by 2 sqrt(depth) for one of mu: rounding leaves each end 1e-16 over that at least
    file = tmp_path / "window.yaml"
    file.write_text(f"M: [[1]]\nC0: [[{1 - depth!r}]]\nC1: [[-2]]\nC2: [[1]]\nK0: [[1]]\n")
    found = answer(capsys, "critical-friction", file)
    assert [point["kind"] for point in found["critical"]] == ["flutter", "restabilised"]
    for point, exact in zip(found["critical"], (1 - depth**0.5, 1 + depth**0.5), strict=True):
        low, high = point["interval"]
        assert low <= exact <= high
        assert point["converged"] == (high - low <= 1e-9) == (depth > 1e-7)
    assert found["certified"]


def test_what_is_counted_is_said_to_agree(tmp_path, capsys, pad):
    file = tmp_path / "pairs.yaml"
    file.write_text(PAIRS)
    assert answer(capsys, "critical-friction", file)["certified"] is True
    assert answer(capsys, "critical-friction", pad)["certified"] is None  # nothing is counted
    damped = ("--set", "damping.ratios=[0.02, 0.02, 0.02]")
    assert answer(capsys, "critical-friction", pad, *damped)["certified"] is None
