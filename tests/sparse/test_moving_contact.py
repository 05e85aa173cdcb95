"""Contact that slides at a speed, and components that turn: closed forms, and the contact's own law
differentiated by differences."""

from typing import Any

import numpy as np
import pytest

import squeal
from squeal.errors import InputError

Z = (0.0, 0.0, 1.0)
MOVES = ("x", "y", "z")


def point(name, mass=1.0, stiffness=(1.0, 1.0, 1.0), place=(0.0, 0.0, 0.0), load=None):
    """One node of three displacements on springs."""
    system = squeal.System(mass * np.eye(3), K=np.diag(stiffness), name=name)
    return squeal.Component(system, [1] * 3, range(3), [place] * 3, load)


def pressed(force=7.0, **contact):
    """A block pressed by a force on ground that moves past it."""
    ground = point("ground", stiffness=(1e9, 1e9, 1e9), place=contact.pop("place", (0, 0, 0)))
    block = point("block", 2.0, (50.0, 80.0, 0.0), load=[0.0, 0.0, -force])
    touch = squeal.Contact(("ground", "block"), [(1, 1)], Z, 40.0, **contact)
    return squeal.assemble([ground, block], [touch], {"mu": 0.5})


def law(velocity, sliding, force, friction):
    """Friction on the block that moves at a velocity (3,) on ground that moves at `sliding`."""
    relative = sliding - velocity
    speed = np.linalg.norm(relative)
    return friction(speed) * force * relative / speed


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -2, 0), (3, 4, 0)])
@pytest.mark.parametrize("slope", [0.0, -0.02, 0.01])
def test_damping_is_the_derivative_of_the_law_of_friction(direction, slope):
    speed = 3.0
    force = 7.0
    mu = 0.5
    found = pressed(force, sliding=direction, speed="3", slope=str(slope))
    C = found.system.at()[1]
    sliding = speed * np.array(direction) / np.linalg.norm(direction)
    step = 1e-5
    derivative = np.zeros((3, 3))

    def friction(v):
        return mu + slope * (v - speed)

    for i, change in enumerate(step * np.eye(3)):
        back = law(-change, sliding, force, friction)
        ahead = law(change, sliding, force, friction)
        derivative[:, i] = (ahead - back) / (2 * step)
    derivative[2] = 0.0
    derivative[:, 2] = 0.0  # the sliding stays in its plane
    assert C[3:, 3:] == pytest.approx(-derivative, rel=1e-8, abs=1e-9)
    assert C[:3] == pytest.approx(-C[3:], abs=1e-14)


def test_about_an_axis_the_speed_is_that_of_the_place():
    """A pair 0.2 m from the axis, 12 rad/s: 2.4 m/s along y; it damps x by mu N / v."""
    place = (0.2, 0.0, 0.0)
    ground = point("ground", stiffness=(1e9, 1e9, 1e9), place=place)
    block = point("block", 2.0, (50.0, 80.0, 0.0), place, [0.0, 0.0, -7.0])
    touch = squeal.Contact(("ground", "block"), [(1, 1)], Z, 40.0, axis=Z, speed="omega")
    joined = squeal.assemble([ground, block], [touch], {"mu": 0.5, "omega": 12.0})
    damping = joined.system.at()[1][3:, 3:]
    exact = np.diag([0.5 * 7.0 / 2.4, 0.0, 0.0])
    assert damping == pytest.approx(exact, rel=1e-7, abs=1e-12)
    at_half_speed = joined.system.at({"omega": 6.0})[1][3:, 3:]
    assert at_half_speed == pytest.approx(2.0 * damping)


def test_open_pairs_do_not_damp():
    bodies = [point("ground", stiffness=(9.0, 9.0, 9.0)), point("block", load=[0.0, 0.0, -2.0])]
    pairs: dict[str, Any] = {"sliding": (1, 0, 0), "speed": "1", "slope": "-0.1"}
    closed = squeal.Contact(("ground", "block"), [(1, 1)], Z, 4.0, **pairs)
    away = squeal.Contact(("ground", "block"), [(1, 1)], Z, 4.0, gap=10.0, **pairs)
    both = squeal.assemble(bodies, [closed, away], {"mu": 0.4})
    alone = squeal.assemble(bodies, [closed], {"mu": 0.4})
    assert np.array_equal(both.system.at()[1], alone.system.at()[1])


@pytest.mark.parametrize("given", [{"speed": "2"}, {"slope": "-0.1"}])
def test_speed_needs_a_direction(given):
    with pytest.raises(InputError, match="needs sliding or axis"):
        squeal.Contact(("a", "b"), [(1, 1)], Z, 1.0, **given)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -3), (1, 0, 0), (1, 2, -2)])
def test_a_point_seen_from_a_turning_frame_has_split_frequencies(axis):
    """w0 +- Omega across the axis, w0 along it."""
    turned = point("mass", 2.0, (200.0,) * 3).rotating(axis, "speed", {"speed": 3.0})
    found = squeal.eigenvalues(turned.system).values
    assert np.sort(found.imag[found.imag > 0]) == pytest.approx([7.0, 10.0, 13.0])
    assert np.abs(found.real).max() < 1e-12


