"""A pad and its exported matrices: the same eigenvalues and verdict from files of every format."""

import numpy as np
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tests.two_ways.asking import ask, ask_if_any, assert_same, cases, pads, path, written
from tests.two_ways.test_sweep_and_thresholds import systems

FORMATS = ("mtx", "mat", "npz")


@cases(3, 0.05)
@given(pads(), st.sampled_from(FORMATS))
def test_exported_matrices_are_those_of_the_pad(scene, form):
    file = written(scene)
    folder = path("matrices")
    found = ask_if_any("eigenvalues", file)
    ask("export", file, "--output", folder, "--format", form)
    assert_same(found, ask("eigenvalues", folder / "system.yaml"))


@cases(3, 0.05)
@given(systems(), st.sampled_from(FORMATS))
def test_a_system_and_its_export_have_the_same_thresholds(system, form):
    file = written(system)
    folder = path("matrices")
    ask("export", file, "--output", folder, "--format", form)
    again = folder / "system.yaml"
    assert yaml.safe_load(again.read_text())["parameter"] == "p"
    one = ask("critical-friction", file, "--max", 2)["crossings"]
    other = ask("critical-friction", again, "--max", 2)["crossings"]
    for key in ("kind", "direction"):
        assert [c[key] for c in one] == [c[key] for c in other]
    assert np.allclose([c["mu"] for c in one], [c["mu"] for c in other], rtol=1e-9)
    assert_same(ask("eigenvalues", file, "--at", 0.7), ask("eigenvalues", again, "--at", 0.7))


@cases(3, 0.05)
@given(pads(models=["B1", "B2"]))
def test_a_linear_pad_as_a_system_has_the_pads_thresholds(scene):
    """B3 is linear in mu: two exports are K0 and K1."""
    other = {"k3", "k4", "L1", "L2", "F_n", "y0"}
    numbers = {n: value for n, value in scene["parameters"].items() if n not in other}
    pad = scene | {"model": "B3", "parameters": {"k_c": 1e7} | numbers}
    at = [ask("eigenvalues", written(pad), "--set", f"mu={mu}") for mu in (0, 1)]
    K0, K1 = (np.array(x["K"]) for x in at)
    system = {"parameter": "mu", "M": at[0]["M"], "K0": at[0]["K"], "K1": (K1 - K0).tolist()}
    if "damping" in scene:
        system["C0"] = at[0]["C"]
    one = ask("critical-friction", written(pad))
    other = ask("critical-friction", written(system))
    assert [c["kind"] for c in one["critical"]] == [c["kind"] for c in other["critical"]]
    a = [c["mu"] for c in one["critical"]]
    b = [c["mu"] for c in other["critical"]]
    assert np.allclose(a, b, rtol=1e-8)
