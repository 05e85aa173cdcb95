"""What a deck says beside nodes, elements, sets and loads: CalculiX writes the rows."""

import shutil
import warnings

import numpy as np
import pytest

from squeal.errors import InputError, InputWarning
from squeal.io.surfaces import deck_sets
from squeal.io.system_files import read_system
from squeal.io.tables import deck_lines, read_table
from tests.io.test_faces import STORE, Block, calculix

needs_calculix = pytest.mark.skipif(not shutil.which("ccx"), reason="needs CalculiX (ccx)")
LENGTH = 0.06  # m
REFERENCE = ["*NODE,NSET=REF", "900,0.08,0.01,0.01", "901,0.08,0.01,0.01"]
# cards behind a bar, whose last element is 3 and whose end has four nodes, and rows that go
TIED = {
    "*EQUATION": (["*EQUATION", "2", "{1},1,1.,{0},1,-1."], 1),
    "*RIGID BODY": ([*REFERENCE, "*RIGID BODY,NSET=TIP,REF NODE=900,ROT NODE=901"], 12),
    "*COUPLING": (
        [*REFERENCE, "*COUPLING,REF NODE=900,SURFACE=END,CONSTRAINT NAME=C", "*KINEMATIC", "1,3"],
        12,
    ),
    "*TRANSFORM": (["*TRANSFORM,NSET=TIP", "1.,1.,0.,-1.,1.,0.", "*BOUNDARY", "{0},1,1"], 1),
}


def bar():
    """A bar of three bricks, clamped at one end, its cards and the nodes of its other end."""
    block = Block("E", "C3D8", np.zeros(3), (LENGTH, 0.02, 0.02), (3, 1, 1), 1)
    clamped = [n for n, place in block.nodes.items() if abs(place[0]) < 1e-9]
    tip = [n for n, place in block.nodes.items() if abs(place[0] - LENGTH) < 1e-9]
    cards = [*block.cards(), "*NSET,NSET=CLAMPED", *(f"{n}," for n in clamped)]
    cards += ["*NSET,NSET=TIP", *(f"{n}," for n in tip)]
    cards += ["*SURFACE,NAME=END,TYPE=ELEMENT", "3,S4", "*BOUNDARY", "CLAMPED,1,3"]
    return cards, tip


def read(folder, name):
    (folder / f"{name}.yaml").write_text(
        f"M: {{file: {name}.mas, symmetric: true}}\nK: {{file: {name}.sti, symmetric: true}}\n"
        f"coordinates: {{file: {name}.inp}}\nelements: {{file: {name}.inp}}\n"
    )
    return read_system(folder / f"{name}.yaml")


@needs_calculix
@pytest.mark.filterwarnings("ignore:.*no line for 1 nodes")  # one that CalculiX adds
@pytest.mark.parametrize("keyword", TIED)
def test_a_keyword_that_takes_rows_from_nodes_is_named(tmp_path, keyword):
    """CalculiX eliminates what depends on other rows, and writes no row for it."""
    cards, tip = bar()
    tying, gone = TIED[keyword]
    calculix(tmp_path, "bar", [*cards, *(line.format(*tip) for line in tying), *STORE])
    with pytest.warns(InputWarning, match=rf"bar\.inp: \{keyword}: ") as given:
        where = read(tmp_path, "bar").coordinates
    assert len([one for one in given if keyword in str(one.message)]) in (1, 2)
    of_tip = [name for name in np.array(where.names)[where.nodes] if int(name) in tip]
    assert len(of_tip) == 3 * len(tip) - gone


def test_a_set_of_the_nodes_of_elements_is_warned_of(tmp_path):
    """A deck may hold such a set and not use it."""
    deck = "*NODE\n1, 0, 0, 0\n*NSET, NSET=A, ELSET=E\n*NSET, NSET=B\n1\n"
    (tmp_path / "set.inp").write_text(deck)
    with pytest.warns(InputWarning, match=r"ELSET of \*NSET is not read: such a set lacks"):
        assert deck_sets(tmp_path / "set.inp", "NODE") == {"B": ["1"]}


