"""`eigenvalues` at one value or over a sweep, and the thresholds between."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.two_ways.asking import (
    SEEDS,
    ask,
    ask_if_any,
    assert_same,
    cases,
    near,
    pads,
    setting,
    uniform,
    verdict_by,
    written,
)

MOST = 1.5


@cases(3, 0.15)
@given(pads(), st.integers(2, 7))
def test_a_pads_sweep_has_the_verdicts_between_its_thresholds(scene, count):
    file = written(scene)
    thresholds = ask("critical-friction", file, "--max", MOST)
    sweep = ask("eigenvalues", file, "--set", "mu=0.013", "--mu", f"0.013:{MOST}:{count}")["sweep"]
    values = np.linspace(0.013, MOST, count)
    assert [row["mu"] for row in sweep] == pytest.approx(values[: len(sweep)], rel=1e-14)
    for row in sweep:
        if near(thresholds, row["mu"]):
            continue
        if row["mu"] > thresholds["mu_end"]:
            assert row.get("verdict") in (None, "beyond a fold"), (scene, row["mu"])
        else:
            assert row["verdict"] == verdict_by(thresholds, row["mu"], scene), (scene, row["mu"])


@cases(2, 0.1)
@given(pads(), uniform(0.0, MOST))
def test_a_pad_at_one_friction_and_in_a_sweep_has_the_same_eigenvalues(scene, mu):
    file = written(scene)
    single = ask_if_any("eigenvalues", file, *setting(mu=mu))
    sweep = ask("eigenvalues", file, *setting(mu=mu), "--sweep", f"{mu / 2!r}:{mu!r}:2")
    last = sweep["sweep"][-1]
    assume(last.get("eigenvalues") and single["how"].startswith("on the branch"))
    assert_same(last, single)


@st.composite
def systems(draw):
    """A system file in the short form: 2 to 5 rows, K0 + p K1 and perhaps C0 + p C1."""
    n = draw(st.integers(2, 5))
    rng = np.random.default_rng(draw(SEEDS))
    squares = np.diag(np.sort(rng.uniform(1.0, 9.0, n)))
    mix = np.eye(n) + 0.3 * rng.uniform(-1, 1, (n, n))
    M = mix.T @ mix
    K0 = mix.T @ squares @ mix
    document = {"M": M, "K0": (K0 + K0.T) / 2, "K1": rng.uniform(-1, 1, (n, n))}
    if draw(st.booleans()):
        document |= {"C0": 0.02 * K0, "C1": 0.02 * rng.uniform(-1, 1, (n, n))}
    rounded = {name: np.round(X, 4).tolist() for name, X in document.items()}
    return {"name": "random", "parameter": "p", **rounded}


@cases(4, 0.165)
@given(systems(), st.lists(uniform(0.0, 2.0), min_size=3, max_size=3))
def test_a_systems_verdict_is_the_one_between_its_thresholds(system, values):
    file = written(system)
    thresholds = ask("critical-friction", file, "--max", 2)
    kinds = {"flutter": 2, "divergence": 1}
    for value in values:
        if near(thresholds, value):
            continue
        found = ask("eigenvalues", file, "--at", repr(value))
        assert found["verdict"] == verdict_by(thresholds, value, system), value
        growing = sum(kinds[mode["kind"]] for mode in found["unstable"])
        assert (growing > 0) == (found["verdict"] in kinds), value
        if "C0" in system:  # a crossing is then a growing root more or less
            crossed = [c for c in thresholds["crossings"] if c["mu"] < value]
            net = sum(kinds[c["kind"]] * {"up": 1, "down": -1}[c["direction"]] for c in crossed)
            assert growing == net, (value, thresholds["crossings"])
