"""From a dimensionless pad to the article's scenes in SI units."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from squeal.article.cases import ANGLE_TEXTS, HISTORY_FIGURES, stem
from squeal.article.identify import space
from squeal.errors import InputError
from squeal.io.writing import write_text
from squeal.model.contact import Formulation, contact_law, contact_model

_PAD = ["m", "w", "h", "I", "k1", "k2", "k3", "k4", "k_c", "L1", "L2", "x0", "theta0"]
_PLACES = ("x0", "theta0")  # left out where zero


def _number(value: float) -> str:
    """Seven digits: a pad that needs more to keep a claim would hold it by a hair."""
    return repr(float(f"{value:.7g}"))


def _parameters(
    numbers: space.Numbers, model: str, angles: tuple[str, ...], speed: float, leave: str = ""
) -> str:
    pad = space.pad_of(numbers, model, (0.0, 0.0))
    si = pad.scaled(1.0 / space.MASS, 1.0 / space.LENGTH, 1.0 / space.TIME)
    lines = []
    for name in _PAD:
        value = getattr(si, name)
        if value is not None and name not in leave.split() and (value or name not in _PLACES):
            lines.append(f"  {name}: {_number(value)}")
    lines += [f"  alpha1: {angles[0]}", f"  alpha2: {angles[1]}", f"  mu: {_number(si.mu)}"]
    if not contact_model(model).linear:
        lines += [f"  F_n: {_number(si.F_n)}", f"  V: {_number(speed)}"]
        if contact_law(model).absolute_gap:
            lines.append(f"  y0: {_number(si.y0)}")
    return "\n".join(lines)


def scene_text(
    numbers: space.Numbers,
    formulation: Formulation,
    model: str,
    case: str,
    first: Sequence[float] | None = None,
    speed: float = space.SPEED,
) -> str:
    """The scene file of a model and a case.

    first: dimensionless state at the start (x, y, theta and rates of zero), by default as high as
    the numbers say; speed: of the surface, m/s.
    """
    f = formulation
    words = (
        f"formulation: {{line_force: {f.line_force}, delta_from: {f.delta_from}, "
        f'delta_moment: "{f.delta_moment}"}}'
    )
    if contact_model(model).linear:
        head = "# Model B3: Fig. 13 (the map leaves alpha1, alpha2 aside)"
        body = _parameters(numbers, "B3", ANGLE_TEXTS["c"], speed, leave="L1 L2 x0")
        return f"{head}\nmodel: B3\nparameters:\n{body}\n"
    head = f"# Model {model}, case ({case}): Fig. {HISTORY_FIGURES[stem(model, case)]}"
    parameters = _parameters(numbers, model, ANGLE_TEXTS[case], speed)
    lines = [head, f"model: {model}", "parameters:", parameters]
    if first is None:
        y = dict(zip(("B1", "B2"), space.first_heights(numbers), strict=True))[model]
        first = (0.0, y, 0.0)
    places = zip(("x", "y", "theta"), first[:3], (space.LENGTH, space.LENGTH, 1.0), strict=True)
    start = ", ".join(f"{name}: {_number(v * unit)}" for name, v, unit in places if v)
    lines.append(f"initial: {{{start}}}")
    if contact_model(model).choices:
        lines.append(words)
    lines += [
        f"time: {{stop: {_number(space.STOP * space.TIME)}, samples: 4001}}",
        "outputs: [events, shares, extrema]",
    ]
    return "\n".join(lines) + "\n"


def check_folder(folder: Path, overwrite: bool) -> None:
    """Refuse a folder that does not exist, or that holds scenes already. Raises InputError."""
    if not folder.is_dir():
        raise InputError(f"--scenes {folder}: is no folder; an existing folder is allowed")
    names = [stem(model, case) for model in ("B1", "B2") for case in ANGLE_TEXTS]
    there = [name for name in (*names, "b3") if (folder / f"{name}.yaml").exists()]
    if there and not overwrite:
        raise InputError(
            f"--scenes {folder}: {there[0]}.yaml exists; another folder is allowed, or --overwrite"
        )


def write_scenes(
    numbers: space.Numbers,
    formulation: Formulation,
    folder: Path,
    first: Mapping[str, Sequence[float]] | None = None,
    speed: float = space.SPEED,
) -> None:
    """Write the nine scene files b1-a.yaml to b2-d.yaml and b3.yaml.

    first: dimensionless states at the start by the scene's name; speed: of the surface, m/s.
    """
    for model in ("B1", "B2"):
        for case in ANGLE_TEXTS:
            name = stem(model, case)
            own = None if first is None else first[name]
            text = scene_text(numbers, formulation, model, case, own, speed)
            write_text(folder / f"{name}.yaml", text)
    write_text(folder / "b3.yaml", scene_text(numbers, formulation, "B3", ""))
