"""An independent oracle: shooting from the free tip, sharing no code with the package.

The rod is integrated in physical form, lengths in eta, tractions in T0 (k = 1),

    theta'' + Nx sin(theta) - Ny cos(theta) = 0,   Nx' = -P sin(theta),
    Ny' = P cos(theta) - tau(r y),                 y' = sin(theta),

from the tip s = 0, where theta' = Nx = Ny = 0, to the plate s = sigma, where theta = theta' = y = 0.
Two of (theta_tip, y_tip, P, sigma, r) are given; the other three follow by Newton's method from these
three conditions alone.  The first integral P u_tip = Phi(u_tip) is not used anywhere: it stays a check.

Where the traction has a kink the integration stops exactly at it and starts afresh.  The integrator is
DOP853 on the equations and their sensitivities; `refine` repeats a solution to 30 digits and more with a
Taylor series integrator in mpmath.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from scipy.integrate import DOP853, quad
from scipy.optimize import brentq

RTOL, ATOL = 1e-13, 1e-15
THETA_TIP, Y_TIP, LOAD, LENGTH, RATE = range(5)
GIVEN_PRESSURE = (THETA_TIP, Y_TIP, LENGTH)
GIVEN_LENGTH = (THETA_TIP, Y_TIP, LOAD)
GIVEN_TIP = (Y_TIP, LOAD, LENGTH)


@dataclass(frozen=True)
class Line:
    """A straight piece of a traction law."""

    offset: float
    slope: float

    def __call__(self, u: Any) -> Any:
        return self.offset + self.slope * u


@dataclass(frozen=True)
class Law:
    """Traction tau(u) over T0, one callable per stretch between kinks; callables take complex u."""

    pieces: tuple[Callable[[Any], Any], ...]
    kinks: tuple[float, ...] = ()

    def index(self, u: float) -> int:
        return int(np.searchsorted(self.kinks, u, side="left"))

    def work(self, u: float) -> float:
        """Phi(u), the integral of tau from 0 to u."""
        edges = [0.0, *(k for k in self.kinks if k < u), u]
        parts = zip(edges[:-1], edges[1:], self.pieces, strict=False)
        return math.fsum(quad(tau, a, b, epsabs=1e-15, epsrel=1e-13)[0] for a, b, tau in parts)


LINEAR = Law((Line(1.0, -1.0),))
COHESIVE = Law((Line(1.0, -1.0), Line(0.0, 0.0)), (1.0,))


def as_law(law: str | Law | Callable[[Any], Any]) -> Law:
    if isinstance(law, Law):
        return law
    if callable(law):
        return Law((law,))
    return {"linear": LINEAR, "cohesive": COHESIVE}[law]


@dataclass(frozen=True)
class TipSolution:
    """An equilibrium: the five numbers, how well it meets the plate, and the integrator's nodes.

    ``residual`` is the largest of |theta|, |theta'|, |y| at the plate, ``identity`` the defect of
    P u_tip = Phi(u_tip), ``tangent`` the derivative of the five numbers along the rod's branch with
    respect to the tip angle, ``nodes`` the columns s, theta, theta', Nx, Ny, y.
    """

    law: Law
    numbers: tuple[float, ...]
    residual: float
    tangent: np.ndarray
    nodes: np.ndarray

    @property
    def theta_tip(self) -> float:
        return self.numbers[THETA_TIP]

    @property
    def y_tip(self) -> float:
        return self.numbers[Y_TIP]

    @property
    def P(self) -> float:
        return self.numbers[LOAD]

    @property
    def sigma(self) -> float:
        return self.numbers[LENGTH]

    @property
    def r(self) -> float:
        return self.numbers[RATE]

    @property
    def u_tip(self) -> float:
        return self.r * self.y_tip

    @property
    def beta0(self) -> float:
        return self.sigma**3

    @property
    def beta1(self) -> float:
        return self.r * self.sigma**4

    @property
    def lam(self) -> float:
        return self.beta1 - math.pi**4

    @property
    def alpha(self) -> float:
        return self.P * self.beta0

    @property
    def alpha1(self) -> float:
        return (self.P - 1.0) * self.beta0

    @property
    def identity(self) -> float:
        return self.P * self.u_tip - self.law.work(self.u_tip)

    def column(self, name: str) -> np.ndarray:
        return self.nodes[:, ("s", "theta", "curvature", "Nx", "Ny", "y").index(name)]


# ----------------------------------------------------------------------------- integration from the tip


def _system(tau: Callable[[Any], Any], load: float, rate: float) -> Callable[[float, np.ndarray], np.ndarray]:
    """Equations and their sensitivities to (theta_tip, y_tip, load, rate), columns of a 5 x 5 array."""
    step = 1e-30

    def system(_s: float, flat: np.ndarray) -> np.ndarray:
        field = flat.reshape(5, 5)
        theta, curvature, nx, ny, y = field[:, 0].tolist()
        sine, cosine = math.sin(theta), math.cos(theta)
        if isinstance(tau, Line):
            traction, slope = tau(rate * y), tau.slope
        else:
            probe = tau(complex(rate * y, step))
            traction, slope = probe.real, probe.imag / step
        out = np.empty((5, 5))
        d = field[:, 1:]
        out[:, 0] = curvature, ny * cosine - nx * sine, -load * sine, load * cosine - traction, sine
        out[0, 1:] = d[1]
        out[1, 1:] = cosine * d[3] - sine * d[2] - (ny * sine + nx * cosine) * d[0]
        out[2, 1:] = -load * cosine * d[0]
        out[3, 1:] = -load * sine * d[0] - slope * rate * d[4]
        out[4, 1:] = cosine * d[0]
        out[2, 3] -= sine
        out[3, 3] += cosine
        out[3, 4] -= slope * y
        return out.ravel()

    return system


def shoot(
    law: Law, numbers: Sequence[float], rtol: float = RTOL
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate from the tip over the given length.

    Returns the end state (theta, theta', Nx, Ny, y), its 5 x 5 Jacobian with respect to the five numbers
    and the nodes.
    """
    theta_tip, y_tip, load, length, rate = (float(n) for n in numbers)
    field = np.zeros((5, 5))
    field[0, :2] = theta_tip, 1.0
    field[4, 0], field[4, 2] = y_tip, 1.0
    index = law.index(rate * (y_tip + 1e-13 * math.sin(theta_tip)))  # on a kink: where the rod goes
    s, nodes = 0.0, [[0.0, *field[:, 0]]]
    flat = field.ravel()
    while s < length:
        system = _system(law.pieces[index], load, rate)
        solver = DOP853(system, s, flat, length, rtol=rtol, atol=min(ATOL, 1e-2 * rtol))
        while solver.status == "running":
            before, state = solver.t, solver.y
            message = solver.step()
            if solver.status == "failed":
                raise ArithmeticError(message)
            after = law.index(rate * solver.y[20])
            if after != index and (before > s or s == 0.0):  # else the step has just left the kink
                kink = law.kinks[min(after, index)]
                s, flat = _stop_at(system, before, state, solver.t, height=kink / rate, rtol=rtol)
                index += 1 if after > index else -1
                nodes.append([s, *flat.reshape(5, 5)[:, 0]])
                break
            nodes.append([solver.t, *solver.y.reshape(5, 5)[:, 0]])
        else:
            s, flat = length, solver.y
    end = flat.reshape(5, 5)
    slope = _system(law.pieces[index], load, rate)(s, flat).reshape(5, 5)[:, 0]
    jacobian = np.column_stack([end[:, 1], end[:, 2], end[:, 3], slope, end[:, 4]])
    return end[:, 0], jacobian, np.array(nodes)


