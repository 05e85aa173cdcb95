"""What `import squeal` offers: names, arguments, types of results, representations."""

import inspect
import subprocess
import sys
import typing

import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.io.scene import Scene
from tests.conftest import ROOT, SCENES
from tests.known import coupled as system

FUNCTIONS = [n for n in squeal.__all__ if inspect.isfunction(getattr(squeal, n))]
OF_SCENES = [
    n
    for n in FUNCTIONS
    if next(iter(inspect.signature(getattr(squeal, n)).parameters), "") == "scene"
]
OF_SYSTEMS = ["critical_points", "crossings", "friction_loop", "track", "unstable_modes"]


def test_only_public_names_are_listed():
    assert dir(squeal) == sorted([*squeal.__all__, "__version__"])
    assert list(squeal.__all__) == sorted(squeal.__all__)
    code = "import sys, squeal; print(dir(squeal) == sorted([*squeal.__all__, '__version__']))"
    run = [sys.executable, "-c", f"{code}; print('numpy' in sys.modules)"]
    done = subprocess.run(run, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["True", "False"]  # and nothing is loaded in vain
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        squeal.nothing  # noqa: B018


@pytest.mark.parametrize("name", FUNCTIONS)
def test_words_of_the_field_and_a_docstring(name):
    assert not {"told", "swept", "found", "of"} & set(name.split("_"))
    assert inspect.getdoc(getattr(squeal, name))


@pytest.mark.parametrize("name", OF_SCENES)
def test_what_takes_a_scene_refuses_anything_else(name):
    scene = squeal.read_scene(SCENES / "b1-c.yaml")
    needed = [
        p
        for p in inspect.signature(getattr(squeal, name)).parameters.values()
        if p.default is p.empty
    ]
    for wrong in (scene.pad, scene.pad_model, "b1-c.yaml", None, system):
        with pytest.raises(InputError, match=rf"^{name}: .* it must be a Scene") as caught:
            getattr(squeal, name)(wrong, *[None] * (len(needed) - 1))
        assert "\n" not in str(caught.value)


def test_there_are_functions_of_scenes():
    assert {"analyse", "critical_friction", "judged_equilibria", "simulate"} <= set(OF_SCENES)
    assert {"stability_map", "sweep_mu"} <= set(OF_SCENES)


@pytest.mark.parametrize("name", OF_SYSTEMS)
def test_what_takes_a_system_refuses_anything_else(name):
    scene = squeal.read_scene(SCENES / "b1-c.yaml")
    for wrong in (scene, scene.pad, None):
        with pytest.raises(InputError, match=rf"^{name}: .* must be a system"):
            getattr(squeal, name)(wrong, [0.0, 1.0])


def classes(hint):
    """The classes of this package in a type."""
    inner = typing.get_args(hint)
    found = set().union(*map(classes, inner)) if inner else set()
    if inspect.isclass(hint) and hint.__module__.startswith("squeal."):
        found.add(hint)
    return found


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_types_of_all_results_are_public(name):
    hint = typing.get_type_hints(getattr(squeal, name))["return"]
    for kind in classes(hint):
        assert getattr(squeal, kind.__name__, None) is kind


def test_a_linear_model_has_no_equilibria():
    with pytest.raises(InputError, match="B3 is not allowed"):
        squeal.judged_equilibria(squeal.read_scene(SCENES / "b3.yaml"))


def test_results_show_what_matters_in_a_few_lines():
    scene = squeal.read_scene(SCENES / "b1-b.yaml", "simulate").replace(stop=1e-3, samples=9)
    results = [
        squeal.analyse(scene),
        squeal.analyse(scene).spectrum,
        squeal.stability_map(scene, squeal.angle_axes(3)),
        squeal.simulate(scene),
        squeal.track(system, [0.0, 0.1]),
        squeal.friction_loop(system),
        squeal.read_plain(ROOT / "squeal" / "article" / "literature" / "systems" / "wing.yaml"),
    ]
    for result in (scene, *results):
        assert len(repr(result)) < 600, repr(result)
        assert "array(" not in repr(result)


api: typing.Any = squeal  # asked for what its types do not allow
SCENE, BLOCK = api.read_scene(SCENES / "b1-c.yaml"), api.read_scene(SCENES / "b2-c.yaml")
LINEAR = api.read_scene(SCENES / "b3.yaml")
MU = api.Axis("mu", 0.0, 1.0, 3)


@pytest.mark.parametrize(
    "wrong",
    [
        *(
            lambda f=f, mu_max=mu_max: f(mu_max)
            for mu_max in (np.nan, np.inf, 5000, True, "2", None, 0, -1)
            for f in (
                lambda mu_max: api.critical_friction(SCENE, mu_max),
                lambda mu_max: api.critical_friction(LINEAR, mu_max),
                lambda mu_max: api.advise(SCENE, mu_max=mu_max),
                lambda mu_max: api.scatter(SCENE, (), 10, mu_max=mu_max),
            )
        ),
        *(lambda mus=mus: api.sweep_mu(SCENE, mus) for mus in (0.3, ["a"], "a", [], [np.inf])),
        *(lambda axes=axes: api.stability_map(SCENE, axes) for axes in (None, (MU,), "ab")),
        *(lambda end=end: api.critical_points(system, end) for end in ("2", np.nan, -1, True)),
        lambda: api.crossings(system, 1.0, mu_min="0"),
        *(lambda mu=mu: api.friction_loop(system, mu) for mu in (0, "1")),
        *(lambda mus=mus: api.track(system, mus) for mus in (-1.0, [np.nan], "2", [])),
        lambda: api.sweep_modes(None, 0.0, 1.0),
        *(lambda end=end: api.sweep_modes(SCENE, 0.0, end) for end in ("1", np.inf, 0)),
        lambda: api.sweep_modes(SCENE, 0.5, 0.4),
        lambda: api.mode_shapes(SCENE),
        lambda: SCENE.replace(damping={"ratios": [0.1] * 3}),
        lambda: SCENE.replace(pad=3),
        lambda: SCENE.replace(pad=3, mu=0.1),
        lambda: BLOCK.replace(formulation="mean"),
        *(
            lambda read=read: read(None)
            for read in (api.read_scene, api.read_plain, api.read_system)
        ),
        lambda: api.Axis("mu", 0.0, 1.0, 3, part=(2, 9)),
        lambda: api.Axis("mu", 0.0, 1.0, 3, part=(2, 2)),
        lambda: api.Axis("mu", 0.0, 1.0, 3, part=1),
        lambda: api.Damping(matrix=np.eye(2)),
    ],
)
def test_wrong_arguments_are_refused_in_a_sentence(wrong):
    with pytest.raises(InputError) as caught:
        wrong()
    assert "it must be " in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "thresholds" not in str(caught.value)


def test_arguments_at_the_ends_of_what_is_allowed_pass():
    assert api.critical_friction(LINEAR, 1000).mu_end == 1000.0
    assert api.critical_friction(LINEAR, np.float32(0.5)).mu_end == 0.5
    assert [mu for mu, _ in api.sweep_mu(LINEAR, (mu / 4 for mu in (2, 0)))] == [0.5, 0.0]
    assert api.stability_map(LINEAR, [MU, api.Axis("h", 0.01, 0.02, 2)]).codes.shape == (3, 2)
    assert api.Axis("mu", 0.0, 3.0, 3, part=(2, 3)).values == pytest.approx([2.5])
    assert api.track(system, np.array([0.1])).values.shape == (1, 4)


def test_damping_takes_arrays_and_holds_tuples():
    given = api.Damping(matrix=np.eye(3))
    assert given == api.Damping(matrix=((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))
    assert hash(api.Damping(ratios=np.full(3, 0.1))) == hash(api.Damping(ratios=(0.1,) * 3))


def test_matrices_of_a_result_are_not_written_to():
    analysis = api.analyse(SCENE)
    for X in (analysis.matrices.M, analysis.matrices.C, analysis.matrices.K):
        with pytest.raises(ValueError, match="read-only"):
            X[0, 0] = 1.0


def test_scenes_are_made_changed_and_asked_in_python():
    pad = squeal.Pad(
        m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
        alpha1=np.pi / 2, alpha2=np.pi, mu=0.4, F_n=4500.0,
    )  # fmt: skip
    scene = Scene("B1", pad)
    (first, *_) = squeal.critical_friction(scene).points
    assert first.mu == pytest.approx(0.315281722069, abs=1e-12)  # as the README prints it
    assert squeal.analyse(scene).judgement.verdict == "flutter"
    assert squeal.analyse(scene.replace(mu=0.99 * first.mu)).judgement.verdict == "marginal"
