"""The file form of an assembly: what its commands answer is what Python joins."""

import functools
import json
import shutil
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.linalg import eigvalsh
from scipy.sparse import load_npz, save_npz, triu

import squeal
from squeal.cli.main import main
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.queries.systems.seat import seat_parameters
from squeal.results.sources import SystemSource

BAND = (500.0, 4000.0)  # Hz
GROWS = (2500.0, 4000.0)  # Hz, the part of it with the modes that friction joins
TOP = 8000.0  # the cut-off, twice the upper end of the band


@pytest.fixture(scope="module")
def brake(tmp_path_factory):
    """A brake of disc and pad as files, and the same parts in Python."""
    from squeal.examples.brake import solid_brake, write_parts

    made = solid_brake(500, around=12)
    folder = tmp_path_factory.mktemp("brake")
    write_parts(folder, made)
    bodies = made.bodies
    contact = made.contact
    gap = np.arange(len(contact.pairs)) % 3 * 1e-5  # m
    heads, *lines = (folder / "pairs.csv").read_text().splitlines()
    rows = [f"{line},{x}" for line, x in zip(lines, gap.tolist(), strict=True)]
    (folder / "pairs.csv").write_text("\n".join([f"{heads},gap", *rows]))
    file = folder / "assembly.yaml"
    file.write_text(file.read_text().replace("mu: 0.4", "mu: 0.5"))  # at which modes grow
    return file, bodies, replace(contact, gap=gap)


@pytest.fixture(scope="module")
def exported(brake, tmp_path_factory):
    """The file of the brake as it is exported, with reduced parts."""
    path, *_ = brake
    small = tmp_path_factory.mktemp("exported") / "small"
    assert main(["export", str(path), "--band", "500:4000", "--output", str(small)]) == 0
    return small / "assembly.yaml"


