"""A brake from its mesh to the verdict with CalculiX: `python brake_from_mesh.py [FOLDER]`.

Writes decks of a disc and of a pad on springs, which stand for the calliper, lets CalculiX write
their matrices, and the files that join them in squeal: brake.yaml. Two more decks are the whole
brake with CalculiX's own contact, without and with friction.
"""

import csv
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

# m: radii of the disc
INNER = 0.06
OUTER = 0.11
# m: radii of the pad
PAD_INNER = 0.08
PAD_OUTER = 0.10
# m
THICKNESS = 0.016
PAD_THICKNESS = 0.012
PAD_SECTORS = 8  # of the disc's sectors that the pad covers
DISC_MATERIAL = (1.15e11, 0.26, 7200.0)  # Pa, 1, kg/m^3: cast iron
PAD_MATERIAL = (6.0e9, 0.30, 2500.0)  # friction material
# N/m: springs behind the pad, and at its ends
PRESS = 4.0e7
SIDE = 1.5e8
FORCE = 4000.0  # N
STIFFNESS = 2.0e11  # N/m^3 of the contact
TURN = 0.002  # rad of the sliding step
MODES = 24


def annulus(radii, angles, heights, first):
    """Nodes {number: place} and elements (C3D8) of a part of a ring; closed if angles go round."""
    closed = np.isclose(angles[-1] - angles[0], 2.0 * np.pi)
    around = len(angles) - closed
    number = {}
    nodes = {}
    for i, radius in enumerate(radii):
        for j in range(around):
            for k, height in enumerate(heights):
                number[i, j, k] = first + len(nodes)
                place = (radius * np.cos(angles[j]), radius * np.sin(angles[j]), height)
                nodes[number[i, j, k]] = place
    elements = []
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    for i in range(len(radii) - 1):
        for j in range(len(angles) - 1):
            for k in range(len(heights) - 1):
                lower = [number[i + a, (j + b) % around, k] for a, b in corners]
                upper = [number[i + a, (j + b) % around, k + 1] for a, b in corners]
                elements.append(lower + upper)
    return nodes, elements, number


class Brake:
    """Meshes, sets and the pairs of nodes in contact; `refine` divides every edge."""

    def __init__(self, refine=1):
        sectors = 40 * refine
        covered = PAD_SECTORS * refine
        step = 2.0 * np.pi / sectors
        radial = np.linspace(INNER, OUTER, 5 * refine + 1)
        heights = np.linspace(-THICKNESS, 0.0, 2 * refine + 1)
        around = step * np.arange(sectors + 1)
        self.disc, self.disc_elements, at = annulus(radial, around, heights, 1)
        inside = (radial > PAD_INNER - 1e-9) & (radial < PAD_OUTER + 1e-9)
        pad_radii = radial[inside]
        pad_angles = step * np.arange(covered + 1)
        pad_heights = np.linspace(0.0, PAD_THICKNESS, 2 * refine + 1)
        first = len(self.disc) + 1
        self.pad, self.pad_elements, of_pad = annulus(pad_radii, pad_angles, pad_heights, first)
        offset = int(np.flatnonzero(inside)[0])
        top = len(heights) - 1
        back = len(pad_heights) - 1
        rings = range(len(pad_radii))
        lines = range(len(pad_angles))
        self.clamped = [at[0, j, k] for j in range(sectors) for k in range(len(heights))]
        self.pairs = [(at[i + offset, j, top], of_pad[i, j, 0]) for i in rings for j in lines]
        self.back = [of_pad[i, j, back] for i in rings for j in lines]
        self.side = [of_pad[i, j, back] for i in rings for j in (0, lines[-1])]
        # each node has a quarter of the face of every element that it belongs to
        share = dict.fromkeys(self.pairs, 0.0)
        for i in rings[:-1]:
            face = 0.5 * (pad_radii[i + 1] ** 2 - pad_radii[i] ** 2) * step
            for j in lines[:-1]:
                for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
                    share[at[i + a + offset, j + b, top], of_pad[i + a, j + b, 0]] += face / 4
        self.shares = share
        count = len(self.disc_elements)
        self.faces = {"disc": [], "pad": []}
        layers = len(heights) - 1
        for place in range(count):
            if place % layers == layers - 1:
                self.faces["disc"].append(place + 1)
        layers = len(pad_heights) - 1
        for place in range(len(self.pad_elements)):
            if place % layers == 0:
                self.faces["pad"].append(count + place + 1)


def mesh_cards(nodes, elements, name, first):
    """Cards of nodes and elements."""
    lines = ["*NODE,NSET=ALL"]
    lines += [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in nodes.items()]
    lines.append(f"*ELEMENT,TYPE=C3D8I,ELSET={name}")
    for number, corners in enumerate(elements, first):
        lines.append(",".join(map(str, [number, *corners])))
    return lines


def material_cards(name, material):
    modulus, ratio, density = material
    return [
        f"*MATERIAL,NAME=M{name}",
        *("*ELASTIC", f"{modulus:e},{ratio:e}", "*DENSITY", f"{density:e}"),
        f"*SOLID SECTION,ELSET={name},MATERIAL=M{name}",
    ]


def disc_cards(brake):
    return [
        *mesh_cards(brake.disc, brake.disc_elements, "DISC", 1),
        *("*NSET,NSET=CLAMPED", *(f"{n}," for n in brake.clamped)),
        *material_cards("DISC", DISC_MATERIAL),
    ]


