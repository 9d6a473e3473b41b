"""Problem cards: what they may say, what they answer, what is refused and how."""

import re
from pathlib import Path

import pytest

from peel_opt.app.cards import load_card, read_card
from peel_opt.app.report import heading
from peel_opt.base.errors import CardError, CardWarning, NoEquilibrium, PeelOptError
from peel_opt.equilibria.result import Equilibrium

PROBLEMS = sorted(
    path
    for path in (Path(__file__).parents[2] / "problems").glob("*.toml")
    # The others are fitted in test_calibration_cards.py, and answered in test_scene_cards.py.
    if not {"calibration", "scene"} & read_card(path).keys()
)

SI = """
title = "a strip"
[rod]
bending_stiffness = "23 uN m"
adhesion_strength = "140 kPa"
adhesion_range = "0.73 mm"
[estimates]
bending_stiffness = "guess"
adhesion_strength = "guess"
adhesion_range = "guess"
[[questions]]
length = "1.9 mm"
"""
RATIO = """
title = "a ratio"
[rod]
ratio = 1.0
[[questions]]
pressure_ratio = 0.8
"""
GROUPS = """
title = "groups"
[groups]
beta0 = 4
lam = 1.0
[[questions]]
"""


# --- the cards that come with the project -------------------------------------------------

#: k [N m], T0 [Pa], y0 [m], eta/y0 as known to two digits or more.
RODS = {
    "aortic_flap": (2.3e-5, 1.4e5, 7.3e-4, 0.75),
    "film_dressing": (4.9e-8, 2.4e5, 1e-3, 0.059),
    "aircraft_tape": (2.2e-4, 5e5, 6.8e-3, 0.11),
    "foil_tape": (4.8e-3, 5e5, 3.5e-3, 0.61),
    "office_tape": (9.5e-6, 5e5, 4e-4, 0.67),
    "graphene": (5.7e-18, 6.2e8, 1e-9, 2.1),
    "mems_beam": (1.1e-7, 8.9e5, 2e-8, 2506.0),
    "pdms_sheet": (2.2e-4, 1e5, 1e-6, 1300.0),
}


def test_no_card_is_missing():
    assert {path.stem for path in PROBLEMS} >= {*RODS, "fig10a", "fig10b"}


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_every_card_is_answered(path):
    card = load_card(path)
    for label, found in card.ask():
        assert isinstance(found, Equilibrium), f"{label}: {found}"
        assert found.certified
        assert found.error <= found.tol
        assert path.stem.startswith("fig") or found.valid, label


@pytest.mark.parametrize("name", RODS)
def test_the_rods_are_the_known_ones(name):
    rod = load_card(PROBLEMS[0].parent / f"{name}.toml").rod()
    found = (rod.bending_stiffness, rod.adhesion_strength, rod.adhesion_range, rod.ratio)
    assert found == pytest.approx(RODS[name], rel=0.025)


def test_figure_10a():
    (_, printed), (_, exact) = load_card(PROBLEMS[0].parent / "fig10a.toml").ask()
    assert printed.alpha == pytest.approx(14.8646046, abs=5e-8)
    assert printed.flags == ("y > y0",)
    assert exact.valid


# --- what a card may say ------------------------------------------------------------------


def test_three_ways_to_the_same_rod(card):
    plain = card(SI).rod()
    numbers = SI.replace('"23 uN m"', "23e-6").replace('"140 kPa"', "140e3").replace('"0.73 mm"', "0.73e-3")
    assert card(numbers).rod() == plain
    # G = T0 y0 / 2
    derived = SI.replace("adhesion_range", "work_of_separation").replace('"0.73 mm"', '"51.1 J/m^2"')
    assert card(derived).rod().adhesion_range == pytest.approx(0.73e-3, rel=1e-12)
    derived = SI.replace("adhesion_strength", "work_of_separation").replace('"140 kPa"', '"51.1 J/m^2"')
    assert card(derived).rod().adhesion_strength == pytest.approx(140e3, rel=1e-12)


