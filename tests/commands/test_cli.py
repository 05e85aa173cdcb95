"""The command line as a user meets it: exit codes, JSON, refusals, and nothing loaded in vain."""

import csv
import json
import math
import os
import subprocess
import sys

import pytest

from squeal.commands.cli import COMMANDS, main
from squeal.errors import ComputationError
from squeal.files.sources import ROOT
from squeal.files.writing import column_name, write_csv
from tests.commands.calls import answer, assert_refused, run
from tests.conftest import SCENES, needs_heyoka

B1, B2, B3 = (str(SCENES / f"{stem}.yaml") for stem in ("b1-c", "b2-c", "b3"))

DRUM = str(ROOT / "article" / "literature" / "systems" / "drum_brake.yaml")


@pytest.mark.parametrize(
    ("arguments", "keys"),
    [
        (("simulate", B1), {"model", "final", "events", "shares", "extrema", "sliding_holds"}),
        (("eigenvalues", B2), {"equilibrium", "M", "C", "K", "eigenvalues", "verdict"}),
        (("critical-friction", B2), {"critical"}),
        (
            ("sliding", B2),
            {"K", "determinant", "rank", "printed_K33_singular", "bound_23a", "bound_23b"}
            | {"holds_as_printed", "holds_sign_aware", "equilibria"},
        ),
        (("map", B3, "--n", "20"), {"share"}),
        (("claims",), {"claims"}),
    ],
)
def test_json_has_the_promised_keys(capsys, arguments, keys):
    assert keys <= answer(capsys, *arguments).keys()


def test_inner_keys_of_the_answers(capsys):
    found = answer(capsys, "simulate", B2)
    assert list(found["final"]) == ["t", "x", "y", "theta", "x_dot", "y_dot", "theta_dot"]
    assert set(found["shares"]) == {"SS", "PC", "FC"}
    assert set(found["extrema"]) == {"Rn", "delta"}
    assert set(found["events"][0]) == {"t", "from", "to"}
    found = answer(capsys, "eigenvalues", B1, "--mu", "0:1:5")
    assert len(found["eigenvalues"]) == 6
    assert set(found["eigenvalues"][0]) == {"real", "imag", "frequency_hz", "damping_ratio"}
    assert set(found["equilibrium"]) == {"x", "y", "theta", "R_n", "contact"}
    assert [row["mu"] for row in found["sweep"]] == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    found = answer(capsys, "sliding", B3)
    assert "equilibria" not in found
    found = answer(capsys, "claims")
    assert len(found["claims"]) == 33
    assert {"id", "verdict", "measured", "where"} <= found["claims"][0].keys()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(capsys, command):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"usage: squeal {command}" in capsys.readouterr().out


@pytest.mark.parametrize(
    "command", sorted(set(COMMANDS) - {"identify", "cite", "take", "export", "terms"})
)
def test_every_query_prints_a_table(capsys, command):
    scene = (
        [] if command in ("claims", "findings") else [B3 if command in ("map", "advise") else B2]
    )
    extra = ["--n", "10"] if command == "map" else []
    code, out, err = run(capsys, command, *scene, *extra)
    assert code == 0
    assert all(line.startswith("squeal: warning: ") for line in err.splitlines())
    assert out.strip()


def test_csv_history(capsys, tmp_path):
    target = tmp_path / "h.csv"
    assert run(capsys, "simulate", B1, "--csv", target)[0] == 0
    with target.open() as stream:
        rows = list(csv.DictReader(stream))
    assert ",".join(rows[0]) == (
        "t [s],x [m],y [m],theta [rad],x_dot [m/s],y_dot [m/s],theta_dot [rad/s],"
        "state,F3 [F_n],F4 [F_n]"
    )
    assert len(rows) == 4001
    assert {row["state"] for row in rows} <= {"1", "2", "3", "4"}
    assert sorted(os.listdir(tmp_path)) == ["h.csv"]


def test_map_files(capsys, tmp_path):
    cells, drawing = tmp_path / "m.csv", tmp_path / "m.pdf"
    found = answer(capsys, "map", B3, "--n", "12", "--csv", cells, "--pdf", drawing)
    rows = cells.read_text().splitlines()
    assert rows[0] == "alpha1 [rad],alpha2 [rad],verdict"
    counted = sum(row.endswith("marginal") for row in rows) / (len(rows) - 1)
    assert counted == pytest.approx(found["share"]["marginal"])
    assert drawing.read_bytes().startswith(b"%PDF")


def rows_of(path):
    with path.open() as stream:
        rows = list(csv.DictReader(stream))
    return [{column_name(head): value for head, value in row.items()} for row in rows]


