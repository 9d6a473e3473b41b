"""`Sensitivities`: derivatives of one number by all that it depends on, with their errors and units.

The number is U F(r, q), with r = eta/y0 and q what it depends on over U_q.  U and U_q are powers of T0 and
of eta = (k/T0)^(1/3): one gradient of F has the derivatives by k, T0 and y0 too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.errors import InvalidInput
from ..base.units import display
from ..model.dimension import RATIO_POWERS, Dimension
from ..model.rod import MATERIAL, UNITS, Rod


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


def in_units(
    rod: Rod,
    of: str,
    value: tuple[Dimension, float],
    on: Mapping[str, tuple[Dimension, float]],
    dimensionless: dict[str, float],
    errors: np.ndarray,
) -> Sensitivities:
    """Return the derivatives of U F(r, q) in the units of a rod, by its material numbers and by what q is of.

    Parameters
    ----------
    value : tuple of Dimension and float
        What U is, and F.
    on : mapping of str to tuple of Dimension and float
        What each q is of: what U_q is, and the number in the units of the rod.
    dimensionless : dict of float
        The gradient of F by r and by each q, in their order.
    errors : ndarray
        Of this gradient.
    """
    (dimension, F), slopes = value, np.array(list(dimensionless.values()))
    kinds, numbers = [kind for kind, _ in on.values()], np.array([number for _, number in on.values()])
    material = np.array([getattr(rod, name) for name in MATERIAL])
    U, sizes = dimension.size(rod), np.array([kind.size(rod) for kind in kinds])
    # d log / d log k, T0, y0 of r and of q, times these.
    of_q = [-q * kind.powers for kind, q in zip(kinds, numbers / sizes, strict=True)]
    response = np.column_stack([rod.ratio * RATIO_POWERS, *of_q])

    def each(by_material: np.ndarray, by_number: np.ndarray) -> dict[str, float]:
        return dict(zip((*MATERIAL, *on), [*by_material.tolist(), *by_number.tolist()], strict=True))

    names = dict.fromkeys(MATERIAL, "") if rod.dimensionless else UNITS
    return Sensitivities(
        of=of,
        value=U * F,
        parameters=each(material, numbers),
        derivatives=each(U * (F * dimension.powers + response @ slopes) / material, U * slopes[1:] / sizes),
        errors=each(U * (np.abs(response) @ errors) / material, U * errors[1:] / sizes),
        dimensionless=dimensionless,
        units={
            **names,
            **{name: kind.unit_of(rod) for name, (kind, _) in on.items()},
            of: dimension.unit_of(rod),
        },
    )
