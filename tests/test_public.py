"""What `import squeal` offers: names, verbs for pads and matrices, answers that save themselves."""

import ast
import csv
import inspect
import json
import subprocess
import sys
import typing

import numpy as np
import pytest
from scipy.sparse import csc_array

import squeal
from squeal.errors import InputError
from squeal.schema import public
from tests.conftest import ROOT, SCENES

api: typing.Any = squeal  # asked for what its types do not allow
SCENE: typing.Any = api.read_scene(SCENES / "b1-c.yaml")
# omega^2 = 2 +- sqrt(1 - 4 mu / 3): flutter from 3/4 on
COUPLED = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 4 / 3], [0.0, 0.0]]}

SYSTEM: typing.Any = api.System(np.eye(2), K=COUPLED)


class Quantity:
    """As pint has them: NumPy takes the magnitude and leaves out the unit."""

    units = "kilogram"

    def __init__(self, magnitude):
        self.magnitude = magnitude

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.magnitude, dtype)


PAD: typing.Any = api.read_scene(ROOT / "workflow" / "scenes" / "b2-c.yaml")
EYE = np.eye(2)
WRONG: list = [
    lambda: api.thresholds(SCENE, np.nan),
    lambda: api.thresholds(SCENE, 5000),
    lambda: api.thresholds(SCENE, True),
    lambda: api.thresholds(SCENE, "2"),
    lambda: api.thresholds(SCENE, 0),
    lambda: api.sweep(SCENE, 0.3),
    lambda: api.sweep(SCENE, ["a"]),
    lambda: api.sweep(SCENE, "a"),
    lambda: api.sweep(SCENE, []),
    lambda: api.sweep(SCENE, [np.inf]),
    lambda: api.sweep(SCENE, [-1]),
    lambda: api.map(SCENE, (api.Axis("mu", -1, 1, 3), api.Axis("mu", 0, 1, 3))),
    lambda: api.map(SCENE, (api.Axis("k9", -1, 1, 3), api.Axis("mu", 0, 1, 3))),
    lambda: api.map(SCENE, (api.Axis("k3", -1, 1, 3), api.Axis("mu", 0, 1, 3))),
    lambda: api.eigenvalues("pad.yaml"),
    lambda: api.simulate("pad.yaml"),
    lambda: api.read_scene(None),
    lambda: api.read_system(None),
    lambda: api.map(SYSTEM),
    lambda: api.advise(SYSTEM),
    lambda: api.eigenvalues(SCENE, band=(1.0, 2.0)),
    lambda: api.eigenvalues(SCENE.pad),
    lambda: api.reduce(SCENE),
    lambda: api.Axis("k1", 0.0, 1.0, 3, log=True),
    lambda: api.sensitivity(SCENE, of="colour"),
    lambda: api.sensitivity(SCENE, matrices={"q": {}}),
    lambda: api.sensitivity(SYSTEM, matrices={"mu": {}}),
    lambda: api.sensitivity(SYSTEM, matrices={"q": {"X": EYE}}),
    lambda: api.sensitivity(SYSTEM, matrices={"q": {"K": np.eye(3)}}),
    lambda: api.sensitivity(SYSTEM, matrices={"q": {"K": "x"}}),
    lambda: api.thresholds(SYSTEM, -1.0),
    lambda: api.advise(SCENE, high=-1),
    lambda: api.System(EYE),
    lambda: api.System(EYE, K=np.eye(3)),
    lambda: api.System(EYE, K={"nu": EYE}),
    lambda: api.Damping(matrix=EYE),
    lambda: api.Damping(matrix=np.array(1.0)),
    lambda: api.System(EYE, K=EYE, labels=("x", "y", "z")),
    lambda: SYSTEM.at({1: 0.5}),
    lambda: SYSTEM.replace({"mu": "x"}),
    lambda: SYSTEM.at(0.5),
    lambda: api.scatter(SCENE, {}),
    lambda: api.scatter(SCENE, {"k1": {1: 0.1}}),
    lambda: api.scatter("pad.yaml", {"k1": {"relative": 0.1}}),
    lambda: SCENE.replace(pad=3),
]


def test_an_argument_has_the_name_of_its_option():
    """Python said mu_max and backend where thresholds say high and the commands --integrator."""
    for verb in (squeal.thresholds, squeal.advise, squeal.scatter):
        assert "high" in inspect.signature(verb).parameters
    assert "integrator" in inspect.signature(squeal.simulate).parameters


