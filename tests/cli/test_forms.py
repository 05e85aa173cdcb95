"""The short and the general form of one system: the same ranges, keys and answers; no scenes."""

import json

import pytest

from tests.cli.calls import answer, assert_refused, run
from tests.conftest import SCENES

# lambda^2 = -2 +- sqrt(1 - 4/3 mu): flutter above mu = 3/4, divergence below -9/4
SHORT = "M: [[1, 0], [0, 1]]\nK0: [[2, -1], [-1, 2]]\nK1: [[0, 1.3333333333333333], [0, 0]]\n"
GENERAL = """parameters: {mu: 0, k: 2}
M: [[1, 0], [0, 1]]
K:
  - {matrix: [[1, 0], [0, 1]], factor: k}
  - {matrix: [[0, -1], [-1, 0]]}
  - {matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}
"""


@pytest.fixture
def forms(tmp_path):
    paths = tmp_path / "short.yaml", tmp_path / "general.yaml"
    for path, text in zip(paths, (SHORT, GENERAL), strict=True):
        path.write_text(text)
    return paths


@pytest.mark.parametrize("option", ["--mu", "--sweep"])
def test_a_parameter_is_swept_over_any_range(forms, capsys, option):
    found = [answer(capsys, "eigenvalues", path, option, "-3:1e4:3")["sweep"] for path in forms]
    assert [[row["verdict"] for row in rows] for rows in found] == [
        ["divergence", "flutter", "flutter"]
    ] * 2
    for path in forms:
        err = assert_refused(capsys, "eigenvalues", path, option, "1:-1:3")
        assert f"{option} 1:-1:3: is not allowed; it must be A:B:N with A < B" in err
    err = assert_refused(capsys, "eigenvalues", SCENES / "b3.yaml", option, "-1:1:3")
    assert f"{option} -1:1:3: is not allowed; it must be A:B:N with 0 <= A < B <= 1000" in err


def test_a_figure_of_a_range_below_zero(forms, capsys, tmp_path):
    for path in forms:
        figure = tmp_path / f"{path.stem}.svg"
        assert run(capsys, "eigenvalues", path, "--mu", "-3:1:5", "--svg", figure)[0] == 0
        assert figure.stat().st_size > 1000


@pytest.mark.parametrize("command", ["critical-friction", "advise"])
@pytest.mark.parametrize("option", ["--max", "--mu-max"])
def test_thresholds_are_sought_up_to_any_value(forms, capsys, command, option):
    for path in forms if command == "critical-friction" else forms[1:]:
        found = answer(capsys, command, path, option, "5e3")
        first = found["critical"]
        first = first[0]["mu"] if isinstance(first, list) else first
        assert first == pytest.approx(0.75, rel=1e-9)
        err = assert_refused(capsys, command, path, option, "-1")
        assert "-1: is not allowed; it must" in err
    err = assert_refused(capsys, command, SCENES / "b3.yaml", option, "5e3")
    assert f"{option} 5e3: is not allowed; it must be a finite number above 0 and at most" in err


def test_both_names_of_the_first_verdict(forms, capsys):
    for path in (*forms, SCENES / "b3.yaml"):
        found = answer(capsys, "critical-friction", path)
        assert found["verdict_at_zero"] == found["verdict_at_start"] == "marginal"
        assert found["mu_start"] == 0.0
        assert found["mu_end"] == 2.0
    for path in forms:
        found = answer(capsys, "critical-friction", path, "--min", "1")
        assert (found["verdict_at_zero"], found["verdict_at_start"]) == (None, "flutter")


def test_a_map_of_one_parameter_is_refused(forms, capsys):
    short, general = forms
    for more in ((), ("--first", "mu:0:1", "--second", "mu:0:1"), ("--band", "0:9")):
        err = assert_refused(capsys, "map", short, *more)
        assert err.startswith("squeal: short.yaml: mu is the only parameter; a map needs a system")
    ends = ("--first", "mu:0:2", "--second", "k:1.9:2.1", "--n", "2")
    expected = [["marginal"] * 2, ["flutter"] * 2]  # at mu = 1/2 and 3/2, whatever k is
    assert answer(capsys, "map", general, *ends)["verdicts"] == expected


@pytest.mark.parametrize("command", ["simulate", "sliding"])
def test_what_takes_a_scene_says_so(forms, capsys, command):
    for path in forms:
        err = assert_refused(capsys, command, path)
        assert err == (
            f"squeal: {path}: M: a system of matrices is not allowed here; it must be a scene\n"
        )


def test_a_table_leaves_out_the_condition_of_a_root_without_one(tmp_path, capsys):
    """K = [[0, 1], [0, 0]] has one vector for four roots of zero."""
    files = {"short": "K0: [[0, 1], [0, 0]]\n", "general": "K: [{matrix: [[0, 1], [0, 0]]}]\n"}
    for name, rows in files.items():
        path, table = tmp_path / f"{name}.yaml", tmp_path / f"{name}.json"
        path.write_text(f"M: [[1, 0], [0, 1]]\n{rows}")
        assert run(capsys, "eigenvalues", path, "--table", table)[0] == 0
        found = json.loads(table.read_text())["rows"]
        assert [row["condition"] for row in found] == [None] * 4
