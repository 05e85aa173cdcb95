"""Columns and entries that several answers share, and what is said of a reduced system."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from squeal.io.writing import Column, JsonObject, columns, number
from squeal.linear.eigen import Eigenvalue

OPEN = "open: "  # how a criterion begins where what is known decides nothing
UNSURE = "not certified: others may be missing"
MOVED = "how far the reduction of components moves this is not known, a higher cutoff tells"


def _finite_condition(root: Eigenvalue) -> float | None:
    """The condition number; None where roots coalesce and it is infinite, which JSON cannot say."""
    return root.condition if root.condition < math.inf else None


ROOT = (
    Column("real", "1/s", lambda root: root.growth_rate),
    Column("imag", "rad/s", lambda root: root.value.imag),
    *columns("frequency_hz damping_ratio%"),
    Column("residual", shown=lambda root: number(root.residual, 2)),
    Column("condition", value=_finite_condition, hidden=True),
)
"""Columns of an eigenvalue, and its keys in JSON."""
ERROR = Column("error", "1/s", shown=lambda e: "-" if e.error is None else number(e.error, 2))


def rounded_growth(row: Any) -> float:
    """The growth rate in three digits: of a long table the rows of the largest are shown."""
    return float(number(row.growth_rate, 3))


def parameter_entry(parameter: str, value: float | None) -> JsonObject:
    """Name and value of the parameter as JSON holds them; whatever its name, `mu` has the value."""
    return {"parameter": parameter, "value": value, "mu": value}


def with_unit(heading: str, unit: str) -> str:
    """The head of a column with its unit, if it has one.

    >>> with_unit("speed", "rad/s"), with_unit("mu", "")
    ('speed, rad/s', 'mu')
    """
    return f"{heading}, {unit}" if unit else heading


def parameter_heading(name: str, others: Collection[str]) -> str:
    """The head of a parameter's column: its name, parameter.NAME if another column has that."""
    return f"parameter.{name}" if name in others else name


def onset_column(parameter: str, unit: str = "") -> Column:
    """The column of where modes begin to grow: at a value, or between two of them."""

    def shown(mode: Any) -> str:
        if mode.onset is None:
            return "-"
        if mode.interval is None:
            return number(mode.onset)
        low, high = map(number, mode.interval)
        return low if low == high else f"{low} to {high}"

    return Column("onset", shown=shown, words=with_unit(f"grows from {parameter}", unit))


def basis_text(basis: Mapping[str, Any], errors: bool = False, counted: bool = False) -> str:
    """Describe a reduced system for people.

    Parameters
    ----------
    basis : mapping
        The reduced system as JSON holds it: its method, "components", "modal" or "reduced", its
        size, the rows of the full system, and what else the method has.
    errors : bool
        Whether the text beside it gives the errors of reduced components.
    counted : bool
        Whether the roots of the full system were counted.
    """
    method = basis["method"]
    size = basis["size"]
    rows = basis["rows"]
    if method == "components":
        text = (
            f"{size} rows reduced from {rows}, modes of components up to "
            f"{basis['cutoff_hz']:g} Hz; counts are of the reduced system"
        )
        if not errors:
            text += f"\n{MOVED}"
        return text
    if method == "modal":
        text = (
            f"first look: real modes up to {basis['real_modes_hz']:.4g} Hz and their corrections, "
            f"{size} vectors"
        )
        if not counted:
            text += "; not certified: nothing was counted"
    else:
        text = (
            f"basis of {size} vectors ({method}), {len(basis['samples'])} solutions of all {rows} "
            f"rows; worst residual there {basis['residual']:.2g}"
        )
    if basis["spurious"]:
        text += f"; {basis['spurious']} roots that the full problem has not are left out"
    if basis["growth_limit"] is not None:
        text += f"\nroots that grow by more than {basis['growth_limit']:.4g} 1/s are left out"
    return text
