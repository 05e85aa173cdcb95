"""Damping that is not given as a matrix: of Rayleigh, of modes, and structural.

It refers to the stiffness of the structure: the symmetric part of K at the system's own parameters,
without friction. The friction coefficient is the parameter `mu`; in a system without one it is the
swept parameter, if all matrices of K that it multiplies are unsymmetric.
"""

import dataclasses
import math
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError, InputWarning
from squeal.linear.matrices import EPS, LARGEST_ASYMMETRY, Array, Matrix, is_sparse, norm_of
from squeal.linear.moduli import Modulus
from squeal.linear.real_modes import real_modes
from squeal.linear.system import System
from squeal.linear.terms import Term, sum_of_terms
from squeal.numerics.differentiation import ONE, Formula, Parameters

MOST_DENSE = 2000
"""Rows up to which modal damping of any number of modes may be a full matrix."""
FEWEST_BORDERED = 400
"""Rows above which damping of few modes adds rows to a sparse system instead: of 2000 rows a full
C makes a factorisation 50 times slower."""
FEW_MODES = 0.1
"""What few modes are: this share of the rows."""
ROUNDED = 16.0
"""Of that matrix of n rows: each entry is known to this times n roundings of the matrix's norm."""
DEFINITION = "unknowns of damped modes"
"""Name of the term that defines the unknowns of `bordered`: it has no share in any energy."""

Ratios = float | Sequence[float] | Callable[[Array], Array]
"""Damping ratios: of all modes, of the first ones, or a function of frequencies (Hz)."""


def structure_stiffness(
    system: System, without: Collection[int] = ()
) -> tuple[Matrix, tuple[int, ...]]:
    """The stiffness that damping refers to: the symmetric part of K, real and without friction.

    Parameters
    ----------
    system : System
        The system; K is taken at its parameters, but without friction (`frictionless`).
    without : collection of int
        Indices of terms of K that are left out.

    Returns
    -------
    stiffness : array or sparse array (n, n)
    terms : tuple of int
        Indices of the terms of K that are part of it.

    Raises
    ------
    InputError
        Where there is none.
    """
    parameters = frictionless(system)
    total: Matrix = 0
    indices = []
    for i, term in enumerate(system.K):
        part = (term.factor.value(parameters) * term.matrix).real
        if i not in without and abs(part).max():
            total = total + part
            indices.append(i)
    if not indices:
        others = " beside the terms with a damping of their own" if without else ""
        raise InputError(f"damping: K has no stiffness without friction{others}; it must have some")
    return (total + total.T) / 2, tuple(indices)


def frictionless(system: System, changes: Parameters | None = None) -> dict[str, float]:
    """The parameters of a system, some of them changed, with the friction coefficient set to 0."""
    values = dict(changes or {})
    if "mu" in system.parameters:
        values["mu"] = 0.0
    elif _multiplies_unsymmetric_terms(system):
        values[system.parameter] = 0.0
    return system.values(values)


def _multiplies_unsymmetric_terms(system: System) -> bool:
    """True if the free parameter multiplies terms of K, none of which is symmetric."""
    matrices = [term.matrix for term in system.K if system.parameter in term.factor.names]
    for X in matrices:
        if abs(X - X.T).max() <= LARGEST_ASYMMETRY * abs(X).max():
            return False
    return bool(matrices)


class Damped(NamedTuple):
    """What is damped, for the answer.

    of: the term by part and number, such as K.2, or modes; by: the key of the damping, such as
    rayleigh; value: how much.
    """

    of: str
    by: str
    value: float | str | list[float]  # or the file of a table


