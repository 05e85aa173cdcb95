"""What `squeal check` says of files, against what was put into them."""

import json
import re
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

import squeal
from squeal.cli.main import main
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.examples.brake import _grid, _mass_and_stiffness, solid_brake, write_brake
from squeal.io.coordinates import Coordinates
from squeal.io.system import SystemFile
from squeal.linear.matrices import dense
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.queries.check import _hints_of_slow_motions
from squeal.queries.real_modes import RealModes
from tests.conftest import ROOT


class Solid(NamedTuple):
    """A body as a brake has it: where its rows are, and their matrices."""

    system: TermSystem
    nodes: np.ndarray
    directions: np.ndarray
    coordinates: np.ndarray


@pytest.fixture(scope="module")
def brake():
    return solid_brake(500, around=60)


def file_of(brake, stiffness=1.0, mass=1.0, length=1.0):
    """The brake in other units."""
    own = brake.system
    K = tuple(Term(stiffness * t.matrix, t.factor) for t in own.K)
    M = tuple(Term(mass * t.matrix, t.factor) for t in own.M)
    at = Coordinates(brake.nodes, brake.directions, length * brake.coordinates)
    return SystemFile(TermSystem(M, (), K, own.parameters), coordinates=at)


def test_mass_and_modes_of_a_brake_are_reported(brake):
    found = squeal.check(file_of(brake), modes=4)
    M, _, K = brake.system.arrays({"mu": 0.0})
    exact = np.sqrt(eigh((K + K.T) / 2, M, eigvals_only=True, subset_by_index=(0, 3)))
    assert found.frequencies_hz == pytest.approx(exact / (2 * np.pi), rel=1e-9)
    along = [np.where(brake.directions == way, 1.0, 0.0) for way in range(3)]
    masses = [r @ M @ r for r in along]
    assert found.mass == pytest.approx(np.mean(masses))
    x = brake.coordinates[brake.nodes, 0]
    assert found.centre[0] == pytest.approx(sum(r @ M @ (r * x) for r in along) / sum(masses))
    assert (found.free, found.negative, found.hints) == (0, 0, ())


@pytest.mark.parametrize("copies", [1, 40])  # dense and sparse
def test_free_motions_and_negative_stiffness_are_counted(copies):
    chain = np.diag([1.0, 2.0, 1.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    chains = [chain] * 6
    springs = [np.diag(np.arange(2.0, 14.0))] * copies
    K = block_diag([*chains, *springs, [[-0.5]]])
    found = squeal.check(squeal.System(csc_array(np.eye(K.shape[0])), K=csc_array(K)), modes=2)
    assert (found.free, found.negative, found.mass) == (6, 1, None)
    assert 2 * np.pi * np.array(found.frequencies_hz) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ({"length": 1e3}, "mm, kg, N/m: frequencies are 1 "),
        ({"stiffness": 1e-3}, "m, kg, N/mm: frequencies are 0.0316 "),
        ({"stiffness": 1e-3, "length": 1e3}, "mm, kg, N/mm: frequencies are 0.0316 "),
        ({"stiffness": 1e-6, "length": 1e3}, "mm, kg, kN/mm: frequencies are 0.001 "),
        ({"mass": 1e3}, "m, g, N/m: frequencies are 0.0316 "),
        ({"mass": 1e-3}, "m, t, N/m: frequencies are 31.6 "),
        ({"mass": 1e-3, "length": 1e3}, "mm, t, N/m: frequencies are 31.6 "),
        # a density in kg/m^3 with lengths in mm, beside a modulus in MPa or in Pa
        (
            {"stiffness": 1e-3, "mass": 1e9, "length": 1e3},
            "mm, kg/m3 mm3, N/mm: frequencies are 1e-06 ",
        ),
        (
            {"stiffness": 1e3, "mass": 1e9, "length": 1e3},
            "mm, kg/m3 mm3, Pa mm: frequencies are 0.001 ",
        ),
    ],
)
def test_units_that_do_not_go_together_are_named_with_their_factor(brake, units, words):
    (hint,) = squeal.check(file_of(brake, **units)).hints
    assert f"looks like {words}times the true ones" in hint


