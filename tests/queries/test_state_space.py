"""State spaces of pads: poles are eigenvalues, the static gain is the compliance."""

import control
import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.scene import Damping
from squeal.linear.moduli import Tabulated
from squeal.linear.terms import Term
from squeal.numerics.differentiation import ONE
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.state_space import state_space
from tests.conftest import scene_of


def apart(one, other):
    """The largest distance of two sets of poles, relative to the largest of them."""
    distance = np.abs(np.asarray(one)[:, None] - np.asarray(other)[None, :])
    ends = max(distance.min(axis=0).max(), distance.min(axis=1).max())
    return ends / np.abs(other).max()


@pytest.mark.parametrize("stem", ["b1-a", "b2-c", "b3"])
@pytest.mark.parametrize("mu", [None, 0.1])
def test_poles_are_the_eigenvalues_and_the_static_gain_is_the_compliance(stem, mu):
    scene = scene_of(stem, damping=Damping(ratios=(0.01, 0.02, 0.03)))
    plant = state_space(scene, mu)
    analysis = analyse(scene if mu is None else scene.replace(mu=mu))
    assert apart(plant.poles(), analysis.spectrum.values) < 1e-9
    assert np.allclose(plant.dcgain() @ analysis.matrices.K, np.eye(3), atol=1e-9)


def test_a_state_space_refuses_and_warns_as_eigenvalues_do(recwarn):
    scene = scene_of("b2-c")
    with pytest.raises(InputError, match=r"mu: -1\.0 is not allowed"):
        state_space(scene, -1.0)
    with pytest.raises(ComputationError, match="no steady sliding"):
        state_space(scene.replace(k1=0.0, k2=0.0))
    assert not recwarn
    beyond = scene.replace(mu=1.69)
    state_space(beyond)
    assert [str(each.message) for each in recwarn] == list(analyse(beyond).warnings)
    assert {each.category for each in recwarn} <= {InputWarning}


def test_a_state_space_becomes_a_system_with_its_poles():
    """Butterworth's third order: poles on the unit circle at 120, 180 and 240 degrees."""
    plant = control.tf2ss([1.0], [1.0, 2.0, 2.0, 1.0])
    exact = np.exp(1j * np.pi * np.array([2, 3, 4]) / 3)
    assert apart(squeal.eigenvalues(squeal.System.from_control(plant)).values, exact) < 1e-12
    discrete = control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1)
    with pytest.raises(InputError, match="discrete in time"):
        squeal.System.from_control(discrete)
    with pytest.raises(InputError, match="TransferFunction is not allowed"):
        squeal.System.from_control(control.tf([1.0], [1.0, 2.0]))


def test_a_system_becomes_a_state_space_with_its_roots():
    """One mass of 2 kg, 3 N s/m and mu 5 N/m: s^2 + 1.5 s + 2.5 mu."""
    system = squeal.System([[2.0]], [[3.0]], {"mu": [[5.0]]}, {"mu": 2.0})
    assert apart(state_space(system).poles(), np.roots([1.0, 1.5, 5.0])) < 1e-14
    plant = state_space(system, 4.0)
    assert apart(plant.poles(), np.roots([1.0, 1.5, 10.0])) < 1e-14
    assert plant.dcgain() == pytest.approx(1 / 20)
    with pytest.raises(InputError, match="complex"):
        state_space(squeal.System([[1.0]], K=[[1.0 + 0.1j]]))
    with pytest.raises(InputError, match="2001 rows are too many"):
        state_space(squeal.System(np.eye(2001), K=np.eye(2001)))


STIFFNESS = [[2.0, -1.0, 0.3], [-1.0, 3.0, -1.0], [0.3, -1.0, 2.0]]
# masses and dampers of three rows: with all, first order, and of some motions neither
RIGGED = {
    "second order": ((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), 6),
    "first order": ((0.0, 0.0, 0.0), (0.1, 0.2, 0.3), 3),
    "a damper without mass": ((1.0, 2.0, 0.0), (0.1, 0.1, 0.5), 5),
    "a spring without mass": ((1.0, 2.0, 0.0), (0.1, 0.1, 0.0), 4),
    "both": ((1.0, 0.0, 0.0), (0.1, 0.3, 0.0), 3),
}