def _stop_at(
    system: Callable[[float, np.ndarray], np.ndarray],
    start: float,
    state: np.ndarray,
    stop: float,
    *,
    height: float,
    rtol: float,
) -> tuple[float, np.ndarray]:
    """Integrate from ``start`` to the s in (start, stop) where y = ``height``."""

    def advance(s: float) -> np.ndarray:
        solver = DOP853(system, start, state, s, rtol=rtol, atol=min(ATOL, 1e-2 * rtol))
        while solver.status == "running":
            solver.step()
        return solver.y

    where = brentq(lambda s: (advance(s)[20] if s > start else state[20]) - height, start, stop, xtol=1e-7)
    for _ in range(4):
        reached = advance(where)
        correction = (height - reached[20]) / math.sin(reached[0])
        where += correction
        if abs(correction) < 1e-15:
            break
    return where, advance(where)


# ----------------------------------------------------------------------------------------- equilibria

_PLATE = (0, 1, 4)  # theta, theta', y vanish there


def solve(law: Law, numbers: Sequence[float], free: tuple[int, ...], rtol: float = RTOL) -> TipSolution:
    """Newton's method in the ``free`` numbers for the three conditions at the plate."""
    values, rows, columns = np.array(numbers, dtype=float), list(_PLATE), list(free)
    last = math.inf
    for _ in range(40):
        end, jacobian, nodes = shoot(law, values, rtol)
        step = np.linalg.solve(jacobian[np.ix_(_PLATE, free)], -end[rows])
        size = float(np.abs(step / values[columns]).max())
        if not size < min(10.0, 5.0 * last):
            break
        if size < 1e-2 * rtol or (size < 1e3 * rtol and size > 0.3 * last):
            break  # as far as rounding lets it
        values[columns] += min(1.0, 0.15 / size) * step
        last = size
    if not size < 1e5 * rtol:
        raise ArithmeticError(f"Newton's method does not converge from {tuple(numbers)}")
    tangent = np.zeros(5)
    tangent[THETA_TIP] = 1.0
    tangent[list(GIVEN_TIP)] = np.linalg.solve(
        jacobian[np.ix_(_PLATE, GIVEN_TIP)], -jacobian[rows, THETA_TIP]
    )
    return TipSolution(law, tuple(values.tolist()), float(np.abs(end[rows]).max()), tangent, nodes)


