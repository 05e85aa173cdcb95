"""Critical speeds against closed forms: Jeffcott, an overhung disc, higher orders, damping."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from scipy.sparse import csc_array, diags_array

import squeal
from squeal.cli.main import main
from squeal.errors import InputError, InputWarning
from squeal.examples.files import Size, write_example
from tests.queries.test_energy import rotor

DATA = Path(__file__).parents[1] / "data"
EYE = np.eye(2)
SPIN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def speeds(answer, direction):
    return [one.speed for one in answer.critical if one.direction == direction]


def shape_at(M, C, K, root):
    """The shape of the eigenvalue nearest to a root, by the first-order form."""
    n = len(M)
    inverse = np.linalg.inv(M)
    values, vectors = np.linalg.eig(
        np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
    )
    return vectors[:n, np.argmin(np.abs(values - root))]


def test_a_disc_has_bounce_and_backward_tilt_and_no_forward_one():
    """Bounce (k/m)^(1/2) twice, tilt (kt / (Jd + Jp))^(1/2) backward, and none where Jp > Jd."""
    m = 10.0
    k = 1e6
    Jd = 0.5
    Jp = 0.8
    kt = 4e4
    M = np.diag([m, m, Jd, Jd])
    G = np.zeros((4, 4))
    G[2:, 2:] = Jp * SPIN
    system = squeal.System(M, {"speed": G}, np.diag([k, k, kt, kt]), parameter="speed")
    answer = squeal.critical_speeds(system, 2000.0)
    assert speeds(answer, None) == pytest.approx([np.sqrt(k / m)] * 2, rel=1e-12)
    assert speeds(answer, "backward") == pytest.approx([np.sqrt(kt / (Jd + Jp))], rel=1e-12)
    assert not speeds(answer, "forward")
    rows = ((1, 1), (1, 2), (1, 4), (1, 5))  # no node moves where the disc tilts alone
    labelled = squeal.System(
        M, {"speed": G}, np.diag([k, k, kt, kt]), parameter="speed", labels=rows
    )
    named = squeal.critical_speeds(labelled, 2000.0).critical
    assert [one.direction for one in named] == [one.direction for one in answer.critical]


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 3.0])
def test_a_thin_rotor_tilts_at_the_speeds_of_the_closed_form_of_any_order(order):
    """n^2 Jd W^2 -+ n Jp W^2 = kt: forward and backward, for Jp < n Jd."""
    Jd = 0.8
    Jp = 0.3
    kt = 500.0
    system = squeal.System(Jd * EYE, {"speed": Jp * SPIN}, kt * EYE, parameter="speed")
    answer = squeal.critical_speeds(system, 200.0, orders=(order,))
    forward = np.sqrt(kt / (order**2 * Jd - order * Jp))
    backward = np.sqrt(kt / (order**2 * Jd + order * Jp))
    assert speeds(answer, "forward") == pytest.approx([forward], rel=1e-12)
    assert speeds(answer, "backward") == pytest.approx([backward], rel=1e-12)


@pytest.mark.parametrize("low", [0.0, 1.0, 0.5])
@pytest.mark.parametrize("high", [2.0, 4.0, 8.0, 3.0])
def test_a_speed_at_which_the_diagram_is_drawn_is_listed_once(low, high):
    """Frequencies 1, 2 and 2, to the last digit, at values of the diagram or at its ends."""
    system = squeal.System(
        np.eye(3), {"speed": np.zeros((3, 3))}, np.diag([1.0, 4.0, 4.0]), parameter="speed"
    )
    found = squeal.critical_speeds(system, high, low).critical
    assert [one.speed for one in found] == [1.0, 2.0, 2.0]


@pytest.mark.parametrize("kt", range(1, 13))
def test_a_critical_speed_at_an_end_of_the_range_is_listed(kt):
    """Backward tilt at (kt / (Jd + Jp))^(1/2): rounding of the root may put it outside."""
    system = squeal.System(EYE, {"speed": 2.0 * SPIN}, kt * EYE, parameter="speed")
    backward = float(np.sqrt(kt / 3.0))
    for low, high in ((backward, 2.0 * backward), (0.0, backward)):
        answer = squeal.critical_speeds(system, high, low)
        assert speeds(answer, "backward") == pytest.approx([backward], rel=1e-9)


def test_a_frequency_that_rises_from_rest_meets_the_speed():
    """(2 - W)^2 damping: overdamped up to near W = 2, where the pair has the frequency k^(1/2)."""
    k = 4.04
    system = squeal.System([[1.0]], {"40 * (2 - speed)": [[1.0]]}, [[k]], parameter="speed")
    # Im^2 = k - (20 (2 - W))^2 = W^2 in exact numbers: 401 W^2 - 1600 W + 1600 - k = 0
    exact = np.sort(np.roots([401.0, -1600.0, 1600.0 - k]).real)
    answer = squeal.critical_speeds(system, 2.2)
    assert [one.speed for one in answer.critical] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("ratio", [2.0, 1.7])
def test_a_frequency_that_is_the_multiple_at_all_speeds_is_warned_of(ratio):
    """A free disc tilts with Jp / Jd times the speed; rounding gave hundreds of crossings."""
    G = np.zeros((3, 3))
    G[:2, :2] = ratio * SPIN
    K = np.diag([0.0, 0.0, 49.3])
    disc = squeal.System(np.eye(3), {"speed": G}, K, parameter="speed", name="disc")
    with pytest.warns(InputWarning, match=f"disc: over a range .* {ratio:g} times"):
        answer = squeal.critical_speeds(disc, 20.0, orders=(1.0, ratio))
    assert [one.speed for one in answer.critical] == pytest.approx([np.sqrt(49.3)], rel=1e-12)
    assert "a multiple that a mode touches" in str(answer)


def test_an_overhung_disc_has_the_speeds_of_stodola_and_green():
    """Bending of a cantilever couples translation and tilt of the disc: the determinant in W^2."""
    EI = 5e4
    length = 0.6
    m = 20.0
    Jd = 0.3
    Jp = 0.55
    own = EI / length**3 * np.array([[12, -6 * length], [-6 * length, 4 * length**2]])
    K = scipy.linalg.block_diag(own, own)
    G = np.zeros((4, 4))
    G[1, 3] = Jp
    G[3, 1] = -Jp
    M = np.diag([m, Jd, m, Jd])
    answer = squeal.critical_speeds(squeal.System(M, {"speed": G}, K, parameter="speed"), 2000.0)
    for way, sign in (("forward", 1.0), ("backward", -1.0)):
        # in the turning coordinate q1 + i q2 whirl at the speed sees the inertia Jd - s Jp
        squares = scipy.linalg.eigvals(own, np.diag([m, Jd - sign * Jp])).real
        exact = np.sort(np.sqrt(squares[(squares > 0.0) & np.isfinite(squares)]))
        assert speeds(answer, way) == pytest.approx(exact[exact < 2000.0], rel=1e-10), way


def test_damping_meets_the_speed_at_the_damped_frequency():
    """Im lambda = W: (k/m - (c/2m)^2)^(1/2), with its damping ratio."""
    k = 900.0
    c = 6.0
    system = squeal.System([[1.0]], [[c]], {"1": [[k]], "0 * speed": [[0.0]]}, parameter="speed")
    (one,) = squeal.critical_speeds(system, 100.0).critical
    assert one.speed == pytest.approx(np.sqrt(k - c * c / 4), rel=1e-12)
    assert one.damping_ratio == pytest.approx(c / 2 / np.sqrt(k), rel=1e-12)
    assert one.growth_rate == pytest.approx(-c / 2, rel=1e-12)


def test_a_rotor_of_ross_meets_its_own_roots():
    """At each critical speed i n W is a root, to rounding but for the damping, by a determinant."""
    system = rotor()
    answer = squeal.critical_speeds(system, 900.0, orders=(1.0, 2.0))
    assert answer.critical
    for one in answer.critical:
        M, C, K = system.arrays({"speed": one.speed})
        z = one.growth_rate + 1j * one.order * one.speed
        sizes = np.linalg.svd(z * z * M + z * C + K, compute_uv=False)
        assert sizes[-1] < 1e-9 * np.linalg.norm(K, 2)


@pytest.fixture
def counts_as_large(monkeypatch):
    """What more than 40 rows are treated as; a diagram has fewer speeds."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)
    monkeypatch.setattr("squeal.queries.critical_speeds.STEPS", 50)


