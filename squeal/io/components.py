"""Files of an assembly: components, each a system file, and the contact between them."""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.cells import Corners
from squeal.io.coordinates import Coordinates
from squeal.io.loads import pressure_load, read_load
from squeal.io.matrices import read_matrix
from squeal.io.surfaces import ALL, read_surface
from squeal.io.system import Origin, SystemFile
from squeal.io.system_keys import CSV, FACTOR, SYSTEM, Document
from squeal.io.tables import Line, number_in, read_table
from squeal.io.writing import write_csv
from squeal.numerics.differentiation import Formula
from squeal.schema import FLAG, TEXT, Group, Key, Named, Number, Place, Several, Whole, row
from squeal.sparse.assembly import ASSEMBLY_DEFAULTS, Assembly, assemble
from squeal.sparse.components import Component
from squeal.sparse.contact_faces import ContactPoints, contact_between_faces
from squeal.sparse.contact_seat import Contact
from squeal.sparse.quadratic import Changes

OTHER_SIZE = 300.0  # times as large: metres beside millimetres, not a disc beside a pin
OTHER_DENSITY = 1e5  # times as dense: kilograms beside tonnes, and what lengths may add
BETWEEN = Several(TEXT, "a list of two names of components", 2)
SURFACES = Several(TEXT, f"a list of two names of surfaces or {ALL}", 2)
POSITIVE = Number(low=0.0)
# fmt: off
LOAD = Group({
    "file": Key(
        "table with the columns node, dof, force, or row, force; or an input deck, of which *CLOAD "
        "and pressures below *DLOAD and *DSLOAD are read",
        TEXT, "N", required=True, unless="surface",
        default="refused, unless surface is given"),
    "surface": Key("a surface of its deck on which a pressure of 1 acts", TEXT, instead="file"),
    "factor": Key("what the forces are multiplied with, such as a pressure", FACTOR, default="1"),
}, owner="load")
REDUCED = Group({
    "rows": Key("how many it had", Whole(1, 10**9), required=True),
    "cutoff": Key("frequency up to which it has modes", POSITIVE, "Hz", required=True),
    "residual_flexibility": Key(
        "matrix file, as `export` wrote it, from which the errors of roots follow",
        TEXT, required=True),
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
        "table of node pairs: first, second; optional area, gap, nx, ny, nz; with point, "
        "first_weight and second_weight several nodes of either side make a point", CSV,
        required=True, unless="distance", default="refused, unless distance is given"),
    "distance": Key("pairs each node of the second with the nearest of the first within it; of "
                    "faces how far they may be from each other", POSITIVE, "m", instead="pairs"),
    "faces": Key(f"joins faces in place of nodes: of each component {ALL}, or a surface of its "
                 "deck; gives area and normal", SURFACES, default="nodes are joined",
                 needs=("distance",)),
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
    document: Document,
    at: Place,
    folder: Path,
    read_component: Callable[[Path], SystemFile],
    band: tuple[float, float] | None = None,
) -> SystemFile:
    """The components and the contact of a file, reduced and seated, as a system.

    `read_component` reads the system file of a component, which may be an assembly itself. `band`
    (Hz) sets the cutoff of a file without one. Raises InputError and ComputationError.
    """
    keys = ASSEMBLY.read(document, at)
    values = ASSEMBLY_DEFAULTS | keys.get("parameters", {})
    read: list[_Side] = []
    origins: list[Origin] = []
    inputs: list[Path] = []
    assumptions: list[str] = []
    for name, component in keys["components"].items():
        path = folder / component["file"]
        file = read_component(path)
        body = _component(name, component, file, at / "components" / name, folder, values)
        assert file.coordinates is not None  # or the component were refused
        read.append(_Side(body, file.coordinates))
        origins += [origin._replace(part=f"{name}.{origin.part}") for origin in file.origins]
        assumptions += [f"{name}: {words}" for words in file.assumptions]
        inputs += [path, *file.inputs]
        if "reduced" in component:
            inputs.append(folder / component["reduced"]["residual_flexibility"])
        if "file" in component.get("load", {}):
            inputs.append(folder / component["load"]["file"])
    _warn_of_other_units(at, read)
    for contact in keys["contact"]:
        if "pairs" in contact:
            inputs.append(folder / contact["pairs"]["file"])
    sides = {side.body.name: side for side in read}
    bodies = [side.body for side in read]
    if "cutoff" in keys and all(body.residual_flexibility is not None for body in bodies):
        words = "is not allowed; all components are reduced already, up to"
        raise (at / "cutoff").refuse(f"{words} {min(body.cutoff for body in bodies):g} Hz")

    def joined(bodies: Sequence[Component], values: Changes, cutoff: float | None) -> Assembly:
        """The components in the contact that some parameters give; they may be joined again."""
        contacts = []
        for number, contact in enumerate(keys["contact"], 1):
            here = at / "contact" / str(number)
            contacts.append(_contact(contact, here, folder, values, sides))
        parameter = keys.get("parameter", "mu")
        name = keys.get("name") or Path(at.source).stem
        with at.named():
            assembly = assemble(bodies, contacts, values, parameter, name, cutoff)

        def joined_at(changes: Changes) -> Assembly:
            changed = {**values, **changes}
            loaded = []
            for body in assembly.components:
                place = at / "components" / body.name
                load = keys["components"][body.name].get("load")
                loaded.append(_loaded_anew(body, load, place, values, changed))
            return joined(loaded, changed, None)

        return replace(assembly, joined_at=joined_at)

    assembly = joined(bodies, values, keys.get("cutoff", band and 2 * band[1]))
    return SystemFile(
        assembly.system,
        reference=keys.get("reference", ""),
        origins=tuple(origins),
        inputs=tuple(inputs),
        coordinates=_coordinates(read, assembly.components),
        assembly=assembly,
        assumptions=tuple(assumptions),
    )


