"""`squeal simulate` draws, sounds and writes its history."""

import csv
import dataclasses
import json
import math

import numpy as np
import pytest
from scipy.io import netcdf_file, wavfile

from squeal.errors import ComputationError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene, read_scene
from squeal.model.contact import contact_law
from squeal.simulation.sound import PEAK, RATE, sound
from tests.cli.calls import answer, assert_refused, run
from tests.conftest import SCENES
from tests.simulation.closed import upright
from tests.simulation.test_response import RATE as PULSE
from tests.simulation.test_response import bounce

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


def test_a_history_in_netcdf_is_that_in_csv(tmp_path, capsys):
    for name in ("h.csv", "h.nc"):
        code, _, _ = run(capsys, "simulate", B2, "--table", tmp_path / name, "--set", "samples=31")
        assert code == 0
    with (tmp_path / "h.csv").open() as stream:
        head, *rows = csv.reader(stream)
    with netcdf_file(tmp_path / "h.nc", mmap=False) as file:
        for i, column in enumerate(head):
            name, _, unit = column.partition(" [")
            variable = file.variables[name]
            assert variable.dimensions[0] == "t"
            assert getattr(variable, "units", b"").decode() == unit.rstrip("]")
            told = [row[i] for row in rows]
            if name == "state":
                found = [b"".join(row).rstrip(b"\0").decode() for row in variable[:]]
                assert found == told
            else:
                numbers = np.array([float(v) if v else math.nan for v in told])
                assert np.array(variable[:], dtype=float).tobytes() == numbers.tobytes()
    assert run(capsys, "simulate", B2, "--nc", tmp_path / "again.nc")[0] == 0
    # another file of that name stays what it is
    (tmp_path / "mine.nc").write_text("mine")
    code, _, err = run(capsys, "simulate", B2, "--nc", tmp_path / "mine.nc")
    assert (code, (tmp_path / "mine.nc").read_text()) == (2, "mine")
    assert "is no NC file" in err


def test_a_sound_is_the_velocity_of_the_last_second():
    found = sound(bounce(2.5))
    assert found.start == 1.5
    assert found.samples.dtype == np.int16
    assert len(found.samples) == RATE
    # y = sag (cos(w t) - 1): y_dot = -sag w sin(w t)
    sag = 400.0 / 1.6e6
    assert found.full_scale * PEAK == pytest.approx(sag * PULSE, rel=5e-3)
    t = 1.5 + np.arange(RATE) / RATE
    inner = slice(200, -200)  # the filter's ends
    velocity = found.samples[inner] / 32767 * found.full_scale
    assert np.abs(velocity + sag * PULSE * np.sin(PULSE * t[inner])).max() < 2e-3 * sag * PULSE


def test_a_sound_ends_where_the_model_does(tmp_path, capsys):
    # a pad that flies and turns at 4 rad/s has turned by 90 degrees after pi/8 s
    free = upright(k1=1e-6, k2=1e-6, k3=None, k4=None, k_c=1e-6, F_n=1e-9)
    flight = (0.0, 0.5, 0.0, 0.0, 0.0, 4.0)
    scene = Scene("B2", free, initial=flight, stop=0.1, samples=2, outputs=("shares",))
    found = sound(scene)
    assert len(found.samples) / RATE == pytest.approx(math.pi / 8, abs=1e-4)
    path = tmp_path / "free.yaml"
    path.write_text(json.dumps(scene.to_dict()))
    err = run(capsys, "simulate", path, "--wav", tmp_path / "x.wav")[2]
    assert (
        err == "squeal: warning: the sound lasts 0.393 s: the model ends before one of 1 s does\n"
    )
    with pytest.raises(ComputationError, match="turned past 90 degrees"):
        sound(dataclasses.replace(scene, stop=0.5))


def test_wav_files(tmp_path, capsys):
    path = tmp_path / "x.wav"
    quiet = ("--set", "initial=equilibrium", "--set", "y_dot=1e-3", "--set", "mu=0.1")
    code, out, err = run(capsys, "simulate", B2, "--wav", path, "--json", *quiet)
    assert (code, err) == (0, "")  # a whole second, so no warning
    rate, samples = wavfile.read(path)
    told = json.loads(out)["sound"]
    assert (rate, len(samples)) == (told["rate_hz"], round(told["duration"] * told["rate_hz"]))
    assert np.abs(samples).max() == pytest.approx(32767 * PEAK, rel=1e-3)
    out = run(capsys, "simulate", B2, "--wav", path, *quiet)[1]
    assert "44100 samples a second" in out
    code, _, err = run(capsys, "simulate", B2, "--wav", tmp_path / "x.mp3")
    assert code == 2
    assert "the name must end in .wav" in err
    assert "sound" not in json.loads(run(capsys, "simulate", B2, "--json", *quiet)[1])


def test_a_scene_at_rest_has_no_cycle_and_a_wrong_range_is_refused(tmp_path, capsys):
    quiet = ("--set", "damping.ratios=[0.2, 0.2, 0.2]", "--set", "mu=0.1")
    picture = tmp_path / "cycles.png"
    found = answer(capsys, "cycles", B1, *quiet, "--pdf", picture)
    assert (found["cycles"], found["reason"]) == ([], "the motion comes to rest")
    assert picture.read_bytes().startswith(b"\x89PNG")
    for over, words in (("mu:1", "NAME:LOW:HIGH"), ("mu:0.2:0.3", "must hold 0.1")):
        assert words in assert_refused(capsys, "cycles", B1, *quiet, "--over", over)
