"""Stability at fixed pressure: small motions of the detached part with its edge clamped.

The bond is one-sided, so to first order the edge does not move: perturbations keep
theta(1) = y(1) = 0.  With phi = delta theta, displacements follow by integration from the edge,

    delta x = int_xi^1 sin(theta) phi,    delta y = -int_xi^1 cos(theta) phi,

and the virtual work of bending, pressure and bond, linearised, gives K phi = mu M phi for
motions exp(+-sqrt(-mu) t) of a rod with unit mass per length.  The pressure turns with the
rod, so K is not symmetric (`motion_matrices`).  With inertia replaced by viscous drag the same mu are
rates of decay.  Counts of eigenvalues depend on the inertia assumed; the sign of det K does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..base.threads import one_thread
from ..equilibria.assembly import discretised
from ..equilibria.branch import Branch
from ..equilibria.result import Equilibrium
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation
from ..residual.newton import correct
from ..residual.shape import Solution
from ..residual.spectral import Spectral
from .motion_matrices import Motions

#: Polynomial degrees per phase of the two solves whose difference is the error.
DEGREES = (16, 22)

#: Eigenvalues reported, smallest magnitude first.
REPORTED = 4

#: What states on other meshes are solved again on, and how far a state may be from itself there.
FINER, SAME = Spectral(32), 0.1

#: Imaginary part, relative to the magnitude, from which a pair counts as complex.
COMPLEX = 1e-7


@dataclass(frozen=True, eq=False)
class Stability:
    """Small motions about an equilibrium.

    Parameters
    ----------
    eigenvalues : ndarray of complex
        mu, smallest magnitude first, in units of k/(rho sbar^4): motions exp(i sqrt(mu) t).
    error : float
        Largest relative change of these when the discretisation is refined.
    index : int
        Number of negative real eigenvalues: directions in which the rod just falls away.  One
        within its error of zero does not count: the state is then `marginal`.
    flutter : bool
        Whether a complex pair makes an undamped inextensible rod oscillate with growing amplitude.
    growth : float
        Fastest growth rate under viscous drag alone, -min Re(mu); negative if all decay.
    determinant_sign : int
        Sign of det K, the same for any inertia: -1 if an odd number of real eigenvalues is negative,
        0 if one of them is within its error of zero, as at contact and at a fold in pressure.
    volume_index : int
        The same count as ``index`` when the swept volume is held instead of the pressure.
    """

    eigenvalues: np.ndarray
    error: float
    index: int
    flutter: bool
    growth: float
    determinant_sign: int
    volume_index: int

    @property
    def marginal(self) -> bool:
        """Whether an eigenvalue is within its error of zero, so that its sign is not known."""
        return self.determinant_sign == 0

    @property
    def stable(self) -> bool:
        """Whether nothing grows at fixed pressure, with or without drag; not claimed if marginal."""
        return self.index == 0 and not self.flutter and not self.marginal

    def __repr__(self) -> str:
        volume = f"index {self.volume_index} at fixed volume"
        if self.index or self.flutter:
            word = f"unstable (index {self.index}{', flutter' if self.flutter else ''})"
        else:
            word = "marginal" if self.marginal else "stable"
        return f"Stability({word} at fixed pressure; {volume}; error {self.error:.0e})"


def analyse(problem: Discretisation, x: np.ndarray, given: Closure | None = None) -> Stability:
    """Return the stability of a discrete solution.

    The state is solved again on a finer mesh and its motions in a finer basis, so that the
    difference has the error of both.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray
    given : Closure, optional
        What the state was asked at, beside the rod; without it the finer state is that of the
        same tip angle.
    """
    states = (problem, x), _finer(problem, x, given)
    with one_thread:
        return _analysed(*(Motions(*state, degree) for state, degree in zip(states, DEGREES, strict=True)))


def _finer(
    problem: Discretisation, x: np.ndarray, given: Closure | None
) -> tuple[Discretisation, np.ndarray]:
    """Return the same state on a finer mesh."""
    s, own = problem.scalars(x), problem.settings
    finer = (own.refined() if isinstance(own, Spectral) else FINER).discretise(problem.phases)
    rod = Closure("ratio", s.ratio) if s.sigma else Closure("length", 0.0)
    start = problem.prolonged(x, finer)
    for second in (given, Closure("amplitude", s.A)):  # at a fold only the latter is regular
        if second is not None:
            found = correct(finer, start, (rod, second))
            if found.converged and np.max(np.abs(found.x[-4:] - x[-4:]) / (1.0 + np.abs(x[-4:]))) < SAME:
                return finer, found.x
    raise NotConverged(
        "the state could not be solved again on a finer mesh, to tell the error of its motions.",
        remedy="Compute it with a finer method or a smaller tol.",
    )


def _analysed(coarse: Motions, fine: Motions) -> Stability:
    mu, rough = fine.eigenvalues(), coarse.eigenvalues()
    lowest = mu[:REPORTED]
    error = float(np.max(np.abs(lowest - rough[: len(lowest)]) / (1.0 + np.abs(lowest))))
    # Where a traction drops, a negative eigenvalue may lie beyond those reported.
    index, seen = _negative(mu, error), _negative(rough, error)
    real = _is_real(lowest)
    # Where a real eigenvalue vanishes, as at contact, its sign is that of rounding.
    vanishes = bool(np.any(real & (np.abs(lowest.real) <= error * (1.0 + np.abs(lowest)))))
    marginal = vanishes or index != seen
    return Stability(
        eigenvalues=lowest,
        error=error,
        index=index,
        flutter=bool(np.any(~real)),
        growth=float(-np.min(mu.real)),
        determinant_sign=0 if marginal else fine.determinant_sign(),
        volume_index=_negative(fine.eigenvalues(fixed_volume=True), error),
    )


def _is_real(mu: np.ndarray) -> np.ndarray:
    return np.abs(mu.imag) <= COMPLEX * np.abs(mu)


def _negative(mu: np.ndarray, error: float) -> int:
    """Count the real eigenvalues that are negative beyond their error."""
    return int(np.sum(_is_real(mu) & (mu.real < -error * (1.0 + np.abs(mu)))))


def stability(state: Equilibrium | Branch, i: int = -1) -> Stability:
    """Return the stability of an equilibrium, or of point ``i`` of a branch.

    Parameters
    ----------
    state : Equilibrium or Branch
        An equilibrium must carry its discrete solution: one that was just computed, not one
        read from a file.
    i : int

    Returns
    -------
    Stability

    Raises
    ------
    InvalidInput
        If there is no solution to linearise about.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> stability(length_given_pressure(Rod.from_ratio(1.0), 0.5)).index
    1
    """
    if isinstance(state, Branch):
        return analyse(*discretised(state, range(len(state))[i]))
    if not isinstance(state, Equilibrium):
        raise InvalidInput(f"a state must be an Equilibrium or a Branch, got {state!r:.60}.")
    if not isinstance(state.source, Solution):
        raise InvalidInput(
            "this equilibrium carries no discrete solution to linearise about.",
            remedy="Compute it again; files and other processes keep the shape only.",
        )
    return analyse(state.source.problem, state.source.x, _given(state))


def _given(eq: Equilibrium) -> Closure:
    """Return the number that an equilibrium was asked at, beside the rod or beta0."""
    if eq.answered == "alpha1":
        return Closure("lam", eq.lam)
    if eq.answered == "length_ratio":
        return Closure("pressure", eq.pressure_ratio)
    return Closure("length", eq.length_ratio)


#: What the paper reads off its effective potential at a given length: minimum or maximum.
PAPER_LABELS = {"lower": "stable (minimum of U_e)", "middle": "unstable (maximum of U_e)"}


def control_table(eq: Equilibrium) -> dict[str, str]:
    """Return who would see a state: a line for each control of an experiment.

    "fixed length" is the paper's reading, by its effective potential and not by the motions
    of the rod; the potential knows the unfolded states only.

    Parameters
    ----------
    eq : Equilibrium
        As for `stability`.

    Returns
    -------
    dict of str
        "stable" or "unstable", and why, by the name of the control; "marginal" where the sign of
        an eigenvalue is not known.

    Raises
    ------
    InvalidInput
        As for `stability`.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> table = control_table(length_given_pressure(Rod.from_ratio(1.0), 0.5))
    >>> table["fixed pressure"], table["fixed length (paper)"]
    ('unstable (index 1)', 'stable (minimum of U_e)')
    """
    if not isinstance(eq, Equilibrium):
        raise InvalidInput(f"a state must be an Equilibrium, got {eq!r:.60}.")
    found = stability(eq)
    flutter = ["flutter"] if found.flutter else []

    def word(index: int, otherwise: str = "stable") -> str:
        reasons = ([f"index {index}"] if index else []) + flutter
        return f"unstable ({', '.join(reasons)})" if reasons else otherwise

    doubt = found.error * (1.0 + abs(found.growth))
    return {
        "fixed pressure": word(found.index, "marginal" if found.marginal else "stable"),
        "fixed pressure, heavy drag": (
            "marginal" if abs(found.growth) <= doubt else "unstable" if found.growth > 0.0 else "stable"
        ),
        "fixed swept volume": word(found.volume_index),
        "fixed length (paper)": PAPER_LABELS.get(eq.state, "not covered"),
    }