class _Side(NamedTuple):
    """A component and the coordinates of its file."""

    body: Component
    coordinates: Coordinates


def _warn_of_other_units(at: Place, sides: Sequence[_Side]) -> None:
    """Warn of full components whose sizes or densities are too different to have the same units."""
    first: tuple[str, float, float] | None = None
    for body, coordinates in sides:
        mass, _ = coordinates.mass_and_centre(body.system.frozen().at()[0])
        size = float(np.ptp(coordinates.places, axis=0).max(initial=0.0))
        if body.rows is not None or mass <= 0.0 or size <= 0.0:  # of reduced rows there is no mass
            continue
        name = body.system.name
        density = mass / size**3
        if first is None:
            first = (name, size, density)
            continue
        first_name, first_size, first_density = first
        here = at / "components" / name
        if abs(math.log(size / first_size)) > math.log(OTHER_SIZE):
            words = f"nodes {size:.4g} apart, those of {first_name} {first_size:.4g}"
            here.warn(f"{words}; all components need the same units")
        elif abs(math.log(density / first_density)) > math.log(OTHER_DENSITY):
            words = f"a mass of {mass:.4g} in a box of {size:.4g}"
            ratio = density / first_density
            here.warn(
                f"{words}, {ratio:.2g} times the density of {first_name}; all components need the "
                "same units"
            )


def _formula_value(keys: Document, key: str, at: Place, values: Mapping[str, float]) -> float:
    """The value of a formula, 1 if it is left out. Raises InputError."""
    with (at / key).named():
        return Formula(keys.get(key, "1")).value(values)


def _component(
    name: str,
    keys: Document,
    file: SystemFile,
    at: Place,
    folder: Path,
    values: Mapping[str, float],
) -> Component:
    """A component as its system `file` and the `keys` of the assembly describe it.

    Raises InputError.
    """
    coordinates = file.coordinates
    if coordinates is None:
        raise at.refuse("its system file has no coordinates; they are needed")
    body = Component(
        replace(file.system, name=name),
        nodes=np.array(coordinates.names)[coordinates.nodes],
        directions=coordinates.directions,
        places=coordinates.places[coordinates.nodes],
    )
    if "rotation" in keys:
        rotation = keys["rotation"]
        with (at / "rotation").named():
            body = body.rotating(
                rotation["axis"], rotation["speed"], values, rotation.get("preloaded", False)
            )
    if "reduced" in keys:
        reduced = keys["reduced"]
        with (at / "reduced" / "residual_flexibility").named():
            flexibility = read_matrix(folder / reduced["residual_flexibility"]).matrix
            size = len(body.system.terms) * body.system.n
            if flexibility.shape[0] not in (size, 2 * size):
                words = f"it must have {size} or {2 * size}, as `export` wrote it"
                raise InputError(f"{flexibility.shape[0]} rows are not allowed; {words}")
        body = replace(
            body,
            rows=reduced["rows"],
            cutoff=reduced["cutoff"],
            residual_flexibility=flexibility.toarray(),
        )
    if "load" in keys:
        load = keys["load"]
        factor = _formula_value(load, "factor", at / "load", values)
        if "surface" in load:
            with (at / "load" / "surface").named():
                unit_load = pressure_load(body, coordinates, load["surface"])
        else:
            unit_load = read_load(folder / load["file"], body, coordinates)
        body = replace(body, load=factor * unit_load)
    return body


