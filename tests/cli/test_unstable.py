"""The table of unstable modes, its filters, and what a healthy pad is called."""

import json

import pytest

from squeal.cli.main import main
from squeal.io.provenance import ROOT as PACKAGE
from tests.cli.calls import assert_refused, run
from tests.conftest import ROOT, SCENES

SYSTEMS = PACKAGE / "article" / "literature" / "systems"


def unstable(capsys, *arguments):
    code, out, err = run(capsys, "eigenvalues", *arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)["unstable"]


def test_a_pad_says_what_grows_and_since_when(capsys, pad):
    (mode,) = unstable(capsys, pad)
    found = json.loads(run(capsys, "eigenvalues", pad, "--json")[1])
    first = found["eigenvalues"][0]
    assert mode["growth_rate"] == first["real"] > 0
    assert {k: mode[k] for k in ("frequency_hz", "damping_ratio")} == {
        k: first[k] for k in ("frequency_hz", "damping_ratio")
    }
    main(["critical-friction", str(pad), "--json"])
    critical = json.loads(capsys.readouterr().out)["critical"]
    assert mode["onset"] == pytest.approx(critical[0]["mu"], rel=1e-9)
    assert mode["kind"] == "flutter"
    assert "onset, mu" in run(capsys, "eigenvalues", pad)[1]


def test_filters(capsys, pad):
    assert unstable(capsys, pad, "--band", "2000:4000") == []
    assert len(unstable(capsys, pad, "--band", "1000:2000", "--min-growth", "600")) == 1
    assert unstable(capsys, pad, "--min-growth", "700") == []
    out = run(capsys, "eigenvalues", pad, "--band", "2000:4000")[1]
    assert "no unstable mode between 2000 and 4000 Hz (1 elsewhere)" in out
    # the eigenvalues themselves stay complete
    assert "3931.9" in out


def test_a_mode_of_the_region_that_grows_too_slowly_is_not_denied(capsys, tmp_path):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3) at mu = 3: 2 +- i sqrt(3), which grows by 0.5683 1/s."""
    path = tmp_path / "s.yaml"
    path.write_text(
        "parameters: {mu: 3}\nM: [[1, 0], [0, 1]]\nK:\n- {matrix: [[2, -1], [-1, 2]]}\n"
        "- {matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}\n"
    )
    region = ("--region", "0:1:0:2")
    assert unstable(capsys, path, *region, "--min-growth", "0.56")
    out = run(capsys, "eigenvalues", path, *region, "--min-growth", "0.57")[1]
    where = "among 0 < Re < 1, 0 < Im < 2 at 0.57 1/s or more"
    assert f"no unstable mode {where} (1 elsewhere)" in out


def test_plain_systems(capsys):
    # omega^2 = 2 +- sqrt(1 - 4 mu / 3): flutter from 3/4 on
    (mode,) = unstable(capsys, SYSTEMS / "mode_coupling.yaml", "--at", "1")
    assert mode["onset"] == pytest.approx(0.75, rel=1e-12)
    assert mode["growth_rate"] == pytest.approx(0.202072, abs=1e-6)
    # nothing grows in Ziegler's pendulum without load
    assert unstable(capsys, SYSTEMS / "ziegler.yaml", "--at", "0") == []


def test_the_thresholds_of_a_speed_name_the_speed(capsys):
    out = run(capsys, "critical-friction", SYSTEMS / "bicycle.yaml", "--max", "10")[1]
    lines = out.splitlines()
    assert lines[0] == "at v = 0: divergence"
    assert lines[1].split() == ["v", "change", "frequency,", "Hz"]
    # Meijaard et al. print 4.292 m/s for the end of the weave and 6.024 m/s for the capsize
    found = [round(float(line.split()[0]), 3) for line in lines[2:5]]
    assert found[1:] == [4.292, 6.024]
    assert lines[-1] == "followed up to v = 10: v = 10 is reached"


def test_a_linear_model_has_onsets_too(capsys, pad):
    scene = SCENES / "b3.yaml"
    for mode in unstable(capsys, scene, "--set", "mu=1.5"):
        assert mode["onset"] is None or 0 < mode["onset"] < 1.5


def test_a_healthy_pad_is_told_so(capsys, pad):
    out = run(capsys, "eigenvalues", pad, "--set", "mu=0.1")[1]
    assert "verdict: marginal (undamped, nothing grows): discriminant" in out
    assert "no unstable mode\n" in out
    found = json.loads(run(capsys, "eigenvalues", pad, "--set", "mu=0.1", "--json")[1])
    assert found["verdict"] == "marginal"
    assert "nothing grows" not in json.dumps(found)
    out = run(
        capsys, "eigenvalues", pad, "--set", "damping.ratios=[0.01, 0.01, 0.01]", "--set", "mu=0.1"
    )[1]
    assert "verdict: stable: " in out
    main(["critical-friction", str(pad)])
    assert "without friction: marginal (undamped, nothing grows)" in capsys.readouterr().out


def test_mode_shapes_and_pictures(capsys, pad, tmp_path):
    found = json.loads(run(capsys, "eigenvalues", pad, "--json")[1])["mode_shapes"]
    assert found["coordinates"] == ["x", "y", "theta"]
    assert [s["mode"] for s in found["shapes"]] == [1, 2, 3]
    for shape in found["shapes"]:
        largest = max(
            abs(complex(*parts)) * lever
            for *parts, lever in zip(shape["real"], shape["imag"], (1, 1, 0.04), strict=True)
        )
        assert largest == pytest.approx(1.0)
    drum = SYSTEMS / "drum_brake.yaml"
    found = json.loads(run(capsys, "eigenvalues", drum, "--json")[1])["mode_shapes"]
    assert found["coordinates"] == ["q1", "q2"]
    # the same from the general form, which --modes asks for
    terms = json.loads(run(capsys, "eigenvalues", drum, "--modes", "2", "--json")[1])["mode_shapes"]
    assert [s["frequency_hz"] for s in terms["shapes"]] == pytest.approx(
        [s["frequency_hz"] for s in found["shapes"]]
    )
    heads = {"--png": b"\x89PNG", "--svg": b"<?xml", "--pdf": b"%PDF"}
    for source, option in ((pad, "--png"), (drum, "--svg"), (drum, "--pdf")):
        picture = tmp_path / f"p.{option[2:]}"
        assert run(capsys, "eigenvalues", source, option, picture)[0] == 0
        assert picture.read_bytes().startswith(heads[option])
    sweep = ("--png", tmp_path / "s.png", "--mu", "0.1:0.5:3")
    assert run(capsys, "eigenvalues", drum, *sweep)[0] == 0
    assert (tmp_path / "s.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--band", "1:0"], "--band 1:0: is not allowed; it must be LOW:HIGH in Hz"),
        (["--band", "1"], "--band 1"),
        (["--band=-1:2"], "--band -1:2"),
        (["--band", "0:inf"], "--band 0:inf"),
        (["--min-growth", "x"], "--min-growth x: is not allowed"),
        (["--min-growth=-1"], "--min-growth -1"),
        (["--min-growth", "inf"], "--min-growth inf"),
    ],
)
def test_refusals(capsys, pad, arguments, part):
    err = assert_refused(capsys, "eigenvalues", pad, *arguments)
    assert part in err


def test_the_readme_names_the_flags():
    assert "--band" in (ROOT / "docs" / "queries.md").read_text(encoding="utf-8")