@pytest.mark.parametrize("name", RIGGED)
@pytest.mark.parametrize("unit", [1.0, 1e-12])
def test_rows_without_mass_are_states_only_where_they_have_roots(name, unit):
    """The response to forces is the inverse of the dynamic stiffness, at any frequency."""
    masses, dampers, states = RIGGED[name]
    M = unit * np.diag(masses)
    C = unit * np.diag(dampers)
    K = unit * np.array(STIFFNESS)
    plant = state_space(squeal.System(M, C, K))
    assert plant.nstates == states
    for z in (0.7j, 2.0 - 1.0j):
        response = np.linalg.inv(z * z * M + z * C + K)
        assert np.allclose(plant(z), response, rtol=1e-12, atol=1e-12 * np.abs(response).max())


def test_a_constraint_is_refused_in_a_sentence():
    held = squeal.System(np.diag([1.0, 0.0]), K=[[2.0, 1.0], [1.0, 0.0]], name="held")
    with pytest.raises(InputError, match=r"held: some motion has neither mass, damper nor spring"):
        state_space(held)


def coupled(c, K1=((0.0, 4.0), (0.0, 0.0))):
    """Two modes that friction couples, damped equally: s^2 + c s + 2 -+ sqrt(1 - 4 mu / 3) = 0."""
    K = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu / 3": K1}
    return squeal.System(np.eye(2), c * np.eye(2), K, name="coupled")


@pytest.mark.parametrize("c", [0.02, 0.1, 0.3])
def test_the_gain_margin_of_the_friction_loop_is_the_threshold(c):
    """At s = i w: w^2 = 2 and (c w)^2 = 4 mu / 3 - 1, so that mu = 3/4 (1 + 2 c^2)."""
    exact = 0.75 * (1.0 + 2.0 * c * c)
    plant = state_space(coupled(c), loop="mu")
    gain, _, frequency, _ = control.margin(plant)
    assert gain == pytest.approx(exact, rel=1e-9)
    assert frequency == pytest.approx(np.sqrt(2.0), rel=1e-9)
    assert squeal.thresholds(coupled(c)).first.mu == pytest.approx(gain, rel=1e-9)


def test_the_root_locus_over_the_friction_loop_is_that_of_the_roots():
    gains = np.array([0.0, 0.3, 1.2])
    plant = state_space(coupled(0.1), loop="mu")
    for gain, loci in zip(gains, control.root_locus_map(plant, gains).loci, strict=True):
        inner = np.sqrt(1.0 - 4.0 * gain / 3.0 + 0j)
        exact = np.concatenate([np.roots([1.0, 0.1, 2.0 + sign * inner]) for sign in (1, -1)])
        assert apart(loci, exact) < 1e-9


@pytest.mark.parametrize("name", RIGGED)
@pytest.mark.parametrize("rank", [1, 2, 3])
def test_closed_loops_have_the_roots_at_that_friction(name, rank):
    """Of any rank of the terms, other parameters at their values: the residual of each root."""
    masses, dampers, states = RIGGED[name]
    M = np.diag(masses)
    C = np.diag(dampers)
    K0 = np.array(STIFFNESS)
    K1 = np.array([[0.0, 1.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0]])
    if rank > 1:
        K1[2, 0] = 0.5
    if rank > 2:
        K1[1, 2] = 0.2
    system = squeal.System(M, C, {"1": K0, "2 * mu * k": K1}, {"k": 0.5, "mu": 9.0})
    plant = state_space(system, loop="mu")
    assert (plant.ninputs, plant.noutputs) == (rank, rank)
    poles = control.feedback(plant, 0.3 * np.eye(rank)).poles()
    assert len(poles) == states
    for z in poles:
        dynamic = z * z * M + z * C + K0 + 0.3 * K1
        assert np.linalg.svd(dynamic)[1][-1] < 1e-11 * np.abs(dynamic).max()


def test_friction_that_damps_is_in_the_loop():
    """One mass: s^2 + (0.5 - mu) s + 4 grows from mu = 0.5 on."""
    system = squeal.System([[1.0]], {"1": [[0.5]], "mu": [[-1.0]]}, [[4.0]])
    assert control.margin(state_space(system, loop="mu"))[0] == pytest.approx(0.5)


