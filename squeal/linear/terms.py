"""Kept until all import `squeal.linear.system`."""

from squeal.linear.system import Matrix, Term, TermSystem, dense, is_sparse

__all__ = ["Matrix", "Term", "TermSystem", "dense", "is_sparse"]
