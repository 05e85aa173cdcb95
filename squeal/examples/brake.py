"""A disc brake in three-dimensional solids, from its geometry.

A disc clamped at its inner edge and a pad on part of its upper face, linear hexahedra on matching
meshes. Normal springs join the faces over the whole contact; friction mu times their force acts
along the disc's motion. `squeal example brake` writes matrices, as a program would, coordinates and
a system file that reads them.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from squeal.analysis.systems.matrices import write_components, write_system
from squeal.errors import InputError
from squeal.io.writing import whole_folder, write_csv, write_text
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.sparse.components import Component
from squeal.sparse.contact_seat import Contact

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
    disc and pad in contact with their `area` (m,), `back` (m,) those of the pad behind them, on
    which the piston acts.
    """

    system: TermSystem = field(repr=False)
    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)
    cells: NDArray[np.intp] = field(repr=False)
    pairs: NDArray[np.intp] = field(repr=False)
    area: NDArray[np.float64] = field(repr=False)
    back: NDArray[np.intp] = field(repr=False)


def _block(counts: tuple[int, int, int], closed: bool) -> tuple[NDArray, NDArray]:
    """Indices (cells, 8) of the corners of each cell of a grid (r, phi, z), and the grid's shape.

    In the order of `CORNERS`; `closed` in phi.
    """
    r, a, z = counts
    around = a if closed else a + 1
    shape = np.array([r + 1, around, z + 1])
    i, j, k = (x.ravel() for x in np.meshgrid(*map(np.arange, counts), indexing="ij"))
    columns = [
        np.ravel_multi_index((i + x, (j + y) % around, k + w), tuple(shape)) for x, y, w in CORNERS
    ]
    return np.array(columns), shape


def _places(radii: NDArray, angles: NDArray, heights: NDArray) -> NDArray:
    r, a, z = (x.ravel() for x in np.meshgrid(radii, angles, heights, indexing="ij"))
    return np.array([r * np.cos(a), r * np.sin(a), z])


