"""Directions of whirls against closed forms: stiffening bearings, several discs, orbits."""

import numpy as np
import pytest
import scipy.linalg
from scipy.sparse import csc_array

import squeal
from squeal.errors import InputError, InputWarning

EYE = np.eye(2)
SPIN = np.array([[0.0, 1.0], [-1.0, 0.0]])
NODES = tuple((node, freedom) for node in (1, 2) for freedom in (1, 2))


def directions(system, high, **settings):
    found = squeal.critical_speeds(system, high, **settings).critical
    return [(pytest.approx(one.speed, rel=1e-9), one.direction) for one in found]


def tilt(J, terms, factor="Omega", matrix=None, **parameters):
    """A disc of unit inertia that tilts on bearings, and J SPIN in C times the speed."""
    C = {factor: J * SPIN if matrix is None else matrix}
    return squeal.System(EYE, C, terms, parameters, parameter="Omega")


@pytest.mark.parametrize("slope", [-300.0, -50.0, 0.0, 50.0, 300.0])
def test_bearings_that_stiffen_or_soften_do_not_turn_the_whirl(slope):
    """W^2 (1 -+ J) = k0 + k1 W, whatever the sign of the slope of the frequency."""
    J = 0.2
    k0 = 1e5
    system = tilt(J, {"k0 + k1 * Omega": EYE}, k0=k0, k1=slope)
    exact = []
    for way, sign in (("backward", 1.0), ("forward", -1.0)):
        (speed,) = [w for w in np.roots([1.0 + sign * J, -slope, -k0]) if w > 0.0]
        exact.append((speed, way))
    assert directions(system, 1500.0) == sorted(exact)


def test_a_table_of_bearings_over_the_speed_does_not_turn_the_whirl():
    """k = 1e5 + 300 W by a formula of two parameters, with a cross-coupled damping of its own."""
    cross = {"Omega": 0.2 * SPIN, "1": 2 * EYE, "(1 + Omega / 1e3) ** 2": -0.4 * SPIN}
    system = squeal.System(EYE, cross, {"1e5 + 300 * Omega": EYE}, parameter="Omega")
    assert [way for _, way in directions(system, 1500.0)] == ["backward", "forward"]


@pytest.mark.parametrize(
    ("factor", "matrix"),
    [
        ("Omega", 0.2 * SPIN),
        ("-Omega", -0.2 * SPIN),
        ("2 * share * Omega", SPIN),
        ("Omega / 10", 2.0 * SPIN + np.diag([1.0, 3.0])),
    ],
)
def test_the_direction_is_that_of_the_term_however_it_is_written(factor, matrix):
    values = {"share": 0.1} if "share" in factor else {}
    system = tilt(0.2, 1e5 * EYE, factor, matrix, **values)
    assert [way for _, way in directions(system, 1500.0)] == ["backward", "forward"]


def test_mirrored_coordinates_have_the_same_directions():
    """y is written with the other sign, in which a disc has -J in the place of J."""
    assert [way for _, way in directions(tilt(-0.2, 1e5 * EYE), 1500.0)] == ["backward", "forward"]


@pytest.mark.parametrize(("second", "way"), [(1.0, "mixed"), (0.8, "mixed"), (0.1, "forward")])
def test_discs_that_whirl_against_each_other_are_mixed(second, way):
    """x in phase and y against: one disc whirls forward, the other backward, with 1 : second."""
    x = np.array([[2.0, -1.0], [-1.0, 2.0]]) * 1e4
    K = np.kron(x, np.diag([1.0, 0.0])) + np.kron(np.abs(x), np.diag([0.0, 1.0]))
    G = scipy.linalg.block_diag(SPIN, second * SPIN) * 1e-3
    damping = scipy.linalg.block_diag(SPIN, -SPIN) * 20.0  # parts the pair of equal frequencies
    system = squeal.System(np.eye(4), {"Omega": G, "1": damping}, K, parameter="Omega")
    first = squeal.critical_speeds(system, 150.0).critical
    assert {one.direction for one in first} == {way, "backward" if way == "forward" else way}