MATERIALS = {  # modulus, Poisson's ratio and density
    "steel": (2.1e11, 0.3, 7850.0),
    "lead": (1.6e10, 0.44, 11300.0),
    "balsa": (1.0e8, 0.3, 120.0),
    "friction lining": (3.0e8, 0.3, 2300.0),
    "hard rubber": (5.0e7, 0.48, 1200.0),
    "soft rubber": (1.0e6, 0.45, 1000.0),
}


def box(*lengths):
    """Corners of the cells of a box in space, of lengths and numbers of cells."""
    x, y, z = (np.linspace(0.0, length, cells + 1) for length, cells in lengths)
    _, _, corners = _grid(x, y, z, closed=False)
    return np.array([a.ravel() for a in np.meshgrid(x, y, z, indexing="ij")]), corners


def ring(inner, outer, height, around, along):
    """A closed ring, one cell thick."""
    angles = 2 * np.pi * np.arange(around) / around
    radii = np.array([inner, outer])
    return _grid(radii, angles, np.linspace(0.0, height, along + 1), closed=True)[1:]


PARTS = {
    "block": box((0.1, 3), (0.08, 3), (0.06, 3)),
    "plate of 1 mm": box((0.3, 8), (0.3, 8), (0.001, 1)),
    "bar of a metre": box((1.0, 40), (0.01, 1), (0.01, 1)),
    "fine layers": box((0.2, 4), (0.2, 4), (0.01, 6)),
    "ring": ring(0.1, 0.14, 0.02, 20, 1),
    "can": ring(0.149, 0.15, 0.1, 24, 4),
}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("material", MATERIALS)
def test_no_sound_part_is_blamed_for_its_units(part, material):
    """Sums of elements are rounded: whether a free motion is one by the last digits is open."""
    places, cells = PARTS[part]
    turned = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0] @ places
    for at in (turned, places):
        M, K = _mass_and_stiffness(at, cells, MATERIALS[material])
        nodes, directions = np.divmod(np.arange(M.shape[0]), 3)
        body = Solid(TermSystem((Term(M),), (), (Term(K),), {}), nodes, directions, at.T)
        hints = squeal.check(file_of(body), modes=1).hints
        assert all(hint.startswith("slow motions, ") for hint in hints)
    in_mm = file_of(body, stiffness=1e-3, mass=1e-3, length=1e3)
    hints = squeal.check(in_mm, modes=1).hints
    assert all(hint.startswith("slow motions, ") for hint in hints)
    for length, units in RARER.items():
        hints = squeal.check(file_of(body, **units), modes=1).hints
        assert all(hint.startswith("slow motions, ") or length in hint for hint in hints)


SLINCH = 0.0254 / 4.448222  # 1 kg in lbf s2/in, and 1 N/m in lbf/in
RARER = {
    "in inches": {"length": 1 / 0.0254, "mass": SLINCH, "stiffness": SLINCH},
    "in centimetres": {"length": 1e2, "mass": 1e-2, "stiffness": 1e-2},  # N s2/cm and N/cm
}


@pytest.mark.parametrize("units", RARER)
def test_a_brake_of_steel_is_not_blamed_for_inches_or_centimetres(brake, units):
    assert squeal.check(file_of(brake, **RARER[units])).hints == ()


@pytest.mark.parametrize(
    ("length", "area", "modulus"),
    [
        (30.0, 7.7e-3, 2.1e11),  # a rail
        (0.33, 4.9e-8, 2.1e11),  # a string of a violin
        (1.0, 7.9e-7, 2.1e11),  # a wire
        (0.02, 1.0, 1.0e6),  # rubber a metre thick
    ],
)
@pytest.mark.parametrize("across", [0.0, 0.01])
def test_no_line_or_plane_is_blamed_for_a_density_that_it_has_not(length, area, modulus, across):
    """Bars of a density of 7850 kg/m^3, or of a rubber of 1100, one or two beside each other."""
    nodes = 40
    step = length / (nodes - 1)
    density = 1100.0 if modulus < 1e9 else 7850.0
    masses = np.full(nodes, density * area * step)
    stiffness = modulus * area / step * chain(np.ones(nodes - 1))
    places = np.zeros((2 * nodes, 3))
    places[:, 0] = np.tile(step * np.arange(nodes), 2)
    places[nodes:, 1] = across
    terms = Term(np.diag(np.tile(masses, 2))), Term(np.kron(np.eye(2), stiffness))
    system = TermSystem((terms[0],), (), (terms[1],), {})
    directions = np.zeros(2 * nodes, dtype=int)
    if across:
        at = Coordinates(np.arange(2 * nodes), directions, places)
    else:  # both bars on the nodes of one, in two directions
        directions[nodes:] = 1
        at = Coordinates(np.tile(np.arange(nodes), 2), directions, places[:nodes])
    hints = squeal.check(SystemFile(system, coordinates=at), modes=1).hints
    assert not any("looks like" in hint for hint in hints)


