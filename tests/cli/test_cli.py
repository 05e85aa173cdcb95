"""The command line as a user meets it: exit codes, JSON, refusals, and nothing loaded in vain."""

import csv
import json
import subprocess
import sys

import pytest

from squeal.cli.main import COMMANDS, main
from squeal.io.provenance import ROOT
from squeal.io.writing import column_name
from tests.cli.calls import answer, assert_refused
from tests.conftest import SCENES

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
    assert {"real", "imag", "frequency_hz", "damping_ratio", "residual"} <= set(
        found["eigenvalues"][0]
    )
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
    for source in (B1, DRUM):
        found = answer(capsys, "eigenvalues", source, "--mu", "0:1:5", "--csv", table)
        last = found["sweep"][-1]["eigenvalues"][-1]
        row = rows_of(table)[-1]
        assert row["verdict"] == found["sweep"][-1]["verdict"]
        assert float(row["imag"]) == last["imag"]
        found = answer(capsys, "critical-friction", source, *(files if source == B1 else files[:2]))
        assert [float(r["mu"]) for r in rows_of(table)] == [p["mu"] for p in found["critical"]]
    found = answer(capsys, "sliding", B2, "--csv", table)
    assert [r["verdict"] for r in rows_of(table)] == [e["verdict"] for e in found["equilibria"]]


def test_sensitivities(capsys):
    found = answer(capsys, "eigenvalues", B1, "--sensitivity")
    by = {row["parameter"]: row["eigenvalues"] for row in found["sensitivity"]}
    assert {"m", "I", "k1", "k4", "alpha2", "mu", "F_n"} <= by.keys()
    assert all(len(slopes) == 6 for slopes in by.values())
    found = answer(capsys, "critical-friction", B1, "--sensitivity")
    assert found["sensitivity"] is None


def test_no_steady_sliding_is_exit_code_1_with_the_reason(capsys, tmp_path):
    # without springs nothing balances the friction force
    scene = tmp_path / "free.yaml"
    scene.write_text(
        "model: B1\nparameters: {m: 1, w: 1, h: 0.2, k1: 0, k2: 0, k3: 1, k4: 1, L1: 1, L2: 1,"
        " alpha1: pi/2, alpha2: pi/2, mu: 0.5, F_n: 0.01}\n"
    )
    err = assert_refused(capsys, "eigenvalues", scene, code=1)
    assert "no steady sliding exists" in err


def modules_after(*commands):
    """Names of the modules that a process has loaded after each of these commands, in turn."""
    code = (
        "import json, sys; from squeal.cli.main import main\n"
        "for words in json.loads(sys.argv[1]):\n"
        "    main(words); print(' '.join(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, json.dumps(commands)],
        capture_output=True,
        text=True,
        check=True,
    )
    return [set(line.split()) for line in done.stderr.splitlines()]


def test_queries_load_neither_integrators_nor_plots(pad):
    # a pad that flutters and its onset first, and what costs a tenth of a second to load has no
    # place in a query of a third
    commands = [[name, str(pad)] for name in ("eigenvalues", "critical-friction")]
    lean = {"squeal.io.system", "squeal.sparse.argument_principle"}
    commands += [[name, B3] for name in ("eigenvalues", "sliding", "critical-friction", "advise")]
    commands.append(["map", B3, "--n", "5"])
    heavy = {"heyoka", "scipy", "matplotlib", "control", "squeal.simulation.run"}
    after = zip(commands, modules_after(*commands), strict=True)
    refused = [heavy | lean] * 2 + [heavy] * 5
    found = {
        " ".join(words): loaded & no for (words, loaded), no in zip(after, refused, strict=True)
    }
    assert not any(found.values()), found


def test_a_minus_sign_by_itself_is_one(capsys, tmp_path):
    scene = tmp_path / "minus.yaml"
    text = (SCENES / "b2-c.yaml").read_text()
    scene.write_text(text)
    by_set = answer(capsys, "eigenvalues", scene, "--set", "formulation.delta_moment=-")
    quoted = answer(capsys, "eigenvalues", scene, "--set", "formulation.delta_moment='-'")
    assert by_set["eigenvalues"] == quoted["eigenvalues"]
    told = assert_refused(capsys, "eigenvalues", scene, "--set", "formulation.line_force=-")
    assert "it must be one of" in told
