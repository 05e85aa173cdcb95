"""Where a command reads its scene from, and --set."""

import hashlib
import io
import math
import os
import sys
import threading

import pytest

from squeal.io.provenance import ROOT
from tests.cli.calls import answer, run
from tests.conftest import SCENES

B1, B2, B3 = (SCENES / f"{stem}.yaml" for stem in ("b1-c", "b2-c", "b3"))
DRUM = ROOT / "article" / "literature" / "systems" / "drum_brake.yaml"


def assert_only_warnings(err):
    assert all(line.startswith("squeal: warning: ") for line in err.splitlines())


@pytest.fixture
def standard_input(monkeypatch):
    def give(content):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))

    return give


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", B1],
        ["eigenvalues", B2],
        ["critical-friction", DRUM],
        ["sliding", B2],
        ["map", B3, "--n", "3"],
    ],
)
def test_a_dash_reads_standard_input(capsys, standard_input, command):
    name, path, *more = command
    content = path.read_bytes()
    expected = answer(capsys, name, path, *more)
    standard_input(content)
    found = answer(capsys, name, "-", *more)
    (made,) = found.pop("provenance")["inputs"]
    assert made == {"name": "standard input", "sha256": hashlib.sha256(content).hexdigest()}
    assert expected.pop("provenance")["inputs"][0]["name"] == path.name
    for key in ("run_time", "name"):
        assert found.pop(key, None) is None or expected.pop(key)
    assert found == expected


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
@pytest.mark.parametrize("command", ["eigenvalues", "critical-friction", "sliding", "simulate"])
def test_a_pipe_is_read_once(capsys, tmp_path, command):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_bytes(B1.read_bytes()), daemon=True)
    writer.start()
    code, out, err = run(capsys, command, pipe)
    writer.join(5)
    assert code == 0
    assert_only_warnings(err)
    assert out


def test_set_is_an_edited_file(capsys, tmp_path):
    edited = tmp_path / "b2-c.yaml"
    lines = B2.read_text().splitlines()
    lines = [f"  mu: {0.3}" if line.startswith("  mu:") else line for line in lines]
    edited.write_text("\n".join(lines) + "\n")
    expected = answer(capsys, "eigenvalues", edited)
    for name in ("mu", "parameters.mu"):
        found = answer(capsys, "eigenvalues", B2, "--set", f"{name}=0.3")
        assert found.pop("set") == {"parameters.mu": 0.3}
        assert found.pop("provenance")
        assert found == {key: value for key, value in expected.items() if key != "provenance"}


def test_set_takes_everything_that_a_file_may_say(capsys):
    found = answer(
        capsys, "simulate", B2, "--set", "stop=1e-4", "--set", "samples=5", "--set",
        "outputs=[shares]", "--set", "initial.x_dot=0.1", "--set", "line_force=mean",
    )  # fmt: skip
    assert found["final"]["t"] == pytest.approx(1e-4)
    assert "events" not in found
    assert found["set"] == {
        "time.stop": 1e-4,
        "time.samples": 5,
        "outputs": ["shares"],
        "initial.x_dot": 0.1,
        "formulation.line_force": "mean",
    }
    turned = answer(capsys, "eigenvalues", B3, "--set", "alpha1=pi/2")
    as_number = answer(capsys, "eigenvalues", B3, "--set", f"alpha1={math.pi / 2!r}")
    assert turned["eigenvalues"] == as_number["eigenvalues"]
    system = answer(capsys, "critical-friction", DRUM, "--set", "K1=[[0, -1e5], [2e5, 0]]")
    assert system["critical"] != answer(capsys, "critical-friction", DRUM)["critical"]
