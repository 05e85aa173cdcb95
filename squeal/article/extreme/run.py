"""Runs the cases of the suite and holds each outcome against the truth."""

import math
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from squeal.article.extreme.cases import PERIODS, Case
from squeal.article.results.extreme import Outcome, Word
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene, read_scene
from squeal.simulation import Simulation, simulate
from squeal.simulation.reference import error_against, precision_in_words, reference
from squeal.simulation.run import in_natural_units

RIGHT = 1e-9  # greatest relative error of a right answer
LONG = 100  # how many times longer the long runs are with --long


def _place(scene: Scene, found: Simulation) -> np.ndarray:
    units, *_ = in_natural_units(scene)
    return units.to_scaled(np.array(found.final[1:]))[:3]


def _against_quad(case: Case, found: Simulation) -> tuple[float, str]:
    exact = reference(case.scene)
    if len(exact.times) != found.contact_changes:
        return math.inf, f"{len(exact.times)} contact changes in {precision_in_words()}"
    return error_against(_place(case.scene, found), exact.place), precision_in_words()


def in_units(scene: Scene, mass: float, length: float, time: float) -> Scene:
    """The same motion in other units."""
    place = np.array([length, length, 1.0])
    initial = np.array(scene.initial) / np.concatenate([place, place / time])
    assert scene.stop is not None
    return replace(
        scene,
        pad=scene.pad.scaled(mass, length, time),
        initial=tuple(initial.tolist()),
        stop=scene.stop / time,
    )


def _against_units(case: Case, found: Simulation) -> tuple[float, str]:
    other = in_units(case.scene, *case.units)
    place = _place(other, simulate(other))
    return error_against(place, _place(case.scene, found)), "the same pad in other units"


def peak_memory() -> float | None:
    """Peak memory of this process in MB, None on systems that do not say."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1024**2 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def _drift(case: Case, found: Simulation, before: float | None) -> tuple[float, str]:
    scene = case.scene
    model = scene.pad_model
    energies = []
    for state in (scene.initial, found.final[1:]):
        q, rates = np.array(state[:3]), np.array(state[3:])
        energies.append(float(model.energy(q, rates, model.state_at(q))))
    told, after = "drift of energy", peak_memory()
    if before is not None and after is not None:
        told += f"; peak memory grew by {after - before:.0f} MB"
    return abs(energies[1] / energies[0] - 1.0), told


def _refused(case: Case) -> Outcome:
    try:
        if case.text:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "scene.yaml"
                file.write_text(case.text, encoding="utf-8")
                read_scene(file, "simulate")
        else:
            simulate(case.scene)
        told, right = "not refused", False
    except (ComputationError, InputError) as error:
        told = str(error).split("scene.yaml: ")[-1]
        right = case.words in told
        if case.time is not None:
            said = float(told.split("t = ")[1].split(" ")[0])
            right = right and math.isclose(said, case.time, rel_tol=1e-6)
    return _not_run(case, right, told)


def _not_run(case: Case, right: bool, told: str) -> Outcome:
    words: Word = "refused" if right else "wrong"
    return Outcome(case.group, case.name, words, None, 0, 0, 0.0, told)


def _ended(case: Case, told: str) -> Outcome:
    """A run that the model ended unasked: right if quad precision says the same."""
    try:
        reference(case.scene)
        alike = False
    except ComputationError as failure:
        alike = str(failure) == told
    return _not_run(case, alike, told)


def run_case(case: Case) -> Outcome:
    """Run a case and hold its outcome against the truth."""
    if case.truth == "refusal":
        return _refused(case)
    before = peak_memory()
    outcome: Word = "right"
    error: float | None = None
    try:
        found = simulate(case.scene)
    except ComputationError as failure:
        return _ended(case, str(failure))
    if case.truth == "warning":
        told = "sliding holds, as it must"
        right = found.sliding_holds is True
        if case.time is not None and math.isfinite(case.time):
            lost = found.sliding_lost_at
            right = lost is not None and math.isclose(lost, case.time, rel_tol=1e-6)
            told, outcome = f"sliding is lost at t = {lost:.6g} s", "warned"
    else:
        if case.truth == "quad":
            error, told = _against_quad(case, found)
        elif case.truth == "scaled":
            error, told = _against_units(case, found)
        elif case.truth == "energy":
            error, told = _drift(case, found, before)
        else:
            assert case.error is not None
            error, told = case.error(case.scene, found), "closed form"
        right = error <= RIGHT
    if not right:
        outcome = "wrong"
    shown = error if error is not None and math.isfinite(error) else None
    counts = (found.steps, found.contact_changes, found.run_time)
    return Outcome(case.group, case.name, outcome, shown, *counts, told)


def longer(case: Case) -> Case:
    """A long run a hundred times as long; other cases as they are."""
    if case.truth != "energy":
        return case
    stop = LONG * (case.scene.stop or 0.0)
    words = case.name.replace(f"{PERIODS}", f"{LONG * PERIODS}")
    return replace(case, name=words, scene=replace(case.scene, stop=stop))
