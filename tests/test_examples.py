"""The files that users take: what the README shows, and what an eigenvalue solver finds of them."""

import numpy as np
import pytest
import yaml
from scipy.linalg import eigvals
from scipy.sparse import load_npz

import squeal
from tests.conftest import ROOT

EXAMPLES = ROOT / "examples"
BRAKE = EXAMPLES / "brake"


def test_the_pad_is_that_of_the_readme():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = readme.partition("```yaml\n")[2].partition("```")[0]
    assert (EXAMPLES / "pad.yaml").read_text(encoding="utf-8") == shown
    assert yaml.safe_load(shown)["model"] == "B1"


def brake_roots(mu):
    """Roots of the brake's matrices in the upper half plane, by SciPy alone."""
    names = ("mass", "stiffness", "contact", "friction")
    M, stiffness, contact, friction = (load_npz(BRAKE / f"{name}.npz").toarray() for name in names)
    K = stiffness + contact + mu * friction
    C = 3.0 * M + 3.0e-8 * stiffness
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    roots = eigvals(A)
    return roots[roots.imag > 0.0]


def test_the_brake_has_the_roots_that_scipy_finds():
    low, high = 500.0, 8000.0
    hertz = (brake_roots(0.4).imag / (2 * np.pi)).tolist()
    expected = sorted(value for value in hertz if low < value < high)
    found = squeal.eigenvalues(squeal.read_system(BRAKE / "system.yaml"), band=(low, high))
    assert sorted(root.frequency_hz for root in found.eigenvalues) == pytest.approx(
        expected, rel=1e-8
    )
    assert found.verdict == "flutter"


def test_the_brake_loses_stability_where_scipy_sees_it():
    band = (500.0, 8000.0)
    first = squeal.thresholds(squeal.read_system(BRAKE / "system.yaml"), high=0.5, band=band).first
    for side, grows in ((-1e-4, False), (1e-4, True)):
        roots = brake_roots(first.mu + side)
        hertz = roots.imag / (2 * np.pi)
        near = roots[np.abs(hertz - first.frequency_hz) < 5.0]
        assert len(near) == 2
        assert (near.real.max() > 0.0) == grows


def test_the_brake_is_made_from_its_geometry(tmp_path):
    """`python -m benchmarks.solid_brake FOLDER --example` remakes it."""
    pytest.importorskip("skfem")
    from benchmarks.solid_brake import write_example

    write_example(tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(
        file.name for file in BRAKE.iterdir()
    )
    for file in BRAKE.iterdir():
        if file.suffix == ".npz":
            apart = load_npz(file) - load_npz(tmp_path / file.name)
            assert abs(apart).max() <= 1e-12 * abs(load_npz(file)).max()
        else:
            again = (tmp_path / file.name).read_text(encoding="utf-8")
            assert again == file.read_text(encoding="utf-8")
