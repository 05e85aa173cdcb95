"""`python -m workflow.trials.real_files [--page docs/files.md]`: files as real programs write them.

CalculiX (`ccx`) writes the matrices of small structures of each of its element types, and prints
their frequencies for the same decks; GNU Octave, FreeFEM and GetFEM run a script that writes the
matrices and prints the frequencies that they find themselves. The package pyyeti brings OP4 files
that MSC and NX Nastran have written with the eigenvalues that these found, and
ansys-mapdl-reader a .full of Ansys whose frequencies its documentation prints. Each file is read as
the program wrote it, and the frequencies of squeal are compared with those of the program. One line
a file; 1 if one differs by more than `CLOSE` and by more than squeal says that the file's digits
leave open, is refused, or may grow as squeal says. What is not installed is named and left out.
With `--page` the table of that page is written anew, where all programs are installed.
"""

from __future__ import annotations

import argparse
import gzip
import itertools
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import squeal
from squeal.errors import InputError, InputWarning

CLOSE = 2e-6  # relative difference of frequencies: CalculiX prints seven digits
MODES = 6
NASTRAN = (
    ("nas2cam_csuper/nas2cam.op4", "MSC, superelements"),
    ("nas2cam_extseout/nas2cam.op4", "MSC, external superelements"),
    ("nas2cam_extseout/nas2cam_notall6_msc2017.op4", "MSC 2017"),
    ("nas2cam_extseout/nas2cam_notall6_msc2017_b.op4", "MSC 2017, other boundary"),
    ("nas2cam_extseout/nas2cam_notall6_nx2021.op4", "NX 2021"),
)
FREE = 1e-3  # of the lowest elastic frequency: slower modes of a free structure are rounding
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Compared:
    """A file that was read: the program and what it holds, rows, and the worst relative difference
    of a frequency, None if it was refused; words: the verdict, or why it was refused; known: what
    squeal says that the digits of the file leave open of that frequency, relative."""

    program: str
    holds: str
    rows: int
    worst: float | None
    words: str = ""
    known: float = 0.0

    @property
    def good(self) -> bool:
        quiet = self.words in ("marginal", "none grows")  # without damping and friction
        return quiet and self.worst is not None and self.worst <= max(CLOSE, self.known)


class Mesh:
    """Nodes of a regular grid, made as they are asked for, and elements over them."""

    def __init__(self, cells: tuple[int, int, int], size: Place) -> None:
        self.cells = cells
        self.size = size
        self.nodes: dict[Place, int] = {}
        self.elements: list[list[int]] = []

    def node(self, i: float, j: float, k: float) -> int:
        """The number of the node at a place counted in cells."""
        return self.nodes.setdefault((i, j, k), len(self.nodes) + 1)

    def places(self) -> Iterator[tuple[int, Place]]:
        """The number of each node, and where it is."""

        def place(at: Place, axis: int) -> float:
            return at[axis] * self.size[axis] / max(self.cells[axis], 1)

        for at, number in self.nodes.items():
            yield number, (place(at, 0), place(at, 1), place(at, 2))

    def boxes(self) -> Iterator[tuple[int, int, int]]:
        """The place of each cell."""
        columns, rows, layers = self.cells
        return itertools.product(range(max(columns, 1)), range(max(rows, 1)), range(max(layers, 1)))


CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0)),
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
TETRAHEDRA = ((0, 1, 3, 7), (0, 1, 7, 5), (0, 5, 7, 4), (1, 2, 3, 7), (1, 2, 7, 6), (1, 6, 7, 5))
TETRAHEDRON_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
WEDGES = ((0, 1, 3, 4, 5, 7), (1, 2, 3, 5, 6, 7))
QUAD_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))


