"""Curves over two parameters on which stability is lost.

They cross the lines between neighbouring points of a map of which one is quiet and the other is
not. Each crossing is located by halving that line with the verdicts of the map, and those on the
sides of one square of the map are joined.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from squeal.analysis.answers import Axis
from squeal.analysis.maps import AXES, BEYOND_FOLD, UNKNOWN, PointVerdicts, codes_at
from squeal.analysis.stack import QUIET, PadStack
from squeal.io.scene import Scene, takes_scene
from squeal.linear import VERDICTS
from squeal.schema.values import takes

Kind = Literal["flutter", "divergence", "fold", "contact"]
KINDS: tuple[Kind, ...] = ("flutter", "divergence", "fold", "contact")
HALVINGS = 40  # of the distance of two neighbouring points of the map


@dataclass(frozen=True, eq=False)
class ThresholdCurve:
    """points (n, 2): the two parameters along the curve; kind: what happens there; frequency_hz
    (n,) of the mode that starts to grow, 0 where none vibrates; closed: it returns to its start."""

    points: np.ndarray
    kind: Kind
    frequency_hz: np.ndarray
    closed: bool


@takes_scene
@takes(axes=AXES)
def threshold_curves(
    scene: Scene, axes: tuple[Axis, Axis], codes: np.ndarray
) -> tuple[ThresholdCurve, ...]:
    """The curves between stable or marginal points of a map and the others.

    Parameters
    ----------
    scene, axes
        Of the map.
    codes : (n1, n2)
        Indices into `squeal.analysis.maps.NAMES` at its points. Curves end beside points that are
        unknown, at the outermost points, and where something else happens.
    """
    lines, quiet, loud = _lines(codes)
    if not len(lines):
        return ()
    names = (axes[0].name, axes[1].name)

    def plain(u: np.ndarray) -> np.ndarray:
        return np.array([axis.at(row) for axis, row in zip(axes, u, strict=True)])

    for _ in range(HALVINGS):
        middle = (quiet + loud) / 2
        calm = np.isin(codes_at(scene, names, plain(middle)).codes, QUIET)
        quiet[:, calm], loud[:, ~calm] = middle[:, calm], middle[:, ~calm]
    one, other = (codes_at(scene, names, plain(end)) for end in (quiet, loud))
    kinds, points = _kinds(one, other), plain(quiet)
    hertz = _frequencies(PadStack.of(scene, names, points), one)
    hertz[kinds != KINDS.index("flutter")] = 0.0
    curves = []
    for chain in _chains(lines, kinds, codes.shape):
        line, closed = np.array(chain), len(chain) > 3 and chain[0] == chain[-1]
        kind = KINDS[kinds[chain[0]]]
        curves.append(ThresholdCurve(points[:, line].T, kind, hertz[line], closed))
    return tuple(curves)


def _lines(codes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines (k, 3) = (axis, i, j) from a point of the map to the next one along an axis of which
    one is quiet, and shares (2, k) of the quiet one and the other on the axes."""
    calm, known = np.isin(codes, QUIET), codes != UNKNOWN
    lines, ends = [], []
    for axis in range(2):
        a, b = (np.moveaxis(part, axis, 0) for part in (calm, known))
        index = np.argwhere((a[1:] != a[:-1]) & b[1:] & b[:-1])
        low = index if axis == 0 else index[:, ::-1]
        high = low + np.eye(2, dtype=int)[axis]
        first = calm[tuple(low.T)][:, None]
        lines.append(np.insert(low, 0, axis, axis=1))
        ends.append((np.where(first, low, high).T, np.where(first, high, low).T))
    size = np.array(codes.shape)[:, None]
    quiet, loud = (np.concatenate([pair[k] for pair in ends], axis=1) for k in range(2))
    return np.concatenate(lines), (quiet + 0.5) / size, (loud + 0.5) / size


def _kinds(one: PointVerdicts, other: PointVerdicts) -> np.ndarray:
    """What happens (k,) between quiet points and others next to them, indices into `KINDS`."""
    diverges = other.codes == VERDICTS.index("divergence")
    kinds = np.where(diverges, KINDS.index("divergence"), KINDS.index("flutter"))
    kinds[one.contact != other.contact] = KINDS.index("contact")
    kinds[other.codes == BEYOND_FOLD] = KINDS.index("fold")
    return kinds


def _frequencies(stack: PadStack, at: PointVerdicts) -> np.ndarray:
    """Frequencies (k,) in Hz of the pairs that are next to growth."""
    states = np.array(stack.scene.pad_model.states, dtype=bool)
    z = at.places.copy()
    z[3] = stack.mu
    return stack.meeting(*stack.matrices(np.arange(stack.n), z, states[at.contact].T))


def _chains(lines: np.ndarray, kinds: np.ndarray, shape: tuple[int, ...]) -> list[list[int]]:
    """Crossings that are joined across squares of the map, as numbers of lines: open chains from
    end to end, then closed ones, whose first and last are the same."""
    number = {tuple(line): k for k, line in enumerate(lines.tolist())}
    near: list[list[int]] = [[] for _ in lines]
    for i in range(shape[0] - 1):
        for j in range(shape[1] - 1):
            around = [(0, i, j), (1, i + 1, j), (0, i, j + 1), (1, i, j)]
            met = [number[side] for side in around if side in number]
            for a, b in zip(met[::2], met[1::2], strict=False):
                if kinds[a] == kinds[b]:
                    near[a].append(b)
                    near[b].append(a)
    chains, seen = [], set[int]()
    for start in sorted(range(len(lines)), key=lambda k: len(near[k]) == 2):
        if start in seen:
            continue
        chain = [start]
        while ahead := [k for k in near[chain[-1]] if k not in seen and k not in chain[-2:]]:
            seen.add(chain[-1])
            chain.append(ahead[0])
        seen.add(chain[-1])
        if len(chain) > 2 and start in near[chain[-1]]:
            chain.append(start)
        if len(chain) > 1:
            chains.append(chain)
    return chains
