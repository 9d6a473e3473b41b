"""`trace`: whole curves of equilibria, walked, checked point by point and labelled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np

from ..base.checks import known_beta0, pair, positive, whole
from ..base.errors import InvalidInput, NotConverged, OutOfRange
from ..base.threads import one_thread
from ..continuation.charted import is_coarse
from ..continuation.family import Family, StepControl
from ..continuation.fill import filled, point_errors
from ..continuation.goal import below_zero, left_for_good
from ..continuation.interpolant import diagram
from ..continuation.landing import UNFINISHED, asked_at, points_at, require_met, with_asked
from ..continuation.points import Point
from ..continuation.primary import PrimaryBranch
from ..continuation.special import EVENTS, ON_CHARTS, locate
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4
from ..model.rod import Rod, require_rod
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.discretisation import Transcription, require_transcription
from ..residual.meshes import TRACED
from .assembly import WalkedSide, assemble, describe, require_identity
from .branch import Branch
from .branch_parts import Trivial
from .question import known_law
from .scene_trace import trace_scene

#: Share of ``tol`` to which some points of the walk must be accurate, by whether the law has kinks.
SHARE = (0.01, 0.3)

#: Steps of the walk; the points between are filled in.
WALK = StepControl(first=0.05, largest=0.25)

#: Least number of points of the walk after which it is given up.
LONGEST = 400

#: End of the furthest window of lambda.
MOST_LAMBDA = 1e10

#: Highest mode; the straight rod is searched for as many branch points.
MOST_MODES = 99


@one_thread
def trace(
    rod: Rod | Scene | None = None,
    *,
    beta0: float | None = None,
    lam: tuple[float, float] = (-PI4, 10.0),
    law: str | CohesiveLaw | None = None,
    mode: int = 1,
    points: int = 128,
    at: Mapping[str, Sequence[float]] | None = None,
    transcription: Transcription | None = None,
    tol: float = 1e-10,
) -> Branch:
    """Trace a branch of detached equilibria with its special points.

    Parameters
    ----------
    rod : Rod or Scene, optional
        Trace the rod's primary branch, from T over all its folds until the tip touches the
        plate; under the linear law, which for eta/y0 > 0.4319 has no end, until p < 0.
        Either this or ``beta0``.  Of a `Scene` its branch, from T or from its lifted states on; a scene
        has its own law, and takes ``points`` and ``tol`` only.
    beta0 : float, optional
        Trace the branch through T at this beta0, 0 or from 1e-12 to 1e12, in both directions; the
        straight rod is beside it as ``trivial``.
    lam : tuple of float
        Window of lambda for ``beta0``: the branch is followed until it leaves the window for
        good.  Only points inside are returned; where it leaves and comes back, the branch has
        ``pieces``, which end on the border exactly.
    law : str or CohesiveLaw, optional
        Default: law (8) for a rod, the linear law at fixed beta0.
    mode : int
        2, 3, ... up to 99 for the branches from beta1 = (mode pi)^4.
    points : int
        Least number of points; curved parts and special points add some.
    at : dict, optional
        Values at which points must lie exactly, such as ``{"pressure_ratio": [0.5, 0.2]}``.
        What lies outside the window does not count.
    transcription : Transcription, optional
        Default: the spectral form with as many nodes as ``tol`` needs.
    tol : float
        Largest error of a point, in the metric of the arclength, but for what rounding adds:
        that shows for eta/y0 above some hundreds and p below T0/1000.  ``error`` has both.

    Returns
    -------
    Branch

    Raises
    ------
    InvalidInput
        If the arguments do not say what to trace, or the branch does not enter the window.
    OutOfRange
        For a ``beta0`` or a window of lambda outside its range.
    NoEquilibrium
        If the branch takes a value of ``at`` nowhere.
    NotConverged
        If the branch cannot be started, is not accurate to ``tol`` with the finest mesh, or a value of
        ``at`` is not met on a branch that could not be followed to its end.

    Examples
    --------
    >>> br = trace(beta0=4, lam=(-1, 3))
    >>> fold = br.special("LP-lambda")[0]
    >>> round(fold.lam, 10), round(fold.alpha1, 9)
    (-0.2690010883, -1.394282025)
    """
    if (rod is None) == (beta0 is None):
        raise InvalidInput("give either a rod or beta0 to trace.")
    if isinstance(rod, Scene):
        others = (law, at, transcription, None if mode == 1 else mode)
        return trace_scene(rod, whole("points", points, 2), positive("tol", tol), others)
    named = known_law(("linear" if rod is None else "cohesive") if law is None else law)
    chosen = COHESIVE if named is None else named
    mode = whole("mode", mode, 1, MOST_MODES)
    points = whole("points", points, 2)
    tol = positive("tol", tol)
    window, asked = _window(lam), asked_at(at)
    if rod is not None:
        closure, sides = Closure("ratio", require_rod(rod).ratio), [1]
    else:
        closure, sides = Closure("length", math.cbrt(known_beta0(beta0))), [-1, 1]
        if closure.value == 0.0 and not chosen.is_affine:
            raise InvalidInput(
                "beta0 = 0 has no strength, hence no cohesive law.", remedy="Use law='linear'."
            )

    def family(mesh: Transcription) -> Family:
        # The tip stays on the plate along the branches of even modes.
        return Family(chosen, mesh, closure, tip_free=mode % 2 == 1)

    def begun(mesh: Transcription) -> list[PrimaryBranch]:
        longest = max(LONGEST, 20 * points)
        return [PrimaryBranch(family(mesh), side, mode, WALK, longest, least=points) for side in sides]

    options: dict[str, object] = {"mode": mode, "points": points, "tol": tol}
    if rod is None:
        options["lam"] = list(window)
    kinked = len(chosen.pieces) > 1
    share = SHARE[kinked] * tol
    meshes = TRACED[kinked] if transcription is None else (require_transcription(transcription),)
    border = window if rod is None else None
    drafts = _walks(begun, meshes, border, share, asked, points)
    if rod is None and mode == 1:
        drafts = chain(_interpolated([family(mesh) for mesh in meshes], window, share, asked, points), drafts)
    for draft in drafts:
        require_met(asked, draft.met, draft.unfinished)
        cut = rod is None and all(part.ended == "window" for part in draft.parts)
        ended = "window" if cut else draft.parts[-1].ended or "p < 0"
        branch = assemble(draft.parts, rod, ended, options)
        reached = float(branch.error.max())
        within = tol + 4.0 * draft.rounding
        if reached <= within:
            break
    else:
        raise NotConverged(
            f"the branch is accurate to {reached:.1e} only, asked for {tol:.1e}.",
            remedy="Give a larger tol, or a finer transcription.",
        )
    require_identity(branch, within)
    if rod is not None:
        return branch
    return replace(branch, trivial=_trivial(closure, window, points))


def _window(lam: tuple[float, float]) -> tuple[float, float]:
    low, high = pair("lam", lam)
    if not -PI4 <= low < high:
        raise InvalidInput(f"the window of lambda must rise and lie above -pi^4, got ({low:g}, {high:g}).")
    if high > MOST_LAMBDA:
        raise OutOfRange(
            f"lambda up to {high:.4g} is beyond {MOST_LAMBDA:g}, and no branch is followed so far.",
            remedy="Give a window that ends sooner.",
        )
    return low, high


class Draft(NamedTuple):
    """A branch that may be accurate enough.

    Its parts, which of the asked-for values they meet, why a part ended that goes on, and what rounding does
    to a point at most.
    """

    parts: list[WalkedSide]
    met: set[tuple[str, float]]
    unfinished: str
    rounding: float


def _interpolated(
    families: Sequence[Family],
    window: tuple[float, float],
    tol: float,
    asked: Sequence[tuple[str, float]],
    points: int,
) -> Iterator[Draft]:
    """Yield the branch as one interpolant, if it is one."""
    found = diagram(families, window, points, tol)
    if found is None:
        return
    parts, met = [], set()
    for own, special in found.sections:
        every, specials, here = with_asked(found.family, own, special, asked)
        parts.append(WalkedSide(found.family, every, specials, found.state_at, "window"))
        met |= here
    yield Draft(parts, met, "", found.rounding)


def _walks(
    begun: Callable[[Transcription], list[PrimaryBranch]],
    meshes: Sequence[Transcription],
    window: tuple[float, float] | None,
    tol: float,
    asked: Sequence[tuple[str, float]],
    points: int,
) -> Iterator[Draft]:
    """Yield the branch as it is walked on meshes that may be fine enough.

    Raises
    ------
    InvalidInput
        If it does not enter the window.
    """
    for walks, rounding in _walked(begun, meshes, window, tol):
        inside = [(w, *piece) for w in walks for piece in _pieces(w, window)]
        if window is not None and not inside:
            mode = walks[0].mode
            raise InvalidInput(
                f"the branch of mode {mode} does not enter the window ({window[0]:g}, {window[1]:g}) of"
                f" lambda from {(mode**4 - 1) * PI4:.6g}, where it begins.",
                remedy="Give lam= a window that holds its beginning.",
            )
        spacing = sum(piece[-1].arclength - piece[0].arclength for _, piece, _ in inside) / (points - 1)
        finished = [_finished(w, _filled(w, piece, spacing), ended, asked) for w, piece, ended in inside]
        unfinished = next((w.ended for w in walks if w.ended in UNFINISHED), "")
        yield Draft(
            [part for part, _ in finished], set().union(*(met for _, met in finished)), unfinished, rounding
        )


def _walked(
    begun: Callable[[Transcription], list[PrimaryBranch]],
    meshes: Sequence[Transcription],
    window: tuple[float, float] | None,
    tol: float,
) -> Iterator[tuple[list[PrimaryBranch], float]]:
    """Yield walks to the end, and what rounding does to their points, on meshes that may be fine enough."""
    for mesh in meshes:
        walks, last = begun(mesh), mesh is meshes[-1]
        if not last and any(is_coarse(walk.family, tol) for walk in walks):
            continue
        for walk in walks:
            walk.extend(lambda _, w=walk: left_for_good(w, window) if window else below_zero(w))  # type: ignore[misc]
        seen = [point_errors(walk.family, [*walk.points[:-1:3], walk.points[-1]]) for walk in walks]
        if last or not any(errors.gains_by_refinement(tol) for errors in seen):
            yield walks, max(float(errors.rounding.max()) for errors in seen)


def _pieces(walk: PrimaryBranch, window: tuple[float, float] | None) -> list[tuple[list[Point], str]]:
    """Stretches of a walk inside the window, which end on its borders exactly, and why they end."""
    points = walk.points
    if window is None:
        return [(points, walk.ended)]
    borders = [landed for border in window for landed in points_at(walk.family, points, "lam", border)]
    every = sorted([*points, *borders], key=lambda p: p.arclength)
    pieces: list[list[Point]] = []
    for here, there in pairwise(every):
        # lambda is monotone between neighbours, folds and borders being among them.
        if not window[0] <= 0.5 * (here.scalars.lam + there.scalars.lam) <= window[1]:
            continue
        if pieces and pieces[-1][-1] is here:
            pieces[-1].append(there)
        else:
            pieces.append([here, there])
    return [(piece, walk.ended if piece[-1] is points[-1] else "window") for piece in pieces]


def _filled(walk: PrimaryBranch, points: list[Point], spacing: float) -> list[Point]:
    """Put points between those that were walked to; the others lie close together already."""
    known = [p for p in points if p.arclength < walk.points[walk.walked_from].arclength]
    return [*known, *filled(walk.family, points[len(known) :], spacing)]


def _finished(
    walk: PrimaryBranch, points: list[Point], ended: str, asked: Sequence[tuple[str, float]]
) -> tuple[WalkedSide, set[tuple[str, float]]]:
    """Add the special points and asked-for values to the points of a walk."""
    arclengths = (points[0].arclength, points[-1].arclength)
    every = [*walk.folds, *walk.events, *([walk.contact] if walk.contact else [])]
    specials = [f for f in every if arclengths[0] <= f.point.arclength <= arclengths[1]]
    if walk.family.closure.value > 0.0 or walk.family.closure.kind != "length":
        begins = walk.points[walk.walked_from].arclength
        specials += locate(walk.family, [p for p in points if p.arclength >= begins], EVENTS)
        others = [event for event in EVENTS if event[0] not in ON_CHARTS]
        if others:
            specials += locate(walk.family, [p for p in points if p.arclength <= begins], others)
    points, specials, met = with_asked(walk.family, points, specials, asked)
    sign = -1 if walk.side < 0 else 1
    return WalkedSide(walk.family, points, specials, walk.state_at, ended, sign), met


def _trivial(closure: Closure, window: tuple[float, float], points: int) -> Trivial:
    """The straight rod over a window of lambda, with its branch points (18)."""
    low, high = window
    modes = [n for n in range(1, MOST_MODES + 1) if low <= (n**4 - 1) * PI4 <= high]
    lam = np.unique([*np.linspace(low, high, points), *((n**4 - 1) * PI4 for n in modes)])
    specials = []
    for n in modes:
        value = (n**4 - 1) * PI4
        index = int(np.searchsorted(lam, value))
        s = Scalars(0.0, 0.0, closure.value, value)
        specials.append(describe("BP", "exact", (value, value), index, s, error=0.0))
    return Trivial(lam, tuple(specials))
