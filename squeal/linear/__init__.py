"""Linear stability of circulatory systems M q'' + C q' + K(mu) q = 0 of any size.

Give matrices and get eigenvalues, a verdict and sensitivities; give a function
`system(mu) -> (M, C, K)` and get thresholds and onsets of modes.
"""

from squeal.linear.eigen import Eigenvalue, Spectrum, UnstableMode, complex_eigenvalues
from squeal.linear.events import Crossing
from squeal.linear.functions import Matrices, SystemFunction
from squeal.linear.map_verdicts import damped_verdicts, errors_may_change, undamped_verdicts
from squeal.linear.paths import unstable_modes
from squeal.linear.sensitivity import sensitivities
from squeal.linear.thresholds import CriticalPoint, Thresholds, thresholds
from squeal.linear.verdicts import GROWING, VERDICTS, Judgement, judge, verdict

# fmt: off
__all__ = [
    "GROWING", "VERDICTS", "CriticalPoint", "Crossing", "Eigenvalue",
    "Judgement", "Matrices", "Spectrum", "SystemFunction", "Thresholds",
    "UnstableMode", "complex_eigenvalues", "damped_verdicts", "errors_may_change", "judge",
    "sensitivities",
    "thresholds", "undamped_verdicts", "unstable_modes", "verdict",
]
# fmt: on
