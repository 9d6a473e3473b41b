"""What the tests of random input share: wild values, and a call of the command line that is judged.

Hypothesis makes the inputs.  A few of each kind run every time, always the same; a thousand or
more with ``-m slow``.
"""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from peel_opt.app.cli.main import main
from peel_opt.base.errors import PeelOptError

PROBLEMS = Path(__file__).parents[1] / "problems"


def examples(few: int, many: int) -> pytest.MarkDecorator:
    """Run a test on ``few`` inputs by default and on ``many`` among the slow tests."""
    return pytest.mark.parametrize("count", [few, pytest.param(many, marks=pytest.mark.slow)])


def hammer(check: Callable[[Any], object], inputs: st.SearchStrategy[Any], count: int) -> None:
    """Call ``check`` with ``count`` inputs, the same ones every time."""
    wanted = settings(
        max_examples=count,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    wanted(given(inputs)(check))()


def typed(call: Callable[[], object]) -> Any:
    """Return what a call returns, or the typed error it raises, in one short line; let all else through."""
    try:
        return call()
    except PeelOptError as error:
        found = error
    text = str(found)
    assert text.strip(), type(found)
    assert "\n" not in text, text
    assert len(text) < 2000, text
    return found


def command(arguments: list[str]) -> tuple[int, str, str]:
    """Run the command line in this process and require a clean end."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    said = err.getvalue()
    assert code in (0, 1, 2), (code, said)
    assert "Traceback" not in said
    if code:
        # argparse shows how to call it first; every line of ours says who speaks.
        lines = said.splitlines()
        assert lines
        ours = [line for line in lines if line.startswith("peel-opt")]
        assert ours or lines[0].startswith("usage: peel-opt"), said
        if not lines[0].startswith("usage: peel-opt"):
            assert ours == lines, said
        assert all(len(line.split(": ", 1)[1]) > 5 for line in ours), said
    return code, out.getvalue(), said


#: Numbers that nobody means, and some that somebody might.
NUMBERS = st.sampled_from(
    [0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-300, 1e300, -1e300, 5e-324, 1e-12, 1e12, math.nan, math.inf]
) | st.floats(allow_nan=True, allow_infinity=True)

#: Values that are no numbers at all, or numbers in disguise.
WILD = st.one_of(
    NUMBERS,
    st.sampled_from([None, True, "", "1", "1.9 mm", "nan", b"1", 10**400, 1 + 2j, (), [], {}, object()]),
    st.sampled_from([np.float32(0.5), np.float64("nan"), np.int64(2), np.bool_(True), np.array(0.7)]),
    st.sampled_from([np.zeros(0), np.ones(2), np.array([1.0]), np.array([{}], dtype=object)]),
)

#: Texts as they stand in cards, tables and argument lists, and as they should not.
NUMERALS = st.sampled_from(
    [
        "0",
        "1",
        "-1",
        "0.5",
        "1e-300",
        "1e300",
        "1e400",
        "nan",
        "inf",
        "-inf",
        "1_000",
        "1,5",
        "٣",
        "0x1p3",
        "1e-12",
        "3.1",
        "0.8",
        "4",
        "--",
        "+-",
        ".",
        "1e",
        "1e99999999",
    ]
)
UNITS = st.sampled_from(
    [
        "",
        "m",
        "mm",
        "Pa",
        "kPa",
        "N m",
        "uN m",
        "J/m^2",
        "eta",
        "y0",
        "T0",
        "%",
        "degC",
        "dB",
        "m**9",
        "eV",
        "m^-9",
        "/0 m",
        "/25 mm",
        "m/m",
        "K",
        "delta_degC",
        "µm",
        "_",
        "m²",
        "N/ m",
        "pH",
    ]
)
QUANTITIES = st.builds("{0} {1}".format, NUMERALS, UNITS)
TEXTS = QUANTITIES | NUMERALS | UNITS | st.text(max_size=12)
