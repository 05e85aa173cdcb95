"""The release archive: the same bytes for the same files, complete or refused, and its manifest."""

import os
import shutil
import sys
import time
import zipfile

import pytest

from squeal.article.contents import FIGURES, RESULTS, figure_files
from tests.conftest import ROOT
from workflow.release import codecheck, gather, pack, verify


def fill(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"{name}\n" * 50)


def test_the_same_files_give_the_same_bytes(tmp_path):
    names = ["b/two.csv", "a.txt", "b/a/one.pdf"]
    for place, order in (("first", names), ("second", names[::-1])):
        fill(tmp_path / place / "squeal", order)
        pack.pack(tmp_path / place / "squeal", tmp_path / f"{place}.zip")
        for path in (tmp_path / place).rglob("*"):  # neither times nor rights of files count
            os.utime(path, (time.time() - 1e6,) * 2)
            path.chmod(0o700)
        pack.pack(tmp_path / place / "squeal", tmp_path / f"{place}-again.zip")
    archives = {path.read_bytes() for path in tmp_path.glob("*.zip")}
    assert len(archives) == 1
    with zipfile.ZipFile(tmp_path / "first.zip") as packed:
        assert packed.namelist() == ["squeal/a.txt", "squeal/b/a/one.pdf", "squeal/b/two.csv"]
        assert packed.read("squeal/a.txt") == (tmp_path / "first/squeal/a.txt").read_bytes()
        assert packed.testzip() is None


def test_an_archive_inside_is_written_the_same_way(tmp_path):
    for i, order in enumerate(("ab", "ba")):
        with zipfile.ZipFile(tmp_path / f"{i}.zip", "w") as packed:
            for name in order:
                packed.writestr(zipfile.ZipInfo(name, (2000 + i, 1, 1, 0, 0, 0)), name * 9)
    first = tmp_path / "0.zip"
    second = tmp_path / "1.zip"
    assert first.read_bytes() != second.read_bytes()
    pack.repack(first)
    pack.repack(second)
    assert first.read_bytes() == second.read_bytes()
    assert zipfile.ZipFile(second).read("b") == b"b" * 9


def test_other_files_give_other_bytes(tmp_path):
    fill(tmp_path / "squeal", ["a.txt"])
    pack.pack(tmp_path / "squeal", tmp_path / "before.zip")
    (tmp_path / "squeal" / "a.txt").write_text("other")
    pack.pack(tmp_path / "squeal", tmp_path / "after.zip")
    assert (tmp_path / "before.zip").read_bytes() != (tmp_path / "after.zip").read_bytes()


@pytest.fixture
def outputs(tmp_path, monkeypatch):
    """A repository in which everything is built, by name only."""
    monkeypatch.setattr(gather, "ROOT", tmp_path)
    names = [*verify.built(), *codecheck.manifest(), "docs/_build/html/index.html"]
    names += [file for name in FIGURES for file in figure_files(name)]
    names += ["dist/squeal-0-py3-none-any.whl", "dist/squeal-0.tar.gz"]
    fill(tmp_path, [*names, "docs/_build/html/.doctrees/index.doctree"])
    return tmp_path


def test_everything_built_is_gathered(outputs):
    places = {str(place) for _, place in gather.built()}
    assert {"paper/report.pdf", "site/index.html", "results/b2-c.csv"} <= places
    assert {f"figures/{name}.pdf" for name in FIGURES} | set(RESULTS) <= places
    assert not any("doctree" in place for place in places)


@pytest.mark.parametrize(
    ("missing", "target"),
    [
        ("results/claims.json", "make report"),
        ("figures/fig11.txt", "make report"),
        ("paper/report.pdf", "make report"),
        ("figures/fig13.pdf", "make report"),
        ("docs/_build/html/index.html", "make site"),
        ("dist/squeal-0.tar.gz", "make dist"),
    ],
)
def test_what_is_missing_is_told_with_its_target(outputs, missing, target):
    (outputs / missing).unlink()
    with pytest.raises(FileNotFoundError, match=f"missing: {target}"):
        list(gather.built())


def test_the_manifest_is_current_and_complete():
    text = (ROOT / "codecheck.yml").read_text(encoding="utf-8")
    assert text == codecheck.text(), "make metadata"
    assert {f"figures/{name}.pdf" for name in FIGURES} | {"paper/report.pdf"} <= {
        *codecheck.manifest()
    }


def test_an_output_of_the_manifest_that_a_build_lacks_is_named(outputs, monkeypatch, capsys):
    shutil.copy(ROOT / "codecheck.yml", outputs)
    monkeypatch.setattr(codecheck, "ROOT", outputs)
    monkeypatch.setattr(sys, "argv", ["codecheck", "--check"])
    assert codecheck.main() == 0
    (outputs / "figures/fig05.pdf").unlink()
    (outputs / "figures/fig13.pdf").write_text("")
    assert codecheck.main() == 1
    said = capsys.readouterr().err
    assert "figures/fig05.pdf, figures/fig13.pdf" in said
