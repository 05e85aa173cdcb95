"""Scattered parameters against pads made by hand, closed forms of growth and of Sobol indices."""

import sys
import typing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array
from scipy.special import ndtri

import squeal
from squeal import Term
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.examples.brake import solid_brake, write_parts
from squeal.linear.moduli import Table, Tabulated
from squeal.numerics.differentiation import Formula
from squeal.queries.parameter_space import Outcome, ParameterSpace
from squeal.queries.scatter import scatter
from squeal.results.sources import digest_of
from tests.queries.test_advise import SCENE, first

COUNT = 24
ONE = csc_array([[1.0]])
MU_MAX = 0.6  # twice the threshold
DRAWN: dict = {"spreads": {"h": {"relative": 0.03}}, "samples": COUNT, "rng": 3, "high": MU_MAX}


@pytest.fixture(scope="module")
def scattered():
    return scatter(SCENE, **DRAWN)


def damped(factor, **parameters):
    """One mass on a spring of 100 N/m: the real part of its roots is half of what is negative
    damping."""
    return squeal.System([[1.0]], {f"-({factor})": [[1.0]]}, [[100.0]], parameters, "x")


def pair(rows=500):
    """Two coupled modes among others far above: flutter where 2 mu > |a - b|."""
    others = (2 * np.pi * np.linspace(40.0, 60.0, rows - 2)) ** 2

    def top(X):
        return csc_array(block_diag([np.array(X, dtype=float), csc_array((rows - 2, rows - 2))]))

    K = {"1": csc_array(diags_array(np.append([0.0, 0.0], others)))}
    K |= {"100*a": top([[1, 0], [0, 0]]), "100*b": top([[0, 0], [0, 1]])}
    K |= {"100*mu": top([[0, 1], [-1, 0]])}
    M = csc_array(diags_array(np.ones(rows)))
    return squeal.System(M, None, K, {"a": 3.0, "b": 2.0, "mu": 0.6})


def growth(a, b, mu):
    """The largest real part of the pair, and its negative damping ratio if it grows."""
    squares = 100 * ((a + b) / 2 + np.sqrt(complex((a - b) ** 2 / 4 - mu**2)) * np.array([1, -1]))
    roots = 1j * np.sqrt(squares)
    root = roots[np.argmax(np.abs(roots.real))]
    return abs(root.real), abs(root.real) / abs(root)


def test_every_sample_is_the_threshold_of_its_own_pad():
    answer = scatter(SCENE, {"w": {"within": 0.004}, "m": {"relative": 0.1}}, 8, 3)
    u = np.random.default_rng(3).random((8, 2))
    w = 0.04 + 0.004 * (2 * u[:, 0] - 1)
    m = 0.2 + 0.02 * ndtri(u[:, 1])
    exact = [first(w=a, m=b) for a, b in zip(w.tolist(), m.tolist(), strict=True)]
    assert answer.values == pytest.approx(sorted(exact), rel=1e-9)


def test_half_of_the_pads_are_stable_at_the_median(scattered):
    half = scatter(SCENE.replace(mu=float(np.median(scattered.values))), **DRAWN)
    assert half.stable == pytest.approx(0.5, abs=0.01)
    assert half.interval[0] < 0.5 < half.interval[1]


def test_samples_that_are_no_pads_are_counted_and_left_out():
    answer = scatter(SCENE, {"h": {"relative": 1.0}}, 20, high=MU_MAX)
    assert 0 < answer.no_pad < 20
    assert len(answer.values) == 20 - answer.no_pad - answer.failed


@pytest.mark.parametrize("changes", [{"k1": 0.0, "k2": 0.0}, {"k3": 8.7e20, "k4": 8.7e20}])
def test_where_no_sample_can_be_computed_nothing_is_said(changes):
    """Pads that rest nowhere; stiffnesses 14 decades apart."""
    with pytest.raises(ComputationError, match="no sample can be computed"):
        scatter(SCENE.replace(**changes), {"F_n": {"relative": 0.01}}, 8)


