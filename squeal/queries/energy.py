"""The verb `energy`: what each named term of M, C and K does to the growth and frequency of a mode.

With a root lambda = sigma + i omega and its right vector x the power balance of a cycle,
Re(conj(lambda) x^H P(lambda) x) = 0, over |lambda|^2 reads sigma D = work of all terms, where

    D = x^H M x + x^H K x / |lambda|^2  of the symmetric parts: twice the stored energy,
    work of C: -Re x^H C x,  of K: -omega Im x^H K x / |lambda|^2,  of M: omega Im x^H M x.

Symmetric stiffness and gyroscopic terms do no work. The works over D sum to sigma. They need no
left vectors, and stay finite where two modes meet.

What a small change of a term does is another question: its derivative takes the left vectors.
Frequency shares do too: since lambda scales with time, 2 K dlambda/dK + C dlambda/dC summed over
all terms of K and C is lambda.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from squeal.equilibrium.damping import damped_model
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.system import Origin, SystemFile
from squeal.io.writing import Answer, Column, Mark, Panel, Table, columns, number
from squeal.linear.damping import DEFINITION, frictionless
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import LARGEST_ASYMMETRY, MCK, Array
from squeal.linear.moduli import Modulus
from squeal.linear.roots import ComplexArray
from squeal.linear.sensitivity import sensitivities
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.model.equations import linearise
from squeal.queries.systems.sensitivity import at_own_frequency
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import PadAnalysis, PadSource, SystemSource
from squeal.schema import public

NO_CYCLE = 1e-8  # |D| over the sum of its parts below which a root does not oscillate
ROUNDING = 1e-12  # of |Im lambda|: growth of at most so much is 0 but for rounding
SPOKEN = 5  # modes that have a sentence, and parts that a line names
WEIGHT_IN_ROOT = {"M": 0.0, "C": 1.0, "K": 2.0}
"""The factors of dlambda/dM, dlambda/dC and dlambda/dK whose sum is lambda, see the module."""
NEGLIGIBLE = 1e-3  # of the largest work of a role in a mode: a sentence leaves out smaller ones


@dataclass(frozen=True)
class NamedTerm:
    """A term of M, C or K: factor times matrix (n, n), at some parameters.

    part: M, C or K; name: for people; role: friction, friction damping, damping, gyroscopic,
    circulatory, stiffness, mass or unsymmetric mass.
    """

    part: str
    name: str
    role: str
    matrix: Any
    factor: complex


@dataclass(frozen=True)
class Contribution:
    """What one term does to one mode.

    Attributes
    ----------
    mode, frequency_hz, growth_rate
        Of the mode: its number, frequency in Hz and growth rate in 1/s.
    part, term, role : str
        Of the term, see `NamedTerm`.
    growth : float or None
        Its work over twice the stored energy, 1/s; the terms of a mode sum to its growth rate. None
        of a root that does not oscillate.
    frequency : float or None
        Its share of the frequency, Hz; the terms sum to the mode's frequency. None where modes
        coalesce.
    d_real, d_hz : float or None
        What 1 % more of the term does to growth rate and frequency, 1/s and Hz; None where modes
        coalesce.
    """

    mode: int
    frequency_hz: float
    growth_rate: float
    part: str
    term: str
    role: str
    growth: float | None
    frequency: float | None
    d_real: float | None
    d_hz: float | None


@dataclass(frozen=True)
class PartShare:
    """What one part of the structure does to one mode.

    energy: its share of the stored energy; growth: the work of all terms on its rows over twice the
    stored energy, 1/s; damping: that of damping terms alone, below 0 where they take energy; all
    None of a root that does not oscillate.
    """

    mode: int
    part: str
    energy: float | None
    growth: float | None
    damping: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Energy(Answer):
    """Contributions of each term to each mode with Im lambda >= 0, and the shares of parts.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> C = [[0.2, 0], [0, 0.2]]
    >>> pair = squeal.System([[1, 0], [0, 1]], C, K, parameters={"mu": 1.0})
    >>> squeal.energy(squeal.eigenvalues(pair)).modes  # the fastest growing first
    [2, 1]
    """

    panel = Panel("term", "growth", Mark.BARS, "mode")

    name: str
    contributions: tuple[Contribution, ...]
    part_shares: tuple[PartShare, ...]

    @property
    def modes(self) -> list[int]:
        """Numbers of the modes, the fastest growing first."""
        rates = {row.mode: row.growth_rate for row in self.contributions}
        return sorted(rates, key=lambda mode: -rates[mode])

    def sentence(self, mode: int) -> str:
        """Which roles of terms put energy into a mode and which take it, in a line.

        Raises InputError for a mode that is not among `modes`.

        Examples
        --------
        >>> import squeal
        >>> damped = squeal.System([[1.0]], [[0.2]], [[4.0]])
        >>> squeal.energy(squeal.eigenvalues(damped)).sentence(1)
        'mode 1, 0.3179 Hz: damping takes 0.1 1/s; in all -0.1 1/s'
        """
        rows = [row for row in self.contributions if row.mode == mode]
        if not rows:
            raise InputError(f"mode: {mode} is not allowed; it must be one of {self.modes}")
        head = f"mode {mode}, {number(rows[0].frequency_hz, 4)} Hz"
        if rows[0].growth is None:
            return f"{head}: does not oscillate, so that no work of a cycle feeds it"
        works: dict[str, float] = {}  # by role, 1/s
        for row in rows:
            works[row.role] = works.get(row.role, 0.0) + (row.growth or 0.0)
        least = NEGLIGIBLE * max(map(abs, works.values()))  # a role that does less is left out
        balance = []
        for role in sorted(works, key=lambda role: -works[role]):
            if works[role] > least:
                balance.append(f"{role} puts in {works[role]:.4g} 1/s")
            elif works[role] < -least:
                balance.append(f"{role} takes {-works[role]:.4g} 1/s")
        works_in_words = ", ".join(balance) or "no term does work"
        return f"{head}: {works_in_words}; in all {number(rows[0].growth_rate, 4)} 1/s"

    def place(self, mode: int) -> str:
        """The five parts that store most of the energy of a mode, in a line, the largest first.

        Empty without parts, and for a mode that does not oscillate.

        Examples
        --------
        >>> import squeal
        >>> found = squeal.eigenvalues(squeal.System([[1.0]], [[0.2]], [[4.0]]))
        >>> squeal.energy(found, parts={"mass": [0]}).place(1)
        '100 % in mass'
        """
        shares = []
        for row in self.part_shares:
            if row.mode == mode and row.energy is not None:
                shares.append((row.energy, f"{number(100.0 * row.energy, 3)} % in {row.part}"))
        shares.sort(key=lambda share: -share[0])
        return ", ".join(text for _, text in shares[:SPOKEN])

    def table(self) -> Table:

        def growth(row: Contribution) -> str:
            """The growth as a number; growth of the size of rounding is shown as 0."""
            if row.growth is None:
                return "-"
            rounding = ROUNDING * math.tau * row.frequency_hz
            return number(row.growth) if abs(row.growth) > rounding else "0"

        all_columns = (
            *columns("mode frequency_hz part term"),
            Column("role", hidden=True),
            Column("growth", "1/s", shown=growth),
            Column("frequency", "Hz", words="of frequency, Hz"),
            Column("d_real", "1/s", words="dRe of 1 %, 1/s"),
            Column("d_hz", words="df of 1 %, Hz"),
        )
        title = "what each term does to each mode (growth sums to the growth rate)"
        rows = sorted(self.contributions, key=lambda row: (-row.growth_rate, row.mode))
        # of a long table people see the rows of highest rank: those of the fastest growing modes
        return Table(all_columns, rows, title, nothing="no root", rank=lambda row: row.growth_rate)

    def parts_table(self) -> Table:
        """The shares of parts.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], [[0.2, 0], [0, 0.2]], K)
        >>> found = squeal.energy(squeal.eigenvalues(pair), parts={"left": [0], "right": [1]})
        >>> [(row["part"], round(row["energy"], 9)) for row in found.parts_table().records()][:2]
        [('left', 0.5), ('right', 0.5)]
        """
        works = (Column("growth", "1/s"), Column("damping", "1/s", words="of it damping, 1/s"))

        def energy(row: PartShare) -> str:
            """The share in %; a share of the size of rounding is shown as 0."""
            return "-" if row.energy is None else number(round(100.0 * row.energy, 6), 4)

        share = Column("energy", shown=energy, percent=True)
        all_columns = (*columns("mode part"), share, *works)
        rank = {mode: -k for k, mode in enumerate(self.modes)}
        title = "where: share of the stored energy, and work on each part, of it by damping"
        return Table(all_columns, self.part_shares, title, rank=lambda row: rank[row.mode])

    def parts(self) -> Sequence[str | Table]:
        sentences = [self.sentence(mode) for mode in self.modes[:SPOKEN]]
        parts: list[str | Table] = ["\n".join(sentences), self.table()]
        if self.part_shares:
            parts.append(self.parts_table())
        return parts

    def to_dict(self) -> dict[str, Any]:
        return {
            "energy": self.table().records(),
            "energy_parts": self.parts_table().records(),
            "energy_sentences": [self.sentence(mode) for mode in self.modes],
        }


@public
def energy(found: Eigenvalues, parts: Mapping[str, Sequence[int]] | None = None) -> Energy:
    """Compute what each term of M, C and K does to the growth and the frequency of each mode.

    Parameters
    ----------
    found : Eigenvalues
        Roots with their vectors, of a pad or of a system; those of a first look have none.
    parts : mapping of str to sequence of int, optional
        Rows, from 0, of each part or element set, a row named twice counts once; left out, the
        components of an assembly.

    Returns
    -------
    Energy
        Growth in 1/s of each term, from the work of a cycle (right vectors): it sums to Re lambda
        of a mode that oscillates, and is None of another one. Frequency share in Hz and the effect
        of 1 % of a term, from left and right vectors.

    Raises
    ------
    InputError
        Without vectors, or for rows that the system has not.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> C = [[0.2, 0], [0, 0.2]]
    >>> pair = squeal.System([[1, 0], [0, 1]], C, K, parameters={"mu": 1.0})
    >>> print(squeal.energy(squeal.eigenvalues(pair)).sentence(2))
    mode 2, 0.2268 Hz: friction puts in 0.2036 1/s, damping takes 0.101 1/s; in all 0.1026 1/s
    """
    roots = [(mode, root) for mode, root in found.of_modes if root.value.imag >= 0.0]
    if any(not root.right.size for _, root in roots):
        raise InputError("found: roots of a first look have no vectors; eigenvalues has them")
    contributions: list[Contribution] = []
    part_shares: list[PartShare] = []
    for group in _groups_of_roots(found, roots):
        for k, (mode, root) in enumerate(group.roots):
            energy_of_mode = _energy_of_mode(group.terms, root)
            for i, term in enumerate(group.terms):
                growth = energy_of_mode.growth_of_term(i)
                # derivatives (rad/s) of root number k of the group by the relative size of the
                # term: with all other matrices held, and with those that follow the frequency
                # moving on with the root
                partial_slope = group.partial_slopes[f"term {i}"][k]
                slope = group.slopes[f"term {i}"][k]
                contributions.append(_contribution(mode, root, term, growth, partial_slope, slope))
            for name, rows in _rows_of_parts(found, parts, root.right.size).items():
                part_shares.append(energy_of_mode.share_of(mode, name, rows, group.terms))
    return Energy(found.name, tuple(contributions), tuple(part_shares))


NumberedRoot = tuple[int, Eigenvalue]
"""The number of a mode, and its root."""


class _GroupOfRoots(NamedTuple):
    """Roots that have the same matrices, and the terms of the matrices.

    Attributes
    ----------
    roots : sequence of m NumberedRoot
        The roots.
    terms : sequence of NamedTerm
        The terms of M, C and K.
    partial_slopes, slopes : mapping of str to array (m,)
        Derivatives of the roots by the relative size of each term, rad/s, see `_slopes_of`: with
        all other matrices held, and with those that follow the frequency moving on with the root.
    """

    roots: Sequence[NumberedRoot]
    terms: Sequence[NamedTerm]
    partial_slopes: Mapping[str, ComplexArray]
    slopes: Mapping[str, ComplexArray]


def _groups_of_roots(answer: Eigenvalues, roots: Sequence[NumberedRoot]) -> Iterator[_GroupOfRoots]:
    """Group the roots by their matrices, and give each group the terms of its matrices.

    All roots have the same matrices, unless some matrix follows the frequency: then each root is a
    group, with the matrices at its frequency.
    """
    source = answer.source
    if isinstance(source, PadSource):
        assert source.analysis is not None
        terms = pad_terms(source.scene.replace(mu=answer.value), source.analysis)
        slopes = _slopes_of(terms, [root for _, root in roots], {})
        # no matrix follows the frequency: the partial derivatives are the whole ones
        yield _GroupOfRoots(roots, terms, slopes, slopes)
        return
    assert source is not None
    system = source.file.system
    groups = [roots]
    if system.follows:
        groups = [[root] for root in roots]
    for group in groups:
        # where matrices follow the frequency this is that of the only root; else any value serves
        omega = max((root.value.imag for _, root in group), default=None)
        frozen = system.frozen(omega)
        terms = named_terms(frozen, source.file)
        eigenvalues = [root for _, root in group]
        by_frequency = {name: frozen.derivative(name) for name in system.follows}
        partial_slopes = _slopes_of(terms, eigenvalues, by_frequency)
        # the frequency of a root above the real axis moves as its imaginary part does
        slopes = at_own_frequency(system, partial_slopes, frequency_slope=np.imag)
        yield _GroupOfRoots(group, terms, partial_slopes, slopes)


def _rows_of_parts(
    answer: Eigenvalues, parts: Mapping[str, Sequence[int]] | None, size: int
) -> Mapping[str, Sequence[int]]:
    """The rows of each part: the given ones, else those of the components of an assembly.

    Raises InputError for rows that a system of this size does not have.
    """
    if not parts:
        if isinstance(answer.source, SystemSource):
            return component_rows(answer.source.file)
        return {}
    for name, rows in parts.items():
        if any(not 0 <= row < size for row in rows):
            raise InputError(f"parts: {name}: is not allowed; it must be rows from 0 to {size - 1}")
    return parts


def component_rows(file: SystemFile) -> dict[str, range]:
    """The rows of each component of an assembly, by name; none of other systems."""
    rows: dict[str, range] = {}
    if file.assembly is None:
        return rows
    start = 0
    for body in file.assembly.components:
        rows[body.name] = range(start, start + body.system.n)
        start += body.system.n
    return rows


def named_terms(system: TermSystem, file: SystemFile) -> list[NamedTerm]:
    """The terms of a system at its parameters, with names by factor and file, and their roles.

    Without the term that defines the unknowns of damped modes, which does no work.
    """
    parameters = system.parameters
    # mu, or the free parameter of a system without mu: what `frictionless` sets to 0 if all are 1
    without_friction = frictionless(system, dict.fromkeys(parameters, 1.0))
    set_to_zero = {name for name in parameters if not without_friction[name]}
    # a term of joined components is a sum over several files: it has no file of its own
    origins = file.origins if file.assembly is None else ()
    named = []
    for part, terms in zip("MCK", system.parts, strict=True):
        # K4, structural damping, counts as K: the first letter of a file's key names the part
        origins_of_part = [origin for origin in origins if origin.part[0] == part]
        for k, term in enumerate(terms):
            if term.name == DEFINITION:
                continue
            # the first terms of a part are those of files, in the order of the origins; a later
            # term is damping that the system file adds, and has no origin
            origin = origins_of_part[k] if k < len(origins_of_part) else None
            factor = term.factor.value(parameters)
            name = term.name or _name_of(term, origin)
            role = _role_of(part, term, bool(term.factor.names & set_to_zero))
            named.append(NamedTerm(part, name, role, term.matrix, factor))
    return named


def _name_of(term: Term, origin: Origin | None) -> str:
    """The file of a term, its key there and its factor; else the factor alone."""
    factor = term.factor.text
    if origin is None or not origin.file:
        return factor
    name = origin.file
    if origin.key:  # of a file with several matrices
        name += f": {origin.key}"
    if factor == "1":
        return name
    return f"{name}, {factor}"


def _role_of(part: str, term: Term, changes_without_friction: bool) -> str:
    """What a term does, by its part, its symmetry and whether its factor depends on friction.

    Of C: skew terms are gyroscopic, all others damping, of friction or not. Of K: friction first,
    then unsymmetric terms are circulatory, symmetric ones with a loss factor damping, the remaining
    ones stiffness. Of M: mass, if symmetric.

    changes_without_friction: whether the factor depends on the parameter that `frictionless` sets
    to zero: mu, or the free parameter of a system without mu, which may be a speed.
    """
    size = abs(term.matrix).max()
    is_skew = size > 0.0 and abs(term.matrix + term.matrix.T).max() <= LARGEST_ASYMMETRY * size
    is_symmetric = abs(term.matrix - term.matrix.T).max() <= LARGEST_ASYMMETRY * size
    if part == "C":
        if is_skew:
            return "gyroscopic"
        return "friction damping" if changes_without_friction else "damping"
    # a skew term of K whose factor depends on a speed, not on mu, is no friction: it is damping
    # that turns with a shaft, or the swirl in a bearing
    is_friction = changes_without_friction and ("mu" in term.factor.names or not is_skew)
    if part == "K" and is_friction:
        return "friction"
    if not is_symmetric:
        return "circulatory" if part == "K" else "unsymmetric mass"
    if np.iscomplexobj(term.matrix) or isinstance(term.factor, Modulus):  # with a loss factor
        return "damping"
    return "stiffness" if part == "K" else "mass"


def pad_terms(scene: Scene, analysis: PadAnalysis) -> list[NamedTerm]:
    """The terms of a pad: the matrices without friction, and what friction adds to them.

    All are taken about the equilibrium with friction.
    """
    model = damped_model(scene)
    q = np.array(analysis.q)
    frictionless_matrices = linearise(model.replace(mu=0.0), q, analysis.state)
    M, C, K = linearise(model, q, analysis.state)
    terms = (  # each with its part, name, role, matrix and factor
        NamedTerm("M", "mass", "mass", M, 1.0),
        NamedTerm("C", "damping", "damping", frictionless_matrices.C, 1.0),
        NamedTerm("C", "falling friction", "friction damping", C - frictionless_matrices.C, 1.0),
        NamedTerm("K", "springs and contact", "stiffness", frictionless_matrices.K, 1.0),
        NamedTerm("K", "friction", "friction", K - frictionless_matrices.K, 1.0),
    )
    return [term for term in terms if np.any(term.matrix)]


def _slopes_of(
    terms: Sequence[NamedTerm], roots: Sequence[Eigenvalue], by_frequency: Mapping[str, MCK]
) -> dict[str, ComplexArray]:
    """Compute how fast each root moves as one term grows by a share of itself, the others held.

    Parameters
    ----------
    terms : sequence of NamedTerm
        All terms of M, C and K.
    roots : sequence of m Eigenvalue
        The roots, which have these matrices.
    by_frequency : mapping of str to (dM, dC, dK)
        Derivatives of the matrices by the parameters that are the frequency of a root.

    Returns
    -------
    dict of str to array (m,)
        Derivatives of the roots, rad/s: by "term 0", "term 1" and so on by the relative size of
        each term, and by the parameters of `by_frequency`.
    """
    nothing: dict[str, Any] = {"M": None, "C": None, "K": None}  # None is a matrix of zeros
    matrices = dict(nothing)
    changes = dict(by_frequency)
    for k, term in enumerate(terms):
        scaled = term.factor * term.matrix
        total = matrices[term.part]
        matrices[term.part] = scaled if total is None else total + scaled
        # the derivative of M, C or K by the relative size of a term of it is the term itself
        derivatives = nothing | {term.part: scaled}
        changes[f"term {k}"] = (derivatives["M"], derivatives["C"], derivatives["K"])
    slopes, _ = sensitivities((matrices["M"], matrices["C"], matrices["K"]), changes, roots)
    return slopes


def stored_and_work(term: NamedTerm, root: complex, right: ComplexArray) -> tuple[Array, Array]:
    """What a term adds to D, and to the work of a cycle (see the module), each row by row (n,).

    With A the factor times the matrix of the term, and x the mode shape (`right`),
    x^H A x = h + i s, where h is the share of the Hermitian part (A + A^H) / 2 and i s the share of
    the skew-Hermitian part (A - A^H) / 2. With omega = Im lambda the term adds

        of M: h to D, omega s to the work;  of K: h / |lambda|^2, -omega s / |lambda|^2;
        of C: 0, -h.
    """
    image = term.factor * (term.matrix @ right)  # A x
    adjoint_image = np.conj(term.factor) * (term.matrix.conj().T @ right)  # A^H x
    h = (right.conj() * (image + adjoint_image)).real / 2
    s = (right.conj() * (image - adjoint_image)).imag / 2
    if term.part == "C":
        return np.zeros(len(h)), -h
    if term.part == "M":
        return h, root.imag * s
    square = abs(root) ** 2 or 1.0  # a root of 0 does not oscillate: its energy is not used
    return h / square, -root.imag * s / square


class _EnergyOfMode(NamedTuple):
    """Stored energy of a mode, and what its terms add to its growth rate, both row by row.

    Attributes
    ----------
    stored : array (n,)
        Energy of each row: its part of D, see the module.
    growths : list of array (n,)
        For each term the part of the growth rate by its work on each row, 1/s; empty for a mode
        that does not oscillate.
    """

    stored: Array
    growths: list[Array]

    def growth_of_term(self, k: int) -> float | None:
        """What term number k adds to the growth rate, 1/s; None if the mode does not oscillate."""
        if not self.growths:
            return None
        return float(self.growths[k].sum())

    def share_of(
        self, mode: int, part: str, rows: Sequence[int], terms: Sequence[NamedTerm]
    ) -> PartShare:
        """The share of a part, which has these rows, in the stored energy and the growth rate.

        `energy` is between 0 and 1; `growth` is what all terms add on its rows, `damping` what
        terms of damping add there, both in 1/s. None of a mode that does not oscillate.
        """
        if not self.growths:
            return PartShare(mode, part, energy=None, growth=None, damping=None)
        index = sorted({*rows})  # a row that is named twice counts once
        share = float(self.stored[index].sum()) / float(self.stored.sum())
        growth = 0.0
        damping = 0.0
        for term, growth_of_term in zip(terms, self.growths, strict=True):
            growth_on_part = float(growth_of_term[index].sum())
            growth += growth_on_part
            if "damping" in term.role:
                damping += growth_on_part
        return PartShare(mode, part, share, growth, damping)


def _energy_of_mode(terms: Sequence[NamedTerm], root: Eigenvalue) -> _EnergyOfMode:
    """Compute the stored energy of a mode, and the work of each term over it, both row by row.

    A real root does not oscillate: D = x^H M x + x^H K x / lambda^2 is 0 but for rounding of its
    two parts where damping is absent, since K x = -lambda^2 M x. The same holds nearly of a root
    with a small imaginary part.
    """
    D = np.zeros(root.right.size)
    magnitude = 0.0  # the sum of the sizes of the parts of D
    works = []
    for term in terms:
        stored, work = stored_and_work(term, root.value, root.right)
        D = D + stored
        magnitude += abs(float(stored.sum()))
        works.append(work)
    total = float(D.sum())
    if root.value.imag <= 0.0 or abs(total) <= NO_CYCLE * magnitude:
        return _EnergyOfMode(D, [])
    return _EnergyOfMode(D, [work / total for work in works])


def _contribution(
    mode: int,
    root: Eigenvalue,
    term: NamedTerm,
    growth: float | None,
    partial_slope: complex,
    slope: complex,
) -> Contribution:
    """The row of a term and a mode.

    growth: what the term adds to the growth rate, 1/s; partial_slope, slope: derivatives of the
    root by the term's relative size, see `_GroupOfRoots`; not finite where modes coalesce.
    """
    frequency = d_real = d_hz = None
    if np.isfinite(slope):
        # the share of the term in Im lambda, which is the sum of those of all terms, see the module
        frequency = float(WEIGHT_IN_ROOT[term.part] * partial_slope.imag) / math.tau
        # the effects of 1 % more of the term
        d_real = float(0.01 * slope.real)
        d_hz = float(0.01 * slope.imag) / math.tau
    return Contribution(
        mode=mode,
        frequency_hz=root.frequency_hz,
        growth_rate=root.growth_rate,
        part=term.part,
        term=term.name,
        role=term.role,
        growth=growth,
        frequency=frequency,
        d_real=d_real,
        d_hz=d_hz,
    )
