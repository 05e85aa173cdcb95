"""System files of the general form: what they mean, what is refused, and by which sentence."""

import jsonschema
import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array, save_npz

from squeal.errors import InputError, InputWarning
from squeal.io.document import read_document
from squeal.io.system import is_general, read_system
from workflow.release.keys import system_schema

M = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 3.0]])
K0 = np.array([[9.0, -1.0, 0.0], [-1.0, 8.0, -2.0], [0.0, -2.0, 7.0]])
K1 = np.array([[0.0, 3.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
D = np.diag([0.1, 0.2, 0.3])

GOOD = """\
name: three
parameters: {Omega: 2.0, mu: 0.4}
parameter: Omega
M: {file: m.mtx}
C:
  - {file: d.npz, factor: 1/Omega - 1}
  - {matrix: [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], factor: Omega}
K: [{file: k0.mtx}, {file: k1.mtx, factor: mu*Omega**2}]
"""


@pytest.fixture
def folder(tmp_path):
    mmwrite(tmp_path / "m.mtx", csc_array(M))
    mmwrite(tmp_path / "k0.mtx", csc_array(K0))
    mmwrite(tmp_path / "k1.mtx", csc_array(K1))
    save_npz(tmp_path / "d.npz", csc_array(D))
    mmwrite(tmp_path / "small.mtx", csc_array(np.eye(2)))
    return tmp_path


def _read(folder, text=GOOD):
    (folder / "system.yaml").write_text(text, encoding="utf-8")
    return read_system(folder / "system.yaml")


def test_sums_of_terms(folder):
    file = _read(folder)
    mass, C, K = file.system.at({"Omega": 0.5})
    assert np.allclose(mass, M)
    G = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
    assert np.allclose(C, (1 / 0.5 - 1) * D + 0.5 * G)
    assert np.allclose(K, K0 + 0.4 * 0.25 * K1)
    assert (file.system.name, file.system.parameter) == ("three", "Omega")
    assert [i.name for i in file.inputs] == ["m.mtx", "d.npz", "k0.mtx", "k1.mtx"]
    assert [(o.part, o.file) for o in file.origins][1:3] == [("C", "d.npz"), ("C", "")]


def test_rows_alone_make_a_matrix(folder):
    rows = K0.tolist()
    file = _read(folder, f"parameters: {{}}\nM: {M.tolist()}\nK: {rows}\n")
    assert np.array_equal(file.system.at()[2], K0)
    assert file.system.parameter == "mu"
    assert file.system.at()[1] is None


def test_rayleigh_leaves_friction_out(folder):
    file = _read(folder, GOOD + "damping: {rayleigh: [0.5, 0.01]}\n")
    C = _read(folder).system.at()[1]
    assert np.allclose(file.system.at()[1] - C, 0.5 * M + 0.01 * K0)


@pytest.mark.parametrize(
    ("given", "ratios"), [("0.03", [0.03] * 3), ("[0.01, 0.02]", [0.01, 0.02])]
)
def test_modal_ratios_are_those_of_the_modes(folder, given, ratios):
    text = f"M: {{file: m.mtx}}\nK: [{{file: k0.mtx}}]\ndamping: {{ratios: {given}}}\n"
    mass, C, K = _read(folder, text).system.at()
    first = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(mass, np.hstack([K, C]))]])
    values = np.linalg.eigvals(first)
    upper = np.sort_complex(1j * values[values.imag > 0])[::-1] / 1j
    found = -upper.real / np.abs(upper)
    expected = np.zeros(3)
    expected[: len(ratios)] = ratios
    assert np.allclose(found, expected, atol=1e-10)


def test_structural_damping_is_a_complex_stiffness(folder):
    text = "M: {file: m.mtx}\nK: {file: k0.mtx}\ndamping: {structural: 0.1}\n"
    assert np.allclose(_read(folder, text).system.at()[2], (1 + 0.1j) * K0)


