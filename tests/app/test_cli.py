"""The command line as its users meet it."""

import argparse
import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from peel_opt import Equilibrium, __version__
from peel_opt.app.cli import main as cli
from peel_opt.app.report import slug
from peel_opt.studies.tradeoff.compare import METHODS

ROOT = Path(__file__).parents[2]
AORTA = str(ROOT / "problems" / "aortic_flap.toml")
ROD = ["--k", "23 uN m", "--T0", "140 kPa", "--y0", "0.73 mm"]

#: Two questions without an answer around one with, in a card that tries to leave its folder.
MIXED = """
title = "mixed é ∞"
[rod]
ratio = 1.0
[[questions]]
name = "../../../too long"
length_ratio = 30
[[questions]]
name = "../../etc/passwd"
pressure_ratio = 0.8
[[questions]]
name = "../../etc/passwd!"
pressure_ratio = 0.7
"""


@pytest.fixture
def mixed(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED, encoding="utf-8")
    return str(path)


def process(*arguments, **options):
    return subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, capture_output=True, check=False, timeout=60, **options
    )


# --- answers ------------------------------------------------------------------------------


def test_pressure(call):
    code, out, err = call("pressure", "--length", "1.9 mm", *ROD)
    assert (code, err) == (0, "")
    for words in ("pressure at 1.9 mm", "kPa", "1.9000000 mm", "lower", "cohesive", "certified", "error"):
        assert words in out


def test_length_inverts_pressure(call):
    answer = json.loads(call("pressure", "--length", "1.9 mm", *ROD, "--json")[1])
    code, out, _ = call("length", "--pressure", f"{answer['pressure [Pa]']!r} Pa", *ROD, "--json")
    assert code == 0
    assert json.loads(out)["length [m]"] == pytest.approx(1.9e-3, rel=1e-9)


def test_a_rod_by_its_ratio_or_from_a_card(call):
    answer = json.loads(call("length", "--pressure", "0.8", "--ratio", "1", "--json")[1])
    assert answer["length_ratio"] == pytest.approx(3.036804006, abs=1e-8)
    assert call("length", "--pressure", "0.8 T0", "--ratio", "1")[0] == 0
    code, out, _ = call("length", "--pressure", "450 mmHg", "--card", AORTA)
    assert code == 0
    assert "k = 22.87 uN m" in out


def test_options_reach_the_question(call):
    args = ("pressure", "--length", "5.2", "--ratio", "1", "--json")
    assert json.loads(call(*args)[1])["state"] == "lower"
    folded = json.loads(call(*args, "--state", "folded", "--tol", "1e-6", "--method", "spectral")[1])
    assert folded["state"] == "folded"
    assert folded["tol"] == 1e-6
    assert folded["stats.method"].startswith("Spectral")
    assert json.loads(call(*args, "--near", "0.24 T0")[1])["state"] == "folded"


def test_run_prints_a_table(call):
    code, out, err = call("run", AORTA)
    assert (code, err) == (0, "")
    for words in ("Aortic", "sourced: adhesion_strength", "estimated: youngs_modulus", "certificate"):
        assert words in out
    for words in ("flap in equilibrium at 300 mmHg", "certified", "2.0314992 mm", "48.354137 kPa"):
        assert words in out


def test_numbers_from_nowhere_are_said_in_one_line(call, tmp_path):
    rod = '[rod]\nbending_stiffness = "23 uN m"\nadhesion_strength = "140 kPa"\nadhesion_range = "0.73 mm"\n'
    (card := tmp_path / "card.toml").write_text(f'title = "x"\n{rod}[[questions]]\npressure_ratio = 0.8\n')
    code, out, err = call("run", card)
    assert (code, err.count("\n")) == (0, 1)
    assert err.startswith("peel-opt: warning: card ")
    assert "without a source: adhesion_range, adhesion_strength, bending_stiffness" in out


def test_a_failed_question_is_one_line_and_the_others_are_answered(call, mixed):
    code, out, err = call("run", mixed)
    assert code == 1
    assert out.count("certified") == 2
    assert "no-equilibrium" in out
    assert err.count("\n") == 1
    assert "too long" in err
    assert "nearest" in err


