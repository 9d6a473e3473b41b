"""Laws: traction and work agree, tip heights answer the pressure asked, bad laws are refused.

Modules: `bond`, `named_laws`, `law_checks`, `law_samples`.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from peel_opt.base.errors import InvalidInput, NoEquilibrium
from peel_opt.model.bond import COHESIVE, LINEAR, CohesiveLaw
from peel_opt.model.equations import Scalars
from peel_opt.model.named_laws import exponential, trapezoidal

#: tau = (1 - u/2)^2 up to u = 2, then nothing: a curved law with a kink, given by its traction alone.
CURVED = CohesiveLaw((lambda u: (1.0 - 0.5 * u) ** 2, lambda u: 0.0 * u), kinks=(2.0,), name="curved")

LAWS = {
    law.name: law
    for law in (
        LINEAR,
        COHESIVE,
        CURVED,
        exponential(),
        trapezoidal(0.3),
        COHESIVE.blend(exponential(), 0.4),
        trapezoidal(0.3).blend(COHESIVE, 0.25),
    )
}
FALLING = CohesiveLaw((lambda u: 1.0 - u, lambda u: 0.0 * u), kinks=(1.0,), name="law (8) again")


def test_the_laws_of_the_paper_fall_straight_and_blends_with_them_do_not() -> None:
    assert [name for name, law in LAWS.items() if law.falls_straight] == ["linear", "cohesive"]
    assert [name for name, law in LAWS.items() if law.is_linear] == ["linear"]
    assert COHESIVE.blend(COHESIVE, 0.5).falls_straight
    assert [name for name, law in LAWS.items() if not law.softens] == []
    assert not CohesiveLaw(lambda u: 1.0 + 0.1 * u - 0.1 * u**2, name="rising").softens
    assert not FALLING.falls_straight  # what a formula of the user's does cannot be read off it


HEIGHTS = (0.0, 1e-6, 0.17, 0.3, 0.5, 0.9, 1.0, 1.1, 1.9, 2.0, 3.7)
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
bounded_law = pytest.mark.parametrize("law", [v for k, v in LAWS.items() if k != "linear"])


class TestTraction:
    @every_law
    def test_starts_at_the_strength(self, law: CohesiveLaw) -> None:
        assert law.traction(0.0) == pytest.approx(1.0, abs=1e-15)

    @every_law
    @pytest.mark.parametrize("u", HEIGHTS)
    def test_is_one_less_the_drop(self, law: CohesiveLaw, u: float) -> None:
        drop = float(law.pieces[law.piece_at(u)].drop(u))
        assert law.traction(u) == pytest.approx(1.0 - drop, abs=1e-14)

    @every_law
    def test_is_continuous_at_its_kinks(self, law: CohesiveLaw) -> None:
        for kink in law.kinks:
            assert law.traction(kink) == pytest.approx(law.traction(kink * (1 + 1e-12)), abs=1e-10)

    @bounded_law
    def test_never_pushes_and_never_grows(self, law: CohesiveLaw) -> None:
        tractions = [law.traction(u) for u in np.linspace(0.0, 4.0, 81)]
        assert min(tractions) >= -1e-15
        assert np.all(np.diff(tractions) <= 1e-15)

    def test_law_8(self) -> None:
        assert [COHESIVE.traction(u) for u in (0.25, 0.75, 1.0, 1.5)] == [0.75, 0.25, 0.0, 0.0]

    def test_linear_law_pushes_beyond_its_range(self) -> None:
        assert LINEAR.traction(1.5) == -0.5
        assert LINEAR.kinks == ()

    def test_trapezoid_holds_its_strength_up_to_the_plateau(self) -> None:
        law = trapezoidal(0.3)
        assert [law.traction(u) for u in (0.1, 0.3, 1.0, 2.0)] == pytest.approx(
            [1.0, 1.0, 0.0, 0.0], abs=1e-15
        )
        assert law.traction(0.65) == pytest.approx(0.5)

    def test_exponential_keeps_the_digits_of_a_small_drop(self) -> None:
        (piece,) = exponential().pieces
        assert float(piece.drop(1e-12)) == pytest.approx(1e-12 - 5e-25, rel=1e-15)


class TestPieces:
    @every_law
    def test_cover_every_separation_once(self, law: CohesiveLaw) -> None:
        assert [p.start for p in law.pieces] == [-math.inf, *law.kinks]
        assert [p.stop for p in law.pieces] == [*law.kinks, math.inf]

    @every_law
    def test_hold_their_separations(self, law: CohesiveLaw) -> None:
        for u in HEIGHTS:
            piece = law.pieces[law.piece_at(u)]
            assert piece.start <= u <= piece.stop

    def test_a_kink_belongs_below(self) -> None:
        assert [COHESIVE.piece_at(u) for u in (0.5, 1.0, 1.0 + 1e-12)] == [0, 0, 1]

    @every_law
    @pytest.mark.parametrize("u", [0.2, 0.7, 1.3])
    def test_pull_is_the_lost_traction_over_the_amplitude(self, law: CohesiveLaw, u: float) -> None:
        scalars = Scalars(A=0.3, m=-2.0, sigma=1.7, lam=3.0)
        Y = u / float(scalars.height(1.0))
        pull = float(law.pieces[law.piece_at(u)].pull(Y, scalars))
        assert scalars.A * pull == pytest.approx(scalars.beta0 * (1.0 - law.traction(u)), abs=1e-12)

    @every_law
    def test_accept_symbols(self, law: CohesiveLaw) -> None:
        u = ca.SX.sym("u")
        for piece in law.pieces:
            inside = min(max(piece.start, 0.0) + 0.1, piece.stop)
            drop = ca.Function("drop", [u], [piece.drop(u)])
            assert float(drop(inside)) == pytest.approx(1.0 - law.traction(inside), abs=1e-14)

    @every_law
    def test_go_on_smoothly_a_little_beyond_their_ends(self, law: CohesiveLaw) -> None:
        for piece in law.pieces:
            for end in (piece.start, piece.stop):
                if math.isfinite(end):
                    assert float(piece.drop(end - 1e-6)) == pytest.approx(
                        float(piece.drop(end + 1e-6)), abs=1e-5
                    )


class TestWork:
    @every_law
    @pytest.mark.parametrize("u", HEIGHTS)
    def test_is_the_integral_of_the_traction(self, law: CohesiveLaw, u: float) -> None:
        inner = [k for k in law.kinks if k < u] or None
        integral = quad(law.traction, 0.0, u, points=inner, epsabs=1e-13, epsrel=1e-12)[0]
        assert law.separation_work(u) == pytest.approx(integral, abs=1e-12)

    @pytest.mark.parametrize(
        ("law", "total"),
        [(COHESIVE, 0.5), (trapezoidal(0.3), 0.65), (exponential(), 1.0), (CURVED, 2.0 / 3.0)],
    )
    def test_full_separation(self, law: CohesiveLaw, total: float) -> None:
        assert law.separation_work(50.0) == pytest.approx(total, rel=1e-12)

    @every_law
    def test_mean_traction_is_work_over_height(self, law: CohesiveLaw) -> None:
        assert law.mean_traction(0.0) == 1.0
        for u in HEIGHTS[1:]:
            assert law.mean_traction(u) * u == pytest.approx(law.separation_work(u), rel=1e-14)


class TestTipHeight:
    @every_law
    @pytest.mark.parametrize("P", [0.999, 0.9, 0.61, 0.5, 0.3, 0.02])
    def test_inverts_the_mean_traction(self, law: CohesiveLaw, P: float) -> None:
        u = law.tip_height(P)
        assert u > 0.0
        assert law.mean_traction(u) == pytest.approx(P, rel=1e-12)

    @bounded_law
    def test_returns_the_height_it_came_from(self, law: CohesiveLaw) -> None:
        for u in (0.4, 0.8, 1.0, 2.5, 40.0):
            assert law.tip_height(law.mean_traction(u)) == pytest.approx(u, rel=1e-11)

    @pytest.mark.parametrize("P", [0.99, 0.75, 0.5])
    def test_inside_the_range_is_twice_the_missing_pressure(self, P: float) -> None:
        assert COHESIVE.tip_height(P) == pytest.approx(2.0 * (1.0 - P), rel=1e-12)
        assert LINEAR.tip_height(P) == pytest.approx(2.0 * (1.0 - P), rel=1e-12)

    @pytest.mark.parametrize("P", [0.5, 0.1, 1e-6])
    def test_beyond_the_range_the_work_is_spent(self, P: float) -> None:
        assert P * COHESIVE.tip_height(P) == pytest.approx(0.5, rel=1e-12)

    def test_linear_law_goes_on_below_zero_pressure(self) -> None:
        assert LINEAR.tip_height(-1.0) == pytest.approx(4.0, rel=1e-12)

    @every_law
    @pytest.mark.parametrize("P", [1.0, 1.5])
    def test_no_height_from_the_strength_up(self, law: CohesiveLaw, P: float) -> None:
        with pytest.raises(NoEquilibrium, match="tip height"):
            law.tip_height(P)

    @bounded_law
    @pytest.mark.parametrize("P", [0.0, -0.2])
    def test_no_height_without_pressure(self, law: CohesiveLaw, P: float) -> None:
        with pytest.raises(NoEquilibrium, match=law.name.split("(")[0]):
            law.tip_height(P)


class TestInitialSlope:
    @pytest.mark.parametrize(
        ("law", "slope"),
        [
            (LINEAR, 1.0),
            (COHESIVE, 1.0),
            (exponential(), 1.0),
            (CURVED, 1.0),
            (trapezoidal(0.3), 0.0),
            (trapezoidal(0.3).blend(COHESIVE, 0.25), 0.25),
            (CohesiveLaw(lambda u: ca.exp(-3.0 * u)), 3.0),
        ],
    )
    def test_values(self, law: CohesiveLaw, slope: float) -> None:
        assert law.initial_slope == pytest.approx(slope, abs=1e-14)

    @every_law
    def test_is_the_slope_of_the_traction(self, law: CohesiveLaw) -> None:
        h = 1e-4
        backward = (3 * law.traction(0.0) - 4 * law.traction(h) + law.traction(2 * h)) / (2 * h)
        assert law.initial_slope == pytest.approx(backward, abs=1e-6)


class TestBlend:
    @pytest.mark.parametrize("h", [0.0, 0.25, 1.0])
    def test_is_the_mean_of_the_two(self, h: float) -> None:
        first, second = trapezoidal(0.3), exponential()
        law = first.blend(second, h)
        for u in HEIGHTS:
            expected = (1 - h) * first.traction(u) + h * second.traction(u)
            assert law.traction(u) == pytest.approx(expected, abs=1e-14)
            work = (1 - h) * first.separation_work(u) + h * second.separation_work(u)
            assert law.separation_work(u) == pytest.approx(work, abs=1e-12)

    def test_has_the_kinks_of_both(self) -> None:
        assert trapezoidal(0.3).blend(trapezoidal(0.6), 0.5).kinks == (0.3, 0.6, 1.0)
        assert COHESIVE.blend(LINEAR, 0.5).kinks == (1.0,)

    def test_blends_again(self) -> None:
        law = COHESIVE.blend(LINEAR, 0.5).blend(exponential(), 0.5)
        assert law.traction(1.4) == pytest.approx(0.5 * (0.5 * -0.4) + 0.5 * math.exp(-1.4), abs=1e-14)


class TestOwnLaws:
    def test_one_callable_serves_all_pieces(self) -> None:
        law = CohesiveLaw(lambda u: 1.0 - ca.fmin(u, 1.0), kinks=(1.0,))
        assert [law.traction(u) for u in (0.4, 1.0, 3.0)] == pytest.approx([0.6, 0.0, 0.0])
        assert law.separation_work(3.0) == pytest.approx(0.5, rel=1e-12)

    def test_work_given_is_work_used(self) -> None:
        law = CohesiveLaw(lambda u: 1.0 - u, work=lambda u: u - 0.5 * u * u)
        assert law.separation_work(0.5) == 0.375

    def test_laws_are_frozen(self) -> None:
        with pytest.raises(AttributeError):
            LINEAR.name = "other"  # type: ignore[misc]

    @pytest.mark.parametrize(
        "law", [LINEAR, COHESIVE, trapezoidal(0.3), trapezoidal(0.3).blend(COHESIVE, 0.5)]
    )
    def test_laws_of_the_package_travel_between_processes(self, law: CohesiveLaw) -> None:
        copy = pickle.loads(pickle.dumps(law))
        assert copy == law
        assert copy.traction(0.4) == law.traction(0.4)

    @pytest.mark.parametrize("scale", [0.0, 0.999, 2.0, math.nan, math.inf])
    def test_must_start_at_one(self, scale: float) -> None:
        with pytest.raises(InvalidInput, match=r"tau\(0\)"):
            CohesiveLaw(lambda u: scale - u)

    @pytest.mark.parametrize("kinks", [(0.0,), (-1.0,), (1.0, 0.5), (1.0, 1.0), (math.nan,), (math.inf,)])
    def test_kinks_must_increase(self, kinks: tuple[float, ...]) -> None:
        with pytest.raises(InvalidInput, match="kinks"):
            CohesiveLaw(lambda u: 1.0 - u, kinks=kinks)

    @pytest.mark.parametrize("count", [1, 3])
    def test_one_callable_for_each_piece(self, count: int) -> None:
        with pytest.raises(InvalidInput, match="needs one callable or 2"):
            CohesiveLaw([lambda u: 1.0 - u] * count, kinks=(1.0,))

    def test_pieces_must_be_callable(self) -> None:
        with pytest.raises(InvalidInput, match="tau"):
            CohesiveLaw((lambda u: 1.0 - u, 0.0), kinks=(1.0,))  # type: ignore[arg-type]

    def test_drop_must_match_the_traction(self) -> None:
        with pytest.raises(InvalidInput, match="add up to 1"):
            CohesiveLaw(lambda u: 1.0 - u, drop=lambda u: 0.5 * u)

    def test_traction_must_be_finite(self) -> None:
        with pytest.raises(InvalidInput, match="finite"):
            CohesiveLaw(lambda u: 1.0 - ca.log1p(-u) if u < 1 else math.nan)

    def test_work_must_belong_to_the_traction(self) -> None:
        with pytest.raises(
            InvalidInput, match=r"work of law 'custom' at u = 0\.4 is 0\.4, tau integrates to 0\.2857"
        ):
            CohesiveLaw(lambda u: 1 / (1 + u) ** 2, work=lambda u: u)

    def test_a_bond_that_stiffens_first_is_another_model(self) -> None:
        with pytest.raises(InvalidInput, match="initial stiffness"):
            CohesiveLaw(lambda u: u * ca.exp(1 - u))

    @pytest.mark.parametrize(
        "tau",
        [
            lambda u: 1 - u if u < 1 else 0 * u,
            lambda u: max(1 - u, 0),
            lambda u: math.exp(-u),
            lambda u: 1 - float(u),
            CubicSpline(np.linspace(0, 9, 40), np.exp(-np.linspace(0, 9, 40))),
            lambda u: (
                1.0 if isinstance(u, float) and u == 0.0 else ca.exp(-u) if isinstance(u, float) else 0.5
            ),
        ],
        ids=["if", "max", "math", "float", "spline", "constant"],
    )
    def test_what_casadi_cannot_take_is_refused_at_once(self, tau: Callable[[Any], Any]) -> None:
        with pytest.raises(InvalidInput, match="CasADi expression") as refused:
            CohesiveLaw(tau)
        for remedy in ("casadi.if_else", "casadi.fmax", "kinks=", "casadi.interpolant"):
            assert remedy in str(refused.value)

    @pytest.mark.parametrize("tau", [lambda u: 1 - ca.sqrt(u), lambda u: 1 - u**0.7 * ca.exp(-u)])
    def test_an_infinite_slope_at_the_start_is_named(self, tau: Callable[[Any], Any]) -> None:
        with pytest.raises(InvalidInput, match="slope that is not finite"):
            CohesiveLaw(tau)

    @pytest.mark.parametrize(
        ("tau", "place"),
        [
            (lambda u: ca.fmax(1 - u, 0), "1"),
            (lambda u: ca.if_else(u < 1, 1, 0), "1"),
            (lambda u: ca.exp(-u) - 0.01 * ca.fmax(u - 0.7, 0), "0.7"),
            (lambda u: ca.exp(-u / 50) - ca.if_else(u > 123.4, 0.05, 0), "123.4"),
            (ca.interpolant("table", "linear", [[0.0, 0.5, 2.0, 9.0]], [1.0, 0.4, 0.1, 0.0]), "0.5, 2"),
        ],
    )
    def test_kinks_that_are_not_named_are_found(self, tau: Callable[[Any], Any], place: str) -> None:
        with pytest.raises(InvalidInput, match=rf"not smooth at u = {place}\..*kinks=\({place},\)"):
            CohesiveLaw(tau)

    @pytest.mark.parametrize(
        "tau",
        [
            lambda u: 0.5 * (1 - ca.tanh((u - 1) / 0.01)) / (0.5 * (1 + math.tanh(100.0))),
            lambda u: 1 - u**1.5 * ca.exp(-u),
            lambda u: ca.exp(-20 * u) * ca.cos(3 * u),
        ],
        ids=["steep", "power", "fast"],
    )
    def test_what_is_steep_but_smooth_has_no_kink(self, tau: Callable[[Any], Any]) -> None:
        assert CohesiveLaw(tau).kinks == ()

    def test_one_formula_cannot_stand_for_both_sides_of_a_jump(self) -> None:
        with pytest.raises(InvalidInput, match="jumps at u = 1, and one formula"):
            CohesiveLaw(lambda u: ca.if_else(u <= 1, 1 - 0.1 * u, 0), kinks=(1.0,))

    def test_nothing_is_printed_where_a_quadrature_has_a_hard_time(self) -> None:
        law = CohesiveLaw([lambda u: 1 - 0.1 * u, lambda u: 0.0 * u], kinks=(1.0,))
        assert law.separation_work(3.0) == pytest.approx(0.95, rel=1e-12)
        assert law.tip_height(0.6) == pytest.approx(0.95 / 0.6, rel=1e-12)

    @pytest.mark.parametrize("plateau", [0.0, -0.1, 1.0, 1.5, math.nan, math.inf, True, "0.3", None])
    def test_plateau_lies_inside_the_range(self, plateau: object) -> None:
        with pytest.raises(InvalidInput, match="plateau"):
            trapezoidal(plateau)  # type: ignore[arg-type]
