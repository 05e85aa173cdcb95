"""Plain systems M, C, K(mu) in the stability queries: recognised by their key M."""

from squeal.cli.numbers import numbers
from squeal.errors import InputError
from squeal.io.short_form import PlainSystem


def value_of(given: str | None, system: PlainSystem | None) -> float:
    """The parameter of a plain system that `--at` names, 0 if it is left out.

    Raises InputError, also where a scene is given, whose friction stands in its file.
    """
    if given is None:
        return 0.0
    words = (
        "a finite number, and goes with a plain system only (the friction of a scene stands in its "
        "file)"
    )
    return numbers(given, "--at", 1, words, lambda _: system is not None)[0]


def refuse_sensitivity(name: str, system: PlainSystem | None) -> None:
    """Sensitivities go by the parameters of a pad. Raises InputError for a plain system."""
    if system is not None:
        raise InputError(
            f"--sensitivity: is not allowed with {name}, a plain system without the parameters of "
            "a pad; a scene is allowed"
        )
