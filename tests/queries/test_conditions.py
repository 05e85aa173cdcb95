"""Operating conditions: closed forms, plain loops over all combinations, and what is refused."""

import itertools
import json
import typing

import numpy as np
import pytest
import scipy.linalg

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.examples.brake import solid_brake
from squeal.results.conditions import Condition, Conditions, ModeAtCondition
from tests.conftest import ROOT, SCENES

PAD = squeal.read_scene(ROOT / "squeal" / "examples" / "pad.yaml")


def roots_by_companion(M, C, K):
    """All eigenvalues with Im lambda >= 0, by another form than the package's, in a unit of time
    that balances it."""
    n = len(M)
    rate = np.sqrt(np.linalg.norm(K, 2) / np.linalg.norm(M, 2))
    zero = np.zeros((n, n))
    eye = np.eye(n)
    A = np.block([[zero, eye], [-K / rate**2, -C / rate]])
    roots = rate * scipy.linalg.eigvals(A, np.block([[eye, zero], [zero, M]]))
    return roots[roots.imag >= 0.0]


def test_coupled_modes_flutter_where_friction_exceeds_their_distance():
    """omega^2 = 2 +- sqrt(gap^2 - mu^2): the real part of a root is that of sqrt(-omega^2)."""
    K = {"1": 2 * np.eye(2), "gap": np.diag([1.0, -1.0]), "mu": [[0.0, 1.0], [-1.0, 0.0]]}
    pair = squeal.System(np.eye(2), K=K, parameters={"gap": 0.5})
    axes = {"mu": [0.2, 0.6, 1.0], "gap": [0.3, 0.5, 0.7]}
    found = squeal.conditions(pair, axes)
    assert [tuple(one.parameters.values()) for one in found.conditions] == list(
        itertools.product(*axes.values())
    )
    for one in found.conditions:
        mu, gap = one.parameters["mu"], one.parameters["gap"]
        if mu < gap:
            assert (one.verdict, one.unstable, one.worst) == ("marginal", 0, None)
            continue
        root = np.sqrt(-2 + 1j * np.sqrt(mu**2 - gap**2))
        assert (one.verdict, one.unstable) == ("flutter", 1)
        assert one.worst.growth_rate == pytest.approx(root.real)
        assert one.worst.frequency_hz == pytest.approx(root.imag / (2 * np.pi))
        assert one.worst.damping_ratio == pytest.approx(-root.real / abs(root))
    (mode,) = found.modes
    assert (mode.unstable, mode.propensity) == (5, 5 / 9)
    assert mode.growth_rate == pytest.approx(np.sqrt(-2 + 1j * np.sqrt(1 - 0.3**2)).real)
    assert mode.at == {"mu": 1.0, "gap": 0.3}


def test_a_mode_is_known_again_where_its_frequency_crosses_another():
    """Mode a always grows and passes b, which grows where `feed` is 1: by shape, not frequency."""
    C = {"1": np.diag([-0.1, 0.1]), "feed": np.diag([0.0, -0.2])}
    K = {"1": np.diag([0.0, 144.0]), "(10 + p)**2": np.diag([1.0, 0.0])}
    both = squeal.System(np.eye(2), C, K, parameters={"p": 0.0, "feed": 0.0}, parameter="p")
    values = [0.0, 0.5, 1.0, 1.4, 1.8, 2.3, 2.8, 3.5, 4.2, 5.0]
    found = squeal.conditions(both, {"feed": [0.0, 1.0], "p": values})
    b, a = sorted(found.modes, key=lambda mode: mode.propensity)
    assert (a.propensity, b.propensity) == (1.0, 0.5)
    assert [a.low_hz, a.high_hz] == pytest.approx(np.array([10, 15]) / (2 * np.pi), rel=1e-4)
    assert [b.low_hz, b.high_hz] == pytest.approx(np.array([12, 12]) / (2 * np.pi), rel=1e-4)


