"""A disc brake in three-dimensional solids, from its geometry.

A disc clamped at its inner edge and a pad on part of its upper face, linear hexahedra on matching
meshes. Normal springs join the faces over the whole contact; friction mu times their force acts
along the disc's motion. `squeal example brake` writes matrices, as a program would, coordinates and
a system file that reads them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import yaml
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.writing import whole_folder, write_csv, write_text
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.matrices import write_components, write_system
from squeal.sparse.components import Component
from squeal.sparse.contact_seat import Contact, pair_directions

if TYPE_CHECKING:
    from scipy.sparse import csc_array

ROWS = (500, 1_000_000)
ROUND = 24  # elements around the disc for each level of refinement
PAD = 4  # of these elements under the pad
GAUSS = 4  # Gauss points along each edge of a cell
CORNERS = (  # of a cell, in steps along r, phi and z
    *((0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)),
    *((0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1)),
)
VTK = [0, 3, 6, 2, 1, 5, 7, 4]  # corners of a cell in the order of VTK


@dataclass(frozen=True)
class Geometry:
    """Sizes (m), materials and stiffnesses (N/m^3: those of an area) of disc and pad.

    A material is Young's modulus (Pa), Poisson's ratio and density (kg/m^3).
    """

    inner: float = 0.075  # radii of the disc
    outer: float = 0.140
    thickness: float = 0.012
    pad_thickness: float = 0.014
    disc: tuple[float, float, float] = (1.1e11, 0.26, 7200.0)
    pad: tuple[float, float, float] = (9.0e9, 0.3, 2900.0)
    contact: float = 6.0e11  # normal stiffness
    piston: float = 2.0e10  # behind the pad, along z
    abutment: float = 4.0e9  # at both ends of the pad, along x and y
    damping: tuple[float, float] = (3.0, 3.0e-8)  # Rayleigh's alpha (1/s) and beta (s)


@dataclass(frozen=True, eq=False)
class SolidBrake:
    """The brake as one system with the contact closed, and as two bodies with a contact that opens.

    Nodes are counted from 0, but from 1 in `bodies` and `contact`.

    Attributes
    ----------
    system : TermSystem
        n rows, parameters mu and contact (a factor of the contact's stiffness).
    nodes, directions : array (n,)
        Node and direction (0 to 2 for x, y, z) of each row; clamped nodes have no row.
    coordinates : array (nodes, 3)
        In m.
    cells : array (elements, 8)
        The nodes of each hexahedron in the order of VTK.
    pairs : array (m, 2)
        The nodes of disc and pad that touch.
    area : array (m,)
        The contact area of each pair, m^2.
    bodies : (Component, Component)
        Disc and pad without contact. The load of the pad is a pressure of 1 Pa on its back.
    contact : Contact
        Joins the bodies; its pairs may open.
    """

    system: TermSystem = field(repr=False)
    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    coordinates: NDArray[np.float64] = field(repr=False)
    cells: NDArray[np.intp] = field(repr=False)
    pairs: NDArray[np.intp] = field(repr=False)
    area: NDArray[np.float64] = field(repr=False)
    bodies: tuple[Component, Component]
    contact: Contact


def _grid(
    radii: NDArray, angles: NDArray, heights: NDArray, closed: bool
) -> tuple[NDArray, NDArray, NDArray]:
    """Make a grid of nodes over cylindrical coordinates r (m), phi (rad), z (m).

    closed: the last angle is joined to the first one by a further row of cells.

    Returns
    -------
    numbers : array (radii, angles, heights)
        The number of each node, from 0.
    coordinates : array (3, nodes)
        x, y and z of each node.
    cells : array (8, cells)
        The nodes at the corners of each cell, in the order of `CORNERS`.
    """
    shape = (len(radii), len(angles), len(heights))
    numbers = np.arange(math.prod(shape)).reshape(shape)
    r, phi, z = np.meshgrid(radii, angles, heights, indexing="ij")
    coordinates = np.array([(r * np.cos(phi)).ravel(), (r * np.sin(phi)).ravel(), z.ravel()])
    corners = []
    for to_r, to_phi, to_z in CORNERS:
        # shifted[i, j, k] is numbers[i + to_r, j + to_phi, k + to_z], counted cyclically
        shifted = np.roll(numbers, (-to_r, -to_phi, -to_z), axis=(0, 1, 2))
        # a cell begins at each node except the last one along each axis; on a closed ring a cell
        # also begins at the last angle, and ends at the first one because `np.roll` is cyclic
        of_cells = shifted[:-1, :, :-1] if closed else shifted[:-1, :-1, :-1]
        corners.append(of_cells.ravel())
    return numbers, coordinates, np.array(corners)


def _at_gauss_points(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Trilinear shape functions of hexahedra, and their slopes, at Gauss points.

    Both are multiplied by the root of the volume of each point, its weight times the determinant of
    the Jacobian: so the sum over the points of a product of two is its integral over the cell.

    Parameters
    ----------
    corners : array (cells, 8, 3)
        Coordinates in m, in the order of `CORNERS`.

    Returns
    -------
    shapes : array (cells, 8, points)
        Of each corner.
    slopes : array (cells, 8, 3, points)
        Derivatives in x, y and z.
    """
    abscissae, weights = np.polynomial.legendre.leggauss(GAUSS)
    indices = np.indices((GAUSS, GAUSS, GAUSS)).reshape(3, -1)  # of each point on each axis
    # from -1 ... 1 to the coordinates of the cell, 0 ... 1: (point, axis)
    points = ((abscissae[indices] + 1.0) / 2.0).T
    weight = np.prod(weights[indices] / 2.0, axis=0)
    is_far = np.array(CORNERS)[:, None] == 1  # (corner, 1, axis): the corner at 1 on this axis
    # a shape function is a product over the axes of s or 1 - s, whose slope is 1 or -1
    factor = np.where(is_far, points, 1.0 - points)  # (corner, point, axis)
    slope = np.where(is_far, 1.0, -1.0)
    shapes = factor.prod(axis=2)
    local = np.stack(
        [
            slope[..., 0] * factor[..., 1] * factor[..., 2],
            factor[..., 0] * slope[..., 1] * factor[..., 2],
            factor[..., 0] * factor[..., 1] * slope[..., 2],
        ]
    )  # slopes in the cell: (axis, corner, point)
    # e: cell, c: corner, p: point, i: axis x_i of space, a: axis s_a of the cell
    jacobian = np.einsum("eci,acp->epia", corners, local)  # d x_i / d s_a
    inverse = np.linalg.inv(jacobian)  # (e, p, a, i): d s_a / d x_i
    root_of_volume = np.sqrt(np.abs(np.linalg.det(jacobian)) * weight)  # (cell, point)
    slopes = np.einsum("epai,acp->ecip", inverse, local)
    return shapes * root_of_volume[:, None], slopes * root_of_volume[:, None, None]


def _mass_and_stiffness(
    coordinates: NDArray, cells: NDArray, material: tuple[float, float, float]
) -> tuple[csc_array, csc_array]:
    """Mass and stiffness matrices (3 nodes, 3 nodes) of an elastic body of linear hexahedra.

    Isotropic elasticity: the energy density is lame / 2 (div u)^2 + shear e : e, of strains e. Row
    3 k + i is direction i of node k. coordinates (3, nodes), cells (8, cells): see `_grid`;
    material: see `Geometry`.
    """
    from scipy.sparse import coo_array

    young, poisson, density = material  # Pa, 1 and kg/m^3
    shear = young / (2.0 * (1.0 + poisson))
    lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    shapes, slopes = _at_gauss_points(coordinates.T[cells.T])
    count = cells.shape[1]
    flat = slopes.reshape(count, 24, -1)  # (cell, corner and direction, point)
    # (cell, corner c, direction i, corner d, direction j): integrals of products d_i N_c d_j N_d of
    # slopes of the shape functions N
    products = (flat @ flat.transpose(0, 2, 1)).reshape(count, 8, 3, 8, 3)
    # matrices of each cell, with the axes of `products`
    # lame d_i N_c d_j N_d + shear d_j N_c d_i N_d, and for i = j shear grad N_c . grad N_d
    K = lame * products + shear * products.transpose(0, 1, 4, 3, 2)
    M = np.zeros_like(K)
    gradients = np.einsum("ecidi->ecd", products)  # integrals of grad N_c . grad N_d
    shape_products = shapes @ shapes.transpose(0, 2, 1)  # integrals of N_c N_d
    for direction in range(3):
        K[:, :, direction, :, direction] += shear * gradients
        M[:, :, direction, :, direction] = density * shape_products
    rows = (3 * cells.T[:, :, None] + np.arange(3)).reshape(count, 24)  # of each cell
    positions = (np.repeat(rows, 24, axis=1).ravel(), np.tile(rows, 24).ravel())
    n = 3 * coordinates.shape[1]

    def assembled(entries: NDArray) -> csc_array:
        # entries of neighbouring cells at the same position are added
        matrix = coo_array((entries.ravel(), positions), shape=(n, n)).tocsc()
        matrix.eliminate_zeros()
        return matrix

    return assembled(M), assembled(K)


def solid_brake(rows: int = 2000, around: int = ROUND) -> SolidBrake:
    """Build the brake from its geometry, on the coarsest mesh with at least so many rows.

    Parameters
    ----------
    rows : int
        Least number of degrees of freedom of the disc alone, 500 to 1,000,000.
    around : int
        Elements around the disc for each level of refinement, a multiple of 6: the pad covers a
        sixth of them.

    Raises
    ------
    InputError
        For another number of rows.
    """
    from scipy.sparse import block_diag, csc_array, diags_array

    if not ROWS[0] <= rows <= ROWS[1]:
        raise InputError(f"{rows} rows are not allowed; it must be {ROWS[0]} to {ROWS[1]}")
    sizes = Geometry()
    level = 1
    # directions times nodes of the disc that move: along r 2 level (of 2 level + 1 the innermost is
    # clamped), along phi around * level, along z level + 1
    while 3 * (2 * level * around * level * (level + 1)) < rows:
        level += 1
    along_pad = around * PAD // ROUND * level  # elements under the pad, in the direction of phi
    radii = np.linspace(sizes.inner, sizes.outer, 2 * level + 1)
    angles = math.tau * np.arange(around * level) / (around * level)  # 2 pi is the first one again
    pad_radii = radii[level:]
    pad_angles = angles[: along_pad + 1]
    disc_heights = np.linspace(-sizes.thickness, 0.0, level + 1)
    pad_heights = np.linspace(0.0, sizes.pad_thickness, level + 1)
    # disc, pad: the numbers of their nodes (radii, angles, heights)
    disc, disc_coordinates, disc_cells = _grid(radii, angles, disc_heights, closed=True)
    pad, pad_coordinates, pad_cells = _grid(pad_radii, pad_angles, pad_heights, closed=False)
    disc_mass, disc_stiffness = _mass_and_stiffness(disc_coordinates, disc_cells, sizes.disc)
    pad_mass, pad_stiffness = _mass_and_stiffness(pad_coordinates, pad_cells, sizes.pad)
    pad += disc.size  # the nodes of the pad are numbered behind those of the disc
    coordinates = np.hstack([disc_coordinates, pad_coordinates])
    cells = np.hstack([disc_cells, pad_cells + disc.size])

    # the lower face of the pad lies on the outer half of the disc's upper face, node on node
    on_disc = disc[level:, : along_pad + 1, -1].ravel()
    pairs = np.column_stack([on_disc, pad[:, :, 0].ravel()])
    area = _areas(pad_radii, pad_angles)

    # rows are 3 node + direction: 3 node + 2 is that along z
    back = pad[:, :, -1].ravel()
    ground = np.zeros(coordinates.size)  # stiffness of each row to the ground, N/m
    ground[3 * back + 2] = sizes.piston * area
    load = np.zeros(coordinates.size)  # N: 1 Pa on the back presses the pad down
    load[3 * back + 2] = -area
    end_area = (sizes.outer - pad_radii[0]) * sizes.pad_thickness  # where abutments hold the pad
    for end in (0, -1):  # the first and the last angle of the pad
        nodes_of_end = pad[:, end, :].ravel()
        area_of_node = end_area / len(nodes_of_end)
        for along in (0, 1):  # x, y
            ground[3 * nodes_of_end + along] += sizes.abutment * area_of_node

    # the disc is clamped at its inner radius
    clamped = (3 * disc[0].ravel()[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(coordinates.size), clamped)  # rows that move
    M = csc_array(block_diag([disc_mass, pad_mass]))
    K = csc_array(block_diag([disc_stiffness, pad_stiffness]) + diags_array(ground))
    alpha, beta = sizes.damping
    C = csc_array(alpha * M + beta * K)

    def terms(matrix: csc_array, kept: NDArray[np.intp]) -> tuple[Term]:
        """The rows and columns `kept` of a matrix, as the only term of a part."""
        return (Term(matrix[kept][:, kept]),)

    def body(name: str, kept: NDArray[np.intp]) -> Component:
        """The body that has the rows `kept`, without contact."""
        nodes = kept // 3
        return Component(
            TermSystem(terms(M, kept), terms(C, kept), terms(K, kept), name=name),
            nodes + 1,
            kept % 3,
            places=coordinates.T[nodes],
            load=load[kept],
        )

    is_of_disc = free < 3 * disc.size
    bodies = (body("disc", free[is_of_disc]), body("pad", free[~is_of_disc]))
    along_axis = (0.0, 0.0, 1.0)
    contact = Contact(
        ("disc", "pad"),
        pairs=pairs + 1,
        normal=along_axis,
        stiffness=sizes.contact,
        area=area,
        axis=along_axis,
    )
    by_name = {component.name: component for component in bodies}
    directions = pair_directions(contact.located(by_name), by_name)
    # a pair has the gap g = G q along z and the slip s = S q along the motion of the disc; with
    # springs k the stiffness of contact is G^T k G, that of its friction S^T k G for mu = 1
    springs = directions.normal.multiply((sizes.contact * area)[:, None])  # k G
    system = TermSystem(
        M=terms(M, free),
        C=terms(C, free),
        K=(
            *terms(K, free),
            Term(csc_array(directions.normal.T @ springs), Formula("contact")),
            Term(csc_array(directions.sliding.T @ springs), Formula("mu*contact")),
        ),
        parameters={"mu": 0.4, "contact": 1.0},
        parameter="mu",
        name="solid brake",
    )
    return SolidBrake(
        system,
        nodes=free // 3,
        directions=free % 3,
        coordinates=coordinates.T,
        cells=cells[VTK].T,
        pairs=pairs,
        area=area,
        bodies=bodies,
        contact=contact,
    )


def _areas(radii: NDArray, angles: NDArray) -> NDArray:
    """The contact area (m^2) of each node (r, phi), r dr dphi; phi varies fastest.

    radii in m, angles in rad, both evenly spaced.
    """
    along_radius = np.ones(len(radii))
    along_angle = np.ones(len(angles))
    for weights in (along_radius, along_angle):
        weights[[0, -1]] = 0.5  # an end has half a cell
    weights = np.outer(along_radius * radii, along_angle)
    return (weights * np.diff(radii).mean() * np.diff(angles).mean()).ravel()


MATRIX_PARTS = ("M", "C", "K", "K", "K")  # mass, damping, stiffness, contact and friction
FILES = {  # the file of each matrix in each program's form
    "abaqus": ("brake_MASS1.mtx", "brake_DMPV1.mtx", "brake_STIF1.mtx")
    + ("contact_STIF1.mtx", "friction_STIF1.mtx"),
    "nastran": ("brake.pch",) * 5,
    "ansys": ("MASS.hb", "DAMP.hb", "STIFF.hb", "CONTACT.hb", "FRICTION.hb"),
    "calculix": ("brake.mas", "damping.sti", "brake.sti", "contact.sti", "friction.sti"),
    "matlab": ("brake.mat",) * 5,
}
KEYS = ("MAAX", "BAAX", "KAAX", "KCONTACT", "KFRIC")  # in a file that holds several

Labels: TypeAlias = list[tuple[int, int]]
"""Node and direction of each row, both from 1."""


def _entries(matrix: csc_array) -> tuple[bool, list[tuple[int, int, float]]]:
    """Whether a matrix is symmetric, and its entries (row, column, value), column by column.

    Of a symmetric matrix they are those of its lower half.
    """
    from scipy.sparse import tril

    symmetric = bool(abs(matrix - matrix.T).max() <= 1e-14 * abs(matrix).max())
    stored = tril(matrix) if symmetric else matrix
    entries = stored.tocsc().tocoo()
    rows, columns = entries.coords
    return symmetric, list(zip(rows.tolist(), columns.tolist(), entries.data.tolist(), strict=True))


def _write_abaqus(path: Path, matrix: csc_array, labels: Labels) -> None:
    """Write lines of node and direction of the row, the same of the column, and the value."""
    _, entries = _entries(matrix)
    with path.open("w", encoding="ascii") as stream:
        for row, column, value in entries:
            stream.write("{},{}, {},{}, {:.16e}\n".format(*labels[row], *labels[column], value))


def _write_calculix(path: Path, matrix: csc_array, labels: Labels) -> None:
    """Write lines of row, column and value, and a file .dof that names the rows."""
    _, entries = _entries(matrix)
    with path.open("w", encoding="ascii") as stream:
        for row, column, value in entries:
            stream.write(f"{row + 1} {column + 1} {value:.16e}\n")
    with path.with_suffix(".dof").open("w", encoding="ascii") as stream:
        for node, direction in labels:
            stream.write(f"{node}.{direction}\n")


def _write_ansys(path: Path, matrix: csc_array, labels: Labels) -> None:
    """Write Harwell-Boeing text in the fields of HBMAT, and a file .mapping that names the rows.

    The text has a head of four lines, then three blocks of numbers: where each column begins, the
    row of each entry, and the entries.
    """
    symmetric, entries = _entries(matrix)
    n = matrix.shape[0]
    columns = [column for _, column, _ in entries]  # rising, see `_entries`
    # where the entries of each column begin, counted from 1, and where the last column ends
    starts = np.searchsorted(columns, np.arange(n + 1)) + 1
    values = [f"{value:25.16E}".replace("E", "D") for _, _, value in entries]
    blocks = [  # so many numbers in a line as `formats` says
        _in_lines([f"{start:10d}" for start in starts], 8),
        _in_lines([f"{row + 1:10d}" for row, _, _ in entries], 8),
        _in_lines(values, 3),
    ]
    line_counts = [block.count("\n") for block in blocks]
    # lines in all, of pointers, of row numbers, of values, and of right sides
    counts = "".join(f"{count:14d}" for count in (sum(line_counts), *line_counts, 0))
    kind = "RSA" if symmetric else "RUA"  # real symmetric or unsymmetric, assembled
    # title and key; counts; kind, rows, columns, entries and element matrices (none)
    head = f"{'brake':72}{'brake':8}\n{counts}\n{kind:14}{n:14d}{n:14d}{len(entries):14d}{0:14d}\n"
    formats = f"{'(8I10)':16}{'(8I10)':16}{'(1P,3D25.16)':20}{'':20}\n"
    path.write_text(head + formats + "".join(blocks), encoding="ascii")
    with path.with_suffix(".mapping").open("w", encoding="ascii") as stream:
        stream.write("Matrix Eqn     Node DOF\n")
        for row, (node, direction) in enumerate(labels, 1):
            stream.write(f"{row:8d} {node:8d} U{'XYZ'[direction - 1]}\n")


def _in_lines(fields: list[str], per_line: int) -> str:
    lines = []
    for start in range(0, len(fields), per_line):
        lines.append("".join(fields[start : start + per_line]) + "\n")
    return "".join(lines)


def _dmig_text(name: str, matrix: csc_array, labels: Labels) -> str:
    """Cards DMIG of a punch file in large fields, with the ten digits that these hold."""
    symmetric, entries = _entries(matrix)
    form = 6 if symmetric else 1
    # fields: name, 0 of a header, form, type 2 of entries and of results: real, double precision
    lines = [f"DMIG    {name:8}{0:8d}{form:8d}{2:8d}{0:8d}"]
    last_column = -1
    for row, column, value in entries:
        if column != last_column:
            lines.append("DMIG*   {:16}{:16d}{:16d}".format(name, *labels[column]))
        number = f"{value:16.9E}".replace("E", "D")
        lines.append("*       {:16d}{:16d}".format(*labels[row]) + number)
        last_column = column
    return "\n".join(lines) + "\n"


WRITERS = {"abaqus": _write_abaqus, "ansys": _write_ansys, "calculix": _write_calculix}


def write_matrices(folder: Path, brake: SolidBrake, form: str) -> dict[str, Any]:
    """Write the matrices as a program would. Returns the system file that reads them, as a mapping.

    Its keys M, C and K hold a list each, with an entry for each matrix that is added: K has several
    (`MATRIX_PARTS` names the key for each term of the system). form: the program, of `FILES`.
    """
    from scipy.io import savemat

    system = brake.system
    labels = list(zip((brake.nodes + 1).tolist(), (brake.directions + 1).tolist(), strict=True))
    document: dict[str, Any] = {
        "name": system.name,
        "parameters": dict(system.parameters),
        "parameter": system.parameter,
    }
    matrix_of_key = {}
    for part, name, key, term in zip(MATRIX_PARTS, FILES[form], KEYS, system.terms, strict=True):
        entry: dict[str, Any] = {"file": name, "factor": term.factor.text}
        if form not in WRITERS:  # all matrices are in one file, which is written below
            entry["key"] = key
        else:
            WRITERS[form](folder / name, term.matrix, labels)
            if form != "ansys":  # whose files say themselves whether they are symmetric
                # as the writers tell it, which write one triangle of a symmetric matrix
                entry["symmetric"], _ = _entries(term.matrix)
        document.setdefault(part, []).append(entry)
        matrix_of_key[key] = term.matrix
    path = folder / FILES[form][0]
    if form == "matlab":
        savemat(path, matrix_of_key)
    elif form == "nastran":
        cards = [_dmig_text(key, matrix, labels) for key, matrix in matrix_of_key.items()]
        path.write_text("".join(cards), encoding="ascii")
    return document


def write_brake(folder: Path, brake: SolidBrake, form: str = "npz") -> None:
    """Write matrices in the form of a program, coordinates, elements and the system file."""
    has_input_file = form in ("abaqus", "calculix")  # it holds nodes and elements
    mesh: dict[str, Any] = {
        "coordinates": {"file": "nodes.csv"},
        "elements": {"file": "elements.csv"},
    }
    if has_input_file:
        mesh = {key: {"file": "brake.inp"} for key in mesh}
    with whole_folder(folder) as temporary:
        if form == "npz":
            write_system(temporary, brake.system, "npz", **mesh)
        else:
            document = write_matrices(temporary, brake, form) | mesh
            write_text(temporary / "system.yaml", yaml.safe_dump(document, sort_keys=False))
        if has_input_file:
            write_text(temporary / "brake.inp", _input_file(brake))
        else:
            write_tables(temporary, brake)


def _input_file(brake: SolidBrake) -> str:
    """Nodes and elements as Abaqus and CalculiX read them."""
    lines = ["*NODE"]
    for number, (x, y, z) in enumerate(brake.coordinates.tolist(), 1):
        lines.append(f"{number}, {x}, {y}, {z}")
    lines.append("*ELEMENT, TYPE=C3D8")
    for number, corners in enumerate((brake.cells + 1).tolist(), 1):
        lines.append(", ".join(map(str, (number, *corners))))
    return "\n".join(lines) + "\n"


def write_tables(folder: Path, brake: SolidBrake) -> None:
    """Nodes with their directions, and elements, as tables."""
    coordinates = brake.coordinates.tolist()
    nodes = []
    for node, direction in zip(brake.nodes.tolist(), brake.directions.tolist(), strict=True):
        nodes.append((node + 1, "xyz"[direction], *coordinates[node]))
    for node in np.setdiff1d(np.arange(len(coordinates)), brake.nodes).tolist():
        nodes.append((node + 1, "fixed", *coordinates[node]))
    write_csv(folder / "nodes.csv", ["node", "dof", "x", "y", "z"], nodes)
    heads = ["element", "type", *(f"node{corner}" for corner in range(1, 9))]
    elements = enumerate((brake.cells + 1).tolist(), 1)
    rows = [(number, "hexahedron", *corners) for number, corners in elements]
    write_csv(folder / "elements.csv", heads, rows)


def write_parts(folder: Path, brake: SolidBrake) -> None:
    """Write disc and pad, a folder each, the pairs of their nodes and the file that joins them."""
    contact = brake.contact
    first, second = contact.pairs.T.tolist()
    rows_of_pairs = zip(first, second, contact.area.tolist(), strict=True)
    document = {
        "name": "solid brake",
        "parameters": {"mu": 0.4, "pressure": 2.0e6, "wear": 0.0},
        "components": {
            "disc": {"file": "disc/system.yaml"},
            "pad": {
                "file": "pad/system.yaml",
                "load": {"file": "pad/load.csv", "factor": "pressure"},
            },
        },
        "contact": [
            {
                "between": ["disc", "pad"],
                "pairs": {"file": "pairs.csv"},
                "normal": [0, 0, 1],
                "axis": [0, 0, 1],
                "stiffness": contact.stiffness,
                "gap": "wear",
            }
        ],
    }
    with whole_folder(folder) as temporary:
        write_components(temporary, brake.bodies, "npz")
        write_csv(temporary / "pairs.csv", ["first", "second", "area"], rows_of_pairs)
        write_text(temporary / "assembly.yaml", yaml.safe_dump(document, sort_keys=False))