def test_files_of_the_stability_queries(capsys, tmp_path):
    table, drawing = tmp_path / "t.csv", tmp_path / "t.pdf"
    files = ("--csv", table, "--pdf", drawing)
    found = answer(capsys, "eigenvalues", B2, *files)
    assert [float(r["imag"]) for r in rows_of(table)] == [e["imag"] for e in found["eigenvalues"]]
    assert drawing.read_bytes().startswith(b"%PDF")
    # the article's linearisation stands beside that about the equilibrium
    assert set(found["origin"]) == {"K", "eigenvalues", "verdict"}
    assert found["origin"]["K"] != found["K"]
    for source in (B1, DRUM):
        found = answer(capsys, "eigenvalues", source, "--mu", "0:1:5", *files)
        last = found["sweep"][-1]["eigenvalues"][-1]
        row = rows_of(table)[-1]
        assert row["verdict"] == found["sweep"][-1]["verdict"]
        assert float(row[f"imag_{len(found['eigenvalues'])}"]) == last["imag"]
        found = answer(capsys, "critical-friction", source, *files)
        assert [float(r["mu"]) for r in rows_of(table)] == [p["mu"] for p in found["critical"]]
    found = answer(capsys, "sliding", B2, "--csv", table)
    assert [r["verdict"] for r in rows_of(table)] == [e["verdict"] for e in found["equilibria"]]


def test_sensitivities(capsys):
    found = answer(capsys, "eigenvalues", B1, "--sensitivity")
    by = {row["parameter"]: row["eigenvalues"] for row in found["sensitivity"]}
    assert {"m", "I", "k1", "k4", "alpha2", "mu", "F_n"} <= by.keys()
    assert all(len(slopes) == 6 for slopes in by.values())
    code, out, _ = run(capsys, "eigenvalues", B1, "--sensitivity")
    assert code == 0
    assert "alpha1     1 degree" in out
    found = answer(capsys, "critical-friction", B1, "--sensitivity")
    assert found["sensitivity"] is None
    assert "nothing moves" in run(capsys, "critical-friction", B1, "--sensitivity")[1]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["nothing"], "'nothing' is no command"),
        (["simulate"], "SCENE.yaml"),
        (["simulate", "none.yaml"], "none.yaml"),
        (["simulate", B3], "B3 is not allowed"),
        (["simulate", B1, "--fast"], "--fast"),
        (["simulate", B1, "--integrator", "euler"], "euler"),
        (["simulate", B1, "--csv", "none/h.csv"], "none"),
        (["eigenvalues", B1, "--mu", "1:0:5"], "--mu 1:0:5"),
        (["eigenvalues", B1, "--mu", "0:1"], "A:B:N"),
        (["eigenvalues", B1, "--at", "0.3"], "--at 0.3"),
        (["critical-friction", B1, "--mu-max", "nan"], "--mu-max nan"),
        (["critical-friction", DRUM, "--sensitivity"], "--sensitivity"),
        (["eigenvalues", DRUM, "--sensitivity"], "--sensitivity"),
        (["eigenvalues", B1, "--pdf", "none/e.pdf"], "none"),
        (["sliding", B3, "--csv", "e.csv"], "B3"),
        (["map", B3, "--n", "1"], "--n 1"),
        (["map", B3, "--first", "alpha2:0:1"], "alpha2"),
        (["map", B3, "--first", "L1:0:1"], "L1:0:1"),
        (["map", B3, "--second", "mu:1:0"], "mu:1:0"),
        (["claims", "--scenes", "none"], "none"),
        (["identify", "--seed", "x"], "--seed x"),
        (["identify", "--scenes", "none"], "--scenes none"),
    ],
)
def test_refusals_are_one_sentence_and_exit_code_2(capsys, tmp_path, monkeypatch, arguments, part):
    monkeypatch.chdir(tmp_path)
    err = assert_refused(capsys, *arguments)
    assert part in err
    assert os.listdir(tmp_path) == []


def test_no_steady_sliding_is_exit_code_1_with_the_reason(capsys, tmp_path):
    # without springs nothing balances the friction force
    scene = tmp_path / "free.yaml"
    scene.write_text(
        "model: B1\nparameters: {m: 1, w: 1, h: 0.2, k1: 0, k2: 0, k3: 1, k4: 1, L1: 1, L2: 1,"
        " alpha1: pi/2, alpha2: pi/2, mu: 0.5, F_n: 0.01}\n"
    )
    err = assert_refused(capsys, "eigenvalues", scene, code=1)
    assert "no steady sliding exists" in err


