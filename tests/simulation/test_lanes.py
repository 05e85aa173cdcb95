"""Many pads in step: series against mpmath, roots against numpy's, pads against closed forms."""

import math

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.model.contact import Formulation
from squeal.simulation.batch.many import DONE, simulate_many, stack
from tests.conftest import HEYOKA, needs_heyoka
from tests.simulation.closed import upright
from tests.simulation.test_batch import some

if HEYOKA:
    import heyoka as hy

    from squeal.simulation.batch import lanes, step
    from squeal.simulation.batch.passing import before_zero, passing
    from squeal.simulation.batch.series import Series, SeriesFunctions

pytestmark = needs_heyoka

DEGREE = 9


def evaluated(outputs, given, values):
    function = hy.cfunc([hy.expression(0.0) + e for e in outputs], given)
    return function(np.ascontiguousarray(values))


def test_coefficients_of_series_are_those_of_mpmath():
    def f(ops, x):
        y = 3.0 - x * ops.sin(x * 0.5) + ops.exp(ops.cos(x) - 1.0)
        return ops.sqrt(1.0 + y * y) / (2.0 + x) - x / 4.0 + y * (-y)

    begin = hy.make_vars("begin")
    x = Series(lambda k: begin if k == 0 else float(k == 1))
    series = f(SeriesFunctions(), x)
    starts = np.linspace(-1.0, 2.0, 7)
    ours = evaluated([series[k] for k in range(DEGREE + 1)], [begin], starts[None])
    with mp.workdps(30):
        exact = np.array([mp.taylor(lambda t: f(mp, t), s, DEGREE) for s in starts], dtype=float)
    assert np.abs(ours.T - exact).max() < 1e-13


def polynomials(count):
    """Coefficients (DEGREE + 1, count), negative at 0, that fall off as those of a step do."""
    random = np.random.default_rng(7)
    a = random.normal(size=(DEGREE + 1, count)) * 0.5 ** np.arange(DEGREE + 1)[:, None]
    a[0] = -np.abs(a[0]) * 10.0 ** random.uniform(-12, 0, count)
    return a


def test_a_passing_that_is_sure_is_the_only_one():
    given = [hy.make_vars(f"a{k}") for k in range(DEGREE + 1)]
    found = passing(given)
    a = polynomials(4000)
    ends, sure, at = evaluated([found.ends, found.sure, found.at], given, a)
    assert 0.6 < sure.mean() < 1.0
    for one, passes, certain, place in zip(a.T, ends, sure, at, strict=True):
        roots = np.roots(one[::-1])
        inside = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real < 1.0)].real
        assert passes == len(inside) % 2
        if certain:
            assert len(inside) == passes
            assert not passes or place == pytest.approx(inside[0], rel=1e-9, abs=1e-13)


def test_rounding_above_zero_at_the_start_is_no_passing_unless_it_grows():
    given = [hy.make_vars(f"a{k}") for k in range(DEGREE + 1)]
    found = passing(given)
    a = np.zeros((DEGREE + 1, 2))
    a[0], a[1] = 1e-17, (-1.0, 1.0)
    ends, sure, at = evaluated([found.ends, found.sure, found.at], given, a)
    assert ends.tolist() == [0.0, 1.0]
    assert sure.tolist() == [1.0, 1.0]
    assert at[1] == 0.0


def test_before_zero_is_before_any_zero():
    given = [hy.make_vars(f"a{k}") for k in range(DEGREE + 1)]
    a = -polynomials(2000)
    (share,) = evaluated([before_zero(given)], given, a)
    grid = np.linspace(0.0, 1.0, 201)[:, None] * share
    values = sum(c * grid**k for k, c in enumerate(a))
    assert np.all(values > 0.0)
    assert np.all(share > 0.0)
    a[1:] *= 1e-15
    assert np.all(evaluated([before_zero(given)], given, a)[0] == 1.0)
    assert np.all(evaluated([before_zero(given)], given, -a)[0] == 0.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [("WIDE", 8), ("AT_ONCE", 50), ("IDLE", 0.9), ("CALL", 1), ("MOST_STEPS", 5)],
)
def test_neither_neighbours_nor_portions_change_a_motion(monkeypatch, name, value):
    pads, initial = some("B2", 21, 60)
    r = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measured=True)
    assert (r["outcome"] == DONE).sum() > 10
    monkeypatch.setattr(lanes, name, value)
    s = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measured=True)
    good = r["outcome"] == DONE
    if name == "MOST_STEPS":  # the lanes give up, each pad runs alone
        assert np.all((s["outcome"] == DONE) == good)
        assert np.allclose(s["final"][good], r["final"][good], rtol=0, atol=1e-7)
        return
    assert np.array_equal(s["final"], r["final"], equal_nan=True)
    assert np.array_equal(s["second"], r["second"], equal_nan=True)


