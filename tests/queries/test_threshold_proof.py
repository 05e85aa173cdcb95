"""What is said to be proved of thresholds, against onsets that are known in closed form."""

import importlib
import math
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest

import squeal
from squeal.equilibrium.damping import without_friction
from squeal.errors import InputError
from squeal.queries.ranges import pad_statement
from squeal.queries.thresholds import critical_friction, with_statement
from tests.conftest import scene_of
from tests.known import known_system

pytest.importorskip("flint")


def flutter(apart: float) -> squeal.TermSystem:
    """Two pads that flutter from 0.75 and from 0.75 (1 + apart)."""
    K0 = np.kron(np.eye(2), [[2.0, -1.0], [-1.0, 2.0]])
    K1 = np.zeros((4, 4))
    K1[0, 1] = 4.0 / 3.0
    K1[2, 3] = 4.0 / 3.0 / (1.0 + apart)
    return squeal.System(np.eye(4), K={"1": K0, "mu": K1})


@pytest.mark.parametrize("apart", [0.0, 1e-7, 1e-3])
def test_thresholds_of_a_small_system_are_proved(apart):
    answer = squeal.thresholds(flutter(apart), prove=True)
    assert answer.proof["status"] == "proved"
    assert answer.certified
    assert answer.proof["extent"] == [0.0, 2.0]
    for onset in (0.75, 0.75 * (1.0 + apart)):
        assert any(c.interval[0] <= onset <= c.interval[1] for c in answer.crossings)
    assert answer.proof_line.startswith("proved: no other mode grows by more than")


def test_the_interval_of_a_threshold_is_as_wide_as_the_page_says():
    """By 1e-10 of its value, by 1e-13 of the range, or as far as slow growth hides.

    The onsets are no doubles: one that is found to all digits has an interval of neighbours.
    """
    coupling = [[0.0, 1.0], [-1.0, 0.0]]
    for onset, margin in ((0.3, 0.3e-10), (1e-6, 2e-13)):
        system = squeal.System(np.eye(2), K={"1": np.diag([1.0, 1.0 + 2 * onset]), "mu": coupling})
        answer = squeal.thresholds(system, 2.0)
        ((low, high),) = [crossing.interval for crossing in answer.crossings]
        assert answer.proof["status"] == "proved"
        assert onset - 2 * margin < low < onset - 0.9 * margin
        assert onset + 0.9 * margin < high < onset + 2 * margin
    slow = squeal.System([[1.0]], {"-(mu - 1)**3": [[1.0]]}, [[1.0]])
    answer = squeal.thresholds(slow, 2.0)
    ((low, high),) = [crossing.interval for crossing in answer.crossings]
    assert answer.proof["status"] == "proved"
    assert 1.0 - 1e-3 < low < 1.0 - 1e-6 < 1.0 + 1e-6 < high < 1.0 + 1e-3


def test_factors_are_evaluated_over_balls():
    """mu**2/4 + mu/2 - 1/16 in place of mu: the onset moves to a root of the quadratic."""
    K = {"1": [[2, -1], [-1, 2]], "mu**2/4 + mu/2 - 1/16": [[0, 4 / 3], [0, 0]]}
    answer = squeal.thresholds(squeal.System(np.eye(2), K=K), prove=True)
    assert answer.proof["status"] == "proved"
    onset = -1.0 + np.sqrt(1.0 + 4.0 * (0.75 + 1.0 / 16.0))
    (crossing,) = answer.crossings
    assert crossing.interval[0] <= onset <= crossing.interval[1]


@pytest.mark.parametrize("stem", ["b1-a", "b1-d", "b2-d", "b3"])
def test_first_loss_of_a_pad_is_proved(stem):
    answer = squeal.thresholds(scene_of(stem), prove=True)
    assert answer.proof["status"] == "proved", answer.proof_line
    first = answer.first
    assert answer.proof["extent"][1] > (first.mu if first else 1.999)


