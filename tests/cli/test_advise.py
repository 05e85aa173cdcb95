"""`squeal advise` as a user meets it: table, JSON, files edited by hand, refusals."""

import json

import pytest

from squeal.io.provenance import ROOT as PACKAGE
from tests.cli.calls import run
from tests.cli.conftest import PAD

ZIEGLER = PACKAGE / "article" / "literature" / "systems" / "ziegler.yaml"


def test_the_answer_is_that_of_files_edited_by_hand(capsys, pad, tmp_path):
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
    head, *rows = table.read_text().splitlines()
    assert head.startswith("parameter,unit,value,step,critical_lowered,critical_raised")
    assert [row.split(",")[0] for row in rows] == list(levers)
