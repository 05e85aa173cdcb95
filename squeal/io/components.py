"""Files of an assembly: components, each a system file, and the contact between them."""

import math
import re
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
from squeal.io.system_keys import CSV, FACTOR, SYSTEM, Document, named_files
from squeal.io.tables import Line, number_in, read_table
from squeal.io.writing import write_csv
from squeal.linear.system import warn_of_unused_parameters
from squeal.numerics.differentiation import Formula, Parameters
from squeal.schema import FLAG, POSITIVE, TEXT, Group, Key, Named, Place, Several, Whole, row
from squeal.sparse.assembly import ASSEMBLY_DEFAULTS, Assembly, assemble
from squeal.sparse.components import Component
from squeal.sparse.contact_faces import ContactPoints, contact_between_faces
from squeal.sparse.contact_seat import EXPONENT, Contact

OTHER_SIZE = 300.0  # times as large: metres beside millimetres, not a disc beside a pin
OTHER_DENSITY = 1e5  # times as dense: kilograms beside tonnes, and what lengths may add
BETWEEN = Several(TEXT, "a list of two names of components", 2)
SURFACES = Several(TEXT, f"a list of two names of surfaces or {ALL}", 2)
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
        "before the load, such as wear, whatever the coordinates; the column gap adds to it",
        FACTOR, "m", default="0"),
    "exponent": Key("normal stiffness times (pressure over reference)^exponent",
                    EXPONENT, default="0"),
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


class _LocatedComponent(NamedTuple):
    """A component and the coordinates of its file, before any reduction."""

    body: Component
    coordinates: Coordinates


def assembly_file(
    document: Document,
    at: Place,
    folder: Path,
    read_component: Callable[[Path], SystemFile],
    band: tuple[float, float] | None,
) -> SystemFile:
    """The system of the components of a file, reduced and joined in static contact.

    The components are read, parameters that nothing uses are left out with a warning, then `join`
    reduces the components and joins them in contact.

    Parameters
    ----------
    document : dict
        A mapping of the form of `ASSEMBLY`, not yet checked.
    at : Place
        Where the document stands, for messages.
    folder : Path
        The folder relative to which files are named.
    read_component : callable
        Reads the system file of a component, which may be an assembly itself.
    band : (float, float) or None
        Frequencies (Hz) that are analysed, whose upper end sets the cutoff of a file without one.

    Raises
    ------
    InputError, ComputationError
    """
    keys = ASSEMBLY.read(document, at)
    file_values = ASSEMBLY_DEFAULTS | keys.get("parameters", {})
    components: dict[str, _LocatedComponent] = {}
    origins: list[Origin] = []
    inputs = [folder / name for name in named_files(keys)]
    for name, component in keys["components"].items():
        file = read_component(folder / component["file"])
        body = _component(name, component, file, at / "components" / name, folder, file_values)
        assert file.coordinates is not None  # `_component` refuses one without
        components[name] = _LocatedComponent(body, file.coordinates)
        for origin in file.origins:
            origins.append(origin._replace(part=f"{name}.{origin.part}"))
        inputs += file.inputs
    located = list(components.values())
    _warn_of_other_units(at, located)
    all_bodies = [component.body for component in located]
    if "cutoff" in keys and all(body.rows for body in all_bodies):
        lowest = min(body.cutoff for body in all_bodies)
        raise (at / "cutoff").refuse(
            f"is not allowed; all components are reduced already, up to {lowest:g} Hz"
        )

    # parameters that a matrix depends on, or that stand in a formula of a load or a contact: every
    # word in the keys of components and contacts may be one of those
    in_use = {*ASSEMBLY_DEFAULTS, keys.get("parameter")}
    in_use.update(re.findall(r"\w+", f"{keys['components']} {keys['contact']}"))
    in_use.update(*(body.system.names for body in all_bodies))
    unused = file_values.keys() - in_use
    for name in unused:
        del file_values[name]
    cutoff = keys.get("cutoff")
    if cutoff is None and band is not None:
        cutoff = 2 * band[1]  # Hz, as the key's default says

    def join(bodies: Sequence[Component], values: Parameters, cutoff: float | None) -> Assembly:
        """Join components, reduced or not, in contact at some values of the parameters.

        `joined_at` of the result joins them at other values: it reuses the components that are
        reduced here, and makes loads, contacts and the static contact solution anew. cutoff (Hz):
        None reduces nothing.
        """
        contacts = []
        for number, contact in enumerate(keys["contact"], 1):
            here = at / "contact" / str(number)
            contacts.append(_contact(contact, here, folder, values, components))
        parameter = keys.get("parameter", "mu")
        name = keys.get("name") or Path(at.source).stem
        with at.prefixing_errors():
            assembly = assemble(bodies, contacts, values, parameter, name, cutoff)

        def join_at(changes: Parameters) -> Assembly:
            new_values = {**values, **changes}
            loaded = []
            for body in assembly.components:
                place = at / "components" / body.name
                load = keys["components"][body.name].get("load")
                loaded.append(_loaded_anew(body, load, place, values, new_values))
            return join(loaded, new_values, None)  # what is reduced is not reduced again

        return replace(assembly, joined_at=join_at)

    assembly = join(all_bodies, file_values, cutoff)
    warn_of_unused_parameters(unused, assembly.seated_system, at / "parameters")
    return SystemFile(
        assembly.seated_system,
        reference=keys.get("reference", ""),
        origins=tuple(origins),
        inputs=tuple(inputs),
        coordinates=_joint_coordinates(located, assembly.components),
        assembly=assembly,
    )


