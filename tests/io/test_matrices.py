"""Matrix files: every format gives back every digit, and a wrong file one sentence."""

import gzip
import os
import struct
import sys
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import hb_write, mmwrite, savemat
from scipy.sparse import coo_array, csc_array, save_npz
from scipy.sparse.linalg import eigsh

import squeal
from squeal.errors import InputError, InputWarning
from squeal.examples.brake import FILES, solid_brake, write_brake
from squeal.io.formats.matrix_file import MatrixFile
from squeal.io.matrices import aligned, fingerprint, read_matrix, write_matrix
from squeal.io.system_files import read_system

WRITTEN = (".mtx", ".mat", ".npz", ".hb", ".txt")
BANNER = "%%MatrixMarket matrix coordinate real"


def put(path, matrix):
    """Write a matrix; SciPy writes Harwell-Boeing, and text is that of Abaqus."""
    if path.suffix == ".hb":
        hb_write(path, csc_array(matrix))
    elif path.suffix == ".txt":
        dense = csc_array(matrix).toarray()
        table = [(i + 1, j + 1, value) for (i, j), value in np.ndenumerate(dense)]
        np.savetxt(path, table, fmt="%d %d %.17g", header="* TYPE=UNSYMMETRIC", comments="*")
    else:
        write_matrix(path, matrix)


@pytest.mark.parametrize("suffix", [".mtx", ".mat", ".npz"])
def test_complex_matrices_come_back_complex(tmp_path, matrix, suffix):
    damped = matrix * (1 + 0.1j)
    write_matrix(tmp_path / f"K{suffix}", damped)
    found = read_matrix(tmp_path / f"K{suffix}").matrix
    assert np.array_equal(found.toarray(), damped.toarray())
    assert fingerprint(found) == fingerprint(damped) != fingerprint(matrix)
    write_matrix(tmp_path / f"K{suffix}", matrix + 0j)  # nothing imaginary in it
    assert fingerprint(read_matrix(tmp_path / f"K{suffix}").matrix) == fingerprint(matrix)


def test_complex_stiffness_is_taken_and_complex_mass_refused(tmp_path):
    write_matrix(tmp_path / "K.npz", np.array([[4.0 + 0.4j, -1.0], [-1.0, 2.0]]))
    write_matrix(tmp_path / "M.npz", np.eye(2))
    text = "M: {file: %s}\nK: {file: K.npz}\n"
    (tmp_path / "s.yaml").write_text(text % "M.npz")
    system = read_system(tmp_path / "s.yaml").system
    assert not system.real
    assert system.at()[2][0, 0] == 4.0 + 0.4j
    (tmp_path / "s.yaml").write_text(text % "K.npz")
    with pytest.raises(InputError, match=r"M.file: K.npz is complex"):
        read_system(tmp_path / "s.yaml")


@pytest.mark.parametrize("hint", ["", ".mtx", ".dat"])
@pytest.mark.parametrize("suffix", WRITTEN)
def test_round_trip_to_the_last_bit_whatever_the_suffix_says(tmp_path, matrix, suffix, hint):
    path = tmp_path / f"K{suffix}"
    put(path, matrix)
    path = path.rename(tmp_path / f"K{hint or suffix}")
    found = read_matrix(path).matrix
    assert np.array_equal(found.toarray(), matrix.toarray())
    assert fingerprint(found) == fingerprint(matrix)


@settings(max_examples=50)
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=9, max_size=9))
def test_every_double_comes_back_from_text(tmp_path_factory, values):
    matrix = np.array(values).reshape(3, 3)
    for suffix in (".mtx", ".txt"):
        path = tmp_path_factory.mktemp("text") / f"K{suffix}"
        put(path, matrix)
        assert np.array_equal(read_matrix(path).matrix.toarray(), matrix)


def test_an_array_of_numpy_is_a_matrix_if_it_has_two_dimensions(tmp_path):
    np.save(tmp_path / "K.npy", np.array([[4.0, -1.0], [-1.0, 2.0]]))
    assert read_matrix(tmp_path / "K.npy").matrix.toarray().tolist() == [[4.0, -1.0], [-1.0, 2.0]]
    np.save(tmp_path / "v.npy", np.ones(3))
    with pytest.raises(InputError, match="an array of 1 dimensions; a matrix has two"):
        read_matrix(tmp_path / "v.npy")
    np.save(tmp_path / "o.npy", np.array([[None]]), allow_pickle=True)
    with pytest.raises(InputError, match="no readable NumPy matrix"):
        read_matrix(tmp_path / "o.npy")


@pytest.mark.parametrize("kind", [">f8", ">f4", "<f2", ">f2", ">i4", ">c16"])
def test_an_array_of_either_byte_order_and_of_half_precision_is_a_matrix(tmp_path, kind):
    array = np.array([[4.1, -1.0], [-1.0, 2.0]]).astype(kind)
    np.save(tmp_path / "K.npy", array)
    np.savez(tmp_path / "K.npz", K=array)
    is_short_float = kind in (">f4", "<f2", ">f2")
    for name in ("K.npy", "K.npz"):
        file = read_matrix(tmp_path / name)
        assert file.matrix.toarray().tolist() == array.tolist()
        assert file.floats == (array.dtype if is_short_float else None)


