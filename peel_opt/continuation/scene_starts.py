"""Small states that no plain rod leads to: a curled tip, a strip, a rod that a line energy holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..base.quadrature import gauss
from ..model.equations import Scalars
from ..model.groups import PI4
from ..model.mixed_bonds import LINE
from ..model.place import Place
from ..model.scene import Scene
from ..model.tips import Middle
from ..residual.closures import Closure
from ..residual.discretisation import PROFILE_POINTS, chebyshev
from ..residual.scene_spectral import SceneProfile
from ..residual.scene_system import REACHES, SAMPLED

#: sbar/eta at which a symmetric strip leaves its wall where eta = y0: the root of tan(g) = tanh(g).
STRIP = 3.926602312047919

#: Curvature over 1/eta, less that of the wall, of the curled rod that a contact begins with.
CURL = 0.01

#: Amplitude, minus the curvature of the middle times the length, that a strip begins with; the largest one at
#: eta = y0, which falls with beta0: what the pressure adds to the axial force goes with both.
SWELLING, LARGEST = 0.2, 1.0


#: Height over y0 of the middle of a strip that a law holds in its first state.
OPENED = 0.5

#: Length that a line energy holds in its first state, as a share of that at which bending, with the small
#: slopes of a beam, is no longer all there is.
BEAM = 0.3

#: EA over the square of the curvature at the front with which a strip with slack begins.
SOFT = 16.0

#: K eta/T0, at least, of the elastic layer that is softened on the way into a scene.
STIFF = 1e6

#: Gauss nodes for what the kernel takes up of a slack.
NODES = 16


@dataclass(frozen=True)
class SmallState:
    """A state to begin with, known but for small terms, and the way from there.

    Parameters
    ----------
    profile : SceneProfile
    held : Closure
        What is held on the way into the scene.
    entered : float
        How far the scene has taken over there, 0 to 1.
    instead : tuple of (str, float)
        Numbers in place of the scene's own there.
    """

    profile: SceneProfile
    held: Closure
    entered: float = 0.0
    instead: tuple[tuple[str, float], ...] = ()


def curled(scene: Scene, ratio: float) -> SmallState:
    """Return a short rod that curls into its wall, without a pressure.

    A beam under -T0 with y = y'' = 0 at its tip has the length 2 sqrt(|kappa| k/T0), the reaction
    3/4 of T0 times that, and the inclination sbar^3 T0/(24 k) there.

    Raises
    ------
    InvalidInput
        If the rod does not curl into its wall.
    """
    curl = _curl(scene)
    share = min(1.0, CURL / -curl)
    length = 2.0 * math.sqrt(-curl * share)
    A, t = length**3 / 24.0, 1.0 - _points()
    Theta, K, ny, Y = (
        t**2 * (4.0 * t - 3.0),
        6.0 * t * (1.0 - 2.0 * t),
        6.0 * (4.0 * t - 1.0),
        t**3 * (1.0 - t),
    )
    scalars = Scalars(A, -24.0, length, ratio * length**4 - PI4)
    numbers = {**scene.entered(share), "reaction": 0.75 * length, "pressure": 0.0, "ratio": ratio}
    return SmallState(_profile(scene, (Theta, K, ny, Y), scalars, numbers), Closure("pressure", 0.0), share)


def pressed(scene: Scene, ratio: float) -> SmallState:
    """Return a short rod that curls into its wall, held by its line energy, under the pressure that it takes.

    A beam has y'' = c at its tip and e at its front, y = y' = 0 there and y = 0 at the tip under the load
    (4 c + 8 e)/sbar^2; the reaction is -3 (c + e)/sbar, and the inclination of the tip sbar (e - c)/6.

    Raises
    ------
    InvalidInput
        If the rod does not curl into its wall.
    NotConverged
        If its line energy lifts its tip off the wall.
    """
    c = _curl(scene)
    q = scene.numbers | {"ratio": ratio}
    e = float(scene.front_curvature(0.0, q) - scene.wall.curvature_of(q))
    if e >= -c:
        raise NotConverged(
            "the line energy bends the rod more at its front than it curls into its wall: its tip lifts off.",
            remedy="Leave out tip=, or give a smaller line_energy.",
        )
    length, x = BEAM * min(1.0, 1.0 / -c), _points()
    A, shear, load = length * (e - c) / 6.0, -3.0 * (c + e), 4.0 * c + 8.0 * e
    fields = (
        -length / A * (c * (1.0 - x) + shear * (1.0 - x**2) / 2.0 + load * (1.0 - x**3) / 6.0),
        length / A * (c + shear * x + 0.5 * load * x**2),
        length / A * (shear + load * x),
        length / A * (c * (1.0 - x) ** 2 / 2.0 + shear * (2.0 - 3.0 * x + x**3) / 6.0)
        + length / A * load * (3.0 - 4.0 * x + x**4) / 24.0,
    )
    pressure = load / length**2 + (0.0 if scene.bond is LINE else 1.0)
    scalars = Scalars(A, (pressure - 1.0) * length**3 / A, length, ratio * length**4 - PI4)
    numbers = {**q, "reaction": shear / length, "pressure": pressure}
    return SmallState(_profile(scene, fields, scalars, numbers), Closure("length", length), entered=1.0)


def swollen(scene: Scene, ratio: float) -> SmallState:
    """Return a strip just lifted between two edges: the kernel of its linear problem.

    Y'''' + N0 Y'' = beta1 (Y - c) has Y = a cos(g xi) + b cosh(h xi) + c, g h = beta1^(1/2), g^2 - h^2 = N0,
    and Y(1) = Y'(1) = Y''(1) = 0 asks for tan(g)/g = tanh(h)/h.  A given slack begins as what this shape
    takes up without an axial force, A^2 sbar int Theta^2 / 2.
    """
    from scipy.optimize import brentq  # which takes long to import

    assert isinstance(scene.tip, Middle)
    N = 0.0 if scene.tip.slack is not None else scene.numbers["roller"]
    larger = math.sqrt(0.5 * abs(N) + math.sqrt(0.25 * N**2 + ratio))  # of g and h, over the length
    over = larger**2 / math.sqrt(ratio) if N < 0.0 else math.sqrt(ratio) / larger**2  # h/g
    g = brentq(lambda g: over * math.sin(g) - math.cos(g) * math.tanh(over * g), math.pi, 1.5 * math.pi)
    h, xi = over * g, _points()
    length = max(g, h) / larger

    def even(at: np.ndarray) -> np.ndarray:
        """cosh(h xi)/cosh(h)."""
        return np.exp(h * (at - 1.0)) * (1.0 + np.exp(-2.0 * h * at)) / (1.0 + math.exp(-2.0 * h))

    def odd(at: np.ndarray) -> np.ndarray:
        """sinh(h xi)/cosh(h)."""
        return np.exp(h * (at - 1.0)) * (1.0 - np.exp(-2.0 * h * at)) / (1.0 + math.exp(-2.0 * h))

    a = 1.0 / (g**2 * (1.0 - math.cos(g) * float(even(np.zeros(1))[0])))
    b = a * math.cos(g) / over**2

    def inclination(at: np.ndarray) -> np.ndarray:
        return h * b * odd(at) - g * a * np.sin(g * at)

    Theta, K = inclination(xi), h**2 * b * even(xi) - g**2 * a * np.cos(g * xi)
    ny = h**3 * b * odd(xi) + g**3 * a * np.sin(g * xi) + N * length**2 * Theta
    Y = a * (np.cos(g * xi) - math.cos(g)) + b * (even(xi) - 1.0)
    most = min(LARGEST, LARGEST * (STRIP / length) ** 3, OPENED / (ratio * length * float(Y.max())))
    A = min(SWELLING, most)
    instead = (("roller", N),)
    if scene.tip.slack is not None:
        nodes, weights = gauss(NODES)
        taken = 0.5 * length * float(weights @ inclination(nodes) ** 2)
        A = min(most, math.sqrt(scene.numbers["slack"] / taken))
        instead = (("slack", A**2 * taken),)
    beta1 = (g * h) ** 2
    scalars = Scalars(A, beta1 * (a * math.cos(g) + b), length, beta1 - PI4)
    numbers = {**scene.entered(0.0), **dict(instead), "thrust": 0.0, "ratio": ratio}
    numbers["pressure"] = scalars.pressure_ratio
    pull = (N * length**2 / A, 0.0)
    profile = _profile(scene, (Theta, K, ny, Y), scalars, numbers, pull)
    return SmallState(profile, Closure("amplitude", A), 0.0, instead)


def split(scene: Scene, ratio: float) -> SmallState:
    """Return a short rod that a large pressure lifts off its line energy: a beam under q = p - T0.

    A free tip has theta' = kappa + q s^2/2, the middle of a strip q (3 s^2 - sbar^2)/6, and the front asks
    for a value of it at sbar, whatever the axial force that is there.

    A strip that stretches and has slack, too, begins without it, and so soft that none need buckle it.

    Raises
    ------
    NotConverged
        If the axial force or the curvature of the tip is more than the line energy can hold.
    """
    slack = getattr(scene.tip, "slack", None)
    q = scene.numbers | {"ratio": ratio}
    q["thrust"] = -q.get("stretch", 0.0) * q.get("glued_strain", 0.0)
    Nx, Ny = (float(force) for force in scene.tip_force(Place(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), q))
    end = float(scene.front_curvature(Nx, q))
    curl = 0.0 if isinstance(scene.tip, Middle) else float(scene.tip_curvature(q))
    if not end > max(curl, 0.0):
        raise NotConverged(
            "there is no short rod to begin with: the axial force or the curvature at the tip is more than"
            " the line energy holds.",
            remedy="Give a larger line_energy, or smaller loads on the tip.",
        )
    EA = q.get("stretch", 0.0)
    instead: tuple[tuple[str, float], ...] = ()
    if slack:
        EA = min(EA, SOFT * end**2)
        instead = (("slack", 0.0), ("stretch", EA))
    limits = [1.0, 1.0 / end, EA**-0.25 * end**-0.5 if EA else 1.0, abs(Nx) ** -0.5 if Nx else 1.0]
    length, xi = BEAM * min(limits), _points()
    if isinstance(scene.tip, Middle):
        load = 3.0 * end / length**2
        A = load * length**3 / 6.0
        fields = (xi**3 - xi, 3.0 * xi**2 - 1.0, 6.0 * xi, 0.25 * (1.0 - xi**2) ** 2)
    else:
        load = 2.0 * (end - curl) / length**2
        bend, push = curl * length, load * length**3
        A = bend + push / 6.0
        fields = (
            (bend * xi + push * xi**3 / 6.0) / A - 1.0,
            (bend + 0.5 * push * xi**2) / A,
            push * xi / A,
            1.0 - xi - (0.5 * bend * (1.0 - xi**2) + push * (1.0 - xi**4) / 24.0) / A,
        )
    pressure = load if scene.bond is LINE else load + 1.0
    scalars = Scalars(A, (pressure - 1.0) * length**3 / A, length, ratio * length**4 - PI4)
    numbers = {**q, **dict(instead), "pressure": pressure}
    pull = (Nx * length**2 / A, Ny * length**2 / A)
    held = Closure("amplitude", A)
    return SmallState(_profile(scene, fields, scalars, numbers, pull), held, entered=1.0, instead=instead)


def buckled(scene: Scene, ratio: float) -> SmallState:
    """Return a strip with slack that its line energy holds, buckled as a clamped column under no net load.

    theta = -a sin(pi xi) under N = (pi/sbar)^2 takes up a^2 sbar/4, and has pi a/sbar at the front.
    """
    q, xi = scene.numbers | {"ratio": ratio}, _points()
    a, end = SWELLING, math.sqrt(2.0 * q["line_energy"])
    length = math.pi * a / end
    thrust = (math.pi / length) ** 2
    jump = q.get("glued_strain", 0.0) - float(scene.strain(thrust, q))
    instead = (("slack", length * (0.25 * a**2 + jump)),)
    A, pressure = math.pi * a, 0.0 if scene.bond is LINE else 1.0
    sine, cosine = np.sin(math.pi * xi), np.cos(math.pi * xi)
    fields = (-sine / math.pi, -cosine, np.zeros_like(xi), (1.0 + cosine) / math.pi**2)
    scalars = Scalars(A, (pressure - 1.0) * length**3 / A, length, ratio * length**4 - PI4)
    numbers = {**q, **dict(instead), "thrust": thrust, "pressure": pressure}
    profile = _profile(scene, fields, scalars, numbers, (math.pi**2 / A, 0.0))
    return SmallState(profile, Closure("pressure", pressure), entered=1.0, instead=instead)


def layered(scene: Scene, plain: SceneProfile) -> SmallState:
    """Return a plain rod's state on a stiff layer, which softens on the way to that of the scene.

    Its reaction R becomes a shear force with the moment R/lam + T0/(2 lam^2), lam = (K/4k)^(1/4), and the
    attached rod is a beam on a foundation, y = e^(-lam z) (a cos(lam z) + b sin(lam z)).
    """
    assert scene.layer is not None
    s, ratio = plain.scalars, plain.numbers["ratio"]
    stiffness = max(scene.numbers["layer_stiffness"], STIFF * max(1.0, ratio))
    instead = (("layer_stiffness", stiffness),)
    numbers = {**plain.numbers, **dict(instead)}
    decay = float(scene.layer.decay(numbers))
    reaction = -s.A / s.sigma**2 * plain.values[-1, -1, 3]
    a, b = 1.0 / stiffness, -0.5 * (reaction / decay + 0.5 / decay**2) / decay**2
    ends = np.cumsum((0.0, *REACHES))
    z = ends[:-1, None] + np.outer(REACHES, _points())
    bend = 2.0 * decay**3 * np.exp(-z) * ((a + b) * np.cos(z) + (b - a) * np.sin(z))
    attached = np.zeros((len(REACHES), PROFILE_POINTS, len(SAMPLED)))
    attached[:, :, SAMPLED.index("ny")] = bend * s.sigma**2 / s.A  # as much as it takes for Theta''
    profile = replace(plain, numbers=numbers, attached=attached)
    return SmallState(profile, Closure("amplitude", float(s.A)), 0.0, instead)


def _curl(scene: Scene) -> float:
    """Return the curvature with which a rod curls into its wall, over 1/eta; negative."""
    curl = scene.imposed_curvature
    if curl >= 0.0:
        raise InvalidInput(
            "a tip rests on its wall only where the rod curls into it, and this one does not.",
            remedy="Give a natural_curvature below the curvature of the wall, or a tip without contact.",
        )
    return curl


def _points() -> np.ndarray:
    """xi of the points of a profile with one phase."""
    return chebyshev(PROFILE_POINTS)[0]


def _profile(
    scene: Scene,
    fields: tuple[np.ndarray, ...],
    scalars: Scalars,
    numbers: dict[str, float],
    pull: tuple[float, float] = (0.0, 0.0),
) -> SceneProfile:
    """Return a profile of one phase, whose forces are those of ``pull`` but for the load across it."""
    Theta, K, ny, Y = fields
    still = np.zeros_like(Theta)
    values = np.stack([Theta, K, still + pull[0], ny + pull[1], Y, _points() - 1.0, still], axis=-1)
    return SceneProfile(np.ones(1), values[None], scalars, scene, numbers)
