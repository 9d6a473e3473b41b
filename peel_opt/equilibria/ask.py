"""The questions: pressure given length, length given pressure, and the paper's dual problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ..base.checks import finite, known_beta0
from ..base.errors import InvalidInput, PeelOptError
from ..model.bond import CohesiveLaw
from ..model.labels import known_state
from ..model.rod import RATIOS, Rod, require_rod
from ..residual.closures import Closure
from ..residual.discretisation import Transcription
from .methods import Method, as_method
from .posed import Posed, known_lambda, known_law
from .question import Question, solve
from .result import Equilibrium


def pressure_given_length(
    rod: Rod,
    length: float,
    *,
    law: str | CohesiveLaw = "auto",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Pressure that holds a detached length in equilibrium.

    Parameters
    ----------
    rod : Rod
    length : float
        Detached length sbar [m].
    law : {"auto", "linear", "cohesive"} or CohesiveLaw
        "auto" is law (8): reported as "linear" where the whole shape stays within y0 and
        the two agree exactly.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Default: the unfolded state of lowest pressure.
    near : float or Equilibrium, optional
        Pick the state whose pressure [Pa] is nearest.
    method : str, Method or Transcription
        "series", "spectral", "collocation" or "shooting" (multiple shooting by IPOPT); "auto"
        takes the cheapest that meets ``tol``.  A configured object such as
        ``Shooting(intervals=24, integrator="rk4")`` is used as it is.
    tol : float
        Largest error of p/T0, and largest certificate, of a certified answer.
    throw : bool
        If False, a failure comes back as an `Equilibrium` whose ``status`` and ``message`` tell.

    Returns
    -------
    Equilibrium

    Raises
    ------
    InvalidInput
        If an argument cannot be meant.
    NoEquilibrium
        If no such state has this length; ``nearest`` is a length [m] that has one.
    AmbiguousState
        If several states fit and ``near`` is not given.
    OutOfRange, NotConverged, NotCertified
        If the answer is out of reach.

    Examples
    --------
    >>> rod = Rod.from_ratio(1.0)
    >>> round(pressure_given_length(rod, 3.2).pressure_ratio, 7)
    0.3687926
    """

    def ask() -> Equilibrium:
        sigma = require_rod(rod, RATIOS).length_ratio(length)
        question = Question(
            posed=Posed.at_length(rod, known_law(law), sigma),
            target=Closure("length", sigma),
            unit=rod.length,
            words=_words("length", rod.length(sigma), "m", "sbar/eta", sigma, rod),
            state=known_state(state),
            near=_near(near, lambda e: e.pressure_ratio, rod.pressure_ratio),
            symbol="" if rod.dimensionless else "m",
        )
        given = {"length": finite("length", length, question.symbol), "length_ratio": sigma}
        return replace(solve(question, as_method(method), tol), given=given)

    return _guarded(ask, rod, "pressure_ratio", tol, throw)


