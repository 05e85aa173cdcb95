"""What is refused: exit code 2, one line that names option, file or key, and nothing written."""

import os

import pytest

from squeal.io.provenance import ROOT as PACKAGE
from tests.cli.calls import assert_refused, run
from tests.conftest import SCENES

B1, B2, B3 = (str(SCENES / f"{stem}.yaml") for stem in ("b1-c", "b2-c", "b3"))
DRUM = str(PACKAGE / "article" / "literature" / "systems" / "drum_brake.yaml")
PAIR = """\
parameters: {mu: 0.2, gap: 0.5}
M: [[1, 0], [0, 1]]
K: [{matrix: [[2, 0], [0, 2]]}, {matrix: [[1, 0], [0, -1]], factor: gap},
    {matrix: [[0, 1], [-1, 0]], factor: mu}]
"""
FILES = {
    "pair.yaml": PAIR,
    "plain.yaml": "M: [[1]]\nK0: [[1]]\nK1: [[1]]\n",
    "spreads.yaml": "spreads: {gap: {absolute: 0.1}}\n",
    "few.yaml": "samples: 5\nspreads: {gap: {absolute: 1}}\n",
    "none-spread.yaml": "spreads: {}\n",
    "zero.yaml": "spreads: {gap: {absolute: 0}}\n",
    "both.yaml": "spreads: {gap: {absolute: 1, within: 1}}\n",
    "unknown.yaml": "spreads: {k9: {absolute: 1}}\n",
    "free.yaml": "spreads: {mu: {absolute: 1}}\n",
    "angle.yaml": "spreads: {alpha1: {relative: 0.1}}\n",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    os.symlink("loop.csv", "loop.csv")
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ("nothing", "nothing"),
        ("eigenvalue x.yaml", "eigenvalues"),
        ("simulate", "SCENE.yaml"),
        ("simulate none.yaml", "none.yaml"),
        (f"simulate {B3}", "B3"),
        (f"simulate {B1} --fast", "--fast"),
        (f"simulate {B1} --integrator euler", "euler"),
        (f"simulate {B1} --csv none/h.csv", "none"),
        ("simulate pair.yaml", "pair.yaml"),
        ("sliding pair.yaml", "pair.yaml"),
        (f"sliding {B3} --csv e.csv", "B3"),
        (f"eigenvalues {B1} --mu 1:0:5", "--mu 1:0:5"),
        (f"eigenvalues {B1} --sweep -1:1:3", "--sweep -1:1:3"),
        (f"eigenvalues {B1} --mu 0:1", "A:B:N"),
        (f"eigenvalues {B1} --at 0.3", "--at 0.3"),
        (f"eigenvalues {B1} --modes 3", "--modes 3"),
        (f"eigenvalues {B1} --band 1:0", "--band 1:0"),
        (f"eigenvalues {B1} --band=-1:2", "--band -1:2"),
        (f"eigenvalues {B1} --band 0:inf", "--band 0:inf"),
        (f"eigenvalues {B1} --memory -3", "--memory -3"),
        (f"eigenvalues {B1} --pdf none/e.pdf", "none"),
        (f"eigenvalues {B1} --csv a.csv --table b.csv", "--csv a.csv"),
        (f"eigenvalues {B1} --pdf a.pdf --png b.png", "--pdf a.pdf"),
        (f"eigenvalues {B1} --mu 0:1:3 --sweep 0:1:5", "--mu 0:1:3"),
        ("eigenvalues pair.yaml --band 400:200", "--band 400:200"),
        ("eigenvalues pair.yaml --modes 0", "--modes 0"),
        ("eigenvalues pair.yaml --region 1:0:0:1", "--region 1:0:0:1"),
        ("eigenvalues pair.yaml --method best", "best"),
        ("eigenvalues pair.yaml --band 1:2 --region 0:1:0:1", "band"),
        ("eigenvalues pair.yaml --sweep 1:0:5", "--sweep 1:0:5"),
        ("eigenvalues pair.yaml --set nu=1", "--set nu=1"),
        ("eigenvalues pair.yaml --set mu=1 --at 2", "--at 2"),
        ("eigenvalues pair.yaml --memory 0", "--memory 0"),
        ("eigenvalues pair.yaml --shape 1 --png s.png", "--shape 1"),
        ("eigenvalues plain.yaml --set nu=0.9", "--set nu=0.9"),
        (f"critical-friction {B1} --mu-max nan", "--mu-max nan"),
        (f"critical-friction {B1} --max 5e3", "--max 5e3"),
        (f"critical-friction {B1} --max 1 --mu-max 0.1", "--max 1"),
        (f"critical-friction {B1} --min 1", "--min 1"),
        (f"critical-friction {DRUM} --sensitivity", "--sensitivity"),
        ("critical-friction pair.yaml --max 1 --min 2", "--max 1"),
        (f"critical-friction {B1} --workers 2", "--workers 2"),
        ("critical-friction pair.yaml --scatter none.yaml", "none.yaml"),
        ("critical-friction pair.yaml --scatter spreads.yaml --workers 0", "--workers 0"),
        ("critical-friction pair.yaml --scatter spreads.yaml --sensitivity", "--sensitivity"),
        ("critical-friction pair.yaml --scatter few.yaml", "few.yaml: samples"),
        ("critical-friction pair.yaml --scatter none-spread.yaml", "none-spread.yaml: spreads"),
        ("critical-friction pair.yaml --scatter zero.yaml", "zero.yaml: spreads.gap"),
        ("critical-friction pair.yaml --scatter both.yaml", "both.yaml: spreads.gap"),
        ("critical-friction pair.yaml --scatter unknown.yaml", "unknown.yaml: spreads: k9"),
        ("critical-friction pair.yaml --scatter free.yaml", "free.yaml: spreads: mu"),
        (f"critical-friction {B1} --scatter angle.yaml", "angle.yaml: spreads: alpha1"),
        ("critical-friction pair.yaml --scatter s.json --csv s.json", "s.json"),
        (f"advise {B1} --tolerance k1", "tolerance k1"),
        (f"advise {B1} --tolerance k1=0", "tolerance k1=0"),
        (f"advise {B1} --tolerance k1=-5%", "tolerance k1=-5%"),
        (f"advise {B1} --tolerance K1=5%", "K1"),
        (f"advise {B1} --tolerance mu=5%", "mu"),
        (f"advise {B1} --tolerance alpha1=5%", "alpha1"),
        (f"advise {B1} --tolerance k1=5% --tolerance k1=6%", "--tolerance k1=6%"),
        (f"advise {B1} --mu-max 0", "--mu-max 0"),
        ("advise plain.yaml", "plain"),
        (f"map {B3} --n 1", "--n 1"),
        (f"map {B3} --first alpha2:0:1", "alpha2"),
        (f"map {B3} --first L1:0:1", "L1"),
        (f"map {B3} --second mu:1:0", "mu:1:0"),
        (f"map {B3} --first k1:0:1e10:log", "--first k1:0:1e10:log"),
        (f"map {B3} --first k1:1:1e10:lin", "--first k1:1:1e10:lin"),
        (f"map {B3} --quantity colour", "colour"),
        ("map plain.yaml --first mu:0:1 --second mu:0:1", "plain"),
        ("map pair.yaml --first mu:0:1", "alpha2"),
        ("map pair.yaml --first nu:0:1 --second gap:0:1", "nu"),
        ("map pair.yaml --first mu:1:0 --second gap:0:1", "mu:1:0"),
        ("map pair.yaml --first mu:0:1 --second mu:0:1", "mu"),
        ("map pair.yaml --quantity growth", "--quantity growth"),
        ("map pair.yaml --threshold-curve c.csv", "--threshold-curve c.csv"),
        (f"map {B3} --csv x.yaml", "--csv x.yaml"),
        (f"map {B3} --pdf x.jpg", "--pdf x.jpg"),
        (f"map {B3} --csv loop.csv", "--csv loop.csv"),
        ("export pair.yaml --output out --format doc", "doc"),
        ("export pair.yaml --output out --method reduced", "--method reduced"),
        ("export pair.yaml --output out --band 1:2", "--band 1:2"),
        ("export plain.yaml --output out --band 1:2", "--band 1:2"),
        (f"export {B1} --output out --band 1:2", "--band 1:2"),
        ("export pair.yaml --output pair.yaml", "--output pair.yaml: is no folder"),
        ("export pair.yaml --output pair.yaml/below", "below: cannot be written"),
        ("export pair.yaml --output .", "is not empty"),
        (f"simulate {B2} --set formulation.line_force=-", "it must be one of"),
        ("claims --scenes none", "none"),
        ("identify --seed x", "--seed x"),
        ("identify --scenes none", "--scenes none"),
        (f"simulate {B2} --set mu", "--set mu"),
        (f"simulate {B2} --set kc=1", "k_c"),
        (f"simulate {B2} --set mu=-1", "--set mu=-1"),
        (f"simulate {B2} --set mu=[", "--set mu=["),
        (f"simulate {B2} --set model=B4", "--set model=B4"),
        (f"simulate {B2} --set k3=5", "parameters.k3"),
        (f"simulate {B2} --set theta=1.6", "initial.theta"),
        (f"simulate {B2} --set time=1", "--set time=1"),
        (f"eigenvalues {B2} --set mu=0.3 --set mu=0.5", "--set mu=0.5"),
        (f"eigenvalues {B2} --set initial.x=1e-4 --set initial=equilibrium", "initial.x"),
    ],
)
def test_a_refusal_is_one_line(capsys, folder, arguments, part):
    assert part in assert_refused(capsys, *arguments.split())
    assert sorted(os.listdir()) == sorted([*FILES, "loop.csv"])


