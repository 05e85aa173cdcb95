"""Linear stability of circulatory systems M q'' + C q' + K(mu) q = 0 of any size.

Give matrices and get eigenvalues, a verdict and sensitivities; give a function
`system(mu) -> (M, C, K)` and get sweeps, tracked modes, thresholds and the friction loop.
"""

from squeal.stability.crossing import CriticalPoint, Crossing, Thresholds
from squeal.stability.cubic import VERDICTS
from squeal.stability.eigen import Eigenvalue, Spectrum, complex_eigenvalues
from squeal.stability.gains import LoopThreshold
from squeal.stability.growth import GROWING
from squeal.stability.judgement import (
    Judgement,
    damped_verdicts,
    judge,
    sum_verdicts,
    undamped_verdicts,
    verdict,
)
from squeal.stability.loop import FrictionLoop, LoopAnswer, friction_loop
from squeal.stability.matrices import Batched, Matrices, System
from squeal.stability.sensitivity import sensitivities
from squeal.stability.stacks import stack_eigenvalues, sweep
from squeal.stability.thresholds import critical_points, crossings, thresholds
from squeal.stability.tracking import TrackedModes, track
from squeal.stability.unstable import UnstableMode, unstable_modes

# fmt: off
__all__ = [
    "GROWING", "VERDICTS", "Batched", "CriticalPoint", "Crossing", "Eigenvalue", "FrictionLoop",
    "Judgement", "LoopAnswer", "LoopThreshold", "Matrices", "Spectrum", "System", "Thresholds",
    "TrackedModes", "UnstableMode", "complex_eigenvalues", "critical_points", "crossings",
    "damped_verdicts", "friction_loop", "judge", "sensitivities", "stack_eigenvalues",
    "sum_verdicts", "sweep", "thresholds", "track", "undamped_verdicts", "unstable_modes",
    "verdict",
]
# fmt: on
