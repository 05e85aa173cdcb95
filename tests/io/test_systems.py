"""System files of both forms: what they mean, and what is refused."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array, save_npz

import squeal
from squeal.errors import InputError, InputWarning
from squeal.io.matrices import write_matrix
from squeal.io.system_files import read_system
from squeal.queries.systems.matrices import write_system

SHORT = """\
name: example
M: [[1, 0], [0, 2]]
C1: [[0.1, 0], [0, 0]]
K0: [[3, 1], [1, 4]]
K2: [[0, -1], [1e-3, 0]]
"""
GENERAL = """\
name: three
parameters: {Omega: 2.0, mu: 0.4}
parameter: Omega
M: {file: m.mtx}
C:
  - {file: d.npz, factor: 1/Omega - 1}
  - {matrix: [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], factor: Omega}
K: [{file: k0.mtx}, {file: k1.mtx, factor: mu*Omega**2}]
"""
M = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 3.0]])
K0 = np.array([[9.0, -1.0, 0.0], [-1.0, 8.0, -2.0], [0.0, -2.0, 7.0]])
K1 = np.array([[0.0, 3.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
D = np.diag([0.1, 0.2, 0.3])
G = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
NODES = "node,dof,x,y,z\n7,x,0,0,0\n7,2,0,0,0\n9,4,1,2,3\n"
SOME = "1,1,1,1,1\n1,2,1,2,1\n"  # rows that are named by node and degree of freedom


@pytest.fixture
def read(tmp_path):
    for name, matrix in {"m": M, "k0": K0, "k1": K1, "small": np.eye(2)}.items():
        mmwrite(tmp_path / f"{name}.mtx", csc_array(matrix))
    save_npz(tmp_path / "d.npz", csc_array(D))
    (tmp_path / "nodes.csv").write_text(NODES)

    def made(text=GENERAL, **files):
        for stem, content in files.items():
            (tmp_path / f"{stem}.txt").write_text(content)
        (tmp_path / "system.yaml").write_text(text, encoding="utf-8")
        return read_system(tmp_path / "system.yaml")

    return made


def test_K0_K1_and_so_on_are_multiplied_with_powers_of_the_parameter(read):
    system = read(SHORT).system
    mass, C, K = system(2.0)
    assert np.array_equal(mass, [[1, 0], [0, 2]])
    assert np.array_equal(C, np.array([[0.2, 0], [0, 0]]))
    assert np.array_equal(K, np.array([[3, -3], [1.004, 4]]))
    assert (system.name, system.parameter, system.n) == ("example", "mu", 2)
    undamped = read("M: [[1]]\nK0: [[2]]\n").system
    assert (undamped(1.0)[1], undamped.name) == (None, "system")
    for name in ("brake pressure", "lambda"):  # no words of formulas
        assert read(f"parameter: {name}\nM: [[1]]\nK0: [[2]]\nK1: [[3]]\n").system(2.0)[2] == [[8]]
    highest = read("M: [[1]]\nK0: [[1]]\nC9: [[2]]\nK9: [[3]]\n").system
    assert [X.item() for X in highest(2.0)] == [1.0, 2 * 2.0**9, 1 + 3 * 2.0**9]
    with pytest.raises(InputError, match="K10"):
        read("M: [[1]]\nK0: [[1]]\nK10: [[3]]\n")


def test_a_matrix_is_the_sum_of_its_terms_times_their_factors(read):
    file = read()
    mass, C, K = file.system.at({"Omega": 0.5})
    assert np.allclose(mass, M)
    assert np.allclose(C, (1 / 0.5 - 1) * D + 0.5 * G)
    assert np.allclose(K, K0 + 0.4 * 0.25 * K1)
    assert (file.system.name, file.system.parameter) == ("three", "Omega")
    assert [i.name for i in file.inputs] == ["m.mtx", "d.npz", "k0.mtx", "k1.mtx"]
    assert [(o.part, o.file) for o in file.origins][1:3] == [("C", "d.npz"), ("C", "")]


def test_rows_that_are_empty_in_every_matrix_are_left_out_with_a_warning(tmp_path):
    """Nastran's AUTOSPC and others leave them; two chains remain, of known frequencies."""
    K = np.diag(np.full(6, 2.0)) - np.eye(6, k=1) - np.eye(6, k=-1)
    K[2] = 0.0
    K[:, 2] = 0.0
    held = 1e30 * np.diag([0.0, 0, 0, 0, 0, 1])
    mass = np.diag([1.0, 1, 0, 1, 1, 1])
    for name, matrix in {"M": mass, "K": K, "held": held}.items():
        write_matrix(tmp_path / f"{name}.mtx", matrix)
    lines = [f"{row},x,{row},0,0\n" for row in range(1, 7)]
    (tmp_path / "nodes.csv").write_text("node,dof,x,y,z\n" + "".join(lines))
    text = "M: {file: M.mtx}\nK: [{file: K.mtx}, {file: held.mtx}]\n"
    (tmp_path / "s.yaml").write_text(f"{text}coordinates: {{file: nodes.csv}}\n")
    with pytest.warns(InputWarning) as caught:
        file = read_system(tmp_path / "s.yaml")
    empty, supports = (str(one.message) for one in caught)
    assert "what is empty in M, C and K is left out: 1 row, the first is row 3" in empty
    assert "the first is row 6" in supports
    assert file.coordinates.supports.tolist() == [2, 5]
    assert file.coordinates.displacements(np.arange(1.0, 5.0))[:, 0].tolist() == [1, 2, 0, 3, 4, 0]
    answer = squeal.eigenvalues(file)
    squares = sorted(one.value.imag**2 for one in answer.eigenvalues if one.value.imag > 0)
    assert squares == pytest.approx([1.0, 1.0, 3.0, 3.0], rel=1e-12)
    assert not answer.certified
    (tmp_path / "s.yaml").write_text("M: [[0]]\nK: [[0]]\n")
    assert read_system(tmp_path / "s.yaml").system.n == 1


