"""What is refused: exit code 2, one line that names option, file or key, and nothing written."""

import json
import os
import shutil

import pytest

import squeal
from squeal.errors import InputError, InputWarning
from tests.cli.calls import assert_refused, run
from tests.conftest import SCENES

PAIR = """\
parameters: {mu: 0.2, gap: 0.5}
M: [[1, 0], [0, 1]]
K: [{matrix: [[2, 0], [0, 2]]}, {matrix: [[1, 0], [0, -1]], factor: gap},
    {matrix: [[0, 1], [-1, 0]], factor: mu}]
"""
FILES = {
    "pair.yaml": PAIR,
    "t.csv": "",
    "blank.mtx": "",
    "entries.txt": "1 1 1.05e+09\n2 2 1.0\n",
    "banner.mtx": "%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 2.0\n",
    "blank.yaml": "M: {file: blank.mtx}\nK: [[1]]\n",
    "plain.yaml": "M: [[1]]\nK0: [[1]]\nK1: [[1]]\n",
    "nested.json": 100_000 * "[",
    "comma.yaml": "M: [[1]]\nparameters: {mu: 0,4}\nK: [[1]]\n",
    "comma_of_pad.yaml": "model: B1\nparameters: {m: 0.2, k1: 2,0e7}\n",
    "nul.yaml": 'M: {file: "a\\0b"}\nK: [[1]]\n',
    "placed.yaml": PAIR + "coordinates: {file: nodes.csv}\n",
    "nodes.csv": "node,dof,x,y,z\n1,x,0,0,0\n2,x,1,0,0\n",
    "typed.yaml": "M: [[1]]\nK: [{matrix: [[1]]}, {matrix: [[1]], facter: mu}]\n",
    "misspelt.yaml": "parameters: {mdsic: 1}\nM: {matrix: [[1]], factor: mdisc}\nK: [[1]]\n",
    "joined.yaml": "parameters: {pressure: 1}\ncomponents: {a: {file: a.yaml}}\ncontact: []\n",
    "free.yaml": "spreads: {mu: {absolute: 1}}\n",
}
REFUSED = """\
nothing | nothing
article critical-friction b1.yaml | 'critical-friction' is no command; allowed are sliding, claims
eigenvalue x.yaml | eigenvalues
thresholds x.yaml --high 2 | did you mean --max? See squeal thresholds --help
thresholds x.yaml --mu_max 2 | did you mean --max? See squeal thresholds --help
map x.yaml --over 1 | unrecognized arguments: --over 1; see squeal map --help
simulate | SCENE.yaml
simulate none.yaml | none.yaml
simulate pipe.yaml | pipe.yaml: cannot be read (no plain file)
simulate /dev/zero | /dev/zero
cite pipe.yaml | pipe.yaml
cite nested.json | nested.json
simulate b3.yaml | B3
simulate b1.yaml --fast | --fast
eigenvalues b1.yaml --csv | argument --csv: expected one argument
thresholds b1.yaml --mu-max --json | argument --mu-max: expected one argument
critical-friction b1.yaml --mu-max 1e-300 | --mu-max 1e-300: 1e-300 is not allowed
map b1.yaml --first mu:0:1 --second mu:0:1 | --second mu:0:1: must name another parameter
map pair.yaml --first gap:0:1 --second gap:0:1 | --second gap:0:1: must name another parameter
example brake --rows 150 | --rows 150: is not allowed; it must be a whole number from 500
simulate b1.yaml --csv none/h.csv | none
sliding b3.yaml --csv e.csv | B3
eigenvalues b1.yaml --mu 1:0:5 | --mu 1:0:5
eigenvalues b1.yaml --sweep -1:1:3 | --sweep -1:1:3
eigenvalues b1.yaml --sweep k1=0:1:3 | of a pad values of mu
eigenvalues pair.yaml --sweep gap:0:1:3 | --set parameter=gap beside it makes gap the free parameter
eigenvalues pair.yaml --set gapp=1 | did you mean gap?
eigenvalues pair.yaml --set x=1 | allowed are parameters, mu, gap, omega, frequency, name
eigenvalues misspelt.yaml | none of the `parameters` of the same system; did you mean mdsic?
eigenvalues joined.yaml --set presure=2 | did you mean pressure?
eigenvalues joined.yaml --set kdisc=2 | one of a component's file by a parameter of its name here
map pair.yaml --first gapp:0:1 --second mu:0:1 | no matrix depends on it; did you mean gap?
conditions pair.yaml --axis gapp=0,1 | gapp is no parameter here; did you mean gap?
optimise pair.yaml --bounds gapp:0:1 | gapp is not allowed, no matrix depends on it
eigenvalues b1.yaml --set my=0.3 | unknown key; did you mean mu?
check blank.yaml | M.file: blank.mtx: no readable Matrix Market matrix: its first line is empty
eigenvalues b1.yaml --at 0 | --at 0
eigenvalues b1.yaml --band 1:2 | --band 1:2
eigenvalues b1.yaml --band 0:inf | --band 0:inf
eigenvalues pair.yaml --region 1:0:0:1 | --region 1:0:0:1
eigenvalues pair.yaml --method best | best
eigenvalues pair.yaml --set nu=1 | --set nu=1
eigenvalues pair.yaml --set mu=1 --at 2 | --at 2
eigenvalues pair.yaml --set gap=0,55 | 0.55
check entries.txt | it must be a mapping of keys to values; a matrix file is named in a system file
check banner.mtx | a matrix file is named in a system file
check packed.mat | a matrix file is named in a system file
check comma.yaml | comma.yaml: line 2
check comma_of_pad.yaml | the key 0.0 is not a word; decimals follow a point
check nul.yaml | nul.yaml: M.file:
check typed.yaml | typed.yaml: K.2.facter: unknown key; did you mean factor
eigenvalues pair.yaml --memory 0 | --memory 0
eigenvalues pair.yaml --shape 1 --png s.png | --shape 1
eigenvalues plain.yaml --set nu=0.9 | --set nu=0.9
critical-friction b1.yaml --max 5e3 | --max 5e3
critical-friction b1.yaml --max 1 --mu-max 0.1 | --max 1
critical-friction pair.yaml --change gap.K=none.mtx | gap
eigenvalues pair.yaml --change shim.K=none.mtx | shim.K: none.mtx
eigenvalues pair.yaml --change shim.K=none.mtx --table new.csv --figure new.png | none.mtx
eigenvalues b1.yaml --change shim.K=none.mtx --table new.csv | matrices
eigenvalues placed.yaml --shape 9 --table new.csv --figure new.png | --shape 9
eigenvalues pair.yaml --change shim=none.mtx | --change shim=none.mtx
eigenvalues pair.yaml --change a.K=x --change a.K=y | --change a.K=y
critical-friction pair.yaml --max 1 --min 2 | --max 1
critical-friction b1.yaml --min 0 | --min 0
report b1.yaml --min 0 | --min 0
report pair.yaml --max 9 --min 8 | --min 8
critical-friction b1.yaml --workers 2 | --workers 2
eigenvalues b1.yaml --workers 2 | --workers 2
scatter pair.yaml none.yaml | none.yaml
scatter pair.yaml free.yaml | free.yaml: spreads: mu
scatter pair.yaml s.json --csv s.json | s.json
scatter pair.yaml free.yaml --journal new.csv --csv new.csv | new.csv
advise b1.yaml --tolerance k1=5% --tolerance k1=6% | --tolerance k1=6%
optimise pair.yaml --bounds gap:1 | --bounds gap:1
optimise pair.yaml --bounds gap:0:1 --bounds gap:0:2 | --bounds gap:0:2
optimise pair.yaml --bounds nu:0:1 | nu
optimise b3.yaml --bounds mu:0:1 | b3.yaml: is a pad; a system of matrices is allowed
map b3.yaml --n 1 | --n 1
map b3.yaml --second mu:1:0 | mu:1:0
map b3.yaml --first k1:0:1e10:log | --first k1:0:1e10:log
map b3.yaml --first k1:1:1e10:lin | --first k1:1:1e10:lin
map b3.yaml --pdf x.jpg | --pdf x.jpg
map b3.yaml --csv loop.csv | --csv loop.csv
map pair.yaml --first mu:0:1 | --second: missing
map pair.yaml --quantity growth --first mu:0:1 --second gap:0:1 | quantity
export pair.yaml --output out --method reduced | band
export pair.yaml --output out --band 1:2 | --band 1:2
export pair.yaml --output pair.yaml/below | below: cannot be written
export pair.yaml --output . | is not empty
identify --seed x | --seed x
eigenvalues b1.yaml --set k1=0 --set k2=0 | no steady sliding | 1
map b3.yaml --n 2 --csv t.csv --pdf t.pdf | --pdf t.pdf: is another output too
simulate b2.yaml --set F_n=0 --set outputs=[events] --csv x.csv | F_n: 0.0 is not allowed; it must \
be above 0 for the output history
cycles b1.yaml --over mu:1 | NAME:LOW:HIGH
cycles b1.yaml --set mu=0.1 --over mu:0.2:0.3 | holds 0.1
simulate b2.yaml --set mu | --set mu: has no value; NAME=VALUE is needed
simulate b2.yaml --set mu= | --set mu=: has no value
simulate b2.yaml --set kc=1 | k_c
simulate b2.yaml --set mu=-1 | --set mu=-1
simulate b2.yaml --set formulation.line_force=- | it must be one of
simulate b2.yaml --set time=1 | --set time=1
eigenvalues b2.yaml --set mu=0.3 --set mu=0.5 | --set mu=0.5
eigenvalues b2.yaml --set initial.x=1e-4 --set initial=equilibrium | initial.x
""".splitlines()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for stem in ("b1-c", "b2-c", "b3"):
        shutil.copy(SCENES / f"{stem}.yaml", f"{stem[:2]}.yaml")
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "packed.mat").write_bytes(b"MATLAB 5.0 MAT-file\xff")
    os.mkfifo(tmp_path / "pipe.yaml")
    for target, link in (("loop.csv", "loop.csv"), ("t.csv", "t.pdf")):
        os.symlink(target, link)
    return tmp_path