def modules_after(*arguments):
    """Names of the modules that a command has loaded when it is done."""
    code = (
        "import sys; from squeal.commands.cli import main; main(sys.argv[1:]);"
        "print(' '.join(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )
    return set(done.stderr.split())


@pytest.mark.parametrize(
    "command", ["eigenvalues", "sliding", "critical-friction", "advise", "map"]
)
def test_queries_load_neither_integrators_nor_plots(command):
    loaded = modules_after(command, B3, *(["--n", "5"] if command == "map" else []))
    assert not loaded & {"heyoka", "scipy", "matplotlib", "control", "squeal.simulation.run"}


def test_a_fluttering_pad_and_its_onset_load_no_more(pad):
    # what costs a tenth of a second to load has no place in a query of a third
    for command in ("eigenvalues", "critical-friction"):
        loaded = modules_after(command, str(pad))
        assert not loaded & {"heyoka", "scipy", "matplotlib", "control", "numpy.ma"}
        assert not loaded & {"squeal.scene.terms", "squeal.stability.sparse.region"}


@needs_heyoka
def test_a_simulation_loads_no_plots_and_no_second_integrator():
    loaded = modules_after("simulate", B1)
    assert "heyoka" in loaded
    assert not loaded & {"matplotlib", "control", "scipy.integrate", "squeal.equilibrium"}


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


def test_help_into_a_closed_pipe():
    read, write = os.pipe()
    os.close(read)
    done = fresh("--help", stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


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


def test_streams_may_be_closed(tmp_path):
    system = tmp_path / "s.yaml"
    system.write_text("M: [[1]]\nC0: [[0.1]]\nK0: [[1]]\n")
    call = f"exec {sys.executable} -m squeal eigenvalues"

    def shell(words):
        return subprocess.run(f"{call} {words}", shell=True, capture_output=True, text=True)

    done = shell("- <&-")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "squeal: standard input: is closed; a file or a pipe is allowed\n"
    done = shell(f"{system} --band 0:9 --set parameter=W --sweep 0:1:3 --json 2>&-")  # and it warns
    assert done.returncode == 0
    assert json.loads(done.stdout)["verdict"] == "stable"
    done = shell(f"{system} >&-")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("encoding", ["ascii", "utf-8"])
def test_letters_that_the_output_lacks_are_escaped(tmp_path, encoding):
    system, table = tmp_path / "böse.yaml", tmp_path / "größe.csv"
    system.write_text("name: größe\nM: [[1]]\nK0: [[1]]\n", encoding="utf-8")
    surroundings = {**os.environ, "PYTHONIOENCODING": encoding, "LC_ALL": "C", "PYTHONUTF8": "0"}
    options = ("--png", tmp_path / "x.png", "--csv", table)
    done = fresh("eigenvalues", system, *options, env=surroundings, capture_output=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("gr\\xf6\\xdfe" if encoding == "ascii" else "größe")
    assert table.read_text().startswith("real")
    picture = (tmp_path / "x.png").read_bytes()
    assert "böse.yaml".encode("latin-1") in picture


@pytest.mark.skipif(sys.platform == "darwin", reason="names of files are UTF-8 there")
def test_a_file_may_have_a_name_that_is_no_text(tmp_path):
    path = os.fsencode(tmp_path) + b"/b\xf6se.yaml"
    with open(path, "wb") as file:
        file.write(b"M: [[1]]\nK0: [[1]]\n")
    done = fresh("eigenvalues", os.fsdecode(path), capture_output=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("b\\xf6se, mu = 0")


def test_only_plain_files_are_written(capsys, tmp_path):
    # a device or pipe would be replaced by the finished file
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for target in (pipe, tmp_path):
        err = assert_refused(capsys, "simulate", B1, "--csv", target)
        assert str(target) in err
    assert pipe.is_fifo()


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


def test_a_refused_simulation_writes_nothing(capsys, tmp_path):
    # the pad turns over: no history of half a run
    target, scene = tmp_path / "h.csv", wild(tmp_path, k1=0, k2=0, F_n=0.01)
    scene.write_text(scene.read_text() + "initial: {y: 5, theta_dot: 10}\n")
    err = assert_refused(capsys, "simulate", scene, "--csv", target, code=1)
    assert "past 90 degrees at t = 0.157" in err
    assert not target.exists()


def test_a_minus_sign_by_itself_is_one(capsys, tmp_path):
    scene = tmp_path / "minus.yaml"
    text = (SCENES / "b2-c.yaml").read_text()
    scene.write_text(text)
    by_set = answer(capsys, "eigenvalues", scene, "--set", "formulation.delta_moment=-")
    quoted = answer(capsys, "eigenvalues", scene, "--set", "formulation.delta_moment='-'")
    assert by_set["eigenvalues"] == quoted["eigenvalues"]
    told = assert_refused(capsys, "eigenvalues", scene, "--set", "formulation.line_force=-")
    assert "it must be one of" in told


def test_stopped_while_modules_load(capsys, monkeypatch):
    def interrupted(name):
        raise KeyboardInterrupt

    monkeypatch.setattr("squeal.commands.cli.command", interrupted)
    assert run(capsys, "eigenvalues", "pad.yaml") == (130, "", "squeal: stopped\n")


def test_beyond_double_precision_is_no_verdict(capsys):
    code, out, err = run(capsys, "eigenvalues", SCENES / "b3.yaml", "--set", "I=1e-300")
    assert (code, out) == (1, "")
    assert "beyond double precision" in err.splitlines()[-1]
