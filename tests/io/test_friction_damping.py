"""Damping by friction that turns with the sliding, mu N / v, against CalculiX.

CalculiX has no such damping: its complex frequencies know Coriolis forces and forces of a fluid
alone. Dashpots in its place, of the normal forces that it prints itself, answer harmonic forces.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest
import scipy.linalg

import squeal
from tests.io.test_faces import PRESS, STIFFNESS, STORE, Block, calculix, springs

pytestmark = pytest.mark.skipif(not shutil.which("ccx"), reason="needs CalculiX (ccx)")
SIZE = (0.06, 0.04, 0.02)  # m, of either block
FRICTION = 0.4
SPEED = 0.05  # m/s along x: slow, so that the damping is strong
MODES = 20
DASHPOT = ["*ELEMENT,TYPE=DASHPOTA,ELSET=D{name}", "{number},{first},{second}"]
DASHPOT += ["*DASHPOT,ELSET=D{name}", "", "{value:.9e}"]
NODE_LINE = re.compile(r"^ +(\d+) +(\S+) +(\S+) +(\S+)$", re.MULTILINE)


class Pair:
    """A block that is pressed on one that moves below it, node by node."""

    def __init__(self):
        low = np.array([0.0, 0.0, SIZE[2]])
        self.base = Block("BASE", "C3D8", np.zeros(3), SIZE, (3, 2, 1), 1)
        self.top = Block("TOP", "C3D8", low, low + SIZE, (3, 2, 1), 1001)
        self.areas = self.base.face_areas(SIZE[2])
        self.nodes = {node: node + 1000 - self.base_to_top() for node in self.areas}
        area_of_load = self.top.face_areas(2 * SIZE[2])
        self.load = {node: -PRESS * area for node, area in area_of_load.items()}

    def base_to_top(self):
        """The upper layer of the one has numbers that are this much above the lower one's."""
        return self.base.layer(SIZE[2])[0] - self.base.layer(0.0)[0]

    def bodies(self):
        held = ["*NSET,NSET=CLAMPED", *(f"{n}," for n in self.base.layer(0.0))]
        held += ["*BOUNDARY", "CLAMPED,1,3"]
        along_each = springs(self.top, 2 * SIZE[2])  # of three directions, z the last
        in_plane = along_each[: 2 * len(along_each) // 3]
        return [*self.base.cards(), *held], [*self.top.cards(), *in_plane]

    def whole(self):
        """Cards of both with springs between them along the normal."""
        base, top = self.bodies()
        cards = [*base, *top]
        for number, (below, above) in enumerate(self.nodes.items(), start=60_001):
            cards += [f"*ELEMENT,TYPE=SPRING2,ELSET=N{below}", f"{number},{below},{above}"]
            cards += [f"*SPRING,ELSET=N{below}", "3,3", f"{STIFFNESS * self.areas[below]:.9e}"]
        return cards


def normal_forces(folder, pair):
    """The forces of the pairs as CalculiX prints displacements, under load and friction."""
    forces = dict.fromkeys(pair.nodes, 0.0)
    for _ in range(8):  # friction moves the forces, and these the friction
        loads = [f"{node},3,{value:.9e}" for node, value in pair.load.items()]
        for below, above in pair.nodes.items():
            loads.append(f"{below},1,{-FRICTION * forces[below]:.9e}")
            loads.append(f"{above},1,{FRICTION * forces[below]:.9e}")
        printing = ["*NSET,NSET=EACH", *(f"{n}," for n in (*pair.nodes, *pair.nodes.values()))]
        step = ["*STEP", "*STATIC", "*CLOAD", *loads, "*NODE PRINT,NSET=EACH", "U", "*END STEP"]
        calculix(folder, "pressed", [*pair.whole(), *printing, *step])
        text = (folder / "pressed.dat").read_text()
        moved = {int(node): float(z) for node, _, _, z in NODE_LINE.findall(text)}
        for below, above in pair.nodes.items():
            approach = moved[below] - moved[above]
            forces[below] = STIFFNESS * pair.areas[below] * approach
    return forces


def damped_deck(pair, forces):
    """The whole with a dashpot at each pair, across the sliding; node 70,000 and more moves with
    the lower block and stands 1 m beside its partner, so that the dashpot acts along y."""
    cards = pair.whole()
    for below, above in pair.nodes.items():
        far = 70_000 + below
        x, y, z = pair.top.nodes[above]
        cards += ["*NODE", f"{far},{x:.9e},{y + 1.0:.9e},{z:.9e}"]
        cards += ["*BOUNDARY", f"{far},1", f"{far},3"]
        cards += ["*EQUATION", "2", f"{far},2,1.,{below},2,-1."]
        value = FRICTION * forces[below] / SPEED
        numbers = {"name": below, "number": 80_000 + below, "first": above, "second": far}
        cards += [line.format(value=value, **numbers) for line in DASHPOT]
    return cards


def joined(folder, pair):
    """The assembly of both decks."""
    for name, cards in zip(("base", "top"), pair.bodies(), strict=True):
        calculix(folder, name, [*cards, *STORE])
        (folder / f"{name}.yaml").write_text(
            f"M: {{file: {name}.mas, symmetric: true}}\nK: {{file: {name}.sti, symmetric: true}}\n"
            f"coordinates: {{file: {name}.inp}}\n"
        )
    rows = [f"{below},{above},{pair.areas[below]:.15g}" for below, above in pair.nodes.items()]
    (folder / "pairs.csv").write_text("\n".join(["first,second,area", *rows]))
    loads = [f"{node},z,{value:.15g}" for node, value in pair.load.items()]
    (folder / "load.csv").write_text("\n".join(["node,dof,force", *loads]))
    (folder / "both.yaml").write_text(
        f"parameters: {{mu: {FRICTION}}}\n"
        "components:\n  base: {file: base.yaml}\n"
        "  top: {file: top.yaml, load: {file: load.csv}}\n"
        "contact:\n  - between: [base, top]\n    pairs: {file: pairs.csv}\n"
        f"    normal: [0, 0, 1]\n    sliding: [1, 0, 0]\n    speed: {SPEED}\n"
        f"    stiffness: {STIFFNESS:g}\n"
    )
    return squeal.read_system(folder / "both.yaml").assembly


def responses(folder, pair, cards):
    """By frequency (Hz) the displacements (nodes, 3) of the upper block under a force across the
    sliding."""
    corner = max(pair.top.nodes)
    modes = ["*STEP", "*FREQUENCY,STORAGE=YES", f"{MODES}", "*END STEP"]
    step = ["*STEP", "*STEADY STATE DYNAMICS", "1000.,20000.,4", "*CLOAD", f"{corner},2,1."]
    step += ["*NODE PRINT,NSET=SEEN", "U", "*END STEP"]
    seen = ["*NSET,NSET=SEEN", *(f"{node}," for node in pair.top.nodes)]
    calculix(folder, "shaken", [*cards, *seen, *modes, *step])
    text = (folder / "shaken.dat").read_text()
    found = {}
    for part in text.split("F O R   F R E Q U E N C Y")[1:]:
        real, imaginary = part.split("for set SEEN")[1:3]
        sides = [
            np.array([[float(value) for value in values] for _, *values in NODE_LINE.findall(side)])
            for side in (real, imaginary)
        ]
        found[float(part.split()[0])] = sides[0] + 1j * sides[1]
    return found


def test_harmonic_motion_is_that_of_calculix_with_dashpots_of_friction(tmp_path):
    """C is checked alone: the stiffness of friction, which CalculiX has not, is left out of K."""
    pair = Pair()
    forces = normal_forces(tmp_path, pair)
    assembly = joined(tmp_path, pair)
    seat = assembly.seats[0]
    assert seat.forces == pytest.approx(list(forces.values()), rel=1e-5)
    shaken = responses(tmp_path, pair, damped_deck(pair, forces))
    assert len(shaken) > MODES
    system = assembly.system
    M, C, _ = system.arrays()
    K = system.arrays({"mu": 0.0})[2]
    _, modes = scipy.linalg.eigh(K, M, subset_by_index=(0, MODES - 1))
    rows = {}
    start = assembly.components[0].system.n
    top = assembly.components[1]
    for row, (node, direction) in enumerate(zip(top.nodes, top.directions, strict=True), start):
        rows[int(node), int(direction)] = row
    force = np.zeros(system.n)
    force[rows[max(pair.top.nodes), 1]] = 1.0
    where = [[rows[node, direction] for direction in range(3)] for node in pair.top.nodes]
    largest = 0.0
    for frequency, wanted in shaken.items():
        s = 2j * np.pi * frequency
        dynamic = modes.T @ (s**2 * M + s * C + K) @ modes
        moved = (modes @ np.linalg.solve(dynamic, modes.T @ force))[np.array(where)]
        assert moved == pytest.approx(wanted, abs=5e-6 * np.abs(wanted).max())
        undamped = modes.T @ (s**2 * M + K) @ modes
        without = (modes @ np.linalg.solve(undamped, modes.T @ force))[np.array(where)]
        largest = max(largest, np.abs(without - wanted).max() / np.abs(wanted).max())
    assert largest > 1.0


def test_complex_frequencies_of_calculix_know_no_dashpot(tmp_path):
    """Neither with Coriolis forces; without them it refuses the step."""
    pair = Pair()
    cards = damped_deck(pair, dict.fromkeys(pair.nodes, 100.0))
    modes = ["*STEP", "*FREQUENCY,STORAGE=YES", f"{MODES}", "*END STEP"]
    turning = ["*DLOAD", "TOP,CENTRIF,1.e-6,0.,0.,0.,0.,0.,1."]
    coriolis = ["*STEP", "*COMPLEX FREQUENCY,CORIOLIS", f"{MODES}", *turning, "*END STEP"]
    calculix(tmp_path, "coriolis", [*cards, *modes, *coriolis])
    tables = (tmp_path / "coriolis.dat").read_text().split("E I G E N V A L U E   O U T P U T")
    lines = NODE_LINE.findall(tables[-1].split("P A R T")[0])
    assert len(lines) == MODES
    frequencies = np.array([float(line[1]) for line in lines])  # rad/s
    growth = np.array([float(line[3]) for line in lines])
    assert np.abs(growth / frequencies).max() < 1e-6
    plain = ["*STEP", "*COMPLEX FREQUENCY", f"{MODES}", "*END STEP"]
    (tmp_path / "plain.inp").write_text("\n".join([*cards, *modes, *plain]))
    run = subprocess.run(["ccx", "plain"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode != 0
    assert "parameter FLUTTER is required" in run.stdout


@pytest.mark.parametrize("speed", [0.05, 3.0])
def test_all_dampers_together_are_friction_times_the_load_over_the_speed(tmp_path, speed):
    """Equilibrium says that all normal forces are the load."""
    pair = Pair()
    joined(tmp_path, pair)
    text = (tmp_path / "both.yaml").read_text().replace(f"speed: {SPEED}", f"speed: {speed}")
    (tmp_path / "both.yaml").write_text(text)
    assembly = squeal.read_system(tmp_path / "both.yaml").assembly
    C = assembly.system.arrays()[1]
    start = assembly.components[0].system.n
    across = np.zeros(assembly.system.n)
    along = np.zeros(assembly.system.n)
    across[start:] = assembly.components[1].directions == 1
    along[start:] = assembly.components[1].directions == 0
    load = PRESS * SIZE[0] * SIZE[1]
    assert across @ C @ across == pytest.approx(FRICTION * load / speed, rel=1e-9)
    assert along @ C @ along == pytest.approx(0.0, abs=1e-12 * load)
