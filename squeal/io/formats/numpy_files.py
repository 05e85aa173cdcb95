"""Files of NumPy: one array of save, one matrix of SciPy's save_npz, or the arrays of savez by
their names."""

from pathlib import Path
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import load_npz

from squeal.io.formats.matrix_file import MatrixFile, check_full_size, file_of_array


def read_npy(path: Path) -> MatrixFile:
    """The matrix of a file of one array. Raises InputError, ValueError."""
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    check_full_size(path, [array.shape])
    if array.ndim != 2:
        raise ValueError(f"an array of {array.ndim} dimensions; a matrix has two")
    return file_of_array(np.asarray(array))


def read_npz(path: Path) -> MatrixFile | dict[str, NDArray]:
    """The matrix, or the arrays, of an archive. Raises InputError, ValueError."""
    with ZipFile(path) as members:
        check_full_size(path, [(member.file_size // 8,) for member in members.infolist()])
    with np.load(path, allow_pickle=False) as archive:
        if "format" in archive:
            return MatrixFile(load_npz(path))
        arrays = dict(archive)
        if len(arrays) < len(archive.files):
            raise ValueError(f"two arrays of one name among {', '.join(archive.files)}")
    check_full_size(path, [array.shape for array in arrays.values()])
    return arrays
