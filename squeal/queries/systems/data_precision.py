"""How precisely a system is known, by the digits of its files, by the reduction of its components
and by what was assumed of it; and how that qualifies roots, verdicts and thresholds."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.linear.digits import are_symmetric, data_errors, known_to_digits, rounding_of_sums
from squeal.linear.eigen import Eigenvalue, of_unit_mass
from squeal.linear.matrices import Array
from squeal.linear.system import TermSystem
from squeal.proof import HALF_ULP
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.proofs import Data, EigenvalueTuple
from squeal.queries.systems.roots import AddErrors, SystemRoots, system_roots
from squeal.results.columns import OPEN
from squeal.results.sources import EigenvalueSelection
from squeal.results.thresholds import Thresholds


def error_bounds(file: SystemFile, system: TermSystem) -> AddErrors | None:
    """The function that adds to roots (m,) how far their true values may be off, 1/s.

    Errors come from the reduction of components and from the digits of the files, and are added.
    None where the entries are exact and nothing was reduced: then only rounding moves the roots.
    """
    bounds: list[AddErrors] = []
    if file.assembly is not None and file.assembly.reduction:
        bounds.append(partial(file.assembly.bounded, system))
    # the bound by digits leaves out how matrices change with the frequency: of those that follow it
    # there is none
    if system.digits and not system.follows:
        bounds.append(partial(known_to_digits, system))
    if len(bounds) < 2:
        return bounds[0] if bounds else None
    by_reduction, by_digits = bounds
    return lambda roots: _with_both_errors(by_reduction(roots), by_digits(roots))


def _with_both_errors(by_reduction: EigenvalueTuple, by_digits: EigenvalueTuple) -> EigenvalueTuple:
    """Roots whose error is the sum of that by a reduction and that by digits.

    The arguments are the same roots, each with one of both errors. A root whose error by the
    reduction is not known (None) stays as it is.
    """
    summed = []
    for root, with_digits in zip(by_reduction, by_digits, strict=True):
        if root.error is not None:
            rounding = root.rounding + with_digits.rounding
            # a real part of exactly zero is known, see `judge_roots`
            has_unknown_sign = 0.0 < abs(root.value.real) <= rounding
            root = replace(
                root,
                error=root.error + (with_digits.error or 0.0),
                rounding=rounding,
                sign_is_open=root.sign_is_open or with_digits.sign_is_open or has_unknown_sign,
            )
        summed.append(root)
    return tuple(summed)


def data_of(file: SystemFile, system: TermSystem) -> Data | None:
    """How precisely the referee may take the entries of M, C and K for known.

    None where it does not judge all roots: of large systems, of matrices that follow the frequency,
    and of reduced components, whose matrices are computed. Else half an ulp (half a unit in the
    last place of a double), and in addition

    - of files with few digits half a unit of the last digit, and the rounding of sums of terms;
    - of others the rounding of sums, if anything was rounded.

    In both cases M and K count as symmetric, and C as skew, only if all terms are: the error of an
    entry (i, j) of one term and that of (j, i) of another one differ.

    system: that of the file, at these or at other parameters.
    """
    if not is_small(system) or (file.assembly is not None and file.assembly.reduction):
        return None
    keeps_symmetry = are_symmetric(system, (*system.M, *system.K))
    keeps_skew = are_symmetric(system, system.C, sign=-1)
    radii = rounding_of_sums(system)
    if system.digits:
        errors: list[Array] = []
        for by_digits, by_sums in zip(data_errors(system), radii, strict=True):
            errors.append(by_digits.toarray() + by_sums)
        return Data(f"{system.digits} digits", tuple(errors), keeps_symmetry, keeps_skew)
    if not any(radius.any() for radius in radii):
        return Data()  # each entry is one given number, known to half an ulp
    return Data(HALF_ULP, radii, keeps_symmetry, keeps_skew)


def roots_of_file(
    file: SystemFile,
    selection: EigenvalueSelection,
    system: TermSystem | None = None,
    is_judged: bool = True,
) -> SystemRoots:
    """The selected roots of a system with the errors of its data; the referee judges a small one.

    A small system P = z^2 M + z C + K is solved as D P (`TermSystem.balanced`): the diagonal D
    gives its rows units that fit those of its columns. D P has the roots and right vectors of P;
    its left vectors y, y^H D P = 0, give those of P, which are D y.

    Parameters
    ----------
    file : SystemFile
        The system with what is known of it.
    selection : EigenvalueSelection
        Which roots.
    system : System, optional
        The system at other parameters than those of the file.
    is_judged : bool
        Whether the referee judges the roots of a small system.
    """
    original = system or file.system
    solved = original.balanced if is_small(original) else original
    roots = system_roots(
        solved,
        selection,
        add_errors=error_bounds(file, solved),
        data=data_of(file, solved) if is_judged else None,
    )
    if solved is original:
        return roots
    M, _, _ = original.arrays()

    def of_original_rows(root: Eigenvalue) -> Eigenvalue:
        """The root with the vectors of the original system; `row_units` is the diagonal of D."""
        right = of_unit_mass(root.right, M)
        left = of_unit_mass(original.row_units * root.left, M)
        return replace(root, right=right, left=left)

    return replace(
        roots,
        eigenvalues=tuple(map(of_original_rows, roots.eigenvalues)),
        others=tuple(map(of_original_rows, roots.others)),
    )


def digits_of_files(file: SystemFile) -> str:
    """What leaves roots of a system open, in words, such as "the 6 digits of K.mtx": the reduction
    of its components, if they were reduced, and the digits of its files, if these are few."""
    digits_of = {matrix.file: matrix.digits for matrix in file.origins if matrix.digits is not None}
    # a matrix that stands in the system file itself has no file name
    causes = [f"the {digits} digits of {name}" for name, digits in digits_of.items() if name]
    if file.system.digits and not causes:
        causes = ["the digits of the matrices"]
    if file.assembly is not None and file.assembly.reduction:
        causes.insert(0, "the reduction")
    return " and ".join(causes)


def open_by_digits(file: SystemFile, roots: EigenvalueTuple) -> str:
    """Say why the verdict is open if the digits of files leave the sign of a growth rate open.

    Empty if they do not.
    """
    # their errors hide the sign of growth
    sign_open = [root for root in roots if root.sign_is_open]
    if not sign_open or not file.system.digits:
        return ""
    farthest = max(root.error or 0.0 for root in sign_open)
    count = "1 root is" if len(sign_open) == 1 else f"{len(sign_open)} roots are"
    return (
        f"{OPEN}{count} known to {number(farthest, 2)} 1/s by {digits_of_files(file)}, and neither "
        "grow nor decay as far as these say"
    )


def accuracy_by_digits(file: SystemFile, roots: EigenvalueTuple) -> str:
    """Say to what share of |lambda| the digits of files determine the roots of decided sign.

    Empty where the files hold all digits, or where no root has both an error and a decided sign.
    """
    decided = [root for root in roots if root.error is not None and not root.sign_is_open]
    if not decided or not file.system.digits:
        return ""
    share = max((root.error or 0.0) / abs(root.value) for root in decided if root.value)
    return f"roots that are not open are known to {number(share, 2)} by {digits_of_files(file)}"


def with_doubts(answer: Thresholds, doubts: Sequence[str]) -> Thresholds:
    """The thresholds, neither certified nor proved any more.

    The reason is what was doubted before, and the new doubts.
    """
    all_doubts = [*answer.doubts, *doubts]
    proof = None
    proof_line = ""
    if answer.proof is not None:
        reason = "; ".join(all_doubts)
        # of growth below a rate nothing is known either: that bound held only with the proof
        proof = {**answer.proof, "status": "open", "growth_below": None, "reason": reason}
        proof_line = f"{OPEN}{reason}"
    return replace(
        answer,
        certified=False,
        details={**answer.details, "doubts": all_doubts},
        proof=proof,
        proof_line=proof_line,
    )
