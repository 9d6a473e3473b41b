"""The picture of the README: shapes of an aortic flap, and the pressure that holds each length.

Usage: python examples/readme_figure.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import picture_file, plot_family, save_figure
from peel_opt.plots.style import family_colours

OWN = Path(__file__).parents[1] / "docs" / "img" / "readme.png"
SHOWN = (120e3, 90e3, 60e3, 45e3, 30e3)  # Pa, of the shapes drawn


def lowest_pressure(rod: po.Rod) -> float:
    """Return the lowest pressure [Pa] that holds an unfolded shape, as the error names it."""
    try:
        po.length_given_pressure(rod, 1e-6 * rod.adhesion_strength)
    except po.NoEquilibrium as error:
        return float(error.nearest)
    raise AssertionError("every pressure holds a shape")


def main(points: int = 48) -> tuple[Figure, list[po.Equilibrium]]:
    """Return the figure and the equilibria of its curve."""
    rod = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140.1e3, adhesion_range=0.73e-3)
    bottom = 1.002 * lowest_pressure(rod) / rod.adhesion_strength
    # Closer together towards the minimum, where the length runs away.
    ratios = bottom + (0.999 - bottom) * np.linspace(1.0, 0.0, points) ** 2
    curve = [po.length_given_pressure(rod, P * rod.adhesion_strength) for P in ratios]
    shown = [po.length_given_pressure(rod, p) for p in SHOWN]

    figure = Figure(figsize=(9.4, 3.7), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    plot_family(shown, left, legend=False)
    left.legend(loc="upper right", frameon=False, fontsize=9)
    left.set_title("Equilibrium shapes of an aortic media flap", fontsize=10, loc="left")

    lengths = np.array([eq.length for eq in curve]) * 1e3
    pressures = np.array([eq.pressure for eq in curve]) * 1e-3
    sure = np.array([eq.certified for eq in curve])
    right.plot(lengths, pressures, color="0.35", linewidth=1.2)
    right.plot(
        lengths[sure], pressures[sure], ".", color="0.35", markersize=5, label="certified to $10^{-8}$"
    )
    for eq, colour in zip(shown, family_colours(len(shown)), strict=True):
        right.plot(eq.length * 1e3, eq.pressure * 1e-3, "o", color=colour, markersize=8)
    right.plot(
        rod.critical_length * 1e3, rod.adhesion_strength * 1e-3, "kx", label=r"transition $T$, $p = T_0$"
    )
    right.set_xlabel(r"detached length $\bar s$ [mm]")
    right.set_ylabel("pressure $p$ [kPa]")
    right.set_ylim(bottom=0.0)
    right.spines[["top", "right"]].set_visible(False)
    right.legend(frameon=False, fontsize=9)
    right.set_title("Pressure that holds a detached length", fontsize=10, loc="left")
    return figure, curve


if __name__ == "__main__":
    path = picture_file(*(sys.argv[1:2] or [OWN]))
    picture, found = main()
    save_figure(picture, path, dpi=140)
    print(f"{path}: {sum(eq.certified for eq in found)} of {len(found)} points certified")
