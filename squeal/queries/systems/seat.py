"""The seat of contact (its static solution: which pairs are closed, and their forces) in answers
that vary parameters: it is computed at one value, and held at the others."""

from dataclasses import replace

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.data_precision import with_doubts
from squeal.results.thresholds import Thresholds
from squeal.schema import Place
from squeal.sparse.assembly import ASSEMBLY_DEFAULTS

SEATED = 5  # values along a range, both ends among them, at which contact is seated anew
SAME = 1e-6  # of the largest: up to it stiffnesses and forces of two seats are the same


def seat_note(file: SystemFile) -> str:
    """Report at which value of the free parameter contact is seated: its static solution, which
    says which pairs are closed, is computed there and held at all other values.

    Empty without contact that has a seat. Not empty even if no matrix depends on the parameter:
    loads and gaps may, and only seating anew shows it.
    """
    assembly = file.assembly
    if assembly is None or not any(contact.has_seat for contact in assembly.contacts):
        return ""
    parameter = file.system.parameter
    at = f"{parameter} = {number(assembly.seated_system.parameters[parameter])}"
    return f"contact is that seated at {at}; {parameter}=VALUE in the file seats it anew"


def seat_parameters(file: SystemFile) -> list[str]:
    """Names of the parameters that act through the seat, the static solution of contact.

    While the seat is held, derivatives by such a parameter miss that effect. Such parameters are

    - parameters of loads and of keys of contact, on which no matrix depends;
    - parameters, but for the free one, in the factor of a contact that may change: one with pairs
      that open, stiffen or damp.
    """
    assembly = file.assembly
    if assembly is None:
        return []
    seated = assembly.seated_system
    # no matrix depends on these; the parameters that every assembly has are left out
    names = seated.parameters.keys() - seated.names - ASSEMBLY_DEFAULTS.keys()
    for contact in assembly.contacts_that_may_change:
        names |= Formula(contact.factor).names - {seated.parameter}
    return sorted(names)


def note_of_seat_parameters(file: SystemFile) -> str:
    """Report which parameters act through the seat, and which of their effects are left out.

    Empty if no parameter acts through the seat and no contact can change.
    """
    notes = []
    names = seat_parameters(file)
    if names:
        verb = "acts" if len(names) == 1 else "act"
        remedy = f"{names[0]}=VALUE in the file seats contact anew"
        notes.append(f"{', '.join(names)} {verb} through the seat: {remedy}")
    if file.assembly is not None and file.assembly.contacts_that_may_change:
        notes.append(
            "the effect of parameters on which pairs are closed and on contact forces is left out"
        )
    return "; ".join(notes)


def notes_of_seat(file: SystemFile) -> list[str]:
    """What an answer over several parameters misses while contact keeps its seat."""
    return [note for note in (seat_note(file), note_of_seat_parameters(file)) if note]


def warn_of_held_seat(file: SystemFile, verb: str) -> None:
    """Warn of what an answer over several parameters misses while contact keeps its seat."""
    for note in notes_of_seat(file):
        Place(verb).warn(note)


def thresholds_as_seated(file: SystemFile, answer: Thresholds) -> Thresholds:
    """Add a note on the seat to thresholds, which were located with the seat held.

    The seat is the static solution of contact: which pairs are closed, and their forces. Contact is
    seated anew at the crossings. If no seat differs there it is seated anew along the range, up to
    the first value at which it differs. Thresholds are not certified if a seat differs, since
    another seat may lose stability where the held one does not.
    """
    note = seat_note(file)
    if not note:
        return answer
    at_crossings = [doubt_of_seat(file, crossing.mu) for crossing in answer.crossings]
    doubts = list(filter(None, at_crossings))
    if not doubts:
        for value in np.linspace(answer.low, answer.high, SEATED).tolist():
            doubt = doubt_of_seat(file, value)
            if doubt:
                doubts = [doubt]
                break
    noted = replace(answer, seat=(note, *doubts))
    return with_doubts(noted, doubts) if doubts else noted


def doubt_of_seat(file: SystemFile, value: float) -> str:
    """Report how contact seated at a value of the free parameter differs from the held seat.

    A seat is a static solution of contact: which pairs are closed, and their forces. It differs if
    a stiffness of a pair does, or a force where forces damp. Empty if it does not differ, and
    without contact that has a seat.
    """
    if not seat_note(file):
        return ""
    assembly = file.assembly
    parameter = file.system.parameter
    at = f"{parameter} = {number(value)}"
    try:
        seats = assembly.joined_at({parameter: value}).seats
    except (ComputationError, InputError) as error:
        return f"contact cannot be seated anew at {at}: {error}"
    for contact, held, anew in zip(assembly.contacts, assembly.seats, seats, strict=True):
        compared = [(held.stiffness, anew.stiffness)]  # 0 where a pair is open
        if contact.is_damped:
            compared.append((held.forces, anew.forces))
        for before, after in compared:
            if np.max(np.abs(after - before)) > SAME * np.max(np.abs(before)):
                # the second sentence of a seat, behind ";", tells nothing of the difference
                anew_in_short = str(anew).split(";")[0]
                held_in_short = str(held).split(";")[0]
                return f"seated anew at {at} it is another {anew_in_short}; held is {held_in_short}"
    return ""
