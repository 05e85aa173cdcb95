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
PAD = 4  # elements along the pad
GAUSS = 4  # points along each edge of a cell
CORNERS = (  # of a cell, in steps along r, phi and z
    *((0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)),
    *((0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1)),
)
VTK = [0, 3, 6, 2, 1, 5, 7, 4]  # corners of a cell in the order of VTK


@dataclass(frozen=True)
class Geometry:
    """Sizes (m), materials (Pa, -, kg/m^3) and stiffnesses (N/m^3, N/m) of disc and pad."""

    inner: float = 0.075
    outer: float = 0.140
    thickness: float = 0.012
    pad_thickness: float = 0.014
    disc: tuple[float, float, float] = (1.1e11, 0.26, 7200.0)
    pad: tuple[float, float, float] = (9.0e9, 0.3, 2900.0)
    contact: float = 6.0e11  # normal stiffness of an area
    piston: float = 2.0e10  # behind the pad, of an area
    abutment: float = 4.0e9  # at the pad's ends, of an area, along the motion
    damping: tuple[float, float] = (3.0, 3.0e-8)  # Rayleigh


@dataclass(frozen=True, eq=False)
class SolidBrake:
    """The system with its parameters mu and contact (a factor of the contact's stiffness).

    `nodes`, `directions` (n,) tell what each row is, `places` (nodes, 3) where in m; `cells`
    (elements, 8) the nodes of each hexahedron in the order of VTK. `pairs` (m, 2) are the nodes of
    disc and pad in contact with their `area` (m,). `bodies` are disc and pad without contact, which
    `contact` joins, and whose pairs may open; their nodes are counted from 1, and the load of the
    pad is a pressure of 1 Pa behind the contact, where the piston acts.
    """

    system: TermSystem = field(repr=False)
    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)
    cells: NDArray[np.intp] = field(repr=False)
    pairs: NDArray[np.intp] = field(repr=False)
    area: NDArray[np.float64] = field(repr=False)
    bodies: tuple[Component, Component]
    contact: Contact


def _grid(
    radii: NDArray, angles: NDArray, heights: NDArray, closed: bool
) -> tuple[NDArray, NDArray, NDArray]:
    """Make a grid of nodes over cylindrical coordinates r, phi, z.

    closed: the last angle is joined to the first one by a further row of cells.

    Returns
    -------
    numbers : array (radii, angles, heights)
        Of the nodes.
    places : array (3, nodes)
        x, y and z of each node.
    cells : array (8, cells)
        The nodes at the corners of each cell, in the order of `CORNERS`.
    """
    shape = (len(radii), len(angles), len(heights))
    numbers = np.arange(math.prod(shape)).reshape(shape)
    r, phi, z = np.meshgrid(radii, angles, heights, indexing="ij")
    places = np.array([(r * np.cos(phi)).ravel(), (r * np.sin(phi)).ravel(), z.ravel()])
    corners = []
    for to_r, to_phi, to_z in CORNERS:
        shifted = np.roll(numbers, (-to_r, -to_phi, -to_z), axis=(0, 1, 2))
        # a cell begins at each node but the last ones of an axis; around a closed ring it begins at
        # the last angle, too, and `np.roll` gives it the first angle as its end
        of_cells = shifted[:-1, :, :-1] if closed else shifted[:-1, :-1, :-1]
        corners.append(of_cells.ravel())
    return numbers, places, np.array(corners)


