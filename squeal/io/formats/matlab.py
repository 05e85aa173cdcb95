"""MATLAB: files of version 5 (save -v7) and of 7.3 (HDF5), with fields of structs.

Version 5 is read here, since SciPy trusts what stands in the file: a damaged one ends the process.
"""

import math
import zlib
from collections.abc import Callable, Iterator
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.io.formats.matrix_file import (
    MOST_FULL,
    NamedMatrices,
    check_full_size,
    matrices_by_name,
)

if TYPE_CHECKING:
    import h5py

NESTED = 8  # structs within structs that are looked into
COMPLEX = 0x08  # among the flags of an array
NUMBER_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4"}  # of data elements
NUMBER_TYPES |= {7: "f4", 9: "f8", 12: "i8", 13: "u8"}

Matrix: TypeAlias = csc_array | NDArray


class ElementType(IntEnum):
    """Types of data elements, of 1 to 18, that hold others."""

    MATRIX = 14
    COMPRESSED = 15


class ArrayClass(IntEnum):
    """Classes of arrays; from SPARSE to UINT64 they hold numbers."""

    STRUCT = 2
    SPARSE = 5
    UINT64 = 15


class _Element(NamedTuple):
    """A data element of version 5: its type and its bytes."""

    kind: int
    data: bytes


def read_mat(path: Path) -> NamedMatrices:
    """The matrices of a file by their names, such as model.K for a field of a struct.

    Raises InputError, ValueError.
    """
    with path.open("rb") as stream:
        head = stream.read(128)
    version = head[124:]
    if version in (b"\x00\x01IM", b"\x01\x00MI"):
        return _read_version_5(path)
    if version == b"\x00\x02IM":
        return _read_hdf5(path)
    raise ValueError("save -v7 of MATLAB writes what is read, or -v7.3 with h5py")


def _read_version_5(path: Path) -> NamedMatrices:
    """The matrices of a file of version 5 by their names. Raises InputError, ValueError."""
    data = path.read_bytes()
    # bytes 126 and 127 of the header hold the word MI: IM if its low byte comes first
    order = "<" if data[126:128] == b"IM" else ">"
    named: list[tuple[str, Matrix]] = []
    sizes: list[tuple[int]] = []  # how many numbers each matrix holds
    try:
        for name, matrix in _variables(data[128:], order):
            named.append((name, matrix))
            sizes.append((matrix.size,))
            check_full_size(path, sizes)  # before the next one takes memory
    except InputError:  # a ValueError too, but its sentence is for the user
        raise
    except (ValueError, LookupError, zlib.error):
        raise ValueError("the file is damaged") from None
    return matrices_by_name(named)


def _variables(data: bytes, order: str) -> Iterator[tuple[str, Matrix]]:
    """Name and matrix of each array of numbers among data elements, also of those in structs.

    `order` of bytes is < or >. Text and the like is left out. Raises ValueError, LookupError,
    zlib.error.
    """
    for element in _elements(data, order):
        if element.kind == ElementType.COMPRESSED:
            (element,) = _elements(_decompress(element.data), order)  # a compressed one holds one
        if element.kind != ElementType.MATRIX:
            raise ValueError
        if element.data:
            yield from _array(element.data, order, "")


def _decompress(content: bytes) -> bytes:
    """The bytes behind a compressed element. Raises InputError, ValueError, zlib.error."""
    decompressor = zlib.decompressobj()
    data = decompressor.decompress(content, 8 * MOST_FULL + 100 * len(content))
    if decompressor.unconsumed_tail:
        raise InputError("more numbers than so small a file may hold; a sparse matrix may")
    return data


def _elements(data: bytes, order: str) -> list[_Element]:
    """The data elements that follow each other in some bytes. Raises ValueError.

    A tag of 8 bytes holds type and size. The data follow, padded to whole words of 8 bytes unless
    they are compressed. An element with at most 4 bytes of data may be short: its size and type
    stand in the first half of the tag, its data in the second half.
    """
    elements = []
    position = 0
    while position < len(data):
        kind, size = np.frombuffer(data[position : position + 8], f"{order}u4").tolist()
        start = position + 8
        small_size = kind >> 16
        if small_size:
            size = small_size
            kind &= 0xFFFF
            end = start
            start -= 4  # the second half of the tag
        elif kind == ElementType.COMPRESSED:
            end = start + size
        else:
            padding = -size % 8
            end = start + size + padding
        content = data[start : min(start + size, end)]  # of a damaged short element: 4 bytes only
        if not 1 <= kind <= 18 or len(content) != size:
            raise ValueError
        elements.append(_Element(kind, content))
        position = end
    return elements


