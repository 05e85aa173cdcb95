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
"""What the speed of a shaft is called. A skew term of K alone does not tell it from the share of a
cross-coupled stiffness; one of C does."""


class Turning(NamedTuple):
    """The skew part (n, n) of what turns with the shaft, and the power of lambda before it."""

    matrix: Matrix
    power: int


def turning_parts(system: System, speed: float) -> Iterable[Turning]:
    """What turns with the shaft: the skew part of those terms of C that are proportional to the
    speed (rad/s), which are gyroscopic; then of those of K, as of damping on the shaft."""
    for terms, power in ((system.C, 1), (system.K, 0)):
        parts = [part for term in terms for part in _skew_part(system, term, speed)]
        if parts:
            yield Turning(sum(parts[1:], parts[0]), power)


def _skew_part(system: System, term: Term, speed: float) -> Iterable[Matrix]:
    """The skew part (n, n) of a term if it is proportional to the speed, else nothing."""
    name = system.parameter
    if name not in term.factor.names:
        return
    try:
        whole, half = (term.factor.value(system.values({name: x})) for x in (speed, speed / 2))
    except InputError:  # beyond the ends of a table, say
        return
    skew = (term.matrix - term.matrix.T) / 2
    is_skew = abs(skew).max() > LARGEST_ASYMMETRY * abs(term.matrix).max()
    if whole and is_skew and abs(whole - 2 * half) <= LARGEST_ASYMMETRY * abs(whole):
        yield whole * skew


def unit_of_parameter(system: System) -> str:
    """rad/s where the free parameter is the speed of a shaft, else "".

    The parameter is a speed if a skew term is proportional to it: a term of C, such as a gyroscopic
    one, unless the parameter is the friction `mu`; or a term of K, if `SPEEDS` has its name.

    Examples
    --------
    >>> from squeal import System
    >>> skew = [[0, 1], [-1, 0]]
    >>> unit_of_parameter(System([[1, 0], [0, 1]], {"W": skew}, [[1, 0], [0, 1]], parameter="W"))
    'rad/s'
    """
    name = system.parameter
    speed = system.parameters[name] or 1.0
    terms: list[Term] = []
    if name != "mu":
        terms += system.C
    if name in SPEEDS:
        terms += system.K
    for term in terms:
        for skew in _skew_part(system, term, speed):
            part = term.factor.value(system.values({name: speed})) * term.matrix
            # all of the term is skew: the matrix of friction has a symmetric part too
            if abs(part - skew).max() <= LARGEST_ASYMMETRY * abs(skew).max():
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
