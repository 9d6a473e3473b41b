"""`Sensitivities`: derivatives of one number by all that it depends on, with their errors and units."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.errors import InvalidInput
from ..base.units import display


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