def test_too_little_memory_is_no_answer(capsys, folder, monkeypatch):
    monkeypatch.setattr("squeal.analysis.systems.roots.ALL_ROWS", 1)
    code, out, err = run(capsys, "eigenvalues", "pair.yaml", "--memory", "1e-7")
    assert (code, out, err.count("\n")) == (1, "", 1)


def test_control_characters_reach_no_terminal(capsys, folder):
    (folder / "name.yaml").write_text(PAIR + 'name: "a\\x1b[2Jb\\rc"\n')
    code, out, _ = run(capsys, "eigenvalues", "name.yaml")
    assert code == 0
    assert "\x1b" not in out
    assert "\r" not in out
    err = assert_refused(capsys, "eigenvalues", "pair.yaml", "--set", "a\x1b[2J=1")
    assert "\x1b" not in err


def test_degrees_are_asked_about(capsys):
    code, out, err = run(capsys, "eigenvalues", B3, "--set", "alpha1=90")
    assert (code, bool(out), err.count("\n")) == (0, True, 1)
    assert err.startswith("squeal: warning: ")
    for fine in ("6.28", "4*pi", "-pi"):
        assert run(capsys, "eigenvalues", B3, "--set", f"alpha1={fine}")[2] == ""
    assert "180" in run(capsys, "map", B3, "--n", "2", "--first", "alpha1:0:180")[2]
