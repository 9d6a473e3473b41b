"""Numbers with units, in and out."""

import decimal
import math

import pytest

from peel_opt.base.checks import parse
from peel_opt.base.errors import InvalidInput
from peel_opt.base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, WORK, display

OWN = {"y0": 7e-4, "eta": 5e-4}


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("140 kPa", PRESSURE, 140e3),
        ("140kPa", PRESSURE, 140e3),
        ("  1.4e5   Pa ", PRESSURE, 140e3),
        ("60 mmHg", PRESSURE, 7999.3432),
        ("1 psi", PRESSURE, 6894.757293),
        ("2 bar", PRESSURE, 2e5),
        ("1 N/mm^2", PRESSURE, 1e6),
        ("0.73 mm", LENGTH, 0.73e-3),
        ("3 um", LENGTH, 3e-6),
        ("3 µm", LENGTH, 3e-6),
        ("3 μm", LENGTH, 3e-6),  # the Greek letter; above, the micro sign
        ("1 in", LENGTH, 0.0254),
        ("35.5 eV", STIFFNESS, 5.68772705e-18),
        ("23 uN m", STIFFNESS, 23e-6),
        ("23 uN*m", STIFFNESS, 23e-6),
        ("2 mN mm", STIFFNESS, 2e-6),
        ("100 gf/in", WORK, 38.608858),
        ("1 lbf/in", WORK, 175.126835),
        ("0.5 mJ/cm**2", WORK, 5.0),
        ("5.1 mJ/cm²", WORK, 51.0),
        ("5.1 mJ/cm2", WORK, 51.0),
        ("5.1 mJ cm-2", WORK, 51.0),
        ("170 N/100 mm", WORK, 1700.0),
        ("12 N/25mm", WORK, 480.0),
        ("0.4", NUMBER, 0.4),
        # Conventional water and mercury, the inch of 25.4 mm, the pound force of 4.4482216152605 N.
        ("1427 cmH2O", PRESSURE, 139940.8955),
        ("1427 cm_H2O", PRESSURE, 139940.8955),
        ("1427 cm H₂O", PRESSURE, 139940.8955),
        ("10 mmH2O", PRESSURE, 98.0665),
        ("10 inH2O", PRESSURE, 2490.8891),
        ("60 mm Hg", PRESSURE, 7999.3432),
        ("29.92 in Hg", PRESSURE, 101320.75),
        ("760 Torr", PRESSURE, 101325.0),
        ("760 torr", PRESSURE, 101325.0),
        ("100 psf", PRESSURE, 4788.0259),
        ("140 kN·m⁻²", PRESSURE, 140e3),
        ("140 kN m⁻²", PRESSURE, 140e3),
        ("14 kg/(m s^2)", PRESSURE, 14.0),
        ("1 kgf/cm²", PRESSURE, 98066.5),
        ("28.7 mil", LENGTH, 0.72898e-3),
        ("2 mils", LENGTH, 50.8e-6),
        ("2 thou", LENGTH, 50.8e-6),
        ("23 uN⋅m", STIFFNESS, 23e-6),
        ("23 µN-m", STIFFNESS, 23e-6),
        ("23 µNm", STIFFNESS, 23e-6),
        ("2 mNmm", STIFFNESS, 2e-6),
        ("0.2 Nm", STIFFNESS, 0.2),
        ("3 N/25.4 mm", WORK, 118.11023622),
        ("3 N/(25 mm)", WORK, 120.0),
        ("5 ozf/in", WORK, 5 * 0.45359237 * 9.80665 / 16 / 0.0254),
        ("5 gf/cm", WORK, 4.903325),
        ("2 pli", WORK, 2 * 0.45359237 * 9.80665 / 0.0254),
        ("120 mm-Hg", PRESSURE, 15998.6865),
        ("23 uN.m", STIFFNESS, 23e-6),
        ("5.664 y0", LENGTH, 5.664 * 7e-4),
    ],
)
def test_text_becomes_si(text, kind, value):
    assert parse("field", text, kind, own=OWN if "y0" in text else None) == pytest.approx(value, rel=1e-7)


