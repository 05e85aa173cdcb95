"""Without an upper end only a friction coefficient has one: 2, or the subject's own value."""

from contextlib import suppress

import numpy as np
import pytest

import squeal
from squeal.errors import InputWarning
from squeal.queries.options import upper_end

EYE = np.eye(2)
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def shaft(speed, name="Omega"):
    """Damping on the shaft: z'' + 3 z' + (1e4 - i W) z = 0 grows from W = 300 on."""
    return squeal.System(EYE, 3 * EYE, {"1": 1e4 * EYE, name: TURN}, {name: speed}, name)


@pytest.mark.parametrize("ask", ["thresholds", "report", "advise", "scatter", "sensitivity"])
def test_a_speed_has_no_end_of_its_own_and_a_warning_says_so(ask):
    more: dict[str, list[object]] = {
        "scatter": [{"a": {"within": 0.1}}],
        "sensitivity": ["threshold"],
    }
    system = squeal.System(
        EYE, 3 * EYE, {"a": EYE, "Omega": TURN}, {"a": 1e4, "Omega": 0.0}, "Omega"
    )
    with (
        pytest.warns(InputWarning, match="high: left out, so that Omega is searched up to 2"),
        suppress(squeal.ComputationError),  # of a threshold that is not there
    ):
        getattr(squeal, ask)(system, *more.get(ask, []))


def test_a_range_reaches_the_value_at_which_a_system_runs():
    found = squeal.thresholds(shaft(310.0))
    assert found.high == 310.0
    assert [point.mu for point in found.points] == pytest.approx([300.0])
    page = squeal.report(shaft(310.0))
    assert page.thresholds.high == 310.0
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
