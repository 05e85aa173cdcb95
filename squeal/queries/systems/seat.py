"""What answers that vary parameters say of the seat of contact, which stays meanwhile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.known import with_doubts
from squeal.results.thresholds import Thresholds
from squeal.sparse.assembly import ASSEMBLY_DEFAULTS, Assembly
from squeal.sparse.contact_seat import Contact

SAME = 1e-6  # of the largest one: differences of stiffnesses and forces that count as none


def seat_note(file: SystemFile) -> str:
    """At which value of the free parameter contact is seated; empty where that moves no seat."""
    assembly = file.assembly
    if assembly is None or not _has_seat(assembly):
        return ""
    seated = assembly.system
    parameter = file.system.parameter
    if not any(parameter in term.factor.names for term in seated.K):
        return ""
    at = f"{parameter} = {number(seated.parameters[parameter])}"
    return f"contact is that seated at {at}; --set {parameter}=VALUE seats it anew"


def seat_parameters(file: SystemFile) -> list[str]:
    """Parameters that may act through the seat, so that a held seat says nothing of them: those
    of loads and of keys of contact, and the factor of contact whose pairs open or stiffen."""
    assembly = file.assembly
    if assembly is None:
        return []
    seated = assembly.system
    names = seated.parameters.keys() - seated.names - ASSEMBLY_DEFAULTS.keys()
    for contact in _contacts_that_may_change(assembly):
        names |= Formula(contact.factor).names
    return sorted(names - {seated.parameter})


def _contacts_that_may_change(assembly: Assembly) -> list[Contact]:
    """Contacts whose part in the roots follows their forces: pairs are open or stiffen, or the
    forces damp."""
    changing = []
    for contact, seat in zip(assembly.contacts, assembly.seats, strict=True):
        if not (seat.constant and seat.closed.all()) or _is_damped(contact):
            changing.append(contact)
    return changing


def note_of_seat_parameters(file: SystemFile) -> str:
    """Which parameters are left out where the seat is held, and what is held of the others; empty
    if contact is none of their matter."""
    notes = []
    names = seat_parameters(file)
    if names:
        verb = "acts" if len(names) == 1 else "act"
        way = f"--set {names[0]}=VALUE seats contact anew"
        notes.append(f"{', '.join(names)} {verb} through the seat: {way}")
    if file.assembly is not None and _contacts_that_may_change(file.assembly):
        notes.append(
            "what a parameter does to the pairs that are closed, and to forces, is left out"
        )
    return "; ".join(notes)


def thresholds_as_seated(file: SystemFile, answer: Thresholds) -> Thresholds:
    """Thresholds with a note on the seat, not certified if contact that is seated anew at one of
    them is another one."""
    note = seat_note(file)
    if not note:
        return answer
    doubts = []
    for crossing in answer.crossings:
        doubt = _doubt_of_seat(file.assembly, answer.parameter, crossing.mu)
        if doubt:
            doubts.append(doubt)
    noted = replace(answer, seat=(note, *doubts))
    if not doubts:
        return noted
    return replace(with_doubts(noted, doubts), proof_line="")  # the doubts have lines of their own


def _has_seat(assembly: Assembly) -> bool:
    """Whether roots depend on where contact is closed, or on its forces."""
    for contact in assembly.contacts:
        if not contact.bonded or contact.exponent > 0.0 or _is_damped(contact):
            return True
    return False


def _is_damped(contact: Contact) -> bool:
    """Whether the normal forces of a contact damp."""
    return bool(contact.speed) or contact.slope != "0"


def _doubt_of_seat(assembly: Assembly, parameter: str, value: float) -> str:
    """How contact seated at a value of the free parameter differs from that of the assembly."""
    at = f"{parameter} = {number(value)}"
    try:
        seats = assembly.joined_at({parameter: value}).seats
    except (ComputationError, InputError) as error:
        return f"contact cannot be seated anew at {at}: {error}"
    for contact, here, anew in zip(assembly.contacts, assembly.seats, seats, strict=True):
        compared = [(here.stiffness, anew.stiffness)]  # which is 0 where contact is open
        if _is_damped(contact):
            compared.append((here.forces, anew.forces))
        for before, after in compared:
            if np.max(np.abs(after - before)) > SAME * np.max(np.abs(before)):
                there, _, _ = str(anew).partition(";")
                held, _, _ = str(here).partition(";")
                return f"seated anew at {at} it is another {there}; held is {held}"
    return ""
