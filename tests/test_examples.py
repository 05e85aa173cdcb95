"""What `squeal example` writes: it runs where it lies, and other programs find the same of it."""

import json
import os
import shlex

import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.examples.brake import CORNERS, solid_brake, write_brake, write_parts
from squeal.examples.brake import _mass_and_stiffness as assembled
from squeal.examples.files import EXAMPLES, Size, write_example


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_first_query_of_an_example_runs_in_an_empty_folder(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["example", name, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    found = sorted(
        path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()
    )
    assert told["files"] == found
    assert main(shlex.split(told["first"])[1:]) == 0
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("form", ["nastran", "matlab", "npz"])  # others in io/test_matrices.py
def test_a_brake_in_the_files_of_each_program_is_the_same(form, tmp_path):
    write_example("brake", tmp_path, Size(form=form))
    read = squeal.read_system(tmp_path / "brake" / "system.yaml").system
    made = solid_brake(500).system
    digits = 5e-10 if form == "nastran" else 1e-15  # ten digits in a punch file
    for matrix, wanted in zip(read.at(), made.at(), strict=True):
        assert abs(matrix - wanted).max() <= digits * abs(wanted).max()


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
@pytest.mark.parametrize("name", ["pad", "article"])
def test_files_of_an_example_have_the_permissions_of_new_files(tmp_path, name):
    """Not those of the package, which is read-only where a system installs it."""
    before = os.umask(0o077)
    try:
        files = write_example(name, tmp_path, Size())
    finally:
        os.umask(before)
    assert {(tmp_path / file).stat().st_mode & 0o777 for file in files} == {0o600}


def test_nothing_is_overwritten(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pad.yaml").write_text("mine", encoding="utf-8")
    assert main(["example", "pad"]) == 2
    assert capsys.readouterr().err.startswith("squeal: pad.yaml: is there already")
    assert (tmp_path / "pad.yaml").read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / "samples.yaml").exists()
    assert main(["example", "drum"]) == 2
    assert "brake" in capsys.readouterr().err
    assert main(["example", "pad", "--to", "pad.yaml"]) == 2
    assert capsys.readouterr().err == "squeal: pad.yaml: cannot be written: is no folder\n"
    assert main(["example", "pad", "--to", "new"]) == 0
    assert (tmp_path / "new" / "samples.yaml").is_file()


@pytest.mark.parametrize(
    ("name", "form", "blocked"),
    [
        ("brake", "abaqus", "brake/brake.inp"),  # among the last that are written
        ("brake", "npz", "brake/nodes.csv"),
        ("components", "abaqus", "brake/assembly.yaml"),
        ("components", "abaqus", "brake/disc"),
        ("rotor", "abaqus", "rotor"),
        ("article", "abaqus", "b3.yaml"),
    ],
)
def test_an_example_is_written_whole_or_not_at_all(name, form, blocked, tmp_path, capsys):
    """A folder stands where a file belongs, or a file where a folder does."""
    place = tmp_path / blocked
    place.parent.mkdir(exist_ok=True)
    if place.suffix:
        place.mkdir()
    else:
        place.touch()
    before = sorted(tmp_path.rglob("*"))
    command = ["example", name, "--to", str(tmp_path)]
    if form != "abaqus":
        command += ["--format", form]
    assert main(command) == 2
    assert str(place) in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_brake_from_python_is_written_whole_or_not_at_all(tmp_path):
    brake = solid_brake(500)
    blocked = {"npz": "elements.csv", "abaqus": "brake.inp", "matlab": "nodes.csv"}
    for form, name in blocked.items():
        folder = tmp_path / form
        (folder / name).mkdir(parents=True)
        with pytest.raises(squeal.InputError, match=f"{name}: cannot be written"):
            write_brake(folder, brake, form)
        assert [path.name for path in folder.iterdir()] == [name]
    (tmp_path / "parts" / "assembly.yaml").mkdir(parents=True)
    with pytest.raises(squeal.InputError, match=r"assembly\.yaml: cannot be written"):
        write_parts(tmp_path / "parts", brake)
    assert [path.name for path in (tmp_path / "parts").iterdir()] == ["assembly.yaml"]


def test_the_solids_are_those_of_scikit_fem():
    """The package assembles hexahedra of its own, so that the example needs no other."""
    skfem = pytest.importorskip("skfem")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    rng = np.random.default_rng(4)
    corners = np.array(CORNERS, dtype=float)
    places = (corners + 0.2 * (rng.random((8, 3)) - 0.5)).T
    cells = np.arange(8)[:, None]
    young = 2.1e11
    poisson = 0.3
    density = 7800.0
    basis = skfem.Basis(
        skfem.MeshHex(places, cells), skfem.ElementVector(skfem.ElementHex1()), intorder=7
    )
    wanted = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis).toarray()
    order = basis.nodal_dofs.T.ravel()
    _, K = assembled(places, cells, (young, poisson, density))
    assert abs(K.toarray() - wanted[np.ix_(order, order)]).max() <= 1e-12 * abs(wanted).max()


def test_a_form_is_refused_where_it_would_be_ignored(tmp_path, capsys):
    assert main(["example", "components", "--format", "nastran", "--to", str(tmp_path)]) == 2
    assert "brake has it" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