def test_coordinates(folder):
    (folder / "nodes.csv").write_text("node,dof,x,y,z\n7,x,0,0,0\n7,2,0,0,0\n9,4,1,2,3\n")
    found = _read(folder, GOOD + "coordinates: {file: nodes.csv}\n").coordinates
    moved = found.displacements(np.array([1.0, 2.0, 5.0]))
    assert np.array_equal(moved, [[1, 2, 0], [0, 0, 0]])
    assert np.array_equal(found.places, [[0, 0, 0], [1, 2, 3]])


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("7,x,0,0,0\n7,2,0,0,0\n", "2 lines; the system's 3 rows need one each"),
        ("7,x,0,0,0\n7,2,0,0,0\n9,4,1,2,inf\n", "line 4: a node and three finite coordinates"),
        ("7,x,0,0,0\n,2,0,0,0\n9,4,1,2,3\n", "line 3: a node and three finite coordinates"),
        ("7,x,0,0,0\n7,9,0,0,0\n9,4,1,2,3\n", "line 3: dof 9 is not allowed; it must be 1, 2, 3"),
        ("7,x,0,0,0\n7,uy,0,0,0\n9,4,1,2,3\n", "line 3: dof uy is not allowed; it must be 1, 2, 3"),
        ("7,x,0,0\n7,2,0,0,0\n9,4,1,2,3\n", "line 2: a node and three finite coordinates"),
    ],
)
def test_wrong_coordinates_are_refused(folder, rows, words):
    (folder / "nodes.csv").write_text(f"node,dof,x,y,z\n{rows}")
    with pytest.raises(InputError, match=f"nodes.csv: {words}"):
        _read(folder, GOOD + "coordinates: {file: nodes.csv}\n")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("m.mtx", "none.mtx"), "M.file: .*none.mtx: cannot be read"),
        (("k1.mtx", "small.mtx"), "K.2: file small.mtx of 2 rows is not allowed"),
        (("mu*Omega**2", "mu*Omego"), "Omego is no parameter; allowed are Omega, mu"),
        (("mu*Omega**2", "exp(mu)"), "K.2.factor: exp.* is not allowed; it must be a formula"),
        (("mu*Omega**2", "1/0"), "K.2.factor: 1/0: is not a finite number at any value"),
        (("{file: k0.mtx}", "{file: k0.mtx, key: K}"), "key K is not allowed"),
        (("{file: k0.mtx}", "{factor: mu}"), "K.1: it must hold one of file and matrix"),
        (("{file: k0.mtx}", "{fil: k0.mtx}"), "K.1.fil: unknown key; allowed are file, key"),
        (("M: {file: m.mtx}", "M: [{file: m.mtx}, 3]"), "M.2: 3 is not allowed"),
        (("M: {file: m.mtx}", "M: []"), r"M: \[\] is not allowed; it must be rows of numbers"),
        (("{matrix: [[0", "{key: K, matrix: [[0"), "C.2.key: .*a matrix without a file"),
        (("parameters: {Omega: 2.0, mu: 0.4}", "parameters: 3"), "must be a mapping of names"),
        (("mu: 0.4", "mu: x"), "parameters.mu: 'x' is not allowed"),
        (("parameter: Omega", "parameter: 2x"), "parameter: '2x' is not allowed; it must be a"),
        (("name: three", "K0: [[1]]"), "K0: unknown key"),
        (("name: three", "coordinates: {file: m.mtx}"), "no column node"),
        (("name: three", "damping: {ratios: [-1]}"), "damping.ratios.1: -1 is not allowed"),
        (("name: three", "damping: {ratios: []}"), "of at least 0, or a list of them"),
    ],
)
def test_refusals(folder, change, words):
    with pytest.raises(InputError, match=words) as caught:
        _read(folder, GOOD.replace(*change))
    assert "\n" not in str(caught.value)
    assert "system.yaml" in str(caught.value) or "m.mtx" in str(caught.value)