def test_a_jeffcott_rotor_tells_a_direction_by_its_orbit_where_rows_are_known():
    """z'' + c z' + (k - i q) z = 0 of z = x + i y: exp(i w t) gains q and is forward."""
    c, k, q = 4.0, 1e4, 600.0
    K = {"1": k * EYE + q * SPIN, "0 * Omega": EYE}
    forward = max(np.roots([1.0, c, k - 1j * q]), key=lambda z: z.imag)
    found = {}
    for labels in ((), ((7, 1), (7, 2)), ((7, 2), (7, 3)), ((7, 1), (7, 3)), (("a", "x"), 3)):
        system = squeal.System(EYE, c * EYE, K, parameter="Omega", labels=labels)
        answer = squeal.critical_speeds(system, 200.0).critical
        assert len(answer) == 2
        found[labels] = {round(one.growth_rate, 6): one.direction for one in answer}
    rates = round(forward.real, 6), round(-c - forward.real, 6)
    assert rates[0] > 0.0
    assert found[()] == found[("a", "x"), 3] == dict.fromkeys(rates)
    for pair in (((7, 1), (7, 2)), ((7, 2), (7, 3))):
        assert found[pair] == dict(zip(rates, ("forward", "backward"), strict=True))
    # a shaft along y turns from z to x
    assert found[(7, 1), (7, 3)] == dict(zip(rates, ("backward", "forward"), strict=True))


def test_damping_that_turns_with_the_shaft_tells_the_direction():
    """z'' + (ce + ci) z' + (k - i ci W) z = 0: forward whirl grows from W = w (1 + ce / ci) on."""
    outer, inner, k = 2.0, 1.0, 1e4
    K = {"1": k * EYE, "Omega": inner * SPIN}
    system = squeal.System(EYE, (outer + inner) * EYE, K, parameter="Omega")
    found = squeal.critical_speeds(system, 500.0, orders=(0.25,)).critical
    rates = {one.direction: one.growth_rate for one in found}
    assert rates["forward"] > 0.0 > rates["backward"]


def test_bearings_of_which_one_whirls_forward_and_one_backward_are_mixed():
    """A rigid rotor by its displacements at two bearings; orbits from numpy alone."""
    mass, Jd, Jp, length = 10.0, 0.4, 0.3, 0.5
    mean = np.array([0.5, 0.5])
    turn = np.array([-1.0, 1.0]) / length
    plane = mass * np.outer(mean, mean) + Jd * np.outer(turn, turn)
    M = np.kron(plane, EYE)
    G = np.kron(Jp * np.outer(turn, turn), SPIN)
    K = np.diag([1e6, 0.9e6, 1.3e6, 2.0e6])
    ways = []
    for labels in ((), NODES):
        system = squeal.System(M, {"speed": G}, K, parameter="speed", labels=labels)
        ways.append(squeal.critical_speeds(system, 3000.0).critical)
    expected = []
    for one in ways[1]:
        A = np.linalg.solve(M, np.hstack([K, one.speed * G]))
        values, vectors = np.linalg.eig(np.block([[np.zeros((4, 4)), np.eye(4)], [-A]]))
        x1, y1, x2, y2 = vectors[:4, np.argmin(np.abs(values - 1j * one.speed))]
        turns = {np.sign((x1 * np.conj(y1)).imag), np.sign((x2 * np.conj(y2)).imag)}
        expected.append(
            {1.0: "forward", -1.0: "backward"}[turns.pop()] if len(turns) == 1 else "mixed"
        )
    assert [one.direction for one in ways[1]] == expected
    assert "mixed" in expected
    assert "mixed" not in [one.direction for one in ways[0]]  # the term alone does not see it


def test_a_file_with_coordinates_finds_the_shaft(tmp_path):
    """Rows in x, y and z of nodes along z, or along x: the shaft turns from x to y, or y to z."""
    rows = np.array([(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)])
    ways = {}
    for axis in (0, 2):
        across = [d for d in range(3) if d != axis]
        K = 1e4 * np.eye(6)
        for node in range(2):
            at = [3 * node + d for d in across]
            K[np.ix_(at, at)] += 300.0 * SPIN
            K[3 * node + axis, 3 * node + axis] = 1e8
        places = np.zeros((2, 3))
        places[1, axis] = 1.0
        lines = ["node,dof,x,y,z"]
        for node, direction in rows:
            lines.append(f"{node},{'xyz'[direction]},{','.join(map(str, places[node]))}")
        (tmp_path / "nodes.csv").write_text("\n".join(lines) + "\n")
        text = "parameter: speed\ncoordinates: {file: nodes.csv}\n"
        text += f"M: {np.eye(6).tolist()}\nC: {(4 * np.eye(6)).tolist()}\n"
        text += (
            f"K: [{{matrix: {K.tolist()}}}, {{matrix: {np.eye(6).tolist()}, factor: 0*speed}}]\n"
        )
        (tmp_path / "jeffcott.yaml").write_text(text)
        found = squeal.critical_speeds(squeal.read_system(tmp_path / "jeffcott.yaml"), 200.0)
        ways[axis] = {one.direction: one.growth_rate for one in found.critical}
    for rates in ways.values():
        assert rates["forward"] > rates["backward"]


