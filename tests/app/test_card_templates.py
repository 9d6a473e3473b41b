"""Cards to begin with, the command that writes them, and the page about their format.

Modules: `card_templates`, `card_page`, `cli/new`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.app import card_page
from peel_opt.app.any_card import load_any
from peel_opt.app.card_templates import TEMPLATES
from peel_opt.app.cards import Card
from peel_opt.app.cli import new
from peel_opt.app.scene_table import MEASURES

from .calling import Call

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "cards.md").read_text(encoding="utf-8")


# --- the page -----------------------------------------------------------------------------


def test_the_page_is_what_its_command_makes(tmp_path: Path) -> None:
    card_page.main([str(tmp_path / "cards.md")])
    made = (tmp_path / "cards.md").read_text(encoding="utf-8")
    assert made == PAGE, "run: python -m peel_opt.app.card_page docs/cards.md"


def test_every_key_of_every_table_is_on_the_page_with_what_it_means() -> None:
    for template in TEMPLATES.values():
        for table in template.card.tables.values():
            for key, field in table.model_fields.items():
                assert field.description, (table.__name__, key)
                assert re.search(rf"^\| `{key}` \| .* \| {re.escape(field.description)} \|$", PAGE, re.M), key


def test_numbers_of_the_page_have_the_units_they_are_read_in() -> None:
    for name, dimension in MEASURES.items():
        value = f"number [{dimension.unit}]" if dimension.unit else "number"
        assert re.search(rf"^\| `{name}` \| {re.escape(value)} \|", PAGE, re.M), name
    for row in (
        "`bending_stiffness` | number [N m]",
        "`times` | list of numbers [s]",
        "`file` | text | required",
    ):
        assert f"| {row} |" in PAGE


# --- the cards ----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_card_of_each_kind_is_written_and_can_be_asked(kind: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "my strip.toml"
    code, out, err = call("new", path, "--kind", kind, "--title", "Mine")
    assert (code, err) == (0, "")
    assert f"peel-opt run '{path}'" in out
    card = load_any(path)  # whose questions are posed in doing so, and whose numbers are from somewhere
    assert card.title == "Mine"
    if isinstance(card, Card):
        assert card.labels() == list(TEMPLATES[kind].asks)
    else:
        assert len(card.data(tmp_path)[0].length) == 6


def test_the_example_of_the_groups_is_a_rod_that_lifts(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "groups.toml"
    assert call("new", path, "--kind", "groups")[0] == 0
    ((_, found),) = load_any(path).ask()
    assert found.valid
    assert found.flags == ()


@pytest.mark.slow
@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_card_of_each_kind_is_answered_as_it_is(kind: str, call: Call, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert call("new", path, "--kind", kind)[0] == 0
    code, out, err = call("run", path)
    assert (code, err) == (0, "")
    assert "certified" in out
    if kind == "history":
        assert call("history", path)[0] == 0


def uncommented(text: str) -> Iterator[str]:
    """Yield the card with one of its commented keys in force, for each of them."""
    lines = text.splitlines()
    for i, line in enumerate(lines):
        if re.match(r"# \w+ = ", line):
            yield "\n".join([*lines[:i], line[2:], *lines[i + 1 :]])


@pytest.mark.filterwarnings("ignore::peel_opt.base.errors.CardWarning")
@pytest.mark.parametrize("kind", TEMPLATES)
def test_what_stands_there_as_a_comment_may_be_said(kind: str) -> None:
    template = TEMPLATES[kind]
    with_mix = template.text(data="x.csv").replace("# mix =", "mix =").replace("# profile =", "profile =")
    with_mix = with_mix.replace("# stretch =", "line_energy = 1.0\nstretch =").replace(
        "# line_energy", "#line_energy"
    )
    texts = list(uncommented(with_mix))
    assert len(texts) >= 2
    for text in texts:
        template.card.checked("x.toml", tomllib.loads(text))


@pytest.mark.parametrize(
    ("typed", "rod"),
    [
        (["--k", "1 mN m"], po.Rod(1e-3, 140e3, 0.73e-3)),
        (["--thickness", "50 um", "--T0", "1 MPa"], po.Rod.from_sheet(1.5e9, 50e-6, 0.4, 1e6, 100.0)),
        (["--E", "2 GPa", "--y0", "1 mm"], po.Rod.from_sheet(2e9, 40e-6, 0.4, 0.5e6, 250.0)),
        (["--kind", "peel", "--k", "9 uN m"], po.Rod(9e-6, 0.5e6, 0.4e-3)),
        (["--ratio", "0.7"], po.Rod.from_ratio(0.7)),
    ],
    ids=lambda case: " ".join(case) if isinstance(case, list) else "",
)
@pytest.mark.filterwarnings("ignore::peel_opt.base.errors.CardWarning")
def test_numbers_take_the_place_of_examples(
    typed: list[str], rod: po.Rod, call: Call, tmp_path: Path
) -> None:
    assert call("new", tmp_path / "a.toml", *typed, "--source", "a handbook")[0] == 0
    card = po.load_card(tmp_path / "a.toml")
    found = card.rod()
    assert found is not None
    assert found.ratio == pytest.approx(rod.ratio, rel=1e-12)
    assert found.eta == pytest.approx(rod.eta, rel=1e-12)
    keys = {new_key for new_key, (flag, _) in new.KEYS.items() if f"--{flag}" in typed}
    assert not keys & set(card.estimates)
    assert card.source == "a handbook"


def test_questions_suit_the_rod_or_are_the_ones_that_are_given(call: Call, tmp_path: Path) -> None:
    for n, ratio in enumerate(("0.02", "1", "400")):
        assert call("new", tmp_path / f"{n}.toml", "--ratio", ratio)[0] == 0
        for label, answer in po.load_card(tmp_path / f"{n}.toml").ask():
            assert isinstance(answer, po.Equilibrium), label
    assert (
        call("new", tmp_path / "b.toml", "--kind", "sheet", "--pressure", "0.2 MPa", "--flaw", "1 mm")[0] == 0
    )
    asked = [question.asked for question in po.load_card(tmp_path / "b.toml").questions]
    assert asked == [{"pressure": "0.2 MPa"}, {"flaw": "1 mm"}]


def test_a_card_that_is_there_stays(call: Call, tmp_path: Path) -> None:
    (path := tmp_path / "a.toml").write_text("mine")
    code, out, err = call("new", path, "--kind", "ratio")
    assert (code, out, path.read_text()) == (2, "", "mine")
    assert "is there already. Name another file, or replace it by --force." in err
    assert call("new", path, "--kind", "ratio", "--force")[0] == 0
    assert "name it .toml" in call("new", tmp_path / "c.csv", "--kind", "calibration")[2]
    (tmp_path / "b.csv").write_text("my measurements")
    assert call("new", tmp_path / "b.toml", "--kind", "calibration")[0] == 2
    assert not (tmp_path / "b.toml").exists()


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        (["--nu", "0,3"], "poisson_ratio has a decimal comma"),
        (["--E", "3 mm"], "youngs_modulus cannot be measured in 'mm'"),
        (["--T0", "1 kPa", "--y0", "1 mm", "--work", "1 N/m"], "give two of"),
        (["--kind", "groups", "--pressure", "1 kPa"], "pressure is fixed by [groups]"),
        (["--kind", "calibration", "--flaw", "1 mm"], "takes no --flaw"),
        (["--ratio", "1", "--k", "1 N m"], "a card of kind ratio takes no --k"),
        (["--kind", "groups", "--k", "1 N m"], "a card of kind groups takes no --k"),
        (["--kind", "blister", "--ratio", "1"], "a card of kind blister takes no --ratio"),
        (["--title", "\udcff"], "holds bytes that are no text"),
        (["--pressure", "2 mm"], "pressure cannot be measured in 'mm'"),
    ],
)
def test_what_makes_no_card_is_one_line_and_no_file(
    typed: list[str], words: str, call: Call, tmp_path: Path
) -> None:
    code, out, err = call("new", tmp_path / "a.toml", *typed)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert not list(tmp_path.iterdir())


# --- at a terminal ------------------------------------------------------------------------


def test_it_asks_at_a_terminal_and_again_where_it_cannot_be_meant(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = iter(["strip", "ratio", "Mine", "0.5 mm", "0.5", "my notebook"])
    asked: list[str] = []

    def at_the_terminal(question: str) -> str:
        asked.append(question)
        return next(answers)

    monkeypatch.setattr("builtins.input", at_the_terminal)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    code, out, _ = call("new", tmp_path / "a.toml")
    assert code == 0
    assert "There is no kind 'strip'." in out
    assert "ratio cannot have a unit" in out
    assert [text.split(" ")[0].strip(",") for text in asked] == [
        "kind",
        "kind",
        "title",
        "ratio",
        "ratio",
        "where",
    ]
    card = po.load_card(tmp_path / "a.toml")
    assert (card.title, card.source, card.rod()) == ("Mine", "my notebook", po.Rod.from_ratio(0.5))


def test_it_asks_nothing_elsewhere_or_if_told_so(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("builtins.input", lambda _: pytest.fail("asked"))
    assert call("new", tmp_path / "a.toml")[0] == 0
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert call("new", tmp_path / "b.toml", "--examples")[0] == 0


def test_who_breaks_off_leaves_no_file(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def end(_: str) -> str:
        raise EOFError

    monkeypatch.setattr("builtins.input", end)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert call("new", tmp_path / "a.toml")[0] == 130
    assert not list(tmp_path.iterdir())


def test_the_command_knows_the_kinds_without_loading_them() -> None:
    assert tuple(TEMPLATES) == new.KINDS
