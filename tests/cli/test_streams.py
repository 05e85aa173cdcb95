"""Streams and files of the commands: pipes, full discs, names, and nothing half written."""

import hashlib
import io
import itertools
import json
import math
import os
import re
import shlex
import subprocess
import sys

import pytest

from squeal.cli import streams
from squeal.cli.main import COMMANDS
from squeal.io.provenance import ROOT
from tests.cli import calls
from tests.cli.calls import B1, B2, B3, answer, run
from tests.conftest import needs_heyoka

DRUM = ROOT / "article" / "literature" / "systems" / "drum_brake.yaml"
WILD = "m: 1, w: 1, h: 0.2, k1: 1, k2: 1, k3: 1, k4: 1, L1: 1, L2: 1, alpha1: 2, alpha2: 2"


@pytest.fixture
def wild(tmp_path):
    path = tmp_path / "wild.yaml"
    numbers = f"{{{WILD}, mu: 0.2, F_n: 0.01}}"
    path.write_text(f"model: B1\nparameters: {numbers}\ntime: {{stop: 1, samples: 2}}\n")
    return path


@pytest.mark.parametrize("command", ["simulate", "eigenvalues", "sliding", "critical-friction"])
@pytest.mark.parametrize("change", ["k1=1e300", "F_n=1e300", "w=1e300", "h=1e150", "m=1e-300"])
def test_numbers_beyond_double_precision_meet_no_traceback(capsys, wild, command, change):
    # motion with so small a mass would take for ever
    change = "m=1e300" if command == "simulate" and change == "m=1e-300" else change
    code, out, err = run(capsys, command, wild, "--set", change, "--json")
    assert code in (0, 1, 2)
    assert all(line.startswith("squeal: ") for line in err.splitlines())
    assert (code == 0) == bool(out)
    assert out or err
    json.loads(out or "0", parse_constant=pytest.fail)


def fresh(words, **more):
    """A shell's command in which SQUEAL stands for the program."""
    command = words.replace("SQUEAL", f"{shlex.quote(sys.executable)} -m squeal")
    command = command.replace(f" {ROOT.parent}", f" {shlex.quote(str(ROOT.parent))}")
    more = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | more
    return subprocess.run(command, shell=True, text=True, check=False, **more)