def test_keys_pick_one_of_several_in_the_case_written(tmp_path, matrix):
    savemat(tmp_path / "s.mat", {"M": np.eye(3), "Kaa": matrix, "kaa": np.eye(2), "note": "text"})
    np.savez(tmp_path / "s.npz", M=np.eye(3), K=np.ones((3, 3)))
    for key, rows in {"M": 3, "Kaa": 20, "kaa": 2}.items():
        assert read_matrix(tmp_path / "s.mat", key).matrix.shape == (rows, rows)
    assert read_matrix(tmp_path / "s.npz", "K").matrix.sum() == 9
    for key in (None, "KAA", "m", "L"):
        with pytest.raises(InputError, match="Kaa, M, kaa"):
            read_matrix(tmp_path / "s.mat", key)
    with pytest.raises(InputError, match="holds no matrix k; it holds K, M"):
        read_matrix(tmp_path / "s.npz", "k")
    save_npz(tmp_path / "one.npz", matrix)
    with pytest.raises(InputError, match="key K"):
        read_matrix(tmp_path / "one.npz", "K")


@pytest.mark.parametrize("friction", ["", "\n  - {file: F.pch, symmetric: false}"])
def test_a_matrix_of_other_nodes_than_all_others_is_refused(tmp_path, friction):
    for name, node in {"K": 1, "F": 1, "M": 7}.items():
        card = f"DMIG,K,{node},1,,{node},1,2.\n"
        (tmp_path / f"{name}.pch").write_text(f"DMIG,K,0,6,2\n{card}")
    (tmp_path / "s.yaml").write_text(f"K:\n  - {{file: K.pch}}{friction}\nM: {{file: M.pch}}\n")
    with pytest.raises(InputError, match=r"M\.file: no other matrix .* M\.pch.* node 7, dof 1;"):
        read_system(tmp_path / "s.yaml")


@pytest.mark.parametrize(
    "text", ["1 1 1.04D+03\n1 2 0\n2 2 -2.5d-1\n2 1 0\n", "1,1,1040.\n2,2,-.25\n"]
)
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf", b"** note\n", b"\xef\xbb\xbf** note\n"])
def test_abaqus_text_may_have_exponents_of_fortran_and_a_byte_order_mark(read, text, mark):
    assert read("K.mtx", mark + text.encode()) == [[1040.0, 0.0], [0.0, -0.25]]


def test_matrix_market_may_have_a_byte_order_mark(read):
    assert read("K.txt", f"\ufeff{BANNER} general\n1 1 1\n1 1 2.5\n") == [[2.5]]


def test_comments_of_abaqus_text_say_nothing_of_its_matrix(tmp_path):
    comments = (
        "** wear 50 %, job #3\n ** SCALE FACTOR = 0.5 was applied\n** subtype=symmetric rotor\n"
    )
    (tmp_path / "K.mtx").write_text(f"{comments}*MATRIX INPUT, NAME=K\n1,1,1,1, 2.0\n")
    K = read_matrix(tmp_path / "K.mtx")
    assert K.matrix.sum() == 2.0
    assert not K.symmetric


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (
            "%%MatrixMarket matrix coordinate real general\n3 3 1\n",
            [[5, 0, 0], [0, 0, 0], [0, 0, 0]],
        ),
        ("*MATRIX INPUT\n3 3 1\n", [[5, 0, 0], [0, 0, 0], [0, 0, 1]]),
        ("3 3 1.0\n", [[5, 0, 0], [0, 0, 0], [0, 0, 1]]),
        ("2 2 1\n3 3 0\n", [[5, 0, 0], [0, 1, 0], [0, 0, 0]]),  # not as many lines follow
    ],
)
def test_a_first_line_that_cannot_be_mistaken_is_read(read, head, expected):
    assert read("C.txt", f"{head}1 1 5.0\n") == expected


def test_abaqus_text_is_placed_by_its_labels(tmp_path):
    (tmp_path / "job_STIF1.mtx").write_text(
        "** comment\n*MATRIX INPUT, NAME=K, TYPE=SYMMETRIC\n"
        "2,1, 2,1, 4.0\n2,1, 7,3, -1.5\n7,3, 7,3, 2.\n"
    )
    (tmp_path / "job_MASS1.mtx").write_text("2,1,2,1,1e-3\n")
    K = read_matrix(tmp_path / "job_STIF1.mtx")
    M = read_matrix(tmp_path / "job_MASS1.mtx")
    assert K.labels == ((2, 1), (7, 3))
    both = aligned([K, M])
    assert both[0].toarray().tolist() == [[4.0, -1.5], [-1.5, 2.0]]
    assert both[1].toarray().tolist() == [[1e-3, 0.0], [0.0, 0.0]]
    (tmp_path / "C.txt").write_text("1 1 1.0\n1 2 0.5\n2 1 -0.5\n")
    C = read_matrix(tmp_path / "C.txt")
    assert C.matrix.toarray().tolist() == [[1.0, 0.5], [-0.5, 0.0]]
    with pytest.raises(InputError, match="cannot be combined"):
        aligned([K, C])
    (tmp_path / "two.yaml").write_text("M: {file: job_MASS1.mtx}\nK: {file: C.txt}\n")
    with pytest.raises(InputError, match=r"C\.txt: the rows have no labels .* needs a \.mapping"):
        squeal.read_system(tmp_path / "two.yaml")
    write_matrix(tmp_path / "big.mtx", csc_array(np.eye(5)))
    assert aligned([C, read_matrix(tmp_path / "big.mtx")])[0].shape == (5, 5)


