"""Questions as a user asks them, by the command line alone, and random things to ask about.

Every property here asks one question in two of our own ways. `make test` asks some forty times,
always the same; with TWO_WAYS=20000 in the environment (`make two-ways`) so many places are drawn
anew.
"""

import contextlib
import csv
import hashlib
import io
import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from hypothesis import HealthCheck, Phase, assume, settings
from hypothesis import strategies as st

from squeal.cli.main import main
from squeal.model.contact import CONTACT_MODELS

TOTAL = int(os.environ.get("TWO_WAYS", "0"))
FOLDER = tempfile.TemporaryDirectory(prefix="two-ways-")


def cases(quick, share, total=TOTAL):
    """So many cases in `make test`; a share of all that TWO_WAYS or another target asks for."""
    return settings(
        max_examples=max(quick, round(share * total)),
        derandomize=not total,
        database=None,
        deadline=None,
        phases=(Phase.explicit, Phase.generate),  # a place is as small as it gets
        suppress_health_check=list(HealthCheck),
    )


def ask(*arguments, code=0):
    """The JSON answer of a command, with what it said on standard error under `said`."""
    ended, out, said = run(*arguments, "--json")
    assert ended == code, said
    return json.loads(out) | {"said": said} if code == 0 else {"said": said}


def ask_if_any(*arguments):
    """The JSON answer of a command; a case that it refuses is none."""
    ended, out, _ = run(*arguments, "--json")
    assume(ended == 0)
    return json.loads(out)


def run(*arguments):
    """Exit code, standard output and standard error."""
    out = io.StringIO()
    said = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        ended = main([str(a) for a in arguments])
    return ended, out.getvalue(), said.getvalue()


def path(name):
    """A file or folder of these tests that does not exist yet."""
    return Path(tempfile.mkdtemp(dir=FOLDER.name)) / name


def written(document):
    """A file with this document, under a name that tells the text."""
    text = yaml.safe_dump(document, sort_keys=False)
    file = Path(FOLDER.name) / f"{hashlib.sha256(text.encode()).hexdigest()[:12]}.yaml"
    file.write_text(text)
    return file


def rows(table):
    """The rows of a file of comma-separated values."""
    with table.open(newline="") as stream:
        return list(csv.DictReader(stream))


def setting(**changes):
    """The options that change numbers of the file, to the last digit."""
    options = []
    for name, value in changes.items():
        options += ["--set", f"{name}={value!r}"]
    return options


# fmt: off
PADS = {
    "B1": {
        "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "L1": 0.8, "L2": 0.8, "F_n": 4500.0, "m": 0.2,
        "w": 0.04, "k3": 8.7e6, "k4": 8.7e6,
    },
    "B2": {
        "h": 0.014, "k1": 2.0e7, "k2": 2.65e7, "L1": 0.81, "L2": 0.81, "F_n": 4525.0, "m": 0.2,
        "w": 0.04, "I": 1.709e-4, "k_c": 1.0e7, "y0": -0.001,
    },
    "BN": {
        "h": 0.018, "k1": 2.3e7, "k2": 1.8e7, "L1": 0.6, "L2": 0.7, "F_n": 3000.0, "m": 0.2,
        "w": 0.04, "k_c": 1.4e7,
    },
}
# fmt: on


SEEDS = st.integers(0, 2**32 - 1)  # of numpy: places drawn by hypothesis itself crowd at ends


def uniform(low, high):
    """A number of few digits, none of them special, each as likely."""
    return SEEDS.map(lambda seed: float(f"{np.random.default_rng(seed).uniform(low, high):.6g}"))


def pad_of(seed: int, models: Sequence[str] = CONTACT_MODELS) -> dict[str, Any]:
    """A scene: one of three pads at random angles and friction, damped or not."""
    rng = np.random.default_rng(seed)
    model = str(rng.choice(models))
    angles = rng.uniform(0.02, np.pi - 0.02, 2)
    numbers = {"alpha1": angles[0], "alpha2": angles[1], "mu": rng.uniform(0.01, 1.4)}
    numbers = {name: round(float(value), 6) for name, value in numbers.items()}
    scene = {"model": model, "parameters": PADS[model] | numbers}
    if model == "BN":
        scene["formulation"] = {"springs": int(rng.choice([2, 3, 6]))}
    damped = rng.choice(["", "", "ratios", "rayleigh"])
    if damped == "ratios":
        scene["damping"] = {"ratios": np.round(rng.uniform(1e-3, 0.05, 3), 4).tolist()}
    elif damped == "rayleigh":
        mass, stiffness = rng.uniform([1.0, 1e-7], [100.0, 1e-6]).tolist()
        scene["damping"] = {"rayleigh": [round(mass, 1), round(stiffness, 9)]}
    return scene


def pads(models=CONTACT_MODELS):
    """Scenes of `pad_of`."""
    return SEEDS.map(lambda seed: pad_of(seed, models))


def verdict_by(thresholds, value, scene_or_system):
    """The verdict at a value of the parameter that a list of its changes tells."""
    still = "stable" if "damping" in scene_or_system or "C0" in scene_or_system else "marginal"
    kinds = [c["kind"] for c in thresholds["critical"] if c["mu"] <= value]
    last = kinds[-1] if kinds else thresholds["verdict_at_start"]
    return still if last == "restabilised" else last


def roots(found):
    """The eigenvalues of an answer."""
    return np.array([complex(e["real"], e["imag"]) for e in found["eigenvalues"]])


def assert_same(one, other, close=1e-7):
    """Every root of each of two answers has its like in the other, and the verdict is one."""
    a = roots(one)
    b = roots(other)
    assert len(a) == len(b)
    apart = np.abs(a[:, None] - b)
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) <= close * np.abs(a).max()
    assert one["verdict"] == other["verdict"]


def near(thresholds, value, relative=1e-6):
    """Is there a change of verdict so close to a value that rounding may decide?"""
    marks = [c["mu"] for c in thresholds["critical"]] + [thresholds.get("mu_end", np.inf)]
    return any(abs(mark - value) <= relative * max(1e-3, abs(value)) for mark in marks)
