"""What is asked of a scene: one number free, all others given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.checks import finite, positive
from ..base.errors import InvalidInput
from ..continuation.scene_family import SceneFamily
from ..model.dimension import LENGTH, TRACTION, Dimension
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.collocation import Collocation
from ..residual.discretisation import Transcription
from ..residual.scene_intervals import SceneIntervals
from ..residual.scene_spectral import SceneDiscretisation, SceneSpectral, SceneTranscription
from ..residual.shooting import Shooting
from ..residual.spectral import Spectral

#: What every scene has.
COMMON = {"pressure": TRACTION, "length": LENGTH}


@dataclass(frozen=True)
class SceneQuestion:
    """What is asked of a scene, over its units of T0 and eta.

    Parameters
    ----------
    scene : Scene
    free : str
    given : dict
        The pressure and the length, as far as they are given.
    """

    scene: Scene
    free: str
    given: dict[str, float]

    @property
    def dimension(self) -> Dimension:
        """What the free number measures."""
        return COMMON.get(self.free) or self.scene.dimensions[self.free]

    @property
    def closures(self) -> tuple[Closure, ...]:
        """What closes the residual of the scene."""
        own = (Closure(name, value) for name, value in self.given.items())
        return (Closure("ratio", self.scene.rod.ratio), *own)

    @property
    def target(self) -> Closure:
        """What the walk along the branch looks for."""
        return self.closures[-1]

    @property
    def number(self) -> str | None:
        """The free number, where it is one of the scene's."""
        return None if self.free in COMMON else self.free

    def transcription(self, mesh: Transcription) -> SceneTranscription:
        """Return the way to discretise the scene that is this one of the paper's."""
        if isinstance(mesh, Spectral):
            return SceneSpectral(self.scene, mesh, self.number)
        assert isinstance(mesh, Shooting | Collocation)
        return SceneIntervals(self.scene, mesh, self.number)

    def family(self, mesh: Spectral) -> SceneFamily:
        """Return the curve of states on which the answer lies."""
        ratio, *held = self.closures
        holding = (held[0],) if self.number else ()
        return SceneFamily(
            self.scene.bond.law, SceneSpectral(self.scene, mesh, self.number), ratio, holding=holding
        )

    def read(self, problem: SceneDiscretisation, x: np.ndarray) -> float:
        """Return the free number of a solution."""
        s = problem.scalars(x)
        if self.free == "length":
            return float(s.sigma)
        return float(problem.found(x)[self.free])

    def weights(self, problem: SceneDiscretisation, x: np.ndarray) -> np.ndarray:
        """Return the gradient of the free number by all unknowns."""
        weights = np.zeros(problem.size)
        if self.number:
            weights[problem.named.stop - 1] = 1.0
        elif self.free == "length":
            weights[problem.column("sigma")] = 1.0
        else:
            s = problem.scalars(x)
            weights[problem.column("A")] = s.m / s.beta0
            weights[problem.column("m")] = s.A / s.beta0
            weights[problem.column("sigma")] = -3.0 * s.alpha1 / s.sigma**4
        return weights

    def named(self, value: float) -> str:
        """Return a value of the free number with its unit."""
        rod = self.scene.rod
        return f"{value * self.dimension.size(rod):.8g} {self.dimension.unit_of(rod)}".rstrip()

    @property
    def words(self) -> str:
        """What is given, for messages."""
        rod = self.scene.rod
        return ", ".join(
            f"{name} = {value * COMMON[name].size(rod):.8g} {COMMON[name].unit_of(rod)}"
            for name, value in self.given.items()
        )


def posed(scene: Scene, free: object, given: dict[str, float]) -> SceneQuestion:
    """Check what is asked, and take it to units of T0 and eta."""
    if not isinstance(scene, Scene):
        raise InvalidInput(
            f"scene must be a Scene, got {scene!r:.60}.", remedy="Make one with Scene(rod, ...)."
        )
    known = (*COMMON, *scene.numbers)
    if free not in known:
        raise InvalidInput(
            f"{free!r} is no number of this scene.",
            remedy=f"Free one of {', '.join(known)}; name a load in the scene, with any size, to free it.",
        )
    wanted = [name for name in COMMON if name != free]
    values = {"pressure": 0.0, **given} if free != "pressure" else dict(given)
    if strange := sorted(set(values) - set(wanted)):
        raise InvalidInput(
            f"{', '.join(strange)} cannot be given here.", remedy=f"Give {' and '.join(wanted)}."
        )
    if missing := [name for name in wanted if name not in values]:
        raise InvalidInput(f"{' and '.join(missing)} must be given to solve for the {free}.")
    rod = scene.rod
    check = {"pressure": finite, "length": positive}
    scaled = {
        name: check[name](name, values[name], COMMON[name].unit_of(rod)) / COMMON[name].size(rod)
        for name in wanted
    }
    return SceneQuestion(scene, str(free), scaled)
