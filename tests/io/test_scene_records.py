"""Records made in Python refuse what a scene file is refused for, with the same sentence."""

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.errors import InputError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import Formulation, models_with
from squeal.model.equations import PadModel
from squeal.model.pad import PARAMETERS, Pad
from squeal.numerics.differentiation import Dual
from squeal.schema.values import Place
from tests.io.test_scene import FALLING, text

BASIC: dict[str, Any] = {
    "m": 1.0,
    "w": 0.05,
    "h": 0.02,
    "k1": 1e6,
    "k2": 1e6,
    "alpha1": 2.0,
    "alpha2": 2.0,
}
BASIC |= {"mu": 0.4}
TOUCH = {"L1": 0.5, "L2": 0.5, "F_n": 500.0}
B1 = Pad(**BASIC, **TOUCH, k3=2e6, k4=2e6)
B2 = Pad(**BASIC, **TOUCH, k_c=4e6)
B3 = Pad(**BASIC, k_c=4e6)


def word(text: str) -> Any:
    """A word that type checkers let pass."""
    return text


def sentence(make):
    with pytest.raises(InputError) as caught:
        make()
    message = str(caught.value)
    assert "\n" not in message
    return message


def file_sentence(tmp_path, content):
    """The refusal of a scene file from its key on."""
    path = tmp_path / "scene.yaml"
    path.write_text(content)
    return sentence(lambda: read_scene(path)).removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("bad", [math.nan, math.inf, "word", True])
def test_a_pad_refuses_what_a_file_does(tmp_path, name, bad):
    model = models_with(name)[0]
    written = {math.inf: ".inf"}.get(bad, ".nan" if bad != bad else str(bad).lower())
    theirs = file_sentence(tmp_path, text(model, **{name: written}))
    ours = sentence(lambda: Pad(**(BASIC | {name: bad})))
    assert f"parameters.{ours.removeprefix('Pad: ')}" == theirs


@pytest.mark.parametrize(
    "name", [n for n, p in PARAMETERS.items() if p.kind.low == 0.0 and n not in FALLING]
)
def test_each_side_of_a_range(tmp_path, name):
    for value in (-1e-300, 0.0, 1e-300):
        model = models_with(name)[0]
        if value > 0.0 or (value == 0.0 and PARAMETERS[name].kind.low_allowed):
            assert getattr(Pad(**(BASIC | {name: value})), name) == value
            assert getattr(B1.replace(**{name: value}), name) == value
            continue
        theirs = file_sentence(tmp_path, text(model, **{name: value}))
        for make in (
            lambda v=value: Pad(**(BASIC | {name: v})),
            lambda v=value: B1.replace(**{name: v}),
        ):
            assert f"parameters.{sentence(make).removeprefix('Pad: ')}" == theirs


@pytest.mark.parametrize("name", BASIC)
def test_a_pad_needs_what_every_model_needs(name):
    values = {n: v for n, v in BASIC.items() if n != name}
    assert f"Pad: {name}: missing" in sentence(lambda: Pad(**values))
    assert f"Pad: {name}: missing" in sentence(lambda: B1.replace(**{name: None}))


def test_arrays_are_checked_entry_by_entry():
    angles = np.linspace(0.1, 3.0, 5)
    np.testing.assert_array_equal(Pad(**(BASIC | {"alpha1": angles})).alpha1, angles)
    stiff = np.array([[1.0, 2.0], [3.0, -4.0]])
    told = sentence(lambda: B1.replace(k3=stiff))
    assert told == "Pad: k3.entry 1, 1: -4.0 is not allowed; it must be a finite number above 0"
    assert "entry 2: nan" in sentence(lambda: B1.replace(alpha1=np.array([0.0, 1.0, np.nan])))
    assert "entry 0: 0" in sentence(lambda: B1.replace(m=np.array([0, 1])))


def test_symbols_dual_numbers_and_complex_steps_pass():
    for value in (Dual(-1.0, 1.0), 1.0 + 1e-200j, np.array([1.0 + 1e-200j]), object()):
        assert B1.replace(k1=value).k1 is value
    assert B1.replace(mu=mp.mpf("-0.3")).mu == mp.mpf("-0.3")  # on the way to a root
    assert "-0.3" in sentence(lambda: B1.replace(mu=np.float32(-0.3)))


