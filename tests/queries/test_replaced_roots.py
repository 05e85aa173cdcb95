"""Roots that the solver misses and the referee proves: they grow, with vectors of their own."""

from dataclasses import replace

import numpy as np
import pytest

import squeal
from squeal.io.scene import Scene, read_scene
from squeal.model.pad import Pad
from squeal.queries.systems import proofs
from tests.conftest import ROOT

COUPLED = [[1.0, -3.0], [-3.0, -2e6]]
# M, C, K, the number of growing modes, and the fastest root: of a row alone, whose coupling to the
# others moves it by less than rounding; of the flutter, det P = 0 with 60 digits
GROWING = [
    *[(np.diag([1, m]), None, COUPLED, 1, np.sqrt(2e6 / m)) for m in (1e-11, 1e-12, 1e-13, 1e-14)],
    (np.diag([1, 1e-20]), None, [[2, 1], [1, -0.5]], 1, np.sqrt(0.5e20)),
    (np.diag([1e-20, 1]), None, [[-0.5, 1], [1, 2]], 1, np.sqrt(0.5e20)),
    (np.eye(2), None, [[1, 0.1], [0.1, -1e20]], 1, 1e10),
    (
        np.diag([0.002, 0.01, 0.3]),
        np.diag([0, 3e-9, 3e9]),
        [[0, -2e12, -2e7], [2e8, 2e-8, -0.2], [5e-13, 2e-7, 1e-6]],
        1,
        1495348.7812211455 * (1 + 1j),
    ),
    (np.diag([5e-14, 5e-24]), [[-2e-9, 2e-4], [-2e-4, -0.03]], [[0, 0], [-50, 1e8]], 3, 6e21),
]


@pytest.mark.parametrize(("M", "C", "K", "count", "fastest"), GROWING)
def test_what_is_proved_to_grow_is_listed_as_unstable(M, C, K, count, fastest):
    found = squeal.eigenvalues(squeal.System(M, C, K))
    assert found.certified
    assert len(found.unstable) == count
    assert found.unstable[0].root == pytest.approx(fastest, rel=1e-6)
    assert found.verdict == found.unstable[0].kind
    assert all(root.residual < 1e-12 for root in found.eigenvalues)
    assert "unstable mode" in found.conclusion


LIGHT = squeal.System(
    np.diag([1, 1e-12]),
    K={"1": [[1, -3], [-3, 0]], "mu": [[0, 0], [0, -2e6]]},
    parameters={"mu": 1.0},
)


def test_a_replaced_root_has_its_own_derivative():
    found = squeal.sensitivity(LIGHT)
    fastest = int(np.argmax(np.real(found.at)))
    # lambda = sqrt(2e18 mu)
    assert found.slopes["mu"][fastest] == pytest.approx(np.sqrt(2e18) / 2, rel=1e-6)
    slow = int(np.argmax(np.imag(found.at)))
    # lambda = i sqrt(1 + 9 / (2e6 mu))
    assert found.slopes["mu"][slow].imag == pytest.approx(-4.5e-6 / 2, rel=1e-4)


def test_conditions_list_the_growth_that_the_solver_misses():
    found = squeal.conditions(LIGHT, {"mu": [0.5, 1.0]})
    assert [one.verdict for one in found.conditions] == ["divergence"] * 2
    assert [one.unstable for one in found.conditions] == [1, 1]


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_constraint_takes_roots_however_its_rows_are_mixed(damping):
    """det P = -(3 + c s / 4 + 2 s^2): no stiffness acts within the motion without mass, which holds
    another one. Rounding made the mass matrix regular, with two roots more at +-3e7."""
    M = [[2.0, 2, 2], [2, 3, 1], [2, 1, 3]]
    C = damping * np.array([[0.25, 0.25, 0.25], [0.25, 0.5, 0], [0.25, 0, 0.5]])
    K = [[3.0, 4, 2], [4, 4, 3], [2, 3, 2]]
    found = squeal.eigenvalues(squeal.System(M, C if damping else None, K))
    root = complex(-damping / 16, np.sqrt(1.5 - (damping / 16) ** 2))
    assert sorted(found.values, key=lambda s: s.imag) == pytest.approx([root.conjugate(), root])
    assert found.verdict == ("stable" if damping else "marginal")
    assert found.certified


def test_growth_of_other_roots_is_not_taken_for_that_of_listed_ones():
    """Sevenths leave M singular to rounding: exactly it has more roots, of 4e8 rad/s and beyond."""
    T = np.array([[-3.0, -2.0, -2.0], [-2.0, 2.0, 3.0], [1.0, -3.0, -3.0]]) / 7
    M = T.T @ np.diag([1.0, 0.0, 0.0]) @ T
    K = T.T @ np.array([[-1.0, 0.0, 1.0], [0.0, -1.0, -2.0], [1.0, 1.0, -2.0]]) @ T
    found = squeal.eigenvalues(squeal.System(M, K=K))
    # without the other two the first coordinate has the stiffness -3/4
    values = [root.value for root in found.eigenvalues]
    assert values == pytest.approx([np.sqrt(0.75), -np.sqrt(0.75)], rel=1e-9)
    assert not found.certified