def answer(capsys, *given):
    assert main(["eigenvalues", *map(str, given), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("pressure", [1e6, 1e8])  # some pairs closed, all of them
def test_a_file_answers_as_python_and_its_export_do(brake, exported, capsys, pressure):
    path, (disc, pad), contact = brake
    sets = ["mu=0.3", "contact=0.9", "wear=1e-6", f"pressure={pressure}"]
    varied = ["--band", "500:4000", *(word for one in sets for word in ("--set", one))]
    read = answer(capsys, path, *varied)
    pressed = replace(pad, load=pressure * pad.load)
    worn = replace(contact, gap=1e-6 + contact.gap)
    joined = squeal.assemble([disc, pressed], [worn], {"mu": 0.3, "contact": 0.9}, cutoff=TOP)
    values = squeal.eigenvalues(joined.system, band=BAND).values
    (found,) = read["contact"]
    (seat,) = joined.seats
    expected = seat.summary()
    assert found.pop("between") == expected.pop("between")
    assert found == pytest.approx(expected, rel=1e-12)
    assert (found["closed"] < len(contact.pairs)) == (pressure == 1e6)
    again = answer(capsys, exported, *varied)
    for e, other in zip(read["eigenvalues"], again["eigenvalues"], strict=True):
        assert e["error"] == pytest.approx(other["error"], rel=0.01, abs=1e-9)
    for one in (read, again):
        roots = np.array([complex(e["real"], e["imag"]) for e in one["eigenvalues"]])
        assert len(roots) == len(values)
        for z in values:  # a pair of nearly one frequency is sensitive
            assert np.abs(roots - z).min() <= 1e-6 * abs(z)


def test_an_export_takes_a_load_factor_that_is_a_number(brake, tmp_path, capsys):
    """It is divided by its value at the present parameters, as a formula is."""
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    document["components"]["pad"]["load"]["factor"] = 1e8
    del document["parameters"]["pressure"]
    file = path.with_name("number.yaml")
    file.write_text(yaml.safe_dump(document))
    out = tmp_path / "out"
    assert main(["export", str(file), "--band", "500:900", "--output", str(out)]) == 0
    capsys.readouterr()
    (seat,) = answer(capsys, file, "--band", "500:900")["contact"]
    (again,) = answer(capsys, out / "assembly.yaml", "--band", "500:900")["contact"]
    assert seat["force"] > 0.0
    assert again["force"] == pytest.approx(seat["force"], rel=1e-9)


def test_no_export_divides_a_load_by_zero(brake, tmp_path, capsys):
    """Joints need no load; of one that is zero now the file could not give the forces."""
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    document["contact"][0]["bonded"] = True
    document["parameters"]["pressure"] = 0.0
    file = path.with_name("joined.yaml")
    file.write_text(yaml.safe_dump(document))
    out = tmp_path / "out"
    assert main(["export", str(file), "--band", "500:900", "--output", str(out)]) == 2
    assert "components.pad.load.factor: is 0, so that no force is known" in capsys.readouterr().err
    assert not out.exists()


def test_an_export_without_components_holds_its_contact_by_assumption(brake, tmp_path, capsys):
    """The joined system cannot seat its contact anew: what was open was proved of the export."""
    path, *_ = brake
    for pressure, is_assumed in ((1e6, True), (1e8, False)):  # some pairs closed, all of them
        out = tmp_path / f"{pressure:g}"
        given = [str(path), "--set", f"pressure={pressure}", "--method", "full"]
        assert main(["export", *given, "--output", str(out)]) == 0
        capsys.readouterr()
        texts = yaml.safe_load((out / "system.yaml").read_text()).get("assumptions", [])
        held = [text for text in texts if text.startswith("contact is held as it is seated")]
        assert len(held) == is_assumed


def test_an_export_has_one_cutoff_and_warns_beyond_it(exported, capsys):
    assert main(["eigenvalues", str(exported), "--set", "cutoff=2e4"]) == 2
    beyond = answer(capsys, exported, "--band", "7900:8100")
    assert len(beyond["warnings"]) == 1


def test_a_turning_component_has_the_same_errors_read_again(brake, tmp_path, capsys):
    """Gyroscopic matrices change under transposition; what a component lacks is kept of both."""
    shutil.copytree(brake[0].parent, tmp_path / "brake")
    path = tmp_path / "brake" / "assembly.yaml"
    damping = tmp_path / "brake" / "pad" / "C0.npz"
    half = triu(load_npz(damping.with_name("M0.npz")), 1)
    save_npz(damping, load_npz(damping) + 2e3 * (half - half.T))
    read = answer(capsys, path, "--band", "500:4000")
    assert main(["export", str(path), "--band", "500:4000", "--output", str(tmp_path / "s")]) == 0
    capsys.readouterr()
    again = answer(capsys, tmp_path / "s" / "assembly.yaml", "--band", "500:4000")
    errors = [e["error"] for e in read["eigenvalues"]]
    others = [e["error"] for e in again["eigenvalues"]]
    assert errors == pytest.approx(others, rel=0.01, abs=1e-9)
    assert max(errors) > 1e-3


def test_modes_of_a_reduced_assembly_are_paired_on_all_nodes(brake, tmp_path, capsys):
    """Shapes of the full model, written as a test of two nodes inside, name the reduced modes."""
    path, bodies, contact = brake
    full = squeal.eigenvalues(squeal.read_system(path), band=BAND)
    assert isinstance(full.source, SystemSource)
    where = full.source.file.coordinates
    inside = set(bodies[0].nodes) - set(contact.pairs[:, 0])
    chosen = [where.names.index(f"disc {node}") for node in sorted(inside)[:2]]
    upper = dict(zip(full.modes.tolist(), full.eigenvalues, strict=True))
    heads = [f"{where.names[k]}:{way}" for k in chosen for way in "xyz"]
    lines = [",".join(["name", "frequency_hz", *heads])]
    for number, mode in upper.items():
        u = where.displacements(mode.right)[chosen].ravel()
        u = u if mode.value.imag > 0 else u.conj()
        lines.append(",".join([f"T{number}", repr(mode.frequency_hz), *map(repr, u.tolist())]))
    (tmp_path / "test.csv").write_text("\n".join(lines))
    found = answer(capsys, path, "--band", "500:4000", "--test", tmp_path / "test.csv")["pairs"]
    assert {pair["reference"]: pair["mode"] for pair in found} == {f"T{k}": k for k in upper}
    assert min(pair["mac"] for pair in found) > 0.99


def test_elements_of_components_are_those_of_the_assembly(brake, tmp_path):
    """They were dropped, so that a shape of joined components was points."""
    path, *_ = brake
    shutil.copytree(path.parent, tmp_path, dirs_exist_ok=True)
    file = tmp_path / "pad" / "system.yaml"
    nodes = [line.split(",")[0] for line in (tmp_path / "pad" / "nodes.csv").read_text().split()]
    corners = list(dict.fromkeys(nodes[1:]))[:4]
    (tmp_path / "pad" / "cells.csv").write_text(
        f"element,type,a,b,c,d\n7,tetra,{','.join(corners)}"
    )
    file.write_text(file.read_text() + "elements: {file: cells.csv}\n")
    where = squeal.read_system(tmp_path / path.name).coordinates
    own = squeal.read_system(file).coordinates
    assert where.elements == ("pad 7",)
    kind, found = where.cells[0]
    kind_of_own, expected = own.cells[0]
    assert kind == kind_of_own
    assert [where.names[k] for k in found] == [f"pad {corner}" for corner in corners]
    assert np.array_equal(where.places[list(found)], own.places[list(expected)])


def test_a_number_given_twice_is_refused_and_a_strange_column_named(brake, tmp_path, capsys):
    path, *_ = brake
    text = path.read_text()
    table = (path.parent / "pairs.csv").read_text()
    (path.parent / "more.csv").write_text(table.replace("gap", "wear"))
    more = path.with_name("more.yaml")
    more.write_text(text.replace("pairs.csv", "more.csv"))
    assert "wear" in answer(capsys, more, "--band", "500:900")["warnings"][0]
    more.write_text(text.replace("  stiffness", "  area: 1.0\n  stiffness"))
    assert main(["eigenvalues", str(more)]) == 2
    assert main(["eigenvalues", str(path), "--set", "contact.1.stiffness=3e11"]) == 2


def test_errors_of_a_reduced_assembly_are_those_against_the_full_one(brake, capsys):
    path, *_ = brake
    top = 2900.0  # Hz; a mode grows at 3000 Hz
    read = answer(capsys, path, "--band", f"500:{top}")
    full = squeal.eigenvalues(squeal.read_system(path), band=(0.0, 2.0 * top))
    exact = full.values
    errors = [e["error"] for e in read["eigenvalues"]]
    for e in read["eigenvalues"]:
        away = np.abs(exact - complex(e["real"], e["imag"])).min()
        assert 0.5 * away <= e["error"]
        assert e["error"] <= 4.0 * away + 1e-8 * e["imag"]
    assert max(errors) > 1e-3
    basis = read["basis"]
    inside = sum(500.0 <= m.frequency_hz <= top for m in full.unstable)
    assert (basis["rows"], basis["cutoff_hz"]) == (full.details["rows"], 2.0 * top)
    assert 0 < read["growing_outside"] <= len(full.unstable) - inside


@pytest.fixture(scope="module")
def exact_thresholds(brake):
    """Those of the full brake with bonded parts."""
    _, bodies, contact = brake
    full = squeal.assemble(bodies, [replace(contact, bonded=True)], {"mu": 0.4}, cutoff=None)
    return squeal.thresholds(full, 1.0, band=BAND)


@pytest.mark.parametrize("cutoff", [6e3, TOP])
def test_thresholds_of_reduced_components_hold_those_of_the_full_ones(
    brake, exact_thresholds, cutoff
):
    """In intervals that are not much wider than what the reduction moves."""
    _, bodies, contact = brake
    small = squeal.assemble(bodies, [replace(contact, bonded=True)], {"mu": 0.4}, cutoff=cutoff)
    exact = exact_thresholds
    found = squeal.thresholds(small, 1.0, band=BAND)
    assert exact.certified
    assert not found.certified
    assert len(found.crossings) == len(exact.crossings) > 0
    for near, true in zip(found.crossings, exact.crossings, strict=True):
        away = abs(near.mu - true.mu)
        low, high = near.interval
        assert low <= true.mu <= high
        assert high - low <= 10 * away + 1e-8


def test_a_growth_within_its_error_is_open_in_the_first_line(brake):
    _, (disc, pad), contact = brake
    bodies = [disc, replace(pad, load=2e6 * pad.load)]
    small = squeal.assemble(bodies, [contact], {"mu": 0.4}, cutoff=TOP)
    crossings = squeal.thresholds(small, 1.0, band=GROWS).crossings
    assert crossings
    for mu in crossings:
        at = squeal.eigenvalues(small, mu.mu, band=GROWS)
        (near,) = (
            e
            for e in at.eigenvalues
            if abs(e.frequency_hz - mu.frequency_hz) < 1 and e.sign_is_open
        )
        assert near.kind == "marginal"
        assert at.verdict in (None, "flutter")
        assert at.unstable or "Open" in at.conclusion


def test_the_reference_pressure_scales_the_stiffness(brake, tmp_path, capsys):
    """k (p/r)^e is k r^-e (p/1 Pa)^e."""
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    more = path.with_name("more.yaml")
    found = []
    contact = document["contact"][0]
    stiffness = 1e-2 * contact["stiffness"]
    for law in ({"stiffness": stiffness, "reference": 0.25}, {"stiffness": 2 * stiffness}):
        more.write_text(yaml.safe_dump(document | {"contact": [contact | law | {"exponent": 0.5}]}))
        roots = answer(capsys, more, "--band", "500:900", "--set", "pressure=1e8")["eigenvalues"]
        found.append([e["imag"] for e in roots])
    assert found[0]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "value", "named"),
    [
        *((("contact", 0, key), None, key) for key in ("between", "pairs", "stiffness")),
        *((("contact", 0, key), 0, key) for key in ("reference", "area")),
        *((("contact", 0, key), [1, 0], key) for key in ("normal", "sliding", "through")),
        (("contact", 0, "exponent"), 1.0, "exponent"),
        (("contact", 0, "between"), ["disc"], "between"),
        (("contact",), None, "contact"),
        (("components", "disc", "file"), None, "file"),
        (("components", "pad", "load", "file"), None, "file"),
        (("components", "disc", "reduced"), {"cutoff": 9000.0}, "rows"),
        (("components", "disc", "reduced"), {"rows": 0, "cutoff": 9000.0}, "rows"),
        (("components", "disc", "reduced"), {"rows": 9}, "cutoff"),
    ],
)
def test_what_a_contact_and_its_components_need_is_required(brake, capsys, keys, value, named):
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    more = path.with_name("more.yaml")
    holder = functools.reduce(lambda own, key: own[key], keys[:-1], document)
    last = keys[-1]
    holder.pop(last, None)
    holder |= {} if value is None else {last: value}
    more.write_text(yaml.safe_dump(document))
    assert main(["eigenvalues", str(more)]) == 2
    assert named in capsys.readouterr().err