def _warn_of_other_units(at: Place, components: Sequence[_LocatedComponent]) -> None:
    """Warn of full components whose sizes or densities are too different to have the same units.

    Each is compared with the first one: the longest edge of the box of its nodes, and the mass
    over the cube of that edge.
    """
    first: tuple[str, float, float] | None = None  # name, size and density
    for body, coordinates in components:
        # M does not depend on the frequency; `frozen` fixes it, so that `at` needs no value
        mass, _ = coordinates.mass_and_centre(body.system.frozen().at()[0])
        size = float(np.ptp(coordinates.places, axis=0).max(initial=0.0))
        # the mass of a reduced component, which has `rows`, lies in rows that move no node
        if body.rows or mass <= 0.0 or size <= 0.0:
            continue
        name = body.name
        density = mass / size**3
        if first is None:
            first = (name, size, density)
            continue
        first_name, first_size, first_density = first
        here = at / "components" / name
        if abs(math.log(size / first_size)) > math.log(OTHER_SIZE):
            here.warn(
                f"nodes {size:.4g} apart, those of {first_name} {first_size:.4g}; all components "
                "need the same units"
            )
        elif abs(math.log(density / first_density)) > math.log(OTHER_DENSITY):
            ratio = density / first_density
            here.warn(
                f"a mass of {mass:.4g} in a box of {size:.4g}, {ratio:.2g} times the density of "
                f"{first_name}; all components need the same units"
            )


def _formula_value(keys: Document, key: str, at: Place, values: Parameters) -> float:
    """The value of the formula that a key names, 1 if it is left out. Raises InputError."""
    with (at / key).prefixing_errors():
        return Formula(keys.get(key, "1")).value(values)


