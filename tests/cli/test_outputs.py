"""Files that commands write: nothing is lost, formats follow the name, heads carry units."""

import csv
import json
import os

import pytest

from squeal.io.scene import read_scene
from squeal.model.contact import contact_law
from tests.cli.calls import B1, B2, B3, answer, assert_refused, run, words

KINDS = {
    ".pdf": b"%PDF-1.4\n", ".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<?xml version='1.0'?><svg/>",
    ".csv": b"mu,kind\n", ".json": b"{}",
}  # fmt: skip


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "v.csv"  # a name that a table may have
    path.write_bytes(B3.read_bytes())
    return path


def test_an_input_is_never_overwritten(capsys, scene):
    before = scene.read_bytes()
    os.symlink(scene, "link.csv")
    command = ("map", "v.csv", "--n", "2", "--csv")
    for name in ("v.csv", "./v.csv", scene, "link.csv"):
        assert "is an input too" in assert_refused(capsys, *command, name)
    assert scene.read_bytes() == before
    assert run(capsys, *command, "other.csv")[0] == 0


@pytest.mark.parametrize("kind", KINDS)
def test_an_existing_file_of_another_kind_stays(capsys, scene, kind):
    for ending in KINDS:
        target = scene.parent / f"x{ending}"
        option = "--table" if ending in (".csv", ".json") else "--figure"
        command = ("map", scene, "--n", "2", option, target)
        target.write_bytes(KINDS[kind])
        if kind == ending:
            assert run(capsys, *command)[0] == 0
        else:
            assert "exists and is no" in assert_refused(capsys, *command)
        assert (target.read_bytes() == KINDS[kind]) == (kind != ending)


@pytest.mark.parametrize("ending", [".pdf", ".svg", ".png"])
def test_figures_follow_their_name_and_hold_their_alternative_text(capsys, scene, ending):
    first = scene.parent / f"a{ending}"
    second = scene.parent / f"b{ending}"
    for target in (first, second):
        assert run(capsys, "map", scene, "--n", "3", "--pdf", target)[0] == 0
    data = first.read_bytes()
    assert data == second.read_bytes()
    assert data.startswith(KINDS[ending][:5])
    assert b" over alpha1 and alpha2: " in data


HEADS = {
    f"simulate {B1}": "t [s], theta_dot [rad/s], state, F3 [F_n]",
    f"eigenvalues {B1}": "real [1/s], imag [rad/s], frequency_hz, damping_ratio",
    f"eigenvalues {B1} --mu 0:1:3": "mu, contact, real [1/s], imag [rad/s]",
    f"critical-friction {B1}": "mu, kind, frequency_hz",
    f"sliding {B1}": "x [m], theta [rad], R_n [N], delta [m], verdict",
    f"map {B3} --n 2 --first k_c:1e6:2e6 --second mu:0:1": "k_c [N/m], mu, verdict",
}


@pytest.mark.parametrize("command", HEADS)
def test_heads_carry_units_and_json_the_same_table(capsys, tmp_path, command):
    table = tmp_path / "t.csv"
    other = tmp_path / "t.json"
    for target in (table, other):
        assert run(capsys, *words(command), "--table", target)[0] == 0
    found = json.loads(other.read_text())
    with table.open() as stream:
        heads, *rows = csv.reader(stream)
    assert set(HEADS[command].split(", ")) <= set(heads)
    assert len(found["rows"]) == len(rows)
    for i, head in enumerate(heads):
        name = head.partition(" [")[0]
        assert head == (f"{name} [{found['units'][name]}]" if found["units"][name] else name)
        for ours, theirs in zip(rows[:3], found["rows"], strict=False):
            assert ours[i] == ("" if theirs[name] is None else str(theirs[name]))


def test_files_that_a_system_names_are_inputs(tmp_path, capsys):
    nodes = tmp_path / "nodes.csv"
    path = tmp_path / "system.yaml"
    nodes.write_text("node,dof,x,y,z\n1,1,0,0,0\n2,rx,1,0,0\n")
    path.write_text("M: [[1, 0], [0, 1]]\nK: [[2, 0], [0, 3]]\ncoordinates: {file: nodes.csv}\n")
    other = tmp_path / ".." / tmp_path.name / "nodes.csv"
    assert "is an input too" in assert_refused(capsys, "eigenvalues", path, "--csv", other)
    found = answer(capsys, "eigenvalues", path, "--csv", tmp_path / "other.csv")
    assert [file["name"] for file in found["provenance"]["inputs"]] == ["system.yaml", "nodes.csv"]


