"""Rods whose tip has come down to the plate: just touching it, or lying on it as a flat tail.

A rod that rests on its tip with a reaction R satisfies, by the first integrals of (12), R sin theta_tip = 0:
either the tip just touches, R = 0, or it lies flat, theta_tip = -pi.  Both are states of one scene, the
rod with its tip in contact, whose rows are (12), theta = theta' = y = 0 at the front, and theta' = y = 0
at the tip.  At every pressure up to T0 there is one of each.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ..base.checks import positive
from ..base.errors import NoEquilibrium, NotConverged
from ..base.threads import one_thread
from ..continuation.primary import primary_branch
from ..continuation.scene_family import SceneFamily, led_over
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..model.rod import RATIOS, Rod, require_rod
from ..model.scene import Scene
from ..model.tips import Contact
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation, Profile
from ..residual.meshes import SCENES
from ..residual.newton import Correction
from ..residual.scene_spectral import SceneDiscretisation, SceneProfile, SceneSpectral
from .ask import require_certified
from .methods import METHODS, Effort, certify, solve_to_tolerance
from .question import Question, known_law
from .result import Equilibrium
from .scene_question import posed
from .scenes import answered
from .scenes import require_certified as require_scene

#: eta/y0 and p/T0 of the states that all others are led over from: there the whole loop is bonded.
BASE_RATIO, BASE_PRESSURE = 1.0, 0.8

#: Tip angle [rad] from which the way to the flat fold goes on without a natural curvature: on the way the
#: curvature grows from zero and falls to zero again, with the square root of the angle that is left.
NEARLY_FLAT = math.pi + 1e-3

#: Natural curvature over 1/eta with which that way begins.
FIRST_CURVATURE = -0.01

#: Angle [rad] and reaction over T0 eta within which a state is one of a kind.
NEAR = 0.01

#: Height of a tip, as a share of the largest, up to which it is down; a folded state at 0.9999 T0 has 1e-4.
DOWN = 1e-6


@one_thread
def touching(rod: Rod, pressure: float, *, law: str | CohesiveLaw = "auto", tol: float = 1e-8) -> Equilibrium:
    """Rod folded over until its tip just touches the plate, without a reaction.

    By p y_tip = Phi(y_tip) a free tip stands at the one height that the pressure has, or on the plate.  The
    states of the second kind cross the folded ones at p = T0.  They are unstable: a lift of the tip grows.
    A tip that lands slides into such a state and leaves it as slowly as it is disturbed.

    Parameters
    ----------
    rod : Rod
    pressure : float
        p [Pa], above zero and not above T0.
    law : str or CohesiveLaw
        As in `length_given_pressure`.
    tol : float
        Largest error of sbar/eta, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium
        With ``state`` "touching".

    Raises
    ------
    InvalidInput, OutOfRange
        As `length_given_pressure`.
    NoEquilibrium
        Above T0, where no rod stays attached.
    NotConverged, NotCertified
        If the answer is out of reach.

    Examples
    --------
    >>> eq = touching(Rod.from_ratio(1.0), 0.8)
    >>> round(eq.length_ratio, 6), round(eq.tip_angle, 4)
    (3.586302, -4.0617)
    """
    question = Question.of_rod(rod, "pressure", pressure, law=law)
    profile = _brought_down(rod, pressure, law, _touching_base)
    s, q = profile.scalars, profile.numbers
    if abs(q["reaction"]) > NEAR:
        raise _lost(question.words, "touching")
    plain = Profile(profile.lengths, _turned(profile.values[:, :, :5]), Scalars(-s.A, -s.m, s.sigma, s.lam))
    began = time.perf_counter()
    try:
        solved = solve_to_tolerance(question, plain, METHODS["spectral"], positive("tol", tol))
    except NotConverged:
        # Close to T0, where touching and folded states cross, only the row of the tip tells them apart.
        held = posed(profile.scene, "length", {"pressure": pressure})
        return require_scene(held, answered(held, profile, "touching", tol, 0, began))
    found = certify(question, "touching", solved, tol, Effort(began, 0))
    if abs(found.length_ratio - s.sigma) > NEAR or abs(found.tip_height) > DOWN * float(found.y.max()):
        raise _lost(question.words, "touching")
    return require_certified(question, found)


@one_thread
def flat_fold(
    rod: Rod, pressure: float, *, law: str | CohesiveLaw = "auto", tol: float = 1e-8
) -> Equilibrium:
    """Rod folded over, with a flat tail that lies on the plate upside down.

    The state is the loop between the front and where the rod lands, with theta = -pi, theta' = 0 and a
    reaction there.  The tail beyond may be of any length and feels no axial force, so that the whole loop may
    stand anywhere along it: where a motion stops, it stays.  It is a consequence of a bond that sticks to the
    upper face of the rod as well.

    Parameters
    ----------
    rod, pressure, law, tol
        As in `touching`.

    Returns
    -------
    Equilibrium
        Of the loop: ``length`` [m] is that from the landing to the front, and ``numbers["reaction"]`` the
        force [N/m] with which the plate holds the rod up where it lands.  ``state`` is "flat fold".

    Raises
    ------
    InvalidInput, OutOfRange, NoEquilibrium, NotConverged, NotCertified
        As `touching`.  Of a loop that is long beside y0 rounding leaves an error above 1e-8: at eta/y0 = 500
        and p/T0 = 2e-3 5e-8 of 37 eta, at 1e-4 4e-7 of 79 eta.  Ask for it with a larger ``tol``.

    Examples
    --------
    >>> eq = flat_fold(Rod.from_ratio(1.0), 0.8)
    >>> round(eq.length_ratio, 6), round(eq.numbers["reaction"], 4)
    (4.439854, 1.4538)
    """
    began = time.perf_counter()
    profile = _brought_down(rod, pressure, law, _flat_base)
    question = posed(profile.scene, "length", {"pressure": pressure})
    found = answered(question, profile, "flat fold", positive("tol", tol), 0, began)
    if abs(found.tip_angle + math.pi) > NEAR:
        raise _lost(question.words, "flat fold")
    return require_scene(question, found)


def _lost(words: str, kind: str) -> NotConverged:
    return NotConverged(
        f"{words}: the way to the {kind} state was lost.",
        remedy="Ask at a higher pressure, or for a rod of less extreme eta/y0.",
    )


def _turned(values: np.ndarray) -> np.ndarray:
    """Fields over an amplitude of the other sign."""
    return -values


def _family(law: CohesiveLaw, ratio: float, closure: Closure | None = None) -> SceneFamily:
    """Return the states of a rod on its tip, with its ratio or something else held."""
    scene = Scene(Rod.from_ratio(ratio), tip=Contact(), law=law)
    return SceneFamily(law, SceneSpectral(scene, SCENES), closure or Closure("ratio", ratio))


def _brought_down(
    rod: Rod, pressure: float, law: str | CohesiveLaw, base: Callable[[CohesiveLaw], SceneProfile]
) -> SceneProfile:
    """Return a state on its tip of this rod, led over from that of another at another pressure."""
    rod = require_rod(rod, RATIOS)
    P = positive("pressure", pressure, "" if rod.dimensionless else "Pa") / rod.adhesion_strength
    bond = known_law(law) or COHESIVE
    if P > 1.0:
        raise NoEquilibrium(
            f"at p/T0 = {P:.6g} no rod stays attached ahead of a front.",
            remedy="Ask at a pressure of at most T0.",
            nearest=rod.adhesion_strength,
        )

    def other_rods(h: float) -> SceneFamily:
        return _family(bond, BASE_RATIO * (rod.ratio / BASE_RATIO) ** h)

    def other_pressures(h: float) -> SceneFamily:
        return _family(bond, rod.ratio, Closure("pressure", BASE_PRESSURE * (P / BASE_PRESSURE) ** h))

    words = f"p/T0 = {P:.6g}, eta/y0 = {rod.ratio:.6g}"
    profile = _followed(other_rods, base(bond), Closure("pressure", BASE_PRESSURE), words)
    profile = _followed(other_pressures, profile, Closure("ratio", rod.ratio), words)
    return replace(profile, scene=Scene(rod, tip=Contact(), law=bond))


def _followed(
    way: Callable[[float], SceneFamily], start: SceneProfile, held: Closure, words: str
) -> SceneProfile:
    """Return the state at the end of a way."""
    solved, _ = led_over(way, start, held)
    if solved is None:
        raise _lost(words, "landed")
    return _profile(*solved)


def _profile(problem: Discretisation, solved: Correction) -> SceneProfile:
    assert isinstance(problem, SceneDiscretisation)
    return problem.profile(solved.x)


@lru_cache(maxsize=8)
def _touching_base(law: CohesiveLaw) -> SceneProfile:
    """Follow the touching states from where the folded ones end, at p = T0, to the pressure of the base."""
    family = _family(law, BASE_RATIO)
    branch = primary_branch(law, family.closure)
    if law.branch_ends:
        branch.extend(lambda _: False)
    if branch.ended != "contact":
        raise NotConverged(
            f"under law {law.name!r} the folded states were not followed to where their tip touches.",
            remedy="Try law (8).",
        )
    end = branch.points[-1].profile
    s = end.scalars
    still = np.zeros((*end.values.shape[:2], 2))
    values = np.concatenate([_turned(end.values), still], axis=2)
    numbers = {**family.scene.numbers, "entered": 1.0, "pressure": 1.0, "ratio": BASE_RATIO, "reaction": 0.0}
    start = SceneProfile(end.lengths, values, Scalars(-s.A, -s.m, s.sigma, s.lam), family.scene, numbers)

    def way(h: float) -> SceneFamily:
        return _family(law, BASE_RATIO, Closure("pressure", BASE_PRESSURE**h))

    return _followed(way, start, family.closure, f"law {law.name!r}")


@lru_cache(maxsize=8)
def _flat_base(law: CohesiveLaw) -> SceneProfile:
    """Turn the tip of the touching state to the plate; a natural curvature holds it on the way."""
    start = _touching_base(law)
    scene = replace(start.scene, natural_curvature=1.0)  # any value: it is left free
    mesh = SceneSpectral(scene, SCENES, "natural_curvature")
    pressure = Closure("pressure", BASE_PRESSURE)
    first = start.scalars.A

    def way(h: float) -> SceneFamily:
        angle = first + h * (-NEARLY_FLAT - first)
        return SceneFamily(law, mesh, Closure("amplitude", angle), holding=(pressure,))

    bent = replace(start, scene=scene, numbers={**start.numbers, "natural_curvature": FIRST_CURVATURE})
    curved = _followed(way, bent, Closure("ratio", BASE_RATIO), f"law {law.name!r}")
    numbers = {name: value for name, value in curved.numbers.items() if name != "natural_curvature"}
    straight = replace(curved, scene=start.scene, numbers=numbers)
    return _followed(lambda _: _family(law, BASE_RATIO), straight, pressure, f"law {law.name!r}")