def damped(
    system: System,
    rayleigh: Sequence[float] = (0.0, 0.0),
    ratios: Ratios = (),
    structural: float = 0.0,
    left_out: Mapping[str, Collection[int]] | None = None,
) -> tuple[System, tuple[Damped, ...]]:
    """The system with damping of its structure, and a list of what is damped.

    Below, K is the stiffness of `structure_stiffness` and Phi are its modes with M.

    Parameters
    ----------
    system : System
        The system.
    rayleigh : sequence of two float
        alpha (1/s) and beta (s): C gains alpha M + beta K.
    ratios : float, sequence of float or function
        Damping ratios zeta of all modes, of the first ones by rising omega, or as a function of
        frequencies (Hz) that is NaN for modes without damping: C gains M Phi diag(2 zeta omega)
        Phi' M, where Phi' M Phi = 1. A system of more than 2000 rows gains a row for each damped
        mode instead (`bordered`), and so does a sparse one of more than 400 rows where at most a
        tenth as many modes are damped. Of more than 2000 rows a function damps the lowest modes
        alone, a quarter to half of all at most, with a warning if more lie in its range.
    structural : float
        The loss factor eta: K gains i eta K. That describes exp(lambda t) with Im lambda > 0; roots
        below the real axis are mirror images.
    left_out : mapping of str to collections of int, optional
        Indices of terms that are left out, as they have damping of their own: of K by the name of
        the argument above, of M by "M". Terms of K that depend on the frequency are always left
        out by `rayleigh` and `structural`.

    Raises
    ------
    InputError
        Without stiffness, for one ratio for all modes of more than 2000 rows, or with an M that is
        not symmetric, positive definite.
    """
    alpha, beta = rayleigh
    indices_left_out = left_out or {}
    C = list(system.C)
    K = list(system.K)
    described: list[Damped] = []

    def terms_left_out(name: str) -> set[int]:
        """Indices of the terms of K that a kind of damping leaves out."""
        terms = set(indices_left_out.get(name, ()))
        for i, term in enumerate(system.K):
            if term.factor.names & set(system.follows):  # it depends on the frequency
                terms.add(i)
        return terms

    def describe(by: str, value: float, part: str, terms: Iterable[int]) -> None:
        """Add terms of M or K, by their indices, to what is damped."""
        for i in terms:
            described.append(Damped(f"{part}.{i + 1}", by, value))

    if alpha:
        mass_terms = [i for i in range(len(system.M)) if i not in indices_left_out.get("M", ())]
        for i in mass_terms:
            factor = Formula(f"{alpha!r} * ({system.M[i].factor.text})")
            name = f"rayleigh mass part {alpha:g} M.{i + 1}"
            C.append(dataclasses.replace(system.M[i], factor=factor, name=name))
        describe("rayleigh", alpha, "M", mass_terms)
    if beta:
        stiffness, stiffness_terms = structure_stiffness(system, terms_left_out("rayleigh"))
        term = _of_stiffness(system, stiffness_terms, beta, stiffness)
        C.append(dataclasses.replace(term, name=f"rayleigh stiffness part {beta:g} K"))
        describe("rayleigh", beta, "K", stiffness_terms)
    if structural:
        stiffness, stiffness_terms = structure_stiffness(system, terms_left_out("structural"))
        term = _of_stiffness(system, stiffness_terms, structural, stiffness)
        name = f"structural {structural:g} K"
        K.append(dataclasses.replace(term, factor=Modulus(imaginary=True), name=name))
        describe("structural", structural, "K", stiffness_terms)
    result = dataclasses.replace(system, C=tuple(C), K=tuple(K))
    if callable(ratios) or np.size(ratios):
        result, modes = _with_modal_damping(result, system, ratios)
        described.append(modes)
    return result, tuple(described)


def _of_stiffness(
    system: System, terms: Iterable[int], coefficient: float, stiffness: Matrix
) -> Term:
    """The term of a coefficient times the stiffness of the structure, with errors of its entries.

    terms: indices of the terms of K of which the stiffness (n, n) is made, see
    `structure_stiffness`.
    """
    parameters = frictionless(system)
    parts = []
    for i in terms:  # |factor| bounds the error of the real part
        weight = coefficient * abs(system.K[i].factor.value(parameters))
        parts.append((weight, system.K[i]))
    total = sum_of_terms(coefficient * stiffness, ONE, parts)
    return total.mapped(lambda X: (X + X.T) / 2)  # the symmetric part, of the errors too


