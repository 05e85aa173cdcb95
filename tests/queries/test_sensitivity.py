"""What moves eigenvalues and thresholds: differences through the whole chain, scaling laws."""

import math
import pickle

import numpy as np
import pytest

import squeal
from squeal.equilibrium.damping import normalised_damping, normalised_damping_slope
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Damping, Scene
from squeal.queries.pads.equilibrium import analyse, branch_system
from squeal.queries.pads.sensitivity import of_threshold
from squeal.queries.pads.stack import parameters
from squeal.queries.thresholds import critical_friction
from squeal.schema import Place
from tests.conftest import scene_of

COUPLED = {"alpha1": 1.0, "alpha2": 2.6, "mu": 0.1}
DAMPINGS = {
    "undamped": None,
    "ratios": Damping(ratios=(0.02, 0.01, 0.03)),
    "one ratio": Damping(ratios=(0.0, 0.02, 0.02)),
    "rayleigh": Damping(rayleigh=(50.0, 1e-7)),
    "matrix": Damping(matrix=((30.0, 0.0, 0.0), (0.0, 20.0, 0.0), (0.0, 0.0, 0.01))),
}


def of_eigenvalues(scene):
    """Slopes of the eigenvalues."""
    return squeal.sensitivity(scene).slopes


def both_sides(scene, name, factor=1.0):
    """The scene with a parameter a step up and down, and the step."""
    value = getattr(scene.pad, name)
    usual = scene.pad.F_n / scene.pad.k1 if name in ("x0", "y0") else 1.0
    h = factor * 1e-5 * (abs(value) or usual)
    up = scene.replace(**{name: value + h})
    down = scene.replace(**{name: value - h})
    return (up, down), h


@pytest.mark.parametrize(
    ("name", "damping"),
    [
        *(("b3", damping) for damping in DAMPINGS),
        ("b2-a", "ratios"),
        ("b1-b", "one ratio"),
        ("b1-b", "free inertia"),
    ],
)
def test_slopes_of_eigenvalues_are_differences_through_the_whole_chain(name, damping):
    follows = {"I": None} if damping == "free inertia" else {}
    scene = scene_of(name, damping=DAMPINGS.get(damping), **follows)
    analysis = analyse(scene)
    size = np.abs(analysis.spectrum.values).max()
    sensitivities = of_eigenvalues(scene)
    assert set(sensitivities) == set(parameters(scene.pad_model))
    for parameter, slopes in sensitivities.items():
        sides, h = both_sides(scene, parameter)
        up, down = (analyse(side).spectrum.values for side in sides)
        assert np.abs((up - down) / (2 * h) - slopes).max() * h < 3e-9 * size, parameter


@pytest.mark.parametrize("damping", ["ratios", "rayleigh", "matrix"])
def test_a_moment_of_inertia_that_follows_moves_the_damping_once(damping):
    """I left out follows m, w and h: dimensions and differences through the whole chain."""
    scene = scene_of("b1-b", damping=DAMPINGS[damping], I=None)
    values = analyse(scene).spectrum.values
    slopes = of_eigenvalues(scene)
    for parameter in ("m", "w", "h"):
        sides, h = both_sides(scene, parameter)
        up, down = (analyse(side).spectrum.values for side in sides)
        assert np.abs((up - down) / (2 * h) - slopes[parameter]).max() * h < 1e-9 * abs(values[-1])
    if damping == "ratios":  # all rates follow the square root of stiffness over mass
        assert scene.pad.m * slopes["m"] == pytest.approx(-values / 2, rel=1e-9)


def test_mass_alone_does_not_move_a_threshold_of_modal_damping():
    """With I left out it slows all motions alike."""
    scene = scene_of("b1-c", damping=DAMPINGS["ratios"], I=None, **COUPLED)
    loss = critical_friction(scene).first
    dmu, hertz = of_threshold(scene, loss)["m"]
    assert abs(dmu) * scene.pad.m < 1e-9 * loss.mu
    assert hertz * scene.pad.m == pytest.approx(-loss.frequency_hz / 2, rel=1e-9)