def test_a_large_rotor_has_the_directions_of_its_discs(monkeypatch):
    """30 discs that tilt at n^2 = W^2 (1 +- J), reduced to those of a band."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)
    monkeypatch.setattr("squeal.queries.critical_speeds.STEPS", 50)
    n = 30
    J = 0.3
    K = csc_array(np.kron(np.diag(np.arange(1.0, n + 1.0) ** 2), EYE))
    G = csc_array(np.kron(J * np.eye(n), SPIN))
    labels = tuple((node, freedom) for node in range(1, n + 1) for freedom in (1, 2))
    M = csc_array(np.eye(2 * n))
    system = squeal.System(M, {"speed": G}, K, parameter="speed", labels=labels)
    exact = [(k / np.sqrt(1 + J), "backward") for k in (1, 2, 3)]
    exact += [(k / np.sqrt(1 - J), "forward") for k in (1, 2, 3)]
    assert directions(system, 3.4, band=(0.1, 1.0)) == sorted(exact)[:5]


def test_modes_of_one_frequency_have_their_own_growth():
    """-10 + 100i and -20 + 100i, from k = 100^2 + (c/2)^2."""
    for w in (100.0, 123.4, 57.3, 88.8, 141.421):
        K = {"1": np.diag([w * w + 100.0, w * w + 400.0]), "0 * Omega": EYE}
        system = squeal.System(EYE, np.diag([20.0, 40.0]), K, parameter="Omega")
        found = squeal.critical_speeds(system, 200.0).critical
        assert [one.mode for one in found] == [1, 2]
        assert sorted(one.growth_rate for one in found) == pytest.approx([-20.0, -10.0])


def test_a_speed_that_is_not_the_free_parameter_is_refused(tmp_path):
    system = squeal.System(EYE, {"Omega": SPIN}, {"k": EYE}, {"Omega": 1.0, "k": 4.0})
    with pytest.raises(InputError, match=r"mu .* no matrix depends on it.* Omega, k"):
        squeal.critical_speeds(system, 10.0)
    text = "parameters: {Omega: 1.0}\nM: [[1]]\nC: [{matrix: [[1]], factor: Omega}]\nK: [[4]]\n"
    (tmp_path / "rotor.yaml").write_text(text)
    with pytest.raises(InputError, match="no matrix depends"):
        squeal.critical_speeds(squeal.read_system(tmp_path / "rotor.yaml"), 10.0)
    (tmp_path / "rotor.yaml").write_text("parameter: Omega\n" + text)
    assert squeal.critical_speeds(squeal.read_system(tmp_path / "rotor.yaml"), 10.0).critical
    with pytest.warns(InputWarning, match="matrices depend on no parameter"):  # as of a shaft
        found = squeal.critical_speeds(squeal.System(EYE, K=4 * EYE), 10.0)
    assert [one.speed for one in found.critical] == pytest.approx([2.0, 2.0])


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_an_overhung_disc_is_named_alike_with_and_without_labels_whichever_way_it_turns(sense):
    """Gyroscopic moments in the rows of tilts alone, where no orbit tells the sense of the shaft.

    In q = u + i slope the whirl at the speed sees the inertia Jd -+ Jp: Stodola and Green.
    """
    EI, length, mass, Jd, Jp = 5e4, 0.6, 20.0, 0.3, 0.2
    plane = EI / length**3 * np.array([[12, -6 * length], [-6 * length, 4 * length**2]])
    K = scipy.linalg.block_diag(plane, plane)
    G = np.zeros((4, 4))
    G[1, 3] = sense * Jp  # slopes of x and y, as a shaft from x to y has them with +Jp
    G[3, 1] = -sense * Jp
    exact = []
    for way, inertia in (("forward", Jd - Jp), ("backward", Jd + Jp)):
        squares = scipy.linalg.eigvals(plane, np.diag([mass, inertia])).real
        exact += [(w, way) for w in np.sqrt(squares) if w < 1500.0]
    for labels in ((), ((1, 1), (1, 5), (1, 2), (1, 4))):
        system = squeal.System(
            np.diag([mass, Jd] * 2), {"Omega": G}, K, parameter="Omega", labels=labels
        )
        assert directions(system, 1500.0) == sorted(exact)


@pytest.mark.parametrize("cutoff", ["", "cutoff: 400.0"])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_rotor_of_reduced_components_whirls_alike_whichever_way_it_turns(tmp_path, sense, cutoff):
    """The overhung disc on its shaft, with a spring to a journal that a housing holds fast."""
    EI, length, mass, Jd, Jp, k = 5e4, 0.6, 20.0, 0.3, 0.2, 1e5
    plane = EI / length**3 * np.array([[12, -6 * length], [-6 * length, 4 * length**2]])
    K = scipy.linalg.block_diag(plane, plane, 1e9 * np.eye(3))
    for disc, journal in ((0, 4), (2, 5)):
        K[np.ix_([disc, journal], [disc, journal])] += k * np.array([[1, -1], [-1, 1]])
    G = np.zeros((7, 7))
    G[1, 3] = sense * Jp
    G[3, 1] = -sense * Jp
    M = np.diag([mass, Jd, mass, Jd, 1.0, 1.0, 1.0])
    nodes = {
        "rotor": ["1,x,0,0,0", "1,ry,0,0,0", "1,y,0,0,0", "1,rx,0,0,0"],
        "housing": [f"{node},{dof},0,0,{z}" for node, z in ((1, 0.6), (2, 0.8)) for dof in "xyz"],
    }
    nodes["rotor"] += [f"2,{dof},0,0,0.6" for dof in "xyz"]
    for name, lines in nodes.items():
        (tmp_path / f"{name}.csv").write_text("\n".join(["node,dof,x,y,z", *lines]) + "\n")
    (tmp_path / "rotor.yaml").write_text(
        "parameter: Omega\nparameters: {Omega: 0.0}\ncoordinates: {file: rotor.csv}\n"
        f"M: {M.tolist()}\nC: [{{matrix: {G.tolist()}, factor: Omega}}]\nK: {K.tolist()}\n"
    )
    fast = 1e9 * np.kron([[1, -1], [-1, 2]], np.eye(3))
    (tmp_path / "housing.yaml").write_text(
        f"coordinates: {{file: housing.csv}}\nM: {np.eye(6).tolist()}\nK: {fast.tolist()}\n"
    )
    (tmp_path / "pairs.csv").write_text("first,second\n2,1\n")
    (tmp_path / "joined.yaml").write_text(
        f"parameter: Omega\nparameters: {{Omega: 0.0}}\n{cutoff}\n"
        "components: {rotor: {file: rotor.yaml}, housing: {file: housing.yaml}}\n"
        "contact: [{between: [rotor, housing], pairs: {file: pairs.csv}, normal: [0, 0, 1],\n"
        "sliding: [1, 0, 0], friction: 0, stiffness: 1e8, tangential: 1e8, bonded: true}]\n"
    )
    plane[0, 0] += k
    exact = []
    for way, inertia in (("forward", Jd - Jp), ("backward", Jd + Jp)):
        squares = scipy.linalg.eigvals(plane, np.diag([mass, inertia])).real
        exact += [(speed, way) for speed in np.sqrt(squares) if speed < 1500.0]
    found = squeal.critical_speeds(squeal.read_system(tmp_path / "joined.yaml"), 1500.0).critical
    assert [one.direction for one in found] == [way for _, way in sorted(exact)]
    speeds = [speed for speed, _ in sorted(exact)]
    assert [one.speed for one in found] == pytest.approx(speeds, rel=1e-3)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 3, 1), (3, 1, 0, 2)])
def test_rows_without_labels_tell_the_whirl_that_the_vector_of_the_disc_turns_in(sense, order):
    """A disc amid a shaft, rows x, y and two tilts in any order: gyroscopic forces see the tilts,
    damping on the shaft what moves across it. z = x + i y turns in the sense of the sign of omega
    in z exp(i omega t): 2 omega^2 - (10 + 4) i omega - 3e5 + 4 i W = 0."""
    G, turning = np.zeros((4, 4)), np.zeros((4, 4))
    G[2:, 2:] = sense * 0.06 * SPIN
    turning[:2, :2] = sense * 4.0 * SPIN
    constant = (
        np.diag([2.0, 2, 0.03, 0.03]),
        np.diag([14.0, 14, 0, 0]),
        np.diag([3e5, 3e5, 12e3, 12e3]),
    )
    M, C, K, G, turning = (A[np.ix_(order, order)] for A in (*constant, G, turning))
    system = squeal.System(M, {"1": C, "W": G}, {"1": K, "W": turning}, {"W": 600.0}, "W")
    found = squeal.critical_speeds(system, 1500.0).critical
    assert [one.direction for one in found if one.speed < 370.0] == ["backward"]
    across = [one for one in found if one.speed > 370.0]
    assert {one.direction for one in across} == {"forward", "backward"}
    for one in across:
        turns = 1.0 if one.direction == "forward" else -1.0
        roots = np.roots([2.0, -14j, -3e5 + 4j * one.speed])
        (omega,) = roots[np.sign(roots.real) == turns]
        assert one.growth_rate == pytest.approx(-omega.imag, rel=1e-6)
