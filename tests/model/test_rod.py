"""The rod: groups, lengths and pressures, in any units, and nothing that is not a number."""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from peel_opt.base.errors import InvalidInput, PeelOptError
from peel_opt.model.rod import Rod

FIELDS = ("bending_stiffness", "adhesion_strength", "adhesion_range")
GOOD = dict(zip(FIELDS, (2.3e-5, 140e3, 0.73e-3), strict=True))

#: From graphene to ship plates.
sizes = st.floats(min_value=1e-18, max_value=1e9)
rods = st.builds(Rod, sizes, sizes, sizes)
numbers = st.floats(min_value=1e-9, max_value=1e9)
seeded = settings(derandomize=True, database=None, max_examples=60, deadline=None)


def close(value: float) -> object:
    return pytest.approx(value, rel=1e-13)


class TestScales:
    def test_medical_flap(self) -> None:
        rod = Rod(**GOOD)
        assert rod.eta == close((2.3e-5 / 140e3) ** (1 / 3))
        assert rod.ratio == pytest.approx(0.7503, rel=1e-4)
        assert rod.work_of_separation == close(0.5 * 140e3 * 0.73e-3)

    @seeded
    @given(rods)
    def test_critical_length_is_20(self, rod: Rod) -> None:
        k, T0, y0 = (getattr(rod, name) for name in FIELDS)
        assert rod.critical_length == close(math.pi * (k * y0 / T0) ** 0.25)
        assert rod.critical_length == close(math.pi * (rod.eta**3 * y0) ** 0.25)

    @seeded
    @given(rods)
    def test_critical_length_has_beta1_of_the_first_mode(self, rod: Rod) -> None:
        _, beta1 = rod.groups(rod.critical_length)
        assert beta1 == close(math.pi**4)

    @seeded
    @given(rods)
    def test_eta_compares_stiffness_with_strength(self, rod: Rod) -> None:
        assert rod.eta**3 * rod.adhesion_strength == close(rod.bending_stiffness)

    @seeded
    @given(numbers)
    def test_from_ratio(self, ratio: float) -> None:
        rod = Rod.from_ratio(ratio)
        assert rod.ratio == close(ratio)
        assert (rod.eta, rod.adhesion_strength) == (1.0, 1.0)


class TestGroups:
    @seeded
    @given(rods, numbers)
    def test_are_those_of_11(self, rod: Rod, sigma: float) -> None:
        length = rod.length(sigma)
        beta0, beta1 = rod.groups(length)
        assert beta0 == close((length / rod.eta) ** 3)
        assert beta1 == close((length / rod.eta) ** 3 * length / rod.adhesion_range)

    @seeded
    @given(rods, numbers)
    def test_ratio_follows_from_them(self, rod: Rod, sigma: float) -> None:
        beta0, beta1 = rod.groups(rod.length(sigma))
        assert beta1 / beta0 ** (4 / 3) == pytest.approx(rod.ratio, rel=1e-12)

    @seeded
    @given(rods, numbers, st.floats(0.01, 100.0), st.floats(0.01, 100.0))
    def test_do_not_depend_on_units(self, rod: Rod, sigma: float, metre: float, newton: float) -> None:
        k, T0, y0 = (getattr(rod, name) for name in FIELDS)
        other = Rod(k * newton * metre, T0 * newton / metre**2, y0 * metre)
        length = rod.length(sigma)
        assert other.groups(length * metre) == pytest.approx(rod.groups(length), rel=1e-11)
        assert other.ratio == pytest.approx(rod.ratio, rel=1e-12)

    def test_fig_10(self) -> None:
        beta0, beta1 = Rod.from_ratio(0.566).groups(2.128 / 0.566)
        assert beta0 == pytest.approx(53.16, rel=1e-3)
        assert beta1 == pytest.approx(113.1, rel=1e-3)