def reduced_up_to(path, cutoff):
    document = yaml.safe_load(path.read_text()) | {"cutoff": cutoff}
    more = path.with_name("more.yaml")
    more.write_text(yaml.safe_dump(document))
    return squeal.read_system(more)


def test_the_check_of_reduced_components_says_what_is_of_the_full_ones(brake):
    path, _, _ = brake
    full = squeal.check(squeal.read_system(path))
    reduced = squeal.check(reduced_up_to(path, TOP))
    assert full.mass is not None
    assert (reduced.mass, reduced.centre, reduced.size, reduced.hints) == (None, None, None, ())
    assert reduced.frequencies_hz == pytest.approx(full.frequencies_hz, rel=1e-4)
    assert "not known of reduced components" in str(reduced)
    low = squeal.check(reduced_up_to(path, 2000.0), modes=100)
    assert max(low.frequencies_hz) <= 2000.0


@pytest.mark.usefixtures("coarse_charts", "without_layout")
def test_a_page_of_reduced_components_names_no_mass(brake):
    path, _, _ = brake
    page = path.with_name("page.html")
    assert main(["report", str(path), "--band", "500:2000", "--output", str(page)]) == 0
    text = page.read_text()
    assert "mass and box: not known of reduced components" in text
    assert "mass of the rows that move" not in text