def test_names_for_type_checkers_are_those_that_are_loaded():
    tree = ast.parse((ROOT / "squeal" / "__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    listed = {alias.name: node.module for node in imports for alias in node.names}
    assert sorted(listed) == squeal.__all__ == sorted(squeal.__all__)
    for name, module in listed.items():
        assert getattr(squeal, name) is getattr(sys.modules[module], name)
        assert inspect.getdoc(getattr(squeal, name))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(squeal, "nothing")  # noqa: B009


def test_importing_loads_nothing_in_vain():
    code = "import sys, squeal; dir(squeal); print('numpy' in sys.modules)"
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["False"]


def test_a_pad_and_matrices_answer_the_same_verbs():
    for subject, value in ((PAD, 0.4), (SYSTEM, 1.0)):
        found = squeal.eigenvalues(subject, at=value)
        assert (found.verdict, found.unstable[0].kind, found.certified) == (
            "flutter",
            "flutter",
            True,
        )
        steps = squeal.sweep(subject, [0.1, value]).steps
        assert [step.verdict for step in steps] == ["marginal", "flutter"]
        first = squeal.thresholds(subject).first
        assert first.kind == "flutter"
        assert found.unstable[0].onset == pytest.approx(first.mu, rel=1e-9)
        moved = squeal.sensitivity(subject)
        assert {len(slopes) for slopes in moved.slopes.values()} == {len(found.eigenvalues)}
    assert first.mu == pytest.approx(0.75, rel=1e-12)


def test_sparse_arrays_and_all_kinds_of_systems_are_one(tmp_path):
    sparse = squeal.System(csc_array(np.eye(2)), K={k: csc_array(X) for k, X in COUPLED.items()})
    file = tmp_path / "system.yaml"
    rows = f"K: [{{matrix: {COUPLED['1']}}}, {{matrix: {COUPLED['mu']}, factor: mu}}]\n"
    file.write_text(f"M: [[1, 0], [0, 1]]\n{rows}")
    expected = squeal.eigenvalues(SYSTEM, at=1.0).values
    for one in (sparse, squeal.read_system(file)):
        assert squeal.eigenvalues(one, at=1.0).values == pytest.approx(expected, rel=1e-12)


def test_an_answer_prints_and_saves_what_it_holds(tmp_path):
    axes = squeal.Axis("mu", 0.0, 1.0, 3), squeal.Axis("k1", 1e8, 2e8, 2)
    short = PAD.replace(outputs=("history",), samples=7, stop=1e-3)
    answers = [
        squeal.eigenvalues(PAD),
        squeal.eigenvalues(SYSTEM, at=0.75),
        squeal.sweep(SYSTEM, [0.0, 1.0]),
        squeal.thresholds(SYSTEM),
        squeal.map(PAD, axes),
        squeal.sensitivity(PAD),
        squeal.simulate(short),
        squeal.sensitivity(PAD, of="threshold"),
    ]
    for answer in answers:
        rows = answer.to_records()
        assert rows
        assert repr(answer).count("\n") < 60
        assert "<table>" in answer._repr_html_()
        json.dumps(answer.to_dict(), allow_nan=False)
        for ending in ("csv", "json"):
            answer.save(tmp_path / f"table.{ending}")
        assert json.loads((tmp_path / "table.json").read_text())["rows"] == rows
        with (tmp_path / "table.csv").open() as stream:
            written = list(csv.reader(stream))
        assert len(written) == 1 + len(rows)
        assert [head.partition(" [")[0] for head in written[0]] == list(rows[0])
        with pytest.raises(InputError, match="must end in"):
            answer.save("table.txt")


def test_without_pandas_there_are_no_data_frames(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pandas is not installed"):
        squeal.eigenvalues(SYSTEM, at=1.0).to_dataframe()


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_arguments_are_refused_in_a_sentence(wrong):
    with pytest.raises(InputError) as caught:
        wrong()
    assert "\n" not in str(caught.value)
    assert "--" not in str(caught.value)  # words of Python, not of the command line


BODY = api.System(np.eye(3), K=np.eye(3), name="body")
WITH_UNITS: dict = {
    "matrix: a": lambda: api.System(Quantity(EYE), K=EYE),
    "k: a": lambda: api.System(EYE, K={"k": EYE}, parameters={"k": Quantity(1.0)}),
    "m: a": lambda: PAD.replace(m=Quantity(0.2)),
    "high: a": lambda: api.thresholds(SYSTEM, Quantity(1.0)),
    "values: a": lambda: api.sweep(SYSTEM, Quantity([0.0, 0.5])),
    "band.1: a": lambda: api.eigenvalues(SYSTEM, band=(Quantity(1.0), 2.0)),
    "ratios.1: a": lambda: api.Damping(ratios=(Quantity(0.1), 0.1, 0.1)),
    "low: a": lambda: api.Axis("mu", Quantity(0.0), 1.0, 3),
    "load: a": lambda: api.Component(BODY, [1] * 3, [0, 1, 2], load=Quantity(np.ones(3))),
    "stiffness: a": lambda: api.Contact(("a", "b"), [(1, 1)], (0, 0, 1), Quantity(1e6)),
}


@pytest.mark.parametrize("words", WITH_UNITS)
def test_quantities_with_units_are_refused_in_a_sentence(words):
    with pytest.raises(InputError, match=f"{words} quantity with a unit is not allowed"):
        WITH_UNITS[words]()


def test_a_dict_of_numbers_is_asked_for_as_a_mapping():
    @public
    def total(weights: dict[str, float]) -> float:
        return sum(weights.values())

    assert total({"a": 1.0, "b": 2.0}) == 3.0
    wrong: typing.Any
    for wrong in ([1.0, 2.0], {"a": "x"}):
        with pytest.raises(InputError, match=r"weights"):
            total(wrong)


def test_a_misspelt_argument_has_a_hint():
    with pytest.raises(TypeError, match=r"eigenvalues: bands is no argument; did you mean band\?"):
        api.eigenvalues(SYSTEM, bands=(1.0, 2.0))


def test_random_numbers_are_those_of_a_seed_or_of_a_generator():
    """SPEC 7 of Scientific Python: the argument is called rng."""
    K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    pair = api.System(EYE, K=K, parameters={"a": 3.0, "b": 2.0})
    spreads = {"a": {"within": 0.1}}
    drawn = api.scatter(pair, spreads, samples=8, rng=np.random.default_rng(5))
    again = api.scatter(pair, spreads, samples=8, rng=drawn.seed)
    assert np.array_equal(drawn.values, again.values)
    other = api.scatter(pair, spreads, samples=8, rng=drawn.seed - 1)
    assert not np.array_equal(drawn.values, other.values)
    for verb in (
        lambda: api.scatter(pair, spreads, samples=8, rng=-1),
        lambda: api.optimise(pair, {"a": (2.0, 4.0)}, rng="one"),
    ):
        with pytest.raises(InputError, match=r"rng: .* is not allowed"):
            verb()
