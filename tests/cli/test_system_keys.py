"""The JSON keys of systems from matrices: what is fixed is there, what is there is documented."""

import re
from pathlib import Path

import pytest

from tests.cli.calls import answer

DOCS = (Path(__file__).parents[2] / "docs" / "systems.md").read_text()
ROOT = {"real", "imag", "frequency_hz", "damping_ratio", "residual"}
CHANGE = {"mu", "kind", "frequency_hz", "interval", "residual"}
CROSSING = {"mu", "kind", "direction", "frequency_hz", "mode", "changes_verdict"}
GENERAL = """
parameters: {mu: 0.9}
M: [{matrix: [[1, 0], [0, 1]]}]
K: [{matrix: [[2, -1], [-1, 2]]}, {matrix: [[0, 1.5], [0, 0]], factor: mu}]
"""
SHORT = "M: [[1, 0], [0, 1]]\nK0: [[2, -1], [-1, 2]]\nK1: [[0, 1.5], [0, 0]]\n"


def _documented():
    section = DOCS.split("## The keys of the answer")[1].split("\n## ")[0]
    return set(re.findall(r"`(\w+)`", section))


@pytest.mark.parametrize("text", [GENERAL, SHORT])
@pytest.mark.parametrize(
    ("arguments", "fixed", "rows"),
    [
        (
            ("eigenvalues", "--sweep", "0:1:3", "--method", "reduced", "--band", "0:10"),
            {"eigenvalues", "certified", "count", "basis", "sweep"},
            {"eigenvalues": ROOT},
        ),
        (
            ("critical-friction", "--max", "2"),
            {"critical", "crossings"},
            {"critical": CHANGE, "crossings": CROSSING},
        ),
    ],
)
def test_keys_are_those_of_the_documentation(text, arguments, fixed, rows, tmp_path, capsys):
    (tmp_path / "system.yaml").write_text(text)
    command, *options = arguments
    if text == SHORT and command == "eigenvalues":
        options = ["--sweep", "0:1:3"]
        fixed = {"eigenvalues", "certified", "count", "sweep"}
    found = answer(capsys, command, tmp_path / "system.yaml", *options)
    assert fixed <= set(found)
    if text == GENERAL:
        assert set(found) <= _documented()
    for key in rows:
        assert found[key]
        for row in found[key]:
            assert rows[key] <= set(row)
            assert text == SHORT or set(row) <= _documented()
    if found.get("basis"):
        assert set(found["basis"]) <= _documented()