def near_transition(r: float, drop: float) -> tuple[float, ...]:
    """First-order state near T at P = 1 - drop, from the kernel (22) of amplitude alpha1."""
    sigma = math.pi * r**-0.25
    theta_tip = -drop * sigma**3 / (math.pi**3 * math.tanh(math.pi / 2))
    return theta_tip, 2.0 * drop / r, 1.0 - drop, sigma, r


def march(
    r: float,
    law: str | Law | Callable[[Any], Any] = "cohesive",
    drop: float | None = None,
    rtol: float = 1e-9,
) -> Iterable[TipSolution]:
    """Yield states along the primary branch of a rod from P = 1 - drop on, the tip angle falling."""
    law = as_law(law)
    drop = min(2e-3, 0.05 * r) if drop is None else drop
    state = solve(law, near_transition(r, drop), GIVEN_PRESSURE, rtol)
    step = -state.theta_tip
    yield state
    previous = None
    while state.theta_tip > -4.2:
        if previous is None:
            guess = np.array(state.numbers) - step * state.tangent
        else:
            guess = _cubic(previous, state, 1.0 + step / (previous.theta_tip - state.theta_tip))
        guess[[THETA_TIP, RATE]] = state.theta_tip - step, r
        try:
            new = solve(law, guess, GIVEN_TIP, rtol)
        except (ArithmeticError, np.linalg.LinAlgError):
            step *= 0.5
            if step < 1e-4:
                raise
            continue
        previous, state = state, new
        step = min(1.5 * step, 0.1)
        yield state


def _cubic(a: TipSolution, b: TipSolution, t: float) -> np.ndarray:
    """Cubic in the tip angle through two states and their tangents, ``a`` at t = 0, ``b`` at t = 1."""
    h = b.theta_tip - a.theta_tip
    low = (1 + 2 * t) * np.array(a.numbers) + t * h * a.tangent
    high = (3 - 2 * t) * np.array(b.numbers) + (t - 1) * h * b.tangent
    return (1 - t) ** 2 * low + t**2 * high


