"""A system as every verb takes it: with its files, and with the selection of its roots."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from squeal.errors import ComputationError, InputError, suggestion
from squeal.io.system import SystemFile
from squeal.io.writing import JsonObject
from squeal.linear.damping import frictionless
from squeal.linear.matrices import why_no_mass
from squeal.linear.system import System, TermSystem, warn_of_unused_parameters
from squeal.numerics.threads import workers_of_verb
from squeal.queries.options import Band
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.matrices import ALL_ROWS, is_symmetric
from squeal.queries.systems.reduced import reduced_for
from squeal.results.sources import EigenvalueSelection
from squeal.schema import Place
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.assembly import Assembly
from squeal.sparse.quadratic import PROGRESS, Progress
from squeal.sparse.reduction import Reduction

SWAPPED = 1e-5  # Hz: a structure of which rows vibrate so slowly has its stiffness for its mass
SERVED = 9  # values at which a reduced system has to be good
ABOVE_CUTOFF = 1.000001  # share of the cutoff of components from which on a region exceeds it


@dataclass(frozen=True)
class SystemAnalysis:
    """A system with its files, and which of its roots are selected."""

    file: SystemFile
    selection: EigenvalueSelection

    @staticmethod
    def of(
        subject: object,
        band: Band | None = None,
        region: Sequence[float] | None = None,
        modes: int | None = None,
        memory: float | None = None,
        progress: Progress | None = None,
    ) -> SystemAnalysis:
        """Read a subject and the options of a verb, and check that they go together.

        Parameters
        ----------
        subject : System, Assembly or SystemFile
            The system.
        band : (float, float), optional
            Frequencies in Hz. Left out, the band of reduced components reaches up to their cutoff.
        region : sequence of 4 float, optional
            Bounds of Re and Im in rad/s, as `Rectangle` takes them.
        modes : int, optional
            Number of the lowest modes.
        memory : float, optional
            Bytes that may be used; what is free if left out.
        progress : callable, optional
            Receives a line now and then while the answer is computed.

        Raises
        ------
        InputError
            For a subject that is no system, and for a selection that is none.
        ComputationError
            For a system that does not fit into the memory.
        """
        file = file_of(subject)
        assembly = file.assembly
        is_unselected = band is None and region is None
        if is_unselected and assembly is not None and assembly.reduction:
            band = (0.0, assembly.cutoff)
        rectangle = None if region is None else Rectangle(*region)
        selection = EigenvalueSelection(band, rectangle, modes)
        if rectangle is not None:
            _refuse_conjugates(rectangle, file.system.real)
        if not is_small(file.system):
            _check_memory(file.system, memory)
        selected = selection.rectangle
        if selected is not None and assembly is not None:
            cutoff = assembly.cutoff
            if selected.high_imag > ABOVE_CUTOFF * math.tau * cutoff:
                Place("band" if band else "region").warn(
                    f"ends above the cutoff of the components, {cutoff:g} Hz; roots above it "
                    "decide nothing"
                )
        PROGRESS.set(progress or (lambda _: None))
        # both warnings look at matrices, which may follow the frequency: at one frequency then
        system = file.system.frozen()
        _warn_of_missing_mass(system)
        _warn_of_swapped_matrices(system)
        return SystemAnalysis(file, selection)

    @property
    def component_reduction(self) -> JsonObject | None:
        """How components were reduced before they were joined, as JSON holds it; None if no
        component was."""
        if self.file.assembly is None:
            return None
        return self.file.assembly.reduction

    @property
    def system(self) -> System:
        """The system that is analysed."""
        return self.file.system

    @property
    def depends_on_parameter(self) -> bool:
        """Whether a matrix depends on the free parameter; an assembly may by its brake load."""
        return self.system.parameter in self.system.names or self.file.assembly is not None

    def warn_of_unused_parameter(self) -> None:
        """Warn if nothing depends on the varied parameter, so that every value has the same answer.

        Raises InputError where it is the friction of a contact without a direction of sliding.
        """
        parameter = self.system.parameter
        if self.file.assembly is not None:
            for contact in self.file.assembly.contacts:
                with Place(f"contact {contact.name}").prefixing_errors():
                    contact.require_direction(self.system.parameters, [parameter])
        if not self.depends_on_parameter:
            at = Place(self.system.name or "system")
            warn_of_unused_parameters([parameter], self.system, at)
        _warn_of_held_damping(self.file, [parameter])

    def reduced(
        self, values: Sequence[float] | None, method: str = "reduced", most: int = SERVED
    ) -> Reduction:
        """Reduce the system to the selected roots.

        Parameters
        ----------
        values : sequence of float or None
            Values of the free parameter, at least one; None is the system's own.
        method : {"reduced", "modal"}
            As of `reduced_for`.
        most : int
            The reduced system is made at so many of the values at most, at least 1, chosen evenly
            by their place in the list.

        Returns
        -------
        Reduction
            The reduced system, or the real modes with their corrections; see `reduced_for`.
        """
        parameter = self.system.parameter
        if values is None:
            values = [self.system.parameters[parameter]]
        positions = np.linspace(0, len(values) - 1, min(most, len(values)))
        changes = [{parameter: values[round(k)]} for k in positions.tolist()]
        return reduced_for(self.system, self.selection, changes, method)


def _warn_of_held_damping(file: SystemFile, names: Iterable[str]) -> None:
    """Warn of damping that does not change with varied parameters of the matrix it is of."""
    held = sorted(file.held.intersection(names))
    if held:
        Place(file.system.name).warn(
            f"damping does not follow {', '.join(held)}, it is that of the given parameters"
        )


def _warn_of_missing_mass(system: TermSystem) -> None:
    """Warn of a row without mass, or of another reason why M is no mass matrix.

    That is a mistake where M and, without friction, K are symmetric. Else the equations may stand
    in any order, so that a row of M is not the mass of the same row of K.
    """
    M, _, _ = system.at()
    reason = why_no_mass(M, ALL_ROWS)
    if reason and is_symmetric(M):
        _, _, K = system.at(frictionless(system))
        if is_symmetric(K):
            Place(system.name or "system").warn(
                f"{reason}; the answer is that of the matrices as they are"
            )


def _warn_of_swapped_matrices(system: TermSystem) -> None:
    """Warn of a system of which half of the rows vibrate more slowly than `SWAPPED`.

    Row i, with the other rows held, vibrates at the angular frequency (|K_ii| / |M_ii|)^1/2.
    """
    M, _, K = system.at()
    masses = np.abs(M.diagonal())
    squares = np.full(system.n, np.inf)  # of angular frequencies; infinite without mass
    np.divide(np.abs(K.diagonal()), masses, out=squares, where=masses > 0.0)
    median_hz = math.sqrt(np.median(squares)) / math.tau
    if 0.0 < median_hz < SWAPPED:
        Place(system.name or "system").warn(
            f"half of the rows vibrate at {median_hz:.1g} Hz and less where the others are held; "
            "are M and K swapped?"
        )


def _refuse_conjugates(region: Rectangle, real: bool) -> None:
    """Raise InputError for a region with more below the real axis than above it.

    Roots below the axis are conjugates of motions that the region does not hold; those of complex
    matrices are no motions at all.
    """
    low = region.low_imag
    high = region.high_imag
    if high <= 0.0 or (real and high < -low):
        raise InputError(
            f"region: {low:g} < Im < {high:g} is not allowed: below the real axis lie conjugates, "
            f"which are no motions of their own; the same roots have {max(-high, 0.0):g} < Im < "
            f"{-low:g}"
        )


def _check_memory(system: TermSystem, limit: float | None) -> None:
    """Refuse a system that does not fit into `limit` bytes; into what is free if it is None.

    A search needs one sparse factorisation for each worker and one Krylov subspace. The bytes of
    both were measured on three-dimensional solids; a full matrix takes what its entries need.
    Raises ComputationError.
    """
    entries = max(int(getattr(term.matrix, "nnz", term.matrix.size)) for term in system.terms)
    # bytes: 16 for a complex entry, of a full factor n^2 of these; else as measured
    factor = min(16.0 * system.n**2, 12.0 * entries * system.n ** (1 / 3))
    subspace = 16 * 2 * 180 * system.n  # 180 complex vectors (2n,) of the first-order form
    needed = workers_of_verb() * factor + subspace
    available = _free_memory() if limit is None else limit
    if needed > available:
        raise ComputationError(
            f"{system.n} rows need about {needed / 1e9:.2g} GB for a factorisation, and "
            f"{available / 1e9:.2g} GB may be used; a larger `memory` allows more, fewer "
            "rows or `workers` need less"
        )


def _free_memory() -> float:
    """Bytes that are free, infinite on machines other than Linux, which do not say."""
    with suppress(OSError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1e3 * float(line.split()[1])  # "MemAvailable:  123 kB"
    return math.inf


def refuse_without_effect(file: SystemFile, names: Iterable[str], at: Place) -> None:
    """Raise InputError for parameters, at a place, that no matrix depends on, and for the frequency
    where each root has its own."""
    system = file.system
    _warn_of_held_damping(file, names)
    allowed = sorted(system.names - {*system.follows})
    for name in names:
        if name not in allowed:
            reason = "no matrix depends on it"
            if name in system.follows:
                reason = "each root has its own"
            elif file.assembly is not None:
                reason += ", and contact stays as it is seated"
            raise at.refuse(f"{name} is not allowed, {reason}; {suggestion(name, allowed)}")


def file_of(subject: object) -> SystemFile:
    """The system file of a system or of an assembly; a system file is returned itself.

    Raises InputError for other subjects.

    Examples
    --------
    >>> import squeal
    >>> file_of(squeal.System([[1.0]], K=[[1.0]])).assembly is None
    True
    """
    if isinstance(subject, SystemFile):
        return subject
    if isinstance(subject, System):
        return SystemFile(subject)
    if isinstance(subject, Assembly):
        return SystemFile(subject.seated_system, assembly=subject)
    allowed = "it must be a System, an Assembly or what read_system gives"
    raise InputError(f"{type(subject).__name__} is not allowed; {allowed}")
