"""Without an upper end a friction is searched up to 2, another parameter to twice its value."""

import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.queries.options import upper_end

EYE = np.eye(2)
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def shaft(speed, name="Omega"):
    """Damping on the shaft: z'' + 3 z' + (1e4 - i W) z = 0 grows from W = 300 on."""
    return squeal.System(EYE, 3 * EYE, {"1": 1e4 * EYE, name: TURN}, {name: speed}, name)


@pytest.mark.parametrize("ask", ["thresholds", "report", "advise", "scatter", "sensitivity"])
def test_the_largest_speed_of_a_shaft_at_rest_is_asked_for(ask):
    more: dict[str, list[object]] = {
        "scatter": [{"a": {"within": 0.1}}],
        "sensitivity": ["threshold"],
    }
    system = squeal.System(
        EYE, 3 * EYE, {"a": EYE, "Omega": TURN}, {"a": 1e4, "Omega": 0.0}, "Omega"
    )
    with pytest.raises(InputError, match="high: missing; Omega is 0 now, so give the largest"):
        getattr(squeal, ask)(system, *more.get(ask, []))


def test_a_range_reaches_twice_the_value_at_which_a_system_runs():
    found = squeal.thresholds(shaft(160.0))
    assert found.high == 320.0
    assert [point.mu for point in found.points] == pytest.approx([300.0])
    page = squeal.report(shaft(310.0))
    assert page.thresholds.high == 620.0
    assert "No loss" not in page.loss


def test_the_end_of_a_friction_is_two_or_its_value():
    assert upper_end(shaft(0.4, "mu"), None) == 2.0
    assert upper_end(shaft(3.0, "mu"), None) == 3.0
    assert upper_end(shaft(0.0), 7.0) == 7.0
    pad = squeal.Pad(
        m=1.0,
        w=0.05,
        h=0.02,
        k1=1e6,
        k2=1e6,
        L1=0.5,
        L2=0.5,
        alpha1=2.3,
        alpha2=2.3,
        k_c=4e6,
        mu=2.5,
        F_n=500.0,
    )
    assert upper_end(squeal.Scene("B2", pad), None) == 2.5


def test_growth_that_scatters_needs_no_range():
    system = squeal.System(
        EYE, 3 * EYE, {"a": EYE, "Omega": TURN}, {"a": 1e4, "Omega": 0.5}, "Omega"
    )
    answer = squeal.scatter(system, {"a": {"within": 0.1}}, samples=8, of="growth")
    assert len(answer.rows) == 8
