"""`hysteresis`: what a rod does when the load is swept up and back down.

At fixed beta0 the swept number is lambda.  The straight rod is a state for every lambda; the
detached one exists above the fold F.  When a state is lost, or given up, the rod jumps to the
other.  All loops are quasi-static, sequences of equilibria, and the bond is reversible: a rod that comes
back to the plate adheres as before.  Under the *delay* convention it holds on as long as it can: it
peels at lambda = 0 and re-adheres at lambda_F.  Under the *Maxwell* convention both happen at
lambda_M, where the effective potential has two minima of equal depth; up and down are then the same path.
"""

from __future__ import annotations

import numpy as np

from ..base.checks import known_beta0, pair, positive, whole
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..equilibria.question import known_law
from ..equilibria.scenes import plain_law, refuse_options
from ..equilibria.trace import trace
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.groups import PI4
from ..model.rod import Rod, require_rod
from ..model.scene import Scene
from .lambda_loop import Convention, HysteresisLoop, State, loop_from_states
from .maxwell import potential_of, walk_round_the_fold
from .normal_form import NormalForm
from .pressure_loop import PressureLoop, sweep_pressure
from .scene_loop import sweep_scene

#: Window of lambda swept by default, in units of -lambda_F, and at beta0 = 0.
WINDOW = (-1.3, 0.4)
WINDOW_AT_ZERO = (-0.5, 1.0)

#: Points of the traced branch below and above this beta0, where it has a corner.
_CORNER = 37.0
_POINTS, _POINTS_AT_CORNER = 128, 512


def hysteresis(
    rod: Rod | Scene | None = None,
    *,
    beta0: float | None = None,
    convention: Convention = "delay",
    form: NormalForm | None = None,
    lam: tuple[float, float] | None = None,
    law: str | CohesiveLaw | None = None,
    points: int = 41,
    tol: float | None = None,
) -> HysteresisLoop | PressureLoop:
    """Sweep lambda at fixed beta0, or the pressure on a rod, up and back down.

    The loop is quasi-static and its bond reversible: every state is an equilibrium, and a rod that comes
    back to the plate adheres with the same law.  What the motion adds, `snap` tells: a rod may jump past the
    folded state and come to lie flat upside down, from where it does not close at the minimum pressure; a
    pressure that falls at a rate is seen to close late.  `history` has bonds that stay broken.
    There is no loop in the volume under a rod, for the reason that `volume_limits` gives.

    Parameters
    ----------
    rod : Rod or Scene, optional
        Sweep the pressure: see `PressureLoop`.  Either this or ``beta0``.  A scene peels where its lifted
        states end, at their snap, or at its transition.
    beta0 : float, optional
        Sweep lambda at this beta0 >= 0 under the linear law.
    convention : {"delay", "maxwell"}
        When a state is given up; a rod under a pressure has the delay only.
    form : NormalForm, optional
        Take the states from a normal form instead of solving for them.
    lam : tuple of float, optional
        From where to where; default from 1.3 lambda_F to 0.4 abs(lambda_F).
    law : str or CohesiveLaw, optional
        Of a rod; default law (8).  It must have a transition at T0 and never push.
    points : int
        Values of the swept number each way.
    tol : float
        Largest error of a solved state, in the metric of the arclength; default 1e-10 at fixed
        beta0, 1e-8 for a rod.

    Returns
    -------
    HysteresisLoop or PressureLoop

    Raises
    ------
    InvalidInput
        If the arguments do not say what to sweep, or the window does not hold the loop.
    NoEquilibrium
        If there is no fold in lambda: above beta0 = 37.5458, or where a form does not reach.  If a scene
        has no snap, no way back or no folded state to jump to.
    NotConverged
        If a swept state cannot be solved for to ``tol``.

    Notes
    -----
    lambda_M depends on how (33) is written, since a positive factor moves it; the fold, the
    jump at lambda = 0 and the area under the delay convention do not.

    Examples
    --------
    >>> loop = hysteresis(beta0=4.0)
    >>> [(jump.direction, round(jump.lam, 8) + 0.0) for jump in loop.jumps]
    [('up', 0.0), ('down', -0.26900109)]
    >>> round(loop.area, 6)
    0.624881
    """
    if (rod is None) == (beta0 is None):
        raise InvalidInput("give either a rod or beta0 to sweep.")
    if convention not in ("delay", "maxwell"):
        raise InvalidInput(f"convention must be 'delay' or 'maxwell', got {convention!r}.")
    points = whole("points", points, 4)
    tol = positive("tol", (1e-10 if rod is None else 1e-8) if tol is None else tol)
    if rod is not None:
        if convention != "delay" or form is not None or lam is not None:
            raise InvalidInput(
                "a rod is swept in pressure, with the delay convention and no normal form.",
                remedy="Give beta0 for a loop in lambda.",
            )
        if isinstance(rod, Scene):
            refuse_options(law="auto" if law is None else law)
            if not rod.is_plain:
                return sweep_scene(rod, points, tol)
            law, rod = plain_law(rod), rod.rod
        chosen = COHESIVE if law is None else known_law(law) or COHESIVE
        return sweep_pressure(require_rod(rod), points, tol, chosen)
    if law is not None and not ((bond := known_law(law)) and bond.is_linear):
        raise InvalidInput("at fixed beta0 the loop is that of the linear law.", remedy="Leave out law=.")
    assert beta0 is not None
    b0 = known_beta0(beta0)
    if form is not None:
        if not isinstance(form, NormalForm):
            raise InvalidInput(
                f"form must be a NormalForm, got {form!r:.60}.", remedy="For instance NormalForm.exact()."
            )
        return _of_a_form(b0, convention, form, lam, points)
    return _of_the_solver(b0, convention, lam, points, tol)


