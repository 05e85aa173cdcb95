"""Arguments are read as their kinds say, under every name and in every place."""

import pytest

import squeal
from squeal.errors import InputError
from squeal.schema.values import FILE, Number, Several, takes

ABOVE = Number(low=0.0)


@takes(high=ABOVE, files=Several(FILE, "two paths", 2), marks=Several(ABOVE, "some numbers"))
def asked(name, high=None, files=None, *, marks=(1.0,)):
    """What it is for."""
    return name, high, files, marks


def test_what_is_allowed_passes_and_defaults_are_not_read():
    assert asked("n") == ("n", None, None, (1.0,))
    assert asked("n", 2, ["a", "b"], marks=(v for v in (1, 2))) == (
        "n",
        2.0,
        ("a", "b"),
        (1.0, 2.0),
    )
    assert asked.__doc__ == "What it is for."
    with pytest.raises(TypeError, match="missing"):
        asked(high=1.0)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"high": "2"}, "asked: high: '2' is not allowed; it must be a finite number above 0"),
        ({"high": None}, "asked: high: None is not allowed; it must be a finite number above 0"),
        ({"files": ["a"]}, "asked: files: ['a'] is not allowed; it must be two paths"),
        ({"files": "ab"}, "asked: files: 'ab' is not allowed; it must be two paths"),
        ({"files": ["a", 3]}, "asked: files: 3 is not allowed; it must be the path of a file"),
        ({"marks": ()}, "asked: marks: () is not allowed; it must be some numbers"),
        ({"marks": 1.0}, "asked: marks: 1.0 is not allowed; it must be some numbers"),
    ],
)
def test_refusals_name_function_argument_and_what_is_allowed(more, told):
    with pytest.raises(InputError) as caught:
        asked("n", **more)
    assert str(caught.value) == told


def test_figures_are_part_of_the_package():
    assert squeal.plots.draw