def test_json_is_one_document_without_nan(call, mixed):
    code, out, _ = call("run", mixed, ROOT / "problems" / "fig10a.toml", "--json")
    assert code == 1
    document = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    first, second = document["cards"]
    assert [a["status"] for a in first["answers"]] == ["no-equilibrium", "certified", "certified"]
    assert first["answers"][0]["nearest"] == pytest.approx(5.400885, abs=1e-4)
    assert second["answers"][0]["alpha"] == pytest.approx(14.8646046, abs=1e-7)
    code, out, err = call("length", "--pressure", "2", "--ratio", "1", "--json")
    assert (code, json.loads(out)["status"]) == (1, "no-equilibrium")
    assert err.count("\n") == 1


# --- files --------------------------------------------------------------------------------


def test_files_of_each_answer_stay_in_their_folder(call, mixed, tmp_path):
    before = set(tmp_path.parent.rglob("*"))
    out = tmp_path / "deep" / "results"
    assert call("run", mixed, "--out", out, "--no-plot")[0] == 1
    names = sorted(path.name for path in out.iterdir())
    stems = ["mixed-etc-passwd", "mixed-etc-passwd-2"]
    assert names == sorted(
        [f"{stem}{suffix}" for stem in stems for suffix in (".csv", ".npz")]
        + ["mixed-summary.csv", "written.json"]
    )
    assert {p for p in set(tmp_path.parent.rglob("*")) - before if p.is_file()} == set(out.iterdir())
    assert Equilibrium.load(out / f"{stems[0]}.npz").pressure_ratio == pytest.approx(0.8)
    assert Equilibrium.load(out / f"{stems[1]}.csv").pressure_ratio == pytest.approx(0.7)
    with open(out / "mixed-summary.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["no-equilibrium", "certified", "certified"]
    assert float(rows[1]["length_ratio"]) == pytest.approx(3.036804006, abs=1e-8)


def test_each_answer_gets_a_picture(call, tmp_path):
    assert call("pressure", "--length", "1.9 mm", *ROD, "--out", tmp_path)[0] == 0
    picture = tmp_path / "pressure-at-1.9-mm.png"
    assert picture.read_bytes().startswith(b"\x89PNG")


OTHER = ["--k", "24 uN m", "--T0", "140 kPa", "--y0", "0.73 mm"]
FAST = ["--no-plot", "--points", "8"]
SPREAD = ["uncertainty", "--samples", "2", "--no-indices", "--workers", "1", "--no-plot"]


@pytest.mark.parametrize(
    ("first", "other", "stem", "kinds"),
    [
        (["length", *ROD, "--pressure", "60 kPa", "--no-plot"], OTHER, "length-at-60-kpa", "npz csv"),
        (["trace", *ROD, *FAST], OTHER, "branch-rod", "npz csv"),
        (["hysteresis", *ROD, *FAST], OTHER, "hysteresis-rod", "npz csv"),
        (["hysteresis", "--beta0", "4", *FAST], ["--lam", "-2", "2"], "hysteresis-beta0-4-delay", "npz csv"),
        (["trace", "--beta0", "4", *FAST], ["--lam", "-2", "2"], "branch-beta0-4", "npz csv"),
        (
            [*SPREAD, *ROD[:4], "--y0", "0.7 mm +- 1 %", "--pressure", "90 kPa"],
            ["--pressure", "91 kPa"],
            "samples",
            "csv",
        ),
        (
            [
                "tradeoff",
                "--beta0",
                "4",
                "--lam",
                "1",
                "--methods",
                "series",
                "--repeats",
                "1",
                "--tols",
                "1e-3",
                "--no-plot",
            ],
            ["--lam", "2"],
            "tradeoff",
            "npz csv",
        ),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_files_of_another_rod_or_question_stay(call, tmp_path, first, other, stem, kinds):
    wrote = f"wrote to {tmp_path}: {_four(stem, kinds)}\n"
    code, out, err = call(*first, "--out", tmp_path)
    assert (code, err) == (0, "")
    assert out.endswith(wrote)
    files = [tmp_path / f"{stem}.{kind}" for kind in kinds.split()]
    before = [path.read_bytes() for path in files]
    code, out, err = call(*first, *other, "--out", tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"{stem}.{kinds.split()[0]}' is of another rod or question (peel-opt {first[0]} " in err
    assert "--force" in err
    assert [path.read_bytes() for path in files] == before
    # Its own files a command replaces, and so it does all with --force.
    assert call(*first, "--out", tmp_path)[0] == 0
    code, out, err = call(*first, *other, "--out", tmp_path, "--force")
    assert (code, err) == (0, "")
    assert out.endswith(wrote)
    assert all(path.read_bytes() != content for path, content in zip(files, before, strict=True))


def test_files_are_named_after_the_card(call, tmp_path):
    for card in ("aortic_flap", "office_tape"):
        path = ROOT / "problems" / f"{card}.toml"
        assert call("trace", "--card", path, "--out", tmp_path, *FAST)[0] == 0
        assert call("run", path, "--out", tmp_path, "--no-plot")[0] == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names > {"branch-aortic-flap.npz", "branch-office-tape.npz"}
    assert names > {"aortic-flap-summary.csv", "office-tape-summary.csv"}


def test_a_card_that_has_become_another_rod_does_not_replace_what_it_was(call, mixed, tmp_path):
    out = tmp_path / "out"
    assert call("run", mixed, "--out", out, "--no-plot")[0] == 1
    Path(mixed).write_text(MIXED.replace("ratio = 1.0", "ratio = 2.0"), encoding="utf-8")
    code, _, err = call("run", mixed, "--out", out, "--no-plot")
    assert (code, err.count("\n")) == (2, 1)
    assert "is of another rod or question" in err
    assert call("run", mixed, "--out", out, "--no-plot", "--force")[0] == 1


def test_a_file_of_ones_own_is_nobody_elses(call, tmp_path):
    (tmp_path / "figure_7.pdf").write_text("from a paper")
    code, out, err = call("figures", "7", "--out", tmp_path)
    assert (code, out) == (2, "")
    assert "figure_7.pdf' is not of this command" in err
    assert (tmp_path / "figure_7.pdf").read_text() == "from a paper"
    (tmp_path / "written.json").write_text("no record")
    code, out, err = call("length", "--pressure", "0.8", "--ratio", "1", "--out", tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "is not the record" in err


@pytest.mark.parametrize("where", ["plain", "plain/below", "x" * 300])
def test_an_unwritable_folder_is_one_line_before_any_work(call, tmp_path, where):
    (tmp_path / "plain").write_text("a file")
    code, out, err = call("run", AORTA, "--out", tmp_path / where)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "folder" in err


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("../../x", "x"),
        ("..", "answer"),
        ("", "answer"),
        ("Länge 60 kPa", "lange-60-kpa"),
        ("a/b\\c:d\0", "a-b-c-d"),
    ],
)
def test_names_of_files_are_safe(text, name):
    assert slug(text) == name
    assert len(slug(text + "é" * 500 + "y" * 500)) <= 60


# --- wrong input --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["pressure", "--length", "1.9", *ROD], "length needs a unit"),
        (["pressure", "--length", "1.9 kPa", *ROD], "length cannot be measured"),
        (["pressure", "--length", "-1.9 mm", *ROD], "must be positive"),
        (["pressure", "--length", "nan mm", *ROD], "must be finite"),
        (["pressure", "--length", "1.9 mm", "--k", "140 kPa", "--T0", "23 uN m", "--y0", "1 mm"], "--k"),
        (["pressure", "--length", "1.9 mm", "--k", "23 uN m"], "--T0 and --y0"),
        (["pressure", "--length", "1.9 mm"], "--ratio"),
        (["pressure", "--length", "1.9 mm", *ROD, "--ratio", "1"], "--ratio"),
        (["pressure", "--length", "1.9 mm", "--ratio", "1"], "cannot have a unit"),
        (["pressure", "--length", "3", "--ratio", "1", "--law", "cubic"], "law"),
        (["pressure", "--length", "3", "--ratio", "1", "--state", "upper"], "state"),
        (["pressure", "--length", "3", "--ratio", "1", "--method", "magic"], "magic"),
        (["pressure", "--length", "3", "--card", "nowhere.toml"], "nowhere.toml"),
        (["pressure", "--length", "3", "--card", str(ROOT / "problems" / "fig10a.toml")], "no [rod]"),
        (["run", AORTA, "--method", "magic"], "magic"),
        (["run", "nowhere.toml"], "No such file"),
        (["run", AORTA, str(ROOT)], "directory"),
        (["run", str(ROOT / "problems" / "calibrate_flap.toml"), "--tol", "1e-6"], "neither --method nor"),
    ],
)
def test_wrong_input_is_one_line_and_code_2(call, arguments, words):
    code, out, err = call(*arguments)
    assert code == 2
    assert words in err
    assert "Traceback" not in err
    if arguments[:3] != ["run", AORTA, "--method"]:
        assert out == ""
        assert err.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [["fly"], ["run"], ["pressure", *ROD], ["run", AORTA, "--tol", "x"], ["run", AORTA, "--tol", "-1"],
     ["run", AORTA, "--jso"]],
)  # fmt: skip
def test_usage_errors_are_code_2(call, arguments):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert "usage: peel-opt" in err