def test_where_no_system_can_be_computed_its_own_reason_is_named():
    """It was that of a pad: no equilibrium in contact."""
    massless = squeal.System(np.zeros((2, 2)), None, {"1": np.eye(2), "mu": np.eye(2)})
    with pytest.raises(ComputationError, match="computed: M: is zero"):
        scatter(massless, {"mu": {"between": [0.0, 1.0]}}, 8, of="growth")


def test_samples_that_cannot_be_computed_are_counted_apart(scattered, monkeypatch):
    """They were dropped as "no such pads", and the quantiles were those of the survivors."""
    outcomes = ParameterSpace.outcomes

    def failing(varied, changes, high, band):
        known = outcomes(varied, changes, high, band)
        return [Outcome(reason="hidden") if i % 4 == 3 else one for i, one in enumerate(known)]

    monkeypatch.setattr(ParameterSpace, "outcomes", failing)
    some = scatter(SCENE, **DRAWN)
    assert (some.failed, some.no_pad, len(some.values)) == (COUNT // 4, 0, COUNT - COUNT // 4)
    assert some.warnings
    # all that holds for the whole holds within the wider intervals
    for one, whole in zip(some.quantiles, scattered.quantiles, strict=True):
        assert (one.low or 0.0) <= whole.value <= (one.high or np.inf)
    assert some.interval[0] <= scattered.stable <= some.interval[1]


@pytest.mark.parametrize("rows", [2, 500])
def test_growth_and_propensity_of_each_sample_are_those_of_the_closed_form(rows):
    """The same of a small system and of a large one, which is reduced."""
    spreads: dict = {"a": {"within": 0.5}, "mu": {"between": [0.2, 0.9]}}
    answer = scatter(pair(rows), spreads, 32, of="growth", band=(1.0, 4.0), design="latin")
    assert (answer.basis is None) == (rows == 2)
    for row in answer.rows:
        a, mu = row.parameters["a"], row.parameters["mu"]
        rate, ratio = growth(a, 2.0, mu)
        grows = 2 * mu > abs(a - 2.0)
        assert row.unstable == grows
        assert row.value == pytest.approx(rate if grows else 0.0, abs=1e-7)
        assert row.propensity == pytest.approx(ratio if grows else 0.0, abs=1e-8)
        assert rows == 2 or row.residual < 1e-7
    shares = [growth(r.parameters["a"], 2.0, r.parameters["mu"])[1] for r in answer.rows]
    unstable = [r.unstable for r in answer.rows]
    assert answer.propensity == pytest.approx(np.mean(np.array(shares) * unstable), abs=1e-8)
    assert answer.stable == pytest.approx(1 - np.mean(unstable))
    assert list(answer.values) == sorted(answer.values)


@pytest.mark.parametrize(("name", "kind"), [("pressure", InputError), ("mu", InputWarning)])
def test_the_held_seat_of_contact_is_no_secret(tmp_path, name, kind):
    """No matrix of joined components holds the pressure that seats their contact."""
    write_parts(tmp_path, solid_brake(500))
    joined = squeal.read_system(tmp_path / "assembly.yaml")
    with pytest.raises(kind, match="seat"):
        scatter(joined, {name: {"within": 0.1}}, 8, of="growth", band=(500.0, 3000.0))


@pytest.mark.parametrize("points", [2, 2001])  # numpy prints no more than 1000 numbers
def test_a_journal_knows_the_numbers_of_a_table_whatever_holds_them(points):
    x: typing.Any = np.linspace(0.0, 1.0, points)
    squares = x**2
    others = squares.copy()
    others[points // 2] += 1e-9

    def digest(quantities, source="bearing.csv"):
        bearing = Tabulated(Formula("1"), "x", source, "kxx", x, quantities)
        parameters = {"x": 0.5}
        return digest_of(squeal.System((Term(ONE),), (), (Term(ONE, bearing),), parameters))

    same = {digest(squares), digest(squares.tolist()), digest(tuple(squares), "moved/bearing.csv")}
    assert len(same) == 1
    assert digest(others) not in same
    storage = Table("lining.csv", 1.0 + x, 1.0 + squares, list(x))
    assert storage == Table("lining.csv", (1.0 + x).tolist(), tuple(1.0 + squares), tuple(x))


def test_a_journal_knows_each_digit_of_a_pad_and_no_name_of_its_file():
    scene = replace(SCENE, source=Path("one.yaml"))
    assert digest_of(scene) == digest_of(replace(scene, source=Path("other.yaml")))
    stiffer = scene.replace(k1=scene.pad.k1 * (1 + 1e-9))
    assert digest_of(scene) != digest_of(stiffer)


def test_a_journal_tells_a_held_frequency_from_that_of_each_root():
    stiffening = {"1 + frequency / 1e4": ONE}
    follows = squeal.System(ONE, K=stiffening)
    held = squeal.System(ONE, K=stiffening, parameters=dict(follows.parameters))
    assert digest_of(follows) != digest_of(held)


def test_a_journal_of_chunks_of_another_size_is_refused(monkeypatch, tmp_path):
    journal = tmp_path / "samples"
    whole = scatter(SCENE, **DRAWN, journal=journal)
    monkeypatch.setattr(sys.modules["squeal.queries.scatter"], "CHUNK", COUNT // 2)
    with pytest.raises(InputError, match="no samples of this question"):
        scatter(SCENE, **DRAWN, journal=journal)
    renewed = scatter(SCENE, **DRAWN, journal=tmp_path / "new")
    assert renewed.to_records() == whole.to_records()


@pytest.mark.parametrize(("rows", "c"), [(2, 0.05), (500, 0.0), (500, 0.05)])
def test_each_threshold_is_that_of_the_closed_form(rows, c):
    """Flutter from mu^2 = (a - b)^2 / 4 + c^2 (a + b) / 200 on."""
    system = pair(rows)
    if c > 0.0:
        system = replace(system, C=(Term(csc_array(c * np.eye(rows)), Formula("1")),))
    spreads = {"a": {"within": 0.5}}
    answer = scatter(system, spreads, 8, high=1.0, band=(1.0, 4.0))
    assert (answer.basis is None) == (rows == 2)
    for row in answer.rows:
        a = row.parameters["a"]
        b = 2.0
        exact = np.sqrt((a - b) ** 2 / 4 + c**2 * (a + b) / 200)
        assert row.value == pytest.approx(exact, rel=1e-8)


def test_a_share_of_thresholds_is_stable_up_to_the_own_value():
    """Flutter where 2.4 mu (1 - mu) > 1/2, so from 0.297 to 0.703; at 0.9 all is stable again."""
    K = {"a": np.diag([1.0, 0.0]), "2": np.diag([0.0, 1.0])}
    K["2.4*mu*(1 - mu)"] = np.array([[0.0, 1.0], [-1.0, 0.0]])
    system = squeal.System(np.eye(2), K=K, parameters={"a": 3.0, "mu": 0.9})
    found = scatter(system, {"a": {"within": 0.02}}, 8, high=1.0)
    assert "stable up to mu = 0.9: 0.0 % of the samples" in found.text()
    grown = scatter(system, {"a": {"within": 0.02}}, 8, of="growth")
    assert "stable at mu = 0.9: 100.0 % of the samples" in grown.text()


def test_of_some_roots_only_growth_is_a_verdict():
    kinds = {}
    for rows in (3, 500):  # all roots, and those of a reduced system
        found = scatter(pair(rows), {"mu": {"between": (0.3, 0.8)}}, 16, of="growth", band=(1, 4))
        kinds[rows] = {row.kind for row in found.rows}
    assert kinds == {3: {"marginal", "flutter"}, 500: {None, "flutter"}}


def test_a_parameter_has_one_name_in_all_tables():
    """The table of growth said parameter.mu, sweeps and maps mu."""
    spreads: dict[str, typing.Any] = {"mu": {"between": [0.2, 0.5]}, "k1": {"relative": 0.05}}
    rows = scatter(SCENE, spreads, samples=8, of="growth").to_records()
    assert {"mu", "k1"} <= rows[0].keys()
    assert not {key for key in rows[0] if key.startswith("parameter")}


def test_the_referee_is_not_asked_of_each_sample(monkeypatch):
    """A sample took 0.15 s of which 0.11 proved what no sample tells of."""
    monkeypatch.setattr("squeal.queries.thresholds._proved_system", pytest.fail)
    found = scatter(pair(3), {"a": {"between": [2.5, 5.5]}}, samples=8)
    for sample in found.rows:
        assert sample.value == pytest.approx((sample.parameters["a"] - 2.0) / 2, rel=1e-9)


def test_a_scene_grows_as_its_eigenvalues_say():
    answer = scatter(SCENE, {"mu": {"between": [0.2, 0.5]}}, 8, of="growth", design="sobol")
    for row in answer.rows[:2]:
        roots = squeal.eigenvalues(SCENE.replace(**row.parameters)).values
        assert row.value == roots.real.max()


@pytest.mark.parametrize("design", ["latin", "sobol"])
def test_each_parameter_is_spread_evenly(design):
    answer = scatter(damped("x + y", x=0.0, y=0.0), EVEN, 16, of="growth", design=design)
    for name in "xy":
        places = sorted(row.parameters[name] for row in answer.rows)
        assert [int(8 * (place + 1)) for place in places] == list(range(16))


EVEN: dict = {"x": {"within": 1.0}, "y": {"within": 1.0}}


def test_sobol_indices_are_drawn_alike_again():
    asked: dict = {"of": "growth", "design": "sobol", "indices": True}
    system = damped("x*y", x=0.0, y=0.0)
    one, again = (scatter(system, EVEN, 16, 2, **asked) for _ in range(2))
    assert again.indices == one.indices


@pytest.mark.parametrize(
    ("factor", "single", "total"),
    [("4*x + 3*y", (0.64, 0.36), (0.64, 0.36)), ("x*y", (0.0, 0.0), (1.0, 1.0))],
)
def test_sobol_indices_are_those_of_a_sum_and_of_a_product(factor, single, total):
    asked: dict = {"of": "growth", "design": "sobol", "indices": True}
    answer = scatter(damped(factor, x=0.0, y=0.0), EVEN, 256, 2, **asked)
    assert len(answer.rows) == 512
    found = {one.parameter: one for one in answer.indices}
    for name, alone, whole in zip("xy", single, total, strict=True):
        one = found[name]
        assert (one.first, one.total) == pytest.approx((alone, whole), abs=0.08)
        assert one.first_interval[0] <= alone <= one.first_interval[1]
        assert 0.0 <= one.total_interval[0] <= whole <= one.total_interval[1] <= 1.0


def test_a_stopped_run_goes_on_and_gives_the_same(tmp_path):
    system = damped("x + y", x=0.0, y=0.0)
    journal = tmp_path / "samples"
    asked: dict = {"samples": 40, "of": "growth"}

    def stop(done, count):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        scatter(system, EVEN, **asked, journal=journal, progress=stop)
    with journal.open("a") as stream:
        stream.write("0123456789abcdef [1, [[")  # and was killed while it wrote
    steps = []
    again = scatter(system, EVEN, **asked, journal=journal, progress=lambda *one: steps.append(one))
    assert steps[0] == (2, 40)
    whole = scatter(system, EVEN, **asked)
    assert again.to_records() == whole.to_records()
    assert scatter(system, EVEN, **asked, journal=journal).to_records() == whole.to_records()
    with pytest.raises(InputError, match="no samples of this question"):
        scatter(system, EVEN, **asked, rng=2, journal=journal)
    with pytest.raises(InputError, match="plain file"):
        scatter(system, EVEN, **asked, journal=tmp_path)
    broken = journal.read_text().splitlines()
    broken[-1] = broken[-1][: len(broken[-1]) // 2]
    journal.write_text("\n".join(broken) + "\n")
    with pytest.warns(InputWarning, match="last line is broken"):
        mended = scatter(system, EVEN, **asked, journal=journal)
    assert mended.to_records() == whole.to_records()
    journal.write_text(journal.read_text().replace("0.", "1.", 1))
    with pytest.raises(InputError, match="no samples of this question"):
        scatter(system, EVEN, **asked, journal=journal)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"spreads": {"k2": {"about": 0.1}}}, r"spreads\.k2"),
        ({"spreads": {"k2": {"relative": 0.0}}}, r"spreads\.k2"),
        ({"spreads": {"k2": {"within": np.nan}}}, r"spreads\.k2"),
        ({"spreads": {"k2": {"between": [1, 0]}}}, r"spreads\.k2"),
        ({"spreads": {"k_c": {"relative": 0.1}}}, "k_c is no parameter here"),
        ({"spreads": {"mu": {"relative": 0.1}}}, "mu is varied to find its threshold"),
        ({"samples": 100, "design": "sobol"}, "a power of 2 for the design sobol, such as 128"),
        ({"samples": 999_999, "design": "sobol"}, "such as 524288"),
        ({"high": 0.1}, "at least mu = 0.4"),
        ({"band": (1.0, 2.0)}, "band: is not allowed with a scene"),
        ({"of": "noise"}, "one of threshold, growth"),
    ],
)
def test_spreads_that_are_none_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        scatter(SCENE, **{"spreads": {"k1": {"relative": 0.1}}, "samples": 10} | given)


