"""What files of matrices hold, before anything is solved that costs: `squeal check`."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Annotated, Any, NamedTuple

import numpy as np

from squeal.io.coordinates import POINTS, Coordinates
from squeal.io.halves import sides_of
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, copied_attributes, number
from squeal.linear.matrices import Matrix, why_no_mass
from squeal.linear.system import System, TermSystem
from squeal.model.pad import Pad
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.real_modes import RealModes, real_modes
from squeal.queries.systems.matrices import ALL_ROWS, matrix_list, system_checks
from squeal.queries.systems.system_analysis import SystemAnalysis
from squeal.queries.unit_hints import FASTEST, hints_of_units, mesh_speed
from squeal.results.columns import basis_text
from squeal.schema import Whole, public

MESH = 30  # nodes from which on the speeds from one to the next are those of waves
FASTEST_PAD = 2500.0  # m/s: the largest size times lowest frequency of a pad on springs


@dataclass(frozen=True, eq=False, repr=False)
class Check(Answer):
    """What a system of matrices is: its files, mass and lowest real modes.

    Attributes
    ----------
    name, rows
        Of the system.
    matrices : tuple of mapping
        Each matrix with its part, file, format, rows and symmetry.
    checks : mapping of str to str
        What is to be said of M, C and K: symmetry, definiteness, condition.
    mass : float or None
        Of all rows that move; None without coordinates, of reduced components, and where no
        displacement has a mass, as in a model of torsion.
    centre : tuple of 3 float, or None
        Centre of mass; None where the mass is.
    size : tuple of 3 float, or None
        Lengths of the box around all nodes; None without coordinates, and of reduced components.
    elements : int
        How many elements have faces.
    frequencies_hz : tuple of float
        The lowest real modes without friction and damping, but for free motions; of reduced
        components those up to their cutoff.
    free, negative : int or None
        Number of motions without stiffness, and with a negative one; None where M is no mass, so
        that no modes are computed.
    hints : tuple of str
        What looks like an error of units, or like free motions that rounding has given a stiffness.
    reduction : mapping or None
        How components were reduced before they were joined, None if they were not.

    Examples
    --------
    >>> import squeal
    >>> free = squeal.System([[2, 0], [0, 2]], K=[[4, -4], [-4, 4]])
    >>> found = squeal.check(free)
    >>> found.free, [round(6.283185307 * hertz, 6) for hertz in found.frequencies_hz]
    (1, [2.0])
    """

    panel = Panel("mode", "frequency_hz")

    name: str
    rows: int
    matrices: tuple[Mapping[str, Any], ...] = field(repr=False)
    checks: Mapping[str, str]
    mass: float | None
    centre: tuple[float, ...] | None
    size: tuple[float, ...] | None
    elements: int
    frequencies_hz: tuple[float, ...]
    free: int | None
    negative: int | None
    hints: tuple[str, ...]
    reduction: Mapping[str, Any] | None = None

    def table(self) -> Table:
        heads = (Column("mode", value=itemgetter(0)), Column("frequency_hz", value=itemgetter(1)))
        rows = list(enumerate(self.frequencies_hz, 1))
        return Table(heads, rows, "lowest real modes, without friction and damping", "no real mode")

    def parts(self) -> list[str | Table]:
        names = ["part", "file", "key", "format", "labels", "factor", "nonzeros", "symmetric"]
        columns = [Column(name, value=itemgetter(name)) for name in names]
        lines = [f"{name}: {text}" for name, text in self.checks.items()]
        if self.mass is not None and self.centre and self.size:
            centre = ", ".join(number(x, 4) for x in self.centre)
            box = ", ".join(number(length, 4) for length in self.size)
            mass = f"{number(self.mass)} in the unit of M, centre at ({centre})"
            lines.append(f"mass of the rows that move: {mass}")
            lines.append(f"nodes in a box of {box}")
            if self.elements:
                lines.append(f"elements with faces: {self.elements}")
            elif self.matrices:  # not of a pad, which has no files of matrices and no mesh
                lines.append(POINTS)
        elif self.reduction is not None:
            lines.append(basis_text(self.reduction, errors=True))
            lines.append("mass and box: not known of reduced components")
        elif self.size is not None:
            lines.append("mass: unknown, since no displacement has one")
        else:
            lines.append("mass: unknown without coordinates (coordinates: {file: nodes.csv})")
        lines.append(f"free motions: {'unknown' if self.free is None else self.free}")
        if self.negative:
            lines.append(f"motions of negative stiffness: {self.negative}")
        files = Table(columns, self.matrices)
        head = f"{self.name}: {self.rows} rows"
        return [head, files, "\n".join(lines), self.table(), "\n".join(self.hints)]

    def to_dict(self) -> dict[str, Any]:
        names = (
            "name rows matrices checks mass centre size elements frequencies_hz free negative hints"
        )
        return copied_attributes(self, names)


@public
def check(subject: object, modes: Annotated[int, Whole(1, 1000)] = 10) -> Check:
    """Say what a pad or a system of matrices is, before it is analysed.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        What `read_scene`, `read_system` or `System` gives; a pad is linearised without friction.
    modes : int
        How many real modes, at the nominal parameters without friction and damping.

    Returns
    -------
    Check
        Mass in the unit of M, lengths in the unit of the coordinates, frequencies in Hz if M and K
        have consistent units with seconds.

    Raises
    ------
    InputError
        For another subject, or a number of modes that is not 1 to 1000.
    ComputationError
        If the modes cannot be computed.

    Examples
    --------
    Two masses of 2 kg on a spring of 4 N/m move freely together:

    >>> import numpy as np, squeal
    >>> found = squeal.check(squeal.System(2 * np.eye(2), K=4.0 * np.array([[1, -1], [-1, 1]])))
    >>> found.free, round(2 * np.pi * found.frequencies_hz[0], 6)
    (1, 2.0)
    """
    described = subject
    if isinstance(subject, Scene):
        described = _linearised(subject)
    analysis = SystemAnalysis.of(described)
    file = analysis.file
    system = analysis.system.frozen()
    M, _, K = system.at()
    free = negative = None
    hertz: list[float] = []
    why_no_modes = why_no_mass(M, ALL_ROWS)
    if why_no_modes:
        hints_of_modes = [f"no real modes were computed: {why_no_modes}"]
    else:
        lowest = real_modes(system, modes)
        free = int(np.sum(np.abs(lowest.squares) <= lowest.errors))
        negative = int(np.sum(lowest.squares < -lowest.errors))
        vibrating = lowest.squares[lowest.squares > lowest.errors]
        hertz = (np.sqrt(vibrating[:modes]) / math.tau).tolist()
        hints_of_modes = _hints_of_slow_motions(lowest)
    if analysis.component_reduction is not None:  # components were reduced to modes up to a cutoff
        hertz = [frequency for frequency in hertz if frequency <= file.assembly.cutoff]
    body = _Body()
    if isinstance(subject, Scene):
        body = _body_of_pad(subject.pad, hertz)
    elif file.coordinates is not None and analysis.component_reduction is None:
        body = _body_of_nodes(file.coordinates, M, K)
    return Check(
        name=system.name or "system",
        rows=system.n,
        matrices=tuple(matrix_list(file)),
        checks=system_checks(system),
        mass=body.mass,
        centre=body.centre,
        size=body.size,
        elements=len(file.coordinates.cells) if file.coordinates else 0,
        frequencies_hz=tuple(hertz),
        free=free,
        negative=negative,
        hints=(*body.hints, *_hints_of_halves(system), *hints_of_modes),
        reduction=analysis.component_reduction,
    )


def _linearised(scene: Scene) -> System:
    """The pad without friction about its equilibrium there."""
    matrices = analyse(scene.replace(mu=0.0)).matrices
    return System(matrices.M, K=matrices.K, name=scene.model)


class _Body(NamedTuple):
    """The mass of a system or pad, its centre, and the box around it, as of `Check`.

    hints: in which units they seem to be, in sentences.
    """

    mass: float | None = None
    centre: tuple[float, ...] | None = None
    size: tuple[float, ...] | None = None
    hints: Sequence[str] = ()


def _body_of_nodes(coordinates: Coordinates, M: Matrix, K: Matrix) -> _Body:
    """The body that moves the nodes of a system, with the matrices (n, n)."""
    mass, centre = coordinates.mass_and_centre(M)
    size = tuple(np.ptp(coordinates.places, axis=0).tolist())
    if not mass:
        return _Body(size=size)
    hints: list[str] = []
    if len(coordinates.places) >= MESH:
        density = mass / (math.prod(size) or math.nan)  # a plane may be of any thickness
        hints = hints_of_units(max(size), density, mesh_speed(coordinates, M, K), FASTEST)
    return _Body(mass, centre, size, hints)


def _body_of_pad(pad: Pad, hertz: Sequence[float]) -> _Body:
    """A pad, whose frequencies `hertz` rise. It is plane, and counts as thick as it is large."""
    size = (2 * pad.w, 2 * pad.h, 0.0)
    largest = max(size)
    speed = largest * max(hertz[:1], default=math.nan)  # NaN without a frequency fits no units
    hints = hints_of_units(largest, pad.m / largest**3, speed, FASTEST_PAD)
    return _Body(pad.m, (pad.x0, pad.y0, 0.0), size, hints)


def _hints_of_slow_motions(lowest: RealModes) -> list[str]:
    """Say how many motions are free but for rounding of the program that made the matrices.

    By the digits of the entries they are not free, since the sizes of their squares omega^2 are
    above `errors`. But these are so small, below `noise`, that rounding in that program may have
    made a stiffness of either sign out of none. A motion of negative stiffness does not vibrate.
    """
    sizes = np.abs(lowest.squares)
    slow = lowest.squares[(sizes > lowest.errors) & (sizes <= lowest.noise)]
    if not slow.size:
        return []
    fastest = math.sqrt(np.abs(slow).max()) / math.tau
    kind = f"at up to {fastest:.2g} Hz"
    if slow.min() < 0.0:
        kind = f"|omega|/2pi up to {fastest:.2g} Hz, {np.sum(slow < 0.0)} of negative stiffness"
    return [
        f"slow motions, {slow.size} in number, {kind}: probably free, "
        "but for rounding of the program that made the matrices"
    ]


def _hints_of_halves(system: TermSystem) -> list[str]:
    """Name the terms of K that look like half, or a part, of a symmetric matrix, in sentences.

    A one-sided entry is not mirrored by another one across the diagonal. A term is named if the
    one-sided entries that half a stiffness may have (`Sides.fitting`) are more than the mirrored
    ones, and more than one in two rows. Friction makes fewer: one in the two rows of a contact at
    most. Terms whose factor has the free parameter, mostly friction, are not judged.
    """
    hints = []
    for position, term in enumerate(system.K, 1):
        if system.parameter in term.factor.names:
            continue
        sides = sides_of(term.matrix)
        if sides.fitting > max(sides.paired, system.n / 2):
            hints.append(
                f"K.{position}: {sides.one_sided} entries have none on the other side of the "
                "diagonal, as in a part of a symmetric matrix"
            )
    return hints