@pytest.mark.parametrize("seed", range(5))
def test_a_loop_that_damps_motions_with_mass_alone_is_a_gain_in_any_coordinates(seed):
    """M = a a^T + b b^T is singular, C = mu f (a + b)^T reads velocities that have mass."""
    rng = np.random.default_rng(seed)
    a, b, f = rng.integers(1, 8, (3, 3)).astype(float)
    M = np.outer(a, a) + np.outer(b, b)
    C = np.outer(f, a + b)
    K = np.diag([3.0, 4.0, 5.0])
    plant = state_space(squeal.System(M, {"mu": C}, K), loop="mu")
    assert (plant.ninputs, plant.noutputs) == (1, 1)
    poles = control.feedback(plant, 0.3).poles()
    assert len(poles) == 4
    for z in poles:
        singular_values = np.linalg.svd(z * z * M + z * 0.3 * C + K, compute_uv=False)
        assert singular_values[-1] < 1e-12 * singular_values[0]
    null = np.cross(a, b) / 1e6  # the motion without mass
    with pytest.raises(InputError, match="damps motions without mass"):
        state_space(squeal.System(M, {"mu": np.outer(f, a + null)}, K), loop="mu")
    light = np.diag([1.0, 1e-10, 0.0])  # a mass so small hides no damper of a motion without one
    with pytest.raises(InputError, match="damps motions without mass"):
        state_space(squeal.System(light, {"mu": np.outer(f, [1.0, 0.0, 1e-6])}, K), loop="mu")


def test_what_is_no_loop_is_refused_in_a_sentence():
    for system, loop, words in (
        (squeal.System([[1.0]], K={"mu**2": [[1.0]]}), "mu", "not linear in mu"),
        (squeal.System({"mu": [[1.0]]}, K=[[1.0]], parameters={"mu": 1.0}), "mu", "M of system"),
        (coupled(0.1), "nu", "nu: is no parameter; allowed are mu"),
        (squeal.System([[1.0]], K=[[1.0]]), "mu", "no matrix of system depends on mu"),
        (
            squeal.System([[1.0]], K={"1": [[1.0]], "mu*p": [[1.0]]}, parameters={"p": 0.0}),
            "mu",
            "no matrix of system depends on mu at these parameters",
        ),
        (scene_of("b3"), "mu", "loop: is not allowed with a scene"),
    ):
        with pytest.raises(InputError, match=words):
            state_space(system, loop=loop)
    with pytest.raises(InputError, match="its value is the loop's gain"):
        state_space(coupled(0.1), 0.3, "mu")


def test_a_reduced_system_has_one_loop_for_one_contact():
    """60 masses, of which friction couples two: the threshold of all rows is the gain margin."""
    frequencies = np.arange(1.0, 61.0)
    frequencies[1] = 1.05
    weights = np.zeros(60)
    weights[:2] = 1.0, -1.0
    K = {"1": np.diag(frequencies**2), "mu": np.outer(np.eye(60)[0], weights)}
    full = squeal.System(np.eye(60), 0.01 * np.eye(60), K)
    reduced = squeal.reduce(full, values=[0.0, 0.1], band=(0.1, 0.6))
    for system in (full, reduced):
        assert state_space(system, loop="mu").ninputs == 1


def test_an_assembly_has_the_loop_of_its_contact():
    """Two masses in one contact pair, pressed by 6 N: friction of one pair has rank 1."""
    fixed = squeal.Component(
        squeal.System(np.eye(3), K=3.0 * np.eye(3), name="one"), [1] * 3, [0, 1, 2]
    )
    free = squeal.System(np.eye(3), K=np.eye(3), name="other")
    pressed = squeal.Component(free, [1] * 3, [0, 1, 2], load=[0.0, 0.0, -6.0])
    touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), sliding=(1, 0, 0), stiffness=2.0)
    joined = squeal.assemble([fixed, pressed], [touch])
    plant = state_space(joined, loop="mu")
    assert plant.ninputs == 1
    at = squeal.eigenvalues(joined.system.replace({"mu": 0.4})).values
    assert apart(control.feedback(plant, 0.4).poles(), at) < 1e-9


@pytest.mark.parametrize("matrix", [[[0.0, 1j], [0.0, 0.0]], [[1.0 + 0.2j, 0.0], [0.0, 0.0]]])
def test_a_complex_loop_is_refused(matrix):
    """At 0 nothing is complex, so that it was lost, or its imaginary part."""
    system = squeal.System(np.eye(2), K={"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": matrix})
    with pytest.raises(InputError, match="what mu multiplies is complex"):
        state_space(system, loop="mu")


def test_a_table_that_is_straight_near_zero_alone_is_no_gain():
    table = Tabulated(ONE, "mu", "k.csv", "k", (0.0, 100.0, 200.0, 300.0), (0.0, 1.0, 2.0, 10.0))
    K = (Term(np.eye(1)), Term(np.eye(1), table))
    system = squeal.System(np.eye(1), K=K, parameters={"mu": 0.0})
    with pytest.raises(InputError, match="is not linear in mu"):
        state_space(system, loop="mu")