def test_the_moment_of_inertia_follows_where_it_was_left_out():
    inertia = B1.m * (B1.w**2 + B1.h**2) / 3
    assert pytest.approx(inertia, rel=1e-15) == B1.I
    assert pytest.approx(2 * inertia, rel=1e-15) == B1.replace(m=2 * B1.m).I
    assert pytest.approx(2 * inertia, rel=1e-15) == B1.replace(mu=0.1).replace(m=2 * B1.m).I
    given = B1.replace(I=inertia)
    assert inertia == given.replace(m=2 * B1.m).I
    assert pytest.approx(2 * inertia, rel=1e-15) == given.replace(m=2 * B1.m, I=None).I
    scaled = B1.scaled(2.0, 0.1, 3.0)
    assert pytest.approx(5 * scaled.I, rel=1e-15) == scaled.replace(m=5 * scaled.m).I


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Formulation(word("integrl")), ("line_force", "'integrl'", "integral, mean")),
        (lambda: Formulation(delta_moment=word("*")), ("delta_moment", "+, -")),
        (lambda: PadModel(word("B4"), B1), ("name", "'B4'", "B1, B2, B3")),
        (lambda: PadModel("B1", B1.replace(k3=None)), ("k3: missing", "model B1")),
        (lambda: PadModel("B2", B1), ("k_c: missing", "model B2")),
        (lambda: PadModel("B2", B3), ("L1: missing", "model B2")),
        (lambda: Scene(word("B4"), B2), ("Scene: model", "'B4'", "B1, B2, B3")),
        (lambda: Scene("B1", B2), ("Scene: parameters.k3: missing", "model B1")),
        (lambda: Scene("B2", B2.replace(k3=1.0)), ("parameters.k3", "1.0", "does not use it")),
        (lambda: Scene("B3", B2), ("parameters.L1", "does not use it")),
        (lambda: Scene("B2", B2.replace(mu=np.array([0.1, 0.2]))), ("parameters.mu", "number")),
        (lambda: Scene("B1", B1, Formulation("mean")), ("formulation", "does not use it")),
        (lambda: Scene("B1", B1, initial=(0.0,) * 5), ("initial", "6 finite numbers")),
        (lambda: Scene("B1", B1, initial=(math.nan, *(0.0,) * 5)), ("initial", "nan")),
        (lambda: Scene("B1", B1, initial=(0, 0, 1.6, 0, 0, 0)), ("initial.theta", "surface")),
        (lambda: Scene("B3", B3, initial=(1.0, *(0.0,) * 5)), ("initial", "does not use it")),
        (lambda: Scene("B1", B1, stop=1.0), ("time.samples: missing",)),
        (lambda: Scene("B1", B1, stop=-1.0, samples=2), ("time.stop", "above 0")),
        (lambda: Scene("B1", B1, stop=1.0, samples=1), ("time.samples", "2 to 10000000")),
        (lambda: Scene("B1", B1, tolerance=0.1), ("tolerance", "at most 0.001")),
        (lambda: Scene("B1", B1, outputs=("event",)), ("outputs", "'event'", "history")),
        (lambda: Damping(), ("Damping", "one of")),
        (lambda: Damping(ratios=(0.1, -0.1, 0.1)), ("ratios", "of at least 0")),
        (lambda: Damping(matrix=((1.0,),)), ("matrix", "3 x 3")),
        (lambda: Axis("mu", 1.0, 0.0, 5), ("Axis", "1 to 0", "low < high")),
        (lambda: Axis("mu", math.nan, 1.0, 5), ("Axis: mu.low", "nan")),
        (lambda: Axis("k3", 0.0, 1.0, 0), ("Axis: k3.n", "whole number")),
    ],
)
def test_refusals_name_record_key_and_what_is_allowed(make, parts):
    told = sentence(make)
    for part in parts:
        assert part in told


def test_replace_takes_parameters_and_fields():
    scene = Scene("B1", B1)
    other = scene.replace(m=2.0, tolerance=1e-9)
    assert (other.pad.m, other.tolerance, other.pad.k3) == (2.0, 1e-9, 2e6)
    assert pytest.approx(2 * scene.pad.I, rel=1e-15) == other.pad.I
    assert scene.replace(pad=B1.replace(mu=0.1), h=0.03).pad.to_dict() == (
        B1.replace(mu=0.1, h=0.03).to_dict()
    )
    assert "Scene: kc: unknown key" in sentence(lambda: scene.replace(kc=1.0))
    assert "Pad: kc: unknown key; allowed are m, w" in sentence(lambda: B1.replace(kc=1.0))
    assert "Pad: k3: -1" in sentence(lambda: scene.replace(k3=-1.0))
    assert "does not use it" in sentence(lambda: scene.replace(k_c=1.0))


@pytest.mark.parametrize(
    "scene",
    [
        Scene("B1", B1, initial=(1e-3, 0, 0.1, 0, 0, -2), stop=1.0, samples=5, tolerance=1e-6),
        Scene("B2", B2.replace(I=0.1, V=3.0), Formulation("mean"), outputs=("history",)),
        Scene("B3", B3, damping=Damping(matrix=((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))),
    ],
)
def test_a_scene_goes_to_a_mapping_and_back(scene):
    back = Scene.from_dict(scene.to_dict(), Place("here"))
    assert back == scene
    assert back.pad.uniform == scene.pad.uniform


def test_short_representations():
    assert repr(B3) == (
        "Pad(m=1, w=0.05, h=0.02, k1=1e+06, k2=1e+06, k_c=4e+06, alpha1=2, alpha2=2, mu=0.4)"
    )
    assert repr(Scene("B3", B3, tolerance=1e-6)) == f"Scene('B3', {B3!r}, tolerance=1e-06)"
