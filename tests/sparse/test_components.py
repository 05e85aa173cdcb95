"""Components: seating against all sets of closed pairs, power laws, balance, the full model."""

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh
from scipy.sparse import csc_array

import squeal
from squeal.errors import InputError, InputWarning

Z = (0, 0, 1)


def row(load, gap=0.0, mu=0.0, exponent=0.0):
    """A rigid plate on springs at four places, with their ground: a body of four free nodes, held
    along x, joined by stiff links to a mean motion (so it may tilt)."""
    rng = np.random.default_rng(1)
    B = rng.standard_normal((4, 4))
    beam = np.zeros((8, 8))
    beam[1::2, 1::2] = B.T @ B + 0.1 * np.eye(4)
    beam[::2, ::2] = 5.0 * np.eye(4) + 1.0
    beam[::2, 1::2] = 0.2
    beam[1::2, ::2] = 0.2
    nodes = np.repeat(range(4), 2)
    ways = np.tile([0, 2], 4)
    base = squeal.Component(squeal.System(np.eye(8), K=9.0 * np.eye(8), name="base"), nodes, ways)
    force = np.zeros(8)
    force[1::2] = load
    plate = squeal.Component(
        squeal.System(np.eye(8), K=beam, name="plate"), nodes, ways, load=force
    )
    pairs = [(i, i) for i in range(4)]
    contact = squeal.Contact(
        ("base", "plate"), pairs, Z, 3.0, sliding=(1, 0, 0), gap=gap, exponent=exponent
    )
    return squeal.assemble([base, plate], [contact], {"mu": mu}), base, plate


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_the_seat_is_the_one_of_all_sets_that_meets_the_conditions(mu):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        load = rng.normal(-1.0, 2.0, 4)
        gap = rng.uniform(0.0, 0.2, 4)
        K = np.zeros((16, 16))
        _, base, plate = row(np.full(4, -5.0))
        K[:8, :8] = base.system.at()[2]
        K[8:, 8:] = plate.system.at()[2]
        f = np.zeros(16)
        f[9::2] = load
        G = np.hstack([-np.eye(8)[1::2], np.eye(8)[1::2]])
        S = np.hstack([-np.eye(8)[::2], np.eye(8)[::2]])
        fitting = []
        for closed in itertools.product([0.0, 1.0], repeat=4):
            k = 3.0 * np.array(closed)[:, None]
            push = (G + mu * S).T
            u = np.linalg.solve(K + push @ (k * G), f - push @ (k[:, 0] * gap))
            if np.array_equal(-(G @ u) - gap > 0, np.array(closed) > 0):
                fitting.append((closed, u))
        assert len(fitting) == 1
        closed, u = fitting[0]
        if not any(closed):
            with pytest.raises(InputError):
                row(load, gap, mu)
            continue
        found = row(load, gap, mu)[0]
        assert found.seats[0].closed.tolist() == [bool(x) for x in closed]
        assert np.allclose(found.displacements, u, rtol=1e-10, atol=1e-12)


def test_contact_acts_on_both_bodies_alike_and_resists_no_common_motion():
    system = row(np.full(4, -5.0), mu=0.3)[0].system
    for term in system.K[1:]:
        assert np.allclose(term.matrix[:8] + term.matrix[8:], 0.0, atol=1e-14)
        assert np.allclose(term.matrix @ np.tile([0.7, -0.4], 8), 0.0, atol=1e-14)


def test_a_power_law_has_the_stiffness_of_hertz():
    """F = c h^(3/2), k = 3/2 c h^(1/2): dF/dh = stiffness F^(1/3)."""
    c = 2.0
    force = 5.0
    ground = squeal.Component(squeal.System([[1.0]], K=[[1e9]], name="a"), [1], [2])
    ball = squeal.Component(squeal.System([[1.0]], K=[[0.0]], name="b"), [1], [2], load=[-force])
    law = squeal.Contact(("a", "b"), [(1, 1)], Z, 1.5 * c ** (2 / 3), exponent=1 / 3)
    found = squeal.assemble([ground, ball], [law])
    h = (force / c) ** (2 / 3)
    assert -found.displacements[1] == pytest.approx(h, rel=1e-8)
    assert found.system.K[-1].matrix[1, 1] == pytest.approx(1.5 * c * h**0.5, rel=1e-8)


