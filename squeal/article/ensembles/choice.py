"""The pad of the report as `workflow/pad.json` holds it."""

from pathlib import Path

from squeal.article.results.records import Record, read_json
from squeal.article.results.verify import Switches
from squeal.model.contact import Formulation


class Choice(Record):
    """The pad of the report: its law, its numbers as the searches have them, where it is from."""

    formulation: Switches
    numbers: dict[str, float]
    origin: str

    @property
    def law(self) -> Formulation:
        """The formulation as the models take it."""
        return Formulation(**self.formulation.to_dict())


def read_choice(file: Path) -> Choice:
    """The stored choice. Raises InputError where the file is none."""
    return read_json(Choice, file)
