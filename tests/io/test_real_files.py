"""Files that other programs wrote give the frequencies that these programs printed."""

import shutil
from pathlib import Path

import pytest

from workflow.trials.real_files import (
    BEGIN,
    END,
    SOURCES,
    Compared,
    beams,
    calculix,
    deck,
    decks,
    nastran,
    shells,
    solids,
    table,
    write_page,
)

needs_ccx = pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX (ccx) is not installed")
QUICK = ("C3D6", "S3", "B31", "C3D8, spring and mass")


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
    assert tuple(one.holds for one in found) == source.holds
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


def test_the_table_of_the_documentation_has_all_that_is_tried():
    """A line for each program, as the list of what is tried has it."""
    text = Path("docs/files.md").read_text(encoding="utf-8")
    lines = text.split(BEGIN)[1].split(END)[0].strip().splitlines()[2:]
    written = [line.split(" | ")[2] for line in lines]
    assert "; ".join(written) == "; ".join(holds for source in SOURCES for holds in source.holds)


def test_the_table_says_what_digits_leave_open(tmp_path):
    found = [
        Compared("Octave", "one", 5, 3e-7, "marginal"),
        Compared("CalculiX", "two", 9, 2e-7, "marginal"),
        Compared("CalculiX", "three", 7, 4e-5, "marginal", 3e-4),
    ]
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nbehind\n")
    write_page(page, found)
    assert page.read_text() == f"before\n{BEGIN}\n{table(found)}\n{END}\nbehind\n"
    assert "| Octave | `.mat` | one | 5 | 3e-07 |" in table(found)
    assert "two; three | 9 | 2e-07; three: 4e-05, of 3e-04 that its digits leave" in table(found)
    assert found[2].good
    assert not Compared("CalculiX", "three", 7, 4e-4, "marginal", 3e-4).good