def test_a_reduced_brake_has_the_roots_of_the_full_one():
    from dataclasses import replace

    from squeal.examples.brake import solid_brake

    brake = solid_brake(600, around=12)
    bodies = brake.bodies
    contact = brake.contact
    joint = replace(contact, bonded=True)
    whole = squeal.assemble(bodies, [joint], {"mu": 0.4}).system
    disc = brake.nodes < brake.pairs[0, 1]
    order = np.concatenate([np.flatnonzero(disc), np.flatnonzero(~disc)])
    for one, other in zip(whole.at(), brake.system.at(), strict=True):
        assert abs(one - other[order][:, order]).max() <= 1e-12 * abs(other).max()
    exact = squeal.eigenvalues(brake.system, band=(500.0, 4000.0)).values
    errors = []
    for cutoff in (8e3, 1.6e4):
        small = squeal.assemble(bodies, [joint], {"mu": 0.4}, cutoff=cutoff)
        near = squeal.eigenvalues(small.system, band=(500.0, 4000.0)).values
        gaps = np.abs(near[:, None] - exact).min(axis=0) / np.abs(exact)
        errors.append(gaps.max())
    assert errors[0] < 1e-5
    assert errors[1] < errors[0] / 5


@pytest.mark.parametrize("n", [60, 160])
def test_modes_of_a_chain_that_one_node_holds(n):
    """w_j = 2 sin((2 j - 1) pi / (4 n - 2)) of n - 1 masses, all up to the cutoff and no other."""
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = K[-1, -1] = 1.0
    w = 2 * np.sin((2 * np.arange(1, n) - 1) * np.pi / (4 * n - 2))
    chain = squeal.Component(squeal.System(np.eye(n), K=K), np.arange(n), np.full(n, 2))
    free = 2 * np.sin(np.arange(1, n) * np.pi / (2 * n))
    for count in (1, 10, 40):
        small = chain.reduced([0], (w[count - 1] + w[count]) / (4 * np.pi))
        M, _, stiff = small.system.at()
        modes = slice(1, count + 1)
        assert M[modes, modes] == pytest.approx(np.eye(count), abs=1e-9)
        found = np.sort(np.diag(stiff)[modes])
        assert found == pytest.approx(w[:count] ** 2, rel=1e-9)
        assert np.all(np.diag(stiff)[count + 1 :] > w[count] ** 2 - 1e-9)  # what late motions add
        assert small.nodes.tolist() == ["0"] + [""] * (small.system.n - 1)
        assert small.system.n <= count + 2
        exact = free[free < w[count - 1] / 2]
        roots = np.sqrt(eigh(stiff, M, eigvals_only=True)[1:][: len(exact)])
        assert roots == pytest.approx(exact, rel=1e-4)


