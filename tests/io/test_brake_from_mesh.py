"""The brake of the documentation: frequencies of CalculiX with its own contact, and of squeal."""

import importlib.util
import shutil

import numpy as np
import pytest
import scipy.linalg

import squeal
from benchmarks import calculix_peers
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from tests.conftest import ROOT

pytestmark = [
    pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX (ccx) is not installed"),
    pytest.mark.filterwarnings("ignore::squeal.errors.InputWarning"),  # of nodes inside elements
]
SCRIPT = ROOT / "docs" / "brake_from_mesh.py"
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


@pytest.fixture(scope="module")
def script():
    """The script of the documentation as a module."""
    found = importlib.util.spec_from_file_location("brake_from_mesh", SCRIPT)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def made(script, tmp_path_factory):
    """The script, its brake, the folder of its files, and what CalculiX prints without friction."""
    folder = tmp_path_factory.mktemp("brake")
    brake = script.Brake()
    script.write_files(folder, brake, mu=0.0)
    script.run_calculix(folder, "normal", script.contact_deck(brake))
    return script, brake, folder, script.printed(folder, "normal")[:, 0]


@pytest.fixture(scope="module")
def rubbing(made):
    """The brake with friction, its components reduced."""
    _, _, folder, _ = made
    text = (folder / "brake.yaml").read_text()
    path = folder / "rubbing.yaml"
    path.write_text(f"{text}cutoff: 24000\n".replace("mu: 0.0", "mu: 0.5"))
    return squeal.read_system(path)


def faces_minus_nodes(script, brake):
    """The springs over the faces (m, m) less those at the nodes, in the order of the pairs."""
    place = {second: i for i, (_, second) in enumerate(brake.shares)}
    areas = -np.diag(list(brake.shares.values()))
    first = len(brake.disc_elements) + 1
    for face in brake.faces["pad"]:
        nodes = brake.pad_elements[face - first][:4]
        rows = [place[node] for node in nodes]
        corners = np.array([brake.pad[node][:2] for node in nodes])
        for a in GAUSS:
            for b in GAUSS:
                shapes = np.array(
                    [(1 - a) * (1 - b), (1 + a) * (1 - b), (1 + a) * (1 + b), (1 - a) * (1 + b)]
                )
                slopes = np.array([[b - 1, 1 - b, 1 + b, -1 - b], [a - 1, -1 - a, 1 + a, 1 - a]])
                area = np.linalg.det(slopes @ corners / 4.0)
                areas[np.ix_(rows, rows)] += area * np.outer(shapes, shapes) / 16.0
    return script.STIFFNESS * areas


def lowest(system, count=12):
    values = squeal.eigenvalues(system, band=(500.0, 7000.0)).values.imag
    return np.sort(values[values > 0])[:count] / (2.0 * np.pi)


def test_frequencies_without_friction_are_those_of_calculix(made):
    script, brake, folder, wanted = made
    text = (folder / "brake.yaml").read_text()
    (folder / "reduced.yaml").write_text(f"{text}cutoff: 9000\n")
    joined = squeal.read_system(folder / "reduced.yaml").assembly
    assert joined.seats[0].closed.all()
    at_nodes = lowest(joined.system)
    assert at_nodes == pytest.approx(wanted[:12], rel=0.017)
    disc, pad = joined.components
    normal = np.zeros((len(brake.shares), joined.system.n))
    rows_of_disc = disc.rows_of([first for first, _ in brake.shares])[:, 2]
    rows_of_pad = pad.rows_of([second for _, second in brake.shares])[:, 2] + disc.system.n
    each = np.arange(len(normal))
    normal[each, rows_of_disc] = -1.0
    normal[each, rows_of_pad] = 1.0
    springs = Term(normal.T @ faces_minus_nodes(script, brake) @ normal)
    system = joined.system
    over_faces = TermSystem(system.M, system.C, (*system.K, springs), system.parameters)
    assert lowest(over_faces) == pytest.approx(wanted[:12], rel=1e-3)


def test_the_areas_of_the_pairs_are_those_of_the_sector(made):
    _, brake, _, _ = made
    angle = 2.0 * np.pi / 5.0
    assert sum(brake.shares.values()) == pytest.approx(0.5 * (0.10**2 - 0.08**2) * angle)


def test_the_terms_of_the_unstable_mode_are_those_of_the_documentation(rubbing):
    """They sum to the root, and 1 % of friction moves it as differences of all roots say."""
    found = squeal.eigenvalues(rubbing, band=(11500.0, 12000.0), prove=False)
    (unstable,) = found.unstable
    answer = squeal.energy(found)
    mode = found.mode_of(unstable)
    rows = {(row.part, row.term): row for row in answer.contributions if row.mode == mode}
    assert sum(row.growth for row in rows.values()) == pytest.approx(unstable.growth_rate)
    assert sum(row.frequency for row in rows.values()) == pytest.approx(unstable.frequency_hz)
    page = (ROOT / "docs" / "brake_from_mesh.md").read_text(encoding="utf-8")
    friction = rows["K", "(mu) * (contact)"]
    assert f"| 0 | {rows['K', '1'].frequency:.1f} |" in page
    assert f"| 0 | {rows['K', 'contact'].frequency:.1f} |" in page
    assert f"| {friction.growth:.1f} | {friction.frequency:.1f} |" in page
    shares = {row.part: row.growth for row in answer.part_shares if row.mode == mode}
    assert (
        f"takes up {shares['pad']:.0f} 1/s of the work, the\ndisc {shares['disc']:.0f} 1/s" in page
    )

    def root_at(mu):
        M, _, K = rubbing.system.arrays({"mu": mu})
        roots = np.sqrt(-scipy.linalg.eigvals(K, M).astype(complex))
        return roots[np.argmin(np.abs(roots - unstable.root))]

    moved = (root_at(0.5005) - root_at(0.4995)) / 0.2  # of 1 %, by a change of 0.2 %
    assert friction.d_real == pytest.approx(moved.real, rel=1e-3)
    assert friction.d_hz == pytest.approx(moved.imag / (2 * np.pi), rel=1e-3)


def test_peers_on_real_modes_find_what_all_rows_have(rubbing):
    """Of the benchmark: its projection against all roots of the undamped problem."""
    system = rubbing.system
    _, projected = calculix_peers.on_real_modes(system)
    M, _, K = system.arrays()
    roots = np.sqrt(-scipy.linalg.eigvals(K, M).astype(complex))
    upper = np.where(roots.imag < 0.0, -roots, roots)
    wanted = upper[np.argsort(upper.imag)][: calculix_peers.MODES]
    line = calculix_peers.compared(1.0, projected, wanted, calculix_peers.ALIKE)
    assert "24 of 24" in line
    line = calculix_peers.compared(1.0, projected[:5], wanted, calculix_peers.ALIKE)
    assert "24 of 24" not in line


def test_the_benchmark_says_that_calculix_is_missing(monkeypatch, capsys):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert calculix_peers.main() == 0
    assert capsys.readouterr().out.endswith("since ccx is not installed\n")
