"""Scene files: what is accepted, and one clear sentence for everything that is not."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from squeal import schema
from squeal.errors import InputError
from squeal.io.scene import check_simulation, read_scene
from squeal.model.contact import CONSISTENT, MODELS, Formulation, models_with
from squeal.model.pad import PARAMETERS
from squeal.schema import Place, document_text, parse_document, scalar

VALUES = {
    "m": "1.0", "w": "0.05", "h": "0.02", "I": "0.001", "k1": "1.0e6", "k2": "1e6", "k3": "2.0e6",
    "k4": "2.0e+6", "k_c": "4.0e6", "L1": ".5", "L2": "0.5", "alpha1": "0.75*pi",
    "alpha2": "3*pi/4", "mu": "0.4", "mu_s": "0.5", "mu_k": "0.3", "v_ref": "2.0", "F_n": "500",
    "V": "5.0", "x0": "0.0", "y0": "-1.0e-4", "theta0": "-0.01*pi",
}  # fmt: skip
FALLING = ("mu_s", "mu_k", "v_ref")
TIME = "time: {stop: 0.05, samples: 2001}\n"


def text(model="B1", drop=(), more="", **changes):
    """A scene of a model with all its parameters but those of friction that falls with speed;
    `changes` replaces values, `more` is appended."""
    lines = [f"model: {model}", "parameters:"]
    for name in PARAMETERS:
        used = model in models_with(name) and name not in (*drop, *FALLING)
        if used or name in changes:
            lines.append(f"  {name}: {changes.get(name, VALUES[name])}")
    return "\n".join([*lines, TIME if model != "B3" else "", more])


@pytest.fixture
def read(tmp_path):
    def reader(content):
        path = tmp_path / "scene.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_scene(path)

    return reader


def assert_refused(made, *parts):
    """One printable line refuses a scene; it names the file and all the parts."""
    with pytest.raises(InputError) as caught:
        made()
    message = str(caught.value)
    assert message.isprintable()
    for part in ("scene.yaml", *parts):
        assert part in message


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", PARAMETERS)
def test_a_parameter_out_of_its_range_or_of_another_model_is_refused_by_its_key(read, model, name):
    parameter = PARAMETERS[name]
    key = f"parameters.{name}"

    def refused(value, *parts):
        assert_refused(lambda: read(text(model, **{name: value})), key, *parts)

    if model not in models_with(name):
        refused(VALUES[name], model)
        return
    if not parameter.angle and name not in FALLING:
        assert getattr(read(text(model)).pad, name) == float(VALUES[name])
    if parameter.required:
        assert_refused(lambda: read(text(model, drop=[name])), key, model)
    else:
        read(text(model, drop=[name]))
    for bad in ("true", "[1]", "{a: 1}", "word", ".nan", ".inf", "1e999", "null", "''", "9" * 400):
        refused(bad)
    if parameter.kind.low == 0.0:
        refused("-1e-300", "-1e-300")
        if parameter.kind.low_allowed:
            read(text(model, **{name: "0"}))
        else:
            refused("0.0", "above 0")


@pytest.mark.parametrize(
    ("given", "value"),
    [("pi", 1.0), ("-pi/2", -0.5), ("0.83*pi", 0.83), ("2e-1 * pi", 0.2), ("3*pi/4", 0.75)]
    + [("+.5*pi", 0.5), ("0.5*pi*2", 1.0), ("1.25", 1.25 / math.pi), ("2", 2 / math.pi)],
)
def test_an_angle_is_a_number_of_radians_or_a_formula_of_pi(read, given, value):
    assert read(text(alpha1=given)).pad.alpha1 == pytest.approx(value * math.pi, rel=1e-15)


def test_a_face_may_turn_by_less_than_a_right_angle(read):
    for turn in ("0.45*pi", "-0.45*pi"):
        for drop in ((), ("theta0",)):
            assert read(text(drop=drop, more=f"initial: {{theta: {turn}}}\n")).initial[2] != 0.0


# value of a parameter, as it stands in the file
NO_ANGLES = ["0.75pi", "tau", "pi/0", "__import__('os')", "'0.5'", "1e400*pi", "", "pi.real"]
NO_NUMBERS = ["0x10", "1_000", "1:30", "0o17", "1e6m", "\uff11"]


@pytest.mark.parametrize(
    ("name", "given"),
    [("alpha1", f'"{given}"') for given in [*NO_ANGLES, "\u0663*pi"]]
    + [("m", given) for given in NO_NUMBERS],
)
def test_a_value_that_is_no_number_is_refused_by_its_key(read, name, given):
    assert_refused(lambda: read(text(**{name: given})), f"parameters.{name}")


# what is added to a scene, and what the refusal names
ADDED = [
    ("speed: 1", "speed"),
    ("model: B1", "line", "model"),
    ("tolerance: 0", "tolerance", "above 0"),
    ("tolerance: 2e-3", "tolerance", "0.001"),
    ("outputs: events", "outputs", "list"),
    ("outputs: [event]", "outputs", "event", "history"),
    ("initial: {z: 1}", "initial.z"),
    ("initial:", "initial", "mapping"),
    ("initial: {theta: 0.6*pi}", "initial.theta"),
    ("initial: {theta_dot: 0.1*pi}", "initial.theta_dot"),
    ("formulation: {line_force: mean}", "formulation", "B1"),
    ("damping: {ratios: [0.1, 0.1]}", "damping.ratios", "3 finite numbers"),
    ("damping: {}", "damping"),
    ("---\nmodel: B1", "line"),
    ("x: [1", "line"),
    ("? [a, b]\n: 1", "line"),
    ('"a\\nb": 1', r"a\nb"),
    ('"a\\x1b[31m": 1', r"\x1b"),
    ("tolerance: !!python/name:os.system x", "line"),
    ('tolerance: !!int "0x10"', "0x10"),
    ("tolerance: !!timestamp 2001-01-01", "line", "2001-01-01"),
    *((f"tolerance: !!{kind} x", "line", "x", kind) for kind in ("bool", "float", "map")),
    ("tolerance: &a [*a]", "nested too deeply"),
    ("\0",),
]
# times, and what the refusal names
TIMES = [
    ("{stop: 0, samples: 10}", "time.stop", "above 0"),
    ("{stop: 1}", "time.samples"),
    ("{stop: 1, samples: 1}", "time.samples", "2 to 10000000"),
    ("{stop: 1, samples: 10000001}", "time.samples"),
    ("{stop: 1, samples: 2.5}", "time.samples", "whole number"),
    ("{stop: 1, samples: true}", "time.samples"),
]
# whole files
FILES = [
    *((content, "the file is empty") for content in (b"", b"\n", b"# comment\n")),
    *((content,) for content in (b"[1, 2]", b"just words", b"a: &a [*a]\n")),
    *((content, "UTF-8") for content in (b"model: \xe9\n", text().encode("utf-16"))),
    (text().replace("m: 1.0", "m: 1.0\n  m: 2.0"), "line 4", "m"),
    (text().replace("parameters:", "parameters:\n  <<: {m: 1}"), "<<"),
    (text().replace("L2: 0.5", "L2: *length"), "line", "length"),
    (text("B2", more="formulation: {line_force: sum}"), "line_force", "integral, mean"),
    *((opening * 100_000, "nested too deeply") for opening in ("[", "{a: ", "- ", "? ")),
]


@pytest.mark.parametrize(
    ("content", "parts"),
    [(text(more=more), parts) for more, *parts in ADDED]
    + [(text().replace(TIME, f"time: {time}\n"), parts) for time, *parts in TIMES]
    + [(content, parts) for content, *parts in FILES],
)
def test_a_refused_scene_names_the_key_and_what_is_allowed(read, content, parts):
    assert_refused(lambda: read(content), *parts)


def test_a_missing_file_or_a_folder_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            read_scene(path)


def test_simulation_needs_a_time_a_nonlinear_model_and_a_force(read):
    def refused(content, *parts):
        scene = read(content)  # which a query takes
        assert_refused(lambda: check_simulation(scene), *parts)

    refused(text().replace(TIME, ""), "time")
    refused(text("B3"), "model", "B3")
    refused(text(F_n="0"), "parameters.F_n", "extrema")
    check_simulation(read(text(F_n="0", more="outputs: [events, shares]")))


# YAML 1.2, and what stands for 1.0 in it
@pytest.mark.parametrize("new", ["+1.", "1E+0", "010", "1.0 # the same\r", "&a 1\n  I: *a"])
@pytest.mark.parametrize("head", ["", "---\n", "%YAML 1.2\n---\n", "\ufeff"])
def test_a_scene_with_a_yaml_head_or_a_number_of_any_spelling_is_read(read, head, new):
    given = head + text(drop=["I"]).replace("m: 1.0", f"m: {new}")
    assert read(given).pad.m == (10.0 if new == "010" else 1.0)


def test_left_out_choices_are_consistent_and_given_ones_are_kept(read):
    assert read(text("B2")).formulation == CONSISTENT
    printed = 'formulation: {line_force: mean, delta_from: frame, delta_moment: "-"}\n'
    assert read(text("B2", more=printed)).formulation == Formulation("mean", "frame", "-")
    assert read(text(more="outputs: []")).outputs == ()


def test_aliases_of_aliases_are_refused_at_once(read, monkeypatch):
    # a thousand million words if written out
    rows = ["&a0 [x, x, x, x, x, x, x, x, x, x]"]
    rows += [f"&a{i} [" + ", ".join([f"*a{i - 1}"] * 10) + "]" for i in range(1, 9)]
    assert_refused(lambda: read(text(more=f"outputs: [[{', '.join(rows)}]]\n")), "aliases")
    bomb = "\n".join(["M: {file: m}", *(f"a{i}: {row}" for i, row in enumerate(rows))])
    with pytest.raises(InputError, match="aliases"):
        parse_document(bomb.encode(), Place("x"))
    monkeypatch.setattr(schema, "MOST", 1_000)
    many = "[" + "1, " * 2_000 + "1]"  # what is written out may be of any size
    assert len(parse_document(f"a: {many}".encode(), Place("x"))["a"]) == 2_001


@pytest.mark.parametrize("text", ["!!float x", "!!bool x", "!!timestamp x", "[1", "a\0", "&a [*a]"])
def test_an_option_that_is_no_yaml_is_the_text_itself(text):
    assert scalar(text) == text


@given(st.text())
@example("08")
@example("1e5")
@example("null")
@example("- a: b")
@example(" x\n")
def test_a_written_document_reads_as_the_same(name):
    document = {"name": name, "row": [name, 0.1, 3, True, None], "x" + name: {"factor": 1e-300}}
    assert parse_document(document_text(document).encode(), Place("x")) == document