@needs_calculix
def test_a_deck_without_such_a_keyword_is_read_without_a_word(tmp_path):
    cards, _ = bar()
    calculix(tmp_path, "bar", [*cards, *STORE])
    with warnings.catch_warnings():
        warnings.simplefilter("error", InputWarning)
        assert read(tmp_path, "bar").system.n == 36


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ("*Cyclic symmetry model, N=12", "CYCLIC SYMMETRY MODEL is not allowed; the matrices of"),
        ("*CYCLICSYMMETRYMODEL,N=12", "the matrices of a sector are not those of the structure"),
        ("*NGEN", "write out each node and element"),
        ("*NSET NSET=A", r"\*NSET NSET=A is not allowed; a comma is needed before its options"),
        ("*Element TYPE=C3D4, ELSET=E", "a comma is needed before its options"),
        ("*ELGEN,ELSET=E", "write out each node and element"),
        ("*NMAP,NSET=N,TYPE=CYLINDRICAL", "write out each node and element"),
        ("*ELEMENT,TYPE=C3D8,INPUT=more.inp", r"INPUT of \*ELEMENT is not read"),
        ("*NODE, NSET=N, INPUT=more.inp", r"INPUT of \*NODE is not read"),
        ("*NODE, System = c, NSET=N", r"SYSTEM = C of \*NODE is not allowed; R, along x, y and z"),
        ("*NODE,SYSTEM=S", r"SYSTEM=S of \*NODE is not allowed"),
        ("*SYSTEM", r"\*SYSTEM is not allowed; write the file without parts and local axes"),
    ],
)
def test_a_keyword_that_says_what_is_not_read_is_refused(tmp_path, card, words):
    (tmp_path / "deck.inp").write_text(f"*NODE\n1,0.,0.,0.\n{card}\n1,2\n")
    with pytest.raises(InputError, match=rf"line 3: .*{words}"):
        list(deck_lines(tmp_path / "deck.inp"))


@pytest.mark.parametrize(
    "card",
    [
        "*ORIENTATION, NAME=OR1, SYSTEM=CYLINDRICAL",
        "*Orientation,System=Rectangular,Name=Or1",
        "*NODE, SYSTEM=R",
        "*NODE, NSET=N, System = Rectangular",
    ],
)
def test_axes_of_a_material_and_nodes_along_x_y_and_z_are_allowed(tmp_path, card):
    (tmp_path / "deck.inp").write_text(f"*NODE\n1,0.,0.,0.\n{card}\n2,1.,0.,0.\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error", InputWarning)
        assert len(list(deck_lines(tmp_path / "deck.inp"))) == 2


@pytest.mark.parametrize("after", ["", "*NSET,NSET=A\n1\n"])
def test_a_deck_that_ends_within_an_element_is_refused(tmp_path, after):
    """The element was left out without a word."""
    (tmp_path / "cut.inp").write_text(f"*ELEMENT,TYPE=C3D8\n1,1,2,3,4,5,6,7,8\n2,9, 10,\n{after}")
    with pytest.raises(InputError, match=r"cut\.inp: .*ends an element.* is the file cut"):
        list(deck_lines(tmp_path / "cut.inp"))


def test_nodes_of_a_deck_name_no_rows_without_labels(tmp_path):
    """The message spoke of a .csv file, which nobody had."""
    (tmp_path / "bar.inp").write_text("*NODE\n1,0.,0.,0.\n")
    (tmp_path / "bar.yaml").write_text("{M: [[1]], K: [[1]], coordinates: {file: bar.inp}}")
    with pytest.raises(InputError, match=r"bar\.inp: names nodes, not the dof of each row.*\.dof"):
        read_system(tmp_path / "bar.yaml")


def test_a_set_is_generated_by_first_last_and_step(tmp_path):
    deck = tmp_path / "deck.inp"
    deck.write_text("*NSET,NSET=A,GENERATE\n1,5,2\n*NSET,GENERATE,NSET=B\n7,8\n*NSET,NSET=B\na\n")
    assert deck_sets(deck, "NODE") == {"A": ["1", "3", "5"], "B": ["7", "8", "1", "3", "5"]}


def test_a_line_that_generates_more_labels_than_memory_holds_is_refused(tmp_path):
    """1,999999999 ended the process."""
    (tmp_path / "deck.inp").write_text("*NSET,NSET=A,GENERATE\n1,999999999\n")
    with pytest.raises(InputError, match=r"line 2: 999999999 labels are not allowed; at most"):
        deck_sets(tmp_path / "deck.inp", "NODE")


