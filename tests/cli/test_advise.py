"""`squeal advise` as a user meets it: table, JSON, files edited by hand, refusals."""

import json

import pytest

from squeal.io.provenance import ROOT as PACKAGE
from tests.cli.calls import assert_refused, run
from tests.cli.conftest import PAD
from tests.conftest import SCENES, only_levers

ZIEGLER = PACKAGE / "article" / "literature" / "systems" / "ziegler.yaml"


def test_the_answer_is_that_of_files_edited_by_hand(capsys, monkeypatch, pad, tmp_path):
    only_levers(monkeypatch, "h", "k1", "alpha1")
    table = tmp_path / "a.csv"
    given = ("advise", pad, "--tolerance", "k1=10%", "--tolerance", "alpha1=0.01", "--csv", table)
    code, out, err = run(capsys, *given, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    levers = {lever["parameter"]: lever for lever in found["levers"]}
    edits = {
        ("k1", "lowered"): ("k1: 2.0e7", "k1: 1.8e7"),
        ("k1", "raised"): ("k1: 2.0e7", "k1: 2.2e7"),
        ("alpha1", "raised"): ("alpha1: 0.5*pi", "alpha1: 1.5807963267948966"),
        ("h", "lowered"): ("h: 0.014", "h: 0.01372"),
    }
    for (name, way), (old, new) in edits.items():
        edited = tmp_path / "edited.yaml"
        edited.write_text(PAD.replace(old, new))
        assert edited.read_text() != PAD
        by_hand = json.loads(run(capsys, "critical-friction", edited, "--json")[1])["critical"][0]
        answer = levers[name][way]
        assert answer["critical"] == pytest.approx(by_hand["mu"], rel=1e-11)
        assert answer["kind"] == by_hand["kind"]
        assert answer["change"] == pytest.approx(by_hand["mu"] - found["critical"], abs=1e-11)
    assert found["advice"].startswith("Stability is first lost at mu = 0.315, below")
    head, *rows = table.read_text().splitlines()
    assert head.startswith("parameter,unit,value,step,critical_lowered,critical_raised")
    assert [row.split(",")[0] for row in rows] == list(levers)


def test_people_read_a_table_and_a_sentence(capsys):
    code, out, err = run(capsys, "advise", SCENES / "b3.yaml")
    assert (code, err) == (0, "")
    assert "gap: relative distance of the closest two frequencies" in out
    assert "No threshold lies below mu = 2." in out
    assert "-0 " not in out


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--tolerance", "k1"], "--tolerance k1: is not allowed; it must be NAME=VALUE"),
        (["--tolerance", "k1=0"], "--tolerance k1=0"),
        (["--tolerance", "k1=-5%"], "--tolerance k1=-5%"),
        (["--tolerance", "k1=nan"], "--tolerance k1=nan"),
        (["--tolerance", "K1=5%"], "K1 is no parameter here; allowed are m, w, h"),
        (["--tolerance", "mu=5%"], "mu is no parameter here"),
        (["--tolerance", "alpha1=5%"], "alpha1 is an angle and has no share"),
        (["--tolerance", "k1=5%", "--tolerance", "k1=6%"], "has a tolerance already"),
        (["--mu-max", "0"], "--mu-max 0"),
    ],
)
def test_refusals(capsys, pad, arguments, part):
    err = assert_refused(capsys, "advise", pad, *arguments)
    assert part in err


def test_a_plain_system_has_nothing_to_vary(capsys):
    err = assert_refused(capsys, "advise", ZIEGLER)
    assert "a plain system without named parameters" in err
