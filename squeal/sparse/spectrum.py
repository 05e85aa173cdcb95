"""All roots of a small problem whose M may be singular, not symmetric or complex."""

from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import check_regular
from squeal.linear.system import Matrix
from squeal.sparse.modes import listed
from squeal.sparse.pencil import pencil_roots
from squeal.sparse.scaled import quadratic


def dense_spectrum(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Eigenvalue, ...]:
    """All finite roots with vectors, backward errors and conditions; matrices (n, n).

    Of real matrices both of a conjugate pair, of complex ones those of rising motion
    Im lambda >= 0 alone. Raises InputError where every number is a root.
    """
    problem = quadratic(M, C, K)
    matrices = [X.toarray() for X in (problem.M, problem.C, problem.K)]
    check_regular(*matrices)
    roots = pencil_roots(*matrices)
    return listed(problem, roots if problem.real else roots.picked(roots.values.imag >= 0.0))
