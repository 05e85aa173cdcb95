"""What becomes of the article's cases from other initial conditions: maps over height and tilt.

The initial conditions are at rest above, below and tilted from the sliding equilibrium, at its x.
Heights and tilts are in static compressions of the contact.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.claims.measures import Case, case_of
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import hammers
from squeal.article.identify.ensemble import simulate_many
from squeal.article.identify.space import compression
from squeal.article.records import Missing, Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._scenes import read_scenes
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene

KINDS = (
    "permanent contact",
    "one edge separates",
    "each edge separates",
    "hammering",
    "invalid simulation",
)
WINDOWS = (1, 10)  # observation times over that of the case
# of a map: points, and half-width in static compressions
SIDE = 11
REACH = 1.75
TOLERANCE = 1e-6


class Map(Record):
    """Outcomes over one observation time.

    windows: the time over that of the case; rows: of indices into `KINDS`, by rising tilt, along
    each the height rises; own: of the reference initial conditions; share: of each kind among all
    others but the equilibrium.
    """

    windows: int
    rows: tuple[str, ...]
    own: int
    share: dict[str, float]


class CaseMaps(Record):
    """Maps of a case, one for each of `WINDOWS`.

    reference: displacement of the reference initial conditions from the equilibrium in x, in y and,
    as the lift of an edge, in w theta; it and the axes of the maps are in static compressions.
    compression: of the contact, in micrometres.
    """

    maps: tuple[Map, ...]
    reference: tuple[float, float, float]
    compression: float


class Starts(Result):
    """The maps by case; reach: half-width of a map in static compressions."""

    cases: dict[str, CaseMaps | Missing]
    reach: float = REACH
    left_out: str = ""

    def share(self, name: str, kind: str, windows: int) -> float:
        """The share of the initial conditions of a case that come to a kind; 0 without a map."""
        case = self.cases[name]
        several = () if isinstance(case, Missing) else case.maps
        return next((m.share[kind] for m in several if m.windows == windows), 0.0)


def plane(
    scene: Scene, equilibrium: np.ndarray, height: np.ndarray, tilt: np.ndarray
) -> np.ndarray:
    """States (n, 6) at rest by height and tilt (n,) from an equilibrium (3,), in compressions.

    A tilt of one lifts an edge by the static compression.
    """
    unit = compression(scene.pad)
    states = np.zeros((len(height), 6))
    states[:, :3] = equilibrium
    states[:, 1] += height * unit
    states[:, 2] += tilt * unit / scene.pad.w
    return states


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Heights and tilts (SIDE^2,) of a map; rows of one tilt, along which the height rises."""
    axis = REACH * (2.0 * np.arange(SIDE) + 1.0 - SIDE) / SIDE
    tilt, height = np.meshgrid(axis, axis, indexing="ij")
    return height.ravel(), tilt.ravel()


def measured_cases(scene: Scene, states: np.ndarray, windows: int) -> list[Case | None]:
    """The measures of motions of a scene from states (n, 6) over so many observation times
    (`windows`); None of a motion that leaves the model."""
    assert scene.stop is not None
    motions = simulate_many(
        scene.model,
        scene.pad,
        states,
        stop=windows * scene.stop,
        tolerance=TOLERANCE,
        formulation=scene.formulation,
        measure=measures,
    )
    cases = []
    for i, valid in enumerate(motions["valid"].tolist()):
        cases.append(case_of(motions, i) if valid else None)
    return cases


def kind(case: Case | None) -> int:
    """The index of a motion's kind: invalid, hammering, or how many different edges separate (0, 1,
    2)."""
    if case is None:
        return KINDS.index("invalid simulation")
    if hammers(case).margin > 0.0:
        return KINDS.index("hammering")
    return len(set(case.losses))


def _map(scene: Scene, equilibrium: np.ndarray, windows: int) -> Map:
    """The map of a scene about its equilibrium (3,), over so many observation times."""
    height, tilt = grid()
    starts = plane(scene, equilibrium, height, tilt)
    # the reference initial conditions last
    cases = measured_cases(scene, np.append(starts, [scene.initial], axis=0), windows)
    *kinds, reference_kind = map(kind, cases)
    kinds_of_map = np.array(kinds)
    is_equilibrium = (height == 0.0) & (tilt == 0.0)  # where the pad stays at rest
    others = kinds_of_map[~is_equilibrium]
    return Map(
        windows=windows,
        # a digit for each kind, a row for each tilt
        rows=tuple("".join(map(str, row)) for row in kinds_of_map.reshape(SIDE, SIDE).tolist()),
        own=reference_kind,
        share={name: float(np.mean(others == i)) for i, name in enumerate(KINDS)},
    )


def maps(scene: Scene) -> CaseMaps | Missing:
    """The maps of a scene of B1 or B2."""
    equilibrium, why = sliding_equilibrium(scene.pad_model)
    if equilibrium is None:
        return Missing(why)
    q = np.array(equilibrium.q)
    unit = compression(scene.pad)
    x, y, theta = ((np.array(scene.initial[:3]) - q) / unit).tolist()
    return CaseMaps(
        maps=tuple(_map(scene, q, windows) for windows in WINDOWS),
        reference=(x, y, theta * scene.pad.w),
        compression=1e6 * unit,
    )


def study(files: Sequence[Path]) -> Starts:
    """The maps of the eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    if why := without_heyoka("nothing else simulates ensembles."):
        return Starts(cases=dict.fromkeys(scenes, Missing(why)), left_out=why)
    return Starts(cases={name: maps(scene) for name, scene in scenes.items()})


def sentences(record: Starts) -> Mapping[str, bool]:
    """What the paper says of these maps."""
    if record.left_out:
        return {}

    def permanent(name: str) -> float:
        """The share of the initial conditions with permanent contact over ten observation times."""
        return record.share(name, "permanent contact", 10)

    def hammering(name: str) -> float:
        """The share of the initial conditions whose motion hammers in this time."""
        return record.share(name, "hammering", 10)

    b1_cases = [name for name in record.cases if name.startswith("b1")]
    return {
        "b1-permanent-contact-near-equilibrium": all(permanent(name) > 0.0 for name in b1_cases),
        "b1-hammers-from-most-in-a-c-d": all(hammering(f"b1-{case}") > 0.5 for case in "acd"),
        "b2-c-hammers-from-all": hammering("b2-c") == 1.0,
        "b2-a-hammers-from-few-b-from-none": 0.0 < hammering("b2-a") < 0.15
        and hammering("b2-b") == 0.0,
    }
