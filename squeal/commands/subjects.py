"""What a command varies: a scene, or a system with named parameters."""

from squeal.analysis.subject import Subject
from squeal.commands.source import Source
from squeal.errors import InputError


def subject_of(source: Source, asked: str) -> Subject:
    """The scene, or the system with named parameters, whose parameters are varied.

    Raises InputError.
    """
    terms = source.terms()
    if terms is not None:
        return terms.system
    if source.system() is not None:
        raise InputError(
            f"{asked}: is not allowed with {source.name}, a plain system without named parameters; "
            "a scene or a system with parameters is allowed"
        )
    return source.scene()
