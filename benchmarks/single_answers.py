"""Single answers: the public call and the bare solve against solve_bvp, law (8), and IPOPT."""

from __future__ import annotations

from functools import partial

import numpy as np

import peel_opt as po
from peel_opt.base.errors import NotConverged
from peel_opt.equilibria.methods import METHODS
from peel_opt.model.bond import LINEAR
from peel_opt.model.equations import Scalars, kernel
from peel_opt.residual import programme
from peel_opt.residual.closures import Closure
from peel_opt.residual.discretisation import PROFILE_POINTS, Profile, chebyshev
from peel_opt.residual.newton import correct
from peel_opt.studies.tradeoff.peers import BvpPeer
from peel_opt.studies.tradeoff.run import REFERENCE

from .figures import Figure, alternating, milliseconds

#: True error at which solve_bvp and the library are compared.
ACCURACY = 1e-8


def peer_at(peer: BvpPeer, true: float, accuracy: float = ACCURACY) -> tuple[float, float]:
    """Return the loosest tolerance at which solve_bvp is within ``accuracy``, and the error there."""
    for exponent in np.arange(4.0, 12.0, 0.5):
        tol = 10.0**-exponent
        try:
            error = abs(peer.solve(tol).answer - true)
        except NotConverged:
            continue
        if error <= accuracy:
            return tol, error
    raise NotConverged(f"solve_bvp does not reach {accuracy:g}.")


def kernel_start(beta0: float, lam: float) -> Profile:
    """Mode (22) with the amplitude of the normal form: no solution yet."""
    alpha1 = po.NormalForm.exact().alpha1(beta0, lam)[0]
    fields = kernel(chebyshev(PROFILE_POINTS)[0])
    m = float(fields["m"])
    nx = -(beta0 + alpha1) * (fields["Y"] - fields["Y"][0])
    values = np.stack([fields["Theta"], fields["K"], nx, fields["ny"], fields["Y"]], axis=-1)
    return Profile(np.ones(1), values[None], Scalars(alpha1 / m, m, np.cbrt(beta0), lam))


def peer_from(start: Profile, eq: po.Equilibrium) -> BvpPeer:
    """Put the groups of ``eq`` to solve_bvp from a profile instead of from the solution."""
    peer = BvpPeer.of(eq)
    s = start.scalars
    peer.fields = start.at(peer.mesh).T * s.A
    peer.parameters = np.array([s.alpha1])
    return peer


def in_groups(beta0: float, lam: float, asked: tuple[float | None, float | None]) -> list[Figure]:
    """Public call and bare solve at (beta0, lam), each over solve_bvp from the same guess."""
    ask = partial(po.equilibrium, beta0=beta0, lam=lam)
    reference = ask(method=REFERENCE, tol=1e-4)
    start = kernel_start(beta0, lam)
    peer = peer_from(start, reference)
    tol, error = peer_at(peer, reference.answer)
    given = (Closure("length", float(np.cbrt(beta0))), Closure("lam", lam))
    bare, x, nodes = _bare(start, given, reference.answer)
    public = ask()
    assert abs(public.answer - reference.answer) <= ACCURACY
    fast, alone, slow = alternating(ask, lambda: correct(bare, x, given), lambda: peer.solve(tol), repeats=40)
    note = f"solve_bvp {slow:.2f} ms at tol {tol:.0e}, error {error:.0e}"
    name = f"equilibrium(beta0={beta0:g}, lam={lam:g})"
    return [
        Figure(f"(a) {name}, {public.stats.method}", fast, "ms"),
        Figure(f"(a) {name} over solve_bvp", slow / fast, "x", asked[0], True, note),
        Figure(f"(a) its solve alone, Spectral({nodes}) from the kernel guess", alone, "ms"),
        Figure("(a) its solve alone over solve_bvp", slow / alone, "x", asked[1], True),
    ]


def _bare(start: Profile, given: tuple[Closure, Closure], true: float):
    """Smallest spectral problem that meets the accuracy from the kernel guess."""
    for nodes in range(6, 33):
        problem = po.Spectral(nodes).discretise(LINEAR.pieces)
        x = problem.pack(start)
        result = correct(problem, x, given)
        if result.converged and abs(problem.scalars(result.x).alpha1 - true) <= ACCURACY:
            return problem, x, nodes
    raise NotConverged("no number of nodes reaches the accuracy from the kernel guess.")


def under_law_8() -> list[Figure]:
    """The length that P = 0.2 holds at r = 1, and the same over solve_bvp."""
    ask = partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.2)
    reference = ask(method=REFERENCE, tol=1e-4)
    peer = BvpPeer.of(reference)
    tol, error = peer_at(peer, reference.answer)
    assert abs(ask().answer - reference.answer) <= ACCURACY
    fast, slow = alternating(ask, lambda: peer.solve(tol))
    note = f"solve_bvp {slow:.2f} ms at tol {tol:.0e}, error {error:.0e}"
    return [
        Figure("(c) length_given_pressure, law (8), r = 1, P = 0.2, 1e-8", fast, "ms", 1.0),
        Figure("(a) the same over solve_bvp started from the solution", slow / fast, "x", 15.0, True, note),
    ]


def by_ipopt() -> list[Figure]:
    """IPOPT's solve of the default multiple shooting, once built, and the call around it."""
    ask = partial(po.equilibrium, beta0=4.0, lam=1.0, method="shooting", tol=1e-6)
    eq = ask()
    method = METHODS["shooting"]
    problem = method.transcription.discretise(LINEAR.pieces)
    start = problem.pack(kernel_start(4.0, 1.0))
    given = (Closure("length", float(np.cbrt(4.0))), Closure("lam", 1.0))
    solution = programme.solve(problem, start, given, method.ipopt)
    error = abs(problem.scalars(solution.x).alpha1 - ask(method=REFERENCE, tol=1e-4).alpha1)
    alone = milliseconds(lambda: programme.solve(problem, start, given, method.ipopt))
    note = f"{solution.status}, {solution.iterations} iterations, error {error:.0e} (asked 1e-6)"
    return [
        Figure(
            "(e) IPOPT multiple shooting from the kernel guess, default setting", alone, "ms", 15.0, note=note
        ),
        Figure("(e) the public call with it, error estimate included", milliseconds(ask), "ms", 15.0),
        Figure("(e) error it reports", eq.error, "", 1e-6),
    ]


def floor() -> list[Figure]:
    """Arithmetic that one Newton step of ten nodes cannot do without."""
    n = 14
    flops = 2 / 3 * n**3 + 2 * n**2 + 4 * 2 * 10 * 10 * n + 10 * 60
    return [Figure("floor: flops of a Newton step with 10 nodes (LU, four products)", flops, "flop")]


def figures() -> list[Figure]:
    """All of this module."""
    return [
        *in_groups(4.0, 1.0, (30.0, 80.0)),
        *in_groups(20.0, 1.0, (None, None)),
        *under_law_8(),
        *by_ipopt(),
        *floor(),
    ]
