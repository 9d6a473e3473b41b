"""The spectral transcription of a scene: its equations compiled once for all scenes of one form."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Self

import casadi as ca
import numpy as np

from ..model.equations import Scalars
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of
from .defect import Tip, march
from .discretisation import PROFILE_POINTS, Discretisation, Phases, Profile, Transcription, chebyshev
from .meshes import SCENES
from .scene_fields import SceneFields
from .scene_system import REACHES, SAMPLED
from .shape import DENSE_POINTS, Shape, Solution, sample_shape
from .spectral import Spectral, SpectralDiscretisation

#: Forms whose equations stay compiled.
MOST_COMPILED = 64


@dataclass(frozen=True, eq=False)
class SceneProfile(Profile):
    """Fields of one solution of a scene, which alone knows what the bond sees of them.

    Parameters
    ----------
    values : ndarray, shape (phases, PROFILE_POINTS, 7)
        Those of a `Profile`, x/sbar and slip/sbar.
    scene : Scene
    numbers : dict
        All its numbers, those left free as they were found.
    attached : ndarray, shape (stretches, PROFILE_POINTS, 7)
        The same fields of the attached rod, where it lies on an elastic layer.
    """

    scene: Scene
    numbers: dict[str, float]
    attached: np.ndarray = field(default_factory=lambda: np.zeros((0, PROFILE_POINTS, len(SAMPLED))))

    @property
    def angle_at_plate(self) -> float:
        """theta less that of the wall where the rod lies on it [rad]; on a layer, where all has decayed."""
        return float(self.scalars.A * (self.attached if len(self.attached) else self.values)[-1, -1, 0])

    def heights(self) -> np.ndarray:
        """What the bond sees, on the points of each phase: for most bonds the gap over y0."""
        return self._openings(self.values, self.coordinates())

    def heights_at(self, xi: np.ndarray) -> np.ndarray:
        """What the bond sees, at coordinates 0 <= xi <= 1 from the tip."""
        return self._openings(self.at(xi), xi)

    def gaps(self) -> np.ndarray:
        """Gap to the wall over eta, on the points of each phase."""
        at = self._places(self.values, self.coordinates())
        return np.asarray(self.scene.wall.gap(at, self.numbers)[0], dtype=float)

    def _openings(self, fields: np.ndarray, xi: np.ndarray) -> np.ndarray:
        return np.asarray(self.scene.opening(self._places(fields, xi), self.numbers), dtype=float)

    def _places(self, fields: np.ndarray, xi: np.ndarray) -> Place:
        s, q = self.scalars, self.numbers
        Theta, _, _, _, Y, x, slip = np.moveaxis(fields, -1, 0)
        theta = s.A * Theta + float(self.scene.wall.curvature_of(q)) * s.sigma * (xi - 1.0)
        return Place(xi * s.sigma, s.sigma, theta, x * s.sigma, s.sigma * s.A * Y, slip * s.sigma)


@dataclass(frozen=True)
class SceneTranscription(Transcription):
    """A way to discretise a scene.

    Parameters
    ----------
    scene : Scene
    mesh : Transcription
        The same way for the paper's scene, with its settings.
    free : str, optional
        The number of the scene that is unknown.
    entered : float
        How far the scene has taken over from the paper's, 0 to 1.
    instead : tuple of (str, float)
        Numbers in place of the scene's own, on the way into it.
    """

    scene: Scene
    mesh: Any
    free: str | None = None
    entered: float = 1.0
    instead: tuple[tuple[str, float], ...] = ()

    @property
    def unknown(self) -> tuple[str, ...]:
        """Names of the numbers that are unknown: reactions, and the one that is left free."""
        return (*self.scene.reactions, *((self.free,) if self.free else ()))

    @property
    def given(self) -> dict[str, float]:
        """The numbers of the scene that are known."""
        numbers = self.scene.entered(self.entered) | dict(self.instead)
        return {name: value for name, value in numbers.items() if name != self.free}

    @abstractmethod
    def discretise(self, phases: Phases) -> SceneDiscretisation:
        """Return the compiled problem for these phases."""

    def refined(self) -> Self:
        """The same on a finer mesh."""
        return replace(self, mesh=self.mesh.refined())


class SceneDiscretisation(Discretisation):
    """A scene in any transcription: its numbers, its certificate's parts and its shape."""

    settings: SceneTranscription
    #: Compiled with the known numbers of the scene as arguments, for all scenes of its form.
    equations: SceneEquations
    #: Those of this one.
    numbers: ca.DM
    #: Where the unknown numbers stand among the unknowns.
    named: slice
    #: Stretches of the attached rod that follow the detached ones.
    beyond: int

    @property
    def stretches(self) -> int:
        """Stretches of rod, detached and attached."""
        return len(self.phases) + self.beyond

    @cached_property
    def expression(self) -> ca.MX:
        """The residual, at the numbers of this scene."""
        return self.equations.residual(self.x, self.numbers)

    def residual_expression(self) -> ca.MX:
        """Bending at the nodes, the front, Theta(1) = 0, the switches, and what the tip adds."""
        return self.expression

    def linearised_expressions(self) -> tuple[ca.MX, ca.MX]:
        """Return the residual and its Jacobian."""
        residual, jacobian = self.equations.linearised(self.x, self.numbers)
        return residual, jacobian

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """`SAMPLED` at the same local coordinates in every phase."""
        return self.equations.sampler(zeta)(self.x, self.numbers)

    def by_numbers(self, x: np.ndarray) -> np.ndarray:
        """Derivatives of the residual by the known numbers of the scene, a column for each."""
        rates: np.ndarray = self.equations.by_numbers(x, self.numbers).full()
        return rates

    def found(self, x: np.ndarray) -> dict[str, float]:
        """Return all numbers of the scene in a solution, "pressure" and "ratio" among them."""
        s = self.scalars(x)
        own = dict(zip(self.settings.unknown, x[self.named].tolist(), strict=True))
        return {**self.settings.given, **own, "pressure": s.pressure_ratio, "ratio": s.ratio}

    def tip_curvature(self, x: np.ndarray) -> float:
        """Return theta'(0) of a solution, times eta."""
        s, q, scene = self.scalars(x), self.found(x), self.settings.scene
        bend, _ = scene.tip_start(s.A, s.sigma, q)
        return float(scene.wall.curvature_of(q) + s.A * bend / s.sigma)

    def pull_ahead(self, x: np.ndarray) -> float:
        """Return the largest traction over T0 that the layer bears ahead of the lobe that is pressed."""
        s, q = self.scalars(x), self.found(x)
        fields = self.attached_at(x, np.linspace(0.0, 1.0, DENSE_POINTS))
        pull = s.sigma * s.A * q["layer_stiffness"] * fields[:, :, 4]
        pressed = int(np.argmin(pull))
        top = pressed + int(np.argmax(pull.ravel()[pressed:]))
        stretch, i = divmod(top, DENSE_POINTS)
        i = min(max(i, 1), DENSE_POINTS - 2)
        a, b, c = np.polyfit((-1.0, 0.0, 1.0), pull[stretch, i - 1 : i + 2], 2)
        return float(c - b**2 / (4.0 * a) if a < 0.0 else c)

    def left_over(self, x: np.ndarray) -> float:
        """Return |theta'| times eta at the far end of the attached rod, which nothing asks to vanish."""
        s = self.scalars(x)
        return float(abs(s.A * self.attached_at(x, np.ones(1))[-1, 0, 1] / s.sigma))

    def ends(self, x: np.ndarray) -> tuple[Place, Place, float]:
        """Return the tip, the bonded place nearest to it, and the work of the loads in the identity."""
        places, work = self.equations.ends(x, self.numbers)
        rows, sbar = np.array(places), self.scalars(x).sigma
        tip = Place(0.0, sbar, *rows[-1, 1:].tolist())
        if not self.settings.scene.unbonded:
            return tip, tip, float(work)
        # Where the front stands on what was never glued, that is the front itself.
        unglued = sum("unbonded" not in past_of(phase) for phase in self.phases)
        xi, theta, x_there, y, slip = rows[unglued - 1].tolist()
        past = past_of(self.phases[min(unglued, len(self.phases) - 1)])
        return tip, Place(xi * sbar, sbar, theta, x_there, y, slip, past), float(work)

    def certificate(self, x: np.ndarray) -> float:
        """How far a solution misses what it was not solved with.

        The identity of the scene over T0 eta, assembled from its parts, where it has one; where it has
        none, by how much the edge is missed by an independent integration from the tip.  On an elastic
        layer it is no less than the curvature that is left where all should have decayed.
        """
        scene, q = self.settings.scene, self.found(x)
        tip, first, work = self.ends(x)
        curvature = self.tip_curvature(x)
        if scene.has_identity:
            missed = abs(scene.identity(tip, first, work, curvature, q))
            return max(missed, self.left_over(x)) if scene.layer is not None else missed
        Nx, Ny = (float(force) for force in scene.tip_force(tip, q))
        return march(scene, q, tip.sbar, Tip(tip.theta, tip.x, tip.y, Nx, Ny, curvature)).missed

    def profile(self, x: np.ndarray) -> SceneProfile:
        """Sample a solution."""
        values = self._profile_sampler(x)[0].reshape(len(self.phases), PROFILE_POINTS, len(SAMPLED))
        attached = self.attached_at(x, chebyshev(PROFILE_POINTS)[0])
        scene, found = self.settings.scene, self.found(x)
        return SceneProfile(self.lengths(x), values, self.scalars(x), scene, found, attached)

    def attached_lengths(self, x: np.ndarray) -> np.ndarray:
        """Return the lengths of the stretches of the attached rod, over the detached length."""
        layer = self.settings.scene.layer
        if layer is None:
            return np.zeros(0)
        q, sbar = self.found(x), self.scalars(x).sigma
        return np.array(REACHES) / (float(layer.decay(q)) * sbar)

    def attached_at(self, x: np.ndarray, zeta: np.ndarray) -> np.ndarray:
        """Return `SAMPLED` of the attached rod at local coordinates of its stretches."""
        if not self.beyond:
            return np.zeros((0, len(zeta), len(SAMPLED)))
        values: np.ndarray = self.equations.sampler(zeta, attached=True)(x, self.numbers).full()
        return values.reshape(self.beyond, len(zeta), len(SAMPLED))

    def prolonged(self, x: np.ndarray, finer: Discretisation) -> np.ndarray:
        """Unknowns of the same solution on another mesh of the same phases."""
        return finer.pack(self.profile(x))