def test_standard_output_holds_what_was_asked_for_and_nothing_else(wild):
    for words in ("-h", "--help"):
        done = fresh(f"SQUEAL {words}")
        assert (done.returncode, done.stderr) == (0, "")
        assert all(command in done.stdout for command in COMMANDS)
    # in this scene heyoka's search for roots complains, by default on standard output
    done = fresh(f"SQUEAL simulate {shlex.quote(str(wild))} --set m=1e20 --json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["model"] == "B1"
    for words, code, out, err in (
        ("SQUEAL --version", 0, "squeal .+\n", ""),
        ("SQUEAL", 2, "", ".+"),
        # a reader who leaves early; a pipe is read once
        (f"SQUEAL simulate {B1} --json | head -n 1", 0, "{\n", ""),
        (f"cat {B3} | SQUEAL eigenvalues /dev/stdin", 0, ".+", ""),
        # closed streams: an input is empty, an output cannot be written, and nobody hears a word
        ("SQUEAL eigenvalues - <&-", 2, "", "squeal: standard input: .+"),
        (f"SQUEAL eigenvalues {B3} >&-", 1, "", "[^\n]*\n"),
        ("SQUEAL nothing 2>&-", 2, "", ""),
    ):
        done = fresh(words)
        assert done.returncode == code, words
        assert re.fullmatch(out, done.stdout, re.DOTALL), words
        assert re.fullmatch(err, done.stderr, re.DOTALL), words


@needs_heyoka
@pytest.mark.parametrize("module", ["equilibrium.compiled", "simulation.taylor"])
def test_a_home_that_cannot_be_written_adds_nothing_to_standard_output(module):
    """Heyoka has no place for what it compiled."""
    code = f"import squeal.{module}, heyoka as hy; x = hy.make_vars('x'); hy.cfunc([x + 1.0], [x])"
    home = {"HOME": os.devnull, "XDG_CACHE_HOME": os.devnull}
    done = fresh(f'{shlex.quote(sys.executable)} -c "{code}"', env=os.environ | home)
    assert (done.returncode, done.stdout) == (0, "")


def test_long_work_says_a_line_now_and_then_where_nobody_sees_a_terminal(capsys, monkeypatch):
    """A clock that adds a second at each look: 40 steps are 80 s of silence without these lines."""
    monkeypatch.setattr(streams, "SILENCE", 10.0)
    clock = itertools.count()
    monkeypatch.setattr("time.monotonic", lambda: float(next(clock)))
    tell = streams.steps()
    show = streams.counter("samples")
    for step in range(40):
        tell(f"step {step}")
    lines = capsys.readouterr().err.splitlines()
    assert 3 <= len(lines) <= 5
    assert all(re.fullmatch(r"squeal: step \d+", line) for line in lines)
    for done in range(1, 41):
        show(done, 40)
    lines = capsys.readouterr().err.splitlines()
    assert 3 <= len(lines) <= 13
    assert all(re.fullmatch(r"squeal: \d+ of 40 samples, about .* remain", line) for line in lines)


class Terminal(io.TextIOWrapper):
    """What says that it is a terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("xterm", "\r\033[Ka step\n\033[1;32mStable\033[0m\n"), ("dumb", "a step\nStable\n")],
)
def test_a_terminal_that_obeys_no_escape_sequences_gets_none(monkeypatch, kind, expected):
    monkeypatch.setenv("TERM", kind)
    monkeypatch.delenv("NO_COLOR", raising=False)
    written = io.BytesIO()
    terminal = Terminal(written, newline="\n")
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys, "stdout", terminal)
    streams.say("a step")
    streams.printed("Stable")
    assert written.getvalue().decode() == expected


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
def test_a_terminal_that_takes_no_progress_stops_nothing(monkeypatch):
    """As of a command whose shell has gone (`stty tostop`)."""
    monkeypatch.setenv("TERM", "xterm")
    with open("/dev/full", "wb", buffering=0) as device, Terminal(device) as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        show = streams.counter("samples")
        for done in range(3):
            show(done, 2)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
@pytest.mark.parametrize("words", [f"sliding {B3} --json", f"sliding {B3}", "--help", "map --help"])
def test_a_full_disc_is_exit_code_1(words):
    done = fresh(f"SQUEAL {words} > /dev/full")
    assert done.returncode == 1
    assert done.stderr == "squeal: output: No space left on device\n"


CANNOT_GROW = [
    *(f"simulate {B1} --set stop=1e-3 --{end} motion.{end}" for end in ("png", "csv")),
    *(f"eigenvalues {B1} --{given}" for given in ("svg roots.svg", "csv roots.json")),
    f"export {B1} --output folder",
]


@pytest.mark.skipif(os.name == "nt", reason="limits of POSIX")
@pytest.mark.parametrize("command", CANNOT_GROW)
def test_a_file_that_cannot_grow_is_refused_and_what_was_there_stays(
    capsys, monkeypatch, tmp_path, command
):
    import resource

    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "motion.csv").write_text("t,x\n")
    before, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, most))
    try:
        code, _, err = run(capsys, *calls.words(command))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (before, most))
    assert code == 2, err
    assert err.startswith(f"squeal: {calls.words(command)[-1]}")
    assert err.endswith("cannot be written: File too large\n")
    assert err.count("\n") == 1
    assert {path.name for path in tmp_path.rglob("*")} == {"folder", "motion.csv"}
    assert (tmp_path / "motion.csv").read_text() == "t,x\n"


# Where a command reads its scene from, and --set


@pytest.mark.parametrize(
    "words", [("simulate", B1), ("critical-friction", DRUM), ("sliding", B2), ("map", B3, "--n=3")]
)
def test_a_dash_reads_standard_input(capsys, monkeypatch, words):
    name, path, *more = words
    content = path.read_bytes()
    expected = answer(capsys, name, path, *more)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
    found = answer(capsys, name, "-", *more)
    (made,) = found["provenance"]["inputs"]
    assert made == {"name": "standard input", "sha256": hashlib.sha256(content).hexdigest()}
    assert expected["provenance"]["inputs"][0]["name"] == path.name
    for key in ("name", "provenance"):
        assert found.pop(key, None) is None or expected.pop(key)
    assert found == expected


def test_set_answers_as_the_edited_file_does(capsys, tmp_path):
    edited = tmp_path / "b2-c.yaml"
    lines = B2.read_text().splitlines()
    edited.write_text("\n".join("  mu: 0.3" if "  mu:" in line else line for line in lines))
    expected = answer(capsys, "eigenvalues", edited)
    for name in ("mu", "parameters.mu"):
        found = answer(capsys, "eigenvalues", B2, "--set", f"{name}=0.3")
        assert found.pop("set") == {"parameters.mu": 0.3}
        assert found == expected | {"provenance": found["provenance"]}


@pytest.mark.parametrize("command", ["eigenvalues", "thresholds", "check"])
@pytest.mark.parametrize("name", ["mu", "spare", "frequency"])
def test_null_leaves_a_parameter_of_a_system_out(capsys, tmp_path, command, name):
    """One that matrices depend on, one that none depends on, and one that the file lacks."""
    system = tmp_path / "system.yaml"
    parameters = {"mu": 0.2, "spare": 3.0}
    matrices = "M: [[1, 0], [0, 1]]\nK0: [[2, 0], [0, 3]]\nK1: [[0, 1], [-1, 0]]\n"
    system.write_text(f"parameters: {parameters}\n{matrices}")
    _, out, _ = run(capsys, command, system, "--set", f"{name}=null", "--json")
    found = json.loads(out)
    assert found.pop("set") == {f"parameters.{name}": None}
    parameters.pop(name, None)
    system.write_text(f"parameters: {parameters}\n{matrices}")
    _, out, _ = run(capsys, command, system, "--json")
    expected = json.loads(out)
    for key in ("provenance", "costs"):
        found.pop(key, None)
        expected.pop(key, None)
    assert found == expected


def test_set_takes_everything_that_a_file_may_say(capsys):
    changes = {"time.stop": 1e-4, "time.samples": 5, "outputs": ["shares"], "initial.x_dot": 0.1}
    changes["formulation.line_force"] = "mean"
    given = (f"--set={key.rpartition('.')[2]}={value}" for key, value in changes.items())
    found = answer(capsys, "simulate", B2, *given)
    assert found["final"]["t"] == pytest.approx(1e-4)
    assert "events" not in found
    assert found["set"] == changes
    turned = answer(capsys, "eigenvalues", B3, "--set", "alpha1=pi/2")
    as_number = answer(capsys, "eigenvalues", B3, "--set", f"alpha1={math.pi / 2!r}")
    assert turned["eigenvalues"] == as_number["eigenvalues"]
    system = answer(capsys, "critical-friction", DRUM, "--set", "K1=[[0, -1e5], [2e5, 0]]")
    assert system["critical"] != answer(capsys, "critical-friction", DRUM)["critical"]


COMMAND = """
from squeal.cli.main import main
main(["--version"])
import numpy
print(threads())
"""
VERB = """
import scipy.linalg
from squeal.schema import public
print(public(threads)())
"""


@pytest.mark.parametrize("script", [COMMAND, VERB], ids=["command", "verb"])
def test_a_command_and_a_verb_compute_with_one_thread_of_blas(script):
    threads = """
def threads():
    from threadpoolctl import threadpool_info
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}
"""
    environment = {key: value for key, value in os.environ.items() if "_NUM_THREADS" not in key}
    words = [sys.executable, "-c", threads + script]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "{1}"
