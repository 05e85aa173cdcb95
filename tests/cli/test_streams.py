"""Streams and files of the commands: pipes, full discs, names, and nothing half written."""

import hashlib
import io
import json
import math
import os
import subprocess
import sys
import threading

import pytest

from squeal.cli.main import COMMANDS
from squeal.errors import ComputationError
from squeal.io.provenance import ROOT
from squeal.io.writing import write_csv
from tests.cli.calls import answer, run
from tests.conftest import SCENES

B1, B2, B3 = (SCENES / f"{stem}.yaml" for stem in ("b1-c", "b2-c", "b3"))


def test_a_reader_who_leaves_early_meets_no_traceback():
    command = f"{sys.executable} -m squeal simulate {B1} --json | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert done.stdout == "{\n"
    assert done.stderr == ""


WILD = {"m": 1, "w": 1, "h": 0.2, "k1": 1, "k2": 1, "k3": 1, "k4": 1, "L1": 1, "L2": 1}
WILD |= {"alpha1": 2, "alpha2": 2, "mu": 0.2, "F_n": 0.01}


def wild(folder, **changes):
    """A scene with some numbers of wild size."""
    path = folder / "wild.yaml"
    numbers = ", ".join(f"{key}: {value}" for key, value in (WILD | changes).items())
    path.write_text(f"model: B1\nparameters: {{{numbers}}}\ntime: {{stop: 1, samples: 2}}\n")
    return path


@pytest.mark.parametrize("command", ["simulate", "eigenvalues", "sliding", "critical-friction"])
@pytest.mark.parametrize(
    "changes",
    [{"k1": 1e300, "k3": 1e300}, {"F_n": 1e300}, {"w": 1e300}, {"h": 1e150}, {"m": 1e-300}],
)
def test_numbers_beyond_double_precision_meet_no_traceback(capsys, tmp_path, command, changes):
    # motion with so small a mass would take for ever
    changes = {"m": 1e300} if command == "simulate" and "m" in changes else changes
    code, out, err = run(capsys, command, wild(tmp_path, **changes), "--json")
    assert code in (0, 1, 2)
    assert all(line.startswith("squeal: ") for line in err.splitlines())
    assert (code == 0) == (out != "")
    if code == 0:
        json.loads(out, parse_constant=pytest.fail)
    else:
        assert err


def fresh(*arguments, **more):
    return subprocess.run(
        [sys.executable, "-m", "squeal", *map(str, arguments)], text=True, check=False, **more
    )


def test_nothing_but_json_on_standard_output(tmp_path):
    # in this scene heyoka's search for roots complains, by default on standard output
    done = fresh("simulate", wild(tmp_path, m=1e20), "--json", capture_output=True)
    assert done.returncode == 0
    assert json.loads(done.stdout)["model"] == "B1"


def test_help_and_version_of_the_module():
    for arguments in (["-h"], ["--help"]):
        done = fresh(*arguments, capture_output=True)
        assert (done.returncode, done.stderr) == (0, "")
        assert all(command in done.stdout for command in COMMANDS)
    assert fresh("--version", capture_output=True).stdout.startswith("squeal ")
    done = fresh(capture_output=True)
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
@pytest.mark.parametrize(
    "arguments",
    [("sliding", B3, "--json"), ("sliding", B3), ("--help",), ("--version",), ("map", "--help")],
)
def test_a_full_disc_is_exit_code_1(arguments):
    with open("/dev/full", "w") as full:
        done = fresh(*arguments, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 1
    assert done.stderr == "squeal: output: No space left on device\n"


@pytest.mark.skipif(os.name == "nt", reason="limits of POSIX")
@pytest.mark.parametrize("name", ["motion.png", "motion.csv", "roots.svg", "roots.json", "folder"])
def test_a_file_that_cannot_grow_is_refused_and_nothing_of_it_left(tmp_path, name):
    target = tmp_path / "out" / name
    target.parent.mkdir()
    system = tmp_path / "s.yaml"
    numbers = "[[3, -1, 0], [-1, 3, -1], [0, -1, 3]]"
    system.write_text(f"M: {numbers}\nK: {numbers}\n")
    if name.startswith("motion"):
        words = f"simulate {B1} --set stop=1e-3 --{target.suffix[1:]}"
    elif name == "folder":
        target.mkdir()
        words = f"export {system} --output"
    else:
        words = f"eigenvalues {system} --{'svg' if 'svg' in name else 'csv'}"
    command = f"{sys.executable} -m squeal {words} {target}"
    done = subprocess.run(
        f"ulimit -f 0; exec {command}", shell=True, capture_output=True, text=True
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith(f"squeal: {target}")
    assert done.stderr.endswith("cannot be written: File too large\n")
    assert done.stderr.count("\n") == 1
    assert [path.name for path in target.parent.rglob("*")] == ["folder"] * (name == "folder")


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    target = tmp_path / "h.csv"
    target.write_text("before\n")

    def rows():
        yield (1.0, 2.0)
        raise ComputationError("half way")

    with pytest.raises(ComputationError):
        write_csv(target, ["a", "b"], rows())
    assert target.read_text() == "before\n"
    assert os.listdir(tmp_path) == ["h.csv"]
    write_csv(target, ["a", "b"], [(0.1, math.nan), (None, "PC")])
    assert target.read_text() == "a,b\n0.1,\n,PC\n"


# Where a command reads its scene from, and --set

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
