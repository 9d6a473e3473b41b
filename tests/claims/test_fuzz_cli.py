"""Argument lists of any kind: every command ends with 0, 1 or 2 and one clear line for what is wrong."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass, replace

import pytest
from hypothesis import strategies as st

from peel_opt.app.cli import main as cli

from ..fuzzing import PROBLEMS, TEXTS, command, examples, hammer


@dataclass(frozen=True)
class Option:
    """What may follow an option: values that can be meant, and others that cannot."""

    good: st.SearchStrategy[str]
    bad: st.SearchStrategy[str] = TEXTS
    count: int = 1


def of(*good: str, bad: str = "", count: int = 1) -> Option:
    """Return an option by its good values and, separated by "|", its bad ones."""
    return Option(st.sampled_from(good), st.sampled_from(bad.split("|")) | TEXTS, count)


FLAG = Option(st.just(""), count=0)
PROBLEM = of(*sorted(map(str, PROBLEMS.glob("[fgo]*.toml"))), bad="nowhere.toml||/|a\0b|-|.")
MEASURED = of(str(PROBLEMS / "calibrate_flap.toml"), bad="nowhere.toml||/|a\0b|-|.")

#: Good ratios are few, so that their branches are walked once; all else about a question is free.
RATIO = of("1", "0.5", "2.5", bad="0|-1|nan|1e-300|1e300|x|1 mm||0.001|1e5")
STIFFNESS = of("23 uN m", "23e-6 N m", bad="23|0 N m|-1 N m|1 m|1e400 N m||1e-300 N m|1e300 J")
STRENGTH = of("140 kPa", "1.4 bar", bad="140|nan kPa|1 mm|1e-300 Pa|1e300 Pa")
RANGE = of("0.73 mm", "730 um", bad="0.73|inf mm|1 Pa|1e-300 m|1e300 m")
LENGTH = of("3.1", "3.3 eta", "5 eta", "5 y0", "4.44", bad="1.9 kPa|1e-9|1 m|0|nan|1e300|3.0138")
PRESSURE = of("0.8", "0.5 T0", "0.65 T0", "0.15 T0", bad="0.1218370412|1|0.999999999|-1|1e-300|60 kg")
BETA0 = of("4", "2", "0", "20", bad="-1|nan|inf|1e300|1e-300|x|1e5")
LAM = of("1", "-0.1", "3", "0", "-0.2", bad="nan|-97.409|1e9|1e300|x|-98|1e-300")
BETA1 = of("98", "99.5", "120", bad="0|-1|nan|1e9|1e300|97.40909103400243")
WINDOW = replace(LAM, count=2)
POINTS = of("8", "9", "12", bad="0|-1|1|1e3|nan|x|9999999999999999999")
MODE = of("1", "2", bad="0|-1|1e3|x|99999")
SEED = of("0", "7", bad="-1|x|9999999999999999999")
TOL = of("1e-8", "1e-6", "0.1", bad="0|1|nan|-1|1e-300|x|1e-13")
LAW = of("auto", "linear", "cohesive", bad="cubic|")
STATE = of("unfolded", "middle", "lower", "folded", bad="upper|")
METHOD = of("auto", "series", "spectral", "collocation", bad="magic|")
CHEAP = of("series", "spectral", bad="magic|")
WORKERS = of("1", bad="0|-1|x|nan")
FORM = of("solver", "paper", "exact", "uniform", bad="own|fit|from_record|coefficients")
CONVENTION = of("delay", "maxwell", bad="x")
SAMPLES = of("2", "4", bad="0|-1|3|x|1e9|99999999999")
QUANTITY = of("readhesion_pressure", "maxwell_length", "length", "pressure", bad="x|")
RATIOS = of("0.5,1", "1:2.5:2:log", "2.5", bad="2:1:2|1:2:0|,|1:2:3:4|1e-300,1|0,1|1:2:99999999")
SHARES = of("0.8,0.5", "0.5:0.9:3", "0.65", bad="2:1:2|1:2:0|,|1:2:3:4|1e-300,1|nan:1:2|0:1:3:log")
SPREAD = of("+- 5 %", "+- 2 % lognormal", "+- 3 % uniform", bad="+- 500 %|+- x|.. ..|1 mm .. 2 m|+- -5 %")
FLAW = of("1", "0.5 eta", bad="0|-1|nan|1e300|1 kPa|x")
PULL = of("6 N/25 mm", "240 N/m", bad="6 N|0 N/m|-1 N/m|nan N/m|x")
ANGLE = of("90 deg", "3.1 rad", bad="0 deg|-90 deg|nan deg|1 mm|x")
WORK = of("100 J/m^2", "5 mJ/cm^2", bad="0 J/m^2|-1 J/m^2|100|x")
UNITS = of("mmHg,mm", "um", bad="|x|kg|mm,m")
FREE = of("force", "length", bad="weight|x|")
PEEL_TEST = of(str(PROBLEMS / "peel_test.toml"), bad="nowhere.toml||/|a\0b|-|.")
#: Files that may be written, and some that may not; a source that no number is without.
NEW_CARD = Option(st.sampled_from(["a.toml", "b/c.toml"]), st.sampled_from([".", "", "/", "a\0b", "d.csv"]))
SOURCE = Option(st.just("a book"), st.just("a book"))
KIND = of("rod", "sheet", "ratio", "groups", "peel", "scene", "blister", "history", "calibration", bad="x|")
NO_CARD = of("nowhere.toml", bad="|/|a\0b|-|.")
FIGURE = Option(st.sampled_from(["0", "11", "p-max", "4.", "x", "7 ", "é"]))

MATERIAL = {"--k": STIFFNESS, "--T0": STRENGTH, "--y0": RANGE}
ROD = MATERIAL | {"--ratio": RATIO, "--card": PROBLEM}
QUESTION = {"--law": LAW, "--state": STATE, "--method": METHOD, "--tol": TOL, "--json": FLAG}

#: The options of each command; "" for what has no name.
COMMANDS: dict[str, dict[str, Option]] = {
    "run": {"": PROBLEM, "--method": METHOD, "--tol": TOL, "--json": FLAG},
    "pressure": {"--length": LENGTH, "--near": PRESSURE} | ROD | QUESTION,
    "length": {"--pressure": PRESSURE, "--near": LENGTH} | ROD | QUESTION,
    "trace": {"--beta0": BETA0, "--lam": WINDOW, "--points": POINTS, "--mode": MODE, "--law": LAW}
    | {"--tol": TOL, "--json": FLAG}
    | ROD,
    "hysteresis": {"--beta0": BETA0, "--lam": WINDOW, "--points": POINTS, "--tol": TOL, "--json": FLAG}
    | {"--form": FORM, "--convention": CONVENTION}
    | ROD,
    "tradeoff": {"--beta0": BETA0, "--lam": LAM, "--beta1": BETA1, "--length": LENGTH, "--pressure": PRESSURE}
    | {"--tols": TOL, "--repeats": of("1", bad="0|-1|x"), "--methods": CHEAP, "--law": LAW, "--state": STATE}
    | {"--json": FLAG}
    | ROD,
    "sweep": {
        "--pressure": PRESSURE,
        "--length": LENGTH,
        "--pressure-ratio": SHARES,
        "--length-ratio": SHARES,
    }
    | {
        "--beta0": of("2, 4", "4", bad="-1, 1|nan,1|2,4"),
        "--lam": of("0:1:3", "1", "1, 3", bad="nan:1:2"),
        "--beta1": BETA1,
    }
    | {"--ratio": RATIOS, "--zip": FLAG, "--resume": FLAG, "--netcdf": FLAG, "--workers": WORKERS}
    | {"--law": LAW, "--state": STATE, "--method": METHOD, "--tol": TOL, "--card": PROBLEM}
    | MATERIAL,
    "uncertainty": {"--T0": SPREAD, "--k": SPREAD, "--y0": SPREAD, "--pressure": PRESSURE, "--length": LENGTH}
    | {"--of": QUANTITY, "--samples": SAMPLES, "--seed": SEED, "--no-indices": FLAG, "--workers": WORKERS}
    | {"--card": of(str(PROBLEMS / "office_tape.toml"), bad="nowhere.toml|"), "--law": LAW, "--state": STATE}
    | {"--tol": TOL, "--json": FLAG},
    "calibrate": {"": MEASURED, "--json": FLAG},
    "flaw": {"--pressure": PRESSURE, "--flaw": FLAW, "--law": LAW, "--units": UNITS, "--json": FLAG} | ROD,
    "peel": {"--pull": PULL, "--angle": ANGLE, "--units": UNITS, "--json": FLAG, "--work": WORK},
    "solve": {"--free": FREE, "--pressure": PRESSURE, "--length": LENGTH, "--tol": TOL, "--json": FLAG}
    | {"--card": PEEL_TEST},
    "new": {"": NEW_CARD, "--kind": KIND, "--ratio": RATIO, "--beta0": BETA0, "--lam": LAM, "--work": WORK}
    | {"--pressure": PRESSURE, "--length": LENGTH, "--flaw": FLAW, "--title": of("mine", bad="|é|\udcff")}
    | {"--source": SOURCE, "--force": FLAG, "--examples": FLAG}
    | MATERIAL,
    # A motion takes seconds: here its card is never one that can be followed.
    "snap": {"": NO_CARD, "--pressure": PRESSURE, "--flaw": FLAW, "--json": FLAG},
    "history": {"": NO_CARD, "--json": FLAG},
    "explore": {"": PROBLEM, "--port": POINTS, "--no-browser": FLAG},
    "figures": {"": FIGURE, "--points": POINTS},
}

_GROUPS, _RATIO, _CARD = ["--beta0", "--lam"], ["--ratio"], ["--card"]

#: What makes a question of each command: one of these sets, given most of the time.
NEEDED: dict[str, list[list[str]]] = {
    "run": [[""]],
    "pressure": [["--length", *rod] for rod in (_RATIO, _CARD, [*MATERIAL])],
    "length": [["--pressure", *rod] for rod in (_RATIO, _RATIO, _CARD, [*MATERIAL])],
    "trace": [["--points", *about] for about in (_RATIO, ["--beta0"], _GROUPS)],
    "hysteresis": [["--points", *about] for about in (_RATIO, ["--beta0"], ["--beta0", "--form"])],
    "tradeoff": [[*_GROUPS], ["--beta0", "--beta1"], ["--pressure", *_RATIO], ["--length", *_CARD]],
    "sweep": [["--workers", *about] for about in (["--ratio", "--pressure-ratio"], _GROUPS)],
    "uncertainty": [["--T0", "--pressure"], ["--T0"], ["--k", "--y0", "--length"]],
    "calibrate": [[""]],
    "flaw": [["--flaw", *rod] for rod in (_RATIO, _CARD)] + [["--pressure", *_RATIO]],
    "peel": [["--pull", "--angle"], ["--work", "--angle"]],
    "solve": [["--free", "--length", "--card"]],
    "new": [["", "--kind"], ["", "--ratio"], ["", *MATERIAL], ["", "--kind", "--k"]],
    "snap": [[""]],
    "history": [[""]],
    "explore": [[], [""]],
    "figures": [[]],
}

#: How many times fewer inputs a command gets whose answers take long.
COSTLY = {"calibrate": 12, "flaw": 8, "solve": 8}

#: What keeps a command short, given always.
ALWAYS = {
    "new": ["--source", "--force", "--examples"],
    "tradeoff": ["--repeats", "--methods", "--tols"],
    "uncertainty": ["--samples", "--no-indices", "--workers", "--card"],
    "figures": [""],  # without a name, all are drawn
}


@st.composite
def argument_lists(draw: st.DrawFn, name: str) -> list[str]:
    """Return the arguments of a question, with a few options too many and a few values spoilt."""
    options = COMMANDS[name]
    chosen = draw(st.sampled_from(NEEDED[name])) if draw(st.integers(0, 9)) else []
    more = draw(st.lists(st.sampled_from([*options]), max_size=draw(st.sampled_from([0, 1, 1, 2, 4]))))
    chosen = list(dict.fromkeys([*chosen, *more, *ALWAYS.get(name, [])]))
    spoilt = draw(st.sets(st.integers(0, len(chosen)), max_size=draw(st.sampled_from([0, 0, 1, 1, 2, 9]))))
    arguments = [name]
    for place, option in enumerate(chosen):
        values = options[option].bad if place in spoilt else options[option].good
        texts = [draw(values) for _ in range(options[option].count)]
        # A value that starts with a minus has to be tied to its option.
        if option and len(texts) == 1:
            arguments.append(f"{option}={texts[0]}")
        else:
            arguments += [*filter(None, [option]), *texts]
    if draw(st.integers(0, 29)) == 0:
        stray = draw(TEXTS | st.sampled_from(["--jso", "-h", "--"]))
        arguments.insert(draw(st.integers(0, len(arguments))), stray)
    return arguments


@pytest.fixture
def no_server(monkeypatch):
    """Keep the explorer from serving: the address it would have is enough."""
    from peel_opt.app.explorer import server

    def serve(state, *, port, browser, ready):
        ready("http://127.0.0.1:0")

    monkeypatch.setattr(server, "serve", serve)


def ended_well(arguments: list[str]) -> None:
    code, out, err = command(arguments)
    if code == 0 and "--json" in arguments and "-h" not in arguments:
        json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    if code == 0:
        assert not err, err


@pytest.mark.parametrize("name", COMMANDS)
@examples(few=25, many=300)
@pytest.mark.usefixtures("no_server")
def test_any_argument_list_ends_with_a_code_and_a_line(name, count, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where files go by default
    hammer(ended_well, argument_lists(name), count // COSTLY.get(name, 1))


@examples(few=100, many=600)
def test_any_words_at_all_are_a_usage_error(count):
    words = st.text(max_size=8) | st.sampled_from([*COMMANDS, "--help", "--version", "--", "-"])

    def check(arguments: list[str]) -> None:
        code, out, _ = command(arguments)
        assert code in (0, 2) or arguments[0] in COMMANDS, (code, out)

    # Two commands start work, and a lot, without any argument.
    short = st.lists(words, max_size=2).filter(lambda given: given[:1] not in (["figures"], ["explore"]))
    hammer(check, short, count)


def test_every_command_is_among_those_tried():
    (commands,) = (
        action for action in cli._parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    assert set(commands.choices) == set(COMMANDS)
    for name, parser in commands.choices.items():
        known = {text for action in parser._actions for text in action.option_strings}
        assert set(COMMANDS[name]) <= known | {""}, name


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (1, ""),
        (3, "peel-opt: something"),
        (2, "Traceback (most recent call last)"),
        (1, "peel-opt: ok\nstray"),
    ],
)
def test_the_judge_lets_nothing_through(code, words, monkeypatch):
    def fails(arguments: list[str]) -> int:
        print(words, file=sys.stderr)
        return code

    monkeypatch.setattr("tests.fuzzing.main", fails)
    with pytest.raises(AssertionError):
        command([])
