"""Files that other programs wrote give the frequencies that these programs printed."""

import shutil
from pathlib import Path

import pytest

from workflow.trials.real_files import (
    SOURCES,
    beams,
    calculix,
    deck,
    decks,
    nastran,
    shells,
    solids,
)

needs_ccx = pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX (ccx) is not installed")
QUICK = ("C3D8I", "S4", "B31", "C3D8, spring and mass")


def test_matrices_of_nastran_have_its_own_frequencies(tmp_path):
    pytest.importorskip("pyyeti")
    found = list(nastran(tmp_path))
    assert len(found) == 5
    assert all(one.good for one in found), found


@needs_ccx
def test_matrices_of_calculix_have_its_own_frequencies(tmp_path, monkeypatch):
    chosen = [one for one in decks() if one[0] in QUICK]
    monkeypatch.setattr("workflow.trials.real_files.decks", lambda: iter(chosen))
    found = list(calculix(tmp_path))
    assert [one.holds for one in found] == list(QUICK)
    assert all(one.good for one in found), found


@pytest.mark.parametrize(
    "program", ["CalculiX's tests", "GNU Octave", "FreeFEM", "GetFEM", "Ansys"]
)
def test_matrices_of_other_programs_have_their_own_frequencies(program, tmp_path):
    (source,) = [one for one in SOURCES if one.program.startswith(program)]
    if not source.is_there():
        pytest.skip(f"{source.program} is not installed")
    found = list(source.files(tmp_path))
    assert found
    assert all(one.good for one in found), found


@pytest.mark.parametrize(
    ("mesh", "nodes", "elements"),
    [
        (solids("C3D8"), 7 * 3 * 3, 24),
        (solids("C3D20"), 7 * 9 + 6 * 9 + 7 * 2 * 3 * 2, 24),
        (solids("C3D4"), 7 * 3 * 3, 144),
        (shells("S8"), 7 * 4 + 6 * 4 + 7 * 3, 18),
        (beams("B32"), 21, 10),
    ],
)
def test_meshes_have_the_nodes_of_their_elements(mesh, nodes, elements):
    assert len(mesh.nodes) == nodes
    assert len(mesh.elements) == elements


def test_a_deck_clamps_one_end():
    text = deck("C3D8")
    clamped = text.split("*NSET,NSET=CLAMPED")[1].split("*NSET")[0]
    assert len(clamped.split()) == 9


def test_the_documentation_names_what_is_tried():
    text = Path("docs/files.md").read_text(encoding="utf-8")
    words = {word.strip(",;.") for word in text.split()}
    elements = {holds for holds, _, _ in decks() if " " not in holds}
    programs = {source.program.split("'")[0].split(" (")[0] for source in SOURCES}
    assert elements <= words
    assert {program.removeprefix("GNU ") for program in programs} <= words
