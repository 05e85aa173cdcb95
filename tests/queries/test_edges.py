"""What once ended in a traceback, or changed what does not change."""

import copy
import math
import pickle

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array, eye_array

import squeal
from squeal.errors import InputError, InputWarning
from squeal.linear import thresholds, unstable_modes
from squeal.queries.systems.region_ends import growing_outside
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import dense_spectrum
from tests.conftest import SCENES, scene_of
from tests.known import affine


@pytest.mark.parametrize("size", [1e14, 1e16, 1e30])
@pytest.mark.parametrize("damping", [0.0, 0.01])
def test_a_penalty_in_memory_is_a_support_as_in_a_file(size, damping):
    """The held row leaves the others their roots, here of a pair that flutters."""
    K = np.array([[size, 2.0, 0.0], [-3.0, 1.0, 5.0], [0.0, -5.0, 1.2]])
    with pytest.warns(InputWarning, match="supports.* 1 row, the first is row 1"):
        system = squeal.System(np.eye(3), damping * np.eye(3), K)
    found = squeal.eigenvalues(system)
    squares = np.linalg.eigvals(K[1:, 1:])
    exact = [np.roots([1.0, damping, s]) for s in squares]
    assert found.verdict == "flutter"
    assert sorted(found.values.real) == pytest.approx(np.sort(np.ravel(exact).real), rel=1e-9)


@pytest.mark.parametrize("soft", [1e-6, 1e-12])
def test_most_rows_are_no_supports_of_a_body_that_is_nearly_free(soft):
    """Two flexible modes that flutter where 2 mu 1e6 is their distance, and a soft third one."""
    friction = np.zeros((3, 3))
    friction[1:, 1:] = [[0.0, 1.0], [-1.0, 0.0]]
    K = {"1": np.diag([soft, 1e7, 1.1e7]), "1e6 * mu": friction}
    found = squeal.thresholds(squeal.System(np.eye(3), K=K, parameters={"mu": 0.0}), 1.0)
    (one,) = found.crossings
    assert one.kind == "flutter"
    assert one.mu == pytest.approx(0.5, rel=1e-9)


def test_a_row_that_a_term_couples_is_no_support():
    """At mu = 0 nothing acts on the stiff row, elsewhere a greater coupling does."""
    K = {"1": np.diag([1.0, 2.0, 1e14]), "mu": 1e14 * (np.eye(3, k=1) + np.eye(3, k=-1))}
    assert squeal.System(np.eye(3), K=K, parameters={"mu": 0.0}).n == 3


@pytest.mark.parametrize("factor", ["mu", "mu**2", "mu**4"])
def test_growth_is_listed_where_damping_and_stiffness_vanish_at_the_start(factor):
    """s^2 - f s + f: at 0 the root is double and at rest. The search of the onset ended there, and
    there was no answer."""
    system = squeal.System(
        [[1.0]], {f"-{factor}": [[1.0]]}, {factor: [[1.0]]}, parameters={"mu": 1.0}
    )
    found = squeal.eigenvalues(system)
    assert found.certified
    assert found.verdict == "flutter"
    assert sorted(found.values, key=np.imag) == pytest.approx(
        [0.5 - 0.75**0.5 * 1j, 0.5 + 0.75**0.5 * 1j], rel=1e-12
    )
    assert str(squeal.sweep(system, [0.5, 1.0])).count(" flutter") == 2


@pytest.mark.parametrize("size", [1e9, 1e16])
@pytest.mark.parametrize("mu", [0.3, 0.9])
def test_modes_that_rounding_hides_on_the_paths_have_no_onset(size, mu):
    K0 = np.array([[size, size / 2, 0.0], [size / 2, size, 0.0], [0.0, 0.0, 2.0]])
    K1 = np.diag([0.0, 0.0, -4.0])
    system = affine(np.eye(3), K0, K1)
    found = thresholds(system, mu)
    for mode in unstable_modes(system, mu, found):
        assert mode.onset is None or mode.onset == pytest.approx(0.5, rel=1e-9)


def test_no_mode_grows_at_a_threshold():
    system = affine(np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]), np.array([[0, 4 / 3], [0, 0]]))
    for mu in (0.75, np.nextafter(0.75, 1.0)):
        assert unstable_modes(system, mu, thresholds(system, mu)) == ()


def test_parameters_of_a_system_do_not_change():
    system = squeal.System(np.eye(2), K={"mu": np.eye(2)}, parameters={"mu": 0.3})
    with pytest.raises(TypeError):
        system.parameters["mu"] = 5.0  # type: ignore[index]
    for other in (pickle.loads(pickle.dumps(system)), copy.deepcopy(system)):
        assert other.parameters == {"mu": 0.3}
        assert other.at()[2].tolist() == system.at()[2].tolist()


def test_the_shape_of_a_system_needs_coordinates_and_that_of_a_pad_none():
    system = squeal.System(np.eye(2), K=np.eye(2))
    with pytest.raises(InputError, match="shape: needs a system with `coordinates"):
        squeal.eigenvalues(system).plot(shape=1)
    pad = squeal.eigenvalues(squeal.read_scene(SCENES / "b1-a.yaml"))
    assert pad.plot(shape=1).get_title().startswith("mode 1: ")
    with pytest.raises(InputError, match="a whole number from 1 to 3"):
        pad.plot(shape=4)


