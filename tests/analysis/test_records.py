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


def test_rows_of_a_history_and_of_a_sweep():
    scene = squeal.read_scene(SCENES / "b2-c.yaml", "simulate")
    run = squeal.simulate(scene.replace(outputs=("history",), samples=7, stop=1e-3))
    assert run.history is not None
    rows = squeal.to_records(run)
    assert [row["t"] for row in rows] == run.history["t"].tolist()
    assert [row["state"] for row in rows] == run.history["state"].tolist()
    assert set(rows[0]) == set(run.history)
    short = squeal.simulate(scene.replace(outputs=("shares",), stop=1e-3))
    with pytest.raises(InputError, match=r"^to_records: history: missing"):
        squeal.to_records(short)
    sweep = squeal.sweep_mu(scene, [0.1, 0.4])
    rows = squeal.to_records(sweep)
    assert [row["mu"] for row in rows] == [0.1] * 6 + [0.4] * 6
    assert sweep[1][1] is not None
    assert [complex(r["real"], r["imag"]) for r in rows[6:]] == list(sweep[1][1].spectrum.values)


def test_pandas_takes_them():
    pandas = pytest.importorskip("pandas")
    scene = squeal.read_scene(SCENES / "b2-c.yaml", "simulate")
    run = squeal.simulate(scene.replace(outputs=("history",), samples=7, stop=1e-3))
    frame = squeal.to_dataframe(run)
    assert isinstance(frame, pandas.DataFrame)
    assert run.history is not None
    assert frame["Rn"].to_numpy().tobytes() == run.history["Rn"].tobytes()
    # a column a key, in their order, numbers as numbers, with a row a record, or none
    pad = squeal.read_scene(SCENES / "b1-a.yaml")
    found = squeal.analyse(pad), squeal.critical_friction(pad), squeal.sweep_mu(pad, [0.1, 0.2])
    for result in found:
        frame, rows = squeal.to_dataframe(result), squeal.to_records(result)
        assert list(frame.columns) == list(rows[0])
        assert len(frame) == len(rows) > 0
        for name in frame.columns:
            if isinstance(rows[0][name], float):
                assert frame[name].dtype == float
            assert frame[name].tolist() == [row[name] for row in rows]
    quiet = squeal.critical_friction(squeal.read_scene(SCENES / "b3.yaml"))
    assert squeal.to_dataframe(quiet).empty


def test_scenes_change_in_place_of_files():
    scene = squeal.read_scene(SCENES / "b2-c.yaml", "simulate")
    damping = squeal.Damping(ratios=(0.01, 0.01, 0.01))
    changed = scene.replace(mu=0.2, stop=1e-3, samples=11, start="equilibrium", damping=damping)
    assert (changed.pad.mu, changed.stop, changed.samples) == (0.2, 1e-3, 11)
    assert (changed.start, changed.damping) == ("equilibrium", damping)
    assert scene.pad.mu != 0.2
    with pytest.raises(InputError, match="Scene: speed: unknown key"):
        scene.replace(speed=1.0)
    with pytest.raises(InputError, match="samples"):
        scene.replace(samples=1)
