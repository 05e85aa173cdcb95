"""`squeal simulate` draws and writes its history."""

import pytest

from squeal.io.provenance import provenance
from squeal.io.scene import read_scene
from squeal.model.contact import contact_law
from tests.cli.calls import answer, assert_refused, run
from tests.conftest import SCENES

MADE = provenance([], "squeal.cli.simulate")
B1, B2 = (str(SCENES / f"{name}.yaml") for name in ("b1-c", "b2-c"))


@pytest.mark.parametrize(
    ("scene", "ending", "head"),
    [(B1, "svg", b"<?xml"), (B2, "svg", b"<?xml"), (B2, "pdf", b"%PDF"), (B1, "png", b"\x89PNG")],
)
def test_pictures_of_a_motion(tmp_path, capsys, scene, ending, head):
    path = tmp_path / f"motion.{ending}"
    code, out, _ = run(capsys, "simulate", scene, "--pdf", path, "--set", "stop=2e-3")
    assert code == 0
    assert path.read_bytes().startswith(head)
    assert "history" not in out
    if ending == "svg":
        text = path.read_text()
        forces = [s.name for s in contact_law(read_scene(scene).model).plotted if s.is_force]
        assert all(f'id="spectrum {name}"' in text for name in forces)
        assert "A last panel shows the spectrum" in text
        assert text.count("position of the reaction over the half length") == 1


def test_a_history_over_a_zero_brake_force_is_refused(tmp_path, capsys):
    table = tmp_path / "x.csv"
    options = ("--set", "F_n=0", "--set", "outputs=[events]", "--set", "stop=1e-3")
    err = assert_refused(capsys, "simulate", B2, *options, "--csv", table)
    assert "parameters.F_n: 0 is not allowed with --csv" in err
    assert not table.exists()
    assert run(capsys, "simulate", B2, *options)[0] == 0


def test_a_scene_at_rest_has_no_cycle_and_a_wrong_range_is_refused(tmp_path, capsys):
    quiet = ("--set", "damping.ratios=[0.2, 0.2, 0.2]", "--set", "mu=0.1")
    picture = tmp_path / "cycles.png"
    found = answer(capsys, "cycles", B1, *quiet, "--pdf", picture)
    assert (found["cycles"], found["reason"]) == ([], "the motion comes to rest")
    assert picture.read_bytes().startswith(b"\x89PNG")
    for over, words in (("mu:1", "NAME:LOW:HIGH"), ("mu:0.2:0.3", "must hold 0.1")):
        assert words in assert_refused(capsys, "cycles", B1, *quiet, "--over", over)
