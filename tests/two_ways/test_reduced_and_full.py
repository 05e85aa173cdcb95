"""A band of a system from the full matrices, from a reduction, and from all roots."""

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import mmwrite
from scipy.sparse import coo_array

from tests.two_ways.asking import SEEDS, ask, cases, path, roots, uniform

LOW = 60.0  # Hz
HIGH = 260.0
FASTEST = 0.2 * 2 * np.pi * HIGH  # 1/s, inside the 0.25 to which a band's region reaches


@st.composite
def chains(draw):
    """A system file of 30 to 60 masses in a row, with friction in some links and damping."""
    n = draw(st.integers(30, 60))
    links = draw(st.integers(1, 4))
    rng = np.random.default_rng(draw(SEEDS))
    k = 1e6 * rng.uniform(0.7, 1.3, n + 1)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    K1 = np.zeros((n, n))
    for i in rng.integers(0, n - 1, links):
        size = 2e6 * rng.uniform(0.3, 1.0)
        K1[i, i + 1] += size
        K1[i + 1, i] -= size
    file = path("chain.yaml")
    matrices = {"M": np.diag(rng.uniform(0.8, 1.2, n)), "K0": K, "K1": K1}
    for name, X in matrices.items():
        mmwrite(file.parent / f"{name}.mtx", coo_array(X))
    document = {"parameters": {"mu": 0.2}, "M": {"file": "M.mtx"}}
    document["K"] = [{"file": "K0.mtx"}, {"file": "K1.mtx", "factor": "mu"}]
    document["damping"] = {"rayleigh": [draw(uniform(1.0, 10.0)), draw(uniform(1e-7, 1e-5))]}
    file.write_text(yaml.safe_dump(document))
    return file


def upper(found):
    """The roots of the band above the real axis.

    Those that decay or grow by more than a quarter of its upper end are left out, as answers tell.
    """
    inside = [z for z in roots(found) if LOW <= z.imag / (2 * np.pi) <= HIGH]
    return np.array([z for z in inside if abs(z.real) < FASTEST])


def assert_same_roots(one, other, close):
    assert len(one) == len(other)
    assert (np.abs(one[:, None] - other).min(axis=1) <= close * np.abs(one)).all()


BAND = ("--band", f"{LOW}:{HIGH}")


@cases(2, 0.02)
@given(chains(), st.lists(uniform(0.0, 1.0), min_size=2, max_size=2, unique=True))
def test_a_sweeps_reduced_roots_are_the_full_ones(file, values):
    low, high = sorted(values)
    sweep = ("--sweep", f"{low!r}:{high!r}:3", *BAND, "--method")
    full = ask("eigenvalues", file, *sweep, "full")
    reduced = ask("eigenvalues", file, *sweep, "reduced")
    for one, other in zip(full["sweep"], reduced["sweep"], strict=True):
        assert_same_roots(upper(one), upper(other), 1e-6)
        # of a reduced system some roots only are known, and those outside of its region are not
        assert other["verdict"] in (one["verdict"], None)


@cases(3, 0.03)
@given(chains(), uniform(0.0, 1.0))
def test_a_band_holds_those_of_all_roots(file, value):
    every = ask("eigenvalues", file, "--at", repr(value))
    region = f"-400:400:{2 * np.pi * LOW!r}:{2 * np.pi * HIGH!r}"
    found = ask("eigenvalues", file, "--at", repr(value), "--region", region)
    assert found["certified"] is True
    assert_same_roots(upper(every), upper(found), 1e-9)


@cases(2, 0.015)
@given(chains())
def test_thresholds_of_a_band_are_those_of_all_that_lie_in_it(file):
    band = ask("critical-friction", file, "--max", 1, *BAND)
    every = ask("critical-friction", file, "--max", 1)
    inside = [c for c in every["crossings"] if LOW < c["frequency_hz"] < HIGH]
    for key in ("kind", "direction"):
        assert [c[key] for c in band["crossings"]] == [c[key] for c in inside]
    for key in ("mu", "frequency_hz"):
        expected = pytest.approx([c[key] for c in inside], rel=1e-8)
        assert [c[key] for c in band["crossings"]] == expected


@cases(1, 0.02)
@given(chains())
def test_an_exported_reduction_has_the_roots_of_the_full_system(file):
    folder = path("reduced")
    options = ("--method", "reduced", *BAND, "--sweep", "0:1:5")
    ask("export", file, *options, "--output", folder)
    for value in (0.0, 0.5, 1.0):
        one = ask("eigenvalues", file, "--at", value)
        other = ask("eigenvalues", folder / "system.yaml", "--at", value)
        assert_same_roots(upper(one), upper(other), 1e-5)