@pytest.mark.parametrize("name", ["b1-d", "b2-c"])
def test_derivatives_obey_the_scaling_of_units(name):
    # in other units of mass and force the frequencies change as sqrt(k/m); lengths do not count
    scene = scene_of(name)
    analysis = analyse(scene)
    pad = scene.pad
    values = analysis.spectrum.values
    slopes = of_eigenvalues(scene)

    def together(names, **powers):
        powers = dict.fromkeys(names.split(), 1) | powers
        return sum(p * getattr(pad, n) * slopes[n] for n, p in powers.items() if n in slopes)

    close = 1e-9 * np.abs(values).max()
    assert np.abs(together("m I") + values / 2).max() < close
    assert np.abs(together("k1 k2 k3 k4 k_c F_n") - values / 2).max() < close
    assert np.abs(together("w h L1 L2 x0 y0 F_n", I=2)).max() < close


def test_modes_of_one_frequency_with_two_ratios_have_no_derivative():
    A = np.diag([1.0, 4.0, 4.0])
    dA = np.ones((3, 3))
    h = 1e-6
    apart = Damping(ratios=(0.1, 0.2, 0.3))
    alike = Damping(ratios=(0.1, 0.2, 0.2))
    assert np.isnan(normalised_damping_slope(apart, A, dA)).any()
    same = normalised_damping_slope(alike, A, dA)
    up = normalised_damping(alike, A + h * dA)[0]
    down = normalised_damping(alike, A - h * dA)[0]
    assert same == pytest.approx((up - down) / (2 * h), abs=1e-8)
    free = np.diag([0.0, 4.0, 9.0])
    held = np.diag([0.0, 1.0, 1.0])  # a free mode has no damping
    ratios = Damping(ratios=(0.0, 0.2, 0.2))
    up = normalised_damping(ratios, free + h * held)[0]
    down = normalised_damping(ratios, free - h * held)[0]
    slope = normalised_damping_slope(ratios, free, held + np.diag([1.0, 0, 0]))
    assert slope == pytest.approx((up - down) / (2 * h), abs=1e-8)


@pytest.mark.parametrize(
    ("name", "damping", "parameters"),
    [
        ("b3", "undamped", ("m", "h", "k2", "alpha1")),
        ("b3", "ratios", ("m", "h")),
        ("b3", "rayleigh", ("m", "k2")),
        ("b1-c", "undamped", ("h",)),
        ("b1-c", "ratios", ("k2",)),
    ],
)
def test_slopes_of_thresholds_are_those_of_differences(name, damping, parameters):
    scene = scene_of(name, damping=DAMPINGS[damping], **COUPLED)
    loss = critical_friction(scene).first
    slopes = of_threshold(scene, loss)
    for parameter in parameters:
        sides, h = both_sides(scene, parameter, 10.0)
        up, down = (critical_friction(side, 1.01 * loss.mu).first for side in sides)
        dmu, hertz = slopes[parameter]
        assert abs((up.mu - down.mu) / (2 * h) - dmu) * h < 1e-7, parameter
        size = loss.frequency_hz  # NaN at a change of contact, which has none
        moved = (up.frequency_hz - down.frequency_hz) / (2 * h)
        assert math.isnan(hertz) or abs(moved - hertz) * h <= 1e-7 * size, parameter


def test_a_threshold_at_zero_stays_there():
    scene = scene_of("b3", damping=Damping(ratios=(0.02, 0.0, 0.01)), **COUPLED)
    loss = critical_friction(scene).first
    assert loss.mu == critical_friction(scene.replace(w=1.01 * scene.pad.w)).first.mu == 0.0
    assert {mu for mu, _ in of_threshold(scene, loss).values()} == {0.0}
    with pytest.raises(ComputationError, match="no derivatives"):
        of_threshold(scene.replace(damping=Damping(matrix=((0.0,) * 3,) * 3)), loss)


def test_a_fold_has_derivatives_and_no_warning_of_rounding(recwarn):
    """Warnings of NumPy reached the user where the balance is exactly singular."""
    scene = scene_of("b2-c")
    fold = critical_friction(scene).points[-1]
    assert fold.kind == "fold"
    assert np.isfinite([mu for mu, _ in of_threshold(scene, fold).values()]).all()
    assert not recwarn


