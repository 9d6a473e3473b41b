"""Rates of the loads of any scene, by automatic differentiation of its parts.

A load knows its `Place`: position and slip count from the front, and a load may stretch with the
detached length.  On a curved wall a force keeps its direction as the front moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput
from ..model.bond import Piece
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of
from ..model.tips import Contact, Middle
from .load_rates import NO_JUMP, LoadRates, Switch
from .scene_spectral import SceneDiscretisation
from .scene_system import SAMPLED

#: What a load depends on at a material point, beside the numbers of the scene.
FIELDS = ("theta", "x", "y", "slip", "sbar")

#: What vanishes at the middle of a strip, of (theta, x, y) there.
TURN, ALONG, ACROSS = (np.eye(3)[i : i + 1] for i in range(3))


def scene_load_rates(problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray) -> LoadRates:
    """Return a state of a scene and the derivatives of its loads, at local coordinates of every phase.

    Raises
    ------
    InvalidInput
        If the rod stretches, or lies on an elastic layer.
    """
    scene, q = problem.settings.scene, problem.found(x)
    if scene.stretch is not None or scene.layer is not None:
        raise InvalidInput(
            "small motions are those of a rod that does not stretch, glued where nothing gives way:"
            " stability does not cover this scene.",
            remedy="Leave out stretch= where it is large, or take law (8), the limit of a stiff layer.",
        )
    parts, numbers, sbar = _Parts(scene, tuple(q)), np.array(list(q.values())), problem.scalars(x).sigma
    places, fields = places_of(problem, x, zeta)
    stretches = zip(problem.phases, np.split(places, len(problem.phases)), strict=True)
    loads = [_load(parts, piece)(here.T, numbers) for piece, here in stretches]
    rates = [found[1].full().reshape(2, len(FIELDS), -1, order="F") for found in loads]
    by = np.moveaxis(np.concatenate(rates, axis=2), 2, 0)  # places, components, fields
    by_pressure = np.concatenate([found[2].full() for found in loads], axis=1)
    # Position counts from the front, along a plate: it falls as the front goes on.
    by_length = by[:, :, 4] - (by[:, :, 1] if scene.is_flat else 0.0)
    tip, edge = places_of(problem, x, np.zeros(1))[0][0], places_of(problem, x, np.ones(1))
    theta, at_edge = places[:, 1], float(edge[0][-1, 1])
    normal = np.stack([-np.sin(theta), np.cos(theta)])
    return LoadRates(
        theta,
        fields["nx"],
        fields["ny"],
        by_theta=sbar**3 * by[:, :, 0],
        # Slip and position are one displacement.
        by_place=sbar**4 * np.stack([by[:, :, 1] + by[:, :, 3], by[:, :, 2]], axis=2),
        by_length=sbar**4 * by_length if np.any(by_length) else None,
        switches=tuple(_switches(problem, parts, x, numbers)),
        holds=_holds(parts, tip, numbers),
        tip=sbar**3 * q["reaction"] * _normal(parts, tip, numbers)[1] if _rests(scene) else None,
        curl=sbar * float(np.sqrt(2.0 * q["line_energy"])) if scene.line_energy else 0.0,
        bend=float(edge[1]["ny"][-1] * np.cos(at_edge) - edge[1]["nx"][-1] * np.sin(at_edge)),
        encloses=bool(np.abs(by_pressure - normal).max() <= NO_JUMP),
    )


@dataclass(frozen=True)
class _Parts:
    """A scene as far as its compiled loads are concerned: scenes of one form share them."""

    scene: Scene = field(compare=False)
    names: tuple[str, ...]
    form: Any = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "form", self.scene.form)

    def symbols(self) -> tuple[ca.SX, ca.SX, dict[str, Any]]:
        """Return a place as s and `FIELDS`, and the numbers of the scene, also by name."""
        place, numbers = ca.SX.sym("place", 1 + len(FIELDS)), ca.SX.sym("q", len(self.names))
        return place, numbers, dict(zip(self.names, ca.vertsplit(numbers), strict=True))


def _place(symbols: ca.SX, piece: Piece | None = None) -> Place:
    s, theta, x, y, slip, sbar = ca.vertsplit(symbols)
    return Place(s, sbar, theta, x, y, slip, past_of(piece) if piece is not None else frozenset())


@lru_cache(maxsize=128)
def _load(parts: _Parts, piece: Piece) -> Callable[[np.ndarray, np.ndarray], list[ca.DM]]:
    """Compiled (places, numbers) -> the load, its rates by `FIELDS` and by the pressure, at each place."""
    place, numbers, q = parts.symbols()
    load = ca.vertcat(*parts.scene.per_length(_place(place, piece), piece, q))
    rates = ca.vec(ca.densify(ca.jacobian(load, place[1:])))
    by_pressure = ca.densify(ca.jacobian(load, q["pressure"]))
    one = ca.Function("load", [place, numbers], [ca.densify(load), rates, by_pressure])

    def at(places: np.ndarray, values: np.ndarray) -> list[ca.DM]:
        count = places.shape[1]
        found: list[ca.DM] = one.map(count)(places, np.tile(values[:, None], count))
        return found

    return at


@lru_cache(maxsize=128)
def _opening(parts: _Parts) -> ca.Function:
    """Compiled (place, numbers) -> rates by `FIELDS` of what the bond sees."""
    place, numbers, q = parts.symbols()
    opening = parts.scene.opening(_place(place), q)
    return ca.Function("opening", [place, numbers], [ca.densify(ca.jacobian(opening, place[1:]))])


@lru_cache(maxsize=128)
def _wall(parts: _Parts) -> ca.Function:
    """Compiled (place, numbers) -> the normal of the wall, and its rates by x and y."""
    place, numbers, q = parts.symbols()
    _, nx, ny = parts.scene.wall.gap(_place(place), q)
    normal = ca.vertcat(nx, ny)
    return ca.Function(
        "wall", [place, numbers], [ca.densify(normal), ca.densify(ca.jacobian(normal, place[2:4]))]
    )


def _normal(parts: _Parts, place: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal of the wall at a place, shape (2,), and its rates by x and y."""
    normal, rates = _wall(parts)(place, numbers)
    return normal.full().ravel(), rates.full()