@pytest.mark.usefixtures("counts_as_large")
def test_a_large_rotor_is_reduced():
    n = 60
    M = diags_array([1.0] * n).tocsc()
    K = diags_array(np.arange(1.0, n + 1.0) ** 2).tocsc()
    G = csc_array((n, n))
    system = squeal.System(M, {"speed": G}, K, parameter="speed")
    answer = squeal.critical_speeds(system, 5.5, band=(0.1, 1.0))
    assert [one.speed for one in answer.critical] == pytest.approx([1, 2, 3, 4, 5], rel=1e-9)


@pytest.mark.usefixtures("counts_as_large")
def test_a_reduced_rotor_has_the_crossings_of_its_band_alone():
    """Of w^2 - W^2 = -+ 0.2 speed W, so at w / 1.2^(1/2) and at w / 0.8^(1/2), beside many modes
    below and above the band, which the reduced system holds by halves."""
    w = np.concatenate([np.linspace(20.0, 150.0, 12), [210.0, 222.0], np.linspace(400, 4000, 40)])
    G = scipy.sparse.kron(scipy.sparse.eye_array(len(w)), 0.2 * SPIN, format="csc")
    M = scipy.sparse.eye_array(2 * len(w), format="csc")
    K = diags_array(np.repeat(w**2, 2)).tocsc()
    system = squeal.System(M, {"speed": G}, K, parameter="speed")
    answer = squeal.critical_speeds(system, 260.0, 180.0, band=(30.0, 41.0))
    backward = np.array([210.0, 222.0]) / np.sqrt(1.2)
    forward = np.array([210.0, 222.0]) / np.sqrt(0.8)
    exact = np.sort(np.concatenate([backward, forward]))
    assert [one.speed for one in answer.critical] == pytest.approx(exact, rel=1e-9)
    for one in answer.critical:
        spread = np.sqrt((0.1 * one.speed) ** 2 + w**2)
        whirls = np.concatenate([spread - 0.1 * one.speed, spread + 0.1 * one.speed])
        below = (whirls > 30.0 * 2 * np.pi) & (whirls < one.speed * (1 - 1e-9))
        assert one.mode == 1 + np.count_nonzero(below)


