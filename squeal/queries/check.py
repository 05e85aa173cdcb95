"""What files of matrices hold, before anything is solved that costs: `squeal check`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import coo_array, csc_array
from scipy.spatial import KDTree

from squeal.errors import ComputationError
from squeal.io.coordinates import POINTS, Coordinates
from squeal.io.halves import sides_of
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked
from squeal.linear.damping import frictionless
from squeal.linear.digits import data_errors
from squeal.linear.matrices import EPS, Matrix, dense, why_no_mass
from squeal.linear.system import System, TermSystem
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.systems.matrices import ALL_ROWS, matrix_list, system_checks
from squeal.queries.systems.system_analysis import SystemAnalysis, file_of
from squeal.results.columns import basis_text
from squeal.schema import Whole, public
from squeal.sparse.factor import factorise, modes_near
from squeal.sparse.quadratic import ScaledSystem

BELOW = -1e-6  # of the square of the frequency scale: where real modes are searched from
FAR_BELOW = -10.0  # the same where a stiffness is negative
NOISE = 1e3  # roundings of the square of the frequency scale: what rounding makes of a zero square
MORE = 6  # modes by which each further search of the lowest ones asks for more
MOST_MORE = 25  # no further search after so many more modes than are wanted
UNITS = {  # of length, mass and stiffness: how many of them are 1 m, 1 kg and 1 N/m
    "m, kg, N/m": (1.0, 1.0, 1.0),
    "mm, t, N/mm": (1e3, 1e-3, 1e-3),
    "mm, kg, N/m": (1e3, 1.0, 1.0),
    "mm, kg, N/mm": (1e3, 1.0, 1e-3),
    "mm, kg, kN/mm": (1e3, 1.0, 1e-6),
    "m, kg, N/mm": (1.0, 1.0, 1e-3),
    "m, g, N/m": (1.0, 1e3, 1.0),
    "mm, g, N/m": (1e3, 1e3, 1.0),
    "m, t, N/m": (1.0, 1e-3, 1.0),
    "mm, t, N/m": (1e3, 1e-3, 1.0),
    "mm, g, N/mm": (1e3, 1e3, 1e-3),
    "mm, kg/m3 mm3, N/mm": (1e3, 1e9, 1e-3),
    "mm, kg/m3 mm3, Pa mm": (1e3, 1e9, 1e3),
}
CONSISTENT = list(UNITS)[:2]
MESH = 30  # nodes from which on a speed from one to the next is that of waves
LARGEST = 50.0  # m, as of a rail
LIGHTEST = 0.02  # kg/m^3 of the box around a frame or shell
HEAVIEST = 2.3e4  # of solid metal
METAL = 1300.0  # more than those of rubber and wood; the box around a brake has hardly more
METAL_SPEED = 300.0  # m/s: waves in what is so dense are faster
SLOWEST = 10.0  # m/s: waves in soft rubber, or size times lowest frequency of a pad on springs
FASTEST = 5e4  # waves; of a metal they are up to 10,000
FASTEST_PAD = 2500.0
CLEARLY = 1e3  # of the square that rounding makes of 0: faster modes are not mixed with slow ones
CLEAR_MASS = 1e-10  # of the largest |theta|, a mass over a stiffness: less is hardly any mass


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
        Of all rows that move; None without coordinates, and of reduced components.
    centre, size : tuple of 3 float, or None
        Centre of mass, and lengths of the box around all nodes; None where the mass is.
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
            if self.matrices:  # a pad has neither nodes nor elements
                lines.append(f"elements with faces: {self.elements}" if self.elements else POINTS)
        elif self.reduction is not None:
            lines.append(basis_text(self.reduction, errors=True))
            lines.append("mass and box: not known of reduced components")
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
        return picked(self, names)


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
    pad = None
    described = subject
    if isinstance(subject, Scene):
        pad = subject.pad
        described = _linearised(subject)
    system = file_of(described).system.frozen()
    analysis = SystemAnalysis.of(described)
    file = analysis.file
    # the real modes
    M, _, K = system.at()
    reason = why_no_mass(M, ALL_ROWS)
    free = negative = None
    squares = errors = np.empty(0)
    noise = 0.0
    if not reason:
        squares, errors, noise = _real_modes(system, modes)
        free = int(np.sum(np.abs(squares) <= errors))
        negative = int(np.sum(squares < -errors))
    vibrating = squares[squares > errors]
    hertz = (np.sqrt(vibrating[:modes]) / (2 * np.pi)).tolist()  # from squares of rad/s
    if analysis.component_reduction is not None:  # components were reduced to modes up to a cutoff
        hertz = [frequency for frequency in hertz if frequency <= file.assembly.cutoff]
    # mass and size: of the nodes of a system, or of a pad
    mass = centre = size = None
    hints: list[str] = []
    elements = len(file.coordinates.cells) if file.coordinates else 0
    if file.coordinates is not None and analysis.component_reduction is None:
        mass, centre = file.coordinates.mass_and_centre(M)
        size = tuple(np.ptp(file.coordinates.places, axis=0).tolist())
        if len(file.coordinates.places) >= MESH:
            density = mass / (math.prod(size) or math.nan)  # a plane may be of any thickness
            speed = _mesh_speed(file.coordinates, M, K)
            hints += _hints_of_units(max(size), density, speed, FASTEST)
    if pad is not None:
        mass = pad.m
        centre = (pad.x0, pad.y0, 0.0)
        size = (2 * pad.w, 2 * pad.h, 0.0)
        largest = max(size)
        speed = largest * max(hertz[:1], default=math.nan)
        hints += _hints_of_units(largest, mass / largest**3, speed, FASTEST_PAD)
    # hints: of units, and of motions that are free but for rounding
    # slow: above `errors`, so by the digits of the entries not free; but below `noise`, so free if
    # the program that made the matrices has rounded
    is_slow = (np.abs(squares) > errors) & (np.abs(squares) <= noise)
    hints += _hints_of_halves(system)
    if reason:
        hints.append(f"no real modes were computed: {reason}")
    if is_slow.any():
        fastest = math.sqrt(np.abs(squares[is_slow]).max()) / (2 * np.pi)
        hints.append(
            f"slow motions, {np.sum(is_slow)} in number, at up to {fastest:.2g} Hz: probably free, "
            "but for rounding of the program that made the matrices"
        )
    return Check(
        name=system.name or "system",
        rows=system.n,
        matrices=tuple(matrix_list(file)),
        checks=system_checks(system),
        mass=mass,
        centre=centre,
        size=size,
        elements=elements,
        frequencies_hz=tuple(hertz),
        free=free,
        negative=negative,
        hints=tuple(hints),
        reduction=analysis.component_reduction,
    )


def _linearised(scene: Scene) -> System:
    """The pad without friction about its equilibrium there."""
    matrices = analyse(scene.replace(mu=0.0)).matrices
    return System(matrices.M, K=matrices.K, name=scene.model)


class _RealModes(NamedTuple):
    """The lowest real modes.

    Attributes
    ----------
    squares : array (m,)
        Squares of the angular frequencies (rad/s)^2, rising; negative of negative stiffness.
    errors : array (m,)
        How far the digits of the entries leave each square open. A motion whose square is not
        larger than this error is free.
    noise : float
        What rounding in a program that assembles or reduces K may make of a square that is zero.
    """

    squares: NDArray[np.float64]
    errors: NDArray[np.float64]
    noise: float


def _real_modes(system: TermSystem, count: int) -> _RealModes:
    """The lowest real modes, of K x = omega^2 M x without friction and damping.

    All modes of a small system are computed, and of a larger one if most of them are wanted. Else
    `_lowest_by_lanczos` computes the lowest ones, until `count` of them have a square omega^2 above
    `noise`, which is what rounding may make of a zero square. Rounding mixes the shapes of modes
    with squares up to `CLEARLY` times `noise`: `_slow_modes` refines these modes.

    Raises
    ------
    ComputationError
        If the modes cannot be computed.
    """
    from scipy.sparse.linalg import ArpackError

    changes = frictionless(system)
    scaled = ScaledSystem(system).at(changes)
    K = (scaled.K + scaled.K.T).real / 2  # the symmetric part
    M = (scaled.M + scaled.M.T).real / 2
    square_of_scale = scaled.frequency_scale**2
    # a little below zero, so that K - shift M is regular where motions are free; K = 0 has the
    # frequency scale 0, and any shift serves
    shift = BELOW * (square_of_scale or 1.0)
    noise = NOISE * EPS * square_of_scale
    try:
        if system.n <= max(ALL_ROWS, count + MOST_MORE + MORE):
            squares, vectors, largest = _all_real_modes(dense(K), dense(M), square_of_scale)
            noise = max(noise, system.n * EPS * largest)
        else:
            squares, vectors = _lowest_by_lanczos(K, M, count, shift, noise)
    except (ArpackError, ArithmeticError, RuntimeError, ValueError) as error:
        raise ComputationError(f"the real modes were not found (is M the mass?): {error}") from None
    order = np.argsort(squares)
    squares = squares[order]
    shapes = (scaled.scale[:, None] * vectors[:, order]).real  # in the system's own coordinates
    slow = np.abs(squares) <= CLEARLY * noise
    if slow.any():
        squares[slow], shapes[:, slow] = _slow_modes(system, changes, shapes[:, slow])
    errors = _errors_of_squares(system, changes, squares, shapes)
    return _RealModes(squares, errors, noise)


def _lowest_by_lanczos(
    K: csc_array, M: csc_array, count: int, shift: float, noise: float
) -> tuple[NDArray[np.float64], NDArray]:
    """The lowest modes of K x = square M x (n, n), by inverse (Lanczos) iteration about a shift.

    At first `count` + 6 modes are computed, then 6 more in each further search, until `count`
    modes have a square above `noise`. Five searches are the most: of a system with more than 30
    free motions fewer than `count` such modes are returned.

    Returns
    -------
    squares : array (m,)
        The squares next to the shift.
    vectors : array (n, m)
        Their modes.

    Raises
    ------
    ArpackError
        If the iteration does not converge.
    """
    factor = factorise((K - shift * M).tocsc())
    squares = np.empty(0)
    computed = count
    while np.sum(squares > noise) < count and computed < count + MOST_MORE:
        computed += MORE
        # where all eigenvalues are equal, as with K in place of M, it never converges
        squares, vectors = modes_near(K, M, shift, computed, factor, maxiter=100)
    return squares, vectors


def _slow_modes(
    system: TermSystem, changes: Mapping[str, float], shapes: NDArray
) -> tuple[NDArray[np.float64], NDArray]:
    """The squares (k,) and shapes (n, k) of slow modes, refined by the Rayleigh-Ritz method.

    K and M are projected on the computed shapes (n, k), which span the slow modes but are mixed by
    rounding. The product K x is taken in long double: in double its rounding, which the fastest
    mode sets, is larger than the squares of slow ones.
    """
    M, _, K = system.at(changes)
    entries = coo_array(K)
    forces = np.zeros(shapes.shape, dtype=np.longdouble)
    terms = entries.data.real.astype(np.longdouble)[:, None] * shapes[entries.col]
    np.add.at(forces, entries.row, terms)
    projected_K = (shapes.T @ forces).astype(float)
    projected_M = shapes.T @ (M.real @ shapes)
    symmetric_K = (projected_K + projected_K.T) / 2
    # solved without use of the symmetry: what this leaves of imaginary parts is rounding
    squares, combinations = np.linalg.eig(np.linalg.solve(projected_M, symmetric_K))
    order = np.argsort(squares.real)
    return squares.real[order], shapes @ combinations.real[:, order]


def _all_real_modes(
    K: NDArray, M: NDArray, square_of_scale: float
) -> tuple[NDArray[np.float64], NDArray, float]:
    """All real modes of a small system, from the eigenvalues theta of M x = theta (K - shift M) x.

    K x = square M x then holds with square = shift + 1 / theta. A motion without mass has
    theta = 0, which rounding leaves below n EPS times the largest |theta|.

    `eigh` needs a positive definite K - shift M, as it is with a shift below all squares. It gives
    independent shapes for a repeated square. Where a motion without mass has a negative stiffness
    no shift makes K - shift M positive definite. `eig` then solves the same problem without its
    symmetry; shapes of a repeated square may then depend on one another.

    square_of_scale: of the frequency scale, (rad/s)^2; K and M symmetric, (n, n).

    Returns
    -------
    squares : array (m,)
        Of the motions that have a mass.
    shapes : array (n, m)
        Their shapes.
    largest : float
        The largest square of the motions whose mass is clearly above rounding, 0 without one.
    """
    for below in (BELOW, FAR_BELOW):
        shift = below * (square_of_scale or 1.0)
        try:
            theta, vectors = eigh(M, K - shift * M)
            break
        except LinAlgError:  # K - shift M is not positive definite
            continue
    else:  # not with any shift
        values, vectors = np.linalg.eig(np.linalg.solve(K - shift * M, M))
        theta = values.real
    size = np.abs(theta)
    has_clear_mass = size > CLEAR_MASS * size.max()
    largest = float(np.max(shift + 1 / theta[has_clear_mass], initial=0.0))
    has_mass = size > len(M) * EPS * size.max()
    return shift + 1 / theta[has_mass], vectors[:, has_mass], largest


def _errors_of_squares(
    system: TermSystem, changes: Mapping[str, float], squares: NDArray[np.float64], shapes: NDArray
) -> NDArray[np.float64]:
    """Bounds (m,) of the change of each squared frequency, to first order in that of the entries.

    An entry may lie off by what the digits of its file leave open, and by half an ulp of its
    double. The square of a mode x then changes by (x^T dK x - square x^T dM x) / (x^T M x); the
    bounds of dK and dM are taken with the absolute values of x. Infinite for a mode without mass.

    changes: the parameters at which M and K are taken; shapes (n, m): of the modes.
    """
    M, _, K = system.at(changes)
    dM, _, dK = data_errors(system, changes)
    dM = dM + _half_ulps(M)
    dK = dK + _half_ulps(K)
    size = np.abs(shapes)
    moved = np.sum(size * (dK @ size + np.abs(squares) * (dM @ size)), axis=0)
    mass = np.abs(np.sum(shapes.conj() * (M @ shapes), axis=0))
    infinite = np.full(len(squares), np.inf)
    return np.divide(moved, mass, out=infinite, where=mass > 0.0)


def _half_ulps(X: Matrix) -> csc_array:
    """Half a unit in the last place of each entry (n, n)."""
    size = abs(csc_array(X))
    return csc_array((np.spacing(size.data) / 2, size.indices, size.indptr), shape=size.shape)


def _hints_of_halves(system: TermSystem) -> list[str]:
    """Which terms of K look like a half, or a part, of a symmetric matrix, in sentences.

    The free parameter does not multiply them, and most entries off their diagonal are such as half
    a stiffness has. These are more than one of two rows: friction leaves one of the two rows of a
    contact at most.
    """
    hints = []
    for place, term in enumerate(system.K, 1):
        if system.parameter in term.factor.names:
            continue
        sides = sides_of(term.matrix)
        if sides.fitting > max(sides.paired, system.n / 2):
            hints.append(
                f"K.{place}: {sides.one_sided} entries have none on the other side of the "
                "diagonal, as in a part of a symmetric matrix"
            )
    return hints


def _mesh_speed(coordinates: Coordinates, M: Matrix, K: Matrix) -> float:
    """How fast waves pass from a node to the next, which no slenderness of the part lowers.

    Of each row it is the distance times (K_ii / M_ii)^(1/2). Two rows of three move in the plane of
    a shell, and one of three along a beam; the others are slower.
    """
    moves = (coordinates.directions >= 0) & (M.diagonal().real > 0.0)
    distances, _ = KDTree(coordinates.places).query(coordinates.places, 2)
    squares = np.abs(K.diagonal()[moves]) / M.diagonal()[moves].real
    speeds = distances[coordinates.nodes[moves], 1] * np.sqrt(squares)
    return float(np.quantile(speeds, 0.75))


def _hints_of_units(size: float, density: float, speed: float, fastest: float) -> list[str]:
    """The units that a brake or a part of it seems to have, in a sentence; none if these units go
    together.

    The first units are taken in which size, density and speed are those of a part. Limits are wide,
    so that no sound model is blamed; a density of NaN is not judged. All arguments are in the units
    of the system but `fastest`.
    """
    for name, (metre, kilogram, newton_per_metre) in UNITS.items():
        factor = math.sqrt(newton_per_metre / kilogram)  # of frequencies
        true_density = density * metre**3 / kilogram
        slowest = METAL_SPEED if true_density > METAL else SLOWEST
        if (
            size / metre < LARGEST
            and not (true_density < LIGHTEST or true_density > HEAVIEST)
            and slowest < speed / metre / factor < fastest
        ):
            if name in CONSISTENT:
                return []
            effect = f"frequencies are {factor:.3g} times the true ones, unless all is soft lining"
            return [f"looks like {name}: {effect}; {' or '.join(CONSISTENT)} go together"]
    return []
