"""Terms of a system file: which there are, what multiplies each, and the damping that they name."""

from dataclasses import dataclass, field, replace
from keyword import iskeyword
from pathlib import Path

from squeal.io.system_keys import POWERS, Document
from squeal.io.tables import read_rising
from squeal.linear.damping import Damped
from squeal.linear.moduli import FREQUENCY, Modulus, Table, Tabulated
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.schema import NAME, NOT_NEGATIVE, Place, scalar

PARTS = ("M", "C", "K")


@dataclass(frozen=True)
class TermKeys:
    """A term of a file: its part (M, C, K or K4), where it stands, and the values of its keys."""

    part: str
    at: Place
    keys: Document

    @property
    def matrix_part(self) -> str:
        """M, C or K; the structural damping K4 is a part of K."""
        return self.part[0]


def swept_parameter(system: Document, at: Place) -> str:
    """The name of the parameter that is swept, in formulas. Raises InputError."""
    name: str = system.get("parameter") or "mu"
    if POWERS.keys().isdisjoint(system):
        NAME.read(name, at / "parameter")
        return name
    if not name.isidentifier() or iskeyword(name):
        return "p"  # in formulas a parameter is a word
    return name


def terms_of(system: Document, at: Place, parameter: str) -> list[TermKeys]:
    """The terms of M, C, K and K4 in their order, powers of the parameter among them. K4 is the
    matrix of structural damping, which adds i K4 to K.

    system: the keys of a system file; parameter: the one that is swept, whose powers multiply K0,
    K1, ..., and C0, C1, ...
    """
    terms = []
    for part in PARTS:
        terms += _terms_of_part(part, system.get(part, ()), at / part)
        names = [name for name in POWERS if name[0] == part]  # K0, K1, ... of K; none of M
        for power, name in enumerate(names):
            if name in system:
                factor = f"{parameter}**{power}" if power else "1"
                terms.append(TermKeys(part, at / name, {"matrix": system[name], "factor": factor}))
    K4 = system.get("damping", {}).get("K4", ())
    return terms + _terms_of_part("K4", K4, at / "damping" / "K4")


def _terms_of_part(part: str, terms: tuple[Document, ...], at: Place) -> list[TermKeys]:
    """The terms of a part; several are numbered from 1 in messages."""
    if len(terms) == 1:
        return [TermKeys(part, at, terms[0])]
    return [TermKeys(part, at / str(number), term) for number, term in enumerate(terms, 1)]


def formula_of(term: TermKeys) -> Formula:
    """What a term is multiplied with, without tables and loss factors. Raises InputError."""
    with (term.at / "factor").prefixing_errors():
        formula = Formula(term.keys.get("factor", "1"), str(term.at / "factor"))
    if not formula.names:
        formula.value({})  # refuses one without a value, such as 1/0
    return formula


def factor_of(
    term: TermKeys, formula: Formula, folder: Path, parameter: str
) -> Formula | Modulus | Tabulated:
    """What a term is multiplied with, tables and loss factors included. Raises InputError.

    formula: its `factor`; parameter: the free parameter, over which a table may stand.
    """
    if "table" in term.keys:
        return _tabulated(term, formula, folder, parameter)
    for key, allowed in {"rayleigh": "MK", "structural": "K", "modulus": "CK"}.items():
        if key in term.keys and term.part not in allowed:
            raise (term.at / key).refuse(
                f"is not allowed at a term of {term.part}; terms of {' and '.join(allowed)} take it"
            )
    if term.part == "K4":  # the system gains i K4
        return Modulus(formula, imaginary=True)
    if "modulus" in term.keys:
        return _tabulated_modulus(term, formula, folder)
    if "structural" not in term.keys:
        return formula
    here = term.at / "structural"
    with here.prefixing_errors():
        loss = Formula(term.keys["structural"], str(here))
    if not loss.names:
        NOT_NEGATIVE.read(loss.value({}), here)
    return Modulus(formula, loss)


