"""The files of each example, as `squeal example NAME` writes them."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from squeal.errors import InputError
from squeal.io.writing import whole_folder

HERE = Path(__file__).parent
ARTICLE = HERE.parent / "article"
FORMS = ("abaqus", "nastran", "ansys", "calculix", "matlab", "npz")
SAMPLES = """\
samples: 64
design: sobol
indices: true
spreads:
  mu: {between: [0.2, 0.5]}
  k1: {relative: 0.05}
"""
RANGES = """\
samples: 64
spreads: {mu: {between: [0.2, 0.5]}, contact: {relative: 0.1}}
"""
TEST = """\
name,frequency_hz,damping_ratio
bending 3,3562,0.001
bending 4,4885,
bending 5,6710,0.002
lining,9000,
"""
LINING = """\
frequency,storage,loss
500,0.90,0.12
2000,1.00,0.10
8000,1.20,0.08
"""
SHIM = {
    "dK.mtx": 1.0e6,
    "dM.mtx": 1.0e-3,
}  # N/m and kg of stiffness and of mass that it adds to each node
SHIM_NODES = (721, 724, 727)  # on the pad's face
DAMPED = {  # system files of the damped brake: what follows the factor of the contact
    "damped": "  structural: 0.1\n",
    "lining": "  modulus: {file: lining.csv}\n",
}
ROTOR = """\
name: rotor
parameters:
  speed: 0.0   # rad/s
  cross: 0.4   # share of the bearings' cross-coupled stiffness
parameter: speed
M: {file: M.mtx}
C: [{file: C.mtx}, {file: G.mtx, factor: speed}]
K: [{file: K.mtx}, {file: cross.mtx, factor: cross}]
coordinates: {file: nodes.csv}
"""
NODE_DISTANCE = 0.25  # m, of neighbouring nodes of the rotor, along z


ABOUT = {  # what files are for whose names do not say it
    "brake/system.yaml": "the system file: names the matrices, friction and contact",
    "brake/damped.yaml": "the same with structural damping",
    "brake/lining.yaml": "the same with a lining whose modulus depends on frequency",
    "brake/lining.csv": "that modulus",
    "brake/assembly.yaml": "joins disc and pad by a contact",
    "rotor/rotor.yaml": "the system file",
    "dK.mtx": "stiffness that a shim adds, for `squeal eigenvalues --change`",
    "dM.mtx": "mass that a shim adds",
    "ranges.yaml": "ranges of parameters, for `squeal scatter`",
    "samples.yaml": "ranges of parameters, for `squeal scatter --of growth`",
    "test.csv": "measured frequencies, for `squeal eigenvalues --test`",
}


@dataclass(frozen=True)
class Size:
    """Of a brake of solids: at least so many degrees of freedom, and whose program's files."""

    rows: int = 500
    form: str = "abaqus"


@dataclass(frozen=True)
class Example:
    """What it is in words, how it is written into a folder, and the query to begin with."""

    about: str
    write: Callable[[Path, Size], None]
    first: str


def write_pad(folder: Path, _: Size) -> None:
    """The pad of the README and ranges of its parameters."""
    shutil.copyfile(HERE / "pad.yaml", folder / "pad.yaml")
    (folder / "samples.yaml").write_text(SAMPLES, encoding="utf-8")


def write_brake(folder: Path, size: Size) -> None:
    """Write matrices of a brake of solids in the form of a program, and a system file.

    The default size also gets two damped variants, measured frequencies of a test, ranges of
    parameters, and the matrices that a shim adds.
    """
    from squeal.examples.brake import solid_brake
    from squeal.examples.brake import write_brake as write_matrices

    home = folder / "brake"
    write_matrices(home, solid_brake(size.rows), size.form)
    if size != Size():
        return  # lining, test, shim and ranges go with nodes and frequencies of the default brake
    (home / "lining.csv").write_text(LINING, encoding="utf-8")
    system = (home / "system.yaml").read_text(encoding="utf-8")
    for name, contact_damping in DAMPED.items():
        # below the factor of the contact stiffness, then for the whole brake
        text = system.replace("  factor: contact\n", "  factor: contact\n" + contact_damping)
        text += "damping: {structural: 0.002}\n"
        (home / f"{name}.yaml").write_text(text, encoding="utf-8")
    for name, entry in SHIM.items():  # on the diagonal, in direction 3 of each node
        lines = (f"{node},3, {node},3, {entry}\n" for node in SHIM_NODES)
        (folder / name).write_text("".join(lines), encoding="utf-8")
    (folder / "test.csv").write_text(TEST, encoding="utf-8")
    (folder / "ranges.yaml").write_text(RANGES, encoding="utf-8")