@pytest.mark.parametrize("ratios", ["0.03", "[0.01, 0.02]"])
@pytest.mark.filterwarnings("ignore:damping.ratios. modes above .* are not damped")
def test_modal_ratios_are_those_of_the_modes(read, ratios):
    text = f"M: {{file: m.mtx}}\nK: [{{file: k0.mtx}}]\ndamping: {{ratios: {ratios}}}\n"
    mass, C, K = read(text).system.at()
    first = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(mass, np.hstack([K, C]))]])
    roots = np.linalg.eigvals(first)
    upper = sorted(roots[roots.imag > 0], key=abs)
    expected = [0.03] * 3 if ratios == "0.03" else [0.01, 0.02, 0.0]
    assert np.allclose([-root.real / abs(root) for root in upper], expected, atol=1e-10)


def test_damping_of_the_structure_leaves_friction_out(read):
    C = read(f"{GENERAL}damping: {{rayleigh: [0.5, 0.01]}}\n").system.at()[1]
    assert np.allclose(C - read().system.at()[1], 0.5 * M + 0.01 * K0)
    text = "M: {file: m.mtx}\nK: {file: k0.mtx, factor: lining}\ndamping: {structural: 0.1}\n"
    system = read(f"parameters: {{lining: 1.0}}\n{text}").system
    assert np.allclose(system.at()[2], (1 + 0.1j) * K0)
    system = read(text.replace(", factor: lining", "")).system
    assert np.allclose(system.at()[2], (1 + 0.1j) * K0)


def test_displacements_of_a_shape_stand_at_the_nodes_of_the_table(read):
    found = read(f"{GENERAL}coordinates: {{file: nodes.csv}}\n").coordinates
    moved = found.displacements(np.array([1.0, 2.0, 5.0]))
    assert np.array_equal(moved, [[1, 2, 0], [0, 0, 0]])
    assert np.array_equal(found.places, [[0, 0, 0], [1, 2, 3]])