def test_a_plain_number_is_in_si_units():
    assert parse("thickness", 40, LENGTH) == 40.0
    assert parse("near", -2.5, PRESSURE, signed=True) == -2.5


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("140", "needs a unit"),
        ("", "number with a unit"),
        ("kPa", "number with a unit"),
        ("140 kpa", "did you mean 'kPa'"),
        ("60 mmHG", "did you mean 'mmHg'"),
        ("140 k!Pa", "cannot be read"),
        ("140 mm", "cannot be measured in 'mm'"),
        ("3 degC", "unit"),
        ("1 500 Pa", "separators of thousands, got '1 500'. Write 1500."),
        ("1 500,5 Pa", "separators of thousands, got '1 500,5'. Write 1500.5."),
        ("1,500,000 Pa", "separators of thousands, got '1,500,000'. Write 1500000."),
        ("1'500 Pa", "Write 1500."),
        ("1_500 Pa", "Write 1500."),
        ("1.234.567 Pa", "Write 1234567."),
        ("1.234,5 Pa", "Write 1234.5."),
        ("1,234.5 Pa", "Write 1234.5."),
        ("1,5 Pa", "decimal comma, got '1,5'. Write 1.5."),
        ("1,500 Pa", "decimal or of thousands, got '1,500'. Write 1.500 or 1500."),
        ("1.2.3 Pa", "cannot be read"),
        ("5 lb/in^2", "'lb' is a mass. Its weight is 'lbf'"),
        ("5 kg/cm²", "'kg' is a mass. Its weight is 'kgf'"),
        ("5 kN/0 mm^2", "a count of 0"),
        ("5 kN/(m", "cannot be read"),
        ("−3 Pa", "must be positive, got -3"),
        ("5 Pa/", "cannot be read"),
        ("nan Pa", "must be finite"),
        ("inf kPa", "must be finite"),
        ("1e400 Pa", "must be finite"),
        ("-3 Pa", "must be positive"),
        ("0 Pa", "must be positive"),
        ("3 " + "Pa*" * 5000 + "Pa", "cannot be read"),
        ("__import__('os').getcwd()", "number with a unit"),
        (math.nan, "must be finite"),
        (-math.inf, "must be finite"),
        (0.0, "must be positive"),
        (10**400, "must be finite"),
        (True, "must be a number"),
        ([1.0], "must be a number"),
        (None, "must be a number"),
    ],
)
def test_what_cannot_be_meant_is_one_line_that_names_the_field(value, words):
    with pytest.raises(InvalidInput, match="adhesion_strength") as caught:
        parse("adhesion_strength", value, PRESSURE)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(("mass", "force"), [("oz/in", "ozf"), ("lb/in", "lbf"), ("g/cm", "gf")])
def test_a_mass_in_the_place_of_a_force_is_told_from_it(mass, force):
    words = rf"is a mass\. Its weight is '{force}'; if that is meant, write '{force}/\w+'\."
    with pytest.raises(InvalidInput, match=words):
        parse("work_of_separation", f"5 {mass}", WORK)


def test_a_text_means_the_nearest_float_whatever_decimals_a_caller_computes_with():
    with decimal.localcontext(prec=3):
        for i in range(1, 1000):
            assert parse("x", f"{i / 100} mm", LENGTH) == float(f"{i / 100}e-3")
    assert float("0.07e-3") != 0.07 * 0.001


def test_a_number_without_a_unit_is_not_asked_for_one():
    with pytest.raises(InvalidInput) as caught:
        parse("beta0", "abc", NUMBER)
    assert str(caught.value) == "beta0 must be a number, got 'abc'."


def test_a_text_is_never_evaluated():
    with pytest.raises(InvalidInput):  # as an expression it would take for ever
        parse("thickness", "3 9**9**9**9", LENGTH)


def test_accepted_units_are_named():
    with pytest.raises(InvalidInput, match=r"kPa.*mmHg.*T0"):
        parse("pressure", "3 mm", PRESSURE, own={"T0": 1e5})
    with pytest.raises(InvalidInput, match="cannot have a unit"):
        parse("ratio", "3 mm", NUMBER)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (6e4, "Pa", "60.0000 kPa"),
        (999.99999, "Pa", "1.00000 kPa"),
        (1.79e-3, "m", "1.79000 mm"),
        (1e-6, "m", "1.00000 um"),
        (-3.2e-7, "m", "-320.000 nm"),
        (5.69e-18, "N m", "5.69000 aN m"),
        (0.0, "m", "0.00000 m"),
        (math.nan, "Pa", "nan Pa"),
        (1e-30, "m", "1.00000e-30 m"),
    ],
)
def test_display_for_people(value, unit, text):
    assert display(value, unit) == text


@pytest.mark.parametrize("value", [1.0, 12.3456, 999.999, 1e3, 0.1, 1e-3, 7.77e-8, 3.21e8])
def test_what_is_displayed_can_be_typed_in_again(value):
    assert parse("p", display(value, "Pa"), PRESSURE) == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("0.2 MPa", PRESSURE, 2e5),
        ("0.3e-1 MPa", PRESSURE, 3e4),
        ("1.1 bar", PRESSURE, 1.1e5),
        ("29 um", LENGTH, 29e-6),
    ],
)
def test_decimal_units_leave_the_number_as_it_is_written(text: str, kind: object, value: float) -> None:
    assert parse("x", text, kind) == value