def _at_gauss_points(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Trilinear shape functions (cells, 8, points) of hexahedra at Gauss points, and their slopes
    (cells, 8, 3, points) in x, y, z, both times the root of the weight.

    corners (cells, 8, 3) in m, in the order of `CORNERS`.
    """
    places, weights = np.polynomial.legendre.leggauss(GAUSS)
    steps = np.meshgrid(*[np.arange(GAUSS)] * 3, indexing="ij")
    points = np.column_stack([(places[axis.ravel()] + 1.0) / 2.0 for axis in steps])
    weight = np.prod([weights[axis.ravel()] / 2.0 for axis in steps], axis=0)
    far = np.array(CORNERS)[:, None] == 1  # (corner, 1, axis)
    # along each axis a function is s or 1 - s, its slope 1 or -1
    along = np.where(far, points, 1.0 - points)  # (corner, point, axis)
    slope = np.where(far, 1.0, -1.0)
    shapes = along.prod(axis=2)
    local = np.stack(
        [
            slope[..., 0] * along[..., 1] * along[..., 2],
            along[..., 0] * slope[..., 1] * along[..., 2],
            along[..., 0] * along[..., 1] * slope[..., 2],
        ]
    )  # (axis, corner, point)
    jacobian = np.einsum("eci,acp->epia", corners, local)
    inverse = np.linalg.inv(jacobian)
    roots = np.sqrt(np.abs(np.linalg.det(jacobian)) * weight)  # (cells, points)
    slopes = np.einsum("epai,acp->ecip", inverse, local)
    return shapes * roots[:, None], slopes * roots[:, None, None]


def _assembled(places: NDArray, cells: NDArray, material: tuple[float, float, float]) -> Any:
    """Mass and stiffness of a body, rows (node, direction)."""
    from scipy.sparse import coo_array

    young, poisson, density = material
    shear = young / (2.0 * (1.0 + poisson))
    volume = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    shapes, slopes = _at_gauss_points(places.T[cells.T])
    count = cells.shape[1]
    flat = slopes.reshape(count, 24, -1)  # corner and direction, point
    both = (flat @ flat.transpose(0, 2, 1)).reshape(count, 8, 3, 8, 3)
    K = volume * both + shear * both.transpose(0, 1, 4, 3, 2)
    M = np.zeros_like(K)
    gradient = np.einsum("eiaja->eij", both)
    mass = shapes @ shapes.transpose(0, 2, 1)
    for way in range(3):
        K[:, :, way, :, way] += shear * gradient
        M[:, :, way, :, way] = density * mass
    rows = (3 * cells.T[:, :, None] + np.arange(3)).reshape(count, 24)
    where = (np.repeat(rows, 24, axis=1).ravel(), np.tile(rows, 24).ravel())
    n = 3 * places.shape[1]
    assembled = tuple(coo_array((X.ravel(), where), shape=(n, n)).tocsc() for X in (M, K))
    for X in assembled:
        X.eliminate_zeros()
    return assembled


def solid_brake(
    rows: int = 2000, geometry: Geometry | None = None, around: int = ROUND
) -> SolidBrake:
    """The brake with at least so many degrees of freedom (500 to 1,000,000).

    `around` elements lie around the disc for each level of refinement, a multiple of 6.

    Raises InputError, and ComputationError if scikit-fem is not installed.
    """
    from scipy.sparse import block_diag, coo_array, csc_array, diags_array

    g = geometry or Geometry()
    if not ROWS[0] <= rows <= ROWS[1]:
        raise InputError(f"{rows} rows are not allowed; it must be {ROWS[0]} to {ROWS[1]}")
    c = next(c for c in range(1, 99) if 3 * (2 * c * around * c * (c + 1)) >= rows)
    along_pad = around * PAD // ROUND * c
    radii = np.linspace(g.inner, g.outer, 2 * c + 1)
    angles = 2 * np.pi * np.arange(around * c) / (around * c)
    disc_cells, disc_shape = _block((2 * c, around * c, c), True)
    pad_cells, pad_shape = _block((c, along_pad, c), False)
    disc = _places(radii, angles, np.linspace(-g.thickness, 0.0, c + 1))
    pad = _places(radii[c:], angles[: along_pad + 1], np.linspace(0.0, g.pad_thickness, c + 1))
    bodies = [_assembled(disc, disc_cells, g.disc), _assembled(pad, pad_cells, g.pad)]
    M, K = (csc_array(block_diag(parts)) for parts in zip(*bodies, strict=True))

    number = np.arange(disc.shape[1]).reshape(disc_shape)
    pads = np.arange(pad.shape[1]).reshape(pad_shape) + disc.shape[1]
    places = np.hstack([disc, pad])
    below, above = number[c:, : along_pad + 1, -1].ravel(), pads[:, :, 0].ravel()
    area = _areas(radii[c:], angles[: along_pad + 1])
    n = len(places.T) * 3
    normal = coo_array(  # gap of each pair: pad's z minus disc's
        (
            np.concatenate([np.ones(len(above)), -np.ones(len(below))]),
            (np.tile(np.arange(len(above)), 2), np.concatenate([3 * above + 2, 3 * below + 2])),
        ),
        shape=(len(above), n),
    ).tocsc()
    x, y = places[0, above], places[1, above]
    radius = np.hypot(x, y)
    data = np.concatenate([-y / radius, x / radius, y / radius, -x / radius])
    columns = np.concatenate([3 * above, 3 * above + 1, 3 * below, 3 * below + 1])
    slide = coo_array((data, (np.tile(np.arange(len(above)), 4), columns)), shape=(len(above), n))
    stiff = diags_array(g.contact * area)
    contact = csc_array(normal.T @ stiff @ normal)
    friction = csc_array(slide.tocsc().T @ stiff @ normal)

    ground = np.zeros(n)
    ground[3 * pads[:, :, -1].ravel() + 2] = g.piston * area
    for end in (0, -1):
        edge = pads[:, end, :].ravel()
        face = (g.outer - radii[c]) * g.pad_thickness / len(edge)
        ground[3 * edge] += g.abutment * face
        ground[3 * edge + 1] += g.abutment * face
    K = csc_array(K + diags_array(ground))

    kept = np.setdiff1d(np.arange(n), (3 * number[0].ravel()[:, None] + np.arange(3)).ravel())
    M, K, contact, friction = (csc_array(X)[kept][:, kept] for X in (M, K, contact, friction))
    alpha, beta = g.damping
    damping = (Term(csc_array(alpha * M + beta * K)),)
    terms = (Term(K), Term(contact, Formula("contact")), Term(friction, Formula("mu*contact")))
    own = {"mu": 0.4, "contact": 1.0}
    system = TermSystem((Term(M),), damping, terms, own, "mu", "solid brake")
    cells = np.hstack([disc_cells, pad_cells + disc.shape[1]])[VTK].T
    pairs, back = np.column_stack([below, above]), pads[:, :, -1].ravel()
    return SolidBrake(system, kept // 3, kept % 3, places.T, cells, pairs, area, back)


def transport(brake: SolidBrake, geometry: Geometry | None = None) -> tuple[Any, Any]:
    """What turning the disc by 1 rad/s adds: G of the gyroscopic term 2 G q' and H of -H q, both
    (n, n), from the derivative along the motion of a material that passes the mesh."""
    from scipy.sparse import block_diag, coo_array, csc_array, kron
    from skfem import Basis, ElementHex1, MeshHex

    density = (geometry or Geometry()).disc[2]
    of_disc = brake.cells[:, VTK].max(axis=1) < brake.pairs[0, 1]
    corners = brake.cells[of_disc][:, np.argsort(VTK)].T
    disc = int(corners.max()) + 1
    basis = Basis(MeshHex(brake.places[:disc].T, corners), ElementHex1())
    x, y, _ = np.asarray(basis.global_coordinates())
    values = np.array([np.asarray(b[0]) for b in basis.basis])
    slopes = np.array([x * b[0].grad[1] - y * b[0].grad[0] for b in basis.basis])
    mass = density * basis.dx
    carried = np.einsum("iep,jep,ep->eij", values, slopes, mass)
    centrifugal = np.einsum("iep,jep,ep->eij", slopes, slopes, mass)
    gyroscopic = (carried - carried.transpose(0, 2, 1)) / 2  # skew, as over the closed ring
    nodes = basis.element_dofs.T
    where = np.repeat(nodes, 8, axis=1).ravel(), np.tile(nodes, 8).ravel()
    others = len(brake.places) - disc
    found = []
    for entries in (gyroscopic, centrifugal):
        scalar = coo_array((entries.ravel(), where), shape=(disc, disc))
        whole = block_diag([scalar, coo_array((others, others))])
        vector = csc_array(kron(whole, np.eye(3)))
        rows = 3 * brake.nodes + brake.directions
        matrix = csc_array(vector[rows][:, rows])
        matrix.eliminate_zeros()
        found.append(matrix)
    return found[0], found[1]


def _areas(radii: NDArray, angles: NDArray) -> NDArray:
    """Share of the contact's area of each node (r, phi)."""
    step = np.diff(radii).mean(), np.diff(angles).mean()
    ends = [np.ones(len(x)) for x in (radii, angles)]
    for weights in ends:
        weights[[0, -1]] = 0.5
    return np.asarray((np.outer(ends[0] * radii, ends[1]) * step[0] * step[1]).ravel())


# the files of mass, damping, stiffness, contact and friction in each program's form
FILES = {
    "abaqus": ("brake_MASS1.mtx", "brake_DMPV1.mtx", "brake_STIF1.mtx")
    + ("contact_STIF1.mtx", "friction_STIF1.mtx"),
    "nastran": ("brake.pch",) * 5,
    "ansys": ("MASS.hb", "DAMP.hb", "STIFF.hb", "CONTACT.hb", "FRICTION.hb"),
    "calculix": ("brake.mas", "damping.sti", "brake.sti", "contact.sti", "friction.sti"),
    "matlab": ("brake.mat",) * 5,
}
KEYS = ("MAAX", "BAAX", "KAAX", "KCONTACT", "KFRIC")  # in a file that holds several


def _entries(matrix: Any) -> tuple[bool, list[tuple[int, int, float]]]:
    """Whether a matrix is symmetric, and its entries (row, column, value), its lower half if so."""
    from scipy.sparse import tril

    symmetric = bool(abs(matrix - matrix.T).max() <= 1e-14 * abs(matrix).max())
    entries = (tril(matrix) if symmetric else matrix).tocsc().tocoo()
    return symmetric, list(zip(*(x.tolist() for x in (*entries.coords, entries.data)), strict=True))


def _as_hbmat(matrix: Any) -> str:
    """Harwell-Boeing text in the fields of Ansys' HBMAT."""
    symmetric, entries = _entries(matrix)
    n, count = matrix.shape[0], len(entries)
    starts = np.searchsorted([column for _, column, _ in entries], np.arange(n + 1)) + 1
    parts = [
        "".join("".join(fields[k : k + each]) + "\n" for k in range(0, len(fields), each))
        for each, fields in (
            (8, [f"{x:10d}" for x in starts]),
            (8, [f"{row + 1:10d}" for row, _, _ in entries]),
            (3, [f"{value:25.16E}".replace("E", "D") for _, _, value in entries]),
        )
    ]
    cards = [part.count("\n") for part in parts]
    head = f"{'brake':72}{'brake':8}\n" + "".join(f"{x:14d}" for x in (sum(cards), *cards, 0))
    head += f"\n{'RSA' if symmetric else 'RUA':14}{n:14d}{n:14d}{count:14d}{0:14d}\n"
    return f"{head}{'(8I10)':16}{'(8I10)':16}{'(1P,3D25.16)':20}{'':20}\n" + "".join(parts)


def _as_dmig(name: str, matrix: Any, rows: list[tuple[int, int]]) -> str:
    """Cards DMIG of a punch file in large fields, with the ten digits that these hold."""
    symmetric, entries = _entries(matrix)
    lines, last = [f"DMIG    {name:8}{0:8d}{6 if symmetric else 1:8d}{2:8d}{0:8d}"], -1
    for row, column, value in entries:
        if column != last:
            lines.append("DMIG*   {:16}{:16d}{:16d}".format(name, *rows[column]))
        number = f"{value:16.9E}".replace("E", "D")
        lines.append("*       {:16d}{:16d}".format(*rows[row]) + number)
        last = column
    return "\n".join(lines) + "\n"


def write_matrices(folder: Path, brake: SolidBrake, form: str) -> dict[str, Any]:
    """Write the matrices as a program would; the document of a system file that reads them."""
    from scipy.io import savemat

    system = brake.system
    rows = list(zip((brake.nodes + 1).tolist(), (brake.directions + 1).tolist(), strict=True))
    own = {"parameters": dict(system.parameters), "parameter": system.parameter}
    document: dict[str, Any] = {"name": system.name} | own
    of = [part for part, terms in zip("MCK", system.parts, strict=True) for _ in terms]
    punched, labels = "", "".join(f"{node}.{way}\n" for node, way in rows)
    mapping = ("UX", "UY", "UZ")
    for part, name, key, term in zip(of, FILES[form], KEYS, system.terms, strict=True):
        path = folder / name
        reading: dict[str, Any] = {"file": name, "factor": term.factor.text}
        symmetric, entries = _entries(term.matrix)
        if form in ("nastran", "matlab"):
            reading["key"] = key
        elif form != "ansys":
            reading["symmetric"] = symmetric
        if form == "abaqus":
            lines = ("{},{}, {},{}, {:.16e}\n".format(*rows[i], *rows[j], x) for i, j, x in entries)
            path.write_text("".join(lines), encoding="ascii")
        elif form == "calculix":
            lines = (f"{i + 1} {j + 1} {x:.16e}\n" for i, j, x in entries)
            path.write_text("".join(lines), encoding="ascii")
            path.with_suffix(".dof").write_text(labels, encoding="ascii")
        elif form == "ansys":
            path.write_text(_as_hbmat(term.matrix), encoding="ascii")
            names = (
                f"{k:8d} {node:8d} {mapping[way - 1]}\n" for k, (node, way) in enumerate(rows, 1)
            )
            beside = "Matrix Eqn     Node DOF\n" + "".join(names)
            path.with_suffix(".mapping").write_text(beside, encoding="ascii")
        elif form == "nastran":
            punched += _as_dmig(key, term.matrix, rows)
        document.setdefault(part, []).append(reading)
    if form == "nastran":
        (folder / FILES[form][0]).write_text(punched, encoding="ascii")
    elif form == "matlab":
        each = zip(KEYS, system.terms, strict=True)
        savemat(folder / FILES[form][0], {key: term.matrix for key, term in each})
    return document


def write_brake(folder: Path, brake: SolidBrake, form: str = "npz") -> None:
    """Matrices in the form of a program, coordinates, elements and the system file in a folder."""
    one = form in ("abaqus", "calculix")  # their input file names nodes and elements
    tables = ("brake.inp", "brake.inp") if one else ("nodes.csv", "elements.csv")
    keys = "coordinates", "elements"
    beside = {key: {"file": name} for key, name in zip(keys, tables, strict=True)}
    if form == "npz":
        write_system(folder, brake.system, "npz", **beside)
    else:
        with whole_folder(folder) as place:
            document = write_matrices(place, brake, form) | beside
            write_text(place / "system.yaml", yaml.safe_dump(document, sort_keys=False))
    if one:
        places, cells = brake.places.tolist(), (brake.cells + 1).tolist()
        lines = ["*NODE", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(places, 1))]
        lines += ["*ELEMENT, TYPE=C3D8"]
        lines += [", ".join(map(str, (k, *row))) for k, row in enumerate(cells, 1)]
        write_text(folder / tables[0], "\n".join(lines) + "\n")
        return
    write_tables(folder, brake)