@pytest.mark.parametrize("seed", range(5))
def test_the_largest_part_of_a_vector_is_positive_in_the_units_of_the_caller(seed):
    rng = np.random.default_rng(seed)
    units = 10.0 ** rng.uniform(-4, 4, 5)
    X = rng.normal(size=(5, 5))
    M = np.diag(units**2)
    K = np.outer(units, units) * (X @ X.T + np.eye(5))
    each = *dense_spectrum(M, None, K), *squeal.eigenvalues(squeal.System(M, K=K)).eigenvalues
    for root in each:
        largest = root.right[np.argmax(np.abs(root.right))]
        assert largest.real > 0.0
        assert abs(largest.imag) <= 1e-12 * largest.real


def test_a_reduced_sweep_of_the_lowest_modes_says_what_growth_it_leaves_out():
    """lambda^2 + 10 lambda + 1 - 3 mu = 0 diverges at 1/3, by 0.19 1/s at 1."""
    slow = squeal.System([[1.0]], [[10.0]], {"1": [[1.0]], "mu": [[-3.0]]})
    answer = squeal.sweep(slow, [0.0, 1.0], modes=1, method="reduced")
    assert 0.0 < answer.basis["growth_limit"] < 0.19
    assert f"grow by more than {answer.basis['growth_limit']:.4g} 1/s are left out" in str(answer)


def test_a_first_look_answers_for_its_own_system_and_roots_alone():
    n = 402
    coupling = csc_array(([1.0, -1.0], ([0, 1], [1, 0])), shape=(n, n))
    systems = []
    for highest in (100.0, 50.0):
        K = {"1": diags_array(np.linspace(1.0, highest, n) ** 2), "mu": coupling}
        systems.append(squeal.System(eye_array(n), {"1": 1e-3 * eye_array(n)}, K))
    first, second = systems
    band = (0.1, 0.25)
    look = squeal.sweep(first, [0.0, 0.2], band=band)
    assert look.is_first_look
    estimated = squeal.eigenvalues(first, at=0.1, band=band, look=look)
    stiffness = np.linspace(1.0, 100.0, n)[:2] ** 2
    squares = np.linalg.eigvals([[stiffness[0], 0.1], [-0.1, stiffness[1]]])
    omega = np.sqrt(squares.min() - 0.0005**2)
    assert estimated.eigenvalues[0].value.imag == pytest.approx(omega, rel=1e-8)
    assert estimated.proof["reason"].startswith("nothing was counted beside a sweep")
    proved = squeal.eigenvalues(first, at=0.1, band=band, look=look, prove=True)
    assert proved.count == len(proved.eigenvalues)  # which no first look counts
    copied = squeal.eigenvalues(pickle.loads(pickle.dumps(first)), at=0.1, band=band, look=look)
    assert copied.values.tolist() == estimated.values.tolist()
    with pytest.raises(InputError, match="look: is the answer of another subject"):
        squeal.eigenvalues(second, at=0.1, band=band, look=look)
    with pytest.raises(InputError, match="look: must be a sweep of the same band"):
        squeal.eigenvalues(first, at=0.1, band=(0.2, 0.25), look=look)


def test_a_friction_beyond_every_range_is_named_as_it_was_given():
    scene = scene_of("b1-a", mu=1e6)
    with pytest.raises(InputError, match=r"^.*mu: 1e\+06 is beyond 1000"):
        squeal.thresholds(scene)


def test_a_vertical_face_is_refused_with_what_is_allowed():
    with pytest.raises(InputError, match=r"theta0: .* below 1\.5708"):
        scene_of("b1-a", theta0=np.pi / 2.0)


def test_a_look_at_another_small_system_is_refused():
    """Above 400 rows the look answers; of fewer rows it decides nothing, and was not read."""
    friction = [[0.0, 1.0], [-1.0, 0.0]]
    first = squeal.System(np.eye(2), K={"1": np.diag([1.0, 4.0]), "mu": friction})
    second = squeal.System(np.eye(2), K={"1": np.diag([1.0, 5.0]), "mu": friction})
    look = squeal.sweep(first, [0.0, 1.0])
    assert squeal.eigenvalues(first, at=0.5, look=look).verdict == "marginal"
    with pytest.raises(InputError, match="another subject"):
        squeal.eigenvalues(second, at=0.5, look=look)


def test_growth_that_may_lie_within_a_region_is_not_told_outside_of_it():
    """Rough roots are known to a thousandth of their size, here to 1 Hz."""
    region = Rectangle(-100.0, 1000.0, math.tau * 1000.0, math.tau * 1010.0)
    beside = complex(50.0, math.tau * 1010.5)
    beyond = complex(50.0, math.tau * 1012.0)
    assert growing_outside([beside], region) is None
    assert growing_outside([beside, beyond], region) == (beyond,)


@pytest.mark.parametrize("share", [0.1, 0.6, 0.9, 1.1])
def test_a_pair_near_the_real_axis_grows_once(share):
    """As |lambda| is 1000 and known to a thousandth, the axis is nearer than |lambda| is known."""
    region = Rectangle(-10.0, 10.0, 0.0, 10.0)
    root = complex(1000.0, share)
    assert growing_outside([root.conjugate(), root], region) == (root,)