def test_the_example_has_the_directions_of_its_orbits(tmp_path):
    """Between bearings of two stiffnesses both first whirls are nearly straight, by numpy."""
    write_example("rotor", tmp_path, Size())
    found = squeal.critical_speeds(squeal.read_system(tmp_path / "rotor" / "rotor.yaml"), 900.0)
    system = rotor()
    for one in found.critical:
        root = one.growth_rate + 1j * one.speed
        M, C, K = system.arrays({"speed": one.speed})
        shape = shape_at(M, C, K, root)
        assert abs(roundness(shape[0::6], shape[1::6])).max() < 0.01
    assert [one.direction for one in found.critical] == ["straight", "straight"]


def roundness(x, y):
    """The area of orbits over that of a circle as large, positive from x to y."""
    return 2.0 * (x * y.conj()).imag / (abs(x) ** 2 + abs(y) ** 2)


BAD_ORDERS = ("0", "3:1", "0:2", "1:1e9", "1:2:3", "1:2,3", "nan:2", "0.5:2", "2:2.5")


@pytest.mark.parametrize(
    ("typed", "orders"),
    [("1:3", [1, 2, 3]), ("2", [2]), ("2:2", [2]), ("0.5:1.5", [0.5, 1.5])],
)
def test_orders_are_one_or_a_range(tmp_path, capsys, typed, orders):
    (tmp_path / "mass.yaml").write_text(
        "parameter: speed\nM: [[1]]\nK: [[4]]\nC: [{matrix: [[1]], factor: speed}]\n"
    )
    command = ["critical-speeds", str(tmp_path / "mass.yaml"), "--max", "9", "--orders", typed]
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["orders"] == orders