@sample_shape.register
def _shape_of_scene(problem: SceneDiscretisation, unknowns: np.ndarray) -> Shape:
    """Sample a state of a scene at ``DENSE_POINTS`` points per phase, kinks included once."""
    dense = np.linspace(0.0, 1.0, DENSE_POINTS)
    phases, lengths = len(problem.phases), problem.lengths(unknowns)
    values = problem.sampler(dense)(unknowns)[0].reshape(phases, DENSE_POINTS, len(SAMPLED))
    starts = np.cumsum(lengths) - lengths
    places = starts[:, None] + lengths[:, None] * dense
    kept = np.ones((phases, DENSE_POINTS), dtype=bool)
    kept[1:, 0] = False
    xi, fields = places[kept], values[kept]
    s, q = problem.scalars(unknowns), problem.found(unknowns)
    Theta, K, nx, ny, Y, x, _ = fields.T
    kw = float(problem.settings.scene.wall.curvature_of(q)) * s.sigma
    theta, curvature = s.A * Theta + kw * (xi - 1.0), s.A * K + kw
    return Shape(xi, x, s.A * Y, theta, curvature, s.A * nx, s.A * ny)


@dataclass(frozen=True, eq=False)
class SceneSolution(Solution):
    """A discrete solution of a scene."""

    problem: SceneDiscretisation

    def gaps(self) -> np.ndarray:
        """Gap to the wall over eta, at the points of the shape."""
        shape, q = self.shape(), self.problem.found(self.x)
        sbar = self.problem.scalars(self.x).sigma
        at = Place(shape.xi * sbar, sbar, shape.theta, shape.x * sbar, shape.y * sbar, 0.0)
        return np.asarray(self.problem.settings.scene.wall.gap(at, q)[0], dtype=float)


