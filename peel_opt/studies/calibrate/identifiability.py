"""What data determine, and what they do not, in words.

The singular value decomposition of the weighted Jacobian in logarithms gives products of powers
k^a T0^b y0^c and how well each is known, independently of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

SYMBOLS = ("k", "T0", "y0")

#: Standard deviation of a logarithm from which a combination counts as not determined.
LOOSE = 0.5

#: Cosine of the angle from which a combination goes by a name.
SAME = 0.998

#: Products of powers that mean something, by their exponents (of k, T0, y0).
NAMED = {
    "the critical length pi (k y0/T0)^(1/4)": (0.25, -0.25, 0.25),
    "the elasto-adhesion length (k/T0)^(1/3)": (1.0 / 3.0, -1.0 / 3.0, 0.0),
    "the work of separation T0 y0/2": (0.0, 1.0, 1.0),
    "the ratio eta/y0": (1.0 / 3.0, -1.0 / 3.0, -1.0),
    "the length (k/(T0 y0))^(1/2)": (0.5, -0.5, -0.5),
}


@dataclass(frozen=True)
class Combination:
    """A product of powers of the material numbers, and how well the data know it.

    Parameters
    ----------
    exponents : tuple of float
        Of k, T0 and y0; the largest is 1 in size, or those of a named product.
    sd : float
        Standard deviation of its logarithm; infinite if the data say nothing.
    name : str
        What it is, if it is something.
    close : str
        What it is close to.
    """

    exponents: tuple[float, float, float]
    sd: float
    name: str = ""
    close: str = ""

    @property
    def determined(self) -> bool:
        """Whether it is known to better than a factor exp(0.5)."""
        return self.sd < LOOSE

    @property
    def formula(self) -> str:
        """Powers of the material numbers, such as "k^0.25 T0^-0.25 y0^0.25"."""
        powers = [(s, e) for s, e in zip(SYMBOLS, self.exponents, strict=True) if abs(e) > 0.005]
        return " ".join(s if abs(e - 1.0) < 0.005 else f"{s}^{e:.2g}" for s, e in powers)

    @property
    def precision(self) -> str:
        """How well it is known, in words."""
        if not math.isfinite(self.sd):
            return "not at all"
        if self.sd < 0.1:
            return f"to {100.0 * self.sd:.2g} %"
        return f"to a factor {math.exp(min(self.sd, 50.0)):.3g}"

    def __str__(self) -> str:
        return f"{self.words} ({self.precision})"

    @property
    def words(self) -> str:
        """Its name or its formula."""
        return self.name or f"{self.formula}{self.close}"


def combinations(jacobian: np.ndarray, free: np.ndarray) -> tuple[Combination, ...]:
    """Return independent combinations of the free material numbers, the best known first.

    Parameters
    ----------
    jacobian : ndarray, shape (rows, free)
        Residuals in standard deviations by logarithms.
    free : ndarray of bool, shape (3,)
    """
    _, s, vt = np.linalg.svd(jacobian, full_matrices=True)
    sizes = np.concatenate([s, np.zeros(len(vt) - len(s))])
    seen = sizes > 1e-10 * sizes.max(initial=0.0)
    sds = np.where(seen, 1.0 / np.where(seen, sizes, 1.0), math.inf)
    return tuple(_named(i, vt, sds, free) for i in range(len(vt)))


def _named(i: int, directions: np.ndarray, sds: np.ndarray, free: np.ndarray) -> Combination:
    """Scale a direction to a product with a name, or to a largest exponent of 1.

    ``sds`` belong to directions of length 1.
    """
    exponents, sd = np.zeros(3), float(sds[i])
    exponents[free] = directions[i]
    close = ""
    if free.sum() > 1:
        for name, powers in NAMED.items():
            target = np.where(free, powers, 0.0)
            # With numbers known, two names may leave the same direction: the whole one counts.
            if np.count_nonzero(target) != np.count_nonzero(powers):
                continue
            length = float(np.linalg.norm(target))
            shares = np.abs(directions @ target[free])
            shares[shares < 1e-12 * length] = 0.0
            own = float(np.linalg.norm(np.where(shares > 0.0, shares * sds, 0.0)))
            # A name is no better known than its share of what is not known lets it be.
            if shares[i] > SAME * length:
                if own < 1.5 * sd * length:
                    a, b, c = (float(v) for v in target)
                    return Combination((a, b, c), own, name)
                close = f", close to {name}"
    largest = exponents[np.argmax(np.abs(exponents))]
    a, b, c = (float(v) for v in exponents / largest)
    return Combination((a, b, c), sd / abs(float(largest)), close=close)


def undetermined_words(found: tuple[Combination, ...]) -> str:
    """Return the warning that some combination is not determined; empty if all are."""
    loose = [c for c in found if not c.determined]
    if not loose:
        return ""
    firm = [c for c in found if c.determined]
    known = f" They do determine {', '.join(map(str, firm))}." if firm else ""
    how = "not at all" if not math.isfinite(loose[-1].sd) else f"only {loose[-1].precision}"
    return (
        f"the data do not tell the free numbers apart: {loose[-1].words} is known {how}."
        f"{known} Fix a number that is known from elsewhere, or measure over a wider range of pressure."
    )