def test_the_command_prints_and_draws_and_refuses(tmp_path, capsys):
    text = (
        "parameter: speed\nM: [[1, 0], [0, 1]]\nC: [{matrix: [[0, 2], [-2, 0]], factor: speed}]\n"
    )
    (tmp_path / "tilt.yaml").write_text(text + "K: [[12, 0], [0, 12]]\n")
    file = str(tmp_path / "tilt.yaml")
    figure = tmp_path / "campbell.svg"
    command = ["critical-speeds", file, "--max", "20", "--orders", "1:2", "--json"]
    assert main([*command, "--figure", str(figure)]) == 0
    rows = json.loads(capsys.readouterr().out)["critical_speeds"]
    # n^2 W^2 + 2 n W^2 = 12, and forward whirl at order 2 is met where 4 - 4 = 0: never
    assert [row["speed"] for row in rows] == pytest.approx([np.sqrt(1.5), 2.0])
    assert "<svg" in figure.read_text()
    for wrong in (["--max", "0"], *(["--max", "5", "--orders", text] for text in BAD_ORDERS), []):
        assert main(["critical-speeds", file, *wrong]) == 2
    with pytest.raises(InputError, match="real matrices"):
        squeal.critical_speeds(squeal.System([[1.0]], K=[[1.0 + 1j]]), 2.0)