def write_components(folder: Path, size: Size) -> None:
    """Disc and pad of the brake by themselves, and the file that joins them by a contact."""
    from squeal.examples.brake import solid_brake, write_parts

    write_parts(folder / "brake", solid_brake(size.rows))


def write_rotor(folder: Path, _: Size) -> None:
    """A rotor on two bearings, computed by ROSS; the skew part of K becomes a matrix of its own."""
    from scipy.io import mmwrite
    from scipy.sparse import coo_array

    # rows: their number; matrices: of M, C, G and K the entries (row, column, value)
    data = json.loads((HERE / "rotor.json").read_text(encoding="utf-8"))
    shape = (data["rows"], data["rows"])
    matrices = {}
    for name, entries in data["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        matrices[name] = coo_array((values, (rows, columns)), shape=shape)
    # cross-coupled stiffness of the bearings (x on y, y on x with the other sign): the skew part
    matrices["cross"] = (matrices["K"] - matrices["K"].T) / 2
    matrices["K"] = matrices["K"] - matrices["cross"]
    home = folder / "rotor"
    home.mkdir()
    for name, matrix in matrices.items():
        mmwrite(home / f"{name}.mtx", matrix)
    (home / "rotor.yaml").write_text(ROTOR, encoding="utf-8")
    directions = ("x", "y", "z", "rx", "ry", "rz")
    lines = ["node,dof,x,y,z"]
    for row in range(data["rows"]):  # node by node
        node, direction = divmod(row, len(directions))
        lines.append(f"{node + 1},{directions[direction]},0,0,{NODE_DISTANCE * node}")
    (home / "nodes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _copied(source: Path) -> Callable[[Path, Size], None]:
    """What writes the scenes and system files of a folder of the package."""

    def write(folder: Path, _: Size) -> None:
        for file in sorted(source.glob("*.yaml")):
            shutil.copyfile(file, folder / file.name)

    return write


EXAMPLES = {
    "pad": Example(
        "a rigid pad on two springs, and ranges of its parameters",
        write_pad,
        "squeal thresholds pad.yaml",
    ),
    "brake": Example(
        "disc and pad in solids as Abaqus writes them, a test, ranges, a shim",
        write_brake,
        "squeal eigenvalues brake/system.yaml --band 500:8000",
    ),
    "components": Example(
        "disc and pad by themselves, joined by a contact with pressure and wear",
        write_components,
        "squeal eigenvalues brake/assembly.yaml",
    ),
    "rotor": Example(
        "a rotor on two bearings with cross-coupled stiffness, from ROSS",
        write_rotor,
        "squeal thresholds rotor/rotor.yaml --max 500",
    ),
    "article": Example(
        "the scenes b1-a to b3 of the article's cases",
        _copied(ARTICLE / "scenes"),
        "squeal simulate b1-c.yaml",
    ),
    "literature": Example(
        "bicycle, drum brake, mode coupling, wing and Ziegler's column",
        _copied(ARTICLE / "literature" / "systems"),
        "squeal thresholds bicycle.yaml --max 10",
    ),
}


def write_example(name: str, folder: Path, size: Size) -> list[str]:
    """Write an example into a folder; its files by name, relative to the folder.

    `size` is that of a brake of solids. No file of the folder is overwritten. Raises InputError for
    an unknown name, and for files that are in the folder already.
    """
    if name not in EXAMPLES:
        raise InputError(f"{name}: is no example; {', '.join(EXAMPLES)} are")
    with whole_folder(folder) as temporary:
        EXAMPLES[name].write(temporary, size)
        files = []
        for path in sorted(temporary.rglob("*")):
            if path.is_file():
                name_in_folder = path.relative_to(temporary)
                target = folder / name_in_folder
                if target.exists():
                    raise InputError(f"{target}: is there already; move it, or name a new folder")
                files.append(name_in_folder.as_posix())
    return files