def test_friction_without_a_direction_is_refused(brake, tmp_path):
    path, bodies, contact = brake
    shutil.copytree(path.parent, tmp_path / "brake")
    document = yaml.safe_load(path.read_text())
    (law,) = document["contact"]
    del law["axis"]
    aimless = tmp_path / "brake" / "aimless.yaml"
    aimless.write_text(yaml.safe_dump(document))
    named = r"aimless\.yaml: contact disc - pad: friction: mu is 0\.5 and has no direction"
    with pytest.raises(InputError, match=named):
        squeal.read_system(aimless)
    law["friction"] = 0
    aimless.write_text(yaml.safe_dump(document))
    assert squeal.read_system(aimless).assembly.seats[0].closed.any()
    nowhere = replace(contact, axis=None)
    with pytest.raises(InputError, match=r"friction: mu is 0\.3"):
        squeal.assemble(bodies, [nowhere], {"mu": 0.3})
    joint = replace(nowhere, bonded=True)  # which does not slide
    assert squeal.assemble(bodies, [joint], {"mu": 0.3}).seats[0].closed.all()


def test_thresholds_name_their_seat_and_are_certified_in_it_alone(brake):
    """Pairs open with friction, where the file seats them without and gaps differ."""
    _, (disc, pad), contact = brake
    bodies = [disc, replace(pad, load=2e6 * pad.load)]
    seated = squeal.assemble(bodies, [contact], {"mu": 0.1})
    found = squeal.thresholds(seated, 1.0, band=GROWS)
    note = "contact is that seated at mu = 0.1; mu=VALUE in the file seats it anew"
    assert note in found.seat
    is_another = False
    for crossing in found.crossings:
        anew = squeal.assemble(bodies, [contact], {"mu": crossing.mu})
        is_another |= not np.array_equal(anew.seats[0].closed, seated.seats[0].closed)
    assert is_another
    assert not found.certified
    assert all(str(found).count(doubt) == 1 for doubt in found.seat[1:])
    assert len(found.seat) > 1
    closed = squeal.assemble(bodies, [replace(contact, gap=0.0)], {"mu": 0.1})
    same = squeal.thresholds(closed, 1.0, band=GROWS)
    assert same.crossings
    assert same.certified
    assert note in same.seat
    low = squeal.sweep(seated, [0.1, 0.2], band=GROWS)
    assert note in str(low)
    at = squeal.eigenvalues(seated, 0.1, band=GROWS)
    assert note in "\n".join(at.notes)
    advice = squeal.advise(seated, high=1.0, band=GROWS)
    assert note in str(advice)
    joint = squeal.assemble(bodies, [replace(contact, bonded=True)], {"mu": 0.1})
    assert "seated" not in str(squeal.sweep(joint, [0.1, 0.2], band=GROWS))


