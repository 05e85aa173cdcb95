"""The referee on nonlinear pads, judged by their equations at 50 digits."""

import mpmath as mp
import numpy as np
import pytest

from squeal.equilibrium.damping import without_friction
from squeal.model.equations import linearise
from squeal.proof import prove_thresholds
from squeal.proof.pads import Line, PadBranch
from tests.conftest import scene_of
from tests.exact import Exact, discriminant

flint = pytest.importorskip("flint")


@pytest.fixture
def digits():
    with mp.workdps(50):
        yield


def branch(stem: str, high: float) -> PadBranch:
    model, start, _ = without_friction(scene_of(stem))
    return PadBranch(model, start, 0.0, high)


def test_taylor_models_hold_what_they_model(digits):
    """Functions of two of them, at random members, against 50 digits."""
    rng = np.random.default_rng(0)
    functions = [
        (lambda x, y: x * y * x - y, lambda x, y: x * y * x - y),
        (lambda x, y: x.sin() * y.cos(), lambda x, y: mp.sin(x) * mp.cos(y)),
        (lambda x, y: x / (y * y + 1), lambda x, y: x / (y * y + 1)),
        (lambda x, y: (x * x + 3.0).sqrt() + 2, lambda x, y: mp.sqrt(x * x + 3) + 2),
        (lambda x, y: 1 / (2.5 - y.sin()), lambda x, y: 1 / (mp.mpf("2.5") - mp.sin(y))),
    ]
    for _ in range(100):
        reach = 10.0 ** rng.uniform(-8.0, -1.0)
        d = mp.mpf(rng.uniform(-reach, reach))
        lines = []
        members = []
        for _ in range(2):
            c, s, r = (float(v) for v in rng.normal(size=3) * (1.0, 1.0, reach))
            w = reach * float(rng.random())
            rest = flint.arb(r, w)
            lines.append(Line(flint.arb(c), flint.arb(s), rest, flint.arb(0, reach)))
            members.append(c + s * d + r + mp.mpf(w) * mp.mpf(rng.uniform(-1.0, 1.0)))
        for of_lines, of_numbers in functions:
            line = of_lines(*lines)
            value = of_numbers(*members)
            # the model at this d, not only its range
            at = line.centre + line.slope * flint.arb(float(d)) + line.rest
            middle = float(at.mid())
            radius = mp.mpf(float((at - middle).abs_upper()))
            assert abs(value - middle) <= radius + mp.mpf(10) ** -15 * abs(middle)


def test_the_branch_holds_the_exact_equilibria(digits):
    """Through a change of contact: at 50 digits the equilibrium of each cell lies in it."""
    found = branch("b1-b", 2.0)
    assert len({cell.state for cell in found.cells}) == 2
    for cell in found.cells[:: max(1, len(found.cells) // 12)]:
        for mu in (cell.low, (cell.low + cell.high) / 2, cell.high):
            exact = Exact(scene_of("b1-b"), cell.state).equilibrium(
                cell.centre + cell.slope * (mu - cell.middle), mu
            )
            for place, value in zip(cell.places(mu, mu), exact, strict=True):
                ball = place.ball()
                miss = abs(value - mp.mpf(float(ball.mid())))
                assert miss <= mp.mpf(float(ball.rad())) + mp.mpf(10) ** -19


def test_first_loss_of_stability_of_a_nonlinear_pad(digits):
    """b1-a flutters where the discriminant at 50 digits vanishes."""
    found = branch("b1-a", 0.4)
    exact = Exact(scene_of("b1-a"), found.cells[0].state)
    cell = found.cells[0]
    guess = cell.centre + cell.slope * (0.3458 - cell.middle)
    _, onset = exact.critical(lambda q, mu: discriminant(exact.cubic(q, mu)), guess, 0.3458)
    value = float(onset)
    interval = (value - 1e-10, value + 1e-10)
    right = prove_thresholds(found, 0.0, 0.4, [interval], 1e-1, counts=[0, 2])
    assert right.status == "proved"
    moved = [(value + 1e-7, value + 2e-7)]
    assert prove_thresholds(found, 0.0, 0.4, moved, 1e-1).status == "refuted"
    assert prove_thresholds(found, 0.0, 0.4, [], 1e-1).status == "refuted"


def test_stiffness_over_balls_is_that_of_the_model():
    """K of a cell of no width is the model's own, to rounding."""
    for stem in ("b1-a", "b2-b", "b2-c", "b2-d"):
        model, start, state = without_friction(scene_of(stem))
        found = PadBranch(model, start, 0.0, 0.1)
        systems = found(0.0, 0.0)
        assert isinstance(systems, tuple)
        (system,) = systems
        K = linearise(model, start, state).K
        assert np.all(np.abs(system.K.mid - K) <= system.K.rad + 1e-11 * np.abs(K).max())


def test_a_branch_that_ends_is_open():
    """A start that is none, and friction outside the range."""
    model, start, _ = without_friction(scene_of("b1-a"))
    nowhere = PadBranch(model, start + 1e3, 0.0, 0.1)
    assert prove_thresholds(nowhere, 0.0, 0.1, [], 1.0).status == "open"
    found = PadBranch(model, start, 0.0, 0.1)
    assert prove_thresholds(found, 0.0, 0.2, [], 1.0).status == "open"