def test_a_pad_whose_loss_is_left_out_is_open():
    """The referee disagrees with a list without it, and with one that is moved."""
    scene = scene_of("b1-a")
    answer = critical_friction(scene)
    model, start, _ = without_friction(scene)
    for crossings in ((), tuple(_moved(one) for one in answer.crossings)):
        said, places = pad_statement(model, start, crossings, 0.4, None, 1e4, None)
        assert said.status == "open"
        assert "disagrees" in said.reason
        shown = with_statement(answer, said, places)
        assert not shown.certified
        assert shown.proof["growth_below"] is None


def _moved(crossing):
    low, high = (end * (1.0 + 1e-6) for end in crossing.interval)
    return replace(crossing, mu=crossing.mu * (1.0 + 1e-6), interval=(low, high))


def test_a_window_that_the_search_overlooks_is_searched_again():
    """K = [[2, f], [1, 2]] grows where f < 0: over 1.4e-6 of the range, in which no step ends."""
    centre = 0.5224
    width = 1e-6
    bump = f"1 - 1.5*{width**2!r}/((mu - {centre})**2 + {width**2!r})"
    K = {"1": [[2.0, 0.0], [1.0, 2.0]], bump: [[0.0, 1.0], [0.0, 0.0]]}
    system = squeal.System(np.eye(2), K=K, parameters={"mu": 0.0})
    assert not squeal.thresholds(system, 1.0, prove=False).crossings
    answer = squeal.thresholds(system, 1.0)
    ends = [centre - width / np.sqrt(2.0), centre + width / np.sqrt(2.0)]
    assert [one.mu for one in answer.crossings] == pytest.approx(ends, abs=1e-10)
    assert (answer.certified, answer.proof["status"]) == (True, "proved")


@pytest.mark.parametrize(("rows", "damped"), [(8, True), (44, False)])
def test_what_the_referee_refutes_does_not_reach_the_user(rows, damped, monkeypatch):
    """The search adds a threshold at first: of 8 rows the range is refuted, of 44 a count."""
    monkeypatch.setattr("squeal.queries.ranges.exact_range", lambda *_: None)
    module = importlib.import_module("squeal.queries.systems.thresholds")
    whole = module.thresholds
    system, expected = known_system(rows, np.random.default_rng(3), damped)
    asked: list[tuple[float, ...]] = []

    def partial(*given, **options):
        found = whole(*given, **options)
        asked.append(given[2])
        if len(asked) > 1:
            return found
        found.crossings.append(replace(found.crossings[0], direction="down"))
        return found

    monkeypatch.setattr(module, "thresholds", partial)
    answer = squeal.thresholds(system)
    assert len(asked) == 2
    assert len(asked[1]) == 1
    assert answer.certified == (rows == 8)  # the others are counted
    values = sorted(event[0] for event in expected)
    assert [one.mu for one in answer.crossings] == pytest.approx(values, rel=1e-9)


@pytest.mark.parametrize("damped", [False, True])
def test_exact_thresholds_take_the_place_of_refuted_ones(damped, monkeypatch):
    module = importlib.import_module("squeal.queries.systems.thresholds")
    whole = module.thresholds
    searches = []

    def with_another(*given, **options):
        found = whole(*given, **options)
        searches.append(given)
        found.crossings.append(replace(found.crossings[0], direction="down"))
        return found

    monkeypatch.setattr(module, "thresholds", with_another)
    system, expected = known_system(6, np.random.default_rng(3), damped)
    answer = squeal.thresholds(system)
    assert (len(searches), answer.certified) == (1, True)
    values = sorted(event[0] for event in expected)
    assert [one.mu for one in answer.crossings] == pytest.approx(values, rel=1e-13)