def _tabulated_modulus(term: TermKeys, formula: Formula, folder: Path) -> Modulus:
    """The factor of a term that has the key `modulus`: a complex modulus over frequency, from a
    table, times a formula. Raises InputError.
    """
    source = folder / term.keys["modulus"]["file"]
    columns = ("frequency", "storage")
    with (term.at / "modulus" / "file").prefixing_errors():
        frequencies, storage, loss = read_rising(source, columns, NOT_NEGATIVE, optional="loss")
    if term.part == "C" and any(loss):
        raise (term.at / "modulus").refuse(
            f"{source.name} has losses; at a term of C none are allowed"
        )
    return Modulus(formula, table=Table(str(source), frequencies, storage, loss))


def _tabulated(term: TermKeys, formula: Formula, folder: Path, parameter: str) -> Tabulated:
    """The factor of a term that has the key `table`: a column of the table times a formula.

    folder: that of the system file, from which the table is looked for; parameter: the one that is
    swept; the column is given over it unless the key `over` of the table names another one. Raises
    InputError.
    """
    here = term.at / "table"
    if term.part not in ("C", "K"):
        raise here.refuse(f"is not allowed at a term of {term.part}; terms of C and K take it")
    for key in ("rayleigh", "structural"):
        if key in term.keys:
            raise (term.at / key).refuse("is not allowed beside table")
    table = term.keys["table"]
    over = table.get("over", parameter)
    if over in FREQUENCY:
        raise here.refuse(f"over {over} is not allowed; the key modulus takes tables over it")
    column = table["column"].strip().lower()
    source = folder / table["file"]
    with (here / "file").prefixing_errors():
        points, quantities = read_rising(source, (over.lower(), column))
    return Tabulated(
        factor=formula,
        parameter=over,
        source=str(source),
        column=column,
        points=tuple(points),
        quantities=tuple(quantities),
    )


@dataclass
class TermDamping:
    """The damping that terms name themselves.

    Attributes
    ----------
    terms : list of Term
        The terms that C gains.
    indices : dict of sets of int
        The terms that the damping of the whole leaves out, as the argument `left_out` of `damped`
        takes them: of M by "M", of K by the kind of damping.
    records : list of Damped
        What is damped.
    """

    terms: list[Term] = field(default_factory=list)
    indices: dict[str, set[int]] = field(
        default_factory=lambda: {"M": set(), "rayleigh": set(), "structural": set()}
    )
    records: list[Damped] = field(default_factory=list)

    def add(
        self,
        term: TermKeys,
        index: int,
        made: Term,
        formula: Formula,
    ) -> None:
        """Take the damping that a term names, so that the damping of the whole leaves it out.

        Parameters
        ----------
        term : TermKeys
            The keys of the term.
        index : int
            Its index among the terms of M, C or K.
        made : Term
            The term of the system that these keys make.
        formula : Formula
            What multiplies it, without tables and loss factors.
        """
        name = f"{term.part}.{index + 1}"
        if term.part == "K4":
            self.indices["structural"].add(index)
            self.records.append(Damped("K", "K4", formula.text))
        if "rayleigh" in term.keys:
            factor = scalar(str(term.keys["rayleigh"]))
            # the damping of the whole is alpha M + beta K: leave this term out of alpha M, or of
            # beta K
            kind = "M" if term.part == "M" else "rayleigh"
            self.indices[kind].add(index)
            self.records.append(Damped(name, "rayleigh", factor))
            product = Formula(f"{factor!r} * ({formula.text})", formula.place)
            term_name = f"rayleigh {factor:g} {name}"
            real = made.matrix.real  # imaginary parts of a stiffness are damping themselves
            self.terms.append(replace(made, matrix=real, factor=product, name=term_name))
        if "structural" in term.keys:
            self.indices["structural"].add(index)
            self.records.append(Damped(name, "structural", scalar(str(term.keys["structural"]))))
        if "modulus" in term.keys:
            if term.part == "K":  # its table has the losses
                self.indices["structural"].add(index)
            self.records.append(Damped(name, "modulus", term.keys["modulus"]["file"]))
