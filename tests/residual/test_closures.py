"""Closures: what each gives, in words and as an equation."""

from __future__ import annotations

from peel_opt.residual.closures import EQUATIONS, SYMBOLS, Closure


def test_a_closure_says_what_it_gives_as_its_equation_writes_it() -> None:
    assert set(SYMBOLS) == set(EQUATIONS) - {"plane"}
    assert str(Closure("pressure", 0.5)) == "p/T0 = 0.5"
    assert str(Closure("length", 3.1456)) == "sbar/eta = 3.1456"