@dataclass(frozen=True)
class SceneSpectral(SceneTranscription):
    """Global Gauss collocation of a scene in Theta''.

    Parameters
    ----------
    scene, free, entered, instead
        As in `SceneTranscription`.
    mesh : Spectral
    """

    mesh: Spectral = SCENES

    @property
    def nodes(self) -> int:
        """Gauss nodes per element."""
        return self.mesh.nodes

    @property
    def elements(self) -> int:
        """Equal elements per phase."""
        return self.mesh.elements

    def gain_at(self, problem: SceneSpectralDiscretisation, x: np.ndarray) -> float:
        """That of the mesh, on the attached rod, too, if it moves."""
        return min(self.mesh.gain_of(x[part]) for part in (problem.fields, problem.attached) if x[part].size)

    def discretise(self, phases: Phases) -> SceneSpectralDiscretisation:
        """Return the compiled problem for these phases."""
        return _discretise(self, phases)


class SceneSpectralDiscretisation(SceneDiscretisation, SpectralDiscretisation):
    """Theta'' at the Gauss nodes of every phase of a scene."""

    settings: SceneSpectral  # type: ignore[assignment]

    def __init__(self, settings: SceneSpectral, phases: Phases) -> None:
        strains = 0 if settings.scene.stretch is None else settings.nodes * settings.elements * len(phases)
        self.beyond = 0 if settings.scene.layer is None else len(REACHES)
        attached = settings.nodes * settings.elements * self.beyond
        super().__init__(settings, phases, strains + attached + len(settings.unknown))  # type: ignore[arg-type]
        #: Where the strain at the nodes, Theta'' of the attached rod and the unknown numbers stand among the
        #: unknowns.
        self.strain = slice(self.extra.start, self.extra.start + strains)
        self.attached = slice(self.strain.stop, self.strain.stop + attached)
        self.named = slice(self.attached.stop, self.extra.stop)
        self.blocks = (self.fields, self.strain, self.attached)
        self.equations = equations_of(self, SpectralEquations)
        self.numbers = ca.DM(list(settings.given.values()))

    @property
    def form(self) -> type[Scalars]:
        """What stands for the scalars among the unknowns: they themselves."""
        return Scalars

    @property
    def identity_row(self) -> int | None:
        """Its identity is that of the scene, whose terms are not counted."""
        return None

    def pack(self, profile: Profile) -> np.ndarray:
        """Unknowns that represent a profile with these phases."""
        numbers = profile.numbers if isinstance(profile, SceneProfile) else {}
        own = [numbers.get(name, 0.0) for name in self.settings.unknown]
        inner = profile.lengths[:-1]
        fields, strain = self._packed(profile)
        attached = []
        if isinstance(profile, SceneProfile):
            for values in profile.attached:
                part = replace(profile, lengths=np.ones(1), values=values[None])
                Theta, _, nx, ny, _, _, _ = part.in_phase(0, self.zeta).T
                theta = profile.scalars.A * Theta
                attached.append(ny * np.cos(theta) - nx * np.sin(theta))
        return np.concatenate([fields, inner, strain, *attached, own, profile.scalars.values])

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Theta'' of a profile at the nodes, from the balance of moments."""
        return self._packed(profile)[0]

    def _packed(self, profile: Profile) -> tuple[np.ndarray, np.ndarray]:
        """Theta'' of a profile at the nodes, from the balance of moments, and the strain there."""
        scene, s, curls, strains = self.settings.scene, profile.scalars, [], []
        numbers = profile.numbers if isinstance(profile, SceneProfile) else self.settings.given
        kw = float(scene.wall.curvature_of(numbers)) * s.sigma
        starts = np.cumsum(profile.lengths) - profile.lengths
        for j, (start, length) in enumerate(zip(starts, profile.lengths, strict=True)):
            fields = profile.in_phase(j, self.zeta)
            theta = s.A * fields[:, 0] + kw * (start + length * self.zeta - 1.0)
            nx, ny, sine, cosine = fields[:, 2], fields[:, 3], np.sin(theta), np.cos(theta)
            strain = scene.strain(s.A / s.sigma**2 * (nx * cosine + ny * sine), numbers)
            curls.append((1.0 + strain) * (ny * cosine - nx * sine))
            strains.append(strain)
        strain = np.concatenate(strains)
        return np.concatenate(curls), strain if scene.stretch is not None else strain[:0]


@lru_cache(maxsize=256)
def _discretise(settings: SceneSpectral, phases: Phases) -> SceneSpectralDiscretisation:
    return SceneSpectralDiscretisation(settings, phases)


class SceneEquations(ABC):
    """The equations of all scenes of one form, compiled with their numbers as arguments.

    Parameters
    ----------
    model : SceneDiscretisation
        One of them.
    """

    #: From the unknowns and the known numbers: to the residual, to it and its Jacobian, and to xi, theta, x,
    #: y and slip at the ends of all stretches and the tip, with the work of the loads.
    residual: ca.Function
    linearised: ca.Function
    ends: ca.Function

    def __init__(self, model: SceneDiscretisation) -> None:
        self.x = ca.MX.sym("x", model.size)
        self.given = ca.MX.sym("given", len(model.settings.given))
        self._samplers: dict[tuple[bytes, bool], ca.Function] = {}

    @cached_property
    def by_numbers(self) -> ca.Function:
        """Compiled derivatives of the residual by the known numbers."""
        arguments = [self.x, self.given]
        return ca.Function("by_numbers", arguments, [ca.jacobian(self.residual(*arguments), self.given)])

    def sampler(self, zeta: np.ndarray, *, attached: bool = False) -> ca.Function:
        """Compiled fields at local coordinates of every phase, or of the attached rod, remembered."""
        key = (np.asarray(zeta, dtype=float).tobytes(), attached)
        if key not in self._samplers:
            samples = self.sampled(np.asarray(zeta, dtype=float), attached=attached)
            self._samplers[key] = ca.Function("sample", [self.x, self.given], [samples])
        return self._samplers[key]

    @abstractmethod
    def sampled(self, zeta: np.ndarray, *, attached: bool) -> ca.MX:
        """`SAMPLED` at local coordinates of every phase, or of the attached rod."""


class SpectralEquations(SceneEquations):
    """Those of the spectral form."""

    def __init__(self, model: SceneSpectralDiscretisation) -> None:
        super().__init__(model)
        self.model, settings = model, model.settings
        matrix, ends = model.chain(model.zeta)
        self.fields = SceneFields(
            settings.scene,
            model.phases,
            np.vstack([matrix, ends, np.zeros((1, matrix.shape[1]))]),
            self.x,
            {
                name: getattr(model, name)
                for name in ("fields", "inner", "strain", "attached", "named", "tail")
            },
            settings.unknown,
            self.given,
            tuple(settings.given),
        )
        whole = self.fields.residual()
        arguments = [self.x, self.given]
        self.residual = ca.Function("residual", arguments, [whole.values])
        self.linearised = ca.Function("linearised", arguments, [whole.values, whole.gradient])
        f = self.fields
        places = [part.values[f.nodes :] for part in (f.xi, f.theta, f.x, f.y, f.slip)]
        self.ends = ca.Function("ends", arguments, [ca.horzcat(*places), f.work().values])

    def sampled(self, zeta: np.ndarray, *, attached: bool) -> ca.MX:
        """`SAMPLED` by integrals from the tip."""
        matrix, _ = self.model.chain(zeta)
        detached = len(self.model.phases) * len(zeta)
        matrix = matrix[detached:] if attached else matrix[:detached]
        return ca.horzcat(*(field.values for field in self.fields.sampled(matrix)))


#: Equations of the forms used last, by form, mesh, free number and stretches.
_COMPILED: OrderedDict[tuple[Hashable, ...], SceneEquations] = OrderedDict()
_COMPILED_LOCK = threading.Lock()


def equations_of(model: SceneDiscretisation, kind: Callable[[Any], SceneEquations]) -> SceneEquations:
    """Return the compiled equations of a scene, shared by all scenes of its form."""
    settings = model.settings
    key = (settings.scene.form, settings.mesh, settings.free, model.phases)
    with _COMPILED_LOCK:
        if key not in _COMPILED:
            _COMPILED[key] = kind(model)
        _COMPILED.move_to_end(key)
        while len(_COMPILED) > MOST_COMPILED:
            _COMPILED.popitem(last=False)
        return _COMPILED[key]
