"""The energies of one state of a scene, load by load, and what has none.

A load that keeps its direction, and whose force is a gradient, has a potential: minus the work it does as
the material goes from where it was glued to where it is, on an elastic layer from where it came off.  What
turns with the rod has none.  Everything is per unit width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput
from ..base.quadrature import gauss
from ..base.threads import one_thread
from ..equilibria.result import Equilibrium
from ..equilibria.scenes import solve
from ..model.dimension import ENERGY, MOMENT
from ..model.loads import Load
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of
from ..model.tips import Middle, TipLoad
from ..residual.scene_load_rates import attached_places, places_of
from ..residual.scene_spectral import SceneDiscretisation
from ..residual.shape import Solution
from ..residual.solved_again import solved_again

#: Gauss points per stretch of the rod, and along the way from where a point was glued to where it is.
POINTS, WAY = 32, 12

#: The energies that belong to the rod and its bond.
OWN = ("bending", "stretch", "glued", "separation", "front")

#: What rounding leaves of an energy.
ROUNDING = 1e-14

#: A rate of a force over T0 up to here is rounding.
CONSERVED = 1e-9


@dataclass(frozen=True)
class EnergyTerms:
    """Energies of a state per width, in the units of its rod: N, or T0 eta^2.

    Parameters
    ----------
    bending : float
        k/2 int (theta' - kappa_n)^2 along the detached part; on an elastic layer with what the attached part
        has more than one that lies flat.
    stretch : float
        EA/2 int eps^2 along it, of a rod that stretches.
    glued : float
        What the same stretch of rod had while it lay on its wall, which it brings along.
    separation : float
        Work done against the bond; on an elastic layer along the attached part, too.
    front : float
        Line energy times the detached length.
    potential : dict of float
        By the name of each load and of the tip, as far as they are conservative.
    non_conservative : tuple of str
        What has no potential: the work it does depends on the way.
    work : dict of float
        What each load puts into the first integral, in J/m^2 or T0 eta: with that of the tip and with
        (k/2) (theta'(0) - kw)^2 it is the work of separation at the tip and the line energy.  Empty where
        the rod stretches or its wall is curved.
    error : float
        Largest error of an energy.
    unit : str
        Of the energies.
    """

    bending: float
    stretch: float
    glued: float
    separation: float
    front: float
    potential: dict[str, float]
    non_conservative: tuple[str, ...]
    work: dict[str, float]
    error: float
    unit: str

    @property
    def total(self) -> float:
        """All energies less what the glued rod has, stationary at an equilibrium.

        Raises
        ------
        InvalidInput
            If some load has no potential.
        """
        if self.non_conservative:
            raise InvalidInput(
                f"there is no total energy: {', '.join(self.non_conservative)} has no potential.",
                remedy="Its terms bending, separation and potential are there by themselves.",
            )
        own = self.bending + self.stretch - self.glued + self.separation + self.front
        return own + sum(self.potential.values())

    def __repr__(self) -> str:
        lines = [f"{name} {getattr(self, name):.9g}" for name in OWN]
        lines += [f"potential of the {name} {value:.9g}" for name, value in self.potential.items()]
        lines += [f"no potential: {name}" for name in self.non_conservative]
        tree = [f"├─ {line}" for line in lines]
        return "\n".join([f"{type(self).__name__} [{self.unit}]", *tree, f"└─ error {self.error:.0e}"])


@one_thread
def energy_terms(eq: Equilibrium) -> EnergyTerms:
    """Return the energies of a state of a rod or a scene.

    Raises
    ------
    InvalidInput
        If it is of no rod, or carries no discrete solution.
    NotConverged
        If it cannot be solved again on a finer mesh, to tell the error.
    """
    state = _in_a_scene(eq)
    source = state.source
    assert isinstance(source, Solution)
    assert isinstance(source.problem, SceneDiscretisation)
    problem, x = solved_again(source.problem, source.x, state.asked_at)
    assert isinstance(problem, SceneDiscretisation)
    rough, fine = _read(source.problem, source.x, POINTS), _read(problem, x, 2 * POINTS)
    apart = [abs(getattr(fine, name) - getattr(rough, name)) for name in OWN]
    apart += [abs(fine.potential[name] - rough.potential[name]) for name in fine.potential]
    rod = state.scene.rod if isinstance(state.scene, Scene) else state.rod
    assert rod is not None
    energy = MOMENT.size(rod)
    per_area = ENERGY.size(rod)
    size = fine.bending + fine.stretch + fine.separation + sum(map(abs, fine.potential.values()))
    return replace(
        fine,
        **{name: getattr(fine, name) * energy for name in OWN},
        potential={name: value * energy for name, value in fine.potential.items()},
        work={name: value * per_area for name, value in fine.work.items()},
        error=(max(apart) + ROUNDING * size) * energy,
        unit=MOMENT.unit_of(rod),
    )


def _in_a_scene(eq: Equilibrium) -> Equilibrium:
    """Return a state with the loads of its scene; that of a plain rod in the paper's."""
    if eq.rod is None:
        raise InvalidInput("energies are those of a rod.", remedy="Ask for the state of a Rod or a Scene.")
    if not isinstance(eq.source, Solution):
        raise InvalidInput(
            "this equilibrium carries no discrete solution to integrate.",
            remedy="Compute it again; files and other processes keep the shape only.",
        )
    if isinstance(eq.scene, Scene):
        return eq
    scene = Scene(eq.rod, law=eq.source.law)
    if eq.answered == "length_ratio":
        return solve(scene, free="length", pressure=eq.pressure, near=eq.length)
    return solve(scene, free="pressure", length=eq.length, near=eq.pressure)


def _read(problem: SceneDiscretisation, x: np.ndarray, points: int) -> EnergyTerms:
    """Return the energies of a discrete state over T0 eta^2, without their error."""
    scene, q, sbar = problem.settings.scene, problem.found(x), problem.scalars(x).sigma
    nodes, weights = gauss(points)
    places, shape = places_of(problem, x, nodes)
    share = np.kron(problem.lengths(x), weights)
    kn, kw = q.get("natural_curvature", 0.0), float(scene.wall.curvature_of(q))
    EA, strain = _stretched(places, shape, q)
    potential, lost, work = _of_loads(problem, places, share * sbar, q)
    tip = problem.ends(x)[0]
    if problem.beyond:  # the front itself has come along by what the attached rod turns
        far = float(attached_places(problem, x, np.ones(1))[0][-1, 4])
        tip = replace(tip, slip=tip.slip - far)
    potential |= _of_the_tip(scene, tip, q)
    bent, pulled = _of_the_attached(problem, x, nodes, weights, q)
    return EnergyTerms(
        bending=float(share @ (shape["curvature"] - kn * sbar) ** 2) / (2.0 * sbar) + bent,
        stretch=0.5 * EA * sbar * float(share @ strain**2),
        glued=0.5 * sbar * ((kw - kn) ** 2 + EA * q.get("glued_strain", 0.0) ** 2),
        separation=float((share * sbar) @ _separated(problem, places, q)) + pulled,
        front=q.get("line_energy", 0.0) * sbar,
        potential=potential,
        non_conservative=lost,
        work=work,
        error=np.nan,
        unit="",
    )


def _of_the_attached(
    problem: SceneDiscretisation, x: np.ndarray, nodes: np.ndarray, weights: np.ndarray, q: dict[str, float]
) -> tuple[float, float]:
    """Return bending and the energy of the layer along the attached rod, over those of one that lies flat."""
    if not problem.beyond:
        return 0.0, 0.0
    places, shape = attached_places(problem, x, nodes)
    share, sbar = np.kron(problem.attached_lengths(x), weights), places[0, 5]
    turned, kn = shape["curvature"], q.get("natural_curvature", 0.0) * sbar
    bent = float(share @ (turned**2 - 2.0 * kn * turned)) / (2.0 * sbar)
    return bent, 0.5 * q["layer_stiffness"] * sbar * float(share @ places[:, 3] ** 2)


def _stretched(
    places: np.ndarray, shape: dict[str, np.ndarray], q: dict[str, float]
) -> tuple[float, np.ndarray]:
    """Return EA over T0 eta and the strain -N.t/EA; both zero where the rod does not stretch."""
    theta, sbar, EA = places[:, 1], places[0, 5], q.get("stretch", 0.0)
    pull = -(shape["nx"] * np.cos(theta) + shape["ny"] * np.sin(theta)) / sbar**2
    return EA, pull / EA if EA else 0.0 * pull


def _separated(problem: SceneDiscretisation, places: np.ndarray, q: dict[str, float]) -> np.ndarray:
    """Work of separation per length, zero where nothing was glued."""
    scene, r = problem.settings.scene, q["ratio"]
    found = []
    for phase, here in zip(problem.phases, np.split(places, len(problem.phases)), strict=True):
        glued = not scene.unbonded or "unbonded" in past_of(phase)
        for row in here if glued else []:
            at = _at(row, past_of(phase))
            gap = float(scene.wall.gap(at, q)[0])
            found.append(scene.bond.potential(gap * r, float(at.slip) * r, q) / r)
        found += [] if glued else [0.0] * len(here)
    return np.array(found)


def _at(row: np.ndarray, past: frozenset[str]) -> Place:
    s, theta, x, y, slip, sbar = row.tolist()
    return Place(s, sbar, theta, x, y, slip, past)


def _of_loads(
    problem: SceneDiscretisation, places: np.ndarray, lengths: np.ndarray, q: dict[str, float]
) -> tuple[dict[str, float], tuple[str, ...], dict[str, float]]:
    """Return the potentials of all loads, what has none, and what each puts into the first integral."""
    scene, count = problem.settings.scene, len(problem.phases)
    way = _moved(places, float(scene.wall.curvature_of(q)))
    if scene.layer is not None:  # loads act from where the detached rod begins, at a gap of T0/K
        way[:, 7] += 1.0 / q["layer_stiffness"]
        way[:, 9] -= 1.0 / q["layer_stiffness"]
    potential: dict[str, float] = {}
    lost: dict[str, str] = {}
    work: dict[str, float] = {}
    for load in scene.loads:
        name, energy, put = type(load).__name__, 0.0, 0.0
        for phase, here, share, ways in zip(
            problem.phases, *(np.split(part, count) for part in (places, lengths, way)), strict=True
        ):
            field = _Field(load, q, past_of(phase))
            if field.turns(here):
                lost.setdefault(name, f"{name}, as it turns with the rod")
            if not field.is_gradient(here):
                lost[name] = f"{name}, whose force is no gradient"
            elif scene.layer is not None and field.pulls_along(here):
                lost[name] = f"{name}, which begins to pull along the wall where the rod comes off"
            elif scene.stretch is not None and load.on_stretched and np.any(field.along(ways)):
                lost[name] = f"{name}, whose force is no gradient as it goes with the stretch"
            energy -= float(share @ field.along(ways))
            put += float(share @ field.put(here))
        if energy and not any(word in lost.get(name, "") for word in ("gradient", "along the wall")):
            potential[name] = energy
        if scene.has_identity and scene.is_flat and scene.stretch is None:
            work[name] = put
    return potential, tuple(lost.values()), work


def _moved(places: np.ndarray, kw: float) -> np.ndarray:
    """Return, for each place, where its material was glued and how far it has come: x, y, dx, dy."""
    s, x, y, slip, sbar = (places[:, i] for i in (0, 2, 3, 4, 5))
    if kw == 0.0:
        return np.concatenate([places, np.stack([x - slip, 0.0 * y, slip, y], axis=1)], axis=1)
    turned = kw * (s - sbar)
    there = np.stack([np.sin(turned) / kw, 2.0 * np.sin(0.5 * turned) ** 2 / kw], axis=1)
    return np.concatenate([places, there, np.stack([x, y], axis=1) - there], axis=1)


class _Field:
    """The force of one load on one stretch of the rod, over T0."""

    def __init__(self, load: Load, q: dict[str, float], past: frozenset[str]) -> None:
        row = ca.SX.sym("place", 6)
        s, theta, x, y, slip, sbar = ca.vertsplit(row)
        at = Place(s, sbar, theta, x, y, slip, past)
        force = load.force(at, q)
        fixed = ca.vertcat(force.x, force.y)
        rates = ca.jacobian(fixed, row)
        by_theta, by_x, by_y = rates[:, 1], rates[:, 2] + rates[:, 4], rates[:, 3]
        rotation = ca.vertcat(by_theta, by_x[1] - by_y[0])
        outputs = [ca.vertcat(force.normal, force.tangential), fixed, rotation, load.work(at, q)]
        self._of = ca.Function("field", [row], [ca.densify(ca.SX(part)) for part in outputs])

    def _at(self, rows: np.ndarray, which: int) -> np.ndarray:
        found: np.ndarray = self._of.map(len(rows))(rows.T)[which].full()
        return found

    def turns(self, rows: np.ndarray) -> bool:
        """Whether a part of it keeps its direction to the rod, not to the wall."""
        return bool(np.abs(self._at(rows, 0)).max() > CONSERVED)

    def is_gradient(self, rows: np.ndarray) -> bool:
        """Whether the rest depends on the place alone, and its work not on the way."""
        return bool(np.abs(self._at(rows, 2)).max() <= CONSERVED)

    def pulls_along(self, rows: np.ndarray) -> bool:
        """Whether the rest has a part along the wall."""
        return bool(np.abs(self._at(rows, 1)[0]).max() > CONSERVED)

    def along(self, ways: np.ndarray) -> np.ndarray:
        """Work of the rest from where the material was glued to where it is, straight on."""
        places, start, way = ways[:, :6], ways[:, 6:8], ways[:, 8:]
        total = np.zeros(len(ways))
        for share, weight in zip(*gauss(WAY), strict=True):
            rows = places.copy()
            rows[:, 2:4] = start + share * way
            rows[:, 4] = share * places[:, 4]
            total += weight * np.sum(self._at(rows, 1).T * way, axis=1)
        return total

    def put(self, rows: np.ndarray) -> np.ndarray:
        """What it puts into the first integral, per length."""
        return self._at(rows, 3).ravel()


def _of_the_tip(scene: Scene, tip: Place, q: dict[str, float]) -> dict[str, float]:
    """Return the potentials of a force and a moment on the tip; a wall or a slack does no work."""
    if isinstance(scene.tip, TipLoad):
        moment = -q.get("moment", 0.0) * float(tip.theta)
    elif isinstance(scene.tip, Middle) and scene.tip.slack is None:
        moment = 0.0
    else:
        return {}
    row = np.array([[0.0, tip.theta, tip.x, tip.y, tip.slip, tip.sbar]], dtype=float)
    way = _moved(row, float(scene.wall.curvature_of(q)))[0, 8:]
    force = np.array([float(part) for part in scene.tip_force(tip, q)])
    found = {"tip": moment - float(force @ way)}
    return {name: value for name, value in found.items() if value}