def test_without_a_threshold_another_seat_along_the_range_withdraws_the_certificate():
    """Seated at mu = 0.95 one of two pairs is open and a mode grows; in the held seat none does."""
    rng = np.random.default_rng(95)
    A = rng.normal(size=(4, 4))
    K = 10 * A @ A.T + 0.5 * np.eye(4)
    M = np.diag(rng.integers(1, 4, 4).astype(float))
    load = np.array([0, -1.0, 0, -1.0]) * rng.uniform(0.5, 2, 4)
    K_disc = np.diag([200.0, 200.0])
    disc = squeal.System(np.eye(2), 0.02 * K_disc, K_disc, name="disc")
    pad = squeal.System(M, 0.02 * K, K, name="pad")
    bodies = [
        squeal.Component(disc, [1, 2], [2, 2]),
        squeal.Component(pad, [1, 1, 2, 2], [0, 2, 0, 2], load=load.tolist()),
    ]
    pairs = [(1, 1), (2, 2)]
    touch = squeal.Contact(("disc", "pad"), pairs, (0, 0, 1), stiffness=50.0, sliding=(1, 0, 0))
    held = squeal.thresholds(squeal.assemble(bodies, [touch], {"mu": 0.0}), high=2.0)
    assert not held.crossings
    assert not held.certified
    assert str(held).count("seated anew at mu = 1 it is another contact") == 1
    anew = squeal.eigenvalues(squeal.assemble(bodies, [touch], {"mu": 0.95}))
    assert anew.verdict == "flutter"


