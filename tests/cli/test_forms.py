"""The short and the general form of one system: the same ranges, keys and answers; no scenes."""

import pytest

from tests.cli.calls import answer
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


def test_both_names_of_the_first_verdict(forms, capsys):
    for path in (*forms, SCENES / "b3.yaml"):
        found = answer(capsys, "critical-friction", path)
        assert found["verdict_at_zero"] == found["verdict_at_start"] == "marginal"
        assert found["mu_start"] == 0.0
        assert found["mu_end"] == 2.0
    for path in forms:
        found = answer(capsys, "critical-friction", path, "--min", "1")
        assert (found["verdict_at_zero"], found["verdict_at_start"]) == (None, "flutter")
