"""What a type checker must refuse, with the line's comment as its code."""

import squeal

squeal.eigenvalues("nonsense")  # arg-type
squeal.thresholds(3.0)  # arg-type
squeal.reduce(squeal.read_scene("pad.yaml"))  # arg-type
squeal.sweep(squeal.System([[1.0]], K=[[1.0]]), [0.0], method="quick")  # arg-type
squeal.System([[1.0]], K=[[1.0]], parameters=["mu"])  # arg-type
squeal.eigenvalue(squeal.System([[1.0]], K=[[1.0]]))  # attr-defined
