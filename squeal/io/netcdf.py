"""Tables as classic netCDF files, which xarray, MATLAB and many others read."""

from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any

import numpy as np


def netcdf(
    units: Mapping[str, str], columns: Mapping[str, Sequence[Any]]
) -> Callable[[IO[Any]], None]:
    """What writes a table to a stream, a variable a column: doubles, None as NaN, or characters.

    `units` become attributes. The dimension bears the name of the first column if that rises
    throughout, so that it is the coordinate of the others, else it is `row`.
    """
    from scipy.io import netcdf_file

    first = next(iter(columns))
    arrays = {name: _array(values) for name, values in columns.items()}
    lead = arrays[first]
    rises = lead.dtype == float and bool((np.diff(lead) > 0.0).all())
    row = first if rises else "row"

    def write(stream: IO[Any]) -> None:
        file = netcdf_file(stream, "w")
        file.source = "squeal"
        file.createDimension(row, len(lead))
        for name, values in arrays.items():
            dimensions: tuple[str, ...] = (row,)
            if values.dtype != float:
                length = max(values.dtype.itemsize, 1)
                dimensions = (row, f"{name}_length")
                file.createDimension(dimensions[1], length)
                values = values.astype(f"S{length}").view("S1").reshape(-1, length)
            variable = file.createVariable(name, "f8" if values.dtype == float else "c", dimensions)
            variable[:] = values
            if units.get(name):
                variable.units = units[name]
        file.close()

    return write


def _array(values: Sequence[Any]) -> np.ndarray:
    if any(isinstance(value, str) for value in values):
        return np.array([("" if v is None else str(v)).encode() for v in values], dtype=bytes)
    return np.array([np.nan if value is None else value for value in values], dtype=float)
