"""What a cohesive law must be, looked at once when it is made.

A law is differentiated symbolically, integrated numerically and cut at its kinks.  One that is
not what it claims would show later, as an equilibrium that is not found or not accurate.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InvalidInput

if TYPE_CHECKING:
    from .bond import CohesiveLaw

#: Largest difference between two ways to the same number that is put down to rounding.
SAME = 1e-9

#: Intervals of a stretch in which a kink is looked for, and how often the one it is in is halved.
INTERVALS, HALVINGS = 192, 30

#: A jump of tau or of its slope counts as a kink from this share of the largest of them.
JUMP = 1e-6

#: How far beyond the last kink (or y0) a law is looked at.
FAR = 1000.0

#: Places named in a message.
NAMED = 6

REMEDY = (
    "Write it with arithmetic and CasADi functions: casadi.exp for math.exp; for a branch or a maximum"
    " one formula for each stretch with kinks=, or casadi.if_else, casadi.fmax and kinks= where they bend;"
    " for a table casadi.interpolant(..., 'bspline', ...)."
)


def reserved(name: str) -> bool:
    """Whether a name is that of a law of the package, or of a choice among them."""
    return name in ("auto", "linear", "cohesive", "exponential") or bool(
        re.fullmatch(r"trapezoidal\([^()]*\)", name)
    )


def check_law(law: CohesiveLaw) -> None:
    """Raise `InvalidInput`, with what helps, unless a law is what it must be."""
    if not isinstance(law.name, str) or reserved(law.name):
        raise InvalidInput(
            f"a law of your own cannot be called {law.name!r}.",
            remedy="Give it a name that no law of the package has: files know laws by it.",
        )
    _check_values(law)
    known = [_is_plain(piece.drop) for piece in law.pieces]
    for i, plain in enumerate(known):
        if not plain:
            _check_symbols(law, i)
    if not all(known):
        _check_smoothness(law)
    if law.work is not None and not all(known):
        _check_work(law)


def _is_plain(drop: Any) -> bool:
    """Whether a drop is one of the package's own shapes, or a blend of shapes looked at before."""
    return getattr(drop, "plain", False)


def _inside(law: CohesiveLaw, i: int, count: int = 7) -> np.ndarray:
    """Places inside a piece, its ends left out."""
    last = max(law.kinks, default=1.0)
    low, high = max(law.pieces[i].start, 0.0), law.pieces[i].stop
    return np.linspace(low, min(high, low + 2.0 * last), count + 2)[1:-1]


def _check_values(law: CohesiveLaw) -> None:
    """tau(0) = 1, and tau and drop add up to 1 everywhere."""
    probe = np.unique([*np.linspace(0.0, 2.0 * max(law.kinks, default=1.0), 9), *law.kinks])
    for u in (float(v) for v in probe):
        try:
            traction, drop = law.traction(u), float(law.pieces[law.piece_at(u)].drop(u))
        except (TypeError, ValueError, ArithmeticError, RuntimeError, NotImplementedError) as error:
            raise InvalidInput(
                f"law {law.name!r} cannot be evaluated at u = {u:g}: {error}.",
                remedy="tau takes one number or CasADi expression and returns one.",
            ) from error
        if u == 0.0 and abs(traction) < SAME:
            raise InvalidInput(
                f"tau(0) of law {law.name!r} must be 1, got {traction:g}: its bond gives way under any load.",
                remedy="A bond with an initial stiffness is another model, not another scaling of this one:"
                " here what has not let go carries its full strength.",
            )
        if u == 0.0 and not abs(traction - 1.0) < SAME:
            raise InvalidInput(
                f"tau(0) of law {law.name!r} must be 1, got {traction:g}.",
                remedy="Divide by the strength; the rod owns T0.",
            )
        if not abs(traction + drop - 1.0) < SAME:  # also where one is not finite
            raise InvalidInput(
                f"law {law.name!r} at u = {u:g}: tau = {traction:g} and drop = {drop:g}"
                " must be finite and add up to 1."
            )


def _check_symbols(law: CohesiveLaw, i: int) -> None:
    """The drop takes a symbol, and what it returns for it is what it returns for numbers."""
    import casadi as ca

    drop, u = law.pieces[i].drop, ca.SX.sym("u")
    try:
        expression = ca.SX(drop(u))
        if expression.shape != (1, 1):
            raise TypeError(f"it returns {expression.shape[0]} x {expression.shape[1]} expressions")
        compiled = ca.Function("drop", [u], [expression])
        places = _inside(law, i)
        values = [(float(compiled(v)), float(drop(v))) for v in places.tolist()]
    except Exception as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        reason = lines[0].split(": ")[-1].rstrip(".")  # without the place in CasADi's source
        raise InvalidInput(
            f"law {law.name!r} does not take a CasADi expression: {reason}.", remedy=REMEDY
        ) from error
    for v, (symbolic, number) in zip(places.tolist(), values, strict=True):
        if not abs(symbolic - number) <= SAME * (1.0 + abs(number)):
            raise InvalidInput(
                f"law {law.name!r} at u = {v:g} is {1.0 - number:g} for a number and {1.0 - symbolic:g} for a"
                " CasADi expression.",
                remedy=REMEDY,
            )
    if not math.isfinite(law.initial_slope):
        raise InvalidInput(
            f"tau of law {law.name!r} starts with a slope that is not finite.",
            remedy="Let it begin with a straight line up to a small u, and give that u in kinks=.",
        )


