"""Matrices of MATLAB files of versions 5 and 7.3, and files that are damaged."""

import contextlib
import struct
import zlib

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.io.matrices import fingerprint, read_matrix


def test_fields_of_structs_of_matlab_have_the_names_that_matlab_gives_them(tmp_path, matrix):
    K = np.array([[2.0, -1.0], [-1.0, 3.0]])
    inner = {"C": 1j * K, "note": "text", "parts": np.array([1, "a"], dtype=object)}
    several = np.zeros((1, 2), dtype=[("K", object)])
    several[0, 0] = (K,)
    several[0, 1] = (3 * K,)
    for compressed in (False, True):
        path = tmp_path / f"{compressed}.mat"
        model = {"model": {"K": matrix, "in": inner}, "runs": several, "K": 2 * K}
        savemat(path, model, do_compression=compressed)
        assert fingerprint(read_matrix(path, "model.K").matrix) == fingerprint(matrix)
        for key, value in {"model.in.C": 1j * K, "runs(2).K": 3 * K, "K": 2 * K}.items():
            assert np.array_equal(read_matrix(path, key).matrix.toarray(), value)
        with pytest.raises(InputError, match=r"holds K, model.K, model.in.C, runs\(1\).K"):
            read_matrix(path, "M")


def test_a_field_of_a_matlab_7_3_struct_is_read_and_no_reference(tmp_path):
    h5py = pytest.importorskip("h5py")
    K = np.array([[2.0, -1.0], [-3.0, 3.0]])
    with h5py.File(tmp_path / "s.mat", "w", userblock_size=512) as file:
        model = file.create_group("model")
        model.attrs["MATLAB_class"] = np.bytes_("struct")
        model["K"] = K.T
        model.create_dataset("parts", (1, 2), dtype=h5py.ref_dtype)
        file.create_group("#refs#")["a"] = K
        model["itself"] = model
    with (tmp_path / "s.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    assert np.array_equal(read_matrix(tmp_path / "s.mat", "model.K").matrix.toarray(), K)
    with pytest.raises(InputError, match="holds no matrix a"):
        read_matrix(tmp_path / "s.mat", "a")


def test_sparse_and_complex_matrices_of_matlab_7_3_are_read_and_text_is_left_out(tmp_path, matrix):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "K.mat", "w", userblock_size=512) as file:
        sparse = file.create_group("K")
        sparse.attrs["MATLAB_sparse"] = 20
        for name, numbers in zip(
            ("data", "ir", "jc"), (matrix.data, matrix.indices, matrix.indptr), strict=True
        ):
            sparse[name] = numbers
        file["C"] = (matrix.toarray().T * (1 + 0.1j)).view([("real", "f8"), ("imag", "f8")])
        file["note"] = np.zeros((2, 2), "u2")
        file["note"].attrs["MATLAB_class"] = np.bytes_("char")
    with (tmp_path / "K.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    assert fingerprint(read_matrix(tmp_path / "K.mat", "K").matrix) == fingerprint(matrix)
    C = read_matrix(tmp_path / "K.mat", "C").matrix
    assert np.array_equal(C.toarray(), matrix.toarray() * (1 + 0.1j))
    with pytest.raises(InputError, match="C, K;"):
        read_matrix(tmp_path / "K.mat")


@pytest.mark.parametrize(("place", "byte"), [(128, 13), (145, 255), (152, 0), (176, 0), (182, 99)])
def test_a_damaged_matlab_file_does_not_end_the_process(tmp_path, matrix, place, byte):
    """A first element that is no matrix, an imaginary part that is missing, elements without a
    type, one that is too long."""
    given = matrix * (1 - 2j)
    savemat(tmp_path / "K.mat", {"K": given, "note": "text", "cell": [[1, "a"]]})
    assert fingerprint(read_matrix(tmp_path / "K.mat", "K").matrix) == fingerprint(given)
    savemat(tmp_path / "K.mat", {"K": np.eye(4)})
    whole = bytearray((tmp_path / "K.mat").read_bytes())
    whole[place] = byte
    (tmp_path / "K.mat").write_bytes(whole)
    with pytest.raises(InputError, match="damaged"):
        read_matrix(tmp_path / "K.mat")


def mat_element(kind, numbers):
    """A data element of version 5 of some type, padded to whole words."""
    data = np.asarray(numbers).tobytes()
    return np.array([kind, len(data)], "<u4").tobytes() + data + bytes(-len(data) % 8)


def sparse_element(rows, starts):
    """A sparse matrix K (2, 2) whose stored numbers have the types of the arrays (i4 or f8)."""
    content = [
        mat_element(6, np.array([5, 2], "<u4")),  # the class sparse, room for two entries
        mat_element(5, np.array([2, 2], "<i4")),
        mat_element(1, np.frombuffer(b"K", "i1")),
        *(mat_element(9 if x.dtype.kind == "f" else 5, x) for x in (rows, starts)),
        mat_element(9, np.array([3.0, 4.0], "<f8")),
    ]
    return mat_element(14, np.frombuffer(b"".join(content), "u1"))


def compressed(data, times):
    for _ in range(times):
        packed = zlib.compress(data)
        data = np.array([15, len(packed)], "<u4").tobytes() + packed
    return data


ROWS = np.array([0, 1], "<i4")


STARTS = np.array([0, 1, 2], "<i4")


@pytest.mark.parametrize(
    ("rows", "starts", "times"),
    [
        (ROWS, STARTS.astype("<f8"), 0),
        (ROWS, np.array([0.0, 1.0, np.inf]), 0),
        (ROWS.astype("<f8") / 2, STARTS, 0),  # it was read as the rows 0 and 0
        (ROWS, STARTS, 2),
        (ROWS, STARTS, 1500),
    ],
)
def test_a_matlab_file_that_no_program_writes_is_damaged(tmp_path, rows, starts, times):
    """Indices that are no integers, and compressed elements in compressed ones."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    path = tmp_path / "K.mat"
    for usual in (0, 1):
        path.write_bytes(head + compressed(sparse_element(ROWS, STARTS), usual))
        assert read_matrix(path).matrix.toarray().tolist() == [[3.0, 0.0], [0.0, 4.0]]
        assert loadmat(path)["K"].toarray().tolist() == [[3.0, 0.0], [0.0, 4.0]]
    path.write_bytes(head + compressed(sparse_element(rows, starts), times))
    with pytest.raises(InputError, match=r"K\.mat: .*the file is damaged$"):
        read_matrix(path)


@pytest.mark.parametrize("broken", ["ir", "jc"])
def test_indices_of_matlab_7_3_that_are_no_integers_are_damaged(tmp_path, broken):
    h5py = pytest.importorskip("h5py")
    numbers = {"data": np.array([3.0, 4.0]), "ir": ROWS, "jc": STARTS}
    numbers[broken] = numbers[broken] * 1.5
    with h5py.File(tmp_path / "K.mat", "w", userblock_size=512) as file:
        group = file.create_group("K")
        group.attrs["MATLAB_sparse"] = 2
        for name, values in numbers.items():
            group[name] = values
    with (tmp_path / "K.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    with pytest.raises(InputError, match=r"K\.mat: .*the file is damaged$"):
        read_matrix(tmp_path / "K.mat")


def test_matlab_files_of_version_4_are_refused(tmp_path):
    """SciPy reads them, and 228 bytes may then take 5 GB."""
    savemat(tmp_path / "K.mat", {"K": np.eye(4)}, format="4")
    with pytest.raises(InputError, match="-v7"):
        read_matrix(tmp_path / "K.mat")


def test_pointers_that_decrease_are_refused_where_the_last_one_is_zero(tmp_path, matrix):
    """SciPy looks at none of them then, and writes past the end of the entries that there are."""
    savemat(tmp_path / "K.mat", {"K": matrix})
    pointers = matrix.indptr.astype("<i4").tobytes()
    whole = (tmp_path / "K.mat").read_bytes()
    (tmp_path / "K.mat").write_bytes(whole.replace(pointers, pointers[:-4] + bytes(4)))
    with pytest.raises(InputError, match="pointers"):
        read_matrix(tmp_path / "K.mat")


@pytest.mark.parametrize("packed", [False, True])
def test_a_matlab_file_changed_anywhere_is_read_or_refused(tmp_path, packed):
    """Also where it is packed, a change of a byte or a word inside."""
    some = np.array([[4.0, -1.0], [-1.0, 3.0]])
    path = tmp_path / "K.mat"
    for kind in (np.array, csc_array):
        savemat(path, {"K": kind(some * (1 + 1j))})
        whole = path.read_bytes()
        for place in range(128, len(whole)):
            for word in (b"\0", b"\x08", b"\0\0\0\x80"):
                data = whole[:place] + word + whole[place + len(word) :]
                if packed:
                    inside = zlib.compress(data[128:])
                    data = data[:128] + struct.pack("<II", 15, len(inside)) + inside
                path.write_bytes(data)
                with contextlib.suppress(InputError):
                    assert np.all(np.isfinite(read_matrix(path).matrix.data))


def element(kind, content):
    """A data element of version 5, padded to whole words of 8 bytes."""
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def opaque(name):
    """An object as MATLAB saved a table in 2020: it has no dimensions, and of its names the first
    is that of the variable."""
    flags = element(6, struct.pack("<II", 17, 0))
    words = b"".join(element(1, word) for word in (name, b"MCOS", b"table"))
    matrix = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1))
    reference = element(14, matrix + element(1, b"") + element(6, struct.pack("<6I", *range(6))))
    return element(14, flags + words + reference)


@pytest.mark.parametrize("name", [b"results", b"s", b"names of all runs"])
@pytest.mark.parametrize("compressed", [False, True])
def test_objects_of_matlab_beside_matrices_are_left_out(tmp_path, matrix, name, compressed):
    """Tables, strings and times, which MATLAB keeps as objects, made the file a damaged one."""
    path = tmp_path / "workspace.mat"
    savemat(path, {"K": matrix}, do_compression=compressed)
    content = opaque(name)
    if compressed:
        content = zlib.compress(content)
        content = struct.pack("<II", 15, len(content)) + content
    data = path.read_bytes()
    path.write_bytes(data[:128] + content + data[128:] + content)
    assert fingerprint(read_matrix(path).matrix) == fingerprint(matrix)


def test_a_compressed_matrix_without_the_end_of_its_stream_is_read(tmp_path, matrix):
    """As two files of MATLAB of 2020 end; all numbers are there."""
    path = tmp_path / "workspace.mat"
    savemat(path, {"K": matrix}, do_compression=True)
    data = path.read_bytes()
    (size,) = struct.unpack("<I", data[132:136])
    path.write_bytes(data[:132] + struct.pack("<I", size - 4) + data[136:-4])
    assert fingerprint(read_matrix(path).matrix) == fingerprint(matrix)
