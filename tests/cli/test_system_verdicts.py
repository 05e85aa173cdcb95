"""Verdicts, onsets and refusals of systems in bands and at wild sizes, against closed forms."""

import json

import numpy as np
import pytest

from squeal.analysis.systems.roots import ALL_ROWS
from tests.cli.calls import answer, assert_refused, run

MEETS, PASSES = (4e4 - 400) / 1.97e4, 4e4 / 1.97e4


@pytest.fixture
def meeting(tmp_path):
    """s^2 - 40 s + k, k = 4e4 - 1.97e4 mu: a growing pair, two real roots, then one of them."""
    path = tmp_path / "meeting.yaml"
    path.write_text(
        "M: [[1, 0], [0, 1]]\nC: [{matrix: [[-40, 0], [0, 1]]}]\nK: [{matrix: [[4.0e4, 0], [0, "
        "1.0e+8]]}, {matrix: [[-1.97e4, 0], [0, 0]], factor: mu}]\n"
    )
    return path


@pytest.mark.parametrize("options", [(), ("--band", "0:1000")])
@pytest.mark.parametrize("high", ["2.005", "2.1", "3", "100"])
def test_a_pair_that_meets_changes_the_verdict_and_crosses_nothing(options, high, meeting, capsys):
    found = answer(capsys, "critical-friction", meeting, "--max", high, *options)
    beyond = float(high) > PASSES
    crossed = [(c["kind"], c["direction"], c["changes_verdict"]) for c in found["crossings"]]
    assert crossed == [("divergence", "down", False)] * beyond
    assert [p["kind"] for p in found["critical"]] == ["divergence"] * beyond
    assert [p["mu"] for p in found["critical"]] == pytest.approx([MEETS] * beyond, rel=1e-9)
    assert found["certified"]


def test_verdicts_in_a_band_of_a_large_system_change_where_growth_changes_hands(tmp_path, capsys):
    """A pair that grows at 0.05 beside r^2 + 0.3 r + 0.2 - mu = 0, and many that decay."""
    from scipy.io import mmwrite
    from scipy.sparse import csc_array, diags_array

    n = ALL_ROWS + 20
    stiffness = np.concatenate([[36.0, 0.2], np.linspace(400.0, 4000.0, n - 2)])
    damping = np.concatenate([[-0.1, 0.3], np.full(n - 2, 0.4)])
    falls = np.zeros(n)
    falls[1] = -1.0
    for name, diagonal in zip("ckf", (damping, stiffness, falls), strict=True):
        mmwrite(tmp_path / f"{name}.mtx", csc_array(diags_array(diagonal)))
    mmwrite(tmp_path / "m.mtx", csc_array(diags_array(np.ones(n))))
    path = tmp_path / "system.yaml"
    path.write_text(
        "M: {file: m.mtx}\nC: {file: c.mtx}\nK: [{file: k.mtx}, {file: f.mtx, factor: mu}]\n"
    )
    found = answer(capsys, "critical-friction", path, "--max", "0.5", "--band", "0:1.5")
    (crossing,), (point,) = found["crossings"], found["critical"]
    assert crossing["mu"] == pytest.approx(0.2, rel=1e-10)
    assert not crossing["changes_verdict"]
    assert point["mu"] == pytest.approx(0.2 + 0.05**2 + 0.3 * 0.05, rel=1e-9)
    assert point["kind"] == "divergence"
    assert found["certified"]
    assert found["left_out"] == []


@pytest.mark.parametrize("high", ["1.05", "2"])
def test_a_root_that_grows_beyond_the_band_is_said_to_leave(high, tmp_path, capsys):
    """r^2 + 0.1 r + 1 - mu = 0 from mu = 1 on; r is a quarter of 2 pi 0.2 Hz at mu = 1.13."""
    path = tmp_path / "leaves.yaml"
    path.write_text(
        "M: [[1, 0], [0, 0]]\nC: [{matrix: [[0.1, 0], [0, 2]]}]\n"
        "K: [{matrix: [[1, 0], [0, 5]]}, {matrix: [[-1, 0], [0, 0]], factor: mu}]\n"
    )
    found = answer(capsys, "critical-friction", path, "--max", high, "--band", "0:0.2")
    (crossing,), (point,) = found["crossings"], found["critical"]
    assert crossing["mu"] == pytest.approx(1.0, rel=1e-12)
    assert crossing["changes_verdict"]
    assert (point["kind"], point["mu"]) == ("divergence", crossing["mu"])
    assert found["unconfirmed"] == []
    assert found["certified"]
    assert len(found["left_out"]) == (high == "2")
    assert "leaves.yaml" in assert_refused(capsys, "critical-friction", path, "--max", high)


@pytest.mark.parametrize(
    ("options", "onsets"),
    [
        ((), [0.5, 0.75]),
        (("--band", "0.1:1"), [0.75]),
        (("--band", "1:5"), [0.5]),
        (("--band", "6:7"), []),
        (("--modes", "1"), [0.5, 0.75]),
        (("--region", "-1:1:1:2"), [0.75]),
    ],
)
def test_a_mode_has_its_onset_however_few_roots_are_asked_for(options, onsets, tmp_path, capsys):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3), flutter from 3/4 on, and 200 +- 100 sqrt(1 - 2 mu)."""
    path = tmp_path / "coupled.yaml"
    path.write_text(
        "M: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\nparameters: {mu: 1}\nK:\n"
        "- {matrix: [[2, -1, 0, 0], [-1, 2, 0, 0], [0, 0, 200, -100], [0, 0, -100, 200]]}\n"
        "- {matrix: [[0, 1.3333333333333333, 0, 0], [0, 0, 0, 0], [0, 0, 0, 200], [0, 0, 0, 0]], "
        "factor: mu}\n"
    )
    code, out, err = run(capsys, "eigenvalues", path, *options, "--json")
    assert (code, err) == (0, "")
    found = sorted(mode["onset"] for mode in json.loads(out)["unstable"])
    assert found == pytest.approx(onsets, rel=1e-12)