BODY = "M: [[1, 0], [0, 1]]\nK: [[2, -1], [-1, 2]]\ncoordinates: {file: %s}\n"
BRAKE = {
    "disc.yaml": BODY % "disc.csv",
    "disc.csv": "node,dof,x,y,z\n1,x,0,0,0\n1,z,0,0,0\n",
    "pad.yaml": BODY % "pad.csv",
    "pad.csv": "node,dof,x,y,z\n1,x,0,0,0\n1,z,0,0,0\n",
    "brake.yaml": """\
components: {disc: {file: disc.yaml}, pad: {file: pad.yaml}}
contact: [{between: [disc, pad], distance: 0.1, normal: [0, 0, 1], stiffness: 1, bonded: true}]
""",
    "change.csv": "1,1,1.0\n2,2,1.0\n",
}


@pytest.mark.parametrize(
    "command",
    [
        "eigenvalues brake.yaml --table disc.csv",
        "eigenvalues disc.yaml --sensitivity --change a.K=change.csv --table change.csv",
        "critical-friction disc.yaml --change a.K=change.csv --table ./change.csv",
    ],
)
def test_all_files_that_a_run_reads_are_inputs(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    for name, text in BRAKE.items():
        (tmp_path / name).write_text(text)
    *rest, table = command.split()
    assert "is an input too" in assert_refused(capsys, *rest, table)
    assert (tmp_path / table).read_text() == BRAKE[table.removeprefix("./")]
    names = {file["name"] for file in answer(capsys, *rest, "new.csv")["provenance"]["inputs"]}
    assert table.removeprefix("./") in names


NAMED_LIKE_COLUMNS = """\
M: {matrix: [[1, 0], [0, 1]]}
K: [{matrix: [[4, 0], [0, 4]]}, {matrix: [[0, 4], [-4, 0]], factor: real}]
C: {matrix: [[1, 0], [0, 1]], factor: verdict}
parameters: {real: 1.0, verdict: 0.5}
parameter: real
"""


def test_a_parameter_with_the_name_of_a_column_stands_as_parameter_NAME(tmp_path, capsys):
    path = tmp_path / "system.yaml"
    table = tmp_path / "table.json"
    path.write_text(NAMED_LIKE_COLUMNS)
    answer(capsys, "eigenvalues", path, "--sweep", "0:1:3", "--csv", table)
    row = json.loads(table.read_text())["rows"][-1]
    assert row["parameter.real"] == 1.0
    assert row["real"] != 1.0


PICTURES = [(B1, ".svg"), (B2, ".svg"), (B2, ".pdf"), (B1, ".png")]


@pytest.mark.parametrize(("scene", "ending"), PICTURES)
def test_a_picture_of_a_motion_is_of_the_kind_that_its_name_says(tmp_path, capsys, scene, ending):
    path = tmp_path / f"motion{ending}"
    found = answer(capsys, "simulate", scene, "--pdf", path, "--set", "stop=2e-3")
    assert path.read_bytes().startswith(KINDS[ending][:5])
    assert "history" not in found
    if ending == ".svg":
        text = path.read_text(encoding="utf-8")
        forces = [s.name for s in contact_law(read_scene(scene).model).plotted if s.is_force]
        assert all(f'id="spectrum {name}"' in text for name in forces)
        assert text.count("position of the reaction over the half length") == 1


def test_a_scene_at_rest_has_no_cycle(tmp_path, capsys):
    quiet = ("--set", "damping.ratios=[0.2, 0.2, 0.2]", "--set", "mu=0.1")
    picture = tmp_path / "cycles.png"
    found = answer(capsys, "cycles", B1, *quiet, "--pdf", picture)
    assert (found["cycles"], found["reason"]) == ([], "the motion comes to rest")
    assert picture.read_bytes().startswith(b"\x89PNG")