def pad_cards(brake):
    """The pad on its springs: along z behind it, along x and y at its ends."""
    first = len(brake.disc_elements) + 1
    lines = mesh_cards(brake.pad, brake.pad_elements, "PAD", first)
    lines += material_cards("PAD", PAD_MATERIAL)
    number = 100_000
    for name, where, way, total in (
        ("PRESS", brake.back, 3, PRESS),
        ("SIDEX", brake.side, 1, SIDE),
        ("SIDEY", brake.side, 2, SIDE),
    ):
        lines.append(f"*ELEMENT,TYPE=SPRING1,ELSET={name}")
        for node in where:
            number += 1
            lines.append(f"{number},{node}")
        lines += [f"*SPRING,ELSET={name}", f"{way}", f"{total / len(where):.9e}"]
    return lines


STORE = ["*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "1", "*END STEP"]


def contact_deck(brake, mu=0.0, turn=0.0):
    """The whole brake: pressed, with friction turned by an angle in rad, and its frequencies."""
    lines = [*disc_cards(brake), *pad_cards(brake), "*BOUNDARY", "CLAMPED,1,3"]
    for name, face in (("disc", "S2"), ("pad", "S1")):
        lines.append(f"*SURFACE,NAME={name.upper()}FACE,TYPE=ELEMENT")
        lines += [f"{element},{face}" for element in brake.faces[name]]
    lines += ["*SURFACE INTERACTION,NAME=TOUCH"]
    lines += ["*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", f"{STIFFNESS:e},1.e-3"]
    if mu:
        lines += ["*FRICTION", f"{mu:e},{100 * STIFFNESS:e}"]
    lines += ["*CONTACT PAIR,INTERACTION=TOUCH,TYPE=SURFACE TO SURFACE", "PADFACE,DISCFACE"]
    lines += ["*STEP,NLGEOM", "*STATIC", "1.,1.", "*CLOAD"]
    lines += [f"{node},3,{-FORCE / len(brake.back):.12g}" for node in brake.back]
    lines.append("*END STEP")
    if mu:
        lines += ["*STEP,NLGEOM", "*STATIC", ".25,1.", "*BOUNDARY"]
        less = 1.0 - np.cos(turn)
        for node in brake.clamped:
            x, y, _ = brake.disc[node]
            along_x = -less * x - np.sin(turn) * y
            along_y = np.sin(turn) * x - less * y
            lines += [f"{node},1,1,{along_x:.9e}", f"{node},2,2,{along_y:.9e}"]
        lines.append("*END STEP")
    lines += ["*STEP,PERTURBATION", "*FREQUENCY", f"{MODES}", "*END STEP"]
    return lines


def run_calculix(folder, name, lines):
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", name], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def printed(folder, name):
    """The frequencies (modes, 2) in Hz and growth rates in 1/s that CalculiX prints."""
    text = (folder / f"{name}.dat").read_text()
    table = text.split("E I G E N V A L U E   O U T P U T")[-1].split("P A R T I C I P A T I O N")[
        0
    ]
    # the last three columns; without friction the eigenvalue stands before them
    rows = re.findall(r"^ +\d+ .*?\S+ +(\S+) +(\S+) *$", table, re.MULTILINE)
    return np.array(rows, dtype=float)


def write_table(path, head, rows):
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows([head, *rows])


SYSTEM = """M: {{file: {name}.mas, symmetric: true}}
K: {{file: {name}.sti, symmetric: true}}
coordinates: {{file: {name}.inp}}
elements: {{file: {name}.inp}}
"""
ASSEMBLY = """name: brake from decks
parameters: {{mu: {mu}}}
components:
  disc: {{file: disc.yaml}}
  pad: {{file: pad.yaml, load: {{file: load.csv}}}}
contact:
  - between: [disc, pad]
    pairs: {{file: pairs.csv}}
    normal: [0, 0, 1]
    axis: [0, 0, 1]
    stiffness: {stiffness:g}
"""


def write_files(folder, brake, mu=0.5):
    """The matrices of both bodies by CalculiX, and the files that join them."""
    clamps = ["*BOUNDARY", "CLAMPED,1,3"]
    run_calculix(folder, "disc", [*disc_cards(brake), *clamps, *STORE])
    run_calculix(folder, "pad", [*pad_cards(brake), *STORE])
    for name in ("disc", "pad"):
        (folder / f"{name}.yaml").write_text(SYSTEM.format(name=name))
    loads = [(node, "z", -FORCE / len(brake.back)) for node in brake.back]
    write_table(folder / "load.csv", ["node", "dof", "force"], loads)
    pairs = [(*pair, area) for pair, area in brake.shares.items()]
    write_table(folder / "pairs.csv", ["first", "second", "area"], pairs)
    (folder / "brake.yaml").write_text(ASSEMBLY.format(mu=mu, stiffness=STIFFNESS))


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    brake = Brake()
    write_files(folder, brake)
    print(f"{folder / 'brake.yaml'}: {len(brake.disc)} and {len(brake.pad)} nodes")
    run_calculix(folder, "normal", contact_deck(brake))
    frequencies = printed(folder, "normal")[:, 0]
    print("CalculiX without friction, Hz:", *np.round(frequencies[:12], 1))
    run_calculix(folder, "friction", contact_deck(brake, 0.5, TURN))
    for frequency, growth in printed(folder, "friction"):
        if growth > 1e-3:
            print(f"CalculiX with friction: {frequency:.0f} Hz grows by {growth:.0f} 1/s")


if __name__ == "__main__":
    main()