def test_errors_hold_of_components_that_turn():
    """Gyroscopic forces act on right and left vectors unlike; against the full system."""
    rng = np.random.default_rng(3)
    n = 60
    some = [0, 1, 2, 3, 4, 5]
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    turn = rng.standard_normal((n, n)) / 40
    C = {"1": 1e-3 * chain, "turn": turn - turn.T}
    system = squeal.System(np.eye(n), C, 50 * chain, {"turn": 1.0}, name="disc")
    disc = squeal.Component(system, np.arange(n), np.full(n, 2))
    block = squeal.System(np.eye(6), K=0.01 * np.eye(6), name="pad")
    pad = squeal.Component(block, np.arange(6), np.full(6, 2), load=-np.ones(6))
    touch = squeal.Contact(("disc", "pad"), [(9 * k, k) for k in some], Z, 3.0)
    full = squeal.assemble([disc, pad], [touch], cutoff=None)
    small = squeal.assemble([disc, pad], [touch], cutoff=1.5)
    exact = squeal.eigenvalues(full).values
    roots = [e for e in squeal.eigenvalues(small, band=(0.0, 1.0)).eigenvalues if e.value.imag > 0]
    errors = [e.error for e in roots]
    aways = [np.abs(exact - e.value).min() for e in roots]
    assert len(roots) > 10
    assert max(aways) > 1e-4
    for error, away in zip(errors, aways, strict=True):
        assert 0.5 * away <= error + 1e-9
        assert error <= 20 * away + 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pairs": [(1, 7)]}, "7 is no node of b"),
        ({"pairs": [(1, 1, 1)]}, "pairs"),
        ({"pairs": np.zeros((0, 2))}, "pairs"),
        ({"normal": (0, 0, 0)}, "no length"),
        ({"sliding": (0, 0, 2)}, "parallel"),
        ({"stiffness": [1.0, 2.0]}, "stiffness: an array .* or one for each of 1 pairs"),
        ({"gap": np.zeros((1, 1))}, "gap: an array"),
        ({"normal": (0, 1)}, "normal: an array .* must be a vector"),
        ({"area": 0.0}, "area: 0.0 is not allowed; it must be a finite number above 0"),
        ({"tangential": np.nan}, "tangential: nan"),
        ({"exponent": 1.0}, "exponent: 1.0"),
        ({"reference": 0.0}, "reference: 0.0"),
    ],
)
def test_what_cannot_be_joined_is_refused(change, words):
    ground = squeal.Component(squeal.System([[1.0]], K=[[1.0]], name="a"), [1], [2])
    block = squeal.Component(squeal.System([[1.0]], K=[[1.0]], name="b"), [1], [2])
    given: dict[str, Any] = {
        "between": ("a", "b"),
        "pairs": [(1, 1)],
        "normal": Z,
        "stiffness": 1.0,
    }
    with pytest.raises(InputError, match=words):
        squeal.assemble([ground, block], [squeal.Contact(**(given | change))])
    with pytest.raises(InputError, match="tangentail is no parameter; did you mean tang"):
        squeal.assemble([ground, block], [squeal.Contact(**given)], parameter="tangentail")
    with pytest.raises(InputError, match="load"):
        squeal.assemble([ground, block], [squeal.Contact(**given)])


@pytest.mark.parametrize("other", [0.25, -1.0, 2.0])
def test_one_name_has_one_value_in_all_components(other):
    """The last component's value won without a word."""

    def body(name, value, load):
        system = squeal.System([[1.0]], K={"E": [[1.0]]}, parameters={"E": value}, name=name)
        return squeal.Component(system, [1], [2], load=[load])

    bodies = [body("a", 1.0, 0.0), body("b", other, -1.0)]
    contact = squeal.Contact(("a", "b"), [(1, 1)], Z, 1.0)
    with pytest.raises(InputError, match=r"the parameter E is .* in b and 1 in another component"):
        squeal.assemble(bodies, [contact])
    assert squeal.assemble(bodies, [contact], {"E": 3.0}).system.parameters["E"] == 3.0


def test_a_parameter_that_no_matrix_of_a_component_needs_leaves_another_one_its_value():
    """Where friction acts inside one body, the other one's mu of 0 replaced it."""
    K = {"1": [[3.0]], "mu": [[1.0]]}
    a = squeal.Component(squeal.System([[1.0]], K=K, parameters={"mu": 0.4}, name="a"), [1], [2])
    b = squeal.Component(squeal.System([[1.0]], K=[[0.0]], name="b"), [1], [2], load=[-1.0])
    contact = squeal.Contact(("a", "b"), [(1, 1)], Z, 2.0, friction="0")
    for bodies in ([a, b], [b, a]):
        system = squeal.assemble(bodies, [contact]).system
        assert system.parameters["mu"] == 0.4
        assert sorted(system.at()[2].diagonal()) == pytest.approx([2.0, 5.4])


def test_numbers_serve_for_formulas():
    places = [[0.0, 0.0, 0.0]] * 2
    a = squeal.Component(squeal.System(np.eye(2), K=np.eye(2), name="a"), [1, 1], [0, 2], places)
    load = [0.0, -1.0]
    b = squeal.Component(squeal.System(np.eye(2), K=np.eye(2), name="b"), [1, 1], [0, 2], load=load)
    joined = []
    for friction, speed, slope in ((0.3, 2, -0.1), ("0.3", "2", "-0.1")):
        contact = squeal.Contact(
            ("a", "b"), [(1, 1)], Z, 2.0, sliding=(1, 0, 0), friction=friction, speed=speed,
            slope=slope,
        )  # fmt: skip
        joined.append(squeal.assemble([a, b], [contact]).system.at())
    for of_numbers, of_texts in zip(*joined, strict=True):
        assert np.array_equal(of_numbers, of_texts)
    turned = [a.rotating((0, 1, 0), speed, {}).system.at()[1] for speed in (2.0, "2.0")]
    assert np.array_equal(*turned)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.inf, np.nan])