def _rests(scene: Scene) -> bool:
    return isinstance(scene.tip, Contact)


def _holds(parts: _Parts, tip: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return what vanishes at the tip in each kind of motions.

    A tip on its wall stays there.  A strip moves symmetrically about its middle, with ends that slide in
    or a distance between them that stays, or so that one half is the mirror image of the other, upside down.
    """
    if _rests(parts.scene):
        return (np.append(0.0, _normal(parts, tip, numbers)[0])[None],)
    if isinstance(parts.scene.tip, Middle):
        symmetric = TURN if parts.scene.tip.slack is None else np.vstack([TURN, ALONG])
        return symmetric, ACROSS
    return (np.zeros((0, 3)),)


def _switches(
    problem: SceneDiscretisation, parts: _Parts, x: np.ndarray, numbers: np.ndarray
) -> Iterator[Switch]:
    """Yield the places where the load jumps that move with the shape: kinks of the bond."""
    places, fields = places_of(problem, x, np.ones(1))
    for j, (before, after) in enumerate(pairwise(problem.phases)):
        here = places[j][:, None]
        jump = (_load(parts, before)(here, numbers)[0] - _load(parts, after)(here, numbers)[0]).full()
        if past_of(before) != past_of(after) or np.abs(jump).max() <= NO_JUMP:
            continue
        _, theta, _, _, _, sbar = places[j]
        turn, by_x, by_y, by_slip, _ = _opening(parts)(here, numbers).full().ravel()
        cosine, sine = np.cos(theta), np.sin(theta)
        along = by_x * cosine + by_y * sine + by_slip * (cosine - 1.0)
        rates = np.array([turn, sbar * (by_x + by_slip), sbar * by_y])
        slope = turn * fields["curvature"][j] + sbar * along
        yield Switch(j, sbar**3 * jump.ravel(), rates, float(slope))


def places_of(
    problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return s and `FIELDS` over eta, a row for each place, and curvature and forces over k and sbar."""
    s, lengths = problem.scalars(x), problem.lengths(x)
    own = dict(zip(SAMPLED, problem.sampler(zeta)(x).full().T, strict=True))
    starts = np.cumsum(lengths) - lengths
    xi = (starts[:, None] + lengths[:, None] * zeta).ravel()
    kw = float(problem.settings.scene.wall.curvature_of(problem.found(x))) * s.sigma
    theta = s.A * own["Theta"] + kw * (xi - 1.0)
    place = [s.sigma * part for part in (own["x"], s.A * own["Y"], own["slip"])]
    places = np.stack([s.sigma * xi, theta, *place, np.full_like(xi, s.sigma)], axis=1)
    return places, {"curvature": s.A * own["K"] + kw, "nx": s.A * own["nx"], "ny": s.A * own["ny"]}