def test_what_cannot_be_checked_is_refused(brake):
    wrong: list = [(brake.system, 0), ("s.yaml", 1)]
    for subject, modes in wrong:
        with pytest.raises(InputError, match="not allowed"):
            squeal.check(subject, modes)


def test_nodes_are_found_by_the_labels_of_rows(tmp_path, brake):
    write_brake(tmp_path, brake, "abaqus")
    system = tmp_path / "system.yaml"
    whole = squeal.check(squeal.read_system(system))  # by the input file
    assert whole.elements == len(brake.cells)
    system.write_text(re.sub(r"(?s)file: brake.inp\n.*", "file: nodes.csv\n", system.read_text()))
    held = np.setdiff1d(np.arange(len(brake.coordinates)), brake.nodes)  # corners of elements
    each = np.concatenate([held, np.unique(brake.nodes)[::-1]])
    lines = (f"{node + 1},{','.join(map(repr, brake.coordinates[node].tolist()))}" for node in each)
    (tmp_path / "nodes.csv").write_text("\n".join(["node,x,y,z", *lines]))
    again = squeal.check(squeal.read_system(system))
    assert (again.mass, again.centre, again.size) == (whole.mass, whole.centre, whole.size)
    text = (tmp_path / "nodes.csv").read_text().splitlines()
    (tmp_path / "nodes.csv").write_text("\n".join(text[:-1]))
    with pytest.warns(InputWarning, match=f"no line for 1 nodes.* {each[-1] + 1}"):
        squeal.read_system(system)


def test_a_stiffness_for_the_mass_is_refused_in_time(brake):
    """All modes are one then, which no restart of ARPACK tells apart: it went on for 9 minutes."""
    own = brake.system
    stiffness = own.K[:1]
    file = SystemFile(TermSystem(stiffness, (), own.K, own.parameters))
    with pytest.raises(ComputationError, match="mass"):
        squeal.check(file)


def test_mass_and_stiffness_in_each_others_place_are_suspected(brake):
    M, _, K = brake.system.at({"mu": 0.0})
    with pytest.warns(InputWarning, match="are M and K swapped"):
        squeal.check(squeal.System(K, K=M))
    with pytest.warns(InputWarning, match="are M and K swapped"):
        squeal.eigenvalues(squeal.System(dense(K)[:50, :50], K=dense(M)[:50, :50]))


