"""Records and arguments in Python refuse what a scene file is refused for, by the same sentence."""

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import InputError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import Formulation, models_with
from squeal.model.equations import PadModel
from squeal.model.pad import PARAMETERS, Pad
from squeal.numerics.differentiation import Dual
from squeal.results.map import Axis
from squeal.schema import Place
from tests.io.test_scene import FALLING, text

BASIC: dict[str, Any] = {"m": 1.0, "w": 0.05, "h": 0.02, "k1": 1e6, "k2": 1e6, "mu": 0.4}
BASIC |= {"alpha1": 2.0, "alpha2": 2.0}
TOUCH = {"L1": 0.5, "L2": 0.5, "F_n": 500.0}
B1 = Pad(**BASIC, **TOUCH, k3=2e6, k4=2e6)
B2 = Pad(**BASIC, **TOUCH, k_c=4e6)
B3 = Pad(**BASIC, k_c=4e6)


def sentence(make):
    with pytest.raises(InputError) as caught:
        make()
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_pad_refuses_what_a_file_does(tmp_path, name):
    path = tmp_path / "scene.yaml"
    bad: dict[Any, Any] = {".nan": math.nan, ".inf": math.inf, "word": "word", "true": True}
    good: dict[str, float] = {}
    if PARAMETERS[name].kind.low == 0.0 and name not in FALLING:
        zero = good if PARAMETERS[name].kind.low_allowed else bad
        zero["0.0"] = 0.0
        bad["-1e-300"] = -1e-300
        good["1e-300"] = 1e-300
    for value in good.values():
        assert getattr(Pad(**(BASIC | {name: value})), name) == value
        assert getattr(B1.replace(**{name: value}), name) == value
    for written, value in bad.items():
        path.write_text(text(models_with(name)[0], **{name: written}))
        theirs = sentence(lambda: read_scene(path))
        for make in (lambda v: Pad(**(BASIC | {name: v})), lambda v: B1.replace(**{name: v})):
            ours = sentence(lambda v=value, make=make: make(v))
            assert theirs == f"{path}: parameters.{ours.removeprefix('Pad: ')}"


def test_arrays_are_checked_entry_by_entry():
    angles = np.linspace(0.1, 3.0, 5)
    np.testing.assert_array_equal(Pad(**(BASIC | {"alpha1": angles})).alpha1, angles)
    stiff = np.array([[1.0, 2.0], [3.0, -4.0]])
    assert "Pad: k3.entry 1, 1: -4.0" in sentence(lambda: B1.replace(k3=stiff))
    assert "entry 2: nan" in sentence(lambda: B1.replace(alpha1=np.array([0.0, 1.0, np.nan])))
    assert "entry 0: 0" in sentence(lambda: B1.replace(m=np.array([0, 1])))


def test_symbols_dual_numbers_and_complex_steps_pass():
    for value in (Dual(-1.0, 1.0), 1.0 + 1e-200j, np.array([1.0 + 1e-200j]), object()):
        assert B1.replace(k1=value).k1 is value
    assert B1.replace(mu=mp.mpf("-0.3")).mu == mp.mpf("-0.3")  # on the way to a root
    assert "-0.3" in sentence(lambda: B1.replace(mu=np.float32(-0.3)))


def test_the_moment_of_inertia_follows_where_it_was_left_out():
    inertia = B1.m * (B1.w**2 + B1.h**2) / 3
    scaled = B1.scaled(2.0, 0.1, 3.0)
    given = B1.replace(I=inertia)
    for pad, expected in [
        (B1, inertia),
        (B1.replace(m=2 * B1.m), 2 * inertia),
        (B1.replace(mu=0.1).replace(m=2 * B1.m), 2 * inertia),
        (given.replace(m=2 * B1.m), inertia),
        (given.replace(m=2 * B1.m, I=None), 2 * inertia),
        (scaled.replace(m=5 * scaled.m), 5 * scaled.I),
    ]:
        assert pytest.approx(expected, rel=1e-15) == pad.I


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Formulation("integrl"), ("line_force", "'integrl'", "integral, mean")),  # type: ignore[arg-type]
        (lambda: PadModel("B4", B1), ("name", "'B4'", "B1, B2, B3")),
        (lambda: PadModel("B2", B1), ("k_c", "model B2")),
        (lambda: Scene("B4", B2), ("Scene: model", "'B4'", "B1, B2, B3")),
        (lambda: Scene("B2", B2.replace(k3=1.0)), ("parameters.k3", "1.0", "B2")),
        (lambda: Scene("B2", B2.replace(mu=np.array([0.1, 0.2]))), ("parameters.mu", "number")),
        (lambda: Scene("B1", B1, initial=(0.0,) * 5), ("initial", "6 finite numbers")),
        (lambda: Scene("B1", B1, initial=(math.nan, *(0.0,) * 5)), ("initial", "nan")),
        (lambda: Scene("B1", B1, initial=(0, 0, 1.6, 0, 0, 0)), ("initial.theta", "1.6")),
        (lambda: Scene("B3", B3, initial=(1.0, *(0.0,) * 5)), ("initial", "B3")),
        (lambda: Scene("B1", B1, stop=1.0), ("time.samples",)),
        (lambda: Scene("B1", B1, damping=0.05), ("Scene: damping", "0.05", "Damping")),  # type: ignore[arg-type]
        (lambda: Scene("B1", B1).replace(kc=1.0), ("kc", "k_c")),
        (lambda: B1.replace(kc=1.0), ("Pad: kc", "k_c")),
        (lambda: Damping(ratios=(0.1, -0.1, 0.1)), ("ratios", "of at least 0")),
        (lambda: Damping(matrix=((1.0,),)), ("matrix", "3 x 3")),
        (lambda: Axis("mu", 1.0, 0.0, 5), ("Axis", "1 to 0", "low < high")),
    ],
)
def test_refusals_name_record_key_and_what_is_allowed(make, parts):
    message = sentence(make)
    for part in parts:
        assert part in message


def test_replace_takes_parameters_and_fields():
    scene = Scene("B1", B1)
    other = scene.replace(m=2.0, tolerance=1e-9)
    assert (other.pad.m, other.tolerance, other.pad.k3) == (2.0, 1e-9, 2e6)
    assert pytest.approx(2 * scene.pad.I, rel=1e-15) == other.pad.I
    changed = scene.replace(pad=B1.replace(mu=0.1), h=0.03)
    assert changed.pad.to_dict() == B1.replace(mu=0.1, h=0.03).to_dict()


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
    assert (back, back.pad.derived) == (scene, scene.pad.derived)
