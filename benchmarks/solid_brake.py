"""A disc brake in three-dimensional solids, from its geometry, by scikit-fem (extra `fe`).

A disc clamped at its inner edge and a pad on part of its upper face, linear hexahedra on matching
meshes. Normal springs join the faces over the whole contact; friction mu times their force acts
along the disc's motion. `python -m benchmarks.solid_brake FOLDER [ROWS]` writes
matrices, coordinates and a system file.
"""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.systems.matrices import write_system
from squeal.errors import ComputationError, InputError
from squeal.io.writing import write_csv
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

ROWS = (500, 1_000_000)
ROUND = 24  # elements around the disc for each level of refinement
PAD = 4  # elements along the pad


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

    `nodes`, `directions` (n,) tell what each row is, `places` (nodes, 3) where in m.
    """

    system: TermSystem = field(repr=False)
    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)


def _block(counts: tuple[int, int, int], closed: bool) -> tuple[NDArray, NDArray]:
    """Indices (cells, 8) of the corners of each cell of a grid (r, phi, z), and the grid's shape.

    In the order that scikit-fem gives the corners of its reference cell; `closed` in phi.
    """
    r, a, z = counts
    around = a if closed else a + 1
    shape = np.array([r + 1, around, z + 1])
    i, j, k = (x.ravel() for x in np.meshgrid(*map(np.arange, counts), indexing="ij"))
    corners = [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0)]
    columns = [
        np.ravel_multi_index((i + x, (j + y) % around, k + w), tuple(shape))
        for x, y, w in (*corners, (1, 1, 1))
    ]
    return np.array(columns), shape


def _places(radii: NDArray, angles: NDArray, heights: NDArray) -> NDArray:
    r, a, z = (x.ravel() for x in np.meshgrid(radii, angles, heights, indexing="ij"))
    return np.array([r * np.cos(a), r * np.sin(a), z])


def _assembled(places: NDArray, cells: NDArray, material: tuple[float, float, float]) -> Any:
    """Mass and stiffness of a body, rows (node, direction)."""
    from scipy.sparse import coo_array

    try:
        from skfem import Basis, ElementHex1, MeshHex
        from skfem.models.elasticity import lame_parameters
    except ImportError:
        raise ComputationError(
            "a brake of solids needs the package scikit-fem, which is not installed (extra fe)"
        ) from None
    young, poisson, density = material
    volume, shear = lame_parameters(young, poisson)
    basis = Basis(MeshHex(places, cells), ElementHex1())
    weight = np.sqrt(basis.dx)  # (cells, points)
    shapes = np.array([np.asarray(b[0]) * weight for b in basis.basis]).transpose(1, 0, 2)
    slopes = np.array([b[0].grad * weight for b in basis.basis]).transpose(2, 0, 1, 3)
    count = len(slopes)
    flat = slopes.reshape(count, 24, -1)  # (cells, corner and direction, points)
    both = (flat @ flat.transpose(0, 2, 1)).reshape(count, 8, 3, 8, 3)
    K = volume * both + shear * both.transpose(0, 1, 4, 3, 2)
    M = np.zeros_like(K)
    gradient, mass = np.einsum("eiaja->eij", both), shapes @ shapes.transpose(0, 2, 1)
    for way in range(3):
        K[:, :, way, :, way] += shear * gradient
        M[:, :, way, :, way] = density * mass
    rows = (3 * basis.element_dofs.T[:, :, None] + np.arange(3)).reshape(count, 24)
    where = (np.repeat(rows, 24, axis=1).ravel(), np.tile(rows, 24).ravel())
    n = 3 * places.shape[1]
    assembled = tuple(coo_array((X.ravel(), where), shape=(n, n)).tocsc() for X in (M, K))
    for X in assembled:
        X.eliminate_zeros()
    return assembled


def solid_brake(rows: int = 2000, geometry: Geometry | None = None) -> SolidBrake:
    """The brake with at least so many degrees of freedom (500 to 1,000,000).

    Raises InputError, and ComputationError if scikit-fem is not installed.
    """
    from scipy.sparse import block_diag, coo_array, csc_array, diags_array

    g = geometry or Geometry()
    if not ROWS[0] <= rows <= ROWS[1]:
        raise InputError(f"{rows} rows are not allowed; it must be {ROWS[0]} to {ROWS[1]}")
    c = next(c for c in range(1, 99) if 3 * (2 * c * ROUND * c * (c + 1)) >= rows)
    radii = np.linspace(g.inner, g.outer, 2 * c + 1)
    angles = 2 * np.pi * np.arange(ROUND * c) / (ROUND * c)
    disc_cells, disc_shape = _block((2 * c, ROUND * c, c), True)
    pad_cells, pad_shape = _block((c, PAD * c, c), False)
    disc = _places(radii, angles, np.linspace(-g.thickness, 0.0, c + 1))
    pad = _places(radii[c:], angles[: PAD * c + 1], np.linspace(0.0, g.pad_thickness, c + 1))
    bodies = [_assembled(disc, disc_cells, g.disc), _assembled(pad, pad_cells, g.pad)]
    M, K = (csc_array(block_diag(parts)) for parts in zip(*bodies, strict=True))

    number = np.arange(disc.shape[1]).reshape(disc_shape)
    pads = np.arange(pad.shape[1]).reshape(pad_shape) + disc.shape[1]
    places = np.hstack([disc, pad])
    below, above = number[c:, : PAD * c + 1, -1].ravel(), pads[:, :, 0].ravel()
    area = _areas(radii[c:], angles[: PAD * c + 1])
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
    return SolidBrake(system, kept // 3, kept % 3, places.T)


def _areas(radii: NDArray, angles: NDArray) -> NDArray:
    """Share of the contact's area of each node (r, phi)."""
    step = np.diff(radii).mean(), np.diff(angles).mean()
    ends = [np.ones(len(x)) for x in (radii, angles)]
    for weights in ends:
        weights[[0, -1]] = 0.5
    return np.asarray((np.outer(ends[0] * radii, ends[1]) * step[0] * step[1]).ravel())


def write_brake(folder: Path, brake: SolidBrake) -> None:
    """Matrices (.npz), coordinates and the system file in a folder."""
    write_system(folder, brake.system, "npz", coordinates={"file": "nodes.csv"})
    rows = (
        (int(node) + 1, "xyz"[way], *map(float, brake.places[node]))
        for node, way in zip(brake.nodes, brake.directions, strict=True)
    )
    write_csv(folder / "nodes.csv", ["node", "dof", "x", "y", "z"], rows)


def main() -> int:
    """Write a brake into the folder that is named."""
    if len(sys.argv) not in (2, 3):
        print(f"usage: python -m {__spec__.name} FOLDER [ROWS]", file=sys.stderr)
        return 2
    try:
        brake = solid_brake(int(sys.argv[2]) if len(sys.argv) == 3 else 2000)
        write_brake(Path(sys.argv[1]), brake)
    except (InputError, ComputationError, ValueError) as error:
        print(f"solid brake: {error}", file=sys.stderr)
        return 2
    print(f"{brake.system.n} degrees of freedom in {sys.argv[1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
