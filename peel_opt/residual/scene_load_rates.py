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

from ..model.bond import Piece
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of
from ..model.tips import Contact, Middle
from .load_rates import NO_JUMP, LoadRates, Stretching, Switch
from .scene_spectral import SceneDiscretisation
from .scene_system import SAMPLED

#: What a load depends on at a material point, beside the numbers of the scene.
FIELDS = ("theta", "x", "y", "slip", "sbar", "strain")

#: What vanishes at the middle of a strip, of (theta, x, y) there.
TURN, ALONG, ACROSS = (np.eye(3)[i : i + 1] for i in range(3))


def scene_load_rates(problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray) -> LoadRates:
    """Return a state of a scene and the derivatives of its loads, at local coordinates of every phase.

    Places of the attached rod follow, where it lies on an elastic layer.
    """
    scene, q = problem.settings.scene, problem.found(x)
    parts, numbers, sbar = _Parts(scene, tuple(q)), np.array(list(q.values())), problem.scalars(x).sigma
    places, fields = _strained(problem, x, zeta)
    stretches = zip(problem.phases, np.split(places, len(problem.phases)), strict=True)
    loads = [_load(parts, piece)(here.T, numbers) for piece, here in stretches]
    rates = [found[1].full().reshape(2, len(FIELDS), -1, order="F") for found in loads]
    by = np.moveaxis(np.concatenate(rates, axis=2), 2, 0)  # places, components, fields
    by_pressure = np.concatenate([found[2].full() for found in loads], axis=1)
    theta = places[:, 1]
    normal = np.stack([-np.sin(theta), np.cos(theta)]) * (1.0 + places[:, 6])
    encloses = bool(np.abs(by_pressure - normal).max() <= NO_JUMP)
    if problem.beyond:
        lying, held = attached_places(problem, x, zeta)
        by = np.concatenate([by, np.zeros((len(lying), *by.shape[1:]))])
        by[len(places) :, 1, 2] = -q["layer_stiffness"]
        theta = np.concatenate([theta, lying[:, 1]])
        fields = {name: np.concatenate([fields[name], held[name]]) for name in fields}
    tip, (edge, at_edge) = _strained(problem, x, np.zeros(1))[0][0], _strained(problem, x, np.ones(1))
    turned, curl = float(edge[-1, 1]), 0.0
    # Position counts from the front, along a plate: it falls as the front goes on, by what was glued there.
    by_length = by[:, :, 4]
    if problem.beyond:
        by_length = by_length - by[:, :, 1] * np.cos(turned) - by[:, :, 3] * (np.cos(turned) - 1.0)
    elif scene.is_flat:
        by_length = by_length - by[:, :, 1] * (1.0 + q.get("glued_strain", 0.0))
    if scene.line_energy:
        there = scene.front_curvature(float(at_edge["nx"][-1]) / sbar**2, q)
        curl = sbar * float(there - scene.wall.curvature_of(q))
    across = float(at_edge["ny"][-1] * np.cos(turned) - at_edge["nx"][-1] * np.sin(turned))
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
        curl=curl,
        bend=across * (1.0 + float(edge[-1, 6])),
        encloses=encloses,
        stretching=_stretching(problem, parts, (places[:, 6], by[:, :, 5]), edge[-1], numbers),
        attached=problem.attached_lengths(x),
        front=_front(problem, parts, x, numbers) if problem.beyond else None,
    )