def test_a_free_bar_seen_from_a_turning_frame_keeps_straight_motions():
    """Straight, uniform motion is x(t) = R(-Omega t) (a + b t): a double root at +- i Omega."""
    M = np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3)) / 6.0  # a consistent mass of 1 kg
    K = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag([900.0, 400.0, 100.0]))
    bar = squeal.Component(squeal.System(M, K=K, name="bar"), [1] * 3 + [2] * 3, [0, 1, 2] * 2)
    turned = bar.rotating(Z, "5", {}).system
    M, C, K = turned.at()
    lam = 5.0j
    shape = np.kron([1.0, 1.0], [1.0, 1.0j, 0.0])
    assert np.abs((lam**2 * M + lam * C + K) @ shape).max() < 1e-12
    assert np.abs((2 * lam * M + C) @ shape).max() < 1e-12


def test_preloaded_matrices_get_coriolis_forces_alone():
    own = point("mass", 2.0, (200.0,) * 3)
    turned = own.rotating(Z, "speed", {"speed": 3.0}, preloaded=True).system
    assert np.array_equal(turned.at()[2], own.system.at()[2])
    assert turned.at()[1] == pytest.approx(12.0 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]]))


SYSTEM = """
M: [[2, 0, 0], [0, 2, 0], [0, 0, 2]]
K: [[200, 0, 0], [0, 200, 0], [0, 0, 200]]
coordinates: {file: NAME.csv}
"""
ASSEMBLY = """
parameters: {mu: 0.5, speed: 3.0}
components:
  disc:
    file: disc.yaml
    rotation: {axis: [0, 0, 2], speed: speed}
  pad: {file: pad.yaml, load: {file: load.csv}}
contact:
  - between: [disc, pad]
    pairs: {file: pairs.csv}
    normal: [0, 0, 1]
    stiffness: 40
    axis: [0, 0, 1]
    speed: speed
    slope: -0.01
"""


def test_rows_that_are_modes_do_not_turn():
    """A chain in the plane: rotated, then reduced, its roots are those of the full one."""
    chain = np.kron([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]], np.eye(2))
    nodes = np.repeat([1, 2, 3], 2)
    full = squeal.Component(squeal.System(np.eye(6), K=chain), nodes, [0, 1] * 3)
    turned = full.rotating(Z, 0.1, {})
    small = turned.reduced([3], cutoff=1.0)  # with all modes
    expected = np.sort(squeal.eigenvalues(turned.system).values.imag)
    assert np.sort(squeal.eigenvalues(small.system).values.imag) == pytest.approx(expected)
    with pytest.raises(InputError, match="rotate the full component, then reduce it"):
        full.reduced([3], cutoff=1.0).rotating(Z, 0.1, {})


def test_the_file_form_says_the_same(tmp_path):
    for name in ("disc", "pad"):
        (tmp_path / f"{name}.yaml").write_text(SYSTEM.replace("NAME", name))
        lines = [f"1,{move},0.2,0,0" for move in MOVES]
        (tmp_path / f"{name}.csv").write_text("\n".join(["node,dof,x,y,z", *lines]))
    (tmp_path / "load.csv").write_text("node,dof,force\n1,z,-7\n")
    (tmp_path / "pairs.csv").write_text("first,second\n1,1\n")
    (tmp_path / "assembly.yaml").write_text(ASSEMBLY)
    read = squeal.read_system(tmp_path / "assembly.yaml").system
    place = (0.2, 0.0, 0.0)
    values = {"mu": 0.5, "speed": 3.0}
    disc = point("disc", 2.0, (200.0,) * 3, place).rotating(Z, "speed", values)
    pad = point("pad", 2.0, (200.0,) * 3, place, [0.0, 0.0, -7.0])
    touch = squeal.Contact(("disc", "pad"), [(1, 1)], Z, 40.0, axis=Z, speed="speed", slope="-0.01")
    joined = squeal.assemble([disc, pad], [touch], values).system
    for one, other in zip(read.arrays(), joined.arrays(), strict=True):
        assert one == pytest.approx(other, rel=1e-14)


def test_a_string_of_beads_on_a_belt_decays_by_the_closed_form():
    """Beads of mass m, drawn by a tension across the belt's motion and pressed on it by N each: of
    m q'' + c q' + T L q = 0 with c = mu N / v every mode decays by c / 2 m."""
    count = 9
    mass = 0.3
    tension = 120.0  # N/m: over the spacing
    force = 6.0
    speed = 0.8
    chain = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    # of each bead y, held by the string, and z, along which it is pressed
    K = tension * np.kron(chain, np.diag([1.0, 0.0]))
    M = mass * np.eye(2 * count)
    labels = np.repeat(np.arange(count), 2)
    directions = np.tile([1, 2], count)
    places = np.column_stack([labels, 0.0 * labels, 0.0 * labels])
    load = np.tile([0.0, -force], count)
    beads = squeal.Component(squeal.System(M, K=K, name="beads"), labels, directions, places, load)
    stiff = squeal.System(np.eye(2 * count), K=1e12 * np.eye(2 * count), name="belt")
    belt = squeal.Component(stiff, labels, directions, places)
    pairs = [(bead, bead) for bead in range(count)]
    touch = squeal.Contact(
        ("belt", "beads"), pairs, Z, 5e3, sliding=(1.0, 0.0, 0.0), speed=str(speed)
    )
    joined = squeal.assemble([belt, beads], [touch], {"mu": 0.4})
    found = squeal.eigenvalues(joined.system).values
    decay = 0.5 * 0.4 * force / speed / mass
    squares = 4.0 * tension / mass * np.sin(np.arange(1, count + 1) * np.pi / 20.0) ** 2
    exact = -decay + 1j * np.sqrt(squares - decay**2)
    for root in exact:
        assert np.abs(found - root).min() < 1e-7 * np.abs(root)
