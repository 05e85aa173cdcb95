"""The verbs for systems from matrices: what `squeal.analysis.verbs` answers with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from squeal.analysis.answers import Eigenvalues, Sweep, Thresholds, basis_text, shape_rows
from squeal.analysis.maps import Axis, Map
from squeal.analysis.pads import mode_shapes, with_places
from squeal.analysis.ranges import PROVED_ROWS, SEARCHES, disagreement, system_statement
from squeal.analysis.sensitivity import Sensitivity
from squeal.analysis.systems.known import (
    accuracy_by_digits,
    data_of,
    digits_of_files,
    error_bounds,
    open_by_digits,
    sweep_as_known,
    thresholds_as_known,
)
from squeal.analysis.systems.matrices import matrix_list, system_checks
from squeal.analysis.systems.proofs import Statement
from squeal.analysis.systems.roots import (
    NO_ROOT,
    SystemRoots,
    Wanted,
    basis_of,
    check_memory,
    is_small,
    looked_at,
    reduced_for,
    roots_of_all,
    rounding_of,
    system_roots,
    verdict_of,
)
from squeal.analysis.systems.sensitivity import (
    Matrices,
    root_sensitivity,
    threshold_sensitivity,
    widened,
    with_matrices,
)
from squeal.analysis.systems.sweeps import followed
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.errors import InputError
from squeal.io.processes import counted, mapped
from squeal.io.system import SystemFile
from squeal.io.writing import number, picked
from squeal.linear import VERDICTS, Spectrum, UnstableMode, unstable_modes
from squeal.linear import thresholds as linear_thresholds
from squeal.linear.digits import has_digits
from squeal.linear.eigen import growing
from squeal.linear.matrices import dense as plain_matrix
from squeal.linear.system import System
from squeal.schema import Place
from squeal.sparse.argument_principle import Disc, Rectangle
from squeal.sparse.components import Assembly
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS, Progress
from squeal.sparse.reduction import Reduction

ONSET_ROWS = 40  # up to so many rows the onset of each unstable mode is computed
SHOWN_ROWS = 100  # matrices and mode shapes of larger systems are not printed
CHECKED = 25  # values of a sweep at which its basis is checked
SERVED = 9  # values at which a reduced system has to be good
SHOWN = 121  # values of the parameter in a figure of thresholds
CORNERS = 5  # values a side of a chart at which a reduced system has to be good
SAME = 1e-6  # of |lambda|: one root, computed in two ways

NAMES = (*VERDICTS, NO_ROOT)

Band = tuple[float, float]


@dataclass(frozen=True)
class Question:
    """A system, what is known of its files, and which of its roots are wanted; its methods are the
    verbs."""

    file: SystemFile
    wanted: Wanted

    @staticmethod
    def of(
        subject: object,
        band: Band | None = None,
        region: Sequence[float] | None = None,
        modes: int | None = None,
        memory: float | None = None,
        progress: Progress | None = None,
    ) -> Question:
        """Raises InputError, and ComputationError for what does not fit into the memory."""
        file = subject
        if isinstance(subject, System):
            file = SystemFile(subject, assumptions=subject.assumptions)
        if isinstance(file, Assembly):
            file = SystemFile(file.system, assembly=file)
        if not isinstance(file, SystemFile):
            allowed = "it must be a System, an Assembly or what read_system gives"
            raise InputError(f"{type(subject).__name__} is not allowed; {allowed}")
        if band is None and region is None and Question(file, Wanted()).joined:
            band = (0.0, file.assembly.cutoff)
        wanted = Wanted(band, None if region is None else Rectangle(*region), modes)
        if not is_small(file.system):
            check_memory(file.system, memory)
        top = math.inf if file.assembly is None else file.assembly.cutoff
        if (wide := wanted.rectangle) and wide.high_imag > 1.000001 * math.tau * top:
            words = f"ends above the cutoff of the components, {top:g} Hz; roots above it decide"
            Place("band" if band else "region").warn(f"{words} nothing")
        PROGRESS.set(progress or (lambda _: None))
        return Question(file, wanted)

    @property
    def joined(self) -> dict[str, Any] | None:
        """How components were reduced before they were joined, None if they were not."""
        return self.file.assembly and self.file.assembly.reduction

    @property
    def system(self) -> System:
        """The system that is analysed."""
        return self.file.system

    def _warn_of_unused_parameter(self) -> None:
        """Warn where no matrix depends on the swept parameter: every value has the same answer.

        What presses components may depend on it without a matrix that does.
        """
        parameter = self.system.parameter
        if parameter not in self.system.names and self.file.assembly is None:
            Place(self.system.name or "system").warn(
                f"no matrix depends on {parameter}; the answer is the same at every value of it"
            )

    def eigenvalues(
        self, at: float | None = None, look: Sweep | None = None, prove: bool = True
    ) -> Eigenvalues:
        """The roots that are wanted, with what proves them complete, or of a large system from the
        basis of a first look. `prove` asks the referee of all roots of a small one."""
        file, free = self.file, self.system.parameter
        if at is not None:
            self._warn_of_unused_parameter()
            file = replace(file, system=self.system.replace({free: at}))
        system = file.system
        if look and isinstance(look.source[1], FirstLook) and not is_small(system):
            roots = looked_at(look.source[1], self.wanted, {free: system.parameters[free]})
        else:
            bounded = error_bounds(file, system) or tuple
            data = data_of(file, system) if prove else None
            roots = system_roots(system, self.wanted, bounded=bounded, data=data)
        doubts = [*roots.doubts, *file.assumptions]
        criterion = roots.criterion
        if roots.verdict is None:
            criterion = open_by_digits(file, roots.every) or criterion
        matrices, checks, region = matrix_list(file), system_checks(system), roots.region
        outside = roots.outside
        if outside and self.joined:  # roots above the cutoff decide nothing
            outside = tuple(z for z in outside if abs(z) < math.tau * file.assembly.cutoff)
        extent = {"radius": region.radius} if isinstance(region, Disc) else region and vars(region)
        details: dict[str, Any] = {"rows": system.n, "parameters": system.given}
        details |= {"matrices": matrices, "checks": checks, "region": extent, "basis": self.joined}
        details |= {"damped": [one._asdict() for one in file.damped], "fastest_outside": None}
        details |= {"growing_outside": None if outside is None else len(outside)}
        details |= picked(roots, "growth_limit") | {"doubts": doubts}
        details |= {"known_by": digits_of_files(file) if has_digits(system) else None}
        shapes = None
        if system.n <= SHOWN_ROWS:
            modes = mode_shapes(Spectrum(roots.eigenvalues))
            names = [f"q{i + 1}" for i in range(system.n)] if modes else []
            shapes = shape_rows(modes, names, "largest entry 1")
            for name, X in zip("MCK", system.at(), strict=True) if system.real else ():
                zero = np.zeros((system.n, system.n))
                details[name] = (zero if X is None else plain_matrix(X)).tolist()
        freedom = "degree" if system.n == 1 else "degrees"
        own = ", ".join(
            f"{name} = {'that of each root' if name in system.follows else format(value, 'g')}"
            for name, value in system.parameters.items()
        )
        lines = [f"{system.n} {freedom} of freedom, {own}"]
        known = any(root.error is not None for root in roots.eigenvalues)
        lines += [f"  {basis_text(self.joined, known)}"] if self.joined else []
        lines += [
            f"  {m['part']}: {m['file'] or 'rows'}, factor {m['factor']}, {m['nonzeros']} non-zeros"
            for m in matrices
        ]
        if file.damped:
            each = (f"{one.of} by {one.by} {one.value!s:.60}" for one in file.damped)
            lines.append(f"  damped terms: {', '.join(each)}")
        lines += [f"  {name}: {text}" for name, text in checks.items()]
        if file.assembly is not None:
            lines += [f"  {seat}" for seat in file.assembly.seats]
            details["contact"] = [seat.summary() for seat in file.assembly.seats]
        accuracy = accuracy_by_digits(file, roots.every)
        notes = ["\n".join(lines), *roots.notes, *[accuracy] * bool(accuracy)]
        beside = ""
        if outside:
            hertz, rate = abs(outside[0].imag) / math.tau, outside[0].real
            details["fastest_outside"] = {"frequency_hz": hertz, "growth_rate": rate}
            fastest = f"{number(hertz, 5)} Hz by {number(rate, 3)} 1/s"
            count = "1 mode grows" if len(outside) == 1 else f"{len(outside)} modes grow"
            beside = f"{count}, the fastest at {fastest}"
            if self.joined or not is_small(system):  # only those that the search came upon
                beside = f"growth was seen too, the fastest at about {fastest}"
            beside = f"Outside of the {'band' if self.wanted.band else 'region'} {beside}"
        words = "" if region is None else self.wanted.words(len(roots.eigenvalues))
        value, grow, source = system.parameters[free], _growing(system, roots), (file, roots)
        head = system.name, free, value, roots.eigenvalues, roots.verdict, criterion, grow
        more = (shapes, details, tuple(notes), beside)
        certified = roots.certified and not doubts
        statement = roots.statement
        if doubts and certified != roots.certified:  # nothing is proved of what was guessed
            statement = Statement("open", statement.by, reason="; ".join(doubts))
        # of joined components the count is that of the reduced system, as its own words say; what
        # was guessed has a line of its own
        line = "" if self.joined or doubts else statement.words
        proof: dict[str, Any] = {"proof": statement.to_dict(), "proof_line": line}
        return Eigenvalues(*head, certified, roots.count, words, *more, **proof, source=source)

    def sweep(
        self, values: Sequence[float], method: str | None = None, workers: int | None = None
    ) -> Sweep:
        """The roots at values of the parameter, on the system itself or on a reduced one."""
        self._warn_of_unused_parameter()
        system, reduction = self.system, None
        if method in ("reduced", "modal") or (method is None and not is_small(system)):
            reduction, _ = self.reduced(values, method or "modal", CHECKED)
        modes = followed(system, self.wanted, values, reduction, workers or 1)
        basis = basis_of(reduction, self.wanted) or self.joined
        answer = Sweep(
            system.name, system.parameter, *modes, basis=basis, source=(self.file, reduction)
        )
        return sweep_as_known(self.file, self.wanted, answer)

    def thresholds(
        self,
        high: float,
        low: float | None = None,
        workers: int | None = None,
        prove: bool | None = None,
    ) -> Thresholds:
        """Every threshold of the wanted roots from low to high, and what the referee says of them
        unless `prove` is false.

        What it refutes is searched again, with the place in question as one that is looked at.
        """
        system = self.system
        provable = system.n <= PROVED_ROWS and system.real and self.wanted == Wanted()
        provable &= self.file.assembly is None and not self.file.assumptions
        if prove and not provable:
            raise InputError(
                f"prove: all thresholds of real systems of up to {PROVED_ROWS} rows can be proved, "
                "without a band or a region"
            )
        self._warn_of_unused_parameter()
        looked_at: list[float] = []
        for _ in range(SEARCHES):
            answer = system_thresholds(
                system, high, low, self.wanted, workers or 1, looked_at=looked_at
            )
            if prove is False:
                break
            refuted = None
            if provable:
                answer, refuted = self._proved(answer)
            elif is_small(system) and system.real and self.file.assembly is None:
                answer, refuted = self._counted(answer)
            if refuted is None:
                break
            looked_at.append(refuted)
        if self.joined:
            answer = widened(self.system, self.file.assembly, answer)
        return thresholds_as_known(self.file, self.wanted, answer)

    def _proved(self, answer: Thresholds) -> tuple[Thresholds, float | None]:
        """The answer with what the referee says of its whole range, and where it is refuted."""
        system = self.system
        roots = roots_of_all(system, self.wanted, {system.parameter: answer.low})
        fastest = float(np.max(np.abs(roots), initial=0.0))
        statement, places = system_statement(
            system, answer.crossings, answer.low, answer.high, fastest
        )
        return with_places(answer, statement, places), statement.refuted_at

    def _counted(self, answer: Thresholds) -> tuple[Thresholds, float | None]:
        """The answer, and where the counts of the referee beside its thresholds refute it."""
        refuted, words = disagreement(self.system, answer.crossings, answer.low, answer.high)
        if refuted is None:
            return answer, None
        details = {**answer.details, "doubts": [*answer.details["doubts"], words]}
        return replace(answer, certified=False, details=details), refuted

    def map(self, axes: tuple[Axis, Axis] | None, workers: int | None = None) -> Map:
        """The verdict on the wanted roots over two named parameters."""
        system, wanted, reduction = self.system, self.wanted, None
        if axes is None or axes[0].name == axes[1].name:
            raise InputError(f"{system.name}: axes: must be two different parameters, by name")
        names = axes[0].name, axes[1].name
        system.values(dict.fromkeys(names, 0.0))
        for name in set(names) - system.names:
            used = ", ".join(sorted(system.names)) or "no parameter"
            words = f"no matrix depends on it; {used} does"
            raise InputError(f"{name}: is not allowed in a chart, {words}")
        if not is_small(system):
            first, second = (np.linspace(a.low, a.high, CORNERS).tolist() for a in axes)
            corners = [{names[0]: a, names[1]: b} for a in first for b in second]
            reduction = reduced_for(system, wanted, corners, "modal")
        grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
        pairs = zip(*(part.ravel().tolist() for part in grid), strict=True)
        points = [dict(zip(names, pair, strict=True)) for pair in pairs]
        parts = mapped(_cell, points, workers or 1, (system, wanted, reduction))
        cells = np.array(list(counted(parts, len(points), PROGRESS.get(), "points")))
        codes = cells[:, 0].astype(np.int8).reshape(grid[0].shape)
        basis = basis_of(reduction, wanted) or self.joined
        details = {"verdicts": [[NAMES[k] for k in row] for row in codes], "basis": basis}
        largest = "largest_real", "1/s", cells[:, 1].reshape(codes.shape)
        head, notes = (system.name, axes, ("", ""), NAMES), (basis_text(basis),) if basis else ()
        return Map(*head, codes, largest, details=details, notes=notes, source=(self.file,))

    def reduced(
        self, values: Sequence[float] | None, method: str = "reduced", most: int = SERVED
    ) -> tuple[Reduction, dict[str, Any] | None]:
        """The system reduced to the roots that are wanted, for these values of its parameter (its
        own), of which it is good at `most`; and what a JSON object says of that."""
        free = self.system.parameter
        own = [self.system.parameters[free]] if values is None else values
        index = np.linspace(0, len(own) - 1, min(most, len(own)))
        changes = [{free: own[round(k)]} for k in index.tolist()]
        reduction = reduced_for(self.system, self.wanted, changes, method)
        return reduction, basis_of(reduction, self.wanted)

    def sensitivity(
        self,
        of: str,
        high: float,
        low: float | None = None,
        known: Any = None,
        matrices: Matrices | None = None,
    ) -> Sensitivity:
        """What moves the wanted roots, or the first loss of stability among them."""
        system = with_matrices(self.file, matrices or {})
        if of == "threshold":
            return threshold_sensitivity(system, known or self.thresholds(high, low, prove=False))
        return root_sensitivity(system, known or self.eigenvalues())


Common = tuple[System, Wanted, Reduction | None]


def _cell(common: Common, at: dict[str, float]) -> tuple[int, float]:
    """The verdict, by its index, and the largest growth at one point of a chart."""
    system, wanted, reduction = common
    if isinstance(reduction, FirstLook):
        roots, _, errors, *_ = reduction.decided(at, deciding=True)
    else:
        roots = reduction.values(at) if reduction else roots_of_all(system, wanted, at)
        errors = np.zeros(1)
    errors = np.fmax(errors, rounding_of(system, roots))
    growth = float(roots.real.max()) if len(roots) else np.nan
    return NAMES.index(verdict_of(roots, errors)), growth


def _growing(system: System, roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """What grows among the roots; of a small system with the onset of each."""
    at = system.parameters[system.parameter]
    grow = growing(roots.every)
    if not (grow and system.real and at > 0.0 and system.n <= ONSET_ROWS):
        return grow
    try:
        known = unstable_modes(system, at, linear_thresholds(system, at))
    except InputError:  # no way from zero: a factor divides by the parameter, M has no factor
        return grow

    def onset(mode: UnstableMode) -> float | None:
        same = min(known, key=lambda other: abs(other.root - mode.root), default=mode)
        return same.onset if abs(same.root - mode.root) <= SAME * abs(mode.root) else None

    return tuple(replace(mode, onset=onset(mode)) for mode in grow)


def along(answer: Thresholds) -> Sweep:
    """The eigenvalue paths over the range of thresholds, for a figure."""
    values = np.linspace(answer.low, answer.high, SHOWN).tolist()
    system, wanted, reduction = answer.source
    return Sweep(answer.name, answer.parameter, *followed(system, wanted, values, reduction))
