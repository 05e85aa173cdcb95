"""Samples of parameters: the file of spreads, designs in the unit cube, values at its points."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from squeal.linear.matrices import Array
from squeal.queries.parameter_space import ParameterSpace
from squeal.results.scatter import Spread
from squeal.schema import FLAG, Group, Key, Named, Number, Place, Whole, Word, read_document, row

DESIGNS = ("random", "latin", "sobol")

_ABOVE = Number(low=0.0)
_SPREAD = Group(
    {
        "relative": Key("normal, standard deviation over the value", _ABOVE),
        "absolute": Key("normal, standard deviation in the parameter's unit", _ABOVE),
        "within": Key("even, between the value minus and plus this", _ABOVE),
        "between": Key("even, between two numbers", row(2)),
    },
    only_one=True,
)
_SPREADS = Named(_SPREAD, "a mapping of parameters to spreads such as {relative: 0.05}")

SPREADS = Group(
    {
        "samples": Key("how many are drawn", Whole(8, 1_000_000), default="400"),
        "seed": Key("of the random numbers", Whole(0, 2**32 - 1), default="1"),
        "design": Key("random, latin (hypercube) or sobol", Word(DESIGNS), default="random"),
        "indices": Key("Sobol indices of each parameter", FLAG, default="false"),
        "spreads": Key("how each parameter scatters", _SPREADS, required=True),
    },
    owner="a file of spreads",
)


def read_spreads(path: Path | str) -> dict[str, Any]:
    """Read a file of spreads as keyword arguments of `scatter`.

    Names of parameters are checked by `scatter`, which knows the scene or system.
    Raises InputError with one sentence that names the file, the key and what is allowed.

    Examples
    --------
    >>> import squeal
    >>> from pathlib import Path
    >>> _ = Path("spreads.yaml").write_text("spreads: {k1: {relative: 0.05}}")
    >>> squeal.read_spreads("spreads.yaml")
    {'spreads': {'k1': {'relative': 0.05}}}
    """
    options = SPREADS.read(*read_document(path))
    if "seed" in options:  # the name in files; as an argument it is `rng`, as SciPy calls it
        options["rng"] = options.pop("seed")
    return options


def require_spreads(spreads: Mapping[str, Spread]) -> None:
    """Raise InputError if no parameter scatters."""
    if not spreads:
        raise Place("spreads").must_be(spreads, _SPREADS.allowed)


def points_of_unit_cube(design: str, samples: int, dimensions: int, seed: int) -> Array:
    """Points (samples, dimensions) in the unit cube, of one of the `DESIGNS`.

    Raises InputError for a Sobol sequence whose length is no power of 2.
    """
    from scipy.stats import qmc

    if design == "random":
        return np.random.default_rng(seed).random((samples, dimensions))
    if design == "latin":
        return qmc.LatinHypercube(dimensions, rng=seed).random(samples)
    # sobol
    is_power_of_2 = samples & (samples - 1) == 0
    if not is_power_of_2:
        near = 2 ** min(round(math.log2(samples)), 19)  # 2^20 is above the 1,000,000 allowed
        raise Place("samples").refuse(
            f"{samples} is not allowed; it must be a power of 2 for the design sobol, "
            f"such as {near}"
        )
    # a point at 0 or 1 would be an infinite value of a normal distribution
    return np.clip(qmc.Sobol(dimensions, rng=seed).random(samples), 1e-9, 1 - 1e-9)


def parameters_at(
    space: ParameterSpace, spreads: Mapping[str, Spread], points: Array
) -> list[dict[str, float]]:
    """The parameters, by name, of each point (n, d) of the unit cube.

    The coordinate of a point is the probability that its parameter is smaller. Raises InputError
    for a spread that does not fit its parameter.
    """
    columns = []  # the values (n,) of each parameter
    for (name, spread), probabilities in zip(spreads.items(), points.T, strict=True):
        columns.append(_values_at(space, name, spread, probabilities))
    samples = []
    for values in np.transpose(columns).tolist():
        samples.append(dict(zip(spreads, values, strict=True)))
    return samples


def _values_at(space: ParameterSpace, name: str, spread: Spread, probabilities: Array) -> Array:
    """The quantiles (n,) of a parameter's distribution at probabilities (n,) between 0 and 1.

    spread: one kind and its size, such as {"relative": 0.05} or {"between": [0.2, 0.5]}. Raises
    InputError if it does not fit the parameter.
    """
    from scipy.special import ndtri

    ((kind, size),) = spread.items()
    at = Place("spreads")
    if not isinstance(size, float):  # of the kind "between", which has two values
        space.require(name, at)
        low, high = size
        if not low < high:
            place_of_range = Place("scatter", "spreads", name, kind)
            raise place_of_range.must_be(list(size), "two numbers, the lower one first")
        return low + (high - low) * probabilities
    # half of an even range, or a standard deviation, in the parameter's unit
    width = space.step(name, size, is_share=kind == "relative", at=at)
    if kind == "within":
        return space.values[name] + width * (2 * probabilities - 1)
    return space.values[name] + width * ndtri(probabilities)  # of the normal distribution
