"""Scatter of the critical friction against what a single monotonic parameter must make of it."""

import numpy as np
import pytest
from scipy.stats import norm

from squeal.analysis.thresholds import critical_friction
from squeal.analysis.variations import Outcome, Spread, Spreads, Varied, read_spreads, scatter
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.model.pad import Pad
from tests.analysis.test_advice import coupled

SIZE, COUNT = 0.03, 24
MU_MAX = 0.6  # twice the threshold


@pytest.fixture(scope="module")
def scene():
    """Flutter at mu = 0.315, which rises evenly with h."""
    values = {"m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6}
    rest = {"L1": 0.8, "L2": 0.8, "alpha1": np.pi / 2, "alpha2": np.pi, "mu": 0.4, "F_n": 4500.0}
    return Scene("B1", Pad(**values, **rest))


@pytest.fixture(scope="module")
def found(scene):
    return scatter(scene, Spreads((Spread("h", "relative", SIZE),), COUNT, 3), mu_max=MU_MAX)


def threshold(scene, factor):
    return critical_friction(scene.replace(h=factor * scene.pad.h), MU_MAX).first.mu


def test_quantiles_hold_the_threshold_at_the_parameter_s_quantile(scene, found):
    ends = [threshold(scene, 1.0 + SIZE * side) for side in (-1.0, 1.0)]
    rising = ends[1] > ends[0]
    held = 0
    for q in found.quantiles:
        level = q.level if rising else 1.0 - q.level
        exact = threshold(scene, 1.0 + SIZE * norm.ppf(level))
        held += (q.low or 0.0) <= exact <= (np.inf if q.high is None else q.high)
    assert held >= len(found.quantiles) - 1  # each interval is of 95 per cent


def test_every_sample_is_the_threshold_of_its_own_pad(scene, found):
    values = np.random.default_rng(3).standard_normal(COUNT)
    exact = sorted(threshold(scene, 1.0 + SIZE * v) for v in values[:8])
    nearest = [found.critical[np.argmin(np.abs(found.critical - mu))] for mu in exact]
    assert nearest == pytest.approx(exact, rel=1e-12)
    assert len(found.critical) + found.failed == COUNT


def test_share_that_stays_stable_is_counted_at_the_scene_s_friction(scene, found):
    middle = float(np.median(found.critical))
    half = scatter(
        scene.replace(mu=middle), Spreads((Spread("h", "relative", SIZE),), COUNT, 3), MU_MAX
    )
    assert half.stable == pytest.approx(0.5, abs=0.01)
    assert half.interval[0] < 0.5 < half.interval[1]


def test_workers_and_progress_change_nothing(scene):
    told = []

    def progress(done, count):
        told.append((done, count))

    spreads = (Spread("k2", "within", 0.01 * scene.pad.k2), Spread("alpha1", "absolute", 0.01))
    alone = scatter(scene, Spreads(spreads, 9), mu_max=MU_MAX, progress=progress)
    both = scatter(scene, Spreads(spreads, 9), mu_max=MU_MAX, workers=2)
    assert np.array_equal(alone.critical, both.critical, equal_nan=True)
    assert told[-1] == (9, 9)


def test_samples_that_are_no_pads_are_counted_and_left_out(scene):
    found = scatter(scene, Spreads((Spread("h", "relative", 1.0),), 20), mu_max=MU_MAX)
    assert 0 < found.no_pad < 20
    assert len(found.critical) == 20 - found.no_pad - found.failed


def test_samples_that_cannot_be_computed_are_counted_apart(scene, found, monkeypatch):
    """They were dropped as "no such pads", and the quantiles were those of the survivors."""
    outcomes = Varied.outcomes

    def failing(varied, names, values, high):
        known = outcomes(varied, names, values, high)
        return [Outcome(reason="hidden") if i % 4 == 3 else one for i, one in enumerate(known)]

    monkeypatch.setattr(Varied, "outcomes", failing)
    some = scatter(scene, found.drawn, mu_max=MU_MAX)
    assert (some.failed, some.no_pad, len(some.critical)) == (COUNT // 4, 0, COUNT - COUNT // 4)
    assert some.warnings
    assert some.to_dict()["scatter"]["failed"] == COUNT // 4
    # whatever they would have been, all that holds for the whole holds within the wider intervals
    for one, whole in zip(some.quantiles, found.quantiles, strict=True):
        assert whole.mu is not None
        assert (one.low or 0.0) <= whole.mu <= (one.high or np.inf)
    assert some.interval[0] <= found.stable <= some.interval[1]


def test_what_a_stack_cannot_decide_is_a_query_of_its_own(scene):
    """Stiffnesses 14 decades apart: no sample is decided in vain, each is counted as failed."""
    stiff = scene.replace(k3=8.7e20, k4=8.7e20)
    with pytest.raises(ComputationError):
        critical_friction(stiff)
    with pytest.raises(ComputationError, match="no sample"):
        scatter(stiff, Spreads((Spread("k2", "relative", 0.01),), 10))


@pytest.mark.parametrize(
    ("name", "kind", "size", "words"),
    [
        ("k2", "about", 0.1, "spread k2: .about"),
        ("k2", "relative", 0.0, "spread k2: 0"),
        ("k2", "relative", float("nan"), "spread k2: nan"),
    ],
)
def test_spreads_defend_themselves(name, kind, size, words):
    with pytest.raises(InputError, match=words):
        Spread(name, kind, size)


def test_a_spread_must_fit_the_scene(scene):
    one = Spread("k2", "relative", 0.1)
    with pytest.raises(InputError, match="spreads: k_c is no parameter here; allowed are m, w"):
        scatter(scene, (Spread("k_c", "relative", 0.1),))
    with pytest.raises(InputError, match="spreads: k2 is named twice; once is allowed"):
        scatter(scene, (one, one))
    with pytest.raises(InputError, match="scatter: str is not allowed"):
        scatter("pad.yaml", (one,))


def test_no_equilibrium_at_all_is_said(scene):
    with pytest.raises(ComputationError, match="no sample has an equilibrium"):
        scatter(scene.replace(k1=0.0, k2=0.0), Spreads((Spread("F_n", "relative", 0.01),), 2))


def test_mode_coupling_scatters_as_its_closed_form_says():
    # flutter from k + (a - b)^2 / 4 k on: with a normal difference d the share below x is that of
    # |d| < sqrt(4 k (x - k)), with an even k the whole is moved
    mean, size, k = 1.0, 0.2, 0.5
    system = coupled({"a": 2.0 + mean, "b": 2.0, "k": k, "mu": 1.0})
    count = 80
    found = scatter(system, Spreads((Spread("a", "absolute", size),), count, 5), mu_max=3.0)
    assert (found.failed, found.beyond) == (0, 0)

    def share(x):
        reach = np.sqrt(np.maximum(4 * k * (x - k), 0.0))
        return norm.cdf(reach, mean, size) - norm.cdf(-reach, mean, size)

    # Dvoretzky, Kiefer, Wolfowitz: farther off than this once in 1000 draws
    bound = np.sqrt(np.log(2 / 1e-3) / (2 * count))
    steps = np.arange(count + 1) / count
    exact = share(found.critical)
    assert max(np.abs(exact - steps[1:]).max(), np.abs(exact - steps[:-1]).max()) < bound
    assert found.interval[0] <= 1.0 - share(1.0) <= found.interval[1]
    held = [
        (q.low or 0.0) <= np.interp(q.level, exact, found.critical) <= (q.high or 9.0)
        for q in found.quantiles
    ]
    assert all(held)
    # half of them lie above the median: these have no threshold in a shorter range
    short = scatter(system, Spreads((Spread("a", "absolute", size),), 24, 5), mu_max=1.0)
    drawn = mean + size * np.random.default_rng(5).standard_normal(24)
    assert short.beyond == np.sum(k + drawn**2 / (4 * k) > 1.0)


def test_a_file_of_spreads_is_named_by_a_path_or_its_text(tmp_path):
    path = tmp_path / "spreads.yaml"
    path.write_text("samples: 20\nspreads: {k1: {relative: 0.05}}\n")
    assert read_spreads(str(path)) == read_spreads(path)
    assert read_spreads(path).samples == 20
    with pytest.raises(InputError, match=r"none\.yaml: cannot be read"):
        read_spreads(str(tmp_path / "none.yaml"))