def test_a_keyword_may_be_indented_and_go_on_in_the_next_line(tmp_path):
    """Its name and its options became members of the set above it."""
    deck = tmp_path / "deck.inp"
    deck.write_text(
        "*NSET, NSET=A\n1,2\n  ** a comment\n  *NSET, NSET=B\n 7,8\n"
        "*NSET, NSET=C,\n\n GENERATE\n1,3\n*NSET, NSET=E,\nB,\n9\n"
        "*NSET, NSET=D,\n5,6\n*DLOAD,\n-1.5,P,2\n"
        "*ELEMENT, TYPE=C3D4,\nELSET=E1\n9,1,2,3,\n4\n"
    )
    nodes = {"A": ["1", "2"], "B": ["7", "8"], "C": ["1", "2", "3"], "D": ["5", "6"]}
    nodes["E"] = ["7", "8", "9"]  # the members of B and 9
    assert deck_sets(deck, "NODE") == nodes
    assert deck_sets(deck, "ELEMENT") == {"E1": ["9"]}
    assert ["-1.5", "P", "2"] in [line.cells for line in deck_lines(deck)]


def elements(path):
    """The nodes of each element with faces by its label."""
    _, lines = read_table(path, ("element", "type"))
    nodes = {}
    for line in lines:
        label, _, *cells = line.cells.values()
        nodes[label] = [cell for cell in cells if cell]
    return nodes


def numbers(first, last):
    return [str(number) for number in range(first, last + 1)]


@pytest.mark.parametrize(
    ("element_type", "lines", "nodes"),
    [
        # unv2ccx and many decks of CalculiX end each line with a comma
        ("C3D4", ["1,1,2,3,4,", "2,2,3,4,5,"], [numbers(1, 4), numbers(2, 5)]),
        ("S4R5", ["1,1,2,3,4,", "2,2,3,4,5"], [numbers(1, 4), numbers(2, 5)]),
        ("STRI65", ["1,1,2,3,4,5,6,", "2,2,3,4,5,6,7"], [numbers(1, 6), numbers(2, 7)]),
        (
            "C3D10MH",
            ["1,1,2,3,4,5,", "6,7,8,9,10,", "2,2,3,4,5,6,7,8,9,10,11,"],
            [numbers(1, 10), numbers(2, 11)],
        ),
        # CalculiX counts nodes, with a comma or without
        ("C3D20R", ["1,1,2,3,4,5,6,7,8", f"{','.join(numbers(9, 20))}"], [numbers(1, 20)]),
        # Abaqus: 15 to 18 nodes, so that a comma says whether more follow
        ("C3D15V", [f"1,{','.join(numbers(1, 15))},", "16,17,18"], [numbers(1, 18)]),
        ("C3D15V", [f"1,{','.join(numbers(1, 15))}", f"2,{','.join(numbers(2, 16))}"],
         [numbers(1, 15), numbers(2, 16)]),
    ],
)  # fmt: skip
def test_an_element_ends_with_its_last_node(tmp_path, element_type, lines, nodes):
    """A comma behind the last node made the next element a part of this one: of two elements one
    was lost without a word, and a deck of an odd number was refused."""
    deck = tmp_path / "mesh.inp"
    deck.write_text(
        "\n".join([f"*ELEMENT,TYPE={element_type},ELSET=E", *lines, "*NSET,NSET=A", "1"])
    )
    assert list(elements(deck).values()) == nodes
    assert deck_sets(deck, "ELEMENT") == {"E": numbers(1, len(nodes))}
    assert deck_sets(deck, "NODE") == {"A": ["1"]}


@pytest.mark.parametrize("element_type", ["U1", "B31", "SPRINGA"])
def test_an_element_of_a_type_without_faces_ends_with_a_line_that_is_not_full(
    tmp_path, element_type
):
    """As in decks of the author of CalculiX, in which user elements end with commas."""
    deck = tmp_path / "beams.inp"
    deck.write_text(f"*ELEMENT,TYPE={element_type},ELSET=E\n1,1,2,\n2,2,3,\n3,3,4,\n")
    assert deck_sets(deck, "ELEMENT") == {"E": ["1", "2", "3"]}