def _component(
    name: str,
    keys: Document,
    file: SystemFile,
    at: Place,
    folder: Path,
    values: Parameters,
) -> Component:
    """A component as its system `file` and the `keys` of the assembly describe it.

    It is read in full, then gets what `keys` add, in this order: the data of its reduction, the
    terms of its rotation, and its brake load. at: where the assembly names the component, for
    messages; folder: that of the assembly, in which `keys` name files; values: of the assembly's
    parameters, for the formulas of `keys`. Raises InputError.
    """
    coordinates = file.coordinates
    if coordinates is None:
        raise at.refuse("its system file has no coordinates; they are needed")
    # `rows` is how many rows a component had before it was reduced, None of a full one
    if file.assembly is not None and any(joined.rows for joined in file.assembly.components):
        raise (at / "file").refuse("joins reduced components; an assembly of full ones is allowed")
    body = Component(
        replace(file.system, name=name),
        nodes=np.array(coordinates.names)[coordinates.nodes],
        directions=coordinates.directions,
        places=coordinates.places[coordinates.nodes],
    )
    if "reduced" in keys:
        reduced = keys["reduced"]
        with (at / "reduced" / "residual_flexibility").prefixing_errors():
            flexibility = read_matrix(folder / reduced["residual_flexibility"]).matrix
            # a block of n rows for each term, and of unsymmetric ones also for each transposed term
            size = len(body.system.terms) * body.system.n
            if flexibility.shape[0] not in (size, 2 * size):
                raise InputError(
                    f"{flexibility.shape[0]} rows are not allowed; it must have {size} or "
                    f"{2 * size}, as `export` wrote it"
                )
        # the other keys are fields of the component by the same names
        body = replace(body, **reduced | {"residual_flexibility": flexibility.toarray()})
    if "rotation" in keys:
        with (at / "rotation").prefixing_errors():
            body = body.rotating(**keys["rotation"], values=values)
    if "load" in keys:
        load = keys["load"]
        factor = _formula_value(load, "factor", at / "load", values)
        if "surface" in load:
            with (at / "load" / "surface").prefixing_errors():
                unit_load = pressure_load(body, coordinates, load["surface"])
        else:
            with (at / "load" / "file").prefixing_errors():
                unit_load = read_load(folder / load["file"], body, coordinates)
        body = replace(body, load=factor * unit_load)
    return body


def _loaded_anew(
    body: Component, load: Document | None, at: Place, values: Parameters, new_values: Parameters
) -> Component:
    """A component that was loaded at the parameters `values`, with its load at `new_values`.

    Of the load only its factor depends on parameters. The body may be reduced, and its load with
    it: the load is multiplied by the new factor over the old one, not read again. load: the keys of
    the load, None without one. Raises InputError.
    """
    if load is None:
        return body
    factor_before = _formula_value(load, "factor", at / "load", values)
    if not factor_before:
        raise (at / "load" / "factor").refuse("is 0; another value is needed where it changes")
    ratio = _formula_value(load, "factor", at / "load", new_values) / factor_before
    return replace(body, load=ratio * body.load)


def _contact(
    keys: Document,
    at: Place,
    folder: Path,
    values: Parameters,
    components: Mapping[str, _LocatedComponent],
) -> Contact:
    """A contact from its keys and the table of its pairs, or the faces of both components.

    values: the parameters, by which formulas in the keys become numbers. Raises InputError.
    """
    arguments: dict[str, Any] = {}  # of `Contact`, as the keys give them
    for key, value in keys.items():
        if key not in ("pairs", "distance", "faces"):
            arguments[key] = value
    points: dict[str, Any]  # arguments of `Contact` that the table or the faces give
    if "pairs" in keys:
        with (at / "pairs" / "file").prefixing_errors():
            points = _table_of_pairs(folder / keys["pairs"]["file"])
    elif "faces" in keys:
        points = _face_contact(keys, at, components)
    else:  # `Contact` pairs the nodes that are this near, m
        points = {"pairs": keys.get("distance")}
    if "normal" not in arguments and "normal" not in points:
        raise CONTACT.keys["normal"].missing(at / "normal", "a contact")
    for key in ("stiffness", "tangential", "gap"):
        if key in arguments:
            arguments[key] = _formula_value(arguments, key, at, values)
    given_twice = sorted(arguments.keys() & points.keys() - {"gap"})
    if given_twice:
        giver = "faces, which give it" if "faces" in keys else "columns of pairs that give it"
        raise (at / given_twice[0]).refuse(f"is not allowed beside {giver}")
    if "gap" in points:  # the column holds the gap of each pair, the key adds the same to all
        points["gap"] = points["gap"] + arguments.get("gap", 0.0)
    with at.prefixing_errors():
        return Contact(**arguments | points)


def _face_contact(
    keys: Document, at: Place, components: Mapping[str, _LocatedComponent]
) -> dict[str, Any]:
    """The points of a contact between faces, their areas and normals, as `pairs`, `area` and
    `normal` of `Contact`.

    keys: of the contact, at `at`; components: by name, with the coordinates of their nodes. Raises
    InputError.
    """
    bodies = []
    surfaces = []
    for name, surface in zip(keys["between"], keys["faces"], strict=True):
        if name not in components:
            raise (at / "between").must_be(name, f"one of {', '.join(components)}")
        body, coordinates = components[name]
        bodies.append(body)
        with (at / "faces" / name).prefixing_errors():
            surfaces.append(read_surface(coordinates, surface))
    first, second = bodies
    on_first, on_second = surfaces
    with (at / "faces").prefixing_errors():
        contact = contact_between_faces(first, second, on_first, on_second, keys["distance"])
    return {"pairs": contact.points, "area": contact.area, "normal": contact.normal}