@pytest.mark.parametrize("factor", ["p", "(p + (p*p)**0.5)"])  # decays, or is exactly zero
@pytest.mark.parametrize("spread", [{"between": [-1.0, 0.3]}, {"between": [0.2, 0.3]}])
def test_bars_of_the_histogram_lie_on_one_side_of_the_limit(spread, factor):
    answer = scatter(damped(factor, p=0.2), {"p": spread}, samples=100, of="growth")
    bars = answer.plot().patches
    ends = [(one.get_x(), one.get_x() + one.get_width(), one.get_height()) for one in bars]
    assert all(high < 1e-6 or low > 0.0 for low, high, _ in ends)
    assert sum(count for *_, count in ends) == 100
    grow = sum(count for low, _, count in ends if low > 0.0)
    assert grow == np.sum(answer.values > 0.0) == 100 * (1.0 - answer.stable)


@pytest.mark.parametrize("name", ["share", "frequency_hz"])
def test_thresholds_over_a_parameter_with_the_name_of_a_column_keep_their_own(name):
    K = {"a": np.diag([1.0, 0.0]), "b": np.diag([0.0, 1.0]), name: [[0, 1], [-1, 0]]}
    pair = squeal.System(np.eye(2), K=K, parameters={"a": 3.0, "b": 2.0}, parameter=name)
    samples = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=8, high=1.0)
    for row in samples.to_records():
        assert row[f"parameter.{name}"] == pytest.approx(abs(row["a"] - 2.0) / 2.0)


@pytest.mark.parametrize(("residual", "lines"), [(1e-7, 0), (7e-5, 1)])
def test_an_unsolved_root_on_a_basis_is_warned_of(residual, lines):
    system = squeal.System([[1.0]], [[0.1]], {"k": [[4.0]]}, parameters={"k": 1.0})
    answer = squeal.scatter(system, {"k": {"relative": 0.1}}, samples=8, of="growth")
    on_basis = replace(answer, basis={"residual": residual})
    assert len(on_basis.warnings) == lines
    assert all("exceeds 1e-06" in line for line in on_basis.warnings)
