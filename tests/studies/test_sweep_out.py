"""Sweeps leave the library: CSV, NPZ, xarray, NetCDF, pictures, the command line."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pint
import pytest

import peel_opt as po
from peel_opt.app.cli.main import main
from peel_opt.base.units import LENGTH, NUMBER, PRESSURE
from peel_opt.studies.sweep.answers import NUMBERS, TEXTS
from peel_opt.studies.sweep.ranges import parse_range

from ..rods import FLAP


@pytest.fixture(scope="module")
def grid() -> po.Sweep:
    axes = {"adhesion_strength": [120e3, 140e3, 160e3], "pressure": [10e3, 80e3, 90e3, 100e3]}
    return po.sweep(axes, rod=FLAP, workers=1)


@pytest.fixture(scope="module")
def listed() -> po.Sweep:
    return po.sweep({"ratio": [0.5, 1.0, 1.0], "pressure_ratio": [0.7, 0.8, 1.5]}, zipped=True)


def test_npz_restores_every_bit(tmp_path: Path, grid: po.Sweep, listed: po.Sweep) -> None:
    for found in (grid, listed):
        again = po.Sweep.load(found.save(tmp_path / "sweep.npz"))
        for name in (*NUMBERS, *TEXTS):
            assert again[name].tobytes() == found[name].tobytes()
        assert repr(again) == repr(found)
        assert again.arithmetic == found.arithmetic
        assert again.rod == found.rod
        assert again.columns == found.columns


def test_damaged_files_are_refused(tmp_path: Path, grid: po.Sweep) -> None:
    path = grid.save(tmp_path / "sweep.npz")
    content = path.read_bytes()
    for damaged in (b"", content[:-50], b"PK" + content[10:]):
        path.write_bytes(damaged)
        with pytest.raises(po.InvalidInput, match="sweep file"):
            po.Sweep.load(path)
    eq = po.length_given_pressure(FLAP, 100e3)
    with pytest.raises(po.InvalidInput, match="peel_opt equilibrium"):
        po.Sweep.load(eq.save(tmp_path / "eq.npz"))


def test_csv_has_units_and_exact_numbers(tmp_path: Path, grid: po.Sweep) -> None:
    lines = grid.to_csv(tmp_path / "sweep.csv").read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert f"# bending_stiffness [N m] = {json.dumps(2.3e-5)}" in comments
    rows = list(csv.DictReader(lines[len(comments) :]))
    assert list(rows[0])[:4] == ["adhesion_strength [Pa]", "pressure [Pa]", "length [m]", "pressure_ratio"]
    assert [float(row["length [m]"]) for row in rows][1].hex() == grid["length"][0, 1].item().hex()
    assert {row["status"] for row in rows} == {"certified", "no-equilibrium"}


def test_xarray_and_netcdf(tmp_path: Path, grid: po.Sweep, listed: po.Sweep) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    data = grid.to_xarray()
    assert data["length"].dims == ("adhesion_strength", "pressure")
    assert data["length"].attrs["units"] == "m"
    picked = data["length"].sel(pressure=100e3, adhesion_strength=140e3)
    single = po.length_given_pressure(FLAP, 100e3)
    error = data["error"].sel(pressure=100e3, adhesion_strength=140e3)
    assert abs(float(picked) - single.length) <= FLAP.eta * (float(error) + single.error)
    for found in (grid, listed):
        with xarray.open_dataset(found.to_netcdf(tmp_path / "sweep.nc"), engine="h5netcdf") as stored:
            assert stored.load().identical(found.to_xarray())
    assert listed.to_xarray()["length_ratio"].dims == ("point",)


def test_without_the_extra_an_error_says_what_to_install(
    tmp_path: Path, grid: po.Sweep, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    for call in (grid.to_xarray, lambda: grid.to_netcdf(tmp_path / "sweep.nc")):
        with pytest.raises(po.MissingExtra, match=r"pip install 'peel_opt\[xarray\]'"):
            call()


def test_pictures_have_units_in_every_label(grid: po.Sweep, listed: po.Sweep) -> None:
    curves = grid.plot()
    assert (curves.get_xlabel(), curves.get_ylabel()) == ("$p$ [kPa]", r"$\bar s$ [mm]")
    labels = [text.get_text() for text in curves.get_legend().get_texts()]
    assert labels == ["$T_0$ = 120 kPa", "$T_0$ = 140 kPa", "$T_0$ = 160 kPa", "no answer"]
    assert "no-equilibrium" in curves.get_title("left")
    axes = {"ratio": np.geomspace(0.5, 5.0, 8), "pressure_ratio": np.linspace(0.5, 0.95, 9)}
    levels = po.sweep(axes, workers=1).plot()
    assert (levels.get_xlabel(), levels.get_ylabel()) == (r"$\eta/y_0$", "$p/T_0$")
    assert levels.get_xscale() == "log"
    assert levels.figure.axes[1].get_ylabel() == r"$\bar s/\eta$"
    assert listed.plot(column="error").get_ylabel() == "estimated error"
    with pytest.raises(po.InvalidInput, match="texts"):
        grid.plot(column="status")
    with pytest.raises(po.InvalidInput, match="no column"):
        grid.plot(column="colour")
    cube = po.sweep({"ratio": [1.0, 2.0], "pressure_ratio": 0.8}, workers=1)
    assert cube.plot().get_title("left").startswith("$p/T_0$ = 0.8; 2 of 2")


def test_a_column_that_is_not_there_is_told_from_those_that_are_each_once() -> None:
    table = po.sweep({"ratio": [0.5, 1.0], "pressure_ratio": 0.8}, workers=1)
    with pytest.raises(po.InvalidInput, match="no column 'lenght'") as refused:
        table["lenght"]
    names = str(refused.value).partition("It has ")[2].rstrip(".").split(", ")
    assert len(names) == len(set(names)) > 10
    assert {"ratio", "length_ratio", "status"} <= set(names)


def test_level_lines_do_not_depend_on_the_order_of_the_axes() -> None:
    from matplotlib.contour import ContourSet

    ratios, pressures = np.geomspace(0.5, 2.0, 8), np.linspace(0.4, 0.9, 9)
    across, up = (np.random.default_rng(1).permutation(n) for n in (8, 9))
    drawn = []
    for axes in ((ratios, pressures), (ratios[across], pressures[up])):
        found = po.sweep(dict(zip(("ratio", "pressure_ratio"), axes, strict=True)), workers=1)
        sets = [c for c in found.plot().collections if isinstance(c, ContourSet)]
        drawn.append([path.vertices for c in sets for path in c.get_paths()])
    assert len(drawn[0]) == len(drawn[1]) > 0
    for one, other in zip(*drawn, strict=True):
        assert np.array_equal(one, other)


def test_ranges() -> None:
    assert parse_range("x", "0.5:2:4", NUMBER).tolist() == [0.5, 1.0, 1.5, 2.0]
    assert parse_range("x", "1:100:3:log", NUMBER) == pytest.approx([1.0, 10.0, 100.0], rel=1e-14)
    assert parse_range("x", "20:100 kPa:3", PRESSURE).tolist() == [20e3, 60e3, 100e3]
    assert parse_range("x", "1 mm, 2 mm,3 mm", LENGTH) == pytest.approx([1e-3, 2e-3, 3e-3])
    assert parse_range("x", "60 kPa", PRESSURE) == 60e3
    assert parse_range("x", "2 y0", LENGTH, own={"y0": 0.5}) == 1.0
    assert parse_range("x", "-1:1:3", NUMBER, signed=True).tolist() == [-1.0, 0.0, 1.0]
    assert parse_range("x", "0.5,1,2", NUMBER).tolist() == [0.5, 1.0, 2.0]
    assert parse_range("x", "1, 9 mm", LENGTH) == pytest.approx([1e-3, 9e-3])
    assert parse_range("x", "60 kPa,70 kPa", PRESSURE).tolist() == [60e3, 70e3]
    assert parse_range("x", "1,2.5", NUMBER).tolist() == [1.0, 2.5]
    for text in ("1:2", "1:2:3:4", "1:2:1", "1:2:x", "0:2:3:log", "1:2:3", "a:b:c", "", "1 kg:2 kg:3"):
        with pytest.raises(po.InvalidInput, match=r"^--p"):
            parse_range("--p", text, PRESSURE, signed=True)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,9 mm", r"1\.9 mm, or 1 mm and 9 mm\. .*'1, 9 mm'"),
        ("1,900 mm", r"1\.900 mm, or 1 mm and 900 mm"),
        ("1,900.5 mm", r"one number or two: 1900\.5 mm, or 1 mm and 900\.5 mm"),
        ("0,5e3um", r"0\.5e3um, or 0um and 5e3um"),
        ("1,9 mm,2,1 mm", r"with and without a unit.*decimal point"),
        ("1,9:3,0 mm:5", r"--p"),
    ],
)
def test_a_decimal_comma_is_no_list(text: str, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        parse_range("--p", text, LENGTH)


def test_files_are_named_after_the_card(tmp_path: Path) -> None:
    problems = Path(__file__).parents[2] / "problems"
    for card in ("aortic_flap", "foil_tape"):
        asked = ["sweep", "--card", str(problems / f"{card}.toml"), "--pressure", "0.6 T0, 0.8 T0"]
        assert main([*asked, "--out", str(tmp_path), "--workers", "1"]) == 0
    ends = (".csv", ".npz", ".png", ".journal")
    stems = "sweep-aortic-flap", "sweep-foil-tape"
    expected = {"written.json", *(f"{stem}{end}" for stem in stems for end in ends)}
    assert {path.name for path in tmp_path.iterdir()} == expected


def test_quantities_keep_their_unit() -> None:
    units = pint.UnitRegistry()
    for lengths in ([1.9, 2.0] * units.mm, [1.9 * units.mm, 2000.0 * units.um]):
        assert po.sweep({"length": lengths}, rod=FLAP)["length"] == pytest.approx([1.9e-3, 2e-3], rel=1e-15)
    strengths = po.sweep({"adhesion_strength": [0.13, 0.15] * units.MPa, "length": 1.9 * units.mm}, rod=FLAP)
    assert strengths["adhesion_strength"].tolist() == [130e3, 150e3]
    assert strengths["length"] == pytest.approx(1.9e-3, rel=1e-15)
    plain = po.sweep({"ratio": 1.0, "pressure_ratio": [60.0, 80.0] * units.percent})
    assert plain["pressure_ratio"] == pytest.approx([0.6, 0.8], rel=1e-15)
    for axes, rod in (
        ({"length": [60.0] * units.kPa}, FLAP),
        ({"length": [3.0] * units.mm}, po.Rod.from_ratio(1.0)),
        ({"ratio": [1.0] * units.mm, "pressure_ratio": 0.8}, None),
    ):
        with pytest.raises(po.InvalidInput, match="cannot be taken in"):
            po.sweep(axes, rod=rod)


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    command = ["sweep", "--ratio", "1, 2", "--pressure-ratio", "0.6:0.8:3", "--out", str(out)]
    assert main([*command, "--netcdf"]) == 0
    printed = capsys.readouterr()
    assert "6 of 6 points certified" in printed.out
    assert printed.err == ""
    files = {path.name for path in out.iterdir()}
    assert files == {"sweep.csv", "sweep.nc", "sweep.npz", "sweep.png", "sweep.journal", "written.json"}
    found = po.Sweep.load(out / "sweep.npz")
    single = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8)
    assert abs(found["length_ratio"][0, 2] - single.length_ratio) <= found["error"][0, 2] + single.error
    assert main(command) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*command, "--resume", "--no-plot"]) == 0
    assert main([*command, "--resume", "--tol", "1e-9"]) == 2
    assert "another sweep" in capsys.readouterr().err


def test_a_missing_extra_is_said_before_the_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "h5netcdf", None)
    out = tmp_path / "out"
    command = ["sweep", "--ratio", "1, 2", "--pressure-ratio", "0.8", "--out", str(out), "--netcdf"]
    assert main(command) == 1
    assert "pip install 'peel_opt[xarray]'" in capsys.readouterr().err
    assert not out.exists()


def test_command_line_without_a_folder_prints_csv(capsys: pytest.CaptureFixture[str]) -> None:
    card = str(Path(__file__).parents[2] / "problems" / "aortic_flap.toml")
    assert main(["sweep", "--card", card, "--pressure", "0.1 T0,0.7 T0"]) == 1
    printed = capsys.readouterr()
    assert "length [m]" in printed.out
    assert "1 no-equilibrium" in printed.err
    assert main(["sweep", "--card", card, "--T0", "0.1 T0,0.7 T0", "--pressure", "1 kPa"]) == 2
    assert main(["sweep", "--ratio", "1, 2"]) == 2
    assert main(["sweep", "--ratio", "1, 2", "--pressure-ratio", "0.5", "--resume"]) == 2