POINT_COLUMNS = ("point", "first", "first_weight", "second", "second_weight")
NORMAL_COLUMNS = ("nx", "ny", "nz")
PLACE_COLUMNS = ("x", "y", "z")
WEIGHT_ROUNDING = 1e-3  # of a sum of weights; more is the weight of nodes that do not move
MOST_WEIGHT = 1.05  # sum of the weights of a point, which may be printed to two digits


def _table_of_pairs(path: Path) -> dict[str, Any]:
    """What a table of node pairs, or of contact points, gives as arguments of `Contact`.

    `pairs` are (first, second) of each line, or ContactPoints (m,) of a table with the column
    point; `area` and `gap` (m,) and `normal` (m, 3) are left out unless it has their columns. Warns
    of columns that are not used. Raises InputError.
    """
    at, lines = read_table(path, ("first", "second"))
    if not lines:
        raise at.refuse("no pair; at least one line below the heads is needed")
    heads = lines[0].cells.keys()
    arguments: dict[str, Any] = {}
    if "point" in heads:
        at, lines = read_table(path, POINT_COLUMNS)  # again: refuses a table that lacks a column
        used = {*POINT_COLUMNS}
        points, pair_lines = _points(lines)
        if heads >= set(PLACE_COLUMNS):
            used.update(PLACE_COLUMNS)
            points = replace(points, places=_numbers(pair_lines, PLACE_COLUMNS))
        arguments["pairs"] = points
    else:
        used = {"first", "second"}
        arguments["pairs"] = [(line.cells["first"], line.cells["second"]) for line in lines]
        pair_lines = [[line] for line in lines]
    for head in ("area", "gap"):
        if head in heads:
            arguments[head] = _numbers(pair_lines, [head]).ravel()
            used.add(head)
    if heads >= set(NORMAL_COLUMNS):
        arguments["normal"] = _numbers(pair_lines, NORMAL_COLUMNS)
        used.update(NORMAL_COLUMNS)
    unused = heads - used
    if unused:
        usable = "area, gap and all of nx, ny, nz have one"
        if "point" in heads:
            usable += ", and beside point all of x, y, z"
        at.warn(f"columns {', '.join(sorted(unused))}: no use is made of them; {usable}")
    return arguments


def _numbers(lines_of_rows: Sequence[Sequence[Line]], heads: Sequence[str]) -> NDArray[np.float64]:
    """The numbers (rows, heads) in the columns `heads` of a table.

    A row may have several lines: the first has the numbers, the others repeat them or have empty
    cells. Raises InputError.
    """
    rows = []
    for first_line, *other_lines in lines_of_rows:
        row = [number_in(first_line.cells[head], first_line.at / head) for head in heads]
        for line in other_lines:
            for head, first in zip(heads, row, strict=True):
                at = line.at / head
                number = number_in(line.cells[head] or first_line.cells[head], at)
                if number != first:
                    raise at.refuse(f"{number:g} is not allowed; the first line has {first:g}")
        rows.append(row)
    return np.array(rows)


def _points(lines: Sequence[Line]) -> tuple[ContactPoints, list[list[Line]]]:
    """The contact points, without places, of a table that has a line for each node of a point, and
    the lines of each. Raises InputError."""
    lines_by_point: dict[str, list[Line]] = defaultdict(list)
    for line in lines:
        name = line.cells["point"]
        if not name:
            raise (line.at / "point").must_be("", "the name of a point")
        lines_by_point[name].append(line)
    lines_of_points = list(lines_by_point.values())
    first, first_weights = _nodes_of_points(lines_of_points, "first")
    second, second_weights = _nodes_of_points(lines_of_points, "second")
    return ContactPoints(first, second, first_weights, second_weights), lines_of_points


