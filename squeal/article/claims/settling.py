"""A motion that settles without damping, on a decaying mode of a fluttering equilibrium."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from squeal.article.claims.measures import measure
from squeal.article.records import Record
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene
from squeal.model.equations import linearise

SMALL = 0.05  # |y - y at rest| at the start over the depth at rest: no contact changes
TOLERANCE = 1e-13  # errors of integration grow like exp(|real| t), with the mode of root -s
WINDOWS = 1.5  # over the time of the scene: long enough to settle, before those errors count


class Settled(Record):
    """A motion of a scene's pad that starts on the decaying mode of its sliding equilibrium.

    real: of that mode (1/s); windows: its length in times of the scene; calm: its greatest late
    acceleration over that of the whole motion.
    """

    scene: str
    real: float
    windows: float
    calm: float


def decaying(scene: Scene) -> tuple[float, np.ndarray] | None:
    """The real part (1/s) of the mode that decays fastest about the sliding equilibrium, and the
    state (x, y, theta and velocities) from which this mode alone moves.

    The state is equilibrium + Re(u, s u) with (s^2 M + K) u = 0. None where the scene is damped,
    has no equilibrium or no mode decays: undamped, a mode decays only if its partner -s flutters.
    """
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    if equilibrium is None or scene.damping is not None:
        return None
    q = np.array(equilibrium.q)
    matrices = linearise(scene.pad_model, q, equilibrium.state)
    # the eigenvalues of M^-1 K are -s^2
    squares, shapes = np.linalg.eig(np.linalg.solve(matrices.M, matrices.K))
    roots = -np.sqrt(-squares.astype(complex))  # of each pair the one in the left half plane
    fastest = int(np.argmin(roots.real))
    s = roots[fastest]
    if s.real > -1e-6 * np.abs(roots).max():  # far above rounding: no mode decays
        return None
    # y is zero where the pad just touches, so that -q[1] is the depth at rest; the mode is scaled
    # so that the pad starts deeper by SMALL of it
    y_of_mode = SMALL * q[1]
    mode = shapes[:, fastest] * (y_of_mode / shapes[1, fastest])
    return float(s.real), np.concatenate([q + mode.real, (s * mode).real])


def settled(scenes: Mapping[str, Scene]) -> Settled | None:
    """The motion on the mode that decays fastest of all scenes' modes, simulated and measured.

    None where no mode decays. The scenes have a time to stop at.
    """
    modes = {}  # by scene: the real part (1/s) and the state of the mode that decays fastest
    for name, scene in scenes.items():
        mode = decaying(scene)
        if mode is not None:
            modes[name] = mode
    if not modes:
        return None
    fastest = min(modes, key=lambda name: modes[name][0])
    real, state = modes[fastest]
    scene = scenes[fastest]
    assert scene.stop is not None
    on_the_mode = replace(
        scene,
        initial=tuple(state.tolist()),
        stop=WINDOWS * scene.stop,
        tolerance=TOLERANCE,
        start="origin",  # `initial` counts from the origin, as `decaying` does
    )
    return Settled(scene=fastest, real=real, windows=WINDOWS, calm=measure(on_the_mode).calm)