def test_the_nodes_of_a_user_element_go_on_behind_a_full_line(tmp_path):
    deck = tmp_path / "bricks.inp"
    first = f"7,{','.join(numbers(1, 15))},\n16,17,18,19,20\n"
    deck.write_text(f"*ELEMENT,TYPE=U20,ELSET=E\n{first}8,{','.join(numbers(1, 15))},\n21\n")
    assert deck_sets(deck, "ELEMENT") == {"E": ["7", "8"]}


@pytest.mark.parametrize("card", ["*NSET", "*N SET", "* NSET", "*nset ", "*NSET\t"])
def test_blanks_in_a_keyword_mean_nothing(tmp_path, card):
    """By the manuals of both programs; the members of the set were left out without a word."""
    deck = tmp_path / "deck.inp"
    deck.write_text(f"*NODE,NSET=ALL\n1\n2\n{card}, NSET = A\n1,2\n")
    assert deck_sets(deck, "NODE") == {"ALL": ["1", "2"], "A": ["1", "2"]}


@pytest.mark.parametrize(
    ("card", "member", "name"),
    [
        ('*NSET, NSET="Fixed (26)-1"', '"Fixed (26)-1"', "FIXED (26)-1"),
        ('*NSET, NSET="a, b"', '"A, B"', "A, B"),
        ('*NSET, NSET="a,b", UNSORTED', ' "a,b" , 3', "A,B"),
        ('*NSET, UNSORTED, NSET = "tip"', "tip", "TIP"),
        ("*NSET, NSET=TIP", '"tip", 3', "TIP"),
    ],
)
def test_a_name_in_quotes_may_hold_blanks_and_commas(tmp_path, card, member, name):
    """Where a quoted name stood in a cell it was no name of a set, and a comma in it ended it."""
    deck = tmp_path / "deck.inp"
    deck.write_text(f"{card}\n1,2\n*NSET, NSET=OTHER\n{member}\n")
    sets = deck_sets(deck, "NODE")
    assert sets[name] == ["1", "2"]
    assert sets["OTHER"][:2] == ["1", "2"]


@pytest.mark.parametrize("card", ["*NSET, NSET=", "*NSET", "*NSET, GENERATE", '*NSET, NSET=""'])
def test_a_set_without_a_name_is_refused(tmp_path, card):
    """Its members were left out without a word."""
    (tmp_path / "deck.inp").write_text(f"{card}\n1,2\n")
    with pytest.raises(InputError, match=r"line 2: .*without a name; \*NSET needs NSET="):
        deck_sets(tmp_path / "deck.inp", "NODE")


@pytest.mark.parametrize("card", ["*INCLUDE, INPUT=set.nam", "* Include , Input = set.nam"])
def test_blanks_in_the_keyword_of_an_included_file_mean_nothing(tmp_path, card):
    """The file was left out without a word."""
    (tmp_path / "set.nam").write_text("*NSET, NSET=A\n1,\n2,\n")
    (tmp_path / "deck.inp").write_text(f"*NODE\n1\n2\n{card}\n")
    assert deck_sets(tmp_path / "deck.inp", "NODE") == {"A": ["1", "2"]}


def test_labels_that_fall_generate_no_set(tmp_path):
    deck = tmp_path / "deck.inp"
    deck.write_text("*NSET,NSET=A,GENERATE\n5,1\n")
    with pytest.raises(InputError, match=r"line 2: 5 to 1 is not allowed"):
        deck_sets(deck, "NODE")


@pytest.mark.parametrize(("element_type", "count"), [("C3D4", 5), ("S4R", 8), ("C3D8", 20)])
def test_more_nodes_than_the_type_has_are_refused(tmp_path, element_type, count):
    deck = tmp_path / "mesh.inp"
    line = ",".join(["7", *numbers(1, count)])
    deck.write_text(f"*ELEMENT,TYPE={element_type},ELSET=E\n{line}\n")
    with pytest.raises(InputError, match=rf"{count} nodes; an element of type {element_type} has"):
        elements(deck)


def test_a_cohesive_element_with_pore_pressure_may_have_nodes_in_the_middle(tmp_path):
    deck = tmp_path / "mesh.inp"
    deck.write_text(f"*ELEMENT,TYPE=COH3D8P\n7,{','.join(numbers(1, 12))}\n")
    assert elements(deck) == {"7": numbers(1, 12)}
