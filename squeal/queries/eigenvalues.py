"""The verb `eigenvalues`: of a pad about its sliding equilibrium, or of a system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from squeal.io.scene import Scene
from squeal.io.writing import number
from squeal.linear import Matrices, Spectrum, UnstableMode, thresholds
from squeal.linear.eigen import Eigenvalue, growing
from squeal.linear.paths import SAME_ROOT, with_onsets
from squeal.queries.options import Band, Modes, Progress, Region, Subject, Workers, refuse_options
from squeal.queries.pads.equilibrium import (
    MATRIX_DIGITS,
    analyse,
    branch_system,
    damping_errors,
    is_known,
)
from squeal.results.columns import OPEN
from squeal.results.eigenvalues import COORDINATES, Eigenvalues, mode_shapes, shape_rows
from squeal.results.sources import PadAnalysis, PadSource
from squeal.results.sweep import Sweep
from squeal.schema import Positive, public

if TYPE_CHECKING:  # scenes start without the referee
    from squeal.queries.systems.proofs import Data


@public
def eigenvalues(
    subject: Subject,
    at: float | None = None,
    band: Band | None = None,
    region: Region | None = None,
    modes: Modes | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    look: Sweep | None = None,
    prove: bool | None = None,
    workers: Workers | None = None,  # `public` reads it
) -> Eigenvalues:
    """Compute eigenvalues, and the verdict on them.

    Parameters
    ----------
    subject : Scene, System, Assembly or SystemFile
        A scene is linearised about its sliding equilibrium.
    at : float, optional
        Value of the friction or of the free parameter; left out, the subject's own.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems. Of a system of more than 400 rows, roots
        that grow or decay faster than a quarter of the highest frequency (in rad/s) are left out.
    region : (float, float, float, float), optional
        Real parts (1/s) from, to, imaginary parts (rad/s) from, to, instead of a band.
    modes : int, optional
        So many roots of least |lambda| are listed, by rising frequency, of systems. Of a system of
        more than 400 rows it is 20 if neither a band nor a region is given.
    memory : float, optional
        Bytes that may be used; left out, what is free.
    progress : callable, optional
        Called with a line for each step of long work on a system; with a scene it is never called.
    look : Sweep, optional
        A sweep by the method modal (a first look) over this value: of more than 400 rows the roots
        are those of its reduced system, and nothing is certified.
    prove : bool, optional
        Left out, the referee judges all roots of a pad, or of a system of up to 400 rows. What it
        proves is certified, what hangs on the last digits of the entries has no verdict, and what
        it refutes is replaced. True calls the referee for the modes of a band of a larger system
        too, False calls it for none.
    workers : int, optional
        Threads for systems of more than 400 rows, 1 if left out; any number gives the same answer.

    Returns
    -------
    Eigenvalues
        Roots in rad/s by rising frequency, unstable modes, and whether a count certifies them.

    Raises
    ------
    InputError
        For what does not fit the subject, as the other verbs do.
    ComputationError
        If no steady sliding exists, or the system does not fit into the memory.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> squeal.eigenvalues(squeal.System([[1, 0], [0, 1]], K=K), at=1.0).verdict
    'flutter'
    """
    if isinstance(subject, Scene):
        refuse_options(
            "a scene",
            band=band,
            region=region,
            modes=modes,
            memory=memory,
            look=look,
            workers=workers,
        )
        scene = subject if at is None else subject.replace(mu=at)
        return pad_eigenvalues(scene, prove is not False)
    from squeal.queries.systems.eigenvalues import system_eigenvalues
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(subject, band, region, modes, memory, progress)
    return system_eigenvalues(analysis, at, look, prove)


def pad_eigenvalues(scene: Scene, prove: bool = True) -> Eigenvalues:
    """Compute the eigenvalues about the sliding equilibrium of a scene, and the verdict on them.

    With `prove` the referee judges the roots and the verdict. It takes the entries of the matrices
    as known to 12 digits, or less well where rounding of the equilibrium leaves larger errors.
    """
    analysis = analyse(scene)
    roots = tuple(analysis.spectrum.eigenvalues)
    verdict = analysis.verdict
    criterion = str(analysis.judgement) if verdict is not None else f"{OPEN}{analysis.doubt}"
    from squeal.queries.systems.proofs import Statement, refereed  # no other question needs it

    if not prove:
        # M is regular, so that there are 2n roots, and all of them were computed
        statement = Statement("counted", "count")
    elif analysis.errors is None:  # it is not known how precise the matrices are: `doubt` says why
        statement = Statement("open", by=None, reason=analysis.doubt)
    else:
        # the referee may replace roots, and decide what rounding left open; the shapes and the
        # unstable modes below are those of its roots
        roots, (verdict, criterion), statement = refereed(
            analysis.matrices, roots, (verdict, criterion), data_of_pad(scene, analysis)
        )
    # theta in rad times w is a length, as x and y
    shapes = mode_shapes(Spectrum(roots), (1.0, 1.0, scene.pad.w))
    return Eigenvalues(
        name=scene.model,
        parameter="mu",
        value=scene.pad.mu,
        eigenvalues=roots,
        verdict=verdict,
        criterion=criterion,
        unstable=_unstable_modes(scene, analysis, roots),
        certified=statement.status == "proved",
        count=len(roots),  # M is regular: all roots of the characteristic polynomial
        shapes=shape_rows(shapes, list(COORDINATES), "largest of x, y, w theta 1 m"),
        details=_details(analysis),
        notes=(_equilibrium_in_words(analysis),),
        warnings=analysis.warnings,
        source=PadSource(scene, analysis),
        proof=statement.to_dict(),
        proof_line=statement.words,
    )


def data_of_pad(scene: Scene, analysis: PadAnalysis) -> Data:
    """How precisely the referee may take the entries of M, C and K for known.

    The entries are computed at an equilibrium that is itself computed: they are known to
    `MATRIX_DIGITS` digits, or less well where rounding of the equilibrium moves them by more.
    """
    from squeal.proof.balls import half_widths
    from squeal.queries.systems.proofs import Data

    assert analysis.errors is not None
    C_error, K_error = analysis.errors
    errors = np.zeros((3, 3)), C_error + damping_errors(scene), K_error
    with_errors = list(zip(analysis.matrices, errors, strict=True))
    if all(is_known(X, error) for X, error in with_errors):
        return Data(MATRIX_DIGITS)
    # how far the entries of M, C and K may be off: by their error, but at least by their digits
    radii = tuple(np.maximum(error, half_widths(X, MATRIX_DIGITS)) for X, error in with_errors)
    # the entries (i, j) and (j, i) may be off by different errors: symmetry is not kept
    return Data(MATRIX_DIGITS, radii, keeps_symmetry=False, keeps_skew=False)


def _details(analysis: PadAnalysis) -> dict[str, Any]:
    """What the JSON object says of an equilibrium and of the matrices there."""
    equilibrium: dict[str, Any] = dict(zip(COORDINATES, analysis.q, strict=True))
    equilibrium |= {"R_n": analysis.R_n, "contact": analysis.contact}
    M, C, K = analysis.matrices
    return {
        "model": analysis.model,
        "equilibrium": equilibrium,
        "how": analysis.how,
        "M": M.tolist(),
        "C": C.tolist(),
        "K": K.tolist(),
        "basis": None,
    }


def _equilibrium_in_words(analysis: PadAnalysis) -> str:
    """The model, the equilibrium and its contact state, and how it was found, in two lines."""
    coordinates = [
        f"{name} = {number(value)} {unit}"
        for (name, unit), value in zip(COORDINATES.items(), analysis.q, strict=True)
    ]
    text = f"model {analysis.model}: {', '.join(coordinates)}, contact {analysis.contact}"
    if analysis.R_n is not None:
        text += f", R_n = {number(analysis.R_n)} N"
    return f"{text}\n({analysis.how})"


def _unstable_modes(
    scene: Scene, analysis: PadAnalysis, roots: Sequence[Eigenvalue]
) -> tuple[UnstableMode, ...]:
    """The growing modes among the roots of a scene, the fastest first, with the mu of their onset.

    Onsets are the thresholds along the branch of equilibria that begins at mu = 0. An onset is None
    where the mode grows without friction already, or where the equilibrium does not lie on that
    branch or lies beyond a fold of it, and where no eigenvalue path ends at the mode.
    """
    mu = scene.pad.mu
    unstable = growing(roots)
    if not unstable or mu == 0.0 or not analysis.on_branch:
        return unstable
    matrices_of_branch, path = branch_system(scene, mu)
    breakpoints: Sequence[float] = []
    if path is not None:  # B3 has none: it is linearised about the origin at any mu
        if path.mu_end < mu:  # the equilibrium lies beyond a fold
            return unstable
        breakpoints = path.breakpoints

    def on_branch(value: float) -> Matrices:
        """M, C, K at a value of mu. At the scene's mu they are exactly the analysed ones, so that
        the paths end at the modes."""
        return analysis.matrices if value == mu else matrices_of_branch(value)

    # a mode and a path belong together if their roots at mu differ by a share `SAME_ROOT` at most
    return with_onsets(unstable, thresholds(on_branch, mu, breakpoints), mu, SAME_ROOT)
