"""Modes paired by frequency and MAC: known vectors, shuffled frequencies, wrong tables."""

import json

import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.queries.compare import Mode, pairing_costs

N = 6
SYSTEM = "M: {M}\nK: {K}\nparameters: {{p: 0.0}}\nparameter: p\ncoordinates: {{file: nodes.csv}}\n"


@pytest.fixture
def chain(tmp_path):
    """Equal masses between equal springs, along x: f_k = sin(k pi / 2 (N + 1)) / pi."""
    K = (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)).tolist()
    (tmp_path / "chain.yaml").write_text(SYSTEM.format(M=np.eye(N).tolist(), K=K))
    nodes = "".join(f"N{k},x,{k},0,0\n" for k in range(1, N + 1))
    (tmp_path / "nodes.csv").write_text(f"node,dof,x,y,z\n{nodes}")
    return tmp_path / "chain.yaml"


K = np.arange(1, N + 1)
HERTZ = np.sin(K * np.pi / (2 * (N + 1))) / np.pi
SINES = np.sin(np.outer(K, K) * np.pi / (N + 1))  # symmetric


def table(path, order, scale=1.0, shapes=True, more=""):
    head = "name,frequency_hz"
    if shapes:
        head += "".join(f",n{k}:X" for k in K)
    rows = [head]
    for k in order:
        row = f"T{k},{float(scale * HERTZ[k])!r}"
        if shapes:
            row += "".join(f",{2 * x!r}" for x in SINES[k].tolist())
        rows.append(row)
    path.with_name("test.csv").write_text("\n".join(rows) + more)
    return path.with_name("test.csv")


def test_mac_of_known_vectors_is_that_of_its_definition():
    X = np.array([[1, 1], [0, 1j]])
    assert squeal.mac(X, X) == pytest.approx(np.array([[1, 0.5], [0.5, 1]]))
    assert squeal.mac(X, -3j * X) == pytest.approx(squeal.mac(X, X))
    assert squeal.mac(SINES, SINES) == pytest.approx(np.eye(N), abs=1e-12)


def test_mac_refuses_rows_with_other_labels():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"mode 1": [1.0, 2.0]}, index=["x", "y"])
    assert squeal.mac(frame, frame)[0, 0] == pytest.approx(1.0)
    with pytest.raises(squeal.InputError, match="labels of their rows"):
        squeal.mac(frame, frame.loc[["y", "x"]])
    series = frame["mode 1"]
    assert squeal.mac(series, series)[0, 0] == pytest.approx(1.0)
    with pytest.raises(squeal.InputError, match="labels of their rows"):
        squeal.mac(series, series.loc[["y", "x"]])


def test_shuffled_frequencies_find_their_modes_and_leave_the_others(chain):
    order = [4, 0, 3, 2]
    answer = squeal.eigenvalues(squeal.read_system(chain))
    found = squeal.compare(answer, table(chain, order, 1 / 1.02, False, "\nfar,9.0\n"), 0.03)
    pairs = {pair.reference: pair for pair in found.pairs}
    assert {k + 1: f"T{k}" for k in order} == found.names
    for k in order:
        assert pairs[f"T{k}"].difference == pytest.approx(2.0, rel=1e-9)
        assert pairs[f"T{k}"].mac is None
    assert pairs["far"].mode is None
    assert [pair.mode for pair in found.pairs if pair.reference is None] == [2, 6]


