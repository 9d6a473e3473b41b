"""Sensitivities: how an answer moves with the rod's material numbers and with what was given.

All of the problem is two numbers, P = f(eta/y0, sbar/eta); `solution_surface` differentiates f
exactly and the chain rule does the rest.  With eta = (k/T0)^(1/3), one gradient of f gives the
derivatives with respect to k, T0, y0 and the given length or pressure together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.errors import InvalidInput
from ..base.units import display
from ..equilibria.question import ASKS, LENGTH, Measure, answering, known_law
from ..equilibria.result import Equilibrium
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import MATERIAL, UNITS, Rod
from ..residual.shape import Solution
from .limits import LIMITS
from .surface import Gradient, gradient

#: Powers of k, T0, y0 in r = eta/y0.
RATIO = np.array(LENGTH.powers) - [0.0, 0.0, 1.0]


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of one number with respect to all that it depends on.

    All mappings have the same keys: ``bending_stiffness``, ``adhesion_strength``,
    ``adhesion_range`` and ``length`` or ``pressure``, whichever was given; in the paper's groups
    ``beta0`` and ``lam``.  ``str`` gives a table.

    Parameters
    ----------
    of : str
        What is differentiated: "pressure", "length", "alpha1" or the name of a limit.
    value : float
        In ``units[of]``.
    parameters : dict of float
        Where the derivatives are taken.
    derivatives : dict of float
        d value / d parameter, in SI units.
    errors : dict of float
        Estimates of the absolute errors of ``derivatives``.
    dimensionless : dict of float
        The gradient they all follow from: d(p/T0 or sbar/eta) by ``ratio`` = eta/y0 and by
        ``length_ratio`` = sbar/eta or ``pressure_ratio`` = p/T0.
    units : dict of str
    """

    of: str
    value: float
    parameters: dict[str, float]
    derivatives: dict[str, float]
    errors: dict[str, float]
    dimensionless: dict[str, float]
    units: dict[str, str]

    @property
    def elasticities(self) -> dict[str, float]:
        """d log value / d log parameter: the per cent it moves per per cent; nan where value = 0."""
        if self.value == 0.0:
            return dict.fromkeys(self.derivatives, math.nan)
        return {name: d * self.parameters[name] / self.value for name, d in self.derivatives.items()}

    @property
    def error(self) -> float:
        """Largest error of an elasticity; nan where the value is 0."""
        if self.value == 0.0:
            return math.nan
        return max(abs(e * self.parameters[name] / self.value) for name, e in self.errors.items())

    def __getitem__(self, parameter: str) -> float:
        try:
            return self.derivatives[parameter]
        except KeyError:
            raise InvalidInput(
                f"{self.of} has no derivative with respect to {parameter!r}.",
                remedy=f"Choose one of {', '.join(self.derivatives)}.",
            ) from None

    def __repr__(self) -> str:
        parts = ", ".join(f"{name} {e:+.4f}" for name, e in self.elasticities.items())
        return f"Sensitivities({self.of} = {self._shown(self.of, self.value)}; elasticities: {parts})"

    def __str__(self) -> str:
        unit = self.units[self.of]
        lines = [
            f"{self.of} = {self._shown(self.of, self.value)}",
            f"{'':<18}{'value':>13}  {'elasticity':>10}  {'relative error':>14}  derivative",
        ]
        for name, e in self.elasticities.items():
            below = self.units[name]
            per = f"{unit}/({below})" if {" ", "/"} & set(below) else f"{unit}/{below}" if below else unit
            d = self.derivatives[name]
            relative = self.errors[name] / abs(d) if d else math.inf
            shown = self._shown(name, self.parameters[name])
            lines.append(f"{name:<18}{shown:>13}  {e:>+10.5f}  {relative:>14.0e}  {d:.8g} {per}".rstrip())
        return "\n".join(lines)

    def _shown(self, name: str, value: float) -> str:
        unit = self.units[name]
        return display(value, unit, 5) if unit in ("Pa", "m", "N m") else f"{value:.6g} {unit}".strip()


