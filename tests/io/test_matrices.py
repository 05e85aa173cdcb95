"""Matrix files: every format gives back every digit, and a wrong file one sentence."""

import numpy as np
import pytest
from scipy.io import mmwrite, savemat
from scipy.sparse import coo_array, csc_array, random_array, save_npz

from squeal.errors import InputError
from squeal.io.matrices import aligned, fingerprint, read_matrix, write_matrix


@pytest.fixture
def matrix():
    made = random_array((20, 20), density=0.2, format="csc", rng=np.random.default_rng(1))
    made.data -= 0.3
    return made


@pytest.mark.parametrize("suffix", [".mtx", ".mat", ".npz", ".hb", ".rua", ".txt", ".inp"])
def test_round_trip_to_the_last_bit(tmp_path, matrix, suffix):
    path = tmp_path / f"K{suffix}"
    write_matrix(path, matrix)
    found = read_matrix(path).matrix
    assert np.array_equal(found.toarray(), matrix.toarray())
    assert fingerprint(found) == fingerprint(matrix)


def test_a_triangle_written_by_us_stays_one(tmp_path):
    write_matrix(tmp_path / "K.txt", csc_array(np.triu(np.ones((3, 3)))))
    assert read_matrix(tmp_path / "K.txt").matrix.sum() == 6


def test_keys_pick_one_of_several(tmp_path, matrix):
    savemat(tmp_path / "s.mat", {"M": np.eye(3), "K": matrix, "note": "text"})
    assert read_matrix(tmp_path / "s.mat", "M").matrix.shape == (3, 3)
    with pytest.raises(InputError, match="holds the matrices K, M; name one"):
        read_matrix(tmp_path / "s.mat")
    with pytest.raises(InputError, match="holds no matrix L; it holds K, M"):
        read_matrix(tmp_path / "s.mat", "L")
    np.savez(tmp_path / "s.npz", M=np.eye(3), K=np.ones((3, 3)))
    assert read_matrix(tmp_path / "s.npz", "K").matrix.sum() == 9
    save_npz(tmp_path / "one.npz", matrix)
    with pytest.raises(InputError, match="key K is not allowed; the file holds one sparse matrix"):
        read_matrix(tmp_path / "one.npz", "K")


def test_a_file_that_was_cut_off_is_no_matrix(tmp_path, matrix):
    path = tmp_path / "K.mat"
    savemat(path, {"K": matrix.toarray()})
    path.write_bytes(path.read_bytes()[:400])
    with pytest.raises(InputError, match=r"no readable \.mat matrix"):
        read_matrix(path)


def test_abaqus_text(tmp_path):
    (tmp_path / "K.inp").write_text(
        "** comment\n*MATRIX INPUT, NAME=K, TYPE=SYMMETRIC\n"
        "2,1, 2,1, 4.0\n2,1, 7,3, -1.5\n7,3, 7,3, 2.\n"
    )
    (tmp_path / "M.inp").write_text("2,1,2,1,1e-3\n")
    K, M = read_matrix(tmp_path / "K.inp"), read_matrix(tmp_path / "M.inp")
    assert K.labels == ((2, 1), (7, 3))
    both = aligned([K, M])
    assert both[0].toarray().tolist() == [[4.0, -1.5], [-1.5, 2.0]]
    assert both[1].toarray().tolist() == [[1e-3, 0.0], [0.0, 0.0]]
    (tmp_path / "C.txt").write_text("1 1 1.0\n1 2 0.5\n2 1 -0.5\n")
    C = read_matrix(tmp_path / "C.txt")
    assert C.matrix.toarray().tolist() == [[1.0, 0.5], [-0.5, 0.0]]
    with pytest.raises(InputError, match="cannot be combined"):
        aligned([K, C])
    write_matrix(tmp_path / "big.mtx", csc_array(np.eye(5)))
    assert aligned([C, read_matrix(tmp_path / "big.mtx")])[0].shape == (5, 5)


SYMMETRIC = """\
{title}{key}
             {lines}             1             1             1{rhs}
RSA                        2             2             3             0
(8I10)          (8I10)          (3E26.18)
{rhs_line}         1         3         4
         1         2         2
  4.000000000000000000E+00 -1.500000000000000000E+00  2.000000000000000000E+00
{values}"""


@pytest.mark.parametrize("rhs", [False, True])
def test_symmetric_harwell_boeing(tmp_path, rhs):
    text = SYMMETRIC.format(
        title="t" * 72,
        key="key     ",
        lines=4 if rhs else 3,
        rhs=" " * 13 + "1" if rhs else "",
        rhs_line="F                          1             0\n" if rhs else "",
        values="  1.0  2.0\n" if rhs else "",
    )
    (tmp_path / "K.rsa").write_text(text)
    assert read_matrix(tmp_path / "K.rsa").matrix.toarray().tolist() == [[4.0, -1.5], [-1.5, 2.0]]