def write_tables(folder: Path, brake: SolidBrake) -> None:
    """Nodes with their directions, and elements, as tables."""
    places, cells = brake.places.tolist(), (brake.cells + 1).tolist()
    ways = [(node, "xyz"[way]) for node, way in zip(brake.nodes, brake.directions, strict=True)]
    ways += [(node, "fixed") for node in np.setdiff1d(np.arange(len(places)), brake.nodes)]
    nodes = ((int(node) + 1, way, *places[node]) for node, way in ways)
    write_csv(folder / "nodes.csv", ["node", "dof", "x", "y", "z"], nodes)
    heads = ["element", "type", *(f"node{k}" for k in range(1, 9))]
    rows = ((k, "hexahedron", *row) for k, row in enumerate(cells, 1))
    write_csv(folder / "elements.csv", heads, rows)


def parts(brake: SolidBrake, geometry: Geometry | None = None) -> tuple[list[Component], Contact]:
    """Disc and pad without contact, nodes counted from 1, the pad pressed by 1 Pa; and the contact
    of the whole brake, whose pairs may open."""
    own, bodies = brake.system, []
    for name, rows in (
        ("disc", np.flatnonzero(brake.nodes < brake.pairs[0, 1])),
        ("pad", np.flatnonzero(brake.nodes >= brake.pairs[0, 1])),
    ):
        M, C, K = (
            tuple(Term(t.matrix[rows][:, rows], t.factor) for t in terms)
            for terms in (own.M, own.C, own.K[:1])
        )
        nodes, directions = brake.nodes[rows], brake.directions[rows]
        load = np.zeros(len(rows))
        for node, area in zip(brake.back, brake.area, strict=True):
            load[(nodes == node) & (directions == 2)] = -area
        system = TermSystem(M, C, K, name=name)
        bodies.append(Component(system, nodes + 1, directions, brake.places[nodes], load))
    stiffness = (geometry or Geometry()).contact
    pairs, normal, axis = brake.pairs + 1, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    return bodies, Contact(("disc", "pad"), pairs, normal, stiffness, brake.area, axis=axis)


def write_parts(folder: Path, brake: SolidBrake) -> None:
    """Disc and pad, a folder each, the pairs of their nodes and the file that joins them."""
    bodies, contact = parts(brake)
    write_components(folder, bodies, "npz")
    table = zip(*contact.pairs.T.tolist(), contact.area.tolist(), strict=True)
    write_csv(folder / "pairs.csv", ["first", "second", "area"], table)
    load = {"file": "pad/load.csv", "factor": "pressure"}
    pads = {"file": "pad/system.yaml", "load": load}
    between = {"between": ["disc", "pad"], "pairs": {"file": "pairs.csv"}}
    laws = {"normal": [0, 0, 1], "axis": [0, 0, 1], "stiffness": contact.stiffness, "gap": "wear"}
    document = {
        "name": "solid brake",
        "parameters": {"mu": 0.4, "pressure": 2.0e6, "wear": 0.0},
        "components": {"disc": {"file": "disc/system.yaml"}, "pad": pads},
        "contact": [between | laws],
    }
    write_text(folder / "assembly.yaml", yaml.safe_dump(document, sort_keys=False))