def _middle(a: Sequence[float], b: Sequence[float]) -> Place:
    return (a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2


def _element(
    mesh: Mesh, corners: Sequence[Sequence[float]], edges: Sequence[tuple[int, int]] = ()
) -> None:
    """An element over its corners, and the middles of its edges."""
    middles = [_middle(corners[a], corners[b]) for a, b in edges]
    mesh.elements.append([mesh.node(*place) for place in (*corners, *middles)])


def solids(kind: str) -> Mesh:
    """A clamped block of solids."""
    mesh = Mesh((6, 2, 2), (0.1, 0.02, 0.015))
    for i, j, k in mesh.boxes():
        corners = [(i + a, j + b, k + c) for a, b, c in CORNERS]
        if kind in ("C3D4", "C3D10"):
            edges = TETRAHEDRON_EDGES if kind == "C3D10" else ()
            for four in TETRAHEDRA:
                _element(mesh, [corners[n] for n in four], edges)
        elif kind == "C3D6":
            for six in WEDGES:
                _element(mesh, [corners[n] for n in six])
        else:
            _element(mesh, corners, EDGES if kind.startswith("C3D20") else ())
    return mesh


def shells(kind: str) -> Mesh:
    """A clamped plate."""
    mesh = Mesh((6, 3, 0), (0.12, 0.05, 0.0))
    for i, j, _ in mesh.boxes():
        corners = [(i + a, j + b, 0) for a, b, c in CORNERS[:4]]
        if kind.startswith("S3"):
            _element(mesh, [corners[n] for n in (0, 1, 2)])
            _element(mesh, [corners[n] for n in (0, 2, 3)])
        else:
            _element(mesh, corners, QUAD_EDGES if kind.startswith("S8") else ())
    return mesh


def beams(kind: str) -> Mesh:
    """A clamped beam."""
    mesh = Mesh((10, 0, 0), (1.0, 0.0, 0.0))
    for i in range(10):
        places: list[Place] = [(i, 0, 0), (i + 1, 0, 0)]
        if kind.startswith("B32"):
            places.insert(1, (i + 0.5, 0, 0))
        _element(mesh, places)
    return mesh


SECTIONS = {
    "C": "*SOLID SECTION,ELSET=E,MATERIAL=S\n",
    "S": "*SHELL SECTION,ELSET=E,MATERIAL=S\n0.004\n",
    "B": "*BEAM SECTION,ELSET=E,MATERIAL=S,SECTION=RECT\n0.02,0.03\n0.,1.,0.\n",
}
MESHES: dict[str, Callable[[str], Mesh]] = {"C": solids, "S": shells, "B": beams}


def deck(kind: str, extra: str = "", before: str = "") -> str:
    """A deck of an element type, clamped at x = 0, up to the step that finds the frequencies.

    extra: cards of the model; before: steps before that one.
    """
    mesh = MESHES[kind[0]](kind)
    lines = ["*NODE,NSET=NALL"]
    lines += [f"{number},{x:.9g},{y:.9g},{z:.9g}" for number, (x, y, z) in mesh.places()]
    lines.append(f"*ELEMENT,TYPE={kind},ELSET=E")
    for number, nodes in enumerate(mesh.elements, start=1):
        # a line of a deck has 16 entries at most
        words = ",".join(map(str, (number, *nodes[:15])))
        rest = ",".join(map(str, nodes[15:]))
        lines.append(f"{words},\n{rest}" if rest else words)
    clamped = [number for number, (x, _, _) in mesh.places() if x == 0.0]
    last_dof = 3 if kind[0] == "C" else 6  # solids have no rotations
    tip = max(mesh.places(), key=lambda one: one[1])[0]
    lines += ["*NSET,NSET=CLAMPED", *(f"{number}," for number in clamped)]
    lines += ["*NSET,NSET=TIP", f"{tip},"]
    lines += ["*BOUNDARY", f"CLAMPED,1,{last_dof}"]
    lines += ["*MATERIAL,NAME=S", "*ELASTIC", "210.e9,.3", "*DENSITY", "7800."]
    return "\n".join(lines) + f"\n{SECTIONS[kind[0]]}{extra}{before}"


def step(storage: bool, perturbed: bool = False) -> str:
    """The step that finds frequencies, or writes the matrices."""
    how = ",SOLVER=MATRIXSTORAGE" if storage else ""
    about = ",PERTURBATION" if perturbed else ""
    return f"*STEP{about}\n*FREQUENCY{how}\n{MODES}\n*END STEP\n"


SPRING = """*ELEMENT,TYPE=SPRING1,ELSET=HELD
9001,{tip}
*SPRING,ELSET=HELD
2
1.e5
*ELEMENT,TYPE=MASS,ELSET=HEAVY
9002,{tip}
*MASS,ELSET=HEAVY
0.05
"""
PULLED = "*STEP,NLGEOM\n*STATIC\n*CLOAD\nTIP,1,2.e4\n*END STEP\n"
SPUN = "*STEP,NLGEOM\n*STATIC\n*DLOAD\nE,CENTRIF,1.e5,0.,0.,0.,0.,0.,1.\n*END STEP\n"


def decks() -> Iterator[tuple[str, str, bool]]:
    """What each deck holds, its text up to the last step, and whether that one is about a load."""
    for kind in (
        *("C3D4", "C3D6", "C3D8", "C3D8I", "C3D8R", "C3D10", "C3D20", "C3D20R"),
        *("S3", "S4", "S4R", "S8", "S8R"),
        *("B31", "B31R", "B32", "B32R"),
    ):
        yield kind, deck(kind), False
    tip = len(list(solids("C3D8").places()))
    yield "C3D8, spring and mass", deck("C3D8", SPRING.format(tip=tip)), False
    yield "C3D20R, pulled", deck("C3D20R", before=PULLED), True
    yield "C3D8I, spun", deck("C3D8I", before=SPUN), True
    yield "S8R, spun", deck("S8R", before=SPUN), True


def run_ccx(folder: Path, name: str, text: str) -> None:
    """Run a deck in a folder. Raises CalledProcessError."""
    (folder / f"{name}.inp").write_text(text, encoding="utf-8")
    subprocess.run(["ccx", name], cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=300)


def printed(folder: Path, name: str) -> np.ndarray:
    """The frequencies (k,) in Hz that CalculiX prints."""
    text = (folder / f"{name}.dat").read_text(encoding="utf-8")
    table = text.split("E I G E N V A L U E   O U T P U T")[1]
    rows = re.findall(r"^ +\d+ +(\S+) +(\S+) +(\S+) +(\S+) *$", table, re.MULTILINE)
    return np.array([float(row[2]) for row in rows])


FILES = (("M", "mas"), ("K", "sti"))  # how CalculiX names them
EXAMPLES = Path("/usr/share/doc/calculix-ccx-test/examples/test")  # of Debian's package
AUTHORS_DECKS = (
    ("beampsensfreq", "C3D20R, author's"),
    ("beamptied7", "C3D8, tied, author's"),
    ("boxprofile", "B32R, box, author's"),
    ("simplebeampipe3", "B32R, pipe, author's"),
    ("uprofile", "B32R, U, author's"),
    ("spring4", "SPRINGA, author's"),
    ("dashpot1", "DASHPOTA, author's"),
    ("contact5", "C3D20R, contact, author's"),
    ("dloadlinIf", "C3D8I, slender, author's"),
)


def calculix(folder: Path) -> Iterator[Compared]:
    """Each deck, written by CalculiX and read."""
    for number, (holds, text, perturbed) in enumerate(decks(), start=1):
        name = f"deck{number}"
        run_ccx(folder, name, text + step(storage=False, perturbed=perturbed))
        wanted = printed(folder, name)
        run_ccx(folder, f"{name}m", text + step(storage=True, perturbed=perturbed))
        yield _of_calculix(folder, name, holds, wanted)


def _of_calculix(folder: Path, name: str, holds: str, wanted: np.ndarray) -> Compared:
    """The matrices of a deck, `name` and m, beside the frequencies that CalculiX printed."""
    system = folder / f"{name}.yaml"
    parts = (f"{part}: {{file: {name}m.{end}, symmetric: true}}\n" for part, end in FILES)
    system.write_text("".join(parts), encoding="utf-8")
    return _compared("CalculiX", holds, system, wanted)


def authors_decks(folder: Path) -> Iterator[Compared]:
    """Decks that the author of CalculiX tests it with, up to their first step of frequencies."""
    for name, holds in AUTHORS_DECKS:
        packed = EXAMPLES / f"{name}.inp.gz"
        if packed.exists():
            text = gzip.decompress(packed.read_bytes()).decode("latin-1")
        else:
            text = packed.with_suffix("").read_text(encoding="latin-1")
        before, card, behind = re.split(r"(?im)^(\*FREQUENCY)", text, maxsplit=1)
        rest = re.split(r"(?im)^\*END STEP", behind, maxsplit=1)[0]
        run_ccx(folder, name, f"{before}{card}{rest}*END STEP\n")
        wanted = printed(folder, name)
        run_ccx(folder, f"{name}m", f"{before}{card},SOLVER=MATRIXSTORAGE\n1\n*END STEP\n")
        yield _of_calculix(folder, name, holds, wanted)


def nastran(folder: Path) -> Iterator[Compared]:
    """Each OP4 file of Nastran that pyyeti brings."""
    with np.printoptions():  # it takes digits from all that NumPy prints
        from pyyeti.nastran import op4

    spec = find_spec("pyyeti")
    if spec is None or spec.submodule_search_locations is None:
        return
    shipped = Path(spec.submodule_search_locations[0]) / "tests"
    for name, holds in NASTRAN:
        squares = np.asarray(op4.read(str(shipped / name), into="dct")["lambda"]).ravel()
        wanted = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
        # without the rigid motions, some 1e-4 Hz by rounding
        wanted = wanted[wanted > FREE * np.min(wanted[wanted > 1e-2])]
        system = folder / "nastran.yaml"
        names, *_ = op4.read(str(shipped / name), into="list")
        count = names.count("kaa")  # superelements come first, and then what they are joined to
        last = f"AA({count})" if count > 1 else "AA"
        files = (f"{part}: {{file: {shipped / name}, key: {part}{last}}}\n" for part in "MK")
        system.write_text("".join(files), encoding="utf-8")
        yield _compared("Nastran", holds, system, wanted)


OCTAVE = """n = 40;
e = ones (n, 1);
K = 1e6 * spdiags ([-e, 2*e, -e], -1:1, n, n);
K(n, n) = 1e6;
M = spdiags ([e, 4*e, e] / 6, -1:1, n, n);
M(n, n) = 2 / 6;
model.mass = M;
model.stiffness = K;
mass = full (M);
stiffness = full (K);
save ("-v7", "compressed.mat", "M", "K");
save ("-v6", "plain.mat", "M", "K");
save ("-v7", "struct.mat", "model");
save ("-v7", "full.mat", "mass", "stiffness");
printf ("%.12g\\n", sqrt (sort (eigs (K, M, 6, "sm"))) / (2 * pi));
"""
OCTAVE_FILES = (
    ("compressed.mat", "sparse, -v7", "M", "K"),
    ("plain.mat", "sparse, -v6", "M", "K"),
    ("struct.mat", "struct, -v7", "model.mass", "model.stiffness"),
    ("full.mat", "full, -v7", "mass", "stiffness"),
)
FREEFEM = """mesh Th = square({cells}, 3, [0.2*x, 0.03*y]);
fespace Vh(Th, [{element}, {element}]);
Vh [u, v], [p, q];
real E = 210e9, nu = 0.3, rho = 7800;
real mu = E/(2*(1 + nu)), lambda = E*nu/((1 + nu)*(1 - 2*nu));
varf stiffness([u, v], [p, q]) = int2d(Th)(lambda*(dx(u) + dy(v))*(dx(p) + dy(q))
  + 2*mu*(dx(u)*dx(p) + dy(v)*dy(q)) + mu*(dy(u) + dx(v))*(dy(p) + dx(q))) + on(4, u=0, v=0);
varf mass([u, v], [p, q]) = int2d(Th)(rho*(u*p + v*q)) + on(4, u=0, v=0);
matrix K = stiffness(Vh, Vh, tgv=-2);
matrix M = mass(Vh, Vh, tgv=-20);
real[int] values(6);
int found = EigenValue(K, M, sym=true, sigma=0, value=values, tol=1e-13);
cout.precision(12);
for (int i = 0; i < min(found, 6); i++) cout << "HERTZ " << sqrt(values[i])/(2*pi) << endl;
func int write(matrix & A, string name) {{
  int[int] I(1), J(1);
  real[int] C(1);
  [I, J, C] = A;
  ofstream f(name);
  f.precision(17);
  f << "%%MatrixMarket matrix coordinate real general" << endl;
  f << A.n << " " << A.m << " " << C.n << endl;
  for (int i = 0; i < C.n; i++) f << I[i] + 1 << " " << J[i] + 1 << " " << C[i] << endl;
  return 0;
}}
write(K, "K.mtx");
write(M, "M.mtx");
"""
FREEFEM_ELEMENTS = (("P1 triangles", 20), ("P2 triangles", 9))
GETFEM = """import numpy as np, getfem as gf
mesh = gf.Mesh("cartesian", np.linspace(0.0, 0.2, 13), np.linspace(0.0, 0.03, 4))
places, data = gf.MeshFem(mesh, 2), gf.MeshFem(mesh)
places.set_fem(gf.Fem("FEM_QK(2, 2)"))
data.set_fem(gf.Fem("FEM_QK(2, 0)"))
gauss = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2, 6)"))
each = np.ones(data.nbdof())
K = gf.asm_linear_elasticity(gauss, places, data, 1.2e11 * each, 0.8e11 * each)
M = gf.asm_mass_matrix(gauss, places)
M.scale(7800.0)
moving = np.flatnonzero(places.basic_dof_nodes()[0] > 1e-9)
for name, matrix in (("K", K), ("M", M)):
    part = gf.Spmat("copy", matrix, moving, moving)
    part.save("hb", name + ".hb")
    part.save("mm", name + ".mtx")
    globals()[name] = part.full()
squares = np.linalg.eigvals(np.linalg.solve(M, K)).real
for square in np.sort(squares)[:6]:
    print("HERTZ %.12g" % (np.sqrt(square) / (2.0 * np.pi)))
"""
GETFEM_FILES = (("hb", "Harwell-Boeing"), ("mtx", "Matrix Market"))
ANSYS_HOLDS = "SOLID186, .full"
ANSYS = (1283.200, 1283.200, 5781.975, 6919.399)  # Hz, as the reader's documentation prints them


def hertz(command: Sequence[str], folder: Path, script: str, name: str) -> np.ndarray:
    """The frequencies (k,) in Hz that a script prints, the last word of each line with a number.

    Raises CalledProcessError.
    """
    (folder / name).write_text(script, encoding="utf-8")
    done = subprocess.run(
        [*command, name], cwd=folder, check=True, capture_output=True, text=True, timeout=300
    )
    lines = re.findall(r"^(?:HERTZ )?([\d.e+]+)$", done.stdout, re.MULTILINE)
    return np.array([float(line) for line in lines])


def octave(folder: Path) -> Iterator[Compared]:
    """Files of GNU Octave in MATLAB's formats."""
    wanted = hertz(["octave-cli", "--norc"], folder, OCTAVE, "chain.m")
    for name, holds, mass, stiffness in OCTAVE_FILES:
        system = folder / "octave.yaml"
        lines = (f"M: {{file: {name}, key: {mass}}}", f"K: {{file: {name}, key: {stiffness}}}")
        system.write_text("\n".join(lines), encoding="utf-8")
        yield _compared("Octave", holds, system, wanted)


def freefem(folder: Path) -> Iterator[Compared]:
    """A clamped plate of FreeFEM, of linear and of quadratic triangles."""
    for element, cells in FREEFEM_ELEMENTS:
        script = FREEFEM.format(element=element.split()[0], cells=cells)
        wanted = hertz(["FreeFem++", "-nw", "-v", "0"], folder, script, "plate.edp")
        system = folder / "freefem.yaml"
        system.write_text("M: {file: M.mtx}\nK: {file: K.mtx}\n", encoding="utf-8")
        yield _compared("FreeFEM", element, system, wanted)


GETFEM_PYTHON = "/usr/bin/python3"  # which Debian's package installs it for


def has_getfem() -> bool:
    """Whether the system's Python has GetFEM."""
    asked = [GETFEM_PYTHON, "-c", "import getfem"]
    return (
        Path(GETFEM_PYTHON).exists() and not subprocess.run(asked, capture_output=True).returncode
    )


def getfem(folder: Path) -> Iterator[Compared]:
    """A clamped plate of GetFEM, in both formats that it writes."""
    wanted = hertz([GETFEM_PYTHON], folder, GETFEM, "plate.py")
    for suffix, holds in GETFEM_FILES:
        system = folder / "getfem.yaml"
        lines = (f"M: {{file: M.{suffix}}}", f"K: {{file: K.{suffix}}}")
        system.write_text("\n".join(lines), encoding="utf-8")
        yield _compared("GetFEM", holds, system, wanted)


def ansys(folder: Path) -> Iterator[Compared]:
    """The .full that ansys-mapdl-reader brings."""
    spec = find_spec("ansys.mapdl.reader")
    if spec is None or spec.origin is None:
        return
    full = Path(spec.origin).parent / "examples" / "file.full"
    system = folder / "ansys.yaml"
    files = (f"{part}: {{file: {full}, key: {part}}}\n" for part in "MK")
    system.write_text("".join(files), encoding="utf-8")
    yield _compared("Ansys", ANSYS_HOLDS, system, np.array(ANSYS))


@dataclass(frozen=True)
class Source:
    """A program, whether it is there, the files that it gives, and what each of them holds."""

    program: str
    is_there: Callable[[], bool]
    files: Callable[[Path], Iterator[Compared]]
    holds: tuple[str, ...]


def _has_package(name: str) -> Callable[[], bool]:
    def is_there() -> bool:
        try:
            return find_spec(name) is not None
        except ModuleNotFoundError:  # of a folder above it
            return False

    return is_there


def _has_command(name: str) -> Callable[[], bool]:
    return lambda: shutil.which(name) is not None


SOURCES = (
    Source("CalculiX (ccx)", _has_command("ccx"), calculix, tuple(deck[0] for deck in decks())),
    Source(
        "CalculiX's tests (calculix-ccx-test)",
        EXAMPLES.exists,
        authors_decks,
        tuple(holds for _, holds in AUTHORS_DECKS),
    ),
    Source(
        "GNU Octave (octave-cli)",
        _has_command("octave-cli"),
        octave,
        tuple(file[1] for file in OCTAVE_FILES),
    ),
    Source(
        "FreeFEM (FreeFem++)",
        _has_command("FreeFem++"),
        freefem,
        tuple(element for element, _ in FREEFEM_ELEMENTS),
    ),
    Source(
        "GetFEM (python3-getfem)",
        has_getfem,
        getfem,
        tuple(holds for _, holds in GETFEM_FILES),
    ),
    Source(
        "Nastran's files (pyyeti)",
        _has_package("pyyeti"),
        nastran,
        tuple(holds for _, holds in NASTRAN),
    ),
    Source(
        "Ansys's file (ansys-mapdl-reader)",
        _has_package("ansys.mapdl.reader"),
        ansys,
        (ANSYS_HOLDS,),
    ),
)


def _compared(program: str, holds: str, system: Path, wanted: np.ndarray) -> Compared:
    """A system file of a program, compared with the frequencies (k,) in Hz that the program found.

    Each frequency is compared with that of the nearest root of squeal.
    """
    with warnings.catch_warnings():  # of labels that repeat, and of triangles that are mirrored
        warnings.simplefilter("ignore", InputWarning)
        try:
            read = squeal.read_system(str(system))
            answer = squeal.eigenvalues(read)
        except InputError as error:
            return Compared(program, holds, 0, None, str(error))
    worst = 0.0
    known = 0.0
    for frequency in wanted:
        root = min(answer.eigenvalues, key=lambda one: abs(one.value.imag / 2 / np.pi - frequency))
        difference = abs(root.value.imag / (2.0 * np.pi * frequency) - 1.0)
        if difference >= worst:
            worst = difference
            known = (root.error or 0.0) / (2.0 * np.pi * frequency)
    words = str(answer.verdict)
    grows = max((root.value.real for root in answer.eigenvalues), default=0.0)
    is_free = program == "Nastran"  # these structures have rigid motions, which rounding lets grow
    if answer.verdict is None and is_free and grows < FREE * 2.0 * np.pi * wanted.min():
        words = "marginal"
    elif answer.verdict is None and not answer.unstable:
        words = "none grows"  # of the lowest modes of a larger system: the others are not known
    return Compared(program, holds, read.system.n, worst, words, known)


FORMATS = {  # of the files of each program
    "CalculiX": "`.sti`, `.mas`, `.dof`",
    "Octave": "`.mat`",
    "FreeFEM": "Matrix Market",
    "GetFEM": "Harwell-Boeing, Matrix Market",
    "Nastran": "OP4",
    "Ansys": "`.full`",
}
BEGIN = "<!-- written by python -m workflow.trials.real_files --page docs/files.md -->"
END = "<!-- end of what is written -->"


def table(found: Sequence[Compared]) -> str:
    """A line of Markdown for each program: what it wrote, most rows, largest difference."""
    head = ("program", "files", "what it wrote", "rows, up to", "largest difference")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    of_programs: dict[str, list[Compared]] = defaultdict(list)
    for one in found:
        of_programs[one.program].append(one)
    for program, files in of_programs.items():
        rows = max(one.rows for one in files)
        holds = "; ".join(one.holds for one in files)
        worst = max(one.worst or 0.0 for one in files if (one.worst or 0.0) <= CLOSE)
        words = f"{worst:.0e}"
        for one in files:
            if one.worst and one.worst > CLOSE:
                words += f"; {one.holds}: {one.worst:.0e}, of {one.known:.0e} that its digits leave"
        lines.append(f"| {program} | {FORMATS[program]} | {holds} | {rows} | {words} |")
    return "\n".join(lines)


def write_page(page: Path, found: Sequence[Compared]) -> None:
    """Write the table of a page anew."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    behind = rest.split(END)[1]
    text = f"{before}{BEGIN}\n{table(found)}\n{END}{behind}"
    page.write_text(text, encoding="utf-8")


def main() -> int:
    """Compare all; one line per file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path, help="a page whose table is written anew")
    page = parser.parse_args().page
    found: list[Compared] = []
    missing = [source.program for source in SOURCES if not source.is_there()]
    for program in missing:
        print(f"left out, since it is not installed: {program}")
    with tempfile.TemporaryDirectory() as made:
        for source in SOURCES:
            if source.program in missing:
                continue
            for one in source.files(Path(made)):
                found.append(one)
                worst = "-" if one.worst is None else f"{one.worst:.1e}"
                line = f"{one.program:12} {one.holds:28} {one.rows:6} {worst:>8} {one.words}"
                print(line, flush=True)
    bad = sum(not one.good for one in found)
    print(f"{len(found)} files, {bad} not as the program says")
    if page is not None and not bad and not missing:
        write_page(page, found)
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