def test_a_mode_that_grows_has_the_error_of_its_root():
    """Two real roots share a number: the one of 1e14 has an error, the small one has none."""
    M = [[1.0 + 1e-14, 1.0], [1.0, 1.0]]
    system = squeal.System(M, [[-1.0, -1.0], [-1.0, -3.0]], [[1.0, 1.0], [1.0, 2.0]])
    found = squeal.eigenvalues(system)
    largest, *others = found.eigenvalues
    found = replace(found, eigenvalues=(replace(largest, error=3.5e12), *others))
    table = str(found).split("unstable modes\n")[1].splitlines()[1:4]
    assert [row.split()[4] for row in table] == ["3.5e+12", "-", "-"]


@pytest.mark.parametrize("light", [1e-17, 1e-20, 1e-30])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_root_beyond_the_reach_of_rounding_is_no_slow_one(light, damping):
    """Complex matrices with a mass below rounding: the QZ algorithm gives that root no size."""
    M = np.array([[1.0, 0.0], [0.1, light]])
    C = damping * np.array([[1.0, 0.0], [2.0, 1.0]])
    K = np.array([[1.0, 0.1], [0.2, 1.0 + 0.01j]])
    found = squeal.eigenvalues(squeal.System(M, C if damping else None, K))
    # det P without the light mass, which changes the slow roots by less than 1e-15
    of_rows = [np.polymul([M[0, 0], C[0, 0], K[0, 0]], [C[1, 1], K[1, 1]])]
    of_rows.append(np.polymul([C[0, 1], K[0, 1]], [M[1, 0], C[1, 0], K[1, 0]]))
    slow = np.roots(np.polysub(*of_rows))
    assert len(found.values) > np.sum(slow.imag > 0.0)
    for value in found.values:
        assert abs(value) > 1e6 or np.abs(slow - value).min() < 1e-9


@pytest.mark.parametrize("mu", [0.1, 0.2, 0.3, 0.7])
def test_an_infinite_root_that_rounding_made_finite_is_no_divergence(mu):
    """det P = -(1 + mu) (2 + s^2). Of the rounded sum 1 + mu the mixed row of the
    multiplier keeps a rest, and roots of 1e7 with it."""
    K = {"1": [[2, 0, -2], [0, 2, 1], [-2, 1, 2]], "mu": [[0, 0, 0], [0, 0, 1], [0, 0, 0]]}
    M = [[1, 0, -1], [0, 1, 0], [-1, 0, 1]]
    system = squeal.System(M, K=K, parameters={"mu": mu})
    found = squeal.eigenvalues(system)
    assert not found.unstable
    assert found.verdict in (None, "marginal")
    (step,) = squeal.sweep(system, [mu]).steps
    assert step.verdict in (None, "marginal")


def test_shapes_of_a_pad_are_those_of_the_replaced_roots():
    """k4 is 10 decades above the other springs: the solver misses frequencies by a hundredth."""
    pad = Pad(
        m=3.623383917280777e-05, w=0.04, h=0.014, k1=8.7e6, k2=2.6e7, k3=8.7e6,
        k4=8.7e6 * 10.0**10.02350723397885, L1=0.8, L2=0.8, alpha1=np.pi / 2, alpha2=np.pi,
        mu=0.925, F_n=4500.0,
    )  # fmt: skip
    found = squeal.eigenvalues(Scene("B1", pad))
    listed = [root.frequency_hz for root in found.eigenvalues if root.value.imag > 0.0]
    assert found.proof["status"] == "proved"
    assert [shape["frequency_hz"] for shape in found.shapes["shapes"]] == listed


def test_unstable_modes_of_a_pad_are_those_of_the_replaced_roots(monkeypatch):
    scene = read_scene(ROOT / "workflow/scenes/b2-c.yaml")
    (mode,) = squeal.eigenvalues(scene).unstable
    assert mode.onset is not None
    refereed = proofs.refereed

    def with_other_roots(matrices, roots, judged, data):
        moved = tuple(replace(root, value=root.value * 1.01) for root in roots)
        return refereed(matrices, roots, judged, data)._replace(roots=moved)

    monkeypatch.setattr(proofs, "refereed", with_other_roots)
    (moved,) = squeal.eigenvalues(scene).unstable
    assert moved.root == pytest.approx(1.01 * mode.root)
    assert moved.onset is None  # no eigenvalue path ends there