def _loaded_anew(
    body: Component, load: Document | None, at: Place, values: Changes, changed: Changes
) -> Component:
    """A component under the load of changed parameters. Raises InputError."""
    if load is None:
        return body
    before = _formula_value(load, "factor", at / "load", values)
    if not before:
        raise (at / "load" / "factor").refuse("is 0; another value is needed where it changes")
    factor = _formula_value(load, "factor", at / "load", changed) / before
    return replace(body, load=factor * body.load)


def _contact(
    keys: Document,
    at: Place,
    folder: Path,
    values: Mapping[str, float],
    sides: Mapping[str, _Side],
) -> Contact:
    """A contact from its keys and the table of its pairs, or the faces of both components.

    Raises InputError.
    """
    law = {key: value for key, value in keys.items() if key not in ("pairs", "distance", "faces")}
    columns: dict[str, Any]
    if "pairs" in keys:
        columns = _pairs(folder / keys["pairs"]["file"])
    elif "faces" in keys:
        columns = _face_contact(keys, at, sides)
    else:
        columns = {"pairs": keys.get("distance")}
    if "normal" not in law and "normal" not in columns:
        raise CONTACT.keys["normal"].missing(at / "normal", "a contact")
    for key in ("stiffness", "tangential", "gap"):
        if key in law:
            law[key] = _formula_value(law, key, at, values)
    for key in sorted(law.keys() & columns.keys()):
        if key != "gap":  # lengths add
            giver = "faces, which give it" if "faces" in keys else "columns of pairs that give it"
            raise (at / key).refuse(f"is not allowed beside {giver}")
        law[key] += columns[key]
    return Contact(**columns | law)


def _face_contact(keys: Document, at: Place, sides: Mapping[str, _Side]) -> dict[str, Any]:
    """The points of a contact between faces, their areas and normals, as `pairs`, `area` and
    `normal` of `Contact`. Raises InputError."""
    for name in keys["between"]:
        if name not in sides:
            raise (at / "between").must_be(name, f"one of {', '.join(sides)}")
    first, second = (sides[name] for name in keys["between"])
    surface_of_first, surface_of_second = keys["faces"]
    here = at / "faces"
    with (here / first.body.name).named():
        on_first = read_surface(first.coordinates, surface_of_first)
    with (here / second.body.name).named():
        on_second = read_surface(second.coordinates, surface_of_second)
    with here.named():
        found = contact_between_faces(
            first.body, second.body, on_first, on_second, keys["distance"]
        )
    return {"pairs": found.points, "area": found.area, "normal": found.normal}


POINT_COLUMNS = ("point", "first", "first_weight", "second", "second_weight")


def _pairs(path: Path) -> dict[str, Any]:
    """Pairs (m, 2) or points (m,), and area, gap (m,) and normal (m, 3) as far as a table has
    them. Raises InputError."""
    at, lines = read_table(path, ("first", "second"))
    if not lines:
        raise at.refuse("no pair; at least one line below the heads is needed")
    unused = lines[0].cells.keys() - {"first", "second"}
    columns: dict[str, Any] = {}
    if "point" in unused:
        missing = [name for name in POINT_COLUMNS if name not in lines[0].cells]
        if missing:
            raise at.refuse(f"no column {missing[0]}; it is needed beside point")
        columns["pairs"], lines = _points(lines)
        unused = unused - {*POINT_COLUMNS, *"xyz"}
    else:
        columns["pairs"] = [(cells["first"], cells["second"]) for _, cells in lines]
    for head in ("area", "gap"):
        if head in unused:
            columns[head] = np.array([number_in(cells[head], at / head) for at, cells in lines])
            unused = unused - {head}
    axes = ("nx", "ny", "nz")
    if unused.issuperset(axes):
        columns["normal"] = np.array(
            [[number_in(cells[axis], at / axis) for axis in axes] for at, cells in lines]
        )
        unused = unused - set(axes)
    if unused:
        words = "no use is made of them; area, gap and all of nx, ny, nz have one"
        at.warn(f"columns {', '.join(sorted(unused))}: {words}")
    return columns


