"""What verbs take: the subjects that they answer for, and the types of their options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import numpy as np

from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.linear.system import System
from squeal.schema import Kind, Number, Place, Whole

Progress = Callable[[str], None]
Modes = Annotated[int, Whole(1, 10**6)]
Workers = Annotated[int, Whole(1, 256)]
Band = tuple[float, float]
Region = tuple[float, float, float, float]
RandomNumbers: TypeAlias = Annotated[
    int | np.random.Generator,
    Kind(
        "a whole number, which draws the same each time, or a numpy.random.Generator",
        lambda given: given if isinstance(given, (int, np.random.Generator)) else None,
    ),
]
SEED = Whole(0, 2**32 - 1)
FRICTION = "mu"  # the name of a parameter that is a friction coefficient
FRICTION_END = 2.0
"""Upper end of a range of the friction coefficient where none is given."""
MU_MAX = Number(low=1e-9, high=1000.0)
"""The end of a range of the friction coefficient: rounding hides the branch on a shorter one."""
BEYOND_PRESENT = 2.0  # upper end of a range of another parameter, over its present value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from squeal.io.system import SystemFile
    from squeal.sparse.assembly import Assembly

    SystemSubject: TypeAlias = System | SystemFile | Assembly
    Subject: TypeAlias = Scene | SystemSubject
    Values: TypeAlias = Sequence[float] | NDArray[np.floating | np.integer]
else:  # systems are loaded by the first question about one, which refuses what is none of these
    Subject = SystemSubject = object
    Values = Sequence[float]


def refuse_options(subject: Literal["a scene", "a system"], **options: object) -> None:
    """Refuse options that were set, but that this kind of subject does not have.

    Raises InputError.
    """
    other = "a system" if subject == "a scene" else "a scene"
    for name, value in options.items():
        if value is not None and value is not False:
            raise InputError(f"{name}: is not allowed with {subject}; {other} takes it")


def seed_of(rng: RandomNumbers, verb: str) -> int:
    """The seed that an answer names; a generator draws one. Raises InputError."""
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(2**32))
    return int(SEED.read(rng, Place(verb, "rng")))


def upper_end(subject: object, high: float | None) -> float:
    """The upper end of a range of the free parameter: `high`, if it is given.

    Else it is 2 for a friction coefficient, or its present value where that is larger, and twice
    the present value for another parameter. Raises InputError where the present value of another
    parameter is not above 0, since nothing tells then which values occur, and where the friction of
    a scene is larger than any allowed end, `MU_MAX`.
    """
    if high is not None:
        return high
    if isinstance(subject, Scene):
        mu = subject.pad.mu
        if mu > MU_MAX.high:
            raise InputError(
                f"mu: {mu:g} is beyond {MU_MAX.high:g}, the end of the range at most; "
                "give the largest friction that is meant as `high`"
            )
        return max(FRICTION_END, mu)
    system = getattr(subject, "system", subject)
    if not isinstance(system, System):  # the caller refuses such a subject, in words of its own
        return FRICTION_END
    name = system.parameter
    present = system.parameters[name]
    if name == FRICTION:
        return max(FRICTION_END, present)
    if present > 0.0:
        return BEYOND_PRESENT * present
    raise InputError(
        f"high: missing; {name} is {present:g} now, so give the largest {name} that occurs"
    )