@pytest.mark.parametrize("line", REFUSED)
def test_a_refusal_is_one_line(capsys, folder, line):
    arguments, part, *code = line.split(" | ")
    before = sorted(os.listdir())
    assert part in assert_refused(capsys, *arguments.split(), code=int((*code, 2)[0]))
    assert sorted(os.listdir()) == before


def test_too_little_memory_is_no_answer(capsys, folder, monkeypatch):
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 1)
    code, out, err = run(capsys, "eigenvalues", "pair.yaml", "--memory", "1e-7")
    assert (code, out, err.count("\n")) == (1, "", 1)


def test_control_characters_reach_no_terminal(capsys, folder):
    (folder / "name.yaml").write_text(PAIR + 'name: "a\\x1b[2Jb\\rc"\n')
    code, out, _ = run(capsys, "eigenvalues", "name.yaml")
    err = assert_refused(capsys, "eigenvalues", "pair.yaml", "--set", "a\x1b[2J=1")
    assert code == 0
    assert not {"\x1b", "\r"} & set(out + err)


def test_what_is_refused_or_answered_in_python_can_be_printed(folder):
    name = "a\x1b[2J\n\u202eb\ud800"
    (folder / "name.yaml").write_text(PAIR + f"name: {json.dumps(name)}\n")
    with pytest.raises(InputError) as refused:
        squeal.read_system(f"{name}.yaml")
    answer = squeal.thresholds(squeal.read_system("name.yaml"))
    for shown in (str(refused.value), str(InputWarning(name)), repr(answer)):
        assert shown.replace("\n", "").isprintable()
    assert str(refused.value).isprintable()


def test_an_angle_beyond_a_turn_is_warned_of_with_its_multiple_of_pi(capsys, folder):
    for words in ("eigenvalues b3.yaml --set alpha1=90", "map b3.yaml --n 2 --first alpha1:0:180"):
        assert "pi" in run(capsys, *words.split())[2]
    for fine in ("6.28", "4*pi"):
        assert not run(capsys, "eigenvalues", "b3.yaml", "--set", f"alpha1={fine}")[2]
