"""On which side motions begin, and what refuses them, by pads on the surface and false motion."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import FULL, NONE
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Coefficients
from squeal.simulation.hybrid import (
    COLLAPSED,
    LIMITS,
    ContactChanges,
    Limit,
    ModelEnd,
    Segment,
    first_contact,
    integrate,
    state_of,
)
from squeal.simulation.run import in_natural_units
from tests.conftest import random_pad
from tests.simulation.closed import upright


@pytest.mark.parametrize("size", [1.0, 1e3, 1e-3])
def test_an_edge_on_the_surface_to_rounding_goes_with_its_motion(size):
    """One a hundred times as far beside it stays on its side at any speed."""
    soon = 1e-8  # before any load turns it
    for seed in range(60):
        r = np.random.default_rng(seed)
        pad = random_pad(seed, "B1", y0=size * r.uniform(-1, 1), h=10 ** r.uniform(-2, 2))
        model = PadModel("B1", pad.replace(w=10 ** r.uniform(-2, 2)))
        turn = r.uniform(-1.0, 1.0)
        state = np.array([0.0, 0.0, turn * model.pad.w, *r.uniform(-1.0, 1.0, 3)])
        for edge in (0, 1):
            state[1] -= model.gaps(model.c.xy_theta(state))[edge]
            ahead = model.gaps(model.c.xy_theta(state[:3] + 1e-8 * state[3:]))
            moved = (ahead - model.gaps(model.c.xy_theta(state)))[edge]
            assert first_contact(model, state, soon)[edge] == (moved < 0)
            off = 500 * np.finfo(float).eps * (model.pad.h + model.pad.w + abs(state[1]) + size)
            for side in (off, -off):
                beside = state + side * np.eye(6)[1]
                assert first_contact(model, beside, soon)[edge] == (side < 0)


@pytest.mark.parametrize(("rate", "state"), [(1.0, FULL), (-1.0, NONE)])
def test_a_pad_that_slides_on_inclined_springs_begins_as_they_will_push_it(rate, state):
    """Without a load y'' = -k sin(a) cos(a) x, so that y begins as minus the cube of time."""
    pad = upright(F_n=0.0, h=1e-9, alpha1=0.8, alpha2=math.pi - 0.8, I=1e3)
    scene = Scene("B1", pad, initial=(0, 0, 0, rate, 0, 0), stop=1.0, samples=2)
    _, model, start, _ = in_natural_units(scene)
    assert state_of(first_contact(model, start)) == state


UNIT = Units(*np.ones(len(Units.__dataclass_fields__)).tolist())


def falls(**changes):
    """A pad without springs, begun above the surface, and a false integrator that hands over the
    same segment again and again, with some of its parts changed."""
    model = PadModel("B1", upright(k1=0.0, k2=0.0))
    none = np.zeros((2, 1), dtype=int)
    high = np.array([[0.0], [0.5], [0.0], [0.0], [0.0], [0.0]])
    segment = Segment(
        law=model.law,
        c=Coefficients(*np.reshape(model.c, (-1, 1))),
        t0=np.zeros(1),
        t1=np.full(1, 0.5),
        first_contact=none,
        end=high,
        changes=ContactChanges(none[0, :0], none[0, :0], np.empty(0), high[:, :0]),
        step_count=np.array([7]),
        limit=np.array([Limit.NONE]),
    )
    wrong: Any = SimpleNamespace(run=lambda *_: replace(segment, **changes))
    return integrate(model, wrong, UNIT, high[:, 0], 0.5)


def at(height):
    return np.array([[0.0], [height], [0.0], [0.0], [0.0], [0.0]])


def test_courses_without_progress_or_with_a_missed_change_are_refused():
    assert falls()[2:] == (7, 0)
    assert falls(end=at(-5e-7))[2:] == (7, 0)
    with pytest.raises(ComputationError, match="a contact change was missed before t"):
        falls(end=at(-2e-6))
    with pytest.raises(ComputationError, match="a contact change was missed before t"):
        falls(end=at(2e-6), first_contact=np.ones((2, 1), dtype=int))
    with pytest.raises(ComputationError, match="no progress beyond t"):
        falls(t1=np.full(1, 1e-12))
    for limit, words in LIMITS.items():
        with pytest.raises(ModelEnd, match=f"{words} at t = 0.5 s"):
            falls(limit=np.array([limit]))
    assert COLLAPSED < 1e-3
