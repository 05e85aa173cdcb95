"""Where a command reads its scene from, and --set."""

import hashlib
import io
import math
import os
import sys
import threading

import pytest

from squeal.io.provenance import ROOT
from tests.cli.calls import answer, assert_refused, run
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


def test_refusals_name_standard_input(capsys, standard_input):
    standard_input(b"model: B4\nparameters: {}\n")
    code, _, err = run(capsys, "eigenvalues", "-")
    assert code == 2
    assert err.startswith("squeal: standard input: model: 'B4'")


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


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ("mu", ("--set mu", "NAME=VALUE")),
        ("kc=1", ("--set kc=1", "unknown key", "k_c")),
        ("mu=-1", ("--set mu=-1", "-1", "at least 0")),
        ("mu=", ("--set mu=", "at least 0")),
        ("mu=[", ("--set mu=[", "at least 0")),
        ("model=B4", ("--set model=B4", "B1, B2, B3")),
        ("k3=5", ("b2-c.yaml: parameters.k3", "does not use it")),
        ("theta=1.6", ("initial.theta", "surface")),
        ("time=1", ("--set time=1", "mapping")),
    ],
)
def test_set_is_checked_like_the_file(capsys, change, parts):
    err = assert_refused(capsys, "simulate", B2, "--set", change)
    for part in parts:
        assert part in err


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        (("mu=0.3", "mu=0.5"), "parameters.mu"),
        (("parameters.mu=0.3", "mu=0.3"), "parameters.mu"),
        (("initial.x=1e-4", "initial=equilibrium"), "initial.x"),
    ],
)
def test_no_value_is_set_twice(capsys, changes, key):
    first, second = changes
    err = assert_refused(capsys, "eigenvalues", B2, "--set", first, "--set", second)
    assert err.startswith(f"squeal: --set {second}: {key} is set already")
    assert run(capsys, "eigenvalues", B2, "--set", second)[0] == 0


def test_a_word_for_a_group_may_be_followed_by_its_keys(capsys):
    both = ("--set", "initial=equilibrium", "--set", "initial.x=1e-4")
    found = answer(capsys, "eigenvalues", B2, *both)
    assert found["set"] == {"initial": "equilibrium", "initial.x": 1e-4}


@pytest.mark.parametrize("option", ["--band", "--at", "--region", "--modes", "--memory"])
def test_no_option_is_given_twice(capsys, option):
    err = assert_refused(capsys, "eigenvalues", DRUM, option, "3", option, "4")
    assert err.startswith(f"squeal: {option} 4")
    assert "is given already" in err


def test_degrees_are_asked_about(capsys):
    code, out, err = run(capsys, "eigenvalues", B3, "--set", "alpha1=90")
    assert (code, bool(out)) == (0, True)
    assert err.startswith("squeal: warning: ")
    assert "parameters.alpha1: 90 rad is more than a full turn" in err
    assert "0.5*pi" in err
    assert err.count("\n") == 1
    for fine in ("6.28", "4*pi", "-pi"):
        assert run(capsys, "eigenvalues", B3, "--set", f"alpha1={fine}")[2] == ""
    code, _, err = run(capsys, "map", B3, "--n", "2", "--first", "alpha1:0:180")
    assert code == 0
    assert "180 rad" in err


def test_the_axes_of_a_map_name_what_is_allowed(capsys):
    code, _, err = run(capsys, "map", B3, "--first", "kc:1:2")
    assert code == 2
    assert "'kc' is not allowed" in err
    assert "k_c" in err
    assert "L1" not in err  # B3 does not use it


def test_a_system_lists_its_own_keys_and_parameters(capsys, tmp_path):
    path = tmp_path / "system.yaml"
    path.write_text("parameters: {mu: 1, Omega: 2}\nM: [[1]]\nK: {matrix: [[1]], factor: Omega}\n")
    err = assert_refused(capsys, "eigenvalues", path, "--set", "foo=1")
    keys = "name, reference, parameters, mu, Omega, parameter, M, C, K, damping, coordinates"
    assert err.endswith(f"--set foo=1: unknown key; allowed are {keys}\n")


def test_an_option_of_systems_is_named_as_it_was_given(capsys):
    for option in ("--gif", "--animation"):
        err = assert_refused(capsys, "eigenvalues", SCENES / "b1-c.yaml", option, "a.gif")
        assert f"{option} a.gif: is not allowed with b1-c.yaml" in err
