"""What Python is given wrongly is refused in a sentence, and what it was given is not shared."""

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_array, dok_array

import squeal
from squeal.errors import ComputationError, InputError
from squeal.sparse.quadratic import PROGRESS
from tests.conftest import SCENES

api: Any = squeal  # asked for what its types do not allow
EYE = np.eye(2)
BIG = 10**400
NAN = math.nan
K: Any = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 4 / 3], [0.0, 0.0]]}
S: Any = api.System(EYE, K=K)
SCENE: Any = api.read_scene(SCENES / "b1-c.yaml")
AXES = api.Axis("mu", 0, 1, 3), api.Axis("k1", 1e8, 2e8, 3)


def known() -> Any:
    return api.eigenvalues(S, at=1.0)


def moved(**given: Any) -> Any:
    return api.sensitivity(S, **given)


REFUSED: list[tuple[Any, str]] = [
    # a mass that vanishes within the range, a direction that there is not
    (lambda: api.thresholds(api.System({"(mu - 1)**2": [[1.0]]}, K=[[1.0]])), "through infinity"),
    (
        lambda: api.thresholds(api.System([[0.0]], {"(mu - 1)**2": [[1.0]]}, [[1.0]])),
        "through infinity",
    ),
    (lambda: api.Component(S, [1, 2], [0, 3]), "directions: 3 is not allowed"),
    # numbers that are none
    (lambda: moved(matrices={"a": {"K": [[NAN, 0], [0, 0]]}}), "a.K: must be a matrix of finite"),
    (lambda: api.mac(np.zeros((2, 1)), EYE), "X: a shape of zeros"),
    (lambda: api.mac(EYE, [[NAN], [1]]), "Y: must be a matrix of finite"),
    (lambda: api.System([[1, 0], [0, NAN]], K=K), "M: must be a matrix of finite"),
    (lambda: api.System(csc_array([[1, 0], [0, math.inf]]), K=K), "M: must be a matrix of finite"),
    (lambda: api.System(EYE * (1 + 1j), K=K), "M: must be a matrix of finite real numbers"),
    (lambda: api.eigenvalues(S, memory=0), "memory"),
    (lambda: api.eigenvalues(S, memory=-1), "memory"),
    (lambda: api.eigenvalues(S, memory="x"), "memory"),
    (lambda: api.eigenvalues(S, memory=NAN), "memory"),
    (lambda: api.eigenvalues(S, progress=3), "progress: 3 is not allowed; it must be a function"),
    # shapes and modes
    (lambda: api.mac(EYE, np.eye(3)), "2 and 3 rows"),
    (lambda: api.mac("a", "b"), "X: must be a matrix of finite numbers"),
    (
        lambda: api.compare(1, 2),
        "computed: 1 is not allowed; it must be an instance of Eigenvalues",
    ),
    (lambda: api.compare(api.thresholds(S), known()), "computed"),
    (lambda: api.compare(known(), known(), tolerance=None), "tolerance: None"),
    (lambda: known().save("x.jpg"), "x.jpg: the name must end in one of .csv, .json, .pdf"),
    # axes
    (lambda: api.map(SCENE, AXES[0]), "axes"),
    (lambda: api.map(SCENE, 3), "axes"),
    (lambda: api.map(SCENE, (("mu", 0, 1, 3), AXES[1])), "axes"),
    (lambda: api.map(SCENE, AXES[:1]), "axes"),
    (lambda: api.map(S), "axes: missing; the map of a system needs two parameters"),
    # systems
    (lambda: api.System([[1, 2], [3]], K=K), "M: "),
    (lambda: api.System([["a"]], K=K), "M: "),
    (lambda: api.System([["1"]], K=K), "M: "),
    (lambda: api.System([[BIG, 0], [0, 1]], K=K), "M: "),
    (lambda: api.System(np.ones((2, 2, 2)), K=K), "M: "),
    (lambda: api.System(3, K=K), "M: "),
    (lambda: api.System(None, K=K), "M and K: at least one matrix each"),
    (lambda: api.System([1, 2], K=[3, 4]), "M: "),
    (lambda: api.System(1.0, K=2.0), "M: "),
    (lambda: api.System([], K=[]), "M: "),
    (lambda: api.System(EYE, K={1: EYE}), "K: factor: 1 is not allowed; it must be text"),
    (lambda: api.System(EYE, K=K, parameters=[1]), "parameters"),
    (lambda: api.System(EYE, K=K, parameters={"mu": "0.3"}), "parameters"),
    (lambda: api.System(EYE, K=K, parameters={"mu": None}), "parameters"),
    (lambda: api.System(EYE, K=K, parameters={"mu": 1j}), "parameters"),
    (lambda: api.System(EYE, K=K, parameters={"mu": NAN}), "parameters"),
    (lambda: api.System(EYE, K=K, parameter=None), "parameter"),
    (lambda: api.System(EYE, K=K, parameter=3), "parameter"),
    # ranges and values
    (lambda: api.thresholds(S, high="2"), "high"),
    (lambda: api.thresholds(S, high=NAN), "high"),
    (lambda: api.thresholds(S, low="a"), "low: 'a' is not allowed; it must be a finite number"),
    (lambda: api.eigenvalues(S, at="a"), "at: "),
    (lambda: api.eigenvalues(S, at=[1]), "at: "),
    (lambda: api.eigenvalues(S, at=1j), "at: "),
    (lambda: api.eigenvalues(S, at=BIG), "at: "),
    (lambda: api.eigenvalues(S, at=np.array(math.nan)), "at: "),
    (lambda: api.eigenvalues(S, region=(1, 2, 3)), "region"),
    (lambda: api.eigenvalues(S, region="abc"), "region"),
    (lambda: api.eigenvalues(S, region=3), "region"),
    (lambda: api.eigenvalues(S, look=3), "look: 3"),
    (lambda: api.optimise(S, None), "bounds"),
    (lambda: api.optimise(S, [1]), "bounds"),
    (lambda: api.optimise(S, {"mu": 1}), "bounds"),
    (lambda: api.optimise(S, {"mu": "ab"}), "bounds"),
    (lambda: moved(known=3), "known: 3"),
    (lambda: moved(known=api.thresholds(S)), "known"),
    (lambda: moved(matrices=[1]), "matrices"),
    (lambda: moved(matrices={"a": EYE}), "matrices"),
    (lambda: moved(matrices={"a": {"K": [["x", 0], [0, 0]]}}), "a.K: must be a matrix"),
]
BEYOND: list[Any] = [
    lambda: api.thresholds(S, high=1e-200),
    lambda: api.thresholds(S, high=1e300),
    lambda: api.eigenvalues(replace(SCENE, pad=replace(SCENE.pad, k1=1e308))),
    lambda: api.eigenvalues(replace(SCENE, pad=replace(SCENE.pad, m=1e-308))),
    lambda: api.eigenvalues(replace(SCENE, pad=replace(SCENE.pad, F_n=1e-300))),
    lambda: api.eigenvalues(replace(SCENE, pad=replace(SCENE.pad, w=1e300))),
]


