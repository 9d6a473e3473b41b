"""What becomes of a transition in a scene that has none: its unfolding, to leading order.

    lambda A - b A^2 + h = 0,      A = alpha1,   lambda = beta1 - beta1 at the transition,

where b is the slope of the branch at T without what is imperfect (0.0961917 beta0 for the paper's rod),
and h is what the imperfection puts on the adjoint kernel of the linear problem there (4 pi^2 c beta0 for
p = p0 (1 + c s/sbar)).  Where h < 0 the branch that goes on from the attached rod ends at

    lambda_max = -2 sqrt(b |h|),

which falls with the square root of what is imperfect.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyfit

from ..base.errors import InvalidInput, NotConverged
from ..base.quadrature import gauss
from ..base.threads import one_thread
from ..continuation.scene_family import SceneFamily, entered_branch
from ..model.loads import Pressure
from ..model.place import Place
from ..model.scene import Scene
from ..model.tips import FREE, Free, TipLoad
from ..residual.closures import Closure
from ..residual.meshes import SCENES
from ..residual.scene_spectral import SceneSpectral
from .critical import NODES, LinearProblem, Transition, critical_length, without_slip

#: Tip angles [rad] at which the slope of the branch without the imperfection is read, to be extrapolated.
ANGLES = (0.02, 0.04, 0.06, 0.09, 0.13)

#: Relative step of the detached length in a derivative of the linear problem.
STEP = 1e-4

#: What rounding leaves of a derivative of the linear problem, as a share of it.
ROUNDING = 1e-9

#: Gauss nodes per stretch of an integral of what is imperfect.
POINTS = 12


@dataclass(frozen=True)
class Unfolding:
    """lambda A - slope A^2 + offset = 0, with A = alpha1 and lambda = beta1 less that of the transition.

    Parameters
    ----------
    transition : Transition
        Of the same scene without what is imperfect in it.
    slope : float
        d lambda / d alpha1 there.
    offset : float
        What the imperfection adds; negative where it lifts the tip, positive where it holds it down.
    slope_error, offset_error : float
        Absolute errors of these two, to leading order as they are.
    """

    transition: Transition
    slope: float
    offset: float
    slope_error: float
    offset_error: float

    @property
    def largest_lam(self) -> float:
        """lambda at which the branch that goes on from the attached rod ends; nan where it has no end."""
        return -2.0 * math.sqrt(self.slope * -self.offset) if self.offset < 0.0 < self.slope else math.nan

    def lam(self, alpha1: float | np.ndarray) -> float | np.ndarray:
        """Return lambda on the branch at some alpha1."""
        return self.slope * alpha1 - self.offset / alpha1

    def alpha1(self, lam: float) -> tuple[float, ...]:
        """Return alpha1 < 0, a lifted rod, at lambda; the smallest lift, which is the physical one, first."""
        roots = np.roots([self.slope, -lam, -self.offset])
        lifted = [float(root.real) for root in roots if abs(root.imag) == 0.0 and root.real < 0.0]
        return tuple(sorted(lifted, reverse=True))


@one_thread
def unfolding(scene: Scene) -> Unfolding:
    """Return the unfolding of the transition that a scene would have but for what lifts its rod.

    Imperfect are a pressure that is not uniform along the rod, a force that pulls off the plate, a moment,
    a natural curvature and a length without glue; it holds while they are small.

    Parameters
    ----------
    scene : Scene
        On a flat wall, with a free or loaded tip.

    Returns
    -------
    Unfolding

    Raises
    ------
    InvalidInput
        If the scene is on a curved wall, a blister, rests on its tip, or has a line energy or a layer.
    NotConverged
        If the branch of the scene without its imperfections could not be followed near its transition.

    Examples
    --------
    >>> from peel_opt.model.rod import Rod
    >>> from peel_opt.model.profiles import linear
    >>> found = unfolding(Scene(Rod.from_ratio(1.0), [Pressure(linear(-1e-3))]))
    >>> round(found.largest_lam / found.transition.beta0, 4)  # -2 sqrt(0.0961917 * 4 pi^2 * 1e-3)
    -0.1232
    """
    if not isinstance(scene, Scene):
        raise InvalidInput(f"unfolding takes a Scene, got {scene!r:.60}.")
    perfect = _perfect(scene)
    transition = critical_length(perfect)
    sigma, r = transition.length_ratio, scene.rod.ratio
    linear = LinearProblem.of(perfect, NODES[1])
    here = linear.matrix(sigma)
    _, _, right = np.linalg.svd(here)
    mode = right[-1] / right[-1][-1]
    _, _, left = np.linalg.svd(here.T)
    rates = []
    for h in (STEP, 2.0 * STEP):
        apart = linear.matrix(sigma * (1.0 + h)) - linear.matrix(sigma * (1.0 - h))
        rates.append(float(left[-1] @ (apart @ mode) / (2.0 * h * sigma)))
    by_length = (4.0 * rates[0] - rates[1]) / 3.0
    pressed = mode[-2] * sigma**3  # alpha1 per amplitude
    offset = float(left[-1] @ _missed(scene, linear, sigma) * pressed * 4.0 * r * sigma**3 / by_length)
    slope, slope_error = _slope(perfect, transition)
    error = abs(offset) * (abs(rates[1] - rates[0]) / abs(by_length) * STEP + ROUNDING)
    return Unfolding(transition, slope, offset, slope_error, error)


def _perfect(scene: Scene) -> Scene:
    """Return the scene without what is imperfect in it."""
    others = scene.line_energy or scene.layer is not None or scene.stretch is not None
    if not scene.is_flat or not isinstance(scene.tip, TipLoad) or others:
        raise InvalidInput(
            "the unfolding is that of a rod on a flat wall with a free or loaded tip, without a line energy"
            " or a layer.",
            remedy="Leave them out, or follow the branch of the scene with trace.",
        )
    pressure = next(load for load in scene.loads if isinstance(load, Pressure))
    if not Pressure(pressure.profile, pressure.dead).keeps_flat or pressure.until is not None:
        pressure = Pressure(dead=pressure.dead)
    loads = [pressure, *(load for load in scene.loads if not isinstance(load, Pressure))]
    in_line = scene.tip.angle == 0.0 and not isinstance(scene.tip, Free)
    tip = replace(scene.tip, moment=0.0) if in_line else FREE
    return replace(scene, loads=loads, tip=tip, natural_curvature=0.0, unbonded=0.0)


def _missed(scene: Scene, linear: LinearProblem, sigma: float) -> np.ndarray:
    """Return by how much the rod that lies on its wall misses the equations of the scene."""
    q, scene = {**scene.numbers, "ratio": scene.rod.ratio, "pressure": linear.pressure}, without_slip(scene)
    piece = scene.bond.law.pieces[0]
    breaks = {name: q[name] for name in scene.breaks if q[name] < sigma}
    nodes, weights = gauss(POINTS)

    def load(s: float) -> float:
        past = frozenset(name for name, where in breaks.items() if where < s)
        return float(scene.per_length(Place(s, sigma, 0.0, s - sigma, 0.0, 0.0, past), piece, q)[1])

    def lifted(s: float) -> float:
        ends = [0.0, *sorted(where for where in breaks.values() if where < s), s]
        return math.fsum(
            (b - a) * float(weights @ [load(a + (b - a) * t) for t in nodes]) for a, b in pairwise(ends)
        )

    pull = float(scene.tip_force(Place(0.0, sigma, 0.0, -sigma, 0.0, 0.0), q)[1])
    curled = linear.matrix(sigma, tip=(0.0, 1.0))[:, -1] * scene.imposed_curvature
    forces = np.array([pull + lifted(sigma * t) for t in linear.grid.xi])
    return curled - np.append(forces, [0.0, 0.0])


def _slope(scene: Scene, transition: Transition) -> tuple[float, float]:
    """Return d lambda / d alpha1 at the transition, from states near it, and its error."""
    mesh, ratio = SceneSpectral(scene, SCENES), Closure("ratio", scene.rod.ratio)
    family = SceneFamily(scene.bond.law, mesh, ratio)
    branch, rates = entered_branch(family), []
    for A in ANGLES:
        found = branch.candidates(Closure("amplitude", A))
        if not found:
            raise NotConverged(
                f"the branch has no state at a tip angle of {-A:g} rad near its transition.",
                remedy="Leave out loads until it has.",
            )
        s = found[0].profile.scalars
        alpha1 = s.alpha1 - (transition.pressure_ratio - 1.0) * s.beta0
        rates.append((s.beta1 - transition.beta1) / alpha1)
    limits = [float(polyfit(ANGLES[:n], rates[:n], n - 1)[0]) for n in (len(ANGLES) - 1, len(ANGLES))]
    return limits[1], abs(limits[1] - limits[0])
