"""What grows at a scene's friction, and from which friction on."""

from squeal.analysis.critical import branch_system
from squeal.analysis.eigenvalues import Analysis
from squeal.io.scene import Scene, takes_scene
from squeal.linear import Matrices, UnstableMode, crossings, unstable_modes


@takes_scene
def growing_modes(scene: Scene, analysis: Analysis) -> tuple[UnstableMode, ...]:
    """The modes of an analysed scene that grow, the fastest first.

    An onset is None where the mode grows without friction, or where the equilibrium does not lie
    on the branch that begins there, or lies beyond a fold of it.
    """
    own, mu = analysis.matrices, scene.pad.mu
    grow = unstable_modes(lambda _: own, mu)
    if not grow or mu == 0.0 or not analysis.on_branch:
        return grow
    system, path = branch_system(scene, mu)
    if path is not None and path.mu_end < mu:
        return grow

    def along(at: float) -> Matrices:
        return own if at == mu else system(at)

    return unstable_modes(along, mu, crossings(along, mu, path.breakpoints if path else ()))