def _check_smoothness(law: CohesiveLaw) -> None:
    """Between its kinks a law has none, and at each of them both stretches go up to it."""
    found: list[float] = []
    for i, piece in enumerate(law.pieces):
        if not _is_plain(piece.drop):
            found += _hidden_kinks(law, i)
    if found:
        places = ", ".join(f"{u:.6g}" for u in found[:NAMED]) + ("" if len(found) <= NAMED else ", ...")
        raise InvalidInput(
            f"tau of law {law.name!r} is not smooth at u = {places}.",
            remedy=f"Name what bends or jumps: kinks=({places},), with one formula for each stretch between"
            " (one for all of them where nothing jumps).",
        )
    for i, piece in enumerate(law.pieces):
        for end, side in ((piece.start, 1.0), (piece.stop, -1.0)):
            if math.isfinite(end) and not _is_plain(piece.drop):
                _check_end(law, i, end, side)


def _values_and_slopes(drop: Callable[[Any], Any]) -> Callable[[np.ndarray], np.ndarray]:
    """Return the drop and its slope at many places at once, shape (2, n)."""
    import casadi as ca

    u = ca.SX.sym("u")
    value = ca.SX(drop(u))
    both = ca.Function("both", [u], [ca.densify(ca.vertcat(value, ca.jacobian(value, u)))])
    return lambda places: both(places[None]).full()


def _hidden_kinks(law: CohesiveLaw, i: int) -> Iterator[float]:
    """Yield where the drop of a piece, or its slope, jumps inside the piece.

    What is least straight in an interval is followed into the half that it is in; a jump is still
    there when the interval is too short for anything smooth.
    """
    piece, last = law.pieces[i], max(law.kinks, default=1.0)
    inset = 1e-9 * last
    low = max(piece.start, 0.0) + inset
    high = piece.stop - inset
    count = max(INTERVALS // len(law.pieces), 16)
    edges = np.linspace(low, high if math.isfinite(high) else low + 4.0 * last, count + 1)
    if not math.isfinite(high):
        edges = np.concatenate([edges, low + np.geomspace(4.0, FAR, 65)[1:] * last])
    read = _values_and_slopes(piece.drop)
    outer = read(edges)
    found: list[float] = []
    for row in (0, 1):
        a, b, fa, fb = edges[:-1], edges[1:], outer[row, :-1], outer[row, 1:]
        fm = read(0.5 * (a + b))[row]
        for _ in range(HALVINGS):
            middle = 0.5 * (a + b)
            low_quarter, high_quarter = (read(0.5 * (middle + end))[row] for end in (a, b))
            first = np.abs(fa - 2.0 * low_quarter + fm) >= np.abs(fm - 2.0 * high_quarter + fb)
            a, b = np.where(first, a, middle), np.where(first, middle, b)
            fa, fb = np.where(first, fa, fm), np.where(first, fm, fb)
            fm = np.where(first, low_quarter, high_quarter)
        scale = max(1.0, float(np.nanmax(np.abs(outer[row]))))
        found += b[~(np.abs(fb - fa) < JUMP * scale)].tolist()
    places = sorted(found)
    yield from (u for j, u in enumerate(places) if j == 0 or u - places[j - 1] > 1e-6 * last)


def _check_end(law: CohesiveLaw, i: int, end: float, side: float) -> None:
    """Raise where a piece does not go up to its end: another formula holds there already."""
    drop, step = law.pieces[i].drop, 1e-4 * max(end, 1e-3)
    near, next_, far = (float(drop(end + side * k * step)) for k in (1, 2, 3))
    at_end, limit = float(drop(end)), 3.0 * near - 3.0 * next_ + far
    if not abs(at_end - limit) < JUMP * (1.0 + abs(limit)):
        raise InvalidInput(
            f"tau of law {law.name!r} jumps at u = {end:g}, and one formula stands for both sides of it.",
            remedy="Give one formula for each stretch, that goes on smoothly beyond its end.",
        )


def _check_work(law: CohesiveLaw) -> None:
    """The work given is the integral of the traction."""
    for u in np.linspace(0.0, 2.0 * max(law.kinks, default=1.0), 6)[1:].tolist():
        try:
            given = law.separation_work(u)
        except Exception as error:
            raise InvalidInput(
                f"work of law {law.name!r} cannot be evaluated at u = {u:g}: {error}."
            ) from error
        integral = law.integrated_work(u)
        if not abs(given - integral) <= SAME * (1.0 + abs(integral)):
            raise InvalidInput(
                f"work of law {law.name!r} at u = {u:g} is {given:.9g}, tau integrates to {integral:.9g}.",
                remedy="work(u) is the integral of tau from 0 to u; leave it out and it is integrated.",
            )
