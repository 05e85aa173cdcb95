"""Matrix files: every format gives back every digit, and a wrong file one sentence."""

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array, random_array, save_npz

from squeal.errors import InputError
from squeal.files.matrices import aligned, fingerprint, read_matrix, write_matrix


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