def sensitivities(
    subject: Equilibrium | Rod, of: str | None = None, *, law: str | CohesiveLaw = "auto"
) -> Sensitivities:
    """Differentiate an equilibrium, or a limit of a rod, with respect to all it depends on.

    Exact derivatives of the discretised problem by the implicit function theorem, on meshes
    refined until two agree; results of every method and law are taken alike.

    Parameters
    ----------
    subject : Equilibrium or Rod
        What was answered, or a rod with ``of``.
    of : str, optional
        For a rod: "readhesion_pressure", "least_length" or "longest_length" (the folds of its
        branch), or "maxwell_length".
    law : str or CohesiveLaw
        For a rod: the law of its bond, default law (8).  An equilibrium brings its own.

    Returns
    -------
    Sensitivities

    Raises
    ------
    AtFold
        If the given number turns round at this equilibrium: the derivatives are infinite there.
    NoEquilibrium
        If the rod has no such limit.
    InvalidInput
        If the limit is not defined under this law, or the equilibrium comes from a file, which
        keeps its shape only.
    NotConverged
        If the solution is lost on a finer mesh.

    Examples
    --------
    >>> from peel_opt import Rod, pressure_given_length
    >>> rod = Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    >>> round(sensitivities(pressure_given_length(rod, length=1.9e-3)).elasticities["length"], 6)
    -3.203367
    """
    if isinstance(subject, Rod):
        if not isinstance(of, str) or of not in LIMITS:
            raise InvalidInput(
                f"sensitivities of a rod need a number to differentiate, got {of!r}.",
                remedy=f"Give of= one of {', '.join(map(repr, LIMITS))}, or an equilibrium.",
            )
        limit = LIMITS[of]
        gradient_of = limit.differentiate(subject.ratio, known_law(law) or COHESIVE)
        return _of_rod(subject, of, ASKS[limit.kind].given, gradient_of)
    if of is not None:
        raise InvalidInput(f"of={of!r} belongs to a rod; an equilibrium has one answer.")
    if law != "auto":
        raise InvalidInput("law= belongs to a rod; an equilibrium has its own law.")
    if not isinstance(subject, Equilibrium):
        raise InvalidInput(f"sensitivities need an equilibrium or a rod, got {type(subject).__name__}.")
    subject.require_papers_scene("sensitivities")
    if subject.message:
        raise InvalidInput(
            f"there is no equilibrium to differentiate ({subject.status}): {subject.message}",
            remedy="Leave out throw=False to have this as an error of its own type.",
        )
    if not isinstance(subject.source, Solution):
        raise InvalidInput(
            "this equilibrium carries no discrete solution to differentiate.",
            remedy="Compute it again; files and other processes keep the shape only.",
        )
    asks = answering(subject.answered, subject.given)
    found = gradient(subject.source, (asks.held, asks.given), asks.asked.read)
    if subject.rod is None:
        return _of_groups(subject, found)
    name = asks.given.name
    held = subject.given[name] if name in subject.given else getattr(subject, name)
    return _of_rod(subject.rod, asks.asked.name, asks.asked, found, asks.given, held)


def _of_rod(
    rod: Rod, of: str, measure: Measure, found: Gradient, given: Measure | None = None, held: float = 0.0
) -> Sensitivities:
    """Chain rule: value = U F(r, g), U its unit, r = eta/y0, and g = given over its unit.

    Parameters
    ----------
    measure : Measure
        What the value is.
    found : Gradient
        Of F by r, and by g if something was given.
    given : Measure or None
    held : float
        The given number, in the units of the rod.
    """
    material = np.array([getattr(rod, name) for name in MATERIAL])
    U, F = measure.from_ratio(rod, 1.0), found.value
    # d log / d log k, T0, y0 of what the value is made of, times the value.
    response = np.outer(RATIO, found.given[:1])
    if given is not None:
        response = np.column_stack([response, -np.array(given.powers) * found.given[1]])
    slopes = U * (F * np.array(measure.powers) + response @ found.derivatives) / material
    errors = U * (np.abs(response) @ found.errors) / material
    derivatives = dict(zip(MATERIAL, slopes.tolist(), strict=True))
    bounds = dict(zip(MATERIAL, errors.tolist(), strict=True))
    parameters = dict(zip(MATERIAL, material.tolist(), strict=True))
    dimensionless = {"ratio": float(found.derivatives[0])}
    named = dict.fromkeys(MATERIAL, "") if rod.dimensionless else UNITS
    labels = {**named, of: measure.name_of_unit(rod)}
    if given is not None:
        per = U / given.from_ratio(rod, 1.0)
        derivatives[given.name] = float(per * found.derivatives[1])
        bounds[given.name] = float(per * found.errors[1])
        parameters[given.name] = held
        dimensionless[given.attribute] = float(found.derivatives[1])
        labels[given.name] = given.name_of_unit(rod)
    return Sensitivities(of, U * F, parameters, derivatives, bounds, dimensionless, labels)


def _of_groups(eq: Equilibrium, found: Gradient) -> Sensitivities:
    """d alpha1 by beta0 and lambda; at beta0 = 0 the gradient has it by beta0 already."""
    per_beta0 = 1.0 / (3.0 * found.given[0] ** 2) if eq.beta0 else 1.0
    scale = np.array([per_beta0, 1.0])
    names = ("beta0", "lam")
    derivatives = dict(zip(names, (scale * found.derivatives).tolist(), strict=True))
    errors = dict(zip(names, (scale * found.errors).tolist(), strict=True))
    parameters = {"beta0": eq.beta0, "lam": eq.lam}
    units = dict.fromkeys((*names, "alpha1"), "")
    return Sensitivities("alpha1", found.value, parameters, derivatives, errors, dict(derivatives), units)