@pytest.mark.parametrize(
    ("keys", "load", "is_assumed"),
    [
        ({}, -6.0, False),  # it is closed, and its stiffness is a number
        ({"gap": [0.0, 1.0]}, -6.0, True),  # one of two pairs is open
        ({"exponent": 0.5}, -6.0, True),
        ({"exponent": 0.9, "reference": 12.0}, -12.0, True),
        ({"speed": "5.0"}, -6.0, True),  # forces damp
    ],
)
def test_the_system_of_components_alone_holds_its_contact_by_assumption(keys, load, is_assumed):
    disc = squeal.System(np.eye(2), np.eye(2), 200.0 * np.eye(2), name="disc")
    pad = squeal.System(np.eye(4), np.eye(4), 10.0 * np.eye(4), name="pad")
    bodies = [
        squeal.Component(disc, [1, 2], [2, 2]),
        squeal.Component(pad, [1, 1, 2, 2], [0, 2, 0, 2], load=[0.0, load, 0.0, load]),
    ]
    keys = {"stiffness": 50.0, "sliding": (1, 0, 0)} | keys
    touch = squeal.Contact(("disc", "pad"), [(1, 1), (2, 2)], (0, 0, 1), **keys)
    joined = squeal.assemble(bodies, [touch], {"mu": 0.1})
    assumed = [text for text in joined.system.assumptions if "held as it is seated at mu" in text]
    assert len(assumed) == is_assumed
    assert not joined.seated_system.assumptions
    assert squeal.eigenvalues(joined).certified
    alone = squeal.thresholds(joined.system, high=1.0)
    assert alone.certified is not is_assumed
    assert not is_assumed or assumed[0] in alone.doubts


def test_a_free_parameter_of_a_load_alone_is_noted_and_certifies_nothing(brake):
    """No matrix depends on the pressure, but contact that stiffens with it is another at each."""
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    document["contact"][0] |= {"exponent": 0.5, "reference": 2e6}
    more = path.with_name("pressure.yaml")
    more.write_text(yaml.safe_dump(document | {"parameter": "pressure"}))
    file = squeal.read_system(more)
    held = document["parameters"]["pressure"]
    found = squeal.sweep(file, [held, 2.0 * held], band=GROWS)
    assert f"seated at pressure = {held:g}" in str(found)
    assert not squeal.thresholds(file, 2.0 * held, band=GROWS).certified
    assert "pressure" not in squeal.sensitivity(file, band=GROWS).values


def test_a_parameter_without_use_is_named_and_acts_through_no_seat(brake, tmp_path):
    path, *_ = brake
    folder = shutil.copytree(path.parent, tmp_path / "brake")
    text = path.read_text()
    (folder / path.name).write_text(text.replace("parameters:", "parameters:\n  wera: 1.0e-6"))
    with pytest.warns(InputWarning, match="parameters: no matrix depends on wera; matrices depend"):
        file = squeal.read_system(folder / path.name)
    assert seat_parameters(file) == ["contact", "pressure", "wear"]


def test_what_acts_through_the_seat_has_no_derivative(brake):
    """With all pairs closed the factor of a constant stiffness has that of a bonded contact."""
    path, (disc, pad), contact = brake
    file = squeal.read_system(path)
    assert not file.assembly.seats[0].closed.all()
    for moved in (
        squeal.sensitivity(file, band=GROWS),
        squeal.sensitivity(file, of="threshold", band=GROWS),
    ):
        assert not {"pressure", "wear", "contact"} & moved.values.keys()
        assert "contact, pressure, wear act through the seat: contact=VALUE in the file" in str(
            moved
        )
    advice = squeal.advise(file, band=GROWS)
    assert [lever.parameter for lever in advice.levers] == ["tangential"]
    assert "contact, pressure, wear act through the seat" in str(advice)
    axes = squeal.Axis("contact", 0.5, 2.0, 2), squeal.Axis("mu", 0.0, 0.2, 2)
    chart = squeal.map(file, axes, band=GROWS)
    assert "contact, pressure, wear act through the seat" in str(chart)
    for refused in (
        lambda: squeal.map(file, (squeal.Axis("wear", 0.0, 1.0, 2), axes[1]), band=GROWS),
        lambda: squeal.optimise(file, {"wear": (0.0, 1.0)}, band=GROWS),
        lambda: squeal.scatter(file, {"wear": {"within": 0.1}}, 8, of="growth", band=GROWS),
    ):
        with pytest.raises(InputError, match=r"wear is not .* contact stays as it is seated"):
            refused()
    closed = replace(contact, gap=0.0)
    slopes = []
    for touch in (closed, replace(closed, bonded=True)):
        joined = squeal.assemble([disc, pad], [touch], {"mu": 0.1})
        slopes.append(squeal.sensitivity(joined, band=GROWS).slopes["contact"])
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-6)