def _between(a: TipSolution, b: TipSolution, which: int, value: float) -> np.ndarray:
    """Guess for the state where the number ``which`` has a given value."""

    def excess(t: float) -> float:
        return float(_cubic(a, b, t)[which]) - value

    t = brentq(excess, 0.0, 1.0) if excess(0.0) * excess(1.0) <= 0.0 else 0.5
    guess = _cubic(a, b, t)
    guess[[which, RATE]] = value, a.r
    return guess


def walk(
    r: float, pressures: Iterable[float], law: str | Law | Callable[[Any], Any] = "cohesive"
) -> dict[float, TipSolution]:
    """Solve for the unfolded states at the given P, following the branch down from T."""
    law = as_law(law)
    todo = sorted(set(pressures), reverse=True)
    found: dict[float, TipSolution] = {}
    previous = None
    for state in march(r, law):
        while todo and todo[0] >= state.P:
            P = todo.pop(0)
            if previous is None:
                guess = np.array(near_transition(r, 1.0 - P))
            else:
                guess = _between(previous, state, LOAD, P)
            guess[LOAD] = P
            found[P] = solve(law, guess, GIVEN_PRESSURE)
        if not todo:
            return found
        if previous is not None and state.P > previous.P:
            break
        previous = state
    # what is left lies within one step of the minimum pressure
    least = pressure_minimum(r, law)
    for P in todo:
        if least.P > P:
            raise ValueError(f"P = {P} is below the minimum {least.P} of r = {r}")
        guess, bend = np.array(least.numbers), _second_derivative(least)
        back = math.sqrt(2.0 * (P - least.P) / bend[LOAD])
        guess += back * least.tangent + 0.5 * back**2 * bend
        guess[LOAD] = P
        found[P] = solve(law, guess, GIVEN_PRESSURE)
    return found


def _second_derivative(state: TipSolution, h: float = 1e-3) -> np.ndarray:
    tangents = []
    for sign in (1.0, -1.0):
        guess = np.array(state.numbers) + sign * h * state.tangent
        tangents.append(solve(state.law, guess, GIVEN_TIP).tangent)
    return (tangents[0] - tangents[1]) / (2.0 * h)


def fold(
    r: float, which: int, law: str | Law | Callable[[Any], Any] = "cohesive", number: int = 0
) -> TipSolution:
    """Locate the ``number``-th state from T where P (``LOAD``) or sigma (``LENGTH``) turns."""
    law = as_law(law)
    previous = None
    for state in march(r, law):
        if previous is not None and previous.tangent[which] * state.tangent[which] < 0.0:
            if number == 0:
                return _turn(previous, state, which)
            number -= 1
        previous = state
    raise ValueError(f"no such fold on the branch of r = {r}")


def _turn(a: TipSolution, b: TipSolution, which: int) -> TipSolution:
    def rate_of_change(theta_tip: float) -> float:
        guess = _between(a, b, THETA_TIP, theta_tip)
        return float(solve(a.law, guess, GIVEN_TIP).tangent[which])

    theta_tip = brentq(rate_of_change, b.theta_tip, a.theta_tip, xtol=1e-13)
    return solve(a.law, _between(a, b, THETA_TIP, theta_tip), GIVEN_TIP)


def pressure_minimum(r: float, law: str | Law | Callable[[Any], Any] = "cohesive") -> TipSolution:
    """Locate the fold in pressure, the least P that holds the rod up."""
    return fold(r, LOAD, law)


def length_fold(r: float, law: str | Law | Callable[[Any], Any] = "cohesive", number: int = 0) -> TipSolution:
    """Locate a fold in length; ``number`` counts from T."""
    return fold(r, LENGTH, law, number)


def solve_tip(
    r: float,
    P: float,
    law: str | Law | Callable[[Any], Any] = "cohesive",
    guess: tuple[float, float, float] | None = None,
) -> TipSolution:
    """Solve for the unfolded state at P, or the state near ``guess`` = (theta_tip, u_tip, sigma)."""
    if guess is None:
        return walk(r, [P], law)[P]
    theta_tip, u_tip, sigma = guess
    return solve(as_law(law), (theta_tip, u_tip / r, P, sigma, r), GIVEN_PRESSURE)


