"""First looks against the full system: errors that hold, roots that are corrected, workers."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.sparse import diags_array, eye_array, lil_array

import squeal
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.linear import GROWING
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.reduced import reduced_for
from squeal.results.sources import EigenvalueSelection
from squeal.sparse import first_look
from squeal.sparse.first_look import FirstLook
from squeal.sparse.region_roots import modes_in
from tests import large
from tests.sparse.test_reduction import BAND as LATE_BAND
from tests.sparse.test_reduction import LATE, RANGE

BRAKE = large.disc_and_pad(3)
BAND = (200.0, 2200.0)
VALUES = [{"mu": mu} for mu in (0.0, 0.35, 0.7)]


def random_brake(seed):
    """The brake with random supports, dampers and gyroscopic part, and random friction."""
    rng = np.random.default_rng(seed)
    C, K0, K1 = BRAKE.C[0].matrix, BRAKE.K[0].matrix, BRAKE.K[1].matrix
    dampers = rng.uniform(0.0, 5.0, BRAKE.n)
    held = rng.uniform(1.0, 1.0005, BRAKE.n)
    dampers[rng.random(BRAKE.n) > 0.03] = 0.0
    C = C * rng.uniform(0.0, 1.0)
    K0 = K0.copy()
    C.setdiag(C.diagonal() + dampers)
    K0.setdiag(K0.diagonal() * held)
    K1 = Term(K1 * rng.uniform(0.5, 2.0), Formula("mu"))
    return replace(BRAKE, C=(Term(C),), K=(Term(K0), K1))


def look_at(system, values=VALUES, **wanted):
    look = reduced_for(system, EigenvalueSelection(**wanted or {"band": BAND}), values, "modal")
    assert isinstance(look, FirstLook)
    return look


def held_against_the_full_system(look, changes):
    """What is judged, after its errors have proved to hold."""
    full = modes_in(look.scaled.at(changes), look.region, False, exact=1e-12).values
    full = full[look.region.contains(full)]
    found = look.estimate_by_basis(changes)
    assert len(found.values) == len(full) > 3
    away = np.abs(full[:, None] - found.values).min(axis=0)
    assert np.all(away <= found.errors + 1e-10 * np.abs(found.values))
    assert np.all(found.errors <= 1e-3 * np.abs(found.values))
    return found


@pytest.mark.parametrize(("seed", "content"), [(0, 1e-3), (1, 1.0), (2, 1e-3)])
def test_the_error_of_each_root_holds(monkeypatch, seed, content):
    monkeypatch.setattr(first_look, "ONE_ROUND_ERROR", content)
    look = look_at(random_brake(seed))
    assert look.size < look.scaled.n / 6
    assert 0.0 < look.worst_residual < 1e-2
    for changes in [*VALUES, {"mu": 0.5}]:
        found = held_against_the_full_system(look, changes)
        assert np.all((np.abs(found.values.real) > found.errors) | found.corrected)


def test_roots_that_would_be_lost_are_solved():
    """A real pair of the projected problem is another one of the full problem, in the region."""
    look = look_at(LATE, RANGE, region=LATE_BAND)
    corrected = [held_against_the_full_system(look, p).corrected.all() for p in RANGE]
    assert (corrected[0], corrected[2]) == (False, True)


def test_solved_roots_have_the_numbers_of_modes():
    """At the last value of the range real modes estimate none of the roots."""
    values = [p["mu"] for p in RANGE]
    for step in squeal.sweep(LATE, values, region=astuple(LATE_BAND), method="modal").steps:
        upper = step.modes[step.roots.imag > 0.0]
        assert upper.all()
        assert len(set(upper.tolist())) == len(upper)


@pytest.mark.parametrize(("seed", "damping"), [(0, 1e-4), (1, 1e-4), (2, 0.0)])
def test_each_root_that_real_modes_lose_is_a_mode_of_its_own(seed, damping):
    """Single rows, equations and coordinates mixed: omega^2 and damping of each are known."""
    rng = np.random.default_rng(seed)
    omegas = np.append(np.linspace(3900.0, 4900.0, 12), rng.uniform(7e3, 3e4, 400))
    n = len(omegas)
    left, right = np.eye(n), np.eye(n)
    for factor in (left, right):
        mixed = rng.permutation(n)
        factor[mixed[: n // 4], mixed[n // 4 : 2 * (n // 4)]] = 1.0
    friction = np.zeros(n)
    friction[7] = 1.0  # damping (1 - 2 mu) alone: growth from mu = 1/2 on
    terms = [np.diag(2.0 * damping * omegas), np.diag(-4.0 * damping * omegas * friction)]
    C = dict(zip(("1", "mu"), (left @ term @ right for term in terms), strict=True))
    turned = np.diag(0.01 * omegas**2 * (np.arange(n) < 6))
    K = {"1": left @ np.diag(omegas**2) @ right, "mu": left @ turned @ right}
    system = squeal.System(left @ right, C, K)
    band = (600.0, 800.0)
    with pytest.warns(InputWarning, match="real modes"):
        swept = squeal.sweep(system, [0.0, 0.5, 1.0], band, method="modal")
    for step in swept.steps:
        hertz = omegas * np.sqrt(1.0 + 0.01 * step.value * (np.arange(n) < 6)) / (2 * np.pi)
        assert len(step.roots) == np.sum((band[0] < hertz) & (hertz < band[1]))
        assert sorted(step.modes.tolist()) == list(range(1, 13))
    growing = [mode.mode for mode in swept.modes if mode.growth_rate > 1e-6]
    assert len(growing) == (damping > 0.0)


@pytest.mark.parametrize("growth", [1e-5, -1e-5])
def test_the_sign_of_a_growth_near_zero_is_that_of_the_full_system(monkeypatch, growth):
    """P(lambda + s) has the roots of P moved by -s: the fastest one to a known growth."""
    monkeypatch.setattr(first_look, "ONE_ROUND_ERROR", 1.0)
    brake = random_brake(3)
    mu = 0.5
    look = look_at(brake)
    full = modes_in(look.scaled.at({"mu": mu}), look.region, False, exact=1e-13)
    s = full.values.real.max() - growth
    M, C, K = brake.M[0].matrix, brake.C[0].matrix, brake.K[0].matrix
    shifted_K = (Term(K + s * C + s * s * M), brake.K[1])
    shifted_C = (Term(C + 2 * s * M),)
    step = squeal.sweep(replace(brake, C=shifted_C, K=shifted_K), [0.0, mu, 0.7], BAND).steps[1]
    fastest = int(np.argmax(step.roots.real))
    assert step.corrected[fastest]
    assert step.roots.real[fastest] == pytest.approx(growth, abs=1e-6)
    assert step.verdict == ("flutter" if growth > 0.0 else None)


def test_friction_that_real_modes_cannot_hold_is_told_and_solved():
    with pytest.warns(InputWarning, match="real modes"):
        look = look_at(BRAKE, [{"mu": 0.0}, {"mu": 1e5}])
    assert held_against_the_full_system(look, {"mu": 1e5}).corrected.all()


def test_workers_give_the_same_bits():
    """Of sweeps and of a chart, whose verdicts are those of the full system."""
    brake = random_brake(0)
    K = (brake.K[0], Term(brake.K[1].matrix, Formula("mu * gap")))
    brake = replace(brake, K=K, parameters={"mu": 0.3, "gap": 1.0})
    axes = squeal.Axis("mu", 0.0, 0.8, 2), squeal.Axis("gap", 0.5, 1.5, 2)

    def swept(workers):
        return squeal.sweep(brake, [0.1, 0.5], BAND, method="modal", workers=workers).to_dict()

    assert swept(1) == swept(2)
    assert brake.n > 400  # whose verbs take threads
    spreads = {"mu": {"within": 0.1}, "gap": {"within": 0.2}}
    for ask in (
        lambda workers: squeal.eigenvalues(brake, band=BAND, workers=workers),
        lambda workers: squeal.thresholds(brake, 0.8, band=BAND, workers=workers),
        lambda workers: squeal.scatter(
            brake, spreads, samples=8, of="growth", band=BAND, workers=workers
        ),
    ):
        assert ask(1).to_dict() == ask(2).to_dict() == ask(3).to_dict()
    chart = squeal.map(brake, axes, band=BAND, workers=1).to_dict()
    assert chart == squeal.map(brake, axes, band=BAND, workers=2).to_dict()
    for a, row in zip(axes[0].values, chart["verdicts"], strict=True):
        for b, verdict in zip(axes[1].values, row, strict=True):
            step = squeal.sweep(brake, [a * b], BAND, method="full").steps[0]
            assert step.verdict == (verdict if verdict in GROWING else None)


def small_system(n, kind):
    """Random matrices with coupling by friction, and the frequencies (Hz) without it."""
    rng = np.random.default_rng(n)
    mix = np.eye(n) + 0.3 * rng.standard_normal((n, n)) / np.sqrt(n)
    w = rng.uniform(6.0, 60.0, n)
    Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
    if kind == "free":
        w[0] = 0.0
    M = mix @ mix.T
    K = mix @ (Q * w**2) @ Q.T @ mix.T
    K = (K + K.T) / 2
    G = rng.standard_normal((n, n))
    C = None
    if kind not in ("undamped", "complex"):
        C = 0.02 * M + 1e-4 * K
    if kind == "gyroscopic":
        C = C + G - G.T
    size = 2.0 if kind == "free" else 20.0
    terms = {
        "1": K * (1.0 + 0.02j) if kind == "complex" else K,
        "mu": size * rng.standard_normal((n, n)),
    }
    return squeal.System(M, C, terms), np.sort(w) / (2 * np.pi)


def bands_of(f):
    """Bands below, between and above frequencies, around one of them and around all."""
    f = f[f > 0.1]
    k = int(np.argmax(np.diff(f, prepend=0.0)))
    before = f[k - 1] if k else 0.0
    gap = (0.7 * before + 0.3 * f[k], 0.3 * before + 0.7 * f[k])
    one = (0.5 * (before + f[k]), f[k] + 0.1)
    return gap, one, (0.0, 0.01), (1e-6, 2e-6), (0.0, 1.5 * f[-1]), (50 * f[-1], 60 * f[-1])


@pytest.mark.filterwarnings("ignore:real modes up to")
@pytest.mark.parametrize("kind", ["undamped", "damped", "gyroscopic", "free", "complex"])
@pytest.mark.parametrize(
    ("method", "n"), [("modal", 1), ("reduced", 1), ("reduced", 3), ("modal", 40), ("reduced", 40)]
)
def test_a_small_system_has_the_roots_of_its_companion_matrix(method, n, kind):
    if (n, kind) == (1, "free"):
        pytest.skip("nothing is left of the structure")
    system, f = small_system(n, kind)
    values = [0.0, 0.6]
    roots = {}
    for mu in values:
        M, C, K = system.arrays({"mu": mu})
        A = np.linalg.solve(M, np.hstack([-K, np.zeros((n, n)) if C is None else -C]))
        roots[mu] = np.linalg.eigvals(np.vstack([np.eye(2 * n)[n:], A]))
    bands = bands_of(f)[:3] if n == 40 else bands_of(f)
    for band in bands:
        region = EigenvalueSelection(band).rectangle
        for step in squeal.sweep(system, values, band, method=method).steps:
            every = roots[step.value]
            lowest = -1e-3 if kind == "complex" else 0.0
            inside = every[region.contains(every) & (every.imag >= lowest)]
            assert len(step.roots) == len(inside), (band, step.value, inside)
            away = np.abs(inside[:, None] - step.roots).min(axis=0, initial=np.inf)
            # a double root at zero lies the square root of rounding away
            assert np.all(away <= np.fmax(step.rounding, 1e-6 * f[-1])), (band, step.value)


def test_a_first_look_at_few_rows_leaves_the_answer_all_that_it_has():
    """Which is cheaper on the system itself: shapes, and a count."""
    system, f = small_system(2, "damped")
    look = squeal.sweep(system, [0.0, 0.3], (0.0, 2 * f[-1]), method="modal")
    band = 0.0, 2 * f[-1]
    answers = [squeal.eigenvalues(system, 0.3, band, look=one).to_dict() for one in (look, None)]
    assert answers[0] == answers[1]
    assert answers[0]["certified"]


def test_a_basis_of_all_motions_lacks_nothing():
    """-lambda^2 = 2 +- sqrt(1 - 4 mu / 3), with residuals of exactly zero."""
    K = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 4 / 3], [0.0, 0.0]]}
    sweep = squeal.sweep(squeal.System(np.eye(2), K=K), [0.0, 1.0], (0.0, 0.5), method="modal")
    for step in sweep.steps:
        root = np.sqrt(1 - 4 * step.value / 3 + 0j)
        expected = 1j * np.sqrt([2 - root, 2 + root])
        assert np.allclose(np.sort_complex(step.roots), np.sort_complex(expected), rtol=1e-12)


@pytest.mark.filterwarnings("error:1 full solutions do not suffice")
@pytest.mark.parametrize("method", ["modal", "reduced"])
@pytest.mark.parametrize("rows", [2, 6])
@pytest.mark.parametrize("distance", [9e-8, 5e-8, 2e-8, 1e-8, 5e-9, 2e-9])
@pytest.mark.parametrize("coupling", [0.0, 1.0])
def test_roots_that_lie_too_close_for_a_vector_each_are_found(coupling, distance, rows, method):
    """Two parts that are nearly equal, alone, and coupled to a nearly defective pair."""
    squares = np.arange(1.0, rows + 1.0)
    squares[1] = 1.0 + 2 * distance
    turn = np.linalg.qr(np.random.default_rng(rows).standard_normal((rows, rows)))[0]
    K = turn @ (np.diag(squares) + coupling * np.eye(rows, k=1)) @ turn.T
    system = squeal.System(np.eye(rows), K={"1": K, "mu": np.zeros_like(K)})
    (step,) = squeal.sweep(system, [0.0], (0.0, 0.2), method=method).steps
    assert len(step.roots) == 2
    for root, rounding in zip(np.sort_complex(step.roots), step.rounding, strict=True):
        away = np.abs(root - 1j * np.sqrt(squares[:2])).min()
        assert away <= max(rounding, 1e-7)


@pytest.mark.parametrize("stiffness", [0.0, 100.0])
@pytest.mark.parametrize("band", [(0.0, 1e-4), (5.0, 6.0), (0.0, 1e3)])
def test_one_row_is_reduced_whatever_the_band_holds(stiffness, band):
    one = squeal.System([[1.0]], K={"1": [[stiffness]], "mu": [[5.0]]})
    for step in squeal.sweep(one, [0.0, 1.0], band, method="reduced").steps:
        w = np.sqrt(stiffness + 5.0 * step.value)
        assert np.all(np.abs(step.roots.imag) == pytest.approx(w))
        assert (len(step.roots) > 0) == bool(band[0] <= w / (2 * np.pi) < band[1])


@pytest.mark.parametrize("workers", [0, 1.5, "two"])
def test_a_wrong_number_of_workers_is_refused(workers):
    with pytest.raises(InputError, match="workers"):
        squeal.sweep(BRAKE, [0.1], BAND, workers=workers)


def test_each_worker_needs_the_memory_of_a_factorisation():
    assert squeal.eigenvalues(BRAKE, band=BAND, memory=6e6).count
    with pytest.raises(ComputationError, match=r"0\.006 GB may be used; .*`workers` need less"):
        squeal.eigenvalues(BRAKE, band=BAND, memory=6e6, workers=9)


@pytest.mark.parametrize("part", ["M", "K"])
def test_real_modes_need_mass_and_stiffness(part):
    matrices = {"M": np.eye(30), "C": np.eye(30), "K": np.diag(np.arange(1.0, 31.0))}
    matrices[part] = np.zeros((30, 30))
    M, C, K = matrices.values()
    system = squeal.System(M, C, {"1": K, "mu": np.eye(30, k=1)}, parameters={"mu": 0.1})
    with pytest.raises(InputError, match=f"{part}: is zero without friction; real modes need a"):
        squeal.sweep(system, [0.0, 0.5], region=(-2.0, 1.0, -1e-3, 1.0), method="modal")


@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_a_pair_outside_of_the_basis_that_friction_brings_into_the_band_is_told(ratio):
    """Two modes at 159 Hz, of which friction brings one to 7.96 Hz: no root of the basis lies near
    the band, so that none has an error, and at mu = 0 nothing is lacking."""
    n = 450
    squares = np.linspace(0.5e6, 2e6, n)
    squares[-2:] = 1e6
    friction = lil_array((n, n))
    friction[n - 2, n - 1] = (1e6 - 50.0**2) * ratio
    friction[n - 1, n - 2] = (1e6 - 50.0**2) / ratio
    mass = eye_array(n).tocsc()
    K = {"1": diags_array(squares).tocsc(), "mu": friction.tocsc()}
    system = squeal.System(mass, {"1": 0.5 * mass}, K, parameters={"mu": 0.3})
    with pytest.warns(InputWarning, match="may lose roots of the band"):
        found = squeal.sweep(system, [0.0, 0.5, 1.0], band=(5.0, 15.0), method="modal")
    assert found.steps[-1].roots.imag == pytest.approx([50.0], rel=1e-4)


@pytest.mark.parametrize("seed", [10, 11])
def test_a_pair_among_many_motions_that_friction_softens_is_not_lost(seed):
    """Friction couples pairs far above the band, and brings one into it: its roots are those of
    lambda^2 + c lambda + 1/4 +- 0.1 i. Of the others |T| is up to 0.85."""
    n = 430
    rng = np.random.default_rng(seed)
    omegas = np.append(np.linspace(0.2, 0.9, 6), rng.uniform(20.0, 40.0, n - 6))
    omegas[7::2] = omegas[6::2]
    couplings = np.zeros(n - 1)
    couplings[6::2] = rng.uniform(0.0, 0.85, n // 2 - 3) * omegas[6::2] ** 2
    softening = np.zeros(n)
    late = 200
    couplings[late] = 0.1
    softening[late : late + 2] = 0.25 - omegas[late] ** 2
    damping = 0.005 * np.fmax(omegas, 1.0)
    K = {
        "1": diags_array(omegas**2).tocsc(),
        "mu": diags_array([-couplings, softening, couplings], offsets=[-1, 0, 1]).tocsc(),
    }
    system = squeal.System(eye_array(n).tocsc(), diags_array(damping).tocsc(), K)
    with pytest.warns(InputWarning, match="may lose roots of the band"):
        found = squeal.sweep(system, [0.0, 0.5, 1.0], (0.0, 1 / (2 * np.pi)), method="modal")
    (growing,) = found.steps[-1].roots[found.steps[-1].roots.real > 0.0]
    expected = np.roots([1.0, damping[late], 0.25 - 0.1j])
    assert growing == pytest.approx(expected[expected.real > 0.0][0], rel=1e-9)
    assert found.steps[-1].verdict == "flutter"
