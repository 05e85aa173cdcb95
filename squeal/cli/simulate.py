"""`squeal simulate`: integrate a scene of B1, B2 or BN through its contact changes.

squeal simulate pad.yaml --set time.stop=0.01 --figure motion.png --table history.csv
"""

import argparse
import dataclasses
import math
from typing import Any

from squeal.cli.command import Parser, Reply
from squeal.cli.options import take_files
from squeal.cli.streams import counter
from squeal.io.scene import OUTPUTS, Scene, check_simulation
from squeal.simulation.run import simulate

FIGURE_INTERVALS = 4_000  # between samples, at least: fewer would draw another motion


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
    """Read the scene, simulate it, write the files that are requested.

    A table needs the history, a figure all outputs and more samples. What the scene does not name
    is computed for these files and left out of the answer.
    """
    scene = given.source.scene()
    check_simulation(scene)
    outputs = scene.outputs
    # between the samples of the history; one, from start to end, if the scene names no samples
    intervals = (scene.samples or 2) - 1
    refinement = 1  # into how many parts each interval is divided for the figure
    if given.table is not None:
        outputs = (*scene.outputs, "history")
    if given.figure is not None:
        outputs = OUTPUTS
        refinement = math.ceil(FIGURE_INTERVALS / intervals)
    task = dataclasses.replace(scene, outputs=outputs, samples=intervals * refinement + 1)
    show = counter("per cent")
    # simulate reports the share of the time that it has reached, from 0 to 1
    motion = simulate(task, given.integrator, lambda share: show(round(100 * share), 100))
    if given.figure is not None:
        name = given.source.name.removesuffix(".yaml")
        motion.save(given.figure, name=name, scene=scene, inputs=given.source.inputs)
    if motion.history is not None:  # of the refined samples only those of the scene
        history = {name: column[::refinement] for name, column in motion.history.items()}
        motion = dataclasses.replace(motion, history=history)
    if given.table is not None:
        motion.save(given.table)
    not_requested: dict[str, Any] = {name: None for name in OUTPUTS if name not in scene.outputs}
    hint = ""
    if given.integrator == "auto" and motion.method.startswith("SciPy"):
        hint = "\n\nabout eight times as fast with heyoka: pip install 'brake-squeal[fast]'"
    reply = Reply.of(dataclasses.replace(motion, **not_requested), more=hint)
    return dataclasses.replace(reply, warnings=_start_warnings(scene))


def _start_warnings(scene: Scene) -> tuple[str, ...] | None:
    """The warnings of the equilibrium that the motion starts from; None if it starts elsewhere."""
    if scene.start != "equilibrium":
        return None
    from squeal.equilibrium import sliding_equilibrium  # a motion from elsewhere needs none

    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    return () if equilibrium is None else equilibrium.warnings