def _strained(
    problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return what `places_of` does, with the strain in the last column: all `FIELDS`."""
    places, fields = places_of(problem, x, zeta)
    theta, sbar = places[:, 1], problem.scalars(x).sigma
    thrust = (fields["nx"] * np.cos(theta) + fields["ny"] * np.sin(theta)) / sbar**2
    strain = problem.settings.scene.strain(thrust, problem.found(x))
    return np.column_stack([places, strain]), fields


def _stretching(
    problem: SceneDiscretisation,
    parts: _Parts,
    along: tuple[np.ndarray, np.ndarray],
    edge: np.ndarray,
    numbers: np.ndarray,
) -> Stretching | None:
    """Return what a rod that stretches has more; ``along`` it the strain, and rates of its load by that."""
    if parts.scene.stretch is None:
        return None
    q, sbar = dict(zip(parts.names, numbers.tolist(), strict=True)), float(edge[5])
    load = _load(parts, problem.phases[-1])(edge[:, None], numbers)[0].full()
    return Stretching(
        stiffness=q["stretch"] * sbar**2,
        strain=along[0],
        by_strain=sbar**3 * along[1],
        parted=float(edge[6]) - q["glued_strain"],
        load=sbar**3 * float(load[0, 0]),
    )


def _front(problem: SceneDiscretisation, parts: _Parts, x: np.ndarray, numbers: np.ndarray) -> Switch:
    """Return where the detached rod ends on a layer: the loads on it end, and the bond pulls on."""
    places, fields = _strained(problem, x, np.ones(1))
    last, sbar = len(problem.phases) - 1, float(places[-1, 5])
    before = _load(parts, problem.phases[-1])(places[last][:, None], numbers)[0].full().ravel()
    lying, _ = attached_places(problem, x, np.zeros(1))
    q = dict(zip(parts.names, numbers.tolist(), strict=True))
    after = np.array([0.0, -q["layer_stiffness"] * lying[0, 3]])
    rates, slope = _opens(parts, places[last], float(fields["curvature"][last]), numbers)
    return Switch(last, sbar**3 * (before - after), rates, slope)


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
    s, theta, x, y, slip, sbar, strain = ca.vertsplit(symbols)
    return Place(s, sbar, theta, x, y, slip, past_of(piece) if piece is not None else frozenset(), strain)


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
    places, fields = _strained(problem, x, np.ones(1))
    for j, (before, after) in enumerate(pairwise(problem.phases)):
        here = places[j][:, None]
        jump = (_load(parts, before)(here, numbers)[0] - _load(parts, after)(here, numbers)[0]).full()
        if past_of(before) != past_of(after) or np.abs(jump).max() <= NO_JUMP:
            continue
        rates, slope = _opens(parts, places[j], float(fields["curvature"][j]), numbers)
        yield Switch(j, float(places[j, 5]) ** 3 * jump.ravel(), rates, slope)


def _opens(
    parts: _Parts, place: np.ndarray, curvature: float, numbers: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the rates by theta, x and y of what the bond sees at a place, and along the rod, by xi."""
    _, theta, _, _, _, sbar, strain = place.tolist()
    turn, by_x, by_y, by_slip, *_ = _opening(parts)(place[:, None], numbers).full().ravel().tolist()
    cosine, sine = (1.0 + strain) * np.cos(theta), (1.0 + strain) * np.sin(theta)
    glued = 1.0 + dict(zip(parts.names, numbers.tolist(), strict=True)).get("glued_strain", 0.0)
    along = by_x * cosine + by_y * sine + by_slip * (cosine - glued)
    rates = np.array([turn, sbar * (by_x + by_slip), sbar * by_y])
    return rates, float(turn * curvature + sbar * along)


def places_of(
    problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return s, theta, x, y, slip and sbar over eta, a row a place; curvature and forces over k and sbar."""
    lengths = problem.lengths(x)
    starts = np.cumsum(lengths) - lengths
    xi = (starts[:, None] + lengths[:, None] * zeta).ravel()
    return _places(problem, x, xi, problem.sampler(zeta)(x)[0])


def attached_places(
    problem: SceneDiscretisation, x: np.ndarray, zeta: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the same of the attached rod on its layer, at local coordinates of its stretches."""
    lengths = problem.attached_lengths(x)
    starts = 1.0 + np.cumsum(lengths) - lengths
    xi = (starts[:, None] + lengths[:, None] * zeta).ravel()
    return _places(problem, x, xi, problem.attached_at(x, zeta).reshape(len(xi), len(SAMPLED)))


def _places(
    problem: SceneDiscretisation, x: np.ndarray, xi: np.ndarray, sampled: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    s, own = problem.scalars(x), dict(zip(SAMPLED, sampled.T, strict=True))
    kw = float(problem.settings.scene.wall.curvature_of(problem.found(x))) * s.sigma
    theta = s.A * own["Theta"] + kw * (xi - 1.0)
    place = [s.sigma * part for part in (own["x"], s.A * own["Y"], own["slip"])]
    places = np.stack([s.sigma * xi, theta, *place, np.full_like(xi, s.sigma)], axis=1)
    return places, {"curvature": s.A * own["K"] + kw, "nx": s.A * own["nx"], "ny": s.A * own["ny"]}
