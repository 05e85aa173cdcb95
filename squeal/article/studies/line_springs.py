"""Point against line contact at equal load.

N springs along the face (model BN) with the normal and rotational stiffness of the line, from the
start of the article's scenes of model B2; the line follows the integral law, which is their limit.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.analysis.eigenvalues import branch_system
from squeal.analysis.thresholds import critical_friction
from squeal.article.claims.motions import contact_shares
from squeal.article.results import line_springs as results
from squeal.article.results.records import Missing
from squeal.article.studies._scenes import read_cases
from squeal.article.studies.starts import grid, plane
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.provenance import NOT_INSTALLED, version
from squeal.io.scene import Scene
from squeal.model.contact import Formulation
from squeal.model.states import FULL, NONE, STATES
from squeal.simulation import Simulation, simulate
from squeal.simulation.ensemble import DONE, simulate_starts

COUNTS = (2, 3, 4, 6, 8, 16, 32)
FEW = (2, 8)  # springs whose thresholds are sought
SAMPLES = 401
SIDE = 9  # starts a side of the plane through equilibrium and own start
TIMES = (1, 3)  # times of the scene over which other starts are compared
MU_MAX = 2.0


def on_springs(scene: Scene, count: int) -> Scene:
    """A scene of B2 on so many springs, on the line with the integral law for 0."""
    if not count:
        return dataclasses.replace(scene, formulation=Formulation())
    return dataclasses.replace(scene, model="BN", formulation=Formulation(springs=count))


def _run(scene: Scene, count: int) -> Simulation | Missing:
    wanted = dataclasses.replace(
        on_springs(scene, count),
        pad=scene.pad.replace(V=None),  # sliding is not asked for
        outputs=("events", "shares", "extrema", "history"),
        samples=SAMPLES,
    )
    try:
        return simulate(wanted)
    except ComputationError as error:
        return Missing(str(error))


def _places(scene: Scene, run: Simulation) -> np.ndarray:
    assert run.history is not None
    return np.array([run.history["x"], run.history["y"], scene.pad.w * run.history["theta"]])


def _contact(scene: Scene, count: int, run: Simulation, line: Simulation) -> results.Contact:
    assert run.shares is not None
    assert run.events is not None
    assert run.extrema is not None
    places, goal = _places(scene, run), _places(scene, line)
    peak = run.extrema["Rn"]
    losses = sum(event.target == "SS" for event in run.events)
    told = (1.0 - run.shares["FC"], run.shares["SS"], losses, peak[1] if peak else 0.0)
    apart = float(np.abs(places - goal).max() / np.ptp(goal, axis=1).max())
    return results.Contact(count, *told, apart)


def _thresholds(scene: Scene) -> tuple[results.Threshold, ...]:
    points = critical_friction(scene, MU_MAX).points
    return tuple(results.Threshold(point.mu, point.kind) for point in points)


def case(scene: Scene) -> results.Case:
    """Motions and thresholds on springs and on the line."""
    line = _run(scene, 0)
    runs = {count: _run(scene, count) for count in COUNTS}
    found = {
        count: _contact(scene, count, run, line)
        if isinstance(run, Simulation) and isinstance(line, Simulation)
        else run
        for count, run in runs.items()
    }
    _, path = branch_system(on_springs(scene, 0), MU_MAX)
    partial = path is not None and not all(map(all, path.states))
    return results.Case(
        _contact(scene, 0, line, line) if isinstance(line, Simulation) else line,
        tuple(one for one in found.values() if not isinstance(one, Simulation)),
        partial,
        {str(n): _thresholds(on_springs(scene, n)) for n in (0, *(FEW if partial else ()))},
    )


def compared(scene: Scene) -> tuple[results.Compared, ...]:
    """Two springs against the line from starts about the line's equilibrium; none without it."""
    line = on_springs(scene, 0)
    rest, _ = sliding_equilibrium(line.pad_model)
    if rest is None:
        return tuple(results.Compared(windows, (0, 0, 0), (0, 0, 0)) for windows in TIMES)
    starts = plane(scene, np.array(rest.q), *grid(SIDE))
    assert scene.stop is not None
    # all times in one batch, since wide ones cost less
    times, every = np.repeat(TIMES, len(starts)), np.tile(starts, (len(TIMES), 1))
    runs = [
        simulate_starts(one, every, times * scene.stop, results.TOLERANCE, measure=contact_shares)
        for one in (on_springs(scene, FEW[0]), line)
    ]
    whole = np.logical_and(*(run["outcome"] == DONE for run in runs))
    full, none = (STATES.index(state) for state in (FULL, NONE))

    def counted(differences: np.ndarray) -> tuple[int, int, int]:
        more, less = (int((sign * differences > results.ALIKE).sum()) for sign in (1.0, -1.0))
        return more, less, len(differences) - more - less

    def over(windows: int) -> results.Compared:
        few, many = (run["shares"][whole & (times == windows)] for run in runs)
        lost, apart = many[:, full] - few[:, full], few[:, none] - many[:, none]
        return results.Compared(windows, counted(lost), counted(apart))

    return tuple(map(over, TIMES))


def study(files: Sequence[Path]) -> results.LineSprings:
    """The four cases of model B2."""
    scenes = read_cases(files, "B2", "simulate")
    stop = max(scene.stop or 0.0 for scene in scenes.values())
    return results.LineSprings(
        cases={name: case(scene) for name, scene in scenes.items()},
        starts={
            name: compared(scene)
            for name, scene in scenes.items()
            if version("heyoka") != NOT_INSTALLED
        },
        stop=1e3 * stop,
        mu_max=MU_MAX,
    )
