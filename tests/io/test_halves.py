"""Half a matrix in a file: completed where it can only be half a structure, friction never."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import mmwrite, savemat
from scipy.linalg import eigvals
from scipy.sparse import coo_array, csc_array

import squeal
from squeal.errors import InputError, InputWarning
from squeal.io.halves import sides_of
from squeal.io.matrices import read_matrix

SPRING = "1,1,1,1,3.0\n2,1,1,1,-1.0\n2,1,2,1,3.0\n"


FRICTION = "1,1,1,2,0.4\n"


CONTACT = "1,1,1,1,5.0\n1,2,1,1,0.4\n1,2,1,2,5.0\n"  # friction at one node, upon stiffnesses


NUMBERED = "1 1 3.0\n2 1 -1.0\n2 2 3.0\n"


def test_a_triangle_as_abaqus_writes_it_is_completed_with_a_warning(read):
    with pytest.warns(InputWarning, match="symmetric: false"):
        assert read("K.mtx", SPRING) == [[3, -1], [-1, 3]]


def test_abaqus_orders_rows_as_it_likes_and_numbers_internal_nodes_below_zero(read):
    """Half a stiffness by another order than that of the labels, a multiplier of zero stiffness."""
    text = "9,1, 9,1, 3.0\n2,1, 9,1, -1.0\n2,1, 2,1, 3.0\n 9,1, -7,0, 1.0\n-7,0,2,1,-1.0\n"
    with pytest.warns(InputWarning, match="symmetric: false"):
        assert read("K.mtx", text) == [[0, -1, 1], [-1, 3, -1], [1, -1, 3]]  # -7, 2, 9


@pytest.mark.filterwarnings("ignore::squeal.errors.InputWarning")
@pytest.mark.parametrize("text", [FRICTION, CONTACT, NUMBERED, SPRING.replace("-1.0", "-3.1")])
def test_one_sided_friction_is_not_mirrored(read, text):
    with pytest.raises(InputError, match="symmetric: true or symmetric: false"):
        read("K.mtx", text)
    alone = read("K.mtx", text, symmetric=False)
    assert alone == read("K.mtx", f"*MATRIX INPUT, TYPE=UNSYMMETRIC\n{text}")
    both = read("K.mtx", text, symmetric=True)
    assert both == read("K.mtx", f"*MATRIX INPUT, TYPE=SYMMETRIC\n{text}")
    assert np.count_nonzero(both) == np.count_nonzero(alone) + 1
    assert np.array_equal(both, np.transpose(both))


@pytest.mark.parametrize(
    "entries",
    [
        [[0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.0, -0.4, 0.0]],  # in both triangles
        [[0.0, 0.4, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]],  # with the stiffness of contact
    ],
)
def test_friction_that_the_user_calls_symmetric_is_mirrored_with_a_warning(tmp_path, entries):
    """Friction acts in rows without stiffness, and of two bodies in both triangles."""
    np.save(tmp_path / "K.npy", np.array(entries))
    with pytest.warns(InputWarning, match=r"K.npy: .*diagonal is empty.*symmetric: false"):
        read_matrix(tmp_path / "K.npy", symmetric=True)
    assert np.array_equal(
        read_matrix(tmp_path / "K.npy", symmetric=False).matrix.toarray(), entries
    )


COUPLINGS = {
    "a single one": [[0.0, 3.0], [3.0, 0.0]],
    "several": [[0, 3, 0, -1], [3, 0, 0, 0], [0, 0, 0, 0], [-1, 0, 0, 0]],
    "a last multiplier": [[2, -1, 0, 1], [-1, 2, -1, 0], [0, -1, 2, -1], [1, 0, -1, 0]],
    "a first multiplier": [[0, 1, 0, 0], [1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 2]],
}


@pytest.mark.parametrize("triangle", [np.tril, np.triu])
@pytest.mark.parametrize("suffix", [".txt", ".npy"])
@pytest.mark.parametrize("whole", COUPLINGS.values(), ids=COUPLINGS.keys())
def test_couplings_without_a_diagonal_are_mirrored_without_a_warning(
    tmp_path, whole, suffix, triangle
):
    """Couplings alone, and Lagrange multipliers in a half without labels."""
    path = tmp_path / f"K{suffix}"
    half = coo_array(triangle(whole))
    if suffix == ".npy":
        np.save(path, half.toarray())
    else:
        np.savetxt(path, np.transpose([half.row + 1, half.col + 1, half.data]), fmt="%d %d %g")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read_matrix(path, symmetric=True).matrix.toarray()
    assert np.array_equal(found, whole)


def test_a_coupling_in_one_triangle_couples_both_ways(tmp_path):
    """Roots of two oscillators whose coupling is a file of one entry, against SciPy."""
    np.save(tmp_path / "k.npy", [[0.0, 0.5], [0.0, 0.0]])
    (tmp_path / "two.yaml").write_text(
        "M: [[1, 0], [0, 1]]\nK: [{matrix: [[4, 0], [0, 5]]}, {file: k.npy, symmetric: true}]\n"
    )
    answer = squeal.eigenvalues(squeal.read_system(tmp_path / "two.yaml"))
    found = np.sort([root.value.imag for root in answer.eigenvalues if root.value.imag > 0])
    assert found == pytest.approx(np.sort(np.sqrt(eigvals([[4, 0.5], [0.5, 5]]).real)), rel=1e-12)


@pytest.mark.parametrize(
    ("factor", "warned"), [("mu", True), ("2 * mu", True), ("0.4", False), ("2 / 5", False)]
)
def test_friction_at_one_node_that_a_parameter_multiplies_is_mirrored_with_a_warning(
    tmp_path, factor, warned
):
    """Flutter at mu = 0.75 of the whole matrix is lost where its entry is mirrored."""
    (tmp_path / "F.mtx").write_text("1,1,1,2,1.3333333333333333\n")
    (tmp_path / "K.mtx").write_text("1,1,1,1,2.\n1,1,1,2,-1.\n1,2,1,1,-1.\n1,2,1,2,2.\n")
    (tmp_path / "M.mtx").write_text("1,1,1,1,1.\n1,2,1,2,1.\n")
    (tmp_path / "pad.yaml").write_text(
        "parameters: {mu: 0.3}\nM: {file: M.mtx}\n"
        f"K: [{{file: K.mtx}}, {{file: F.mtx, symmetric: true, factor: {factor}}}]\n"
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        squeal.read_system(tmp_path / "pad.yaml")
    messages = [str(one.message) for one in caught if "symmetric: false" in str(one.message)]
    assert len(messages) == warned
    assert all("F.mtx has an empty diagonal" in message for message in messages)


def test_a_half_may_hold_numbers_whose_squares_no_double_holds(read):
    text = "1,1,1,1,3.0e200\n2,1,1,1,-1.0e200\n2,1,2,1,3.0e200\n"
    with pytest.warns(InputWarning, match="symmetric: false"):
        assert read("K.mtx", text) == [[3e200, -1e200], [-1e200, 3e200]]


@given(st.lists(st.sampled_from([None, None, 0.0, -1.0, 2.0]), min_size=16, max_size=16))
@settings(max_examples=200)
def test_sides_are_those_that_a_look_at_each_pair_of_entries_finds(values):
    """None is no entry, and a zero in the file is one."""
    table = [values[4 * i : 4 * i + 4] for i in range(4)]
    places = [(i, j) for i in range(4) for j in range(4) if table[i][j] is not None]
    entries = [table[i][j] for i, j in places]
    rows, columns = np.array(places, dtype=int).reshape(-1, 2).T
    sides = sides_of(csc_array(coo_array((entries, (rows, columns)), shape=(4, 4))))
    off = [(i, j) for i, j in places if i != j]
    assert sides.paired == sum((j, i) in off for i, j in off)
    single = [(i, j) for i, j in off if (j, i) not in off and table[i][j]]
    assert sides.one_sided == len(single)
    diagonal = [table[i][i] or 0.0 for i in range(4)]
    fitting = [table[i][j] ** 2 <= diagonal[i] * diagonal[j] for i, j in single]
    assert sides.fitting == (sum(fitting) if min(diagonal) >= 0.0 else 0)


@pytest.mark.parametrize("stiffness", [0.9, 5.0])
def test_reading_and_check_agree_on_what_is_half_a_stiffness(tmp_path, stiffness):
    """Too weak a diagonal is no stiffness: k_12^2 is at most k_11 k_22."""
    half = np.tril(np.full((4, 4), 1.0)) + (stiffness - 1.0) * np.eye(4)
    np.save(tmp_path / "K.npy", half)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_matrix(tmp_path / "K.npy")
    hints = squeal.check(squeal.System(np.eye(4), K=half)).hints
    assert any("half of a symmetric" in str(one.message) for one in caught) == (stiffness > 1.0)
    assert any("part of a symmetric" in hint for hint in hints) == (stiffness > 1.0)


@pytest.mark.parametrize("suffix", [".mtx", ".npy", ".mat"])
@pytest.mark.parametrize("triangle", [np.tril, np.triu])
def test_a_triangle_that_is_said_to_be_all_is_read_with_a_warning(tmp_path, suffix, triangle):
    """Programs write half of a symmetric matrix under the word general, or as an array."""
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    path = tmp_path / f"K{suffix}"

    def write(matrix):
        if suffix == ".mtx":
            mmwrite(path, coo_array(matrix), symmetry="general")
        elif suffix == ".npy":
            np.save(path, matrix)
        else:
            savemat(path, {"K": matrix})

    write(triangle(K))
    with pytest.warns(InputWarning, match=r"half of a symmetric matrix.*symmetric: true"):
        assert np.array_equal(read_matrix(path).matrix.toarray(), triangle(K))
    assert np.array_equal(read_matrix(path, symmetric=False).matrix.toarray(), triangle(K))
    assert np.array_equal(read_matrix(path, symmetric=True).matrix.toarray(), K)
    friction = np.array([[0.0, 0.4, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    for whole in (K, np.diag([1.0, 2.0, 3.0]), friction):
        write(whole)
        assert np.array_equal(read_matrix(path).matrix.toarray(), whole)  # without a warning


@pytest.mark.parametrize("word", ["*FRICTION", "*Friction", "*friction\n0.5"])
def test_half_a_stiffness_of_a_job_with_friction_is_refused(tmp_path, word):
    """CalculiX writes one half of the unsymmetric matrix of its contact."""
    (tmp_path / "job.sti").write_text("1 1 2\n2 1 -1\n2 2 1\n")
    (tmp_path / "job.dof").write_text("1.1\n2.1\n")
    (tmp_path / "job.inp").write_text(f"*SURFACE INTERACTION,NAME=I\n{word}\n")
    with pytest.raises(InputError, match=r"job\.sti: .*one half.*job\.inp has \*FRICTION"):
        read_matrix(tmp_path / "job.sti")


@pytest.mark.parametrize("coupling", [-1.8, 1.9, 3.0])
def test_half_a_matrix_that_is_indefinite_when_completed_is_refused(tmp_path, coupling):
    """3, 1 and 1 on the diagonal with two couplings to the first: definite below sqrt(1.5)."""
    text = f"1 1 3\n2 1 {coupling / 1.2}\n3 1 {coupling / 1.2}\n2 2 1\n3 3 1\n"
    (tmp_path / "K.sti").write_text(text)
    (tmp_path / "K.dof").write_text("1.1\n2.1\n3.1\n")
    if abs(coupling / 1.2) > np.sqrt(3):  # more than the diagonal allows: no half of a structure
        with pytest.raises(InputError, match="nothing says"):
            read_matrix(tmp_path / "K.sti")
        return
    with pytest.raises(InputError, match="1 negative eigenvalues"):
        read_matrix(tmp_path / "K.sti")
    assert read_matrix(tmp_path / "K.sti", symmetric=True).matrix.nnz == 7