def test_without_flint_it_is_open(monkeypatch):
    for module in ("loads", "terms"):
        monkeypatch.setattr(importlib.import_module(f"squeal.proof.{module}"), "flint", None)
    for subject in (scene_of("b1-a"), flutter(1e-3)):
        answer = squeal.thresholds(subject, prove=True)
        assert answer.proof["status"] == "open"
        assert not answer.certified
        assert "python-flint is not installed" in answer.proof_line


def test_an_interval_that_may_hold_more_proves_nothing():
    """Windows of growth 1e-7 wide, one of which the interval of another threshold would hold."""
    gyroscopic = np.zeros((4, 4))
    gyroscopic[:2, :2] = [[0.0, -2.0], [2.0, 0.0]]
    soft = np.diag([-1.0, -1.0, 206.75, 100.0])
    window = f"(1 - 2/(1 + {4.0**23!r}*(mu - 0.03515625)**2))"
    damped_window = f"(1 - 2/(1 + {4.0**24!r}*(mu - 0.0123)**2))"
    C = {
        "1": gyroscopic,
        "(mu - 0.1259765625)**2": np.diag([0.0, 0.0, 0.0625, 0.0]),
        damped_window: np.diag([0.0, 0.0, 0.0, 1.0]),
    }
    K = {"1": soft, window: np.diag([4.0, 4.0, 0.0, 0.0])}
    answer = squeal.thresholds(squeal.System(np.eye(4), C=C, K=K), 0.25)
    changes = [0.01229994, 0.01230006, 0.03515613, 0.03515637]
    is_complete = len(answer.crossings) == len(changes)
    assert is_complete or not answer.certified