def _nodes_of_points(
    lines_of_points: Sequence[Sequence[Line]], side: str
) -> tuple[NDArray[np.str_], NDArray[np.float64]]:
    """Labels and weights (points, a) of the nodes of each point on the side `first` or `second`.

    a is the largest number of nodes of a point; points with fewer nodes are padded by empty labels
    of weight 0. A line with a weight and no label stands for nodes that do not move. Raises
    InputError.
    """
    labels: list[list[str]] = []
    weights: list[list[float]] = []
    head = f"{side}_weight"
    for lines_of_point in lines_of_points:
        at = lines_of_point[0].at
        weight_of_node: dict[str, float] = defaultdict(float)
        for line in lines_of_point:
            label = line.cells[side]
            text = line.cells[head]
            if label or text:
                weight_of_node[label] += number_in(text, line.at / head)
        if not weight_of_node:
            raise at.refuse(f"its point has no node in the column {side}")
        total = sum(weight_of_node.values())
        if abs(total) > MOST_WEIGHT:
            raise at.refuse(f"{head} of its point adds up to {total:g}; -1 to 1 is allowed")
        if "" in weight_of_node:  # what does not move adds nothing to the motion of the point
            weight_of_node[""] = 0.0
        labels.append(list(weight_of_node))
        weights.append(list(weight_of_node.values()))
    padded_labels = [*zip_longest(*labels, fillvalue="")]  # (a, points)
    padded_weights = [*zip_longest(*weights, fillvalue=0.0)]
    return np.array(padded_labels).T, np.array(padded_weights).T


def write_points(path: Path, contact: Contact) -> None:
    """Write the points of a contact between faces as the table that the key `pairs` names.

    A line holds a node of either side with its weight. A point of 1 node on the first side and 4 on
    the second one has 4 lines, with blank cells for the first side in three; each line repeats
    area, normal and place of the point. Nodes that do not move are no nodes of the component: their
    common weight has a line with a blank node, so that the weights of a side add up to 1.
    """
    points = contact.pairs
    rows: list[list[object]] = []
    for i in range(len(points)):
        nodes_of_sides = []  # (label, weight) of each node of the first and of the second side
        for number in (0, 1):
            labels, weights = points.side(number)
            used = np.flatnonzero(weights[i])
            nodes = [*zip(labels[i, used].tolist(), weights[i, used].tolist(), strict=True)]
            unmoved = 1.0 - weights[i].sum()
            if abs(unmoved) > WEIGHT_ROUNDING:
                nodes.append(("", unmoved))
            nodes_of_sides.append(nodes)
        of_point = [contact.area[i], *contact.normal[i], *points.places[i]]
        for first, second in zip_longest(*nodes_of_sides, fillvalue=("", "")):
            rows.append([i + 1, *first, *second, *of_point])
    write_csv(path, [*POINT_COLUMNS, "area", *NORMAL_COLUMNS, *PLACE_COLUMNS], rows)


def _joint_coordinates(
    components: Sequence[_LocatedComponent], reduced: Sequence[Component]
) -> Coordinates:
    """The nodes of the rows of all components, one after the other, and their elements.

    The rows are those before the reduction; `reduced` components have the bases that lead back to
    them, for mode shapes.
    """
    names: list[str] = []
    nodes = []
    cells: list[tuple[str, Corners]] = []
    elements: list[str] = []
    for body, coordinates in components:
        nodes_before = len(names)  # nodes of the components so far
        nodes.append(coordinates.nodes + nodes_before)
        names += [f"{body.name} {node}" for node in coordinates.names]
        elements += [f"{body.name} {element}" for element in coordinates.elements]
        for kind, corners in coordinates.cells:
            cells.append((kind, tuple(corner + nodes_before for corner in corners)))
    bases: list[NDArray[np.float64]] = []
    if any(body.basis is not None for body in reduced):
        for body in reduced:  # without a basis a component was reduced by its file: its rows stay
            bases.append(np.eye(body.system.n) if body.basis is None else body.basis)
    return Coordinates(
        nodes=np.concatenate(nodes),
        directions=np.concatenate([component.coordinates.directions for component in components]),
        places=np.concatenate([component.coordinates.places for component in components]),
        names=tuple(names),
        cells=tuple(cells),
        elements=tuple(elements),
        bases=tuple(bases),
    )