def test_a_divergence_is_one_mode_over_all_conditions():
    """A mass on the spring 1 - p diverges by (p - 1)^0.5 from p = 1 on; another one never does."""
    K = {"1": np.diag([1.0, 9.0]), "p": np.diag([-1.0, 0.0]), "q": np.diag([0.0, 1.0])}
    system = squeal.System(np.eye(2), K=K, parameters={"p": 0.0, "q": 0.0}, parameter="p")
    found = squeal.conditions(system, {"p": [0.5, 2.0, 5.0, 10.0], "q": [0.0, 1.0]})
    (mode,) = found.modes
    assert (mode.unstable, mode.propensity) == (6, 0.75)
    assert (mode.low_hz, mode.high_hz) == (0.0, 0.0)
    assert mode.growth_rate == pytest.approx(3.0)
    assert [one.verdict for one in found.conditions] == ["marginal"] * 2 + ["divergence"] * 6
    assert "the worst 0 Hz, growth 3 1/s, at p = 10" in found.conclusion


def test_a_rotor_agrees_with_a_plain_loop_over_its_matrices():
    rotor = json.loads((ROOT / "squeal" / "examples" / "rotor.json").read_text("utf-8"))
    whole = {}
    for name, entries in rotor["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        whole[name] = np.zeros((rotor["rows"],) * 2)
        whole[name][rows, columns] = values
    cross = (whole["K"] - whole["K"].T) / 2
    C = {"1": whole["C"], "speed": whole["G"]}
    K = {"1": whole["K"] - cross, "cross": cross}
    given = {"speed": 0.0, "cross": 0.4}
    system = squeal.System(whole["M"], C, K, parameters=given, parameter="speed")
    axes: dict[str, typing.Any] = {"speed": np.linspace(0.0, 900.0, 4), "cross": [0.1, 0.4, 1.6]}
    found = squeal.conditions(system, axes)
    grows = []
    for one, (speed, share) in zip(
        found.conditions, itertools.product(*axes.values()), strict=True
    ):
        damping = C["1"] + speed * C["speed"]
        roots = roots_by_companion(whole["M"], damping, K["1"] + share * cross)
        roots = roots[roots.imag > 1.0]  # free motions neither grow nor decay
        growing = roots[roots.real > 1e-6 * np.abs(roots)]
        fastest = roots[np.argmax(roots.real)]
        assert one.unstable == len(growing)
        grows.append(len(growing))
        if not len(growing):
            assert one.verdict == "marginal"
            continue
        assert one.verdict == "flutter"
        assert one.worst.growth_rate == pytest.approx(fastest.real, rel=1e-6)
        assert one.worst.frequency_hz == pytest.approx(fastest.imag / (2 * np.pi), rel=1e-9)
        assert len({mode.mode for mode in one.modes}) == len(one.modes)
        hertz = [mode.frequency_hz for mode in one.modes]
        assert sorted(hertz) == pytest.approx(np.sort(growing.imag) / (2 * np.pi), rel=1e-9)
    assert sum(mode.unstable for mode in found.modes) == sum(grows)
    assert found.propensity == np.count_nonzero(grows) / len(grows)


def test_a_large_brake_agrees_with_a_plain_loop_of_eigenvalues():
    brake = solid_brake(500, around=60).system
    axes = {"mu": [0.0, 0.6], "contact": [0.8]}
    band = (3500.0, 7000.0)
    found = squeal.conditions(brake, axes, band=band)
    assert found.basis is not None
    assert found.extent == "3500 to 7000 Hz"
    for one in found.conditions:
        plain = squeal.eigenvalues(brake.replace(one.parameters), band=band)
        assert plain.certified
        assert one.unstable == len(plain.unstable)
        for mode, reference in zip(one.modes, plain.unstable, strict=True):
            assert mode.frequency_hz == pytest.approx(reference.frequency_hz, rel=1e-6)
            assert mode.growth_rate == pytest.approx(reference.growth_rate, rel=1e-3)
        fastest = max(root.growth_rate for root in plain.eigenvalues)
        assert one.worst.growth_rate == pytest.approx(fastest, rel=1e-3)
        assert one.verdict == plain.verdict


def test_pressure_seats_contact_anew_at_each_condition(tmp_path, monkeypatch):
    """A block is pressed by `pressure` on another one that a spring of 3 N/m holds. With
    dp/dh = 2 (p / 5)^0.5 the contact has the stiffness 2 (pressure / 5)^0.5, whatever h is."""
    files = {
        "one.yaml": "M: [[1.0]]\nK: [[3.0]]\ncoordinates: {file: one.csv}\n",
        "other.yaml": "M: [[1.0]]\nK: [[0.0]]\ncoordinates: {file: other.csv}\n",
        "one.csv": "node,dof,x,y,z\n1,z,0,0,0\n",
        "other.csv": "node,dof,x,y,z\n1,z,0,0,0\n",
        "load.csv": "node,dof,force\n1,z,-1\n",
        "pairs.csv": "first,second\n1,1\n",
        "both.yaml": """
parameters: {pressure: 1.0, stretch: 1.0}
components:
  one: {file: one.yaml}
  other: {file: other.yaml, load: {file: load.csv, factor: pressure}}
contact:
  - between: [one, other]
    pairs: {file: pairs.csv}
    normal: [0, 0, 1]
    stiffness: 2 * stretch
    exponent: 0.5
    reference: 5.0
""",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    file = squeal.read_system(tmp_path / "both.yaml")
    axes = {"pressure": [0.5, 1.0, 7.0], "stretch": [1.0, 3.0]}
    found = squeal.conditions(file, axes)
    assert found.seated
    for one in found.conditions:
        k = 2 * one.parameters["stretch"] * np.sqrt(one.parameters["pressure"] / 5)
        squares = np.linalg.eigvalsh([[3 + k, -k], [-k, k]])
        hertz = [mode.frequency_hz for mode in one.rows]
        assert hertz == pytest.approx(np.sqrt(squares) / (2 * np.pi))
    again = file.replaced({"pressure": 7.0}).replaced({"stretch": 3.0})
    k = 6 * np.sqrt(7 / 5)
    assert again.system.arrays()[2] == pytest.approx(np.array([[3 + k, -k], [-k, k]]))


def test_joined_arrays_are_seated_anew_by_friction():
    """As `assemble` joins them at the friction of each condition."""
    nodes = [1, 1]
    ways = [0, 2]
    disc = squeal.System(np.eye(2), np.diag([0.1, 0.3]), np.diag([90.0, 110.0]), name="disc")
    pad = squeal.System(np.eye(2), np.diag([0.1, 0.3]), [[90.0, 3.0], [3.0, 110.0]], name="pad")
    bodies = [
        squeal.Component(disc, nodes, ways),
        squeal.Component(pad, nodes, ways, load=[0.0, -6.0]),
    ]
    touch = squeal.Contact(
        ("disc", "pad"), [(1, 1)], (0, 0, 1), stiffness=60.0, sliding=(1, 0, 0), exponent=0.5
    )
    found = squeal.conditions(squeal.assemble(bodies, [touch]), {"mu": [0.0, 0.5, 1.5]})
    for one in found.conditions:
        plain = squeal.assemble(bodies, [touch], one.parameters)
        M, C, K = plain.system.arrays()
        roots = roots_by_companion(M, C, K)
        assert one.worst.growth_rate == pytest.approx(roots.real.max(), rel=1e-6)
        assert one.unstable == np.count_nonzero(roots.real > 1e-9)


def test_a_pad_agrees_with_a_plain_loop_of_eigenvalues():
    axes = {"mu": [0.2, 0.6], "F_n": [2000.0], "k1": [1.9e7, 2.1e7]}
    found = squeal.conditions(PAD, axes)
    assert len(found.conditions) == 4
    for one in found.conditions:
        plain = squeal.eigenvalues(PAD.replace(**one.parameters))
        assert (one.verdict, one.unstable) == (plain.verdict, len(plain.unstable))
        for mode, reference in zip(one.modes, plain.unstable, strict=True):
            assert mode.growth_rate == pytest.approx(reference.growth_rate, rel=1e-9)
            assert mode.frequency_hz == pytest.approx(reference.frequency_hz, rel=1e-9)


def test_conditions_without_an_answer_are_named_and_no_share():
    """Without springs nothing holds a pad, so that it does not slide steadily."""
    scene = squeal.read_scene(SCENES / "b2-c.yaml").replace(k2=0.0)
    found = squeal.conditions(scene, {"k1": [0.0, scene.pad.k1]})
    lost, known = found.conditions
    assert (lost.verdict, lost.unstable) == (None, None)
    assert "no steady sliding exists" in lost.reason
    assert found.solved == 1
    assert found.propensity in (0.0, 1.0)
    assert known.unstable == found.unstable
    first = "conditions: 1 of 2 conditions, the first of them k1 = 0, have no answer: no steady"
    assert found.warnings[0].startswith(first)


REFUSED = [
    ({}, "conditions: axes: none is given; at least one parameter with its values is required"),
    ({"speed": [1.0]}, "conditions: axes: speed is no parameter here; allowed are mu, gap"),
    ({"gap": [1.0, 1.0]}, "conditions: axes: gap has a value twice; each value is allowed once"),
    (
        {"unused": [1.0]},
        "unused is not allowed, no matrix depends on it; allowed are gap",
    ),
    ({"gap": []}, "conditions: axes.gap: [] is not allowed; it must be a sequence"),
    ({"gap": ["a"]}, "conditions: axes.gap.1: 'a' is not allowed; it must be a finite number"),
    ({"gap": range(1000), "mu": range(1000)}, "1000000 conditions are not allowed; it must be at"),
]


@pytest.mark.parametrize(("axes", "words"), REFUSED)
@pytest.mark.filterwarnings("ignore:.*no matrix depends on")
def test_what_is_no_axis_is_refused(axes, words):
    K = {"1": np.eye(2), "gap": np.eye(2), "mu": np.eye(2)}
    given = {"gap": 0.5, "mu": 0.0}
    if "unused" in axes:
        given["unused"] = 1.0
    system = squeal.System(np.eye(2), K=K, parameters=given)
    with pytest.raises(InputError) as refusal:
        squeal.conditions(system, axes)
    assert words in str(refusal.value)


def test_a_large_system_needs_a_band_and_a_pad_takes_none():
    with pytest.raises(InputError, match="band: is missing"):
        squeal.conditions(solid_brake(500, around=60).system, {"mu": [0.1]})
    with pytest.raises(InputError, match="band: is not allowed with a scene"):
        squeal.conditions(PAD, {"mu": [0.1]}, band=(0.0, 1.0))
    with pytest.raises(InputError, match=r"conditions: k1 = -1: Pad: k1: -1\.0 is not allowed"):
        squeal.conditions(PAD, {"k1": [1e7, -1.0]})


def test_the_command_prints_writes_and_draws_the_same(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["example", "pad"]) == 0
    capsys.readouterr()
    typed = ["conditions", "pad.yaml", "--axis", "mu=0.2:0.4:3", "--axis", "alpha1=0.5*pi,1.6"]
    files = ["--table", "conditions.csv", "--figure", "conditions.svg"]
    assert main([*typed, *files, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["axes"][1] == {"name": "alpha1", "values": [np.pi / 2, 1.6]}
    assert answer["axes"][0]["values"] == pytest.approx([0.2, 0.3, 0.4])
    pad = squeal.read_scene("pad.yaml")
    found = squeal.conditions(pad, {one["name"]: one["values"] for one in answer["axes"]})
    assert answer["conditions"] == found.to_dict()["conditions"]
    assert answer["modes"][0]["propensity"] == found.modes[0].propensity
    assert {"provenance", "admissible", "warnings"} <= answer.keys()
    head, *lines = (tmp_path / "conditions.csv").read_text().splitlines()
    assert head.startswith("mu,alpha1,verdict,unstable,mode,frequency_hz,growth_rate [1/s]")
    assert len(lines) == 6
    assert "Matrix of operating conditions of pad.yaml" in (tmp_path / "conditions.svg").read_text()


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (["mu"], "--axis mu: is not allowed; it must be NAME=A:B:N or NAME=A,B,... with finite"),
        (["mu=1:0:3"], "--axis mu=1:0:3: is not allowed; it must be A:B:N with A < B and a whole"),
        (["mu=0.1,x"], "--axis mu=0.1,x: is not allowed; it must be NAME=A:B:N or NAME=A,B,..."),
        (["mu=0.1", "mu=0.2"], "--axis mu=0.2: mu is given already; each axis is allowed once"),
        ([], "the following arguments are required: --axis"),
        (["weight=1"], "conditions: axes: weight is no parameter here; allowed are m, w, h"),
    ],
)
def test_the_command_refuses_in_one_sentence(axes, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["example", "pad"])
    capsys.readouterr()
    typed = [part for axis in axes for part in ("--axis", axis)]
    assert main(["conditions", "pad.yaml", *typed]) == 2
    assert words in capsys.readouterr().err


def test_what_is_open_is_not_said_to_be_stable():
    row = ModeAtCondition(100.0, -0.1, 1e-4, grows=False)
    for verdict, words in (
        ("stable", "No unstable mode at 1"),
        (None, "No unstable mode was found"),
    ):
        one = Condition({"mu": 0.3}, verdict, (row,))
        found = Conditions("brake", {"mu": (0.3,)}, (one,), tolerance=0.1)
        assert found.conclusion.startswith(words)