# what takes the place of the table's first lines, and what the refusal names
NO_NODES = [
    (NODES[: NODES.index("9,4")], "nodes.csv", "2 lines"),
    (NODES.replace("1,2,3", "1,2,inf"), "nodes.csv", "line 4"),
    (NODES.replace("7,2", ",2"), "nodes.csv", "line 3"),
    (NODES.replace("7,2", "7,9"), "nodes.csv", "line 3", "dof", "9"),
    (NODES.replace("7,x,0,0,0", "7,x,0,0"), "nodes.csv", "line 2"),
    (NODES.replace("node", "knot"), "nodes.csv", "node"),
    (b"node,\xff\n", "nodes.csv"),
    (NODES.replace("7,x,0,0,0", "7,x,0,0,0,1"), "nodes.csv", "line 2", "6 cells"),
    (f'{NODES}"{"1" * 200_000}', "nodes.csv", "no table"),
]
# of powers
NO_POWERS = [
    ("M: [[1]]\n", "K0"),
    (f"{SHORT}K: [[1, 0], [0, 1]]\n", "K0", "beside K"),
    ("K0: [[1]]\n", "M"),
    (f"{SHORT}K3: [[1, 2]]\n", "K3", "row 1"),
    (f"{SHORT}K3: [[1]]\n", "K3", "1 rows", "2 of M"),
    (f"{SHORT}K3: [[1, 2], [3, x]]\n", "K3.row 2", "'x'"),
    (f"{SHORT}K3: [[1, 2], [3, true]]\n", "K3.row 2", "True"),
    (f"{SHORT}K3: []\n", "K3", "square matrix"),
    (f"{SHORT}K10: [[1]]\n", "K10"),
    (f"{SHORT}parameter: 3\n", "parameter", "text"),
    (f"{SHORT}K0: [[1, 2], [3, 4]]\n", "K0", "line"),
    ("M: [[1, 2], [2, 1]]\nK0: [[1, 0], [0, 1]]\n", "M", "positive definite"),
    ("M: [[1, 1], [0, 1]]\nK0: [[1, 0], [0, 1]]\n", "M", "symmetric"),
    ("M: [[0]]\nK0: [[1]]\n", "M", "well-conditioned"),
]
# a part of the general form and what takes its place
NO_TERMS = [
    ("m.mtx", "none.mtx", "M.file", "none.mtx"),
    ("k1.mtx", "small.mtx", "K.2", "small.mtx", "2 rows"),
    ("mu*Omega**2", "mu*Omego", "Omego", "did you mean Omega?"),
    ("mu*Omega**2", "exp(mu)", "K.2.factor", "exp"),
    ("mu*Omega**2", "1/0", "K.2.factor", "1/0"),
    ("{file: k0.mtx}", "{file: k0.mtx, key: K}", "K.1", "key K"),
    ("{file: k0.mtx}", "{factor: mu}", "K.1", "file", "matrix"),
    ("{file: k0.mtx}", "{file: k0.mtx, matrix: [[1]]}", "K.1.matrix", "file"),
    ("{file: k0.mtx}", "{fil: k0.mtx}", "K.1.fil", "did you mean file?"),
    ("{file: k0.mtx}", "{file: k0.mtx, symmetric: 3}", "K.1.symmetric", "true or false"),
    ("M: {file: m.mtx}", "M: [{file: m.mtx}, 3]", "M.2", "3"),
    ("M: {file: m.mtx}", "M: []", "M: []"),
    ("{matrix: [[0", "{key: K, matrix: [[0", "C.2.file", "key"),
    ("parameters: {Omega: 2.0, mu: 0.4}", "parameters: 3", "parameters", "names"),
    ("mu: 0.4", "mu: x", "parameters.mu", "'x'"),
    ("parameter: Omega", "parameter: 2x", "parameter", "'2x'"),
    ("mu: 0.4", "mu: 0.4, lambda: 1.0", "parameters", "'lambda'", "no keyword"),
    ("mu: 0.4", "mu: 0.4, None: 1.0", "parameters", "'None'", "no keyword"),
    ("mu*Omega**2", "mu*1_0", "K.2.factor", "1_0"),
    ("name: three", "coordinates: {file: m.mtx}", "m.mtx", "node"),
    ("name: three", "coordinates: {file: nix.csv}", "coordinates.file", "nix.csv"),
    ("name: three", "damping: {ratios: {file: nix.csv}}", "damping.ratios.file", "nix.csv"),
    ("factor: mu*Omega**2", "modulus: {file: nix.csv}", "K.2.modulus.file", "nix.csv"),
    ("factor: mu*Omega**2", "table: {file: nix.csv, column: k}", "K.2.table.file", "nix.csv"),
    ("mu*Omega**2", "mu/0", "K.2.factor: mu/0"),
    ("name: three", "damping: {ratios: [-1]}", "damping.ratios.1", "-1"),
    ("name: three", "damping: {ratios: []}", "damping.ratios"),
    ("name: three", "damping: {rayleigh: [1]}", "damping.rayleigh"),
]


