"""From a dimensionless parameter set to the article's scenes in SI units."""

import math
from pathlib import Path

import numpy as np

from squeal.article.cases import ANGLE_TEXTS, HISTORY_FIGURES, STEMS, stem
from squeal.article.identify.search import arrays
from squeal.article.identify.space import (
    LENGTH,
    MASS,
    MODELS,
    SPEED,
    STOP,
    TIME,
    pad_of,
    stacked,
    starts,
)
from squeal.errors import ComputationError, InputError
from squeal.io.writing import write_text
from squeal.model.contact import Formulation, contact_law, contact_model
from squeal.model.pad import Model

PARAMETERS = ["m", "w", "h", "I", "k1", "k2", "k3", "k4", "k_c", "L1", "L2", "x0", "theta0"]


def _number(value: float) -> str:
    """A number with seven digits: a claim that needs more of them holds by too small a margin."""
    return repr(float(f"{value:.7g}"))


def scene_text(
    numbers: dict[str, float], formulation: Formulation, model: Model, case: str = ""
) -> str:
    """The text of the scene file, in SI units, of a model and a case, or of model B3, which has no
    case. numbers: the dimensionless ones of a set, by the names of `space.DIMENSIONS`.

    Raises ComputationError where a standing pad has no initial state, see `starts`.
    """
    n = arrays(numbers)
    linear = contact_model(model).linear
    no_angles = (0.0, 0.0)  # those of the case are written as multiples of pi below
    # kg, m and s, each measured in the dimensionless units
    pad = pad_of(n, model, no_angles).scaled(1.0 / MASS, 1.0 / LENGTH, 1.0 / TIME)
    parameters = {name: float(np.ravel(v)[0]) for name, v in pad.given().items()}
    about = ": Fig. 13 (the map leaves alpha1, alpha2 aside)"
    if case:
        about = f", case ({case}): Fig. {HISTORY_FIGURES[stem(model, case)]}"
    lines = [f"# Model {model}{about}", f"model: {model}", "parameters:"]
    for name in PARAMETERS:
        is_default = name in ("x0", "theta0") and not parameters.get(name)  # zero, as if left out
        is_unused = linear and name in ("L1", "L2", "x0")
        if name in parameters and not is_default and not is_unused:
            lines.append(f"  {name}: {_number(parameters[name])}")
    alpha1, alpha2 = ANGLE_TEXTS[case or "c"]  # B3, whose map leaves them aside, has those of (c)
    lines += [f"  alpha1: {alpha1}", f"  alpha2: {alpha2}", f"  mu: {_number(parameters['mu'])}"]
    if linear:
        return "\n".join(lines) + "\n"
    lines += [f"  F_n: {_number(parameters['F_n'])}", f"  V: {_number(SPEED)}"]
    if contact_law(model).absolute_gap:
        lines.append(f"  y0: {_number(parameters['y0'])}")
    # the pad starts at rest: velocities, the last three, are zero
    x, y, theta, *_ = starts(n, stacked(n, model, case, formulation))[0].tolist()
    if math.isnan(x):
        raise ComputationError(
            f"{stem(model, case)}: without friction the pad is not in full contact, so that it "
            "cannot start there"
        )
    initial = {"x": LENGTH * x, "y": LENGTH * y, "theta": theta}
    start = ", ".join(f"{name}: {_number(value)}" for name, value in initial.items() if value)
    lines.append(f"initial: {{{start}}}")
    if contact_model(model).choices:
        f = formulation
        lines.append(
            f"formulation: {{line_force: {f.line_force}, delta_from: {f.delta_from}, "
            f'delta_moment: "{f.delta_moment}"}}'
        )
    lines.append(f"time: {{stop: {_number(STOP * TIME)}, samples: 4001}}")
    return "\n".join([*lines, "outputs: [events, shares, extrema]"]) + "\n"


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuse a folder that does not exist, or that holds scenes already. Raises InputError."""
    if not folder.is_dir():
        raise InputError(f"--scenes {folder}: is no folder; an existing folder is allowed")
    existing = [name for name in STEMS if (folder / f"{name}.yaml").exists()]
    if existing and not overwrite:
        raise InputError(
            f"--scenes {folder}: {existing[0]}.yaml exists; another folder is allowed, or "
            "--overwrite"
        )


def write_scenes(numbers: dict[str, float], formulation: Formulation, folder: Path) -> None:
    """Write the nine scene files b1-a.yaml to b2-d.yaml and b3.yaml.

    Raises ComputationError, before a file is written, where a pad has no initial state.
    """
    texts = {"b3": scene_text(numbers, formulation, "B3")}
    for model in MODELS:
        for case in ANGLE_TEXTS:
            texts[stem(model, case)] = scene_text(numbers, formulation, model, case)
    for name, text in texts.items():
        write_text(folder / f"{name}.yaml", text)
