"""Numbers and states in words: units with a prefix, titles, warnings."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from ..equilibria.result import Equilibrium
from ..model.labels import DISQUALIFYING, FLAGS
from ..model.mixed_bonds import LINE
from ..model.rod import Rod, Units

PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

#: Symbols in words, as mathematics.
SYMBOLS = {"lambda": r"\lambda", "alpha1": r"\alpha_1", "theta": r"\theta", "eta": r"\eta", "y0": "y_0"}
_FORMULA = re.compile(r"\b(?:lambda|theta|eta/y0|(?:alpha1|y|p) [<>=] \w+)")

#: What a pen without mathematics writes in place of it, in this order.
_PLAIN = (
    (r"\bar s", "s̄"),
    (r"\lambda", "λ"),
    (r"\alpha", "α"),
    (r"\beta", "β"),
    (r"\eta", "η"),
    (r"\theta", "θ"),
    (r"\tau", "τ"),
    (r"\pi", "π"),
    (r"\times", "×"),
    (r"\,", " "),
    (r"^\circ", "°"),
    ("^4", "⁴"),
    ("^2", "²"),
    ("_e", "ₑ"),
    (" - ", " − "),
    *((f"_{digit}", "₀₁₂₃₄₅₆₇₈₉"[digit]) for digit in range(10)),
    ("$", ""),
    ("\n", ", "),
)

ANSWERS = {"pressure_ratio": "$p/T_0$", "length_ratio": r"$\bar s/\eta$", "alpha1": r"$\alpha_1$"}


@dataclass(frozen=True)
class AxisUnit:
    """The unit of an axis: ``size`` in the unit of the data; a symbol divides, a name stands in brackets."""

    size: float
    name: str
    is_symbol: bool = False

    def axis(self, quantity: str) -> str:
        """Return the label of an axis that shows ``quantity``."""
        return f"${quantity}/{self.name}$" if self.is_symbol else f"${quantity}$ [{self.name}]"


#: Units that a rod brings, as mathematics.
_OWN = {"sbar": r"\bar s", "eta": r"\eta", "T0": "T_0", "T0 eta^3": r"(T_0\eta^3)"}
_OWN |= {"tau": r"\tau", "c eta/T0": r"(c\eta/T_0)"}


def axis_unit(name: str, largest: float) -> AxisUnit:
    """Return the unit of an axis of values up to ``largest``, by its name: SI with a prefix, or a symbol."""
    return AxisUnit(1.0, _OWN[name], is_symbol=True) if name in _OWN else prefixed(largest, name)


def length_unit(rod: Rod | None, extent: float) -> AxisUnit:
    """Return the unit in which a picture of a rod, ``extent`` across, is drawn."""
    return axis_unit(Units.of(rod).length, extent)


def pressure_unit(rod: Rod, largest: float) -> AxisUnit:
    """Return the unit of an axis of pressures up to ``largest``."""
    return axis_unit(Units.of(rod).pressure, largest)


def prefixed(largest: float, unit: str) -> AxisUnit:
    """Return an SI unit with the prefix that fits values up to ``largest``."""
    exponent = _exponent(largest)
    return AxisUnit(10.0**exponent, f"{PREFIXES[exponent]}{unit}")


def quantity(value: float, unit: str) -> str:
    """Return an SI quantity with four digits and a prefix, "48.68 kPa"."""
    exponent = _exponent(value)
    return f"{value / 10.0**exponent:.4g} {PREFIXES[exponent]}{unit}"


def _exponent(value: float) -> int:
    if value == 0.0 or not math.isfinite(value):
        return 0
    exponent = 3 * math.floor(math.log10(abs(value)) / 3.0)
    return min(max(exponent, min(PREFIXES)), max(PREFIXES))


def load(eq: Equilibrium) -> str:
    """Return the pressure as it names one curve among others: with units, or dimensionless."""
    if eq.rod is not None and not eq.rod.dimensionless:
        return f"$p$ = {quantity(eq.pressure, 'Pa')}"
    if math.isfinite(eq.pressure_ratio):
        return f"$p/T_0 = {eq.pressure_ratio:.4g}$"
    return rf"$\alpha = {eq.alpha:.4g}$"


def title(eq: Equilibrium) -> str:
    """Return what is in the picture: numbers, state, law and how far to trust them."""
    lines = []
    if eq.rod is not None and not eq.rod.dimensionless:
        length = quantity(eq.length, "m")
        lines.append(rf"{load(eq)},  $\bar s$ = {length}")
    elif eq.rod is None:
        lines.append(rf"$\beta_0 = {eq.beta0:.5g}$,  $\beta_1 = {eq.beta1:.5g}$,  $\alpha = {eq.alpha:.5g}$")
    if math.isfinite(eq.pressure_ratio):
        lines.append(
            rf"$p/T_0 = {eq.pressure_ratio:.4g}$,  $\bar s/\eta = {eq.length_ratio:.4g}$,"
            rf"  $\eta/y_0 = {eq.ratio:.4g}$"
        )
    overhang = r" with overhang $|\theta| > 90^\circ$" if "overhang" in eq.flags else ""
    law = "no cohesive law" if eq.law == LINE.name else f"{eq.law} law"
    lines.append(f"{eq.state} state{overhang}, {law}; {trust(eq)}")
    return "\n".join(lines)


def trust(eq: Equilibrium) -> str:
    """Return the error of the answered number, and whether it is certified."""
    verdict = "certified" if eq.certified else "not certified"
    return f"{ANSWERS.get(eq.answered, eq.answered.replace('_', ' '))} {verdict}, error {_power(eq.error)}"


def _power(value: float) -> str:
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    mantissa, exponent = f"{value:.0e}".split("e")
    return rf"${mantissa}\times 10^{{{int(exponent)}}}$"


def warnings_of(flags: Iterable[str]) -> list[str]:
    """Return in words the flags that make a state unphysical."""
    return [typeset(FLAGS[flag]) for flag in flags if flag in DISQUALIFYING]


def typeset(words: str) -> str:
    """Return words with their formulae as mathematics, "fold in lambda" with a Greek letter."""

    def formula(found: re.Match[str]) -> str:
        text = found.group()
        for name, symbol in SYMBOLS.items():
            text = text.replace(name, symbol)
        return f"${text}$"

    return _FORMULA.sub(formula, words)


def symbol(attribute: str) -> str:
    """Return in letters what a number is written as that answers, by the attribute of an `Equilibrium`."""
    return plain(ANSWERS[attribute])


def plain(label: str) -> str:
    """Return a label in letters, for a pen that sets no mathematics."""
    for written, shown in _PLAIN:
        label = label.replace(written, shown)
    return label


def amount(rod: Rod | None, value: float, unit: str, own: str) -> str:
    """Return a number with its unit, or over the rod's own."""
    if rod is not None and not rod.dimensionless:
        return quantity(value, unit)
    symbols = own.replace("eta", r"\eta")
    return f"{value:.4g} ${symbols}$"