class TestRoundTrips:
    @seeded
    @given(rods, numbers)
    def test_length(self, rod: Rod, sigma: float) -> None:
        assert rod.length_ratio(rod.length(sigma)) == close(sigma)

    @seeded
    @given(rods, st.floats(-10.0, 10.0))
    def test_pressure(self, rod: Rod, P: float) -> None:
        assert rod.pressure_ratio(rod.pressure(P)) == pytest.approx(P, rel=1e-13, abs=1e-300)

    @seeded
    @given(rods, st.floats(-1e3, 1e3), numbers)
    def test_force(self, rod: Rod, n_hat: float, sigma: float) -> None:
        length = rod.length(sigma)
        force = rod.force(n_hat, length)
        assert force * length**2 / rod.bending_stiffness == pytest.approx(n_hat, rel=1e-12, abs=1e-200)

    @seeded
    @given(rods)
    def test_equal_numbers_make_equal_rods(self, rod: Rod) -> None:
        twin = Rod(*(getattr(rod, name) for name in FIELDS))
        assert twin == rod
        assert hash(twin) == hash(rod)
        assert dataclasses.replace(rod, adhesion_range=2.0 * rod.adhesion_range).ratio == close(
            0.5 * rod.ratio
        )


class TestInput:
    @pytest.mark.parametrize("field", FIELDS)
    @pytest.mark.parametrize(
        "value",
        [0.0, -0.0, -1.0, math.nan, math.inf, -math.inf, True, "140", None, 1j, [1.0], np.array([1.0])],
    )
    def test_only_positive_numbers(self, field: str, value: object) -> None:
        with pytest.raises(InvalidInput, match=field) as caught:
            Rod(**(GOOD | {field: value}))
        assert isinstance(caught.value, ValueError)
        assert isinstance(caught.value, PeelOptError)
        assert caught.value.status == "invalid-input"

    def test_message_names_the_unit(self) -> None:
        with pytest.raises(InvalidInput, match=r"adhesion_strength \[Pa\] must be positive"):
            Rod(**(GOOD | {"adhesion_strength": -1.0}))

    def test_texts_have_their_units(self) -> None:
        assert Rod(**(GOOD | {"adhesion_strength": "140 kPa"})).adhesion_strength == 140e3
        with pytest.raises(InvalidInput, match="needs a unit"):
            Rod(**(GOOD | {"adhesion_strength": "140"}))

    @pytest.mark.parametrize("value", [2, np.float64(2.0), np.float32(2.0), np.int64(2), Fraction(2)])
    def test_any_real_number_becomes_a_float(self, value: object) -> None:
        rod = Rod(value, value, value)  # type: ignore[arg-type]
        assert {type(getattr(rod, name)) for name in FIELDS} == {float}
        assert rod == Rod(2.0, 2.0, 2.0)

    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, True, "0.5", None])
    def test_ratio(self, value: object) -> None:
        with pytest.raises(InvalidInput, match="ratio"):
            Rod.from_ratio(value)  # type: ignore[arg-type]

    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, True, "1 kPa", None])
    def test_length(self, value: object) -> None:
        rod = Rod(**GOOD)
        for question in (rod.length_ratio, rod.groups):
            with pytest.raises(InvalidInput, match=r"length (\[m\]|needs a unit|cannot be measured)"):
                question(value)  # type: ignore[operator]

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, True, "1 mm", None])
    def test_pressure(self, value: object) -> None:
        with pytest.raises(InvalidInput, match=r"pressure (\[Pa\]|needs a unit|cannot be measured)"):
            Rod(**GOOD).pressure_ratio(value)  # type: ignore[arg-type]

    def test_pressure_may_suck(self) -> None:
        assert Rod(**GOOD).pressure_ratio(-140e3) == close(-1.0)

    def test_is_frozen(self) -> None:
        with pytest.raises(dataclasses.FrozenInstanceError):
            Rod(**GOOD).adhesion_range = 1.0  # type: ignore[misc]

    def test_prints_what_it_is(self) -> None:
        text = repr(Rod(**GOOD))
        for part in ("2.3e-05 N m", "140000 Pa", "0.00073 m", "eta/y0=0.7503"):
            assert part in text
