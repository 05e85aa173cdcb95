"""Writes free structures as bulk data of ten digits (DMIG) by pyNastran 1.4.1's own writer.

`python -m tests.data.free_structures tests/data` in an environment of its own that has pyNastran.
The matrices are those of beam elements in closed form. The beam bends within a plane, the frame
moves within its plane, and the wing is a swept and tapered box of two spars and ribs.
"""

import sys
from pathlib import Path

import numpy as np

BEAM = ((1, 5), 2)  # directions of each node, free motions
FRAME = ((0, 1, 5), 3)
WING = (tuple(range(6)), 6)


def element(length, a, b, E=7.1e10, nu=0.33, rho=2700.0):
    """Stiffness and consistent mass (12, 12) of a beam along x: u v w and rotations, two nodes."""
    area = a * b
    Iy = a * b**3 / 12
    Iz = b * a**3 / 12
    J = Iy + Iz
    G = E / 2 / (1 + nu)
    h = length
    K = np.zeros((12, 12))
    M = np.zeros((12, 12))
    for i, stiff, mass in ((0, E * area, rho * area), (3, G * J, rho * J)):
        own = np.ix_([i, i + 6], [i, i + 6])
        K[own] += stiff / h * np.array([[1, -1], [-1, 1]])
        M[own] += mass * h / 6 * np.array([[2, 1], [1, 2]])
    bend = np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h * h, -6 * h, 2 * h * h],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h * h, -6 * h, 4 * h * h],
        ]
    )
    move = np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    )
    for rows, sign, inertia in (([1, 5, 7, 11], 1, Iz), ([2, 4, 8, 10], -1, Iy)):
        turn = np.diag([1.0, sign, 1.0, sign])
        K[np.ix_(rows, rows)] += E * inertia / h**3 * turn @ bend @ turn
        M[np.ix_(rows, rows)] += rho * area * h / 420 * turn @ move @ turn
    return K, M


def assembled(points, bars, directions):
    """K, M and the labels of bars (start, end, width, height) between points (m, 3)."""
    n = 6 * len(points)
    K = np.zeros((n, n))
    M = np.zeros((n, n))
    for start, end, a, b in bars:
        along = points[end] - points[start]
        length = np.linalg.norm(along)
        x = along / length
        y = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [1.0, 0.0, 0.0], x)
        y /= np.linalg.norm(y)
        T = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
        rows = np.r_[6 * start : 6 * start + 6, 6 * end : 6 * end + 6]
        for whole, own in zip((K, M), element(length, a, b), strict=True):
            whole[np.ix_(rows, rows)] += T.T @ own @ T
    kept = [6 * i + d for i in range(len(points)) for d in directions]
    labels = [(i + 1, d + 1) for i in range(len(points)) for d in directions]
    matrices = [(X + X.T) / 2 for X in (K[np.ix_(kept, kept)], M[np.ix_(kept, kept)])]
    for X in matrices:  # what the rotations leave of zeros
        X[np.abs(X) < 1e-13 * np.abs(X).max()] = 0.0
    return *matrices, labels


def beam():
    """An uneven beam along x, of seven nodes."""
    x = np.linspace(0.0, 1.0, 7) ** 1.1
    points = np.outer(x, [1.37, 0.0, 0.0])
    return assembled(points, [(k, k + 1, 0.0317, 0.0213) for k in range(6)], BEAM[0])


def frame():
    """Two columns and a beam between them, the columns of two bars and the beam of four."""
    points = []
    for level, place in ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (2, 3), (2, 4), (1, 4), (0, 4)):
        points.append([0.45 * place, 0.62 * level + 0.02 * place, 0.0])
    bars = [(k, k + 1, 0.025, 0.012 + 0.001 * k) for k in range(8)]
    return assembled(np.array(points), bars, FRAME[0])


def wing():
    """A swept and tapered box: two spars and three ribs."""
    points = []
    bars = []
    for rib in range(3):
        chord = 0.6 - 0.09 * rib
        for side in (0.0, 1.0):
            points.append([0.28 * rib + side * chord, 0.7 * rib, 0.04 * rib + 0.03 * side])
        bars.append((2 * rib, 2 * rib + 1, 0.03, 0.006))
        if rib:
            thickness = 0.05 - 0.007 * rib
            bars += [(2 * rib - 2, 2 * rib, 0.012, thickness)]
            bars += [(2 * rib - 1, 2 * rib + 1, 0.01, thickness)]
    return assembled(np.array(points), bars, WING[0])


STRUCTURES = {"beam": (beam, BEAM[1]), "frame": (frame, FRAME[1]), "wing": (wing, WING[1])}


def write(folder: Path) -> None:
    """All files, by pyNastran."""
    from pyNastran.bdf.bdf import BDF

    for name, (make, _) in STRUCTURES.items():
        K, M, labels = make()
        model = BDF(debug=False)
        for key, X in (("KAAX", K), ("MAAX", M)):
            columns = []
            rows = []
            values = []
            for c in range(len(X)):
                for r in range(c, len(X)):
                    if X[r, c]:
                        columns.append(labels[c])
                        rows.append(labels[r])
                        values.append(X[r, c])
            model.add_dmig(key, 6, 2, 0, 0, len(X), columns, rows, values)
        model.punch = True
        model.write_bdf(folder / f"{name}.bdf", size=16, is_double=False, write_header=False)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
