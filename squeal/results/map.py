"""The verdict over two parameters."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.writing import Answer, Column, JsonObject, Table, copied_attributes, in_order, plain
from squeal.results.columns import parameter_heading
from squeal.results.sources import Source
from squeal.schema import Number, Place, Whole


@dataclass(frozen=True)
class Axis:
    """One parameter of a map: n values at the middles of n equal cells between low and high.

    log: the cells are equal in the logarithm. Raises InputError for an empty range.

    Examples
    --------
    >>> Axis("mu", 0.0, 1.0, 4).values.tolist()
    [0.125, 0.375, 0.625, 0.875]
    """

    name: str
    low: float
    high: float
    n: int
    log: bool = False

    def __post_init__(self) -> None:
        at = Place("Axis", self.name)
        Whole(1, 100_000).read(self.n, at / "n")
        Number().check(self.low, at, "low")
        Number().check(self.high, at, "high")
        if not self.low < self.high or (self.log and not self.low > 0.0):
            allowed = "a range with low < high"
            if self.log:
                allowed += ", above 0 on a logarithmic axis"
            raise at.must_be(f"{self.low:g} to {self.high:g}", allowed)

    @property
    def values(self) -> NDArray[np.float64]:
        """The n values."""
        return self.at((np.arange(self.n) + 0.5) / self.n)

    def at(self, share: Any) -> Any:
        """Values at shares of the way from low to high.

        Examples
        --------
        >>> Axis("k", 1.0, 100.0, 2, log=True).at(0.5).item()
        10.0
        """
        if self.log:
            low = np.log10(self.low)
            high = np.log10(self.high)
            return 10.0 ** (low + (high - low) * share)
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, eq=False, repr=False)
class Map(Answer):
    """The verdict over two parameters.

    codes (n1, n2): indices into `verdicts`; quantity: name, unit and values (n1, n2) of a number
    beside them; admissible (n1, n2): where a pad has an equilibrium that the model means.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
    >>> axes = squeal.Axis("mu", 0, 1, 3), squeal.Axis("gap", 0, 1, 2)
    >>> found = squeal.map(pair, axes)  # flutter from mu = gap on
    >>> [[found.verdicts[code] for code in row] for row in found.codes]
    [['marginal', 'marginal'], ['flutter', 'marginal'], ['flutter', 'flutter']]
    """

    grid = (0, 1)

    name: str
    axes: tuple[Axis, Axis]
    units: tuple[str, str]
    verdicts: tuple[str, ...]
    codes: NDArray[np.int8]
    quantity: tuple[str, str, NDArray[np.float64]] | None = None
    admissible: NDArray[np.bool_] | None = None
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    source: Source | None = None

    @property
    def share(self) -> dict[str, float]:
        """Share of the points that each verdict has, each point the middle of a cell of its own.

        It approximates the verdict's share of the area, of a logarithmic axis as it is drawn.
        """
        counts = np.bincount(self.codes.ravel(), minlength=len(self.verdicts))
        shares = counts / self.codes.size
        return dict(zip(self.verdicts, shares.tolist(), strict=True))

    def table(self) -> Table:
        # name, unit and values (n1, n2) of each column that is not a parameter
        results = [("verdict", "", np.array(self.verdicts)[self.codes])]
        if self.quantity is not None:
            results.append(self.quantity)
        if self.admissible is not None:
            results.append(("admissible", "", 1 * self.admissible))  # printed as 1 or 0
        names = [name for name, _, _ in results]
        first, second = self.axes
        grid = np.meshgrid(first.values, second.values, indexing="ij")
        columns = []
        for axis, unit, values in zip(self.axes, self.units, grid, strict=True):
            columns.append((parameter_heading(axis.name, names), unit, values))
        columns += results
        heads = [(name, unit) for name, unit, _ in columns]
        # one row for each point of the map; the second parameter varies fastest
        cells = [values.ravel().tolist() for _, _, values in columns]
        return Table(in_order(heads), list(zip(*cells, strict=True)))

    def parts(self) -> Sequence[str | Table]:
        first, second = self.axes
        title = f"share of the area: {first.name} x {second.name}, {first.n} x {second.n} points"
        share = Column("share, %", value=lambda pair: f"{100 * pair[1]:.3f}")
        shares = (Column("verdict", value=itemgetter(0)), share)
        return [Table(shares, list(self.share.items()), title), *self.notes]

    def curves(self) -> Table:
        """A row for each point of each curve on which stability is lost.

        Raises InputError for a map that was computed without curves.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> axes = squeal.Axis("mu", 0.1, 0.9, 3), squeal.Axis("k1", 1.9e7, 2.1e7, 2)
        >>> found = squeal.map(squeal.Scene("B3", pad), axes, curves=True)
        >>> sorted({row["kind"] for row in found.curves().records()})
        ['flutter']
        """
        if "threshold_curve" not in self.details:
            raise InputError("curves: were not computed; map(..., curves=True) does so")
        rows = []
        for curve_number, curve in enumerate(self.details["threshold_curve"], 1):
            for point, hertz in zip(curve["points"], curve["frequency_hz"], strict=True):
                rows.append((curve_number, *point, curve["kind"], hertz))
        names = ["curve", *(axis.name for axis in self.axes), "kind", "frequency_hz"]
        return Table(in_order(zip(names, ["", *self.units, "", ""], strict=True)), rows)

    def to_dict(self) -> JsonObject:
        axes = []
        for axis in self.axes:
            scale = "log" if axis.log else "linear"
            axes.append(copied_attributes(axis, "name low high n") | {"scale": scale})
        # n: of the first axis; `axes` has that of both
        answer = {"share": self.share, "n": int(self.codes.shape[0]), "axes": axes}
        if self.admissible is not None:
            answer["admissible_share"] = float(self.admissible.mean())
        if self.quantity is not None:
            name, unit, numbers = self.quantity
            rows = []
            for row in numbers.tolist():
                rows.append([plain(value) for value in row])
            answer |= {"quantity": name, "unit": unit, "values": rows}
        return answer | deepcopy(dict(self.details))
