"""What feeds a mode: closed forms, work integrated over a cycle, differences of each factor."""

import json
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg
from scipy.io import savemat
from scipy.sparse import csc_array, diags_array

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.examples.brake import solid_brake
from squeal.io.system import SystemFile
from squeal.linear.moduli import Tabulated
from squeal.linear.terms import Term
from squeal.numerics.differentiation import ONE
from squeal.queries.energy import named_terms, pad_terms
from squeal.results.sources import PadSource
from tests.conftest import ROOT
from tests.known import system_of

ROTOR = json.loads((ROOT / "squeal" / "examples" / "rotor.json").read_text("utf-8"))
EYE = np.eye(2)
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
STIFF = np.diag([100.0, 120.0])


def roots_by_companion(M: Any, C: Any, K: Any) -> np.ndarray:
    """All eigenvalues, by another form than the package's, in a unit of time that balances it."""
    n = len(M)
    rate = np.sqrt(np.linalg.norm(K, 2) / np.linalg.norm(M, 2))
    zero = np.zeros((n, n))
    eye = np.eye(n)
    A = np.block([[zero, eye], [-K / rate**2, -C / rate]])
    B = np.block([[eye, zero], [zero, M]])
    return rate * scipy.linalg.eigvals(A, B)


def brake(sparse=False):
    """Friction, friction damping, damping of one block, and a gyroscopic term."""
    K1 = np.array([[0.0, 40.0], [-30.0, 5.0]])
    matrices = {"1": np.diag([0.5, 0.2]), "0.3 * mu": np.array([[0.2, 0.1], [0.0, 0.4]])}
    matrices["speed"] = TURN
    K = {"1": STIFF, "mu": K1}
    if sparse:
        matrices = {key: csc_array(X) for key, X in matrices.items()}
        K = {key: csc_array(X) for key, X in K.items()}
    given = {"mu": 0.8, "speed": 0.3}
    return squeal.System(EYE, matrices, K, parameters=given, name="brake")


