"""Pads and scenes that several tests use.

The scenes are a fixed pad with flutter, folds and changes of contact; those of the workflow may be
identified anew at any time.
"""

import gc
import importlib.util
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from squeal.io.scene import read_scene
from squeal.model.contact import models_with
from squeal.model.pad import Pad

ROOT = Path(__file__).parent.parent
SCENES = ROOT / "tests" / "scenes"
# a pad that goes on hammering with damping in some cases, also without flutter, by the printed law
HAMMERING = ROOT / "tests" / "hammering"


HEYOKA = importlib.util.find_spec("heyoka") is not None
needs_heyoka = pytest.mark.skipif(not HEYOKA, reason="needs heyoka, which is not installed")
# files that take long: a worker runs a file whole, and none of these should be the last
LONG = (
    *(
        "simulation/test_ensemble",
        "article/test_measures",
        "article/test_stability",
        "analysis/test_sensitivity",
    ),
    *("simulation/test_falling", "cli/test_cli"),
    *("cli/test_installed", "analysis/test_maps", "analysis/test_slow_roots"),
    *("workflow/test_workflow", "simulation/test_simulation"),
    "equilibrium/test_admissible",
)
BACKENDS = [pytest.param("heyoka", marks=needs_heyoka), "scipy"]
INSTALLED: tuple[Literal["heyoka", "scipy"], ...] = ("heyoka", "scipy") if HEYOKA else ("scipy",)


def random_pad(seed: int, model: str = "", **fixed: Any) -> Pad:
    """A plausible dimensionless pad (w = m = k1 = 1): all parameters of B1 and B2, or a model's."""
    r = np.random.default_rng(seed)
    values: dict[str, Any] = {
        "m": 1.0,
        "w": 1.0,
        "h": r.uniform(0.1, 1.0),
        "I": r.uniform(0.2, 0.6),
        "k1": 1.0,
        "k2": r.uniform(0.4, 2.5),
        "k3": r.uniform(0.2, 3.0),
        "k4": r.uniform(0.2, 3.0),
        "k_c": r.uniform(0.2, 3.0),
        "L1": r.uniform(1.0, 20.0),
        "L2": r.uniform(1.0, 20.0),
        "alpha1": r.uniform(0.1, 3.0),
        "alpha2": r.uniform(0.1, 3.0),
        "mu": r.uniform(0.1, 0.8),
        "F_n": r.uniform(1e-3, 1e-2),
        "theta0": r.uniform(-0.01, 0.01),
        "x0": r.uniform(-0.1, 0.1),
        "y0": r.uniform(-0.02, 0.0),
    }
    used = {n: v for n, v in (values | fixed).items() if not model or model in models_with(n)}
    return Pad(**used)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: looking for garbage in it took a quarter of this time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: f"{item.path.parent.name}/{item.path.stem}" not in LONG)


@pytest.fixture
def scenes():
    return SCENES


def scene_of(stem, **changes):
    """A scene with numbers of its pad, or keys of its own, changed."""
    return read_scene(SCENES / f"{stem}.yaml").replace(**changes)


def hammering_scene(stem):
    """A scene of the pad that goes on hammering, with its start."""
    return read_scene(HAMMERING / f"{stem}.yaml", "simulate")