def _at_gauss_points(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Trilinear shape functions (cells, 8, points) of hexahedra at Gauss points, and their slopes
    (cells, 8, 3, points) in x, y, z, both times the root of the weight.

    corners (cells, 8, 3) in m, in the order of `CORNERS`.
    """
    places, weights = np.polynomial.legendre.leggauss(GAUSS)
    steps = np.indices((GAUSS, GAUSS, GAUSS)).reshape(3, -1)
    points = ((places[steps] + 1.0) / 2.0).T
    weight = np.prod(weights[steps] / 2.0, axis=0)
    is_far = np.array(CORNERS)[:, None] == 1  # (corner, 1, axis)
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
    # e: cell, c: corner, p: point, i: axis of space, a: axis of the cell
    jacobian = np.einsum("eci,acp->epia", corners, local)
    inverse = np.linalg.inv(jacobian)
    roots = np.sqrt(np.abs(np.linalg.det(jacobian)) * weight)  # (cells, points)
    slopes = np.einsum("epai,acp->ecip", inverse, local)
    return shapes * roots[:, None], slopes * roots[:, None, None]


def _mass_and_stiffness(
    places: NDArray, cells: NDArray, material: tuple[float, float, float]
) -> tuple[csc_array, csc_array]:
    """Mass and stiffness matrices (3 nodes, 3 nodes) of an elastic body of linear hexahedra.

    Isotropic elasticity: the energy density is lame / 2 (div u)^2 + shear e : e, of strains e. A
    row is that of a node and a direction, node by node. places (3, nodes), cells (8, cells): see
    `_grid`; material: Young's modulus, Poisson's ratio and density.
    """
    from scipy.sparse import coo_array

    young, poisson, density = material
    shear = young / (2.0 * (1.0 + poisson))
    lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    shapes, slopes = _at_gauss_points(places.T[cells.T])
    count = cells.shape[1]
    flat = slopes.reshape(count, 24, -1)  # corner and direction, point
    # (cell, corner c, direction i, corner d, direction j): integrals of products d_i N_c d_j N_d of
    # slopes of the shape functions N
    products = (flat @ flat.transpose(0, 2, 1)).reshape(count, 8, 3, 8, 3)
    # lame d_i N_c d_j N_d + shear d_j N_c d_i N_d, and for i = j shear grad N_c . grad N_d
    K = lame * products + shear * products.transpose(0, 1, 4, 3, 2)
    M = np.zeros_like(K)
    gradient = np.einsum("ecidi->ecd", products)
    mass = shapes @ shapes.transpose(0, 2, 1)
    for direction in range(3):
        K[:, :, direction, :, direction] += shear * gradient
        M[:, :, direction, :, direction] = density * mass
    rows = (3 * cells.T[:, :, None] + np.arange(3)).reshape(count, 24)
    positions = (np.repeat(rows, 24, axis=1).ravel(), np.tile(rows, 24).ravel())
    n = 3 * places.shape[1]

    def assembled(entries: NDArray) -> csc_array:
        matrix = coo_array((entries.ravel(), positions), shape=(n, n)).tocsc()
        matrix.eliminate_zeros()
        return matrix

    return assembled(M), assembled(K)


def solid_brake(rows: int = 2000, around: int = ROUND) -> SolidBrake:
    """Build the brake from its geometry, on the coarsest mesh with at least so many rows.

    Parameters
    ----------
    rows : int
        Least number of degrees of freedom, 500 to 1,000,000; the disc alone has as many.
    around : int
        Elements around the disc for each level of refinement, a multiple of 6.

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
    # nodes of the disc that move: 2 level along r (2 level + 1 but for the clamped ones), around *
    # level along phi, level + 1 along z
    while 3 * (2 * level * around * level * (level + 1)) < rows:
        level += 1
    along_pad = around * PAD // ROUND * level  # elements
    radii = np.linspace(sizes.inner, sizes.outer, 2 * level + 1)
    angles = 2 * np.pi * np.arange(around * level) / (around * level)
    pad_radii = radii[level:]
    pad_angles = angles[: along_pad + 1]
    disc_heights = np.linspace(-sizes.thickness, 0.0, level + 1)
    pad_heights = np.linspace(0.0, sizes.pad_thickness, level + 1)
    disc, disc_places, disc_cells = _grid(radii, angles, disc_heights, closed=True)
    pad, pad_places, pad_cells = _grid(pad_radii, pad_angles, pad_heights, closed=False)
    disc_mass, disc_stiffness = _mass_and_stiffness(disc_places, disc_cells, sizes.disc)
    pad_mass, pad_stiffness = _mass_and_stiffness(pad_places, pad_cells, sizes.pad)
    pad += disc.size  # the nodes of the pad are numbered behind those of the disc
    places = np.hstack([disc_places, pad_places])
    cells = np.hstack([disc_cells, pad_cells + disc.size])

    # the pad lies on the outer half of the disc, on nodes of the same places
    on_disc = disc[level:, : along_pad + 1, -1].ravel()
    pairs = np.column_stack([on_disc, pad[:, :, 0].ravel()])
    area = _areas(pad_radii, pad_angles)
    back = pad[:, :, -1].ravel()
    ground = np.zeros(places.size)  # stiffness of each row to the ground
    ground[3 * back + 2] = sizes.piston * area
    load = np.zeros(places.size)
    load[3 * back + 2] = -area
    for end in (0, -1):
        nodes_of_end = pad[:, end, :].ravel()
        end_area = (sizes.outer - pad_radii[0]) * sizes.pad_thickness
        area_of_node = end_area / len(nodes_of_end)
        ground[3 * nodes_of_end] += sizes.abutment * area_of_node
        ground[3 * nodes_of_end + 1] += sizes.abutment * area_of_node

    clamped = (3 * disc[0].ravel()[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(places.size), clamped)
    M = csc_array(block_diag([disc_mass, pad_mass]))
    K = csc_array(block_diag([disc_stiffness, pad_stiffness]) + diags_array(ground))
    alpha, beta = sizes.damping
    C = csc_array(alpha * M + beta * K)

    def terms(matrix: csc_array, rows: NDArray[np.intp]) -> tuple[Term]:
        return (Term(matrix[rows][:, rows]),)

    def body(name: str, rows: NDArray[np.intp]) -> Component:
        nodes = rows // 3
        return Component(
            TermSystem(terms(M, rows), terms(C, rows), terms(K, rows), name=name),
            nodes + 1,
            rows % 3,
            places=places.T[nodes],
            load=load[rows],
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
    by_name = {one.name: one for one in bodies}
    directions = pair_directions(contact.located(by_name), by_name)
    # a pair has the gap g = G q along z and the slip s = S q along the motion of the disc; with
    # springs k the stiffness of contact is G^T k G, that of its friction S^T k G for mu = 1
    springs = directions.normal.multiply((sizes.contact * area)[:, None])
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
        places=places.T,
        cells=cells[VTK].T,
        pairs=pairs,
        area=area,
        bodies=bodies,
        contact=contact,
    )


def _areas(radii: NDArray, angles: NDArray) -> NDArray:
    """Share of the contact's area of each node (r, phi)."""
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
    """Write Harwell-Boeing text in the fields of HBMAT, and a file .mapping that names the rows."""
    symmetric, entries = _entries(matrix)
    n = matrix.shape[0]
    columns = [column for _, column, _ in entries]  # rising, see `_entries`
    starts = np.searchsorted(columns, np.arange(n + 1)) + 1
    values = [f"{value:25.16E}".replace("E", "D") for _, _, value in entries]
    blocks = [
        _in_lines([f"{start:10d}" for start in starts], 8),
        _in_lines([f"{row + 1:10d}" for row, _, _ in entries], 8),
        _in_lines(values, 3),
    ]
    line_counts = [block.count("\n") for block in blocks]
    # lines in all, of pointers, of row numbers, of values, and of right sides
    counts = "".join(f"{count:14d}" for count in (sum(line_counts), *line_counts, 0))
    kind = "RSA" if symmetric else "RUA"  # real symmetric or unsymmetric, assembled
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

    form: the program, of `FILES`.
    """
    from scipy.io import savemat

    system = brake.system
    labels = list(zip((brake.nodes + 1).tolist(), (brake.directions + 1).tolist(), strict=True))
    document: dict[str, Any] = {
        "name": system.name,
        "parameters": dict(system.parameters),
        "parameter": system.parameter,
    }
    matrices = [term.matrix for term in system.terms]
    for part, name, key, term in zip(MATRIX_PARTS, FILES[form], KEYS, system.terms, strict=True):
        entry: dict[str, Any] = {"file": name, "factor": term.factor.text}
        if form not in WRITERS:  # all matrices are in one file, which is written below
            entry["key"] = key
        else:
            WRITERS[form](folder / name, term.matrix, labels)
            if form != "ansys":  # whose files say themselves whether they are symmetric
                entry["symmetric"], _ = _entries(term.matrix)
        document.setdefault(part, []).append(entry)
    named = dict(zip(KEYS, matrices, strict=True))
    path = folder / FILES[form][0]
    if form == "matlab":
        savemat(path, named)
    elif form == "nastran":
        cards = [_dmig_text(key, matrix, labels) for key, matrix in named.items()]
        path.write_text("".join(cards), encoding="ascii")
    return document


def write_brake(folder: Path, brake: SolidBrake, form: str = "npz") -> None:
    """Write matrices in the form of a program, coordinates, elements and the system file."""
    has_input_file = form in ("abaqus", "calculix")  # which names nodes and elements
    mesh = {"coordinates": {"file": "nodes.csv"}, "elements": {"file": "elements.csv"}}
    if has_input_file:
        mesh = {key: {"file": "brake.inp"} for key in mesh}
    with whole_folder(folder) as place:
        if form == "npz":
            write_system(place, brake.system, "npz", **mesh)
        else:
            document = write_matrices(place, brake, form) | mesh
            write_text(place / "system.yaml", yaml.safe_dump(document, sort_keys=False))
        if has_input_file:
            write_text(place / "brake.inp", _input_file(brake))
        else:
            write_tables(place, brake)


def _input_file(brake: SolidBrake) -> str:
    """Nodes and elements as Abaqus and CalculiX read them."""
    lines = ["*NODE"]
    for number, (x, y, z) in enumerate(brake.places.tolist(), 1):
        lines.append(f"{number}, {x}, {y}, {z}")
    lines.append("*ELEMENT, TYPE=C3D8")
    for number, corners in enumerate((brake.cells + 1).tolist(), 1):
        lines.append(", ".join(map(str, (number, *corners))))
    return "\n".join(lines) + "\n"


def write_tables(folder: Path, brake: SolidBrake) -> None:
    """Nodes with their directions, and elements, as tables."""
    places = brake.places.tolist()
    nodes = []
    for node, direction in zip(brake.nodes.tolist(), brake.directions.tolist(), strict=True):
        nodes.append((node + 1, "xyz"[direction], *places[node]))
    for node in np.setdiff1d(np.arange(len(places)), brake.nodes).tolist():
        nodes.append((node + 1, "fixed", *places[node]))
    write_csv(folder / "nodes.csv", ["node", "dof", "x", "y", "z"], nodes)
    heads = ["element", "type", *(f"node{corner}" for corner in range(1, 9))]
    elements = enumerate((brake.cells + 1).tolist(), 1)
    rows = [(number, "hexahedron", *corners) for number, corners in elements]
    write_csv(folder / "elements.csv", heads, rows)


def write_parts(folder: Path, brake: SolidBrake) -> None:
    """Disc and pad, a folder each, the pairs of their nodes and the file that joins them."""
    contact = brake.contact
    table = zip(*contact.pairs.T.tolist(), contact.area.tolist(), strict=True)
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
    with whole_folder(folder) as place:
        write_components(place, brake.bodies, "npz")
        write_csv(place / "pairs.csv", ["first", "second", "area"], table)
        write_text(place / "assembly.yaml", yaml.safe_dump(document, sort_keys=False))