def test_stiffness_of_a_strip(card):
    strip = SI.replace(
        'bending_stiffness = "23 uN m"', 'youngs_modulus = "1.2 MPa"\nthickness = "1 mm"\npoisson_ratio = 0.5'
    ).replace(
        'bending_stiffness = "guess"',
        'youngs_modulus = "guess"\nthickness = "guess"\npoisson_ratio = "guess"',
    )
    assert card(strip).rod().bending_stiffness == pytest.approx(1.2e6 * 1e-9 / (12 * 0.75))


def test_answers_carry_labels(card):
    text = (
        RATIO + '[[questions]]\nlength = "5.2 eta"\nstate = "folded"\n[[questions]]\npressure_ratio = 0.8\n'
    )
    text += '[[questions]]\nname = "mine"\nlength = 3.036804006\nnear = "0.5 T0"\nlaw = "cohesive"\n'
    answers = dict(card(text).ask())
    first, folded, again, mine = answers
    assert first == "length at p/T0 = 0.8 (1)"
    assert again == "length at p/T0 = 0.8 (3)"
    assert folded == "pressure at 5.2 eta, folded"
    assert mine == "mine"
    assert answers[first].length_ratio == pytest.approx(3.036804006, abs=1e-8)
    assert answers[folded].state == "folded"
    assert answers[mine].pressure_ratio == pytest.approx(0.5048542, abs=1e-6)


def test_groups_need_no_more_than_an_empty_question(card):
    ((label, found),) = card(GROUPS).ask()
    assert label == "alpha1 at beta0 = 4, lambda = 1"
    assert found.alpha1 == pytest.approx(-4.4354069891, abs=1e-8)
    assert card(GROUPS).rod() is None


def test_a_failed_question_leaves_the_others_their_answers(card):
    text = (
        RATIO.replace("pressure_ratio = 0.8", "length_ratio = 30") + "[[questions]]\npressure_ratio = 0.8\n"
    )
    (_, failed), (_, answered) = card(text).ask()
    assert isinstance(failed, NoEquilibrium)
    assert answered.certified


def test_method_and_tolerance_can_be_replaced(card):
    ((_, found),) = card(RATIO).ask(method="spectral", tol=1e-6)
    assert found.stats.method.startswith("Spectral")
    assert found.tol == 1e-6
    ((_, found),) = card(RATIO).ask(method="magic")
    assert isinstance(found, PeelOptError)


def test_names_cannot_act_on_a_terminal(card):
    ((label, _),) = card(RATIO + 'name = "one\\n\\u001b[31mtwo"').ask()
    assert label == "one [31mtwo"


def test_editors_on_windows_are_welcome(card):
    assert card(b"\xef\xbb\xbf" + SI.replace("\n", "\r\n").encode()).title == "a strip"