def _with_modal_damping(system: System, undamped: System, ratios: Ratios) -> tuple[System, Damped]:
    """A system with damping ratios of the real modes of an undamped one, and what is damped.

    C gains U U' with U = M Phi diag(2 zeta omega)^(1/2). Raises InputError for more ratios than
    there are modes, and for one ratio of all modes of more than 2000 rows.

    Parameters
    ----------
    system : System
        The system that gains the damping; it may have Rayleigh damping already.
    undamped : System
        The system whose modes are damped.
    ratios : float, sequence of float or function
        As `damped`.
    """
    n = system.n
    K, _ = structure_stiffness(undamped)
    M = undamped.frozen().at()[0]
    is_large = n > MOST_DENSE
    if callable(ratios):
        # of a large system only the modes in the range of the table are computed
        omega, modes = real_modes(K, M, count=n, ratios=ratios if is_large else None)
        zeta = ratios(omega / math.tau)
        # the highest mode computed lies in the table's range, so that higher ones may lie in it too
        if is_large and np.isfinite(zeta[-1]):
            warnings.warn(
                f"damping.ratios: modes above {omega[-1] / math.tau:.6g} Hz are not damped, "
                f"although the table goes on: the lowest {len(omega)} of {n} are computed",
                InputWarning,
                stacklevel=2,
            )
    else:
        is_list = np.ndim(ratios) > 0
        if is_large and not is_list:
            raise InputError(
                f"damping.ratios: one ratio for all modes of {n} rows is not allowed; above "
                f"{MOST_DENSE} rows it must be a list for the first modes or a table of frequencies"
            )
        count = n  # one number is that of all modes
        if is_list:
            count = np.size(ratios)
        if count > n:
            raise InputError(
                f"damping.ratios: {count} ratios of {n} rows are not allowed; it must be at most "
                "one a row"
            )
        omega, modes = real_modes(K, M, count, ratios=None)
        if is_list and len(omega) < count:
            raise InputError(
                f"damping.ratios: {count} ratios of {len(omega)} modes are not allowed; the other "
                "rows have no mass"
            )
        zeta = np.broadcast_to(np.asarray(ratios, dtype=float), len(omega))
        is_all_damping = not system.C and system.real
        if is_list and count < n and is_all_damping:
            warnings.warn(
                f"damping.ratios: modes above {omega[-1] / math.tau:.6g} Hz are not damped, and "
                "nothing else damps: whether one of them grows slowly or not at all may stay open",
                InputWarning,
                stacklevel=2,
            )
    is_damped = np.isfinite(zeta)  # NaN: outside of the range of `ratios`
    if not is_damped.any():
        raise InputError("damping.ratios: no mode of the structure lies in the table's range")
    if undamped.digits is not None:  # modes of nearly one frequency may be any mixture of them
        system = system.assuming(
            f"damping by ratios is that of modes which {undamped.digits} digits do not determine"
        )
    U = (M @ modes[:, is_damped]) * np.sqrt(2 * zeta * omega)[is_damped]
    first, last = omega[is_damped][[0, -1]] / math.tau
    description = Damped(
        of=f"{is_damped.sum()} modes ({first:.6g} Hz, {last:.6g} Hz)",
        by="ratios",
        value=zeta[is_damped].tolist(),
    )
    damps_few = is_sparse(K) and n > FEWEST_BORDERED and U.shape[1] <= FEW_MODES * n
    if not is_large and not damps_few:
        damping = U @ U.T
        # of the products and of the modes: exact arithmetic must not take the entries for exact
        rounding = ROUNDED * n * EPS * norm_of(damping)
        term = Term(damping, rounding=rounding, name="ratios")
        return dataclasses.replace(system, C=(*system.C, term)), description
    return bordered(system, U), description


def bordered(system: System, U: Array, of_stiffness: bool = False) -> System:
    """A sparse system with U U' added to C, or to K, by k more unknowns instead of a full matrix.

    The unknowns w = U' q are defined by k more rows w - U' q = 0 of K. In the first n rows the
    force U U' q' of a damping is U w' with the time derivative w', and U in C; that of a stiffness
    is U w, and U in K. U has the shape (n, k).
    """
    from scipy.sparse import block_array, csc_array, eye_array

    n, k = U.shape

    def enlarged(term: Term) -> Term:
        """The term with rows and columns of zeros for the new unknowns."""

        def resized(matrix: Matrix) -> csc_array:
            X = csc_array(matrix, copy=True)
            X.resize((n + k, n + k))
            return X

        return term.mapped(resized)

    larger = system.mapped(enlarged, system.labels)
    zeros = csc_array((n, n))
    columns = csc_array(U)
    if of_stiffness:
        forces = block_array([[zeros, columns], [-columns.T, eye_array(k)]], format="csc")
        return dataclasses.replace(larger, K=(*larger.K, Term(forces, name="ratios")))
    forces = block_array([[zeros, columns], [None, csc_array((k, k))]], format="csc")
    definition = block_array([[zeros, None], [-columns.T, eye_array(k)]], format="csc")
    return dataclasses.replace(
        larger,
        C=(*larger.C, Term(forces, name="ratios")),
        K=(*larger.K, Term(definition, name=DEFINITION)),
    )