def test_alone_it_prints_its_help(call):
    code, out, err = call()
    assert (code, err) == (0, "")
    assert out == call("--help")[1]
    assert "commands:" in out


def test_ctrl_c_is_code_130(call, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("peel_opt.app.cards.Card.ask", interrupt)
    assert call("run", AORTA) == (130, "", "peel-opt: interrupted\n")


# --- as a process -------------------------------------------------------------------------


def test_help_and_version_import_nothing_heavy():
    code = (
        "import sys; from peel_opt.app.cli.main import main\n"
        "codes = [main(['--help']), main(['run', '--help']), main(['--version'])]\n"
        "heavy = {'numpy', 'casadi', 'scipy', 'pint', 'pydantic', 'matplotlib', 'tqdm'}\n"
        "sys.exit(any(codes) or bool(heavy & set(sys.modules)))"
    )
    result = process("-c", code)
    assert result.returncode == 0, result.stderr
    assert __version__.encode() in result.stdout


def test_every_command_speaks_alike():
    (commands,) = (a for a in cli._parser()._actions if isinstance(a, argparse._SubParsersAction))
    shared = {}
    for name, parser in commands.choices.items():
        options = {text: a.help for a in parser._actions for text in a.option_strings}
        assert all(options.values()), name
        assert f"peel-opt {name}" in cli.EPILOG
        if name not in ("explore", "figures", "new"):
            assert {"--json", "--out", "--no-plot"} <= set(options), name
        for option in ("--law", "--state", "--method", "--json", "--no-plot", "--card"):
            if option in options:
                assert shared.setdefault(option, options[option]) == options[option], name
    assert all(method in shared["--method"] for method in METHODS)


@pytest.mark.parametrize("lam", ["-0.1:1:2", "-0.1,1"])
def test_a_range_may_begin_with_a_minus(call, lam):
    code, out, _ = call("sweep", "--beta0", "4", "--lam", lam, "--json")
    points = json.loads(out)["points"]
    assert (code, [point["lam"] for point in points]) == (0, [-0.1, 1.0])
    assert points[1]["alpha1"] == pytest.approx(-4.4354069891, abs=1e-9)


@pytest.mark.parametrize("low", [["--lam", "-5e-1"], ["--lam=-5e-1"], ["--lam", "-.5"], ["--lam", "-0.05E1"]])
def test_a_negative_number_may_have_an_exponent(call, low):
    code, out, _ = call("trace", "--beta0", "4", *low, "1", "--points", "8", "--json")
    document = json.loads(out)
    assert (code, document["options"]["lam"]) == (0, [-0.5, 1.0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["hysteresis", "--beta0", "-4e0", "--lam", "-1e0", "1"], "beta0 must be"),
        (["sweep", "--beta0", "4", "--lam", "-5e-2"], "all are single numbers"),
        (["tradeoff", "--beta0", "4", "--lam", "-1e3"], "got lam = -1000"),
        (["pressure", "--ratio", "1", "--length", "-3e0"], "length must be positive, got -3"),
        (["length", "--ratio", "1", "--pressure", "-5e-1 T0"], "pressure must be positive, got -0.5"),
        (["length", *ROD, "--pressure", "-5e-1kPa"], "pressure [Pa] must be positive, got -500"),
        (["trace", "--beta0", "4", "--lam", "-inf", "1"], "lam must be finite"),
        (["trace", "--ratio", "1", "--points", "-1e1"], "invalid int value"),
        (["trace", "--ratio", "1", "--tol", "-1e-3"], "must lie between 0 and 1, got -1e-3"),
    ],
)
def test_what_is_wrong_with_a_negative_number_is_said_of_the_number(call, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert "expected" not in err


def test_near_and_a_folder_are_read_as_they_were_typed(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ("pressure", "--ratio", "1", "--length", "3.1", "--near", "-1e-1", "--out", "-1", "--no-plot")
    code, out, _ = call(*asked)
    assert code == 0
    assert "far from near=-0.1" in out
    assert (tmp_path / "-1").is_dir()


def _four(stem, kinds):
    return ", ".join(f"{stem}.{kind}" for kind in kinds.split())


def test_the_commands_over_many_rods_print_nothing_but_their_result(call, tmp_path):
    asked = ("--pressure", "0.7 T0,0.8 T0", "--card", AORTA, "--out", tmp_path, "--json")
    code, out, err = call("sweep", *asked)
    assert (code, err) == (0, f"wrote to {tmp_path}: {_four('sweep-aortic-flap', 'csv npz png')}\n")
    document = json.loads(out)
    assert document["summary"] == "2 of 2 points certified"
    assert document["points"][0]["length [m]"] > 1e-3
    assert document["adhesion_strength [Pa]"] == 140.1e3
    spread = ("--pressure", "0.7 T0 +- 1 %", "--card", AORTA, "--samples", "4", "--out", tmp_path, "--json")
    code, out, err = call("uncertainty", *spread)
    assert (code, err) == (0, f"wrote to {tmp_path}: samples-aortic-flap.csv, length-aortic-flap.png\n")
    assert json.loads(out)["results"][0]["sampled"]["samples"] == 8
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".npz", ".png", ".journal", ".json"}


def test_where_no_sample_has_an_answer_the_code_says_so(call, monkeypatch):
    from peel_opt.studies.uncertainty import run as propagation
    from peel_opt.studies.uncertainty.fates import Sampled

    def none(rod, varied, *_):
        count = len(varied["pressure"])
        return Sampled(np.full(count, np.nan), np.full(count, "no-equilibrium"), 0.0)

    monkeypatch.setattr(propagation, "_answers", none)
    spread = ("--pressure", "0.7 T0 +- 1 %", "--card", AORTA, "--samples", "4")
    code, out, err = call("uncertainty", *spread)
    assert (code, err) == (1, "peel-opt: no sample has an answer\n")
    assert "100 % of 8 samples have no answer (8 no-equilibrium)" in out


@pytest.mark.parametrize(
    ("setting", "backend"), [("text.usetex: True", ""), ("", "nonsense")], ids=["usetex", "backend"]
)
def test_pictures_need_neither_latex_nor_a_backend(setting, backend, tmp_path):
    (tmp_path / "matplotlibrc").write_text(setting)
    environ = {**os.environ, "MATPLOTLIBRC": str(tmp_path), "MPLBACKEND": backend or "agg"}
    environ["PATH"] = str(tmp_path)  # no LaTeX there
    asked = ("-m", "peel_opt", "length", "--ratio", "1", "--pressure", "0.8", "--out", str(tmp_path / "out"))
    result = process(*asked, env=environ)
    assert (result.returncode, result.stderr) == (0, b"")
    assert (tmp_path / "out" / "length-at-0.8.png").read_bytes().startswith(b"\x89PNG")


def test_the_folder_of_a_page_is_made(call, tmp_path, monkeypatch):
    from peel_opt.app.explorer import export

    monkeypatch.setattr(export, "write_page", lambda path, *_, **__: Path(path))
    assert call("explore", "--export", tmp_path / "new" / "page.html")[0] == 0
    assert (tmp_path / "new").is_dir()


def test_a_plain_terminal_gets_its_table(mixed):
    plain = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}
    result = process("-W", "error", "-m", "peel_opt", "run", mixed, env={**os.environ, **plain})
    assert result.returncode == 1
    assert b"mixed \\xe9 \\u221e" in result.stdout
    assert b"Traceback" not in result.stderr


def test_a_reader_that_leaves_does_not_stop_the_work(tmp_path):
    command = [sys.executable, "-m", "peel_opt", "run", AORTA, "--out", str(tmp_path), "--no-plot"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        running.stdout.close()
        errors = running.stderr.read()
    assert (running.returncode, errors) == (0, b"")
    assert len(list(tmp_path.glob("*.npz"))) == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_one_line():
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "peel_opt", "length", "--pressure", "0.8", "--ratio", "1"]
        result = subprocess.run(
            command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, check=False, timeout=60
        )
    assert result.returncode == 2
    assert result.stderr.count(b"\n") == 1
    assert b"No space left" in result.stderr
