"""Motion on many springs: model B1 as two of them, the line contact as their limit."""

import dataclasses

import pytest

from squeal.io.scene import Scene, read_scene
from squeal.model import contact
from squeal.model.contact import ContactModel, Formulation, PointContact, Spring
from squeal.model.equations import PadModel
from squeal.simulation.hybrid import whole
from squeal.simulation.run import in_natural_units, make_integrator, simulate
from tests.conftest import SCENES, needs_heyoka
from tests.simulation.closed import bouncing, upright


def on_springs(scene, count, **more):
    return dataclasses.replace(scene, model="BN", formulation=Formulation(springs=count), **more)


@dataclasses.dataclass(frozen=True)
class _Halves(PointContact):
    """Model B1 written as two halves of one stiffness."""

    parameters = ("k_c",)
    springs = (Spring(-1.0, "k_c", 0.5), Spring(1.0, "k_c", 0.5))


@pytest.mark.parametrize("case", "abcd")
@needs_heyoka
def test_two_springs_at_the_edges_are_model_b1(case, monkeypatch):
    halves = ContactModel("halves", "two halves of a stiffness", _Halves)
    monkeypatch.setitem(contact.MODELS, "halves", halves)
    scene = read_scene(SCENES / f"b1-{case}.yaml")
    scene = scene.replace(k4=scene.pad.k3)
    units, model, start, stop = in_natural_units(scene)
    k = 2.0 * model.pad.k3
    other = PadModel("halves", model.pad.replace(k3=None, k4=None, k_c=k))
    ends, times = [], []
    for one in (model, other):
        integrator = make_integrator(one, scene.tolerance, "heyoka")
        course = whole(one, integrator, units, start, stop)
        ends.append(course.end)
        times.append(course.t)
    assert len(times[0]) == len(times[1]) > 10
    assert times[1] == pytest.approx(times[0], rel=1e-12)
    assert ends[1] == pytest.approx(ends[0], rel=1e-12)


SPRUNG = {"k3": None, "k4": None, "k_c": 1e6}


def test_a_level_pad_touches_with_all_springs_in_the_same_instant():
    pad, height, count = upright(**SPRUNG), 1e-3, 6
    touch, back, _ = bouncing(pad, height)
    scene = Scene(
        "BN", pad, Formulation(springs=count), (0, height, 0, 0, 0, 0), 2.5 * touch + back, 2
    )
    run = simulate(scene)
    times = [e.t for e in run.events]
    assert times == pytest.approx([touch] * count + [touch + back] * count, rel=1e-11)
    assert [e.source for e in run.events][:2] == ["SS", "PC"]
    assert run.events[count - 1].target == "FC"
    assert run.shares["FC"] == pytest.approx(back / scene.stop, rel=1e-10)
    assert run.shares["PC"] == pytest.approx(0.0, abs=1e-12)
