"""Calibration cards, their CSV files, the command line, files and pictures of a fit."""

from __future__ import annotations

import importlib.util
import json
import shutil
from pathlib import Path

import numpy as np
import pint
import pytest

import peel_opt as po
from peel_opt.app.calibration_cards import load_calibration
from peel_opt.app.cards import load_card
from peel_opt.app.cli.main import main

ROOT = Path(__file__).parents[2]
FLAP = ROOT / "problems" / "calibrate_flap.toml"
CARDS = [
    pytest.param(path, marks=pytest.mark.slow if path.stem == "calibrate_tear" else ())
    for path in sorted((ROOT / "problems").glob("calibrate_*.toml"))
]
TRUTH = {
    "bending_stiffness": 23e-6,
    "adhesion_strength": 140e3,
    "adhesion_range": 0.73e-3,
    "unbonded": 0.5e-3,
}
GOOD = "length [mm], pressure [kPa], pressure_sd [kPa], state\n1.9, 48, 0.5, lower\n2.2, 33, 0.5,\n"


@pytest.mark.parametrize("path", CARDS, ids=lambda path: path.stem)
def test_every_card_recovers_its_truth(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", str(path), "--json", "--out", str(tmp_path), "--no-plot"]) == 0
    fit = json.loads(capsys.readouterr().out)["calibration"]
    units = {"bending_stiffness": "N m", "adhesion_strength": "Pa", "adhesion_range": "m", "unbonded": "m"}
    assert "synthetic" in load_calibration(path).note
    for name in fit["free"]:
        low, high = fit[f"{name}_interval [{units[name]}]"]
        assert low < TRUTH[name] < high
    assert fit["warnings"] == []
    assert fit["p_value"] > 0.01
    assert {o["status"] for o in fit["observations"]} == {"certified"}
    stem = path.stem.replace("_", "-")
    assert json.loads((tmp_path / f"{stem}.json").read_text())["free"] == fit["free"]
    text = (tmp_path / f"{stem}.csv").read_text()
    assert "fitted pressure [Pa]" in text
    assert text.count("\n") > len(fit["observations"])


def test_run_fits_a_calibration_card(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tape = ROOT / "problems" / "office_tape.toml"
    assert main(["run", str(FLAP), "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert out.count("wrote to") == 1
    assert "chi-square" in out
    assert "95 % interval" in out
    assert (tmp_path / "calibrate-flap.png").stat().st_size > 10_000
    assert main(["run", str(tape), str(FLAP), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["cards"]
    assert "answers" in first
    assert second["calibration"]["status"] == "fitted"


def test_the_wrong_command_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", str(ROOT / "problems" / "office_tape.toml")]) == 2
    assert "no [calibration]" in capsys.readouterr().err
    with pytest.raises(po.CardError, match="peel-opt calibrate"):
        load_card(FLAP)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("calibrate_flap.csv", "../calibrate_flap.csv", "file must lie beside the card"),
        ("calibrate_flap.csv", "/etc/passwd", "file must lie beside the card"),
        ("calibrate_flap.csv", "none.csv", "No such file"),
        ("adhesion_range = ", "adhesion_rang = ", "did you mean 'adhesion_range'"),
        ("free = [", "fre = [", "did you mean 'free'"),
        ('"adhesion_strength", "adhesion_range"]', '"stiffness"]', "free must list some of"),
        ("[sources]\nbending_stiffness", "[sources]\nthickness", "names 'thickness'"),
        ("[calibration]", '[estimates]\nbending_stiffness = "guess"\n[calibration]', "stands in both"),
        ("[[pairs]]", "[[pears]]", "unknown key 'pears'; did you mean 'pairs'"),
        ("[calibration]", "[calibration]\nlevel = 2", "level must lie between 1e-06 and 1"),
        ("[calibration]", "[calibration]\nlevel = 1e-17", "level must lie between 1e-06 and 1"),
        ("[calibration]", "[calibration]\nloss = 'huge'", "loss"),
        ("[calibration]", "[calibration]\nstate = 'upper'", "unknown state 'upper'"),
        ('"adhesion_range"]', '"weight"]', "'weight', which is no number under [scene]"),
        ("[sources]", "[scene]\nweight = '1 m'\n[sources]", "weight cannot be measured in 'm'"),
        ('"100 kPa"', '"100 mm"', "adhesion_strength cannot be measured in 'mm'"),
    ],
)
def test_mistakes_in_cards(
    old: str, new: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(FLAP.with_suffix(".csv"), tmp_path)
    text = FLAP.read_text()
    assert old in text
    card = tmp_path / "card.toml"
    card.write_text(text.replace(old, new, 1))
    assert main(["calibrate", str(card)]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_what_is_not_fitted_is_from_somewhere(tmp_path: Path) -> None:
    (card := tmp_path / "card.toml").write_text(
        FLAP.read_text().replace("[sources]\nbending_stiffness =", "# ")
    )
    with pytest.warns(po.CardWarning, match="where bending_stiffness is from"):
        assert load_calibration(card).unsourced == ("bending_stiffness",)


# --- CSV ----------------------------------------------------------------------------------


def read(tmp_path: Path, text: str | bytes, **options: object) -> po.Measurements:
    path = tmp_path / "data.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return po.read_measurements(path, **options)


def test_what_a_file_may_hold(tmp_path: Path) -> None:
    data = read(tmp_path, GOOD)
    assert data.length == pytest.approx([1.9e-3, 2.2e-3])
    assert data.pressure == pytest.approx([48e3, 33e3])
    assert data.pressure_sd == pytest.approx([500.0, 500.0])
    assert data.length_sd is None
    assert data.state == ("lower", None)
    assert data.names == ("data.csv, line 2", "data.csv, line 3")
    marked = b"\xef\xbb\xbf# made today\r\n\r\n" + GOOD.replace("\n", "\r\n").encode() + b"# the end"
    assert read(tmp_path, marked).names[0] == "data.csv, line 4"
    percent = read(tmp_path, "pressure [bar],length [in], length_sd [%], note\n0.48, 0.075, 2, first\n")
    assert percent.pressure == pytest.approx([48e3])
    assert percent.length_sd == pytest.approx([0.02 * 0.075 * 25.4e-3])
    bare = read(tmp_path, "length [mm], pressure [kPa]\n1.9, 48\n", pressure_sd=500.0, state="lower")
    assert bare.state == ("lower",)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("48", "", "line 2, column 'pressure': the cell is empty"),
        ("48", "nan", "line 2, column 'pressure': 'nan' is no finite number"),
        ("48", "48 kPa", "line 2, column 'pressure': '48 kPa' is no number"),
        ("48", "-48", "line 2, column 'pressure': must be positive, got -48"),
        ("2.2, 33, 0.5", "2.2, 33, 0", "line 3, column 'pressure_sd': must be positive"),
        ("1.9, 48", "1,9, 48", "line 2: 5 cells for 4 columns"),
        ("lower", "upper", "line 2, column 'state': unknown state 'upper'"),
        ("pressure [kPa]", "presure [kPa]", "unknown column 'presure [kPa]'. Did you mean 'pressure'"),
        ("pressure [kPa]", "pressure", "column 'pressure' needs a unit"),
        ("pressure [kPa]", "pressure [mm]", "column 'pressure' cannot be measured in 'mm'"),
        ("length [mm]", "length [mn]", "unknown unit 'mn'"),
        ("length [mm], ", "", "column 'length' is missing"),
        ("length [mm]", "pressure [Pa]", "column 'length' is missing"),
        (", state", ", pressure [Pa]", "column 'pressure' comes twice"),
        ("lower", "l" * 200_000, "line 2: field larger than field limit"),
        ("state", "s" * 200_000, "line 1: field larger than field limit"),
        (GOOD, GOOD.split("\n", maxsplit=1)[0], "a header and no rows"),
        (GOOD, "# nothing", "is empty"),
        (GOOD, "a\0b", "NUL"),
    ],
)
def test_what_a_file_may_not_hold(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(po.InvalidInput) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(po.InvalidInput, match="No such file"):
        po.read_measurements(tmp_path / "none.csv")
    with pytest.raises(po.InvalidInput, match="not a CSV file"):
        read(tmp_path, b"\xff\xfe\x00")
    with pytest.raises(po.InvalidInput, match="given besides"):
        read(tmp_path, GOOD, pressure_sd=1.0)
    (tmp_path / "shape.csv").write_text("x [mm], y [mm]\n-1, 0.5\n-0.5, 0.2\n")
    shape = po.read_shape(tmp_path / "shape.csv", sd=1e-5, pressure=6e4)
    assert shape.x == pytest.approx([-1e-3, -5e-4])
    assert shape.name == "shape"
    with pytest.raises(po.InvalidInput, match="needs a column 'sd'"):
        po.read_shape(tmp_path / "shape.csv", pressure=6e4)


def test_notes_are_data_and_nothing_but_a_line_break_ends_a_line(tmp_path: Path) -> None:
    hashes = read(
        tmp_path, "note,length [mm],pressure [kPa]\n#1,1.9,47\n#2,2.0,40\n3,2.1,34\n", pressure_sd=1.0
    )
    assert hashes.length == pytest.approx([1.9e-3, 2.0e-3, 2.1e-3])
    head = "length [mm],note,pressure [kPa]\n"
    quoted = read(
        tmp_path, head + '1.9,"#1",47\n2.0,"two\n1.95,lines,99\nof note",40\n2.1,#3,34\n', pressure_sd=1.0
    )
    assert quoted.pressure == pytest.approx([47e3, 40e3, 34e3])
    assert quoted.names == ("data.csv, line 2", "data.csv, line 3", "data.csv, line 6")
    for strange in ("\v", "\f", "\x85", "\u2028"):
        one = read(tmp_path, head + f"1.9,a{strange}1.95,47\n", pressure_sd=1.0)
        assert one.length == pytest.approx([1.9e-3])
    with pytest.raises(po.InvalidInput, match="line 3: 1 cells for 3 columns"):
        read(tmp_path, "note,length [mm],pressure [kPa]\n1,1.9,47\n# the end", pressure_sd=1.0)
    with pytest.raises(po.InvalidInput, match="line 2: unexpected end of data"):
        read(tmp_path, head + '1.9,"open,47\n', pressure_sd=1.0)


def test_quantities_of_pint_keep_their_units() -> None:
    units, other = pint.UnitRegistry(), pint.UnitRegistry()
    mm, kPa = units.mm, other.kPa
    pairs = po.Measurements(
        np.array([1.9, 2.0]) * mm,
        [60.0 * kPa, 6e4 * other.Pa],
        length_sd=15.0 * units.um,
        pressure_sd=0.5 * kPa,
    )
    assert pairs.length == pytest.approx([1.9e-3, 2.0e-3])
    assert pairs.pressure == pytest.approx([6e4, 6e4])
    assert pairs.length_sd == pytest.approx([15e-6, 15e-6])
    assert pairs.pressure_sd == pytest.approx([500.0, 500.0])
    shape = po.MeasuredShape([-1.0, -0.5] * mm, [0.5, 0.2] * mm, 12.0 * units.um, pressure=60.0 * kPa)
    assert shape.x == pytest.approx([-1e-3, -5e-4])
    assert shape.sd == pytest.approx([12e-6, 12e-6])
    assert shape.pressure == pytest.approx(6e4)
    for wrong in (np.array([1.9]) * units.kg, np.array([1.9]) * units.dimensionless):
        with pytest.raises(po.InvalidInput, match="length cannot be taken in"):
            po.Measurements(wrong, [6e4], pressure_sd=500.0)


def test_intervals_are_computed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[str] = []
    interval = po.Calibration.interval

    def counted(fit: po.Calibration, name: str, **how: object) -> tuple[float, float]:
        asked.append(name)
        return interval(fit, name, **how)

    monkeypatch.setattr(po.Calibration, "interval", counted)
    assert main(["calibrate", str(FLAP), "--out", str(tmp_path), "--no-plot"]) == 0
    assert asked == ["adhesion_strength", "adhesion_range"]
    assert "95 % interval" in capsys.readouterr().out
    stored = json.loads((tmp_path / "calibrate-flap.json").read_text())
    assert stored["adhesion_range_interval_method"] == "profile"


# --- pictures and the example ---------------------------------------------------------------


def test_picture_of_a_fit() -> None:
    card = load_calibration(FLAP)
    fit = card.fit(FLAP.parent)
    ax = fit.plot()
    below = ax.figure.axes[1]
    assert ax.get_xlabel() == r"$\bar s$ [mm]"
    assert ax.get_ylabel() == below.get_xlabel() == "$p$ [kPa]"
    assert below.get_ylabel() == "residual [sd]"
    drawn = np.concatenate([line.get_ydata() for line in below.lines if len(line.get_ydata()) == 14])
    assert np.sort(drawn) == pytest.approx(np.sort(np.concatenate(fit.residuals)))
    assert (ROOT / "docs" / "img" / "calibration.png").stat().st_size > 10_000


def test_calibrate_flap() -> None:
    spec = importlib.util.spec_from_file_location("calibrate_flap", ROOT / "examples" / "calibrate_flap.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = module.main()
    assert found["T0 [kPa]"] == pytest.approx(138.672, abs=2e-3)
    assert found["y0 [mm]"] == pytest.approx(0.71026, abs=2e-5)
    assert found["chi-square"] == pytest.approx(6.641, abs=2e-3)
