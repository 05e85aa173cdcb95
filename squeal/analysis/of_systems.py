"""The verbs for systems from matrices: what `squeal.analysis.verbs` answers with."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from squeal.analysis.answers import (
    Axis,
    Eigenvalues,
    Map,
    Sensitivity,
    Step,
    Sweep,
    Thresholds,
    basis_text,
    shape_rows,
)
from squeal.analysis.pads import mode_shapes
from squeal.analysis.systems.matrices import matrix_list, system_checks
from squeal.analysis.systems.roots import (
    NO_BAND,
    NO_ROOT,
    SystemRoots,
    Wanted,
    check_memory,
    extent,
    growing,
    is_small,
    noise_of,
    reduced_for,
    roots_of_all,
    system_roots,
    verdict_of,
)
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.errors import InputError
from squeal.io.system import SystemFile
from squeal.linear import GROWING, VERDICTS, Spectrum, UnstableMode, unstable_modes
from squeal.linear import thresholds as linear_thresholds
from squeal.linear.eigen import ordered
from squeal.linear.matrices import dense as plain_matrix
from squeal.linear.system import TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.quadratic import Progress, quiet
from squeal.sparse.reduction import Reduction

ONSET_ROWS = 40  # up to so many rows the onset of each unstable mode is computed
SHOWN_ROWS = 100  # matrices and mode shapes of larger systems are not printed
CHECKED = 25  # values of a sweep at which its basis is checked
SERVED = 9  # values at which a reduced system has to be good
SHOWN = 121  # values of the parameter in a figure of thresholds
CORNERS = 5  # values a side of a chart at which a reduced system has to be good
SAME = 1e-6  # of |lambda|: one root, computed in two ways

METHODS = ("full", "reduced", "modal")
NAMES = (*VERDICTS, NO_ROOT)

Band = tuple[float, float]


def _some(values: Sequence[float], most: int) -> list[float]:
    """At most so many of the values, both ends included."""
    index = np.linspace(0, len(values) - 1, min(most, len(values)))
    return [values[round(k)] for k in index.tolist()]


def _basis(reduction: Reduction | None, wanted: Wanted) -> dict[str, Any] | None:
    """A reduced system as JSON holds it."""
    if reduction is None:
        return None
    limit = None if wanted.band is None else wanted.rectangle.high_real  # type: ignore[union-attr]
    return {
        "method": reduction.method,
        "size": reduction.size,
        "samples": [dict(changes) for changes in reduction.samples],
        "residual": reduction.worst,
        "converged": reduction.converged,
        "spurious": reduction.spurious,
        "growth_limit": limit,
    }


@dataclass(frozen=True)
class Question:
    """A system, what is known of its files, and which of its roots are wanted; its methods are the
    verbs."""

    file: SystemFile
    wanted: Wanted
    progress: Progress = quiet

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
        file = SystemFile(subject) if isinstance(subject, TermSystem) else subject
        if not isinstance(file, SystemFile):
            allowed = "it must be a Scene, a System or what read_system gives"
            raise InputError(f"{type(subject).__name__} is not allowed; {allowed}")
        wanted = Wanted(band, None if region is None else Rectangle(*region), modes)
        if not is_small(file.system):
            check_memory(file.system, memory)
        return Question(file, wanted, progress or quiet)

    @property
    def system(self) -> TermSystem:
        """The system that is analysed."""
        return self.file.system

    def eigenvalues(self, at: float | None = None) -> Eigenvalues:
        """The roots that are wanted, with what proves them complete."""
        file, free = self.file, self.system.parameter
        if at is not None:
            file = replace(file, system=self.system.replace({free: at}))
        system = file.system
        roots = system_roots(system, self.wanted, None, self.progress)
        matrices, checks = matrix_list(file), system_checks(system)
        details: dict[str, Any] = {
            "rows": system.n,
            "parameters": dict(system.parameters),
            "matrices": matrices,
            "checks": checks,
            "region": extent(roots.region),
            "growth_limit": roots.growth_limit,
            "growing_outside": roots.growing_outside,
            "basis": None,
        }
        shapes = None
        if system.n <= SHOWN_ROWS:
            modes = mode_shapes(Spectrum(roots.eigenvalues))
            names = [f"q{i + 1}" for i in range(system.n)] if modes else []
            shapes = shape_rows(modes, names, "largest entry 1")
            for name, X in zip("MCK" if system.real else "", system.at(), strict=False):
                zero = np.zeros((system.n, system.n))
                details[name] = (zero if X is None else plain_matrix(X)).tolist()
        freedom = "degree" if system.n == 1 else "degrees"
        own = ", ".join(f"{name} = {value:g}" for name, value in system.parameters.items())
        lines = [f"{system.n} {freedom} of freedom, {own}"]
        lines += [
            f"  {m['part']}: {m['file'] or 'rows'}, factor {m['factor']}, {m['nonzeros']} non-zeros"
            for m in matrices
        ]
        notes = ["\n".join(lines + [f"  {name}: {text}" for name, text in checks.items()])]
        if roots.growing_outside:
            notes.append(f"{roots.growing_outside} modes grow outside of the band or region")
        words = "" if roots.region is None else self.wanted.words()
        if roots.growth_limit is not None:
            words += f" with growth below {roots.growth_limit:.4g} 1/s"
        return Eigenvalues(
            system.name,
            free,
            system.parameters[free],
            roots.eigenvalues,
            roots.verdict,
            roots.criterion,
            _growing(system, roots),
            roots.certified,
            roots.count,
            words,
            shapes,
            details,
            tuple(notes),
            source=(file, roots),
        )

    def sweep(self, values: Sequence[float], method: str | None = None) -> Sweep:
        """The roots at values of the parameter, on the system itself or on a reduced one."""
        system, free, basis = self.system, self.system.parameter, None
        if method is not None and method not in METHODS:
            allowed = f"it must be one of {', '.join(METHODS)}"
            raise InputError(f"method: {method} is not allowed; {allowed}")
        if method == "full" or (method is None and is_small(system)):
            steps = tuple(self._full(values))
        else:
            changes = [{free: value} for value in _some(values, CHECKED)]
            method = method or "reduced"
            reduction, region = reduced_for(system, self.wanted, changes, method, self.progress)
            steps = tuple(self._reduced(values, reduction, region))
            basis = _basis(reduction, self.wanted)
        return Sweep(system.name, free, steps, basis, self.file)

    def _reduced(
        self, values: Sequence[float], reduction: Reduction, region: Rectangle
    ) -> Iterator[Step]:
        """The sweep on a reduced system."""
        noise = noise_of(reduction.system)
        for value in values:
            solution = reduction.modes(region, {self.system.parameter: value})
            verdict = _growth(solution.values, noise)  # of all of them, however few are listed
            order = ordered(solution.values)[: self.wanted.modes]
            residuals = solution.residuals[order]
            yield Step(
                value, solution.values[order], residuals, verdict, spurious=solution.spurious
            )

    def _full(self, values: Sequence[float]) -> Iterator[Step]:
        """The sweep on the system itself."""
        system, wanted, noise = self.system, self.wanted, noise_of(self.system)
        small = is_small(system)
        if not small and wanted.rectangle is None and wanted.modes is None:
            raise InputError(NO_BAND)
        for value in values:
            changes = {system.parameter: value}
            if not small:
                self.progress(f"{system.parameter} = {value:g}")
                answer = system_roots(system, wanted, changes, self.progress)
                roots = np.array([e.value for e in answer.eigenvalues], dtype=complex)
                residuals = np.array([e.residual for e in answer.eigenvalues])
                yield Step(value, roots, residuals, answer.verdict)
                continue
            roots = roots_of_all(system, wanted, changes)
            # on all of them, however few are listed
            verdict = (verdict_of if wanted.rectangle is None else _growth)(roots, noise)
            if wanted.modes is not None:
                roots = roots[roots.imag >= 0.0][: wanted.modes]
            yield Step(value, roots, np.full(len(roots), np.nan), verdict)

    def thresholds(self, high: float, low: float | None = None) -> Thresholds:
        """Every threshold of the wanted roots from low to high."""
        system, wanted = self.system, self.wanted
        located = system_thresholds(system, high, low, wanted, self.progress)
        basis = _basis(located.reduction, wanted)
        notes = [f"not confirmed on the full system: {words}" for words in located.unconfirmed]
        notes += located.left_out
        if located.crossings_outside:
            notes.append(f"crossings outside {wanted.words()}: {located.crossings_outside}")
        if located.certified is not None:
            foreseen = "foreseen, not excluded by proof" if system.real else "not foreseen"
            notes.append(f"windows between the computed values are {foreseen}")
        if basis:
            notes.append(basis_text(basis))
        details = {
            "parameters": dict(system.parameters),
            "admissible_to": located.high,
            "unconfirmed": list(located.unconfirmed),
            "left_out": list(located.left_out),
            "crossings_outside": located.crossings_outside,
            "basis": basis,
        }
        return Thresholds(
            system.name,
            system.parameter,
            located.low,
            located.high,
            located.verdict,
            located.points,
            located.crossings,
            f"{system.parameter} = {located.high:g} is reached",
            located.certified,
            notes=tuple(notes),
            details=details,
            source=(self.file, located, wanted),
        )

    def map(self, axes: tuple[Axis, Axis] | None) -> Map:
        """The verdict on the wanted roots over two named parameters."""
        system, wanted, reduction = self.system, self.wanted, None
        if axes is None or axes[0].name == axes[1].name:
            given = "none" if axes is None else f"{axes[0].name} twice"
            allowed = "it must be two named parameters"
            raise InputError(f"{system.name}: axes: {given} is not allowed; {allowed}")
        for axis in axes:
            system.values({axis.name: 0.0})
            if axis.name not in system.names:
                used = ", ".join(sorted(system.names)) or "no parameter"
                raise InputError(
                    f"{axis.name}: is not allowed in a chart, no matrix depends on it; {used} does"
                )
        names = axes[0].name, axes[1].name
        if not is_small(system):
            first, second = (np.linspace(a.low, a.high, CORNERS).tolist() for a in axes)
            corners = [{names[0]: a, names[1]: b} for a in first for b in second]
            reduction, region = reduced_for(system, wanted, corners, progress=self.progress)
        codes, noise = np.zeros((axes[0].n, axes[1].n), dtype=np.int8), noise_of(system)
        growth = np.full(codes.shape, np.nan)
        for i, a in enumerate(axes[0].values.tolist()):
            self.progress(f"{names[0]} = {a:.6g}")
            for j, b in enumerate(axes[1].values.tolist()):
                changes = {names[0]: a, names[1]: b}
                if reduction is None:
                    roots = roots_of_all(system, wanted, changes)
                else:
                    roots = reduction.values(region, changes)
                codes[i, j] = NAMES.index(verdict_of(roots, noise))
                growth[i, j] = roots.real.max() if len(roots) else np.nan
        basis = _basis(reduction, wanted)
        return Map(
            system.name,
            axes,
            ("", ""),
            NAMES,
            codes,
            ("largest_real", "1/s", growth),
            details={"verdicts": [[NAMES[k] for k in row] for row in codes], "basis": basis},
            notes=(basis_text(basis),) if basis else (),
            source=(self.file,),
        )

    def reduced(
        self, values: Sequence[float] | None, method: str = "reduced"
    ) -> tuple[Reduction, dict[str, Any] | None]:
        """The system reduced to the roots that are wanted, for these values of its parameter (its
        own), and what a JSON object says of that."""
        system, free = self.system, self.system.parameter
        own = [system.parameters[free]] if values is None else values
        changes = [{free: value} for value in _some(own, SERVED)]
        reduction, _ = reduced_for(system, self.wanted, changes, method, self.progress)
        return reduction, _basis(reduction, self.wanted)

    def sensitivity(self, of: str, high: float, known: Eigenvalues | None = None) -> Sensitivity:
        """What moves the eigenvalues: -y^H (s^2 dM + s dC + dK) x over y^H (2 s M + C) x."""
        if of == "threshold":
            raise InputError(
                "sensitivity: thresholds of a system are not allowed; advise takes them"
            )
        answer = known or self.eigenvalues()
        system = self.system.replace({self.system.parameter: answer.value})
        values = dict(system.parameters)
        M, C, _ = system.at()
        slopes = {}
        for name in values:
            dM, dC, dK = system.derivative(name)
            moved = []
            for root in answer.eigenvalues:
                s, x, y = root.value, root.right, root.left.conj()
                terms = ((s * s, dM), (s, dC), (1.0, dK))
                change = sum(f * (y @ (X @ x)) for f, X in terms if X is not None)
                scale = y @ (2 * s * (M @ x) + (0.0 if C is None else C @ x))
                moved.append(-change / scale if scale else complex(np.nan, np.nan))
            slopes[name] = np.array(moved, dtype=complex)
        verdict, units = answer.verdict or "", dict.fromkeys(values, "")
        return Sensitivity(
            "eigenvalues", system.parameter, answer.values, verdict, slopes, values, units
        )


def _growth(roots: np.ndarray, noise: float) -> str | None:
    """The verdict on some roots, which prove none but growth."""
    verdict = verdict_of(roots, noise)
    return verdict if verdict in GROWING else None


def _growing(system: TermSystem, roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """What grows among the roots; of a small system with the onset of each."""
    at = system.parameters[system.parameter]
    grow = growing((*roots.eigenvalues, *roots.others))
    if not (grow and system.real and at > 0.0 and system.n <= ONSET_ROWS):
        return grow
    try:
        known = unstable_modes(system, at, linear_thresholds(system, at))
    except InputError:  # no way from zero: a factor divides by the parameter, M has no factor
        return grow

    def apart(one: UnstableMode, other: UnstableMode) -> float:
        hertz = 2 * np.pi * (one.frequency_hz - other.frequency_hz)
        size = np.hypot(one.growth_rate, 2 * np.pi * one.frequency_hz)
        return float(np.hypot(one.growth_rate - other.growth_rate, hertz) / size)

    modes = []
    for mode in grow:
        same = min(known, key=lambda other: apart(mode, other), default=None)
        onset = same.onset if same is not None and apart(mode, same) <= SAME else None
        modes.append(replace(mode, onset=onset))
    return tuple(modes)


def along(answer: Thresholds) -> Sweep:
    """The eigenvalue paths over the range of thresholds, for a figure."""
    file, located, wanted = answer.source
    question, values = Question(file, wanted), np.linspace(answer.low, answer.high, SHOWN).tolist()
    if located.reduction is None:
        steps = question._full(values)
    else:
        steps = question._reduced(values, located.reduction, wanted.rectangle)
    return Sweep(answer.name, answer.parameter, tuple(steps), source=file)