def test_op4_by_its_package(tmp_path, matrix):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    op4.write(str(tmp_path / "K.op4"), {"K": matrix})
    assert fingerprint(read_matrix(tmp_path / "K.op4").matrix) == fingerprint(matrix)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("K.csv", "1,2", "the suffix must be one of"),
        ("K.mtx", None, "cannot be read"),
        ("K.mtx", "", "no readable .mtx matrix"),
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 1\n", "2 x 3"),
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 nan\n", "finite"),
        ("K.mtx", "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 2\n", "complex"),
        ("K.mat", "no such thing", "no readable .mat matrix"),
        ("K.npz", "no such thing", "no readable .npz matrix"),
        ("K.hb", "no such thing", "no readable .hb matrix"),
        ("K.hb", "complex\n1 1 1 1 0\nCUA 1 1 1 0\n(1I8)\n1\n", "type CUA; RUA and RSA"),
        ("K.txt", "1 2\n", "2 columns"),
        ("K.txt", "1 x 3\n", "no readable .txt matrix"),
        ("K.txt", "0 1 3\n", "count from 1"),
        ("K.txt", "1.5 1 3\n", "whole numbers"),
        ("K.txt", "** nothing\n", "no entries"),
        ("K.txt", "1 1 1\n9e14 9e14 1\n", "entry 9e14 9e14 1: 9e+14 rows need"),
        (
            "K.mtx",
            "%%MatrixMarket matrix coordinate real general\n"
            "900000000000000 900000000000000 1\n1 1 1\n",
            "9e+14 rows need",
        ),
    ],
)
def test_a_wrong_file_gets_one_sentence(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(InputError) as refused:
        read_matrix(tmp_path / name)
    assert str(tmp_path / name) in str(refused.value)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    with pytest.raises(InputError, match="files hold keys"):
        read_matrix(tmp_path / "K.mtx", "K")
    with pytest.raises(InputError, match="to write"):
        write_matrix(tmp_path / "K.doc", np.eye(2))


@pytest.mark.parametrize(
    ("kind", "line", "allowed"),
    [
        ("coordinate real", "1 1 2.0D+01", "row, column, a number such as -3.4e+05"),
        ("coordinate real", "1 1 2,5", "row, column, a number"),
        ("coordinate real", "1 1 2.5abc", "row, column, a number"),
        ("coordinate real", "1 1 0x10", "row, column, a number"),
        ("coordinate real", "1 1 2.0+101", "row, column, a number"),
        ("coordinate real", "1 1 2 0.1", "row, column, a number"),
        ("coordinate integer", "1 1 2.7", "row, column, a whole number"),
        ("coordinate integer", "1 1 2e3", "row, column, a whole number"),
        ("coordinate complex", "1 1 2 0 7", "row, column, two numbers"),
        ("coordinate pattern", "1 1 2", "row, column"),
        ("array real", "2.0D+01", "a number"),
    ],
)
def test_a_matrix_market_line_is_read_to_its_end(tmp_path, kind, line, allowed):
    path = tmp_path / "K.mtx"
    size = "1 1 1" if kind.startswith("coordinate") else "1 1"
    path.write_text(f"%%MatrixMarket matrix {kind} general\n% note\n\n{size}\n{line}\n")
    with pytest.raises(InputError) as refused:
        read_matrix(path)
    assert f"{path}: no readable .mtx matrix: line 5, {line}: {allowed}" in str(refused.value)
    reason = "; Fortran's exponent D is not read" if "D" in line else ""
    assert str(refused.value).endswith(f" allowed{reason}")


@pytest.mark.parametrize("value", ["-.5e-1", "5.", "1E+3", " 7\t", "7\r"])
@pytest.mark.parametrize("field", ["real", "double", "REAL"])
def test_a_matrix_market_number_may_be_written_in_many_ways(tmp_path, field, value):
    path = tmp_path / "K.mtx"
    head = f"%%MatrixMarket matrix coordinate {field} general\n1 1 1\n"
    path.write_bytes(f"{head}\n 1\t1 {value}".encode())
    assert read_matrix(path).matrix.toarray().tolist() == [[float(value)]]


@pytest.mark.parametrize("field", ["real", "integer", "complex"])
@pytest.mark.parametrize("dense", [False, True])
def test_what_scipy_writes_is_read(tmp_path, field, dense):
    square = np.array([[2, -1], [0, 3]])
    mmwrite(tmp_path / "K.mtx", square if dense else coo_array(square), field=field)
    assert read_matrix(tmp_path / "K.mtx").matrix.toarray().tolist() == square.tolist()


@pytest.mark.parametrize("upper", [False, True])
def test_a_symmetric_file_holds_one_triangle(tmp_path, upper):
    path = tmp_path / "K.mtx"
    corner = "1 2 -1" if upper else "2 1 -1"
    path.write_text(
        f"%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 2\n{corner}\n2 2 3\n"
    )
    assert read_matrix(path).matrix.toarray().tolist() == [[2, -1], [-1, 3]]


@pytest.mark.parametrize(
    ("symmetry", "entries"),
    [("symmetric", "1 2 -1\n2 1 -1\n"), ("skew-symmetric", "1 2 -1\n2 1 1\n")],
)
def test_both_triangles_of_a_symmetric_file_are_not_added(tmp_path, symmetry, entries):
    path = tmp_path / "K.mtx"
    path.write_text(f"%%MatrixMarket matrix coordinate real {symmetry}\n2 2 2\n{entries}")
    with pytest.raises(InputError, match=f"a {symmetry} file holds one triangle"):
        read_matrix(path)


def test_a_skew_symmetric_file_has_no_diagonal(tmp_path):
    path = tmp_path / "G.mtx"
    head = "%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 2\n2 1 -1\n"
    path.write_text(f"{head}2 2 0\n")
    assert read_matrix(path).matrix.toarray().tolist() == [[0, 1], [-1, 0]]
    path.write_text(f"{head}2 2 5\n")
    with pytest.raises(InputError, match="a skew-symmetric file has no diagonal"):
        read_matrix(path)


def harwell_boeing(kind, pointers, rows, values):
    head = f"{'t':80}\n{3:14}{1:14}{1:14}{1:14}{0:14}\n"
    head += f"{kind:14}{2:14}{2:14}{len(rows):14}{0:14}\n{'(8I10)':16}{'(8I10)':16}(8E10.1)\n"
    lists = ("".join(f"{k:10}" for k in numbers) for numbers in (pointers, rows))
    return head + "\n".join([*lists, "".join(f"{v:10.1e}" for v in values)]) + "\n"


def test_both_triangles_of_a_symmetric_harwell_boeing_file_are_not_added(tmp_path):
    path = tmp_path / "K.rsa"
    path.write_text(harwell_boeing("RSA", [1, 3, 5], [1, 2, 1, 2], [2, -1, -1, 3]))
    with pytest.raises(InputError, match="a symmetric file holds one triangle"):
        read_matrix(path)
    path.write_text(harwell_boeing("RUA", [1, 3, 5], [1, 2, 1, 2], [2, -1, -1, 3]))
    assert read_matrix(path).matrix.toarray().tolist() == [[2, -1], [-1, 3]]


@pytest.mark.parametrize("kind", ["RUA", "RSA"])
def test_a_row_beyond_the_last_is_refused(tmp_path, kind):
    path = tmp_path / "K.hb"
    path.write_text(harwell_boeing(kind, [1, 2, 3], [1, 7], [2, 3]))
    with pytest.raises(InputError, match=r"no readable \.hb matrix: .*ind"):
        read_matrix(path)
    np.savez(
        tmp_path / "K.npz",
        format=b"csc",
        shape=[2, 2],
        data=[2.0, 3.0],
        indices=[0, 6],
        indptr=[0, 1, 2],
    )
    with pytest.raises(InputError, match=r"no readable \.npz matrix: .*ind"):
        read_matrix(tmp_path / "K.npz")


def test_matlabs_later_form_is_refused_by_its_name(tmp_path):
    path = tmp_path / "k.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384))
    with pytest.raises(InputError, match=r"HDF5 form \(-v7.3\) is not read; save it with -v7"):
        read_matrix(path)


@pytest.mark.parametrize("suffix", [".hb", ".rua"])
@pytest.mark.parametrize("entry", [0.0, 1e-101, 1e100])
def test_what_harwell_boeing_does_not_hold_is_refused(suffix, entry, tmp_path):
    path = tmp_path / f"K{suffix}"
    with pytest.raises(InputError, match="holds matrices with entries of 1e-99 to 1e99"):
        write_matrix(path, np.diag([entry, entry and 1.0]))
    assert not list(tmp_path.iterdir())
    write_matrix(path, np.diag([1e-99, 9e99]))
    assert read_matrix(path).matrix.diagonal().tolist() == [1e-99, 9e99]


@pytest.mark.parametrize("suffix", [".txt", ".inp", ".mtx"])
def test_rows_without_entries_come_back(suffix, tmp_path):
    write_matrix(tmp_path / f"K{suffix}", csc_array(([2.0], ([0], [1])), shape=(3, 3)))
    write_matrix(tmp_path / f"C{suffix}", csc_array((3, 3)))
    assert read_matrix(tmp_path / f"K{suffix}").matrix.toarray().tolist() == [
        [0, 2, 0],
        [0] * 3,
    ] + [[0] * 3]
    assert read_matrix(tmp_path / f"C{suffix}").matrix.shape == (3, 3)