@pytest.mark.parametrize("discs", [3, 40])  # some, and so many that units are guessed
def test_a_model_of_torsion_has_no_mass_and_no_error_of_units(discs, capsys, tmp_path):
    lines = [f"{k},rz,0,0,{0.1 * k}" for k in range(discs)]
    (tmp_path / "nodes.csv").write_text("\n".join(["node,dof,x,y,z", *lines]) + "\n")
    inertia = (0.5 * np.eye(discs)).tolist()
    stiffness = (8.0 * np.eye(discs)).tolist()
    file = tmp_path / "shaft.yaml"
    file.write_text(f"coordinates: {{file: nodes.csv}}\nM: {inertia}\nK: {stiffness}\n")
    assert main(["check", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["mass"], found["centre"], found["hints"]) == (None, None, [])
    assert found["size"] == pytest.approx([0.0, 0.0, 0.1 * (discs - 1)])
    assert found["frequencies_hz"][0] == pytest.approx(4.0 / (2.0 * np.pi))
    assert main(["check", str(file)]) == 0
    assert "mass: unknown, since no displacement has one" in capsys.readouterr().out


def test_a_slow_part_of_unknown_size_is_no_error_of_units():
    """A cantilever of a metre has its lowest mode at 17 Hz."""
    square = (2.0 * np.pi * 17.0) ** 2
    part = squeal.System(np.eye(2), K=np.diag([square, 6.0 * square]))
    assert squeal.check(part).hints == ()


def chain(springs):
    """Stiffness of masses in a row, joined by springs and free at both ends."""
    n = len(springs) + 1
    K = np.zeros((n, n))
    for i, k in enumerate(springs):
        K[i : i + 2, i : i + 2] += [[k, -k], [-k, k]]
    return K


@pytest.mark.parametrize("spring", [1e-9, 1e-11, 1e-13, 1e-15, 1e-17])
@pytest.mark.parametrize("rows", [50, 410])  # dense and sparse
def test_a_weak_spring_is_no_free_motion(rows, spring):
    """Alone, and beside a chain that is free: entries are exact, however small they are."""
    stiff = np.linspace(0.5, 1.0, rows - 1)
    alone = squeal.System(csc_array(np.eye(rows)), K=csc_array(np.diag([spring, *stiff])))
    K = block_diag([chain(np.ones(rows - 2)), [[spring]]])
    beside = squeal.System(csc_array(np.eye(rows)), K=csc_array(K))
    for system, free in ((alone, 0), (beside, 1)):
        found = squeal.check(system)
        assert (found.free, found.negative) == (free, 0)
        assert 2 * np.pi * found.frequencies_hz[0] == pytest.approx(np.sqrt(spring), rel=1e-6)


def test_a_soft_mount_of_a_stiff_bar_is_no_free_motion():
    """Two masses on a spring of 1: half an ulp of the bar of 1e13 moves the square 1/2 by 1/500."""
    K = chain([1e13]) + np.diag([1.0, 0.0])
    found = squeal.check(squeal.System(np.eye(2), K=K))
    assert (found.free, found.negative) == (0, 0)
    assert (2 * np.pi * found.frequencies_hz[0]) ** 2 == pytest.approx(0.5, rel=4e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("massless", [0, 2])
def test_free_motions_of_a_stiffness_of_low_rank_are_all_counted(sign, massless):
    factor = np.random.default_rng(0).standard_normal((30, 3))
    has_no_mass = np.arange(30) >= 30 - massless
    K = factor @ np.diag([1.0, sign, 1.0]) @ factor.T + np.diag(1.0 * has_no_mass)
    M = np.diag(1.0 * ~has_no_mass)
    vibrating = 3 if sign > 0 else 2
    found = squeal.check(squeal.System(M, K=K))
    assert (found.free, found.negative) == (27 - massless, 3 - vibrating)
    assert len(found.frequencies_hz) == vibrating


def test_free_motions_that_a_reduction_made_stiff_are_hinted_at():
    """Of a free chain that static modes of its ends and fixed ones reduce, in doubles."""
    n = 80
    K = 1e9 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0] = K[-1, -1] = 1e9
    M = np.diag(np.linspace(0.1, 0.3, n))
    inner = slice(1, -1)
    basis = np.zeros((n, 12))
    basis[0, 0] = basis[-1, 1] = 1.0
    basis[inner, :2] = -np.linalg.solve(K[inner, inner], K[inner, [0, -1]])
    _, fixed_modes = eigh(K[inner, inner], M[inner, inner], subset_by_index=(0, 9))
    basis[inner, 2:] = fixed_modes
    reduced_K = basis.T @ K @ basis
    found = squeal.check(squeal.System(basis.T @ M @ basis, K=(reduced_K + reduced_K.T) / 2))
    assert found.free == 0
    (hint,) = found.hints
    assert hint.startswith("slow motions, 1 in number")


def test_a_slow_motion_of_negative_stiffness_has_no_frequency():
    squares = np.array([-4.0, 1.0, 1e6]) * np.pi**2
    modes = RealModes(squares, errors=np.full(3, 1e-3), noise=100.0)
    (hint,) = _hints_of_slow_motions(modes)
    assert hint.startswith(
        "slow motions, 2 in number, |omega|/2pi up to 1 Hz, 1 of negative stiffness: probably free"
    )
    (hint,) = _hints_of_slow_motions(modes._replace(squares=np.abs(squares)))
    assert hint.startswith("slow motions, 2 in number, at up to 1 Hz: probably free")


@pytest.mark.parametrize("springs", [[1 / 3, 1e8 / 7, 2e-3], [0.1, 0.3], [1e12 / 3, 0.7, 1e-3]])
def test_sums_that_were_rounded_leave_a_free_motion_free(springs):
    """The diagonal holds sums that are off by half an ulp: a chain of three springs is free."""
    found = squeal.check(squeal.System(np.eye(len(springs) + 1), K=chain(springs)))
    assert (found.free, found.negative) == (1, 0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ()),
        (
            {"m": 200.0, "I": None},
            ("m, g, N/m: frequencies are 0.0316 times",),
        ),
        ({"w": 40.0, "h": 14.0, "I": None}, ("mm, kg, N/m: ",)),
        ({"k1": 2e4, "k2": 2.6e4, "k3": 8.7e3, "k4": 8.7e3}, ("m, kg, N/mm: ",)),
    ],
)
def test_units_of_a_pad_are_checked_as_those_of_a_system(changes, words):
    """A pad of 200 g with its mass in grams was taken without a word."""
    scene = squeal.read_scene(ROOT / "examples" / "pad.yaml")
    found = squeal.check(scene.replace(**changes))
    hints = "; ".join(found.hints)
    assert all(part in hints for part in words)
    assert bool(found.hints) == bool(words)


