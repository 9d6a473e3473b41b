"""A design chart from one sweep: the pressure that holds a detached length, for a family of tapes.

Usage: python examples/pressure_chart_sweep.py [--journal FILE] [PICTURE]

With a journal the sweep may be stopped at any moment; the same command goes on.
"""

from __future__ import annotations

import argparse

import numpy as np

import peel_opt as po
from peel_opt.plots import picture_file, save_figure

#: Transparent tape with adhesives of 0.3 to 0.8 MPa.
BACKING = {"bending_stiffness": 9.5e-6, "adhesion_range": 0.4e-3}  # k [N m], y0 [m]
STRENGTHS = np.linspace(0.3e6, 0.8e6, 21)  # T0 [Pa]
LENGTHS = np.linspace(0.85e-3, 1.3e-3, 19)  # [m]


def main(picture: str | None = None, journal: str | None = None, workers: int | None = None) -> po.Sweep:
    """Return the sweep, and draw it."""
    if picture is not None:
        picture_file(picture)
    axes = BACKING | {"adhesion_strength": STRENGTHS, "length": LENGTHS}
    chart = po.sweep(axes, journal=journal, workers=workers)
    if picture is not None:
        save_figure(chart.plot().figure, picture, dpi=100)
    return chart


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", nargs="?")
    parser.add_argument("--journal")
    arguments = parser.parse_args()
    found = main(arguments.picture, arguments.journal)
    print(found)
    for row in found.failures[:3]:
        print(f"T0 = {row['adhesion_strength']:.3g} Pa, sbar = {row['length']:.3g} m: {row['message']}")
