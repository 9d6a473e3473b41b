"""The discretised (12) as a nonlinear programme, solved by IPOPT.

An equilibrium is a square feasibility problem: as many constraints as unknowns and a
constant objective.  It is not a minimum of an energy (the load is not conservative, and the
interesting branch is a saddle).
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from types import FrameType
from typing import Any

import casadi as ca
import numpy as np

from ..base.threads import heard
from ..model.equations import Scalars
from ..model.groups import PI4
from .closures import EQUATIONS, Closure, derivatives
from .discretisation import Discretisation

#: IPOPT's words for a solved square problem.
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")


@dataclass(frozen=True)
class Ipopt:
    """Options of the interior-point solver.

    Parameters
    ----------
    tol : float
        Largest scaled constraint violation.
    max_iterations : int
        A solve that starts on a path takes fewer than ten.
    """

    tol: float = 1e-10
    max_iterations: int = 60


def silent(tol: float, max_iterations: int, **more: object) -> dict[str, Any]:
    """Settings of `casadi.nlpsol` for a programme that its maker has scaled: nothing is printed."""
    return {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": tol,
            "constr_viol_tol": tol,
            "max_iter": max_iterations,
            "nlp_scaling_method": "none",
            **more,
        },
    }


@dataclass(frozen=True, eq=False)
class NlpSolution:
    """What IPOPT returned: ``solved`` only if its own status says so."""

    x: np.ndarray
    solved: bool
    status: str
    iterations: int
    evaluations: int


@lru_cache(maxsize=128)
def build(
    problem: Discretisation, kinds: tuple[str, ...], options: Ipopt, minimise: bool = False
) -> ca.Function:
    """Compile the NLP of a discretisation closed by the questions ``kinds``.

    The unknowns are scaled by ``p[:n]`` and the constraints by the next as many as there are;
    the given values follow.  One solver serves all values of a structure.  With ``minimise``
    the objective is lambda; otherwise it is constant and the problem square.
    """
    n, k = problem.size, problem.expression.shape[0] + len(kinds)
    z, p = ca.MX.sym("z", n), ca.MX.sym("p", n + k + len(kinds))
    unknowns = z * p[:n]
    scalars = Scalars(*ca.vertsplit(unknowns[problem.tail]))
    given = [EQUATIONS[kind](scalars, p[n + k + i]) for i, kind in enumerate(kinds)]
    residual = ca.substitute(problem.expression, problem.x, unknowns)
    constraints = ca.vertcat(residual, *given) * p[n : n + k]
    settings = silent(options.tol, options.max_iterations)
    if not minimise:
        # With a constant objective and vanishing multipliers the Hessian of the Lagrangian is
        # zero at the solution; saying so makes every iteration a Newton step of the constraints.
        arguments = [z, p, ca.MX.sym("lam_f"), ca.MX.sym("lam_g", k)]
        names = ["x", "p", "lam_f", "lam_g"]
        settings["hess_lag"] = ca.Function("hess_lag", arguments, [ca.MX(n, n)], names, ["hess"])
    objective = scalars.lam / PI4 if minimise else ca.MX(0)
    return ca.nlpsol("equilibrium", "ipopt", {"x": z, "p": p, "f": objective, "g": constraints}, settings)


def solve(
    problem: Discretisation, start: np.ndarray, given: tuple[Closure, ...], options: Ipopt | None = None
) -> NlpSolution:
    """Solve the residual together with the closures by IPOPT, from ``start``.

    Returns
    -------
    NlpSolution
        ``solved`` is False, and nothing is raised, if IPOPT gave up.
    """
    return _run(problem, start, given, options or Ipopt(), minimise=False)


def minimise_lambda(problem: Discretisation, start: np.ndarray, given: Closure) -> NlpSolution:
    """Find the least lambda with a detached equilibrium under one closure: a fold."""
    return _run(problem, start, (given,), Ipopt(max_iterations=200), minimise=True)


@heard
def _run(
    problem: Discretisation, start: np.ndarray, given: tuple[Closure, ...], options: Ipopt, *, minimise: bool
) -> NlpSolution:
    solver = build(problem, tuple(c.kind for c in given), options, minimise)
    scale = unknown_scale(problem, start)
    _, jacobian = problem.linearised(start)
    border, _ = derivatives(given, start[problem.tail])
    sizes = np.abs(jacobian.full()) @ scale
    sizes = np.append(sizes, np.abs(border) @ scale[problem.tail])
    parameters = np.concatenate([scale, 1.0 / np.maximum(sizes, 1e-12), [c.value for c in given]])
    with _interrupts_wait():
        result = solver(x0=start / scale, p=parameters, lbg=0.0, ubg=0.0)
        stats = solver.stats()
    x = result["x"].full().ravel() * scale
    status = str(stats["return_status"])
    return NlpSolution(
        x=x,
        solved=status in SOLVED and bool(np.all(np.isfinite(x))),
        status=status,
        iterations=int(stats["iter_count"]),
        evaluations=int(stats["n_call_nlp_g"]),
    )


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Hold Ctrl-C back while IPOPT runs, some hundredths of a second, and let it through then.

    CasADi looks for signals before every evaluation.  A KeyboardInterrupt that it meets there is
    cleared, and IPOPT reports a failed evaluation: the solve would count as not converged and
    the interrupt be lost.  Only the main thread receives signals.
    """
    own = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(own):
        yield
        return
    frames: list[FrameType | None] = []
    signal.signal(signal.SIGINT, lambda _, frame: frames.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, own)
        if frames:
            own(signal.SIGINT, frames[0])


def unknown_scale(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """Size of each unknown at the start, no smaller than a thousandth of its block."""
    scale = np.abs(x)
    fields = problem.fields
    scale[fields] = np.maximum(scale[fields], 1e-3 * max(1.0, float(np.max(scale[fields]))))
    scale[problem.field_count :] = np.maximum(scale[problem.field_count :], 1e-3)
    return scale