def _array(data: bytes, order: str, prefix: str) -> Iterator[tuple[str, Matrix]]:
    """The name and the matrix of an array; of a struct those of its fields; none of text.

    data: the bytes of the array's data element; order: that of the bytes of a number, "<" or ">";
    prefix: what stands before the name, as `model.` does before a field of the struct `model`.
    Raises ValueError, LookupError.
    """
    flags, dimensions, name, *parts = _elements(data, order)
    flag_word, _ = np.frombuffer(flags.data, f"{order}u4").tolist()
    array_class = flag_word & 0xFF  # the lowest byte; the flags stand in the next one
    if array_class > ArrayClass.UINT64:  # functions and objects, such as tables, have no dimensions
        return
    shape = np.frombuffer(dimensions.data, f"{order}i4").tolist()
    is_complex = bool(flag_word >> 8 & COMPLEX)
    full_name = prefix + name.data.decode("latin-1")
    if not full_name or len(shape) != 2:  # no matrix that a key can name
        return
    if min(shape) < 0:
        raise ValueError
    if array_class == ArrayClass.STRUCT:
        yield from _struct(parts, order, full_name, math.prod(shape))
    elif array_class == ArrayClass.SPARSE:
        indices, values = _numbers(parts, order, is_complex)
        rows, starts = map(_integers, indices)  # the row of each entry; where columns start
        count = starts[-1]
        if not 0 <= count <= min(len(rows), len(values)):
            raise ValueError
        yield full_name, csc_array((values[:count], rows[:count], starts), shape=shape)
    elif ArrayClass.SPARSE < array_class <= ArrayClass.UINT64:
        indices, values = _numbers(parts, order, is_complex)
        if indices:
            raise ValueError
        yield full_name, values.reshape(shape, order="F")


def _numbers(parts: list[_Element], order: str, is_complex: bool) -> tuple[list[NDArray], NDArray]:
    """The indices of an array, none of a full one, and its values. Raises ValueError.

    `parts` are the indices of rows and the starts of columns of a sparse array, the real parts, and
    the imaginary parts of a complex one.
    """
    arrays = [np.frombuffer(part.data, order + NUMBER_TYPES[part.kind]) for part in parts]
    *indices, values = arrays
    if is_complex:
        imaginary = values
        *indices, real = indices
        values = real + 1j * imaginary.reshape(real.shape)
    return indices, values


def _integers(indices: NDArray) -> NDArray[np.int64]:
    """The indices of rows or the starts of columns of a sparse array. Raises ValueError."""
    if indices.dtype.kind not in "iu":
        raise ValueError("the file is damaged")
    return indices.astype(np.int64)


def _struct(
    parts: list[_Element], order: str, full_name: str, count: int
) -> Iterator[tuple[str, Matrix]]:
    """Names and matrices in the fields of an array of `count` structs, named `full_name`.

    `parts` are the width of a name, the names padded to it, and the fields, those of the first
    struct first. `order` of bytes is < or >. Structs within more than `NESTED` others are left
    out. Raises ValueError, LookupError.
    """
    name_width, padded_names, *fields = parts
    width = int(np.frombuffer(name_width.data, f"{order}i4")[0])
    if width < 1 or len(padded_names.data) % width:
        raise ValueError
    keys = []
    for start in range(0, len(padded_names.data), width):
        padded = padded_names.data[start : start + width]
        keys.append(padded.split(b"\0")[0].decode("latin-1"))
    if len(fields) != len(keys) * count:
        raise ValueError
    if full_name.count(".") >= NESTED:
        return
    for i, field in enumerate(fields):
        member, key_index = divmod(i, len(keys))
        # model(2).K for the field K of the second struct, model.K for that of a single one
        member_name = f"{full_name}({member + 1})" if count > 1 else full_name
        if field.kind == ElementType.MATRIX and field.data:
            yield from _array(field.data, order, f"{member_name}.{keys[key_index]}")


def _read_hdf5(path: Path) -> dict[str, Matrix]:
    """The matrices of a file of version 7.3 by their names. Raises InputError, ValueError.

    Such a file holds transposed arrays, sparse ones as groups data, ir, jc, and structs as groups.
    """
    import h5py

    def numbers(dataset: h5py.Dataset) -> NDArray:
        check_full_size(path, [dataset.shape])
        stored: NDArray = dataset[()]
        if stored.dtype.names:  # complex numbers are records of two
            return stored["real"] + 1j * stored["imag"]
        return stored

    matrices: dict[str, Matrix] = {}

    def collect(group: h5py.Group, prefix: str) -> None:
        for name, item in group.items():
            if name.startswith("#"):  # MATLAB's own, as what references point to
                continue
            if "MATLAB_sparse" in item.attrs:
                matrices[prefix + name] = _sparse_group(item, numbers)
            elif isinstance(item, h5py.Group):  # a struct
                if prefix.count(".") < NESTED:
                    collect(item, f"{prefix}{name}.")
            elif getattr(item, "ndim", 0) == 2 and _is_numeric(item):
                matrices[prefix + name] = numbers(item).T

    with h5py.File(path) as file:
        collect(file, "")
    return matrices


def _sparse_group(group: "h5py.Group", numbers: "Callable[[h5py.Dataset], NDArray]") -> csc_array:
    """The sparse matrix in a group; one without entries needs neither data nor ir.

    Raises InputError, ValueError.
    """
    starts = _integers(numbers(group["jc"]))
    shape = (int(group.attrs["MATLAB_sparse"]), len(starts) - 1)
    if not starts.any():
        return csc_array(shape)
    rows = _integers(numbers(group["ir"]))
    return csc_array((numbers(group["data"]), rows, starts), shape=shape)


def _is_numeric(dataset: "h5py.Dataset") -> bool:
    """Whether a dataset of HDF5 holds numbers, neither references nor text."""
    return dataset.dtype.kind in "biufcV" and dataset.attrs.get("MATLAB_class") != b"char"