# Falling friction: modes that grow from the least friction on

# fmt: off
PAD = {
    "m": 1.6, "w": 0.025, "h": 0.019, "k1": 3.9e6, "k2": 1.06e6, "k_c": 1.56e6, "L1": 0.23,
    "L2": 0.25, "alpha1": 0.5, "alpha2": 2.3, "F_n": 42.0, "V": 0.04, "mu_s": 0.24, "mu_k": 0.12,
    "v_ref": 0.4,
}
# fmt: on


def falling(**changes):
    document = {"model": "B2", "parameters": PAD | changes, "formulation": {"line_force": "mean"}}
    return Scene.from_dict(document, Place("falling"))


def test_falling_friction_makes_modes_of_an_undamped_pad_grow_from_the_start():
    """Its damping is mu times a matrix; growth rates by numpy's roots at mu = 1e-6."""
    pad = falling()
    small = 1e-6
    M, C, K = map(np.asarray, branch_system(pad, 0.5)[0](small))
    below = -np.linalg.solve(M, np.hstack([K, C]))
    roots = np.linalg.eigvals(np.vstack([np.eye(3, 6, 3), below]))
    growing = sorted((z for z in roots if z.real > 1e-12 * abs(z) and z.imag > 0), key=np.real)
    hertz = [z.imag / (2 * np.pi) for z in growing[::-1]]
    found = critical_friction(pad, 0.5)
    assert [(c.mu, c.direction) for c in found.crossings] == [(0.0, "up")] * 2
    assert [c.frequency_hz for c in found.crossings] == pytest.approx(hertz, rel=1e-5)
    assert [c.changes_verdict for c in found.crossings] == [True, False]
    (point,) = found.points
    assert (point.mu, point.kind) == (0.0, "flutter")
    assert point.frequency_hz == pytest.approx(hertz[0], rel=1e-5)


def test_the_range_of_thresholds_is_refused_beside_eigenvalues():
    with pytest.raises(InputError, match="are of thresholds"):
        squeal.sensitivity(scene_of("b3", **COUPLED), high=1.0)


def a_pair(k, free="mu", stiffer=0.0):
    """Flutter from mu = 1 / k on."""
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, k], [0, 0]], "stiffer": np.eye(2)}
    parameters = {"mu": 1.2 / k, "stiffer": stiffer}
    return squeal.System(np.eye(2), K=K, parameters=parameters, parameter=free)


OTHER_SUBJECTS = {
    "a pad": scene_of("b3", **COUPLED),
    "a stiffer pad": scene_of("b3", **COUPLED).replace(k1=2.1e7),
    "one row": squeal.System([[1.0]], K={"mu": [[4.0]]}),
    "a pair": a_pair(4 / 3),
    "another pair": a_pair(2.0),
    "another parameter": a_pair(4 / 3, free="stiffer"),
    "another value": a_pair(4 / 3, stiffer=0.1),
}


@pytest.mark.parametrize("of", OTHER_SUBJECTS)
def test_an_answer_is_taken_for_its_own_subject_alone(of):
    """At whatever value of the free parameter it was computed, and from whatever copy."""
    known = squeal.eigenvalues(OTHER_SUBJECTS[of], 0.25)
    for name, subject in OTHER_SUBJECTS.items():
        copy = pickle.loads(pickle.dumps(subject))
        if name == of:
            found = squeal.sensitivity(copy, known=known)
            assert found.at == pytest.approx(known.values)
            continue
        with pytest.raises(InputError, match="known: is the answer of another subject"):
            squeal.sensitivity(copy, known=known)


def test_thresholds_serve_their_own_subject_alone():
    """As what is differentiated, as onsets of modes, and as marks in a figure."""
    thresholds = squeal.thresholds(a_pair(2.0))
    pair = a_pair(4 / 3)
    refused = pytest.raises(InputError, match="is the answer of another subject")
    with refused:
        squeal.sensitivity(pair, of="threshold", known=thresholds)
    with refused:
        squeal.eigenvalues(pair).with_onsets(thresholds)
    with refused:
        squeal.sweep(pair, [0.0, 0.5, 1.0]).plot(damping=True, thresholds=thresholds)
