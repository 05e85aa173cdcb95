"""`squeal critical-friction --scatter`: file of tolerances, answer, table, picture, refusals."""

import json

import numpy as np
import pytest
from scipy.stats import norm

from squeal.cli.main import main
from tests.cli.calls import run

SYSTEM = """name: coupled
parameters: {a: 3.0, b: 2.0, k: 0.5, mu: 1.0}
parameter: mu
M: [[1, 0], [0, 1]]
K:
  - {matrix: [[1, 0], [0, 0]], factor: a}
  - {matrix: [[0, 0], [0, 1]], factor: b}
  - {matrix: [[0, -1], [-1, 0]], factor: k}
  - {matrix: [[0, 1], [0, 0]], factor: mu}
"""
SPREADS = "samples: 60\nseed: 7\nspreads:\n  a: {absolute: 0.2}\n"


@pytest.fixture
def system(tmp_path):
    path = tmp_path / "coupled.yaml"
    path.write_text(SYSTEM)
    return path


def spread_file(folder, text=SPREADS):
    path = folder / "spreads.yaml"
    path.write_text(text)
    return path


def exact(level):
    """Flutter from k + (a - b)^2 / 4 k on, and a - b is normal, hardly ever below 0."""
    return 0.5 + norm.ppf(level, 1.0, 0.2) ** 2 / 2.0


def test_the_answer_is_that_of_the_closed_form(capsys, system, tmp_path):
    table, picture = tmp_path / "t.csv", tmp_path / "p.png"
    given = (system, "--scatter", spread_file(tmp_path), "--csv", table, "--png", picture)
    code, out, err = run(capsys, "critical-friction", *given, "--json")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    found = answer["scatter"]
    assert (found["samples"], found["seed"], found["failed"]) == (60, 7, 0)
    assert found["spreads"] == [{"name": "a", "kind": "absolute", "size": 0.2}]
    held = [(q["low"] or 0) <= exact(q["level"]) <= (q["high"] or 9) for q in found["quantiles"]]
    assert sum(held) >= len(held) - 1
    assert found["interval"][0] <= found["stable"] <= found["interval"][1]
    mus, share = np.loadtxt(table, skiprows=1, delimiter=",").T
    assert len(mus) == 60
    assert np.allclose(share, np.arange(1, 61) / 60)
    assert np.mean(mus > 1.0) == pytest.approx(found["stable"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert {one["name"] for one in answer["provenance"]["inputs"]} == {
        "coupled.yaml", "spreads.yaml"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("spread", "part"),
    [
        ("alpha1: {relative: 0.1}", "spreads: alpha1 is an angle and has no share"),
        ("x0: {relative: 0.1}", "spreads: x0 is 0 and has no share; it must be given in its unit"),
        ("x0: {absolute: 1.0e-6}, alpha1: {absolute: 1.0e-3}", ""),
    ],
)
def test_no_share_of_an_angle_or_of_zero(capsys, pad, tmp_path, spread, part):
    path = spread_file(tmp_path, f"samples: 10\nspreads: {{{spread}}}\n")
    code, _, err = run(capsys, "critical-friction", pad, "--scatter", path)
    assert code == (2 if part else 0)
    assert part in err


def test_a_system_with_parameters_is_advised_on(capsys, system):
    assert main(["advise", str(system), "--json", "--tolerance", "b=0.3"]) == 0
    found = json.loads(capsys.readouterr().out)
    first = found["levers"][0]
    assert first["parameter"] == "b"
    assert first["lowered"]["critical"] == pytest.approx(0.5 + 1.3**2 / 2)
    assert first["raised"]["critical"] == pytest.approx(0.5 + 0.7**2 / 2)


def test_progress_is_shown_to_a_terminal_only(capsys, system, tmp_path, monkeypatch):
    path = spread_file(tmp_path, SPREADS.replace("60", "20"))
    assert run(capsys, "critical-friction", system, "--scatter", path)[2] == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert "20 of 20 samples" in run(capsys, "critical-friction", system, "--scatter", path)[2]
