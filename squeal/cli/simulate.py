"""`squeal simulate`: integrate a B1 or B2 scene through its contact changes."""

import argparse
import dataclasses
import math
from typing import Any

from squeal.cli.command import Parser, Reply
from squeal.cli.options import said, take_files
from squeal.cli.streams import progress_line
from squeal.io.scene import Scene
from squeal.simulation import Simulation, simulate

DRAWN = ("events", "shares", "extrema", "response", "history")
LEAST, MOST = 4_001, 100_001  # samples of a picture


def options(parser: Parser) -> None:
    """Options of `squeal simulate`."""
    take_files(
        parser,
        table="the history",
        figure="a picture of forces, position of the reaction, contact states and spectrum",
    )
    parser.add_argument(
        "--integrator",
        choices=("auto", "heyoka", "scipy"),
        default="auto",
        help="auto takes heyoka where it is installed, else SciPy",
    )


def run(given: argparse.Namespace) -> Reply:
    """Read the scene, simulate it, write the files that are requested."""
    scene = given.source.scene("simulate")
    task, every = _task(given, scene)
    with progress_line("per cent") as progress:
        tell = None if progress is None else lambda share: progress(round(100 * share), 100)
        whole = simulate(task, given.integrator, tell)
    if given.table is not None:
        _requested(dataclasses.replace(scene, outputs=DRAWN), whole, every).save(given.table)
    if given.figure is not None:
        name = given.source.name.removesuffix(".yaml")
        whole.plot(given.figure, name=name, scene=scene, inputs=[given.source.file])
    result = _requested(scene, whole, every)
    return dataclasses.replace(Reply.of(result), warnings=_start_warnings(scene))


def _task(given: argparse.Namespace, scene: Scene) -> tuple[Scene, int]:
    """The scene with all outputs that the files need, and how many samples of its history come
    for each that the scene names.

    Raises InputError for a scene without brake force, over which a history gives its forces.
    """
    name = next((name for name in ("figure", "table") if getattr(given, name) is not None), None)
    if name is None:
        return scene, 1
    if scene.pad.F_n == 0.0:
        raise (given.source.at / "parameters" / "F_n").refuse(
            f"0 is not allowed with {said(given, name)}, whose history gives forces over F_n; it "
            "must be above 0"
        )
    if given.figure is None:
        return dataclasses.replace(scene, outputs=(*scene.outputs, "history")), 1
    from squeal.simulation.observers import sampling_step
    from squeal.simulation.run import in_natural_units

    _, model, _, stop = in_natural_units(scene)
    assert scene.samples is not None
    parts = min(max(math.ceil(stop / sampling_step(model)), LEAST), MOST)
    every = max(1, math.ceil((parts - 1) / (scene.samples - 1)))
    samples = (scene.samples - 1) * every + 1
    return dataclasses.replace(scene, outputs=DRAWN, samples=samples), every


def _requested(scene: Scene, result: Simulation, every: int) -> Simulation:
    """The result without what is only for files, its history at the scene's own times."""
    history = result.history
    if history is not None:
        history = {name: values[::every] for name, values in history.items()}
    fields: dict[str, Any] = {name: None for name in DRAWN if not scene.wants(name)}
    return dataclasses.replace(result, **({"history": history} | fields))


def _start_warnings(scene: Scene) -> tuple[str, ...] | None:
    """What speaks against the equilibrium that the motion starts from; None without one."""
    if scene.start != "equilibrium":
        return None
    from squeal.equilibrium import sliding_equilibrium  # a motion from elsewhere needs none

    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    return () if equilibrium is None else equilibrium.warnings