@pytest.mark.parametrize(("ask", "words"), REFUSED)
def test_what_python_is_given_wrongly_is_named(ask, words):
    with pytest.raises(InputError) as refused:
        ask()
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("ask", BEYOND)
def test_numbers_of_wild_size_fail_with_a_sentence(ask):
    with np.errstate(all="ignore"), suppress(ComputationError, InputError):
        assert np.isfinite(getattr(ask(), "values", 0.0)).all()


@pytest.mark.filterwarnings("ignore:.*no matrix depends on mu")
@pytest.mark.parametrize("made", [np.array, csc_array])
@pytest.mark.parametrize("kind", [float, complex])
def test_a_system_does_not_follow_what_it_was_made_from(made, kind):
    A = made([[2.0, -1.0], [-1.0, 2.0]], dtype=kind)
    terms = squeal.Term(made(EYE)), squeal.Term(A)
    systems = squeal.System(EYE, K=A), squeal.TermSystem(terms[:1], (), terms[1:])
    (A.data if made is csc_array else A)[:] *= 4
    for system in systems:  # omega^2 = 1, 3
        squares = squeal.eigenvalues(system).values.imag ** 2
        assert sorted(squares.round(9).tolist()) == [1, 1, 3, 3]
        assert squeal.thresholds(system).verdict == "marginal"  # a system of real matrices


def test_an_answer_does_not_follow_what_it_has_said():
    axes = squeal.Axis("mu", 0, 1, 3), squeal.Axis("gap", 0, 1, 3)
    wide = squeal.System(EYE, K=K | {"gap": EYE}, parameters={"gap": 0.5})
    answers = [squeal.eigenvalues(S), squeal.check(S), squeal.thresholds(S), squeal.map(wide, axes)]
    for answer in answers:
        said = answer.to_dict()
        before = repr(said)
        for part in said.values():
            if isinstance(part, dict | list):
                part.clear()
        assert repr(answer.to_dict()) == before


def test_likeness_of_shapes_does_not_depend_on_their_scale():
    for size in (1e200, 1e-200):
        assert squeal.mac([[size], [size]], [[1, 1], [1, -1]]).round(12).tolist() == [[1, 0]]


def test_scalars_of_numpy_and_single_shapes_are_taken():
    once = api.eigenvalues(S, at=0.3).values
    assert np.array_equal(api.eigenvalues(S, at=np.array(0.3)).values, once)
    assert api.map(SCENE, AXES, curves=np.bool_(True)).verdicts
    assert api.mac([1, 2], [1, 3]) == pytest.approx(0.98)
    assert api.mac([1, 2], EYE) == pytest.approx(np.array([[0.2, 0.8]]))
    assert api.System(dok_array(EYE), K=K).n == 2


def test_a_division_by_zero_without_words_is_one_of_ours():
    def progress(_):
        raise ZeroDivisionError

    with pytest.raises(ComputationError, match="ZeroDivisionError"):
        api.sweep(S, [0.3], progress=progress)
    assert PROGRESS.get() is not progress  # of the next question