@pytest.mark.parametrize(
    ("text", "nodes", "parts"),
    [(text, NODES, parts) for text, *parts in NO_POWERS]
    + [(GENERAL.replace(old, new), NODES, parts) for old, new, *parts in NO_TERMS]
    + [(f"{GENERAL}coordinates: {{file: nodes.csv}}", nodes, parts) for nodes, *parts in NO_NODES],
)
def test_one_sentence_names_file_key_and_value(tmp_path, read, text, nodes, parts):
    (tmp_path / "nodes.csv").write_bytes(nodes if isinstance(nodes, bytes) else nodes.encode())
    with pytest.raises(InputError) as refused:
        read(text)
    message = str(refused.value)
    assert message.startswith(str(tmp_path))
    assert "\n" not in message
    assert message.count(".yaml") == 1
    for part in parts:
        assert part in message


def test_labels_that_m_or_k_alone_have_are_reported(read):
    some = SOME + "2,1,2,1,1\n"
    with (
        pytest.warns(InputWarning, match="K lacks 1 row of M, .* 1 of node 2"),
        pytest.warns(InputWarning, match="M lacks 2 rows of K, .* 1 of node 3"),
    ):
        read("M: {file: m.txt}\nK: {file: k.txt}\n", m=some, k=f"{SOME}3,1,3,1,5\n4,1,4,1,5\n")
    text = "M: {file: m.txt}\nK: [{file: m.txt}, {file: some.txt, factor: mu}]\n"
    assert read(text, some=SOME).system.n == 3  # a term of K may be of some rows only


def test_one_sided_friction_stays_on_its_side(read):
    text = "M: {file: m.txt}\nK: [{file: m.txt}, {file: f.txt, factor: mu, SAID}]\n"
    files = {"m": SOME, "f": "1,1,1,2,0.4\n1,1,1,1,0\n1,2,1,2,0\n"}
    with pytest.raises(InputError, match=r"K\.2\.file: .*f\.txt: .*symmetric: true or"):
        read(text.replace(", SAID", ""), **files)
    K = read(text.replace("SAID", "symmetric: false"), **files).system.at({"mu": 1.0})[2]
    assert K.tolist() == [[1, 0.4], [0, 1]]


def test_supports_by_penalties_are_left_out_with_a_warning(tmp_path, read):
    (tmp_path / "nodes.csv").write_text("node,dof,x,y,z\n7,x,0,0,0\n7,y,0,0,0\n9,z,1,2,3\n")
    text = "M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nK: [[9, 0, -1], [0, 1.0e+30, 0], [-1, 0, 7]]\n"
    with pytest.warns(InputWarning, match="supports, .* left out: 1 row, .* row 2"):
        file = read(f"{text}coordinates: {{file: nodes.csv}}\n")
    assert file.system.at()[2].tolist() == [[9, -1], [-1, 7]]
    assert file.coordinates.displacements(np.array([1.0, 2.0])).tolist() == [[1, 0, 0], [0, 0, 2]]


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ("mju: 0.45", "parameters: no matrix depends on mju; matrices depend on mu = 0"),
        ("mju: 0.45, lining: 2", "no matrix depends on lining, mju; matrices depend on mu = 0"),
        ("mu: 0.45, lining: 2", "parameters: no matrix depends on lining; .* mu = 0.45"),
    ],
)
def test_a_parameter_that_enters_no_matrix_is_named(read, parameters, words):
    text = "M: {file: m.mtx}\nK: [{file: k0.mtx}, {file: k1.mtx, factor: mu}]\n"
    with pytest.warns(InputWarning, match=words):
        read(text + f"parameters: {{{parameters}}}\n")
    with pytest.warns(InputWarning, match="System: parameters: .* mju; matrices .* mu = 0"):
        squeal.System(M, K={"1": K0, "mu": K1}, parameters={"mju": 0.4})


@pytest.mark.parametrize(
    ("K", "parameters", "parameter"),
    [
        ({"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}, {"mu": 0.3}, "p"),
        ([[2, -1], [-1, 2]], {}, "speed"),
        ([[2, -1], [-1, 2]], {}, "mu"),
        ({"1 + p": [[2, -1], [-1, 2]]}, {"p": 0.0}, "mu"),
        ({"1 + mu": [[2, -1], [-1, 2]]}, {}, "mu"),
    ],
)
def test_a_written_system_is_read_with_its_parameters(tmp_path, K, parameters, parameter):
    """An unused free parameter of value 0 was left out, and mu took its place on reading."""
    system = squeal.System([[1, 0], [0, 1]], None, K, parameters, parameter=parameter)
    write_system(tmp_path, system, "mtx")
    read = squeal.read_system(tmp_path / "system.yaml").system
    assert read.parameter == parameter
    assert read.parameters == system.parameters