def test_a_cutoff_that_is_no_frequency_is_refused(cutoff):
    chain = squeal.Component(squeal.System(np.eye(2), K=np.eye(2)), [1, 2], [0, 0])
    with pytest.raises(InputError, match=r"cutoff: .* must be a finite number above 0"):
        chain.reduced([2], cutoff)


def test_a_component_without_mass_inside_keeps_its_static_stiffness():
    """Two springs of 1 in a row."""
    system = squeal.System(np.diag([0.0, 1.0]), K=[[2.0, -1.0], [-1.0, 1.0]])
    small = squeal.Component(system, [1, 2], [0, 0]).reduced([2], cutoff=1.0)
    assert small.system.at()[2] == pytest.approx(np.array([[0.5]]))


def test_a_component_is_reduced_once():
    K = 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    system = squeal.System(np.eye(3), K=K, name="chain")
    small = squeal.Component(system, [1, 2, 3], [0, 0, 0]).reduced([1], cutoff=1.0)
    with pytest.raises(InputError, match="chain: is reduced already"):
        small.reduced([1], cutoff=1.0)


def test_a_component_of_which_every_row_stays_is_not_reduced():
    """Nothing is truncated: its roots are those of the full matrices, which can be proved."""
    system = squeal.System(np.eye(2), K=[[2.0, -1.0], [-1.0, 3.0]], name="a")
    body = squeal.Component(system, [1, 2], [0, 0])
    assert body.reduced([2, 1], cutoff=1.0) is body
    other = squeal.Component(squeal.System([[1.0]], K=[[5.0]], name="b"), [7], [0])
    pairs = [(1, 7), (2, 7)]
    joint = squeal.Contact(("a", "b"), pairs, (1, 0, 0), stiffness=1.0, bonded=True)
    assembly = squeal.assemble([body, other], [joint], cutoff=1.0)
    assert assembly.reduction is None
    answer = squeal.eigenvalues(assembly)
    assert answer.certified
    stiffness = [[3.0, -1.0, -1.0], [-1.0, 4.0, -1.0], [-1.0, -1.0, 7.0]]
    squares = np.linalg.eigvalsh(stiffness)
    assert np.sort(answer.values.imag)[3:] == pytest.approx(np.sqrt(squares))


def test_rows_of_one_displacement_are_refused():
    twice = squeal.Component(squeal.System(np.eye(2), K=np.eye(2), name="a"), [7, 7], [1, 1])
    with pytest.raises(InputError, match="a: several rows move the node 7 along y"):
        twice.rows_of([7])


def test_an_array_of_a_component_has_its_rows():
    system = squeal.System(np.eye(2), K=np.eye(2))
    with pytest.raises(InputError, match=r"places: an array \(2, 2\) is not allowed"):
        squeal.Component(system, [1, 2], [0, 0], places=np.zeros((2, 2)))
    with pytest.raises(InputError, match=r"load\.entry 1: nan"):
        squeal.Component(system, [1, 2], [0, 0], load=[0.0, np.nan])


@pytest.mark.parametrize("form", [np.asarray, csc_array])
def test_a_motion_that_nothing_holds_is_refused_in_dense_and_in_sparse_matrices(form, rng):
    """A chain that is free along x; its springs leave the last pivot a rounding above zero."""

    def chain(springs):
        off_diagonal = np.diag(springs[1:-1], 1)
        return np.diag(springs[:-1] + springs[1:]) - off_diagonal - off_diagonal.T

    for _ in range(20):
        held, pressed, free = rng.uniform(1, 3, (3, 21)) * 1e7 / 3
        held[-1] = pressed[0] = pressed[-1] = free[0] = free[-1] = 0.0
        body = squeal.System(form(np.eye(20)), K=form(chain(held)), name="body")
        stiffness = form(block_diag(chain(pressed), chain(free)))
        pad = squeal.System(form(np.eye(40)), K=stiffness, name="pad")
        labels = np.arange(20)
        load = np.zeros(40)
        load[19] = -5.0
        load[22] = 1.0
        parts = [
            squeal.Component(body, labels, np.full(20, 2)),
            squeal.Component(pad, np.tile(labels, 2), np.repeat([2, 0], 20), load=load),
        ]
        touch = squeal.Contact(("body", "pad"), [(19, 0)], (0, 0, 1), stiffness=1e6)
        with pytest.raises(InputError, match="nothing holds some motion"):
            squeal.assemble(parts, [touch])