@pytest.mark.parametrize("damper", [0.0, 1e3, 1e6, 1e9, 1e12])
def test_a_strong_damper_hides_no_slow_growth(damper):
    """Two modes of 100 rad/s flutter where friction outdoes their damping, at 1/2; the third row
    moves that by less than a thousandth."""
    K0 = np.array([[1e4, 0.0, -50.0], [0.0, 1e4, -50.0], [-50.0, -50.0, 2e4]])
    K1 = np.array([[0.0, 100.0, 0.0], [-100.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    damping = np.diag([0.5, 0.5, damper])
    answer = squeal.thresholds(squeal.System(np.eye(3), damping, {"1": K0, "mu": K1}))
    if damper < 1e7:
        assert answer.certified
    if answer.certified:
        (crossing,) = answer.crossings
        assert crossing.mu == pytest.approx(0.5, abs=1e-3)
        assert answer.proof["growth_below"] <= 1.01e-4


def pressed():
    """A plate of one node, pressed on a base by a spring of 3 N/m, and the stiffness of both."""
    ways = np.array([0, 2])
    node = np.zeros(2, dtype=int)
    plate_stiffness = np.array([[4.0, -1.0], [-1.0, 1.0]])
    base = squeal.Component(squeal.System(np.eye(2), K=9.0 * np.eye(2), name="base"), node, ways)
    plate = squeal.Component(
        squeal.System(np.eye(2), K=plate_stiffness, name="plate"), node, ways, load=[0.0, -1.0]
    )
    contact = squeal.Contact(("base", "plate"), [(0, 0)], (0, 0, 1), 3.0, sliding=(1, 0, 0))
    K = np.zeros((4, 4))
    K[:2, :2] = 9.0 * np.eye(2)
    K[2:, 2:] = plate_stiffness
    return squeal.assemble([base, plate], [contact], {"mu": 0.0}), K


def test_thresholds_of_components_that_were_not_reduced_are_proved():
    assembly, K = pressed()
    normal = np.array([0.0, -1.0, 0.0, 1.0])
    tangent = np.array([-1.0, 0.0, 1.0, 0.0])
    low = 0.0
    high = 1.0
    for _ in range(60):
        mu = (low + high) / 2.0
        pushed = 3.0 * np.outer(normal + mu * tangent, normal)
        if np.linalg.eigvals(K + pushed).imag.any():
            high = mu
        else:
            low = mu
    answer = squeal.thresholds(assembly, 3.0, prove=True)
    assert answer.proof["status"] == "proved"
    (crossing,) = answer.crossings
    assert crossing.interval[0] <= low <= high <= crossing.interval[1]


def test_what_cannot_be_proved_says_why():
    stiffness = np.diag([2.0, 2.0, 2.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    K = {"1": stiffness, "mu": np.diag([1.0, 0.0, 0.0])}
    chain = squeal.Component(squeal.System(np.eye(3), K=K, name="chain"), [1, 2, 3], [0, 0, 0])
    base = squeal.Component(squeal.System([[1.0]], K=[[5.0]], name="base"), [1], [0])
    joint = squeal.Contact(("chain", "base"), [(1, 1)], (1, 0, 0), stiffness=1.0, bonded=True)
    assembly = squeal.assemble([chain, base], [joint], cutoff=1.0)
    with pytest.raises(InputError, match="components that were reduced"):
        squeal.thresholds(assembly, prove=True)
    guessed = squeal.System(np.eye(2), K=np.eye(2), assumptions=("rows 1 and 2 are supports",))
    with pytest.raises(InputError, match="what was assumed: rows 1 and 2"):
        squeal.thresholds(guessed, prove=True)


def coincident(*losses, factor="mu"):
    """Uncoupled rows and pairs that lose (sign 1) or regain (-1) stability, each at its own value.

    A kind is "divergence", K = value - factor, "flutter", C = value - factor, or "undamped
    flutter".
    """
    n = sum(2 if kind.startswith("undamped") else 1 for kind, _, _ in losses)
    C = {"1": np.zeros((n, n)), factor: np.zeros((n, n))}
    K = {"1": np.zeros((n, n)), factor: np.zeros((n, n))}
    row = 0
    for kind, sign, value in losses:
        if kind == "undamped flutter":
            K["1"][row : row + 2, row : row + 2] = [[2.0, -sign * value], [-1.0, 2.0]]
            K[factor][row, row + 1] = sign
            row += 2
            continue
        of_kind = K if kind == "divergence" else C
        of_kind["1"][row, row] = sign * value
        of_kind[factor][row, row] = -sign
        other = C if kind == "divergence" else K
        other["1"][row, row] = 1.0
        row += 1
    return squeal.System(np.eye(n), C=C, K=K)


NEARBY = 0.75 * (1.0 + 1e-13)


COINCIDENT = [
    ([("flutter", 1, 0.75), ("divergence", 1, NEARBY)], "several kinds or directions"),
    ([("divergence", 1, 0.75), ("divergence", -1, NEARBY), ("flutter", 1, 0.75)], "cancel"),
    ([("divergence", 1, 0.75), ("undamped flutter", -1, NEARBY), ("flutter", 1, 0.75)], ""),
]


@pytest.mark.parametrize(("losses", "reason"), COINCIDENT[:2])
def test_what_one_interval_does_not_tell_apart_is_not_proved(losses, reason):
    """A factor of so large a power is left to the enclosure."""
    answer = squeal.thresholds(coincident(*losses, factor="mu + (mu - 0.75)**10"))
    assert (answer.certified, answer.proof["status"]) == (False, "open")
    assert reason in answer.proof["reason"]


@pytest.mark.parametrize("losses", [losses for losses, _ in COINCIDENT])
def test_exact_thresholds_are_told_apart(losses):
    answer = squeal.thresholds(coincident(*losses))
    assert (answer.certified, answer.proof["by"]) == (True, "exact")
    left = list(answer.crossings)
    for kind, sign, value in losses:
        held = [c for c in left if c.interval[0] <= value <= c.interval[1]]
        crossing = next(c for c in held if c.kind == kind.split()[-1])
        assert crossing.direction == ("up" if sign > 0 else "down")
        left.remove(crossing)
    assert not left


def circulatory(factor):
    """Two equal rows, coupled by a skew stiffness x: they grow wherever x is other than zero."""
    return squeal.System(np.eye(2), K={"1": 4.0 * np.eye(2), factor: [[0.0, 1.0], [-1.0, 0.0]]})


@pytest.mark.parametrize("factor", ["mu**2", "mu**3", "mu / (1 + mu)", "4/3 * mu * (2 + mu)"])
def test_growth_from_the_low_end_on_is_proved(factor):
    answer = squeal.thresholds(circulatory(factor))
    (crossing,) = answer.crossings
    assert (crossing.mu, crossing.kind, crossing.direction) == (0.0, "flutter", "up")
    assert (answer.certified, answer.proof["by"]) == (True, "exact")


@pytest.mark.parametrize(("factor", "touch"), [("mu - 0.3", 0.3), ("1 - 0.75 / (mu + 0.25)", 0.5)])
def test_growth_that_pauses_at_one_value_is_proved(factor, touch):
    answer = squeal.thresholds(circulatory(factor), 1.0)
    assert [(c.mu, c.direction) for c in answer.crossings] == [(touch, "down"), (touch, "up")]
    assert answer.certified
    assert not answer.points  # the verdict is flutter on both sides


@pytest.mark.parametrize("factor", ["mu**2 - 2", "(mu**4)**0.5 - 2", "mu**9 - 2", "2**0.5 - mu"])
def test_growth_that_pauses_where_no_count_is_made_is_open_there(factor):
    answer = squeal.thresholds(circulatory(factor), 2.0)
    assert (answer.certified, answer.proof["status"]) == (False, "open")
    pause = 2.0 ** (1 / 9) if "9" in factor else 2.0**0.5
    assert answer.proof["where"] == pytest.approx(pause, abs=1e-5)


def test_a_factor_with_the_parameter_below_has_exact_thresholds():
    """Row 1, without row 2, q'' + (1/mu - 4/3) q' + 4 q = 0; row 2 is a spring and a force of q."""
    one = np.diag([1.0, 0.0])
    K = np.array([[4.0, 0.0], [1.0, 2.0**-60]])
    C = {"1/mu": one, "4/3": -one}
    answer = squeal.thresholds(squeal.System(one, C, K, parameters={"mu": 0.5}), 2.0, low=0.25)
    (crossing,) = answer.crossings
    assert crossing.direction == "up"
    assert crossing.mu == pytest.approx(0.75, rel=1e-15)
    assert answer.certified


@pytest.mark.parametrize("free_rows", [0, 1, 2])
def test_a_shaft_beside_free_motions_is_proved(free_rows):
    """s^2 +- i s + 1 - 2 mu: both pairs of the shaft leave the axis where 1 - 2 mu is -1/4. Free
    motions of other rows may grow or not, as far as rounding tells, on both sides of that."""
    n = 2 + free_rows
    C = np.zeros((n, n))
    C[:2, :2] = [[0.0, 1.0], [-1.0, 0.0]]
    shaft = np.diag([1.0] * 2 + [0.0] * free_rows)
    answer = squeal.thresholds(squeal.System(np.eye(n), C, {"1": shaft, "mu": -2.0 * shaft}))
    (crossing,) = answer.crossings
    assert crossing.mu == pytest.approx(0.625, rel=1e-12)
    assert answer.proof["status"] == "proved"


def test_twins_of_one_kind_and_direction_are_proved():
    answer = squeal.thresholds(coincident(("flutter", 1, 0.75), ("flutter", 1, NEARBY)))
    assert answer.proof["status"] == "proved"
    assert len(answer.crossings) == 2


COMPLIANCE = 1e-11


def constrained(constraints):
    """Two masses, q1 + q2 = compliance times each force: q1 is held by 2 and mu times the first
    force, q2 by 3 and the sum of the forces. At rest mu / 2 - constraints / 3 is the compliance."""
    n = 2 + constraints
    K = np.diag([2.0, 3.0] + [-COMPLIANCE] * constraints)
    K[1, 2:] = 1.0
    K[2:, :2] = 1.0
    friction = np.zeros((n, n))
    friction[0, 2] = -1.0
    masses = np.diag([1.0, 1.0] + [0.0] * constraints)
    return masses, {"1": K, "mu": friction}


@pytest.mark.parametrize("constraints", [1, 2])
@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("high", [2.0, 8.0, 100.0])
def test_stiff_constraints_with_friction_have_one_threshold(constraints, damping, high):
    """Sixteen were listed up to 100, after 20 s, and an interval of +-1.4 up to 2."""
    masses, K = constrained(constraints)
    C = damping * masses if damping else None
    answer = squeal.thresholds(squeal.System(masses, C, K), low=0.0, high=high)
    (crossing,) = answer.crossings
    assert (answer.certified, crossing.kind, crossing.direction) == (True, "divergence", "up")
    assert crossing.mu == pytest.approx(2 * (constraints / 3 + COMPLIANCE), rel=1e-15)
    assert [point.mu for point in answer.points] == [crossing.mu]


def test_free_motions_beside_massless_rows_have_their_thresholds():
    """s (s + 1 - 3 mu / 4) grows from 4/3 on; a free motion that nothing damps does not grow."""
    mass = np.diag([1.0, 0.0])
    spring = np.diag([0.0, 1.0])
    slowing = {"1": np.eye(2), "mu": -0.75 * mass}
    (crossing,) = squeal.thresholds(squeal.System(mass, slowing, {"1": spring})).crossings
    assert crossing.mu == pytest.approx(4 / 3, rel=1e-15)
    answer = squeal.thresholds(squeal.System(mass, None, {"1": spring, "mu": spring}))
    assert (answer.certified, answer.crossings, answer.verdict) == (True, (), "marginal")


def test_a_threshold_at_the_end_of_the_range_is_listed():
    """K = [[2, -mu], [-1, 2]] beside a spring without mass: flutter below 0."""
    mass = np.diag([1.0, 1.0, 0.0])
    K = np.array([[2.0, 0.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    friction = np.zeros((3, 3))
    friction[0, 1] = 1.0
    system = squeal.System(mass, None, {"1": K, "mu": friction})
    (begins,) = squeal.thresholds(system, low=0.0).points
    (ends,) = squeal.thresholds(system, low=-1.0, high=0.0).crossings
    assert (begins.mu, begins.kind) == (0.0, "flutter")
    assert ends.interval[0] <= 0.0 <= ends.interval[1]


@pytest.mark.parametrize("high", [2.0, 1e12, 1e14])
def test_a_pair_that_begins_to_grow_far_below_the_end_of_the_range_is_one_flutter(high):
    """lambda^2 + (1 - mu) lambda + 2 = 0: at mu = 1 lambda = +- i sqrt(2), from 1 + sqrt(8) on both
    are real."""
    answer = squeal.thresholds(squeal.System([[1.0]], {"1 - mu": [[1.0]]}, [[2.0]]), high)
    (crossing,) = answer.crossings
    assert answer.certified
    assert (crossing.mu, crossing.kind, crossing.mode) == (1.0, "flutter", 1)
    assert crossing.frequency_hz == pytest.approx(math.sqrt(2.0) / math.tau, rel=1e-9)
    first, *later = answer.points
    assert (first.kind, first.frequency_hz) == ("flutter", crossing.frequency_hz)
    assert [point.kind for point in later] == ["divergence"] * (high > 1.0 + math.sqrt(8.0))


@pytest.mark.parametrize("k", [1e-4, 1e-12, 1e-14])
def test_a_slow_pair_beside_a_constraint_has_its_frequency(k):
    """lambda^2 + (1 - mu) lambda + k = 0 is a pair for |mu - 1| < 2 sqrt(k) only."""
    damper = np.diag([1.0, 0.0, 0.0])
    K = [[k, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0]]
    answer = squeal.thresholds(squeal.System(np.diag([1.0, 1.0, 0.0]), {"1 - mu": damper}, K), 1e6)
    (crossing,) = answer.crossings
    assert answer.certified
    assert crossing.kind == "flutter"
    assert crossing.frequency_hz == pytest.approx(math.sqrt(k) / math.tau, rel=1e-9)


def test_a_pair_through_zero_is_flutter_without_a_frequency():
    """lambda^2 - mu lambda + mu = 0: two real roots become a pair at mu = 0."""
    answer = squeal.thresholds(squeal.System([[1.0]], {"-mu": [[1.0]]}, {"mu": [[1.0]]}), 2.0, -1.0)
    found = [(c.mu, c.kind, c.direction, c.frequency_hz) for c in answer.crossings]
    assert found == [(0.0, "divergence", "down", 0.0), (0.0, "flutter", "up", 0.0)]
    assert answer.certified


def last_digit(number: float) -> float:
    """One unit of the last digit that a number is printed with."""
    return 10.0 ** int(Decimal(repr(number)).as_tuple().exponent)


def hidden(left, right, stiffnesses, dampings):
    """Separate oscillators of mass 1, left and right multiplied by matrices of determinant one.

    dampings: formula of the damping of each.
    """
    left, right = np.array(left), np.array(right)
    C = {}
    for k, formula in enumerate(dampings):
        C[formula] = np.outer(left[:, k], right[k])
    return squeal.System(left @ right, C, left @ np.diag(stiffnesses) @ right)


SLOW = [
    (
        [[1, 1], [0, 1]], [[1, -1], [-1, 2]], [8.0, 1.000444171950221e-11],
        ["(0.1298828125-mu)/(mu+5.0)", "2*(mu-0.27734375)*(mu-0.7685546875)"],
    ),
    (
        [[1, 0], [0, 1]], [[2, 1], [1, 1]], [3.0, 8.284581574100567e-12],
        ["3*(0.8642578125-mu)/(mu+5)", "0.03*(0.259765625-mu)/(mu+5)"],
    ),
    (
        [[2, 1], [1, 1]], [[1, 0], [0, 1]], [8.0, 4.0e-12],
        ["(0.375-mu)/(mu+5)", "0.05*(0.71875-mu)/(mu+2)"],
    ),
    (
        [[1, 0, 0], [0, -1, 0], [0, 2, 1]], [[1, 0, 1], [0, 2, 1], [0, 1, 0]],
        [8.0, 2.207323842215841e-12, 7.500872003532924e-07],
        ["(0.19921875-mu)/(mu+5)", "-2*(0.1240234375-mu)/(mu+2)", "3*(0.61328125-mu)/(mu+5)"],
    ),
    (
        [[1, 0], [0, 1]], [[1, 1], [0, 1]], [8.0, 3.0e-12],
        ["0.2*(0.46875-mu)", "0.02*(0.28125-mu)/(mu+2)"],
    ),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*are M and K swapped")
@pytest.mark.parametrize("parts", SLOW, ids=range(len(SLOW)))
def test_the_frequency_of_a_slow_crossing_is_right_in_the_digits_that_it_has(parts):
    system = hidden(*parts)
    answer = squeal.thresholds(system, 1.0, low=0.0)
    known = np.sqrt(parts[2]) / (2.0 * math.pi)
    assert answer.certified
    flutters = {crossing.mu: crossing.frequency_hz for crossing in answer.crossings}
    assert len(flutters) >= len(known)
    for hertz in flutters.values():
        unit = last_digit(hertz)
        assert np.abs(hertz - known).min() <= max(0.6 * unit, 2e-7 * hertz)
    for point in answer.points:
        assert point.frequency_hz == flutters.get(point.mu, point.frequency_hz)


THROUGH_ZERO = {
    "a pair": ("-(mu-0.5)", "(mu-0.5)**2", ["flutter"]),
    "a slow pair": ("-0.01*(mu-0.3)", "3*(mu-0.3)**2", ["flutter"]),
    "two real roots": ("-3*(mu-0.5)", "(mu-0.5)**2", ["divergence", "divergence"]),
    "two real roots of two sizes": ("-(mu-0.5)", "(mu-0.5)**4", ["divergence", "divergence"]),
    "a pair that hardly grows": ("-(mu-0.5)**3", "(mu-0.5)**2", ["flutter"]),
    "a real root that becomes a pair": ("-(mu-0.5)", "mu-0.5", ["divergence", "flutter"]),
}


@pytest.mark.parametrize(("C", "K", "kinds"), THROUGH_ZERO.values(), ids=list(THROUGH_ZERO))
def test_roots_that_pass_zero_together_are_what_they_are_beyond(C, K, kinds, monkeypatch):
    """s^2 + C s + K = 0 has two roots of zero at the threshold, beside which a search would divide
    its steps in vain."""
    monkeypatch.delattr("squeal.queries.systems.thresholds.thresholds")
    system = squeal.System([[1.0]], {C: [[1.0]]}, {K: [[1.0]]})
    answer = squeal.thresholds(system, 1.0, low=0.0)
    assert answer.certified
    assert [crossing.kind for crossing in answer.crossings] == kinds
    assert [crossing.frequency_hz for crossing in answer.crossings] == [0.0] * len(kinds)
    threshold = answer.crossings[0].mu
    for value in (threshold + 0.03, threshold + 0.25):
        assert squeal.eigenvalues(system.replace({"mu": value})).verdict == kinds[-1]
    assert answer.points[-1].kind == kinds[-1]


@pytest.mark.parametrize("stiffness", [1e-10, 4e-12, 3e-13])
def test_a_slow_pair_that_soon_turns_into_two_real_roots_is_no_divergence(stiffness):
    left = np.array([[2.0, 1.0], [1.0, 1.0]])
    dampings = ["(0.375-mu)/(mu+5)", "(0.71875-mu)/(mu+2)"]
    answer = squeal.thresholds(hidden(left, np.eye(2), [8.0, stiffness], dampings), 1.0, low=0.0)
    assert answer.certified
    _, slow = answer.crossings
    assert slow.mu == pytest.approx(0.71875, abs=1e-6)
    assert slow.kind == "flutter"
    unit = last_digit(slow.frequency_hz)
    error = abs(slow.frequency_hz - math.sqrt(stiffness) / (2 * math.pi))
    assert error <= max(0.6 * unit, 2e-7 * slow.frequency_hz)


@pytest.mark.parametrize(
    ("matrix", "factor", "pole"),
    [
        ("K", "1/(mu-0.5)", "0.5"),
        ("C", "1/(mu-0.3)", "0.3"),
        ("M", "1/(2 - 4*mu)", "0.5"),
        ("K", "mu/(mu**2 - 0.5)", "0.707106781"),
        ("K", "(mu**2 - 0.25)/(mu - 0.5)", "0.5"),
    ],
)
def test_a_factor_without_a_value_within_the_range_is_refused_before_any_search(
    matrix, factor, pole
):
    matrices = {"M": {"1": np.eye(2)}, "C": {"1": np.eye(2)}, "K": {"1": 2.0 * np.eye(2)}}
    matrices[matrix][factor] = np.array([[0.0, 1.0], [0.0, 0.0]])
    system = squeal.System(matrices["M"], matrices["C"], matrices["K"])
    with pytest.raises(InputError, match=f"not a finite number at mu = {pole}, within the range"):
        squeal.thresholds(system, 1.0, low=0.0)
    assert squeal.thresholds(system, 0.25, low=0.0).high == 0.25
