"""The table of unstable modes."""

import json

import pytest

from squeal.cli.main import main
from tests.cli.calls import run


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
