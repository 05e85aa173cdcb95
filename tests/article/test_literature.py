"""The systems of the literature: every row, and the systems against 34-digit arithmetic."""

import mpmath as mp
import pytest

from squeal.article.literature import comparison
from squeal.article.results.stability import DERIVED, MATRICES, READ
from tests.linear.conftest import exact_damped


@pytest.fixture(scope="module")
def rows():
    return comparison.literature_rows()


def test_every_row_agrees(rows):
    wrong = [
        f"{row.name}, {row.quantity}: {row.expected} expected, {row.computed} computed"
        for row in rows
        if not row.agrees
    ]
    assert not wrong


def test_every_system_and_all_provenances_occur(rows):
    assert {row.name for row in rows} == {
        comparison.literature_system(name).name for name in comparison.SYSTEMS
    }
    assert {row.provenance for row in rows} == {DERIVED, MATRICES, READ}
    assert all(comparison.literature_system(name).reference for name in comparison.SYSTEMS)


def test_wing_to_the_last_printed_digit():
    M, C, K = comparison.literature_system("wing")(0.0)
    assert C is not None
    reference = exact_damped(M, C, K)
    for value in comparison.WING:
        nearest = min(reference, key=lambda r: abs(r - mp.mpc(value)))
        assert abs(complex(nearest).real - value.real) < 6e-9
        assert abs(complex(nearest).imag - value.imag) < 6e-9


def test_damping_destabilises_brake_and_pendulum(rows):
    critical = {row.quantity: float(row.computed) for row in rows if "critical" in row.quantity}
    assert critical["critical mu, damping ratios 0.01 and 0.02"] < critical["critical mu, undamped"]
    assert critical["critical load, damping 0.01"] < 0.71 * critical["critical load, undamped"]


def test_disagreement_is_seen(rows):
    row = next(row for row in rows if row.expected == "none")
    assert row.error == 0.0
    system = comparison.literature_system("wing")
    wrong = comparison.compare(system, "y", 1.0, None)
    assert not wrong.agrees
    assert wrong.error is None
    assert not comparison.compare(system, "y", 1.0, 1.0 + 1e-11).agrees
    assert comparison.compare(system, "y", 1.0, 1.0 + 1e-13).agrees