@pytest.mark.parametrize(("direction", "refusal"), [(0.7, "0.7 is not"), (3, "3 is not")])
def test_a_direction_between_two_axes_is_refused(direction, refusal):
    """It is not cut off to a whole number."""
    system = squeal.System(np.eye(2), K=np.eye(2))
    with pytest.raises(InputError, match=rf"directions: {refusal} allowed; it must be 0, 1, 2"):
        squeal.Component(system, [1, 2], [0, direction])
    with pytest.raises(InputError, match=r"directions\.entry 1: nan"):
        squeal.Component(system, [1, 2], [0, np.nan])


def test_a_node_that_only_turns_lies_where_its_rows_say():
    """A pinned node, whose displacements are held: it has rotations alone."""
    system = squeal.System(np.eye(3), K=np.eye(3), name="plate")
    places = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]
    plate = squeal.Component(system, ["pinned", "free", "free again"], [-1, 2, 2], places)
    assert plate.places_of(["free", "pinned"]).tolist() == [places[1], places[0]]


def test_a_motion_that_no_boundary_drives_is_truncated_all_the_same():
    """It leaves no residual flexibility, but it may grow: C = -50 here."""
    system = squeal.System(np.eye(2), np.diag([0.05, -50.0]), np.diag([20.0, 1e6]), name="a")
    body = squeal.Component(system, ["1", "2"], [2, 0], np.zeros((2, 3)))
    assert "moves roots" in body.reduced(["1"], cutoff=20).system.assumptions[0]


def test_a_threshold_above_the_cutoff_may_lie_anywhere():
    """How far the reduction moves it is not known; the one warning says that of the band."""
    stiffness = [[2.0, -0.6, 0.0], [-0.6, 2.0, -0.5], [0.0, -0.5, 3.0]]
    system = squeal.System(np.eye(3), K=stiffness, name="one")
    body = squeal.Component(system, [1, 1, 2], [0, 2, 2])
    other = squeal.System(np.diag([5.0, 5.0]), K=np.diag([50.0, 1e-3]), name="other")
    pressed = squeal.Component(other, [1, 1], [0, 2], load=[0.0, -6.0])
    touch = squeal.Contact(("one", "other"), [(1, 1)], Z, sliding=(1, 0, 0), stiffness=2.0)
    assembly = squeal.assemble([body, pressed], [touch], cutoff=0.1)
    with pytest.warns(InputWarning, match=r"ends above the cutoff of the components, 0\.1 Hz"):
        answer = squeal.thresholds(assembly, high=5.0, band=(0.0, 1.0))
    (crossing,) = answer.crossings
    assert crossing.frequency_hz > 0.1
    assert crossing.interval == (0.0, 5.0)


def test_a_joint_has_one_stiffness_whatever_its_exponent_and_load():
    """It may pull, and no power of a pull is a stiffness: what moves no root has no seat."""
    joint = squeal.Contact(("a", "b"), [(1, 1)], Z, 2.0, exponent=0.5, bonded=True)
    for force in (-1.0, 50.0):
        bodies = []
        for name, load in (("a", [0.0]), ("b", [force])):
            system = squeal.System([[1.0]], K=[[3.0]], name=name)
            bodies.append(squeal.Component(system, [1], [2], [[0, 0, 0]], load))
        assembly = squeal.assemble(bodies, [joint], {"mu": 0.0})
        assert eigh(assembly.system.at()[2])[0] == pytest.approx([3.0, 7.0])
        assert "load and gap move the forces alone, not the roots" in str(assembly.seats[0])
    assert not joint.has_seat
