"""Measurements as spreadsheets, testing machines and pandas give them.

Modules: studies/calibrate/read.py, base/records.py.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import peel_opt as po

LENGTHS, PRESSURES = [1.9e-3, 2.4e-3], [67.1e3, 46.2e3]

FORMS = {
    "semicolons and decimal commas": (
        "length [mm];pressure [kPa];pressure_sd [%]\n1,9;67,1;1\n2,4;46,2;1\n",
        "utf-8",
    ),
    "tabs": ("length [mm]\tpressure [kPa]\tpressure_sd [%]\n1.9\t67.1\t1\n2.4\t46.2\t1\n", "utf-8"),
    "tabs and decimal commas": (
        "length [mm]\tpressure [kPa]\tpressure_sd [%]\n1,9\t67,1\t1\n2,4\t46,2\t1\n",
        "utf-8",
    ),
    "UTF-16": ("length [mm]\tpressure [kPa]\tpressure_sd [%]\n1,9\t67,1\t1\n2,4\t46,2\t1\n", "utf-16"),
    "cp1252": (
        "length [µm],pressure [kPa],pressure_sd [%],Prüfer\n1900,67.1,1,Jürgen\n2400,46.2,1,Jürgen\n",
        "cp1252",
    ),
    "a row of units": ("Length;Pressure;Pressure SD\nmm;kPa;%\n1,9;67,1;1\n2,4;46,2;1\n", "utf-8"),
    "round brackets": ("Length (mm),Pressure (kPa),pressure_sd (%)\n1.9,67.1,1\n2.4,46.2,1\n", "utf-8"),
    "further columns": (
        "no,length [mm],pressure [kPa],pressure_sd [%],operator,\n1,1.9,67.1,1,KM,\n2,2.4,46.2,1,KM,\n",
        "utf-8",
    ),
    "a block above": (
        "Machine;Z010\nOperator;K. M.\n\nDate;2024-05-03\n"
        "length [mm];pressure [kPa];pressure_sd [%]\n1,9;67,1;1\n2,4;46,2;1\n",
        "utf-8",
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_numbers(form: str, tmp_path: Path) -> None:
    text, coding = FORMS[form]
    path = tmp_path / "export.csv"
    path.write_bytes(text.encode(coding))
    data = po.read_measurements(path)
    np.testing.assert_allclose(data.length, LENGTHS, rtol=1e-15)
    np.testing.assert_allclose(data.pressure, PRESSURES, rtol=1e-15)
    np.testing.assert_allclose(data.pressure_sd, 0.01 * np.array(PRESSURES), rtol=1e-15)


def test_what_was_read_is_said(tmp_path: Path) -> None:
    path = tmp_path / "export.csv"
    path.write_text("Machine;Z010\nlength [mm];pressure [kPa];operator\n1,9;67,1;KM\n")
    assert po.read_measurements(path, pressure_sd=500.0).read == (
        "1 rows of 'export.csv' (UTF-8, cells separated by semicolons, decimal comma),"
        " header in 'export.csv', line 2: length [mm], pressure [kPa]; not read: operator"
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "length [mm]\tpressure [kPa]\n1,900\t67\n",
            "line 2: '1,900' may be a decimal comma or a separator of thousands",
        ),
        (
            "length [mm];pressure [Pa]\n1,9;67.100\n",
            "line 2, column 'pressure': '67.100' has a point, and other numbers",
        ),
        (
            "length [mm],pressure [kPa],presure_sd [kPa]\n1.9,67,1\n",
            "unknown column 'presure_sd.*Did you mean 'pressure_sd'",
        ),
    ],
)
def test_what_may_mean_two_things_is_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "export.csv"
    path.write_text(text)
    with pytest.raises(po.InvalidInput, match=words):
        po.read_measurements(path, pressure_sd=1.0)


def test_a_data_frame_is_read_like_a_file() -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {"length [mm]": [1.9, 2.4], "pressure [kPa]": [67.1, 46.2], "day": ["Mon", None]}, index=["a", "b"]
    )
    data = po.read_measurements(frame, pressure_sd=500.0)
    np.testing.assert_allclose(data.length, LENGTHS, rtol=1e-15)
    assert data.read == (
        "2 rows of a data frame, header in its titles: length [mm], pressure [kPa]; not read: day"
    )
    frame.loc["b", "pressure [kPa]"] = np.nan
    with pytest.raises(po.InvalidInput, match="row 'b', column 'pressure': the cell is empty"):
        po.read_measurements(frame, pressure_sd=500.0)


def test_results_are_data_frames_and_labelled_arrays() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    eq = po.length_given_pressure(po.Rod(23e-6, 101e3, 1.2e-6), 67e3)
    frame = eq.to_dataframe()
    assert (frame["y [m]"].to_numpy() == eq.y).all()
    assert frame.attrs["pressure [Pa]"] == eq.pressure
    labelled = eq.to_xarray()
    assert labelled["y"].attrs["units"] == "m"
    assert labelled["y"].dims == ("point",)
