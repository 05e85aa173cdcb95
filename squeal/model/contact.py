"""The contact models by name: their laws, the choices that each has, the parameters it needs."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache, lru_cache
from typing import Any

from squeal.model.laws import (
    ContactLaw,
    DeltaFrom,
    DeltaMoment,
    LineContact,
    LineForce,
    PointContact,
    SpringContact,
)
from squeal.model.pad import PARAMETERS, Pad
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Whole, Word


@dataclass(frozen=True)
class Formulation:
    """Choices that the models leave open; `ContactModel.choices` says which model has which.

    line_force: "integral" = (k_c/2w) x integral of the penetration, "mean" = Eq. (13) as printed.
    delta_from: "centre" of mass (needed by Eq. 10), or the fixed "frame" as in Eqs. (17)-(20).
    delta_moment: "+" as in Eq. (10), "-" as in Eq. (21).
    springs: how many there are along the face. Raises InputError for anything else.
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"
    springs: int = 16

    def __post_init__(self) -> None:
        FORMULATION.read(vars(self), Place("Formulation"))

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a scene file, defaults left out."""
        return {f.name: v for f in fields(self) if (v := getattr(self, f.name)) != f.default}


# fmt: off
FORMULATION = Group({
    "line_force": Key(
        "integral: (k_c / 2w) x integral of the penetration; mean: Eq. (13) as printed",
        Word(("integral", "mean")), default="integral"),
    "delta_from": Key(
        "where delta is counted from: the centre of mass, or the frame as in Eqs. (17)-(20)",
        Word(("centre", "frame")), default="centre"),
    "delta_moment": Key(
        "sign of the moment of Rn: + as in Eq. (10), - as in Eq. (21)",
        Word(("+", "-")), default="+"),
    "springs": Key(
        "how many springs the lower face has, at w (2 i + 1 - N)/sqrt(N^2 - 1) from its middle",
        Whole(2, 1000), default="16"),
})
# fmt: on
FORMULATION_CHOICES: dict[str, tuple[str, ...]] = {
    name: key.kind.choices for name, key in FORMULATION.keys.items() if isinstance(key.kind, Word)
}
CONSISTENT = Formulation()


@dataclass(frozen=True)
class ContactModel:
    """A contact model as scenes name it.

    words: what it is; law: its contact law; choices: the keys of `Formulation` that it reads;
    linear: it is its law's linearisation about the origin in full contact, which has no motion,
    load or sliding equilibrium of its own.
    """

    name: str
    words: str
    law: Callable[[Formulation], ContactLaw]
    choices: tuple[str, ...] = ()
    linear: bool = False

    def uses(self, parameter: str) -> bool:
        """True if a parameter of `Pad` means anything in this model."""
        if any(parameter in model.stiffnesses for model in MODELS.values()):
            return parameter in self.stiffnesses
        return not (self.linear and parameter in _OF_MOTION)

    @property
    def stiffnesses(self) -> tuple[str, ...]:
        """The contact stiffnesses that it needs."""
        return self.law(CONSISTENT).parameters


def _line(f: Formulation) -> ContactLaw:
    return LineContact(f.line_force, f.delta_from, f.delta_moment)


def _springs(f: Formulation) -> ContactLaw:
    return SpringContact(f.springs)


MODEL = Place("model")
_LINE = ("line_force", "delta_from", "delta_moment")
_OF_MOTION = ("L1", "L2", "F_n", "V", "mu_s", "mu_k", "v_ref", "x0", "y0")
MODELS: dict[str, ContactModel] = {
    model.name: model
    for model in (
        ContactModel("B1", "point contacts at the two edges", lambda _: PointContact()),
        ContactModel("B2", "line contact", _line, _LINE),
        ContactModel("B3", "line contact, linearised", _line, _LINE, linear=True),
        ContactModel("BN", "equal springs along the lower face", _springs, ("springs",)),
    )
}


CONTACT_MODELS = tuple(name for name, model in MODELS.items() if not model.linear)


def contact_model(name: str, at: Place = MODEL) -> ContactModel:
    """A model by its name. Raises InputError if there is none of that name."""
    return MODELS[Word(tuple(MODELS)).read(name, at)]


@cache
def models_with(parameter: str) -> tuple[str, ...]:
    """Names of the models in which a parameter of `Pad` means anything."""
    return tuple(name for name, model in MODELS.items() if model.uses(parameter))


@cache
def _needed(name: str) -> tuple[str, ...]:
    return tuple(n for n, p in PARAMETERS.items() if p.required and name in models_with(n))


def check_pad(name: str, pad: Pad, at: Place) -> None:
    """Refuse an unknown model, or a pad without a parameter that it needs. Raises InputError."""
    if name not in MODELS:
        contact_model(name, at / "name")
    for parameter in _needed(name):
        if getattr(pad, parameter) is None:
            raise PARAMETERS[parameter].missing(at / parameter, f"model {name}")


@lru_cache(maxsize=256)
def contact_law(name: str, formulation: Formulation = CONSISTENT) -> ContactLaw:
    """The contact law of a model, always the same object for the same choices."""
    return contact_model(name).law(formulation)
