"""Every worker of pytest has a core of its own: one thread of BLAS, set before NumPy is loaded."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
