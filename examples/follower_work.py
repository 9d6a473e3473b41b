"""A closed loop of shapes on which the pressure does work: its load has no potential.

A rod of fixed detached length is bent by hand through a closed loop of shapes, theta(s) =
a g1(s) + b g2(s) with (a, b) on a circle.  Bending energy and the work of separation come back
to where they were; the area swept by the free rod, and with it the work of the pressure, does
not.  So no energy of the shape alone tells which state is preferred under pressure.
"""

from __future__ import annotations

import numpy as np

STEPS, POINTS = 2000, 400


def swept_areas(slope: float = 0.6) -> tuple[float, float]:
    """Area swept in one turn over sbar^2: of the full loop, and of one retraced along a line."""
    s = (np.arange(POINTS) + 0.5) / POINTS
    g1, g2 = -((1.0 - s) ** 2), -((1.0 - s) ** 3)  # clamped at the edge s = 1
    turn = np.linspace(0.0, 2.0 * np.pi, STEPS + 1)

    def area(a: np.ndarray, b: np.ndarray) -> float:
        theta = a[:, None] * g1 + b[:, None] * g2
        # Middles of links at the edge's side first, then integrated towards the tip.
        x = -np.cumsum(np.cos(theta)[:, ::-1], axis=1)[:, ::-1] / POINTS
        y = -np.cumsum(np.sin(theta)[:, ::-1], axis=1)[:, ::-1] / POINTS
        middle = 0.5 * (theta[1:] + theta[:-1])
        work = -np.sin(middle) * np.diff(x, axis=0) + np.cos(middle) * np.diff(y, axis=0)
        return float(work.sum() / POINTS)

    full = area(slope * (1 + np.cos(turn)), slope * np.sin(turn))
    retraced = area(slope * (1 + np.cos(turn)), slope * (1 + np.cos(turn)))
    return full, retraced


def main() -> tuple[float, float]:
    """Return the two swept areas over sbar^2."""
    return swept_areas()


if __name__ == "__main__":
    full, retraced = main()
    print(f"area swept in one turn of the loop:   {full:+.6f} sbar^2")
    print(f"area swept there and back on a line:  {retraced:+.6f} sbar^2")
    print(f"work of a pressure p in one turn:     {full:+.6f} p sbar^2 per unit width, at no cost in energy")