def test_the_documented_rotor_of_ross_has_its_printed_speeds():
    """ROSS prints 92, 96, 271 and 300 rad/s for six shaft elements, two discs and two bearings."""
    data = json.loads((DATA / "documented_rotor.json").read_text(encoding="utf-8"))
    whole = {}
    for name, entries in data["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        shape = (data["rows"],) * 2
        whole[name] = csc_array((values, (rows, columns)), shape=shape).toarray()
    system = squeal.System(whole["M"], {"speed": whole["G"]}, whole["K"], parameter="speed")
    found = squeal.critical_speeds(system, 400.0).critical
    assert [one.speed for one in found] == pytest.approx(data["critical_speeds"], rel=1e-8)
    assert [round(one.speed) for one in found] == [92, 96, 271, 300]
    # as the orbits of the nodes say, which M, K and G give with numpy alone
    turns = []
    for one in found:
        shape = shape_at(whole["M"], one.speed * whole["G"], whole["K"], 1j * one.speed)
        x, y = shape[0::4], shape[1::4]
        moves = np.abs(x) ** 2 + np.abs(y) ** 2 > 1e-6 * np.max(np.abs(x) ** 2 + np.abs(y) ** 2)
        round_enough = roundness(x, y)[moves]
        senses = set(np.sign(round_enough[abs(round_enough) > 0.1])) or {0.0}
        assert len(senses) == 1
        turns.append({1.0: "forward", -1.0: "backward", 0.0: "straight"}[senses.pop()])
    # the term sees how discs tilt: without labels it names what is nearly straight, too
    assert [one.direction for one in found][2:] == turns[2:] == ["backward", "forward"]
    labels = tuple((node, freedom) for node in range(7) for freedom in (1, 2, 4, 5))
    labelled = squeal.System(
        whole["M"], {"speed": whole["G"]}, whole["K"], parameter="speed", labels=labels
    )
    assert [one.direction for one in squeal.critical_speeds(labelled, 400.0).critical] == turns
    for speed, frequencies in data["frequencies"].items():
        roots = squeal.eigenvalues(system, at=float(speed), modes=4).eigenvalues
        assert [root.value.imag for root in roots] == pytest.approx(frequencies, rel=1e-8)


@pytest.mark.usefixtures("coarse_charts")
def test_the_example_has_the_critical_speeds_and_the_limit_of_ross(tmp_path):
    """ROSS 2.3.0: `run_critical_speed`, and Brent's method on the largest real part of its roots
    from 10 to 1000 Hz, of the rotor of `tests/data/rotor.py` with 0.4 of its cross-coupling."""
    write_example("rotor", tmp_path, Size())
    report = squeal.report(
        squeal.read_system(tmp_path / "rotor" / "rotor.yaml"), 900.0, band=(10.0, 1000.0)
    )
    expected = [524.11919834, 533.96260738]
    assert speeds(report.critical, "straight") == pytest.approx(expected, rel=1e-9)
    assert report.thresholds.first.mu == pytest.approx(14.99495882, rel=1e-9)
    assert "(143.1 rpm): forward whirl begins to grow at 262.5 Hz" in report.loss


def test_a_mass_that_vanishes_at_one_speed_is_refused():
    """Its motion has no finite root there, and two at other speeds."""
    mass = {"1": np.diag([1.0, 0.0]), "speed": np.diag([0.0, 1e-3])}
    gyroscopic = {"speed": [[0.0, 2.0], [-2.0, 0.0]]}
    system = squeal.System(mass, gyroscopic, np.diag([12.0, 12.0]), parameter="speed")
    with pytest.raises(InputError, match="singular at all speeds of the range, or at none"):
        squeal.critical_speeds(system, 20.0)
    assert squeal.critical_speeds(system, 20.0, low=1.0).speeds[0] == 1.0


@pytest.mark.parametrize(
    ("running", "ratio", "is_near"),
    [
        (110.0, 0.001, True),  # 9.1 % below, 17 % required
        (125.0, 0.001, False),  # 20 % below
        (85.0, 0.001, True),  # 17.6 % above, 27 % required
        (75.0, 0.001, False),  # 33 % above
        (105.0, 0.25, False),  # so well damped that no peak is left
    ],
)
def test_critical_speeds_are_judged_by_the_margin_of_the_standard(running, ratio, is_near):
    """A Jeffcott rotor of 100 rad/s."""
    damping = {"1": 200.0 * ratio * np.eye(2), "speed": 1e-9 * np.array([[0.0, 1.0], [-1.0, 0.0]])}
    rotor = squeal.System(np.eye(2), damping, 1e4 * np.eye(2), {"speed": running}, "speed")
    found = squeal.critical_speeds(rotor, 300.0)
    assert found.critical
    for row in found.table().records():
        assert row["margin"] == pytest.approx(row["speed"] / running - 1.0)
    words = f"nearer to {running:g} rad/s than API 617 allows: none"
    assert (words in str(found)) != is_near


def test_a_wave_that_stands_still_has_no_critical_speed_of_order_0():
    """A disc in the fixed frame: its backward wave, 3 - 2 Omega, stands still at Omega = 1.5."""
    C = {"4 * Omega": [[0, 1], [-1, 0]]}
    disc = squeal.System(np.eye(2), C, {"9 - 4 * Omega**2": np.eye(2)}, parameter="Omega")
    with pytest.raises(InputError, match=r"orders: .* of order 0 are standing waves"):
        squeal.critical_speeds(disc, 3.0, orders=(0.0,))
    frequencies = np.abs(squeal.sweep(disc, [1.0, 1.5, 2.0]).steps[1].roots.imag)
    assert sorted(frequencies) == pytest.approx([0.0, 0.0, 6.0, 6.0], abs=1e-6)


def test_growth_below_rounding_of_a_root_is_zero():
    """A shaft without damping: every root lies on the imaginary axis, rounding moves it aside."""
    C = {"2 * Omega": [[0, 1], [-1, 0]]}
    K = {"1": [[1, 0], [0, 1.7]], "Omega**2": [[-1, 0], [0, -1]]}
    shaft = squeal.System(np.eye(2), C, K, parameters={"Omega": 1.3}, parameter="Omega")
    for mode in squeal.critical_speeds(shaft, 5.0).critical:
        assert (mode.growth_rate, mode.damping_ratio) == (0.0, 0.0)
    speeds = np.linspace(0.0, 0.9, 40).tolist()
    for condition in squeal.conditions(shaft, {"Omega": speeds}).conditions:
        assert {(row.growth_rate, row.damping_ratio) for row in condition.rows} == {(0.0, 0.0)}


@pytest.mark.parametrize("highest", [1e4, 1e8, 1e12])
def test_no_fast_mode_hides_a_critical_speed_of_a_slow_one(highest, recwarn):
    """Frequencies of 100 and highest^(1/2) rad/s, which hardly change with the speed."""
    C = {"Omega": [[0.0, 1e-6], [-1e-6, 0.0]]}
    rotor = squeal.System(np.eye(2), C, np.diag([1e4, highest]), parameter="Omega")
    speeds = [row["speed"] for row in squeal.critical_speeds(rotor, 100.1, 99.9).to_records()]
    assert speeds == pytest.approx([100.0] * len(speeds), abs=1e-4)
    assert len(speeds) == 1 + (highest == 1e4)
    assert not recwarn
