"""How many eigenvalues lie to the right of a vertical line, without any eigenvalue.

The sign function of A - x has the eigenvalue +1 for each of them and -1 for each other, so that
its trace counts them. Newton's iteration S <- (c S + (c S)^-1) / 2 converges quadratically; the
scaling c = |det S|^(-1/n) speeds its start (Byers 1987).
"""

import numpy as np

from squeal.linear.matrices import Array
from squeal.numerics.inverse import inverse

STEPS = 60
WHOLE = 1e-3  # distance of the trace from a whole number that is accepted
SCALED = 1e-2  # change of a step below which it is not scaled any more


def count_right(A: Array, x: float = 0.0) -> int | None:
    """Number of eigenvalues of A (n, n) with real part above x; None if it does not settle."""
    n = len(A)
    S = np.asfortranarray(A - x * np.eye(n))
    with np.errstate(all="ignore"):
        scale = True
        for _ in range(STEPS):
            try:
                other, size = inverse(S)
            except np.linalg.LinAlgError:
                return None
            factor = float(np.exp(-size / n)) if scale else 1.0
            new = (factor * S + other / factor) / 2
            change = float(np.linalg.norm(new - S, 1) / np.linalg.norm(new, 1))
            S = new
            if not np.isfinite(change):
                return None
            scale = scale and change > SCALED
            if change < 1e-5:  # the next step would leave its square
                break
        else:
            return None
    number = (float(np.trace(S)) + n) / 2
    return round(number) if abs(number - round(number)) < WHOLE else None