# --- what is refused ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('range = "0.73', 'rang = "0.73', r"'adhesion_rang' in \[rod\]; did you mean 'adhesion_range'"),
        ('length = "1.9', 'lenght = "1.9', r"'lenght' in \[\[questions\]\] no. 1; did you mean 'length'"),
        ('title = "a', 'tittle = "b"\ntitle = "a', r"'tittle'; did you mean 'title'"),
        ("[rod]", "[road]", r"'road'; did you mean 'rod'"),
        ('title = "a strip"', "", "'title' is missing"),
        ('"140 kPa"', '"140 mm"', r"\[rod\]: adhesion_strength cannot be measured in 'mm'"),
        ('"140 kPa"', '"140 kpa"', "adhesion_strength.*did you mean 'kPa'"),
        ('"140 kPa"', '"140"', "adhesion_strength needs a unit"),
        ('"140 kPa"', '"-140 kPa"', "adhesion_strength.*must be positive"),
        ('"140 kPa"', "0", "adhesion_strength.*must be positive"),
        ('"140 kPa"', "nan", "adhesion_strength.*must be finite"),
        ('"140 kPa"', "inf", "adhesion_strength.*must be finite"),
        ('"140 kPa"', "true", "adhesion_strength.*must be a number"),
        ('"140 kPa"', '["140 kPa"]', "adhesion_strength.*must be a number"),
        ('"23 uN m"', '"140 kPa"', "bending_stiffness cannot be measured in 'kPa'"),  # swapped
        ('"1.9 mm"', '"1.9"', r"no. 1: length needs a unit"),
        ('"1.9 mm"', '"1.9 kPa"', r"no. 1: length cannot be measured in 'kPa'"),
        ('"1.9 mm"', '"-1.9 mm"', r"no. 1: length.*must be positive"),
        ('"1.9 mm"', '"1.9 mm"\nnear = "3 mm"', r"no. 1: near cannot be measured in 'mm'"),
        ('"1.9 mm"', '"1.9 mm"\npressure = "60 kPa"', "not several"),
        ('length = "1.9 mm"', "", "give one of pressure"),
        ('"1.9 mm"', '"1.9 mm"\nlaw = "quadratic"', "law"),
        ('"1.9 mm"', '"1.9 mm"\nstate = "upper"', "middle, lower, folded"),
        ('"1.9 mm"', '"1.9 mm"\nmethod = "magic"', "magic"),
        ('"1.9 mm"', '"1.9 mm"\ntol = 0', "tol must be positive"),
        ('"1.9 mm"', '"1.9 mm"\nname = 3', "name"),
        ('[[questions]]\nlength = "1.9 mm"', "", "at least one entry"),
        ("[[questions]]", "[questions]", "questions"),
        ('adhesion_range = "0.73 mm"', "", r"\[rod\].*two of"),
        ('bending_stiffness = "23 uN m"', "", r"\[rod\].*bending_stiffness"),
        ('bending_stiffness = "23', 'ratio = 1.0\nbending_stiffness = "23', "ratio alone"),
        ("[estimates]", '[sources]\nadhesion_range = "book"\n[estimates]', "stands in both"),
        ("[estimates]", '[sources]\nthickness = "book"\n[estimates]', "names 'thickness'"),
        ('title = "a strip"', 'title = "a strip"\n[groups]\nbeta0 = 4\nlam = 1', "not both"),
        ('title = "a strip"', "title = ", "no TOML text"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_that_names_the_field(refused, old, new, words):
    assert old in SI
    assert "card.toml" in refused(SI.replace(old, new), words)


def test_a_number_without_a_source_is_a_warning_that_names_it(card):
    with pytest.warns(CardWarning, match=r"where adhesion_range is from: give a source") as said:
        found = card(SI.replace('adhesion_range = "guess"', ""))
    assert found.unsourced == ("adhesion_range",)
    assert len(said) == 1
    assert found.rod() == card(SI).rod()


def test_one_source_covers_all_that_have_none_of_their_own(card):
    bare = SI.partition("[estimates]")[0] + '[[questions]]\nlength = "1.9 mm"\n'
    with pytest.warns(CardWarning, match="adhesion_range, adhesion_strength, bending_stiffness are from"):
        assert len(card(bare).unsourced) == 3
    covered = 'source = "a notebook"\n' + bare
    assert card(covered).unsourced == ()
    assert "all numbers from: a notebook" in heading(card(covered), "card.toml")
    assert "others from: a notebook" in heading(card('source = "a notebook"\n' + SI), "card.toml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (RATIO.replace("1.0", '"0.566 mm"'), "ratio cannot have a unit"),
        (RATIO.replace("pressure_ratio = 0.8", 'pressure = "60 kPa"'), "pressure cannot have a unit"),
        (RATIO.replace("1.0", "-1.0"), "ratio must be positive"),
        (RATIO.replace("0.8", '"80 %"'), "pressure_ratio"),
        (GROUPS.replace("lam = 1.0", ""), r"\[groups\]: give either beta1 or lam"),
        (GROUPS.replace("lam = 1.0", "lam = 1.0\nbeta1 = 9"), "not both"),
        (GROUPS.replace("beta0 = 4", ""), r"'beta0' is missing in \[groups\]"),
        (GROUPS.replace("beta0 = 4", "beta0 = -4"), "beta0 must be zero or positive"),
        (GROUPS + 'length = "1 mm"', "length is fixed by"),
        ("", "is empty"),
        (" \n\n", "is empty"),
        (b"title = \"\xff\"", "UTF-8"),
        (b"title = \"\0\"", "NUL"),
        (b"\x7fELF" + bytes(range(256)), "NUL"),
        (b"#" * 1_000_001, "larger than 1000 kB"),
        (b"a = " + b"[" * 50_000, "TOML|nested"),
    ],
    ids=range(16),
)  # fmt: skip
def test_a_card_that_means_nothing_is_one_line(refused, text, words):
    assert len(refused(text, words)) < 400


