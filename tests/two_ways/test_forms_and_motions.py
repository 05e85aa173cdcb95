"""One answer as JSON and CSV; one motion by two integrators and in a batch."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from squeal.model.contact import CONTACT_MODELS
from tests.conftest import needs_heyoka
from tests.two_ways.asking import PADS, ask, ask_if_any, cases, pads, path, rows, uniform, written


def growing_modes(scene, mu):
    changed = scene | {"parameters": scene["parameters"] | {"mu": mu}}
    return len(ask("eigenvalues", written(changed))["unstable"])


@cases(3, 0.05)
@given(pads())
def test_thresholds_are_the_same_as_json_and_as_a_table(scene):
    table = path("found.csv")
    file = written(scene)
    found = ask("critical-friction", file, "--csv", table)
    listed = rows(table)
    # where the contact changes two modes may diverge at once: two crossings, one change
    values = [float(row["mu"]) for row in listed]
    for mu in {mu for mu in values if values.count(mu) > 1}:
        ways = [row["direction"] for row in listed if float(row["mu"]) == mu]
        below = growing_modes(scene, mu * (1 - 1e-6))
        above = growing_modes(scene, mu * (1 + 1e-6))
        assert ways.count("up") - ways.count("down") == above - below
    pairs = [(float(r["mu"]), r["verdict"]) for r in listed if r["verdict"]]
    assert [*dict.fromkeys(pairs)] == [(c["mu"], c["kind"]) for c in found["critical"]]
    assert all(c["interval"][0] <= c["mu"] <= c["interval"][1] for c in found["critical"])


def motion(model, alpha1, alpha2, mu, y_dot):
    """A pad that starts beside its equilibrium and leaves it through changes of contact."""
    pad = PADS[model] | {"alpha1": alpha1, "alpha2": alpha2, "mu": mu}
    kick = {"from": "equilibrium", "y_dot": y_dot}
    return {
        "model": model,
        "parameters": pad,
        "initial": kick,
        "time": {"stop": 0.002, "samples": 21},
        "outputs": ["events", "shares", "extrema"],
        "damping": {"ratios": [0.01, 0.01, 0.01]},
    }


MOTIONS = st.builds(
    motion,
    st.sampled_from(CONTACT_MODELS),
    uniform(1.2, 2.0),
    uniform(2.2, 2.9),
    uniform(0.05, 0.5),
    uniform(-0.4, 0.4),
)


@needs_heyoka
@cases(3, 0.02)
@given(MOTIONS)
# a point leaves for 4 microseconds, less than a step
@example(motion("BN", 1.86105, 2.27307, 0.0966728, -0.317026))
def test_two_integrators_give_one_motion(scene):
    file = written(scene)
    one = ask_if_any("simulate", file, "--integrator", "heyoka")
    other = ask("simulate", file, "--integrator", "scipy")
    for a, b in zip(one["events"], other["events"], strict=True):
        assert (a["from"], a["to"]) == (b["from"], b["to"])
        assert a["t"] == pytest.approx(b["t"], abs=1e-9)
    assert one["shares"] == pytest.approx(other["shares"], abs=1e-6)
    for name, ends in one["extrema"].items():
        assert ends == pytest.approx(other["extrema"][name], rel=1e-6, abs=1e-6), name
    a = [one["final"][n] for n in ("x", "y", "theta")]
    b = [other["final"][n] for n in ("x", "y", "theta")]
    assert np.allclose(a, b, rtol=1e-6, atol=1e-10)


@cases(3, 0.02)
@given(MOTIONS)
def test_a_motions_table_ends_where_the_answer_does(scene):
    table = path("history.csv")
    file = written(scene)
    found = ask_if_any("simulate", file, "--csv", table)
    last = rows(table)[-1]
    for name, value in found["final"].items():
        (column,) = [x for x in last if x.split(" ")[0] == name]
        assert float(last[column]) == pytest.approx(value, rel=1e-14), name
    assert sum(found["shares"].values()) == pytest.approx(1.0)
