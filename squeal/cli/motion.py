"""The files that `squeal simulate` writes: history, picture and sound."""

import argparse
import dataclasses
import math
import warnings
from typing import Any

import numpy as np

from squeal.errors import InputWarning
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.scene_keys import COORDINATES, INITIAL
from squeal.io.writing import picked, write_table
from squeal.model.contact import contact_law
from squeal.plots.runs import Event, Run, Summary
from squeal.simulation import Simulation

UNITS = {"t": "s"} | {name: INITIAL.keys[name].unit for name in COORDINATES}
DRAWN = ("events", "shares", "extrema", "response", "history")
LEAST, MOST = 4_001, 100_001  # samples of a picture


def task_of(given: argparse.Namespace, scene: Scene) -> tuple[Scene, int]:
    """The scene with all outputs that the wanted files need, and how many samples of its history
    come for each that the scene names.

    Raises InputError for a scene without brake force, over which a history gives its forces.
    """
    option = given.figure_option if given.figure is not None else given.table and given.table_option
    if option is None:
        return scene, 1
    if scene.pad.F_n == 0.0:
        raise (given.source.at / "parameters" / "F_n").refuse(
            f"0 is not allowed with {option}, whose history gives forces over F_n; it must be "
            "above 0"
        )
    if given.figure is None:
        more = () if scene.wants("history") else ("history",)
        return dataclasses.replace(scene, outputs=(*scene.outputs, *more)), 1
    from squeal.simulation.response import sampling_step
    from squeal.simulation.run import in_natural_units

    _, model, _, stop = in_natural_units(scene)
    assert scene.samples is not None
    parts = min(max(math.ceil(stop / sampling_step(model)), LEAST), MOST)
    every = max(1, math.ceil((parts - 1) / (scene.samples - 1)))
    samples = (scene.samples - 1) * every + 1
    return dataclasses.replace(scene, outputs=DRAWN, samples=samples), every


def asked(scene: Scene, result: Simulation, every: int) -> Simulation:
    """The result without what is only for files, its history at the scene's own times."""
    history = result.history
    if history is not None:
        history = {name: values[::every] for name, values in history.items()}
    fields: dict[str, Any] = {name: None for name in DRAWN if not scene.wants(name)}
    return dataclasses.replace(result, **({"history": history} | fields))


def write_files(
    given: argparse.Namespace, scene: Scene, result: Simulation, every: int
) -> dict[str, Any]:
    """Write the files that are wanted; what the JSON object says of them."""
    if given.table is not None:
        write_history(given, asked(dataclasses.replace(scene, outputs=DRAWN), result, every))
    if given.figure is not None:
        draw(given, scene, result)
    if given.sound is None:
        return {}
    from squeal.simulation.sound import LENGTH, RATE, sound

    heard = sound(scene, given.integrator)
    heard.write(given.sound)
    length = len(heard.samples) / RATE
    if length < LENGTH:
        warnings.warn(
            f"the sound lasts {length:.3g} s: the model ends before one of {LENGTH:g} s does",
            InputWarning,
            stacklevel=2,
        )
    return {"sound": heard.to_dict()}


def write_history(given: argparse.Namespace, result: Simulation) -> None:
    """A row for each sample; forces in units of F_n, places in units of w."""
    assert result.history is not None
    units = UNITS | {signal.name: signal.over for signal in contact_law(result.model).plotted}
    columns = {name: values.tolist() for name, values in result.history.items()}
    rows = zip(*columns.values(), strict=True)
    write_table(given.table, {name: units.get(name, "") for name in columns}, rows)


def draw(given: argparse.Namespace, scene: Scene, result: Simulation) -> None:
    """Forces, place of the reaction, contact states and spectrum."""
    from squeal.plots.motion import drawing
    from squeal.plots.style import save

    assert result.events is not None
    assert result.response is not None
    assert result.history is not None
    summary = Summary(
        name=given.source.name.removesuffix(".yaml"),
        stop=result.final[0],
        events=tuple(Event(e.t, e.source, e.target) for e in result.events),
        **picked(result, "model shares extrema method tolerance steps"),
        provenance=provenance([given.source.file], "squeal.cli.simulate"),
    )
    run = Run(summary, {name: np.asarray(values) for name, values in result.history.items()})
    made = drawing(run, scene.pad_model, result.response.frequency_hz)
    save(made, given.figure, text=False)
