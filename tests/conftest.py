"""Pads and scenes that several tests use; those of the workflow may be identified anew."""

import functools
import gc
import importlib.util
import math
import sys
from pathlib import Path
from typing import Any, Literal

import hypothesis
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
BACKENDS = [pytest.param("heyoka", marks=needs_heyoka), "scipy"]
INSTALLED: tuple[Literal["heyoka", "scipy"], ...] = ("heyoka", "scipy") if HEYOKA else ("scipy",)
# fmt: off
LONG = (  # files that take long: a worker runs a file whole, and none of these should be the last
    "article/test_ensemble", "article/test_measures", "article/test_stability", "cli/test_cli",
    "queries/test_sensitivity", "simulation/test_falling", "cli/test_installed",
    "queries/test_maps", "queries/test_slow_roots", "workflow/test_workflow",
    "simulation/test_simulation", "equilibrium/test_admissible",
)
RANGES = {  # of the dimensionless parameters of a plausible pad, in the order of the draws
    "h": (0.1, 1.0), "I": (0.2, 0.6), "k2": (0.4, 2.5), "k3": (0.2, 3.0), "k4": (0.2, 3.0),
    "k_c": (0.2, 3.0), "L1": (1.0, 20.0), "L2": (1.0, 20.0), "alpha1": (0.1, 3.0),
    "alpha2": (0.1, 3.0), "mu": (0.1, 0.8), "F_n": (1e-3, 1e-2), "theta0": (-0.01, 0.01),
    "x0": (-0.1, 0.1), "y0": (-0.02, 0.0),
}
# fmt: on


@pytest.fixture(autouse=True)
def without_progress(monkeypatch):
    """A busy machine takes 10 s for what a test is to print nothing of."""
    monkeypatch.setattr("squeal.cli.streams.SILENCE", math.inf)


@pytest.fixture(scope="module")
def coarse_charts():
    """Charts of few points, where a report is made and its text is at stake."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("squeal.queries.sweep.DRAWN_OF_SYSTEMS", 13)
        patched.setattr("squeal.queries.sweep.DRAWN_AT_OWN_FREQUENCIES", 7)
        patched.setattr("squeal.queries.sweep.DRAWN_OF_PADS", 13)
        yield


@pytest.fixture(scope="module")
def without_layout():
    """Figures whose parts nobody moves apart, which takes half of the time that they take: for
    files of which kind, content and refusals are at stake."""
    from squeal.plots.style import RC

    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(RC, "figure.constrained_layout.use", False)
        yield


@pytest.fixture(scope="module")
def without_proof():
    """Reports of thresholds that no referee proves, which takes a third of the time of a report:
    for files in which cures and advice are at stake."""
    from squeal.queries.thresholds import thresholds

    unproved = functools.partial(thresholds, prove=False)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("squeal.reports.report.thresholds", unproved)
        yield


def _refuse_connections(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "socket.connect" or isinstance(arguments[1], (str, bytes)):  # of a path
        return
    if arguments[1][0] != "127.0.0.1":  # this machine, where a browser of the tests listens
        raise AssertionError(f"a connection to {arguments[1]}; none is allowed")


sys.addaudithook(_refuse_connections)
# the same cases everywhere, however slow the machine, and no file of them in the repository
hypothesis.settings.register_profile("any machine", deadline=None, database=None, derandomize=True)
hypothesis.settings.load_profile("any machine")


def random_pad(seed: int, model: str = "", **fixed: Any) -> Pad:
    """A plausible dimensionless pad (w = m = k1 = 1): all parameters of B1 and B2, or a model's."""
    r = np.random.default_rng(seed)
    drawn = {name: r.uniform(*ends) for name, ends in RANGES.items()}
    values = dict.fromkeys(("m", "w", "k1"), 1.0) | drawn | fixed
    return Pad(**{n: v for n, v in values.items() if not model or model in models_with(n)})


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


def scene_of(stem, **changes):
    """A scene with numbers of its pad, or keys of its own, changed."""
    return read_scene(SCENES / f"{stem}.yaml").replace(**changes)


def hammering_scene(stem):
    """A scene of the pad that goes on hammering, with its start."""
    return read_scene(HAMMERING / f"{stem}.yaml")
