"""What an answer was computed from: a pad and its equilibrium, or a system and a selection."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from hashlib import sha256
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from squeal.errors import NO_BALLS, InputError
from squeal.io.scene import Scene
from squeal.linear import Judgement, Spectrum
from squeal.linear.shaft import unit_of_parameter
from squeal.linear.system import System
from squeal.model.contact import State, contact_law
from squeal.model.equations import Linearisation
from squeal.schema import Place, row

if TYPE_CHECKING:  # pads start without the solvers of large systems
    from squeal.equilibrium import Path
    from squeal.io.system import SystemFile
    from squeal.sparse.argument_principle import Rectangle
    from squeal.sparse.reduction import Reduction

LOWEST = 20  # modes of a larger system where nothing else is selected


class Doubt(StrEnum):
    """Why nobody knows how far the matrices about an equilibrium may be off, in words."""

    NONE = ""
    NOT_ENCLOSED = "rounding hides whether there is an equilibrium, or how it touches the surface"
    ROUNDING = f"rounding may change the verdict, and {NO_BALLS}"
    NO_BALLS = NO_BALLS


@dataclass(frozen=True)
class PadAnalysis:
    """One equilibrium, the linearisation about it, its six eigenvalues and the verdict.

    q = (x, y, theta) in SI units; R_n is None for B3, which is linearised about the origin.
    on_branch: the equilibrium is reached from the one without friction; warnings: a sentence for
    each reason why it is none that the model means. errors: how far the entries of C and K (3, 3)
    may be off, damping in C left aside; doubt: why nobody knows that.
    """

    model: str
    q: tuple[float, float, float]
    R_n: float | None
    state: State
    how: str
    matrices: Linearisation = field(repr=False)
    spectrum: Spectrum = field(repr=False)
    judgement: Judgement
    on_branch: bool = True
    warnings: tuple[str, ...] = ()
    errors: tuple[np.ndarray, np.ndarray] | None = field(default=None, repr=False)
    doubt: Doubt = Doubt.NONE

    @property
    def verdict(self) -> str | None:
        """The verdict; None where rounding hides it, or the equilibrium that it would be about."""
        is_hidden = self.doubt in (Doubt.NOT_ENCLOSED, Doubt.ROUNDING)
        return None if is_hidden else self.judgement.verdict

    @property
    def admissible(self) -> bool:
        """True if nothing speaks against the equilibrium."""
        return not self.warnings

    @property
    def contact(self) -> str:
        """Name of the contact state."""
        return contact_law(self.model).state_name(self.state)


@dataclass(frozen=True)
class EigenvalueSelection:
    """Roots of a band (Hz) or of a region, or the lowest ones; of a band the lowest `modes`.

    Raises InputError when made with a band and a region, or with what is none.
    """

    band: tuple[float, float] | None = None
    region: Rectangle | None = None
    modes: int | None = None

    def __post_init__(self) -> None:
        if self.band is None:
            return
        if self.region is not None:
            raise InputError("band, region: one of them is allowed")
        from squeal.sparse.argument_principle import band

        band(*row(2).read(self.band, Place("band")))

    @property
    def rectangle(self) -> Rectangle | None:
        """The region, or that of the band, in the complex plane; None if neither is given.

        An edge on the real axis is moved a little beyond it, so that real roots lie inside.
        """
        region = self.region
        if self.band is not None:
            from squeal.sparse.argument_principle import band

            region = band(*self.band)
        if region is None or (region.low_imag != 0.0 and region.high_imag != 0.0):
            return region
        margin = 1e-6 * max(region.high_imag, -region.low_imag)
        if region.low_imag == 0.0:
            return replace(region, low_imag=-margin)
        return replace(region, high_imag=margin)

    def words(self, count: int | None = None) -> str:
        """The selection in words, for people; of the lowest modes the `count` that were found."""
        if self.band is not None:
            return f"{self.band[0]:g} to {self.band[1]:g} Hz"
        if self.region is not None:
            r = self.region
            return f"{r.low_real:g} < Re < {r.high_real:g}, {r.low_imag:g} < Im < {r.high_imag:g}"
        modes = self.modes or LOWEST
        if count is not None:
            modes = min(count, modes)
        return f"the lowest {modes} modes"


@dataclass(frozen=True, eq=False)
class PadSource:
    """A pad as the source of an answer.

    analysis: about its equilibrium, of eigenvalues; branch: of equilibria, of thresholds, None for
    B3, which is linearised about the origin.
    """

    scene: Scene
    analysis: PadAnalysis | None = None
    branch: Path | None = None

    @property
    def subject(self) -> Scene:
        """What the answer is of."""
        return self.scene


@dataclass(frozen=True, eq=False)
class SystemSource:
    """A system, which of its roots were selected, and the reduced system that served."""

    file: SystemFile
    selection: EigenvalueSelection
    reduction: Reduction | None = None

    @property
    def subject(self) -> System:
        """What the answer is of."""
        return self.file.system


Source: TypeAlias = PadSource | SystemSource


def unit_of(source: Source | None) -> str:
    """The unit of the free parameter: rad/s of the speed of a shaft, "" of others."""
    if isinstance(source, SystemSource):
        return unit_of_parameter(source.file.system)
    return ""


def digest_of(subject: Scene | System, *options: object) -> str:
    """A digest of what stability depends on in a subject, and of options.

    Equal numbers of a subject have equal digests, whatever arrays or files hold them; 0 and -0, and
    options 1 and 1.0, differ.
    """
    from squeal.io.matrices import fingerprint

    content: tuple[object, ...]
    if isinstance(subject, Scene):
        numbers = _doubles(subject.pad.to_dict())
        content = (subject.model, numbers, subject.formulation, subject.damping)
    else:
        matrices = []
        for terms in subject.parts:
            # the factor with the numbers of its table, whose file may change
            matrices.append([(repr(term.factor), fingerprint(term.matrix)) for term in terms])
        numbers = _doubles(subject.parameters)
        content = (subject.parameter, numbers, subject.follows, matrices)
    return sha256(repr((content, options)).encode()).hexdigest()


def _doubles(numbers: Mapping[str, float]) -> list[tuple[str, float]]:
    """Numbers with their names, all as doubles, in the order of the names."""
    return [(name, float(value)) for name, value in sorted(numbers.items())]


def refuse_other_subject(name: str, source: Source | None, subject: Scene | System) -> None:
    """Raise InputError for an answer, given as option `name`, of another subject than this one.

    The free parameter may have another value, the others not.
    """
    if source is None or digest_of(_at_zero(source.subject)) != digest_of(_at_zero(subject)):
        raise InputError(f"{name}: is the answer of another subject; that of this one is allowed")


def _at_zero(subject: Scene | System) -> Scene | System:
    """The subject with the free parameter at zero."""
    if isinstance(subject, Scene):
        return subject.replace(mu=0.0)
    return subject.replace({subject.parameter: 0.0})
