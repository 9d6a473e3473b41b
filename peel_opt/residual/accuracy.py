"""How far to trust a discrete solution: its certificate, what its mesh leaves out, what rounding does.

The *certificate* is by how much a solution misses an equation that follows from those it was solved with.

What *a finer mesh* would change of a solution is, to first order, a step of Newton's method there.
Its right side is the residual of the prolonged solution, and its matrix on the smooth functions
that matter is that of the mesh at hand: the residual is restricted to it and sent through the
factors that are there already.  Weighted with the adjoint of the answer this is |w R_fine|; the
step has it for every scalar at once.

At 16 nodes, refined to 24, this is 0.65 to 1.3 times the true error of an answer, in the median 0.9;
what the finer mesh does not see either makes it too low.  At 8 to 12 nodes it may be a hundred
times too low.

*Rounding*: each equation of a discretised problem is a sum of terms, and its value cannot be known better
than to a few units in the last place of the largest of them.  The row of the inverse Jacobian
that belongs to the answered number says what such a residue does to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.arrays import EPS
from ..base.threads import one_thread
from ..model.bond import CohesiveLaw, Piece
from ..model.equations import LowPressure, Scalars
from ..model.groups import PI4
from .closures import Closure
from .discretisation import Discretisation, Profile, Transcription
from .linear import Linearised, gradient
from .spectral import Spectral, SpectralDiscretisation

#: Height below which a tip lies on the plate, as a share of the largest.
HEIGHT_NOISE = 1e-9

#: Fewer nodes need not resolve a shape, nor see that they do not.
RESOLVING = 16

#: How much larger than the estimate an error may be, with room to spare.
SAFE = 2.5

#: Units in the last place of its terms that an equation may lose: a sum of a few dozen terms,
#: and an integrator whose stages are not seen among the terms.  Over 2000 random cases a
#: quarter of the first and two thirds of the second were lost.
UNITS, UNITS_OF_STAGES = 4.0, 14.0


def certificate(law: CohesiveLaw, profile: Profile, tip: Piece) -> float:
    """How far a solution misses the equation that follows from those it was solved with.

    The larger of |p - Phi(y_tip)/y_tip| / T0, which the two first integrals of (12) make zero, and
    of |theta| at the plate [rad], of (14).  One of them is among the equations, the other is not.

    A rod whose tip is held to the plate satisfies p y_tip = Phi(y_tip) for any p, and it cannot be
    divided by y_tip: on such a piece the first is |p y_tip - Phi(y_tip)| / (T0 y0).

    Parameters
    ----------
    law : CohesiveLaw
    profile : Profile
    tip : Piece
        The phase at the tip.
    """
    return certificate_of_ends(law, profile.scalars, profile.ends, tip)


def certificate_of_ends(law: CohesiveLaw, s: Scalars, ends: tuple[float, float], tip: Piece) -> float:
    """`certificate` of a solution by its scaled height at the tip and its scaled angle at the plate."""
    height, edge = (float(s.A * end) for end in ends)
    defect = first_integral_defect(law, s, height, tip)
    if tip.lost is None and s.beta0:
        defect *= abs(height) * s.beta1 / s.beta0
    return max(defect, abs(edge))


def certificates_of_ends(law: CohesiveLaw, s: Scalars, heights: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """`certificate` of many solutions with free tips under a law of straight pieces.

    By their scalars, the heights u of their tips and their scaled angles at the plate, each an array.
    """
    defects = np.abs(s.alpha1 / s.beta0 + law.mean_drops(heights))
    certificates: np.ndarray = np.maximum(defects, np.abs(s.A * edges))
    return certificates


def first_integral_defect(law: CohesiveLaw, scalars: Scalars, tip_height: float, tip: Piece) -> float:
    """|p - Phi(y_tip)/y_tip| / T0, which the two first integrals of (12) make zero.

    ``tip_height`` is y/sbar.  At beta0 = 0, where there is no T0, the identity of the linear
    law alpha1 = -beta1 y_tip / 2 is divided by beta1 instead.  A bond that has let go for good has
    taken all of its work, however low the tip has come down since.
    """
    if scalars.beta0 == 0.0:
        return float(abs(scalars.alpha1 / scalars.beta1 + 0.5 * tip_height))
    u = tip_height * scalars.beta1 / scalars.beta0
    drop = 1.0 - tip.work_done / u if tip.for_good else law.mean_drop(u)
    return float(abs(scalars.alpha1 / scalars.beta0 + drop))


def can_estimate(transcription: Transcription | None) -> bool:
    """Whether one residual tells the error of solutions of a transcription."""
    return isinstance(transcription, Spectral) and transcription.nodes >= RESOLVING


def defect(problem: SpectralDiscretisation, x: np.ndarray) -> np.ndarray:
    """Residual of a solution on the refined mesh, as the equations of its own mesh.

    Parameters
    ----------
    problem : SpectralDiscretisation
    x : ndarray, shape (n,) or (k, n)
        A solution, or a stack of them.

    Returns
    -------
    ndarray, shape (n - 2,) or (k, n - 2)
        The two closures of a question are left out: they hold on every mesh.
    """
    finer = problem.finer
    there = problem.prolonged(x, finer)
    return problem.restricted(finer.residual(there) if x.ndim == 1 else finer.residuals(there), finer)


def refinement(at: Linearised) -> np.ndarray:
    """First-order change of a solution's unknowns by the refined mesh.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given, of a transcription that `can_estimate`.

    Returns
    -------
    ndarray, shape (n,)
    """
    assert isinstance(at.problem, SpectralDiscretisation)
    missed = np.concatenate([defect(at.problem, at.x), np.zeros(len(at.closing))])
    return at.factors.solve(-missed)


@dataclass(frozen=True, eq=False)
class Response:
    """How an answer responds to the equations of its discrete problem.

    Parameters
    ----------
    rounding : float
        What rounding does to the answer, and what Newton's method has left.
    unsettled : float
        The second of these alone.
    condition : float
        Largest derivative of the answer with respect to a given number other than the rod's.
    leverage : ndarray, shape (4,)
        How much further the same residues of the equations move the answer than each scalar.
    """

    rounding: float
    unsettled: float
    condition: float
    leverage: np.ndarray


def response(at: Linearised, update: np.ndarray, read: Callable[[Scalars], float]) -> Response:
    """Return how the answered number of a solution responds to the equations.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given.
    update : ndarray, shape (n,)
        The last of Newton's method.
    read : callable
        The answered number.
    """
    weights = gradient(read, at.tail, at.problem.form)
    unsettled = 4.0 * abs(float(weights @ update[at.problem.tail]))
    return _response(at, unsettled, at.of_scalars @ weights, read(at.problem.scalars(at.x)))


def response_to(at: Linearised, update: np.ndarray, weights: np.ndarray, value: float) -> Response:
    """Return how a number of a solution responds to the equations.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given.
    update : ndarray, shape (n,)
        The last of Newton's method.
    weights : ndarray, shape (n,)
        Gradient of the number by all unknowns.
    value : float
        The number itself.
    """
    own = at.factors.solve(weights, transposed=True)
    return _response(at, 4.0 * abs(float(weights @ update)), own, value)


def _response(at: Linearised, unsettled: float, own: np.ndarray, value: float) -> Response:
    """Put together what the response ``own`` of a number to every equation says of it."""
    problem, given = at.problem, [closure for closure in at.closing if isinstance(closure, Closure)]
    by_given = np.abs(own[-len(given) :] @ at.by_given)
    # p/T0 enters as 1 - p/T0, but where it is small, and lambda as pi^4 + lambda: their rounding is
    # that of the larger.
    terms = {"pressure": 0.0 if problem.form is LowPressure else 1.0, "lam": PI4}
    given_sizes = np.array([max(abs(c.value), terms.get(c.kind, 0.0)) for c in given])
    with one_thread:
        sizes = at.sizes
    lost = own * sizes * units_lost(problem, len(sizes))
    residues = math.sqrt(lost @ lost)  # of independent signs
    digits = abs(value) + float(by_given @ given_sizes)
    asked = [d for d, c in zip(by_given.tolist(), given, strict=True) if c.kind != "ratio"]
    towards = at.of_scalars
    return Response(
        # Once it has settled, the last update is rounding of the equations itself: it counts once.
        rounding=max(unsettled, EPS * residues) + 2.0 * EPS * digits,
        unsettled=unsettled,
        condition=max(asked),
        leverage=math.sqrt(own @ own) / np.sqrt(np.einsum("ij,ij->j", towards, towards)),
    )


def units_lost(problem: Discretisation, count: int) -> np.ndarray:
    """Units in the last place of its terms that each of ``count`` equations of this problem may lose."""
    units = np.full(count, UNITS)
    units[problem.defects] = UNITS_OF_STAGES
    return units
