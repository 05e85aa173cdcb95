"""Every kind of answer by every method: one table, so that no answer lacks what others have."""

import functools
import importlib
import json

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.axes import Axes

import squeal
from squeal.errors import InputError
from tests.conftest import ROOT, SCENES

K = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 4 / 3], [0.0, 0.0]], "k": [[0.1, 0], [0, 0]]}
SYSTEM = squeal.System(
    np.eye(2), 0.01 * np.eye(2), K, parameters={"mu": 1.0, "k": 0.1}, name="two masses"
)
ROTOR = squeal.System(  # whirl at sqrt(1 + (speed/2)^2) +- speed/2
    np.eye(2), {"speed": [[0, 1], [-1, 0]]}, np.diag([1.0, 1.2]), parameter="speed", name="rotor"
)
SCENE = squeal.read_scene(SCENES / "b1-c.yaml")
SHORT = SCENE.replace(outputs=("history",), samples=7, stop=1e-3)
DAMPED = squeal.read_scene(ROOT / "examples" / "pad.yaml").replace(
    damping=squeal.Damping(ratios=(0.02, 0.02, 0.02))
)
AXES = squeal.Axis("mu", 0.0, 1.0, 3), squeal.Axis("k", 0.1, 0.2, 2)
PAD_AXES = squeal.Axis("k1", 1.9e7, 2.1e7, 3), squeal.Axis("k2", 2.5e7, 2.7e7, 2)
SPREAD = {"k": {"between": [0.05, 0.15]}}
ANSWERS = {
    "eigenvalues": lambda: squeal.eigenvalues(SYSTEM),
    "eigenvalues of a pad": lambda: squeal.eigenvalues(SCENE),
    "sweep": lambda: squeal.sweep(SYSTEM, [0.0, 0.5, 1.0]),
    "thresholds": lambda: squeal.thresholds(SYSTEM),
    "critical speeds": lambda: squeal.critical_speeds(ROTOR, 3.0, orders=(0.5, 1.0)),
    "conditions": lambda: squeal.conditions(SYSTEM, {"mu": [0.5, 1.0], "k": [0.1, 0.2, 0.3]}),
    "map": lambda: squeal.map(SYSTEM, AXES),
    "map of a quantity": lambda: squeal.map(SCENE, PAD_AXES, quantity="critical-friction"),
    "sensitivity": lambda: squeal.sensitivity(SYSTEM),
    "sensitivity of the threshold": lambda: squeal.sensitivity(SYSTEM, of="threshold"),
    "energy": lambda: squeal.energy(squeal.eigenvalues(SYSTEM)),
    "energy over a sweep": lambda: squeal.energy_sweep(squeal.sweep(SYSTEM, [0.0, 0.5, 1.0])),
    "advice": lambda: squeal.advise(SYSTEM),
    "optimum": lambda: squeal.optimise(SYSTEM, {"k": (0.05, 0.15)}),
    "scatter": lambda: squeal.scatter(SYSTEM, SPREAD, samples=16),
    "pairs": lambda: squeal.compare(squeal.eigenvalues(SYSTEM), squeal.eigenvalues(SYSTEM)),
    "check": lambda: squeal.check(SYSTEM),
    "simulation": lambda: squeal.simulate(SHORT),
    "cycles": lambda: squeal.cycles(DAMPED),
    "no cycles": lambda: squeal.cycles(SCENE),
    "report": lambda: squeal.report(SYSTEM),
}
GRIDS = {
    "sweep": ["mu", "mode"],
    "conditions": ["mu", "k"],
    "map": ["mu", "k"],
    "map of a quantity": ["k1", "k2"],
    "simulation": ["t"],
}
pytestmark = pytest.mark.usefixtures("coarse_charts")
each = pytest.mark.parametrize("name", ANSWERS)
answer = functools.cache(lambda name: ANSWERS[name]())


@pytest.fixture(autouse=True)
def closed():
    pyplot.switch_backend("Agg")
    yield
    pyplot.close("all")


def artists(axes):
    return len(axes.lines) + len(axes.collections) + len(axes.patches)


def test_every_kind_of_answer_is_here():
    kinds = {getattr(squeal, name) for name in squeal.__all__}
    kinds = {kind for kind in kinds if isinstance(kind, type) and issubclass(kind, squeal.Answer)}
    assert kinds - {squeal.Answer} == {type(answer(name)) for name in ANSWERS}


@each
def test_its_rows_are_records_frames_and_files(name, tmp_path):
    found = answer(name)
    rows = found.to_records()
    assert rows or name == "no cycles"
    frame = found.to_dataframe()
    assert len(frame) == len(rows)
    assert [list(frame.columns)] == [list(row) for row in rows[:1]] or not rows
    found.save(tmp_path / "table.json")
    assert json.loads((tmp_path / "table.json").read_text())["rows"] == rows
    found.save(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text().count("\n") == 1 + len(rows)
    found.save(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@each
def test_it_draws_a_figure_that_pyplot_shows(name):
    axes = answer(name).plot()
    assert isinstance(axes, Axes)
    assert pyplot.gcf() is axes.figure
    assert axes.figure.canvas.manager is not None  # what `pyplot.show` shows


@each
def test_it_draws_one_panel_in_axes_and_in_a_style_that_are_given(name):
    _, (left, right) = pyplot.subplots(1, 2)
    assert answer(name).plot(ax=left) is left
    assert answer(name).plot(right, alpha=0.5) is right
    assert artists(left) == artists(right)
    assert artists(left) > 0 or name == "no cycles"
    drawn = [*right.lines, *right.collections, *right.patches]
    assert all(one.get_alpha() == 0.5 for one in drawn)


@each
def test_it_is_an_array_over_axes_where_it_has_axes(name):
    if name not in GRIDS:
        with pytest.raises(InputError, match="has no axes"):
            answer(name).to_xarray()
        return
    if importlib.util.find_spec("xarray") is None:
        with pytest.raises(InputError, match="xarray is not installed"):
            answer(name).to_xarray()
        return
    data = answer(name).to_xarray()
    rows = answer(name).to_records()
    assert dict(data.sizes) == {axis: len({row[axis] for row in rows}) for axis in GRIDS[name]}
    row = rows[0]
    place = {axis: row[axis] for axis in GRIDS[name]}
    assert all(data[column].sel(place).item() == row[column] for column in data.data_vars)


def test_the_panel_of_a_sweep_shows_what_was_computed():
    """Undamped: omega^2 = 2 +- sqrt(1 - 4 mu/3)."""
    system = squeal.System(np.eye(2), K={"1": K["1"], "mu": K["mu"]})
    _, axes = pyplot.subplots()
    values = np.linspace(0.0, 0.7, 8)
    lines = squeal.sweep(system, values).plot(axes).lines
    split = np.sqrt(1 - 4 * values / 3)
    for line, square in zip(lines, (2 - split, 2 + split), strict=True):
        x, y = np.unique(np.array(line.get_data()), axis=1)
        assert x == pytest.approx(values)
        assert y == pytest.approx(np.sqrt(square) / (2 * np.pi))


@each
def test_a_notebook_shows_its_lines_apart_and_heads_of_tables(name):
    shown = answer(name)._repr_html_()
    lines = [part.count("\n") for part in answer(name).parts() if isinstance(part, str)]
    assert shown.count("<br>") == sum(lines)
    assert "<p></p>" not in shown
    assert "frozenset" not in shown


def test_a_system_names_itself_shortly():
    assert repr(SYSTEM) == "<System two masses: 2 rows, 5 terms, mu = 1, k = 0.1>"
    assert repr(SYSTEM.K[1].factor) == "Formula(text='mu')"
