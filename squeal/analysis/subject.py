"""What can be varied: a scene's pad or a system with named parameters, seen alike."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from squeal.analysis.maps import MU_MAX
from squeal.analysis.sensitivity import parameters
from squeal.analysis.thresholds import CriticalFriction, critical_friction, critical_parameter
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.short_form import PlainSystem
from squeal.linear.system import System as Function
from squeal.linear.system import Term, TermSystem
from squeal.model.pad import PARAMETERS
from squeal.numerics.formula import Formula
from squeal.schema.place import Place
from squeal.schema.values import Number

Subject = Scene | TermSystem
LARGEST = 100  # degrees of freedom of a system whose critical friction is computed again and again


def System(
    M: Any,
    C: Any = None,
    K: Any = None,
    parameters: Mapping[str, float] | None = None,
    parameter: str = "mu",
    name: str = "system",
) -> TermSystem:
    """A system M q'' + C q' + K q = 0 from arrays in memory.

    Parameters
    ----------
    M, C, K : array_like (n, n), SciPy sparse array, or mapping of formulas to such
        A mapping holds terms by their factors, formulas of the parameters, such as
        ``{"1": K0, "mu": K1}``. C may be left out.
    parameters : mapping of str to float
        Named numbers; the free parameter is 0 if it is not among them.
    parameter : str
        The free parameter, in which thresholds are sought.
    name : str
        What the system is called.

    Raises
    ------
    InputError
        For a matrix that is not square or finite, and a formula with unknown names.

    Examples
    --------
    >>> K0, K1 = [[2, -1], [-1, 2]], [[0, 4 / 3], [0, 0]]
    >>> coupled = System([[1, 0], [0, 1]], K={"1": K0, "mu": K1})
    >>> coupled.n, coupled.parameter
    (2, 'mu')
    """

    def terms(given: Any) -> tuple[Term, ...]:
        if given is None:
            return ()
        each = given.items() if isinstance(given, Mapping) else [("1", given)]
        arrays = ((text, X if hasattr(X, "tocsc") else np.asarray(X)) for text, X in each)
        return tuple(
            Term(X if np.iscomplexobj(X) else X.astype(float), Formula(text)) for text, X in arrays
        )

    if K is None:
        raise InputError("System: K: missing; a matrix or a mapping of formulas to matrices is")
    return TermSystem(terms(M), terms(C), terms(K), dict(parameters or {}), parameter, name)


def varied_subject(given: object, asked: str, mu_max: float) -> Subject:
    """A scene or system whose parameters may be varied, and an upper end that it allows.

    Raises InputError naming `asked`.
    """
    subject: Any = getattr(given, "system", given)  # of a system file
    if isinstance(subject, TermSystem):
        if subject.n > LARGEST:
            raise InputError(
                f"{asked}: {subject.n} degrees of freedom are not allowed; at most {LARGEST} are, "
                "so reduce the system first"
            )
        if not named_values(subject):
            raise InputError(
                f"{asked}: {subject.name or 'the system'} has no named parameter but "
                f"{subject.parameter}; it must have one under its key parameters"
            )
    elif not isinstance(subject, Scene):
        kind = "a plain system" if isinstance(subject, PlainSystem) else type(subject).__name__
        raise InputError(
            f"{asked}: {kind} is not allowed; it must be a Scene or a system with named parameters"
        )
    upper_end_of(subject).read(mu_max, Place(asked, "mu_max"))
    return subject


def upper_end_of(subject: object) -> Number:
    """Up to where thresholds may be sought: a friction, or a parameter of a system in its unit."""
    return MU_MAX if isinstance(subject, Scene) else Number(low=0.0)


def named_values(subject: Subject) -> dict[str, float]:
    """The parameters that a critical friction depends on, with their values, in SI units."""
    if isinstance(subject, Scene):
        values = {name: getattr(subject.pad, name) for name in parameters(subject.pad_model)}
        return {name: value for name, value in values.items() if name != "mu"}
    return {name: v for name, v in subject.parameters.items() if name != subject.parameter}


def check_name(subject: Subject, name: str, asked: str, share: bool = False) -> None:
    """Refuse what is no parameter, and a share of an angle or of zero. Raises InputError."""
    names = named_values(subject)
    if name not in names:
        raise InputError(f"{asked}: {name} is no parameter here; allowed are {', '.join(names)}")
    if share and is_angle(subject, name):
        raise InputError(f"{asked}: {name} is an angle and has no share; it must be given in rad")
    if share and not names[name]:
        raise InputError(f"{asked}: {name} is 0 and has no share; it must be given in its unit")


def is_angle(subject: Subject, name: str) -> bool:
    """True for a parameter that is an angle."""
    return isinstance(subject, Scene) and PARAMETERS[name].angle


def unit_of(subject: Subject, name: str) -> str:
    """The unit of a parameter, empty where it is not known or has none."""
    unit = PARAMETERS[name].unit if isinstance(subject, Scene) else ""
    return "" if unit == "1" else unit


def own_value(subject: Subject) -> float:
    """The friction (or free parameter) at which the subject stands."""
    if isinstance(subject, Scene):
        return subject.pad.mu
    return float(subject.parameters[subject.parameter])


def free_name(subject: Subject) -> str:
    """What the free parameter is called."""
    return "mu" if isinstance(subject, Scene) else subject.parameter


def varied(subject: Subject, values: dict[str, float]) -> Subject:
    """The same with other values of some parameters. Raises InputError."""
    return subject.replace(**values) if isinstance(subject, Scene) else subject.replace(values)


def dense(system: TermSystem) -> Function:
    """The system with plain arrays."""
    return (lambda mu: system.arrays({system.parameter: mu})) if system.sparse else system


def critical_of(subject: Subject, high: float) -> CriticalFriction:
    """The thresholds along the friction (or free parameter) from 0 to `high`.

    Raises what `critical_friction` raises.
    """
    if isinstance(subject, Scene):
        return critical_friction(subject, high)
    return critical_parameter(dense(subject), high, subject.parameter)