def test_steps_that_do_not_begin_where_the_ones_before_ended_are_refused(monkeypatch):
    monkeypatch.setattr(lanes, "twice", lambda size: (np.zeros(size), np.zeros(size)))
    lanes.lanes.cache_clear()  # integrators in use are not asked again
    pads, initial = some("B2", 21, 60)
    with pytest.raises(ComputationError, match="columns in turn"):
        simulate_many("B2", stack(pads), initial, 30.0, 1e-10)
    lanes.lanes.cache_clear()


def test_no_column_is_written_where_it_is_read(monkeypatch):
    # heyoka may read a column while it writes it, and works through so many at once
    bases: list[int] = []
    calls: list[int] = []

    def based(size, twice=lanes.twice):
        one, other = twice(size)
        bases[:] = [array.ctypes.data for array in (one, other)]
        return one, other

    class Watched:
        def __init__(self, *of):
            self._step = step.compiled_step(*of)
            self.nparams = self._step.nparams

        def __call__(self, given, outputs=None, **more):
            if outputs is not None:
                columns = given.shape[1]
                read, written = (
                    (array.ctypes.data - base) // 8 + np.arange(array.size)
                    for array, base in zip((given, outputs), bases, strict=True)
                )
                _, one, other = np.intersect1d(read, written, return_indices=True)
                calls.append(len(one))
                blocks = (index % columns // step.WIDTH for index in (one, other))
                assert not np.any(np.equal(*blocks))
                more["outputs"] = outputs
            return self._step(given, **more)

    monkeypatch.setattr(lanes, "twice", based)
    monkeypatch.setattr(lanes, "compiled_step", Watched)
    monkeypatch.setattr(lanes, "CALL", 1)  # as if there were pads enough for a call each
    lanes.lanes.cache_clear()
    pads, initial = some("B1", 21, 60)
    simulate_many("B1", stack(pads), initial, 3.0, 1e-10)
    lanes.lanes.cache_clear()
    assert calls
    assert min(calls) > 0


@pytest.mark.parametrize("memory", [True, False])
def test_two_addresses_of_one_memory(monkeypatch, memory):
    if not memory:
        monkeypatch.delattr("os.memfd_create", raising=False)
    one, other = lanes.twice(1000)
    one[:], other[500:] = np.arange(1000.0), -1.0
    assert not np.may_share_memory(one, other)
    assert other[:500].tolist() == list(range(500))
    assert set(one[500:]) == {-1.0}


@pytest.mark.parametrize("share", [1e-3, 1e-6, 1e-9, 1e-12])
def test_separations_much_shorter_than_a_step(share):
    # dropped from a small height a pad leaves the surface for a short while once a cycle
    pad = upright()
    k, K = pad.k1 + pad.k2, pad.k1 + pad.k2 + pad.k3 + pad.k4
    height = share * pad.F_n / K
    ratio = k * height / pad.F_n
    fall = 2 * math.asin(math.sqrt(ratio / (1 + ratio) / 2)) / math.sqrt(k / pad.m)
    speed = math.sqrt((2 * pad.F_n * height + k * height**2) / pad.m)
    rate = math.sqrt(K / pad.m)
    period = 2 * fall + 2 * (math.pi - math.atan2(speed / rate, pad.F_n / K)) / rate
    r = simulate_many("B1", pad, np.array([[0, height, 0, 0, 0, 0.0]]), 4.5 * period, 1e-12)
    assert r["changes"].tolist() == [18]


@pytest.mark.parametrize("share", [0.0, 1e-15, 1e-12, 1e-6])
def test_grazing_from_below_is_no_separation(share):
    pad = upright()
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    sag, rate = pad.F_n / K, math.sqrt(K / pad.m)
    stop = 30.0 / rate
    r = simulate_many("B1", pad, np.array([[0, -share * sag, 0, 0, 0, 0.0]]), stop, 1e-12)
    y = -sag + (1 - share) * sag * math.cos(rate * stop)
    assert r["final"][0, 1] == pytest.approx(y, abs=1e-11 * sag)
    assert share < 1e-13 or not r["changes"][0]


def test_an_ambiguous_step_is_tried_again(monkeypatch):
    # with steps that are never halved separations within a step are passed over
    pads, initial = some("B1", 64, 900)
    r = simulate_many("B1", stack(pads), initial, 60.0, 1e-10)
    lanes.lanes.cache_clear()
    monkeypatch.setattr(step, "SHORT", 1e30)
    s = simulate_many("B1", stack(pads), initial, 60.0, 1e-10)
    lanes.lanes.cache_clear()
    assert (r["changes"] != s["changes"]).any()


@pytest.mark.parametrize("springs", [2, 5])
def test_many_springs_in_step(springs):
    pads, initial = some("B2", 9, 20)
    words = Formulation(springs=springs)
    r = simulate_many("BN", stack(pads), initial, 20.0, 1e-11, words)
    tight = simulate_many("BN", stack(pads), initial, 20.0, 1e-14, words)
    assert np.array_equal(r["changes"], tight["changes"])
    assert np.allclose(r["final"], tight["final"], rtol=0, atol=1e-8, equal_nan=True)