def length_given_pressure(
    rod: Rod,
    pressure: float,
    *,
    law: str | CohesiveLaw = "auto",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Detached length that a pressure holds in equilibrium.

    The length is free and closed by the Weierstrass-Erdmann condition theta'(sbar) = 0, (49).

    Parameters
    ----------
    rod : Rod
    pressure : float
        p [Pa], between the minimum pressure of the rod and T0.
    law, method, throw
        As in `pressure_given_length`.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Default: the unfolded state, which is unique.
    near : float or Equilibrium, optional
        Pick the state whose length [m] is nearest.
    tol : float
        Largest error of sbar/eta, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium

    Raises
    ------
    InvalidInput, NoEquilibrium, AmbiguousState, OutOfRange, NotConverged, NotCertified
        As in `pressure_given_length`; ``nearest`` is a pressure [Pa].

    Examples
    --------
    >>> round(length_given_pressure(Rod.from_ratio(1.0), 0.8).length_ratio, 9)
    3.036804006
    """

    def ask() -> Equilibrium:
        P = require_rod(rod, RATIOS).pressure_ratio(pressure)
        question = Question(
            posed=Posed.at_pressure(rod, known_law(law), P),
            target=Closure("pressure", P),
            unit=rod.pressure,
            words=_words("pressure", rod.pressure(P), "Pa", "p/T0", P, rod),
            state=known_state(state),
            near=_near(near, lambda e: e.length_ratio, rod.length_ratio),
            symbol="" if rod.dimensionless else "Pa",
        )
        given = {"pressure": finite("pressure", pressure, question.symbol), "pressure_ratio": P}
        return replace(solve(question, as_method(method), tol), given=given)

    return _guarded(ask, rod, "length_ratio", tol, throw)


def equilibrium(
    *,
    beta0: float,
    lam: float | None = None,
    beta1: float | None = None,
    law: str | CohesiveLaw = "linear",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Solve the paper's dual problem: alpha1 at given (beta0, lambda) or (beta0, beta1).

    Parameters
    ----------
    beta0 : float
        (sbar/eta)^3 >= 0; at 0 only the linear law has a meaning.
    lam, beta1 : float
        One of them; beta1 = pi^4 + lam > 0.  Near T give ``lam``: beta1 has lost its digits.
    law : {"linear", "cohesive", "auto"} or CohesiveLaw
    state : {"unfolded", "middle", "lower", "folded", "spurious"}, optional
        Labels are those of the rod r = beta1/beta0^(4/3); "spurious" is alpha1 > 0.
        Default: the unfolded state of lowest pressure.
    near : float or Equilibrium, optional
        Pick the state whose alpha1 is nearest.
    method, throw
        As in `pressure_given_length`.
    tol : float
        Largest error of alpha1, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium
        Without a rod: lengths in units of sbar, forces in k/sbar^2.

    Raises
    ------
    InvalidInput, NoEquilibrium, AmbiguousState, OutOfRange, NotConverged, NotCertified
        As in `pressure_given_length`; ``nearest`` is a value of lambda.

    Examples
    --------
    >>> round(equilibrium(beta0=4, lam=1.0).alpha1, 8)
    -4.43540699
    """

    def ask() -> Equilibrium:
        b0 = known_beta0(beta0)
        shift = known_lambda(lam, beta1)
        posed = Posed.at_groups(known_law(law), b0, shift)
        if b0 == 0.0 and not posed.effective_law.is_affine:
            raise InvalidInput(
                "beta0 = 0 has no strength, hence no cohesive law.", remedy="Use law='linear'."
            )
        question = Question(
            posed=posed,
            target=posed.given[b0 == 0.0],
            unit=float,
            words=f"beta0 = {b0:.6g}, lambda = {shift:.6g}",
            state=known_state(state),
            near=_near(near, lambda e: e.alpha1, partial(finite, "near")),
        )
        answered = solve(question, as_method(method), tol)
        given = {} if beta1 is None else {"beta1": finite("beta1", beta1)}
        return replace(answered, beta0=b0, lam=shift, given=given)

    return _guarded(ask, None, "alpha1", tol, throw)


def _words(name: str, value: float, unit: str, symbol: str, ratio: float, rod: Rod) -> str:
    """Name the given number, in the rod's units if it has any."""
    if rod.dimensionless:
        return f"{symbol} = {ratio:.6g}"
    return f"{name} {float(value):.6g} {unit} ({symbol} = {ratio:.6g})"


def _near(
    near: float | Equilibrium | None, read: Callable[[Equilibrium], float], scale: Callable[[float], float]
) -> float | None:
    if near is None:
        return None
    return read(near) if isinstance(near, Equilibrium) else scale(near)


def _guarded(
    ask: Callable[[], Equilibrium], rod: Rod | None, asked: str, tol: float, throw: bool
) -> Equilibrium:
    try:
        return ask()
    except PeelOptError as error:
        if throw:
            raise
        return Equilibrium.nothing(rod, asked, tol, error.status, str(error))