def _of_the_solver(
    beta0: float, convention: Convention, lam: tuple[float, float] | None, points: int, tol: float
) -> HysteresisLoop:
    """Solve for every swept state."""
    fold, potential = 0.0, None
    if beta0 > 0.0:
        walk = walk_round_the_fold(beta0, beyond=-0.05)
        located = walk.fold("LP-lambda")
        assert located is not None
        fold, potential = located.point.scalars.lam, potential_of(beta0, walk)
    window = _window(lam, fold)
    count = _POINTS if beta0 < _CORNER else _POINTS_AT_CORNER
    switch = potential.maxwell()[0] if potential and convention == "maxwell" else 0.0
    grid = _grid(window, fold, switch, points)
    swept = [float(value) for value in grid if fold < value < window[1] and (value or beta0)]
    branch = trace(beta0=beta0, lam=window, points=count, tol=tol, at={"lam": swept})
    folds = branch.special("LP-lambda")
    if beta0 > 0.0 and not (folds and abs(folds[0].lam - fold) < _same(fold)):
        raise NotConverged(
            f"the traced branch at beta0 = {beta0:.9g} does not turn at lambda = {fold:.9g}.",
            remedy="Stay further below beta0 = 37.5458, where the branch has a corner.",
        )
    lower = np.flatnonzero(branch.state == "lower")

    def solved(value: float) -> State:
        rows = np.array([folds[0].index]) if value == fold and folds else lower
        row = int(rows[np.argmin(np.abs(branch.lam[rows] - value))])
        if abs(branch.lam[row] - value) > _same(fold):
            raise NotConverged(
                f"no lower state was reached at beta0 = {beta0:g}, lambda = {value:.9g}.",
                remedy="Sweep a narrower window, or ask for another number of points.",
            )
        return float(branch.alpha1[row]), "lower", float(branch.error[row]), row

    ends = (fold if convention == "delay" else switch, switch)
    return loop_from_states(beta0, convention, "solver", grid, ends, solved, potential, branch)


def _of_a_form(
    beta0: float, convention: Convention, form: NormalForm, lam: tuple[float, float] | None, points: int
) -> HysteresisLoop:
    """Read the states off a normal form."""
    potential = form.at(beta0)
    fold, at_fold = potential.fold()
    switch = potential.maxwell()[0] if convention == "maxwell" else 0.0
    if convention == "delay":
        potential.delay()  # an error here says how far the form reaches
    grid = _grid(_window(lam, fold), fold, switch, points)

    def solved(value: float) -> State:
        if value == fold and beta0 > 0.0:
            return at_fold, "lower", np.nan, -1
        below = [x for x in potential.alpha1(value) if x < at_fold]
        if not below:
            raise NoEquilibrium(
                f"the curve of this form ends before lambda = {value:.6g} at beta0 = {beta0:g}.",
                remedy="Sweep a narrower window with lam=(low, high).",
            )
        return float(below[-1]), "lower", np.nan, -1

    ends = (fold if convention == "delay" else switch, switch)
    return loop_from_states(beta0, convention, form.kind, grid, ends, solved, potential, None)


def _window(lam: tuple[float, float] | None, fold: float) -> tuple[float, float]:
    """Return the swept window; it must hold the whole loop."""
    if lam is None:
        return (WINDOW[0] * -fold, WINDOW[1] * -fold) if fold else WINDOW_AT_ZERO
    low, high = pair("lam", lam)
    if not (-PI4 <= low < fold <= 0.0 < high):
        raise InvalidInput(
            f"the window ({low:g}, {high:g}) of lambda does not hold the loop.",
            remedy=f"Start between -pi^4 and {fold:.6g}, the fold, and end above 0.",
        )
    return low, high


def _grid(window: tuple[float, float], fold: float, switch: float, points: int) -> np.ndarray:
    """Values swept: even, with the fold, the jumps and lambda = 0 among them."""
    return np.unique([*np.linspace(*window, points), fold, switch, 0.0])


def _same(fold: float) -> float:
    """How close two values of lambda must be to count as one."""
    return max(1e-9 * abs(fold), 1e-12)