@pytest.mark.parametrize(
    ("more", "valid"),
    [("", True), ("damping: {rayleigh: [1, 0]}\n", True), ("damping: {rayleigh: [1]}\n", False)]
    + [("damping: {ratios: 0.1}\n", True), ("speed: 1\n", False), ("reference: 3\n", False)]
    + [("C0: [[1]]\n", False), ("damping: {structural: -1}\n", False)],
)
def test_reader_and_schema_agree(folder, more, valid):
    try:
        _read(folder, GOOD + more)
        ours = True
    except InputError:
        ours = False
    document = read_document(folder / "system.yaml")
    assert ours == valid
    assert jsonschema.Draft202012Validator(system_schema()).is_valid(document) == valid


def test_which_form_a_file_has():
    assert is_general({"M": {"file": "m.mtx"}, "K0": [[1]]})
    assert is_general({"M": [[1]], "K": [[1]]})
    assert not is_general({"M": [[1]], "K0": [[1]]})
    assert not is_general({"model": "B1"})


LABELLED = {
    "m.txt": "1,1,1,1,1\n1,2,1,2,1\n2,1,2,1,1\n",
    "k.txt": "1,1,1,1,9\n1,2,1,2,7\n3,1,3,1,5\n4,1,4,1,5\n",
}


def test_labels_that_m_or_k_alone_have_are_reported(tmp_path):
    for name, text in LABELLED.items():
        (tmp_path / name).write_text(text)
    words = "1 rows stand in M and not in K, the first is degree of freedom 1 of node 2"
    with (
        pytest.warns(InputWarning, match=words),
        pytest.warns(InputWarning, match="2 rows stand in K and not in M, .* 1 of node 3"),
    ):
        _read(tmp_path, "M: {file: m.txt}\nK: {file: k.txt}\n")
    friction = LABELLED["m.txt"][: -len("2,1,2,1,1\n")]
    (tmp_path / "f.txt").write_text(friction)
    text = "M: {file: m.txt}\nK: [{file: m.txt}, {file: f.txt, factor: mu}]\n"
    assert _read(tmp_path, text).system.n == 3  # a term of K may be of some rows only


def test_one_sided_friction_stays_on_its_side(folder):
    (folder / "f.txt").write_text("1,1,1,2,0.4\n1,1,1,1,0\n1,2,1,2,0\n2,1,2,1,0\n")
    (folder / "m.txt").write_text("1,1,1,1,1\n1,2,1,2,1\n2,1,2,1,1\n")
    text = "M: {file: m.txt}\nK: [{file: m.txt}, {file: f.txt, factor: mu SAID}]\n"
    with pytest.raises(InputError, match=r"K\.2\.file: .*f\.txt: .*symmetric: true or"):
        _read(folder, text.replace(" SAID", ""))
    found = _read(folder, text.replace(" SAID", ", symmetric: false")).system
    assert found.at({"mu": 1.0})[2].tolist() == [[1, 0.4, 0], [0, 1, 0], [0, 0, 1]]
    with pytest.raises(InputError, match="must be true or false"):
        _read(folder, text.replace(" SAID", ", symmetric: 3"))


def test_supports_by_penalties_are_left_out_with_a_warning(folder):
    (folder / "nodes.csv").write_text("node,dof,x,y,z\n7,x,0,0,0\n7,y,0,0,0\n9,z,1,2,3\n")
    text = "M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nK: [[9, 0, -1], [0, 1.0e+30, 0], [-1, 0, 7]]\n"
    with pytest.warns(InputWarning, match="1 rows .* supports and left out, the first is row 2"):
        found = _read(folder, text + "coordinates: {file: nodes.csv}\n")
    assert found.system.at()[2].tolist() == [[9, -1], [-1, 7]]
    moved = found.coordinates.displacements(np.array([1.0, 2.0]))
    assert moved.tolist() == [[1, 0, 0], [0, 0, 2]]


def test_a_factor_of_one_leaves_damping_on_and_is_reported(folder):
    text = "parameters: {lining: 1.0}\nM: {file: m.mtx}\nK: {file: k0.mtx, factor: lining}\n"
    with pytest.warns(InputWarning, match=r"damping: also damps K\.1 \(lining\)"):
        found = _read(folder, text + "damping: {structural: 0.1}\n")
    assert np.allclose(found.system.at()[2], (1 + 0.1j) * K0)
