"""Cards, tables of measurements and quantities of any content: read, or refused in one line."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from hypothesis import strategies as st

from peel_opt.app.any_card import load_any
from peel_opt.app.calibration_cards import CalibrationCard, load_calibration
from peel_opt.app.cards import load_card
from peel_opt.base.checks import parse
from peel_opt.base.errors import CardError, InvalidInput, PeelOptError
from peel_opt.base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, WORK, display
from peel_opt.studies.calibrate.read import read_measurements, read_shape
from peel_opt.studies.sweep.ranges import parse_range
from peel_opt.studies.uncertainty.inputs import middle, split

from ..fuzzing import NUMERALS, PROBLEMS, TEXTS, UNITS, WILD, examples, hammer, typed

CARDS = sorted(path.read_bytes() for path in PROBLEMS.glob("*.toml"))
TABLES = sorted(path.read_bytes() for path in PROBLEMS.glob("*.csv"))

#: Words a card or a table may hold, for putting in the place of others.
KEYS = sorted({word for card in CARDS for word in re.findall(r"^\[*(\w+)\b", card.decode(), re.MULTILINE)})

KINDS = (PRESSURE, LENGTH, STIFFNESS, WORK, NUMBER)


@st.composite
def hurt(draw: st.DrawFn, whole: list[bytes]) -> bytes:
    """Return one of some texts with a few bytes, words or lines changed, lost or doubled."""
    data = draw(st.sampled_from(whole))
    for _ in range(draw(st.integers(1, 4))):
        how = draw(st.sampled_from(["byte", "cut", "line", "word", "number", "insert"]))
        place = draw(st.integers(0, max(len(data) - 1, 0)))
        if how == "byte" and data:
            data = data[:place] + bytes([draw(st.integers(0, 255))]) + data[place + 1 :]
        elif how == "cut":
            data = data[:place] + data[place + draw(st.integers(1, 80)) :]
        elif how == "insert":
            data = data[:place] + draw(st.binary(max_size=6)) + data[place:]
        elif how == "line":
            lines = data.splitlines(keepends=True) or [b""]
            one, other = (draw(st.integers(0, len(lines) - 1)) for _ in "ab")
            lines.insert(one, lines[other]) if draw(st.booleans()) else lines.pop(one)
            data = b"".join(lines)
        else:
            pattern = rb"[a-z_]{3,}" if how == "word" else rb'"[^"\n]*"|[-+.\d]+'
            found = list(re.finditer(pattern, data))
            if found:
                word = found[draw(st.integers(0, len(found) - 1))]
                other = draw(st.sampled_from(KEYS)) if how == "word" else draw(TOML_VALUES)
                data = data[: word.start()] + other.encode() + data[word.end() :]
    return data


#: Values as TOML writes them.
TOML_VALUES = st.one_of(
    TEXTS.map(json.dumps),
    NUMERALS,
    st.sampled_from(
        ["true", "[]", "{}", "1979-05-27", "[[1]]", "{a = 1}", "''", '["x", 1]', "0x7fffffffffff"]
    ),
)


@st.composite
def built(draw: st.DrawFn) -> bytes:
    """Return a card of known tables and keys with values of any kind."""
    lines = [] if draw(st.booleans()) else ['title = "x"']
    headers = ["[rod]", "[scene]", "[groups]", "[[questions]]", "[sources]", "[estimates]"]
    headers += ["[calibration]", "[[pairs]]", "[[shapes]]", "[[rod]]", "[questions]", "[x.y]"]
    for header in draw(st.lists(st.sampled_from(headers), max_size=5)):
        lines.append(header)
        keys = draw(st.lists(st.sampled_from(KEYS), max_size=5, unique=True))
        lines += [f"{key} = {draw(TOML_VALUES)}" for key in keys]
    return "\n".join(lines).encode()


def refused_or(call, kind: type[PeelOptError] = InvalidInput):
    """Return what a call returns; an error must be of this kind."""
    found = typed(call)
    assert not isinstance(found, PeelOptError) or isinstance(found, kind), repr(found)
    return found


@pytest.mark.filterwarnings("ignore::peel_opt.base.errors.CardWarning")
@pytest.mark.parametrize(
    "cards", [hurt(CARDS), built(), st.binary(max_size=200)], ids=["mutated", "built", "bytes"]
)
@examples(few=120, many=900)
def test_any_card_is_read_or_refused_in_one_line(cards, count, tmp_path):
    path = tmp_path / "card.toml"

    def check(data: bytes) -> None:
        path.write_bytes(data)
        for load in (load_card, load_calibration, load_any):
            card = refused_or(lambda load=load: load(path), CardError)
            if isinstance(card, CardError):
                assert "card.toml" in str(card)
            elif isinstance(card, CalibrationCard):
                refused_or(lambda card=card: card.data(PROBLEMS))
            else:
                assert len(card.labels()) == len(set(card.labels())) == len(card.questions)

    hammer(check, cards, count)


@pytest.mark.parametrize("tables", [hurt(TABLES), st.binary(max_size=200)], ids=["mutated", "bytes"])
@examples(few=120, many=900)
def test_any_table_of_measurements_is_read_or_refused_in_one_line(tables, count, tmp_path):
    path = Path(tmp_path / "table.csv")

    def check(data: bytes) -> None:
        path.write_bytes(data)
        for read in (read_measurements, lambda p: read_measurements(p, pressure_sd=1.0), read_shape):
            found = refused_or(lambda read=read: read(path))
            if not isinstance(found, InvalidInput):
                numbers = found.pressure if hasattr(found, "names") else found.x
                assert len(numbers)

    hammer(check, tables, count)


@examples(few=300, many=3000)
def test_any_quantity_is_a_finite_number_or_refused(count):
    def check(drawn) -> None:
        value, kind, signed = drawn
        found = refused_or(lambda: parse("x", value, kind, own={"T0": 1e5, "eta": 1e-300}, signed=signed))
        if not isinstance(found, InvalidInput):
            assert math.isfinite(found)
            assert signed or found > 0.0
            assert display(found, kind.si)

    hammer(check, st.tuples(TEXTS | WILD, st.sampled_from(KINDS), st.booleans()), count)


@examples(few=150, many=1500)
def test_any_range_and_any_spread_is_read_or_refused(count):
    def check(drawn) -> None:
        text, kind = drawn
        values = refused_or(lambda: parse_range("--x", text, kind, signed=True))
        assert isinstance(values, InvalidInput) or math.isfinite(
            abs(values).max() if hasattr(values, "max") else values
        )
        value, around = split(text)
        if not value and ".." in around:
            refused_or(lambda: middle("--x", around, kind))

    parts = st.lists(TEXTS, min_size=1, max_size=4)
    marks = st.sampled_from([":", ",", "..", " +- ", "+-", " lognormal", " uniform", ": "])
    counts = st.sampled_from(["2", "3", "1", "-1", "1e3", "5:log", "3:lin", "99999999"])
    ranges = st.builds("{0}{3}:{1}{3}:{2}".format, NUMERALS, NUMERALS, counts, UNITS)
    hammer(check, st.tuples(ranges | st.builds(str.join, marks, parts), st.sampled_from(KINDS)), count)