def _points(lines: Sequence[Line]) -> tuple[ContactPoints, list[Line]]:
    """The points of a table with a line for each of their nodes, and the first line of each.

    Raises InputError.
    """
    lines_of_points: dict[str, list[Line]] = defaultdict(list)
    for line in lines:
        lines_of_points[line.cells["point"].strip()].append(line)
    labels: dict[str, list[list[str]]] = {"first": [], "second": []}
    weights: dict[str, list[list[float]]] = {"first": [], "second": []}
    for of_point in lines_of_points.values():
        for side in ("first", "second"):
            named = [line for line in of_point if line.cells[side].strip()]
            if not named:
                raise of_point[0].at.refuse(f"its point has no node in the column {side}")
            head = f"{side}_weight"
            labels[side].append([line.cells[side].strip() for line in named])
            weights[side].append([number_in(line.cells[head], line.at / head) for line in named])
    first_lines = [of_point[0] for of_point in lines_of_points.values()]
    places = None
    if {*"xyz"} <= lines[0].cells.keys():
        places = np.array(
            [[number_in(cells[axis], at / axis) for axis in "xyz"] for at, cells in first_lines]
        )
    points = ContactPoints(
        first=_padded(labels["first"]),
        second=_padded(labels["second"]),
        first_weights=_padded_with_zeros(weights["first"]),
        second_weights=_padded_with_zeros(weights["second"]),
        places=places,
    )
    return points, first_lines


def _padded(rows: Sequence[Sequence[str]]) -> NDArray[np.str_]:
    """Rows of one length; the first label fills what is missing."""
    width = max(len(row) for row in rows)
    return np.array([[*row, *[row[0]] * (width - len(row))] for row in rows])


def _padded_with_zeros(rows: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    width = max(len(row) for row in rows)
    return np.array([[*row, *[0.0] * (width - len(row))] for row in rows])


def write_points(path: Path, contact: Contact) -> None:
    """The points of a contact between faces as the table that `pairs` names.

    A point has as many lines as the side of more nodes; what is known of the point stands in each.
    """
    points = contact.pairs
    rows: list[list[object]] = []
    for i in range(len(points)):
        sides = []
        for number in (0, 1):
            labels, weights = points.side(number)
            used = np.flatnonzero(weights[i])
            if not len(used):  # a point of nodes that do not move
                used = np.array([0])
            nodes = labels[i, used].tolist()
            sides.append(zip(nodes, weights[i, used].tolist(), strict=True))
        of_point = [contact.area[i], *contact.normal[i], *points.places[i]]
        for first, second in zip_longest(*sides, fillvalue=("", "")):
            rows.append([i + 1, *first, *second, *of_point])
    write_csv(path, [*POINT_COLUMNS, "area", "nx", "ny", "nz", "x", "y", "z"], rows)


def _coordinates(sides: Sequence[_Side], reduced: Sequence[Component]) -> Coordinates:
    """The nodes of all rows before their reduction, and the elements, for mode shapes."""
    names: list[str] = []
    nodes = []
    cells: list[tuple[str, Corners]] = []
    elements: list[str] = []
    for body, own in sides:
        before = len(names)
        nodes.append(own.nodes + before)
        names += [f"{body.name} {node}" for node in own.names]
        elements += [f"{body.name} {element}" for element in own.elements]
        for kind, corners in own.cells:
            cells.append((kind, tuple(corner + before for corner in corners)))
    return Coordinates(
        nodes=np.concatenate(nodes),
        directions=np.concatenate([side.coordinates.directions for side in sides]),
        places=np.concatenate([side.coordinates.places for side in sides]),
        names=tuple(names),
        cells=tuple(cells),
        elements=tuple(elements),
        bases=tuple(body.basis for body in reduced if body.basis is not None),  # of all or none
    )
