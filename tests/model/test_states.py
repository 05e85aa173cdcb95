"""Contact states and transitions against Tables 1 and 2 of the article."""

import pickle

import numpy as np
import pytest

from squeal.article.transitions import transitions
from squeal.model.contact import (
    State,
    states,
)
from squeal.model.equations import PadModel
from tests.conftest import random_pad


def test_states_of_many_points_are_those_of_a_straight_face():
    places = np.linspace(-1, 1, 5)
    lines = np.random.default_rng(0).normal(size=(2000, 2, 1))
    met = {State(*touching) for touching in (lines[:, 0] + lines[:, 1] * places < 0).tolist()}
    assert met == set(states(5))
    assert len(transitions(5)) == 2 * len(states(5))  # a ring
    assert pickle.loads(pickle.dumps(states(5)[3])) == states(5)[3]


def table_2(p, q):
    """State of model B2 by Eq. (12) and Table 2; the level pad by the height of its face."""
    w, h, tilt = p.w, p.h, p.theta0 + q[2]
    X, Y = p.x0 + q[0], p.y0 + q[1]
    left = X - w * np.cos(tilt) + h * np.sin(tilt)
    right = X + w * np.cos(tilt) + h * np.sin(tilt)
    if tilt == 0.0:
        return "FC" if Y < 0.0 else "SS"
    low = Y - w * np.sin(tilt) - h * np.cos(tilt)  # of the leading edge
    lost = left + (-h - low) / np.tan(tilt)
    if left < lost < right:
        return "PC"
    return "FC" if (lost >= right) == (tilt > 0.0) else "SS"


@pytest.mark.parametrize("theta0", [0.0, 0.02, -0.02])
def test_penetrations_tell_the_rows_of_table_2(theta0):
    p = random_pad(4, theta0=theta0)
    model, random, seen = PadModel("B2", p), np.random.default_rng(0), set()
    for tilt in [0.0, *random.uniform(-0.3, 0.3, 300)]:
        q = (random.uniform(-1, 1), random.uniform(-0.3, 0.3), tilt - theta0)
        told = model.state_name(model.state_at(q))
        assert told == table_2(p, q)
        seen.add(told)
    assert seen == {"SS", "PC", "FC"}