def test_modes_of_a_pad_are_those_of_its_springs():
    """Frictionless, the press held by k1 at right angles: omega^2 from K about the equilibrium."""
    scene = squeal.read_scene(ROOT / "examples" / "pad.yaml")
    found = squeal.check(scene, modes=3)
    roots = squeal.eigenvalues(scene.replace(mu=0.0)).values
    upper = np.sort(roots.imag[roots.imag > 0.0])
    assert found.frequencies_hz == pytest.approx(upper / (2 * np.pi), rel=1e-9)
    assert (found.mass, found.size[:2], found.rows) == (0.2, (0.08, 0.028), 3)


@pytest.mark.parametrize("copies", [1, 40])  # dense and sparse
def test_a_mass_matrix_that_is_cut_is_none(copies):
    """Rows behind a cut have couplings and no diagonal. The modes of a large one changed from one
    run to the next."""
    mass = block_diag([np.array([[2.0, 1.0], [1.0, 2.0]])] * (10 * copies)).tolil()
    mass[-1, -1] = 0.0
    system = squeal.System(csc_array(mass), K=csc_array(np.eye(20 * copies)))
    rows = f"rows {20 * copies - 1} and {20 * copies}"
    with pytest.warns(InputWarning, match="M is no mass"):
        found = squeal.check(system)
    assert found.free is None
    assert re.search(rf"M is no mass: ({rows}|.*) are coupled by more", found.hints[0])


def test_rows_of_k_without_an_entry_are_named():
    K = csc_array(np.diag([1.0, 2.0, 0.0]))
    K.eliminate_zeros()
    found = squeal.check(squeal.System(csc_array(np.eye(3)), K=K))
    assert "1 row without an entry, the first is row 3" in found.checks["K"]
    assert found.free == 1


@pytest.mark.parametrize("modes", [380, 401, 1000])
def test_nearly_all_modes_of_a_large_system_are_given(modes):
    frequencies = np.linspace(1.0, 100.0, 402)
    system = squeal.System(eye_array(402), K=diags_array(frequencies**2))
    found = 2 * np.pi * np.array(squeal.check(system, modes=modes).frequencies_hz)
    assert found == pytest.approx(frequencies[:modes], rel=1e-9)


@pytest.mark.parametrize(("factor", "is_named"), [("1", True), ("lining", True), ("mu", False)])
def test_a_stiffness_of_which_a_part_is_given_is_named(factor, is_named):
    K = np.diag(np.full(6, 2.0)) - np.eye(6, k=1) - np.eye(6, k=-1)
    values = {"lining": 1.0} if factor == "lining" else None
    part = np.tril(K)
    part[0, 1] = -1.0  # a pair is left
    for matrix, alone in ((np.tril(K), 5), (part, 4), (K, 0), (K + 0.1 * np.eye(6, k=3), 0)):
        terms = {factor: matrix} if factor != "mu" else {"1": K, "mu": matrix}
        hints = "; ".join(squeal.check(squeal.System(np.eye(6), K=terms, parameters=values)).hints)
        assert (f"K.1: {alone} entries have none" in hints) == (is_named and alone > 0)
        assert ("have none" in hints) == (is_named and alone > 0)


@pytest.mark.parametrize("contacts", [1, 4])
def test_friction_in_numbers_is_no_half_of_a_stiffness(contacts):
    K = np.kron(np.eye(contacts), [[2.0, -0.4], [0.0, 1.0]])
    hints = squeal.check(squeal.System(np.eye(2 * contacts), K=K)).hints
    assert not any("have none" in hint for hint in hints)
