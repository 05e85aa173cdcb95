"""What turns with a shaft, and whether the free parameter of a system is the speed of one."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from squeal.errors import InputError
from squeal.linear.matrices import LARGEST_ASYMMETRY, Matrix
from squeal.linear.system import System
from squeal.linear.terms import Term

RPM = 30.0 / math.pi
"""Revolutions a minute of 1 rad/s."""
SPEEDS = ("speed", "Omega", "omega", "spin")
"""What the speed of a shaft is called. The name decides where only a term of K is skew, as such a
term may also be a share of a cross-coupled stiffness."""


class Turning(NamedTuple):
    """The skew part (n, n) of terms that turn with the shaft, and the power of lambda before it: 1
    of C, 0 of K."""

    matrix: Matrix
    power: int


def turning_parts(system: System, speed: float) -> Iterable[Turning]:
    """What turns with the shaft: the skew part of those terms of C that are proportional to the
    speed (rad/s), which are gyroscopic; then of those of K, as of damping on the shaft."""
    for terms, power in ((system.C, 1), (system.K, 0)):
        parts = []
        for term in terms:
            skew = _skew_part(system, term, speed)
            if skew is not None:
                parts.append(skew)
        if parts:
            yield Turning(sum(parts[1:], parts[0]), power)


def _skew_part(system: System, term: Term, speed: float) -> Matrix | None:
    """The skew part (n, n) of a term at a speed if its factor is proportional to it, else None."""
    name = system.parameter
    if name not in term.factor.names:
        return None
    try:
        factor = term.factor.value(system.values({name: speed}))
        half = term.factor.value(system.values({name: speed / 2}))
    except InputError:  # beyond the ends of a table, say
        return None
    skew = (term.matrix - term.matrix.T) / 2
    is_skew = abs(skew).max() > LARGEST_ASYMMETRY * abs(term.matrix).max()
    if factor and is_skew and abs(factor - 2 * half) <= LARGEST_ASYMMETRY * abs(factor):
        return factor * skew
    return None


def unit_of_parameter(system: System) -> str:
    """rad/s where the free parameter is the speed of a shaft, else "".

    The parameter is a speed if a skew term is proportional to it. This is a term of C, such as a
    gyroscopic one, unless the parameter is the friction `mu`; or a term of K, if `SPEEDS` has the
    name of the parameter.

    Examples
    --------
    >>> from squeal import System
    >>> skew = [[0, 1], [-1, 0]]
    >>> unit_of_parameter(System([[1, 0], [0, 1]], {"W": skew}, [[1, 0], [0, 1]], parameter="W"))
    'rad/s'
    """
    name = system.parameter
    speed = system.parameters[name] or 1.0  # any but 0 shows what the terms are made of
    terms: list[Term] = []
    if name != "mu":
        terms += system.C
    if name in SPEEDS:
        terms += system.K
    for term in terms:
        skew = _skew_part(system, term, speed)
        if skew is None:
            continue
        whole = term.factor.value(system.values({name: speed})) * term.matrix
        # all of the term is skew: the matrix of friction has a symmetric part too
        if abs(whole - skew).max() <= LARGEST_ASYMMETRY * abs(skew).max():
            return "rad/s"
    return ""


def name_of_kind(kind: str, unit: str) -> str:
    """What people call a verdict or the kind of a threshold; unit: of the parameter.

    A whirl grows by damping on the shaft or by fluids, alone: it is no flutter of two modes.

    Examples
    --------
    >>> name_of_kind("flutter", "rad/s"), name_of_kind("flutter", "")
    ('unstable whirl', 'flutter')
    """
    return "unstable whirl" if unit and kind == "flutter" else kind


def speed_words(value: float, unit: str) -> str:
    """What follows a value of a parameter: its unit and, of a speed, its four digits in rpm.

    Examples
    --------
    >>> speed_words(600.0, "rad/s"), speed_words(0.4, "")
    (' rad/s (5730 rpm)', '')
    """
    if not unit or not value:
        return f" {unit}".rstrip()
    return f" {unit} ({float(f'{value:.4g}') * RPM:.4g} rpm)"