def test_contact_whose_forces_damp_has_no_derivative(brake):
    """The forces at the pairs follow the stiffness of contact, and friction damps by them."""
    _, (disc, pad), contact = brake
    damped = replace(contact, gap=0.0, speed="5.0")
    moved = squeal.sensitivity(squeal.assemble([disc, pad], [damped], {"mu": 0.1}), band=BAND)
    assert "contact" not in moved.values
    assert "contact" in str(moved)


def test_friction_without_a_direction_is_refused_where_it_is_varied(brake):
    _, (disc, pad), contact = brake
    aside = replace(contact, sliding=None, axis=None)
    rests = squeal.assemble([disc, pad], [aside], {"mu": 0.0})
    assert squeal.eigenvalues(rests, band=BAND).certified
    for ask in (
        lambda: squeal.thresholds(rests, 1.0, band=BAND),
        lambda: squeal.sweep(rests, [0.0, 0.5], band=BAND),
    ):
        with pytest.raises(InputError, match="has no direction"):
            ask()


def test_faces_without_a_distance_miss_the_distance(brake):
    path, *_ = brake
    document = yaml.safe_load(path.read_text())
    (law,) = document["contact"]
    del law["pairs"]
    law["faces"] = ["all", "all"]
    more = path.with_name("more.yaml")
    more.write_text(yaml.safe_dump(document))
    with pytest.raises(InputError, match=r"contact\.1\.distance: missing; faces needs it"):
        squeal.read_system(more)


@pytest.mark.parametrize(
    ("mass", "length", "words"),
    [
        (1e-12, 1.0, "pad: a mass of .* times the density of disc"),  # t/mm^3 beside m
        (1.0, 1e3, "pad: nodes .* apart, those of disc"),
    ],
)
def test_components_in_other_units_are_named(brake, tmp_path, mass, length, words):
    path, _, _ = brake
    folder = tmp_path / "brake"
    shutil.copytree(path.parent, folder)
    document = yaml.safe_load(path.read_text())
    pad = folder / document["components"]["pad"]["file"]
    keys = yaml.safe_load(pad.read_text())
    for term in keys["M"]:
        term["factor"] = mass
    pad.write_text(yaml.safe_dump(keys))
    table = pad.parent / keys["coordinates"]["file"]
    heads, *lines = table.read_text().splitlines()
    first = heads.split(",").index("x")
    moved = [heads]
    for line in lines:
        cells = line.split(",")
        for axis in range(first, first + 3):
            cells[axis] = repr(length * float(cells[axis]))
        moved.append(",".join(cells))
    table.write_text("\n".join(moved))
    with pytest.warns(InputWarning, match=words), suppress(InputError, ComputationError):
        squeal.read_system(folder / "assembly.yaml")


def chain_assembly(folder, name, disc, cutoff="cutoff: 0.15", node=6):
    """The path of an assembly of two chains of six masses, the keys of its disc given as text."""
    K = 2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    np.savez(folder / "m.npz", np.eye(6))
    np.savez(folder / "k.npz", K)
    nodes = "".join(f"{i},z,{i},0,0\n" for i in range(1, 7))
    (folder / "n.csv").write_text("node,dof,x,y,z\n" + nodes)
    (folder / "c.yaml").write_text(
        "M: {file: m.npz}\nK: {file: k.npz}\ncoordinates: {file: n.csv}\n"
    )
    (folder / f"{name}.csv").write_text(f"first,second\n{node},1\n")
    (folder / "load.csv").write_text("node,dof,force\n1,z,-5\n")
    (folder / f"{name}.yaml").write_text(
        f"{cutoff}\ncomponents:\n  disc: {disc}\n"
        "  pad: {file: c.yaml, load: {file: load.csv}}\n"
        f"contact:\n  - {{between: [disc, pad], pairs: {{file: {name}.csv}}, normal: [0, 0, 1], "
        "stiffness: 2.0, friction: 0}\n"
    )
    return folder / f"{name}.yaml"


REDUCED_DISC = (
    "file: small/disc/system.yaml, reduced: "
    "{rows: 6, cutoff: 0.15, residual_flexibility: small/disc/flexibility.mtx}"
)