@pytest.mark.parametrize("order", [1, -1])
def test_rows_that_are_only_numbered_go_with_the_same_rows_in_any_order_of_files(order):
    shell = MatrixFile(csc_array(np.eye(3)), ((1, 1), (2, 1), (-1, 1)), numbered=True)
    solid = MatrixFile(csc_array(np.eye(2)), ((1, 1), (2, 1)))
    with pytest.raises(InputError, match="rows"):
        aligned([shell, solid][::order])


def test_abaqus_keywords_name_scale_and_divide_the_matrices_of_a_text(read):
    text = "*MATRIX INPUT, NAME=Kc, TYPE=UNSYMMETRIC, SCALE FACTOR=2.\n** note\n1,1,1,2,3.\n"
    assert read("s.inp", text) == [[0, 6], [0, 0]]
    two = f"{text}*MATRIX INPUT, NAME=M\n1,1,1,1,1.\n** note\n1,2,1,2,1.\n"
    assert read("s.inp", two, key="Kc") == [[0, 6], [0, 0]]
    assert read("s.inp", two, key="M") == [[1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("text", "total"),
    [
        (f"{BANNER} general\n2 2 3\n1 1 1\n2 1 4\n2 1 3\n", 8),
        (f"{BANNER} symmetric\n2 2 3\n1 1 1\n2 1 4\n2 1 3\n", 15),
        ("1 1 1.0\n2 1 4.0\n1 2 0\n2 1 3.0\n", 8),
    ],
)
def test_entries_that_meet_are_summed_with_a_warning(read, text, total):
    with pytest.warns(InputWarning, match="1 entries .* row 2, column 1"):
        assert np.sum(read("K.mtx", text)) == total


def harwell_boeing(kind, pointers, rows, values, sides=0):
    """A file of two rows; `sides` right-hand sides follow."""
    lines = 3 + sides
    n = len(pointers) - 1
    head = f"{'t':80}\n{lines:14}{1:14}{1:14}{1:14}{sides or '':14}\n"
    head += f"{kind:14}{n:14}{n:14}{len(rows):14}{0:14}\n"
    head += f"{'(8I10)':16}{'(8I10)':16}{'(8E10.1)':20}\n"
    head += f"F{sides:27}{0:14}\n" if sides else ""
    text = head + "".join(f"{k:10}" for k in pointers) + "\n"
    text += "".join(f"{k:10}" for k in rows) + "\n"
    text += "".join(f"{v:10.1e}" for v in values) + "\n"
    return text + "   1.0e+00   2.0e+00\n" * sides


@pytest.mark.parametrize("sides", [0, 1])
def test_one_triangle_of_harwell_boeing_stands_for_both_with_or_without_right_sides(read, sides):
    text = harwell_boeing("RSA", [1, 3, 4], [1, 2, 2], [4.0, -1.5, 2.0], sides)
    assert read("K.rsa", text) == [[4.0, -1.5], [-1.5, 2.0]]


def test_harwell_boeing_may_hold_no_entry(read):
    assert read("K.hb", harwell_boeing("RUA", [1, 1, 1], [], [])) == [[0.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize("kind", ["RSA", "RZA"])
def test_harwell_boeing_may_hold_both_triangles_that_agree(read, kind):
    sign = 1.0 if kind == "RSA" else -1.0
    text = harwell_boeing(kind, [1, 2, 3], [2, 1], [-1.5, -1.5 * sign])
    assert read("K.rsa", text) == [[0.0, -1.5 * sign], [-1.5, 0.0]]
    wrong = harwell_boeing(kind, [1, 2, 3], [2, 1], [-1.5, 2.5 * sign])
    with pytest.raises(InputError, match="holds both triangles, and they differ"):
        read("K.rsa", wrong)


def test_fields_that_touch_and_labels_of_ansys_harwell_boeing_are_read(tmp_path, read):
    """Numbers that touch, D for E, complex, and the file that names the rows."""
    (tmp_path / "K.mapping").write_text("Matrix Eqn  Node  DOF\n 1  11 UX\n 2  11 ROTZ\n")
    head = f"{'K':72}{'K':8}\n{3:14}{1:14}{1:14}{1:14}{0:14}\n{'CSA':14}{2:14}{2:14}{2:14}{0:14}\n"
    text = f"{head}{'(3I4)':16}{'(2I4)':16}{'(4D9.2)':20}\n   1   3   3\n   1   2\n"
    text += " 4.00D+00-1.00D-01-2.50D+00 0.00D+00\n"
    assert read("K.txt", text) == [[4 - 0.1j, -2.5], [-2.5, 0]]
    assert read_matrix(tmp_path / "K.txt").labels == ((11, 1), (11, 6))


@pytest.mark.parametrize("name", ["WARP", "VOLT", "VX", "MAG", "ENKE", "7"])
def test_hbmat_names_any_degree_of_freedom(tmp_path, name):
    """Beams with warping, and acoustic, electric and magnetic elements, have others than UX."""
    (tmp_path / "K.hb").write_text(harwell_boeing("RUA", [1, 2, 3], [1, 2], [2, 3]))
    (tmp_path / "K.mapping").write_text(f"Matrix Eqn  Node  DOF\n 1  5 UX\n 2  5 {name}\n")
    first, second = read_matrix(tmp_path / "K.hb").labels
    assert first == (5, 1)
    assert second[0] == 5
    assert second != first


DMIG = """$ a comment
GRID    1               0.      0.      0.
DMIG    K       0       6       4       0                       8
DMIG*   K                              2               1
*                      2               1 4.000000000D+00 1.000000000D-01
DMIG    K       7       3               2       1       -1.5
        7       3       2.0+1
CBAR,9,9,1,2,1.,0.,0.
+,7,3,.5
dmig,m,0,1,1,0
DMIG,M,2,1,,2,1,1.-3,
+,7,3,.5
DMIG,M,7,3,,2,1,-.25
"""


def test_dmig_is_read_alike_in_small_large_and_free_fields(tmp_path):
    (tmp_path / "job.pch").write_text(DMIG)
    K = read_matrix(tmp_path / "job.pch", "K")
    M = read_matrix(tmp_path / "job.pch", "M")
    assert K.labels == M.labels == ((2, 1), (7, 3))
    assert K.matrix.toarray().tolist() == [[4 + 0.1j, -1.5], [-1.5, 20]]
    assert M.matrix.toarray().tolist() == [[1e-3, -0.25], [0.5, 0]]  # GJ, CJ is the column


MARKED = """DMIG    K       0       6       1       0                       2
DMIG*   K                              1               1                *A
*A                     1               1 5.0 D+5                        *B
*B                     2               1-2.5 D+5
DMIG*   K                              2               1                *C
*C                     2               1 1.5+5
"""


@pytest.mark.parametrize("mark", ["*A", "*", "*K1", "*12", "* B"])
def test_dmig_continuations_may_carry_any_mark(tmp_path, mark):
    """A card's name ends with *, a mark begins with it; MSC's sample decks write both."""
    text = MARKED.replace("*A      ", f"{mark:8}").replace("*B      ", f"{mark:8}")
    (tmp_path / "K.pch").write_text(text)
    K = read_matrix(tmp_path / "K.pch").matrix
    assert K.toarray().tolist() == [[5e5, -2.5e5], [-2.5e5, 1.5e5]]


def test_of_several_dmig_matrices_only_the_one_picked_is_built(tmp_path):
    """PARAM,EXTOUT,DMIGPCH writes the rectangular VAX beside the matrices."""
    text = MARKED + "DMIG,VAX,0,9,1,,,,1\nDMIG,VAX,1,0,,1,1,1.\n"
    (tmp_path / "K.pch").write_text(text)
    assert read_matrix(tmp_path / "K.pch", "K").matrix.shape == (2, 2)
    with pytest.raises(InputError, match=r"VAX has the form 9 \(rectangular\)"):
        read_matrix(tmp_path / "K.pch", "VAX")
    with pytest.raises(InputError, match=r"matrices K \(symmetric\), VAX \(rectangular\)"):
        read_matrix(tmp_path / "K.pch")


def write_bar(folder, stem, labels, rows=4):
    """K and M of a fixed-free chain of unit springs and masses in lower triangles, with labels."""
    folder.mkdir(exist_ok=True)
    K = ""
    for i in range(1, rows):
        K += f"{i} {i} 2\n{i + 1} {i} -1\n"
    K += f"{rows} {rows} 1\n"
    (folder / f"{stem}.sti").write_text(K)
    (folder / f"{stem}.mas").write_text("".join(f"{i} {i} 1\n" for i in range(1, rows + 1)))
    (folder / f"{stem}.dof").write_text("".join(f"{label}\n" for label in labels))
    text = f"M: {{file: {stem}.mas}}\nK: {{file: {stem}.sti}}\n"
    (folder / f"{stem}.yaml").write_text(text)
    return folder / f"{stem}.yaml"


CHAIN = 2 * np.sin(np.pi * np.arange(1, 8, 2) / 18)  # of four masses, fixed and free


@pytest.mark.filterwarnings("ignore::squeal.errors.InputWarning")
@pytest.mark.parametrize(
    "labels",
    [
        ("1.1", "1.1", "2.1", "2.1"),  # an expanded beam
        ("3.1", "1.1", "3.1", "2.1"),
        ("1.1", "1.1", "1.1", "1.1"),
        ("1.1", "2.1", "2.2", "2.2"),
        ("1.1", "2.1", "3.1", "4.1"),
    ],
)
def test_rows_that_share_a_label_are_not_added(tmp_path, labels):
    """CalculiX gives several rows of an expanded shell or beam one label."""
    system = read_system(write_bar(tmp_path, "bar", labels)).system
    M, _, K = system.at()
    values = eigsh(csc_array(K), 3, csc_array(M), sigma=0, return_eigenvectors=False)
    assert np.sqrt(np.sort(values)) == pytest.approx(CHAIN[:3], rel=1e-12)


@pytest.mark.filterwarnings("ignore::squeal.errors.InputWarning")
def test_rows_that_share_labels_are_told_apart_within_one_job_alone(tmp_path):
    write_bar(tmp_path, "one", ("1.1", "1.1", "2.1", "3.1"))
    path = write_bar(tmp_path, "two", ("1.1", "2.1", "2.1", "3.1"))
    path.write_text("M: {file: one.mas}\nK: {file: two.sti}\n")
    with pytest.raises(InputError, match="one job"):
        read_system(path)


def test_calculix_names_its_rows_in_a_file_beside(tmp_path):
    (tmp_path / "b.sti").write_text("1 1 4.0\n2 1 -1.0\n2 2 3.0\n3 3 1.0\n")
    (tmp_path / "b.mas").write_text("1 1 1.0\n2 2 1.0\n")
    (tmp_path / "b.dof").write_text("5.1\n4.3\n9.2\n")
    with pytest.warns(InputWarning, match="symmetric: false"):
        K = read_matrix(tmp_path / "b.sti")
    M = read_matrix(tmp_path / "b.mas")
    assert K.labels == M.labels == ((5, 1), (4, 3), (9, 2))
    both = aligned([K, M])
    assert both[0].toarray().tolist() == [[3, -1, 0], [-1, 4, 0], [0, 0, 1]]  # by node
    assert both[1].diagonal().tolist() == [1, 1, 0]


@pytest.mark.parametrize("binary", [True, False])
def test_op4_that_pyyeti_writes_comes_back(tmp_path, matrix, binary):
    with np.printoptions():  # which the package changes
        op4 = pytest.importorskip("pyyeti.nastran.op4")
    square = {"KXX": matrix, "K4XX": matrix.toarray() * (1 + 0.1j)}
    op4.write(str(tmp_path / "K.dat"), square, binary=binary)
    for key, one in square.items():
        assert fingerprint(read_matrix(tmp_path / "K.dat", key).matrix) == fingerprint(one)


def _write_two_of_one_name(path):
    """Matrices K, K and M, the two K different, as other programs write them or their bytes."""
    K = np.array([[2.0, -1.0], [-1.0, 3.0]])
    matrices = [K, 1e4 * K, np.eye(2)]
    if path.suffix == ".op4":
        with np.printoptions():  # which the package changes
            op4 = pytest.importorskip("pyyeti.nastran.op4")
        op4.write(str(path), ["K", "k" if "case" in path.stem else "K", "M"], matrices)
    elif path.suffix == ".mat":  # variables appended, as a second `save` without -append does not
        parts = []
        for name, matrix in zip("KKM", matrices, strict=True):
            savemat(path, {name: matrix})
            parts.append(path.read_bytes()[128:])
        path.write_bytes(path.read_bytes()[:128] + b"".join(parts))
    else:
        block = "*MATRIX INPUT, NAME={}\n1,1,1,1, {}\n"
        text = "".join(block.format(*pair) for pair in zip("KKM", (2.0, 2e4, 1.0), strict=True))
        path.write_text(text)


@pytest.mark.parametrize("name", ["d.op4", "case.op4", "d.mat", "d.inp"])
def test_matrices_of_one_name_are_numbered_and_the_name_picks_none(tmp_path, name):
    _write_two_of_one_name(tmp_path / name)
    assert read_matrix(tmp_path / name, "M").matrix.diagonal()[0] == 1.0
    assert read_matrix(tmp_path / name, "K(1)").matrix.diagonal()[0] == 2.0
    assert read_matrix(tmp_path / name, "K(2)").matrix.diagonal()[0] == 2e4
    with pytest.raises(InputError, match=r"holds no matrix K; it holds K\(1\), K\(2\), M"):
        read_matrix(tmp_path / name, "K")


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_two_arrays_of_one_name_in_an_archive_are_refused(tmp_path):
    with ZipFile(tmp_path / "d.npz", "w") as archive:
        for value in (2.0, 3.0):
            with archive.open("K.npy", "w") as member:
                np.save(member, np.array([[value]]))
    with pytest.raises(InputError, match="two arrays of one name among K, K"):
        read_matrix(tmp_path / "d.npz", "K")


class Uncompiled:
    """A module of pyyeti where no folder for what Numba compiles can be written."""

    def __getattr__(self, name):
        raise RuntimeError("cannot cache function '_numba_interp': no locator available")


@pytest.mark.parametrize("name", ["K.op4", "job.op2"])
def test_a_library_that_cannot_be_loaded_is_not_laid_on_the_file(tmp_path, monkeypatch, name):
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", Uncompiled())
    monkeypatch.setitem(sys.modules, "pyyeti.nastran.op2", Uncompiled())
    (tmp_path / name).write_bytes(b"1")
    with pytest.raises(InputError, match=f"{name}: pyyeti: cannot cache .*NUMBA_CACHE_DIR"):
        read_matrix(tmp_path / name)


def test_op2_that_is_laid_out_by_hand_is_read(tmp_path):
    """A label, then each block by name and trailer; of a column the runs of what is not zero."""

    def record(form, *values):
        data = struct.pack("<" + form, *values)
        return struct.pack("<i", len(data)) + data + struct.pack("<i", len(data))

    def keys(*numbers):
        return b"".join(record("i", number) for number in numbers)

    def block(name, columns, kind):
        word = record("8s", name.encode().ljust(8))
        size = len(columns)
        body = keys(2) + word + keys(-1, 7) + record("7i", 101, size, size, 6, kind, size, 0)
        body += keys(-2, 1, 0, 2) + word + keys(-3, 1)
        for count, runs in enumerate(columns, 4):
            body += keys(1)
            for row, *values in runs:
                body += keys(1 + 2 * len(values)) + record(f"i{len(values)}d", row, *values)
            body += keys(-count, 1)
        return body + keys(0, 0)

    head = (
        keys(3) + record("3i", 11, 24, 26) + keys(7) + record("28s", b"NASTRAN FORT TAPE ID CODE")
    )
    head += keys(2) + record("8s", b"LABEL") + keys(-1, 0)
    K = [[(1, 4.0, -1.0)], [(1, -1.0, 3.0)], [(3, 2.5)]]
    B = [[(1, 1.0, 0.5)], [], [(1, 2.0, 0.0), (3, 0.0, -1.0)]]
    (tmp_path / "job.op2").write_bytes(head + block("KAA", K, 2) + block("BAA", B, 4) + keys(0))
    found = [read_matrix(tmp_path / "job.op2", key) for key in ("KAA", "BAA")]
    assert [one.form for one in found] == ["Nastran OP2"] * 2
    assert found[0].matrix.toarray().tolist() == [[4, -1, 0], [-1, 3, 0], [0, 0, 2.5]]
    assert found[1].matrix.toarray().tolist() == [[1 + 0.5j, 0, 2], [0, 0, 0], [0, 0, -1j]]
    twice = 2 * block("KAA", K, 2)
    (tmp_path / "job.op2").write_bytes(head + twice + keys(0))
    with pytest.raises(InputError, match=r"it holds KAA\(1\), KAA\(2\)"):
        read_matrix(tmp_path / "job.op2", "KAA")


def test_an_ansys_full_is_read_without_its_constrained_rows():
    """The cantilever that the package ships has the frequencies that it prints."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    K, M = aligned([read_matrix(examples.fullfile, key) for key in "KM"])
    assert K.shape == (900, 900)
    hertz = np.sqrt(eigsh(K, 4, M, sigma=0)[0]) / (2 * np.pi)
    assert hertz == pytest.approx([1283.200, 1283.200, 5781.975, 6919.399], abs=1e-3)


READER = """
import os, types
import numpy as np

def read_binary(path):
    print("a word of the package")
    words = open(path).read()
    if words == "crash":
        os.abort()
    if words == "more":
        np.ones(2 * 10**9)
    if words == "refused":
        raise type("Own", (Exception,), {})("no such matrix")
    K, M = np.triu(np.arange(1.0, 17.0).reshape(4, 4)), np.diag([1.0, 2, 3, 4])
    rows, held = np.array([[3, 0], [3, 1], [3, 2], [4, 0]]), np.array([[3, 1]])
    return types.SimpleNamespace(load_km=lambda: (rows, K, M), const=held)
"""


@pytest.fixture
def full(tmp_path, monkeypatch):
    """Another reader in the place of Ansys' own."""
    reader = tmp_path / "ansys" / "mapdl" / "reader.py"
    reader.parent.mkdir(parents=True)
    reader.write_text(READER, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path / "a.full"


def test_an_ansys_full_is_read_by_a_reader_in_its_place(full):
    """Triangles of node 3, whose second row is held, and of node 4."""
    full.write_text("any", encoding="utf-8")
    found = read_matrix(full, "K")
    assert found.labels == ((3, 1), (3, 3), (4, 1))
    assert found.matrix.toarray().tolist() == [[1, 3, 4], [3, 11, 12], [4, 12, 16]]
    assert read_matrix(full, "M").matrix.diagonal().tolist() == [1, 3, 4]


@pytest.mark.parametrize(
    ("content", "reason"), {"crash": "damaged", "more": "allocate", "refused": "no such"}.items()
)
def test_a_full_that_its_reader_does_not_survive_is_refused(full, content, reason):
    full.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=reason):
        read_matrix(full, "K")


@pytest.mark.parametrize("form", FILES)
def test_a_brake_written_as_a_program_would_has_the_same_matrices(tmp_path, form):
    """Halves, labels and all digits; punch files hold ten of them."""
    brake = solid_brake(500, around=12)
    write_brake(tmp_path / form, brake, form)
    found = read_system(tmp_path / form / "system.yaml").system  # without a warning
    for read, own in zip(found.at(), brake.system.at(), strict=True):
        allowed = 1e-9 if form == "nastran" else 1e-15
        assert abs(read - own).max() <= allowed * abs(own).max()


def lines(head, *body):
    return "\n".join([f"%%MatrixMarket matrix {head}", *body]) + "\n"


def coordinates(*body, kind="real general"):
    return "K.mtx", lines(f"coordinate {kind}", *body)


SUBSTRUCTURE = """**
** GENERATED BY CALCULIX
**
*USER ELEMENT,NODES=2,LINEAR
** ELEMENT NODES
1,1
*MATRIX,TYPE=STIFFNESS
 1.00000000000000E+03
"""
# file, content, and what the refusal names
REFUSED = [
    ("K.csv", "1,2", "suffix"),
    ("K.mtx", None, "cannot be read"),
    ("K.mtx", "", "Matrix Market"),
    (*coordinates("2 3 1", "1 1 1"), "2 x 3"),
    (*coordinates("1 1 1", "1 1 nan"), "finite"),
    (*coordinates("2 2 1", "1 3 1"), "index 2"),
    (*coordinates("2 2 1", "1 1.5 1"), "whole numbers"),
    (*coordinates("2 2 1", "0 1 1"), "from 1"),
    (*coordinates("2 2 2", "1 1 1"), "2 are"),
    (*coordinates("2 2", "1 1 1"), "3 numbers"),
    (*coordinates("2 2 1", "1 1 1", kind="real hermitian"), "hermitian"),
    ("K.mtx", lines("array real general", "30000 30000", "1"), "900000000 are"),
    (*coordinates("300000000 300000000 1", "1 1 1"), "3e+08 rows"),
    (*coordinates("2 2 2", "1 2 1", "2 1 1", kind="real symmetric"), "one triangle"),
    (*coordinates("2 2 2", "1 2 1", "2 1 1", kind="real skew-symmetric"), "one triangle"),
    (*coordinates("2 2 2", "1 2 1", "1 1 1", kind="real skew-symmetric"), "diagonal"),
    (*coordinates("1 1 1", "1 1 2.0D+01"), "2.0D+01"),
    *((*coordinates("1 1 1", f"1 1 {x}"), x) for x in ("2,5", "2.5abc", "0x10", "2.0+101")),
    (*coordinates("1 1 2", "1 1 2", "1 1"), "columns"),
    (*coordinates("1 1 1", "1 1 2.7", kind="integer general"), "whole numbers"),
    ("K.mat", "no such thing", "MATLAB"),
    ("k.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384), "MATLAB"),
    ("K.hb", "no such thing", "Harwell-Boeing"),
    ("K.hb", "elements\n1 1 1 1 0\nRSE 1 1 1 0\n(1I8)\n1\n", "RSE", "assembled"),
    ("K.rsa", harwell_boeing("RSA", [1, 3, 5], [1, 2, 1, 2], [2, -1, -2, 3]), "both triangles"),
    ("K.hb", harwell_boeing("RUA", [1, 2, 3], [1, 7], [2, 3]), "ind"),
    ("K.hb", "t\n1 1 1 1 0\nRUA 9 9 999999999 0\n(8I9)\n1\n1\n", "fewer numbers"),
    ("K.hb", harwell_boeing("RUA", [1, 2, 3], [1, 2], [2, 3]).replace("RUA", "RHA"), "RHA"),
    (
        "K.hb",
        harwell_boeing("RUA", [1, 2, 3], [1, 2], [2, 3]).replace("(8E10.1)  ", "(4(2E9.1))"),
        "(4(2E9.1)) is not read",
    ),
    ("K.pch", "DMIG,K,0,1,1\nDMIG,K,1,1,,1,1.5,2.\n", "whole numbers"),
    ("K.pch", "DMIG,K,0,9,1\nDMIG,K,1,1,,1,1,2.\n", "form 9"),
    ("K.pch", "DMIG,K,1,1,,1,1,2.\n", "missing"),
    ("K.pch", "DMIG,K,0,6,1\nDMIG,K,1,1,,1,1,2. 3\n", "no number"),
    ("K.txt", "1 2\n", "2 columns"),
    ("K.txt", "1.5e+00 2e+00 3e+00 4e+00\n", "4 columns", ".npy"),
    ("K.mtx", "1.5e+00 2e+00 3e+00 4e+00\n", "its first line is '1.5e+00 2e+00 3e+00 4e+00';"),
    ("K.mtx", "\n", "its first line is empty"),
    ("K.mtx", "1;1;2.5\n", "its first line is '1;1;2.5';"),
    ("K.txt", "1;1;2.5\n", "; is not", "commas or blanks"),
    ("K.mtx.gz", gzip.compress(b"1 1 2.5\n", mtime=0), "unpack"),
    ("K.mtx", gzip.compress(b"1 1 2.5\n", mtime=0), "unpack"),
    ("K.pch", "GRID,1,,0.,0.,0.\n", "holds no matrix", "DMIG"),
    ("K.mtx", SUBSTRUCTURE, "the keyword *USER ELEMENT", "substructure"),
    ("K.txt", "1 x 3\n", "x"),
    ("K.txt", "** nothing\n", "no entries"),
    ("K.txt", "1 1 x\n1 1 1\n", "x"),
    ("K.txt", "1.5 1 1\n", "1.5", "whole"),
    ("K.txt", "0 1 1\n", "from 1"),
    ("C.txt", "3 3 1\n1 1 5.0\n", "3 3 1, may hold the sizes", "%%MatrixMarket", "*MATRIX INPUT"),
    ("C.dat", "3,3,2\n\n1,2,0.4\n2,3,0.4\n", "3 3 2, may hold the sizes"),
    ("K.txt", "1,1,1,1,2.\n1,1,1,2\n", "columns"),
    ("K.mtx", "1,1,1,1,2,5\n1,2,1,2,2,5\n", "point"),
    ("K.txt", "% by hand\n2 2 1\n1 1 1\n", "% is not"),
    ("K.dat", "# by hand\n1 1 1\n", "suffix"),
    ("K.mtx", "*CLOAD\n1, 1, 4.0\n", "*CLOAD"),
    ("K.inp", "*MATRIX INPUT, NAME=K\n1,1,1\n*MATRIX INPUT, NAME=K\n1,1,1\n", "K(1), K(2)"),
    ("K.pch", "DMIG,K,0,1,2\nDMIG,K,1,1,,1,1,2.\nDMIG,K,0,1,2\nDMIG,K,1,1,,1,1,3.\n", "twice"),
    ("K.txt", "1 1 1\n300000000 300000000 1\n", "3e+08 rows"),
]


@pytest.mark.parametrize(("name", "content", "parts"), [(n, c, p) for n, c, *p in REFUSED])
def test_a_wrong_file_gets_one_sentence(tmp_path, read, name, content, parts):
    with pytest.raises(InputError) as refused:
        read(name, content) if content is not None else read_matrix(tmp_path / name)
    assert "\n" not in str(refused.value)
    for part in (str(tmp_path / name), *parts):
        assert part in str(refused.value)


def test_what_cannot_hold_a_matrix_is_refused(tmp_path, matrix):
    savemat(tmp_path / "K.mat", {"K": matrix.toarray()})
    (tmp_path / "K.mat").write_bytes((tmp_path / "K.mat").read_bytes()[:400])
    arrays: Any = {"data": [2.0, 3.0], "indices": [0, 6], "indptr": [0, 1, 2]}
    np.savez(tmp_path / "K.npz", format=b"csc", shape=[2, 2], **arrays)
    os.mkfifo(tmp_path / "pipe.mtx")
    write_matrix(tmp_path / "K.mtx", matrix)
    for name in ("K.mat", "K.npz", "pipe.mtx", ".", "K.mtx"):
        with pytest.raises(InputError, match=str(tmp_path)):
            read_matrix(tmp_path / name, "K" if name == "K.mtx" else None)
    with pytest.raises(InputError, match=r"K\.doc"):
        write_matrix(tmp_path / "K.doc", np.eye(2))


def test_small_files_become_no_large_arrays(tmp_path, monkeypatch):
    """What is packed tightly, or named only, is refused before it is made."""
    for module in ("matrix_file", "matlab"):
        monkeypatch.setattr(f"squeal.io.formats.{module}.MOST_FULL", 1000)
    large = np.zeros((100, 100))
    np.savez_compressed(tmp_path / "K.npz", K=large)
    savemat(tmp_path / "K.mat", {"K": large}, do_compression=True)
    savemat(tmp_path / "bytes.mat", {"K": large.astype(np.int8)}, do_compression=True)
    (tmp_path / "K.hb").write_text("t\n1 1 1 1 0\nRUA 2 2 3 0\n(999999999I9)(1I9)(1I9)\n1\n1\n1\n")
    for name in ("K.npz", "K.mat", "bytes.mat", "K.hb"):
        with pytest.raises(InputError, match="numbers"):
            read_matrix(tmp_path / name)


@pytest.mark.parametrize("value", ["-.5e-1", "5.", "1E+3", " 7\t", "7\r"])
def test_a_matrix_market_number_may_be_written_in_many_ways(read, value):
    text = lines("coordinate DOUBLE general", "% note\n", f"1 1 1\n\n 1\t1 {value}")
    assert read("K.mtx", text) == [[float(value)]]


def test_the_ones_of_a_pattern_are_an_assumption(tmp_path):
    head = "%%MatrixMarket matrix coordinate pattern symmetric"
    (tmp_path / "K.mtx").write_text(f"{head}\n2 2 3\n1 1\n2 1\n2 2\n")
    (tmp_path / "s.yaml").write_text("M: [[1, 0], [0, 1]]\nK: {file: K.mtx}\n")
    with pytest.warns(InputWarning, match="K.mtx: the file is a pattern without numbers"):
        file = read_system(tmp_path / "s.yaml")
    (assumption,) = file.assumptions
    assert "each entry is taken as 1" in assumption
    assert not squeal.eigenvalues(file).certified


@pytest.mark.filterwarnings("ignore:.*pattern without numbers")
@pytest.mark.parametrize("entry", ["real", "integer", "complex", "pattern"])
@pytest.mark.parametrize("kind", ["general", "symmetric", "skew-symmetric"])
@pytest.mark.parametrize("form", [np.array, coo_array])
def test_what_scipy_writes_is_read(tmp_path, entry, kind, form):
    if entry == "pattern" and (form is np.array or kind == "skew-symmetric"):
        return
    some = np.array([[2, -1, 5], [0, 3, 4], [1, 7, 0]])
    square = {"general": some, "symmetric": some + some.T}.get(kind, some - some.T)
    square = (square != 0).astype(int) if entry == "pattern" else square
    mmwrite(tmp_path / "K.mtx", form(square), field=entry, symmetry=kind)
    assert np.array_equal(read_matrix(tmp_path / "K.mtx").matrix.toarray(), square)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_titles_and_comments_have_letters_of_any_encoding(tmp_path, encoding):
    comment = "Prüfstand"
    market = tmp_path / "market.mtx"
    market.write_text(
        f"%%MatrixMarket matrix coordinate real general\n% {comment}\n1 1 1\n1 1 2.5\n",
        encoding=encoding,
    )
    abaqus = tmp_path / "abaqus.mtx"
    abaqus.write_text(f"** {comment}\n1,1, 1,1, 2.5\n", encoding=encoding)
    boeing = tmp_path / "boeing.rua"
    hb_write(boeing, csc_array([[2.5]]))
    _, *lines = boeing.read_text(encoding="ascii").splitlines()
    boeing.write_text("\n".join([f"{comment:72}{'key':8}", *lines]) + "\n", encoding=encoding)
    for path in (market, abaqus, boeing):
        assert read_matrix(path).matrix.toarray() == [[2.5]]


@pytest.mark.parametrize("name", ["K.dat", "K.DAT", "K.bdf"])
def test_cards_below_a_long_case_control_are_found(tmp_path, name):
    """A job of MSC Nastran ends in .dat, and its first DMIG may stand far below."""
    control = "$ " + 70 * "-" + "\nSOL 103\nCEND\n" + 80 * ("$ " + 70 * "-" + "\n") + "BEGIN BULK\n"
    bulk = "DMIG, K, 0, 6, 1, 0\nDMIG, K, 7, 1,, 7, 1, 2.5\nENDDATA\n"
    (tmp_path / name).write_text(control + bulk)
    file = read_matrix(tmp_path / name)
    assert file.labels == ((7, 1),)
    assert file.matrix.toarray() == [[2.5]]
