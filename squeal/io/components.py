"""Files of an assembly: components, each a system file, and the contact between them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io import system as files
from squeal.io.matrices import read_matrix
from squeal.io.system import CSV, FACTOR, SYSTEM, Coordinates, Origin, SystemFile, number_in
from squeal.numerics.differentiation import Formula
from squeal.schema import FLAG, TEXT, Group, Key, Named, Number, Place, Several, Whole, row
from squeal.sparse.assembly import OWN, assemble
from squeal.sparse.components import Component
from squeal.sparse.contact_seat import Contact

BETWEEN = Several(TEXT, "a list of two names of components", 2)
POSITIVE = Number(low=0.0)
# fmt: off
LOAD = Group({
    "file": Key("table with the columns node, dof, force", TEXT, "N", required=True),
    "factor": Key("what the forces are multiplied with, such as a pressure", FACTOR, default="1"),
}, owner="load")
REDUCED = Group({
    "rows": Key("how many it had", Whole(1, 10**9), required=True),
    "cutoff": Key("frequency up to which it has modes", POSITIVE, "Hz", required=True),
    "lacks": Key("matrix file that tells the errors of roots", TEXT, required=True),
}, owner="reduced")
ROTATION = Group({
    "axis": Key("of the rotation, in its sense", row(3), required=True),
    "speed": Key("speed", FACTOR, "rad/s", required=True),
    "preloaded": Key(
        "whether K has the centrifugal forces already, as that of a step about the turning state",
        FLAG, default="false"),
}, owner="a rotation")
COMPONENT = Group({
    "file": Key("system file of M, C and K with coordinates", TEXT, required=True),
    "reduced": Key("what it was reduced from, as `export` writes it; it is not reduced again",
                   REDUCED, default="it is no reduced one"),
    "load": Key("brake load, under which contact is seated", LOAD, default="none"),
    "rotation": Key("seen from a frame that turns with it: Coriolis and centrifugal forces",
                    ROTATION, default="none"),
}, owner="a component")
CONTACT = Group({
    "between": Key("the components", BETWEEN, required=True),
    "pairs": Key(
        "table of node pairs: first, second; optional area, gap, nx, ny, nz", CSV, required=True,
        unless="distance", default="refused, unless distance is given"),
    "distance": Key("pairs each node of the second with the nearest of the first within it",
                    POSITIVE, "m", instead="pairs"),
    "normal": Key(
        "from the first to the second", row(3), default="the columns nx, ny, nz of the table"),
    "stiffness": Key("normal stiffness", FACTOR, "N/m^3, N/m without area", required=True),
    "area": Key("of all pairs together", POSITIVE, "m^2", default="the column area, or none"),
    "axis": Key("of the rotation of the first, in its sense", row(3), default="none"),
    "through": Key("a point of the axis", row(3), "m", default="the origin", needs=("axis",)),
    "sliding": Key("constant direction in which the first moves past the second", row(3),
                   default="none", instead="axis"),
    "friction": Key("coefficient of friction", FACTOR, default="mu"),
    "speed": Key("of sliding; friction then turns with its direction, which damps motion across it",
                 FACTOR, "m/s, rad/s with axis", default="no such damping"),
    "slope": Key("d friction / d speed, below 0 where friction falls", FACTOR, "s/m", default="0"),
    "factor": Key("of the normal stiffness", FACTOR, default="contact"),
    "tangential": Key("stiffness across the normal", FACTOR, "as stiffness", default="0"),
    "gap": Key(
        "between the nodes beside their places, such as wear; the column gap adds to it", FACTOR,
        "m", default="0"),
    "exponent": Key("normal stiffness times (pressure over reference)^exponent",
                    Number(0.0, 0.99, low_allowed=True), default="0"),
    "reference": Key("pressure at which the stiffness holds", POSITIVE, "Pa", default="1"),
    "bonded": Key("whether no pair can open, as in a joint", FLAG, default="false"),
}, owner="a contact")
ASSEMBLY = Group({
    **{key: SYSTEM.keys[key] for key in ("name", "reference", "parameters", "parameter")},
    "cutoff": Key("frequency up to which components keep their modes; full ones without it",
                  POSITIVE, "Hz", default="twice the upper end of --band"),
    "components": Key("system files by name", Named(COMPONENT, "a mapping of names to components"),
                      required=True),
    "contact": Key("between components", Several(CONTACT, "a list of contacts"), required=True),
}, owner="an assembly")
# fmt: on


def assembly_file(
    document: dict[str, Any],
    at: Place,
    folder: Path,
    read_component: Callable[[Path], SystemFile],
    band: tuple[float, float] | None = None,
) -> SystemFile:
    """The components and the contact of a file, reduced and seated, as a system.

    `read_component` reads the system file of a component, which may be an assembly itself.
    Raises InputError and ComputationError.
    """
    given = ASSEMBLY.read(document, at)
    values = OWN | given.get("parameters", {})
    inputs, origins, bodies, contacts = list[Path](), list[Origin](), list[Component](), []
    assumptions = list[str]()

    def value(one: dict[str, Any], key: str, here: Place) -> float:
        with (here / key).named():
            return Formula(one.get(key, "1")).value(values)

    for name, one in given["components"].items():
        here, path = at / "components" / name, folder / one["file"]
        file = read_component(path)
        if (where := file.coordinates) is None:
            raise here.refuse("its system file has no coordinates; they are needed")
        origins += [o._replace(part=f"{name}.{o.part}") for o in file.origins]
        inputs += [path, *file.inputs]
        assumptions += [f"{name}: {words}" for words in file.assumptions]
        nodes, places = np.array(where.names)[where.nodes], where.places[where.nodes]
        body = Component(replace(file.system, name=name), nodes, where.directions, places)
        if turning := one.get("rotation"):
            with (here / "rotation").named():
                preloaded = turning.get("preloaded", False)
                body = body.rotating(turning["axis"], turning["speed"], values, preloaded)
        if known := one.get("reduced"):
            inputs.append(folder / known["lacks"])
            size = len(body.system.terms) * body.system.n
            with (here / "reduced" / "lacks").named():
                if (lacks := read_matrix(inputs[-1]).matrix).shape[0] not in (size, 2 * size):
                    words = f"it must have {size} or {2 * size}, as `export` wrote it"
                    raise InputError(f"{lacks.shape[0]} rows are not allowed; {words}")
            body = replace(body, **known | {"lacks": lacks.toarray()})
        if load := one.get("load"):
            inputs.append(folder / load["file"])
            factor = value(load, "factor", here / "load")
            body = replace(body, load=factor * _load(inputs[-1], body))
        bodies.append(body)
    for i, one in enumerate(given["contact"], 1):
        here, table = at / "contact" / str(i), {"pairs": one.pop("distance", None)}
        if "pairs" in one:
            inputs.append(folder / one.pop("pairs")["file"])
            table = _pairs(inputs[-1])
        if not {"normal"} & (one.keys() | table.keys()):
            raise CONTACT.keys["normal"].missing(here / "normal", "a contact")
        one |= {k: value(one, k, here) for k in ("stiffness", "tangential", "gap") if k in one}
        for key in sorted(one.keys() & table.keys()):
            if key != "gap":  # lengths add
                raise (here / key).refuse("is not allowed beside columns of pairs that give it")
            one[key] += table[key]
        contacts.append(Contact(**table | one))
    if "cutoff" in given and all(body.lacks is not None for body in bodies):
        words = "is not allowed; all components are reduced already, up to"
        raise (at / "cutoff").refuse(f"{words} {min(body.cutoff for body in bodies):g} Hz")
    cutoff, title = given.get("cutoff", band and 2 * band[1]), given.get("name")
    with at.named():
        names = given.get("parameter", "mu"), title or Path(at.source).stem
        found = assemble(bodies, contacts, values, *names, cutoff)
    read = tuple(origins), tuple(inputs), _coordinates(bodies, found.components)
    reference = given.get("reference", "")
    return SystemFile(
        found.system, reference, *read, assembly=found, assumptions=tuple(assumptions)
    )


def _load(path: Path, body: Component) -> NDArray[np.float64]:
    load = np.zeros(body.system.n)
    for here, line in files.read_table(path, ("node", "dof", "force"))[1]:
        with here.named():
            rows = body.rows_of([line["node"]])[0]
        direction = files.DIRECTIONS[files.DOF.read(line["dof"].lower(), here / "dof")]
        if direction < 0 or rows[direction] < 0:
            raise here.refuse(f"{body.name} has no such row; a displacement of a node is needed")
        load[rows[direction]] += number_in(line["force"], here / "force")
    return load


def _pairs(path: Path) -> dict[str, Any]:
    """Pairs (m, 2), and area, gap (m,) and normal (m, 3) as far as a table has them."""
    at, lines = files.read_table(path, ("first", "second"))
    if not lines:
        raise at.refuse("no pair; at least one line below the heads is needed")
    table: dict[str, Any] = {"pairs": [(line["first"], line["second"]) for _, line in lines]}
    unused = lines[0][1].keys() - {"first", "second"}
    for name, heads in {"area": ["area"], "gap": ["gap"], "normal": ["nx", "ny", "nz"]}.items():
        if {*heads} <= unused:
            unused = unused - {*heads}
            cells = [[number_in(line[x], here / x) for x in heads] for here, line in lines]
            table[name] = np.array(cells) if name == "normal" else np.ravel(cells)
    if unused:
        words = "no use is made of them; area, gap and all of nx, ny, nz have one"
        at.warn(f"columns {', '.join(sorted(unused))}: {words}")
    return table


def _coordinates(full: Sequence[Component], small: Sequence[Component]) -> Coordinates:
    """The nodes of all rows before their reduction, for mode shapes."""
    names = np.concatenate([[f"{x.name} {node}" for node in x.nodes] for x in full])
    texts, first, nodes = np.unique(names, return_index=True, return_inverse=True)
    places, directions = (
        np.concatenate([getattr(x, key) for x in full]) for key in ("places", "directions")
    )
    bases = tuple(x.basis for x in small if x.basis is not None)  # of all, or of none
    return Coordinates(nodes, directions, places[first], tuple(texts.tolist()), bases=bases)