def test_a_component_that_was_reduced_before_moves_beside_one_reduced_now(tmp_path):
    both = chain_assembly(tmp_path, "both", "{file: c.yaml}")
    assert main(["export", str(both), "--output", str(tmp_path / "small")]) == 0
    one = chain_assembly(tmp_path, "one", f"{{{REDUCED_DISC}}}")
    moved = {}
    for name, path in {"both": both, "one": one}.items():
        file = squeal.read_system(path)
        shape = squeal.eigenvalues(file).eigenvalues[0].right
        moved[name] = np.abs(file.coordinates.displacements(shape)[:, 2])
    # the pad, and of the disc what its file still has: its node in contact
    assert moved["one"][-6:] == pytest.approx(moved["both"][-6:])
    assert moved["one"].max() == pytest.approx(moved["both"].max())


def test_a_reduced_component_cannot_be_rotated(tmp_path, capsys):
    """Its modes belong to no node, so that they would get no Coriolis forces."""
    both = chain_assembly(tmp_path, "both", "{file: c.yaml}")
    assert main(["export", str(both), "--output", str(tmp_path / "small")]) == 0
    capsys.readouterr()
    turning = "rotation: {axis: [1, 0, 0], speed: 0.1}"
    one = chain_assembly(tmp_path, "one", f"{{{REDUCED_DISC}, {turning}}}")
    assert main(["eigenvalues", str(one)]) == 2
    refusal = capsys.readouterr().err
    assert "one.yaml: components.disc.rotation: " in refusal
    assert "rotate the full component, then reduce it" in refusal


@pytest.mark.parametrize("cutoff", ["cutoff: 5", "cutoff: 0.15"])
def test_an_assembly_is_a_component_as_long_as_its_own_are_full(tmp_path, cutoff):
    """With all modes kept the rows have the number of the full ones, but move other things."""
    chain_assembly(tmp_path, "inner", "{file: c.yaml}", "")
    outer = chain_assembly(tmp_path, "outer", "{file: inner.yaml}", "", node="pad 6")
    M, _, K = squeal.read_system(outer).system.arrays()
    chain = 2 * np.eye(18) - np.eye(18, k=1) - np.eye(18, k=-1)
    for end in (5, 11):  # two chains end; springs of stiffness 2 join them
        chain[end : end + 2, end : end + 2] += [[2.0, -1.0], [-1.0, 2.0]]
    assert eigvalsh(K, M) == pytest.approx(eigvalsh(chain))
    chain_assembly(tmp_path, "inner", "{file: c.yaml}", cutoff)
    with pytest.raises(InputError, match=r"disc.*file: joins reduced components"):
        squeal.read_system(outer)


def test_a_table_of_pairs_is_exported_as_it_stands_in_any_letters(tmp_path):
    system = "M: [[1]]\nK: [[2]]\ncoordinates: {file: n.csv}\n"
    (tmp_path / "c.yaml").write_text(system)
    (tmp_path / "n.csv").write_text("node,dof,x,y,z\n1,z,0,0,0\n")
    pairs = "first,second,geprüft\n1,1,von Jörg\n".encode("latin-1")
    (tmp_path / "pairs.csv").write_bytes(pairs)
    (tmp_path / "a.yaml").write_text(
        "components: {disc: {file: c.yaml}, pad: {file: c.yaml}}\n"
        "contact:\n  - {between: [disc, pad], pairs: {file: pairs.csv}, normal: [0, 0, 1], "
        "stiffness: 2.0, friction: 0, bonded: true}\n"
    )
    out = tmp_path / "out"
    assert main(["export", str(tmp_path / "a.yaml"), "--output", str(out)]) == 0
    assert (out / "pairs1.csv").read_bytes() == pairs
    assert {path.name for path in out.iterdir()} == {"assembly.yaml", "disc", "pad", "pairs1.csv"}


def test_blanks_beside_the_commas_of_a_table_change_no_answer(tmp_path):
    path = chain_assembly(tmp_path, "joined", "{file: c.yaml}")
    plain = squeal.eigenvalues(squeal.read_system(path)).values
    for name in ("joined.csv", "load.csv", "n.csv"):
        table = tmp_path / name
        table.write_text(table.read_text().replace(",", " , "))
    spaced = squeal.eigenvalues(squeal.read_system(path)).values
    assert spaced.tolist() == plain.tolist()
