"""Every key of a scene file in one table; those of the pad and the formulation stand in the model.

Files are read, records checked, and the documentation and the JSON schema written from it.
"""

from dataclasses import replace

from squeal.model.contact import CONTACT_MODELS, FORMULATION, MODELS, models_with
from squeal.model.pad import PARAMETERS
from squeal.schema.keys import Group, Key
from squeal.schema.values import Angle, Number, Row, Square, Whole, Word, Words

OUTPUTS = ("events", "shares", "extrema", "response", "history")
DEFAULT_OUTPUTS = ("events", "shares", "extrema")
DEFAULT_TOLERANCE = 1e-15

STARTS = ("origin", "equilibrium")
# fmt: off
INITIAL = Group({
    "from": Key(
        "where the others count from: the origin, or the sliding equilibrium that "
        "`eigenvalues` takes, which they then kick", Word(STARTS), default="origin"),
    "x": Key("displacement along the surface", Number(), "m", default="0"),
    "y": Key("displacement normal to the surface", Number(), "m", default="0"),
    "theta": Key("rotation", Angle(), "rad", default="0"),
    "x_dot": Key("velocity along the surface", Number(), "m/s", default="0"),
    "y_dot": Key("velocity normal to the surface", Number(), "m/s", default="0"),
    "theta_dot": Key("rate of rotation", Number(), "rad/s", default="0"),
}, short="from")
COORDINATES = tuple(INITIAL.keys)[1:]

TIME = Group({
    "stop": Key("length of time", Number(low=0.0), "s", required=True),
    "samples": Key(
        "equally spaced times of the history, both ends included",
        Whole(2, 10_000_000), required=True),
}, owner="time")

DAMPING = Group({
    "matrix": Key("3 x 3, in x, y and theta", Square(3), "SI units"),
    "ratios": Key(
        "3 modal damping ratios, of the modes without friction by rising frequency",
        Row(3, Number(low=0.0, low_allowed=True)), "1"),
    "rayleigh": Key(
        "alpha (1/s) and beta (s) of C = alpha M + beta K, K without friction",
        Row(2, Number(low=0.0, low_allowed=True))),
}, only_one=True)

PAD = Group({name: replace(key, models=models_with(name)) for name, key in PARAMETERS.items()})

FORMULATIONS = Group({
    name: replace(key, models=tuple(n for n, m in MODELS.items() if name in m.choices))
    for name, key in FORMULATION.keys.items()
})

SCENE = Group({
    "model": Key(
        "; ".join(f"{name} {model.words}" for name, model in MODELS.items()),
        Word(tuple(MODELS)), required=True),
    "parameters": Key("the pad and its load", PAD, required=True),
    "formulation": Key(
        "reading of the contact's equations", FORMULATIONS, default="the consistent one",
        models=tuple(name for name, model in MODELS.items() if model.choices)),
    "initial": Key(
        "first state; `equilibrium` alone starts at rest there",
        INITIAL, default="0", models=CONTACT_MODELS),
    "time": Key(
        "what is simulated; needed by `simulate` alone",
        TIME, default="no simulation", models=CONTACT_MODELS),
    "tolerance": Key(
        "relative error tolerance of a step",
        Number(low=0.0, high=1e-3, high_allowed=True), "1", default=f"{DEFAULT_TOLERANCE:g}"),
    "outputs": Key(
        "what a simulation computes and prints",
        Words(OUTPUTS), default=", ".join(DEFAULT_OUTPUTS)),
    "damping": Key(
        "linear damping -C q', in stability queries and simulations alike; ratios and rayleigh "
        "make C from the pad about its equilibrium without friction, and it is then the same "
        "in every contact state", DAMPING, default="none"),
}, owner="every scene")
