"""Files of an assembly: components, each a system file, and the contact between them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.io.system import (
    DIRECTIONS,
    DOF,
    FACTOR,
    SYSTEM,
    Coordinates,
    Origin,
    SystemFile,
    read_system,
    read_table,
)
from squeal.numerics.differentiation import Formula
from squeal.schema import ANY, FLAG, TEXT, Group, Key, Named, Number, Place, Several, row
from squeal.sparse.components import Component, Contact, assemble

BETWEEN = Several(TEXT, "a list of two names of components", 2)
CSV = Group({"file": Key("a .csv file", TEXT, required=True)}, owner="a table")
# fmt: off
LOAD = Group({
    "file": Key("table with the columns node, dof, force", TEXT, "N", required=True),
    "factor": Key("what the forces are multiplied with, such as a pressure", FACTOR, default="1"),
}, owner="load")
COMPONENT = Group({
    "file": Key(
        "system file of M, C and K with coordinates", TEXT, required=True),
    "load": Key("brake load, under which contact is seated", LOAD, default="none"),
}, owner="a component")
CONTACT = Group({
    "between": Key("the components", BETWEEN, required=True),
    "pairs": Key(
        "table of node pairs: first, second; optional area, gap, nx, ny, nz", CSV, required=True,
        unless="distance", default="refused, unless distance is given"),
    "distance": Key(
        "pairs each node of the second with the nearest of the first within it",
        Number(low=0.0), "m", instead="pairs"),
    "normal": Key(
        "from the first to the second", row(3), default="the columns nx, ny, nz of the table"),
    "stiffness": Key("normal stiffness", FACTOR, "N/m^3, N/m without area", required=True),
    "area": Key(
        "of all pairs together", Number(low=0.0), "m^2", default="the column area, or none"),
    "axis": Key("of the rotation of the first, in its sense", row(3), default="none"),
    "through": Key("a point of the axis", row(3), "m", default="the origin", needs=("axis",)),
    "sliding": Key(
        "constant direction in which the first moves past the second", row(3), default="none",
        instead="axis"),
    "friction": Key("coefficient of friction", FACTOR, default="mu"),
    "factor": Key("of the normal stiffness", FACTOR, default="contact"),
    "tangential": Key("stiffness across the normal", FACTOR, "as stiffness", default="0"),
    "gap": Key(
        "between the nodes beside their places, such as wear; multiplied with the column gap",
        FACTOR, "m", default="the column gap, or 0"),
    "exponent": Key(
        "normal stiffness times (pressure over reference)^exponent",
        Number(0.0, 0.99, low_allowed=True), default="0"),
    "reference": Key("pressure at which the stiffness holds", Number(low=0.0), "Pa", default="1"),
    "bonded": Key("whether no pair can open, as in a joint", FLAG, default="false"),
}, owner="a contact")
ASSEMBLY = Group({
    **{key: SYSTEM.keys[key] for key in ("name", "reference", "parameters", "parameter")},
    "cutoff": Key(
        "frequency up to which components keep their modes; full ones without it", Number(low=0.0),
        "Hz", default="twice the upper end of --band"),
    "components": Key(
        "system files by name", Named(COMPONENT, "a mapping of names to components"),
        required=True),
    "contact": Key("between components", Several(CONTACT, "a list of contacts"), required=True),
}, owner="an assembly")
# fmt: on


def assembly_file(
    document: dict[str, Any], at: Place, folder: Path, band: tuple[float, float] | None = None
) -> SystemFile:
    """The components and the contact of a file, reduced and seated, as a system.

    Raises InputError and ComputationError.
    """
    given = ASSEMBLY.read(document, at)
    values = {"mu": 0.0, "contact": 1.0, "tangential": 1.0, **given.get("parameters", {})}
    inputs, origins, bodies = list[Path](), list[Origin](), list[Component]()

    def value(one: dict[str, Any], key: str, here: Place, default: str = "1") -> float:
        """The value of a formula."""
        with (here / key).named():
            return Formula(one.get(key, default)).value(values)

    for name, one in given["components"].items():
        here, path = at / "components" / name, folder / one["file"]
        file = read_system(path)
        body = _component(file, name, here)
        origins += [o._replace(part=f"{name}.{o.part}") for o in file.origins]
        inputs += [path, *file.inputs]
        if load := one.get("load"):
            inputs.append(folder / load["file"])
            forces = value(load, "factor", here / "load") * _load(inputs[-1], body)
            body = replace(body, load=forces)
        bodies.append(body)
    contacts = []
    for i, one in enumerate(given["contact"], 1):
        here, table = at / "contact" / str(i), {"pairs": one.pop("distance", None)}
        if "pairs" in one:
            inputs.append(folder / one.pop("pairs")["file"])
            table = _pairs(inputs[-1])
        if "normal" not in one and "normal" not in table:
            raise CONTACT.keys["normal"].missing(here / "normal", "a contact")
        for key in ("stiffness", "tangential", "gap"):
            if key in one:
                one[key] = value(one, key, here)
        if "gap" in one:
            one["gap"] = one["gap"] * table.get("gap", 1.0)
        contacts.append(Contact(**table | one))
    cutoff, name = given.get("cutoff", band and 2 * band[1]), given.get("name")
    with at.named():
        found = assemble(
            bodies, contacts, values, given.get("parameter", "mu"), name or Path(at.source).stem,
            cutoff,
        )  # fmt: skip
    coordinates = _coordinates(bodies, found.components)
    reference, read = given.get("reference", ""), (tuple(origins), tuple(inputs), coordinates)
    return SystemFile(found.system, reference, *read, assembly=found)


def _component(file: SystemFile, name: str, at: Place) -> Component:
    """A component of a system file. Raises InputError unless its rows have nodes."""
    where = file.coordinates
    if where is None:
        raise at.refuse("its system file has no coordinates; they are needed")
    system, places = replace(file.system, name=name), where.places[where.nodes]
    return Component(system, np.array(where.names)[where.nodes], where.directions, places)


def _number(line: dict[str, str], name: str, here: Place) -> float:
    try:
        return float(ANY.read(float(line[name]), here / name))
    except ValueError:
        raise (here / name).must_be(line[name], ANY.named) from None


def _load(path: Path, body: Component) -> NDArray[np.float64]:
    """The load (n,) in a table with the columns node, dof, force. Raises InputError."""
    load = np.zeros(body.system.n)
    for here, line in read_table(path, ("node", "dof", "force"))[1]:
        with here.named():
            rows = body.rows_of([line["node"]])[0]
        direction = DIRECTIONS[DOF.read(line["dof"].lower(), here / "dof")]
        if direction < 0 or rows[direction] < 0:
            raise here.refuse(f"{body.name} has no such row; a displacement of a node is needed")
        load[rows[direction]] += _number(line, "force", here)
    return load


def _pairs(path: Path) -> dict[str, Any]:
    """Pairs (m, 2), and area, gap (m,) and normal (m, 3) as far as a table has them."""
    _, lines = read_table(path, ("first", "second"))
    if not lines:
        raise Place(str(path)).refuse("no pair; at least one line below the heads is needed")
    table: dict[str, Any] = {"pairs": [(line["first"], line["second"]) for _, line in lines]}
    for name, columns in (("area", ["area"]), ("gap", ["gap"]), ("normal", ["nx", "ny", "nz"])):
        if set(columns) <= lines[0][1].keys():
            cells = [[_number(line, c, here) for c in columns] for here, line in lines]
            table[name] = np.array(cells) if len(columns) > 1 else np.ravel(cells)
    return table


def _coordinates(full: Sequence[Component], small: Sequence[Component]) -> Coordinates | None:
    """The nodes of all rows before their reduction, for mode shapes; None if some have no place."""
    if any(body.places is None for body in full):
        return None
    bases = tuple(x.basis for x in small if x.basis is not None)  # of all, or of none
    names = np.concatenate([[f"{x.name} {node}" for node in x.nodes] for x in full])
    texts, first, nodes = np.unique(names, return_index=True, return_inverse=True)
    places = np.concatenate([body.places for body in full])[first]
    directions = np.concatenate([body.directions for body in full])
    return Coordinates(nodes, directions, places, tuple(texts.tolist()), bases=bases)