def test_shapes_decide_where_frequencies_lie_between(chain, capsys):
    test = table(chain, [5, 4])
    text = test.read_text()
    for k, hertz in ((4, "0.306"), (5, "0.300")):
        text = text.replace(repr(float(HERTZ[k])), hertz)
    test.write_text(text)  # in the wrong order: T5 lies nearer to the fifth mode
    assert main(["eigenvalues", str(chain), "--test", str(test), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    pairs = {row["reference"]: row for row in found["pairs"] if row["reference"]}
    assert (pairs["T4"]["mode"], pairs["T5"]["mode"]) == (5, 6)
    assert pairs["T4"]["mac"] == pytest.approx(1.0)
    assert "test.csv" in [file["name"] for file in found["provenance"]["inputs"]]


def test_two_answers_are_paired_by_mac_and_names_reach_a_sweep(chain):
    K = {"1": np.diag([1.0, 3.0, 9.0]), "p": np.diag([1.0, -1.0, 0.0])}
    system = squeal.System(np.eye(3), K=K, parameter="p")
    here = squeal.eigenvalues(system, 0.8)
    there = squeal.eigenvalues(system, 1.2)  # the roots have crossed in between
    assert [(p.reference, p.mode) for p in squeal.compare(there, here, 0.5).pairs[:2]] == [
        ("1", 2),
        ("2", 1),
    ]
    named = squeal.sweep(system, [0.0, 2.0]).named({2: "bending"})
    rows = {(row["p"], row["name"]): row["frequency_hz"] for row in named.to_records()}
    assert rows[2.0, "bending"] == pytest.approx(1 / (2 * np.pi))
    with pytest.raises(InputError, match="6 and 3 rows"):
        squeal.compare(here, squeal.eigenvalues(squeal.read_system(chain)))


def test_a_table_of_eigenvalues_stands_for_a_test(tmp_path):
    """Two pairs of one frequency each, of which one mode grows: turned round in the variant."""
    rates = np.array([-1.0, 2.0, 3.0, -4.0])
    C = -2 * np.diag(rates)
    K = np.diag(rates**2 + np.array([100.0, 100.0, 300.0, 300.0]) ** 2)
    turned = [1, 0, 3, 2]
    one = squeal.eigenvalues(squeal.System(np.eye(4), C, K))
    one.save(tmp_path / "one.csv")
    other = squeal.eigenvalues(squeal.System(np.eye(4), C[turned][:, turned], K[turned][:, turned]))
    pairs = squeal.compare(other, tmp_path / "one.csv", 0.1).pairs
    assert sorted(p.reference for p in pairs) == ["1", "2", "3", "4"]
    assert all(p.damping_ratio == pytest.approx(p.reference_damping) for p in pairs)


WRONG = [
    ("a,1\na,2", "name"),
    (",1", "name"),
    ("a,-1", "frequency_hz"),
    ("a,0", "frequency_hz"),
    ("a,x", "frequency_hz"),
    ("a,nan", "frequency_hz"),
]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        *((f"name,frequency_hz\n{rows}", words) for rows, words in WRONG),
        ("name,hertz\na,1", "no column frequency_hz"),
        ("name,frequency_hz,n9:x\na,1,1", "n9:x"),
        ("name,frequency_hz,n1:y\na,1,1", "n1:y"),
        ("name,frequency_hz,n1\na,1,1", "n1"),
        ("name,frequency_hz,n1:x\na,1,inf", "n1:x"),
        ("name,frequency_hz,damping_ratio\na,1,high", "damping_ratio"),
    ],
)
def test_wrong_tables_are_refused(chain, text, words):
    path = chain.with_name("test.csv")
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        squeal.compare(squeal.eigenvalues(squeal.read_system(chain)), path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_two_modes_of_one_frequency_the_test_hears_that_which_grows(tmp_path, sign):
    coupled = squeal.System([[1, 0], [0, 1]], K=[[200.0, 9.0 * sign], [-9.0 * sign, 200.0]])
    found = squeal.eigenvalues(coupled)
    frequency = found.eigenvalues[0].frequency_hz
    (tmp_path / "test.csv").write_text(f"name,frequency_hz\nsqueal,{frequency!r}\n")
    pairs = squeal.compare(found, tmp_path / "test.csv")
    assert pairs.pairs[0].reference == "squeal"
    assert pairs.pairs[0].damping_ratio < 0.0
    assert len(pairs.warnings) == 1


@pytest.mark.parametrize("tolerance", [0.1, 1e-4, 1e-10])
def test_shapes_outweigh_growth_at_every_tolerance(tmp_path, tolerance):
    """Two modes of one frequency on two nodes; the test measured that which decays."""
    C = "[[0.2, 0], [0, -0.2]]"
    system = "M: [[1, 0], [0, 1]]\nC: {}\nK: [[4, 0], [0, 4]]\ncoordinates: {{file: nodes.csv}}\n"
    (tmp_path / "pair.yaml").write_text(system.format(C))
    (tmp_path / "nodes.csv").write_text("node,dof,x,y,z\na,x,0,0,0\nb,x,1,0,0\n")
    found = squeal.eigenvalues(squeal.read_system(tmp_path / "pair.yaml"))
    hertz = found.eigenvalues[0].frequency_hz
    (tmp_path / "test.csv").write_text(f"name,frequency_hz,a:x,b:x\nT,{hertz!r},1,0\n")
    pair, _ = squeal.compare(found, tmp_path / "test.csv", tolerance).pairs
    assert pair.mac == pytest.approx(1.0)
    assert pair.damping_ratio == pytest.approx(0.05)


def test_a_mode_that_does_not_vibrate_is_near_to_none_that_does():
    modes = [
        Mode(name, hertz, None, np.empty(0, complex)) for name, hertz in (("0", 0.0), ("1", 0.05))
    ]
    differences = pairing_costs(modes, modes, 0.1).difference
    assert differences == pytest.approx(np.array([[0.0, 1.0], [-1.0, 0.0]]))
