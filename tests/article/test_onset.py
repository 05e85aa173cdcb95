"""What lasts with damping, and cycles against a second method."""

import dataclasses
import functools

import numpy as np
import pytest

from squeal.article.figures import outcomes
from squeal.article.studies import onset
from squeal.article.studies._damped_contact import DampedContact
from squeal.article.studies.basin import Basin
from squeal.article.studies.grazing import Grazing
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import read_scene
from squeal.linear.thresholds import CriticalPoint
from tests.article.plain import Plain, move
from tests.conftest import ROOT, needs_heyoka

pytestmark = needs_heyoka


@pytest.fixture(scope="module", autouse=True)
def few_verdicts_on_sliding():
    """The study takes its thresholds from elsewhere."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("squeal.queries.cycles.SLIDING", 2)
        yield


def scene(name):
    return read_scene(ROOT / f"workflow/scenes/{name}.yaml")


@pytest.mark.parametrize("half_width", [0.5, 3.0])
def test_sampled_states_fill_a_box_about_the_equilibrium(half_width):
    one = scene("b1-d")
    states = onset.sampled_states(one, half_width, onset.STARTS)
    rest = np.append(sliding_equilibrium(one.pad_model)[0].q, np.zeros(3))
    compression = one.pad.F_n / (one.pad.k3 + one.pad.k4)
    reach = half_width * compression * np.array([1.0, 1.0, 1.0 / one.pad.w])
    reach = np.append(reach, reach * np.sqrt(one.pad.k1 / one.pad.m))
    share = (states - rest) / reach
    assert np.abs(share).max() < 1.0
    assert np.abs(share).max(axis=0) == pytest.approx(1.0, abs=0.1)
    # of a uniform distribution from -1 to 1
    assert share.var(axis=0) == pytest.approx(1.0 / 3.0, abs=0.1)


@pytest.mark.parametrize("tilt", [0.0, 1e-3, -0.05])
@pytest.mark.parametrize("name", ["b1-d", "b2-d"])
def test_growth_under_contact_damping_is_that_of_the_equations_with_it(name, tilt):
    """Also of a pad that is tilted at the start; by complex steps through the whole motion."""
    one = scene(name).replace(theta0=tilt)
    expected = DampedContact.of(one, 1e-2, 0.0).growth
    assert onset.contact_growth(one, 1e-2) == pytest.approx(expected, rel=1e-9)


def test_sentences_fall_where_nothing_lasts():
    rest = onset.After(0.005, None, 4, 0, 0, 0, 0.0, None, None)
    names = ["b1-a", "b1-d", "b2-c-integral", "b2-d-integral", "b2-d-mean"]
    record = onset.Onset(
        after=dict.fromkeys(names, (rest,)), cycles={}, other_damping={}, contact_damping={}
    )
    checks = onset.sentences(record)
    assert not checks["d-survives-other-damping"]
    assert not checks["d-goes-on-beside-stable-sliding"]
    assert checks["d-comes-to-rest-with-the-printed-law"]


def test_sliding_is_not_stable_where_there_is_no_equilibrium(monkeypatch):
    assert onset.slides_stably(scene("b1-d"), onset.RATIO)
    assert not onset.slides_stably(scene("b2-c"), onset.RATIO)

    def no_equilibrium(_):
        raise ComputationError("no sliding equilibrium was found")

    monkeypatch.setattr(onset, "analyse", no_equilibrium)
    assert not onset.slides_stably(scene("b1-d"), onset.RATIO)


def test_a_figure_without_a_trailing_blow_says_so():
    rest = onset.After(0.005, None, 4, 0, 0, 0, 0.0, None, None)
    record = onset.Onset(after={"b1-d": (rest,)}, cycles={}, other_damping={}, contact_damping={})
    drawing = outcomes.draw(
        record, Basin(shares={}, compression={}), Grazing(blows=(), grazes=None, crosses=None)
    )
    assert "No trailing blow" in drawing.alternative


def test_strong_damping_brings_all_to_rest():
    found, _ = onset.after(scene("b1-b"), 0.2)
    assert found.own is not None
    assert (found.own.lost, found.own.turns, found.lasting) == (0.0, 0, 0)
    assert found.growth < 0.0


def test_the_cycle_of_b2_c_is_that_of_a_simulation(monkeypatch):
    """Its multiplier is the decay of a disturbance, its branch begins at the flutter threshold."""
    monkeypatch.setattr(onset, "STARTS_UNSTABLE", 1)  # beside the reference one, which lasts
    one = scene("b2-c")
    row, state = onset.after(one, onset.RATIO)
    assert row.own.goes_on
    found = onset.cycles(one, state)
    assert isinstance(found, onset.Cycles)
    assert found.own.multiplier == pytest.approx(found.decay, abs=1e-6)
    assert found.shift < 1e-4
    # a supercritical branch ends where the equilibrium begins to flutter
    assert found.branch[-1].mu == pytest.approx(found.threshold, rel=1e-3)
    assert found.unstable[0][0] == found.threshold
    # the lower face reaches the surface's speed before the fold at 0.37236
    assert 0.3716 < found.reaches < 0.3724
    # half the time of a period is no period
    assert dataclasses.replace(found.own, multiplier=1.0).stable is False


D_CYCLES = {
    "b1-d": (
        4.28066917e-06,
        -2.06315285e-05,
        0.000587922045,
        0.0155442953,
        0.878538462,
        11.1705638,
    ),
    "b2-d": (
        -1.14269908e-05,
        2.57750934e-05,
        0.000386963797,
        -0.492860121,
        0.284165554,
        27.7643212,
    ),
}


@functools.cache
def cycles_of_d(case):
    """The cycles of case (d) from a stored one, which two tests compare with other programs.

    Those of B2 begin later: the branch narrows to cycles in full contact of a third of the
    amplitude, and from this phase of the first cycle a step lands on the equilibrium beside them.
    """
    one = scene(case)
    state = np.array(D_CYCLES[case])
    if case == "b2-d":
        start = onset.DampedStart(damped_model(onset.damped(one, onset.RATIO)), state)
        period = 0.353788574654628e-3
        state = onset.run([start], 0.125 * period)["final"][0]
    return onset.cycles(one, state)


@pytest.mark.parametrize(
    ("case", "fold", "closed"), [("b1-d", 0.07955816, False), ("b2-d", 0.13492164, True)]
)
def test_folds_of_case_d_are_those_of_shooting_by_differences(case, fold, closed):
    """The folds by another program, from the article's equations with SciPy and with differences.
    On both sides of each fold a long simulation there stays on the cycle or comes to rest."""
    found = cycles_of_d(case)
    assert isinstance(found, onset.Cycles)
    assert found.fold == pytest.approx(fold, abs=2e-8)
    assert found.closed is closed
    assert found.reaches is None


def test_forces_of_the_cycle_on_points_are_those_of_another_program():
    """The peaks at the edges and of their sum, and the share of the period in the air."""
    one = scene("b1-d")
    state = np.array(D_CYCLES["b1-d"])
    found = cycles_of_d("b1-d")
    assert isinstance(found, onset.Cycles)
    model = Plain(one.pad, line=False)
    model.damp(onset.RATIO)
    motion = move(model, state, 1e-3 * found.own.period, 20001)
    depths = np.maximum(-motion.gaps, 0.0) / one.pad.F_n
    leading = one.pad.k3 * depths[0]
    trailing = one.pad.k4 * depths[1]
    assert found.own.leading == pytest.approx(leading.max(), rel=1e-4)
    assert found.own.trailing == pytest.approx(trailing.max(), rel=1e-4)
    assert found.own.peak == pytest.approx((leading + trailing).max(), rel=1e-4)
    assert found.airborne == pytest.approx(np.mean((motion.gaps > 0.0).all(axis=0)), abs=1e-3)
    assert np.abs(motion.states[-1] - state).max() < 1e-4 * np.abs(state).max()


def test_growth_lasts_from_a_loss_of_stability_until_it_is_regained():
    kinds = {0.2: "flutter", 0.4: "restabilised", 0.6: "divergence"}
    points = [CriticalPoint(mu, kind, 0.0, (mu, mu), True) for mu, kind in kinds.items()]
    assert onset._unstable(points) == ((0.2, 0.4), (0.6, onset.GREATEST))
    assert onset._unstable([]) == ()


@pytest.mark.parametrize(("stem", "threshold"), [("b1-d", 0.1111), ("b2-d", 0.1121)])
def test_damping_of_the_normal_force_has_the_threshold_of_motions_written_out(stem, threshold):
    """benchmarks/contact_damping.c differentiates the article's equations by differences."""
    found = onset.contact_damping(scene(stem))
    assert found.threshold == pytest.approx(threshold, abs=1e-4)
    assert min(found.growth.values()) > 0.0
