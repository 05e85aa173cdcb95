"""Eigenvalues of a pad or a system at one value of its parameter, and the modes that grow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import InputError
from squeal.io.writing import (
    Answer,
    Column,
    JsonObject,
    Panel,
    Table,
    columns,
    copied_attributes,
    number,
)
from squeal.linear import Spectrum, UnstableMode
from squeal.linear.eigen import Eigenvalue, values_of
from squeal.linear.matrices import EPS
from squeal.linear.paths import mode_numbers
from squeal.linear.shaft import name_of_kind, speed_words
from squeal.results.columns import (
    ERROR,
    OPEN,
    ROOT,
    UNSURE,
    onset_column,
    parameter_entry,
    rounded_growth,
)
from squeal.results.sources import Source, SystemSource, refuse_other_subject, unit_of

SAME = 1e-9  # of |lambda|: a mode that grows is this listed one
Onsets = dict[UnstableMode, JsonObject]
"""Of unstable modes `onset` and `interval`, as `UnstableMode` has them."""
COORDINATES = {"x": "m", "y": "m", "theta": "rad"}
"""Of a pad, with their units."""


@dataclass(frozen=True, eq=False)
class ModeShape:
    """The shape (n,) of one mode, complex.

    number: by rising frequency, from 1; a pair of eigenvalues is one mode. shape: scaled so that
    the entry of levers * shape with the largest absolute value is 1, see `mode_shapes`; a rotation
    is thus one over a length.
    """

    number: int
    frequency_hz: float
    growth_rate: float
    shape: np.ndarray = field(repr=False)


def mode_shapes(spectrum: Spectrum, levers: ArrayLike = 1.0) -> tuple[ModeShape, ...]:
    """The shape of each mode, by rising frequency.

    A mode is a pair of complex eigenvalues, or two real ones. Of all real eigenvalues the half that
    grows faster (rounded up) is shown, since an eigenvalue of that half is the first to become
    unstable. Real ones come first, as their frequency is 0.

    Parameters
    ----------
    spectrum : Spectrum
        Eigenvalues by rising frequency; solvers set the imaginary part of real ones to 0.
    levers : array_like (n,)
        Lengths that make the coordinates comparable, (1, 1, w) of a pad, whose angle moves an edge
        by w; 1 if left out.
    """
    real = [root for root in spectrum.eigenvalues if root.value.imag == 0.0]
    real.sort(key=lambda root: -root.growth_rate)
    shown = real[: (len(real) + 1) // 2]
    shown += [root for root in spectrum.eigenvalues if root.value.imag > 0.0]
    return tuple(mode_shape(k, root, levers) for k, root in enumerate(shown, 1))


def mode_shape(number_of_mode: int, root: Eigenvalue, levers: ArrayLike) -> ModeShape:
    """The shape of a mode, scaled so that its largest part is 1; levers: see `mode_shapes`."""
    lengths = np.asarray(levers) * root.right
    largest = int(np.argmax(np.abs(lengths)))
    return ModeShape(
        number=number_of_mode,
        frequency_hz=root.frequency_hz,
        growth_rate=root.growth_rate,
        shape=root.right / lengths[largest],  # levers set the scale alone
    )


def shape_rows(shapes: Sequence[ModeShape], names: Sequence[str], rule: str) -> JsonObject:
    """Mode shapes as a JSON object; names: of the coordinates, rule: how shapes are scaled."""
    rows = []
    for mode in shapes:
        row = {"mode": mode.number} | copied_attributes(mode, "frequency_hz growth_rate")
        row |= {"real": mode.shape.real.tolist(), "imag": mode.shape.imag.tolist()}
        rows.append(row)
    return {"coordinates": list(names), "normalisation": rule, "shapes": rows}


def eigenvalues_of_arrays(
    values: NDArray[np.complex128],
    residuals: NDArray[np.float64],
    rounding: NDArray[np.float64],
    right: NDArray[np.complex128] | None = None,
) -> tuple[Eigenvalue, ...]:
    """Roots (m,) without left vectors.

    values in rad/s; residuals: backward errors; rounding: how far they may be off, 1/s; right:
    right vectors (k, m), of no length if left out.
    """
    no_vector = np.empty(0, dtype=complex)
    roots = []
    for k, value in enumerate(values.tolist()):
        root = Eigenvalue(
            value,
            right=no_vector if right is None else right[:, k],
            left=no_vector,
            residual=float(residuals[k]),
            condition=math.nan,
            rounding=float(rounding[k]),
        )
        roots.append(root)
    return tuple(roots)


class KnowsOnsets(Protocol):
    """A sweep or thresholds: answers that say from which value on a mode grows."""

    @property
    def source(self) -> Source | None:
        """What it was computed from."""
        ...

    def onsets(self, eigenvalues: Eigenvalues) -> Onsets:
        """`onset` and `interval` of those of the unstable modes for which they are known."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Eigenvalues(Answer):
    """Eigenvalues of a pad or a system at one value of its parameter.

    eigenvalues: by rising frequency, of a region that `extent` names in words ("" for all);
    verdict: on them, None where they decide nothing; certified: whether it is proved, or of more
    than 400 rows counted, that no eigenvalue of the extent is missing; proof: what is known of
    that, as JSON holds it, and proof_line in words; unstable: the modes that grow, the fastest
    first; shapes: mode shapes as JSON holds them; details: what else the JSON object says, M, C and
    K among it; notes: lines for people; beside: what grows outside of the extent, in words;
    depends: whether anything depends on the parameter, so that its value is worth naming; numbers
    (m,): of the modes of the eigenvalues, where modes are not numbered by rising frequency.

    Examples
    --------
    >>> import squeal
    >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
    >>> found = squeal.eigenvalues(mass)
    >>> found.verdict, found.values.round(4).tolist()
    ('stable', [(-0.1+1.9975j), (-0.1-1.9975j)])
    """

    panel = Panel("real", "frequency_hz")

    name: str
    parameter: str
    value: float
    eigenvalues: tuple[Eigenvalue, ...]
    verdict: str | None
    criterion: str
    unstable: tuple[UnstableMode, ...]
    certified: bool
    count: int | None
    extent: str = ""
    shapes: Mapping[str, Any] | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    beside: str = ""
    warnings: tuple[str, ...] = ()
    source: Source | None = None
    proof: Mapping[str, Any] | None = None
    proof_line: str = ""
    depends: bool = True
    numbers: NDArray[np.intp] | None = None

    @property
    def values(self) -> NDArray[np.complex128]:
        """The eigenvalues (m,) in rad/s."""
        return values_of(self.eigenvalues)

    @property
    def modes(self) -> NDArray[np.intp]:
        """The number (m,) of each one's mode, by rising frequency unless `numbers` says another; of
        a pair both have the same."""
        return mode_numbers(self.values) if self.numbers is None else self.numbers

    @property
    def of_modes(self) -> list[tuple[int, Eigenvalue]]:
        """Each with the number of its mode."""
        return list(zip(self.modes.tolist(), self.eigenvalues, strict=True))

    @property
    def open(self) -> str:
        """Which modes the error of a reduction, or the digits of files, leave open, in words; empty
        if none."""
        numbers = sorted({number for number, root in self.of_modes if root.sign_is_open})
        if not numbers:
            return ""
        mode = "mode" if len(numbers) == 1 else "modes"
        within = "the error of the reduction"
        known_by = self.details.get("known_by")  # the digits of files, in words
        if known_by:
            within = f"what {known_by} leave open"
        return f"growth of {mode} {', '.join(map(str, numbers))} is within {within}"

    @property
    def coordinates(self) -> list[str]:
        """What each row of an eigenvector is called: of a system by the label of the row."""
        if isinstance(self.source, SystemSource):
            return self.source.file.system.row_names
        return list(COORDINATES)

    def mode_of(self, mode: UnstableMode) -> int | None:
        """The number of a mode that grows, None if it is not listed.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> found = squeal.eigenvalues(pair)
        >>> [found.mode_of(mode) for mode in found.unstable]
        [1]
        """
        tolerance = SAME * abs(mode.root)
        numbers = self.modes[np.abs(self.values - mode.root) <= tolerance].tolist()
        if not numbers:
            return None
        # Several unstable modes may have this root: if it is that of modes 2 and 3, the first of
        # them is mode 2, the second mode 3; more of them than roots are listed are mode 3, too. A
        # mode of another answer has the first number
        position = 0
        for other in self.unstable:
            if other is mode:
                return numbers[min(position, len(numbers) - 1)]
            if abs(other.root - mode.root) <= tolerance:
                position += 1
        return numbers[0]

    def save_shapes(self, path: Path | str) -> None:
        """Write the shapes of the modes on the nodes of a system with coordinates, as VTK (.vtk)
        or a universal file (.unv), by the end of the name. Raises InputError.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> try:
        ...     squeal.eigenvalues(mass).save_shapes("shapes.vtk")
        ... except squeal.InputError as error:
        ...     print(error)
        save_shapes: needs `coordinates: {file: nodes.csv}` in the system file
        """
        coordinates = None
        if isinstance(self.source, SystemSource):
            coordinates = self.source.file.coordinates
        if coordinates is None:
            raise InputError(
                "save_shapes: needs `coordinates: {file: nodes.csv}` in the system file"
            )
        first_of_mode: dict[int, Eigenvalue] = {}  # of a pair the upper root
        for number_of_mode, root in self.of_modes:
            first_of_mode.setdefault(number_of_mode, root)
        from squeal.io.shapes import write_shapes  # which few answers need

        write_shapes(Path(path), coordinates, sorted(first_of_mode.items()))

    def with_onsets(self, others: KnowsOnsets) -> Eigenvalues:
        """The eigenvalues with the onsets of unstable modes from a sweep or from thresholds.

        An onset that is known already stays. Raises InputError for those of another subject.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> found = squeal.eigenvalues(pair).with_onsets(squeal.thresholds(pair))
        >>> round(found.unstable[0].onset, 9)
        0.75
        """
        if self.source is not None:
            refuse_other_subject("others", others.source, self.source.subject)
        onset_fields = others.onsets(self)  # `onset` and `interval` of each mode
        unstable = []
        for mode in self.unstable:
            if mode.onset is None and mode in onset_fields:
                mode = replace(mode, **onset_fields[mode])
            unstable.append(mode)
        return replace(self, unstable=tuple(unstable))

    @property
    def conclusion(self) -> str:
        """The verdict in a line."""
        if self.unstable:
            modes = "1 unstable mode"
            if len(self.unstable) > 1:
                modes = f"{len(self.unstable)} unstable modes"
            return self._with_extent(modes) + f": {self._fastest()}"
        if self.verdict == "stable":
            return self._with_extent("Stable")
        if self.verdict == "marginal":
            reason = "no mode grows, not all decay"
            if self.limit_hz is not None:  # two undamped modes of one frequency
                modes = f"modes at {self.limit_hz:.4g} Hz have one shape"
                reason = f"to rounding on the limit of flutter, {modes}"
            return self._with_extent("Marginal") + f": {reason}"
        # what is open: the signs of some roots (`self.open`), or all that the criterion says
        if self.open or self.criterion.startswith(OPEN):
            reason = self.open or self.criterion.removeprefix(OPEN)
            return self._with_extent("Open") + f": {reason}"
        what = "growing mode" if self.eigenvalues else "root"
        return self._with_extent(f"No {what} was found") + f"; {self.completeness}"

    @property
    def limit_hz(self) -> float | None:
        """The first frequency at which undamped modes coincide to rounding in too few shapes.

        At such a root z fewer independent vectors x solve (z^2 M + z C + K) x = 0 than roots
        coincide: a motion t sin(omega t) is possible. The drift of a free body, at zero, is no such
        limit. Known only where the details hold the matrices.
        """
        if "K" not in self.details:
            return None
        M, C, K = map(np.array, map(self.details.get, "MCK"))
        for root in self.eigenvalues:
            z = root.value  # rad/s
            # two roots coincide if their distance is at most the rounding of both
            rounding = 2 * root.rounding + EPS * abs(z)
            coinciding_roots = np.sum(np.abs(self.values - z) <= rounding)
            if root.kind == "marginal" and z.imag > 0.0 and coinciding_roots > 1:
                P = z * z * M + z * C + K
                slope = 2 * abs(z) * M + abs(C)  # of the size of dP/dz = 2 z M + C
                # how far P is off by rounding of K and of z: smaller singular values count as zero
                error = EPS * np.linalg.norm(K) + rounding * np.linalg.norm(slope)
                shape_count = len(P) - np.linalg.matrix_rank(P, tol=len(P) * error)
                if shape_count < coinciding_roots:
                    return root.frequency_hz
        return None

    def _with_extent(self, verdict: str) -> str:
        """A verdict with the region and the value of the parameter that it holds for."""
        if self.extent:
            verdict += f", {self.extent}"
        if self.depends:
            verdict += f", {self.parameter} = {number(self.value, 4)}"
            verdict += speed_words(self.value, unit_of(self.source))
        return verdict

    def _fastest(self) -> str:
        """The size of the mode that grows fastest, in words."""
        fastest = self.unstable[0]
        if fastest.frequency_hz:
            damping = 100 * fastest.damping_ratio
            size = f"{fastest.frequency_hz:.4g} Hz, damping {damping:.3g} %"
        else:
            size = f"{fastest.kind}, growth {fastest.growth_rate:.4g} 1/s"
        if len(self.unstable) > 1:
            size = f"the fastest {size}"
        return size

    @property
    def completeness(self) -> str:
        """How sure it is that no root is missing, in words."""
        if self.proof_line:
            return self.proof_line
        if self.certified:
            return "certified by a count"
        doubts = self.details.get("doubts")
        if doubts:
            return f"not certified: {'; '.join(doubts)}"
        return UNSURE

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of its roots, with the error of a reduction if it is known."""
        if any(root.error is not None for root in self.eigenvalues):
            return (*ROOT, ERROR)
        return ROOT

    def table(self) -> Table:
        numbers = {id(root): number for number, root in self.of_modes}
        mode = Column("mode", value=lambda root: numbers[id(root)])
        return Table((mode, *self.columns), self.eigenvalues, "", "no root", rounded_growth)

    @property
    def growing(self) -> Table:
        """The table of the modes that grow, with the error of a reduction if it is known."""
        heads = [
            Column("mode", value=self.mode_of),
            Column("kind", shown=lambda mode: name_of_kind(mode.kind, unit_of(self.source))),
            *columns("frequency_hz"),
            Column("growth_rate", "1/s"),
        ]
        if ERROR in self.columns:  # the eigenvalue of a mode knows its error, the mode does not

            def error_of(mode: UnstableMode) -> str:
                if self.mode_of(mode) is None:
                    return "-"
                # by its value, since two real roots may share a number
                nearest = min(self.eigenvalues, key=lambda root: abs(root.value - mode.root))
                return ERROR.cell(nearest)

            heads.append(replace(ERROR, shown=error_of))
        heads += columns("damping_ratio%")
        if self.depends:
            heads.append(onset_column(self.parameter, unit_of(self.source)))
        nothing = "no unstable mode is listed"
        if self.verdict is None:  # a listed root may grow that rounding leaves open
            nothing = "no mode is known to grow"
        return Table(heads, self.unstable, "unstable modes", nothing, rounded_growth)

    def parts(self) -> Sequence[str | Table]:
        count = f"{len(self.eigenvalues)} roots, {self.completeness}"
        limit = self.details.get("growth_limit")
        if limit is not None:
            count += f"; roots that grow by more than {number(limit, 4)} 1/s are not among them"
        head = f"{self.name}\n{self.conclusion}\n{self.beside}".rstrip()
        # the first note says what equilibrium or matrices were analysed: it stands above the table
        notes = []
        if self.open and self.unstable:  # else the conclusion says it
            notes.append(self.open)
        notes += self.notes[1:]
        onset_is_unknown = all(mode.onset is None for mode in self.unstable)
        # matrices that do not depend on the parameter have no onset
        if self.unstable and self.depends and onset_is_unknown:
            notes.append(f"from which {self.parameter} on: --sweep and `squeal thresholds` tell")
        return [head, *self.notes[:1], self.table(), count, self.growing, *notes]

    def to_dict(self) -> JsonObject:
        document: JsonObject = {"name": self.name}
        document |= parameter_entry(self.parameter, self.value)
        document |= copied_attributes(self, "details")["details"]  # copies of them
        document["eigenvalues"] = Table(self.columns, self.eigenvalues).records()
        document |= copied_attributes(self, "verdict criterion certified count")
        if self.proof is not None:
            document["proof"] = dict(self.proof)
        unstable = self.unstable
        document["unstable"] = [{"mode": self.mode_of(mode)} | asdict(mode) for mode in unstable]
        document["mode_shapes"] = copied_attributes(self, "shapes")["shapes"]
        return document