# -------------------------------------------------------------------- the paper's groups, linear law (12)


@dataclass(frozen=True)
class GroupSolution:
    """An equilibrium of (12), (14): lengths in sbar, loads in k/sbar^3."""

    beta0: float
    lam: float
    alpha1: float
    theta_tip: float
    y_tip: float
    residual: float
    tangent_lam: float
    nodes: np.ndarray

    @property
    def identity(self) -> float:
        """Defect of alpha1 = -beta1 y_tip / 2."""
        return self.alpha1 + 0.5 * (self.lam + math.pi**4) * self.y_tip


def given_groups(
    beta0: float, lam: float, guess: tuple[float, float], free_lam: bool = False
) -> GroupSolution:
    """Solve (12), (14) under the linear law near ``guess`` = (alpha1, theta_tip), also for beta0 = 0.

    With ``free_lam`` the tip angle is kept and lam is found near the given one.
    """
    alpha1, theta_tip = guess
    scale = math.pi**4
    law = Law((Line(beta0, -scale),))  # traction beta0 - pi^4 u, u = (1 + lam/pi^4) y
    numbers = (theta_tip, -2.0 * alpha1 / (scale + lam), beta0 + alpha1, 1.0, 1.0 + lam / scale)
    found = solve(law, numbers, (Y_TIP, LOAD, RATE) if free_lam else GIVEN_LENGTH)
    _, jacobian, _ = shoot(law, found.numbers)
    J = jacobian[list(_PLATE)]
    tangent = np.linalg.solve(J[:, (Y_TIP, LOAD, RATE)], -J[:, THETA_TIP])
    return GroupSolution(
        beta0,
        (found.r - 1.0) * scale,
        found.P - beta0,
        found.theta_tip,
        found.y_tip,
        found.residual,
        float(tangent[2] * scale),
        found.nodes,
    )


def lam_fold(beta0: float, bracket: tuple[float, float]) -> GroupSolution:
    """Fold in lambda at fixed beta0 between two tip angles, following the branch from T."""
    state, theta_tip = None, -0.01
    lam, alpha1 = 0.0, theta_tip * math.pi**3 * math.tanh(math.pi / 2)

    def at(angle: float) -> GroupSolution:
        nonlocal state, theta_tip, lam, alpha1
        pieces = max(1, math.ceil(abs(angle - theta_tip) / 0.05))
        for target in np.linspace(theta_tip, angle, pieces + 1)[1:]:
            state = given_groups(beta0, lam, (alpha1 * target / theta_tip, target), free_lam=True)
            theta_tip, lam, alpha1 = state.theta_tip, state.lam, state.alpha1
        return state if state is not None else given_groups(beta0, lam, (alpha1, theta_tip), free_lam=True)

    angle = brentq(lambda a: at(a).tangent_lam, *bracket, xtol=1e-13)
    return at(angle)


# ---------------------------------------------------------------- as many digits as wanted: Taylor, mpmath


def taylor_shoot(law: Law, numbers: Sequence[Any], digits: int = 30) -> list[Any]:
    """End state by Taylor series in mpmath, for laws made of straight pieces."""
    with mpmath.workdps(digits + 5):
        theta, y, load, length, rate = (mpmath.mpf(n) for n in numbers)
        state = [theta, mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(0), y]
        kinks = [mpmath.mpf(k) / rate for k in law.kinks]
        index = sum(y > k for k in kinks)
        s, order, tiny = mpmath.mpf(0), int(1.3 * digits) + 8, mpmath.mpf(10) ** -(digits + 3)
        while s < length:
            series = _taylor_series(state, law.pieces[index], load, rate, order)
            # the last coefficients: near the tip only every third one differs from zero
            size = max(abs(c[n]) ** (mpmath.mpf(1) / n) for c in series for n in range(order - 5, order + 1))
            h = min(length - s, tiny ** (mpmath.mpf(1) / order) / size if size else length)
            new = [_at(c, h) for c in series]
            after = sum(new[4] > k for k in kinks)
            crossing = after != index and (s == 0 or abs(state[4] - kinks[min(after, index)]) > tiny)
            if crossing:
                kink = kinks[min(after, index)]
                h = _series_root(series[4], series[0], kink, h)
                new = [_at(c, h) for c in series]
                new[4] = kink
                index += 1 if after > index else -1
            state, s = new, s + h
        return state


