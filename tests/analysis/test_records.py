"""Results as rows and as data frames."""

import sys
import types

import pytest

import squeal
from squeal.errors import InputError
from tests.conftest import SCENES


@pytest.fixture(scope="module")
def scene():
    return squeal.read_scene(SCENES / "b3.yaml")


def test_rows_hold_what_the_results_hold(scene):
    found = squeal.analyse(scene)
    rows = squeal.to_records(found)
    assert [complex(r["real"], r["imag"]) for r in rows] == list(found.spectrum.values)
    assert rows == squeal.to_records(found.spectrum)
    assert list(found.frequencies_hz) == [r["frequency_hz"] for r in rows[::2]]
    advice = squeal.advise(scene)
    assert [r["parameter"] for r in squeal.to_records(advice)] == [
        lever.parameter for lever in advice.levers
    ]

    def coupled(mu):
        return [[1.0, 0.0], [0.0, 1.0]], None, [[2.0, -1.0 + 4 / 3 * mu], [-1.0, 2.0]]

    (mode,) = squeal.to_records(squeal.unstable_modes(coupled, 1.0))
    assert mode["kind"] == "flutter"
    sweep = squeal.sweep_modes(coupled, 0.0, 1.0)
    rows = squeal.to_records(sweep)
    assert len(rows) == 4 * len(sweep.mus)
    assert {r["mode"] for r in rows} == {1, 2}
    assert squeal.to_records(squeal.critical_friction(scene)) == []


def test_data_frames_where_pandas_is(scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pandas is not installed; install it, or use to_records"):
        squeal.to_dataframe(squeal.analyse(scene))
    frame = types.SimpleNamespace(from_records=lambda rows: ("frame", len(rows)))
    monkeypatch.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=frame))
    assert squeal.to_dataframe(squeal.analyse(scene)) == ("frame", 6)


@pytest.mark.parametrize("wrong", ["pad.yaml", 3, None, [1, 2]])
def test_anything_else_is_refused(wrong):
    with pytest.raises(InputError, match=r"^to_records: .* must be an Analysis"):
        squeal.to_records(wrong)