def rotor():
    whole = {}
    for name, entries in ROTOR["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        shape = (ROTOR["rows"],) * 2
        whole[name] = csc_array((values, (rows, columns)), shape=shape).toarray()
    cross = (whole["K"] - whole["K"].T) / 2
    C = {"1": whole["C"], "speed": whole["G"]}
    K = {"1": whole["K"] - cross, "cross": cross}
    at = {"speed": 300.0, "cross": 0.4}
    return squeal.System(whole["M"], C, K, parameters=at, parameter="speed")


def test_damping_that_turns_with_a_shaft_is_no_friction():
    """Of a Jeffcott rotor internal damping c puts in c speed / (2 w) beside what it takes."""
    internal = 1.5
    external = 0.8
    stiffness = 1e4
    speed = 50.0
    C = (internal + external) * EYE
    K = {"1": stiffness * EYE, f"{internal} * speed": TURN}
    jeffcott = squeal.System(EYE, C, K, parameters={"speed": speed}, parameter="speed")
    roles = {term.name: term.role for term in named_terms(jeffcott, SystemFile(jeffcott))}
    assert roles[f"{internal} * speed"] == "circulatory"


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_term_of_friction_is_friction_whatever_the_coefficient_is(mu):
    K = {"1": STIFF, "mu": [[0.0, 1.0], [0.0, 0.0]]}
    system = squeal.System(EYE, K=K, parameters={"mu": mu})
    roles = [term.role for term in named_terms(system, SystemFile(system))]
    assert roles == ["mass", "stiffness", "friction"]


def joined():
    """Two blocks of two coordinates each, one pressed on the other and dragged by friction."""
    nodes = [1, 1]
    ways = [0, 2]
    M = EYE
    K = np.diag([90.0, 110.0])
    C = np.diag([0.1, 0.3])
    one = squeal.Component(squeal.System(M, C, K, name="disc"), nodes, ways)
    own = squeal.System(M, C, K + [[0, 3], [3, 0]], name="pad")
    other = squeal.Component(own, nodes, ways, load=[0.0, -6.0])
    touch = squeal.Contact(("disc", "pad"), [(1, 1)], (0, 0, 1), stiffness=60.0, sliding=(1, 0, 0))
    return squeal.assemble([one, other], [touch], {"mu": 0.9})


@pytest.mark.parametrize("subject", [brake(), brake(sparse=True), rotor(), joined()])
def test_terms_sum_to_each_root_and_agree_with_differences_of_their_factors(subject):
    found = squeal.eigenvalues(subject)
    answer = squeal.energy(found)
    file = subject if not isinstance(subject, squeal.Assembly) else None
    system = subject.system if file is None else subject
    terms = named_terms(system, SystemFile(system))
    base = {part: np.zeros((system.n, system.n)) for part in "MCK"}
    dense = []
    for term in terms:
        X = np.asarray(term.matrix.todense() if hasattr(term.matrix, "todense") else term.matrix)
        dense.append(term.factor * X)
        base[term.part] = base[term.part] + dense[-1]
    size = np.abs(found.values).max()
    for mode in answer.modes:
        rows = [row for row in answer.contributions if row.mode == mode]
        if rows[0].growth is None:
            continue
        assert sum(row.growth for row in rows) == pytest.approx(
            rows[0].growth_rate, abs=1e-10 * size
        )
        frequencies = sum(row.frequency for row in rows)
        assert frequencies == pytest.approx(rows[0].frequency_hz, rel=1e-8)
        root = rows[0].growth_rate + 2j * np.pi * rows[0].frequency_hz
        step = 1e-5
        for row, term, X in zip(rows, terms, dense, strict=True):
            moved = []
            for sign in (1, -1):
                changed = base | {term.part: base[term.part] + sign * step * X}
                roots = roots_by_companion(*(changed[part] for part in "MCK"))
                moved.append(roots[np.argmin(abs(roots - root))])
            slope = (moved[0] - moved[1]) / (2 * step)
            near = 1e-7 * abs(root)
            assert 100 * row.d_real == pytest.approx(slope.real, rel=1e-4, abs=near), row
            turned = 100 * row.d_hz * 2 * np.pi
            assert turned == pytest.approx(slope.imag, rel=1e-4, abs=near), row


def root_near(parts, root):
    """The root of sparse matrices nearest to a value, of large ones by inverse iteration and
    Newton's method: no derivative of the package."""
    x = y = np.ones(parts["M"].shape[0], complex)
    if parts["M"].shape[0] < 10:
        roots = roots_by_companion(*(parts[part].toarray() for part in "MCK"))
        return roots[np.argmin(abs(roots - root))]
    value = root
    for _ in range(8):
        P = csc_array(value**2 * parts["M"] + value * parts["C"] + parts["K"])
        factor = scipy.sparse.linalg.splu(P)
        for _ in range(3):
            x = factor.solve(x)
            x = x / np.linalg.norm(x)
            y = factor.solve(y, "H")
            y = y / np.linalg.norm(y)
        slope = y.conj() @ ((2 * value * parts["M"] + parts["C"]) @ x)
        step = (y.conj() @ (P @ x)) / slope
        value = value - step
        if abs(step) < 1e-13 * abs(value):
            break
    return value


def solids():
    system = solid_brake(500, around=60).system
    found = squeal.eigenvalues(system, band=(6000.0, 7000.0))
    return found, named_terms(system, SystemFile(system))


def damped_pad():
    scene = squeal.read_scene(ROOT / "workflow" / "scenes" / "b2-c.yaml")
    damping = squeal.Damping(ratios=(0.02, 0.02, 0.02))
    found = squeal.eigenvalues(scene.replace(damping=damping), at=0.4)
    assert isinstance(found.source, PadSource)
    return found, pad_terms(found.source.scene.replace(mu=0.4), found.source.analysis)


@pytest.mark.parametrize("subject", [damped_pad, solids])
def test_terms_of_the_pad_and_of_the_brake_of_solids_agree_with_differences(subject):
    found, terms = subject()
    matrices = [csc_array(term.factor * term.matrix) for term in terms]
    size = matrices[0].shape
    base = {part: csc_array(size) for part in "MCK"}
    for term, X in zip(terms, matrices, strict=True):
        base[term.part] = base[term.part] + X
    answer = squeal.energy(found)
    for mode in answer.modes[:2]:
        rows = [row for row in answer.contributions if row.mode == mode]
        root = rows[0].growth_rate + 2j * np.pi * rows[0].frequency_hz
        assert sum(row.growth for row in rows) == pytest.approx(root.real, abs=1e-10 * abs(root))
        assert sum(row.frequency for row in rows) == pytest.approx(root.imag / 2 / np.pi, rel=1e-7)
        step = 1e-5
        for row, term, X in zip(rows, terms, matrices, strict=True):
            moved = []
            for sign in (1, -1):
                changed = base | {term.part: base[term.part] + sign * step * X}
                moved.append(root_near(changed, root))
            slope = (moved[0] - moved[1]) / (2 * step)
            near = 1e-6 * abs(root)
            assert 100 * row.d_real == pytest.approx(slope.real, rel=1e-4, abs=near), row
            turned = 100 * row.d_hz * 2 * np.pi
            assert turned == pytest.approx(slope.imag, rel=1e-4, abs=near), row


def test_growth_is_the_work_of_a_cycle_over_twice_the_stored_energy():
    """Integrated over one period of the motion itself, freed of its growth."""
    found = squeal.eigenvalues(brake())
    rows = squeal.energy(found).contributions
    root = next(e for e in found.eigenvalues if e.value.imag > 0 and e.value.real > 0)
    mode = next(k for k, e in found.of_modes if e is root)
    period = 2 * np.pi / root.value.imag
    t = np.arange(400) * period / 400
    # x exp(lambda t) at sigma = 0 of the envelope: what grows multiplies all energies alike
    q = (root.right[:, None] * np.exp(1j * root.value.imag * t)).real
    v = (root.value * root.right[:, None] * np.exp(1j * root.value.imag * t)).real

    def mean(X, left, right):
        return float(np.mean(np.sum(left * (X @ right), axis=0)))

    K1 = np.array([[0.0, 40.0], [-30.0, 5.0]])
    C1 = np.array([[0.2, 0.1], [0.0, 0.4]])
    friction = 0.8 * K1
    damping = np.diag([0.5, 0.2])
    symmetric = STIFF + (friction + friction.T) / 2
    twice = mean(EYE, v, v) + mean(symmetric, q, q)
    skew = (friction - friction.T) / 2
    works = {
        "mu": -mean(skew, v, q),
        "1": -mean(damping, v, v),
        "0.3 * mu": -mean(0.24 * C1, v, v),
        "speed": 0.0,
    }
    own = {row.term: row.growth for row in rows if row.mode == mode and row.growth}
    for name, work in works.items():
        assert own.get(name, 0.0) == pytest.approx(work / twice, abs=1e-12), name
    roles = {row.term: row.role for row in rows if row.part in "CK"}
    assert roles["mu"] == "friction"
    assert roles["0.3 * mu"] == "friction damping"
    assert roles["speed"] == "gyroscopic"


def test_the_energy_of_two_degrees_of_freedom_is_that_of_the_closed_form():
    """M = I, K = w I + mu TURN, C = c I: x = (1, -+ i), lambda^2 + c lambda + w -+ i mu = 0."""
    c = 0.3
    w = 50.0
    mu = 4.0
    system = system_of(EYE, ((EYE, "c"),), ((EYE, "w"), (TURN, "mu")), {"c": c, "w": w, "mu": mu})
    found = squeal.eigenvalues(system)
    answer = squeal.energy(found)
    for mode in answer.modes:
        rows = {row.term: row for row in answer.contributions if row.mode == mode}
        sigma = rows["c"].growth_rate
        omega = 2 * np.pi * rows["c"].frequency_hz
        square = sigma**2 + omega**2
        stored = 1 + w / square
        turn = 1.0 if sigma > -c / 2 else -1.0
        assert rows["c"].growth == pytest.approx(-c / stored, rel=1e-12)
        assert rows["mu"].growth == pytest.approx(turn * omega * mu / square / stored, rel=1e-9)
    growing = answer.sentence(answer.modes[0])
    assert "friction puts in 0.28" in growing
    assert "damping takes 0.1501 1/s" in growing


def test_a_pad_is_fed_by_friction_alone_and_a_divergence_by_no_cycle():
    scene = squeal.read_scene(ROOT / "workflow" / "scenes" / "b2-c.yaml")
    found = squeal.eigenvalues(scene, at=0.4)
    rows = [row for row in squeal.energy(found).contributions if row.mode == 2]
    fed = {row.term: row.growth for row in rows}
    assert fed["friction"] == pytest.approx(found.unstable[0].growth_rate, rel=1e-9)
    assert fed["springs and contact"] == pytest.approx(0.0, abs=1e-8)
    assert isinstance(found.source, PadSource)
    whole = {part: np.zeros((3, 3)) for part in "MCK"}
    for term in pad_terms(scene.replace(mu=0.4), found.source.analysis):
        whole[term.part] = whole[term.part] + term.matrix
    given = zip("MCK", found.source.analysis.matrices, strict=True)
    assert all(np.allclose(whole[part], X, rtol=1e-14) for part, X in given)
    column = squeal.System(EYE, K={"1": STIFF, "mu": -STIFF}, parameters={"mu": 1.5})
    answer = squeal.energy(squeal.eigenvalues(column))
    assert all(row.growth is None for row in answer.contributions)
    assert "does not oscillate" in answer.sentence(1)
    with pytest.raises(InputError, match=r"^mode: 3 is not allowed; it must be one of \[2, 1\]$"):
        answer.sentence(3)


def test_parts_share_what_the_terms_do():
    """By component of an assembly, and by given rows."""
    answer = squeal.energy(squeal.eigenvalues(joined()))
    for mode in answer.modes:
        shares = [row for row in answer.part_shares if row.mode == mode]
        assert [row.part for row in shares] == ["disc", "pad"]
        assert sum(row.energy for row in shares) == pytest.approx(1.0)
        rate = next(row.growth_rate for row in answer.contributions if row.mode == mode)
        assert sum(row.growth for row in shares) == pytest.approx(rate, abs=1e-9)
    apart = squeal.System(EYE, np.diag([0.2, 0.0]), STIFF)  # two blocks that know nothing of it
    answer = squeal.energy(squeal.eigenvalues(apart), parts={"one": [0], "other": [1]})
    known = {(row.mode, row.part): (row.energy, row.growth) for row in answer.part_shares}
    assert known[1, "one"] == pytest.approx((1.0, -0.1))
    assert known[2, "other"] == pytest.approx((1.0, 0.0))
    with pytest.raises(InputError, match="one: is not allowed; it must be rows from 0 to 1"):
        squeal.energy(squeal.eigenvalues(apart), parts={"one": [2]})


def test_a_row_that_a_part_names_twice_counts_once():
    """Also of another part: each mode stores all of its energy in the rows of both."""
    found = squeal.eigenvalues(squeal.System(EYE, np.diag([0.2, 0.0]), STIFF))
    once = squeal.energy(found, parts={"one": [0, 1], "other": [1]})
    twice = squeal.energy(found, parts={"one": [0, 1, 0], "other": [1, 1]})
    assert twice.part_shares == once.part_shares
    assert [row.energy for row in once.part_shares if row.part == "one"] == pytest.approx([1.0] * 2)


def test_a_loss_factor_takes_half_of_itself_per_radian():
    """K (1 + i eta): lambda = i w (1 + i eta)^(1/2), and all of its decay is damping's."""
    eta = 0.02
    w2 = 100.0
    K = np.array([[w2 * (1 + 1j * eta)]])
    found = squeal.eigenvalues(squeal.System([[1.0]], K=K))
    (row,) = [row for row in squeal.energy(found).contributions if row.part == "K"]
    root = 1j * np.sqrt(w2 * (1 + 1j * eta))
    assert row.role == "damping"
    assert row.growth == pytest.approx(root.real, rel=1e-12)
    assert row.frequency == pytest.approx(root.imag / (2 * np.pi), rel=1e-12)


def test_frequency_shares_sum_to_the_frequency_where_stiffness_follows_it():
    """K (1 + omega / 10): its own derivative is what 1 % of it does at omega of the root."""
    K = np.array([[4.0, 0.8], [0.8, 20.0]])
    M = np.diag([1.0, 2.0])
    C = np.diag([0.2, 0.1])
    system = squeal.System(M, C, {"1 + omega / 10": K})
    found = squeal.eigenvalues(system, band=(0.0, 2.0))
    rows = squeal.energy(found).contributions

    def root_near(root, size):
        """The root of a stiffness of relative size `size`, at its own frequency."""
        for _ in range(100):
            roots = roots_by_companion(M, C, size * (1 + root.imag / 10) * K)
            root = roots[np.argmin(abs(roots - root))]
        return root

    for number, root in found.of_modes:
        of_mode = [row for row in rows if row.mode == number]
        shares = sum(row.frequency for row in of_mode)
        assert shares == pytest.approx(root.frequency_hz, rel=1e-8)
        slope = (root_near(root.value, 1 + 1e-5) - root_near(root.value, 1 - 1e-5)) / 2e-5
        (of_K,) = [row for row in of_mode if row.part == "K"]
        assert 100 * of_K.d_real == pytest.approx(slope.real, rel=1e-4)
        assert 100 * of_K.d_hz * 2 * np.pi == pytest.approx(slope.imag, rel=1e-6)


def swept(subject, values, **selection):
    """Contributions over a sweep by value and mode, and the answer."""
    answer = squeal.energy_sweep(squeal.sweep(subject, values, **selection))
    rows: dict[tuple[float, int], list[Any]] = {}
    for value, mode, row in answer.contributions:
        assert mode is not None
        rows.setdefault((value, mode), []).append(row)
    return rows, answer


def test_terms_over_a_sweep_sum_to_each_root_and_move_it_as_differences_say():
    """Of the sweep of friction: d lambda / d mu is what its terms do, over mu."""
    K1 = np.array([[0.0, 40.0], [-30.0, 5.0]])
    C1 = np.array([[0.06, 0.03], [0.0, 0.12]])

    def roots(mu):
        damping = np.diag([0.5, 0.2]) + 0.3 * TURN + mu * C1
        found = roots_by_companion(EYE, damping, STIFF + mu * K1)
        return found[found.imag > 0.0]

    values = [0.1, 0.2, 0.5, 0.8, 1.1]
    rows, _ = swept(brake(), values)
    assert {value for value, _ in rows} == set(values)
    for (mu, _), of_mode in rows.items():
        rate = of_mode[0].growth_rate
        assert sum(row.growth for row in of_mode) == pytest.approx(rate, abs=1e-10)
        root = rate + 2j * np.pi * of_mode[0].frequency_hz
        assert np.min(np.abs(roots(mu) - root)) < 1e-9
        nearest = [
            found[np.argmin(abs(found - root))] for found in (roots(mu + 1e-5), roots(mu - 1e-5))
        ]
        slope = (nearest[0] - nearest[1]) / 2e-5
        by_friction = sum(100 * row.d_real for row in of_mode if "mu" in row.term) / mu
        assert by_friction == pytest.approx(slope.real, rel=1e-5, abs=1e-6)


def test_a_mode_that_begins_without_oscillation_keeps_its_terms():
    """q'' - c q' + (mu - 1) q = 0 diverges below mu = 1, and is fed by its damper above."""
    c = 0.1
    one = squeal.System([[1.0]], [[-c]], {"1": [[-1.0]], "mu": [[1.0]]})
    found = squeal.energy_sweep(squeal.sweep(one, [0.5, 1.5, 2.0]))
    values, rates, terms = found.growth_of(1)
    real_root = c / 2 + np.sqrt((c / 2) ** 2 + 0.5)
    assert values == [0.5, 1.5, 2.0]
    assert rates == pytest.approx([real_root, c / 2, c / 2])
    assert terms["C: 1"] == pytest.approx([np.nan, c / 2, c / 2], nan_ok=True)


def test_parts_store_no_energy_of_a_mode_that_does_not_oscillate():
    overdamped = squeal.System([[1.0]], [[3.0]], [[1.0]])
    found = squeal.energy(squeal.eigenvalues(overdamped), parts={"mass": [0]})
    assert found.place(1) == ""


def test_a_sweep_without_modes_has_a_figure_that_says_so(tmp_path):
    chain = squeal.System(EYE, K={"1": STIFF, "mu": TURN})
    swept = squeal.sweep(chain, [0.0, 1.0], band=(100.0, 200.0))
    found = squeal.energy_sweep(swept)
    found.save(tmp_path / "none.svg")
    assert "no mode" in (tmp_path / "none.svg").read_text("utf-8")
    assert not found.plot(ax=found.plot()).get_lines()


def test_modes_have_the_numbers_of_the_sweep():
    """Two modes whose frequencies cross keep their numbers and their damping."""
    K = {"1": np.diag([100.0, 144.0]), "p": np.diag([100.0, 0.0])}
    system = squeal.System(EYE, np.diag([0.2, 0.6]), K, parameter="p")
    rows, answer = swept(system, [0.0, 0.2, 0.3, 0.6, 1.0])
    for (_, mode), of_mode in rows.items():
        assert sum(row.growth for row in of_mode) == pytest.approx({1: -0.1, 2: -0.3}[mode])
    values, rates, terms = answer.growth_of(1)
    assert (values, list(terms)) == ([0.0, 0.2, 0.3, 0.6, 1.0], ["C: 1"])
    assert rates == pytest.approx([-0.1] * 5)


def test_a_damped_pad_over_friction_has_the_terms_of_each_value(capsys, monkeypatch, tmp_path):
    """The terms of each value are those of `energy` there, and the command prints the same."""
    monkeypatch.chdir(tmp_path)
    assert main(["example", "pad"]) == 0
    capsys.readouterr()
    typed = ["eigenvalues", "pad.yaml", "--set", "damping.ratios=[0.02, 0.02, 0.02]"]
    assert main([*typed, "--sweep", "0.2:0.4:2", "--energy", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {row["mu"] for row in found["energy_sweep"]} == {0.2, 0.4}
    own = sorted((row["growth"], row["term"]) for row in found["energy"])
    last = [row for row in found["energy_sweep"] if row["mu"] == 0.4]
    same = sorted((row["growth"], row["term"]) for row in last)
    for (growth, term), (other, name) in zip(own, same, strict=True):
        assert term == name
        assert growth == pytest.approx(other, abs=1e-6)
    assert main([*typed, "--sweep", "0.2:0.4:2", "--energy"]) == 0
    text = capsys.readouterr().out
    assert "what each term does to mode 1 over mu, 1/s" in text


def test_a_sweep_of_a_large_brake_is_solved_on_the_full_system():
    rows, _ = swept(solid_brake(500, around=60).system, [0.3, 0.6], band=(6000.0, 7000.0))
    for of_mode in rows.values():
        rate = of_mode[0].growth_rate
        assert sum(row.growth for row in of_mode) == pytest.approx(rate, abs=1e-6)
    fastest = max(rows.values(), key=lambda of_mode: of_mode[0].growth_rate)
    assert {row.term: row.growth > 0 for row in fastest if abs(row.growth) > 1.0} == {
        "1": False,
        "mu*contact": True,
    }


def test_terms_of_components_from_files_are_named_by_their_factors(capsys, monkeypatch, tmp_path):
    """No stiffness of theirs is damping, which a system file adds without a file."""
    monkeypatch.chdir(tmp_path)
    assert main(["example", "components"]) == 0
    capsys.readouterr()
    assert (
        main(["eigenvalues", "brake/assembly.yaml", "--band=500:4000", "--energy", "--json"]) == 0
    )
    rows = json.loads(capsys.readouterr().out)["energy"]
    terms = {(row["part"], row["term"], row["role"]) for row in rows}
    assert terms == {
        ("M", "1", "mass"),
        ("C", "1", "damping"),
        ("K", "1", "stiffness"),
        ("K", "contact", "stiffness"),
        ("K", "(mu) * (contact)", "friction"),
    }


def test_a_stiffness_from_a_table_is_a_stiffness():
    table = Tabulated(ONE, "speed", "bearing.csv", "kxx", (0.0, 1.0), (1.0, 2.0))
    K = (Term(np.array([[4.0]]), table),)
    system = squeal.System(np.eye(1), K=K, parameters={"speed": 0.5})
    roles = [term.role for term in named_terms(system, SystemFile(system))]
    assert roles == ["mass", "stiffness"]


def test_a_part_says_how_much_of_the_damping_it_gives():
    """Modes (1, 1) and (1, -1) of two masses, and a damper of 0.002 at the left one alone."""
    system = squeal.System(np.eye(2), np.diag([0.002, 0.0]), [[2.0, -1.0], [-1.0, 2.0]])
    found = squeal.energy(squeal.eigenvalues(system), parts={"left": [0], "right": [1]})
    rows = found.parts_table().records()
    assert [row["damping"] for row in rows if row["part"] == "right"] == [0.0, 0.0]
    left = [row["damping"] for row in rows if row["part"] == "left"]
    assert left == pytest.approx([-0.0005, -0.0005], rel=1e-5)


def test_terms_of_one_file_are_named_by_their_keys(tmp_path):
    matrices = {
        "M": np.eye(2),
        "K1": np.diag([4.0, 9.0]),
        "KR": np.array([[0.0, 1.0], [-1.0, 0.0]]),
    }
    savemat(tmp_path / "disc.mat", matrices)
    (tmp_path / "system.yaml").write_text(
        "parameters: {mu: 0.1}\n"
        "M: {file: disc.mat, key: M}\n"
        "K:\n"
        "  - {file: disc.mat, key: K1}\n"
        "  - {file: disc.mat, key: KR, factor: mu}\n"
    )
    found = squeal.eigenvalues(squeal.read_system(tmp_path / "system.yaml"))
    assert "  K: disc.mat: KR, factor mu, 2 non-zeros" in found.notes[0].splitlines()
    names = [row.term for row in squeal.energy(found).contributions if row.mode == 1]
    assert names == ["disc.mat: M", "disc.mat: K1", "disc.mat: KR, mu"]


def test_damping_that_a_file_adds_has_the_names_of_its_keys(tmp_path):
    (tmp_path / "pair.yaml").write_text(
        "M: [{matrix: [[1, 0], [0, 1]]}]\nK:\n- {matrix: [[2, -1], [-1, 2]]}\n"
        "- {matrix: [[1, 0], [0, 0]], rayleigh: 0.003}\n"
        "damping: {rayleigh: [0.3, 0.001], ratios: 0.01}\n"
    )
    found = squeal.energy(squeal.eigenvalues(squeal.read_system(tmp_path / "pair.yaml")))
    names = [row["term"] for row in found.table().records() if row["part"] == "C"]
    added = ["rayleigh mass part 0.3 M.1", "rayleigh stiffness part 0.001 K", "ratios"]
    assert names == 2 * ["rayleigh 0.003 K.2", *added]
    (tmp_path / "pair.yaml").write_text("M: [[1]]\nK: [[4]]\ndamping: {structural: 0.02}\n")
    found = squeal.energy(squeal.eigenvalues(squeal.read_system(tmp_path / "pair.yaml")))
    assert [row["term"] for row in found.table().records()] == ["1", "1", "structural 0.02 K"]


@pytest.mark.filterwarnings("ignore:damping.ratios. modes above .* are not damped")
def test_damping_of_few_modes_is_one_term_and_takes_what_their_ratios_say(tmp_path, monkeypatch):
    """The unknowns that stand for the damped modes have no share."""
    n = 450
    hertz = np.arange(1.0, n + 1.0)
    stiffness = diags_array((2 * np.pi * hertz) ** 2).tocsc()
    savemat(tmp_path / "chain.mat", {"M": csc_array(np.eye(n)), "K": stiffness})
    (tmp_path / "chain.yaml").write_text(
        "M: [{file: chain.mat, key: M}]\n"
        "K: [{file: chain.mat, key: K}]\n"
        "damping: {ratios: [0.01, 0.02]}\n"
    )
    monkeypatch.chdir(tmp_path)
    system = squeal.read_system("chain.yaml")
    energy = squeal.energy(squeal.eigenvalues(system, band=(0.5, 2.5)))
    growth = {(row.mode, row.term): row.growth for row in energy.contributions}
    assert {term for _, term in growth} == {"chain.mat: M", "chain.mat: K", "ratios"}
    assert growth[1, "ratios"] == pytest.approx(-2 * np.pi * 0.01)
    assert growth[2, "ratios"] == pytest.approx(-4 * np.pi * 0.02)