def test_a_path_that_is_no_card_is_one_line(tmp_path):
    for path, words in ((tmp_path / "none.toml", "No such file"), (tmp_path, "directory"), ("a\0b", "null")):
        with pytest.raises(CardError, match=words):
            load_card(path)


def test_several_mistakes_are_counted(card):
    with pytest.raises(CardError, match="1 more"):
        card(SI.replace("140 kPa", "140 kpa").replace("0.73 mm", "0.73 mn"))


def test_a_thickness_that_overflows_is_wrong_input(tmp_path):
    path = tmp_path / "thick.toml"
    text = (
        'title = "thick"\n[rod]\nyoungs_modulus = "1 MPa"\nthickness = "1e200 m"\npoisson_ratio = 0.3\n'
        'adhesion_strength = "1 kPa"\nadhesion_range = "1 mm"\n[[questions]]\npressure = "500 Pa"\n'
    )
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PeelOptError):
        load_card(path).rod()


def test_names_of_questions_are_told_apart(tmp_path):
    path = tmp_path / "names.toml"
    questions = "".join(
        f'[[questions]]\nname = "{n}"\npressure_ratio = 0.{5 + i}\n'
        for i, n in enumerate(["a", "a", "a (2)"])
    )
    path.write_text(f'title = "names"\n[rod]\nratio = 1.0\n{questions}', encoding="utf-8")
    labels = load_card(path).labels()
    assert len(set(labels)) == 3
    assert labels[2] == "a (2)"


# --- units of the trade, and what is said in them -----------------------------------------


def test_a_card_in_water_columns_and_mils(card):
    text = SI.replace('"140 kPa"', '"1427 cmH2O"').replace('"0.73 mm"', '"28.7 mil"')
    found = card(text.replace('length = "1.9 mm"', 'pressure = "612 cmH2O"'))
    rod = found.rod()
    assert rod.adhesion_strength == pytest.approx(139940.8955, rel=1e-14)
    assert rod.adhesion_range == pytest.approx(0.72898e-3, rel=1e-14)
    ((label, answer),) = found.ask()
    assert label == "length at 612 cmH2O"
    assert answer.pressure == pytest.approx(612 * 98.0665, rel=1e-14)
    assert answer.certified


@pytest.mark.parametrize(
    ("asked", "unit", "size"),
    [
        ('pressure = "100 mmHg"', "mmHg", 133.322387415),
        ('pressure = "0.1 T0"', "T0", 140e3),
        ('length = "2 y0"', "y0", 0.73e-3),
        ('length = "1.46 mm"', "mm", 1e-3),
    ],
)
def test_the_nearest_that_does_exist_is_said_in_the_unit_that_was_typed(card, asked, unit, size):
    ((_, error),) = card(SI.replace('length = "1.9 mm"', asked)).ask()
    assert isinstance(error, NoEquilibrium)
    end = r"(Below|None is shorter than) ([\d.]+) (\w+)"
    side, said, name = re.search(end, str(error)).groups()
    assert (side == "Below") == asked.startswith("pressure")
    assert name == unit
    assert float(said) * size == pytest.approx(error.nearest, rel=1e-7)


@pytest.mark.parametrize("tol", ["10", "1", "0", "-1e-6", '"10"'])
def test_a_tolerance_is_refused_as_on_the_command_line(card, tol):
    with pytest.raises(CardError, match="tol must"):
        card(SI + f"tol = {tol}\n")


def test_a_label_is_one_line_however_its_value_was_typed(card):
    text = SI.replace('length = "1.9 mm"', 'pressure = """60\nkPa"""\nnear = """2\n mm"""')
    found = card(text)
    assert found.labels() == ["length at 60 kPa, near 2 mm"]


def test_a_number_that_is_none_is_not_asked_for_a_unit(card):
    with pytest.raises(CardError, match=r"beta0 must be a number, got 'abc'\.$"):
        card(GROUPS.replace("beta0 = 4", 'beta0 = "abc"'))
