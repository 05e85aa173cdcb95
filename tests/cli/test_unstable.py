"""The table of unstable modes, its filters, and what a healthy pad is called."""

import json

import pytest

from squeal.cli.main import main
from squeal.io.provenance import ROOT as PACKAGE
from tests.cli.calls import answer, run

SYSTEMS = PACKAGE / "article" / "literature" / "systems"


def unstable(capsys, *arguments):
    code, out, err = run(capsys, "eigenvalues", *arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)["unstable"]


def test_a_pad_says_what_grows_and_since_when(capsys, pad):
    (mode,) = unstable(capsys, pad)
    found = json.loads(run(capsys, "eigenvalues", pad, "--json")[1])
    first = found["eigenvalues"][0]
    assert mode["growth_rate"] == first["real"] > 0
    assert {k: mode[k] for k in ("frequency_hz", "damping_ratio")} == {
        k: first[k] for k in ("frequency_hz", "damping_ratio")
    }
    main(["critical-friction", str(pad), "--json"])
    critical = json.loads(capsys.readouterr().out)["critical"]
    assert mode["onset"] == pytest.approx(critical[0]["mu"], rel=1e-9)
    assert mode["kind"] == "flutter"


def test_filters(capsys, pad):
    assert unstable(capsys, pad, "--band", "2000:4000") == []
    assert len(unstable(capsys, pad, "--band", "1000:2000", "--min-growth", "600")) == 1
    assert unstable(capsys, pad, "--min-growth", "700") == []
    # the eigenvalues themselves stay complete
    assert len(answer(capsys, "eigenvalues", pad, "--band", "2000:4000")["eigenvalues"]) == 6


def test_a_mode_of_the_region_that_grows_too_slowly_is_not_denied(capsys, tmp_path):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3) at mu = 3: 2 +- i sqrt(3), which grows by 0.5683 1/s."""
    path = tmp_path / "s.yaml"
    path.write_text(
        "parameters: {mu: 3}\nM: [[1, 0], [0, 1]]\nK:\n- {matrix: [[2, -1], [-1, 2]]}\n"
        "- {matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}\n"
    )
    region = ("--region", "0:1:0:2")
    assert unstable(capsys, path, *region, "--min-growth", "0.56")
    found = answer(capsys, "eigenvalues", path, *region, "--min-growth", "0.57")
    assert (found["unstable"], found["verdict"]) == ([], "flutter")
