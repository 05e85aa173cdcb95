"""Maps point by point against the queries of single pads; curves between verdicts, closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

import squeal
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import Formulation
from squeal.model.equations import about_origin
from squeal.model.pad import Pad
from squeal.queries.pads import maps
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.pads.maps import NAMES, angle_axes, stability_map, verdicts_at
from squeal.queries.pads.stack import STABLE_OR_MARGINAL, PadStack
from squeal.queries.thresholds import critical_friction
from squeal.results.map import Axis
from tests.conftest import HAMMERING, ROOT, scene_of

MATRIX = Damping(matrix=((60.0, 10.0, 0.2), (10.0, 90.0, -0.1), (0.2, -0.1, 0.08)))
RATIOS = Damping(ratios=(0.004, 0.03, 0.001))
# springs upright but for SLANT, which holds the pad along x and else changes the rest in some 1e-6:
# y and theta are two coupled modes
SLANT = 1e-6
UPRIGHT = Scene(
    "B3",
    Pad(m=1.3, w=0.05, h=0.04, k1=3e6, k2=1e6, k_c=8e6, alpha1=math.pi / 2 + SLANT,
        alpha2=math.pi / 2 - SLANT, mu=0.3),
)  # fmt: skip


def verdict_at(scene, **changes):
    """What a sweep says of this pad, and 'beyond a fold' where its branch ends."""
    one = scene.replace(**changes)
    return squeal.sweep(one, [one.pad.mu]).steps[0].verdict or "beyond a fold"


def assert_point_by_point(scene, axes, verdict=verdict_at):
    """The verdicts of a map, which are those of the queries."""
    codes = stability_map(scene, axes).codes
    met = set()
    for i, a in enumerate(axes[0].values.tolist()):
        for j, b in enumerate(axes[1].values.tolist()):
            expected = verdict(scene, **{axes[0].name: a, axes[1].name: b})
            assert NAMES[codes[i, j]] == expected, (a, b)
            met.add(expected)
    return met


@pytest.mark.parametrize(
    ("stem", "axes", "damping"),
    [
        ("b1-c", angle_axes(4), MATRIX),
        ("b2-c", angle_axes(4), RATIOS),
        ("b3", angle_axes(8), MATRIX),
        ("b3", angle_axes(8), RATIOS),
        # the damping ratios are those of each point's own pad
        ("b2-b", (Axis("mu", 0.0, 0.6, 4), Axis("m", 0.05, 0.5, 4)), RATIOS),
    ],
)
def test_damped_maps_are_the_queries_point_by_point(stem, axes, damping):
    met = assert_point_by_point(scene_of(stem, damping=damping), axes)
    assert met >= {"stable"} | ({"flutter"} if stem != "b2-b" else set())


@pytest.mark.parametrize("quantity", ["critical-friction", "growth"])
def test_any_number_of_workers_gives_the_same_bits(quantity, monkeypatch):
    """A map of several blocks, each of which is computed as a whole."""
    monkeypatch.setattr(maps, "POINTS_AT_ONCE", 9)
    monkeypatch.setattr(maps, "QUANTITY_POINTS", 7)
    scene = scene_of("b2-d")
    axes = Axis("alpha1", 0.0, math.pi, 4), Axis("alpha2", 0.0, math.pi, 5)
    alone, shared = (squeal.map(scene, axes, quantity, workers=n) for n in (1, 2))
    assert len(np.unique(alone.codes)) > 1
    assert shared.codes.tobytes() == alone.codes.tobytes()
    assert shared.quantity[2].tobytes() == alone.quantity[2].tobytes()
    assert shared.warnings == alone.warnings


def test_pads_that_rest_far_from_where_they_are_put():
    # short springs turn this pad by 50 degrees: no place that the load reaches is an equilibrium
    pad = Pad(
        m=1.16, w=0.0249, h=0.0155, k1=2.93e7, k2=6.4e6, L1=0.0575, L2=0.0858, alpha1=1.7,
        alpha2=2.15, mu=0.67, F_n=164.0, x0=-0.05, y0=1.4e-5, k_c=1.37e8,
    )  # fmt: skip
    scene = Scene("B2", pad, Formulation("mean", "frame"))
    axes = Axis("mu", 0.0, 0.8, 3), Axis("k2", 6.3e6, 6.5e6, 2)
    assert assert_point_by_point(scene, axes) == {"flutter"}
    assert not stability_map(scene, axes).admissible.any()


STIFF_FACE = Scene(
    "B2",
    Pad(
        m=1.0, w=1.0, k1=1.0, h=0.2689816314417701, I=0.3026823240875288, k2=1.438826587096588,
        k_c=320045.6330011822, L1=7.468306790577523, L2=12.353271181464967,
        alpha1=1.4922565104551517, alpha2=2.149442007353456, mu=1.4625, F_n=0.0022663027845558946,
        x0=0.0725781542340169, y0=-0.012209485629771793, theta0=0.004143949912545275,
    ),
    Formulation("mean", "frame", "-"),
)  # fmt: skip


@pytest.mark.parametrize(
    "scene",
    [
        # beside these angles branches fold; here they come close to it and go on
        *(
            read_scene(ROOT / "workflow" / "scenes" / "b2-d.yaml").replace(alpha1=a, alpha2=b)
            for a, b in ((1.4807, 1.0734), (1.4812, 1.1083), (1.4816, 1.1271), (1.485, 1.3011))
        ),
        STIFF_FACE,  # which tilts
    ],
)
def test_a_branch_that_bends_does_not_turn_back(scene):
    code = verdicts_at(scene, ("mu",), np.array([[scene.pad.mu]])).codes[0]
    assert NAMES[code] == verdict_at(scene) != "beyond a fold"


def test_a_contour_takes_the_fold_that_the_query_finds():
    """Once a grid value, 1.34375; and around it the map changed between marginal and beyond."""
    pad = Pad(
        m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
        alpha1=0.32798, alpha2=0.42706, mu=0.4, F_n=4500.0,
    )  # fmt: skip
    scene = Scene("B1", pad)
    fold = critical_friction(scene).points[-1]
    assert fold.kind == "fold"
    loss = PadStack.of(scene, ("h",), np.array([[pad.h]])).first_losses(2.0).mu[0]
    assert loss == pytest.approx(fold.mu, rel=1e-9)
    mus = np.linspace(1.33, 1.36, 61)
    names = [NAMES[code] for code in verdicts_at(scene, ("mu",), mus[None]).codes]
    assert names == ["marginal" if mu < fold.mu else "beyond a fold" for mu in mus]


@pytest.mark.parametrize("alpha1", [0.245317, 0.245387, 0.245407])
def test_a_window_of_flutter_between_two_levels_is_found(alpha1):
    """It is 2 to 7 thousandths of friction wide, levels are 31 apart; by the discriminant of
    det(K0 + mu K1 - s M), a polynomial in mu, whose roots are its ends."""
    scene = scene_of("b3").replace(
        k1=6624369.0, k2=28367543.0, k_c=9149264.0, h=0.0049027, I=0.00023991, alpha2=2.678625
    )
    model = scene.replace(alpha1=alpha1).pad_model
    M, _, K0 = about_origin(model.replace(mu=0.0))
    K1 = about_origin(model.replace(mu=1.0)).K - K0
    nodes = np.cos(np.pi * (np.arange(40) + 0.5) / 40) + 1.0
    squares = np.linalg.eigvals(np.linalg.solve(M, K0 + nodes[:, None, None] * K1).astype(complex))
    a, b, c = squares.T / np.abs(squares).max()
    discriminant = (((a - b) * (a - c) * (b - c)) ** 2).real
    fit = np.polynomial.Chebyshev.fit(nodes, discriminant, 12, domain=[0.0, 2.0])
    roots = np.asarray(fit.roots())
    real = roots.real[np.abs(roots.imag) < 1e-9]
    start, end = sorted(real[np.abs(real - 0.08) < 0.01])
    assert 1e-3 < end - start < 1e-2
    losses = PadStack.of(scene, ("alpha1",), np.array([[alpha1]])).first_losses(2.0)
    assert losses.kinds == ["flutter"]
    assert losses.mu[0] == pytest.approx(start, abs=1e-6)


@pytest.mark.parametrize(
    ("stem", "damping"),
    [
        ("b1-c", Damping(ratios=(0.01, 0.02, 0.03))),
        ("b2-c", None),
        ("b3", None),
        ("b3", Damping(ratios=(0.01, 0.02, 0.03))),
    ],
)
def test_growth_and_frequency_are_those_of_the_dominant_eigenvalue(stem, damping):
    scene = scene_of(stem, damping=damping)
    k2 = scene.pad.k2
    axes = Axis("alpha1", 0.3, 2.9, 3), Axis("k2", 0.4 * k2, 2.5 * k2, 3)
    growth = stability_map(scene, axes, "growth").quantity[2]
    frequency = stability_map(scene, axes, "frequency").quantity[2]
    for i, j in np.ndindex(3, 3):
        one = scene.replace(alpha1=float(axes[0].values[i]), k2=float(axes[1].values[j]))
        values = squeal.sweep(one, [one.pad.mu]).steps[0].roots
        if values is None:
            assert np.isnan(growth[i, j])
            continue
        top = max(values, key=lambda root: (root.real, root.imag))
        assert growth[i, j] == pytest.approx(top.real, abs=1e-7 * np.abs(values).max())
        if top.real > 1e-6 * np.abs(values).max():
            assert frequency[i, j] == pytest.approx(abs(top.imag) / math.tau, rel=1e-6)
        else:
            assert np.isnan(frequency[i, j])


def test_rounding_of_undamped_roots_is_no_growth_where_ratios_are_zero():
    undamped = read_scene(ROOT / "examples" / "pad.yaml")
    scene = replace(undamped, damping=Damping(ratios=(0.0, 0.0, 0.0)))
    axes = Axis("mu", 0.0, 1.0, 5), Axis("k1", 1e7, 3e7, 5)
    answer = stability_map(scene, axes, "growth")
    is_marginal = answer.codes == NAMES.index("marginal")
    assert is_marginal.any()
    assert not is_marginal.all()
    assert np.all(answer.quantity[2][is_marginal] == 0.0)
    frequency = stability_map(scene, axes, "frequency").quantity[2]
    assert np.array_equal(np.isnan(frequency), is_marginal)


def test_an_undamped_pad_beside_damped_ones_flutters_at_its_own_frequency():
    """Friction does not fall where mu_s = mu_k, and the pad has no damping there."""
    falls = scene_of("b1-c").pad.replace(mu=None, mu_s=0.3, mu_k=0.3, v_ref=2.0, V=5.0)
    scene = replace(scene_of("b1-c"), pad=falls)
    alone = PadStack.of(scene, ("mu_k",), np.array([[0.3]]))
    beside = PadStack.of(scene, ("mu_k",), np.array([[0.3, 0.2]]))
    hertz = []
    for stack in (alone, beside):
        equilibria, _ = stack.at_mu()
        A, B = stack.matrices(np.arange(stack.n), equilibria)
        hertz.append(stack.frequency_at_onset(A, B)[0])
    assert hertz[1] == pytest.approx(hertz[0], rel=1e-9)


def test_values_that_could_not_be_decided_are_named_in_the_record(monkeypatch, recwarn):
    """They stood in a warning alone, which spoke of no equilibrium."""
    losses = PadStack.first_losses
    some = np.array([True, False, False, False])
    monkeypatch.setattr(
        PadStack, "first_losses", lambda *given: losses(*given)._replace(unknown=some)
    )
    axes = Axis("k1", 1e8, 2e8, 2), Axis("k2", 1e8, 2e8, 2)
    answer = squeal.map(scene_of("b3"), axes, "critical-friction")
    assert answer.warnings == ("critical friction could not be decided at 25 % of the points",)
    assert answer.to_dict()["admissible"] is True
    assert not recwarn


def test_each_axis_of_a_map_has_its_own_number_of_points_in_json():
    axes = Axis("k1", 1e8, 2e8, 3), Axis("k2", 1e8, 2e8, 2)
    answer = squeal.map(scene_of("b3"), axes).to_dict()
    assert [axis["n"] for axis in answer["axes"]] == [3, 2]


def test_ratios_of_an_unstable_mode_are_refused_with_the_place():
    # Eq. (21) as printed turns the contact's moment round: rotation falls off without friction
    scene = scene_of("b3", damping=RATIOS, formulation=Formulation(delta_moment="-"))
    with pytest.raises(ComputationError, match="unstable without friction at k_c = "):
        stability_map(scene, (Axis("k_c", 1e5, 1e9, 4), Axis("mu", 0.0, 0.1, 2)))


def curves_of(scene, axes):
    """Kinds, points (n, 2) and frequencies of the curves of a map."""
    curves = squeal.map(scene, axes, curves=True).details["threshold_curve"]
    return [(c["kind"], np.array(c["points"]), np.array(c["frequency_hz"])) for c in curves]


def mode_coupling(pad, k1):
    """The critical friction of UPRIGHT's two modes, from K written out by hand.

    K = [[k1 + k2 + k_c, b], [b + h mu k_c, w^2 (k1 + k2 + k_c/3)]] with b = w (k2 - k1): a double
    root where the frequencies' distance is what friction closes.
    """
    a = (k1 + pad.k2 + pad.k_c) / pad.m
    d = pad.w**2 * (k1 + pad.k2 + pad.k_c / 3) / pad.I
    b = pad.w * (pad.k2 - k1)
    return -(b + pad.m * pad.I * (a - d) ** 2 / (4 * b)) / (pad.h * pad.k_c), (a + d) / 2


@pytest.mark.parametrize("log", [False, True])
def test_curves_of_mode_coupling_are_those_of_the_closed_form(log):
    axes = Axis("k1", 1.5e6, 6e6, 16, log), Axis("mu", 0.0, 3.0, 16)
    curves = [
        (points, hertz) for kind, points, hertz in curves_of(UPRIGHT, axes) if kind == "flutter"
    ]
    assert curves
    for points, hertz in curves:
        assert len(points) > 10
        for (k1, mu), rate in zip(points, hertz, strict=True):
            exact, s = mode_coupling(UPRIGHT.pad, k1)
            assert mu == pytest.approx(exact, rel=1e-5)
            assert rate == pytest.approx(math.sqrt(s) / (2 * math.pi), rel=1e-5)
    # and every value of k1 at which the closed form lies in the map has its place on a curve
    for k1 in axes[0].values:
        mu, _ = mode_coupling(UPRIGHT.pad, float(k1))
        if 0.1 < mu < 2.9:
            met = [np.interp(k1, *points[np.argsort(points[:, 0])].T) for points, _ in curves]
            assert min(abs(m - mu) for m in met) < 0.02
    assert curves_of(UPRIGHT, (Axis("mu", 0.0, 0.01, 6), Axis("h", 0.01, 0.02, 6))) == []


def assert_divides(scene, axes, points):
    """Close to a curve there are pads that grow, or have no equilibrium, and pads that do not."""
    low, high = np.array([(axis.low, axis.high) for axis in axes]).T
    spans = high - low
    points = points[1 : -1 : max(1, len(points) // 4)]
    inside = ((points > low + 1e-3 * spans) & (points < high - 1e-3 * spans)).all(axis=1)
    assert inside.any()
    for point in points[inside]:
        turns = 2 * np.pi * np.arange(8) / 8
        near = point[:, None] + 1e-4 * spans[:, None] * np.array([np.cos(turns), np.sin(turns)])
        calm = np.isin(
            verdicts_at(scene, tuple(axis.name for axis in axes), near).codes, STABLE_OR_MARGINAL
        )
        assert 0 < calm.sum() < 8, point


@pytest.mark.parametrize("damped", [False, True])
def test_points_on_the_curves_of_a_tilted_pad_divide(damped):
    scene = scene_of("b3", damping=Damping(rayleigh=(20.0, 4e-6)) if damped else None)
    axes = Axis("alpha1", 0.1, 1.3, 4), Axis("alpha2", 2.7, 3.0, 3)
    curves = curves_of(scene, axes)
    assert {kind for kind, *_ in curves} >= {"flutter"}
    for kind, points, _ in curves:
        assert_divides(scene, axes, points)
        for a1, a2 in points[:: max(1, len(points) // 4)] if kind == "flutter" else ():
            values = analyse(scene.replace(alpha1=a1, alpha2=a2)).spectrum.values
            size = np.abs(values).max()
            if damped:  # a pair on the axis, and nothing right of it
                assert abs(values.real.max()) < 1e-7 * size
            else:  # two equal frequencies
                rates = np.sort(np.abs(values.imag))[::2]
                assert np.diff(rates).min() < 1e-4 * size


def test_folds_are_those_of_the_branch():
    scene = scene_of("b2-c")
    fold = critical_friction(scene).first
    h = scene.pad.h
    assert fold.kind == "fold"
    axes = Axis("mu", 0.9 * fold.mu, 1.1 * fold.mu, 4), Axis("h", 0.98 * h, 1.02 * h, 2)
    ((points, hertz),) = [(p, f) for kind, p, f in curves_of(scene, axes) if kind == "fold"]
    assert not hertz.any()
    for mu, height in points[:: len(points) - 1]:
        own = critical_friction(scene.replace(h=height)).first
        assert own.kind == "fold"
        assert own.mu == pytest.approx(mu, rel=1e-8)
    along = points[np.argsort(points[:, 1])]
    assert np.interp(h, along[:, 1], along[:, 0]) == pytest.approx(fold.mu, rel=1e-3)


def test_a_contact_change_that_costs_stability_ends_where_it_does_no_more(monkeypatch):
    monkeypatch.setattr(maps, "HALVINGS", 27)  # what 1e-9 of the width takes
    scene = read_scene(HAMMERING / "b2-c.yaml")
    axes = Axis("mu", 0.8, 1.0, 6), Axis("alpha1", 1.8, 2.0, 4)
    curves = curves_of(scene, axes)
    assert {"flutter", "contact"} <= {kind for kind, *_ in curves}
    for kind, points, _ in curves:
        assert_divides(scene, axes, points)
        for mu, alpha1 in points[::5] if kind == "contact" else ():
            model = scene.replace(mu=mu, alpha1=alpha1).pad_model
            gaps = model.gaps(np.array(sliding_equilibrium(model)[0].q))
            assert np.abs(gaps).min() < 1e-9 * scene.pad.w


def test_an_unknown_quantity_is_refused_before_the_map_is_computed(monkeypatch):
    monkeypatch.setattr(maps, "on_grid", None)
    scene = read_scene(ROOT / "workflow" / "scenes" / "b3.yaml")
    with pytest.raises(
        squeal.InputError, match=r"quantity: 'grwth' is not allowed; it must be one"
    ):
        stability_map(scene, angle_axes(5), "grwth")