def _taylor_series(state: list[Any], piece: Any, load: Any, rate: Any, order: int) -> list[list[Any]]:
    theta, curvature, nx, ny, y = ([v] for v in state)
    sine, cosine = [mpmath.sin(state[0])], [mpmath.cos(state[0])]
    offset, slope = mpmath.mpf(piece.offset), mpmath.mpf(piece.slope) * rate
    for n in range(order):
        # products by Cauchy's rule; S' = C theta', C' = -S theta'
        bend = mpmath.fdot(ny, cosine[::-1]) - mpmath.fdot(nx, sine[::-1])
        turn = mpmath.fdot(cosine, curvature[::-1]), -mpmath.fdot(sine, curvature[::-1])
        pull = load * cosine[n] - slope * y[n] - (offset if n == 0 else 0)
        theta.append(curvature[n] / (n + 1))
        curvature.append(bend / (n + 1))
        nx.append(-load * sine[n] / (n + 1))
        ny.append(pull / (n + 1))
        y.append(sine[n] / (n + 1))
        sine.append(turn[0] / (n + 1))
        cosine.append(turn[1] / (n + 1))
    return [theta, curvature, nx, ny, y]


def _at(series: list[Any], h: Any) -> Any:
    value = mpmath.mpf(0)
    for c in reversed(series):
        value = value * h + c
    return value


def _series_root(y: list[Any], theta: list[Any], height: Any, stop: Any) -> Any:
    low, high = mpmath.mpf(0), stop
    rising = _at(y, high) > height
    for _ in range(20):
        middle = (low + high) / 2
        if (_at(y, middle) > height) == rising:
            high = middle
        else:
            low = middle
    h = (low + high) / 2
    for _ in range(6):
        h -= (_at(y, h) - height) / mpmath.sin(_at(theta, h))
    return h


def refine(
    law: Law, numbers: Sequence[Any], free: tuple[int, ...], digits: int = 30
) -> tuple[tuple[Any, ...], Any]:
    """Repeat a solution with the Taylor integrator to about ``digits`` digits.

    Returns the five numbers and the largest residual at the plate, all mpmath numbers.
    """
    _, jacobian, _ = shoot(law, [float(n) for n in numbers])
    with mpmath.workdps(digits + 5):
        inverse = mpmath.matrix(np.linalg.inv(jacobian[np.ix_(_PLATE, free)]).tolist())
        values = [mpmath.mpf(n) for n in numbers]
        for _ in range(8):
            end = taylor_shoot(law, values, digits)
            residual = mpmath.matrix([end[i] for i in _PLATE])
            worst = max(abs(v) for v in residual)
            if worst < mpmath.mpf(10) ** -(digits - 4):
                break
            step = inverse * residual
            for i, number in enumerate(free):
                values[number] -= step[i]
        return tuple(values), worst


def refine_fold(
    law: Law, numbers: Sequence[Any], which: int, free: tuple[int, ...] = GIVEN_TIP, digits: int = 30
) -> tuple[Any, ...]:
    """Repeat a fold with the Taylor integrator; good to about digits/2."""
    with mpmath.workdps(digits + 5):
        h = mpmath.mpf(10) ** -(digits // 3)
        angle = mpmath.mpf(numbers[THETA_TIP])

        def at(theta_tip: Any) -> tuple[Any, ...]:
            return refine(law, (theta_tip, *numbers[1:]), free, digits)[0]

        def slope(theta_tip: Any) -> Any:
            return (at(theta_tip + h)[which] - at(theta_tip - h)[which]) / (2 * h)

        bend = (slope(angle + 1000 * h) - slope(angle - 1000 * h)) / (2000 * h)
        for _ in range(4):
            angle -= slope(angle) / bend
        return at(angle)
